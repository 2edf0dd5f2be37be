//! Channels that cannot be true.
//!
//! Each test names its evidence and asks for a wide margin over what chance, a
//! quiet rig or a coarse sensor gives:
//!
//! * dead or frozen: one value for far longer than anywhere else in the
//!   recording, *and* either another channel proves that the quantity moved, or
//!   the declared noise would have moved it.
//! * saturated: long runs at the very largest or smallest value, entered or
//!   left at full slope, or where the declared noise would have moved it.
//! * dropout: a leap and a leap back, both far beyond the signal's own steps.
//! * spikes, held channels, leaps: see the rooms of these names.
//! * at odds with another channel or with the rig: see `contradictions`, `gauges`.
//!
//! A command (`u`, `x_ref`) may hold, leap and saturate; only a command that
//! never changes while the axis goes to and fro is a fault. A single leap
//! without return (a collision, a step of load) is not judged here.

use super::contradictions::contradictions;
use super::fault::{Fault, FaultKind, fault, floor};
use super::gauges;
use super::held::held;
use super::leaps::leaps;
use super::lifeless;
use super::smoothing::smoothed;
use super::spikes::spikes;
use super::statistics::{Run, as_float, ordinary_steps, path, quantile, runs};
use super::{Excitation, SignalReport};
use crate::recording::Recording;
use crate::rig::Rig;

/// Shortest frozen stretch when another channel proves motion, rows.
const FROZEN_ROWS: usize = 30;
/// It must exceed the next longest stretch by this factor.
const FROZEN_FACTOR: usize = 5;
/// Shortest frozen stretch on the evidence of the declared noise alone, rows.
const QUIET_ROWS: usize = 100;
/// It must exceed the next longest stretch by this factor: a rest of a rig with
/// less noise than declared has several long stretches.
const QUIET_FACTOR: usize = 15;
/// Declared noise at least this share of the quantum moves a signal that rests.
const DITHER_SHARE: f64 = 0.5;
/// Chance, over the whole recording, of a stretch as long as the one found.
const CHANCE: f64 = 1e-9;
/// Share of another channel's span that proves motion.
const MOVED_SHARE: f64 = 0.1;
/// A leap is this many times the 99 % quantile of the signal's own steps, which a hundred dropouts in
/// ten thousand rows do not move ...
const LEAP_STEPS: f64 = 10.0;
/// ... and this many times its noise.
const LEAP_NOISE: f64 = 20.0;
/// Shortest run at a rail, rows, and rows in such runs altogether.
const RAIL_RUN_ROWS: usize = 5;
const RAIL_ROWS: usize = 20;
const RAIL_LONGEST_ROWS: usize = 10;
/// The longest run at a rail exceeds the longest elsewhere by this factor.
const RAIL_FACTOR: usize = 4;
/// Slope at the edge of a rail, in noise or quanta a row.
const RAIL_SLOPE: f64 = 3.0;
/// Edges at full slope that prove a rail.
const RAIL_EDGES: usize = 2;
/// A command is dead if the axis reverses this often under it.
const DEAD_COMMAND_REVERSALS: usize = 6;

pub(super) fn faults(
    rig: &Rig,
    recording: &Recording,
    signals: &[SignalReport],
    excitation: &Excitation,
    rate_hz: f64,
) -> Vec<Fault> {
    let ordinary = ordinary_steps(&recording.time_s);
    let mut faults = Vec::new();
    for report in signals {
        let Some(values) = recording.signal(&report.name) else {
            continue;
        };
        let channel = Channel {
            report,
            values,
            recording,
            signals,
            ordinary: &ordinary,
            runs: runs(values),
        };
        match gauges::open_chamber(rig, recording, report, values) {
            Some(gauges::OpenChamber::Fault(open)) => faults.push(open),
            Some(gauges::OpenChamber::Bench(_)) => {}
            None => faults.extend(channel.faults(excitation, rate_hz)),
        }
    }
    let is_held = |name: &str| {
        let mut held = faults.iter().filter(|fault| fault.kind == FaultKind::Held);
        held.any(|fault| fault.signal == name)
    };
    let sampled: Vec<&SignalReport> = signals.iter().filter(|one| !is_held(&one.name)).collect();
    let leaps = leaps(recording, &sampled, &ordinary, rate_hz);
    faults.extend(leaps);
    if let gauges::Supply::Mistaken(fault) = gauges::supply(rig, recording) {
        faults.push(fault);
    }
    faults.extend(gauges::inverted(rig, recording));
    faults.extend(lifeless::lifeless(rig, recording, signals));
    faults.extend(contradictions(rig, recording, signals));
    faults
}

