//! Channels that contradict each other or the rig: a unit, a sign, two wires exchanged.
//!
//! Each test asks for what no axis does, whatever it leaves out:
//!
//! * speed and change of position disagree by a factor, or the position lies beyond the stroke;
//! * a chamber's pressure stands above the supply's or below the surroundings';
//! * the command is far beyond what opens the valve altogether;
//! * over strokes to and fro the gas takes work from a carriage that has none to give: its
//!   friction must be paid for, and what a constant force, a spring or the mass lends it takes
//!   back (332 drawn recordings: 56 % and more of the work done either way stays);
//! * the chamber that is fed loses gas (the same recordings: correlations from 0.26).

use super::SignalReport;
use super::fault::{Fault, FaultKind, at_odds_as, floor};
use super::statistics::{as_float, moved, quantile};
use crate::recording::Recording;
use crate::rig::{FeedsAWhen, PositionZero, Rig, Valve};

/// Factor between speed and change of position that is no calibration error, where the two follow
/// each other in all but this.
const SPEED_FACTOR: f64 = 1.5;
/// Units of time over each other: seconds in milliseconds, minutes, microseconds.
const UNITS_OF_TIME: [f64; 3] = [1000.0, 60.0, 1e6];
/// So near to one of them.
const THAT_UNIT: f64 = 0.02;
/// The position may cover this many strokes ...
const STROKE_FACTOR: f64 = 1.5;
/// ... and lie beyond an end by this part of one.
const BEYOND_END: f64 = 0.2;
/// The pressure of a chamber in the median, over the supply's and over the surroundings'.
const OVER_SUPPLY: f64 = 1.2;
const OVER_AMBIENT: f64 = 0.8;
/// One that an exhaust reaches, over the surroundings'.
const EXHAUSTED: f64 = 0.4;
/// The recorded supply over the declared one, either way.
const SUPPLY_FACTOR: f64 = 3.0;
/// The command in the median, over what opens the valve altogether.
const OVER_OPEN: f64 = 5.0;
/// Rows over which work and mass are balanced.
const ROWS: usize = 10;
/// To and fro: the way is this many times the span, which is no less than this part of the
/// stroke.
const TIMES_SPAN: f64 = 3.0;
const LEAST_SPAN: f64 = 0.05;
/// Work and correlation below this are of the wrong sign.
const WRONG_SIGN: f64 = -0.25;

pub(super) fn contradictions(
    rig: &Rig,
    recording: &Recording,
    signals: &[SignalReport],
) -> Vec<Fault> {
    let mut faults: Vec<Fault> = Vec::new();
    faults.extend(speed(recording, signals));
    faults.extend(stroke(rig, recording));
    if let Some(valve) = &rig.valve {
        faults.extend(
            ["p_a", "p_b"]
                .iter()
                .filter_map(|signal| chamber(rig, recording, signal)),
        );
        faults.extend(supply(rig, recording));
        faults.extend(command(valve, recording));
        faults.extend(one_sided(rig, valve, recording));
        faults.extend(signs(rig, valve, recording));
    }
    faults
}

/// A fault of the whole recording.
fn at_odds(recording: &Recording, signal: &str, said: &str) -> Fault {
    at_odds_as(FaultKind::Inconsistent, recording, signal, said)
}

fn quantile_of(values: &[f64], share: f64) -> f64 {
    quantile(&mut values.to_vec(), share)
}

/// Compares changes of position with the path of the speed.
fn speed(recording: &Recording, signals: &[SignalReport]) -> Option<Fault> {
    /// Below this correlation the speed is simply noisy, and one of the two is off by chance.
    const CORRELATED: f64 = 0.95;
    let report = signals.iter().find(|signal| signal.name == "x")?;
    if report.maximum - report.minimum < floor(report) {
        return None;
    }
    let (mut moved_moved, mut moved_path, mut path_path) = (0.0, 0.0, 0.0);
    for window in moved(recording, ROWS)? {
        moved_moved += window.moved_m * window.moved_m;
        moved_path += window.moved_m * window.path_m;
        path_path += window.path_m * window.path_m;
    }
    let correlation = moved_path / (moved_moved * path_path).sqrt();
    let factor = moved_path / moved_moved;
    let fits = (1.0 / SPEED_FACTOR..=SPEED_FACTOR).contains(&factor);
    (correlation.abs() > CORRELATED && !fits).then(|| {
        let is_of_time = UNITS_OF_TIME.iter().any(|unit| {
            [factor, 1.0 / factor]
                .iter()
                .any(|times| (times.abs() / unit - 1.0).abs() < THAT_UNIT)
        });
        let what = if is_of_time {
            "the unit of t is probably wrong, or that of one of the two"
        } else {
            "the unit or the sign of one is wrong"
        };
        let said = format!("is {factor:.4} times the change of x per second; {what}");
        at_odds(recording, "v", &said)
    })
}

