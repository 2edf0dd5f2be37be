//! Effects of the sensors.

use super::{Applied, Draw, Effect, Form, SIDES};

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
    let wrong = *draw.random.one_of(&SIDES);
    let mut applied = Applied {
        form: "constant",
        ..Applied::default()
    };
    for &port in wrong {
        let offset_pa = draw.size([300.0, 3e3, 8e3, 20e3]) * draw.random.sign();
        draw.physics.sensors.pressure_offset_pa[port] = offset_pa;
        applied.places.push(PRESSURES[port]);
        let key = format!("offset_{}_Pa", ["a", "b"][port]);
        applied.parameters.insert(key, offset_pa);
    }
    applied
}

fn gauge_gain(draw: &mut Draw<'_>) -> Applied {
    let wrong = *draw.random.one_of(&SIDES);
    let mut applied = Applied {
        form: "constant",
        ..Applied::default()
    };
    for &port in wrong {
        let error = draw.size([0.5e-3, 5e-3, 1e-2, 3e-2]) * draw.random.sign();
        draw.physics.sensors.pressure_gain[port] *= 1.0 + error;
        applied.places.push(PRESSURES[port]);
        let key = format!("gain_error_{}", ["a", "b"][port]);
        applied.parameters.insert(key, error);
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