/// One signal with all that it is judged by.
struct Channel<'c> {
    report: &'c SignalReport,
    values: &'c [f64],
    recording: &'c Recording,
    signals: &'c [SignalReport],
    ordinary: &'c [bool],
    runs: Vec<Run>,
}

impl Channel<'_> {
    fn faults(&self, excitation: &Excitation, rate_hz: f64) -> Vec<Fault> {
        if is_command(&self.report.name) {
            return self.dead_command(excitation).into_iter().collect();
        }
        if let Some(fault) = self.dead() {
            return vec![fault];
        }
        if let Some(fault) = held(self.recording, self.report, self.values, rate_hz) {
            return vec![fault];
        }
        // Interference in step with the mains repeats like an average.
        let spikes = spikes(self.recording, self.report, self.values, self.ordinary);
        if !spikes.is_empty() {
            return spikes;
        }
        if let Some(fault) = smoothed(self.recording, self.report, self.values, rate_hz) {
            return vec![fault];
        }
        let dropouts = self.dropouts();
        if !dropouts.is_empty() {
            return dropouts;
        }
        match self.saturated() {
            Some(fault) => vec![fault],
            None => self.frozen().into_iter().collect(),
        }
    }

    fn dead_command(&self, excitation: &Excitation) -> Option<Fault> {
        let reversals = excitation.reversals.unwrap_or(0);
        let dead = self.runs.len() == 1 && reversals >= DEAD_COMMAND_REVERSALS;
        dead.then(|| {
            let why = format!("while the axis reverses {reversals} times");
            self.whole_fault(&why)
        })
    }

    fn dead(&self) -> Option<Fault> {
        let [run] = self.runs[..] else {
            return None;
        };
        if run.length < FROZEN_ROWS {
            return None;
        }
        let why = self.motion_elsewhere(run).or_else(|| self.must_dither())?;
        Some(self.whole_fault(&why))
    }

    fn whole_fault(&self, why: &str) -> Fault {
        let run = Run {
            start: 0,
            length: self.values.len(),
        };
        let said = format!("is dead: {} throughout {why}", self.shown(self.values[0]));
        self.fault(FaultKind::Dead, run, &said)
    }

    fn frozen(&self) -> Option<Fault> {
        let longest = *self.runs.iter().max_by_key(|run| run.length)?;
        let value = self.values[longest.start];
        let is_clipped = self.is_extreme(longest);
        // A position that is clipped holds the same value each time, and often both ends.
        let next = self.longest_run(|run| {
            let own = self.values[run.start].to_bits() == value.to_bits();
            run != longest && !(is_clipped && (own || self.is_extreme(run)))
        });
        if longest.length < FROZEN_ROWS || !self.beyond_chance(longest) {
            return None;
        }
        let moved = (longest.length >= FROZEN_FACTOR * next)
            .then(|| self.motion_elsewhere(longest))
            .flatten();
        let quiet = longest.length >= QUIET_ROWS && longest.length >= QUIET_FACTOR * next;
        let quiet = quiet && self.dithers_at_rest(longest);
        let why = moved.or_else(|| quiet.then(|| self.must_dither()).flatten())?;
        let said = format!(
            "is frozen at {} for {} rows {why}; elsewhere it holds for {next} rows at most",
            self.shown(self.values[longest.start]),
            longest.length,
        );
        Some(self.fault(FaultKind::Frozen, longest, &said))
    }

    /// Whether a run holds the largest or the smallest value.
    fn is_extreme(&self, run: Run) -> bool {
        let held = self.values[run.start].to_bits();
        [self.report.maximum, self.report.minimum]
            .iter()
            .any(|extreme| extreme.to_bits() == held)
    }

    fn longest_run(&self, wanted: impl Fn(Run) -> bool) -> usize {
        let runs = self.runs.iter().filter(|run| wanted(**run));
        runs.map(|run| run.length).max().unwrap_or(0)
    }

    /// Whether repeats as frequent as elsewhere in the recording could not
    /// add up to this run.
    fn beyond_chance(&self, run: Run) -> bool {
        let rows = as_float(self.values.len());
        let elsewhere = self.values.len() - run.length;
        let repeats = elsewhere.saturating_sub(self.runs.len() - 1);
        let chance = as_float(repeats) / as_float(elsewhere.max(1));
        rows * chance.powf(as_float(run.length)) < CHANCE
    }

    /// Proof by another channel that this one must have changed in the run.
    fn motion_elsewhere(&self, run: Run) -> Option<String> {
        match self.report.name.as_str() {
            "x" => self.speed_proves_motion(run),
            "v" => self.position_contradicts(run),
            "p_a" | "p_b" | "force" => self.moved("x", run),
            _ => None,
        }
    }

    fn moved(&self, other: &str, run: Run) -> Option<String> {
        let report = self.signals.iter().find(|signal| signal.name == other)?;
        let values = &self.recording.signal(other)?[run.start..run.end()];
        let low = values.iter().copied().reduce(f64::min)?;
        let high = values.iter().copied().reduce(f64::max)?;
        let least = (MOVED_SHARE * (report.maximum - report.minimum)).max(floor(report));
        (high - low > least)
            .then(|| format!("while {other} moves by {:.3e} {}", high - low, report.unit))
    }

    fn speed_proves_motion(&self, run: Run) -> Option<String> {
        let path = self.way_by_speed(run)?;
        let least = 0.5 * MOVED_SHARE * (self.report.maximum - self.report.minimum);
        let proven = path.abs() > least.max(floor(self.report)) && self.speed_is_alive(run);
        proven.then(|| format!("while v adds up to {path:.3e} m"))
    }

    /// A path added up from mere noise or offset of the speed proves nothing.
    fn speed_is_alive(&self, run: Run) -> bool {
        let report = self.signals.iter().find(|signal| signal.name == "v");
        let (Some(report), Some(speed)) = (report, self.recording.signal("v")) else {
            return false;
        };
        let speed = &speed[run.start..run.end()];
        let fastest = speed.iter().fold(0.0_f64, |most, one| most.max(one.abs()));
        let overall = report.maximum.max(-report.minimum);
        fastest > 10.0 * report.noise && fastest > 0.02 * overall
    }

    /// Under a constant speed the position runs straight in time, whatever the
    /// calibration of either; a bend, or motion under a speed of 0, disproves
    /// it.
    fn position_contradicts(&self, run: Run) -> Option<String> {
        let report = self.signals.iter().find(|signal| signal.name == "x")?;
        let position = &self.recording.signal("x")?[run.start..run.end()];
        let time_s = &self.recording.time_s[run.start..run.end()];
        let duration_s = time_s[time_s.len() - 1] - time_s[0];
        // Within its quantum even a sound speed may change unseen.
        let measured = self.report.quantum.unwrap_or(0.0);
        let quantum = measured.max(self.report.declared_resolution.unwrap_or(0.0));
        let least = floor(report).max(duration_s * quantum);
        let path = self.path_by_speed(run)?;
        let moved = position[position.len() - 1] - position[0];
        let stands = (path.abs() < 0.1 * moved.abs()).then_some(moved.abs());
        let off = bend(time_s, position).max(stands.unwrap_or(0.0));
        (off > least).then(|| format!("while x departs from uniform motion by {off:.3e} m"))
    }

    /// The farthest that the speed leads away within a run: what is clipped comes back to where it
    /// left.
    fn way_by_speed(&self, run: Run) -> Option<f64> {
        let speed = &self.recording.signal("v")?[run.start..run.end()];
        let time_s = &self.recording.time_s[run.start..run.end()];
        let mut at_m = 0.0;
        let steps = time_s.windows(2).zip(speed.windows(2));
        let ways = steps.map(|(time, speed)| {
            at_m += 0.5 * (speed[0] + speed[1]) * (time[1] - time[0]);
            at_m
        });
        ways.max_by(|one, other| one.abs().total_cmp(&other.abs()))
    }

    fn path_by_speed(&self, run: Run) -> Option<f64> {
        let speed = &self.recording.signal("v")?[run.start..run.end()];
        let time_s = &self.recording.time_s[run.start..run.end()];
        Some(path(time_s, speed))
    }

    /// Proof by the declared noise.
    fn must_dither(&self) -> Option<String> {
        let noise = self.report.declared_noise?;
        let quantum = match (self.report.declared_resolution, self.report.quantum) {
            (Some(declared), Some(measured)) => declared.max(measured),
            (Some(declared), None) => declared,
            (None, Some(measured)) => measured,
            // Constant throughout and no resolution declared: it may be coarse.
            (None, None) => return None,
        };
        (noise >= DITHER_SHARE * quantum).then(|| {
            format!(
                "although its noise is {noise:.3e} {unit} and its quantum {quantum:.3e} {unit}",
                unit = self.report.unit
            )
        })
    }

    /// Whether the signal is seen to dither where it rests outside the run:
    /// some sensors have a dead band, and show noise only in motion.
    fn dithers_at_rest(&self, run: Run) -> bool {
        const ROWS: usize = 25;
        const LEAST_WINDOWS: usize = 5;
        const DITHERING_SHARE: f64 = 0.9;
        let Some(noise) = self.report.declared_noise else {
            return false;
        };
        let quiet_span = 8.0 * noise + 2.0 * self.report.quantum.unwrap_or(0.0);
        let outside = self.values[..run.start]
            .chunks_exact(ROWS)
            .chain(self.values[run.end()..].chunks_exact(ROWS));
        let quiet: Vec<&[f64]> = outside.filter(|rows| span(*rows) <= quiet_span).collect();
        let dithering = quiet.iter().filter(|rows| dithers(rows)).count();
        dithering >= LEAST_WINDOWS && as_float(dithering) >= DITHERING_SHARE * as_float(quiet.len())
    }

    fn saturated(&self) -> Option<Fault> {
        // An end stop holds a position as a rail would.
        if self.report.name == "x" {
            return None;
        }
        [self.report.maximum, self.report.minimum]
            .into_iter()
            .find_map(|rail| self.saturated_at(rail))
    }

    #[expect(clippy::float_cmp, reason = "a rail repeats its bits")]
    fn saturated_at(&self, rail: f64) -> Option<Fault> {
        let at_rail = |run: Run| self.values[run.start] == rail;
        let held: Vec<Run> = self
            .runs
            .iter()
            .copied()
            .filter(|run| at_rail(*run) && run.length >= RAIL_RUN_ROWS)
            .collect();
        let rows: usize = held.iter().map(|run| run.length).sum();
        let longest = *held.iter().max_by_key(|run| run.length)?;
        // A channel that is clipped at one end often is at the other too.
        let elsewhere = self.longest_run(|run| !self.is_extreme(run));
        let long = longest.length >= RAIL_LONGEST_ROWS.max(RAIL_FACTOR * elsewhere);
        if rows < RAIL_ROWS || !long || !self.beyond_chance(longest) {
            return None;
        }
        let edges: usize = held.iter().map(|run| self.steep_edges(*run)).sum();
        let quiet = longest.length >= QUIET_ROWS.max(QUIET_FACTOR * elsewhere);
        let must_move = || {
            self.motion_elsewhere(longest).is_some()
                || (self.must_dither().is_some() && self.dithers_at_rest(longest))
        };
        if edges < RAIL_EDGES && !(quiet && must_move()) {
            return None;
        }
        let whole = Run {
            start: held[0].start,
            length: held[held.len() - 1].end() - held[0].start,
        };
        let said = format!(
            "is saturated at {}: {rows} rows in {} stretches, the longest {} rows",
            self.shown(rail),
            held.len(),
            longest.length,
        );
        Some(self.fault(FaultKind::Saturated, whole, &said))
    }

    /// How many of a run's two edges the signal reaches at full slope.
    fn steep_edges(&self, run: Run) -> usize {
        const ROWS: usize = 3;
        let quantum = self.report.quantum.unwrap_or(0.0);
        let steep = RAIL_SLOPE * self.report.noise.max(quantum) * as_float(ROWS);
        let rail = self.values[run.start];
        let before = run.start.checked_sub(ROWS);
        let before = before.map(|place| (self.values[place] - rail).abs());
        let after = self.values.get(run.end() - 1 + ROWS);
        let after = after.map(|value| (value - rail).abs());
        [before, after]
            .into_iter()
            .flatten()
            .filter(|edge| *edge > steep)
            .count()
    }

    fn dropouts(&self) -> Vec<Fault> {
        if self.report.name == "a" {
            return Vec::new();
        }
        let leaps = self.leaps();
        let mut faults = Vec::new();
        let mut place = 0;
        while place + 1 < leaps.len() {
            let (away, back) = (leaps[place], leaps[place + 1]);
            if !returns(away.1, back.1) || !self.is_material(away, back) {
                place += 1;
                continue;
            }
            faults.push(self.dropout(away.0, back.0));
            place += 2;
        }
        faults
    }

    /// Whether a leap stands out of what the signal covers otherwise. A force
    /// leaps by nature, at a break-away or a collision.
    fn is_material(&self, away: (usize, f64), back: (usize, f64)) -> bool {
        const SHARE: f64 = 0.2;
        const FORCE_SHARE: f64 = 1.5;
        let share = if self.report.name == "force" {
            FORCE_SHARE
        } else {
            SHARE
        };
        let before = &self.values[..away.0];
        let rest = before.iter().chain(&self.values[back.0..]);
        away.1.abs() > share * span(rest)
    }

    /// The rows that the signal enters by a leap, with the leap.
    fn leaps(&self) -> Vec<(usize, f64)> {
        let steps = || {
            self.values
                .windows(2)
                .zip(self.ordinary)
                .enumerate()
                .filter(|(_, (_, ordinary))| **ordinary)
                .map(|(place, (pair, _))| (place + 1, pair[1] - pair[0]))
        };
        let mut sizes: Vec<f64> = steps().map(|(_, step)| step.abs()).collect();
        let share = usual_share(sizes.len());
        let usual = quantile(&mut sizes, share);
        let quantum = self.report.quantum.unwrap_or(0.0);
        let least = (LEAP_STEPS * usual)
            .max(LEAP_NOISE * self.report.noise)
            .max(LEAP_NOISE * quantum);
        steps().filter(|(_, step)| step.abs() > least).collect()
    }

    fn dropout(&self, away: usize, back: usize) -> Fault {
        let run = Run {
            start: away,
            length: back - away,
        };
        let said = format!(
            "drops out for {} rows: from {} to {} and back to {}",
            run.length,
            self.shown(self.values[away - 1]),
            self.shown(self.values[away]),
            self.shown(self.values[back]),
        );
        self.fault(FaultKind::Dropout, run, &said)
    }

    fn shown(&self, value: f64) -> String {
        format!("{value:.6} {}", self.report.unit)
    }

    fn fault(&self, kind: FaultKind, run: Run, said: &str) -> Fault {
        fault(self.recording, &self.report.name, kind, run, said)
    }
}

