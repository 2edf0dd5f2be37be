//! The catalogue of left-out physics that the model holds today: the one home
//! of the effects' names, of their parameters' keys, units, neutral values and meanings.
//!
//! Names are those of a verdict (`format = "verdict/1"`); keys are read by
//! [`crate::model`] and by the laws, which are stopped in a debug build when
//! they read a key, or assume a neutral value, that stands otherwise here. Rig
//! reading refuses what the catalogue does not know: a slip in a name would
//! else switch an effect off in silence.

use std::collections::BTreeMap;

use crate::rig::{EffectFault, Facts, facts};
use crate::text::expected_one_of;
use model_core::left_out::FORGETTING_WAY_M;

/// One effect of `[effects.NAME]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// The name of the verdict.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub what: &'static str,
    /// Its parameters; one that a rig file leaves out is neutral.
    pub parameters: &'static [EffectParameter],
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    /// The key, ending in its unit where that is fixed.
    pub key: &'static str,
    /// The unit; `signal` stands for the unit of the command (V, or 1).
    pub unit: &'static str,
    /// The value that stands for an absent key. With all parameters of an
    /// effect neutral the effect is off. `None`: an absent key leaves a number
    /// of the rig as declared.
    pub neutral: Option<f64>,
    /// The least value that the law has a meaning for.
    pub least: f64,
    /// What it is, in a few words.
    pub what: &'static str,
    /// A typical value or range.
    pub typical: &'static str,
}

impl EffectParameter {
    /// What a person needs to know of the key.
    pub fn facts(&self) -> Facts {
        let source = "`pneuma diagnose` finds it, or the part's data sheet";
        facts(self.unit, self.typical, self.what, source)
    }
}

const fn parameter(
    key: &'static str,
    unit: &'static str,
    neutral: f64,
    least: f64,
    what: &'static str,
    typical: &'static str,
) -> EffectParameter {
    EffectParameter {
        key,
        unit,
        neutral: Some(neutral),
        least,
        what,
        typical,
    }
}

/// A parameter that adds to a declared number and may have either sign.
const fn signed(
    key: &'static str,
    unit: &'static str,
    what: &'static str,
    typical: &'static str,
) -> EffectParameter {
    parameter(key, unit, 0.0, f64::MIN, what, typical)
}

/// A tube narrower than this is none: the law divides by its area.
const NARROWEST_TUBE_M: f64 = 1e-4;
/// No wall of a pneumatic axis is so much colder than its surroundings.
const COLDEST_WALL_OFFSET_K: f64 = -100.0;
/// A needle narrower than this is shut: the law divides by its area.
const NARROWEST_NEEDLE_M2: f64 = 1e-9;
/// The law divides by the bristle's stiffness.
const SOFTEST_BRISTLE_N_M: f64 = 1e-3;
/// The law divides by the wavelength; no seal or guide has a shorter one.
const SHORTEST_WAVE_M: f64 = 1e-3;
/// The law divides by the time constant; shorter is no growth but a level.
const SHORTEST_DWELL_S: f64 = 1e-3;
/// No seal forgets on the way of an atom: the law divides by it.
const SHORTEST_FORGETTING_M: f64 = 1e-6;

