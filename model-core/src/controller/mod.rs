//! The position controller: one call a tick.
//!
//! ```text
//! F* = M (a_r + w^2 e + 2 zeta w e') + friction(v_r) - d      position loop
//! F*' + k (F* - F)  ->  valve command                         force loop, inverse flow map
//! ```
//!
//! Feedforward runs ahead of the sensors by the delay of tick and spool, and is
//! compared with the measured force only when it is due: both loops together
//! would otherwise ask twice for the same force.
//!
//! A spool with a slew limit is under way for long: the force that it brings until it is where
//! the feedforward wants it is counted as if it were there, or the loop would ask for it again.
//!
//! Gas that is on its way in a tube is counted as if it had arrived, and the feedforward runs
//! ahead by its transit as well.
//!
//! A load behind a spring swings against the carriage faster than the valve can follow: what is
//! fed back is the velocity of their centre of mass, which no swing changes.
//!
//! Friction is fed forward by a bristle of its own that the *reference* moves: the
//! measured velocity is too coarse near rest. The position error moves it too,
//! slowly; while the load sticks that is an integral which ends at the force of
//! breakaway, and it is let go the moment the load slips: the friction then
//! stops it, in less way than any feedback could.
//!
//! At a reversal the load sticks a little before the reference turns, for friction
//! rises as it slows. It waits with the friction of sliding fed forward the other way, and
//! gets that of breakaway when the reference comes by.
//!
//! At rest the valve is shut, and what leaks changes the force: within some newtons the
//! error is some micrometres, and every crossing of the dead zone would be a step of the
//! spool (`rest.rs`).
//!
//! Limits: one valve moves both chambers against each other, so the mean pressure
//! is not controlled; a load below about half the rig's mass is not tried.

mod rest;

use crate::axis::Axis;
use crate::feedforward::ForceRates;
use crate::friction::FrictionLevels;
use crate::left_out::{DelayLine, SpoolDynamics, ValveDelay};
pub use crate::observer::Measurements;
use crate::observer::{Observer, ObserverGains, ObserverState};
use crate::real::Real;
use crate::reference::{Follower, MotionLimits, Reference};
use rest::Rest;

/// What the observer believes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<R> {
    /// Position, m.
    pub position_m: R,
    /// Velocity, m/s.
    pub velocity_m_per_s: R,
    /// Friction against +x, N.
    pub friction_n: R,
    /// Force that the model does not explain, along +x, N.
    pub disturbance_n: R,
}

impl<R: Copy> Estimate<R> {
    /// The four in the order of the link.
    pub fn to_array(&self) -> [R; 4] {
        [
            self.position_m,
            self.velocity_m_per_s,
            self.friction_n,
            self.disturbance_n,
        ]
    }
}

/// What an experiment wishes of an axis at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wish<R> {
    /// A command, V.
    Command(R),
    /// Gas and known loads are to push along +x with this, N: the force loop alone.
    Force(R),
}

/// What the controller decides at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Action<R> {
    /// Valve command, V.
    pub command_v: R,
    /// The observer's belief.
    pub estimate: Estimate<R>,
}

/// Bandwidths and limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains<R> {
    /// Of the observer.
    pub observer: ObserverGains<R>,
    /// Of the position loop, rad/s.
    pub position_per_s: R,
    /// Damping ratio of the position loop.
    pub damping: R,
    /// Of the force loop, 1/s.
    pub force_per_s: R,
    /// By how much the feedforward runs ahead: tick, hold, spool and tube, s.
    pub lead_s: R,
    /// Speed at which an error moves the bristle of the feedforward, 1/s.
    pub approach_per_s: R,
    /// Share of the Coulomb friction by which the force may exceed stiction where
    /// the load sticks off its place: what is known of stiction is not exact.
    pub breakaway_margin: R,
    /// Speed above which a load that should stand still has slipped, m/s.
    pub slip_m_per_s: R,
    /// Error below which the load may come to rest, m.
    pub rest_error_m: R,
    /// Error above which rest is given up, m.
    pub lost_error_m: R,
    /// Error that rest does not correct, m.
    pub indifferent_m: R,
    /// Of the force where rest corrects, 1/s.
    pub rest_force_per_s: R,
    /// How a reference that jumps is joined.
    pub motion: MotionLimits<R>,
}

