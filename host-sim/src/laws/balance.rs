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
//! such windows are left out. What stiction is shows at break-away: the gas force
//! at which the carriage leaves its place against the static level, one residual
//! per event.

use super::carriage_history::slope;
use super::force::outer_n;
use super::{Output, Sink, Track, delayed, white_noise};
use crate::model::{Side, Values};
use model_core::carriage::{Carriage, CarriageState};
use model_core::friction::FrictionLevels;
use model_core::left_out::DwellStiction;
use model_core::math::Compensated;
use model_core::real::Real;

/// Half width of the bump, s: 40 ms in all resolve the reversal of a hard
/// stroke, and average the pressures' noise to a fifth.
const HALF_WIDTH_S: f64 = 0.02;
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
/// The carriage stands where it stays within this of its place, m: presliding
/// of metal guides is some 20 to 60 um.
const STANDING_M: f64 = 1e-4;
/// ... or within this many deviations of its sensor's noise ...
const STANDING_DEVIATIONS: f64 = 5.0;
/// ... for at least this long, s.
const LEAST_REST_S: f64 = 0.03;
/// The first way after break-away, m: from its parabola over time the instant
/// of the break-away is found.
const FIRST_WAY_M: f64 = 1e-3;
/// How well that instant is found, s.
const INSTANT_NOISE_S: f64 = 3e-3;
/// Rows on either side over which the gas force at that instant is averaged.
const INSTANT_ROWS: usize = 2;
/// How far off the force at break-away is at a slow rise, N: on nineteen carriages whose
/// friction is the model's, or nearly so, 0.4 to 2.4 N were left. Faster events are
/// scaled to it.
const BREAKAWAY_NOISE_N: f64 = 1.5;
/// A break-away that is off by more than this says no more than that, N: it may
/// have been none.
const MOST_TOLD_N: f64 = 12.0;
/// Slower rises of force than this are taken as this, N/s.
const LEAST_RATE_N_PER_S: f64 = 20.0;
/// Events that are worse than this many times that are left out.
const WORST_EVENT: f64 = 4.0;

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

/// The output of the break-aways; its residuals are limited.
pub const BREAKAWAY: usize = 2;

/// The noise of the outputs that the law itself knows of, N.
pub const OWN_NOISE_N: [f64; 3] = [SLIDING_NOISE_N, CREEPING_NOISE_N, BREAKAWAY_NOISE_N];

/// The instant at which a carriage leaves its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakaway {
    /// The row before which it left.
    pub row: usize,
    /// The instant, s.
    pub at_s: f64,
    /// +1 or -1.
    pub direction: f64,
    /// How long it has stood, s.
    pub rest_s: f64,
}

/// The break-aways of a recorded position.
pub fn breakaways(time_s: &[f64], position_m: &[f64]) -> Vec<Breakaway> {
    let mut events = Vec::new();
    let standing_m = STANDING_M.max(STANDING_DEVIATIONS * white_noise(position_m));
    let Some(&first) = position_m.first() else {
        return events;
    };
    // The place is the mean of where it has stood so far.
    let (mut place, mut since, mut rows) = (first, 0_usize, 1.0);
    // The place before, and whether an event told of it.
    let (mut place_before, mut was_told) = (f64::INFINITY, false);
    for (row, &position) in position_m.iter().enumerate() {
        let away = position - place;
        if away.abs() <= standing_m {
            rows += 1.0;
            place += away / rows;
            continue;
        }
        let rest_s = time_s[row] - time_s[since];
        if rest_s < LEAST_REST_S {
            (place, since, rows) = (position, row, 1.0);
            continue;
        }
        // Within the first way from the place before it creeps: neither was a rest.
        let creeps = (place - place_before).abs() < FIRST_WAY_M;
        if creeps && was_told {
            events.pop();
        }
        place_before = place;
        let instant = instant(&time_s[row..], &position_m[row..], place).filter(|_| !creeps);
        was_told = instant.is_some();
        if let Some(at_s) = instant {
            let at_s = at_s.clamp(time_s[since], time_s[row]);
            events.push(Breakaway {
                row: time_s.partition_point(|&time| time < at_s),
                at_s,
                direction: away.signum(),
                rest_s,
            });
        }
        (place, since, rows) = (position, row, 1.0);
    }
    events
}

