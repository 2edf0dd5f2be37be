//! What a data sheet says of an axis, and the rig file made of it: typical values are marked as
//! typical and get wide deviations.

use std::f64::consts::PI;
use std::fmt::Write;

use super::columns::Guess;
use super::valves::{TYPICAL_DEAD_ZONE_V, TYPICAL_LAMINAR_RATIO};
use crate::rig::{FORMAT, quoted};

/// Friction of a seal grows with its length: Coulomb, static and viscous friction over the bore,
/// N/m, N/m and N s/m2. Those of a rodless cylinder of 25 mm (Meng et al. 2011: 20.2 N, 28.9 N, 64.5 N s/m).
const FRICTION_PER_BORE: [f64; 3] = [808.0, 1156.0, 2580.0];
/// Dead volume per piston area, m: port and cushion, some 20 mm of stroke.
const DEAD_LENGTH_M: f64 = 0.02;
/// Dead volume of fittings and a short tube, m3.
const FITTINGS_M3: f64 = 15e-6;

/// What a person with other sensors uncomments.
const SENSORS_OF_A_BOARD: &str = "
# A controller board takes 0 to 10 V for 0 to 10 bar absolute (p_a, p_b, p_s), -10 to 10 V for -0.25 to 0.25 m (x)
# and for -2 to 2 m/s (v). For other sensors at its terminals, and where one is not there:
# [board.p_a]
# output_mA = [4, 20]
# range_Pa = [0, 1.0e6]
# sensor = \"gauge\"
# [board.v]
# sensor = \"none\"
";

