//! What the declarations read of a rig and its recordings before anything is fitted.

use super::mark::Mark;
use crate::law::Law;
use crate::rig::Rig;
use crate::side::Side;

/// Part of the Coulomb level that an integrator holds: 0.4 N of 20 N, 0.8 kPa on the piston.
pub const FRICTION_SHARE: f64 = 0.02;

/// A law, a rig, and figures of the recordings that starts and boxes of parameters are taken from.
#[derive(Clone, Debug)]
pub struct Scene<'a> {
    /// The law that is missing something.
    pub law: Law,
    /// The rig.
    pub rig: &'a Rig,
    /// Sides whose pressure is recorded.
    pub sides: Vec<Side>,
    /// Median time from row to row, s.
    pub row_s: f64,
    /// A force that the law misses, N; 1 where its misfit is no force.
    pub misfit_n: f64,
    /// The gas of chamber A in mid-recording, where the rig says enough of it.
    pub gas_a: Option<ChamberGas>,
    /// The gas of chamber B.
    pub gas_b: Option<ChamberGas>,
    /// When a vessel's pressure first leaves its starting level for good, s.
    pub decay_begins_s: Option<f64>,
    /// When the longest recording ends, s.
    pub end_s: f64,
    /// The highest speed of the recorded position or stem, per s.
    pub fastest_per_s: f64,
    /// A typical speed of the motion, m/s.
    pub typical_speed_m_s: f64,
    /// How near the carriage comes to an end of its stroke, m.
    pub nearest_end_m: Option<f64>,
    /// The highest recorded pressure of chamber A, Pa, at least one bar.
    pub highest_pressure_pa: f64,
}

/// The gas in a chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChamberGas {
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Mass times heat capacity at constant volume, J/K.
    pub capacity_j_k: f64,
    /// Its pressure, Pa.
    pub pressure_pa: f64,
    /// Choked flow out of it per area, kg/(s m2): m' = A Cd C1 p / sqrt(T), Cd about 0.82.
    pub choked_kg_s_m2: f64,
}

impl Scene<'_> {
    /// The places of the chambers whose pressure is recorded.
    pub fn chambers(&self) -> Vec<&'static str> {
        self.sides.iter().map(|side| side.place()).collect()
    }

    /// The gas of a side.
    pub fn gas(&self, side: Side) -> Option<&ChamberGas> {
        match side {
            Side::A => self.gas_a.as_ref(),
            Side::B => self.gas_b.as_ref(),
        }
    }

    /// Whether the law is of gas behind a valve.
    pub fn is_behind_valve(&self) -> bool {
        self.law == Law::Chambers && self.rig.valve.is_some()
    }

    /// Whether the law is of something that a valve's spool moves, or of the spool.
    pub fn follows_spool(&self) -> bool {
        self.is_behind_valve() || matches!(self.law, Law::ValveFlow | Law::Spool)
    }

    /// Whether the law is of a carriage or of a bench with friction.
    pub fn is_of_forces(&self) -> bool {
        matches!(self.law, Law::Force | Law::Carriage | Law::Balance)
    }

    /// A mark, where the law is one of a whole axis: benches ask for the effect itself.
    pub fn mark(&self, mark: Mark) -> Option<Mark> {
        let is_of_axis = self.law == Law::Balance || self.is_behind_valve();
        is_of_axis.then_some(mark)
    }

    /// Area of the fully open valve, m2.
    pub fn open_valve_m2(&self) -> f64 {
        let valve = self.rig.valve.as_ref();
        let last = valve.and_then(|valve| valve.exhaust_area_m2.last().copied());
        last.unwrap_or(1e-5)
    }

    /// The spool's whole way, in units of the command, where the rig has a valve.
    pub fn spool_stroke_v(&self) -> Option<f64> {
        let valve = self.rig.valve.as_ref()?;
        valve.opening_v.last().map(|opening| 2.0 * opening)
    }

    /// The force that matters, N, where friction is declared.
    pub fn least_force_n(&self) -> Option<f64> {
        let coulomb_n = self.rig.value("friction.coulomb_N")?;
        Some(FRICTION_SHARE * coulomb_n)
    }
}