/// Every effect, in the order of a verdict's list.
#[rustfmt::skip]
pub const EFFECTS: &[Effect] = &[
    Effect {
        name: "tube-line",
        what: "Tubes between valve and cylinder at both ports: the gas is stored, delayed and throttled.",
        parameters: &[
            parameter("length_m", "m", 0.0, 0.0, "length of each tube", "0.1 to 3"),
            parameter("diameter_m", "m", 0.004, NARROWEST_TUBE_M, "inner diameter", "0.004 to 0.008"),
        ],
    },
    Effect {
        name: "spool-dynamics",
        what: "The spool follows the command as a second-order lag.",
        parameters: &[
            parameter("natural_frequency_Hz", "Hz", 0.0, 0.0, "natural frequency; 0 is an ideal spool", "60 to 130"),
            parameter("damping_ratio", "1", 0.7, 0.0, "damping ratio", "0.6 to 0.9"),
        ],
    },
    Effect {
        name: "valve-hysteresis",
        what: "Play between command and spool or stem.",
        parameters: &[parameter("width", "signal", 0.0, 0.0, "full width of the play", "0.4 % of the command range")],
    },
    Effect {
        name: "valve-delay",
        what: "Dead time of the command.",
        parameters: &[parameter("delay_s", "s", 0.0, 0.0, "dead time", "0.001 to 0.005")],
    },
    Effect {
        name: "piston-leakage",
        what: "Gas past the piston seal, through a gap, a hole, or both.",
        parameters: &[
            parameter("laminar_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0, "conductance of the gap: mass flow over the difference of the squared pressures", "5e-17 to 5e-16"),
            parameter("orifice_m2", "m2", 0.0, 0.0, "area of the hole; in a rig without [valve] the effective one, times the discharge coefficient", "1e-9 to 1e-7"),
        ],
    },
    Effect {
        name: "chamber-leakage",
        what: "Gas from the chambers to the surroundings, through gaps, holes, or both.",
        parameters: &[
            parameter("laminar_a_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0, "conductance of the gap of chamber A", "5e-17 to 5e-16"),
            parameter("laminar_b_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0, "conductance of the gap of chamber B", "5e-17 to 5e-16"),
            parameter("orifice_a_m2", "m2", 0.0, 0.0, "area of the hole of chamber A; in a rig without [valve] the effective one, times the discharge coefficient", "1e-9 to 1e-7"),
            parameter("orifice_b_m2", "m2", 0.0, 0.0, "area of the hole of chamber B; in a rig without [valve] the effective one, times the discharge coefficient", "1e-9 to 1e-7"),
            // Time of the recording at which the leak opens.
            parameter("onset_s", "s", f64::NEG_INFINITY, f64::MIN, "time of the recording at which the leak opens", "-inf: always open"),
        ],
    },
    Effect {
        name: "supply-droop",
        what: "A supply tank that is emptied faster than it is refilled.",
        parameters: &[
            parameter("tank_volume_m3", "m3", 0.0, 0.0, "volume of the tank; 0 is a constant supply", "0.0005 to 0.02"),
            parameter("feed_area_m2", "m2", 1e-5, 0.0, "orifice area of regulator and line that refill it", "5e-6 to 2e-5"),
            // 1 where the recorded supply pressure is the regulator's, 0 where it is the tank's.
            parameter("gauge_before_feed", "1", 0.0, 0.0, "1 where the recorded supply pressure is that of the regulator, 0 where it is that of the tank", "0 or 1"),
        ],
    },
    Effect {
        name: "exhaust-back-pressure",
        what: "A silencer at the exhaust, with the volume before it.",
        parameters: &[
            parameter("silencer_area_m2", "m2", 0.0, 0.0, "orifice area of the silencer; 0 is none", "1 to 3 times the area of the valve"),
            parameter("volume_m3", "m3", 2e-5, 0.0, "volume between valve and silencer", "2e-5"),
        ],
    },
    Effect {
        name: "gas-temperature-dynamics",
        what: "The energy balance in place of a reduced model, and extra conductance to the wall.",
        parameters: &[
            parameter("memory_a", "1", 0.0, 0.0, "0 the reduced model, 1 the energy balance of chamber A", "0 or 1"),
            parameter("memory_b", "1", 0.0, 0.0, "0 the reduced model, 1 the energy balance of chamber B", "0 or 1"),
            parameter("conductance_a_W_K", "W/K", 0.0, 0.0, "heat conductance of chamber A to the wall", "0.2 to 2"),
            parameter("conductance_b_W_K", "W/K", 0.0, 0.0, "heat conductance of chamber B to the wall", "0.2 to 2"),
        ],
    },
    Effect {
        name: "variable-heat-transfer",
        what: "Heat transfer that grows with gas density and mass flow.",
        parameters: &[
            parameter("density_exponent", "1", 0.0, 0.0, "exponent of the density ratio", "0.5 to 0.8"),
            parameter("flow_W_m2K", "W/(m2 K)", 0.0, 0.0, "additional coefficient at full flow", "10 to 100"),
        ],
    },
    Effect {
        name: "wall-temperature",
        what: "A wall at another temperature than the surroundings; with a heat capacity the gas warms it.",
        parameters: &[
            parameter("offset_K", "K", 0.0, COLDEST_WALL_OFFSET_K, "wall less ambient temperature", "-10 to 10"),
            parameter("heat_capacity_J_K", "J/K", 0.0, 0.0, "heat capacity; 0 is a wall of constant temperature", "1000 to 2500"),
            parameter("outer_W_K", "W/K", 0.0, 0.0, "conductance of the wall to the surroundings", "0.2 to 1"),
        ],
    },
    Effect {
        name: "dead-volume",
        what: "Gas volume beside the stated dead volumes.",
        parameters: &[signed("volume_a_m3", "m3", "additional volume of chamber A", "-1e-5 to 5e-5"), signed("volume_b_m3", "m3", "additional volume of chamber B", "-1e-5 to 5e-5")],
    },
    Effect {
        name: "pressure-dependent-friction",
        what: "Friction that grows with the chamber pressures.",
        parameters: &[
            signed("per_mean_pressure_N_Pa", "N/Pa", "growth with the mean gauge pressure", "2e-5 to 6e-5"),
            signed("per_pressure_difference_N_Pa", "N/Pa", "growth with the pressure difference", "5e-6 to 3e-5"),
            signed("static_rise_per_mean_pressure_N_Pa", "N/Pa", "further growth of the static level", "0 to 3e-5"),
        ],
    },
    Effect {
        name: "position-dependent-friction",
        what: "Friction that varies along the stroke, as shares of the friction level.",
        parameters: &[
            signed("cosine", "1", "cosine amplitude", "0.05 to 0.3"),
            signed("sine", "1", "sine amplitude", "0.05 to 0.3"),
            parameter("wavelength_m", "m", 0.1, SHORTEST_WAVE_M, "wavelength", "0.02 to 0.2"),
            signed("slope_per_m", "1/m", "linear share", "-1 to 1"),
            signed("curvature_per_m2", "1/m2", "quadratic share", "-5 to 5"),
        ],
    },
    Effect {
        name: "direction-dependent-friction",
        what: "More friction towards +x, less towards -x, as shares of the friction level.",
        parameters: &[signed("asymmetry", "1", "share of the dry friction", "-0.3 to 0.3"), signed("viscous_asymmetry", "1", "share of the viscous friction", "-0.3 to 0.3")],
    },
    Effect {
        name: "dwell-stiction",
        what: "Break-away force that grows with the time at rest.",
        parameters: &[
            signed("rise_N", "N", "growth after a long rest", "0.2 to 1 times static_N"),
            parameter("time_constant_s", "s", 1.0, SHORTEST_DWELL_S, "time constant of the growth", "1 to 100"),
            parameter("forgetting_way_m", "m", FORGETTING_WAY_M, SHORTEST_FORGETTING_M, "travel over which the growth is lost", "1e-5 to 1e-3"),
        ],
    },
    Effect {
        name: "stribeck-friction",
        what: "Static level above the sliding one, beside the stated friction.",
        parameters: &[signed("static_excess_N", "N", "additional static level", "0 to 0.5 times coulomb_N")],
    },
    Effect {
        name: "coulomb-friction",
        what: "Dry friction beside the stated one.",
        parameters: &[
            signed("coulomb_N", "N", "additional dry friction", "-10 to 40"),
            EffectParameter {
                key: "bristle_stiffness_N_m",
                unit: "N/m",
                neutral: None,
                what: "stiffness before break-away, in place of the stated one",
                typical: "1e4 to 1e6",
                least: SOFTEST_BRISTLE_N_M,
            },
        ],
    },
    Effect {
        name: "viscous-friction",
        what: "Viscous friction beside the stated one.",
        parameters: &[signed("viscous_Ns_m", "N s/m", "additional viscous friction", "-50 to 100")],
    },
    Effect {
        name: "load-compliance",
        what: "A part of the moving mass behind a spring.",
        parameters: &[
            parameter("load_mass_kg", "kg", 0.0, 0.0, "mass behind the spring", "0.3 to 0.8 times mass_kg"),
            parameter("stiffness_N_m", "N/m", 0.0, 0.0, "stiffness", "1e5 to 1e6"),
            parameter("damping_Ns_m", "N s/m", 0.0, 0.0, "damping", "10 to 500"),
        ],
    },
    Effect {
        // Stands for the compliance too where it has a mass.
        name: "load-backlash",
        what: "A part of the moving mass behind a backlash and a spring.",
        parameters: &[
            parameter("load_mass_kg", "kg", 0.0, 0.0, "mass behind the backlash", "0.3 to 0.8 times mass_kg"),
            parameter("stiffness_N_m", "N/m", 0.0, 0.0, "stiffness in contact", "1e5 to 1e6"),
            parameter("damping_Ns_m", "N s/m", 0.0, 0.0, "damping in contact", "10 to 500"),
            parameter("gap_m", "m", 0.0, 0.0, "backlash, end to end", "2e-5 to 5e-4"),
        ],
    },
    Effect {
        name: "constant-force",
        what: "A constant force beside the stated one.",
        parameters: &[signed("force_N", "N", "force against +x", "-30 to 30")],
    },
    Effect {
        // No physics with a name: what recordings asked for.
        name: "unknown-force",
        what: "A force of no known law: a table of nine points over position or velocity, found from recordings.",
        parameters: &[
            // 0: over the position, m; 1: over the velocity, m/s.
            parameter("of_velocity", "1", 0.0, 0.0, "0: over the position, 1: over the velocity", "0 or 1"),
            parameter("from", "m, m/s", -1.0, f64::MIN, "first point of the table", "-0.25"),
            parameter("to", "m, m/s", 1.0, f64::MIN, "last point of the table", "0.25"),
            signed("force_0_N", "N", "force against +x at point 0", "-30 to 30"),
            signed("force_1_N", "N", "force against +x at point 1", "-30 to 30"),
            signed("force_2_N", "N", "force against +x at point 2", "-30 to 30"),
            signed("force_3_N", "N", "force against +x at point 3", "-30 to 30"),
            signed("force_4_N", "N", "force against +x at point 4", "-30 to 30"),
            signed("force_5_N", "N", "force against +x at point 5", "-30 to 30"),
            signed("force_6_N", "N", "force against +x at point 6", "-30 to 30"),
            signed("force_7_N", "N", "force against +x at point 7", "-30 to 30"),
            signed("force_8_N", "N", "force against +x at point 8", "-30 to 30"),
        ],
    },
    Effect {
        // No physics with a name: what recordings asked for of the valve.
        name: "unknown-opening",
        what: "A valve opening that differs from the stated one by no known law: a table of nine points over the opening, evenly spaced over its square root, found from recordings.",
        parameters: &[
            parameter("from", "V", 0.0, 0.0, "first point of the table", "0"),
            parameter("to", "V", 1.0, 0.0, "last point of the table", "5"),
            signed("shift_0_V", "V", "shift of the opening at point 0", "-0.2 to 0.2"),
            signed("shift_1_V", "V", "shift of the opening at point 1", "-0.2 to 0.2"),
            signed("shift_2_V", "V", "shift of the opening at point 2", "-0.2 to 0.2"),
            signed("shift_3_V", "V", "shift of the opening at point 3", "-0.2 to 0.2"),
            signed("shift_4_V", "V", "shift of the opening at point 4", "-0.2 to 0.2"),
            signed("shift_5_V", "V", "shift of the opening at point 5", "-0.2 to 0.2"),
            signed("shift_6_V", "V", "shift of the opening at point 6", "-0.2 to 0.2"),
            signed("shift_7_V", "V", "shift of the opening at point 7", "-0.2 to 0.2"),
            signed("shift_8_V", "V", "shift of the opening at point 8", "-0.2 to 0.2"),
        ],
    },
    Effect {
        // No physics with a name: what recordings asked for of the gauges of the chambers.
        name: "unknown-reading",
        what: "A pressure gauge that errs by no known law: a table of nine points over the pressure, found from recordings. It stays off the board.",
        parameters: &[
            parameter("from", "Pa", 0.0, 0.0, "first point of the table", "1e5"),
            parameter("to", "Pa", 1e6, 0.0, "last point of the table", "7e5"),
            signed("error_a_0_Pa", "Pa", "reading less pressure of chamber A at point 0", "-10000 to 10000"),
            signed("error_a_1_Pa", "Pa", "reading less pressure of chamber A at point 1", "-10000 to 10000"),
            signed("error_a_2_Pa", "Pa", "reading less pressure of chamber A at point 2", "-10000 to 10000"),
            signed("error_a_3_Pa", "Pa", "reading less pressure of chamber A at point 3", "-10000 to 10000"),
            signed("error_a_4_Pa", "Pa", "reading less pressure of chamber A at point 4", "-10000 to 10000"),
            signed("error_a_5_Pa", "Pa", "reading less pressure of chamber A at point 5", "-10000 to 10000"),
            signed("error_a_6_Pa", "Pa", "reading less pressure of chamber A at point 6", "-10000 to 10000"),
            signed("error_a_7_Pa", "Pa", "reading less pressure of chamber A at point 7", "-10000 to 10000"),
            signed("error_a_8_Pa", "Pa", "reading less pressure of chamber A at point 8", "-10000 to 10000"),
            signed("error_b_0_Pa", "Pa", "reading less pressure of chamber B at point 0", "-10000 to 10000"),
            signed("error_b_1_Pa", "Pa", "reading less pressure of chamber B at point 1", "-10000 to 10000"),
            signed("error_b_2_Pa", "Pa", "reading less pressure of chamber B at point 2", "-10000 to 10000"),
            signed("error_b_3_Pa", "Pa", "reading less pressure of chamber B at point 3", "-10000 to 10000"),
            signed("error_b_4_Pa", "Pa", "reading less pressure of chamber B at point 4", "-10000 to 10000"),
            signed("error_b_5_Pa", "Pa", "reading less pressure of chamber B at point 5", "-10000 to 10000"),
            signed("error_b_6_Pa", "Pa", "reading less pressure of chamber B at point 6", "-10000 to 10000"),
            signed("error_b_7_Pa", "Pa", "reading less pressure of chamber B at point 7", "-10000 to 10000"),
            signed("error_b_8_Pa", "Pa", "reading less pressure of chamber B at point 8", "-10000 to 10000"),
        ],
    },
    Effect {
        name: "end-cushion",
        what: "Cushions at the ends of the stroke: exhaust through needles, elastic buffers.",
        parameters: &[
            parameter("length_m", "m", 0.0, 0.0, "length of the pneumatic cushion; 0 is none", "0.01 to 0.03"),
            parameter("needle_area_m2", "m2", 1e-6, NARROWEST_NEEDLE_M2, "area of the needle", "5e-7 to 3e-6"),
            parameter("buffer_length_m", "m", 0.0, 0.0, "length of the elastic buffer", "0.002 to 0.01"),
            parameter("buffer_stiffness_N_m", "N/m", 0.0, 0.0, "stiffness of the buffer", "1e4 to 1e6"),
            parameter("buffer_damping_Ns_m", "N s/m", 0.0, 0.0, "damping of the buffer", "10 to 1000"),
        ],
    },
    Effect {
        name: "pressure-sensor-lag",
        what: "Both chamber pressures are recorded late, as a first-order lag.",
        parameters: &[parameter("time_constant_s", "s", 0.0, 0.0, "time constant", "0.001 to 0.005")],
    },
    Effect {
        name: "gauge-gain",
        what: "Recorded over true absolute chamber pressure, less one.",
        parameters: &[signed("gain_error_a", "1", "relative error of the gain of chamber A's gauge", "-0.01 to 0.01"), signed("gain_error_b", "1", "relative error of the gain of chamber B's gauge", "-0.01 to 0.01")],
    },
    Effect {
        name: "pressure-sensor-offset",
        what: "Recorded less true chamber pressure.",
        parameters: &[signed("offset_a_Pa", "Pa", "offset of chamber A", "-10000 to 10000"), signed("offset_b_Pa", "Pa", "offset of chamber B", "-10000 to 10000")],
    },
    Effect {
        name: "position-time-skew",
        what: "The position is recorded late against the other channels.",
        parameters: &[signed("delay_s", "s", "delay", "0 to 0.01")],
    },
    Effect {
        name: "slew-limit",
        what: "Largest rate of spool or stem, by direction; 0 is none.",
        parameters: &[
            parameter("rising_per_s", "signal/s", 0.0, 0.0, "largest rate upwards", "1000 V/s for a spool"),
            parameter("falling_per_s", "signal/s", 0.0, 0.0, "largest rate downwards", "1000 V/s for a spool"),
        ],
    },
];

/// The effect of that name.
pub fn effect(name: &str) -> Option<&'static Effect> {
    EFFECTS.iter().find(|effect| effect.name == name)
}

impl Effect {
    /// The parameter of that key.
    pub fn parameter(&self, key: &str) -> Option<&'static EffectParameter> {
        self.parameters.iter().find(|known| known.key == key)
    }
}

/// Whether this is a table that recordings asked for, and no physics with a name.
pub fn is_unnamed(name: &str) -> bool {
    name.starts_with("unknown-")
}

/// Whether a law may read this key and take this value for an absent one.
pub fn is_catalogued(name: &str, key: &str, neutral: f64) -> bool {
    effect(name)
        .and_then(|effect| effect.parameter(key))
        .and_then(|parameter| parameter.neutral)
        .is_some_and(|known| known.to_bits() == neutral.to_bits())
}

/// Judges one `[effects.NAME]` of a rig file.
pub fn check(name: &str, parameters: &BTreeMap<String, f64>) -> Result<(), EffectFault> {
    let Some(effect) = effect(name) else {
        let known: Vec<&str> = EFFECTS.iter().map(|effect| effect.name).collect();
        return Err(EffectFault {
            parameter: None,
            problem: "unknown effect".into(),
            expected: expected_one_of(name, &known),
        });
    };
    for (key, value) in parameters {
        check_parameter(effect, key, *value)?;
    }
    Ok(())
}

fn check_parameter(effect: &Effect, key: &str, value: f64) -> Result<(), EffectFault> {
    let fault = |problem: String, expected: String| EffectFault {
        parameter: Some(key.into()),
        problem,
        expected,
    };
    let Some(parameter) = effect.parameter(key) else {
        let known: Vec<&str> = effect.parameters.iter().map(|known| known.key).collect();
        let expected = expected_one_of(key, &known);
        return Err(fault("unknown parameter".into(), expected));
    };
    if value >= parameter.least {
        return Ok(());
    }
    let expected = format!("a number of at least {}", parameter.least);
    Err(fault(format!("{value} is out of range"), expected))
}
