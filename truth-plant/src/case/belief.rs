//! What the engineer believes: the rig file, its values wrong by draws from
//! its own uncertainties.

use std::fmt::Write as _;

use super::nameplate::{
    AMBIENT, AREA_M2, BORE_M, BRISTLE_DAMPING_NS_M, BRISTLE_STIFFNESS_N_M, LAMINAR_RATIO,
    Nameplate, POSITION_NOISE_M, PRESSURE_NOISE_PA, SPEED_NOISE_M_S, STROKE_M,
};
use super::nature::Departure;
use crate::plant::gas::{GAS_CONSTANT, HEAT_RATIO};
use crate::plant::sensors::{POSITION_STEP_M, PRESSURE_STEP_PA};
use crate::random::Random;

/// One standard deviation of what is typed: relative, absolute for a `_V` that
/// is not a table.
const UNCERTAINTY: [(&str, f64); 15] = [
    ("supply.pressure_Pa", 0.004),
    ("valve.null_V", 0.025),
    ("valve.critical_pressure_ratio", 0.06),
    ("valve.opening_V", 0.03),
    ("valve.supply_area_m2", 0.05),
    ("valve.exhaust_area_m2", 0.05),
    ("cylinder.dead_volume_a_m3", 0.12),
    ("cylinder.dead_volume_b_m3", 0.12),
    ("chambers.heat_transfer_charging_W_m2K", 0.25),
    ("chambers.heat_transfer_discharging_W_m2K", 0.25),
    ("carriage.mass_kg", 0.02),
    ("friction.viscous_Ns_m", 0.15),
    ("friction.coulomb_N", 0.12),
    ("friction.static_N", 0.12),
    ("friction.stribeck_velocity_m_s", 0.2),
];

/// Typing errors stay within this many deviations.
const LARGEST_ERROR: f64 = 2.5;

/// What the engineer declares besides the values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Declared {
    /// The supply pressure is recorded.
    pub(super) supply_recorded: bool,
    /// The chambers are declared polytropic.
    pub(super) polytropic: bool,
    /// Multiplier of the noise.
    pub(super) noise: f64,
    /// Some values are wrong by two to three deviations.
    pub(super) careless: bool,
}

/// The typing errors, in deviations, by the position in [`UNCERTAINTY`].
#[derive(Clone, Debug)]
pub(super) struct Belief {
    deviations: [f64; UNCERTAINTY.len()],
    declared: Declared,
}

impl Belief {
    pub(super) fn draw(random: &mut Random, declared: Declared) -> Self {
        let mut deviations = [0.0; UNCERTAINTY.len()];
        for deviation in &mut deviations {
            *deviation = random.normal().clamp(-LARGEST_ERROR, LARGEST_ERROR);
        }
        // Drawn in any case, so that the noise of what follows stays the same.
        let count = 3 + (random.fraction() * 3.0) as usize;
        for _ in 0..count {
            let position = (random.fraction() * UNCERTAINTY.len() as f64) as usize;
            let wrong = random.between(2.0, 3.0) * random.sign();
            if declared.careless {
                deviations[position] = wrong;
            }
        }
        Self {
            deviations,
            declared,
        }
    }

    /// Factor between typed and true value, or the difference for the null.
    fn error(&self, key: &str) -> f64 {
        UNCERTAINTY
            .iter()
            .zip(self.deviations)
            .find(|((known, _), _)| *known == key)
            .map_or(0.0, |((_, deviation), count)| deviation * count)
    }

    fn typed(&self, key: &str, truth: f64) -> f64 {
        truth * (1.0 + self.error(key))
    }

    /// The null that the engineer types, and that the controller works with.
    pub(super) fn null_v(&self, nameplate: &Nameplate) -> f64 {
        nameplate.null_v + self.error("valve.null_V")
    }

