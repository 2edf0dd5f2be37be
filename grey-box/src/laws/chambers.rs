//! Chambers driven by recorded position, command and supply pressure.

use super::command::spool_positions;
use super::{InitialState, Output, Sink, Track, View, delayed};
use crate::effects::flow::{chamber_leakage, supply_droop};
use crate::effects::sensing::{position_time_skew, pressure_sensor_lag};
use crate::gauge::Gauge;
use crate::lag::followed;
use crate::model::{Side, Values};
use crate::recording::Recording;
use crate::rig::Rig;
use model_core::axis::{PneumaticState, Pneumatics, ValveDrive};
use model_core::left_out::{SilencerState, TankState, TubeState};
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
/// How far the command before a recording may be from its first one, as a part of the
/// valve's largest opening, one standard deviation: anything, from shut to wide open.
const EARLIER_COMMAND_SHARE: f64 = 0.5;
/// The supply's pressure where none is declared or recorded, Pa.
const DEFAULT_SUPPLY_PA: f64 = 7e5;

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

/// The gas temperature of a chamber; where it follows from the pressure it does not matter.
fn temperature_start(values: &Values<'_, f64>, side: Side) -> InitialState {
    let ambient_k = values.ambient().temperature_k;
    let bounds = if values.has_temperature_state(side) {
        (100.0, 1000.0)
    } else {
        (ambient_k, ambient_k)
    };
    let name = if side == Side::A { "T_a" } else { "T_b" };
    InitialState {
        standard_deviation: INITIAL_TEMPERATURE_SD_K,
        bounds,
        ..hidden(name, ambient_k)
    }
}

/// Pressure drop and flow of a tube.
fn tube_start(side: Side) -> [InitialState; 2] {
    let names = match side {
        Side::A => ["pressure over tube a", "flow in tube a"],
        Side::B => ["pressure over tube b", "flow in tube b"],
    };
    names.map(|name| hidden(name, 0.0))
}

/// What a recording begins with, in the order of [`Layout`].
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
    let sides: Vec<Side> = sides(rig).collect();
    let Some(pneumatics) = values.pneumatics() else {
        return Vec::new();
    };
    let layout = Layout::of(&values, &pneumatics, &sides);
    let seen_pa = |side: Side| {
        let signal = recording.signal(side.pressure_signal()).unwrap_or(&[]);
        Gauge::of(&values, side).reads_pa(view.value(&recording.time_s, signal, row))
    };
    let pressure = |(output, &side): (usize, &Side)| InitialState {
        name: if side == Side::A { "p_a" } else { "p_b" },
        guess: seen_pa(side),
        standard_deviation: INITIAL_PRESSURE_SHARE * seen_pa(side),
        bounds: (1e3, 1e9),
        measured_by: Some(output),
        read_by: layout.readings.then(|| layout.reading_place() + output),
    };
    let temperature = |side: &Side| temperature_start(&values, *side);
    let wall_rise = |side: &Side| hidden(if *side == Side::A { "wall a" } else { "wall b" }, 0.0);
    let reading = |one: (usize, &Side)| InitialState {
        name: if *one.1 == Side::A {
            "reading of p_a"
        } else {
            "reading of p_b"
        },
        read_by: None,
        ..pressure(one)
    };
    let of_sides = |there: bool| sides.iter().filter(move |_| there);
    let pressures = sides.iter().enumerate().map(pressure);
    let readings = sides.iter().enumerate().filter(|_| layout.readings);
    pressures
        .chain(sides.iter().map(temperature))
        .chain(command_start(rig, recording))
        .chain(of_sides(layout.walls).map(wall_rise))
        .chain(
            layout
                .tank
                .then(|| tank_start(&values, recording, row, view)),
        )
        .chain(layout.silencer.then_some(SILENCER_START))
        .chain(layout.second_silencer.then_some(SECOND_SILENCER_START))
        .chain(readings.map(reading))
        .chain(of_sides(layout.tubes).flat_map(|side| tube_start(*side)))
        .collect()
}

/// A state that stays at what a recording is taken to begin with; only a window in
/// mid-recording begins elsewhere.
fn hidden(name: &'static str, guess: f64) -> InitialState {
    InitialState {
        name,
        guess,
        standard_deviation: 1.0,
        bounds: (guess, guess),
        measured_by: None,
        read_by: None,
    }
}

/// What a silencer holds over the surroundings' pressure, Pa: as much as an open valve
/// leaves in it.
const SILENCER_START: InitialState = InitialState {
    name: "silencer",
    guess: 0.0,
    standard_deviation: 2e4,
    bounds: (-5e4, 1e6),
    measured_by: None,
    read_by: None,
};

/// What that of port b holds, where it has one of its own.
const SECOND_SILENCER_START: InitialState = InitialState {
    name: "silencer b",
    ..SILENCER_START
};