/// The position that a thousandth of the rows goes beyond, at either end: a single dropout
/// is another fault.
fn stroke(rig: &Rig, recording: &Recording) -> Option<Fault> {
    const OUTERMOST: f64 = 1e-3;
    let cylinder = rig.cylinder.as_ref()?;
    let (stroke_m, position) = (cylinder.stroke_m?, recording.signal("x")?);
    let low_m = quantile_of(position, OUTERMOST);
    let high_m = quantile_of(position, 1.0 - OUTERMOST);
    let span_m = high_m - low_m;
    if span_m > STROKE_FACTOR * stroke_m {
        let said = format!(
            "covers {span_m:.3} m but the stroke is {stroke_m} m; the unit or the stroke is wrong"
        );
        return Some(at_odds(recording, "x", &said));
    }
    let (zero, end_m) = match cylinder.position_zero? {
        PositionZero::EndA => ("end-a", 0.0),
        PositionZero::MidStroke => ("mid-stroke", -0.5 * stroke_m),
    };
    let beyond_m = BEYOND_END * stroke_m;
    let lies_within = low_m > end_m - beyond_m && high_m < end_m + stroke_m + beyond_m;
    (!lies_within).then(|| {
        let said = format!(
            "lies between {low_m:.3} and {high_m:.3} m, beyond a stroke of {stroke_m} m counted from {zero}; \
             the stroke, `position_zero` or the sensor's `offset` is wrong"
        );
        at_odds(recording, "x", &said)
    })
}

fn chamber(rig: &Rig, recording: &Recording, signal: &str) -> Option<Fault> {
    let pressure = recording.signal(signal)?;
    let recorded_supply = recording
        .signal("p_s")
        .map(|supply| quantile_of(supply, 0.5));
    let declared_supply = rig.supply.as_ref().map(|supply| supply.pressure_pa);
    let supply_pa = recorded_supply.or(declared_supply)?;
    let ambient_pa = rig.ambient_pressure_pa();
    let (low_pa, median_pa) = (quantile_of(pressure, 0.01), quantile_of(pressure, 0.5));
    let bar = |pressure_pa: f64| format!("{:.2} bar absolute", pressure_pa / 1e5);
    let said = if median_pa > OVER_SUPPLY * supply_pa {
        format!(
            "has a median of {}, above the supply pressure of {}; a unit is wrong, or the pressure columns are exchanged",
            bar(median_pa),
            bar(supply_pa)
        )
    } else if median_pa < OVER_AMBIENT * ambient_pa {
        format!(
            "has a median of {}, below ambient pressure; the unit is wrong, or gauge pressure is declared as absolute",
            bar(median_pa)
        )
    } else if low_pa < EXHAUSTED * ambient_pa {
        format!(
            "falls to {}, below any exhaust pressure; it may be gauge pressure declared as absolute",
            bar(low_pa)
        )
    } else {
        return None;
    };
    Some(at_odds(recording, signal, &said))
}

fn supply(rig: &Rig, recording: &Recording) -> Option<Fault> {
    let declared_pa = rig.supply.as_ref()?.pressure_pa;
    let recorded_pa = quantile_of(recording.signal("p_s")?, 0.5);
    let fits = (1.0 / SUPPLY_FACTOR..=SUPPLY_FACTOR).contains(&(recorded_pa / declared_pa));
    (!fits).then(|| {
        let said = format!(
            "stands at {:.4} bar absolute in the median, but the rig declares {:.2}; one of the units is wrong",
            recorded_pa / 1e5,
            declared_pa / 1e5
        );
        at_odds(recording, "p_s", &said)
    })
}

fn command(valve: &Valve, recording: &Recording) -> Option<Fault> {
    let open_v = *valve.opening_v.last()?;
    let away: Vec<f64> = recording
        .signal("u")?
        .iter()
        .map(|command| (command - valve.null_v).abs())
        .collect();
    let away_v = quantile_of(&away, 0.5);
    (away_v > OVER_OPEN * open_v).then(|| {
        let said = format!(
            "is {away_v:.3} V from the valve's null in the median, but {open_v} V open it altogether; \
             the unit, `null_V` or the table of openings is wrong"
        );
        at_odds(recording, "u", &said)
    })
}

/// A command that stays on one side of the null while the carriage goes to and fro.
fn one_sided(rig: &Rig, valve: &Valve, recording: &Recording) -> Option<Fault> {
    let stroke_m = rig.cylinder.as_ref()?.stroke_m?;
    if !goes_to_and_fro(recording.signal("x")?, stroke_m) {
        return None;
    }
    let command = recording.signal("u")?;
    let (low_v, high_v) = (quantile_of(command, 0.0), quantile_of(command, 1.0));
    let is_on_one_side = high_v < valve.null_v || low_v > valve.null_v;
    (is_on_one_side && high_v > low_v).then(|| {
        let said = format!(
            "lies between {low_v:.3} and {high_v:.3} V and never crosses the valve's null of {} V although the carriage goes to and fro; \
             the unit or `null_V` is wrong",
            valve.null_v
        );
        at_odds(recording, "u", &said)
    })
}

