//! The full energy balance in the place of a reduced model.
//!
//! ```text
//! T    = T_reduced + memory (T_balance - T_reduced)
//! p' V = gamma (R T m' - p V') + (gamma - 1) Q,   Q = (h A + C) (Tw - T)
//! ```
//!
//! A reduced model (the paper's (6)) gives the gas the temperature that belongs to its pressure; the
//! balance of energy, (3) and (5), remembers how it got there. With memory 1 the reduced model is
//! the balance; of a closed chamber with an index n, n goes to gamma. C is a conductance to the wall beside that of the declared h. It matters wherever a
//! chamber is filled or emptied within less than a second and then held: the pressure goes on by some per cent.
//! Confused with dead volumes, heat transfer and leaks; a fill burst at fixed piston, then the valve shut and
//! the pressure watched for some seconds, separates them.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Kind, Numbers, PLAIN, parameter};
use crate::effects::scene::Scene;
use crate::law::Law;
use crate::rig::ChamberModel;
use crate::side::Side;
use model_core::real::Real;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "gas-temperature-dynamics",
    what: "The energy balance in place of a reduced model, and extra conductance to the wall.",
    parameters: &[
        parameter("memory_a", "1", 0.0, 0.0, "0 the reduced model, 1 the energy balance of chamber A", "0 or 1").said("memory A", ""),
        parameter("memory_b", "1", 0.0, 0.0, "0 the reduced model, 1 the energy balance of chamber B", "0 or 1").said("memory B", ""),
        parameter("conductance_a_W_K", "W/K", 0.0, 0.0, "heat conductance of chamber A to the wall", "0.2 to 2").said("wall conductance of chamber A", "W/K"),
        parameter("conductance_b_W_K", "W/K", 0.0, 0.0, "heat conductance of chamber B to the wall", "0.2 to 2").said("wall conductance of chamber B", "W/K"),
    ],
    meaning: "the gas temperature follows an energy balance with heat exchange to the wall",
    shown_by: "a fill burst at fixed piston and a dwell of 10 s with the valve at its null",
    kind: Kind::BuiltIn,
    candidates,
    ..PLAIN
};

fn memory_key(side: Side) -> String {
    format!("memory_{}", side.letter())
}

fn conductance_key(side: Side) -> String {
    format!("conductance_{}_W_K", side.letter())
}

/// 1 where the energy balance of a chamber holds in the place of a reduced model.
pub fn memory<R: Real>(numbers: &impl Numbers<R>, side: Side) -> R {
    EFFECT.number(numbers, &memory_key(side))
}

/// Additional conductance from a chamber's gas to the wall, W/K.
pub fn conductance_w_k<R: Real>(numbers: &impl Numbers<R>, side: Side) -> R {
    EFFECT.number(numbers, &conductance_key(side))
}

/// Where the rig declares no heat transfer, the conductance to the wall is free, started from time
/// constants of 20, 5 and 1.5 s.
fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    let chambers = scene.rig.chambers.as_ref();
    let Some(chambers) = chambers.filter(|chambers| {
        let is_reduced = chambers.model != ChamberModel::EnergyBalance;
        scene.law == Law::Chambers && is_reduced && scene.rig.vessel.is_none()
    }) else {
        return Vec::new();
    };
    let mut balance = Candidate::new(EFFECT.name, &scene.chambers());
    for &side in &scene.sides {
        balance = balance.switch(&memory_key(side), 1.0);
        if chambers.heat_transfer_charging_w_m2k.is_none() {
            let Some(gas) = scene.gas(side) else {
                return Vec::new();
            };
            let starts = [20.0, 5.0, 1.5].map(|time_constant_s| gas.capacity_j_k / time_constant_s);
            let bounds = (0.0, 1e3 * starts[1]);
            balance = balance.free(&conductance_key(side), bounds, &starts);
        }
    }
    vec![balance]
}
