//! Friction between carriage and rail: three laws of presliding over one law
//! of slip.
//!
//! A law is advanced over a step at a constant mean speed; the force that it
//! returns is the mean over the step. So the impulse of the damping of a
//! bristle is exact, however short its spike after a reversal.

use serde::{Deserialize, Serialize};

/// How presliding is modelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Presliding {
    /// One bristle that slips at every speed (Canudas de Wit et al. 1995).
    #[default]
    LuGre,
    /// One bristle that only bends until 0.7 of its slip (Dupont et al. 2002).
    ElastoPlastic,
    /// Parallel elements that stick or slip each (Al-Bender et al. 2005,
    /// without the lag of slip).
    MaxwellSlip,
}

/// A repeating change of the friction along the stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Amplitude relative to the friction.
    pub amplitude: f64,
    /// Length of a period.
    pub period_m: f64,
    /// Phase at mid-stroke.
    pub phase_rad: f64,
    /// A triangle in place of a sine.
    pub triangular: bool,
}

impl Wave {
    fn factor(&self, position_m: f64) -> f64 {
        let phase = 2.0 * core::f64::consts::PI * position_m / self.period_m + self.phase_rad;
        let sine = libm::sin(phase);
        let value = if self.triangular {
            2.0 / core::f64::consts::PI * libm::asin(sine)
        } else {
            sine
        };
        1.0 + self.amplitude * value
    }
}

/// A stretch of the stroke with another friction, beside borders that rise evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zone {
    /// Friction within over friction outside, less one.
    pub more: f64,
    /// Where it begins.
    pub from_m: f64,
    /// Where it ends.
    pub to_m: f64,
    /// Length of a border, outside of both.
    pub border_m: f64,
}

impl Zone {
    fn factor(&self, position_m: f64) -> f64 {
        let outside_m = (self.from_m - position_m)
            .max(position_m - self.to_m)
            .max(0.0);
        1.0 + self.more * (1.0 - outside_m / self.border_m).max(0.0)
    }
}

/// Break-away force that grows while the contact rests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dwell {
    /// Growth after a long rest; with `logarithmic`, after ten time constants.
    pub growth_n: f64,
    /// Time constant.
    pub time_constant_s: f64,
    /// Growth with the logarithm of the time, in place of an exponential.
    pub logarithmic: bool,
}

/// Path over which a contact forgets its rest.
const FORGETTING_M: f64 = 0.2e-3;

impl Dwell {
    fn added_n(&self, rested_s: f64) -> f64 {
        let rests = rested_s / self.time_constant_s;
        if self.logarithmic {
            self.growth_n * libm::log1p(rests) / libm::log1p(10.0)
        } else {
            -self.growth_n * libm::expm1(-rests)
        }
    }
}

/// The friction of a carriage.
#[derive(Clone, Debug, PartialEq)]
pub struct Friction {
    /// Law of presliding.
    pub presliding: Presliding,
    /// Stiffness of the contact in presliding.
    pub stiffness_n_per_m: f64,
    /// Damping of presliding.
    pub damping_n_s_per_m: f64,
    /// Viscous friction.
    pub viscous_n_s_per_m: f64,
    /// Friction with the square of the speed.
    pub quadratic_n_s2_per_m2: f64,
    /// Coulomb friction without pressure.
    pub coulomb_n: f64,
    /// Break-away force without pressure.
    pub static_n: f64,
    /// Speed at which the Stribeck curve falls.
    pub stribeck_m_per_s: f64,
    /// Growth per gauge pressure in the mean of the chambers.
    pub per_mean_pressure_n_per_pa: f64,
    /// Growth per pressure difference.
    pub per_difference_n_per_pa: f64,
    /// Exponent of the growth with the mean pressure, the growth at
    /// [`SERVO_GAUGE_PA`] unchanged.
    pub mean_pressure_exponent: f64,
    /// Friction in direction `+x` over that without direction, less one; in
    /// direction `-x` the opposite.
    pub asymmetry: f64,
    /// Change along the stroke.
    pub wave: Option<Wave>,
    /// A stretch with another level.
    pub zone: Option<Zone>,
    /// Growth at rest.
    pub dwell: Option<Dwell>,
}

/// Mean gauge pressure of a servo axis at work.
pub const SERVO_GAUGE_PA: f64 = 350e3;

