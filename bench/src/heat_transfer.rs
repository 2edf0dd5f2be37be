//! Heat transfer by the stop method, figures 8 and 9 of the paper.
//!
//! A chamber at the end of the stroke is charged or discharged and shut at once. Its mass then
//! stays, and when its gas has taken the wall's temperature the settled pressure says what the
//! mass is: so the temperature at the stop was (the paper's (7))
//!
//! ```text
//! T(t) = T_wall p(t) / p_settled
//! ```
//!
//! The recorded pressure from the begin to the stop says the same mass by the energy balance
//! ([`crate::fixed_volume`]), if the heat transfer is right. It is the one number by which both
//! masses agree in all runs; no flow law is asked. Runs of several lengths say besides whether it
//! changes while the gas flows: a straight line over the time since the opening.

use std::ops::Range;

use grey_box::fit::Parameter;
use grey_box::laws::Track;
use grey_box::model::{Side, Values};
use grey_box::rig::Rig;
use model_core::chamber::stop_method_temperature_k;
use model_core::valve::GasState;

use crate::fixed_volume::{Content, Vessel};
use crate::least_squares::{Solved, fitted};
use crate::outcome::{Kind, Number, Outcome, Picture, Stretch};
use crate::settling::{Leak, Reference, Settled, extrapolated, settled};
use crate::steady;

/// The outcome depends on numbers under these sections.
pub const DEPENDS_ON: &[&str] = &["cylinder.", "vessel.", "environment.", "gas."];
/// A valve has shut so long after its command, s: spools take some ms. From there on the pressure
/// is read, and extrapolated to the command: gas at rest has another heat transfer.
const SHUTTING_S: f64 = 0.03;
/// The first of the settling, from which it is extrapolated, s.
const EARLY_S: f64 = 0.4;
/// The pressure at the begin is read from so much rest, s.
const REST_S: f64 = 0.5;
/// A shorter rest does not say it, s.
const LEAST_REST_S: f64 = 0.05;
/// A run changes the pressure by this at least, Pa: less says little of the temperature.
const LEAST_CHANGE_PA: f64 = 2e4;
/// So many time constants after a stop the gas has the wall's temperature, to a part in 150.
const SETTLED_AFTER: f64 = 5.0;
/// How far what has leaked may be off the shut valve's law: the ratio of its leakages is hardly known.
const LEAK_ERROR: f64 = 0.3;
/// A command within this part of the recorded range of the shut one is shut.
const SHUT_SHARE: f64 = 0.01;
/// A chamber of which more than this is dead volume has a surface that the cylinder does not say.
const MOST_DEAD_SHARE: f64 = 0.5;
/// Heat transfer changes over time beyond so many deviations of the change.
const CHANGES: f64 = 3.0;
/// The heat transfer that is sought, W/(m2 K).
const RANGE: (f64, f64) = (0.0, 5000.0);

/// One run: opened at rest, stopped, settled.
struct Run {
    recording: String,
    side: Side,
    vessel: Vessel,
    /// From the opening to the stop.
    time_s: Vec<f64>,
    pressure_pa: Vec<f64>,
    stop_pa: f64,
    settled: Settled,
    /// Of the pressures at the begin and at the stop.
    end_deviations_pa: [f64; 2],
    fills: bool,
}

