//! The supervisor: is what the control task is told believable, and in which
//! state is it.
//!
//! | room | check |
//! |---|---|
//! | `range` | failed conversions, readings out of range, the supply |
//! | `jump` | readings that change faster than physics |
//! | `travel` | position against velocity: frozen or contradicting |
//! | `force` | pressures against motion |
//! | `polarity` | whether valve and motion answer the right way round |
//! | `pressure` | a chamber pressure that stands still and should not |
//! | `stream` | missed samples, stale or impossible references |
//! | `swing` | a command that goes to and fro at a hold without an end |
//! | `sensors` | what is assumed of the sensors |
//!
//! ```text
//! Init --10 ms--> Idle <--a reference of NaN / one that is a number--> Track
//!   \               \                                                   /
//!    +---------------+------------- any finding ----> Fault <----------+
//!                     Fault --acknowledged--> Idle, for 10 ms at least
//! ```
//!
//! Limits follow from the rig, the sensors and the tick: each check's file says
//! how. Choices of engineering are seven: 15 % of the axis' largest force as the
//! reserve for what the model of the force leaves out (`force`), 0.5 mm that a
//! position may miss (`travel`, `sensors`), 2 % of the flow near the valve's
//! null that counts as none (`pressure`), 5 ms of skew between position and
//! velocity (`sensors`), 5 % of the largest force that may act unknown at the first move
//! (`polarity`), half of the full opening that counts as a swing, and 12 of them
//! (`swing`). A check is `Params` + `State` + a total step.

mod force;
mod jump;
mod polarity;
mod pressure;
mod range;
mod sensors;
mod step;
mod stream;
mod swing;
mod travel;

use crate::codes::AdcCodes;
use crate::fault::{Channel, Finding};
use crate::settings::Wiring;
use crate::status::Counters;
use crate::tick::State;
use force::ForceState;
use jump::{Jump, JumpState};
use model_core::axis::Axis;
use model_core::controller::Measurements;
use model_core::real::Real;
use model_core::reference::Reference;
use polarity::PolarityState;
use pressure::{PressureState, Side};
use range::Range;
pub use step::Shown;
use step::Step;
use stream::{Stream, StreamState};
use swing::{Asked, Swing, SwingState};
use travel::TravelState;

/// Time for the observer to settle before anything is asked of the axis, s: two
/// time constants of its slowest loop on measured states, 200 1/s, on what is
/// left of a start at the measured values.
const SETTLE_S: f32 = 10e-3;

/// What the checks go by; made from the rig.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Limits {
    range: Range,
    jump: Jump,
    stream: Stream,
    swing: Swing,
    settle_ticks: u16,
}

impl Limits {
    fn new(axis: &Axis<f32>, wiring: Wiring) -> Self {
        let (range, jump) = (Range::new(axis, wiring), Jump::new(axis));
        Self {
            stream: Stream::new(axis, range.stroke_m, &jump),
            range,
            jump,
            swing: Swing::new(axis),
            settle_ticks: settle_ticks(axis.dt_s),
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast from f32 saturates"
)]
fn settle_ticks(dt_s: f32) -> u16 {
    (SETTLE_S / dt_s + 0.5) as u16
}

/// What the checks remember.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Memory {
    last: Option<(AdcCodes, Measurements<f32>)>,
    jump: JumpState,
    travel: TravelState,
    force: ForceState,
    polarity: PolarityState,
    pressures: [PressureState; 2],
    swing: SwingState,
}

/// Checks and state.
#[derive(Clone, Debug)]
pub struct Supervisor {
    limits: Limits,
    memory: Memory,
    stream: StreamState,
    /// Where the spool was while what arrives in the chambers since the last tick passed it, as
    /// far as known, V.
    spool_v: f32,
    state: State,
    settled_ticks: u16,
    latched: Option<Finding>,
    fault_tick: u32,
    pending: Option<Finding>,
    has_new_settings: bool,
    /// How many times the loop was calmed since it has its settings.
    calmed: u8,
    counters: Counters,
}