/// Signs of pressures, position and command against each other, over strokes to and fro.
fn signs(rig: &Rig, valve: &Valve, recording: &Recording) -> Option<Fault> {
    let stroke_m = rig.cylinder.as_ref()?.stroke_m?;
    let strokes = goes_to_and_fro(recording.signal("x")?, stroke_m);
    if recording.signal("force").is_some() || !strokes {
        return None;
    }
    let work = gas_work(rig, recording).is_some_and(|share| share < WRONG_SIGN);
    let flow = fed(rig, valve, recording).is_some_and(|share| share < WRONG_SIGN);
    let (signal, said) = match (work, flow) {
        (false, false) => return None,
        (true, true) => (
            "p_a",
            "and p_b appear to be exchanged: the gas takes work from the carriage, and the chamber fed by the valve loses gas",
        ),
        (true, false) => (
            "x",
            "has the wrong sign, or p_a and p_b are exchanged together with the valve ports: over full cycles the gas takes work from the carriage (+x enlarges chamber A)",
        ),
        (false, true) => (
            "u",
            "has the wrong sign, or `feeds_a_when` is wrong: the chamber fed by the valve loses gas",
        ),
    };
    Some(at_odds(recording, signal, said))
}

fn goes_to_and_fro(position: &[f64], stroke_m: f64) -> bool {
    let span_m = quantile_of(position, 1.0) - quantile_of(position, 0.0);
    let steps = position.iter().step_by(ROWS);
    let steps: Vec<f64> = steps.copied().collect();
    let way_m: f64 = steps.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    span_m > LEAST_SPAN * stroke_m && way_m > TIMES_SPAN * span_m
}

/// The work that the gas does on the carriage, over all that is done either way.
fn gas_work(rig: &Rig, recording: &Recording) -> Option<f64> {
    rig.carriage.as_ref()?;
    let position = recording.signal("x")?;
    let (p_a, p_b) = (recording.signal("p_a")?, recording.signal("p_b")?);
    let areas_m2 = ["a", "b"].map(|side| rig.value(&format!("cylinder.area_{side}_m2")));
    let [area_a_m2, area_b_m2] = [areas_m2[0]?, areas_m2[1]?];
    let ambient_pa = rig.ambient_pressure_pa();
    let force_n =
        |row: usize| area_a_m2 * (p_a[row] - ambient_pa) - area_b_m2 * (p_b[row] - ambient_pa);
    let works = (ROWS..recording.len()).step_by(ROWS).map(|row| {
        let mean_n = (row - ROWS..row).map(force_n).sum::<f64>() / as_float(ROWS);
        mean_n * (position[row] - position[row - ROWS])
    });
    let (sum, all) = works.fold((0.0, 0.0), |(sum, all), work| {
        (sum + work, all + work.abs())
    });
    (all > 0.0).then(|| sum / all)
}

/// Correlation of the opening towards chamber A with what A gains of pressure times volume
/// and B loses.
fn fed(rig: &Rig, valve: &Valve, recording: &Recording) -> Option<f64> {
    let towards_a = match valve.feeds_a_when {
        FeedsAWhen::AboveNull => 1.0,
        FeedsAWhen::BelowNull => -1.0,
    };
    let (position, command) = (recording.signal("x")?, recording.signal("u")?);
    let (p_a, p_b) = (recording.signal("p_a")?, recording.signal("p_b")?);
    let cylinder = rig.cylinder.as_ref()?;
    let stroke_m = cylinder.stroke_m?;
    let end_m = match cylinder.position_zero? {
        PositionZero::EndA => 0.0,
        PositionZero::MidStroke => -0.5 * stroke_m,
    };
    let energy = |row: usize| {
        let from_a_m = position[row] - end_m;
        p_a[row] * from_a_m - p_b[row] * (stroke_m - from_a_m)
    };
    let (mut both, mut openings, mut gains) = (0.0, 0.0, 0.0);
    for row in (ROWS..recording.len()).step_by(ROWS) {
        let opening = command[row - ROWS..row]
            .iter()
            .map(|command| command - valve.null_v);
        let opening = towards_a * opening.sum::<f64>();
        let gain = energy(row) - energy(row - ROWS);
        both += opening * gain;
        openings += opening * opening;
        gains += gain * gain;
    }
    let scale = (openings * gains).sqrt();
    (scale > 0.0).then(|| both / scale)
}