/// An axis as its data sheets describe it.
#[derive(Clone, Debug)]
pub struct DataSheet {
    /// Bore, m.
    pub bore_m: f64,
    /// Rod on the side of chamber B, m; 0 for a rodless cylinder.
    pub rod_m: f64,
    /// Stroke, m.
    pub stroke_m: f64,
    /// Moving mass, kg.
    pub mass_kg: f64,
    /// Inclination of +x above the horizontal, degrees.
    pub inclination_deg: f64,
    /// Name of the valve, and where its flow comes from.
    pub valve: String,
    /// Nominal flow, l/min.
    pub nominal_flow_l_min: f64,
    /// Critical pressure ratio, and whether it is typical only.
    pub critical_pressure_ratio: (f64, bool),
    /// Command at which the valve is closed, V.
    pub null_v: f64,
    /// Opening at which it is fully open, V.
    pub full_opening_v: f64,
    /// Supply pressure, Pa absolute, and how it was stated.
    pub supply_pa: (f64, String),
    /// Ambient pressure, Pa.
    pub ambient_pa: f64,
    /// Ambient temperature, K.
    pub temperature_k: f64,
    /// Tube from valve to cylinder, length and inner diameter, m.
    pub tube_m: (f64, f64),
    /// Whether a command above the null moves the axis to +x, and how that is known.
    pub feeds_a_above_null: (bool, &'static str),
    /// Whether x is 0 in the middle of the stroke, and how that is known.
    pub zero_is_mid_stroke: (bool, &'static str),
}

/// A signal of the rig file.
#[derive(Clone, Debug)]
pub struct SignalLine {
    /// Signal, column, unit and why.
    pub guess: Guess,
    /// Noise, SI, and where it comes from.
    pub noise: Option<(f64, &'static str)>,
    /// Resolution, SI.
    pub resolution: Option<f64>,
}

impl DataSheet {
    /// Areas of the piston on both sides, m2.
    fn areas_m2(&self) -> [f64; 2] {
        let circle = |diameter_m: f64| PI / 4.0 * diameter_m * diameter_m;
        let bore_m2 = circle(self.bore_m);
        [bore_m2, bore_m2 - circle(self.rod_m)]
    }

    fn dead_volume_m3(&self) -> f64 {
        let (length_m, diameter_m) = self.tube_m;
        let tube_m3 = PI / 4.0 * diameter_m * diameter_m * length_m;
        DEAD_LENGTH_M * self.areas_m2()[0] + FITTINGS_M3 + tube_m3
    }

    /// The rig file.
    pub fn rig_file(&self, signals: &[SignalLine]) -> String {
        let mut text = String::from(
            "# A first rig file, written by `pneuma init` from data sheet values.\n\
             # Values marked \"typical\" were not on the data sheet: replace them by measured ones where you can.\n\
             # Every key is explained in docs/rig.md; check the file with `pneuma check --rig FILE run.csv`.\n\
             format = \"rig/1\"\n",
        );
        self.write_signals(&mut text, signals);
        self.write_surroundings(&mut text);
        self.write_valve(&mut text);
        self.write_cylinder(&mut text);
        self.write_mechanics(&mut text);
        self.write_uncertainty(&mut text);
        text.push_str(SENSORS_OF_A_BOARD);
        text
    }

    fn write_signals(&self, text: &mut String, signals: &[SignalLine]) {
        if signals.is_empty() {
            text.push_str(
                "\n# Name the columns of your recordings before you use this file, for example:\n\
                 # [signals]\n\
                 # t = { column = \"t_s\", unit = \"s\" }\n\
                 # u = { column = \"u_V\", unit = \"V\" }\n\
                 # p_a = { column = \"p_a\", unit = \"bar(g)\" }\n\
                 # p_b = { column = \"p_b\", unit = \"bar(g)\" }\n\
                 # x = { column = \"x_mm\", unit = \"mm\" }\n",
            );
            return;
        }
        text.push_str("\n# +x enlarges chamber A. Noise and resolution are in SI units.\n");
        write_signal_lines(text, signals);
    }

    fn write_surroundings(&self, text: &mut String) {
        let (supply_pa, stated) = &self.supply_pa;
        section(
            text,
            "gas",
            &[
                ("gamma", "1.4", "air"),
                ("gas_constant_J_kgK", "287.0", "dry air"),
            ],
        );
        section(
            text,
            "environment",
            &[
                ("pressure_Pa", &short(self.ambient_pa), "ambient pressure"),
                (
                    "temperature_K",
                    &short(self.temperature_k),
                    "ambient temperature",
                ),
            ],
        );
        section(
            text,
            "supply",
            &[(
                "pressure_Pa",
                &short(*supply_pa),
                &format!("absolute; stated as {stated}"),
            )],
        );
    }

    fn write_valve(&self, text: &mut String) {
        let (b, typical_b) = self.critical_pressure_ratio;
        let (above, how) = self.feeds_a_above_null;
        let word = if above {
            "\"above-null\""
        } else {
            "\"below-null\""
        };
        let b_from = if typical_b { "typical" } else { "data sheet" };
        let _ = writeln!(
            text,
            "\n# {}.\n# No data sheet states the area over the opening: until `pneuma identify valve-flow` has measured\n# it, it is taken as linear from the dead zone to the full opening, supply and exhaust alike.",
            self.valve
        );
        section_without_gap(
            text,
            "valve",
            &[
                ("feeds_a_when", word, how),
                ("null_V", &short(self.null_v), "middle of the command range"),
                (
                    "nominal_flow_l_min",
                    &short(self.nominal_flow_l_min),
                    "from 6 to 5 bar",
                ),
                ("b", &short(b), b_from),
                ("dead_zone_V", &short(TYPICAL_DEAD_ZONE_V), "typical"),
                (
                    "full_opening_V",
                    &short(self.full_opening_v),
                    "half of the command range",
                ),
                (
                    "laminar_pressure_ratio",
                    &short(TYPICAL_LAMINAR_RATIO),
                    "typical",
                ),
            ],
        );
    }

    fn write_cylinder(&self, text: &mut String) {
        let [area_a, area_b] = self.areas_m2();
        let dead = short(self.dead_volume_m3());
        let (length_m, diameter_m) = self.tube_m;
        let of_tube = if length_m > 0.0 {
            format!(
                "typical: port, fittings and {length_m} m of tube {} mm",
                1e3 * diameter_m
            )
        } else {
            "typical: port, fittings and a short tube".to_owned()
        };
        let of_b = if self.rod_m > 0.0 {
            "less the rod"
        } else {
            "rodless: the same"
        };
        let (mid, how) = self.zero_is_mid_stroke;
        section(
            text,
            "cylinder",
            &[
                ("stroke_m", &short(self.stroke_m), "data sheet"),
                ("bore_m", &short(self.bore_m), "data sheet"),
                ("area_a_m2", &short(area_a), "pi/4 bore^2"),
                ("area_b_m2", &short(area_b), of_b),
                ("dead_volume_a_m3", &dead, &of_tube),
                ("dead_volume_b_m3", &dead, &of_tube),
                (
                    "position_zero",
                    if mid { "\"mid-stroke\"" } else { "\"end-a\"" },
                    how,
                ),
            ],
        );
        section(
            text,
            "chambers",
            &[
                ("model", "\"energy-balance\"", ""),
                ("heat_transfer_charging_W_m2K", "50.0", "typical"),
                ("heat_transfer_discharging_W_m2K", "20.0", "typical"),
            ],
        );
    }

    fn write_mechanics(&self, text: &mut String) {
        if self.inclination_deg != 0.0 {
            let why = "+x points up by this angle";
            section(
                text,
                "axis",
                &[("inclination_deg", &short(self.inclination_deg), why)],
            );
        }
        section(
            text,
            "carriage",
            &[("mass_kg", &short(self.mass_kg), "moving mass")],
        );
        let [coulomb, fixed, viscous] = FRICTION_PER_BORE.map(|per_bore| per_bore * self.bore_m);
        section(
            text,
            "friction",
            &[
                ("bristle_stiffness_N_m", "9.14e5", "typical"),
                ("bristle_damping_Ns_m", "1327.0", "typical"),
                ("viscous_Ns_m", &short(viscous), "typical for the bore"),
                ("coulomb_N", &short(coulomb), "typical for the bore"),
                ("static_N", &short(fixed), "typical for the bore"),
                ("stribeck_velocity_m_s", "0.005", "typical"),
            ],
        );
    }

    fn write_uncertainty(&self, text: &mut String) {
        let b = if self.critical_pressure_ratio.1 {
            "0.25"
        } else {
            "0.1"
        };
        text.push_str("\n# One standard deviation: relative, in volts where the key ends in _V.");
        section(
            text,
            "uncertainty",
            &[
                (
                    "\"supply.pressure_Pa\"",
                    "0.02",
                    "reading of the regulator's gauge",
                ),
                ("\"valve.null_V\"", "0.1", "unit to unit"),
                ("\"valve.b\"", b, ""),
                ("\"valve.opening_V\"", "0.15", "assumed shape"),
                (
                    "\"valve.nominal_flow_l_min\"",
                    "0.3",
                    "scale of supply and exhaust area each",
                ),
                ("\"cylinder.dead_volume_a_m3\"", "0.5", "guessed"),
                ("\"cylinder.dead_volume_b_m3\"", "0.5", "guessed"),
                (
                    "\"chambers.heat_transfer_charging_W_m2K\"",
                    "0.5",
                    "typical",
                ),
                (
                    "\"chambers.heat_transfer_discharging_W_m2K\"",
                    "0.5",
                    "typical",
                ),
                ("\"carriage.mass_kg\"", "0.05", ""),
                ("\"friction.viscous_Ns_m\"", "0.5", "typical"),
                ("\"friction.coulomb_N\"", "0.5", "typical"),
                ("\"friction.static_N\"", "0.5", "typical"),
                ("\"friction.stribeck_velocity_m_s\"", "0.5", "typical"),
            ],
        );
    }
}

/// The columns alone as a rig file, to read a recording by.
pub(super) fn signals_file(signals: &[SignalLine]) -> String {
    let mut text = format!("format = \"{FORMAT}\"\n");
    write_signal_lines(&mut text, signals);
    text
}

fn write_signal_lines(text: &mut String, signals: &[SignalLine]) {
    text.push_str("[signals]\n");
    for signal in signals {
        let guess = &signal.guess;
        let mut extra = String::new();
        if let Some((noise, _)) = signal.noise {
            let _ = write!(extra, ", noise = {}", short(noise));
        }
        if let Some(resolution) = signal.resolution {
            let _ = write!(extra, ", resolution = {}", short(resolution));
        }
        let noise = signal
            .noise
            .map_or_else(String::new, |(_, source)| format!("; noise {source}"));
        let _ = writeln!(
            text,
            "{} = {{ column = {}, unit = \"{}\"{extra} }} # {}{noise}",
            guess.signal,
            quoted(&guess.column),
            guess.unit,
            guess.why
        );
    }
}

fn section(text: &mut String, name: &str, lines: &[(&str, &str, &str)]) {
    text.push('\n');
    section_without_gap(text, name, lines);
}

fn section_without_gap(text: &mut String, name: &str, lines: &[(&str, &str, &str)]) {
    let _ = writeln!(text, "[{name}]");
    for (key, value, comment) in lines {
        let comment = if comment.is_empty() {
            String::new()
        } else {
            format!(" # {comment}")
        };
        let _ = writeln!(text, "{key} = {value}{comment}");
    }
}

/// A number to six digits, as TOML writes one: an ambient pressure keeps its 101325.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}
