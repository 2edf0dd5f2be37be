//! Steady flows out of recordings.

use std::ops::Range;

use grey_box::laws::{Track, median_step_s};
use grey_box::model::{Side, Values};
use grey_box::rig::Rig;
use model_core::valve::FlowLaw;

use crate::fixed_volume::{Content, Vessel};
use crate::flow_point::FlowPoint;
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
) -> Result<(Vec<FlowPoint>, Vec<Stretch>), String> {
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

fn stretch(track: &Track<'_>, rows: &Range<usize>, point: &FlowPoint) -> Stretch {
    let what = format!(
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
    );
    Stretch::of(track.recording, rows, what)
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
    fn by_gauge(&self, point: &FlowPoint, law: &FlowLaw<f64>) -> f64 {
        let path = usize::from(!point.is_fed());
        let moved = FlowPoint {
            port_pa: point.port_pa + steady::GAUGE_LINEARITY * point.port_pa,
            ..*point
        };
        moved.per_area(law)[path] / point.per_area(law)[path] - 1.0
    }

    fn point(
        &self,
        rows: &Range<usize>,
        (flow_kg_per_s, deviation_kg_per_s): (f64, f64),
    ) -> FlowPoint {
        let over = |signal: Option<&[f64]>, otherwise: f64| {
            signal.map_or(otherwise, |all| steady::mean(&all[rows.clone()]))
        };
        FlowPoint {
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
fn from_meter(rig: &Rig, track: &Track<'_>) -> Result<Vec<(FlowPoint, Range<usize>)>, String> {
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

/// A vessel at port A as a flow meter.
struct Metered<'a> {
    around: Surroundings<'a>,
    vessel: Vessel,
    law: FlowLaw<f64>,
    time_s: &'a [f64],
    step_s: f64,
    /// Rows over which the mass is differentiated.
    window: usize,
    noise_kg: f64,
}

/// Rates of the mass in a vessel that fills or empties.
fn from_vessel(
    rig: &Rig,
    track: &Track<'_>,
    leakage_m2: [f64; 2],
) -> Result<Vec<(FlowPoint, Range<usize>)>, String> {
    let heat_transfer = heat_transfer(rig)?;
    let metered = Metered::of(rig, track)?;
    let (around, vessel, window) = (&metered.around, &metered.vessel, metered.window);
    let mut found = Vec::new();
    let begin_pa = steady::mean(&around.port_pa[..window.min(around.port_pa.len())]);
    let mut content = vessel.settled(begin_pa);
    let mut shut_in_kg = None;
    for (open, shut) in crate::heat_transfer::cycles(around.command_v) {
        if let Some((mass_kg, from)) = shut_in_kg {
            // Whether the gas has settled or not: shut in, it keeps its mass but for what leaks, and
            // its pressure says its temperature.
            let opening_pa = steady::mean(&around.port_pa[open.saturating_sub(window)..open]);
            let leaked_kg = around.leaked_kg(&metered.law, metered.time_s, from..open, leakage_m2);
            content = vessel.holding(mass_kg + leaked_kg, opening_pa);
        } else {
            let (rest, leak) = metered.at_rest(open, content, heat_transfer[0]);
            content = rest;
            let leak = leak.filter(|_| open > LEAKING_WINDOWS * window);
            found.extend(leak.map(|point| (point, 0..open)));
        }
        let fills = around.port_pa[shut - 1] > around.port_pa[open];
        let flowing = heat_transfer[usize::from(!fills)];
        let rows = open..shut + 1;
        let (time_s, port_pa) = (&metered.time_s[rows.clone()], &around.port_pa[rows]);
        let contents = vessel.contents(time_s, port_pa, content, (flowing, fills));
        shut_in_kg = contents.last().map(|end| (end.mass_kg, shut));
        found.extend(metered.flows(open, &contents));
    }
    Ok(found)
}

impl<'a> Metered<'a> {
    fn of(rig: &Rig, track: &'a Track<'_>) -> Result<Self, String> {
        let around = Surroundings::of(rig, track)?;
        let vessel = Vessel::of(rig, Side::A, 0.0)?;
        let time_s = &track.recording.time_s;
        let step_s = median_step_s(time_s);
        let noise_pa = steady::signal_noise(rig, "p_a", around.port_pa);
        let gas_constant = vessel.gas.heat_capacity_ratio * vessel.gas.gas_constant_j_per_kg_k;
        Ok(Self {
            law: super::stated_law(rig),
            window: (WINDOW_S / step_s).round().max(4.0) as usize,
            noise_kg: noise_pa * vessel.volume_m3 / (gas_constant * vessel.wall_k),
            around,
            vessel,
            time_s,
            step_s,
        })
    }

    /// Deviation of a rate over so many rows: of the slope of evenly sampled white noise, kg/s.
    fn rate_deviation(&self, rows: usize) -> f64 {
        let span_s = rows as f64 * self.step_s;
        self.noise_kg * (12.0 / rows as f64).sqrt() / span_s
    }

    /// Before the first opening the gas has the wall's temperature: what flows is leakage. What the
    /// vessel then holds, and the flow.
    fn at_rest(
        &self,
        open: usize,
        start: Content,
        heat_transfer: f64,
    ) -> (Content, Option<FlowPoint>) {
        let rows = 0..open + 1;
        let (time_s, port_pa) = (
            &self.time_s[rows.clone()],
            &self.around.port_pa[rows.clone()],
        );
        let resting = self
            .vessel
            .contents(time_s, port_pa, start, (heat_transfer, true));
        let masses: Vec<f64> = resting.iter().map(|one| one.mass_kg).collect();
        let flow = steady::slope(time_s, &masses);
        let deviation = self
            .rate_deviation(masses.len())
            .hypot(BALANCE_ERROR * flow);
        let point = self.around.point(&rows, (flow, deviation));
        (
            *resting.last().unwrap_or(&start),
            (open > 0).then_some(point),
        )
    }

    /// The flows of one opening.
    fn flows(&self, open: usize, contents: &[Content]) -> Vec<(FlowPoint, Range<usize>)> {
        let from = (OPENING_S / self.step_s) as usize;
        let last = contents.len().saturating_sub(self.window);
        let windows = (from..last)
            .step_by(self.window)
            .map(|first| first..first + self.window);
        windows
            .filter_map(|rows| self.flow(open, contents, rows))
            .collect()
    }

    fn flow(
        &self,
        open: usize,
        contents: &[Content],
        rows: Range<usize>,
    ) -> Option<(FlowPoint, Range<usize>)> {
        let of = |part: fn(&Content) -> f64| -> Vec<f64> {
            contents[rows.clone()].iter().map(part).collect()
        };
        let absolute = open + rows.start..open + rows.end;
        let flow = steady::slope(&self.time_s[absolute.clone()], &of(|one| one.mass_kg));
        let deviation = self.rate_deviation(self.window);
        let mut point = FlowPoint {
            port_k: steady::mean(&of(|one| one.temperature_k)),
            ..self.around.point(&absolute, (flow, deviation))
        };
        let share = BALANCE_ERROR.hypot(self.around.by_gauge(&point, &self.law));
        point.deviation_kg_per_s = deviation.hypot(share * flow);
        let is_read = point.ratio() < HIGHEST_RATIO && flow.abs() > 3.0 * deviation;
        is_read.then_some((point, absolute))
    }
}
