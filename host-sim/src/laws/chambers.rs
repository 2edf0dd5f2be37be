//! Chambers driven by recorded position, command and supply pressure.

use super::{InitialState, Output, Sink, Track, View, delayed};
use crate::lag::followed;
use crate::model::{Side, Values};
use crate::recording::Recording;
use crate::rig::Rig;
use model_core::axis::{CommandState, PneumaticState, Pneumatics, ValveDrive};
use model_core::left_out::TankState;
use model_core::math::Compensated;
use model_core::real::Real;
use model_core::valve::{GasState, Valve};
use std::ops::Range;

/// The longest step with a valve, s: its stiffness is then resolved as at 1 kHz.
const LONGEST_VALVE_STEP_S: f64 = 2e-3;
/// The longest step of a closed chamber, s; it has no fast mode.
const LONGEST_CLOSED_STEP_S: f64 = 0.1;
/// Steps into which one row is divided at the most (over a gap).
const MOST_SUBSTEPS: f64 = 200.0;
/// History of the command that is run through before a window, s: longer than
/// any delay or lag of a valve.
const COMMAND_WARM_UP_S: f64 = 0.2;
/// How far the gas may be from ambient when a recording begins in mid-motion,
/// K, one standard deviation: half the excursion of a full-speed stroke.
const INITIAL_TEMPERATURE_SD_K: f64 = 20.0;

/// How far the pressure at the start may be from the recorded one, as a part
/// of it, one standard deviation: noise is far less, but a model with its own
/// error fits best from a start that is a little off.
const INITIAL_PRESSURE_SHARE: f64 = 5e-3;

/// How far the tank may be from the regulator when a recording begins, as a part
/// of the regulator's pressure, one standard deviation: a usual droop.
const INITIAL_DROOP_SHARE: f64 = 0.03;
/// What the wall may have gained when a recording begins, K, one standard
/// deviation; the bounds leave it where it is, as the offset says the same.
const INITIAL_WALL_RISE_SD_K: f64 = 1.0;

/// Sides with a recorded pressure.
fn sides(rig: &Rig) -> impl Iterator<Item = Side> + '_ {
    Side::BOTH
        .into_iter()
        .filter(|side| rig.signals.contains(side.pressure_signal()))
}

pub(super) fn outputs(rig: &Rig) -> Vec<Output> {
    sides(rig)
        .map(|side| Output {
            signal: side.pressure_signal(),
            place: side.place(),
            unit: "Pa",
        })
        .chain(predicts_supply(rig).then_some(Output {
            signal: "p_s",
            place: "supply",
            unit: "Pa",
        }))
        .collect()
}

/// Whether the supply pressure is predicted: where it is both declared and
/// recorded, a supply that does not hold what it should is to be seen. One that
/// is recorded only drives the valve as it is.
fn predicts_supply(rig: &Rig) -> bool {
    rig.valve.is_some() && rig.value("supply.pressure_Pa").is_some() && rig.signals.contains("p_s")
}

/// Pressure and temperature of each recorded chamber; then, where the rig models
/// them, what its walls have gained and its tank's pressure.
pub(super) fn initial_states(
    rig: &Rig,
    recording: &Recording,
    row: usize,
    view: View,
) -> Vec<InitialState> {
    let values = Values::<f64> {
        rig,
        keys: &[],
        replaced: &[],
    };
    let ambient_k = values.ambient().temperature_k;
    let pressure = |(output, side): (usize, Side)| {
        let signal = recording.signal(side.pressure_signal()).unwrap_or(&[]);
        let guess = view.value(&recording.time_s, signal, row) - values.pressure_offset_pa(side);
        InitialState {
            name: if side == Side::A { "p_a" } else { "p_b" },
            guess,
            standard_deviation: INITIAL_PRESSURE_SHARE * guess,
            bounds: (1e3, 1e9),
            measured_by: Some(output),
        }
    };
    let temperature = |side: Side| InitialState {
        name: if side == Side::A { "T_a" } else { "T_b" },
        guess: ambient_k,
        standard_deviation: INITIAL_TEMPERATURE_SD_K,
        bounds: if values.has_temperature_state(side) {
            (100.0, 1000.0)
        } else {
            (ambient_k, ambient_k)
        },
        measured_by: None,
    };
    let wall_rise = |side: Side| InitialState {
        name: if side == Side::A { "wall a" } else { "wall b" },
        guess: 0.0,
        standard_deviation: INITIAL_WALL_RISE_SD_K,
        bounds: (0.0, 0.0),
        measured_by: None,
    };
    let walls = sides(rig).filter(|_| values.wall().is_warmed());
    sides(rig)
        .enumerate()
        .map(pressure)
        .chain(sides(rig).map(temperature))
        .chain(walls.map(wall_rise))
        .chain(tank_start(&values, recording, row, view))
        .collect()
}

