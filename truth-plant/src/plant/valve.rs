//! The valve's areas over its opening, and the way from command to opening.

use std::collections::VecDeque;

/// Openings between which the areas are linear, in volts of command from the
/// null. A rig file declares its tables at these openings.
pub const OPENINGS_V: [f64; 19] = [
    0.0, 0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 3.6, 4.3, 5.0,
];

/// The shape of the valve's areas: `leak + largest tanh(((opening - overlap) /
/// span)^shape)` at [`OPENINGS_V`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaCurve {
    /// Opening that only covers the overlap.
    pub overlap_v: f64,
    /// Area that the path would reach far open.
    pub largest_m2: f64,
    /// Area that stays when the path is shut.
    pub leak_m2: f64,
    /// Exponent of the opening curve.
    pub shape: f64,
    /// Opening beyond the overlap at which the curve bends.
    pub span_v: f64,
}

impl AreaCurve {
    /// The area at an opening.
    pub fn area_m2(&self, opening_v: f64) -> f64 {
        let free_v = opening_v - self.overlap_v;
        if free_v <= 0.0 {
            return self.leak_m2;
        }
        let open = libm::tanh(libm::pow(free_v / self.span_v, self.shape));
        self.leak_m2 + self.largest_m2 * open
    }

    /// The areas at [`OPENINGS_V`].
    pub fn table_m2(&self) -> [f64; OPENINGS_V.len()] {
        OPENINGS_V.map(|opening_v| self.area_m2(opening_v))
    }
}

/// The areas of the four paths, linear between points.
#[derive(Clone, Debug, PartialEq)]
pub struct Areas {
    /// Command at which the spool is centred.
    pub null_v: f64,
    /// Openings of the points, rising from nought.
    pub openings_v: Vec<f64>,
    /// Areas of a supply path at these.
    pub supply_m2: Vec<f64>,
    /// Exhaust area over supply area.
    pub asymmetry: f64,
    /// How much later than the supply path the exhaust path opens.
    pub exhaust_late_v: f64,
}

/// What the four paths let through now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Paths {
    /// From the supply to ports a and b.
    pub supply_m2: [f64; 2],
    /// From ports a and b to the exhaust.
    pub exhaust_m2: [f64; 2],
}

impl Areas {
    /// Area of a supply path at an opening: shut and wide open it stays as at
    /// the table's ends.
    pub fn at_m2(&self, opening_v: f64) -> f64 {
        let openings_v = &self.openings_v;
        let above = openings_v.partition_point(|point_v| *point_v <= opening_v);
        let Some(below) = above.checked_sub(1) else {
            return self.supply_m2[0];
        };
        if above == openings_v.len() {
            return self.supply_m2[below];
        }
        let share = (opening_v - openings_v[below]) / (openings_v[above] - openings_v[below]);
        self.supply_m2[below] + share * (self.supply_m2[above] - self.supply_m2[below])
    }

    /// The four paths of a spool at a position, in volts of command.
    pub fn paths(&self, spool_v: f64) -> Paths {
        let opening_v = spool_v - self.null_v;
        let forwards = self.at_m2(opening_v);
        let backwards = self.at_m2(-opening_v);
        Paths {
            supply_m2: [forwards, backwards],
            exhaust_m2: [-opening_v, opening_v]
                .map(|opening_v| self.at_m2(opening_v - self.exhaust_late_v) * self.asymmetry),
        }
    }
}

/// A play: its output stands still until the input has crossed the width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Play {
    /// Full width.
    pub width_v: f64,
    /// Share of the output.
    pub weight: f64,
}

/// Most plays that make up one hysteresis.
pub const PLAYS: usize = 4;

/// A spool on a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spool {
    /// Undamped frequency.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping: f64,
    /// Largest speed, in volts of command.
    pub fastest_v_per_s: f64,
}

