//! The force balance of a free carriage in weak form: what the search for a
//! missing force works on.
//!
//! ```text
//! residual = [ sum phi (gas - friction - load) dt - M sum phi'' x dt ] / sum phi dt
//! phi(s) = (1 - s^2)^3, |s| < 1
//! ```
//!
//! A position predicted over a window is chaotic in stick and slip and mixes a
//! starting velocity with every force. The balance tested with a smooth bump
//! needs no derivative of the position (two partial integrations move it to the
//! bump), is linear in nearly every parameter, and resolves some hundredths of
//! a newton from 40 ms of sliding.
//!
//! Where the carriage stands, the balance says nothing but that stiction holds;
//! such windows are left out. What stiction is shows at break-away (`breakaway`), one
//! residual per event.

pub use super::breakaway::{BREAKAWAY_NOISE_N, KNOWN_TO_N};
use super::breakaway::{Breakaway, PositionReading, Recorded, Stand, breakaways};
use super::carriage_history::{slope, way_m};
use super::force::outer_n;
use super::pressure_reading::PressureReading;
use super::{Motion, Output, Sink, Track};
use crate::model::{Side, Values};
use crate::rig::Rig;
use model_core::carriage::{Carriage, CarriageState};
use model_core::friction::FrictionLevels;
use model_core::math::Compensated;
use model_core::real::Real;

/// Half width of the bump, s: 40 ms in all resolve the reversal of a hard
/// stroke, and average the pressures' noise to a fifth.
pub(super) const HALF_WIDTH_S: f64 = 0.02;
/// It holds no fewer rows than this on either side of its middle.
const FEWEST_ROWS: usize = 3;
/// Slower than this at any row of it, a window may stick, m/s. Well above the
/// noise of a smoothed velocity (some 0.3 mm/s).
const CREEPING_M_PER_S: f64 = 3e-3;
/// Faster than this in all rows, a window only slides, m/s. Below, friction
/// falls with speed so steeply that the noise of the velocity shows.
const SLIDING_M_PER_S: f64 = 1.2e-2;
/// What the sampling of hard strokes at 1 kHz leaves of the balance, N: forces
/// below that are not looked for while sliding.
const SLIDING_NOISE_N: f64 = 0.15;
/// The same while creeping: friction falls by some 2 kN s/m, the velocity is
/// known to 0.3 mm/s.
const CREEPING_NOISE_N: f64 = 0.5;
/// ... and no better than this part of a dry friction that is larger than most (25 N): what a
/// bristle gives way by, and later, grows with it.
const CREEPING_NOISE_SHARE: f64 = 0.02;
/// Between isothermal and adiabatic, for the air spring of a piston that begins to move.
const POLYTROPIC: f64 = 1.2;

/// This near to the end of its stroke the carriage may touch it, m: as far as position
/// sensors are off. What the end bears nobody has recorded, so nothing is asked there.
const AT_THE_END_M: f64 = 1e-3;

/// The name of outputs that should be nought.
pub const SIGNAL: &str = "balance";

const BALANCE: Output = Output {
    signal: SIGNAL,
    place: "force-balance",
    unit: "N",
};

/// The outputs: the balance while sliding, while creeping, and at break-away.
pub(super) const OUTPUTS: [Output; 3] = [BALANCE; 3];

/// The output of the balance while creeping.
pub const CREEPING: usize = 1;

/// The output of the break-aways; its residuals are limited.
pub const BREAKAWAY: usize = 2;

/// The noise of the outputs that the law itself knows of, N, beside a dry friction.
pub fn own_noise_n(coulomb_n: f64) -> [f64; 3] {
    let creeping_n = CREEPING_NOISE_N.max(CREEPING_NOISE_SHARE * coulomb_n);
    [SLIDING_NOISE_N, creeping_n, BREAKAWAY_NOISE_N]
}

/// Bump and its second derivative, normalised to a mean.
struct Bump {
    weights: Vec<f64>,
    /// One row longer at either end.
    curvature: Vec<f64>,
}

/// The rows on either side of its middle that a bump is to hold.
fn half_rows(track: &Track<'_>, step_s: f64) -> usize {
    (track.balanced_over_s() / step_s).round() as usize
}

/// Whether a bump is as narrow as it is to be.
pub fn is_resolved(track: &Track<'_>) -> bool {
    let step_s = super::motion::median_step_s(&track.recording.time_s);
    half_rows(track, step_s) >= FEWEST_ROWS
}