/// Evaluates runs of the stop method.
///
/// # Errors
/// If no recording holds such a run, or the rig does not say the volume.
pub fn measure(rig: &Rig, tracks: &[Track<'_>]) -> Result<Outcome, String> {
    let mut runs: Vec<Run> = Vec::new();
    let mut notes = Vec::new();
    for track in tracks {
        for side in Side::BOTH {
            runs_of(rig, track, side, (&mut runs, &mut notes))?;
        }
    }
    if runs.is_empty() {
        let why = notes
            .first()
            .map_or(String::new(), |why| format!(" ({why})"));
        return Err(format!(
            "no run of the stop method was found{why}: a rest, the valve opened for a while, and shut until the pressure has settled"
        ));
    }
    let mut numbers = Vec::new();
    let mut found = [None, None];
    for (fills, key) in [
        (true, "chambers.heat_transfer_charging_W_m2K"),
        (false, "chambers.heat_transfer_discharging_W_m2K"),
    ] {
        let of_kind: Vec<&Run> = runs.iter().filter(|one| one.fills == fills).collect();
        if of_kind.is_empty() {
            continue;
        }
        let (value, deviation) = heat_transfer(&of_kind)?.at(0);
        numbers.push(Number::of_key(key, value, deviation));
        let over_time = Course::of(&of_kind);
        notes.extend(over_time.map(|course| course.sentence(fills)));
        found[usize::from(!fills)] = Some(Found {
            constant: value,
            over_time,
        });
    }
    numbers.extend(at_rest(&runs));
    notes.extend(what_is_missing(found));
    Ok(Outcome {
        title: "Heat transfer",
        method: "The stop method: after the valve has shut, the settled pressure says the mass of the gas, and with it \
                 the temperature at the stop. The pressure up to the stop says the same mass by the energy balance if \
                 the heat transfer is right; it is the one number by which both agree in all runs.",
        numbers,
        stretches: runs.iter().map(Run::stretch).collect(),
        notes,
        pictures: pictures(rig, &runs, found),
        ..Outcome::default()
    })
}

/// The runs of one chamber in one recording.
fn runs_of(
    rig: &Rig,
    track: &Track<'_>,
    side: Side,
    (runs, notes): (&mut Vec<Run>, &mut Vec<String>),
) -> Result<(), String> {
    let recording = track.recording;
    let command = recording.signal("u").ok_or(
        "no command is recorded: it says when the valve was opened and when it was stopped",
    )?;
    let Some(pressure_pa) = recording.signal(side.pressure_signal()) else {
        return Ok(());
    };
    let mut settles_at_s = f64::NEG_INFINITY;
    for (open, shut) in cycles(command) {
        let opened_s = recording.time_s[open];
        if opened_s < settles_at_s {
            notes.push(format!(
                "{}: at {opened_s:.2} s the valve opens before the gas has settled from the stop before, {SETTLED_AFTER} time constants; the run is left out",
                recording.name
            ));
            continue;
        }
        match run(rig, track, (side, pressure_pa), (open, shut)) {
            Ok(Some(one)) => {
                settles_at_s = one.stop_s() + SETTLED_AFTER * one.settled.time_constant_s;
                runs.push(one);
            }
            Ok(None) => {}
            Err(why) => notes.push(format!("{}: {why}", recording.name)),
        }
    }
    Ok(())
}

/// Rows at which the valve is opened and shut again; shut is what the recording ends with.
pub(crate) fn cycles(command: &[f64]) -> Vec<(usize, usize)> {
    let Some(&shut) = command.last() else {
        return Vec::new();
    };
    let range = command
        .iter()
        .map(|one| (one - shut).abs())
        .fold(0.0, f64::max);
    let is_shut = |row: usize| (command[row] - shut).abs() <= SHUT_SHARE * range;
    let mut cycles = Vec::new();
    let mut opened = None;
    for row in 1..command.len() {
        match (is_shut(row - 1), is_shut(row)) {
            (true, false) => opened = Some(row),
            (false, true) => cycles.extend(opened.take().map(|open| (open, row))),
            _ => {}
        }
    }
    cycles
}

fn run(
    rig: &Rig,
    track: &Track<'_>,
    (side, pressure_pa): (Side, &[f64]),
    (open, shut): (usize, usize),
) -> Result<Option<Run>, String> {
    let time_s = &track.recording.time_s;
    let command = track.recording.signal("u").unwrap_or(&[]);
    let rest = rest_before(time_s, command, open);
    if (pressure_pa[shut] - pressure_pa[open]).abs() < LEAST_CHANGE_PA {
        return Ok(None);
    }
    let opened_s = time_s[open];
    if opened_s - time_s[rest.start] < LEAST_REST_S {
        return Err(format!(
            "at {opened_s:.2} s the valve opens without a rest before"
        ));
    }
    let positions = track.recording.signal("x");
    let position_m = positions.map_or(0.0, |all| steady::mean(&all[rest.start..shut]));
    let vessel = Vessel::of(rig, side, position_m)?;
    if is_mostly_dead(rig, side, position_m) {
        return Ok(None);
    }
    let noise_pa = steady::signal_noise(rig, side.pressure_signal(), pressure_pa);
    let stop = stopped(rig, track, (side, vessel), (shut, noise_pa))?;
    let begin_deviation_pa = noise_pa / (rest.len() as f64).sqrt();
    let mut open_pa = pressure_pa[open..=shut].to_vec();
    // Both ends of the balance: what the rest and the settling say of them is quieter than a row.
    open_pa[0] = steady::mean(&pressure_pa[rest]);
    open_pa[shut - open] = stop.pressure_pa;
    Ok(Some(Run {
        recording: track.recording.name.clone(),
        side,
        vessel,
        time_s: time_s[open..=shut].to_vec(),
        fills: stop.settled.pressure_pa > open_pa[0],
        pressure_pa: open_pa,
        stop_pa: stop.pressure_pa,
        settled: stop.settled,
        end_deviations_pa: [begin_deviation_pa, stop.deviation_pa],
    }))
}

/// The pressure at a stop, and where it settles.
struct Stop {
    pressure_pa: f64,
    deviation_pa: f64,
    settled: Settled,
}

fn stopped(
    rig: &Rig,
    track: &Track<'_>,
    (side, vessel): (Side, Vessel),
    (shut, noise_pa): (usize, f64),
) -> Result<Stop, String> {
    let time_s = &track.recording.time_s;
    let command = track.recording.signal("u").unwrap_or(&[]);
    let shown_pa = track
        .recording
        .signal(side.pressure_signal())
        .unwrap_or(&[]);
    let is_other = |row: &usize| (command[*row] - command[shut]).abs() > f64::EPSILON;
    let until = (shut..command.len()).find(is_other).unwrap_or(time_s.len());
    let at = |later_s: f64| {
        let end_s = time_s[shut] + later_s;
        time_s.partition_point(|time| *time < end_s).min(until)
    };
    let (rows, early) = (at(SHUTTING_S)..until, at(SHUTTING_S)..at(EARLY_S));
    let leak = leak(rig, track, (side, vessel), rows.clone());
    let settled = settled(
        &time_s[rows.clone()],
        &shown_pa[rows],
        (&leak, Reference::Begin),
        (noise_pa, vessel.gas.heat_capacity_ratio),
    )?;
    let (pressure_pa, deviation_pa) = extrapolated(
        &time_s[early.clone()],
        &shown_pa[early],
        time_s[shut],
        noise_pa,
    )?;
    Ok(Stop {
        pressure_pa,
        deviation_pa,
        settled,
    })
}

/// What the shut valve lets through at the recorded pressures, up to a factor: its leakages are in
/// the ratio of the rig file's. Without a valve in the rig file a leak is taken as the same all the
/// time.
fn leak(rig: &Rig, track: &Track<'_>, (side, vessel): (Side, Vessel), rows: Range<usize>) -> Leak {
    let recording = track.recording;
    let time_s = &recording.time_s[rows.clone()];
    let values = Values::<f64>::of(rig);
    let (Some(Ok(valve)), Some(pressure_pa)) =
        (values.valve(), recording.signal(side.pressure_signal()))
    else {
        return Leak::steady(time_s);
    };
    let ambient = values.ambient();
    let declared_pa = values.get("supply.pressure_Pa");
    let supply_pa = |row: usize| recording.signal("p_s").map(|all| all[row]).or(declared_pa);
    let shut_m2 = [valve.supply.area_m2(0.0), valve.exhaust.area_m2(0.0)];
    let at = |pressure_pa| GasState {
        pressure_pa,
        ..ambient
    };
    let pa_per_kg = vessel.settled_pa(1.0);
    let mut course_pa = Vec::from_iter((!rows.is_empty()).then_some(0.0));
    for row in rows.skip(1) {
        let Some(supply_pa) = supply_pa(row) else {
            return Leak::steady(time_s);
        };
        let here = at(pressure_pa[row]);
        let fed = valve.law.flow(shut_m2[0], at(supply_pa), here);
        let vented = valve.law.flow(shut_m2[1], here, ambient);
        let into_kg_per_s = fed.mass_flow_kg_per_s - vented.mass_flow_kg_per_s;
        let dt_s = recording.time_s[row] - recording.time_s[row - 1];
        course_pa.push(course_pa[course_pa.len() - 1] + into_kg_per_s * dt_s * pa_per_kg);
    }
    Leak {
        course_pa,
        error: LEAK_ERROR,
    }
}

/// The last of the rest before a row.
fn rest_before(time_s: &[f64], command: &[f64], open: usize) -> Range<usize> {
    let mut from = open;
    while from > 0
        && time_s[open] - time_s[from - 1] <= REST_S
        && (command[from - 1] - command[open - 1]).abs() <= f64::EPSILON
    {
        from -= 1;
    }
    from..open
}

fn is_mostly_dead(rig: &Rig, side: Side, position_m: f64) -> bool {
    let geometry = Values::<f64>::of(rig).geometry(side);
    rig.vessel.is_none()
        && geometry
            .is_some_and(|one| one.dead_volume_m3 > MOST_DEAD_SHARE * one.volume_m3(position_m))
}

impl Run {
    /// With a heat transfer over the time since the opening.
    fn contents(&self, heat_transfer: &dyn Fn(f64) -> f64) -> Vec<Content> {
        let start = self.vessel.settled(self.pressure_pa[0]);
        self.vessel.contents_over(
            &self.time_s,
            &self.pressure_pa,
            start,
            (heat_transfer, self.fills),
        )
    }

    /// What the pressure settles at by the balance, Pa.
    fn predicted_pa(&self, heat_transfer: &dyn Fn(f64) -> f64) -> f64 {
        let contents = self.contents(heat_transfer);
        self.vessel
            .settled_pa(contents.last().map_or(f64::NAN, |end| end.mass_kg))
    }

    fn deviation_pa(&self) -> f64 {
        let [begin_pa, stop_pa] = self.end_deviations_pa;
        let linearity_pa = steady::GAUGE_LINEARITY * self.settled.pressure_pa;
        self.settled
            .deviation_pa
            .hypot(begin_pa)
            .hypot(stop_pa)
            .hypot(linearity_pa)
    }

    /// The stop method's temperature, K, and its deviation.
    fn temperature_k(&self) -> (f64, f64) {
        let settled_pa = self.settled.pressure_pa;
        let value = stop_method_temperature_k(self.stop_pa, settled_pa, self.vessel.wall_k);
        (value, value * self.deviation_pa() / settled_pa)
    }

    /// How long the valve was open, s.
    fn open_s(&self) -> f64 {
        self.stop_s() - self.time_s[0]
    }

    fn stop_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1]
    }

    fn stretch(&self) -> Stretch {
        let (temperature_k, deviation_k) = self.temperature_k();
        Stretch {
            recording: self.recording.clone(),
            from_s: self.time_s[0],
            to_s: self.stop_s(),
            what: format!(
                "chamber {} {} for {:.3} s: {:.1} ± {:.1} K at the stop, settled at {:.2} kPa",
                self.side.letter().to_ascii_uppercase(),
                if self.fills { "charged" } else { "discharged" },
                self.open_s(),
                temperature_k,
                deviation_k,
                1e-3 * self.settled.pressure_pa
            ),
        }
    }
}

