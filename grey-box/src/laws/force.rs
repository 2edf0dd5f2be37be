//! A bench that measures force: motion and pressures in, force out.
//!
//! ```text
//! F = (pa - p0) Aa - (pb - p0) Ab - Ff - M x'' - FL - Fl - Fe
//! ```
//!
//! F acts on the carriage against +x, as a test machine that holds the rod
//! does. The bristle follows the recorded displacement, not a velocity: it
//! needs no derivative, and its own stiffness filters the jitter of a position
//! at rest. A load behind a spring follows the motion and takes the force Fl (M
//! is then the mass without it); buffers at the ends take Fe.

use super::{Output, Sink, Track, delayed};
use crate::effects::sensing::position_time_skew;
use crate::gauge::Gauge;
use crate::model::{Side, Values};
use model_core::carriage::{Carriage, CarriageState};
use model_core::friction::FrictionLevels;
use model_core::left_out::LoadCoupling;
use model_core::math::Compensated;
use model_core::real::Real;
use std::ops::Range;

pub(super) const OUTPUT: Output = Output {
    signal: "force",
    place: "force-balance",
    unit: "N",
};

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    sink: &mut dyn Sink<R>,
) {
    let Some(motion) = track.motion.as_ref() else {
        return;
    };
    let carriage = values.carriage();
    let (declared, terms) = (values.friction_levels(), values.friction_terms());
    let bristle = values.bristle();
    let ambient = carriage.ambient_pressure_pa;
    let skew_s = position_time_skew::delay_s(values);
    let gauges = Side::BOTH.map(|side| Gauge::of(values, side));
    let gauge = |side: Side, row: usize| match track.signal(side.pressure_signal()) {
        Some(pressure) => gauges[side as usize].reads_pa(R::from_f64(pressure[row])) - ambient,
        None => R::ZERO,
    };
    let time = &track.recording.time_s;
    let read = |signal: &[f64], row: usize| delayed(time, signal, row, skew_s);
    let (load, mass_kg) = carriage.load();
    let mut before = read(&motion.position_m, rows.start);
    let mut state = CarriageState::new(before, read(&motion.velocity_m_per_s, rows.start));
    for row in rows {
        let (gauge_a, gauge_b) = (gauge(Side::A, row), gauge(Side::B, row));
        let position = read(&motion.position_m, row);
        let velocity = read(&motion.velocity_m_per_s, row);
        let dt_s = R::from_f64(if row > 0 { track.dt_s(row - 1) } else { 1.0 });
        let load_n = if row > 0 {
            follow(&carriage, load.as_ref(), &mut state, velocity, dt_s)
        } else {
            R::ZERO
        };
        state.position_m = Compensated::new(position);
        state.velocity_m_per_s = velocity;
        let levels = carriage.levels(&state, terms.levels(&declared, gauge_a, gauge_b));
        let dry = FrictionLevels {
            viscous_n_s_per_m: R::ZERO,
            ..levels
        };
        let step = (position - before) / dt_s;
        let (next, friction) = bristle.step_driven(&dry, step, state.deflection_m, dt_s);
        (state.deflection_m, before) = (next, position);
        let viscous = levels.viscous_n_s_per_m * velocity;
        let inertia = mass_kg * read(&motion.acceleration_m_per_s2, row) + load_n;
        let gas = gauge_a * carriage.area_a_m2 - gauge_b * carriage.area_b_m2;
        let held = carriage.external_force_n + terms.constant_force_n;
        let outer = outer_n(&carriage, &state);
        sink.row(
            row,
            &[gas - friction - viscous - inertia - held - outer],
            &[],
        );
    }
}

/// Load, age of the seal's contact and what trails behind over a row that ends at a velocity;
/// returns the mean force that the load takes, N.
fn follow<R: Real>(
    carriage: &Carriage<R>,
    load: Option<&LoadCoupling<R>>,
    state: &mut CarriageState<R>,
    velocity_m_per_s: R,
    dt_s: R,
) -> R {
    if let Some(effects) = &carriage.effects {
        state.contact_age = effects.contact_age(state.contact_age, velocity_m_per_s, dt_s);
        let equation = &effects.force_equation;
        state.trail = equation.trail(state.trail, velocity_m_per_s * dt_s);
    }
    let before = state.velocity_m_per_s;
    load.map_or(R::ZERO, |load| {
        load.follow(&mut state.load, before, velocity_m_per_s, dt_s)
    })
}

/// Force of the buffers, and the one without a law, against +x, N.
pub(super) fn outer_n<R: Real>(carriage: &Carriage<R>, state: &CarriageState<R>) -> R {
    let (position, velocity) = (state.position_m.value, state.velocity_m_per_s);
    carriage.effects.as_ref().map_or(R::ZERO, |effects| {
        let buffers = &effects.elastic_buffer;
        buffers.reaction(position, velocity, R::ZERO).force_n
            + effects.unnamed_force_n(position, velocity)
            + effects.force_equation.trailing_n * state.trail
    })
}