impl Bump {
    fn of(track: &Track<'_>) -> Self {
        let step_s = super::motion::median_step_s(&track.recording.time_s);
        let half = half_rows(track, step_s).max(FEWEST_ROWS);
        let ends = half as f64 + 1.0;
        let at = |row: usize| (row as f64 - half as f64) / ends;
        let rows = 2 * half + 1;
        let value = |row: usize| (1.0 - at(row).powi(2)).max(0.0).powi(3);
        let sum: f64 = (0..rows).map(value).sum();
        let weights: Vec<f64> = (0..rows).map(|row| value(row) / sum).collect();
        // Summed by parts exactly: the second difference of the bump. The bump
        // is nought one row beyond its ends.
        let weight = |row: isize| {
            let inside = usize::try_from(row).ok();
            inside
                .and_then(|row| weights.get(row))
                .copied()
                .unwrap_or(0.0)
        };
        let second = |row: isize| weight(row + 1) - 2.0 * weight(row) + weight(row - 1);
        let curvature = (-1..=rows as isize).map(|row| second(row) / step_s.powi(2));
        Self {
            curvature: curvature.collect(),
            weights,
        }
    }
}

/// How the rows around one weigh in its balance.
pub fn weights(track: &Track<'_>) -> Vec<f64> {
    Bump::of(track).weights
}

/// How the rows around one weigh in the acceleration that its balance counts, 1/s2: one row more
/// on either side than in the bump.
pub fn curvature(track: &Track<'_>) -> Vec<f64> {
    Bump::of(track).curvature
}

/// An output that is not predicted at a row.
fn skipped<R: Real>() -> R {
    R::from_f64(f64::NAN)
}

/// A balance that came out as NaN is no balance that was left out.
fn or_infinite<R: Real>(residual: R) -> R {
    if residual.value().is_nan() {
        R::from_f64(f64::INFINITY)
    } else {
        residual
    }
}

/// The gas force at each break-away of a recording, in its direction, N: about the static
/// level, whatever a rig file says of that.
pub(super) fn break_away_forces_n(rig: &Rig, track: &Track<'_>) -> Vec<f64> {
    let values = Values::of(rig);
    let Some(pressures) = PressureReading::new(&values, track) else {
        return Vec::new();
    };
    let (carriage, constant_n) = (values.carriage(), values.friction_terms().constant_force_n);
    events(rig, track)
        .into_iter()
        .map(|event| {
            let [p_a, p_b] = pressures.at(event.row);
            event.direction * (carriage.drive_n(p_a, p_b) - constant_n)
        })
        .collect()
}

/// Where the carriage is, as its break-aways are read off it: whatever is fitted, the same
/// moments are looked at.
fn position_reading(rig: &Rig, track: &Track<'_>) -> PositionReading {
    let held_n = rig.value("friction.static_N");
    let stiffness_n_per_m = rig.value("friction.bristle_stiffness_N_m");
    let deflection_m = held_n.zip(stiffness_n_per_m).map(|(held, by)| held / by);
    let position_m = track.signal("x").unwrap_or_default();
    PositionReading::new(
        &track.recording.time_s,
        position_m,
        deflection_m.unwrap_or(0.0),
    )
}

/// When the carriage leaves its place.
fn events(rig: &Rig, track: &Track<'_>) -> Vec<Breakaway> {
    breakaways(&track.recording.time_s, &position_reading(rig, track))
}

/// The row before which the carriage leaves its place, and how long it has stood there, s, for
/// each time that it does.
pub fn rests_s(rig: &Rig, track: &Track<'_>) -> Vec<(usize, f64)> {
    let events = events(rig, track).into_iter();
    events.map(|event| (event.row, event.rest_s)).collect()
}

pub(super) fn predict<R: Real>(values: &Values<'_, R>, track: &Track<'_>, sink: &mut dyn Sink<R>) {
    let (Some(motion), Some(position_m), Some(pressures)) = (
        track.motion.as_ref(),
        track.signal("x"),
        PressureReading::new(values, track),
    ) else {
        return;
    };
    let driven = Driven {
        values,
        track,
        motion,
        position_m,
        pressures,
        ends_m: values.stroke_ends_m(),
    };
    let carriage = values.carriage();
    let reading = position_reading(values.rig, track);
    let along = driven.forces(&carriage, &reading);
    driven.report_break_aways(&carriage, &along, &reading, sink);
    driven.report_windows(&carriage, &along.force_n, sink);
}

/// What drives the law.
struct Driven<'a, R> {
    values: &'a Values<'a, R>,
    track: &'a Track<'a>,
    motion: &'a Motion,
    position_m: &'a [f64],
    pressures: PressureReading<'a, R>,
    ends_m: Option<[R; 2]>,
}

/// Forces row by row, and the break-aways among the rows with the friction declared there.
struct Along<R> {
    gas_n: Vec<f64>,
    driving_n: Vec<R>,
    force_n: Vec<R>,
    breaks: Vec<(Breakaway, FrictionLevels<R>)>,
}

