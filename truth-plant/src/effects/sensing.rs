//! Effects of the sensors.

use super::{Applied, Draw, Effect, Form, SIDES};
use crate::plant::sensors::Sensors;

pub(super) const EFFECTS: &[Effect] = &[
    Effect {
        name: "pressure-sensor-lag",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: pressure_lag,
    },
    Effect {
        name: "pressure-sensor-offset",
        on_list: true,
        may_begin: true,
        has_other_form: false,
        may_be_immaterial: true,
        apply: pressure_offset,
    },
    Effect {
        name: "gauge-gain",
        on_list: true,
        may_begin: true,
        has_other_form: false,
        may_be_immaterial: true,
        apply: gauge_gain,
    },
    Effect {
        name: "position-time-skew",
        on_list: true,
        may_begin: true,
        has_other_form: false,
        may_be_immaterial: true,
        apply: position_skew,
    },
];

const PRESSURES: [&str; 2] = ["sensor.p_a", "sensor.p_b"];

fn pressure_lag(draw: &mut Draw<'_>) -> Applied {
    let lag_s = draw.size([0.2e-3, 2e-3, 5e-3, 12e-3]);
    let sensors = &mut draw.physics.sensors;
    let parameters = [("time_constant_s", lag_s)];
    if draw.form == Form::Other {
        sensors.pressure_lag_s = 0.5 * lag_s;
        sensors.second_pressure_lag_s = 0.5 * lag_s;
        return Applied::new(PRESSURES, "two equal lags", parameters);
    }
    sensors.pressure_lag_s = lag_s;
    Applied::new(PRESSURES, "first order", parameters)
}

fn pressure_offset(draw: &mut Draw<'_>) -> Applied {
    let key = |side: &str| format!("offset_{side}_Pa");
    gauge_errors(
        draw,
        [300.0, 3e3, 8e3, 20e3],
        key,
        |sensors, port, offset_pa| {
            sensors.pressure_offset_pa[port] = offset_pa;
        },
    )
}

fn gauge_gain(draw: &mut Draw<'_>) -> Applied {
    let key = |side: &str| format!("gain_error_{side}");
    gauge_errors(
        draw,
        [0.5e-3, 5e-3, 1e-2, 3e-2],
        key,
        |sensors, port, error| {
            sensors.pressure_gain[port] *= 1.0 + error;
        },
    )
}

/// An error of one chamber's gauge or of both, each of its own size and sign.
fn gauge_errors(
    draw: &mut Draw<'_>,
    sizes: [f64; 4],
    key: impl Fn(&str) -> String,
    put_in: impl Fn(&mut Sensors, usize, f64),
) -> Applied {
    let wrong = *draw.random.one_of(&SIDES);
    let mut applied = Applied {
        form: "constant",
        ..Applied::default()
    };
    for &port in wrong {
        let error = draw.size(sizes) * draw.random.sign();
        put_in(&mut draw.physics.sensors, port, error);
        applied.places.push(PRESSURES[port]);
        applied.parameters.insert(key(["a", "b"][port]), error);
    }
    applied
}

fn position_skew(draw: &mut Draw<'_>) -> Applied {
    let late_s = draw.size([0.1e-3, 1e-3, 3e-3, 6e-3]);
    draw.physics.sensors.position_late_s = late_s;
    Applied::new(
        ["sensor.x", "sensor.v"],
        "position and speed come late",
        [("delay_s", late_s)],
    )
}