/// The command that was held before the first row: a valve that is late still follows
/// it. Recordings often begin with the step that is to be looked at.
fn command_start(rig: &Rig, recording: &Recording) -> Option<InitialState> {
    let first = *recording.signal("u")?.first()?;
    let valve = rig.valve.as_ref()?;
    let reach = *valve.opening_v.last()?;
    // Beyond its whole stroke a valve does not tell one command from another: a fit that went
    // there did not come back.
    let null = valve.null_v;
    Some(InitialState {
        name: "earlier command",
        guess: first,
        standard_deviation: EARLIER_COMMAND_SHARE * reach,
        bounds: (first.min(null - reach), first.max(null + reach)),
        measured_by: None,
        read_by: None,
    })
}

/// The tank's pressure; a recorded one where there is one.
fn tank_start(
    values: &Values<'_, f64>,
    recording: &Recording,
    row: usize,
    view: View,
) -> InitialState {
    let regulator_pa = values.get_or("supply.pressure_Pa", DEFAULT_SUPPLY_PA);
    let recorded = recording.signal("p_s");
    let at_tank = recorded.filter(|_| !supply_droop::gauge_before_feed(values));
    let seen = at_tank.map(|signal| view.value(&recording.time_s, signal, row));
    let share = match seen {
        Some(_) => INITIAL_PRESSURE_SHARE,
        None => INITIAL_DROOP_SHARE,
    };
    InitialState {
        name: "p_s",
        guess: seen.unwrap_or(regulator_pa),
        standard_deviation: share * regulator_pa,
        bounds: (1e3, 1e9),
        measured_by: None,
        read_by: None,
    }
}

/// What drives the chambers, row by row.
struct Drive<'a, R> {
    position_m: Option<&'a [f64]>,
    time_s: &'a [f64],
    command_v: Option<&'a [f64]>,
    supply_pa: Option<&'a [f64]>,
    declared_supply_pa: R,
    supply_temperature_k: R,
    /// Whether the gauge of the supply sits at a modelled tank, which the regulator feeds.
    gauges_tank: bool,
    skew_s: R,
}

impl<'a, R: Real> Drive<'a, R> {
    fn of(values: &Values<'_, R>, track: &'a Track<'_>, gauges_tank: bool) -> Self {
        let is_driven_by_gauge = !predicts_supply(values.rig) && !gauges_tank;
        Self {
            position_m: track.signal("x"),
            time_s: &track.recording.time_s,
            command_v: track.signal("u"),
            supply_pa: track.signal("p_s").filter(|_| is_driven_by_gauge),
            declared_supply_pa: values.get_or("supply.pressure_Pa", DEFAULT_SUPPLY_PA),
            supply_temperature_k: values.ambient().temperature_k,
            gauges_tank,
            skew_s: position_time_skew::delay_s(values),
        }
    }

    /// The spool's position over each row, after a command that was held before the first.
    fn spool(&self, values: &Values<'_, R>, rows: &Range<usize>, earlier: R) -> Vec<R> {
        let command = self.command_v.unwrap_or(&[]);
        spool_positions(values, (self.time_s, command), rows, earlier)
    }

    fn position(&self, row: usize) -> R {
        match self.position_m {
            Some(position) => delayed(self.time_s, position, row, self.skew_s),
            None => R::ZERO,
        }
    }