impl<R: Real> Gains<R> {
    /// Gains found on the paper's axis and on rigs of 1.7 to 4.4 kg, with a spool
    /// of 100 Hz and a tick of 1 ms, all of them with parameters wrong within
    /// their uncertainty.
    pub fn standard() -> Self {
        let c = R::from_f64;
        Self {
            observer: ObserverGains {
                pressure_per_s: c(200.0),
                motion_per_s: c(250.0),
                disturbance_per_s: c(50.0),
                edge_per_s: c(1.0),
                friction_per_s: c(10.0),
            },
            position_per_s: c(60.0),
            damping: c(1.0),
            force_per_s: c(200.0),
            // One tick, half a tick of hold, and 2 zeta / w of a spool of 100 Hz
            // with zeta 0.7 is 3.7 ms.
            lead_s: c(3.5e-3),
            approach_per_s: c(30.0),
            breakaway_margin: c(0.5),
            slip_m_per_s: c(4e-3),
            rest_error_m: c(15e-6),
            lost_error_m: c(13.5e-6),
            indifferent_m: c(11e-6),
            rest_force_per_s: c(100.0),
            // What the valve passes with 5 kg to spare.
            motion: MotionLimits {
                velocity_m_per_s: c(0.8),
                acceleration_m_per_s2: c(8.0),
                jerk_m_per_s3: c(400.0),
            },
        }
    }
}

impl<R: Real> Gains<R> {
    /// The gains for a valve that is later than that of the data sheet, in small
    /// motion and in reversals: the feedforward runs further ahead by the former,
    /// and what goes around through the valve slows down by the latter. Little at first, for the gains leave some margin of phase; then
    /// faster than in proportion, as what is fed forward also gets less exact.
    #[must_use]
    fn for_valve_later_by(self, small_s: R, reversal_s: R) -> Self {
        let ratio = reversal_s / self.lead_s;
        let share = R::ONE / (R::ONE + R::from_f64(SLOWING) * ratio * ratio);
        Self {
            lead_s: self.lead_s + small_s,
            ..self.slower_by(share)
        }
    }

    /// What goes around through the valve, slower by this share.
    #[must_use]
    fn slower_by(self, share: R) -> Self {
        Self {
            position_per_s: share * self.position_per_s,
            force_per_s: share * self.force_per_s,
            approach_per_s: share * self.approach_per_s,
            rest_force_per_s: share * self.rest_force_per_s,
            ..self
        }
    }
}

/// The controller's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<R> {
    axis: Axis<R>,
    gains: Gains<R>,
    /// From what is fed forward to the flow through the valve.
    due: ValveDelay<R>,
    observer: Observer<R>,
}

/// The controller's memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerState<R> {
    observer: ObserverState<R>,
    /// The command that acts until the next tick.
    command_v: R,
    follower: Follower<R>,
    acceleration_m_per_s2: R,
    feedforward: Feedforward<R>,
    rest: Rest<R>,
}

/// Memory of the force feedforward.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Feedforward<R> {
    /// Deflection of the bristle that the reference moves, m.
    deflection_m: R,
    force_n: R,
    /// Forces that are not due yet.
    line: DelayLine<R>,
    /// The way the reference goes: -1, 1, or 0 before it has gone any.
    way: R,
    /// The load has broken away since the reference goes this way.
    has_broken_away: bool,
}

impl<R: Real> Feedforward<R> {
    /// A force that has stood since long ago.
    fn holding(force_n: R, stiffness_n_per_m: R) -> Self {
        Self {
            deflection_m: force_n / stiffness_n_per_m,
            force_n,
            line: DelayLine::holding(force_n),
            way: R::ZERO,
            has_broken_away: false,
        }
    }
}

/// The reference at the time when a command of now acts.
struct Ahead<R> {
    velocity_m_per_s: R,
    acceleration_m_per_s2: R,
    /// Whether the load is to stand still.
    is_still: bool,
}

/// Errors of position and velocity.
struct Errors<R> {
    position_m: R,
    velocity_m_per_s: R,
}

