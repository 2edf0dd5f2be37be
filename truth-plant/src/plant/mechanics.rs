//! The carriage, what it pulls and what it runs against, advanced with the
//! implicit midpoint rule under constant gas pressures.

use super::friction::{Friction, Memory, Relaxation, Surroundings};

/// A load on the carriage that is not rigidly a part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Its mass, a part of the whole moving mass.
    pub mass_kg: f64,
    /// Stiffness of the coupling.
    pub stiffness_n_per_m: f64,
    /// Damping of the coupling.
    pub damping_n_s_per_m: f64,
    /// Full play of the coupling.
    pub gap_m: f64,
    /// Coulomb friction of the load's own guide.
    pub guide_n: f64,
}

/// Speed over which the friction of the load's guide changes its sign.
const GUIDE_M_PER_S: f64 = 2e-3;

impl Load {
    /// Force of the carriage on the load; the damper only acts in contact.
    fn coupling_n(&self, stretch_m: f64, speed_m_per_s: f64) -> f64 {
        let half_m = 0.5 * self.gap_m;
        let pressed_m = stretch_m - stretch_m.clamp(-half_m, half_m);
        if pressed_m == 0.0 && self.gap_m > 0.0 {
            return 0.0;
        }
        let force_n = self.stiffness_n_per_m * pressed_m + self.damping_n_s_per_m * speed_m_per_s;
        // With play nothing pulls: the faces part instead.
        if self.gap_m > 0.0 && force_n * pressed_m < 0.0 {
            0.0
        } else {
            force_n
        }
    }
}

/// A cable that is dragged along: stiff at first, then with a constant force
/// (Dahl 1968).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cable {
    /// Force after a long way.
    pub force_n: f64,
    /// Way over which it builds up.
    pub path_m: f64,
}

/// A spring that stiffens: a hose that is bent, a chain of cables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Stiffness at its rest.
    pub n_per_m: f64,
    /// Stiffness that grows with the square of the way.
    pub n_per_m3: f64,
    /// Where it pushes nothing.
    pub rest_m: f64,
}

/// A force that repeats along the way: teeth, a magnetic band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cogging {
    /// Amplitude.
    pub force_n: f64,
    /// Way after which it repeats.
    pub pitch_m: f64,
    /// Its phase at position 0, rad.
    pub phase_rad: f64,
}

/// A force that varies with time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    /// Amplitude.
    pub force_n: f64,
    /// Frequency.
    pub frequency_hz: f64,
}

/// Everything about the motion that does not change with time.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanics {
    /// All that moves, a load included.
    pub mass_kg: f64,
    /// Friction of the carriage.
    pub friction: Friction,
    /// Constant force against `+x`.
    pub constant_n: f64,
    /// The load, if it is not rigidly coupled.
    pub load: Option<Load>,
    /// A dragged cable.
    pub cable: Option<Cable>,
    /// A spring that stiffens.
    pub spring: Option<Spring>,
    /// A force that repeats along the way.
    pub cogging: Option<Cogging>,
    /// A force that grows with the time since the recording began, N/s.
    pub drift_n_per_s: f64,
    /// A force that varies with time.
    pub disturbance: Option<Disturbance>,
    /// Half the stroke: beyond it the piston meets its stop.
    pub half_stroke_m: f64,
}

/// Stiffness and damping of a stop: rubber on aluminium, stops 2 kg at 1 m/s in
/// about 2 mm. Recordings keep away from it.
const STOP_N_PER_M: f64 = 1e6;
const STOP_N_S_PER_M: f64 = 1e3;

/// Where everything that moves is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionState {
    /// Position of the carriage.
    pub position_m: f64,
    /// Its speed.
    pub speed_m_per_s: f64,
    /// Position of the load.
    pub load_m: f64,
    /// Its speed.
    pub load_m_per_s: f64,
    /// Force of the cable.
    pub cable_n: f64,
    /// What the rail's contact remembers.
    pub contact: Memory,
}

/// The gas as the piston feels it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Force on the piston.
    pub force_n: f64,
    /// Mean gauge pressure of the chambers.
    pub mean_gauge_pa: f64,
    /// Pressure difference of the chambers.
    pub difference_pa: f64,
}

/// Corrections of the mean speed; each divides its error by more than 50 at
/// the default step.
const CORRECTIONS: usize = 4;

