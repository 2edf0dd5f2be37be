//! From a rig's numbers to the laws of `model-core`, in any scalar.
//!
//! The only place that knows which key of the rig file (or of an effect) feeds
//! which parameter. Structure comes from the [`Rig`], numbers from [`Values`]:
//! the rig's own, some of them replaced by those a fit is trying.

use crate::effects;
use crate::rig::{ChamberModel, Exhausts, FeedsAWhen, PositionZero, Rig, STANDARD_PRESSURE_PA};
use crate::units::STANDARD_GRAVITY_M_S2;
use model_core::axis::{Axis, CommandPath, Pneumatics};
use model_core::carriage::Carriage;
use model_core::chamber::{Chamber, ChamberGeometry, ThermalModel};
use model_core::friction::{Bristle, FrictionLevels};
use model_core::gas::Gas;
use model_core::left_out::{
    CarriageEffects, ChamberLeakage, DirectionDependentFriction, DwellStiction, ElasticBuffer,
    EndCushion, ExhaustBackPressure, FORGETTING_WAY_M, ForceVariable, FrictionTerms, KNOTS,
    LoadCoupling, PistonLeakage, PositionDependentFriction, SlewLimit, SpoolDynamics, SupplyDroop,
    TubeLine, UnknownForce, ValveDelay, ValveHysteresis, VariableHeatTransfer, WallTemperature,
    knots, over_knots,
};
use model_core::paper;
use model_core::real::Real;
use model_core::valve::{AreaTable, FlowLaw, GasState, TABLE_CAPACITY, TableFault, Valve};

/// Key of the force at a knot of an unknown force's table.
pub fn force_key(knot: usize) -> String {
    format!("force_{knot}_N")
}

/// Key of the shift at a knot of an unknown opening's table.
pub fn shift_key(knot: usize) -> String {
    format!("shift_{knot}_V")
}

/// Where the knots of an unknown opening's table lie, V: evenly over the opening's root, as most
/// commands open a little and few altogether.
pub fn opening_knots<R: Real>(from: R, to: R) -> [R; KNOTS] {
    knots(from.sqrt(), to.sqrt()).map(|root| root * root)
}

/// Which chamber.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// Chamber a, which +x enlarges.
    A,
    /// Chamber b.
    B,
}

impl Side {
    /// Both.
    pub const BOTH: [Self; 2] = [Self::A, Self::B];

    /// "a" or "b", as in keys and signals.
    pub fn letter(self) -> char {
        match self {
            Self::A => 'a',
            Self::B => 'b',
        }
    }

    /// The pressure signal's name.
    pub fn pressure_signal(self) -> &'static str {
        match self {
            Self::A => "p_a",
            Self::B => "p_b",
        }
    }

    /// The place of its gauge in a verdict.
    pub fn gauge_place(self) -> &'static str {
        match self {
            Self::A => "sensor.p_a",
            Self::B => "sensor.p_b",
        }
    }

    /// The place in a verdict.
    pub fn place(self) -> &'static str {
        match self {
            Self::A => "chamber-a",
            Self::B => "chamber-b",
        }
    }
}

/// Why a rig is no whole axis: the key to add or to change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AxisFault {
    /// The section or `section.key`.
    pub key: String,
    /// What is wrong with it.
    pub problem: String,
    /// What should stand there.
    pub expected: String,
}

impl AxisFault {
    /// A key or a section that the rig does not have.
    pub fn missing(key: &str) -> Self {
        let what = if key.contains('.') {
            "a value"
        } else {
            "the section"
        };
        Self {
            key: key.into(),
            problem: "missing".into(),
            expected: format!("{what}, as a whole axis needs it"),
        }
    }
}

/// What a rig must say before its whole axis can be built; [`Values::valve`]
/// and the thermal model need their sections besides.
const AXIS_KEYS: &[&str] = &[
    "supply.pressure_Pa",
    "cylinder.stroke_m",
    "cylinder.area_a_m2",
    "cylinder.area_b_m2",
    "cylinder.dead_volume_a_m3",
    "cylinder.dead_volume_b_m3",
    "carriage.mass_kg",
];