    /// What a gauge of the supply shows.
    fn supply_gauge_pa(&self, state: &PneumaticState<R>) -> R {
        if self.gauges_tank {
            state.tank.pressure_pa(self.declared_supply_pa)
        } else {
            self.declared_supply_pa
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
    sink: &mut dyn Sink<R>,
) {
    let Some(mut pneumatics) = values.pneumatics() else {
        return;
    };
    let valve = values.valve().and_then(Result::ok);
    let sides: Vec<Side> = sides(values.rig).collect();
    let gauges_tank =
        pneumatics.supply_droop.is_present() && !supply_droop::gauge_before_feed(values);
    let drive = Drive::of(values, track, gauges_tank);
    let onset_s = chamber_leakage::onset_s(values);
    let leaks = (pneumatics.leak_a, pneumatics.leak_b);
    let lag_s = pressure_sensor_lag::time_constant_s(values);
    let layout = Layout::of(values, &pneumatics, &sides).or_plain(initial);
    let earlier = layout.earlier_command(initial);
    let spool = valve.map(|valve| (valve, drive.spool(values, &rows, earlier)));
    let gauges: Vec<Gauge<R>> = sides.iter().map(|&side| Gauge::of(values, side)).collect();
    let (mut state, mut shown) = layout.start(initial);
    let outputs = sides.len() + usize::from(predicts_supply(values.rig));
    let mut states = [R::ZERO; MOST_STATES];
    if layout.valve {
        states[layout.command_place()] = earlier;
    }
    let mut report = |state: &PneumaticState<R>, shown: &[R; 2], row: usize| {
        let mut showing = [R::ZERO; 3];
        for ((slot, gauge), shown_pa) in showing.iter_mut().zip(&gauges).zip(shown) {
            *slot = gauge.shows_pa(*shown_pa);
        }
        showing[sides.len()] = drive.supply_gauge_pa(state);
        layout.store(&mut states, state, (shown, drive.declared_supply_pa));
        sink.row(row, &showing[..outputs], &states[..layout.count()]);
    };
    report(&state, &shown, rows.start);
    let mut position_m = drive.position(rows.start);
    for row in rows.start..rows.end.saturating_sub(1) {
        let open = share_open(drive.time_s, row, onset_s);
        pneumatics.leak_a = leaks.0.scaled(open);
        pneumatics.leak_b = leaks.1.scaled(open);
        let valve_now = spool
            .as_ref()
            .map(|(valve, spool)| (valve, spool[row - rows.start]));
        let before = pressures(&sides, &state);
        let way_m = (position_m, drive.position(row + 1));
        advance(&pneumatics, &mut state, valve_now, &drive, (row, way_m));
        position_m = way_m.1;
        let after = pressures(&sides, &state);
        let dt = R::from_f64(track.dt_s(row));
        for (side, slot) in shown.iter_mut().enumerate() {
            *slot = followed(*slot, (before[side], after[side]), lag_s, dt);
        }
        report(&state, &shown, row + 1);
    }
}

/// States at a row, to which one model led, for another that goes on from there: where that
/// takes the carriage to be elsewhere, the gas is pressed there without heat.
pub(super) fn handed_on<R: Real>(
    (from, to): (&Values<'_, R>, &Values<'_, R>),
    track: &Track<'_>,
    row: usize,
    states: &mut [R],
) {
    let Some((pneumatics, position)) = to.pneumatics().zip(track.signal("x")) else {
        return;
    };
    let skew_s = |values: &Values<'_, R>| position_time_skew::delay_s(values);
    let at_m = |skew_s| delayed(&track.recording.time_s, position, row, skew_s);
    let (from_m, to_m) = (at_m(skew_s(from)), at_m(skew_s(to)));
    let kappa = pneumatics.gas.heat_capacity_ratio;
    let sides: Vec<Side> = sides(to.rig).collect();
    for (index, side) in sides.iter().enumerate() {
        let chamber = match side {
            Side::A => &pneumatics.chamber_a,
            Side::B => &pneumatics.chamber_b,
        };
        let volume_m3 = |position_m| chamber.geometry.volume_m3(position_m);
        let ratio = volume_m3(from_m) / volume_m3(to_m);
        let pressed = ratio.powf(kappa);
        states[index] = states[index] * pressed;
        if to.has_temperature_state(*side) {
            let place = index + sides.len();
            states[place] = states[place] * pressed / ratio;
        }
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
    (row, (from, to)): (usize, (R, R)),
) {
    let dt_s = drive.time_s[row + 1] - drive.time_s[row];
    let longest = if valve.is_some() {
        LONGEST_VALVE_STEP_S
    } else {
        LONGEST_CLOSED_STEP_S
    };
    let steps = (dt_s / longest).ceil().clamp(1.0, MOST_SUBSTEPS);
    let step_s = R::from_f64(dt_s / steps);
    let way = to - from;
    let valve = valve.map(|(valve, spool_v)| ValveDrive {
        areas: valve.areas(spool_v),
        supply: drive.supply(row),
    });
    let mut here = from;
    for step in 1..=steps as u32 {
        let next = from + way * R::from_f64(f64::from(step) / steps);
        match &valve {
            Some(valve) => pneumatics.step_behind_regulator(state, valve, here, next, step_s),
            None => pneumatics.step(state, None, here, next, step_s),
        }
        here = next;
    }
}

/// Where each state stands among those that a recording or window begins with:
/// pressures, temperatures, the earlier command; and what an effect adds, walls, tank,
/// silencer or silencers, the sensors' readings, and each tube's pressure over the chamber's and flow.
struct Layout<'a> {
    sides: &'a [Side],
    valve: bool,
    walls: bool,
    tank: bool,
    silencer: bool,
    second_silencer: bool,
    readings: bool,
    tubes: bool,
}

/// The most states of one law.
const MOST_STATES: usize = 16;

impl<'a> Layout<'a> {
    fn of<R: Real>(values: &Values<'_, R>, pneumatics: &Pneumatics<R>, sides: &'a [Side]) -> Self {
        let valve = values.rig.valve.is_some();
        let silencer = valve && pneumatics.back_pressure.is_present();
        Self {
            sides,
            valve,
            walls: pneumatics.chamber_a.wall.is_warmed(),
            tank: pneumatics.supply_droop.is_present(),
            silencer,
            second_silencer: silencer && pneumatics.separate_exhausts,
            readings: pressure_sensor_lag::time_constant_s(values) > R::ZERO,
            tubes: valve && pneumatics.tube.is_present(),
        }
    }

    /// The same without what effects add, where a recording begins with fewer states: a fit that
    /// only tries an effect out begins as if nothing had happened before, the wall at its offset,
    /// the tank full.
    fn or_plain<R>(self, initial: &[R]) -> Self {
        if initial.len() >= self.count() {
            return self;
        }
        Self {
            walls: false,
            tank: false,
            silencer: false,
            second_silencer: false,
            readings: false,
            tubes: false,
            ..self
        }
    }

    /// One per chamber, where there are such.
    fn per_side(&self, there: bool) -> usize {
        if there { self.sides.len() } else { 0 }
    }

    fn command_place(&self) -> usize {
        2 * self.sides.len()
    }

    fn wall_place(&self) -> usize {
        self.command_place() + usize::from(self.valve)
    }

    fn tank_place(&self) -> usize {
        self.wall_place() + self.per_side(self.walls)
    }

    fn silencer_place(&self) -> usize {
        self.tank_place() + usize::from(self.tank)
    }

    fn second_silencer_place(&self) -> usize {
        self.silencer_place() + usize::from(self.silencer)
    }

    fn reading_place(&self) -> usize {
        self.second_silencer_place() + usize::from(self.second_silencer)
    }

    fn tube_place(&self) -> usize {
        self.reading_place() + self.per_side(self.readings)
    }

    /// Number of states.
    fn count(&self) -> usize {
        self.tube_place() + 2 * self.per_side(self.tubes)
    }

    /// The command before the first row; without a valve it is nothing.
    fn earlier_command<R: Real>(&self, initial: &[R]) -> R {
        if self.valve {
            initial[self.command_place()]
        } else {
            R::ZERO
        }
    }

    /// The state at the start, and what the sensors show there.
    fn start<R: Real>(&self, initial: &[R]) -> (PneumaticState<R>, [R; 2]) {
        let gas = |wanted: Side| {
            let index = self.sides.iter().position(|&side| side == wanted);
            let index = index.unwrap_or(0);
            GasState {
                pressure_pa: initial[index],
                temperature_k: initial[index + self.sides.len()],
            }
        };
        let mut state = PneumaticState::at_rest(gas(Side::A), gas(Side::B));
        if self.tank {
            state.tank = TankState::at(initial[self.tank_place()]);
        }
        if self.silencer {
            state.silencer = SilencerState::at(initial[self.silencer_place()]);
        }
        if self.second_silencer {
            state.silencer_b = SilencerState::at(initial[self.second_silencer_place()]);
        }
        let mut shown = pressures(self.sides, &state);
        for (index, &side) in self.sides.iter().enumerate() {
            let (chamber, tube) = match side {
                Side::A => (&mut state.a, &mut state.tube_a),
                Side::B => (&mut state.b, &mut state.tube_b),
            };
            if self.walls {
                chamber.wall_rise_k = Compensated::new(initial[self.wall_place() + index]);
            }
            if self.readings {
                shown[index] = initial[self.reading_place() + index];
            }
            if self.tubes {
                let place = self.tube_place() + 2 * index;
                let pressure_pa = chamber.pressure_pa.value;
                *tube = TubeState::flowing(pressure_pa, initial[place], initial[place + 1]);
            }
        }
        (state, shown)
    }

    /// Writes the states as they stand now; the earlier command stays.
    fn store<R: Real>(
        &self,
        states: &mut [R; MOST_STATES],
        state: &PneumaticState<R>,
        (shown, regulator_pa): (&[R; 2], R),
    ) {
        for (index, &side) in self.sides.iter().enumerate() {
            let (chamber, tube) = match side {
                Side::A => (&state.a, &state.tube_a),
                Side::B => (&state.b, &state.tube_b),
            };
            states[index] = chamber.pressure_pa.value;
            states[index + self.sides.len()] = chamber.temperature_k.value;
            if self.walls {
                states[self.wall_place() + index] = chamber.wall_rise_k.value;
            }
            if self.readings {
                states[self.reading_place() + index] = shown[index];
            }
            if self.tubes {
                let place = self.tube_place() + 2 * index;
                states[place] = tube.port_pa() - chamber.pressure_pa.value;
                states[place + 1] = tube.flow_kg_per_s();
            }
        }
        if self.tank {
            states[self.tank_place()] = state.tank.pressure_pa(regulator_pa);
        }
        if self.silencer {
            states[self.silencer_place()] = state.silencer.excess_pa();
        }
        if self.second_silencer {
            states[self.second_silencer_place()] = state.silencer_b.excess_pa();
        }
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
