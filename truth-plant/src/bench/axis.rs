//! The axis that all benches of a seed share: the nameplate of the cases and
//! what only a bench sees.

use crate::case::nameplate::{AMBIENT, Nameplate};
use crate::plant::friction::Friction;
use crate::plant::gas::{FlowShape, Node};
use crate::plant::network::Network;
use crate::plant::valve::{Paths, Play, Spool};
use crate::random::{Purpose, Random};

/// Longest step of the spool: the fastest has a period of 7.7 ms.
pub(super) const STEP_S: f64 = 25e-6;

/// The axis on its bench.
pub(super) struct Axis {
    pub(super) nameplate: Nameplate,
    /// Growth of the friction with the mean gauge pressure.
    pub(super) friction_n_per_pa: f64,
    pub(super) bristle_stiffness_n_per_m: f64,
    pub(super) bristle_damping_n_s_per_m: f64,
    /// Area of a leak past the piston; half of the pistons have none.
    pub(super) piston_leak_m2: f64,
    pub(super) spool: Spool,
    pub(super) play: Play,
    pub(super) delay_s: f64,
    pub(super) spool_m_per_v: f64,
}

/// A delay as the bench steps it: up to the next step. It stands a hair before its step, so that
/// rounding does not make it the one after.
fn on_grid(delay_s: f64) -> f64 {
    const HAIR_S: f64 = 1e-9;
    (libm::round(delay_s / STEP_S) * STEP_S - HAIR_S).max(0.0)
}

impl Axis {
    pub(super) fn draw(seed: u64) -> Self {
        let nameplate = Nameplate::draw(&mut Random::new(seed, Purpose::Plant));
        let random = &mut Random::new(seed, Purpose::Bench(0));
        let friction_n_per_pa = random.between(2e-5, 6e-5);
        let leak_m2 = random.between(0.0, 5e-10);
        Self {
            nameplate,
            friction_n_per_pa,
            bristle_stiffness_n_per_m: random.between(4e5, 12e5),
            bristle_damping_n_s_per_m: random.between(600.0, 1600.0),
            piston_leak_m2: if random.chance(0.5) { leak_m2 } else { 0.0 },
            spool: Spool {
                frequency_hz: random.between(70.0, 130.0),
                damping: random.between(0.6, 0.9),
                fastest_v_per_s: random.between(800.0, 2500.0),
            },
            play: Play {
                width_v: random.between(0.01, 0.05),
                weight: 1.0,
            },
            delay_s: on_grid(random.between(0.0, 1e-3)),
            spool_m_per_v: random.between(0.35e-3, 0.45e-3),
        }
    }

    /// The gas of the axis: no tubes, no tank, no silencer.
    pub(super) fn network(&self) -> Network {
        self.nameplate.physics(1.0).network
    }

    /// The flow law of all paths.
    pub(super) fn flow(&self) -> FlowShape {
        self.network().flow
    }

    /// The supply, with air at ambient temperature.
    pub(super) fn supply(&self) -> Node {
        Node {
            pressure_pa: self.nameplate.supply_pa,
            ..AMBIENT
        }
    }

    /// Area of the path from the supply to a port; openings count from the null.
    pub(super) fn supply_m2(&self, opening_v: f64) -> f64 {
        self.nameplate.curve.area_m2(opening_v)
    }

    /// Area of the path from a port to the exhaust.
    pub(super) fn exhaust_m2(&self, opening_v: f64) -> f64 {
        self.nameplate.asymmetry * self.nameplate.curve.area_m2(opening_v)
    }

    /// Areas at openings, under the keys of the truth.
    pub(super) fn named_areas(&self, openings_v: &[f64]) -> Vec<(String, f64)> {
        let named = |opening_v: &f64| {
            [
                (
                    format!("supply_area_m2@{opening_v:.1}"),
                    self.supply_m2(*opening_v),
                ),
                (
                    format!("exhaust_area_m2@{opening_v:.1}"),
                    self.exhaust_m2(*opening_v),
                ),
            ]
        };
        openings_v.iter().flat_map(named).collect()
    }

    /// The paths of port A at a command; port B is plugged.
    pub(super) fn paths(&self, command_v: f64) -> Paths {
        let opening_v = command_v - self.nameplate.null_v;
        Paths {
            supply_m2: [self.supply_m2(opening_v), 0.0],
            exhaust_m2: [self.exhaust_m2(-opening_v), 0.0],
        }
    }

    /// The friction with both chambers at a gauge pressure. Coulomb and static
    /// level grow by the same force, where the plant's own law lets them grow
    /// by the same factor.
    pub(super) fn friction(&self, gauge_pa: f64) -> Friction {
        let grown_n = self.friction_n_per_pa * gauge_pa;
        let friction = self.nameplate.physics(1.0).mechanics.friction;
        Friction {
            stiffness_n_per_m: self.bristle_stiffness_n_per_m,
            damping_n_s_per_m: self.bristle_damping_n_s_per_m,
            coulomb_n: friction.coulomb_n + grown_n,
            static_n: friction.static_n + grown_n,
            ..friction
        }
    }
}