/// What was found of one kind of runs.
#[derive(Clone, Copy)]
struct Found {
    /// One number for all of them, W/(m2 K).
    constant: f64,
    over_time: Option<Course>,
}

/// Heat transfer over the time since the opening: a straight line between both ends.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Course {
    /// At the opening and at the last stop, W/(m2 K), each with its deviation.
    ends: [(f64, f64); 2],
    until_s: f64,
    /// The change over its own deviation.
    significance: f64,
}

impl Course {
    /// None if the runs do not determine it.
    fn of(runs: &[&Run]) -> Option<Self> {
        let until_s = runs.iter().map(|one| one.open_s()).fold(0.0, f64::max);
        let residuals = |ends: &[f64]| {
            residuals(runs, &|time_s| {
                between([ends[0], ends[1]], time_s / until_s)
            })
        };
        let end = Parameter::new(50.0).bounded(RANGE.0, RANGE.1);
        let solved = fitted(&[end, end], &residuals).ok()?;
        let change = solved.values[1] - solved.values[0];
        let ends = [solved.at(0), solved.at(1)];
        let is_determined = ends.iter().all(|(value, deviation)| deviation < value);
        is_determined.then(|| Self {
            ends,
            until_s,
            significance: change.abs() / solved.deviation_of_difference(0, 1),
        })
    }

