//! Figures 2 to 7: spool and flow of the proportional valve.

use bench::sines::sines;
use bench::{Kind, Picture, iso6358};
use model_core::axis::{CommandPath, CommandState};
use model_core::left_out::{SlewLimit, SpoolDynamics, ValveDelay, ValveHysteresis};
use model_core::valve::{GasState, Valve};
use std::f64::consts::TAU;

use super::Figure;
use crate::model::Values;
use crate::rig::Rig;

/// Nulls of three valves, V: within the data sheet's 5.0 +- 0.1.
const NULLS_V: [f64; 3] = [4.94, 5.0, 5.07];
/// Hysteresis of the data sheet, 0.4 % of the spool's stroke, V.
const PLAY_V: f64 = 0.04;
/// Spool of the data sheet: -3 dB at 100 Hz; damping and the fastest speed are typical.
const SPOOL: SpoolDynamics<f64> = SpoolDynamics {
    natural_frequency_hz: 100.0,
    damping_ratio: 0.7,
};
const FASTEST_V_PER_S: f64 = 1200.0;
/// Amplitudes of figure 3, V.
const AMPLITUDES_V: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
const FREQUENCIES_HZ: [f64; 10] = [2.0, 5.0, 10.0, 20.0, 35.0, 50.0, 70.0, 100.0, 140.0, 200.0];
const MM2: f64 = 1e6;
const BAR: f64 = 1e5;

pub(super) fn figures(rig: &Rig) -> Result<Vec<Figure>, String> {
    let valve = Values::<f64>::of(rig)
        .valve()
        .and_then(Result::ok)
        .ok_or("the rig has no valve")?;
    Ok(vec![
        spool_over_command(),
        frequency_response(),
        flow_over_command(&valve),
        flow_over_both(&valve),
        areas(&valve),
        discharge(&valve),
    ])
}

fn spool_over_command() -> Figure {
    let play = ValveHysteresis { width: PLAY_V };
    let mut played = 5.0;
    let ramp = (0..=1200).map(|place| {
        let turns = f64::from(place) / 400.0;
        5.0 + 5.0 * (4.0 * (turns - (turns + 0.5).floor()).abs() - 1.0)
    });
    let loop_of = ramp.map(|command: f64| {
        played = play.step(played, command);
        (command, played - command)
    });
    let apart = Picture::new(
        "Spool less command: the play",
        ("command", "V"),
        ("difference", "V"),
    )
    .with(
        "play of 0.4 % of the range",
        Kind::Law,
        loop_of.skip(400).collect(),
    );
    let line = Picture::new(
        "Spool displacement over the command",
        ("command", "V"),
        ("spool, of its full stroke", ""),
    )
    .with("linear", Kind::Law, vec![(0.0, -1.0), (10.0, 1.0)]);
    Figure {
        number: "2",
        title: "Spool displacement over the command",
        says: "Quasi-linear, with low hysteresis.",
        assumed: "The width of the play, 0.4 % of the range, is the data sheet's.",
        pictures: vec![line, apart],
    }
}

fn frequency_response() -> Figure {
    let mut gains = Picture::new("Gain of the spool", ("frequency", "Hz"), ("gain", "dB"));
    let mut phases = Picture::new("Phase of the spool", ("frequency", "Hz"), ("phase", "°"));
    for amplitude_v in AMPLITUDES_V {
        let responses: Vec<(f64, f64, f64)> = FREQUENCIES_HZ
            .iter()
            .filter_map(|hertz| response(amplitude_v, *hertz))
            .collect();
        let name = format!("{amplitude_v} V");
        let gain = responses.iter().map(|one| (one.0, 20.0 * one.1.log10()));
        gains = gains.with(&name, Kind::Law, gain.collect());
        let phase = responses.iter().map(|one| (one.0, one.2.to_degrees()));
        phases = phases.with(&name, Kind::Law, phase.collect());
    }
    Figure {
        number: "3",
        title: "Frequency response of the spool at four amplitudes",
        says: "Gain and phase depend on the amplitude.",
        assumed: "Natural frequency 100 Hz (data sheet), damping 0.7 and a largest speed of 1200 V/s (typical), amplitudes of 0.5 to 4 V: the text gives none of them. The limited speed is what makes the response depend on the amplitude.",
        pictures: vec![gains, phases],
    }
}

/// Frequency, gain and phase of a sine of the command.
fn response(amplitude_v: f64, hertz: f64) -> Option<(f64, f64, f64)> {
    const STEP_S: f64 = 2e-4;
    const PERIODS: f64 = 8.0;
    let limit = SlewLimit {
        rising_per_s: FASTEST_V_PER_S,
        falling_per_s: FASTEST_V_PER_S,
    };
    let (delay, play) = (ValveDelay { delay_s: 0.0 }, ValveHysteresis { width: 0.0 });
    let path = CommandPath::new(delay, play, limit, &SPOOL, STEP_S);
    let mut state = CommandState::holding(5.0);
    let rows = (PERIODS / hertz / STEP_S) as usize;
    let time_s: Vec<f64> = (0..rows).map(|row| row as f64 * STEP_S).collect();
    let command: Vec<f64> = time_s
        .iter()
        .map(|time| 5.0 + amplitude_v * (TAU * hertz * time).sin())
        .collect();
    // The mean over a row belongs to its middle, and a held command is late by as much: read at the
    // row both cancel.
    let spool: Vec<f64> = command
        .iter()
        .map(|one| path.step(&mut state, *one))
        .collect();
    let sine = sines(&time_s, &command).into_iter().next()?;
    let response = sine.response(&time_s, &command, &spool);
    Some((hertz, response.gain, response.phase_rad))
}