/// The instant at which a way that grows with the square of time began: the
/// root of the way is a straight line of time. `None` where the carriage does
/// not get through the first millimetre, or turns back.
fn instant<R: Real>(time_s: &[R], position_m: &[R], place_m: R) -> Option<R> {
    let is_first = |way: f64| way <= FIRST_WAY_M && way > 0.5 * STANDING_M;
    let roots: Vec<(R, R)> = time_s
        .iter()
        .zip(position_m)
        .map(|(&time, &position)| (time, (position - place_m).abs()))
        .take_while(|(_, way)| is_first(way.value()))
        .map(|(time, way)| (time, way.sqrt()))
        .collect();
    if roots.len() < 3 {
        return None;
    }
    let share = R::ONE / R::from_f64(roots.len() as f64);
    let (mut time, mut root) = (R::ZERO, R::ZERO);
    for &(at, value) in &roots {
        time += at * share;
        root += value * share;
    }
    let (mut covariance, mut variance) = (R::ZERO, R::ZERO);
    for &(at, value) in &roots {
        covariance += (at - time) * (value - root);
        variance += (at - time) * (at - time);
    }
    let slope = covariance / variance;
    (slope.value() > 0.0).then(|| time - root / slope)
}

/// When a way that never turns back, known at equal steps, reaches a length.
fn reached<R: Real>(way_m: &[R], step_s: f64, length_m: f64) -> Option<R> {
    let after = way_m.partition_point(|way| way.value() <= length_m);
    let before = after.checked_sub(1)?;
    let (from, to) = (*way_m.get(before)?, *way_m.get(after)?);
    let share = (R::from_f64(length_m) - from) / (to - from);
    Some((R::from_f64(before as f64) + share) * R::from_f64(step_s))
}

/// The instant of [`instant`] as rows would show it, taken between the same two
/// lengths whatever the parameters: rows that enter and leave would hide how the
/// instant moves with them.
fn instant_of_way<R: Real>(way_m: &[R], step_s: f64) -> Option<R> {
    const ROWS: usize = 20;
    let first_s = reached(way_m, step_s, STANDING_M)?;
    let last_s = reached(way_m, step_s, FIRST_WAY_M)?;
    let (mut time_s, mut position_m) = (Vec::with_capacity(ROWS), Vec::with_capacity(ROWS));
    for row in 0..ROWS {
        let share = R::from_f64(row as f64 / ROWS as f64);
        let at_s = first_s + (last_s - first_s) * share;
        let before = ((at_s.value() / step_s) as usize).min(way_m.len() - 2);
        let (from, to) = (way_m[before], way_m[before + 1]);
        let part = at_s / R::from_f64(step_s) - R::from_f64(before as f64);
        time_s.push(at_s);
        position_m.push(from + (to - from) * part);
    }
    instant(&time_s, &position_m, R::ZERO)
}