impl Supervisor {
    /// A supervisor for an axis, before its first tick.
    pub fn new(axis: &Axis<f32>, wiring: Wiring) -> Self {
        Self {
            limits: Limits::new(axis, wiring),
            memory: Memory::default(),
            stream: StreamState::default(),
            spool_v: axis.valve.null_v,
            state: State::Init,
            settled_ticks: 0,
            latched: None,
            fault_tick: 0,
            pending: None,
            has_new_settings: false,
            calmed: 0,
            counters: Counters::default(),
        }
    }

    /// The state.
    pub fn state(&self) -> State {
        self.state
    }

    /// The finding that holds the valve at its null.
    pub fn latched(&self) -> Option<Finding> {
        self.latched
    }

    /// The tick whose sample showed it.
    pub fn fault_tick(&self) -> u32 {
        self.fault_tick
    }

    /// What has been counted.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// What the board counts.
    pub fn counters_mut(&mut self) -> &mut Counters {
        &mut self.counters
    }

    /// Limits for another axis, that of new settings; what was remembered begins
    /// anew.
    pub fn replace_axis(&mut self, axis: &Axis<f32>, wiring: Wiring) {
        self.has_new_settings = true;
        self.calmed = 0;
        self.limits = Limits::new(axis, wiring);
        self.spool_v = axis.valve.null_v;
        self.begin_anew();
    }

    /// The board saw something; the next tick reacts. The first one counts.
    pub fn note(&mut self, finding: Finding) {
        self.pending.get_or_insert(finding);
    }

    /// Back to idle, unless the cause still stands or there is nothing to
    /// acknowledge.
    pub fn acknowledge(&mut self) -> bool {
        let Some(finding) = self.latched else {
            return false;
        };
        let has_ended = self.has_new_settings && finding.fault.ends_with_settings();
        if finding.fault.is_standing() && !has_ended {
            return false;
        }
        self.latched = None;
        // What the board noted meanwhile; what is still so, the next tick sees.
        self.pending = None;
        self.state = State::Idle;
        self.begin_anew();
        true
    }

    fn begin_anew(&mut self) {
        self.memory = Memory::default();
        self.stream = StreamState::default();
        self.settled_ticks = 0;
    }

    /// Judges what the sensors show and what is asked of the loop, which the axis may follow or not;
    /// the state in which its command is made.
    #[inline]
    pub fn step(
        &mut self,
        axis: &Axis<f32>,
        shown: &Shown<'_>,
        (reference, may_follow): (&Reference<f32>, bool),
    ) -> State {
        if self.state == State::Fault {
            return State::Fault;
        }
        match self
            .pending
            .take()
            .or_else(|| self.judge(axis, shown, reference))
        {
            Some(finding) => self.trip(finding, shown.tick),
            None => self.go_on(may_follow && !stream::is_nothing(reference)),
        }
        self.state
    }

    /// What the valve has to do against a motion the wrong way round, V from its null, where
    /// there is one and its time has not passed.
    pub fn brake_v(&self, axis: &Axis<f32>, now: &Measurements<f32>, tick: u32) -> Option<f32> {
        let ticks = u16::try_from(tick.wrapping_sub(self.fault_tick)).ok()?;
        let seen = (&self.memory.polarity, self.latched?);
        polarity::brake_v(axis, now, seen, axis.dt_s * f32::from(ticks))
    }

    /// Latches a finding of this tick.
    pub fn trip(&mut self, finding: Finding, tick: u32) {
        self.state = State::Fault;
        self.latched = Some(finding);
        self.fault_tick = tick;
        self.pending = None;
        self.counters.faults = self.counters.faults.saturating_add(1);
    }

    fn go_on(&mut self, follows: bool) {
        let is_settled = self.settled_ticks >= self.limits.settle_ticks;
        self.settled_ticks = self.settled_ticks.saturating_add(1);
        if !is_settled {
            return;
        }
        self.state = if follows { State::Track } else { State::Idle };
    }

    /// Judges the command that a reference brought, `above_null_v` from the valve's null; whether
    /// the loop has to be calmed.
    #[inline]
    pub fn watch_command(
        &mut self,
        reference: &Reference<f32>,
        above_null_v: f32,
        (dt_s, tick): (f32, u32),
    ) -> bool {
        let (limits, memory) = (&self.limits.swing, &mut self.memory.swing);
        match limits.check(memory, reference, above_null_v, (dt_s, self.calmed)) {
            Some(Asked::Calm) => {
                self.calmed += 1;
                return true;
            }
            Some(Asked::Stop(finding)) => self.trip(finding, tick),
            None => {}
        }
        false
    }

