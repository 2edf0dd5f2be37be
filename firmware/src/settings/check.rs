//! The one judgement of settings: what passes here can be stepped for ever.
//!
//! The ranges are those of a servo-pneumatic axis with room on both sides; they
//! are there to catch a slip of units and a damaged number, not to doubt a rig.

use super::field::{Field, Fields, Range, Rows, SettingsFault, field, fields};
use super::parameters::{Chamber, Settings, Thermal};
use crate::codes::POSITION_M;
use model_core::left_out::DELAY_CAPACITY;

/// Where a valve of 0 to 10 V may have its null, V: half a volt about the middle, five times what
/// data sheets allow. In a fault the valve is put there.
pub const NULL_V: [f32; 2] = [4.5, 5.5];

/// Positions beyond the converter's scale, which has its nought at mid-stroke,
/// cannot be measured.
const LONGEST_FROM_ZERO_M: f32 = POSITION_M.highest;

/// The ranges of a chamber's numbers, in the order of [`chamber_fields`].
type ChamberRanges = [Range; 8];
const CHAMBER_A: ChamberRanges = chamber_ranges([
    "chamber_a.area_m2",
    "chamber_a.dead_volume_m3",
    "chamber_a.length_at_zero_m",
    "chamber_a.bore_m",
    "chamber_a.temperature_memory",
    "chamber_a.wall_conductance_w_per_k",
    "chamber_a.leak_laminar_kg_per_s_pa2",
    "chamber_a.leak_orifice_m2",
]);
const CHAMBER_B: ChamberRanges = chamber_ranges([
    "chamber_b.area_m2",
    "chamber_b.dead_volume_m3",
    "chamber_b.length_at_zero_m",
    "chamber_b.bore_m",
    "chamber_b.temperature_memory",
    "chamber_b.wall_conductance_w_per_k",
    "chamber_b.leak_laminar_kg_per_s_pa2",
    "chamber_b.leak_orifice_m2",
]);