/// The part of the rise of stiction over sliding friction that a break-away
/// shows when it is read as [`instant`] reads it: a bristle gives way little by
/// little, the more so the faster the force rises, and a seal that has aged
/// forgets on the way. Found by doing just that with the model's own bristle
/// under a force that rises at `rate_n_per_s`; `levels` are those of a new seal.
fn seen_share<R: Real>(
    carriage: &Carriage<R>,
    levels: &FrictionLevels<R>,
    age: R,
    rate_n_per_s: f64,
) -> R {
    const STEP_S: f64 = 1e-4;
    const MOST_STEPS: usize = 4000;
    let bristle = carriage.bristle;
    let dwell = carriage
        .effects
        .map_or_else(DwellStiction::neutral, |effects| effects.dwell_stiction);
    let aged = dwell.levels(*levels, age);
    let rise_n = aged.static_n - aged.coulomb_n;
    if rise_n <= R::ZERO {
        return R::ONE;
    }
    let rate = rate_n_per_s.max(LEAST_RATE_N_PER_S);
    // Begun where even the slowest rise breaks away in time.
    let half = levels.coulomb_n * R::from_f64(0.5);
    let start_n = half.max(aged.static_n - R::from_f64(0.3 * rate));
    let step_s = R::from_f64(STEP_S);
    let mut velocity = R::ZERO;
    let mut deflection = start_n / bristle.stiffness_n_per_m;
    let (mut way_m, mut way) = (Vec::new(), R::ZERO);
    let mut age = age * (-deflection / dwell.forgetting_way_m).exp();
    for step in 0..MOST_STEPS {
        let at_s = step as f64 * STEP_S;
        way_m.push(way);
        if way.value() > FIRST_WAY_M {
            break;
        }
        let out = bristle.step_with_mass(
            &dwell.levels(*levels, age),
            carriage.mass_kg,
            velocity,
            deflection,
            start_n + R::from_f64(rate * at_s),
            step_s,
        );
        (velocity, deflection) = (out.velocity_m_per_s, out.deflection_m);
        age = dwell.step(age, velocity, step_s);
        way += step_s * velocity;
    }
    match instant_of_way(&way_m, STEP_S) {
        Some(at_s) => {
            let force_n = start_n + R::from_f64(rate) * at_s;
            (force_n - aged.coulomb_n) / rise_n
        }
        None => R::ONE,
    }
}

/// Bump and its second derivative, normalised to a mean.
struct Bump {
    weights: Vec<f64>,
    /// One row longer at either end.
    curvature: Vec<f64>,
}

