//! What happens to an axis in service.

use super::World;

/// Something that changes at a time and stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When, s from the beginning.
    pub at_s: f64,
    /// What.
    pub change: Change,
}

/// What changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// The moving mass from now on, kg.
    Mass(f64),
    /// The supply pressure from now on, Pa absolute.
    SupplyPressure(f64),
    /// A force along +x from now on, besides the rig's, N.
    Push(f64),
}

impl Event {
    /// Changes the world in the step to `end_s` that contains the event.
    pub(super) fn apply(&self, world: &mut World, end_s: f64) {
        let begin_s = end_s - world.axis.dt_s;
        if !(begin_s <= self.at_s && self.at_s < end_s) {
            return;
        }
        self.change.apply(world);
    }
}

impl Change {
    /// Changes the world.
    pub(super) fn apply(&self, world: &mut World) {
        match *self {
            Self::Mass(mass_kg) => world.axis.carriage.mass_kg = mass_kg,
            Self::SupplyPressure(pressure_pa) => world.supply_pressure_pa = pressure_pa,
            // The carriage's own load counts against +x.
            Self::Push(force_n) => world.axis.carriage.external_force_n -= force_n,
        }
    }
}
