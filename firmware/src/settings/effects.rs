//! Left-out physics of gas and carriage among the settings: what it is, its ranges,
//! and both ways between it and the laws.
//!
//! The neutral numbers switch an effect off exactly, as in the laws themselves. What
//! an effect means stands at its law in [`model_core::left_out`]. Effects of the
//! command's path, of the tube, of one chamber and of the friction levels stand in
//! those sections. Effects of a sensor or a recording are none of the controller's.

use super::field::{Fields, Range, Rows, SettingsFault, fields};
use super::mechanics::{Carriage, Friction, FrictionTerms};
use crate::codes::POSITION_M;
use model_core::axis::Pneumatics;
use model_core::carriage::CarriageEffects;
use model_core::left_out::{
    DirectionDependentFriction, DwellStiction, ElasticBuffer, EndCushion, ExhaustBackPressure,
    ForceEquation, ForceVariable, FrictionZone, KNOTS, LoadCoupling, PistonLeakage, PortThrottle,
    PositionDependentFriction, SupplyDroop, UnknownForce, VariableHeatTransfer, WallTemperature,
};
use serde::{Deserialize, Serialize};

/// What the model leaves out of the gas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PneumaticEffects {
    /// Leak past the piston through a gap, kg/(s Pa2).
    pub piston_leak_laminar_kg_per_s_pa2: f32,
    /// Leak past the piston through an orifice, m2.
    pub piston_leak_orifice_m2: f32,
    /// Tank between regulator and valve, m3; 0 is none.
    pub tank_volume_m3: f32,
    /// Orifice between regulator and tank, m2.
    pub feed_area_m2: f32,
    /// Silencer behind the exhaust paths, m2; 0 is none.
    pub silencer_area_m2: f32,
    /// Volume between valve and silencer, m3.
    pub silencer_volume_m3: f32,
    /// Whether each exhaust path has a silencer of its own.
    pub separate_exhausts: bool,
    /// Length of the cushions, m; 0 is none.
    pub cushion_length_m: f32,
    /// Needle of the cushions, m2.
    pub cushion_needle_m2: f32,
    /// One-way flow control through which chamber a empties, m2; 0 is none.
    pub throttle_a_m2: f32,
    /// The same of chamber b, m2.
    pub throttle_b_m2: f32,
    /// Exponent of the density in the heat transfer.
    pub heat_density_exponent: f32,
    /// Heat transfer by the flow, W/(m2 K).
    pub heat_flow_w_per_m2_k: f32,
    /// Wall over the surroundings, K.
    pub wall_offset_k: f32,
    /// Heat capacity of a chamber's wall, J/K; 0 holds its temperature.
    pub wall_heat_capacity_j_per_k: f32,
    /// From the wall to the surroundings, W/K.
    pub wall_outer_w_per_k: f32,
}

/// What the model leaves out of the carriage's motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MechanicalEffects {
    /// Friction over the position: share of the cosine.
    pub position_cosine: f32,
    /// Share of the sine.
    pub position_sine: f32,
    /// Wavelength of both, m.
    pub position_wavelength_m: f32,
    /// Trend of the share, 1/m.
    pub position_slope_per_m: f32,
    /// Curvature of the share, 1/m2.
    pub position_curvature_per_m2: f32,
    /// Share of the friction in one zone.
    pub zone_share: f32,
    /// Middle of the zone, m.
    pub zone_middle_m: f32,
    /// Length of the zone, m.
    pub zone_length_m: f32,
    /// Friction by direction: share of the dry levels.
    pub direction_asymmetry: f32,
    /// Share of the viscous coefficient.
    pub direction_viscous_asymmetry: f32,
    /// Growth of stiction by standing, N.
    pub dwell_rise_n: f32,
    /// Time constant of the growth, s.
    pub dwell_time_constant_s: f32,
    /// Way over which the growth is forgotten, m.
    pub dwell_forgetting_way_m: f32,
    /// Part of the moving mass that hangs behind a spring, kg; 0 is none.
    pub load_mass_kg: f32,
    /// Stiffness of the spring, N/m.
    pub load_stiffness_n_per_m: f32,
    /// Damping beside the spring, N s/m.
    pub load_damping_n_s_per_m: f32,
    /// Play of the spring, m.
    pub load_gap_m: f32,
    /// Position at which the lower buffer begins, m.
    pub buffer_low_m: f32,
    /// Position at which the upper buffer begins, m.
    pub buffer_high_m: f32,
    /// Stiffness of the buffers, N/m; 0 is none.
    pub buffer_stiffness_n_per_m: f32,
    /// Damping of the buffers, N s/m.
    pub buffer_damping_n_s_per_m: f32,
    /// Whether the force without a law is one of the velocity, and not of the position.
    pub unknown_force_of_velocity: bool,
    /// The first knot of its table, m or m/s.
    pub unknown_force_from: f32,
    /// The last one.
    pub unknown_force_to: f32,
    /// Its values, N.
    pub unknown_force_n: [f32; KNOTS],
    /// Force equation: stiffness of a spring, N/m.
    pub spring_n_per_m: f32,
    /// Stiffness that grows with the square of the way, N/m3.
    pub stiffening_n_per_m3: f32,
    /// Position at which the spring pushes nothing, m.
    pub spring_rest_m: f32,
    /// Drag per square of the speed, N s2/m2.
    pub drag_n_s2_per_m2: f32,
    /// Sine part of a force that repeats along the way, N.
    pub pitch_sine_n: f32,
    /// Cosine part, N.
    pub pitch_cosine_n: f32,
    /// Way after which it repeats, m.
    pub pitch_m: f32,
    /// Force that trails behind the motion, N.
    pub trailing_n: f32,
    /// Way in which it turns over, m.
    pub trailing_path_m: f32,
}