/// The tank's pressure; a recorded one where there is one.
fn tank_start(
    values: &Values<'_, f64>,
    recording: &Recording,
    row: usize,
    view: View,
) -> Option<InitialState> {
    if !values.supply_droop().is_present() {
        return None;
    }
    let regulator_pa = values.get("supply.pressure_Pa")?;
    let recorded = recording.signal("p_s");
    let seen = recorded.map(|signal| view.value(&recording.time_s, signal, row));
    let share = match seen {
        Some(_) => INITIAL_PRESSURE_SHARE,
        None => INITIAL_DROOP_SHARE,
    };
    Some(InitialState {
        name: "p_s",
        guess: seen.unwrap_or(regulator_pa),
        standard_deviation: share * regulator_pa,
        bounds: (1e3, 1e9),
        measured_by: None,
    })
}

/// What drives the chambers, row by row.
struct Drive<'a, R> {
    position_m: Option<&'a [f64]>,
    time_s: &'a [f64],
    command_v: Option<&'a [f64]>,
    supply_pa: Option<&'a [f64]>,
    declared_supply_pa: R,
    supply_temperature_k: R,
    /// Whether the valve draws from a modelled tank, which the regulator feeds.
    has_tank: bool,
    skew_s: R,
}

impl<R: Real> Drive<'_, R> {
    fn position(&self, row: usize) -> R {
        match self.position_m {
            Some(position) => delayed(self.time_s, position, row, self.skew_s),
            None => R::ZERO,
        }
    }

    fn supply(&self, row: usize) -> GasState<R> {
        GasState {
            pressure_pa: match self.supply_pa {
                Some(pressure) => R::from_f64(pressure[row]),
                None => self.declared_supply_pa,
            },
            temperature_k: self.supply_temperature_k,
        }
    }
}

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    initial: &[R],
    sink: &mut impl Sink<R>,
) {
    let Some(mut pneumatics) = values.pneumatics() else {
        return;
    };
    let valve = values.valve().and_then(Result::ok);
    let sides: Vec<Side> = sides(values.rig).collect();
    let drive = Drive {
        position_m: track.signal("x"),
        time_s: &track.recording.time_s,
        command_v: track.signal("u"),
        supply_pa: track
            .signal("p_s")
            .filter(|_| !predicts_supply(values.rig) && !pneumatics.supply_droop.is_present()),
        declared_supply_pa: values.get_or("supply.pressure_Pa", 7e5),
        supply_temperature_k: values.ambient().temperature_k,
        has_tank: pneumatics.supply_droop.is_present(),
        skew_s: values.effect("position-time-skew", "delay_s", 0.0),
    };
    let onset_s = values.effect("chamber-leakage", "onset_s", f64::NEG_INFINITY);
    let leaks = (pneumatics.leak_a, pneumatics.leak_b);
    let lag_s = values.effect("pressure-sensor-lag", "time_constant_s", 0.0);
    let spool = valve.map(|valve| (valve, spool_positions(values, &drive, &rows)));
    let walls = pneumatics.chamber_a.wall.is_warmed();
    let layout = Layout::new(&sides, walls, drive.has_tank);
    let offsets_pa = [0, 1].map(|index| match sides.get(index) {
        Some(&side) => values.pressure_offset_pa(side),
        None => R::ZERO,
    });
    let mut state = layout.start(initial);
    let mut shown = pressures(&sides, &state);
    let outputs = sides.len() + usize::from(predicts_supply(values.rig));
    let mut report = |state: &PneumaticState<R>, shown: &[R; 2], row: usize| {
        let mut showing = [R::ZERO; 3];
        for (index, slot) in showing.iter_mut().take(sides.len()).enumerate() {
            *slot = shown[index] + offsets_pa[index];
        }
        showing[sides.len()] = if drive.has_tank {
            state.tank.pressure_pa(drive.declared_supply_pa)
        } else {
            drive.declared_supply_pa
        };
        let states = layout.states(state, drive.declared_supply_pa);
        sink.row(row, &showing[..outputs], &states[..layout.count()]);
    };
    report(&state, &shown, rows.start);
    for row in rows.start..rows.end.saturating_sub(1) {
        let open = share_open(drive.time_s, row, onset_s);
        pneumatics.leak_a = leaks.0.scaled(open);
        pneumatics.leak_b = leaks.1.scaled(open);
        let valve_now = spool
            .as_ref()
            .map(|(valve, spool)| (valve, spool[row - rows.start]));
        let before = pressures(&sides, &state);
        advance(&pneumatics, &mut state, valve_now, &drive, row);
        let after = pressures(&sides, &state);
        let dt = R::from_f64(track.dt_s(row));
        for (side, slot) in shown.iter_mut().enumerate() {
            *slot = followed(*slot, (before[side], after[side]), lag_s, dt);
        }
        report(&state, &shown, row + 1);
    }
}

/// The part of a row after the leak has opened.
fn share_open<R: Real>(time_s: &[f64], row: usize, onset_s: R) -> R {
    let length = R::from_f64(time_s[row + 1] - time_s[row]);
    ((R::from_f64(time_s[row + 1]) - onset_s) / length).clamp(R::ZERO, R::ONE)
}