const fn chamber_ranges(names: [&'static str; 8]) -> ChamberRanges {
    let [
        area,
        dead_volume,
        length,
        bore,
        memory,
        conductance,
        laminar,
        orifice,
    ] = names;
    [
        Range::field(area, 1e-6, 1.0),
        Range::field(dead_volume, 0.0, 0.5),
        Range::field(length, 1e-3, LONGEST_FROM_ZERO_M),
        Range::field(bore, 1e-3, 2.0),
        Range::field(memory, 0.0, 1.0),
        Range::field(conductance, 0.0, 1e4),
        Range::field(laminar, 0.0, 1e-9),
        Range::field(orifice, 0.0, 1e-3),
    ]
}

fn chamber_fields(chamber: &Chamber, ranges: &'static ChamberRanges) -> Fields<8> {
    let values = [
        chamber.area_m2,
        chamber.dead_volume_m3,
        chamber.length_at_zero_m,
        chamber.bore_m,
        chamber.temperature_memory,
        chamber.wall_conductance_w_per_k,
        chamber.leak_laminar_kg_per_s_pa2,
        chamber.leak_orifice_m2,
    ];
    Fields { ranges, values }
}

/// Points of a valve's table.
const OPENINGS_V: [Range; 1] = [Range::field("valve.openings_v", 0.0, 100.0)];
const SUPPLY_AREAS_M2: [Range; 1] = [Range::field("valve.supply_areas_m2", 0.0, 0.1)];
const EXHAUST_AREAS_M2: [Range; 1] = [Range::field("valve.exhaust_areas_m2", 0.0, 0.1)];

impl Settings {
    /// Shows every number to a visitor, the points of the valve's table apart.
    pub fn visit(&self, visitor: &mut impl FnMut(Field)) {
        // Nothing is judged here, and nothing refused.
        let _shown = self.rows(&mut |rows| {
            rows.iter().for_each(&mut *visitor);
            Ok(())
        });
    }

    #[rustfmt::skip]
    fn rows(
        &self,
        show: &mut impl FnMut(Rows<'_>) -> Result<(), SettingsFault>,
    ) -> Result<(), SettingsFault> {
        let Self {
            gas, ambient, valve, command_path, chambers, chamber_a, chamber_b, tube, carriage,
            friction, friction_terms, pneumatic_effects, mechanical_effects, controller, sensors,
            // No number.
            wiring: _,
        } = self;
        show(fields![
            field("gas.heat_capacity_ratio", gas.heat_capacity_ratio, 1.01, 2.0),
            field("gas.gas_constant_j_per_kg_k", gas.gas_constant_j_per_kg_k, 50.0, 5e3),
            field("ambient.pressure_pa", ambient.pressure_pa, 1e4, 1e6),
            field("ambient.temperature_k", ambient.temperature_k, 200.0, 400.0),
            field("valve.null_v", valve.null_v, NULL_V[0], NULL_V[1]),
            field("valve.critical_pressure_ratio", valve.critical_pressure_ratio, 0.01, 0.99),
            field("valve.laminar_pressure_ratio", valve.laminar_pressure_ratio, 0.1, 0.9999),
            field("valve.discharge_slope", valve.discharge_slope, -0.1, 0.25),
            field("valve.opening_stretch", valve.opening_stretch, 0.01, 100.0),
            field("valve.supply_area_scale", valve.supply_area_scale, 0.01, 100.0),
            field("valve.exhaust_area_scale", valve.exhaust_area_scale, 0.01, 100.0),
            field("command_path.delay_s", command_path.delay_s, 0.0, 0.1),
            field("command_path.hysteresis_width_v", command_path.hysteresis_width_v, 0.0, 5.0),
            or_none("command_path.rising_v_per_s", command_path.rising_v_per_s, 1.0, 1e6),
            or_none("command_path.falling_v_per_s", command_path.falling_v_per_s, 1.0, 1e6),
            or_none("command_path.natural_frequency_hz", command_path.natural_frequency_hz, 1.0, 1e4),
            field("command_path.damping_ratio", command_path.damping_ratio, 0.0, 20.0),
            field(
                "chambers.heat_transfer_charging_w_per_m2_k",
                chambers.heat_transfer_charging_w_per_m2_k, 0.0, 1e5,
            ),
            field(
                "chambers.heat_transfer_discharging_w_per_m2_k",
                chambers.heat_transfer_discharging_w_per_m2_k, 0.0, 1e5,
            ),
        ].rows())?;
        show_thermal(&chambers.thermal, show)?;
        show(chamber_fields(chamber_a, &CHAMBER_A).rows())?;
        show(chamber_fields(chamber_b, &CHAMBER_B).rows())?;
        show(fields![
            or_none("tube.length_m", tube.length_m, 1e-3, 50.0),
            field("tube.diameter_m", tube.diameter_m, 1e-4, 0.1),
            field("carriage.mass_kg", carriage.mass_kg, 0.01, 1e4),
            field("carriage.external_force_n", carriage.external_force_n, -1e5, 1e5),
            field("friction.bristle_stiffness_n_per_m", friction.bristle_stiffness_n_per_m, 1.0, 1e10),
            field("friction.bristle_damping_n_s_per_m", friction.bristle_damping_n_s_per_m, 0.0, 1e7),
            field("friction.stribeck_velocity_m_per_s", friction.stribeck_velocity_m_per_s, 1e-6, 10.0),
            field("friction.coulomb_n", friction.coulomb_n, 0.0, 1e5),
            field("friction.static_n", friction.static_n, 0.0, 1e5),
            field("friction.viscous_n_s_per_m", friction.viscous_n_s_per_m, 0.0, 1e6),
            field("friction_terms.coulomb_n", friction_terms.coulomb_n, -1e5, 1e5),
            field("friction_terms.stribeck_n", friction_terms.stribeck_n, -1e5, 1e5),
            field("friction_terms.viscous_n_s_per_m", friction_terms.viscous_n_s_per_m, -1e6, 1e6),
            field(
                "friction_terms.per_mean_pressure_n_per_pa",
                friction_terms.per_mean_pressure_n_per_pa, -0.1, 0.1,
            ),
            field(
                "friction_terms.per_pressure_difference_n_per_pa",
                friction_terms.per_pressure_difference_n_per_pa, -0.1, 0.1,
            ),
            field(
                "friction_terms.static_rise_per_mean_pressure_n_per_pa",
                friction_terms.static_rise_per_mean_pressure_n_per_pa, -0.1, 0.1,
            ),
            field("friction_terms.constant_force_n", friction_terms.constant_force_n, -1e5, 1e5),
        ].rows())?;
        show(pneumatic_effects.fields().rows())?;
        show(mechanical_effects.fields().rows())?;
        show(mechanical_effects.knots())?;
        show(controller.listed().rows())?;
        show(sensors.fields().rows())
    }

    /// Judges every number, for steps of `dt_s`. A function of its own: what it holds on the
    /// stack is gone before the controller is built.
    #[inline(never)]
    pub(super) fn check(&self, dt_s: f32) -> Result<(), SettingsFault> {
        field("tick.period_s", dt_s, 1e-5, 0.02).check()?;
        self.rows(&mut |rows| rows.check())?;
        self.check_tables()?;
        self.check_delay(dt_s)?;
        self.controller.check_tick(dt_s)?;
        self.check_together()
    }

    /// That the points rise is for the table itself to say.
    fn check_tables(&self) -> Result<(), SettingsFault> {
        let valve = &self.valve;
        let points = |ranges, values| Rows { ranges, values }.check();
        points(&OPENINGS_V, &valve.openings_v)?;
        points(&SUPPLY_AREAS_M2, &valve.supply_areas_m2)?;
        points(&EXHAUST_AREAS_M2, &valve.exhaust_areas_m2)
    }

    /// A longer delay would be cut short in silence: the line of past commands
    /// holds so many steps and no more.
    fn check_delay(&self, dt_s: f32) -> Result<(), SettingsFault> {
        let longest_s = dt_s * (DELAY_CAPACITY - 2) as f32;
        let delay_s = self.command_path.delay_s;
        field("command_path.delay_s", delay_s, 0.0, longest_s).check()
    }

    fn check_together(&self) -> Result<(), SettingsFault> {
        let fault = |name, problem| Err(SettingsFault::Contradiction(name, problem));
        let (declared, terms) = (&self.friction, &self.friction_terms);
        if self.valve.laminar_pressure_ratio <= self.valve.critical_pressure_ratio {
            return fault(
                "valve.laminar_pressure_ratio",
                "expected to be above the critical pressure ratio",
            );
        }
        if declared.coulomb_n + terms.coulomb_n < 0.0 {
            return fault(
                "friction_terms.coulomb_n",
                "takes away more than the declared Coulomb friction",
            );
        }
        if declared.static_n + terms.coulomb_n + terms.stribeck_n < 0.0 {
            return fault(
                "friction_terms.stribeck_n",
                "takes away more than the declared static friction",
            );
        }
        if declared.viscous_n_s_per_m + terms.viscous_n_s_per_m < 0.0 {
            return fault(
                "friction_terms.viscous_n_s_per_m",
                "takes away more than the declared viscous friction",
            );
        }
        self.mechanical_effects
            .check_with(&self.carriage, declared, terms)?;
        self.sensors.check()
    }
}

fn show_thermal(
    thermal: &Thermal,
    show: &mut impl FnMut(Rows<'_>) -> Result<(), SettingsFault>,
) -> Result<(), SettingsFault> {
    match *thermal {
        Thermal::EnergyBalance => Ok(()),
        Thermal::Polytropic {
            expansion_index,
            compression_index,
            reference_pressure_pa,
        } => {
            let fields = fields![
                field("chambers.expansion_index", expansion_index, 0.5, 2.0),
                field("chambers.compression_index", compression_index, 0.5, 2.0),
                field(
                    "chambers.reference_pressure_pa",
                    reference_pressure_pa,
                    1e4,
                    1e8
                ),
            ];
            show(fields.rows())
        }
        Thermal::PolytropicProcess { index } => {
            show(fields![field("chambers.polytropic_index", index, 0.5, 2.0)].rows())
        }
    }
}