/// Share of the moving mass that a load behind a spring may have: the law would
/// take no more of it, in silence.
const MOST_LOAD_SHARE: f32 = 0.95;
/// Shortest reach of a table, m or m/s: the law divides by it.
const LEAST_TABLE: f32 = 1e-3;

impl PneumaticEffects {
    /// None.
    pub fn neutral() -> Self {
        let (droop, exhaust) = (SupplyDroop::neutral(), ExhaustBackPressure::neutral());
        let cushion = EndCushion::neutral();
        Self {
            piston_leak_laminar_kg_per_s_pa2: 0.0,
            piston_leak_orifice_m2: 0.0,
            tank_volume_m3: droop.tank_volume_m3,
            feed_area_m2: droop.feed_area_m2,
            silencer_area_m2: exhaust.silencer_area_m2,
            silencer_volume_m3: exhaust.volume_m3,
            separate_exhausts: false,
            cushion_length_m: cushion.length_m,
            cushion_needle_m2: cushion.needle_area_m2,
            throttle_a_m2: 0.0,
            throttle_b_m2: 0.0,
            heat_density_exponent: 0.0,
            heat_flow_w_per_m2_k: 0.0,
            wall_offset_k: 0.0,
            wall_heat_capacity_j_per_k: 0.0,
            wall_outer_w_per_k: 0.0,
        }
    }

    /// Every number with its range.
    #[rustfmt::skip]
    pub(super) fn fields(&self) -> Fields<15> {
        fields![
            field(
                "pneumatic_effects.piston_leak_laminar_kg_per_s_pa2",
                self.piston_leak_laminar_kg_per_s_pa2, 0.0, 1e-9,
            ),
            field("pneumatic_effects.piston_leak_orifice_m2", self.piston_leak_orifice_m2, 0.0, 1e-3),
            or_none("pneumatic_effects.tank_volume_m3", self.tank_volume_m3, 1e-12, 10.0),
            field("pneumatic_effects.feed_area_m2", self.feed_area_m2, 0.0, 0.1),
            or_none("pneumatic_effects.silencer_area_m2", self.silencer_area_m2, 1e-9, 0.1),
            field("pneumatic_effects.silencer_volume_m3", self.silencer_volume_m3, 0.0, 1.0),
            or_none("pneumatic_effects.cushion_length_m", self.cushion_length_m, 1e-5, 2.0),
            field("pneumatic_effects.cushion_needle_m2", self.cushion_needle_m2, 1e-9, 0.1),
            or_none("pneumatic_effects.throttle_a_m2", self.throttle_a_m2, 1e-9, 0.1),
            or_none("pneumatic_effects.throttle_b_m2", self.throttle_b_m2, 1e-9, 0.1),
            field("pneumatic_effects.heat_density_exponent", self.heat_density_exponent, 0.0, 4.0),
            field("pneumatic_effects.heat_flow_w_per_m2_k", self.heat_flow_w_per_m2_k, 0.0, 1e5),
            field("pneumatic_effects.wall_offset_k", self.wall_offset_k, -100.0, 300.0),
            field(
                "pneumatic_effects.wall_heat_capacity_j_per_k",
                self.wall_heat_capacity_j_per_k, 0.0, 1e6,
            ),
            field("pneumatic_effects.wall_outer_w_per_k", self.wall_outer_w_per_k, 0.0, 1e6),
        ]
    }

