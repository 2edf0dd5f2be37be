//! Carriage and friction as the settings hold them.

use serde::{Deserialize, Serialize};

/// The carriage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Carriage {
    /// Moving mass, kg.
    pub mass_kg: f32,
    /// Constant load against +x, N.
    pub external_force_n: f32,
}

/// The bristle and the friction levels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Friction {
    /// sigma0, N/m.
    pub bristle_stiffness_n_per_m: f32,
    /// sigma1, N s/m.
    pub bristle_damping_n_s_per_m: f32,
    /// v_s, m/s.
    pub stribeck_velocity_m_per_s: f32,
    /// FC, N.
    pub coulomb_n: f32,
    /// FS, N.
    pub static_n: f32,
    /// sigma2, N s/m.
    pub viscous_n_s_per_m: f32,
}

/// Additions to the friction levels; all nought is neutral.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrictionTerms {
    /// dFC, N.
    pub coulomb_n: f32,
    /// dFS above the Coulomb level, N.
    pub stribeck_n: f32,
    /// dsigma2, N s/m.
    pub viscous_n_s_per_m: f32,
    /// N per Pa of mean gauge pressure.
    pub per_mean_pressure_n_per_pa: f32,
    /// N per Pa of pressure difference.
    pub per_pressure_difference_n_per_pa: f32,
    /// N per Pa of mean gauge pressure by which FS grows more than FC.
    pub static_rise_per_mean_pressure_n_per_pa: f32,
    /// dFL against +x, N.
    pub constant_force_n: f32,
}