/// A rig's numbers, some replaced.
#[derive(Clone, Copy, Debug)]
pub struct Values<'a, R> {
    /// Structure and numbers.
    pub rig: &'a Rig,
    /// Keys of the replaced numbers.
    pub keys: &'a [String],
    /// What they are replaced by, in the order of `keys`.
    pub replaced: &'a [R],
}

impl<'a> Values<'a, f64> {
    /// The rig's numbers, none replaced.
    pub fn of(rig: &'a Rig) -> Self {
        Self {
            rig,
            keys: &[],
            replaced: &[],
        }
    }
}

impl<R: Real> Values<'_, R> {
    /// The number at `section.key`, if the rig or a replacement has it.
    pub fn get(&self, key: &str) -> Option<R> {
        match self.keys.iter().position(|candidate| candidate == key) {
            Some(index) => self.replaced.get(index).copied(),
            None => self.rig.value(key).map(R::from_f64),
        }
    }

    /// The same, or a default.
    pub fn get_or(&self, key: &str, default: f64) -> R {
        self.get(key).unwrap_or_else(|| R::from_f64(default))
    }

    /// An effect's parameter; `neutral` where the effect is not modelled.
    pub fn effect(&self, effect: &str, parameter: &str, neutral: f64) -> R {
        debug_assert!(
            effects::is_catalogued(effect, parameter, neutral),
            "{effect}.{parameter} = {neutral} is not so in the catalogue"
        );
        self.get_or(&format!("effects.{effect}.{parameter}"), neutral)
    }

    /// Whether an effect has any parameter, if perhaps a neutral one.
    pub fn holds(&self, effect: &str) -> bool {
        let of_effect = |key: &String| {
            let key = key.strip_prefix("effects.");
            let key = key.and_then(|key| key.strip_prefix(effect));
            key.is_some_and(|parameter| parameter.starts_with('.'))
        };
        self.rig.effects.contains_key(effect) || self.keys.iter().any(of_effect)
    }

    /// The gas; air where the rig says nothing.
    pub fn gas(&self) -> Gas<R> {
        Gas::new(
            self.get_or("gas.gamma", 1.4),
            self.get_or("gas.gas_constant_J_kgK", 287.0),
        )
    }

    /// The surroundings; the standard atmosphere where the rig says nothing.
    pub fn ambient(&self) -> GasState<R> {
        GasState {
            pressure_pa: self.get_or("environment.pressure_Pa", STANDARD_PRESSURE_PA),
            temperature_k: self.get_or("environment.temperature_K", paper::AMBIENT_TEMPERATURE_K),
        }
    }

    fn flow_law(&self) -> FlowLaw<R> {
        FlowLaw {
            critical_pressure_ratio: self.get_or(
                "valve.critical_pressure_ratio",
                paper::CRITICAL_PRESSURE_RATIO,
            ),
            laminar_pressure_ratio: self.get_or(
                "valve.laminar_pressure_ratio",
                paper::LAMINAR_PRESSURE_RATIO,
            ),
            discharge_slope: self.get_or("valve.discharge_slope", paper::DISCHARGE_SLOPE),
            flow_coefficient: self.gas().flow_coefficient,
        }
    }

    /// The valve, where the rig has one.
    pub fn valve(&self) -> Option<Result<Valve<R>, TableFault>> {
        let valve = self.rig.valve.as_ref()?;
        let shift = self.shift_of_openings();
        let stretch = self.get_or("valve.opening_V", 1.0);
        let edge_v = self.get("valve.edge_V");
        let exhaust_later_v = self.get_or("valve.exhaust_shift_V", 0.0) / stretch;
        let roundness = self.get_or("valve.curve_roundness", 0.0);
        let table = |areas: &[f64], scale: &str, later_v: R| {
            let mut table = AreaTable::new(&valve.opening_v, areas)?;
            if let Some((from, to, shifts_v)) = shift {
                let off_by_v =
                    |opening_v: R| over_knots(from.sqrt(), to.sqrt(), &shifts_v, opening_v.sqrt());
                table.open_elsewhere(&opening_knots(from, to), off_by_v);
            }
            let mut table = table.curved(edge_v, roundness).later(later_v);
            table.opening_stretch = stretch;
            table.area_scale = self.get_or(scale, 1.0);
            Ok(table)
        };
        let build = || {
            Ok(Valve {
                null_v: self.get_or("valve.null_V", paper::NULL_V),
                feeds_a_above_null: valve.feeds_a_when == FeedsAWhen::AboveNull,
                law: self.flow_law(),
                supply: table(&valve.supply_area_m2, "valve.supply_area_m2", R::ZERO)?,
                exhaust: table(
                    &valve.exhaust_area_m2,
                    "valve.exhaust_area_m2",
                    exhaust_later_v,
                )?,
            })
        };
        Some(build())
    }

    /// What recordings asked the valve's openings to be off by: first and last knot, V, and the
    /// shift at each, V; `None` where by nothing.
    fn shift_of_openings(&self) -> Option<(R, R, [R; KNOTS])> {
        if !self.holds("unknown-opening") {
            return None;
        }
        let number = |key: &str, neutral| self.effect("unknown-opening", key, neutral);
        let shifts_v: [R; KNOTS] = std::array::from_fn(|knot| number(&shift_key(knot), 0.0));
        let is_off = shifts_v.iter().any(|shift_v| *shift_v != R::ZERO);
        is_off.then(|| (number("from", 0.0), number("to", 1.0), shifts_v))
    }

    /// The path from command to spool, for steps of `dt_s`.
    pub fn command_path(&self, dt_s: f64) -> CommandPath<R> {
        CommandPath::new(
            self.valve_delay(),
            self.hysteresis(),
            self.slew_limit(),
            &self.spool_dynamics(),
            R::from_f64(dt_s),
        )
    }

    /// Motion of the spool.
    pub fn spool_dynamics(&self) -> SpoolDynamics<R> {
        SpoolDynamics {
            natural_frequency_hz: self.effect("spool-dynamics", "natural_frequency_Hz", 0.0),
            damping_ratio: self.effect("spool-dynamics", "damping_ratio", 0.7),
        }
    }

    /// Dead time of the command.
    pub fn valve_delay(&self) -> ValveDelay<R> {
        ValveDelay {
            delay_s: self.effect("valve-delay", "delay_s", 0.0),
        }
    }

    /// Play between command and spool or stem.
    pub fn hysteresis(&self) -> ValveHysteresis<R> {
        ValveHysteresis {
            width: self.effect("valve-hysteresis", "width", 0.0),
        }
    }

    /// The slew limit of valve or stem.
    pub fn slew_limit(&self) -> SlewLimit<R> {
        SlewLimit {
            rising_per_s: self.effect("slew-limit", "rising_per_s", 0.0),
            falling_per_s: self.effect("slew-limit", "falling_per_s", 0.0),
        }
    }

    /// One chamber, where the rig says enough of its geometry.
    pub fn chamber(&self, side: Side) -> Option<Chamber<R>> {
        Some(Chamber {
            gas: self.gas(),
            geometry: self.geometry(side)?,
            thermal: self.thermal_model(),
            temperature_memory: self.side_effect("gas-temperature-dynamics", "memory", side),
            heat_transfer_charging_w_per_m2_k: self
                .get_or("chambers.heat_transfer_charging_W_m2K", 0.0),
            heat_transfer_discharging_w_per_m2_k: self
                .get_or("chambers.heat_transfer_discharging_W_m2K", 0.0),
            wall_conductance_w_per_k: self.side_effect(
                "gas-temperature-dynamics",
                "conductance_{}_W_K",
                side,
            ),
            wall_temperature_k: self.ambient().temperature_k,
            wall: self.wall(),
            heat_variation: VariableHeatTransfer {
                density_exponent: self.effect("variable-heat-transfer", "density_exponent", 0.0),
                flow_w_per_m2_k: self.effect("variable-heat-transfer", "flow_W_m2K", 0.0),
            },
        })
    }

    /// The wall of either chamber.
    pub fn wall(&self) -> WallTemperature<R> {
        WallTemperature {
            offset_k: self.effect("wall-temperature", "offset_K", 0.0),
            heat_capacity_j_per_k: self.effect("wall-temperature", "heat_capacity_J_K", 0.0),
            outer_w_per_k: self.effect("wall-temperature", "outer_W_K", 0.0),
        }
    }

    /// Whether the chamber's gas temperature is a state of its own. In a reduced
    /// model it follows from the pressure, and its start means nothing.
    pub fn has_temperature_state(&self, side: Side) -> bool {
        let balance = matches!(self.thermal_model(), ThermalModel::EnergyBalance);
        let memory = self.side_effect("gas-temperature-dynamics", "memory", side);
        balance || memory.value() > 0.0
    }

    /// An effect's parameter that each chamber has its own of: `name_a_unit` is
    /// written with the side in the place of `{}`, or at the end.
    fn side_effect(&self, effect: &str, parameter: &str, side: Side) -> R {
        let letter = side.letter().to_string();
        let name = if parameter.contains("{}") {
            parameter.replace("{}", &letter)
        } else {
            format!("{parameter}_{letter}")
        };
        self.effect(effect, &name, 0.0)
    }

    /// Geometry of a chamber, where the rig says enough of it.
    pub fn geometry(&self, side: Side) -> Option<ChamberGeometry<R>> {
        if let Some(vessel) = self.rig.vessel.as_ref() {
            let surface_m2 = self.get_or("vessel.surface_m2", 0.0);
            return (side == Side::A).then(|| vessel_geometry(vessel.volume_m3, surface_m2));
        }
        let cylinder = self.rig.cylinder.as_ref()?;
        let stroke = self.get("cylinder.stroke_m")?;
        let half = stroke * R::from_f64(0.5);
        let letter = side.letter();
        let (length_at_zero_m, length_per_position) = match (cylinder.position_zero?, side) {
            (PositionZero::MidStroke, Side::A) => (half, R::ONE),
            (PositionZero::MidStroke, Side::B) => (half, -R::ONE),
            (PositionZero::EndA, Side::A) => (R::ZERO, R::ONE),
            (PositionZero::EndA, Side::B) => (stroke, -R::ONE),
        };
        let area_m2 = self.get(&format!("cylinder.area_{letter}_m2"))?;
        Some(ChamberGeometry {
            area_m2,
            dead_volume_m3: self.get(&format!("cylinder.dead_volume_{letter}_m3"))?
                + self.side_effect("dead-volume", "volume_{}_m3", side),
            length_at_zero_m,
            length_per_position,
            bore_m: self
                .get("cylinder.bore_m")
                .unwrap_or_else(|| bore_of(area_m2)),
        })
    }

    fn thermal_model(&self) -> ThermalModel<R> {
        let model = self.rig.chambers.as_ref().map(|chambers| chambers.model);
        match model {
            None | Some(ChamberModel::EnergyBalance) => ThermalModel::EnergyBalance,
            Some(ChamberModel::PolytropicProcess) => ThermalModel::PolytropicProcess {
                index: self.get_or("chambers.polytropic_index", 1.2),
            },
            Some(ChamberModel::Polytropic) => ThermalModel::Polytropic {
                expansion_index: self.get_or("chambers.expansion_index", paper::EXPANSION_INDEX),
                compression_index: self
                    .get_or("chambers.compression_index", paper::COMPRESSION_INDEX),
                // The supply's is as printed in the paper; its drift at rest is explained
                // in `model_core::chamber`.
                reference_pressure_pa: self
                    .get("chambers.reference_pressure_Pa")
                    .or_else(|| self.get("supply.pressure_Pa"))
                    .unwrap_or_else(|| R::from_f64(paper::SUPPLY_PRESSURE_PA)),
            },
        }
    }

    /// The leak of one chamber.
    pub fn leak(&self, side: Side) -> ChamberLeakage<R> {
        ChamberLeakage {
            laminar_kg_per_s_pa2: self.side_effect("chamber-leakage", "laminar_{}_kg_s_Pa2", side),
            orifice_area_m2: self.leak_area_m2(self.side_effect(
                "chamber-leakage",
                "orifice_{}_m2",
                side,
            )),
        }
    }

    /// The area of a leak's hole. Where a rig has no valve it says nothing of a discharge, and its
    /// areas are effective ones, as ISO 6358 and everyone who empties a tank has them.
    fn leak_area_m2(&self, stated_m2: R) -> R {
        if self.rig.valve.is_some() {
            stated_m2
        } else {
            stated_m2 / self.flow_law().choked_discharge()
        }
    }

    /// The leak past the piston.
    pub fn piston_leak(&self) -> PistonLeakage<R> {
        PistonLeakage {
            laminar_kg_per_s_pa2: self.effect("piston-leakage", "laminar_kg_s_Pa2", 0.0),
            orifice_area_m2: self.leak_area_m2(self.effect("piston-leakage", "orifice_m2", 0.0)),
        }
    }

    /// The tank between regulator and valve.
    pub fn supply_droop(&self) -> SupplyDroop<R> {
        SupplyDroop {
            tank_volume_m3: self.effect("supply-droop", "tank_volume_m3", 0.0),
            feed_area_m2: self.effect("supply-droop", "feed_area_m2", 1e-5),
        }
    }

    /// Whether the gauge of the supply shows the regulator's pressure and not the tank's.
    pub fn gauge_before_feed(&self) -> bool {
        let gauge = self.effect("supply-droop", "gauge_before_feed", 0.0);
        gauge.value() > 0.5
    }

    /// Both chambers with leaks and tubes. Where the rig describes one chamber
    /// only, the other is its copy, of which nothing is recorded or reported.
    pub fn pneumatics(&self) -> Option<Pneumatics<R>> {
        Some(Pneumatics {
            gas: self.gas(),
            law: self.flow_law(),
            ambient: self.ambient(),
            chamber_a: self.chamber(Side::A).or_else(|| self.chamber(Side::B))?,
            chamber_b: self.chamber(Side::B).or_else(|| self.chamber(Side::A))?,
            leak_a: self.leak(Side::A),
            leak_b: self.leak(Side::B),
            piston_leak: self.piston_leak(),
            tube: TubeLine {
                length_m: self.effect("tube-line", "length_m", 0.0),
                diameter_m: self.effect("tube-line", "diameter_m", 0.004),
            },
            supply_droop: self.supply_droop(),
            back_pressure: ExhaustBackPressure {
                silencer_area_m2: self.effect("exhaust-back-pressure", "silencer_area_m2", 0.0),
                volume_m3: self.effect("exhaust-back-pressure", "volume_m3", 2e-5),
            },
            separate_exhausts: self
                .rig
                .valve
                .as_ref()
                .is_some_and(|valve| valve.exhausts == Some(Exhausts::Two)),
            cushion: EndCushion {
                length_m: self.effect("end-cushion", "length_m", 0.0),
                needle_area_m2: self.effect("end-cushion", "needle_area_m2", 1e-6),
            },
        })
    }

    /// The bristle; the paper's where the rig says nothing.
    pub fn bristle(&self) -> Bristle<R> {
        let declared = self.get_or(
            "friction.bristle_stiffness_N_m",
            paper::BRISTLE_STIFFNESS_N_PER_M,
        );
        let key = "effects.coulomb-friction.bristle_stiffness_N_m";
        Bristle {
            stiffness_n_per_m: self.get(key).unwrap_or(declared),
            damping_n_s_per_m: self.get_or("friction.bristle_damping_Ns_m", 0.0),
            stribeck_velocity_m_per_s: self.get_or(
                "friction.stribeck_velocity_m_s",
                paper::STRIBECK_VELOCITY_M_PER_S,
            ),
        }
    }

    /// Declared friction levels; what is not declared is nought.
    pub fn friction_levels(&self) -> FrictionLevels<R> {
        let coulomb_n = self.get_or("friction.coulomb_N", 0.0);
        FrictionLevels {
            coulomb_n,
            static_n: self.get("friction.static_N").unwrap_or(coulomb_n),
            viscous_n_s_per_m: self.get_or("friction.viscous_Ns_m", 0.0),
        }
    }

    /// Friction and load terms that the model leaves out.
    pub fn friction_terms(&self) -> FrictionTerms<R> {
        FrictionTerms {
            coulomb_n: self.effect("coulomb-friction", "coulomb_N", 0.0),
            stribeck_n: self.effect("stribeck-friction", "static_excess_N", 0.0),
            viscous_n_s_per_m: self.effect("viscous-friction", "viscous_Ns_m", 0.0),
            per_mean_pressure_n_per_pa: self.effect(
                "pressure-dependent-friction",
                "per_mean_pressure_N_Pa",
                0.0,
            ),
            per_pressure_difference_n_per_pa: self.effect(
                "pressure-dependent-friction",
                "per_pressure_difference_N_Pa",
                0.0,
            ),
            static_rise_per_mean_pressure_n_per_pa: self.effect(
                "pressure-dependent-friction",
                "static_rise_per_mean_pressure_N_Pa",
                0.0,
            ),
            constant_force_n: self.effect("constant-force", "force_N", 0.0),
        }
    }

    /// The carriage; areas and mass that the rig does not give are nought.
    pub fn carriage(&self) -> Carriage<R> {
        Carriage {
            mass_kg: self.get_or("carriage.mass_kg", 0.0),
            external_force_n: self.get_or("carriage.external_force_N", 0.0) + self.weight_along(),
            area_a_m2: self.get_or("cylinder.area_a_m2", 0.0),
            area_b_m2: self.get_or("cylinder.area_b_m2", 0.0),
            ambient_pressure_pa: self.ambient().pressure_pa,
            bristle: self.bristle(),
            effects: self.carriage_effects().if_any(),
        }
    }

    /// The part of the moving mass's weight against +x, N. The sine is taken with its first
    /// derivative, which is all that a fit asks for.
    fn weight_along(&self) -> R {
        let Some(inclination_deg) = self.get("axis.inclination_deg") else {
            return R::ZERO;
        };
        let (sine, cosine) = libm::sincos(inclination_deg.value().to_radians());
        let off_rad = (inclination_deg - R::from_f64(inclination_deg.value()))
            * R::from_f64(1_f64.to_radians());
        let sine = R::from_f64(sine) + off_rad * R::from_f64(cosine);
        self.get_or("carriage.mass_kg", 0.0) * R::from_f64(STANDARD_GRAVITY_M_S2) * sine
    }

    /// The same without derivatives.
    pub fn still_carriage(&self) -> Carriage<f64> {
        let replaced: Vec<f64> = self.replaced.iter().map(|number| number.value()).collect();
        let values = Values::<f64> {
            rig: self.rig,
            keys: self.keys,
            replaced: &replaced,
        };
        values.carriage()
    }

    /// What the carriage's own motion leaves out.
    pub fn carriage_effects(&self) -> CarriageEffects<R> {
        CarriageEffects {
            position_friction: self.position_friction(),
            direction_friction: DirectionDependentFriction {
                asymmetry: self.effect("direction-dependent-friction", "asymmetry", 0.0),
                viscous_asymmetry: self.effect(
                    "direction-dependent-friction",
                    "viscous_asymmetry",
                    0.0,
                ),
            },
            dwell_stiction: DwellStiction {
                rise_n: self.effect("dwell-stiction", "rise_N", 0.0),
                time_constant_s: self.effect("dwell-stiction", "time_constant_s", 1.0),
                forgetting_way_m: self.effect(
                    "dwell-stiction",
                    "forgetting_way_m",
                    FORGETTING_WAY_M,
                ),
            },
            load: self.load_coupling(),
            elastic_buffer: self.elastic_buffer(),
            unknown_force: self.unknown_force(),
        }
    }

    fn position_friction(&self) -> PositionDependentFriction<R> {
        let number = |key, neutral| self.effect("position-dependent-friction", key, neutral);
        PositionDependentFriction {
            cosine: number("cosine", 0.0),
            sine: number("sine", 0.0),
            wavelength_m: number("wavelength_m", 0.1),
            slope_per_m: number("slope_per_m", 0.0),
            curvature_per_m2: number("curvature_per_m2", 0.0),
        }
    }

    /// The load with its play where it has one, else the load without.
    fn load_coupling(&self) -> LoadCoupling<R> {
        let coupling = |effect, gap_m| LoadCoupling {
            load_mass_kg: self.effect(effect, "load_mass_kg", 0.0),
            stiffness_n_per_m: self.effect(effect, "stiffness_N_m", 0.0),
            damping_n_s_per_m: self.effect(effect, "damping_Ns_m", 0.0),
            gap_m,
        };
        let gap_m = self.effect("load-backlash", "gap_m", 0.0);
        let with_play = coupling("load-backlash", gap_m);
        if with_play.is_neutral() {
            coupling("load-compliance", R::ZERO)
        } else {
            with_play
        }
    }

    fn unknown_force(&self) -> UnknownForce<R> {
        let number = |key: &str, neutral| self.effect("unknown-force", key, neutral);
        UnknownForce {
            over: if number("of_velocity", 0.0).value() > 0.5 {
                ForceVariable::Velocity
            } else {
                ForceVariable::Position
            },
            from: number("from", -1.0),
            to: number("to", 1.0),
            at_knot_n: std::array::from_fn(|knot| number(&force_key(knot), 0.0)),
        }
    }

    /// The buffers at the ends of the stroke; none where the rig does not say
    /// where the stroke ends.
    fn elastic_buffer(&self) -> ElasticBuffer<R> {
        let number = |key| self.effect("end-cushion", key, 0.0);
        let Some(ends_m) = self.stroke_ends_m() else {
            return ElasticBuffer::NEUTRAL;
        };
        let length_m = number("buffer_length_m");
        ElasticBuffer {
            low_m: ends_m[0] + length_m,
            high_m: ends_m[1] - length_m,
            stiffness_n_per_m: number("buffer_stiffness_N_m"),
            damping_n_s_per_m: number("buffer_damping_Ns_m"),
        }
    }

    /// Positions of the piston at the ends of its stroke, m.
    pub fn stroke_ends_m(&self) -> Option<[R; 2]> {
        let stroke_m = self.get("cylinder.stroke_m")?;
        Some(match self.rig.cylinder.as_ref()?.position_zero? {
            PositionZero::MidStroke => {
                let half = stroke_m * R::from_f64(0.5);
                [-half, half]
            }
            PositionZero::EndA => [R::ZERO, stroke_m],
        })
    }

    /// The whole axis, for steps of `dt_s`. A rig without `[friction]` slides
    /// freely, one without `[gas]` or `[environment]` has standard air.
    pub fn axis(&self, dt_s: f64) -> Result<Axis<R>, AxisFault> {
        if self.rig.vessel.is_some() {
            return Err(AxisFault {
                key: "vessel".into(),
                problem: "a vessel has no carriage".into(),
                expected: "[cylinder] in its place".into(),
            });
        }
        if self.rig.chambers.is_none() {
            return Err(AxisFault::missing("chambers"));
        }
        let valve = self.valve().ok_or_else(|| AxisFault::missing("valve"))?;
        let valve = valve.map_err(table_fault)?;
        if let Some(key) = AXIS_KEYS.iter().find(|key| self.get(key).is_none()) {
            return Err(AxisFault::missing(key));
        }
        Ok(Axis {
            command_path: self.command_path(dt_s),
            valve,
            pneumatics: self
                .pneumatics()
                .ok_or_else(|| AxisFault::missing("cylinder"))?,
            carriage: self.carriage(),
            friction: self.friction_levels(),
            friction_terms: self.friction_terms(),
            supply_temperature_k: self.ambient().temperature_k,
            dt_s: R::from_f64(dt_s),
        })
    }
}

