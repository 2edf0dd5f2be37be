//! A located misfit in the words of an engineer.

use crate::inspect::correlation;
use crate::locate::located::{Located, SINCE_START, Sameness, VariableShare};
use crate::rig::Rig;
use crate::signals::Reading;
use crate::text::plain;

/// Correlation from which a shape is called by its name.
const SHAPE: f64 = 0.8;
/// Energy that "mostly" stands for.
const MOSTLY: f64 = 0.6;
/// ... if it lies in no more than this part of the rows.
const FEW_ROWS: f64 = 0.4;
/// Intervals are the finding if they hold this part of the energy ...
const INTERVAL_ENERGY: f64 = 0.4;
/// ... in no more than this part of the time.
const INTERVAL_TIME: f64 = 0.25;
/// A variable that explains this part is the better finding all the same.
const PLAIN_VARIABLE: f64 = 0.3;

/// What is said of white noise.
pub(crate) const NO_PATTERN: &str = "no pattern over time or state";

/// The phrase: the leading variable, the intervals, an offset, or no pattern.
pub(crate) fn when(located: &Located, sameness: Sameness, rig: &Rig) -> String {
    let intervals = located.interval_share >= INTERVAL_ENERGY
        && located.interval_time <= INTERVAL_TIME
        && !located.intervals.is_empty();
    match located.leading() {
        Some(variable) if !intervals || variable.eta_squared >= PLAIN_VARIABLE => {
            of_variable(variable, rig)
        }
        _ if intervals => of_intervals(located),
        _ if sameness.offset => "constant offset".into(),
        _ if sameness.drifts => "slow drift; no variable explains it beyond chance".into(),
        _ => NO_PATTERN.into(),
    }
}

fn of_intervals(located: &Located) -> String {
    let places: Vec<String> = located
        .intervals
        .iter()
        .take(2)
        .map(|(name, from, to)| format!("{} to {} s of {name}", plain(*from, 4), plain(*to, 4)))
        .collect();
    let rest = located.intervals.len().saturating_sub(places.len());
    let more = if rest > 0 {
        format!(" and {rest} more")
    } else {
        String::new()
    };
    format!(
        "{:.0} % of the squared error in {:.0} % of the time: {}{more}",
        100.0 * located.interval_share,
        100.0 * located.interval_time,
        places.join(", ")
    )
}

fn of_variable(variable: &VariableShare, rig: &Rig) -> String {
    match variable.name {
        "time since reversal" => after(variable, "a reversal"),
        "time since a step of the command" => after(variable, "a step of the command"),
        SINCE_START => over_time(variable),
        _ => over_state(variable, rig),
    }
}

/// "mostly within 0.2 s after a reversal".
fn after(variable: &VariableShare, event: &str) -> String {
    let cumulative = variable.cumulative();
    let bin = cumulative.iter().position(|(energy, _)| *energy >= MOSTLY);
    match bin {
        Some(bin) if cumulative[bin].1 <= FEW_ROWS => {
            let within = upper_edge(variable, bin);
            format!("mostly within {} s after {event}", plain(within, 2))
        }
        _ => format!("depends on the time since {event}"),
    }
}

/// Half way to the next bin.
fn upper_edge(variable: &VariableShare, bin: usize) -> f64 {
    let here = variable.bins[bin].x;
    let next = variable.bins.get(bin + 1).map_or(here, |next| next.x);
    0.5 * (here + next)
}

fn over_time(variable: &VariableShare) -> String {
    let cumulative = variable.cumulative();
    if let Some(bin) = cumulative.iter().position(|(energy, _)| *energy >= MOSTLY)
        && cumulative[bin].1 <= FEW_ROWS
    {
        let within = upper_edge(variable, bin);
        return format!("mostly in the first {} s of a recording", plain(within, 2));
    }
    let (x, size) = (positions(variable), variable.sizes());
    if correlation(&x, &means(variable)).abs() >= SHAPE {
        "drifts during a recording".into()
    } else if correlation(&x, &size) >= SHAPE {
        "increases during a recording".into()
    } else {
        "changes during a recording".into()
    }
}

fn over_state(variable: &VariableShare, rig: &Rig) -> String {
    let name = variable.name;
    if variable.of_size > variable.of_value {
        return of_shape(variable, &variable.sizes(), true, rig);
    }
    let (x, mean) = (positions(variable), means(variable));
    if changes_sign(&x) {
        let sign: Vec<f64> = x.iter().map(|x| x.signum()).collect();
        let (line, step) = (correlation(&x, &mean), correlation(&sign, &mean));
        if step.abs() >= SHAPE && step.abs() > line.abs() {
            return format!("changes sign with {name}");
        }
    }
    of_shape(variable, &mean, false, rig)
}

/// How a curve over the bins runs: with the variable, with its size, or with a
/// largest value somewhere.
fn of_shape(variable: &VariableShare, curve: &[f64], size: bool, rig: &Rig) -> String {
    let name = variable.name;
    let x = positions(variable);
    let (line, even) = (correlation(&x, curve), correlation(&magnitudes(&x), curve));
    let both_signs = changes_sign(&x);
    if both_signs && even.abs() >= SHAPE && even.abs() > line.abs() {
        let verb = if even > 0.0 { "increases" } else { "decreases" };
        return format!("{verb} with the size of the {name}");
    }
    if line.abs() >= SHAPE {
        let verb = match (size, line > 0.0) {
            (true, false) => "decreases in size",
            (false, false) => "decreases",
            _ => "increases",
        };
        return format!("{verb} with {name}");
    }
    let largest = curve
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
        .map_or(0, |(place, _)| place);
    let reading = Reading::of_quantity(rig, variable.unit);
    let place = reading.difference(x.get(largest).copied().unwrap_or(0.0));
    // The command of a valve is counted from its null here, as its opening is.
    let from_null = if name == "command" && rig.valve.is_some() {
        " from the null"
    } else {
        ""
    };
    let at = format!("{} {}", plain(place, 2), reading.unit);
    format!(
        "depends on {name}, largest near {}{from_null}",
        at.trim_end()
    )
}

fn positions(variable: &VariableShare) -> Vec<f64> {
    variable.bins.iter().map(|bin| bin.x).collect()
}

fn means(variable: &VariableShare) -> Vec<f64> {
    variable.bins.iter().map(|bin| bin.mean).collect()
}

fn magnitudes(values: &[f64]) -> Vec<f64> {
    values.iter().map(|value| value.abs()).collect()
}

/// Whether both signs occur among the bins, each at more than the edge.
fn changes_sign(x: &[f64]) -> bool {
    let positive = x.iter().filter(|x| **x > 0.0).count();
    let least = (x.len() / 6).max(1);
    positive >= least && x.len() - positive >= least
}