/// The share of a signal's steps that are taken as usual: all but one in a
/// hundred, and in a short recording all but a few.
fn usual_share(steps: usize) -> f64 {
    let few = 1.0 - 8.0 / as_float(steps.max(1));
    few.clamp(0.9, 0.99)
}

/// The largest minus the smallest value; 0 for none.
fn span<'v>(values: impl IntoIterator<Item = &'v f64>) -> f64 {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values
        .into_iter()
        .fold(start, |(low, high), one| (low.min(*one), high.max(*one)));
    (high - low).max(0.0)
}

/// Whether values go up and down from row to row, as noise does and a slow
/// drift through the quanta does not.
fn dithers(values: &[f64]) -> bool {
    const CHANGED_SHARE: f64 = 0.2;
    const TURNED_SHARE: f64 = 0.4;
    let steps: Vec<f64> = values
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step| step.abs() > 0.0)
        .collect();
    let turned = steps
        .windows(2)
        .filter(|pair| pair[0] * pair[1] < 0.0)
        .count();
    as_float(steps.len()) >= CHANGED_SHARE * as_float(values.len())
        && as_float(turned) >= TURNED_SHARE * as_float(steps.len())
}

/// Whether the second leap undoes the first; the signal may have moved on in
/// between.
fn returns(away: f64, back: f64) -> bool {
    const ALIKE: f64 = 3.0;
    let ratio = -back / away;
    (1.0 / ALIKE..=ALIKE).contains(&ratio)
}

fn is_command(name: &str) -> bool {
    matches!(name, "u" | "x_ref")
}

/// The largest distance of a position from the straight line between its ends.
fn bend(time_s: &[f64], position: &[f64]) -> f64 {
    let last = position.len() - 1;
    let duration_s = time_s[last] - time_s[0];
    if duration_s <= 0.0 {
        return 0.0;
    }
    let slope = (position[last] - position[0]) / duration_s;
    let line = |time: f64| position[0] + slope * (time - time_s[0]);
    time_s
        .iter()
        .zip(position)
        .fold(0.0, |most, (time, x)| most.max((x - line(*time)).abs()))
}
