//! The catalogue of left-out physics that the model holds today: the one home
//! of the effects' names, of their parameters' keys, units and neutral values.
//!
//! Names are those of a verdict (`format = "verdict/1"`); keys are read by
//! [`crate::model`] and by the laws, which are stopped in a debug build when
//! they read a key, or assume a neutral value, that stands otherwise here. Rig
//! reading refuses what the catalogue does not know: a slip in a name would
//! else switch an effect off in silence.

use std::collections::BTreeMap;

use crate::rig::EffectFault;
use crate::text::expected_one_of;
use model_core::left_out::FORGETTING_WAY_M;

/// One effect of `[effects.NAME]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// The name of the verdict.
    pub name: &'static str,
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
}

const fn parameter(
    key: &'static str,
    unit: &'static str,
    neutral: f64,
    least: f64,
) -> EffectParameter {
    EffectParameter {
        key,
        unit,
        neutral: Some(neutral),
        least,
    }
}

/// A parameter that adds to a declared number and may have either sign.
const fn signed(key: &'static str, unit: &'static str) -> EffectParameter {
    parameter(key, unit, 0.0, f64::MIN)
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
pub const EFFECTS: &[Effect] = &[
    Effect {
        name: "tube-line",
        parameters: &[
            parameter("length_m", "m", 0.0, 0.0),
            parameter("diameter_m", "m", 0.004, NARROWEST_TUBE_M),
        ],
    },
    Effect {
        name: "spool-dynamics",
        parameters: &[
            parameter("natural_frequency_Hz", "Hz", 0.0, 0.0),
            parameter("damping_ratio", "1", 0.7, 0.0),
        ],
    },
    Effect {
        name: "valve-hysteresis",
        parameters: &[parameter("width", "signal", 0.0, 0.0)],
    },
    Effect {
        name: "valve-delay",
        parameters: &[parameter("delay_s", "s", 0.0, 0.0)],
    },
    Effect {
        name: "piston-leakage",
        parameters: &[
            parameter("laminar_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0),
            parameter("orifice_m2", "m2", 0.0, 0.0),
        ],
    },
    Effect {
        name: "chamber-leakage",
        parameters: &[
            parameter("laminar_a_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0),
            parameter("laminar_b_kg_s_Pa2", "kg/(s Pa2)", 0.0, 0.0),
            parameter("orifice_a_m2", "m2", 0.0, 0.0),
            parameter("orifice_b_m2", "m2", 0.0, 0.0),
            // Time of the recording at which the leak opens.
            parameter("onset_s", "s", f64::NEG_INFINITY, f64::MIN),
        ],
    },
    Effect {
        name: "supply-droop",
        parameters: &[
            parameter("tank_volume_m3", "m3", 0.0, 0.0),
            parameter("feed_area_m2", "m2", 1e-5, 0.0),
            // 1 where the recorded supply pressure is the regulator's, 0 where it is the tank's.
            parameter("gauge_before_feed", "1", 0.0, 0.0),
        ],
    },
    Effect {
        name: "exhaust-back-pressure",
        parameters: &[
            parameter("silencer_area_m2", "m2", 0.0, 0.0),
            parameter("volume_m3", "m3", 2e-5, 0.0),
        ],
    },
    Effect {
        name: "gas-temperature-dynamics",
        parameters: &[
            parameter("memory_a", "1", 0.0, 0.0),
            parameter("memory_b", "1", 0.0, 0.0),
            parameter("conductance_a_W_K", "W/K", 0.0, 0.0),
            parameter("conductance_b_W_K", "W/K", 0.0, 0.0),
        ],
    },
    Effect {
        name: "variable-heat-transfer",
        parameters: &[
            parameter("density_exponent", "1", 0.0, 0.0),
            parameter("flow_W_m2K", "W/(m2 K)", 0.0, 0.0),
        ],
    },
    Effect {
        name: "wall-temperature",
        parameters: &[
            parameter("offset_K", "K", 0.0, COLDEST_WALL_OFFSET_K),
            parameter("heat_capacity_J_K", "J/K", 0.0, 0.0),
            parameter("outer_W_K", "W/K", 0.0, 0.0),
        ],
    },
    Effect {
        name: "dead-volume",
        parameters: &[signed("volume_a_m3", "m3"), signed("volume_b_m3", "m3")],
    },
    Effect {
        name: "pressure-dependent-friction",
        parameters: &[
            signed("per_mean_pressure_N_Pa", "N/Pa"),
            signed("per_pressure_difference_N_Pa", "N/Pa"),
            signed("static_rise_per_mean_pressure_N_Pa", "N/Pa"),
        ],
    },
    Effect {
        name: "position-dependent-friction",
        parameters: &[
            signed("cosine", "1"),
            signed("sine", "1"),
            parameter("wavelength_m", "m", 0.1, SHORTEST_WAVE_M),
            signed("slope_per_m", "1/m"),
            signed("curvature_per_m2", "1/m2"),
        ],
    },
    Effect {
        name: "direction-dependent-friction",
        parameters: &[signed("asymmetry", "1"), signed("viscous_asymmetry", "1")],
    },
    Effect {
        name: "dwell-stiction",
        parameters: &[
            signed("rise_N", "N"),
            parameter("time_constant_s", "s", 1.0, SHORTEST_DWELL_S),
            parameter(
                "forgetting_way_m",
                "m",
                FORGETTING_WAY_M,
                SHORTEST_FORGETTING_M,
            ),
        ],
    },
    Effect {
        name: "stribeck-friction",
        parameters: &[signed("static_excess_N", "N")],
    },
    Effect {
        name: "coulomb-friction",
        parameters: &[
            signed("coulomb_N", "N"),
            EffectParameter {
                key: "bristle_stiffness_N_m",
                unit: "N/m",
                neutral: None,
                least: SOFTEST_BRISTLE_N_M,
            },
        ],
    },
    Effect {
        name: "viscous-friction",
        parameters: &[signed("viscous_Ns_m", "N s/m")],
    },
    Effect {
        name: "load-compliance",
        parameters: &[
            parameter("load_mass_kg", "kg", 0.0, 0.0),
            parameter("stiffness_N_m", "N/m", 0.0, 0.0),
            parameter("damping_Ns_m", "N s/m", 0.0, 0.0),
        ],
    },
    Effect {
        // Stands for the compliance too where it has a mass.
        name: "load-backlash",
        parameters: &[
            parameter("load_mass_kg", "kg", 0.0, 0.0),
            parameter("stiffness_N_m", "N/m", 0.0, 0.0),
            parameter("damping_Ns_m", "N s/m", 0.0, 0.0),
            parameter("gap_m", "m", 0.0, 0.0),
        ],
    },
    Effect {
        name: "constant-force",
        parameters: &[signed("force_N", "N")],
    },
    Effect {
        // No physics with a name: what recordings asked for.
        name: "unknown-force",
        parameters: &[
            // 0: over the position, m; 1: over the velocity, m/s.
            parameter("of_velocity", "1", 0.0, 0.0),
            parameter("from", "m, m/s", -1.0, f64::MIN),
            parameter("to", "m, m/s", 1.0, f64::MIN),
            signed("force_0_N", "N"),
            signed("force_1_N", "N"),
            signed("force_2_N", "N"),
            signed("force_3_N", "N"),
            signed("force_4_N", "N"),
            signed("force_5_N", "N"),
            signed("force_6_N", "N"),
            signed("force_7_N", "N"),
            signed("force_8_N", "N"),
        ],
    },
    Effect {
        // No physics with a name: what recordings asked for of the valve.
        name: "unknown-opening",
        parameters: &[
            parameter("from", "V", 0.0, 0.0),
            parameter("to", "V", 1.0, 0.0),
            signed("shift_0_V", "V"),
            signed("shift_1_V", "V"),
            signed("shift_2_V", "V"),
            signed("shift_3_V", "V"),
            signed("shift_4_V", "V"),
            signed("shift_5_V", "V"),
            signed("shift_6_V", "V"),
            signed("shift_7_V", "V"),
            signed("shift_8_V", "V"),
        ],
    },
    Effect {
        // No physics with a name: what recordings asked for of the gauges of the chambers.
        name: "unknown-reading",
        parameters: &[
            parameter("from", "Pa", 0.0, 0.0),
            parameter("to", "Pa", 1e6, 0.0),
            signed("error_a_0_Pa", "Pa"),
            signed("error_a_1_Pa", "Pa"),
            signed("error_a_2_Pa", "Pa"),
            signed("error_a_3_Pa", "Pa"),
            signed("error_a_4_Pa", "Pa"),
            signed("error_a_5_Pa", "Pa"),
            signed("error_a_6_Pa", "Pa"),
            signed("error_a_7_Pa", "Pa"),
            signed("error_a_8_Pa", "Pa"),
            signed("error_b_0_Pa", "Pa"),
            signed("error_b_1_Pa", "Pa"),
            signed("error_b_2_Pa", "Pa"),
            signed("error_b_3_Pa", "Pa"),
            signed("error_b_4_Pa", "Pa"),
            signed("error_b_5_Pa", "Pa"),
            signed("error_b_6_Pa", "Pa"),
            signed("error_b_7_Pa", "Pa"),
            signed("error_b_8_Pa", "Pa"),
        ],
    },
    Effect {
        name: "end-cushion",
        parameters: &[
            parameter("length_m", "m", 0.0, 0.0),
            parameter("needle_area_m2", "m2", 1e-6, NARROWEST_NEEDLE_M2),
            parameter("buffer_length_m", "m", 0.0, 0.0),
            parameter("buffer_stiffness_N_m", "N/m", 0.0, 0.0),
            parameter("buffer_damping_Ns_m", "N s/m", 0.0, 0.0),
        ],
    },
    Effect {
        name: "pressure-sensor-lag",
        parameters: &[parameter("time_constant_s", "s", 0.0, 0.0)],
    },
    Effect {
        name: "pressure-sensor-offset",
        parameters: &[signed("offset_a_Pa", "Pa"), signed("offset_b_Pa", "Pa")],
    },
    Effect {
        name: "position-time-skew",
        parameters: &[signed("delay_s", "s")],
    },
    Effect {
        name: "slew-limit",
        parameters: &[
            parameter("rising_per_s", "signal/s", 0.0, 0.0),
            parameter("falling_per_s", "signal/s", 0.0, 0.0),
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
pub(crate) fn is_catalogued(name: &str, key: &str, neutral: f64) -> bool {
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