    pub(super) fn piston_leak(&self) -> PistonLeakage<f32> {
        PistonLeakage {
            laminar_kg_per_s_pa2: self.piston_leak_laminar_kg_per_s_pa2,
            orifice_area_m2: self.piston_leak_orifice_m2,
        }
    }

    pub(super) fn supply_droop(&self) -> SupplyDroop<f32> {
        SupplyDroop {
            tank_volume_m3: self.tank_volume_m3,
            feed_area_m2: self.feed_area_m2,
        }
    }

    pub(super) fn back_pressure(&self) -> ExhaustBackPressure<f32> {
        ExhaustBackPressure {
            silencer_area_m2: self.silencer_area_m2,
            volume_m3: self.silencer_volume_m3,
        }
    }

    pub(super) fn cushion(&self) -> EndCushion<f32> {
        EndCushion {
            length_m: self.cushion_length_m,
            needle_area_m2: self.cushion_needle_m2,
        }
    }

    /// Those of both chambers.
    pub(super) fn throttles(&self) -> [PortThrottle<f32>; 2] {
        [self.throttle_a_m2, self.throttle_b_m2]
            .map(|outlet_area_m2| PortThrottle { outlet_area_m2 })
    }

    pub(super) fn heat_variation(&self) -> VariableHeatTransfer<f32> {
        VariableHeatTransfer {
            density_exponent: self.heat_density_exponent,
            flow_w_per_m2_k: self.heat_flow_w_per_m2_k,
        }
    }

    pub(super) fn wall(&self) -> WallTemperature<f32> {
        WallTemperature {
            offset_k: self.wall_offset_k,
            heat_capacity_j_per_k: self.wall_heat_capacity_j_per_k,
            outer_w_per_k: self.wall_outer_w_per_k,
        }
    }
}

impl From<&Pneumatics<f32>> for PneumaticEffects {
    /// Heat transfer and wall are those of chamber a: both have the same.
    fn from(pneumatics: &Pneumatics<f32>) -> Self {
        let chamber = &pneumatics.chamber_a;
        Self {
            piston_leak_laminar_kg_per_s_pa2: pneumatics.piston_leak.laminar_kg_per_s_pa2,
            piston_leak_orifice_m2: pneumatics.piston_leak.orifice_area_m2,
            tank_volume_m3: pneumatics.supply_droop.tank_volume_m3,
            feed_area_m2: pneumatics.supply_droop.feed_area_m2,
            silencer_area_m2: pneumatics.back_pressure.silencer_area_m2,
            silencer_volume_m3: pneumatics.back_pressure.volume_m3,
            separate_exhausts: pneumatics.separate_exhausts,
            cushion_length_m: pneumatics.cushion.length_m,
            cushion_needle_m2: pneumatics.cushion.needle_area_m2,
            throttle_a_m2: pneumatics.throttle_a.outlet_area_m2,
            throttle_b_m2: pneumatics.throttle_b.outlet_area_m2,
            heat_density_exponent: chamber.heat_variation.density_exponent,
            heat_flow_w_per_m2_k: chamber.heat_variation.flow_w_per_m2_k,
            wall_offset_k: chamber.wall.offset_k,
            wall_heat_capacity_j_per_k: chamber.wall.heat_capacity_j_per_k,
            wall_outer_w_per_k: chamber.wall.outer_w_per_k,
        }
    }
}

impl MechanicalEffects {
    /// None.
    pub fn neutral() -> Self {
        CarriageEffects::neutral().into()
    }