    /// The rig file.
    pub(super) fn rig_toml(&self, nameplate: &Nameplate, departure: &Departure) -> String {
        let mut text = String::from("format = \"rig/1\"\n");
        self.signals(&mut text, departure.declared_noise);
        self.surroundings(&mut text, nameplate);
        self.valve(&mut text, nameplate, departure);
        self.body(&mut text, nameplate);
        section(&mut text, "uncertainty");
        for (key, deviation) in UNCERTAINTY {
            line(&mut text, &format!("\"{key}\""), &deviation.to_string());
        }
        text
    }

    fn signals(&self, text: &mut String, [of_pressure, of_position]: [f64; 2]) {
        let noise = self.declared.noise;
        let pressure = |column: &str| {
            format!(
                "{{ column = \"{column}\", unit = \"Pa(abs)\", noise = {:.1}, resolution = {PRESSURE_STEP_PA:.1} }}",
                of_pressure * noise * PRESSURE_NOISE_PA
            )
        };
        section(text, "signals");
        line(text, "t", "{ column = \"t_s\", unit = \"s\" }");
        line(text, "u", "{ column = \"u_V\", unit = \"V\" }");
        line(text, "p_a", &pressure("p_a_Pa"));
        line(text, "p_b", &pressure("p_b_Pa"));
        if self.declared.supply_recorded {
            line(text, "p_s", &pressure("p_s_Pa"));
        }
        let position = format!(
            "{{ column = \"x_m\", unit = \"m\", noise = {:e}, resolution = {POSITION_STEP_M:e} }}",
            of_position * noise * POSITION_NOISE_M
        );
        line(text, "x", &position);
        let speed = format!(
            "{{ column = \"v_m_s\", unit = \"m/s\", noise = {:e} }}",
            noise * SPEED_NOISE_M_S
        );
        line(text, "v", &speed);
    }

    fn surroundings(&self, text: &mut String, nameplate: &Nameplate) {
        section(text, "gas");
        line(text, "gamma", &format!("{HEAT_RATIO:?}"));
        line(text, "gas_constant_J_kgK", &format!("{GAS_CONSTANT:?}"));
        section(text, "environment");
        line(text, "pressure_Pa", &format!("{:?}", AMBIENT.pressure_pa));
        line(
            text,
            "temperature_K",
            &format!("{:?}", AMBIENT.temperature_k),
        );
        section(text, "supply");
        let pressure_pa = self.typed("supply.pressure_Pa", nameplate.supply_pa);
        line(text, "pressure_Pa", &significant(pressure_pa, 4));
    }

    fn valve(&self, text: &mut String, nameplate: &Nameplate, departure: &Departure) {
        section(text, "valve");
        line(text, "feeds_a_when", "\"above-null\"");
        line(text, "null_V", &format!("{:.3}", self.null_v(nameplate)));
        let critical = self.typed("valve.critical_pressure_ratio", nameplate.critical_ratio);
        line(text, "critical_pressure_ratio", &format!("{critical:.3}"));
        line(text, "laminar_pressure_ratio", &LAMINAR_RATIO.to_string());
        let truth_m2 = measured(nameplate, departure);
        let openings_v = departure.openings_v.iter();
        let openings: Vec<f64> = openings_v
            .map(|opening_v| self.typed("valve.opening_V", *opening_v))
            .collect();
        let scaled = |key: &str, scale: f64| -> Vec<f64> {
            let typed = |area_m2: &f64| self.typed(key, scale * area_m2);
            truth_m2.iter().map(typed).collect()
        };
        let supply = scaled("valve.supply_area_m2", 1.0);
        let exhaust = scaled("valve.exhaust_area_m2", nameplate.asymmetry);
        line(text, "opening_V", &table(&openings));
        line(text, "supply_area_m2", &table(&supply));
        line(text, "exhaust_area_m2", &table(&exhaust));
    }

    fn body(&self, text: &mut String, nameplate: &Nameplate) {
        self.cylinder_and_chambers(text, nameplate);
        self.carriage_and_friction(text, nameplate);
    }