fn gas_at(pressure_pa: f64) -> GasState<f64> {
    GasState {
        pressure_pa,
        temperature_k: 293.15,
    }
}

/// Flow from 7 to 5 bar through the path that is fed, as the paper's figure 4: port A above the null,
/// port B below, l/min.
fn supply_flow_l_min(valve: &Valve<f64>, command_v: f64, (up_pa, down_pa): (f64, f64)) -> f64 {
    let areas = valve.areas(command_v);
    let fed_m2 = areas.supply_a_m2.max(areas.supply_b_m2);
    let flow = valve.law.flow(fed_m2, gas_at(up_pa), gas_at(down_pa));
    iso6358::flow_l_min(flow.mass_flow_kg_per_s)
}

fn commands() -> impl Iterator<Item = f64> {
    (0..=200).map(|place| 0.05 * f64::from(place))
}

fn flow_over_command(valve: &Valve<f64>) -> Figure {
    let mut as_they_are = Picture::new(
        "Three valves, from 7 to 5 bar",
        ("command", "V"),
        ("flow", "l/min (ANR)"),
    );
    let mut shifted = Picture::new(
        "The same, shifted by their nulls",
        ("command less null", "V"),
        ("flow", "l/min (ANR)"),
    );
    for null_v in NULLS_V {
        let one = Valve { null_v, ..*valve };
        let flow = |command_v: f64| supply_flow_l_min(&one, command_v, (7.0 * BAR, 5.0 * BAR));
        let name = format!("null at {null_v} V");
        as_they_are = as_they_are.with(
            &name,
            Kind::Law,
            commands().map(|at| (at, flow(at))).collect(),
        );
        let about = commands().map(|at| (at - null_v, flow(at)));
        shifted = shifted.with(&name, Kind::Law, about.collect());
    }
    Figure {
        number: "4",
        title: "Steady flow over the command",
        says: "Three valves at 7 bar before and 5 bar behind: their nulls differ, and once shifted the curves coincide within 2 to 8 V. Overlap is positive, with some leakage.",
        assumed: "The three nulls, the overlap of 0.3 V, the leakage of 0.1 mm² and the shape between overlap and full opening; the full flow is that of 700 l/min nominal. Pressures are taken as absolute.",
        pictures: vec![as_they_are, shifted],
    }
}

fn flow_over_both(valve: &Valve<f64>) -> Figure {
    let mut picture = Picture::new(
        "Flow at 7 bar supply",
        ("command", "V"),
        ("flow", "l/min (ANR)"),
    );
    for ratio in [0.2, 0.5, 0.7, 0.85, 0.95] {
        let flow = |at: f64| supply_flow_l_min(valve, at, (7.0 * BAR, ratio * 7.0 * BAR));
        let curve = commands().map(|at| (at, flow(at)));
        picture = picture.with(
            format!("pressure ratio {ratio}"),
            Kind::Law,
            curve.collect(),
        );
    }
    Figure {
        number: "5",
        title: "Flow over command and pressure ratio",
        says: "Supply of 7 bar.",
        assumed: "As in figure 4; the critical pressure ratio is 0.29 (the text: smaller than the published 0.29 at large openings).",
        pictures: vec![picture],
    }
}

fn areas(valve: &Valve<f64>) -> Figure {
    let mut picture = Picture::new("Area of port A's paths", ("command", "V"), ("area", "mm²"));
    let of = |area: fn(&model_core::valve::PathAreas<f64>) -> f64| {
        commands()
            .map(|at| (at, MM2 * area(&valve.areas(at))))
            .collect::<Vec<_>>()
    };
    picture = picture
        .with("supply", Kind::Law, of(|one| one.supply_a_m2))
        .with("exhaust", Kind::Given, of(|one| one.exhaust_a_m2));
    Figure {
        number: "6",
        title: "Effective areas of both paths over the command",
        says: "Both areas follow from the measured flow by (1).",
        assumed: "All of the curve: the text has no number of it.",
        pictures: vec![picture],
    }
}

fn discharge(valve: &Valve<f64>) -> Figure {
    let ratios = || (0..=200).map(|place| f64::from(place) / 200.0);
    let coefficient = Picture::new("Discharge coefficient", ("pressure ratio", ""), ("Cd", ""))
        .with(
            "Cd(r) of the paper",
            Kind::Law,
            ratios().map(|r| (r, valve.law.discharge(r))).collect(),
        );
    let mut flow = Picture::new(
        "Flow at 6 bar before the valve",
        ("pressure ratio", ""),
        ("flow", "l/min (ANR)"),
    );
    for opening_v in [1.0, 2.0, 3.0, 4.0, 5.0] {
        let through =
            |ratio: f64| supply_flow_l_min(valve, 5.0 + opening_v, (6.0 * BAR, ratio * 6.0 * BAR));
        let curve = ratios().map(|ratio| (ratio, through(ratio)));
        flow = flow.with(format!("{} V", 5.0 + opening_v), Kind::Law, curve.collect());
    }
    Figure {
        number: "7",
        title: "Discharge coefficient, and flow over the pressure ratio",
        says: "Cd(r) = 0.8153 + 0.0933 r - 0.1038 r², identified; measured and computed flow at 6 bar before the valve.",
        assumed: "Areas as in figure 6; the flow becomes laminar above a ratio of 0.98 (the text: close to 1).",
        pictures: vec![coefficient, flow],
    }
}