/// A reference slower than this stands still, m/s and m/s2: rounding of what is
/// streamed, far below what the sensors see.
const STILL_M_PER_S: f64 = 1e-6;
const STILL_M_PER_S2: f64 = 1e-4;
/// The spool of the valve's data sheet: -3 dB at 100 Hz, damping 0.6 to 0.9.
const SPOOL_HZ: f64 = 100.0;
const SPOOL_DAMPING: f64 = 0.7;
/// The friction of a load left behind is fed forward as at so many times its speed. Of 60
/// seeds on 13 rigs, with 1 some were thrown too far at the end of a move, with 2 some
/// stuck again.
const LEFT_BEHIND_SHARE: f64 = 1.4;
/// How much bandwidth a late valve costs: found on plants with 2 ms more (nothing
/// need be given up) and 10 ms more (a quarter is left).
const SLOWING: f64 = 0.37;
/// What the spool does at a reversal, in edges of its dead zone: over both of them, and half as
/// far on. On 27 plants with slew limits of 50 to 400 V/s, rates known to 25 %: less runs away
/// on the slowest, with 8 they are three to ten times as far off.
const REVERSAL: f64 = 3.0;
/// How much of the way through a tube counts as the valve's being late: what is under way in it
/// is known, and only so well. On tubes of 1.4 to 3 m, with none half of the plants swing at the
/// edges of the valve, with 0.7 their error grows again.
const TRANSIT_SHARE: f64 = 0.5;
/// The valve's input, V.
const COMMAND_RANGE_V: [f64; 2] = [0.0, 10.0];

impl<R: Real> Controller<R> {
    /// A controller for this axis; the tick is the axis' step.
    pub fn new(axis: Axis<R>) -> Self {
        Self::with_gains(axis, Gains::standard())
    }

    /// The same with these gains. An axis whose spool follows at once is taken to
    /// have the spool of the data sheet: the valve's lag is felt in every reversal.
    /// The gains are for that spool; to a slower valve they are fitted.
    pub fn with_gains(mut axis: Axis<R>, gains: Gains<R>) -> Self {
        let data_sheet = SpoolDynamics {
            natural_frequency_hz: R::from_f64(SPOOL_HZ),
            damping_ratio: R::from_f64(SPOOL_DAMPING),
        };
        axis.command_path = axis.command_path.or_spool(&data_sheet);
        let reversal_v = R::from_f64(REVERSAL) * axis.valve.supply.edge_v();
        let later_s = |step_v| {
            let lag_s: R = axis.command_path.lag_s(step_v);
            (lag_s - data_sheet.lag_s()).max(R::ZERO)
        };
        let transit_s = axis.pneumatics.transit_s();
        let small_s = later_s(R::ZERO);
        let due = ValveDelay {
            delay_s: gains.lead_s + small_s,
        };
        let reversal_s = later_s(reversal_v) + R::from_f64(TRANSIT_SHARE) * transit_s;
        let gains = gains.for_valve_later_by(small_s + transit_s, reversal_s);
        Self {
            due,
            observer: Observer::new(&axis, &gains.observer),
            axis,
            gains,
        }
    }

    /// The observer follows the measured pressures more slowly, by this share: where the loop
    /// swings, as it does about gauges that lag.
    pub fn follow_pressures_slower(&mut self, share: R) {
        self.observer.follow_pressures_slower(share);
    }

    /// The loop becomes slower by this share: where it swings although nobody knows why, as about
    /// tubes and dead times that are not in the rig.
    pub fn slow_down(&mut self, share: R) {
        self.gains = self.gains.slower_by(share);
    }

    /// The axis that this is the controller of.
    pub fn axis(&self) -> &Axis<R> {
        &self.axis
    }

    /// Its observer.
    pub fn observer(&self) -> &Observer<R> {
        &self.observer
    }

    /// The command at which the valve is centred, V.
    pub fn null_v(&self) -> R {
        self.axis.valve.null_v
    }

    /// Where the spool was, as far as known, while what now arrives in the chambers passed it,
    /// V: with tubes a transit before.
    #[inline]
    pub fn felt_spool_v(&self, state: &ControllerState<R>) -> R {
        state.observer.felt_spool_v
    }

