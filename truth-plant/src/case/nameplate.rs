//! The true values of a rig, drawn, and the plant without any effect.

use std::collections::BTreeMap;

use crate::plant::Physics;
use crate::plant::friction::{Friction, Presliding};
use crate::plant::gas::{FlowShape, Leak, Node, PAPER_DISCHARGE};
use crate::plant::heat::Heat;
use crate::plant::mechanics::Mechanics;
use crate::plant::network::{Cylinder, Network, Supply};
use crate::plant::sensors::Sensors;
use crate::plant::valve::{AreaCurve, Areas, CommandPath, OPENINGS_V};
use crate::random::Random;

/// Constants of the seed paper's axis that all rigs share and know.
pub(crate) const STROKE_M: f64 = 0.5;
pub(crate) const BORE_M: f64 = 0.025;
pub(crate) const AREA_M2: f64 = 4.909e-4;
pub(crate) const LAMINAR_RATIO: f64 = 0.985;
pub(crate) const BRISTLE_STIFFNESS_N_M: f64 = 9.14e5;
pub(crate) const BRISTLE_DAMPING_NS_M: f64 = 1327.0;
pub(crate) const AMBIENT: Node = Node {
    pressure_pa: 101_325.0,
    temperature_k: 293.15,
};

/// Noise of the sensors at a multiplier of 1.
pub(crate) const PRESSURE_NOISE_PA: f64 = 250.0;
pub(crate) const POSITION_NOISE_M: f64 = 4e-6;
pub(crate) const SPEED_NOISE_M_S: f64 = 1.5e-3;

/// The values that differ from rig to rig.
#[derive(Clone, Debug)]
pub(crate) struct Nameplate {
    pub(crate) mass_kg: f64,
    pub(crate) dead_volume_m3: [f64; 2],
    pub(crate) supply_pa: f64,
    pub(crate) null_v: f64,
    pub(crate) curve: AreaCurve,
    pub(crate) asymmetry: f64,
    pub(crate) critical_ratio: f64,
    pub(crate) coulomb_n: f64,
    pub(crate) static_n: f64,
    pub(crate) viscous_n_s_per_m: f64,
    pub(crate) stribeck_m_per_s: f64,
    pub(crate) charging_w_per_m2_k: f64,
    pub(crate) discharging_w_per_m2_k: f64,
}

impl Nameplate {
    /// Ranges a third wider than those of the practice rigs.
    pub(crate) fn draw(random: &mut Random) -> Self {
        let coulomb_n = random.between(13.0, 38.0);
        Self {
            mass_kg: random.between(1.3, 5.0),
            dead_volume_m3: [
                random.between(13.5e-6, 38e-6),
                random.between(13.5e-6, 38e-6),
            ],
            supply_pa: random.between(600e3, 780e3),
            null_v: random.between(4.86, 5.12),
            curve: AreaCurve {
                overlap_v: random.between(0.165, 0.34),
                largest_m2: random.between(14e-6, 20e-6),
                leak_m2: random.between(0.05e-6, 0.13e-6),
                shape: random.between(1.05, 1.45),
                span_v: random.between(2.85, 3.15),
            },
            asymmetry: random.between(0.88, 1.15),
            critical_ratio: random.between(0.25, 0.39),
            coulomb_n,
            static_n: coulomb_n * random.between(1.25, 1.6),
            viscous_n_s_per_m: random.between(40.0, 100.0),
            stribeck_m_per_s: random.between(0.0037, 0.0097),
            charging_w_per_m2_k: random.between(33.0, 66.0),
            discharging_w_per_m2_k: random.between(12.0, 29.0),
        }
    }

