//! The rig file of a bench, section by section.

use super::axis::Axis;
use crate::case::belief::{line, section, significant, table};
use crate::case::nameplate::{
    AMBIENT, AREA_M2, BORE_M, LAMINAR_RATIO, POSITION_NOISE_M, PRESSURE_NOISE_PA, STROKE_M,
};
use crate::plant::gas::{FlowShape, GAS_CONSTANT, HEAT_RATIO, Node};
use crate::plant::sensors::{POSITION_STEP_M, PRESSURE_STEP_PA};
use crate::random::Random;

/// Digits of what is stated right.
const RIGHT: usize = 7;
/// Digits of what an engineer estimates.
const ESTIMATED: usize = 3;

/// Density of air at the reference of ISO 8778, kg/m3.
const ANR_KG_PER_M3: f64 = 1.185;

/// Litres of reference air in a minute, in kg/s.
pub(super) const L_PER_MIN_KG_PER_S: f64 = ANR_KG_PER_M3 / 60_000.0;

/// A true value as an engineer states it with this relative deviation: wrong
/// by 0.4 to 1.3 deviations.
pub(super) fn wrong(random: &mut Random, truth: f64, deviation: f64) -> f64 {
    truth * (1.0 + random.sign() * random.between(0.4, 1.3) * deviation)
}

/// A rig file that is being written.
pub(super) struct Rig {
    text: String,
    uncertainty: Vec<(String, f64)>,
}

impl Rig {
    pub(super) fn new() -> Self {
        let mut rig = Self {
            text: String::from("format = \"rig/1\"\n"),
            uncertainty: Vec::new(),
        };
        rig.section("signals");
        rig.text("t", "{ column = \"t_s\", unit = \"s\" }");
        rig
    }

    /// A section begins.
    pub(super) fn section(&mut self, name: &str) {
        section(&mut self.text, name);
    }

    /// A key with what TOML makes of this text.
    pub(super) fn text(&mut self, key: &str, value: &str) {
        line(&mut self.text, key, value);
    }

    /// A key whose value is right.
    pub(super) fn right(&mut self, key: &str, value: f64) {
        line(&mut self.text, key, &significant(value, RIGHT));
    }

    /// A key whose value is an estimate.
    pub(super) fn estimate(&mut self, key: &str, value: f64) {
        line(&mut self.text, key, &significant(value, ESTIMATED));
    }

    /// Deviation of a value, by its full key.
    pub(super) fn uncertain(&mut self, key: &str, deviation: f64) {
        self.uncertainty.push((key.to_owned(), deviation));
    }

    /// A signal with its unit; noise and step in SI units, none if 0.
    pub(super) fn signal(&mut self, name: &str, column: &str, unit: &str, [noise, step]: [f64; 2]) {
        let sensor = if noise > 0.0 {
            format!(
                ", noise = {}, resolution = {}",
                significant(noise, 4),
                significant(step, 4)
            )
        } else {
            String::new()
        };
        self.text(
            name,
            &format!("{{ column = \"{column}\", unit = \"{unit}\"{sensor} }}"),
        );
    }

    /// The command.
    pub(super) fn command(&mut self) {
        self.signal("u", "u_V", "V", [0.0; 2]);
    }

    /// A pressure in Pa.
    pub(super) fn pressure(&mut self, name: &str) {
        let column = format!("{name}_Pa");
        self.signal(
            name,
            &column,
            "Pa(abs)",
            [PRESSURE_NOISE_PA, PRESSURE_STEP_PA],
        );
    }

    /// Both chamber pressures in bar gauge.
    pub(super) fn gauge_pressures(&mut self) {
        for (name, column) in [("p_a", "pa_bar"), ("p_b", "pb_bar")] {
            self.signal(
                name,
                column,
                "bar(g)",
                [PRESSURE_NOISE_PA, PRESSURE_STEP_PA],
            );
        }
    }

    /// The position of the axis' own sensor.
    pub(super) fn position(&mut self, column: &str, unit: &str) {
        self.signal("x", column, unit, [POSITION_NOISE_M, POSITION_STEP_M]);
    }

