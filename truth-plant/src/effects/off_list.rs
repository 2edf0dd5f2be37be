//! Effects that no verdict has a name for.

use super::{Applied, COMMAND, Draw, Effect, FLOW, FORCE};
use crate::plant::mechanics::{Cable, Cogging, Disturbance, Spring};

/// Opening over which a loss of discharge fades.
const DISCHARGE_FADE_V: f64 = 0.6;

const fn effect(name: &'static str, apply: fn(&mut Draw<'_>) -> Applied) -> Effect {
    Effect {
        name,
        on_list: false,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: false,
        apply,
    }
}

pub(super) const EFFECTS: &[Effect] = &[
    effect("cable-drag", cable_drag),
    effect("quadratic-friction", quadratic_friction),
    effect("null-drift", null_drift),
    effect("discharge-by-opening", discharge_by_opening),
    effect("area-by-temperature", area_by_temperature),
    effect("periodic-force", periodic_force),
    effect("position-sensor-wave", position_sensor_wave),
    effect(SUPPLY_RIPPLE, supply_ripple),
    effect("stiffening-spring", stiffening_spring),
    effect("cogging", cogging),
    effect("cogging-and-drift", cogging_and_drift),
];

/// The effect that a recorded supply pressure would give away.
pub(crate) const SUPPLY_RIPPLE: &str = "supply-ripple";

fn cable_drag(draw: &mut Draw<'_>) -> Applied {
    let force_n = draw.size([0.3, 3.0, 7.0, 14.0]);
    let path_m = draw.random.between(0.01, 0.04);
    draw.physics.mechanics.cable = Some(Cable { force_n, path_m });
    let parameters = [("force_N", force_n), ("path_m", path_m)];
    Applied::new(FORCE, "Dahl", parameters)
}

fn quadratic_friction(draw: &mut Draw<'_>) -> Applied {
    let coefficient = draw.size([2.0, 15.0, 40.0, 100.0]);
    draw.physics.mechanics.friction.quadratic_n_s2_per_m2 = coefficient;
    let parameters = [("quadratic_Ns2_m2", coefficient)];
    Applied::new(FORCE, "v |v|", parameters)
}

/// So much of the half stroke from its rest it pushes with the drawn force.
const SPRING_WAY: f64 = 0.6;

fn stiffening_spring(draw: &mut Draw<'_>) -> Applied {
    let force_n = draw.size([0.3, 4.0, 9.0, 18.0]);
    let half_m = draw.physics.mechanics.half_stroke_m;
    let way_m = SPRING_WAY * half_m;
    let of_cube = draw.random.between(0.5, 1.0);
    let spring = Spring {
        n_per_m: (1.0 - of_cube) * force_n / way_m,
        n_per_m3: of_cube * force_n / (way_m * way_m * way_m),
        rest_m: draw.random.between(-0.2, 0.2) * half_m,
    };
    draw.physics.mechanics.spring = Some(spring);
    let parameters = [
        ("spring_N_m", spring.n_per_m),
        ("stiffening_N_m3", spring.n_per_m3),
        ("rest_m", spring.rest_m),
    ];
    Applied::new(FORCE, "k x + k3 x^3", parameters)
}

fn cogging(draw: &mut Draw<'_>) -> Applied {
    let teeth = drawn_cogging(draw);
    let parameters = [("force_N", teeth.force_n), ("pitch_m", teeth.pitch_m)];
    Applied::new(FORCE, "sine of the position", parameters)
}

fn drawn_cogging(draw: &mut Draw<'_>) -> Cogging {
    let cogging = Cogging {
        force_n: draw.size([0.2, 2.0, 5.0, 12.0]),
        pitch_m: draw.random.between(0.012, 0.06),
        phase_rad: draw.random.between(0.0, core::f64::consts::TAU),
    };
    draw.physics.mechanics.cogging = Some(cogging);
    cogging
}

fn cogging_and_drift(draw: &mut Draw<'_>) -> Applied {
    let teeth = drawn_cogging(draw);
    // Over five seconds it comes to as much as the teeth.
    let drift_n_per_s = 0.2 * teeth.force_n * draw.random.sign();
    draw.physics.mechanics.drift_n_per_s = drift_n_per_s;
    let parameters = [
        ("drift_N_s", drift_n_per_s),
        ("force_N", teeth.force_n),
        ("pitch_m", teeth.pitch_m),
    ];
    Applied::new(
        FORCE,
        "sine of the position, and linear in time",
        parameters,
    )
}

fn null_drift(draw: &mut Draw<'_>) -> Applied {
    let drift_v_per_s = draw.size([0.1e-3, 1e-3, 3e-3, 8e-3]) * draw.random.sign();
    draw.physics.command.drift_v_per_s = drift_v_per_s;
    let parameters = [("drift_V_s", drift_v_per_s)];
    Applied::new(COMMAND, "linear in time", parameters)
}

fn discharge_by_opening(draw: &mut Draw<'_>) -> Applied {
    let loss = draw.size([0.02, 0.15, 0.3, 0.55]);
    let areas = &mut draw.physics.areas;
    for (area_m2, opening_v) in areas.supply_m2.iter_mut().zip(&areas.openings_v) {
        *area_m2 *= 1.0 - loss * libm::exp(-opening_v / DISCHARGE_FADE_V);
    }
    Applied::new(FLOW, "loss at small openings", [("relative_loss", loss)])
}

fn area_by_temperature(draw: &mut Draw<'_>) -> Applied {
    let coefficient = draw.size([1.0, 6.0, 12.0, 25.0]) * draw.random.sign();
    draw.physics.network.area_by_temperature = coefficient;
    let parameters = [("per_relative_square", coefficient)];
    Applied::new(FLOW, "square of the temperature's departure", parameters)
}

fn periodic_force(draw: &mut Draw<'_>) -> Applied {
    let force_n = draw.size([0.2, 2.0, 6.0, 14.0]);
    let frequency_hz = draw.random.between(1.0, 8.0);
    draw.physics.mechanics.disturbance = Some(Disturbance {
        force_n,
        frequency_hz,
    });
    let parameters = [("force_N", force_n), ("frequency_Hz", frequency_hz)];
    Applied::new(FORCE, "sine of time", parameters)
}

fn position_sensor_wave(draw: &mut Draw<'_>) -> Applied {
    let amplitude_m = draw.size([3e-6, 30e-6, 0.1e-3, 0.3e-3]);
    let period_m = draw.random.between(2e-3, 20e-3);
    draw.physics.sensors.position_wave_m = [amplitude_m, period_m];
    let parameters = [("amplitude_m", amplitude_m), ("period_m", period_m)];
    Applied::new(["sensor.x"], "sine of the position", parameters)
}

fn supply_ripple(draw: &mut Draw<'_>) -> Applied {
    let ripple = draw.size([0.0005, 0.005, 0.015, 0.04]);
    let frequency_hz = draw.random.between(0.5, 5.0);
    draw.physics.network.supply.ripple = ripple;
    draw.physics.network.supply.ripple_hz = frequency_hz;
    let parameters = [
        ("relative_amplitude", ripple),
        ("frequency_Hz", frequency_hz),
    ];
    Applied::new(["supply"], "sine of time", parameters)
}
