//! Where a model and recordings part: when, and over which state.
//!
//! Responsibilities: from the residuals of one law, per predicted signal, find
//! the stretches of time that hold far more than their part of the misfit, and
//! rank the variables that the misfit goes with.
//!
//! Method. Over time: mean squares of blocks against the whole. Over state: the
//! residual in quantile bins of each variable; the part of its energy that the
//! bins explain is the correlation ratio, corrected for the number of bins with
//! as many independent rows as the residual's own correlation leaves. A misfit
//! may keep its size but change its sign (with the direction of motion, say):
//! the same is asked of the residual's size, and the larger of the two counts.
//!
//! Glossary: *residual*, predicted less recorded; *share*, part of the sum of
//! squares; *eta squared*, part of the energy explained by one variable.
//!
//! Limits: variables are looked at one by one. Variables that go together in a
//! recording (command and velocity) share the credit; the first is named, the
//! others are in the list. What a law integrates is judged by what it is the
//! integral of: the position of a free carriage by the force that its error
//! stands for, the pressure behind a valve by the rate of its error. An error
//! of force or flow would otherwise show long after its cause.

pub(crate) mod kinematics;
mod located;
mod phrase;

use crate::estimate::correlation::integrated_autocorrelation;
use crate::laws::{Law, Motion, Output, Track, median, median_step_s};
pub use crate::locate::located::{Bin, Located, VariableShare};
use crate::locate::located::{SINCE_START, Sameness};
use crate::rig::Rig;

/// Quantile bins of a variable at the most.
const MOST_BINS: usize = 16;
/// ... and at the least, unless values repeat: a shape needs that many.
const LEAST_BINS: usize = 6;
/// Independent rows that a bin needs at the least.
const ROWS_PER_BIN: f64 = 4.0;
/// A variable below this part of the energy is not named.
const LEAST_NAMED: f64 = 0.03;
/// ... and the variance between its bins must stand this many of its own
/// standard deviations over what chance gives.
const NAMED_DEVIATIONS: f64 = 6.0;
/// Recordings that together show what runs alike in all.
const LEAST_SHARED: usize = 3;
/// Independent rows beyond the number of bins without which nothing is said.
const LEAST_FREEDOM: f64 = 4.0;
/// An offset must stand this many standard errors over nought.
const OFFSET_DEVIATIONS: f64 = 5.0;
/// Blocks into which a recording is cut to look for stretches of misfit.
const BLOCKS: usize = 200;
/// Shortest block, rows.
const LEAST_BLOCK_ROWS: usize = 10;
/// A block counts when its mean square exceeds this many times the whole's ...
const BLOCK_FACTOR: f64 = 2.5;
/// ... and by this many standard errors of a mean square of as many rows.
const BLOCK_DEVIATIONS: f64 = 6.0;
/// Stretches that hold less than this part of the misfit are not told.
const LEAST_TOLD: f64 = 0.05;
/// Stretches told.
const MOST_INTERVALS: usize = 12;
/// A mean this much of the energy is an offset.
const OFFSET_SHARE: f64 = 0.5;
/// Recordings whose means have one sign by chance once in eight times or less.
const ONE_SIGN_RECORDINGS: usize = 4;
/// A residual that hangs together over this many rows is no noise.
const DRIFT_ROWS: f64 = 5.0;
/// Half width of the window in which the force behind a position error is
/// taken, s: the position's noise is then far below any friction.
const FORCE_HALF_WINDOW_S: f64 = 0.012;
/// Half width of the window in which the rate of a pressure error is taken, s.
const RATE_HALF_WINDOW_S: f64 = 0.012;
/// Rows on either side of such a window at the least.
const LEAST_HALF_ROWS: f64 = 3.0;

/// The quantity that is off where a scale is.
pub const POSITION: &str = "position";

/// Locates the misfit of a law. `residuals` (predicted less recorded, SI) are
/// by output, recording and row; what is not finite does not count.
pub fn locate(
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    residuals: &[Vec<Vec<f64>>],
) -> Vec<Located> {
    let outputs = law.outputs(rig);
    let mut all: Vec<Located> = outputs
        .iter()
        .zip(residuals)
        .map(|(output, columns)| located(law, rig, tracks, output, columns))
        .collect();
    let part = |one: &Located| (one.rms / one.spread.max(f64::MIN_POSITIVE)).powi(2);
    let whole: f64 = all.iter().map(part).sum();
    for one in &mut all {
        one.share = if whole > 0.0 { part(one) / whole } else { 0.0 };
    }
    all
}