    /// Memory for an axis that is at rest where the sensors say.
    pub fn begin(&self, measured: &Measurements<R>) -> ControllerState<R> {
        let force_n = self
            .axis
            .carriage
            .drive_n(measured.pressure_a_pa, measured.pressure_b_pa);
        ControllerState {
            observer: self.observer.begin(&self.axis, measured),
            command_v: self.null_v(),
            follower: Follower::at(measured.position_m),
            acceleration_m_per_s2: R::ZERO,
            feedforward: Feedforward::holding(force_n, self.stiffness()),
            rest: Rest::left(),
        }
    }

    /// One tick without a task: the observer goes on, the valve is at its null.
    pub fn idle(&self, state: &mut ControllerState<R>, measured: &Measurements<R>) -> Action<R> {
        self.observe(state, measured);
        state.command_v = self.null_v();
        state.follower = Follower::at(state.observer.carriage.position_m.value);
        state.acceleration_m_per_s2 = R::ZERO;
        state.feedforward = Feedforward::holding(self.gas_force_n(state), self.stiffness());
        state.rest = Rest::left();
        self.action(state)
    }

    /// The command for valve or force as somebody else says, V, in place of the null of a tick
    /// that was [`idle`](Self::idle).
    #[inline(never)]
    pub fn instead(&self, state: &mut ControllerState<R>, wish: &Wish<R>) -> R {
        let command_v = match wish {
            Wish::Command(command_v) => *command_v,
            Wish::Force(wanted_n) => self.pressed_v(state, *wanted_n),
        };
        let [lowest_v, highest_v] = COMMAND_RANGE_V.map(R::from_f64);
        state.command_v = command_v.clamp(lowest_v, highest_v);
        state.command_v
    }

    /// The command of the force loop alone, V.
    fn pressed_v(&self, state: &ControllerState<R>, wanted_n: R) -> R {
        let rates = self.rates(state, state.observer.carriage.velocity_m_per_s);
        let missing_n = wanted_n - self.gas_force_n(state);
        let on_the_way_n = self.on_the_way_n(state, &rates, R::ZERO);
        let rate = self.gains.force_per_s * (missing_n - on_the_way_n);
        let command_v = rates.command_v(&self.axis, rate);
        state.observer.edges.done(command_v, self.null_v())
    }

    /// One tick of following a reference.
    pub fn track(
        &self,
        state: &mut ControllerState<R>,
        measured: &Measurements<R>,
        reference: &Reference<R>,
    ) -> Action<R> {
        self.observe(state, measured);
        let reference = state
            .follower
            .step(&self.gains.motion, reference, self.axis.dt_s);
        let ahead = self.ahead(state, &reference);
        let common_m_per_s = self
            .axis
            .carriage
            .common_velocity_m_per_s(&state.observer.carriage);
        let errors = Errors {
            position_m: reference.position_m - state.observer.carriage.position_m.value,
            velocity_m_per_s: reference.velocity_m_per_s - common_m_per_s,
        };
        let force_n = self.gas_force_n(state);
        let was_resting = state.rest.is_resting();
        state.rest.step(
            &self.gains,
            &self.axis,
            &state.observer,
            &ahead,
            &errors,
            force_n,
        );
        let command_v = if state.rest.is_resting() {
            self.rest_command_v(state)
        } else {
            if was_resting {
                state.feedforward = Feedforward::holding(force_n, self.stiffness());
            }
            self.tracking_command_v(state, &ahead, &errors, force_n)
        };
        let [lowest_v, highest_v] = COMMAND_RANGE_V.map(R::from_f64);
        state.command_v = state
            .observer
            .edges
            .done(command_v, self.null_v())
            .clamp(lowest_v, highest_v);
        self.action(state)
    }

    /// One tick of the observer, under the command that acted since the last.
    #[inline]
    fn observe(&self, state: &mut ControllerState<R>, measured: &Measurements<R>) {
        let command_v = state.command_v;
        self.observer
            .step(&self.axis, &mut state.observer, command_v, measured);
    }

    fn action(&self, state: &ControllerState<R>) -> Action<R> {
        let observer = &state.observer;
        Action {
            command_v: state.command_v,
            estimate: Estimate {
                position_m: observer.carriage.position_m.value,
                velocity_m_per_s: observer.carriage.velocity_m_per_s,
                friction_n: observer.carriage.friction_n,
                disturbance_n: observer.disturbance_n,
            },
        }
    }