/// Elements of the Maxwell slip law.
pub const ELEMENTS: usize = 6;
/// Shares of slip force and of stiffness: soft elements slip last.
const SLIP_SHARE: [f64; ELEMENTS] = [0.08, 0.12, 0.16, 0.2, 0.22, 0.22];
const STIFFNESS_SHARE: [f64; ELEMENTS] = [0.3, 0.25, 0.18, 0.13, 0.09, 0.05];

/// What the contact remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Memory {
    /// Deflection of the bristle.
    pub bristle_m: f64,
    /// Forces of the Maxwell elements.
    pub element_n: [f64; ELEMENTS],
    /// Time that the contact has rested.
    pub rested_s: f64,
}

/// What friction depends on besides the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Position of the carriage.
    pub position_m: f64,
    /// Mean of the chambers' gauge pressures.
    pub mean_gauge_pa: f64,
    /// Difference of the chambers' pressures.
    pub difference_pa: f64,
}

/// The curve of slip force over speed, at one place, time and pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    coulomb_n: f64,
    static_n: f64,
    stribeck_m_per_s: f64,
    asymmetry: f64,
}

impl Slip {
    /// Slip force at a speed, without viscous parts; positive.
    pub fn force_n(&self, speed_m_per_s: f64) -> f64 {
        let relative = speed_m_per_s / self.stribeck_m_per_s;
        let fall = libm::exp(-relative * relative);
        let side = if speed_m_per_s > 0.0 {
            self.asymmetry
        } else {
            -self.asymmetry
        };
        (self.coulomb_n + (self.static_n - self.coulomb_n) * fall) * (1.0 + side)
    }
}

impl Friction {
    /// The slip curve under these surroundings.
    pub fn slip(&self, surroundings: &Surroundings, memory: &Memory) -> Slip {
        let grown_n = self.pressed_n(surroundings);
        let along = self
            .wave
            .map_or(1.0, |wave| wave.factor(surroundings.position_m));
        let within = self
            .zone
            .map_or(1.0, |zone| zone.factor(surroundings.position_m));
        let factor = (1.0 + grown_n / self.coulomb_n) * along * within;
        let dwelt_n = self
            .dwell
            .map_or(0.0, |dwell| dwell.added_n(memory.rested_s));
        Slip {
            coulomb_n: self.coulomb_n * factor,
            static_n: self.static_n * factor + dwelt_n,
            stribeck_m_per_s: self.stribeck_m_per_s,
            asymmetry: self.asymmetry,
        }
    }

    /// Growth of the Coulomb friction with the pressures.
    fn pressed_n(&self, surroundings: &Surroundings) -> f64 {
        let relative = (surroundings.mean_gauge_pa / SERVO_GAUGE_PA).max(0.0);
        let with_mean_n = if self.per_mean_pressure_n_per_pa > 0.0 {
            let curve = libm::pow(relative, self.mean_pressure_exponent);
            self.per_mean_pressure_n_per_pa * SERVO_GAUGE_PA * curve
        } else {
            0.0
        };
        with_mean_n + self.per_difference_n_per_pa * surroundings.difference_pa.abs()
    }

    /// Advances the contact over a step at a mean speed: the mean force
    /// against `+x`, and what the contact then remembers.
    pub fn advance(
        &self,
        slip: &Slip,
        memory: &Memory,
        speed_m_per_s: f64,
        dt_s: f64,
    ) -> (f64, Memory) {
        let slip_n = slip.force_n(speed_m_per_s);
        let (contact_n, mut next) = match self.presliding {
            Presliding::LuGre => self.bend(slip_n, memory, speed_m_per_s, dt_s),
            Presliding::ElastoPlastic => self.bend_or_slip(slip_n, memory, speed_m_per_s, dt_s),
            Presliding::MaxwellSlip => self.stick_or_slip(slip_n, memory, speed_m_per_s, dt_s),
        };
        next.rested_s = rest(memory.rested_s, speed_m_per_s, dt_s);
        let fluid_n = speed_m_per_s
            * (self.viscous_n_s_per_m + self.quadratic_n_s2_per_m2 * speed_m_per_s.abs());
        (contact_n + fluid_n, next)
    }