fn table_fault(fault: TableFault) -> AxisFault {
    let (key, problem, expected) = match fault {
        TableFault::Length(count) => (
            "valve.opening_V",
            format!("has {count} points"),
            format!("2 to {TABLE_CAPACITY} points"),
        ),
        TableFault::LengthsDiffer => (
            "valve.opening_V",
            "differs in length from the areas".into(),
            "as many openings as areas".into(),
        ),
        TableFault::OpeningNotRising(point) => (
            "valve.opening_V",
            format!("point {point} (counted from 0) does not follow"),
            "openings that begin at 0 and rise".into(),
        ),
        TableFault::AreaNotRising(point) => (
            "valve.supply_area_m2 or valve.exhaust_area_m2",
            format!("point {point} (counted from 0) is below the one before"),
            "areas that never fall".into(),
        ),
    };
    AxisFault {
        key: key.into(),
        problem,
        expected,
    }
}

/// A vessel: all of its volume is dead, its wall that of a tube of 1 m without ends.
fn vessel_geometry<R: Real>(volume_m3: f64, surface_m2: R) -> ChamberGeometry<R> {
    ChamberGeometry {
        area_m2: R::ZERO,
        dead_volume_m3: R::from_f64(volume_m3),
        length_at_zero_m: R::ONE,
        length_per_position: R::ZERO,
        bore_m: surface_m2 * R::from_f64(1.0 / std::f64::consts::PI),
    }
}

/// The bore of a round piston.
fn bore_of<R: Real>(area_m2: R) -> R {
    (area_m2 * R::from_f64(4.0 / std::f64::consts::PI)).sqrt()
}