/// The laws between the command and the spool's position; all off by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CommandPath {
    /// Pure delay.
    pub delay_s: f64,
    /// Largest rise and fall of the driven command; `None` for no limit.
    pub slew_v_per_s: Option<[f64; 2]>,
    /// A hysteresis as a sum of plays (Prandtl and Ishlinskii); weights sum to 1.
    pub plays: Vec<Play>,
    /// The spool's own motion.
    pub spool: Option<Spool>,
    /// Lag of the first order in place of a spool on a spring.
    pub lag_s: f64,
    /// Drift of the null with time.
    pub drift_v_per_s: f64,
}

/// Where the command path stands.
#[derive(Clone, Debug, Default)]
pub struct CommandState {
    /// Commands of the last ticks, the newest first.
    history_v: VecDeque<f64>,
    driven_v: f64,
    play_v: [f64; PLAYS],
    spool_v: f64,
    spool_v_per_s: f64,
}

/// Ticks of commands kept: more than the longest delay.
const HISTORY: usize = 32;

impl CommandState {
    pub(crate) fn at_rest(command_v: f64) -> Self {
        Self {
            history_v: VecDeque::from(vec![command_v; HISTORY]),
            driven_v: command_v,
            play_v: [command_v; PLAYS],
            spool_v: command_v,
            spool_v_per_s: 0.0,
        }
    }

    /// A new command holds from now on.
    pub(crate) fn accept(&mut self, command_v: f64) {
        self.history_v.pop_back();
        self.history_v.push_front(command_v);
    }

    /// Position of the spool, in volts of command.
    pub(crate) fn spool_v(&self) -> f64 {
        self.spool_v
    }

    /// Advances by a step at `since_tick_s` after the last command.
    pub(crate) fn advance(
        &mut self,
        path: &CommandPath,
        since_tick_s: f64,
        tick_s: f64,
        dt_s: f64,
    ) {
        let late_s = path.delay_s - since_tick_s;
        let ticks_ago = libm::ceil(late_s / tick_s).max(0.0) as usize;
        let delayed_v = self.history_v[ticks_ago.min(HISTORY - 1)];
        self.drive(path, delayed_v, dt_s);
        let magnet_v = self.play(path);
        self.move_spool(path, magnet_v, dt_s);
    }

    fn drive(&mut self, path: &CommandPath, delayed_v: f64, dt_s: f64) {
        self.driven_v = match path.slew_v_per_s {
            Some([rise, fall]) => {
                delayed_v.clamp(self.driven_v - fall * dt_s, self.driven_v + rise * dt_s)
            }
            None => delayed_v,
        };
    }

    fn play(&mut self, path: &CommandPath) -> f64 {
        let input_v = self.driven_v;
        if path.plays.is_empty() {
            self.play_v = [input_v; PLAYS];
            return input_v;
        }
        let mut output_v = 0.0;
        for (play, held_v) in path.plays.iter().zip(&mut self.play_v) {
            let half_v = 0.5 * play.width_v;
            *held_v = held_v.clamp(input_v - half_v, input_v + half_v);
            output_v += play.weight * *held_v;
        }
        output_v
    }

    /// The midpoint rule on `x'' = w^2 (u - x) - 2 z w x'`.
    fn move_spool(&mut self, path: &CommandPath, input_v: f64, dt_s: f64) {
        let Some(spool) = path.spool else {
            let before_v = self.spool_v;
            self.spool_v = if path.lag_s > 0.0 {
                input_v + (before_v - input_v) * libm::exp(-dt_s / path.lag_s)
            } else {
                input_v
            };
            self.spool_v_per_s = 0.0;
            return;
        };
        let omega = 2.0 * core::f64::consts::PI * spool.frequency_hz;
        let acceleration =
            |x: f64, v: f64| omega * omega * (input_v - x) - 2.0 * spool.damping * omega * v;
        let half_s = 0.5 * dt_s;
        let middle_x = self.spool_v + half_s * self.spool_v_per_s;
        let middle_v = self.spool_v_per_s + half_s * acceleration(self.spool_v, self.spool_v_per_s);
        let limit = spool.fastest_v_per_s;
        self.spool_v += dt_s * middle_v.clamp(-limit, limit);
        self.spool_v_per_s =
            (self.spool_v_per_s + dt_s * acceleration(middle_x, middle_v)).clamp(-limit, limit);
    }
}