    /// `dz/dt = v - stiffness |v| z / slip`, solved exactly.
    fn bend(&self, slip_n: f64, memory: &Memory, speed_m_per_s: f64, dt_s: f64) -> (f64, Memory) {
        let travel_m = speed_m_per_s * dt_s;
        let decay = self.stiffness_n_per_m * travel_m.abs() / slip_n;
        let bristle = Relaxation::of(memory.bristle_m, travel_m, decay);
        let force_n = self.stiffness_n_per_m * bristle.mean
            + self.damping_n_s_per_m * (bristle.end - memory.bristle_m) / dt_s;
        (
            force_n,
            Memory {
                bristle_m: bristle.end,
                ..*memory
            },
        )
    }

    /// The same with the slip weighted by how near the bristle is to its limit.
    fn bend_or_slip(
        &self,
        slip_n: f64,
        memory: &Memory,
        speed_m_per_s: f64,
        dt_s: f64,
    ) -> (f64, Memory) {
        const BREAK_AWAY: f64 = 0.7;
        // Parts short against the bristle's limit, for the weight to follow it.
        const PART: f64 = 0.1;
        const MOST_PARTS: f64 = 32.0;
        let limit_m = slip_n / self.stiffness_n_per_m;
        let travel_m = speed_m_per_s * dt_s;
        let parts = libm::ceil(travel_m.abs() / (PART * limit_m)).clamp(1.0, MOST_PARTS);
        let step_m = travel_m / parts;
        let mut bristle_m = memory.bristle_m;
        let mut sum_m = 0.0;
        for _ in 0..parts as usize {
            let bent = bristle_m * 1.0_f64.copysign(step_m) / limit_m;
            let weight = ((bent - BREAK_AWAY) / (1.0 - BREAK_AWAY)).clamp(0.0, 1.0);
            let smooth = weight * weight * (3.0 - 2.0 * weight);
            let part = Relaxation::of(bristle_m, step_m, smooth * step_m.abs() / limit_m);
            bristle_m = part.end;
            sum_m += part.mean;
        }
        let force_n = self.stiffness_n_per_m * sum_m / parts
            + self.damping_n_s_per_m * (bristle_m - memory.bristle_m) / dt_s;
        (
            force_n,
            Memory {
                bristle_m,
                ..*memory
            },
        )
    }

    /// Each element is a spring that yields at its share of the slip force; the
    /// damping acts with the share of stiffness that sticks.
    fn stick_or_slip(
        &self,
        slip_n: f64,
        memory: &Memory,
        speed_m_per_s: f64,
        dt_s: f64,
    ) -> (f64, Memory) {
        let mut next = *memory;
        let mut force_n = 0.0;
        for element in 0..ELEMENTS {
            let stiffness = STIFFNESS_SHARE[element] * self.stiffness_n_per_m;
            let limit_n = SLIP_SHARE[element] * slip_n;
            let before_n = memory.element_n[element];
            let sprung_n = before_n + stiffness * speed_m_per_s * dt_s;
            let after_n = sprung_n.clamp(-limit_n, limit_n);
            next.element_n[element] = after_n;
            force_n += 0.5 * (before_n + after_n);
            let stuck_m_per_s = (after_n - before_n) / (stiffness * dt_s);
            // A fall of the limit is not a motion against the damper.
            if stuck_m_per_s * speed_m_per_s > 0.0 {
                force_n += STIFFNESS_SHARE[element] * self.damping_n_s_per_m * stuck_m_per_s;
            }
        }
        (force_n, next)
    }
}

/// The time rested grows at rest and is forgotten along the path:
/// `dr/dt = 1 - |v| r / path`, solved exactly.
fn rest(rested_s: f64, speed_m_per_s: f64, dt_s: f64) -> f64 {
    let forgotten = speed_m_per_s.abs() * dt_s / FORGETTING_M;
    Relaxation::of(rested_s, dt_s, forgotten).end
}

/// The solution of `dy = (gain - decay y) ds` over `s` from 0 to 1.
pub(crate) struct Relaxation {
    /// Value at the end.
    pub(crate) end: f64,
    /// Mean value.
    pub(crate) mean: f64,
}

impl Relaxation {
    pub(crate) fn of(start: f64, gain: f64, decay: f64) -> Self {
        let slope = gain - decay * start;
        let (end_share, mean_share) = if decay > 1e-5 {
            let end_share = -libm::expm1(-decay) / decay;
            (end_share, (1.0 - end_share) / decay)
        } else {
            (1.0 - 0.5 * decay, 0.5 - decay / 6.0)
        };
        Self {
            end: start + slope * end_share,
            mean: start + slope * mean_share,
        }
    }
}