impl<R> Along<R> {
    fn with_room_for(rows: usize) -> Self {
        Self {
            gas_n: Vec::with_capacity(rows),
            driving_n: Vec::with_capacity(rows),
            force_n: Vec::with_capacity(rows),
            breaks: Vec::new(),
        }
    }
}

fn dry<R: Real>(levels: FrictionLevels<R>) -> FrictionLevels<R> {
    FrictionLevels {
        viscous_n_s_per_m: R::ZERO,
        ..levels
    }
}

/// How far a force that trails has come after another way, m.
fn trail_after<R: Real>(carriage: &Carriage<R>, trail: R, way_m: f64) -> R {
    let effects = carriage.effects.as_ref();
    effects.map_or(trail, |effects| {
        effects.force_equation.trail(trail, R::from_f64(way_m))
    })
}

/// The levels of a friction that depends on the place.
fn placed<R: Real>(
    carriage: &Carriage<R>,
    levels: FrictionLevels<R>,
    place_m: R,
) -> FrictionLevels<R> {
    let effects = carriage.effects.as_ref();
    effects.map_or(levels, |effects| {
        effects.position_friction.levels(levels, place_m)
    })
}

impl<R: Real> Driven<'_, R> {
    fn is_free(&self, position_m: f64) -> bool {
        self.ends_m.is_none_or(|[low, high]| {
            position_m > low.value() + AT_THE_END_M && position_m < high.value() - AT_THE_END_M
        })
    }

    fn forces(&self, carriage: &Carriage<R>, reading: &PositionReading) -> Along<R> {
        let (values, track, motion) = (self.values, self.track, self.motion);
        let position = self.position_m;
        let (load, _) = carriage.load();
        // Where a load is in its play nobody knows when the carriage leaves: it is taken as rigid.
        let is_loose = load.is_some_and(|load| load.gap_m > R::ZERO);
        let (declared, terms) = (values.friction_levels(), values.friction_terms());
        let bristle = values.bristle();
        let ambient = carriage.ambient_pressure_pa;
        let time = &track.recording.time_s;
        let events = breakaways(time, reading).into_iter();
        let events = events.filter(|event| self.is_free(position[event.row]));
        let mut events = events.peekable();
        let mut along = Along::with_room_for(track.len());
        let velocity = |row: usize| R::from_f64(motion.velocity_m_per_s[row]);
        let mut state = CarriageState::new(R::from_f64(motion.position_m[0]), velocity(0));
        let mut sliding_before_n = None;
        for row in 0..track.len() {
            let [p_a, p_b] = self.pressures.at(row);
            let gas_n = carriage.drive_n(p_a, p_b) - terms.constant_force_n;
            let before = row.saturating_sub(1);
            let dt_s = (time[row] - time[before]).max(1e-9);
            let way = motion.position_m[row] - motion.position_m[before];
            let dt = R::from_f64(dt_s);
            // Of the position itself, as the acceleration is: the bump takes its noise. A smoothed velocity is
            // off by 0.07 N where pressures part by 20 bar/s, and bent mass and friction by 2 to 4 %.
            let speed = |row: usize| R::from_f64(slope(time, position, row, 1));
            state.trail = trail_after(carriage, state.trail, way_m(motion, row));
            let load_n = match &load {
                Some(load) if row > 0 => {
                    load.follow(&mut state.load, speed(before), speed(row), dt)
                }
                _ => R::ZERO,
            };
            state.position_m = Compensated::new(R::from_f64(motion.position_m[row]));
            state.velocity_m_per_s = velocity(row);
            let declared_here = terms.levels(&declared, p_a - ambient, p_b - ambient);
            let levels = carriage.levels(&state, declared_here);
            if let Some(event) = events.next_if(|event| event.row <= row) {
                let place_m = state.position_m.value;
                along
                    .breaks
                    .push((event, placed(carriage, declared_here, place_m)));
            }
            let dry = dry(levels);
            let step = R::from_f64(way / dt_s);
            let here_n = dry.sliding_n(&bristle, step);
            let sliding_n = [sliding_before_n.replace(here_n).unwrap_or(here_n), here_n];
            let (deflection, friction) =
                bristle.step_driven_between(sliding_n, &dry, step, state.deflection_m, dt);
            state.deflection_m = deflection;
            let outer = outer_n(carriage, &state);
            let held_n = if is_loose { R::ZERO } else { load_n };
            let force_n = gas_n - load_n - outer - friction - levels.viscous_n_s_per_m * speed(row);
            along.gas_n.push(gas_n.value());
            along.driving_n.push(gas_n - held_n - outer);
            along.force_n.push(force_n);
        }
        along
    }

    fn report_break_aways(
        &self,
        carriage: &Carriage<R>,
        along: &Along<R>,
        reading: &PositionReading,
        sink: &mut dyn Sink<R>,
    ) {
        let (load, mass_kg) = carriage.load();
        let is_loose = load.is_some_and(|load| load.gap_m > R::ZERO);
        let time = &self.track.recording.time_s;
        let recorded = Recorded::new(time, reading, &along.gas_n, &along.driving_n);
        let still = self.values.still_carriage();
        for (event, levels) in &along.breaks {
            let stand = Stand {
                carriage,
                mass_kg: if is_loose { carriage.mass_kg } else { mass_kg },
                levels: *levels,
                air_spring_n_per_m: air_spring_n_per_m(
                    self.values,
                    &self.pressures,
                    self.position_m,
                    event.row,
                ),
            };
            if let Some(residual) = stand.residual(&stand.still(&still), event, &recorded) {
                let outputs = [skipped(), skipped(), or_infinite(residual)];
                sink.row(event.row, &outputs, &[]);
            }
        }
    }

    /// The balance over windows in which the carriage slides or creeps.
    fn report_windows(&self, carriage: &Carriage<R>, force_n: &[R], sink: &mut dyn Sink<R>) {
        let (_, mass_kg) = carriage.load();
        let (track, motion, position) = (self.track, self.motion, self.position_m);
        let bump = Bump::of(track);
        let half = bump.weights.len() / 2;
        let mut centre = half + 1;
        while centre + half + 1 < track.len() {
            let rows = centre - half..centre + half + 1;
            // A smoothed velocity mixes in what lies that far beyond: a stop, perhaps.
            let beyond = motion.half_width;
            let smoothed = rows.start.saturating_sub(beyond)..(rows.end + beyond).min(track.len());
            let slowest = slowest_m_per_s(&motion.velocity_m_per_s[smoothed]);
            let touches_no_end = position[rows.clone()]
                .iter()
                .all(|&place| self.is_free(place));
            if slowest > CREEPING_M_PER_S && touches_no_end {
                let place = position[centre];
                let curved: f64 = bump
                    .curvature
                    .iter()
                    .zip(&position[rows.start - 1..rows.end + 1])
                    .map(|(c, x)| c * (x - place))
                    .sum();
                let mut mean = -mass_kg * R::from_f64(curved);
                for (weight, &force) in bump.weights.iter().zip(&force_n[rows]) {
                    mean += R::from_f64(*weight) * force;
                }
                let outputs = if slowest > SLIDING_M_PER_S {
                    [or_infinite(mean), skipped(), skipped()]
                } else {
                    [skipped(), or_infinite(mean), skipped()]
                };
                sink.row(centre, &outputs, &[]);
            }
            centre += (half / 2).max(1);
        }
    }
}