    fn stiffness(&self) -> R {
        self.axis.carriage.bristle.stiffness_n_per_m
    }

    /// Observed force of the gas and the known loads on the carriage, N.
    /// What is on its way in the tubes is counted, else the loop around would make up for it
    /// anew at every tick.
    fn gas_force_n(&self, state: &ControllerState<R>) -> R {
        let (gas, body) = (&state.observer.pneumatics, &state.observer.carriage);
        let carriage = &self.axis.carriage;
        let (a_pa, b_pa) =
            self.axis
                .pneumatics
                .settled_pa(gas, body.position_m.value, body.velocity_m_per_s);
        carriage.drive_n(a_pa, b_pa)
            - self.axis.friction_terms.constant_force_n
            - carriage.unknown_force_n(body.position_m.value, body.velocity_m_per_s)
            - carriage.trailing_force_n(body)
    }

    fn ahead(&self, state: &mut ControllerState<R>, reference: &Reference<R>) -> Ahead<R> {
        let lead_s = self.gains.lead_s;
        let acceleration = reference.acceleration_m_per_s2;
        let jerk = (acceleration - state.acceleration_m_per_s2) / self.axis.dt_s;
        state.acceleration_m_per_s2 = acceleration;
        let half = R::from_f64(0.5);
        let velocity_m_per_s =
            reference.velocity_m_per_s + lead_s * (acceleration + half * lead_s * jerk);
        let still = R::from_f64(STILL_M_PER_S);
        Ahead {
            velocity_m_per_s,
            acceleration_m_per_s2: acceleration + lead_s * jerk,
            is_still: velocity_m_per_s.abs() <= still
                && reference.velocity_m_per_s.abs() <= still
                && acceleration.abs() <= R::from_f64(STILL_M_PER_S2),
        }
    }

    /// The force that the reference needs when it is ahead: inertia and friction.
    fn feedforward_n(
        &self,
        state: &mut ControllerState<R>,
        ahead: &Ahead<R>,
        errors: &Errors<R>,
    ) -> R {
        let (gains, carriage) = (&self.gains, &self.axis.carriage);
        let speed = state.observer.carriage.velocity_m_per_s.abs();
        let inertia_n = carriage.mass_kg * ahead.acceleration_m_per_s2;
        if ahead.is_still && speed > gains.slip_m_per_s {
            state.feedforward.deflection_m = R::ZERO;
            return inertia_n;
        }
        let approach = gains.approach_per_s * state.rest.approach_share() * errors.position_m;
        let is_left_behind = self.notice_left_behind(state, ahead, errors);
        let (deflection_m, friction_n) = carriage.bristle.step_driven(
            &self.fed_forward_levels(state, ahead, speed, is_left_behind),
            ahead.velocity_m_per_s + approach,
            state.feedforward.deflection_m,
            self.axis.dt_s,
        );
        state.feedforward.deflection_m = deflection_m;
        inertia_n + friction_n
    }

    /// Notes the way of the reference and whether the load has broken away on it, and tells
    /// whether it still sticks where the reference, on its way, has passed it by the
    /// time that a command of now acts. Once on each way: a load that slows down in the
    /// course of it would be thrown forth again and again.
    fn notice_left_behind(
        &self,
        state: &mut ControllerState<R>,
        ahead: &Ahead<R>,
        errors: &Errors<R>,
    ) -> bool {
        let feedforward = &mut state.feedforward;
        if ahead.is_still {
            feedforward.way = R::ZERO;
            return false;
        }
        let way = ahead.velocity_m_per_s.signum();
        if way * feedforward.way <= R::ZERO {
            feedforward.way = way;
            feedforward.has_broken_away = false;
        }
        // At twice the Stribeck velocity little is left of stiction.
        let stribeck = self.axis.carriage.bristle.stribeck_velocity_m_per_s;
        let sliding = self.gains.slip_m_per_s.max(stribeck + stribeck);
        if way * state.observer.carriage.velocity_m_per_s > sliding {
            feedforward.has_broken_away = true;
        }
        let passes_m = errors.position_m + self.gains.lead_s * ahead.velocity_m_per_s;
        !feedforward.has_broken_away && way * passes_m > R::ZERO
    }