fn located(
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    output: &Output,
    columns: &[Vec<f64>],
) -> Located {
    let judged = Judged::of(law, rig, tracks, output, columns);
    // In a window a position error grows from nought to its end whatever the
    // cause; the force does not.
    let timed = match law.fit_window_s() {
        Some(_) => &judged.columns[..],
        None => columns,
    };
    let stretches = stretches(tracks, timed, correlated_rows(timed));
    let variables = variables(law, rig, tracks, output, &judged);
    found(rig, tracks, output, columns, &judged, stretches, variables)
}

/// An input of a law that is looked at in the place of a signal.
#[derive(Clone, Copy)]
pub(crate) struct Input {
    /// Its place.
    pub place: &'static str,
    /// What it is.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
}

/// What an input would have had to be, over time and state.
pub(crate) fn of_input(
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    input: Input,
    columns: Vec<Vec<f64>>,
) -> Located {
    let outputs = law.outputs(rig);
    let output = Output {
        signal: outputs.first().map_or("", |output| output.signal),
        place: input.place,
        unit: input.unit,
    };
    of_quantity(law, rig, tracks, &output, input.quantity, columns)
}

/// A quantity that is not what a law takes it for, over time and state.
pub(crate) fn of_quantity(
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    output: &Output,
    quantity: &'static str,
    columns: Vec<Vec<f64>>,
) -> Located {
    let judged = Judged {
        quantity,
        unit: output.unit,
        correlated: correlated_rows(&columns),
        columns,
    };
    let columns = &judged.columns;
    let stretches = stretches(tracks, columns, judged.correlated);
    let variables = variables(law, rig, tracks, output, &judged);
    found(rig, tracks, output, columns, &judged, stretches, variables)
}