    fn at(&self, time_s: f64) -> f64 {
        between(self.ends.map(|(value, _)| value), time_s / self.until_s)
    }

    fn sentence(&self, fills: bool) -> String {
        let name = way(fills);
        let [from, to] = self
            .ends
            .map(|(value, deviation)| format!("{value:.0} ± {deviation:.0}"));
        let until_s = self.until_s;
        if self.significance > CHANGES {
            format!(
                "heat transfer while {name} changes: {from} W/(m2 K) at the opening, {to} after {until_s:.2} s. The model has \
                 one number; the one given here is that of all runs together"
            )
        } else {
            format!(
                "heat transfer while {name} is the same all the time as far as these runs show: {from} W/(m2 K) at the \
                 opening, {to} after {until_s:.2} s"
            )
        }
    }
}

fn between([from, to]: [f64; 2], share: f64) -> f64 {
    from + (to - from) * share
}

fn way(fills: bool) -> &'static str {
    if fills { "charging" } else { "discharging" }
}

fn heat_transfer(runs: &[&Run]) -> Result<Solved, String> {
    let start = Parameter::new(50.0).bounded(RANGE.0, RANGE.1);
    fitted(&[start], &|numbers| residuals(runs, &|_| numbers[0]))
}

fn residuals(runs: &[&Run], heat_transfer: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let off_pa = |one: &&Run| one.predicted_pa(heat_transfer) - one.settled.pressure_pa;
    let in_deviations = |one: &&Run| off_pa(one) / one.deviation_pa();
    runs.iter().map(in_deviations).collect()
}