    /// The friction level to feed forward, the same at any speed of the bristle.
    /// Stiction counts only while both reference and load are slow, at twice the
    /// speed: a load that still slides when the force of stiction is fed forward
    /// runs away. One that the reference has left behind needs it to come along: there
    /// its own speed counts alone, and what is more than the friction of sliding is no more
    /// than throws it to the reference's speed until the force loop has taken it back.
    fn fed_forward_levels(
        &self,
        state: &ControllerState<R>,
        ahead: &Ahead<R>,
        speed_m_per_s: R,
        is_left_behind: bool,
    ) -> FrictionLevels<R> {
        let mut levels = state
            .observer
            .friction_at(&self.axis, ahead.velocity_m_per_s);
        if ahead.is_still {
            levels.static_n += self.gains.breakaway_margin * levels.coulomb_n;
        }
        let bristle = &self.axis.carriage.bristle;
        let faster = ahead.velocity_m_per_s.abs().max(speed_m_per_s);
        let mut sliding_n = levels.sliding_n(bristle, faster + faster);
        if is_left_behind {
            let counted_m_per_s = R::from_f64(LEFT_BEHIND_SHARE) * speed_m_per_s;
            let more_n = levels.sliding_n(bristle, counted_m_per_s) - sliding_n;
            let until_taken_back_s = self.gains.lead_s + R::ONE / self.gains.force_per_s;
            let most_n =
                self.axis.carriage.mass_kg * ahead.velocity_m_per_s.abs() / until_taken_back_s;
            sliding_n += more_n.clamp(R::ZERO, most_n);
        }
        FrictionLevels {
            coulomb_n: sliding_n,
            static_n: sliding_n,
            ..levels
        }
    }

    fn tracking_command_v(
        &self,
        state: &mut ControllerState<R>,
        ahead: &Ahead<R>,
        errors: &Errors<R>,
        force_n: R,
    ) -> R {
        let (gains, dt_s) = (&self.gains, self.axis.dt_s);
        let feedforward_n = self.feedforward_n(state, ahead, errors);
        let feedforward_rate = (feedforward_n - state.feedforward.force_n) / dt_s;
        state.feedforward.force_n = feedforward_n;
        let due_n = self
            .due
            .step(&mut state.feedforward.line, feedforward_n, dt_s);
        let bandwidth = gains.position_per_s;
        let two = R::from_f64(2.0);
        let feedback = bandwidth
            * (bandwidth * errors.position_m + two * gains.damping * errors.velocity_m_per_s);
        let wanted_n = due_n + self.axis.carriage.mass_kg * feedback - state.observer.disturbance_n;
        let rates = self.rates(state, state.observer.carriage.velocity_m_per_s);
        let on_the_way_n = self.on_the_way_n(state, &rates, feedforward_rate);
        rates.command_v(
            &self.axis,
            feedforward_rate + gains.force_per_s * (wanted_n - force_n - on_the_way_n),
        )
    }

    /// The force that is still to come while the spool goes as fast as it can to where the
    /// feedforward wants it, N.
    #[inline]
    fn on_the_way_n(&self, state: &ControllerState<R>, rates: &ForceRates<R>, rate: R) -> R {
        let Some(slew) = self.axis.command_path.slew() else {
            return R::ZERO;
        };
        let observer = &state.observer;
        let slewed_v = observer.command.slewed_v();
        // With the valve's edges where the rig has them.
        let from_v = observer.edges.undone(slewed_v, self.null_v());
        rates.on_the_way_n(&self.axis, &slew, from_v, rate)
    }

    fn rest_command_v(&self, state: &ControllerState<R>) -> R {
        self.rates(state, R::ZERO)
            .rest_command_v(&self.axis, state.rest.wanted_n_per_s())
    }

    fn rates(&self, state: &ControllerState<R>, velocity_m_per_s: R) -> ForceRates<R> {
        let observer = &state.observer;
        ForceRates::at(
            &self.axis,
            &observer.pneumatics,
            observer.supply_pressure_pa,
            observer.carriage.position_m.value,
            velocity_m_per_s,
        )
    }
}
