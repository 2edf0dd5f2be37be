//! A free carriage driven by recorded pressures, predicting its position.

use super::motion::local_quadratic;
use super::{InitialState, Output, Sink, Track};
use crate::model::Values;
use crate::recording::Recording;
use model_core::carriage::CarriageState;
use model_core::friction::{Bristle, FrictionLevels};
use model_core::real::Real;
use std::ops::Range;

/// The longest step, s: friction is first order in the step, and at 1 ms its
/// error is several times the noise of a good position sensor (measured: 5 mm/s
/// against 1.6 mm/s rms of velocity).
const LONGEST_STEP_S: f64 = 2.5e-4;
/// Rows on each side from which position and velocity at a window's start are
/// estimated.
const START_HALF_WIDTH: usize = 4;

pub(super) const OUTPUT: Output = Output {
    signal: "x",
    place: "force-balance",
    unit: "m",
};

pub(super) fn initial_states(recording: &Recording, row: usize) -> Vec<InitialState> {
    let time = &recording.time_s;
    let position = recording.signal("x").unwrap_or(&[]);
    let from = row.saturating_sub(START_HALF_WIDTH);
    let to = (row + START_HALF_WIDTH + 1).min(position.len());
    let [x, slope, _] = local_quadratic(&time[from..to], &position[from..to], time[row]);
    let velocity = match recording.signal("v") {
        Some(v) => local_quadratic(&time[from..to], &v[from..to], time[row])[0],
        None => slope,
    };
    let state = |name, guess, standard_deviation, measured_by| InitialState {
        name,
        guess,
        standard_deviation,
        lower: -1e3,
        measured_by,
    };
    vec![
        state("x", x, 1e-3, Some(0)),
        state("v", velocity, 1e-2, None),
    ]
}

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    initial: &[R],
    sink: &mut impl Sink<R>,
) {
    let (Some(a), Some(b)) = (track.signal("p_a"), track.signal("p_b")) else {
        return;
    };
    let carriage = values.carriage();
    let (declared, terms) = (values.friction_levels(), values.friction_terms());
    let ambient = carriage.ambient_pressure_pa;
    let drive = |p_a: R, p_b: R| carriage.drive_n(p_a, p_b) - terms.constant_force_n;
    let mut state = CarriageState::new(initial[0], initial[1]);
    let at_start = |p: &[f64]| R::from_f64(p.get(rows.start).copied().unwrap_or(f64::NAN));
    let (p_a, p_b) = (at_start(a), at_start(b));
    let levels = terms.levels(&declared, p_a - ambient, p_b - ambient);
    let acceleration = acceleration_m_per_s2(track, rows.start);
    let inertia_n = carriage.mass_kg * R::from_f64(acceleration);
    let rest_n = drive(p_a, p_b) - inertia_n;
    state.deflection_m = start_deflection(&carriage.bristle, &levels, initial[1], rest_n);
    sink.row(rows.start, &[initial[0]], initial);
    for row in rows.start..rows.end.saturating_sub(1) {
        let dt_s = track.dt_s(row);
        let steps = (dt_s / LONGEST_STEP_S - 1e-9).ceil().max(1.0);
        let step_s = R::from_f64(dt_s / steps);
        for step in 0..steps as u32 {
            let share = (f64::from(step) + 0.5) / steps;
            let between = |p: &[f64]| R::from_f64(p[row] + share * (p[row + 1] - p[row]));
            let (p_a, p_b) = (between(a), between(b));
            let levels = terms.levels(&declared, p_a - ambient, p_b - ambient);
            carriage.step(&mut state, &levels, drive(p_a, p_b), step_s);
        }
        let position = state.position_m.value;
        sink.row(row + 1, &[position], &[position, state.velocity_m_per_s]);
    }
}

fn acceleration_m_per_s2(track: &Track<'_>, row: usize) -> f64 {
    let motion = track.motion.as_ref();
    motion.map_or(0.0, |motion| motion.acceleration_m_per_s2[row])
}

/// Deflection with which the bristle carries what force the motion leaves over,
/// as far as it can.
///
/// Not from the motion before the window: a carriage that stands under load
/// (stiction) has its bristle bent since long ago, and beginning such a window
/// with a relaxed bristle lets the carriage break away, millimetres within the
/// window.
fn start_deflection<R: Real>(
    bristle: &Bristle<R>,
    levels: &FrictionLevels<R>,
    velocity_m_per_s: R,
    friction_n: R,
) -> R {
    let most_n = levels.sliding_n(bristle, velocity_m_per_s);
    let carried_n = friction_n - levels.viscous_n_s_per_m * velocity_m_per_s;
    carried_n.clamp(-most_n, most_n) / bristle.stiffness_n_per_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Law;
    use crate::rig::Rig;
    use std::collections::BTreeMap;

    const RIG: &str = r#"
        format = "rig/1"
        [signals]
        t = { column = "t", unit = "s" }
        x = { column = "x", unit = "m" }
        p_a = { column = "p_a", unit = "Pa(abs)" }
        p_b = { column = "p_b", unit = "Pa(abs)" }
        [cylinder]
        area_a_m2 = 4.909e-4
        area_b_m2 = 4.909e-4
        [carriage]
        mass_kg = 2.0
        [friction]
        bristle_stiffness_N_m = 9.14e5
        bristle_damping_Ns_m = 1327.0
        coulomb_N = 20.2
        static_N = 28.9
        stribeck_velocity_m_s = 5.03e-3
    "#;

    #[test]
    fn regress_a_carriage_that_stands_under_load_stays() {
        // 27 N below a stiction of 28.9 N, standing since long before the window.
        let rig = Rig::parse(RIG, "rig.toml").unwrap();
        let time: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
        let level = |value: f64| vec![value; time.len()];
        let signals = BTreeMap::from([
            ("x".to_owned(), level(0.1)),
            ("p_a".to_owned(), level(5e5 + 27.0 / 4.909e-4)),
            ("p_b".to_owned(), level(5e5)),
        ]);
        let recording = Recording::from_signals("standing", time, signals);
        let values = Values::<f64> {
            rig: &rig,
            keys: &[],
            replaced: &[],
        };
        let mut farthest = 0.0_f64;
        let mut sink = |_: usize, outputs: &[f64], _: &[f64]| {
            farthest = farthest.max((outputs[0] - 0.1).abs());
        };
        let track = Track::new(&recording);
        Law::Carriage.predict(&values, &track, 500..750, &[0.1, 0.0], &mut sink);
        assert!(farthest < 1e-6, "moved {farthest} m");
    }
}
