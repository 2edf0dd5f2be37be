//! Effects between command and spool.

use super::{Applied, COMMAND, Draw, Effect, Form, Strength};
use crate::plant::valve::{Play, Spool};

pub(super) const EFFECTS: &[Effect] = &[
    Effect {
        name: "spool-dynamics",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: spool_dynamics,
    },
    Effect {
        name: "valve-hysteresis",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: valve_hysteresis,
    },
    Effect {
        name: "valve-delay",
        on_list: true,
        may_begin: true,
        has_other_form: false,
        may_be_immaterial: true,
        apply: valve_delay,
    },
    Effect {
        name: "slew-limit",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: slew_limit,
    },
];

fn spool_dynamics(draw: &mut Draw<'_>) -> Applied {
    let frequency_hz = draw.size([400.0, 60.0, 28.0, 14.0]);
    if draw.form == Form::Other {
        let lag_s = 1.0 / (2.0 * core::f64::consts::PI * frequency_hz);
        draw.physics.command.lag_s = lag_s;
        return Applied::new(COMMAND, "first order", [("time_constant_s", lag_s)]);
    }
    let damping = draw.random.between(0.5, 0.9);
    // Half the stroke in 4 ms (MPYE-5: 4.2 ms); one that nobody should care about has none.
    const FASTEST_V_PER_S: f64 = 1250.0;
    let fastest_v_per_s = if draw.strength == Strength::Immaterial {
        f64::INFINITY
    } else {
        FASTEST_V_PER_S
    };
    draw.physics.command.spool = Some(Spool {
        frequency_hz,
        damping,
        fastest_v_per_s,
    });
    let parameters = [
        ("natural_frequency_Hz", frequency_hz),
        ("damping_ratio", damping),
    ];
    Applied::new(COMMAND, "second order", parameters)
}

fn valve_hysteresis(draw: &mut Draw<'_>) -> Applied {
    let width_v = draw.size([0.004, 0.02, 0.06, 0.15]);
    let plays = &mut draw.physics.command.plays;
    if draw.form == Form::Other {
        *plays = [0.3, 0.7, 1.2, 1.8]
            .map(|share| Play {
                width_v: share * width_v,
                weight: 0.25,
            })
            .to_vec();
        return Applied::new(COMMAND, "Prandtl-Ishlinskii", [("mean_width", width_v)]);
    }
    *plays = vec![Play {
        width_v,
        weight: 1.0,
    }];
    Applied::new(COMMAND, "play", [("width", width_v)])
}

fn valve_delay(draw: &mut Draw<'_>) -> Applied {
    let delay_s = draw.size([0.2e-3, 2e-3, 5e-3, 10e-3]);
    draw.physics.command.delay_s = delay_s;
    Applied::new(COMMAND, "delay", [("delay_s", delay_s)])
}

fn slew_limit(draw: &mut Draw<'_>) -> Applied {
    let rise = draw.size([2000.0, 400.0, 120.0, 50.0]);
    let (fall, form) = match draw.form {
        Form::Usual => (rise, "symmetric"),
        Form::Other => (0.5 * rise, "falls at half the speed"),
    };
    draw.physics.command.slew_v_per_s = Some([rise, fall]);
    Applied::new(
        COMMAND,
        form,
        [("rising_per_s", rise), ("falling_per_s", fall)],
    )
}