    /// The plant that the rig file's laws describe completely.
    pub(crate) fn physics(&self, noise: f64) -> Physics {
        Physics {
            command: CommandPath::default(),
            areas: Areas {
                null_v: self.null_v,
                openings_v: OPENINGS_V.to_vec(),
                supply_m2: self.curve.table_m2().to_vec(),
                asymmetry: self.asymmetry,
                exhaust_late_v: 0.0,
            },
            network: self.network(),
            mechanics: self.mechanics(),
            sensors: Sensors {
                pressure_lag_s: 0.0,
                second_pressure_lag_s: 0.0,
                pressure_offset_pa: [0.0; 2],
                pressure_gain: [1.0; 2],
                position_gain: 1.0,
                position_late_s: 0.0,
                position_wave_m: [0.0, 1.0],
                pressure_noise_pa: noise * PRESSURE_NOISE_PA,
                position_noise_m: noise * POSITION_NOISE_M,
                speed_noise_m_per_s: noise * SPEED_NOISE_M_S,
            },
        }
    }

    fn network(&self) -> Network {
        Network {
            ambient: AMBIENT,
            supply: Supply {
                pressure_pa: self.supply_pa,
                tank: None,
                ripple: 0.0,
                ripple_hz: 0.0,
            },
            silencer: None,
            flow: FlowShape {
                critical_ratio: self.critical_ratio,
                laminar_ratio: LAMINAR_RATIO,
                discharge: PAPER_DISCHARGE,
            },
            area_by_temperature: 0.0,
            line: None,
            cylinder: Cylinder {
                stroke_m: STROKE_M,
                bore_m: BORE_M,
                area_m2: [AREA_M2; 2],
                dead_volume_m3: self.dead_volume_m3,
            },
            cushion: None,
            throttle_m2: [None; 2],
            piston_leak: Leak::default(),
            chamber_leak: [Leak::default(); 2],
            heat: Heat {
                charging_w_per_m2_k: self.charging_w_per_m2_k,
                discharging_w_per_m2_k: self.discharging_w_per_m2_k,
                per_flow_w_per_m2_k: 0.0,
                density_exponent: 0.0,
                eichelberg_exponent: 0.0,
            },
            wall: None,
        }
    }

    fn mechanics(&self) -> Mechanics {
        Mechanics {
            mass_kg: self.mass_kg,
            friction: Friction {
                presliding: Presliding::LuGre,
                stiffness_n_per_m: BRISTLE_STIFFNESS_N_M,
                damping_n_s_per_m: BRISTLE_DAMPING_NS_M,
                viscous_n_s_per_m: self.viscous_n_s_per_m,
                quadratic_n_s2_per_m2: 0.0,
                coulomb_n: self.coulomb_n,
                static_n: self.static_n,
                stribeck_m_per_s: self.stribeck_m_per_s,
                per_mean_pressure_n_per_pa: 0.0,
                per_difference_n_per_pa: 0.0,
                mean_pressure_exponent: 1.0,
                asymmetry: 0.0,
                wave: None,
                zone: None,
                dwell: None,
            },
            constant_n: 0.0,
            load: None,
            cable: None,
            spring: None,
            cogging: None,
            drift_n_per_s: 0.0,
            disturbance: None,
            half_stroke_m: 0.5 * STROKE_M,
        }
    }
}

impl Nameplate {
    /// The true values under the names that the practice rigs' `truth.json`
    /// has, as the effects leave them.
    pub(crate) fn named_values(&self, physics: &Physics) -> BTreeMap<String, f64> {
        let network = &physics.network;
        [
            ("thermal", 1.0),
            ("M", self.mass_kg),
            ("V0a", self.dead_volume_m3[0]),
            ("V0b", self.dead_volume_m3[1]),
            ("ps", self.supply_pa),
            ("null", self.null_v),
            ("ovl", self.curve.overlap_v),
            ("Amax", self.curve.largest_m2),
            ("Aleak", self.curve.leak_m2),
            ("asym", self.asymmetry),
            ("shape", self.curve.shape),
            ("span", self.curve.span_v),
            ("FC", self.coulomb_n),
            ("FS", self.static_n),
            ("s2", self.viscous_n_s_per_m),
            ("vs", self.stribeck_m_per_s),
            ("hc", network.heat.charging_w_per_m2_k),
            ("hd", network.heat.discharging_w_per_m2_k),
            ("b", self.critical_ratio),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into()
    }
}