    /// Every number but the knots with its range.
    #[rustfmt::skip]
    pub(super) fn fields(&self) -> Fields<32> {
        const FARTHEST_M: f32 = POSITION_M.highest;
        fields![
            field("mechanical_effects.position_cosine", self.position_cosine, -10.0, 10.0),
            field("mechanical_effects.position_sine", self.position_sine, -10.0, 10.0),
            field("mechanical_effects.position_wavelength_m", self.position_wavelength_m, 1e-3, 100.0),
            field("mechanical_effects.position_slope_per_m", self.position_slope_per_m, -1e3, 1e3),
            field(
                "mechanical_effects.position_curvature_per_m2",
                self.position_curvature_per_m2, -1e4, 1e4,
            ),
            field("mechanical_effects.zone_share", self.zone_share, -0.95, 100.0),
            field("mechanical_effects.zone_middle_m", self.zone_middle_m, -FARTHEST_M, FARTHEST_M),
            field("mechanical_effects.zone_length_m", self.zone_length_m, 1e-3, 100.0),
            field("mechanical_effects.direction_asymmetry", self.direction_asymmetry, -0.95, 0.95),
            field(
                "mechanical_effects.direction_viscous_asymmetry",
                self.direction_viscous_asymmetry, -0.95, 0.95,
            ),
            field("mechanical_effects.dwell_rise_n", self.dwell_rise_n, -1e5, 1e5),
            field("mechanical_effects.dwell_time_constant_s", self.dwell_time_constant_s, 1e-3, 1e6),
            field("mechanical_effects.dwell_forgetting_way_m", self.dwell_forgetting_way_m, 1e-6, 10.0),
            or_none("mechanical_effects.load_mass_kg", self.load_mass_kg, 1e-4, 1e4),
            or_none("mechanical_effects.load_stiffness_n_per_m", self.load_stiffness_n_per_m, 1e-2, 1e10),
            field("mechanical_effects.load_damping_n_s_per_m", self.load_damping_n_s_per_m, 0.0, 1e7),
            field("mechanical_effects.load_gap_m", self.load_gap_m, 0.0, 0.1),
            field("mechanical_effects.buffer_low_m", self.buffer_low_m, -FARTHEST_M, FARTHEST_M),
            field("mechanical_effects.buffer_high_m", self.buffer_high_m, -FARTHEST_M, FARTHEST_M),
            or_none("mechanical_effects.buffer_stiffness_n_per_m", self.buffer_stiffness_n_per_m, 1e-2, 1e10),
            field("mechanical_effects.buffer_damping_n_s_per_m", self.buffer_damping_n_s_per_m, 0.0, 1e7),
            field("mechanical_effects.unknown_force_from", self.unknown_force_from, -100.0, 100.0),
            field("mechanical_effects.unknown_force_to", self.unknown_force_to, -100.0, 100.0),
            field("mechanical_effects.spring_n_per_m", self.spring_n_per_m, -1e4, 1e4),
            field("mechanical_effects.stiffening_n_per_m3", self.stiffening_n_per_m3, -1e6, 1e6),
            field("mechanical_effects.spring_rest_m", self.spring_rest_m, -10.0, 10.0),
            field("mechanical_effects.drag_n_s2_per_m2", self.drag_n_s2_per_m2, 0.0, 1e3),
            field("mechanical_effects.pitch_sine_n", self.pitch_sine_n, -200.0, 200.0),
            field("mechanical_effects.pitch_cosine_n", self.pitch_cosine_n, -200.0, 200.0),
            field("mechanical_effects.pitch_m", self.pitch_m, 1e-3, 100.0),
            field("mechanical_effects.trailing_n", self.trailing_n, -500.0, 500.0),
            field("mechanical_effects.trailing_path_m", self.trailing_path_m, 1e-3, 10.0),
        ]
    }

