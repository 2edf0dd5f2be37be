//! Steady flows out of recordings.

use std::ops::Range;

use grey_box::laws::{Track, median_step_s};
use grey_box::model::{Side, Values};
use grey_box::rig::Rig;
use model_core::valve::FlowLaw;

use super::Point;
use crate::fixed_volume::{Content, Vessel};
use crate::outcome::Stretch;
use crate::steady;

/// The first part of a held command: flow and meter settle.
const SETTLING_SHARE: f64 = 0.5;
/// A command within this is held, V.
const ONE_COMMAND_V: f64 = 0.005;
/// A pressure within this part of itself is held.
const ONE_PRESSURE: f64 = 0.01;
/// A flow meter is linear to this part of its reading, and its zero drifts by this part of the
/// largest flow: one deviation each, of laboratory meters (chosen).
const METER_LINEARITY: f64 = 1e-3;
const METER_ZERO: f64 = 3e-4;
/// Windows over which a vessel's mass is differentiated, s.
const WINDOW_S: f64 = 0.04;
/// A leakage is read from so many of them at least.
const LEAKING_WINDOWS: usize = 4;
/// A valve has opened so long after its command, s.
const OPENING_S: f64 = 0.05;
/// Closer to equal pressures the difference of two gauges says nothing of the ratio.
const HIGHEST_RATIO: f64 = 0.97;
/// What heat and volume leave in a flow out of a vessel, as a part of it: one deviation.
const BALANCE_ERROR: f64 = 1e-2;

/// All steady flows of the recordings; a shut valve leaks by these areas, from the supply and to the
/// exhaust.
pub(super) fn of(
    rig: &Rig,
    tracks: &[Track<'_>],
    leakage_m2: [f64; 2],
) -> Result<(Vec<Point>, Vec<Stretch>), String> {
    let mut points = Vec::new();
    let mut stretches = Vec::new();
    for track in tracks {
        let found = if track.recording.signal("flow_a").is_some() {
            from_meter(rig, track)?
        } else if rig.vessel.is_some() {
            from_vessel(rig, track, leakage_m2)?
        } else {
            return Err(format!(
                "{}: flow_a is not recorded and the rig file has no [vessel]: a flow test has a flow meter at port A, \
                 or a vessel of known volume. Recordings of the axis in motion are evaluated where [cylinder] and x are there",
                track.recording.name
            ));
        };
        for (point, rows) in found {
            points.push(point);
            stretches.push(stretch(track, &rows, &point));
        }
    }
    if points.len() < 3 {
        return Err(format!(
            "{} steady flows were found: a valve needs commands held over its range",
            points.len()
        ));
    }
    Ok((points, stretches))
}

fn stretch(track: &Track<'_>, rows: &Range<usize>, point: &Point) -> Stretch {
    let time_s = &track.recording.time_s;
    Stretch {
        recording: track.recording.name.clone(),
        from_s: time_s[rows.start],
        to_s: time_s[rows.end - 1],
        what: format!(
            "{:.3} V, {:.2} to {:.2} bar: {:.1} l/min",
            point.command_v,
            1e-5 * if point.is_fed() {
                point.supply_pa
            } else {
                point.port_pa
            },
            1e-5 * if point.is_fed() {
                point.port_pa
            } else {
                point.exhaust_pa
            },
            crate::iso6358::flow_l_min(point.flow_kg_per_s)
        ),
    }
}

/// What is the same in all points of a recording, or recorded row by row.
struct Surroundings<'a> {
    command_v: &'a [f64],
    port_pa: &'a [f64],
    supply_pa: Option<&'a [f64]>,
    exhaust_pa: Option<&'a [f64]>,
    declared_supply_pa: f64,
    ambient_pa: f64,
    ambient_k: f64,
}

impl<'a> Surroundings<'a> {
    fn of(rig: &Rig, track: &'a Track<'_>) -> Result<Self, String> {
        let recording = track.recording;
        let needed = |signal: &str| {
            recording
                .signal(signal)
                .ok_or(format!("{}: {signal} is not recorded", recording.name))
        };
        let declared = rig.value("supply.pressure_Pa");
        let supply_pa = recording.signal("p_s");
        if supply_pa.is_none() && declared.is_none() {
            return Err(format!(
                "{}: p_s is not recorded, and [supply] pressure_Pa is missing",
                recording.name
            ));
        }
        let ambient = Values::<f64>::of(rig).ambient();
        Ok(Self {
            command_v: needed("u")?,
            port_pa: needed("p_a")?,
            supply_pa,
            exhaust_pa: recording.signal("p_e"),
            declared_supply_pa: declared.unwrap_or(0.0),
            ambient_pa: ambient.pressure_pa,
            ambient_k: ambient.temperature_k,
        })
    }