impl Bump {
    fn new(step_s: f64) -> Self {
        let half = ((HALF_WIDTH_S / step_s).round() as usize).max(3);
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

/// A residual that grows ever less towards [`MOST_TOLD_N`].
fn limited<R: Real>(residual: R) -> R {
    let ratio = residual / R::from_f64(MOST_TOLD_N);
    residual / (R::ONE + ratio * ratio).sqrt()
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

pub(super) fn predict<R: Real>(values: &Values<'_, R>, track: &Track<'_>, sink: &mut impl Sink<R>) {
    let (Some(motion), Some(a), Some(b)) = (
        track.motion.as_ref(),
        track.signal("p_a"),
        track.signal("p_b"),
    ) else {
        return;
    };
    let Some(position) = track.signal("x") else {
        return;
    };
    let carriage = values.carriage();
    let (load, mass_kg) = carriage.load();
    let (declared, terms) = (values.friction_levels(), values.friction_terms());
    let bristle = values.bristle();
    let ambient = carriage.ambient_pressure_pa;
    let offsets = Side::BOTH.map(|side| values.pressure_offset_pa(side));
    let time = &track.recording.time_s;
    let pressure = PressureReading {
        time_s: time,
        lag_s: values.effect("pressure-sensor-lag", "time_constant_s", 0.0),
        skew_s: values.effect("position-time-skew", "delay_s", 0.0),
    };
    let bump = Bump::new(super::motion::median_step_s(time));
    let mut gas: Vec<R> = Vec::with_capacity(track.len());
    let mut force: Vec<R> = Vec::with_capacity(track.len());
    let ends = values.stroke_ends_m();
    let is_free = |position: f64| {
        ends.is_none_or(|[low, high]| {
            position > low.value() + AT_THE_END_M && position < high.value() - AT_THE_END_M
        })
    };
    let events = breakaways(time, position).into_iter();
    let events = events.filter(|event| is_free(position[event.row]));
    let mut events = events.peekable();
    let mut breaks: Vec<(Breakaway, FrictionLevels<R>)> = Vec::new();
    let velocity = |row: usize| R::from_f64(motion.velocity_m_per_s[row]);
    let mut state = CarriageState::new(R::from_f64(motion.position_m[0]), velocity(0));
    for row in 0..track.len() {
        let p_a = pressure.at(a, row) - offsets[0];
        let p_b = pressure.at(b, row) - offsets[1];
        gas.push(carriage.drive_n(p_a, p_b) - terms.constant_force_n);
        let before = row.saturating_sub(1);
        let dt_s = (time[row] - time[before]).max(1e-9);
        let way = motion.position_m[row] - motion.position_m[before];
        let dt = R::from_f64(dt_s);
        let load_n = match &load {
            // A contact lasts a few rows: its velocity is hardly smoothed.
            Some(load) if row > 0 => {
                let [from, to] =
                    [before, row].map(|row| R::from_f64(slope(time, position, row, 1)));
                load.follow(&mut state.load, from, to, dt)
            }
            _ => R::ZERO,
        };
        state.position_m = Compensated::new(R::from_f64(motion.position_m[row]));
        state.velocity_m_per_s = velocity(row);
        let levels = terms.levels(&declared, p_a - ambient, p_b - ambient);
        let levels = carriage.levels(&state, levels);
        if let Some(event) = events.next_if(|event| event.row <= row) {
            breaks.push((event, levels));
        }
        let dry = FrictionLevels {
            viscous_n_s_per_m: R::ZERO,
            ..levels
        };
        let step = R::from_f64(way / dt_s);
        let (deflection, friction) = bristle.step_driven(&dry, step, state.deflection_m, dt);
        state.deflection_m = deflection;
        let viscous = levels.viscous_n_s_per_m * velocity(row);
        let outer = outer_n(&carriage, &state);
        force.push(gas[row] - friction - viscous - load_n - outer);
    }
    for (event, levels) in breaks {
        let Some((drive, noise_n, rate)) = event.force(time, &gas) else {
            continue;
        };
        let scale = BREAKAWAY_NOISE_N / noise_n;
        if scale * WORST_EVENT <= 1.0 {
            continue;
        }
        let dwell = carriage.effects.map(|effects| effects.dwell_stiction);
        let age = dwell.map_or(R::ZERO, |dwell| {
            dwell.step(R::ZERO, R::ZERO, R::from_f64(event.rest_s))
        });
        let seen = seen_share(&carriage, &levels, age, rate);
        let levels = dwell.map_or(levels, |dwell| dwell.levels(levels, age));
        let held = levels.coulomb_n + (levels.static_n - levels.coulomb_n) * seen;
        let residual = limited((drive - held) * R::from_f64(scale));
        let outputs = [skipped(), skipped(), or_infinite(residual)];
        sink.row(event.row, &outputs, &[]);
    }
    let half = bump.weights.len() / 2;
    let mut centre = half + 1;
    while centre + half + 1 < track.len() {
        let rows = centre - half..centre + half + 1;
        // A smoothed velocity mixes in what lies that far beyond: a stop, perhaps.
        let beyond = motion.half_width;
        let smoothed = rows.start.saturating_sub(beyond)..(rows.end + beyond).min(track.len());
        let slowest = motion.velocity_m_per_s[smoothed]
            .iter()
            .fold(f64::INFINITY, |least, v| least.min(v.abs()));
        let touches_no_end = position[rows.clone()].iter().all(|&place| is_free(place));
        if slowest > CREEPING_M_PER_S && touches_no_end {
            let place = position[centre];
            let curved: f64 = bump
                .curvature
                .iter()
                .zip(&position[rows.start - 1..rows.end + 1])
                .map(|(c, x)| c * (x - place))
                .sum();
            let mut mean = -mass_kg * R::from_f64(curved);
            for (weight, &force) in bump.weights.iter().zip(&force[rows]) {
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

/// How a pressure is read off its recording, where its sensor lags or the
/// position was logged at another time.
struct PressureReading<'a, R> {
    time_s: &'a [f64],
    lag_s: R,
    skew_s: R,
}

impl<R: Real> PressureReading<'_, R> {
    /// The pressure when the position of this row was where it was recorded.
    fn at(&self, recorded_pa: &[f64], row: usize) -> R {
        let shown = if self.skew_s.value().abs() > 0.0 {
            delayed(self.time_s, recorded_pa, row, -self.skew_s)
        } else {
            R::from_f64(recorded_pa[row])
        };
        if self.lag_s.value() <= 0.0 {
            return shown;
        }
        // Over as many rows as a lag lasts: the bump averages the rest.
        const REACH: usize = 1;
        let (from, to) = (
            row.saturating_sub(REACH),
            (row + REACH).min(recorded_pa.len() - 1),
        );
        let slope = (recorded_pa[to] - recorded_pa[from]) / (self.time_s[to] - self.time_s[from]);
        shown + self.lag_s * R::from_f64(slope)
    }
}

impl Breakaway {
    /// The force in the direction of the break-away at its instant, how well it
    /// is known, N, and how fast it rises, N/s.
    fn force<R: Real>(&self, time_s: &[f64], gas_n: &[R]) -> Option<(R, f64, f64)> {
        let from = self.row.checked_sub(INSTANT_ROWS + 1)?;
        let rows = from..self.row + INSTANT_ROWS;
        let around = gas_n.get(rows.clone())?;
        let mut mean = R::ZERO;
        for &force in around {
            mean += force;
        }
        let count = around.len() as f64;
        let (first, last) = (around.first()?.value(), around.last()?.value());
        let rate = (last - first) / (time_s[rows.end - 1] - time_s[rows.start]);
        let noise_n = BREAKAWAY_NOISE_N.hypot(rate * INSTANT_NOISE_S);
        let force = mean * R::from_f64(self.direction / count);
        Some((force, noise_n, rate * self.direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::left_out::CarriageEffects;
    use model_core::paper;
    use model_core::real::Dual;

    /// Force that a break-away shows, by static level, age and forgetting way.
    fn held_n<R: Real>([static_n, age, way_m]: [R; 3], rate_n_per_s: f64) -> R {
        let mut effects = CarriageEffects::neutral();
        effects.dwell_stiction = DwellStiction {
            rise_n: R::from_f64(30.0),
            time_constant_s: R::ONE,
            forgetting_way_m: way_m,
        };
        let carriage = Carriage {
            effects: Some(effects),
            ..paper::axis::<R>().carriage
        };
        let levels = FrictionLevels {
            static_n,
            ..paper::friction_levels::<R>()
        };
        let aged = effects.dwell_stiction.levels(levels, age);
        let seen = seen_share(&carriage, &levels, age, rate_n_per_s);
        levels.coulomb_n + (aged.static_n - levels.coulomb_n) * seen
    }

    #[test]
    fn val_derivatives_of_a_break_away_are_its_differences() {
        for (rate, age) in [(30.0, 0.5), (400.0, 0.0), (400.0, 0.3), (2000.0, 0.8)] {
            let at = [45.0, age, 2e-4];
            let dual: [Dual<3>; 3] = std::array::from_fn(|i| Dual::parameter(at[i], i));
            let slopes = held_n(dual, rate).gradient;
            for (index, step) in [0.5, 0.02, 1e-5].into_iter().enumerate() {
                let moved = |by: f64| {
                    let mut at = at;
                    at[index] += by;
                    held_n(at, rate)
                };
                let difference = (moved(step) - moved(-step)) / (2.0 * step);
                println!(
                    "{rate} N/s, age {age}: {index} {:.4} {difference:.4}",
                    slopes[index]
                );
                let scale = [1.0, 30.0, 30.0 / 2e-4][index];
                assert!((slopes[index] - difference).abs() < 0.03 * scale);
            }
        }
    }
}