    /// Gas and surroundings.
    pub(super) fn surroundings(&mut self) {
        self.section("gas");
        self.right("gamma", HEAT_RATIO);
        self.right("gas_constant_J_kgK", GAS_CONSTANT);
        self.section("environment");
        self.right("pressure_Pa", AMBIENT.pressure_pa);
        self.right("temperature_K", AMBIENT.temperature_k);
    }

    /// The supply.
    pub(super) fn supply(&mut self, axis: &Axis) {
        self.section("supply");
        self.right("pressure_Pa", axis.nameplate.supply_pa);
    }

    /// The cylinder with these dead volumes.
    pub(super) fn cylinder(&mut self, dead_volume_m3: [f64; 2]) {
        self.section("cylinder");
        self.right("stroke_m", STROKE_M);
        self.right("bore_m", BORE_M);
        self.right("area_a_m2", AREA_M2);
        self.right("area_b_m2", AREA_M2);
        self.right("dead_volume_a_m3", dead_volume_m3[0]);
        self.right("dead_volume_b_m3", dead_volume_m3[1]);
        self.text("position_zero", "\"mid-stroke\"");
    }

    /// The energy balance with these heat transfer coefficients.
    pub(super) fn chambers(&mut self, charging: f64, discharging: f64) {
        self.section("chambers");
        self.text("model", "\"energy-balance\"");
        self.right("heat_transfer_charging_W_m2K", charging);
        self.right("heat_transfer_discharging_W_m2K", discharging);
    }

    /// The valve by null and nominal flow, as a data sheet states it.
    pub(super) fn data_sheet_valve(&mut self, axis: &Axis, random: &mut Random, null_v: f64) {
        let plate = &axis.nameplate;
        let flow_l_min = wrong(random, nominal_flow_l_min(axis), 0.1);
        let ratio = wrong(random, plate.critical_ratio, 0.15);
        self.section("valve");
        self.text("feeds_a_when", "\"above-null\"");
        self.right("null_V", null_v);
        self.right("laminar_pressure_ratio", LAMINAR_RATIO);
        self.estimate("nominal_flow_l_min", flow_l_min);
        self.estimate("b", ratio);
        self.uncertain("valve.nominal_flow_l_min", 0.1);
        self.uncertain("valve.b", 0.15);
    }

    /// The valve by its areas, wrong by one factor each.
    pub(super) fn table_valve(&mut self, axis: &Axis, random: &mut Random, null_v: f64) {
        const DEVIATION: f64 = 0.05;
        const OPENINGS_V: [f64; 12] = [0.0, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 3.0, 5.0];
        self.section("valve");
        self.text("feeds_a_when", "\"above-null\"");
        self.right("null_V", null_v);
        self.right("critical_pressure_ratio", axis.nameplate.critical_ratio);
        self.right("laminar_pressure_ratio", LAMINAR_RATIO);
        self.text("opening_V", &table(&OPENINGS_V));
        let supply = wrong(random, 1.0, DEVIATION);
        let exhaust = wrong(random, 1.0, DEVIATION);
        let supply_m2 = OPENINGS_V.map(|opening_v| supply * axis.supply_m2(opening_v));
        let exhaust_m2 = OPENINGS_V.map(|opening_v| exhaust * axis.exhaust_m2(opening_v));
        self.text("supply_area_m2", &table(&supply_m2));
        self.text("exhaust_area_m2", &table(&exhaust_m2));
        self.uncertain("valve.supply_area_m2", DEVIATION);
        self.uncertain("valve.exhaust_area_m2", DEVIATION);
    }

    /// The text, with the deviations at its end.
    pub(super) fn finish(mut self) -> String {
        if !self.uncertainty.is_empty() {
            section(&mut self.text, "uncertainty");
        }
        for (key, deviation) in &self.uncertainty {
            line(
                &mut self.text,
                &format!("\"{key}\""),
                &significant(*deviation, 3),
            );
        }
        self.text
    }
}

/// Flow from 6 to 5 bar gauge through the fully open valve.
fn nominal_flow_l_min(axis: &Axis) -> f64 {
    let at = |gauge_pa: f64| Node {
        pressure_pa: AMBIENT.pressure_pa + gauge_pa,
        ..AMBIENT
    };
    let flow: FlowShape = axis.flow();
    let stream = flow.stream(axis.supply_m2(5.0), at(6e5), at(5e5));
    stream.mass_kg_per_s / L_PER_MIN_KG_PER_S
}