    /// What leaks into the port over rows with the valve shut, kg.
    fn leaked_kg(
        &self,
        law: &FlowLaw<f64>,
        time_s: &[f64],
        rows: Range<usize>,
        leakage_m2: [f64; 2],
    ) -> f64 {
        rows.map(|row| {
            let [fed, vented] = self.point(&(row..row + 1), (0.0, 1.0)).per_area(law);
            (leakage_m2[0] * fed - leakage_m2[1] * vented) * (time_s[row + 1] - time_s[row])
        })
        .sum()
    }

    /// What an error of the port's gauge does to the flow by the law, as a part of it: near equal
    /// pressures much.
    fn by_gauge(&self, point: &Point, law: &FlowLaw<f64>) -> f64 {
        let path = usize::from(!point.is_fed());
        let moved = Point {
            port_pa: point.port_pa + steady::GAUGE_LINEARITY * point.port_pa,
            ..*point
        };
        moved.per_area(law)[path] / point.per_area(law)[path] - 1.0
    }

    fn point(&self, rows: &Range<usize>, (flow_kg_per_s, deviation_kg_per_s): (f64, f64)) -> Point {
        let over = |signal: Option<&[f64]>, otherwise: f64| {
            signal.map_or(otherwise, |all| steady::mean(&all[rows.clone()]))
        };
        Point {
            command_v: over(Some(self.command_v), 0.0),
            flow_kg_per_s,
            deviation_kg_per_s,
            supply_pa: over(self.supply_pa, self.declared_supply_pa),
            port_pa: over(Some(self.port_pa), 0.0),
            exhaust_pa: over(self.exhaust_pa, self.ambient_pa),
            supply_k: self.ambient_k,
            port_k: self.ambient_k,
        }
    }
}

/// Commands and pressures that were held, the flow settled.
fn from_meter(rig: &Rig, track: &Track<'_>) -> Result<Vec<(Point, Range<usize>)>, String> {
    let around = Surroundings::of(rig, track)?;
    let flow = track.recording.signal("flow_a").unwrap_or(&[]);
    let zero = METER_ZERO * flow.iter().map(|one| one.abs()).fold(0.0, f64::max);
    if is_table(around.command_v) {
        let point = |row: usize| {
            let noise = rig
                .signals
                .get("flow_a")
                .and_then(|one| one.noise)
                .unwrap_or(0.0);
            let deviation = noise.hypot(METER_LINEARITY * flow[row]).hypot(zero);
            (
                around.point(
                    &(row..row + 1),
                    (flow[row], deviation.max(f64::MIN_POSITIVE)),
                ),
                row..row + 1,
            )
        };
        return Ok((0..flow.len()).map(point).collect());
    }
    let noise_pa = steady::signal_noise(rig, "p_a", around.port_pa);
    let law = super::stated_law(rig);
    let mut found = Vec::new();
    for held in steady::held(around.command_v, ONE_COMMAND_V) {
        for rows in levels(around.port_pa, &held, noise_pa) {
            let from = rows.start + (SETTLING_SHARE * rows.len() as f64) as usize;
            let settled = from..rows.end;
            if settled.len() < 2 * BATCH_ROWS {
                continue;
            }
            let (mean, deviation) = steady::mean_of_batches(&flow[settled.clone()]);
            let half = settled.len() / 2;
            let drift = steady::mean(&flow[settled.start + half..settled.end])
                - steady::mean(&flow[settled.start..settled.start + half]);
            let mut point = around.point(
                &settled,
                (mean, deviation.hypot(0.5 * drift).max(f64::MIN_POSITIVE)),
            );
            let share = METER_LINEARITY.hypot(around.by_gauge(&point, &law));
            point.deviation_kg_per_s = point.deviation_kg_per_s.hypot(share * mean).hypot(zero);
            found.push((point, settled));
        }
    }
    Ok(found)
}

/// A command that changes from row to row is no recording over time but a table: every row is a
/// point.
fn is_table(command_v: &[f64]) -> bool {
    let held = steady::held(command_v, ONE_COMMAND_V);
    2 * held.len() > command_v.len()
}

/// Fewest rows of half of a settled flow.
const BATCH_ROWS: usize = 5;

/// Parts of a range in which a pressure stays, smoothed against its noise.
fn levels(pressure_pa: &[f64], rows: &Range<usize>, noise_pa: f64) -> Vec<Range<usize>> {
    const SMOOTH: usize = 8;
    let smooth: Vec<f64> = pressure_pa[rows.clone()]
        .chunks(SMOOTH)
        .map(steady::mean)
        .collect();
    let middle = steady::mean(&smooth);
    let tolerance = (ONE_PRESSURE * middle).max(4.0 * noise_pa);
    steady::held(&smooth, tolerance)
        .into_iter()
        .map(|one| rows.start + SMOOTH * one.start..(rows.start + SMOOTH * one.end).min(rows.end))
        .collect()
}