impl Mechanics {
    /// Everything at rest at a position.
    pub fn at_rest(&self, position_m: f64) -> MotionState {
        MotionState {
            position_m,
            load_m: position_m,
            ..MotionState::default()
        }
    }

    /// One step.
    pub fn advance(&self, state: &MotionState, push: &Push, time_s: f64, dt_s: f64) -> MotionState {
        let surroundings = Surroundings {
            position_m: state.position_m + 0.5 * dt_s * state.speed_m_per_s,
            mean_gauge_pa: push.mean_gauge_pa,
            difference_pa: push.difference_pa,
        };
        let slip = self.friction.slip(&surroundings, &state.contact);
        let middle_s = time_s + 0.5 * dt_s;
        let outside_n = push.force_n
            - self.constant_n
            - self.drift_n_per_s * middle_s
            - self.disturbance_n(middle_s);
        let carriage_kg = self.mass_kg - self.load.map_or(0.0, |load| load.mass_kg);
        let mut next = *state;
        let mut mean_m_per_s = state.speed_m_per_s;
        let mut load_mean_m_per_s = state.load_m_per_s;
        for _ in 0..CORRECTIONS {
            let (friction_n, contact) =
                self.friction
                    .advance(&slip, &state.contact, mean_m_per_s, dt_s);
            let middle_m = state.position_m + 0.5 * dt_s * mean_m_per_s;
            let cable = self.drag(state.cable_n, mean_m_per_s * dt_s);
            let mut force_n = outside_n
                - friction_n
                - cable.mean
                - self.of_place_n(middle_m)
                - self.stop_n(middle_m, mean_m_per_s);
            if let Some(load) = &self.load {
                let load_middle_m = state.load_m + 0.5 * dt_s * load_mean_m_per_s;
                let coupling_n =
                    load.coupling_n(middle_m - load_middle_m, mean_m_per_s - load_mean_m_per_s);
                force_n -= coupling_n;
                let guide_n = load.guide_n * libm::tanh(load_mean_m_per_s / GUIDE_M_PER_S);
                next.load_m_per_s =
                    state.load_m_per_s + dt_s * (coupling_n - guide_n) / load.mass_kg;
                load_mean_m_per_s = 0.5 * (state.load_m_per_s + next.load_m_per_s);
            }
            next.speed_m_per_s = state.speed_m_per_s + dt_s * force_n / carriage_kg;
            mean_m_per_s = 0.5 * (state.speed_m_per_s + next.speed_m_per_s);
            next.contact = contact;
            next.cable_n = cable.end;
        }
        next.position_m = state.position_m + dt_s * mean_m_per_s;
        next.load_m = state.load_m + dt_s * load_mean_m_per_s;
        next
    }

    /// Force against `+x` of a stop that the piston presses.
    fn stop_n(&self, position_m: f64, speed_m_per_s: f64) -> f64 {
        let beyond_m = position_m - position_m.clamp(-self.half_stroke_m, self.half_stroke_m);
        if beyond_m == 0.0 {
            return 0.0;
        }
        let force_n = STOP_N_PER_M * beyond_m + STOP_N_S_PER_M * speed_m_per_s;
        if force_n * beyond_m > 0.0 {
            force_n
        } else {
            0.0
        }
    }

    /// Force against `+x` of the place alone.
    fn of_place_n(&self, position_m: f64) -> f64 {
        let spring_n = self.spring.map_or(0.0, |spring| {
            let way_m = position_m - spring.rest_m;
            (spring.n_per_m + spring.n_per_m3 * way_m * way_m) * way_m
        });
        let cogging_n = self.cogging.map_or(0.0, |cogging| {
            let turns = position_m / cogging.pitch_m;
            cogging.force_n * libm::sin(2.0 * core::f64::consts::PI * turns + cogging.phase_rad)
        });
        spring_n + cogging_n
    }

    fn drag(&self, now_n: f64, travel_m: f64) -> Relaxation {
        let Some(cable) = &self.cable else {
            return Relaxation::of(0.0, 0.0, 0.0);
        };
        let ways = travel_m / cable.path_m;
        Relaxation::of(now_n, cable.force_n * ways, ways.abs())
    }

    fn disturbance_n(&self, time_s: f64) -> f64 {
        self.disturbance.map_or(0.0, |disturbance| {
            let phase = 2.0 * core::f64::consts::PI * disturbance.frequency_hz * time_s;
            disturbance.force_n * libm::sin(phase)
        })
    }
}
