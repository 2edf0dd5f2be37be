//! A free carriage driven by recorded pressures, predicting its position.

use super::carriage_history::recall;
use super::pressure_reading::PressureReading;
use super::{InitialState, Output, Sink, Track, View};
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

pub(super) const OUTPUT: Output = Output {
    signal: "x",
    place: "force-balance",
    unit: "m",
};

pub(super) fn initial_states(recording: &Recording, row: usize, view: View) -> Vec<InitialState> {
    let time = &recording.time_s;
    let position = recording.signal("x").unwrap_or(&[]);
    let (x, slope) = view.value_and_slope(time, position, row);
    let velocity = match recording.signal("v") {
        Some(v) => view.value(time, v, row),
        None => slope,
    };
    let state = |name, guess, standard_deviation, measured_by| InitialState {
        name,
        guess,
        standard_deviation,
        bounds: (-1e3, 1e3),
        measured_by,
        read_by: None,
    };
    vec![
        state("x", x, 1e-3, Some(0)),
        state("v", velocity, 1e-2, Some(0)),
    ]
}

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    initial: &[R],
    sink: &mut dyn Sink<R>,
) {
    let (Some(pressures), Some(x)) = (PressureReading::new(values, track), track.signal("x"))
    else {
        return;
    };
    if rows.is_empty() {
        return;
    }
    let carriage = values.carriage();
    let (declared, terms) = (values.friction_levels(), values.friction_terms());
    let ambient = carriage.ambient_pressure_pa;
    let drive = |p_a: R, p_b: R| carriage.drive_n(p_a, p_b) - terms.constant_force_n;
    let mut state = CarriageState::new(initial[0], initial[1]);
    let forces = |row: usize, velocity: R| {
        let [p_a, p_b] = pressures.at(row);
        let levels = terms.levels(&declared, p_a - ambient, p_b - ambient);
        let here = CarriageState::new(R::from_f64(x[row]), velocity);
        let levels = carriage.levels(&here, levels);
        let friction = levels.steady_n(&carriage.bristle, velocity);
        let held = carriage.unknown_force_n(here.position_m.value, velocity);
        [drive(p_a, p_b) - held, friction, levels.coulomb_n]
    };
    let [p_a, p_b] = pressures.at(rows.start);
    recall(&carriage, track, rows.start, &forces, &mut state);
    let levels = terms.levels(&declared, p_a - ambient, p_b - ambient);
    let levels = carriage.levels(&state, levels);
    let held = carriage.unknown_force_n(initial[0], initial[1]);
    let drive_n = drive(p_a, p_b) - held;
    state.deflection_m = start_deflection(&carriage.bristle, &levels, initial[1], drive_n);
    sink.row(rows.start, &[initial[0]], initial);
    let mut before = [p_a, p_b];
    for row in rows.start..rows.end.saturating_sub(1) {
        let dt_s = track.dt_s(row);
        let steps = (dt_s / LONGEST_STEP_S - 1e-9).ceil().max(1.0);
        let step_s = R::from_f64(dt_s / steps);
        let after = pressures.at(row + 1);
        for step in 0..steps as u32 {
            let share = (f64::from(step) + 0.5) / steps;
            let share = R::from_f64(share);
            let [p_a, p_b] = [0, 1].map(|side| before[side] + share * (after[side] - before[side]));
            let levels = terms.levels(&declared, p_a - ambient, p_b - ambient);
            carriage.step(&mut state, &levels, drive(p_a, p_b), step_s);
        }
        before = after;
        let position = state.position_m.value;
        sink.row(row + 1, &[position], &[position, state.velocity_m_per_s]);
    }
}

/// Deflection at the start of a window: steady where the carriage slides; where
/// it stands, the one that carries the drive force, as far as stiction can.
///
/// Not from the motion before the window: a carriage that stands under load has
/// its bristle bent since long ago, and beginning with a relaxed bristle lets it
/// break away, millimetres within the window. A wrong guess while sliding is
/// forgotten within 0.1 mm of way.
fn start_deflection<R: Real>(
    bristle: &Bristle<R>,
    levels: &FrictionLevels<R>,
    velocity_m_per_s: R,
    drive_n: R,
) -> R {
    let most_n = levels.sliding_n(bristle, velocity_m_per_s);
    let slides = velocity_m_per_s.abs() > bristle.stribeck_velocity_m_per_s;
    let carried_n = if slides {
        most_n * velocity_m_per_s.signum()
    } else {
        drive_n.clamp(-most_n, most_n)
    };
    carried_n / bristle.stiffness_n_per_m
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