/// One row, in as many steps as its length asks for.
fn advance<R: Real>(
    pneumatics: &Pneumatics<R>,
    state: &mut PneumaticState<R>,
    valve: Option<(&Valve<R>, R)>,
    drive: &Drive<'_, R>,
    row: usize,
) {
    let dt_s = drive.time_s[row + 1] - drive.time_s[row];
    let longest = if valve.is_some() {
        LONGEST_VALVE_STEP_S
    } else {
        LONGEST_CLOSED_STEP_S
    };
    let steps = (dt_s / longest).ceil().clamp(1.0, MOST_SUBSTEPS);
    let step_s = R::from_f64(dt_s / steps);
    let from = drive.position(row);
    let way = drive.position(row + 1) - from;
    let valve = valve.map(|(valve, spool_v)| ValveDrive {
        areas: valve.areas(spool_v),
        supply: drive.supply(row),
    });
    let mut here = from;
    for step in 1..=steps as u32 {
        let next = from + way * R::from_f64(f64::from(step) / steps);
        match &valve {
            Some(regulated) if drive.has_tank => {
                pneumatics.step_behind_regulator(state, regulated, here, next, step_s);
            }
            _ => pneumatics.step(state, valve.as_ref(), here, next, step_s),
        }
        here = next;
    }
}

/// The spool's position over each row of the range, after a run through the
/// command before it.
fn spool_positions<R: Real>(
    values: &Values<'_, R>,
    drive: &Drive<'_, R>,
    rows: &Range<usize>,
) -> Vec<R> {
    let Some(command) = drive.command_v else {
        return Vec::new();
    };
    let step_s = super::motion::median_step_s(drive.time_s);
    let path = values.command_path(step_s);
    let warm_up = (COMMAND_WARM_UP_S / step_s).ceil() as usize;
    let from = rows.start.saturating_sub(warm_up);
    let mut state = CommandState::holding(R::from_f64(command[from]));
    let mut positions = Vec::with_capacity(rows.len());
    for (row, &command_v) in command.iter().enumerate().take(rows.end).skip(from) {
        let position = path.step(&mut state, R::from_f64(command_v));
        if row >= rows.start {
            positions.push(position);
        }
    }
    positions
}

/// Where each state stands: pressures, temperatures, walls, tank, as in
/// [`initial_states`].
struct Layout<'a> {
    sides: &'a [Side],
    walls: bool,
    tank: bool,
}

/// Pressure, temperature and wall of both chambers, and the tank.
const MOST_STATES: usize = 7;

impl<'a> Layout<'a> {
    fn new(sides: &'a [Side], walls: bool, tank: bool) -> Self {
        Self { sides, walls, tank }
    }

    /// Number of states.
    fn count(&self) -> usize {
        self.tank_place() + usize::from(self.tank)
    }

    fn tank_place(&self) -> usize {
        self.sides.len() * if self.walls { 3 } else { 2 }
    }

    /// The state at the start. A fit that only tries out a wall or a tank has no
    /// states for them: the wall begins at its offset, the tank full.
    fn start<R: Real>(&self, initial: &[R]) -> PneumaticState<R> {
        let count = self.sides.len();
        let place = |wanted: Side| self.sides.iter().position(|&side| side == wanted);
        let gas = |wanted: Side| {
            let index = place(wanted).unwrap_or(0);
            GasState {
                pressure_pa: initial[index],
                temperature_k: initial[index + count],
            }
        };
        let mut state = PneumaticState::at_rest(gas(Side::A), gas(Side::B));
        if initial.len() < self.count() {
            return state;
        }
        if self.walls {
            let rise = |wanted: Side| initial[place(wanted).unwrap_or(0) + 2 * count];
            state.a.wall_rise_k = Compensated::new(rise(Side::A));
            state.b.wall_rise_k = Compensated::new(rise(Side::B));
        }
        if self.tank {
            state.tank = TankState::at(initial[self.tank_place()]);
        }
        state
    }

    fn states<R: Real>(&self, state: &PneumaticState<R>, regulator_pa: R) -> [R; MOST_STATES] {
        let count = self.sides.len();
        let mut states = [R::ZERO; MOST_STATES];
        for (index, &side) in self.sides.iter().enumerate() {
            let chamber = match side {
                Side::A => &state.a,
                Side::B => &state.b,
            };
            states[index] = chamber.pressure_pa.value;
            states[index + count] = chamber.temperature_k.value;
            if self.walls {
                states[index + 2 * count] = chamber.wall_rise_k.value;
            }
        }
        if self.tank {
            states[self.tank_place()] = state.tank.pressure_pa(regulator_pa);
        }
        states
    }
}

fn pressures<R: Real>(sides: &[Side], state: &PneumaticState<R>) -> [R; 2] {
    let mut pressures = [R::ZERO; 2];
    for (slot, &side) in pressures.iter_mut().zip(sides) {
        *slot = match side {
            Side::A => state.a.pressure_pa.value,
            Side::B => state.b.pressure_pa.value,
        };
    }
    pressures
}