/// With the valve shut the settling itself says the heat transfer of gas at rest.
fn at_rest(runs: &[Run]) -> Option<Number> {
    let all: Vec<(f64, f64)> = runs
        .iter()
        .filter(|one| one.settled.above_pa.abs() > 20.0 * one.settled.deviation_pa)
        .map(|one| {
            let mass_kg = one.vessel.settled(one.settled.pressure_pa).mass_kg;
            let value = one.vessel.settling_s(mass_kg, 1.0) / one.settled.time_constant_s;
            let share = one.settled.time_constant_deviation_s / one.settled.time_constant_s;
            (value, value * share)
        })
        .collect();
    let weight = |one: &(f64, f64)| 1.0 / one.1.powi(2);
    let sum: f64 = all.iter().map(weight).sum();
    let middle = all.iter().map(|one| one.0 * weight(one)).sum::<f64>() / sum;
    let squares: f64 = all
        .iter()
        .map(|one| (one.0 - middle).powi(2) * weight(one))
        .sum();
    let ratio = (squares / (all.len() as f64 - 1.0)).max(1.0);
    let what = "heat transfer coefficient while the valve is shut";
    (all.len() > 1).then(|| {
        Number::named(
            "heat_transfer_shut_W_m2K",
            what,
            "W/(m2 K)",
            (middle, (ratio / sum).sqrt()),
        )
    })
}

