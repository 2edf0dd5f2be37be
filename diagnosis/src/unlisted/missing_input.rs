//! What an input of the chambers would have had to be, as a short equation.
//!
//! The input is known window by window, each value with its deviation
//! ([`crate::unlisted::unknown_input`]); a term shows there as its mean over the rows of the window. A constant is an
//! ordinary parameter's.
//!
//! One term: beside it further ones took up what the model is off by within the windows.
//!
//! Limits: a window is a tenth of a second, so what swings faster than some 5 Hz is seen weakened. The
//! equation is said; no rig holds it.

use crate::laws::{Track, median};
use crate::locate::Input;
use crate::rig::Rig;
use crate::unlisted::equation::{self, Equation, Form, Missing, Variable};
use std::ops::Range;

const TIME: &str = "time";

/// A median of the size of a normal variable over its standard deviation.
const MEDIAN_OF_SIZE: f64 = 0.6745;

/// A window, and what it needs.
#[derive(Clone)]
pub(crate) struct Sample {
    pub recording: usize,
    pub rows: Range<usize>,
    pub value: f64,
    pub deviation: f64,
}

/// The equation of what windows of a length need; `None` where none explains it.
pub(crate) fn equation(
    rig: &Rig,
    tracks: &[Track<'_>],
    input: Input,
    (needed, window_s): (&[Sample], f64),
) -> Option<Equation> {
    let variables = variables(rig, tracks, window_s);
    let needed = &scattered(needed);
    let library = variables
        .iter()
        .flat_map(|(variable, forms)| forms.iter().map(move |form| (*form, variable)));
    let shows = |rows: &[Vec<f64>]| -> Vec<f64> {
        let of = |sample: &Sample| {
            let rows = &rows[sample.recording][sample.rows.clone()];
            rows.iter().sum::<f64>() / (rows.len().max(1) as f64 * sample.deviation)
        };
        needed.iter().map(of).collect()
    };
    let constant: Vec<f64> = needed.iter().map(|one| 1.0 / one.deviation).collect();
    let reduced = |samples: &[f64]| equation::without(samples, &constant, &constant);
    let samples: Vec<f64> = needed.iter().map(|one| one.value / one.deviation).collect();
    equation::best(&Missing {
        quantity: input.quantity,
        unit: input.unit,
        samples: reduced(&samples),
        strain: 0.0,
        recording: needed.iter().map(|one| one.recording).collect(),
        shows: &shows,
        reduced: &reduced,
        most_terms: 1,
        library: library.collect(),
    })
}

/// The samples with the deviations that they show from one to the next, where these are larger: what
/// the model is off by within a window is in none of the sensors' noise.
fn scattered(needed: &[Sample]) -> Vec<Sample> {
    let follow = |pair: &&[Sample]| pair[0].recording == pair[1].recording;
    let apart = |pair: &[Sample]| {
        let known = pair[0].deviation.hypot(pair[1].deviation);
        ((pair[1].value - pair[0].value) / known).abs()
    };
    let apart: Vec<f64> = needed.windows(2).filter(follow).map(apart).collect();
    let times = median(apart).map_or(1.0, |size| (size / MEDIAN_OF_SIZE).max(1.0));
    let scaled = |one: &Sample| Sample {
        deviation: times * one.deviation,
        ..one.clone()
    };
    needed.iter().map(scaled).collect()
}

/// A column of a variable in one recording; none where that has no such signal.
type Column<'c> = &'c dyn Fn(&Track<'_>) -> Option<Vec<f64>>;

/// What an input may go with, and in which forms.
fn variables(rig: &Rig, tracks: &[Track<'_>], window_s: f64) -> Vec<(Variable, &'static [Form])> {
    const OVER_TIME: &[Form] = &[Form::Linear, Form::Settling, Form::WaveByRecording];
    const OVER_OPENING: &[Form] = &[Form::Linear, Form::Settling];
    const OVER_PRESSURE: &[Form] = &[Form::Linear, Form::Beyond];
    const OVER_PLACE: &[Form] = &[Form::Linear];
    const OVER_SPEED: &[Form] = &[Form::Linear, Form::Square];
    let null_v = rig.value("valve.null_V").unwrap_or(0.0);
    let mut known = Vec::new();
    let mut add = |name, unit, forms, column: Column<'_>| {
        let columns: Option<Vec<Vec<f64>>> = tracks.iter().map(column).collect();
        let Some(columns) = columns else { return };
        let resolution = if name == TIME { window_s } else { 0.0 };
        let variable = Variable {
            name,
            unit,
            resolution,
            columns,
        };
        let (from, to) = variable.range();
        if from < to {
            known.push((variable, forms));
        }
    };
    let signal = |track: &Track<'_>, name: &str| track.recording.signal(name).map(<[f64]>::to_vec);
    let above_null = |track: &Track<'_>| -> Option<Vec<f64>> {
        let command_v = track.recording.signal("u")?;
        Some(command_v.iter().map(|u| u - null_v).collect())
    };
    add(TIME, "s", OVER_TIME, &|track| {
        let time_s = &track.recording.time_s;
        Some(time_s.iter().map(|time| time - time_s[0]).collect())
    });
    add("command", "V", OVER_SPEED, &above_null);
    add("opening", "V", OVER_OPENING, &|track| {
        Some(above_null(track)?.iter().map(|above| above.abs()).collect())
    });
    add("pressure of chamber A", "Pa", OVER_PRESSURE, &|track| {
        signal(track, "p_a")
    });
    add("pressure of chamber B", "Pa", OVER_PRESSURE, &|track| {
        signal(track, "p_b")
    });
    add("supply pressure", "Pa", OVER_PRESSURE, &|track| {
        signal(track, "p_s")
    });
    add("position", "m", OVER_PLACE, &|track| signal(track, "x"));
    add("velocity", "m/s", OVER_SPEED, &|track| {
        Some(track.motion.as_ref()?.velocity_m_per_s.clone())
    });
    known
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::estimate::Bench;
    use crate::laws::Law;
    use crate::search;
    use crate::unlisted::unknown_input;
    use truth_plant::Strength;

    /// The input that an axis of the other plant asks for, and its equation.
    fn found(seed: u64, effect: &str) -> (&'static str, Equation) {
        let (rig, recordings) = drawn::off_list(seed, Strength::Medium, effect);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let bench = Bench::new(Law::Chambers, &rig, &tracks);
        let baseline = search::baseline(&bench).unwrap();
        let needed = unknown_input::find(&bench, &baseline).unwrap();
        let equation = needed.equation.unwrap();
        println!("{}; {}", equation.text(), equation.share);
        (needed.located.place, equation)
    }

    /// A neighbour that draws from the same supply, 1.310 times a second.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_a_supply_that_swings_is_a_sine_of_time_of_its_frequency() {
        let (place, equation) = found(77, "supply-ripple");
        assert_eq!(place, "supply");
        assert_eq!(equation.terms.len(), 1);
        assert_eq!(equation.terms[0].form, Form::WaveByRecording);
        let (period_s, _) = equation.terms[0].shape.unwrap();
        assert!((period_s * 1.310_256 - 1.0).abs() < 0.01, "{period_s} s");
    }

    /// -2.75 mV/s were drawn; the ordinary parameters take up a part.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_a_null_that_drifts_is_proportional_to_time() {
        let (place, equation) = found(80, "null-drift");
        assert_eq!(place, "valve-command");
        assert_eq!(
            (equation.terms[0].form, equation.terms[0].variable),
            (Form::Linear, TIME)
        );
        let drift_v_per_s = equation.terms[0].coefficients[0].0;
        assert!(
            (-4e-3..-1.4e-3).contains(&drift_v_per_s),
            "{drift_v_per_s} V/s"
        );
    }

    #[test]
    fn prop_samples_that_scatter_are_known_as_they_scatter() {
        let sample = |(index, value): (usize, f64)| Sample {
            recording: index / 4,
            rows: 0..1,
            value,
            deviation: 0.1,
        };
        let of = |values: [f64; 8]| {
            let samples: Vec<Sample> = values.into_iter().enumerate().map(sample).collect();
            scattered(&samples)[0].deviation
        };
        assert!((of([1.0, 1.05, 1.0, 1.05, 3.0, 3.05, 3.0, 3.05]) - 0.1).abs() < 1e-12);
        assert!(of([1.0, 2.0, 1.0, 2.0, 3.0, 4.0, 3.0, 4.0]) > 0.9);
    }
}