/// The finding put together.
fn found(
    rig: &Rig,
    tracks: &[Track<'_>],
    output: &Output,
    columns: &[Vec<f64>],
    judged: &Judged,
    stretches: Stretches,
    mut variables: Vec<VariableShare>,
) -> Located {
    let energy = Energy::of(columns);
    let correlated = correlated_rows(columns);
    variables.sort_by(|a, b| {
        let key = |one: &VariableShare| (one.significant, one.eta_squared);
        let (a, b) = (key(a), key(b));
        b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    let mut located = Located {
        place: output.place,
        signal: output.signal,
        unit: output.unit,
        rms: energy.mean_square().sqrt(),
        spread: spread(tracks, output.signal),
        share: 0.0,
        mean: energy.mean(),
        interval_share: stretches.share,
        interval_time: stretches.time_share,
        intervals: stretches.intervals,
        quantity: judged.quantity,
        quantity_unit: judged.unit,
        variables,
        when: String::new(),
    };
    let sameness = Sameness {
        offset: offset_is_real(columns, &energy, correlated),
        drifts: correlated > DRIFT_ROWS,
    };
    located.when = phrase::when(&located, sameness, rig);
    located
}

/// Whether the mean is most of the misfit, and either no chance or of one sign
/// in all of several recordings.
fn offset_is_real(columns: &[Vec<f64>], energy: &Energy, correlated: f64) -> bool {
    let mean = energy.mean();
    let one_sign = columns.len() >= ONE_SIGN_RECORDINGS
        && columns
            .iter()
            .all(|column| Energy::of(std::slice::from_ref(column)).mean() * mean > 0.0);
    let error = energy.mean_square() * correlated / energy.count.max(1) as f64;
    let significant = mean * mean > OFFSET_DEVIATIONS * OFFSET_DEVIATIONS * error;
    mean * mean > OFFSET_SHARE * energy.mean_square() && (one_sign || significant)
}

/// Sums over finite residuals.
#[derive(Clone, Copy, Debug, Default)]
struct Energy {
    sum: f64,
    squares: f64,
    count: usize,
}

impl Energy {
    fn of(columns: &[Vec<f64>]) -> Self {
        let mut energy = Self::default();
        columns.iter().flatten().for_each(|&r| energy.add(r));
        energy
    }

    fn add(&mut self, residual: f64) {
        if residual.is_finite() {
            self.sum += residual;
            self.squares += residual * residual;
            self.count += 1;
        }
    }

    fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    fn mean_square(&self) -> f64 {
        self.squares / self.count.max(1) as f64
    }
}

/// Rows that count as one, the median over the recordings: one recording with
/// a drift should not forbid every finding.
fn correlated_rows(columns: &[Vec<f64>]) -> f64 {
    let lengths = columns
        .iter()
        .map(|column| integrated_autocorrelation(column));
    median(lengths.collect()).unwrap_or(1.0).max(1.0)
}

fn spread(tracks: &[Track<'_>], signal: &str) -> f64 {
    let mut energy = Energy::default();
    let recorded = tracks
        .iter()
        .filter_map(|track| track.recording.signal(signal));
    recorded.flatten().for_each(|&value| energy.add(value));
    (energy.mean_square() - energy.mean().powi(2))
        .max(0.0)
        .sqrt()
}

// Over time.

/// What [`stretches`] finds.
struct Stretches {
    intervals: Vec<(String, f64, f64)>,
    share: f64,
    time_share: f64,
}

/// A run of blocks with far more than their part of the misfit.
#[derive(Clone, Copy)]
struct Stretch {
    recording: usize,
    from: usize,
    to: usize,
    squares: f64,
}

fn stretches(tracks: &[Track<'_>], columns: &[Vec<f64>], correlated: f64) -> Stretches {
    let whole = Energy::of(columns);
    let mut found: Vec<Stretch> = Vec::new();
    for (recording, column) in columns.iter().enumerate() {
        found.extend(stretches_of(recording, column, &whole, correlated));
    }
    found.sort_by(|a, b| b.squares.total_cmp(&a.squares));
    found.truncate(MOST_INTERVALS);
    if squares_of(&found) < LEAST_TOLD * whole.squares {
        found.clear();
    }
    let rows: usize = found.iter().map(|one| one.to - one.from).sum();
    found.sort_by_key(|one| (one.recording, one.from));
    let intervals = found
        .iter()
        .map(|one| {
            let recording = tracks[one.recording].recording;
            let last = one.to.min(recording.len()) - 1;
            let (from_s, to_s) = (recording.time_s[one.from], recording.time_s[last]);
            (recording.name.clone(), from_s, to_s)
        })
        .collect();
    Stretches {
        intervals,
        share: squares_of(&found) / whole.squares.max(f64::MIN_POSITIVE),
        time_share: rows as f64 / whole.count.max(1) as f64,
    }
}

fn squares_of(found: &[Stretch]) -> f64 {
    found.iter().map(|one| one.squares).sum()
}

fn stretches_of(recording: usize, column: &[f64], whole: &Energy, correlated: f64) -> Vec<Stretch> {
    let rows = (column.len() / BLOCKS).max(LEAST_BLOCK_ROWS);
    let independent = (rows as f64 / correlated).max(1.0);
    let deviation = (2.0 / independent).sqrt();
    // The correlation of the residual is no reason to overlook a block that
    // holds many times its part: its standard error counts up to one.
    let factor = BLOCK_FACTOR.max(1.0 + BLOCK_DEVIATIONS * deviation.min(1.0));
    let threshold = factor * whole.mean_square();
    let mut found: Vec<Stretch> = Vec::new();
    for from in (0..column.len()).step_by(rows) {
        let to = (from + rows).min(column.len());
        let mut block = Energy::default();
        column[from..to].iter().for_each(|&r| block.add(r));
        if block.count == 0 || block.mean_square() <= threshold {
            continue;
        }
        match found.last_mut() {
            Some(last) if from <= last.to + rows => {
                last.to = to;
                last.squares += block.squares;
            }
            _ => found.push(Stretch {
                recording,
                from,
                to,
                squares: block.squares,
            }),
        }
    }
    found
}

// Over state.

/// What is binned over the variables.
struct Judged {
    quantity: &'static str,
    unit: &'static str,
    columns: Vec<Vec<f64>>,
    correlated: f64,
}

impl Judged {
    fn of(
        law: Law,
        rig: &Rig,
        tracks: &[Track<'_>],
        output: &Output,
        columns: &[Vec<f64>],
    ) -> Self {
        let pairs = || tracks.iter().zip(columns);
        let (quantity, unit, columns) = match (law, rig.value("carriage.mass_kg")) {
            (Law::Carriage, Some(mass_kg)) => {
                let force = |(track, column): (&Track<'_>, &Vec<f64>)| {
                    missing_force(track, column, mass_kg)
                };
                ("force", "N", pairs().map(force).collect())
            }
            (Law::Chambers, _) if rig.valve.is_some() => {
                let rate = |(track, column): (&Track<'_>, &Vec<f64>)| rate(track, column);
                ("rate of pressure", "Pa/s", pairs().map(rate).collect())
            }
            _ => (output.signal, output.unit, columns.to_vec()),
        };
        let correlated = correlated_rows(&columns);
        Self {
            quantity,
            unit,
            columns,
            correlated,
        }
    }
}

/// Rate of a residual; NaN where it is not finite, and at the ends.
fn rate(track: &Track<'_>, residual: &[f64]) -> Vec<f64> {
    let half = half_rows(track, RATE_HALF_WINDOW_S);
    if residual.iter().any(|error| !error.is_finite()) {
        return vec![f64::NAN; residual.len()];
    }
    Motion::with_half_width(&track.recording.time_s, residual, half).velocity_m_per_s
}

fn half_rows(track: &Track<'_>, half_s: f64) -> usize {
    let step_s = median_step_s(&track.recording.time_s);
    (half_s / step_s).round().max(LEAST_HALF_ROWS) as usize
}

/// The force along +x that the model has too much of: mass times the curvature
/// of the position error, window by window. A window begins where the residual
/// is nought, as the prediction begins with the recorded motion.
fn missing_force(track: &Track<'_>, residual: &[f64], mass_kg: f64) -> Vec<f64> {
    let time_s = &track.recording.time_s;
    let half = half_rows(track, FORCE_HALF_WINDOW_S);
    let mut force = vec![f64::NAN; residual.len()];
    let window_s = Law::Carriage.fit_window_s().unwrap_or(f64::INFINITY);
    for rows in crate::fit::law_problem::windows(time_s, window_s) {
        let (time, errors) = (&time_s[rows.clone()], &residual[rows.clone()]);
        if errors.len() <= 2 * half || errors.iter().any(|error| !error.is_finite()) {
            continue;
        }
        let motion = Motion::with_half_width(time, errors, half);
        let inner = half..errors.len() - half;
        for row in inner {
            force[rows.start + row] = mass_kg * motion.acceleration_m_per_s2[row];
        }
    }
    force
}

/// A variable along the recordings; NaN where it has no value.
struct Variable {
    name: &'static str,
    unit: &'static str,
    columns: Vec<Vec<f64>>,
}

fn variables(
    law: Law,
    rig: &Rig,
    tracks: &[Track<'_>],
    output: &Output,
    judged: &Judged,
) -> Vec<VariableShare> {
    candidates(law, rig, tracks, output)
        .into_iter()
        .filter_map(|variable| explained(&variable, judged))
        .collect()
}

type Column<'c> = &'c dyn Fn(&Track<'_>) -> Option<Vec<f64>>;

/// The variables that signals and law offer.
fn candidates(law: Law, rig: &Rig, tracks: &[Track<'_>], output: &Output) -> Vec<Variable> {
    let null_v = rig.valve.as_ref().map_or(0.0, |valve| valve.null_v);
    let supply_pa = rig.value("supply.pressure_Pa");
    let own = output.signal;
    let pressure_law = law == Law::Chambers;
    let position_unit = if law == Law::Actuator { "1" } else { "m" };
    let command_unit = if law == Law::Actuator { "1" } else { "V" };
    let mut all = Vec::new();
    let mut add = |name, unit, column: Column<'_>| {
        let columns: Option<Vec<Vec<f64>>> = tracks.iter().map(column).collect();
        if let Some(columns) = columns {
            all.push(Variable {
                name,
                unit,
                columns,
            });
        }
    };
    let speed_unit = if law == Law::Actuator { "1/s" } else { "m/s" };
    add("velocity", speed_unit, &|track| {
        Some(track.motion.as_ref()?.velocity_m_per_s.clone())
    });
    if law != Law::Actuator {
        add("acceleration", "m/s2", &|track| {
            Some(track.motion.as_ref()?.acceleration_m_per_s2.clone())
        });
    }
    add("position", position_unit, &|track| signal(track, "x"));
    if pressure_law {
        add("pressure", "Pa", &|track| signal(track, own));
        add("rate of pressure", "Pa/s", &|track| {
            let pressure = track.recording.signal(own)?;
            let motion = Motion::from_position(&track.recording.time_s, pressure);
            Some(motion.velocity_m_per_s)
        });
        add("pressure ratio to supply", "1", &|track| {
            ratio(track, own, supply_pa)
        });
    } else {
        add("chamber A pressure", "Pa", &|track| signal(track, "p_a"));
        add("chamber B pressure", "Pa", &|track| signal(track, "p_b"));
        add("pressure difference", "Pa", &difference);
    }
    add("command", command_unit, &|track| {
        let command = track.recording.signal("u")?;
        Some(command.iter().map(|u| u - null_v).collect())
    });
    add("time since a step of the command", "s", &since_command_step);
    add("time since reversal", "s", &since_reversal);
    add(SINCE_START, "s", &since_start);
    all
}

fn signal(track: &Track<'_>, name: &str) -> Option<Vec<f64>> {
    track.recording.signal(name).map(<[f64]>::to_vec)
}

fn difference(track: &Track<'_>) -> Option<Vec<f64>> {
    let (a, b) = (
        track.recording.signal("p_a")?,
        track.recording.signal("p_b")?,
    );
    Some(a.iter().zip(b).map(|(a, b)| a - b).collect())
}

/// A chamber's pressure over the supply's: choked or not, and which way.
fn ratio(track: &Track<'_>, own: &str, declared_pa: Option<f64>) -> Option<Vec<f64>> {
    let pressure = track.recording.signal(own)?;
    if let Some(supply) = track.recording.signal("p_s") {
        return Some(pressure.iter().zip(supply).map(|(p, s)| p / s).collect());
    }
    let supply_pa = declared_pa?;
    Some(pressure.iter().map(|p| p / supply_pa).collect())
}

fn since_start(track: &Track<'_>) -> Option<Vec<f64>> {
    let first = *track.recording.time_s.first()?;
    Some(
        track
            .recording
            .time_s
            .iter()
            .map(|time| time - first)
            .collect(),
    )
}

/// Time since the command last leapt by a tenth of its range; `None` where it
/// leaps fewer than five times.
fn since_command_step(track: &Track<'_>) -> Option<Vec<f64>> {
    /// A leap, as part of the range.
    const LEAP: f64 = 0.1;
    /// Leaps that make a pattern.
    const LEAST_LEAPS: usize = 5;
    let command = track.recording.signal("u")?;
    let low = command.iter().copied().fold(f64::INFINITY, f64::min);
    let high = command.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let steps = command.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let leaps: Vec<bool> = std::iter::once(false)
        .chain(steps.map(|step| step > LEAP * (high - low)))
        .collect();
    let count = leaps.iter().filter(|leap| **leap).count();
    // A command that leaps on every other row has no time in between.
    let usable = count >= LEAST_LEAPS && count < command.len() / 10;
    usable.then(|| since(&track.recording.time_s, &leaps))
}

/// Time since the motion last turned round.
fn since_reversal(track: &Track<'_>) -> Option<Vec<f64>> {
    /// Slower than this part of the 95 % quantile of speed is rest.
    const REST: f64 = 0.03;
    let velocity = &track.motion.as_ref()?.velocity_m_per_s;
    let mut speeds: Vec<f64> = velocity.iter().map(|v| v.abs()).collect();
    let rank = speeds.len().checked_sub(1)? * 95 / 100;
    let rest = REST * *speeds.select_nth_unstable_by(rank, f64::total_cmp).1;
    let mut direction = 0.0_f64;
    let turns: Vec<bool> = velocity
        .iter()
        .map(|&v| {
            if v.abs() <= rest || v.signum() * direction > 0.0 {
                return false;
            }
            let turned = direction.abs() > 0.0;
            direction = v.signum();
            turned
        })
        .collect();
    Some(since(&track.recording.time_s, &turns))
}

/// Time since the last event; NaN before the first.
fn since(time_s: &[f64], events: &[bool]) -> Vec<f64> {
    let mut last = f64::NAN;
    time_s
        .iter()
        .zip(events)
        .map(|(&time, &event)| {
            if event {
                last = time;
            }
            time - last
        })
        .collect()
}

/// Bins the residual over a variable and weighs what the bins explain. `None`
/// where the variable does not vary.
fn explained(variable: &Variable, judged: &Judged) -> Option<VariableShare> {
    let mut pairs: Vec<(f64, f64)> = variable
        .columns
        .iter()
        .zip(&judged.columns)
        .flat_map(|(x, r)| x.iter().copied().zip(r.iter().copied()))
        .filter(|(x, r)| x.is_finite() && r.is_finite())
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Two series meet by chance as often as the quicker of the two allows
    // (Bartlett): a drifting residual does not forbid a finding over velocity.
    let mut correlated = judged.correlated.min(correlated_rows(&variable.columns));
    let count = |correlated: f64| pairs.len() as f64 / correlated;
    let wanted = ((count(correlated) / ROWS_PER_BIN) as usize).clamp(LEAST_BINS, MOST_BINS);
    let groups = quantile_groups(&pairs, wanted);
    if groups.len() < 2 {
        return None;
    }
    // Time runs the same in every recording: a drift that several share is no accident,
    // and chance is what each has beside it.
    if variable.name == SINCE_START && judged.columns.len() >= LEAST_SHARED {
        let beside = beside(variable, judged, &groups);
        correlated = correlated.min(correlated_rows(&beside));
    }
    let independent = count(correlated);
    let of_value = between_groups(&groups, |residual| residual, independent);
    let of_size = between_groups(&groups, f64::abs, independent);
    let larger = if of_size.share > of_value.share {
        of_size
    } else {
        of_value
    };
    Some(VariableShare {
        name: variable.name,
        unit: variable.unit,
        eta_squared: larger.share,
        of_value: of_value.share,
        of_size: of_size.share,
        significant: larger.share > LEAST_NAMED && larger.deviations > NAMED_DEVIATIONS,
        bins: groups.iter().map(|group| bin(group)).collect(),
    })
}

/// The residual less the mean of its group.
fn beside(variable: &Variable, judged: &Judged, groups: &[&[(f64, f64)]]) -> Vec<Vec<f64>> {
    let ends: Vec<(f64, f64)> = groups
        .iter()
        .filter_map(|group| Some((group.last()?.0, bin(group).mean)))
        .collect();
    let common = |x: f64| {
        let group = ends.partition_point(|(end, _)| *end < x);
        ends.get(group).map_or(f64::NAN, |(_, mean)| *mean)
    };
    let columns = variable.columns.iter().zip(&judged.columns);
    columns
        .map(|(x, r)| x.iter().zip(r).map(|(x, r)| r - common(*x)).collect())
        .collect()
}

/// Cuts sorted pairs into groups of about equal number; equal values of the
/// variable stay together.
fn quantile_groups(pairs: &[(f64, f64)], wanted: usize) -> Vec<&[(f64, f64)]> {
    let mut groups = Vec::new();
    let mut from = 0;
    for group in 1..=wanted {
        let aim = pairs.len() * group / wanted;
        if aim <= from {
            continue;
        }
        let value = pairs[aim - 1].0;
        let to = pairs.partition_point(|pair| pair.0 <= value);
        groups.push(&pairs[from..to]);
        from = to;
    }
    groups
}

fn bin(group: &[(f64, f64)]) -> Bin {
    let mut energy = Energy::default();
    group.iter().for_each(|&(_, residual)| energy.add(residual));
    let mean = energy.mean();
    Bin {
        x: group.iter().map(|pair| pair.0).sum::<f64>() / group.len().max(1) as f64,
        mean,
        sd: (energy.mean_square() - mean * mean).max(0.0).sqrt(),
        count: group.len(),
    }
}

/// What groups explain of a measure of the residual.
#[derive(Clone, Copy, Debug, Default)]
struct Explained {
    /// Part of the residual's energy, corrected for the number of groups.
    share: f64,
    /// Standard deviations of the variance ratio (the F statistic, variance
    /// between the groups over that within) over 1, its value by chance.
    deviations: f64,
}

/// Part of the energy of the residual that the groups explain of a measure of
/// it, about the measure's mean: the correlation ratio corrected for the number
/// of groups, times the measure's variance over the residual's energy.
fn between_groups(
    groups: &[&[(f64, f64)]],
    measure: fn(f64) -> f64,
    independent: f64,
) -> Explained {
    let mut whole = Energy::default();
    let mut between = 0.0;
    for group in groups {
        let mut part = Energy::default();
        group
            .iter()
            .for_each(|&(_, residual)| part.add(measure(residual)));
        between += part.sum * part.sum / part.count.max(1) as f64;
        whole.sum += part.sum;
        whole.squares += part.squares;
        whole.count += part.count;
    }
    let common = whole.sum * whole.sum / whole.count.max(1) as f64;
    let total = whole.squares - common;
    let freedom = independent - groups.len() as f64;
    if total <= 0.0 || freedom < LEAST_FREEDOM {
        return Explained::default();
    }
    let eta_squared = (between - common) / total;
    let left = (1.0 - eta_squared).max(f64::EPSILON);
    let corrected = 1.0 - left * (independent - 1.0) / freedom;
    let parts = groups.len() as f64 - 1.0;
    let variance_ratio = eta_squared / left * freedom / parts;
    Explained {
        share: corrected.max(0.0) * total / whole.squares,
        deviations: (variance_ratio - 1.0) / (2.0 / parts + 2.0 / freedom).sqrt(),
    }
}