    /// The force without a law at its knots.
    pub(super) fn knots(&self) -> Rows<'_> {
        const RANGES: [Range; 1] = [Range::field(
            "mechanical_effects.unknown_force_n",
            -1e5,
            1e5,
        )];
        Rows {
            ranges: &RANGES,
            values: &self.unknown_force_n,
        }
    }

    /// What the declared mass and friction allow.
    pub(super) fn check_with(
        &self,
        carriage: &Carriage,
        friction: &Friction,
        terms: &FrictionTerms,
    ) -> Result<(), SettingsFault> {
        let fault = |name, problem| Err(SettingsFault::Contradiction(name, problem));
        if self.load_mass_kg > MOST_LOAD_SHARE * carriage.mass_kg {
            return fault(
                "mechanical_effects.load_mass_kg",
                "expected at most 95 % of the moving mass, of which it is a part",
            );
        }
        let static_n = friction.static_n + terms.coulomb_n + terms.stribeck_n;
        if static_n + self.dwell_rise_n < 0.0 {
            return fault(
                "mechanical_effects.dwell_rise_n",
                "takes away more than the static friction",
            );
        }
        if self.unknown_force_to - self.unknown_force_from < LEAST_TABLE {
            return fault(
                "mechanical_effects.unknown_force_to",
                "expected the last knot beyond the first",
            );
        }
        if !self.effects().elastic_buffer.is_neutral() && self.buffer_low_m > self.buffer_high_m {
            return fault(
                "mechanical_effects.buffer_low_m",
                "expected below the position at which the upper buffer begins",
            );
        }
        Ok(())
    }

    /// The laws; `None` while all are neutral.
    pub(super) fn if_any(&self) -> Option<CarriageEffects<f32>> {
        self.effects().if_any()
    }

    fn effects(&self) -> CarriageEffects<f32> {
        CarriageEffects {
            position_friction: PositionDependentFriction {
                cosine: self.position_cosine,
                sine: self.position_sine,
                wavelength_m: self.position_wavelength_m,
                slope_per_m: self.position_slope_per_m,
                curvature_per_m2: self.position_curvature_per_m2,
                zone: FrictionZone {
                    share: self.zone_share,
                    middle_m: self.zone_middle_m,
                    length_m: self.zone_length_m,
                },
            },
            direction_friction: DirectionDependentFriction {
                asymmetry: self.direction_asymmetry,
                viscous_asymmetry: self.direction_viscous_asymmetry,
            },
            dwell_stiction: DwellStiction {
                rise_n: self.dwell_rise_n,
                time_constant_s: self.dwell_time_constant_s,
                forgetting_way_m: self.dwell_forgetting_way_m,
            },
            load: LoadCoupling {
                load_mass_kg: self.load_mass_kg,
                stiffness_n_per_m: self.load_stiffness_n_per_m,
                damping_n_s_per_m: self.load_damping_n_s_per_m,
                gap_m: self.load_gap_m,
            },
            elastic_buffer: ElasticBuffer {
                low_m: self.buffer_low_m,
                high_m: self.buffer_high_m,
                stiffness_n_per_m: self.buffer_stiffness_n_per_m,
                damping_n_s_per_m: self.buffer_damping_n_s_per_m,
            },
            unknown_force: UnknownForce {
                over: if self.unknown_force_of_velocity {
                    ForceVariable::Velocity
                } else {
                    ForceVariable::Position
                },
                from: self.unknown_force_from,
                to: self.unknown_force_to,
                at_knot_n: self.unknown_force_n,
            },
            force_equation: ForceEquation {
                spring_n_per_m: self.spring_n_per_m,
                stiffening_n_per_m3: self.stiffening_n_per_m3,
                rest_m: self.spring_rest_m,
                drag_n_s2_per_m2: self.drag_n_s2_per_m2,
                sine_n: self.pitch_sine_n,
                cosine_n: self.pitch_cosine_n,
                pitch_m: self.pitch_m,
                trailing_n: self.trailing_n,
                path_m: self.trailing_path_m,
            },
        }
    }
}

impl From<CarriageEffects<f32>> for MechanicalEffects {
    fn from(effects: CarriageEffects<f32>) -> Self {
        let position = &effects.position_friction;
        let (load, buffer) = (&effects.load, &effects.elastic_buffer);
        let (unknown, equation) = (&effects.unknown_force, &effects.force_equation);
        Self {
            position_cosine: position.cosine,
            position_sine: position.sine,
            position_wavelength_m: position.wavelength_m,
            position_slope_per_m: position.slope_per_m,
            position_curvature_per_m2: position.curvature_per_m2,
            zone_share: position.zone.share,
            zone_middle_m: position.zone.middle_m,
            zone_length_m: position.zone.length_m,
            direction_asymmetry: effects.direction_friction.asymmetry,
            direction_viscous_asymmetry: effects.direction_friction.viscous_asymmetry,
            dwell_rise_n: effects.dwell_stiction.rise_n,
            dwell_time_constant_s: effects.dwell_stiction.time_constant_s,
            dwell_forgetting_way_m: effects.dwell_stiction.forgetting_way_m,
            load_mass_kg: load.load_mass_kg,
            load_stiffness_n_per_m: load.stiffness_n_per_m,
            load_damping_n_s_per_m: load.damping_n_s_per_m,
            load_gap_m: load.gap_m,
            buffer_low_m: buffer.low_m,
            buffer_high_m: buffer.high_m,
            buffer_stiffness_n_per_m: buffer.stiffness_n_per_m,
            buffer_damping_n_s_per_m: buffer.damping_n_s_per_m,
            unknown_force_of_velocity: unknown.over == ForceVariable::Velocity,
            unknown_force_from: unknown.from,
            unknown_force_to: unknown.to,
            unknown_force_n: unknown.at_knot_n,
            spring_n_per_m: equation.spring_n_per_m,
            stiffening_n_per_m3: equation.stiffening_n_per_m3,
            spring_rest_m: equation.rest_m,
            drag_n_s2_per_m2: equation.drag_n_s2_per_m2,
            pitch_sine_n: equation.sine_n,
            pitch_cosine_n: equation.cosine_n,
            pitch_m: equation.pitch_m,
            trailing_n: equation.trailing_n,
            trailing_path_m: equation.path_m,
        }
    }
}