/// The least speed over some rows; none where it turns, be it from one row to the next. The bristle
/// bends over within that row, which nobody recorded: windows over hard reversals (73 m/s2 rms)
/// took the balance from 0.06 to 0.24 N at the true numbers, and a load of 50 g on a spring was named.
fn slowest_m_per_s(velocity_m_per_s: &[f64]) -> f64 {
    let turns = velocity_m_per_s
        .iter()
        .any(|v| v * velocity_m_per_s[0] <= 0.0);
    let speeds = velocity_m_per_s.iter().map(|v| v.abs());
    if turns {
        0.0
    } else {
        speeds.fold(f64::INFINITY, f64::min)
    }
}

/// How stiffly the gas of both chambers holds the piston at a row, N/m: n p A^2 / V of each.
/// Nought where a volume is not known.
fn air_spring_n_per_m<R: Real>(
    values: &Values<'_, R>,
    pressures: &PressureReading<'_, R>,
    position_m: &[f64],
    row: usize,
) -> R {
    let of = |side: Side, pressure: R| {
        let geometry = values.geometry(side)?;
        let volume = geometry.volume_m3(R::from_f64(position_m[row]));
        Some(R::from_f64(POLYTROPIC) * pressure * geometry.area_m2 * geometry.area_m2 / volume)
    };
    let [p_a, p_b] = pressures.at(row);
    match (of(Side::A, p_a), of(Side::B, p_b)) {
        (Some(a), Some(b)) => a + b,
        _ => R::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_what_turns_between_two_rows_does_not_slide() {
        let slides = |velocity: &[f64]| slowest_m_per_s(velocity) > SLIDING_M_PER_S;
        assert!(slides(&[0.05, 0.02, 0.03]) && slides(&[-0.05, -0.02]));
        assert!(!slides(&[0.05, 0.01, 0.05]));
        assert!(!slides(&[0.08, 0.06, -0.06, -0.07]));
        assert!(!slides(&[-0.06, 0.07]));
    }
}