    /// How many times the loop was calmed since it has its settings.
    pub fn calmed(&self) -> u8 {
        self.calmed
    }

    /// Remembers where the spool was while what arrives in the chambers until the next tick
    /// passed it, V.
    #[inline]
    pub fn remember_spool(&mut self, spool_v: f32) {
        self.spool_v = spool_v;
    }

    #[inline]
    fn judge(
        &mut self,
        axis: &Axis<f32>,
        shown: &Shown<'_>,
        reference: &Reference<f32>,
    ) -> Option<Finding> {
        let limits = &self.limits;
        let stream = &mut self.stream;
        let elapsed = match limits
            .stream
            .elapsed(stream, shown.tick, &mut self.counters)
        {
            Ok(elapsed) => elapsed,
            Err(finding) => return Some(finding),
        };
        let elapsed_s = axis.dt_s * f32::from(u16::try_from(elapsed).unwrap_or(u16::MAX));
        limits
            .range
            .check(shown.codes, shown.measured)
            .or_else(|| limits.stream.check_reference(stream, reference, elapsed_s))
            .or_else(|| {
                // A sample of the same tick again adds nothing.
                if elapsed == 0 {
                    return None;
                }
                let last = (*shown.codes, *shown.measured);
                let (codes_before, before) = self.memory.last.replace(last)?;
                let step = Step {
                    now: shown.measured,
                    before: &before,
                    codes_now: shown.codes,
                    codes_before: &codes_before,
                    elapsed_s,
                    is_next: elapsed == 1,
                    tick: shown.tick,
                    spool_v: self.spool_v,
                };
                let tracks = self.state == State::Track;
                self.memory.check(axis, &self.limits, &step, tracks)
            })
    }
}

impl Memory {
    #[inline]
    fn check(
        &mut self,
        axis: &Axis<f32>,
        limits: &Limits,
        step: &Step<'_>,
        tracks: bool,
    ) -> Option<Finding> {
        let unexplained = if tracks {
            let polarity = self.polarity.check(axis, step);
            polarity.or(self.force.check(axis, step))
        } else {
            self.force = ForceState::default();
            None
        };
        limits
            .jump
            .check(&mut self.jump, axis, step)
            .or_else(|| self.travel.check(step))
            .or_else(|| self.frozen_pressure(axis, limits, step))
            .or(unexplained)
    }

    /// One chamber a tick in turn, each for two ticks: a tick's cost stays low.
    fn frozen_pressure(
        &mut self,
        axis: &Axis<f32>,
        limits: &Limits,
        step: &Step<'_>,
    ) -> Option<Finding> {
        let (before, now) = (step.codes_before, step.codes_now);
        let [a, b] = &mut self.pressures;
        a.count((before.pressure_a, now.pressure_a));
        b.count((before.pressure_b, now.pressure_b));
        let is_turn_of_a = step.tick.is_multiple_of(2);
        let state = if is_turn_of_a { a } else { b };
        if !state.stands() {
            return None;
        }
        let valve = &axis.valve;
        let above_null_v = step.spool_v - valve.null_v;
        // Positive where the valve feeds this chamber.
        let feeding_v = if valve.feeds_a_above_null == is_turn_of_a {
            above_null_v
        } else {
            -above_null_v
        };
        let (channel, chamber, pressure_pa) = if is_turn_of_a {
            let chamber = &axis.pneumatics.chamber_a;
            (Channel::PressureA, chamber, step.now.pressure_a_pa)
        } else {
            let chamber = &axis.pneumatics.chamber_b;
            (Channel::PressureB, chamber, step.now.pressure_b_pa)
        };
        let side = Side {
            channel,
            chamber: &chamber.geometry,
            supply_area_m2: valve.supply.area_m2(Real::max(feeding_v, 0.0)),
            exhaust_area_m2: valve.exhaust.area_m2(Real::max(-feeding_v, 0.0)),
            pressure_pa,
        };
        let open_flow_m3_per_s = limits.jump.most_volume_flow_m3_per_s;
        let time_s = 2.0 * step.elapsed_s;
        state.check(axis, &side, step, (open_flow_m3_per_s, time_s))
    }
}