/// Before the first opening the gas has the wall's temperature: what flows is leakage. What it then
/// holds, and the flow.
fn at_rest(
    vessel: &Vessel,
    around: &Surroundings<'_>,
    (time_s, start): (&[f64], Content),
    (noise_kg, heat_transfer): (f64, f64),
) -> (Content, Option<Point>) {
    let rows = 0..time_s.len();
    let resting = vessel.contents(
        time_s,
        &around.port_pa[rows.clone()],
        start,
        (heat_transfer, true),
    );
    let masses: Vec<f64> = resting.iter().map(|one| one.mass_kg).collect();
    let flow = steady::slope(time_s, &masses);
    let span_s = time_s[time_s.len() - 1] - time_s[0];
    let deviation = noise_kg * (12.0 / masses.len() as f64).sqrt() / span_s;
    let point = around.point(&rows, (flow, deviation.hypot(BALANCE_ERROR * flow)));
    (
        *resting.last().unwrap_or(&start),
        (span_s > 0.0).then_some(point),
    )
}

/// Coefficients of charging and discharging.
fn heat_transfer(rig: &Rig) -> Result<[f64; 2], String> {
    let [charging, discharging] = ["charging", "discharging"].map(|way| {
        let key = format!("chambers.heat_transfer_{way}_W_m2K");
        rig.value(&key).ok_or(format!(
            "{key} is missing: the gas of a vessel warms and cools"
        ))
    });
    Ok([charging?, discharging?])
}

/// Rates of the mass in a vessel that fills or empties.
fn from_vessel(
    rig: &Rig,
    track: &Track<'_>,
    leakage_m2: [f64; 2],
) -> Result<Vec<(Point, Range<usize>)>, String> {
    let around = Surroundings::of(rig, track)?;
    let vessel = Vessel::of(rig, Side::A, 0.0)?;
    let time_s = &track.recording.time_s;
    let noise_pa = steady::signal_noise(rig, "p_a", around.port_pa);
    let step_s = median_step_s(time_s);
    let window = (WINDOW_S / step_s).round().max(4.0) as usize;
    let gas_constant = vessel.gas.heat_capacity_ratio * vessel.gas.gas_constant_j_per_kg_k;
    let noise_kg = noise_pa * vessel.volume_m3 / (gas_constant * vessel.wall_k);
    let heat_transfer = heat_transfer(rig)?;
    let law = super::stated_law(rig);
    let mut found = Vec::new();
    let cycles = crate::heat_transfer::cycles(around.command_v);
    let begin_pa = steady::mean(&around.port_pa[..window.min(around.port_pa.len())]);
    let mut content = vessel.settled(begin_pa);
    let mut shut_in_kg = None;
    for (open, shut) in cycles {
        let opening_pa = steady::mean(&around.port_pa[open.saturating_sub(window)..open]);
        if let Some((mass_kg, from)) = shut_in_kg {
            // Whether the gas has settled or not: shut in, it keeps its mass but for what leaks, and
            // its pressure says its temperature.
            let leaked_kg = around.leaked_kg(&law, time_s, from..open, leakage_m2);
            content = vessel.holding(mass_kg + leaked_kg, opening_pa);
        } else {
            let (rest, leak) = at_rest(
                &vessel,
                &around,
                (&time_s[..=open], content),
                (noise_kg, heat_transfer[0]),
            );
            content = rest;
            found.extend(
                leak.filter(|_| open > LEAKING_WINDOWS * window)
                    .map(|point| (point, 0..open)),
            );
        }
        let fills = around.port_pa[shut - 1] > around.port_pa[open];
        let flowing = heat_transfer[usize::from(!fills)];
        let rows_open = open..shut + 1;
        let contents = vessel.contents(
            &time_s[rows_open.clone()],
            &around.port_pa[rows_open],
            content,
            (flowing, fills),
        );
        shut_in_kg = contents.last().map(|end| (end.mass_kg, shut));
        let from = (OPENING_S / step_s) as usize;
        for first in (from..contents.len().saturating_sub(window)).step_by(window) {
            let rows = first..first + window;
            let masses: Vec<f64> = contents[rows.clone()]
                .iter()
                .map(|one| one.mass_kg)
                .collect();
            let flow = steady::slope(&time_s[open..][rows.clone()], &masses);
            let span_s = window as f64 * step_s;
            let deviation = noise_kg * (12.0 / window as f64).sqrt() / span_s;
            let temperature_k = steady::mean(
                &contents[rows.clone()]
                    .iter()
                    .map(|one| one.temperature_k)
                    .collect::<Vec<f64>>(),
            );
            let absolute = open + rows.start..open + rows.end;
            let mut point = Point {
                port_k: temperature_k,
                ..around.point(&absolute, (flow, deviation))
            };
            let share = BALANCE_ERROR.hypot(around.by_gauge(&point, &law));
            point.deviation_kg_per_s = deviation.hypot(share * flow);
            if point.ratio() < HIGHEST_RATIO && flow.abs() > 3.0 * deviation {
                found.push((point, absolute));
            }
        }
    }
    Ok(found)
}