    fn cylinder_and_chambers(&self, text: &mut String, nameplate: &Nameplate) {
        let typed =
            |key: &str, truth: f64, digits: usize| significant(self.typed(key, truth), digits);
        section(text, "cylinder");
        line(text, "stroke_m", &STROKE_M.to_string());
        line(text, "bore_m", &BORE_M.to_string());
        line(text, "area_a_m2", &format!("{AREA_M2:e}"));
        line(text, "area_b_m2", &format!("{AREA_M2:e}"));
        for (side, truth_m3) in ["a", "b"].into_iter().zip(nameplate.dead_volume_m3) {
            let key = format!("dead_volume_{side}_m3");
            let value = typed(&format!("cylinder.{key}"), truth_m3, 3);
            line(text, &key, &value);
        }
        line(text, "position_zero", "\"mid-stroke\"");
        section(text, "chambers");
        let model = if self.declared.polytropic {
            "\"polytropic\""
        } else {
            "\"energy-balance\""
        };
        line(text, "model", model);
        for (way, truth) in [
            ("charging", nameplate.charging_w_per_m2_k),
            ("discharging", nameplate.discharging_w_per_m2_k),
        ] {
            let key = format!("heat_transfer_{way}_W_m2K");
            let value = typed(&format!("chambers.{key}"), truth, 3);
            line(text, &key, &value);
        }
        // Beater's exponents, as the seed paper takes them.
        line(text, "expansion_index", "1.11");
        line(text, "compression_index", "1.18");
    }

    fn carriage_and_friction(&self, text: &mut String, nameplate: &Nameplate) {
        let typed =
            |key: &str, truth: f64, digits: usize| significant(self.typed(key, truth), digits);
        section(text, "carriage");
        line(
            text,
            "mass_kg",
            &typed("carriage.mass_kg", nameplate.mass_kg, 4),
        );
        line(text, "external_force_N", "0.0");
        section(text, "friction");
        line(
            text,
            "bristle_stiffness_N_m",
            &format!("{BRISTLE_STIFFNESS_N_M:e}"),
        );
        line(
            text,
            "bristle_damping_Ns_m",
            &format!("{BRISTLE_DAMPING_NS_M:?}"),
        );
        line(
            text,
            "viscous_Ns_m",
            &typed("friction.viscous_Ns_m", nameplate.viscous_n_s_per_m, 3),
        );
        let coulomb_n = self.typed("friction.coulomb_N", nameplate.coulomb_n);
        // No engineer types a break-away force under the sliding one.
        let static_n = self
            .typed("friction.static_N", nameplate.static_n)
            .max(1.05 * coulomb_n);
        line(text, "coulomb_N", &significant(coulomb_n, 3));
        line(text, "static_N", &significant(static_n, 3));
        line(
            text,
            "stribeck_velocity_m_s",
            &typed(
                "friction.stribeck_velocity_m_s",
                nameplate.stribeck_m_per_s,
                3,
            ),
        );
    }
}

/// The areas of a supply path as they were measured; none falls.
fn measured(nameplate: &Nameplate, departure: &Departure) -> Vec<f64> {
    let mut most_m2 = 0.0_f64;
    let points = departure.openings_v.iter().zip(&departure.measured);
    let areas = points.map(|(opening_v, wrong)| {
        most_m2 = most_m2.max(wrong * departure.area_m2(&nameplate.curve, *opening_v));
        most_m2
    });
    areas.collect()
}

pub(crate) fn section(text: &mut String, name: &str) {
    // Writing into a String cannot fail.
    let _ = write!(text, "\n[{name}]\n");
}

pub(crate) fn line(text: &mut String, key: &str, value: &str) {
    let _ = writeln!(text, "{key} = {value}");
}

/// The value with that many significant digits, always as a TOML float.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    format!("{rounded:?}")
}

pub(crate) fn table(values: &[f64]) -> String {
    let items: Vec<String> = values.iter().map(|value| significant(*value, 4)).collect();
    format!("[{}]", items.join(", "))
}
