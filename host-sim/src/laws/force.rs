//! A bench that measures force: motion and pressures in, force out.
//!
//! ```text
//! F = (pa - p0) Aa - (pb - p0) Ab - Ff - M x'' - FL
//! ```
//!
//! F acts on the carriage against +x, as a test machine that holds the rod
//! does. The bristle follows the recorded displacement, not a velocity: it
//! needs no derivative, and its own stiffness filters the jitter of a position
//! at rest.

use super::{Output, Sink, Track, delayed};
use crate::model::{Side, Values};
use model_core::friction::FrictionLevels;
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
    sink: &mut impl Sink<R>,
) {
    let Some(motion) = track.motion.as_ref() else {
        return;
    };
    let carriage = values.carriage();
    let (declared, terms) = (values.friction_levels(), values.friction_terms());
    let bristle = values.bristle();
    let ambient = carriage.ambient_pressure_pa;
    let skew_s = values.effect("position-time-skew", "delay_s", 0.0);
    let gauge = |side: Side, row: usize| match track.signal(side.pressure_signal()) {
        Some(pressure) => R::from_f64(pressure[row]) - values.pressure_offset_pa(side) - ambient,
        None => R::ZERO,
    };
    let time = &track.recording.time_s;
    let read = |signal: &[f64], row: usize| delayed(time, signal, row, skew_s);
    let mut deflection = R::ZERO;
    let mut before = read(&motion.position_m, rows.start);
    for row in rows {
        let (gauge_a, gauge_b) = (gauge(Side::A, row), gauge(Side::B, row));
        let levels = terms.levels(&declared, gauge_a, gauge_b);
        let position = read(&motion.position_m, row);
        let dt_s = R::from_f64(if row > 0 { track.dt_s(row - 1) } else { 1.0 });
        let dry = FrictionLevels {
            viscous_n_s_per_m: R::ZERO,
            ..levels
        };
        let step = (position - before) / dt_s;
        let (next, friction) = bristle.step_driven(&dry, step, deflection, dt_s);
        (deflection, before) = (next, position);
        let viscous = levels.viscous_n_s_per_m * read(&motion.velocity_m_per_s, row);
        let inertia = carriage.mass_kg * read(&motion.acceleration_m_per_s2, row);
        let gas = gauge_a * carriage.area_a_m2 - gauge_b * carriage.area_b_m2;
        let load = carriage.external_force_n + terms.constant_force_n;
        sink.row(row, &[gas - friction - viscous - inertia - load], &[]);
    }
}
