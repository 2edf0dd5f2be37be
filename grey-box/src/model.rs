//! From a rig's numbers to the laws of `model-core`, in any scalar.
//!
//! The only place that knows which key of the rig file (or of an effect) feeds
//! which parameter. Structure comes from the [`Rig`], numbers from [`Values`]:
//! the rig's own, some of them replaced by those a fit is trying.

use crate::effects::Numbers;
use crate::effects::flow::{
    chamber_leakage, exhaust_back_pressure, piston_leakage, port_throttle, slew_limit,
    spool_dynamics, supply_droop, tube_line, unknown_opening, valve_delay, valve_hysteresis,
};
use crate::effects::friction::{
    coulomb, direction_dependent, dwell_stiction, position_dependent, pressure_dependent, stribeck,
    viscous,
};
use crate::effects::gas::{dead_volume, gas_temperature, variable_heat_transfer, wall_temperature};
use crate::effects::load::{
    constant_force, end_cushion, force_equation, load_backlash, load_compliance, unknown_force,
};
use crate::rig::{ChamberModel, Exhausts, FeedsAWhen, PositionZero, Rig, STANDARD_PRESSURE_PA};
pub use crate::side::Side;
use crate::units::STANDARD_GRAVITY_M_S2;
use model_core::axis::{Axis, CommandPath, Pneumatics};
use model_core::carriage::Carriage;
use model_core::carriage::CarriageEffects;
use model_core::chamber::{Chamber, ChamberGeometry, ThermalModel};
use model_core::friction::{Bristle, FrictionLevels};
use model_core::gas::Gas;
use model_core::left_out::{
    ChamberLeakage, ElasticBuffer, FrictionTerms, LoadCoupling, PistonLeakage, over_knots,
};
use model_core::paper;
use model_core::real::Real;
use model_core::valve::{AreaTable, FlowLaw, GasState, TABLE_CAPACITY, TableFault, Valve};

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

impl<R: Real> Numbers<R> for Values<'_, R> {
    fn stated(&self, key: &str) -> Option<R> {
        self.get(key)
    }

    fn holds(&self, effect: &str) -> bool {
        let of_effect = |key: &String| {
            let key = key.strip_prefix("effects.");
            let key = key.and_then(|key| key.strip_prefix(effect));
            key.is_some_and(|parameter| parameter.starts_with('.'))
        };
        self.rig.effects.contains_key(effect) || self.keys.iter().any(of_effect)
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
        let shift = unknown_opening::law(self);
        let stretch = self.get_or("valve.opening_V", 1.0);
        let edge_v = self.get("valve.edge_V");
        let exhaust_later_v = self.get_or("valve.exhaust_shift_V", 0.0) / stretch;
        let roundness = self.get_or("valve.curve_roundness", 0.0);
        let table = |areas: &[f64], scale: &str, later_v: R| {
            let mut table = AreaTable::new(&valve.opening_v, areas)?;
            if let Some((from, to, shifts_v)) = shift {
                let off_by_v =
                    |opening_v: R| over_knots(from.sqrt(), to.sqrt(), &shifts_v, opening_v.sqrt());
                table.open_elsewhere(&unknown_opening::opening_knots(from, to), off_by_v);
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

    /// The path from command to spool, for steps of `dt_s`.
    pub fn command_path(&self, dt_s: f64) -> CommandPath<R> {
        CommandPath::new(
            valve_delay::law(self),
            valve_hysteresis::law(self),
            slew_limit::law(self),
            &spool_dynamics::law(self),
            R::from_f64(dt_s),
        )
    }

    /// One chamber, where the rig says enough of its geometry.
    pub fn chamber(&self, side: Side) -> Option<Chamber<R>> {
        Some(Chamber {
            gas: self.gas(),
            geometry: self.geometry(side)?,
            thermal: self.thermal_model(),
            temperature_memory: gas_temperature::memory(self, side),
            heat_transfer_charging_w_per_m2_k: self
                .get_or("chambers.heat_transfer_charging_W_m2K", 0.0),
            heat_transfer_discharging_w_per_m2_k: self
                .get_or("chambers.heat_transfer_discharging_W_m2K", 0.0),
            wall_conductance_w_per_k: gas_temperature::conductance_w_k(self, side),
            wall_temperature_k: self.ambient().temperature_k,
            wall: wall_temperature::law(self),
            heat_variation: variable_heat_transfer::law(self),
        })
    }

    /// Whether the chamber's gas temperature is a state of its own. In a reduced
    /// model it follows from the pressure, and its start means nothing.
    pub fn has_temperature_state(&self, side: Side) -> bool {
        let balance = matches!(self.thermal_model(), ThermalModel::EnergyBalance);
        balance || gas_temperature::memory(self, side).value() > 0.0
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
                + dead_volume::volume_m3(self, side),
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
        chamber_leakage::law(self, side, |stated_m2| self.leak_area_m2(stated_m2))
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
        piston_leakage::law(self, |stated_m2| self.leak_area_m2(stated_m2))
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
            tube: tube_line::law(self),
            supply_droop: supply_droop::law(self),
            back_pressure: exhaust_back_pressure::law(self),
            separate_exhausts: self
                .rig
                .valve
                .as_ref()
                .is_some_and(|valve| valve.exhausts == Some(Exhausts::Two)),
            cushion: end_cushion::needles(self),
            throttle_a: port_throttle::law(self, Side::A),
            throttle_b: port_throttle::law(self, Side::B),
        })
    }

    /// The bristle; the paper's where the rig says nothing.
    pub fn bristle(&self) -> Bristle<R> {
        let declared = self.get_or(
            "friction.bristle_stiffness_N_m",
            paper::BRISTLE_STIFFNESS_N_PER_M,
        );
        Bristle {
            stiffness_n_per_m: coulomb::bristle_stiffness_n_m(self).unwrap_or(declared),
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
        let [per_mean, per_difference, static_rise] = pressure_dependent::growth_n_pa(self);
        FrictionTerms {
            coulomb_n: coulomb::coulomb_n(self),
            stribeck_n: stribeck::static_excess_n(self),
            viscous_n_s_per_m: viscous::viscous_n_s_m(self),
            per_mean_pressure_n_per_pa: per_mean,
            per_pressure_difference_n_per_pa: per_difference,
            static_rise_per_mean_pressure_n_per_pa: static_rise,
            constant_force_n: constant_force::force_n(self),
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
            position_friction: position_dependent::law(self),
            direction_friction: direction_dependent::law(self),
            dwell_stiction: dwell_stiction::law(self),
            load: self.load_coupling(),
            elastic_buffer: self.elastic_buffer(),
            unknown_force: unknown_force::law(self),
            force_equation: force_equation::law(self),
        }
    }

    /// The load with its play where it has one, else the load without.
    fn load_coupling(&self) -> LoadCoupling<R> {
        let with_play = load_backlash::law(self);
        if with_play.is_neutral() {
            load_compliance::law(self)
        } else {
            with_play
        }
    }

    /// The buffers at the ends of the stroke; none where the rig does not say
    /// where the stroke ends.
    fn elastic_buffer(&self) -> ElasticBuffer<R> {
        match self.stroke_ends_m() {
            Some(ends_m) => end_cushion::buffers(self, ends_m),
            None => ElasticBuffer::NEUTRAL,
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