fn what_is_missing(found: [Option<Found>; 2]) -> Option<String> {
    let missing = match found {
        [None, _] => way(true),
        [_, None] => way(false),
        _ => return None,
    };
    Some(format!(
        "no {missing} run was given: that coefficient stays as it is"
    ))
}

fn pictures(rig: &Rig, runs: &[Run], found: [Option<Found>; 2]) -> Vec<Picture> {
    let values = Values::<f64>::of(rig);
    let stated = [
        "chambers.heat_transfer_charging_W_m2K",
        "chambers.heat_transfer_discharging_W_m2K",
    ]
    .map(|key| values.get(key));
    let mut temperatures = Picture::new(
        "Gas temperature by the stop method",
        ("time since opening", "s"),
        ("temperature", "K"),
    );
    let mut coefficients = Picture::new(
        "Heat transfer",
        ("time since opening", "s"),
        ("heat transfer", "W/(m² K)"),
    );
    for (place, stated) in stated.into_iter().enumerate() {
        let (fills, kind) = (place == 0, [Kind::Points, Kind::OtherPoints][place]);
        let name = way(fills);
        let of_kind: Vec<&Run> = runs.iter().filter(|one| one.fills == fills).collect();
        let Some(longest) = of_kind
            .iter()
            .max_by(|a, b| a.open_s().total_cmp(&b.open_s()))
        else {
            continue;
        };
        let points = of_kind
            .iter()
            .map(|one| (one.open_s(), one.temperature_k().0));
        temperatures = temperatures.with(format!("{name}, stopped"), kind, points.collect());
        for (name, value, kind) in [
            (
                format!("{name}, energy balance"),
                found[place].map(|one| one.constant),
                Kind::Law,
            ),
            (format!("{name}, rig file"), stated, Kind::Given),
        ] {
            if let Some(value) = value {
                let curve = longest.time_s.iter().zip(longest.contents(&|_| value));
                let curve = curve.map(|(time, one)| (time - longest.time_s[0], one.temperature_k));
                temperatures = temperatures.with(name, kind, curve.collect());
            }
        }
        coefficients = with_coefficients(coefficients, (&of_kind, kind), found[place]);
    }
    vec![temperatures, coefficients]
}

/// The picture with each run's own heat transfer, that of all, and its course over time.
fn with_coefficients(
    picture: Picture,
    (runs, kind): (&[&Run], Kind),
    found: Option<Found>,
) -> Picture {
    let name = way(runs.first().is_some_and(|one| one.fills));
    let each = runs.iter().filter_map(|one| {
        let solved = heat_transfer(&[one]).ok()?;
        Some((one.open_s(), solved.values[0]))
    });
    let picture = picture.with(format!("{name}, mean of each run"), kind, each.collect());
    let Some(found) = found else {
        return picture;
    };
    let until_s = runs.iter().map(|one| one.open_s()).fold(0.0, f64::max);
    let line = |of: &dyn Fn(f64) -> f64| [0.0, until_s].map(|time_s| (time_s, of(time_s))).to_vec();
    let all = line(&|_| found.constant);
    let picture = picture.with(format!("{name}, one for all"), Kind::Law, all);
    let Some(course) = found.over_time else {
        return picture;
    };
    let over_time = line(&|time_s| course.at(time_s));
    picture.with(format!("{name}, over time"), Kind::Given, over_time)
}
