//! Gas in a volume that does not change: mass and temperature out of the recorded pressure.
//!
//! The energy balance (the paper's (3)) without work,
//!
//! ```text
//! V p'/(gamma-1) = cp T_flow m' + h S (T_wall - T)        T = p V / (m R)
//! ```
//!
//! is a law for the mass as soon as the pressure is recorded: nothing need be known of the valve.
//! T_flow is the supply's temperature while gas flows in, the gas' own while it flows out. Which
//! of both holds is given for a whole stretch: by the sign of every row's noise it would be the
//! wrong one half of the time at rest.

use grey_box::model::{Side, Values};
use grey_box::rig::Rig;
use model_core::gas::Gas;

/// What does not change with the recording.
#[derive(Clone, Copy, Debug)]
pub struct Vessel {
    /// Volume, m3.
    pub volume_m3: f64,
    /// Surface of its wall, m2.
    pub surface_m2: f64,
    /// Temperature of wall and surroundings, K.
    pub wall_k: f64,
    /// Temperature of what flows in, K.
    pub supply_k: f64,
    /// The gas.
    pub gas: Gas<f64>,
}

/// Mass and temperature at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Content {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Temperature, K.
    pub temperature_k: f64,
}

impl Vessel {
    /// A chamber of a rig with the piston at a place, or its vessel.
    ///
    /// # Errors
    /// If the rig does not say enough of its geometry.
    pub fn of(rig: &Rig, side: Side, position_m: f64) -> Result<Self, String> {
        let values = Values::<f64>::of(rig);
        let geometry = values.geometry(side).ok_or(
            "the volume is not known: [vessel] volume_m3, or [cylinder] with stroke, areas and dead volumes",
        )?;
        let ambient = values.ambient();
        Ok(Self {
            volume_m3: geometry.volume_m3(position_m),
            surface_m2: geometry.surface_m2(position_m),
            wall_k: ambient.temperature_k,
            supply_k: ambient.temperature_k,
            gas: values.gas(),
        })
    }

    /// Gas that has the wall's temperature.
    pub fn settled(&self, pressure_pa: f64) -> Content {
        let gas_constant = self.gas.gas_constant_j_per_kg_k;
        Content {
            mass_kg: pressure_pa * self.volume_m3 / (gas_constant * self.wall_k),
            temperature_k: self.wall_k,
        }
    }

    /// So much gas at a pressure.
    pub fn holding(&self, mass_kg: f64, pressure_pa: f64) -> Content {
        Content {
            mass_kg,
            temperature_k: self.temperature_k(mass_kg, pressure_pa),
        }
    }

    /// The pressure of so much gas at the wall's temperature, Pa.
    pub fn settled_pa(&self, mass_kg: f64) -> f64 {
        mass_kg * self.gas.gas_constant_j_per_kg_k * self.wall_k / self.volume_m3
    }

    /// Mass and temperature at every row, from a content at the first one; the heat transfer in
    /// W/(m2 K). The steps are those of the rows, halved (Heun), so that one of a second order.
    pub fn contents(
        &self,
        time_s: &[f64],
        pressure_pa: &[f64],
        start: Content,
        (heat_transfer, fills): (f64, bool),
    ) -> Vec<Content> {
        self.contents_over(time_s, pressure_pa, start, (&|_| heat_transfer, fills))
    }

    /// The same with a heat transfer that changes with the time since the first row, s.
    pub fn contents_over(
        &self,
        time_s: &[f64],
        pressure_pa: &[f64],
        start: Content,
        (heat_transfer, fills): (&dyn Fn(f64) -> f64, bool),
    ) -> Vec<Content> {
        let mut all = vec![start];
        let mut mass_kg = start.mass_kg;
        for row in 1..time_s.len() {
            let dt_s = time_s[row] - time_s[row - 1];
            let from = (mass_kg, pressure_pa[row - 1]);
            let rise_pa = pressure_pa[row] - pressure_pa[row - 1];
            let at = |row: usize| (heat_transfer(time_s[row] - time_s[0]), fills);
            let first = self.gain_kg(from, rise_pa, dt_s, at(row - 1));
            let to = (mass_kg + first, pressure_pa[row]);
            let second = self.gain_kg(to, rise_pa, dt_s, at(row));
            mass_kg += 0.5 * (first + second);
            all.push(Content {
                mass_kg,
                temperature_k: self.temperature_k(mass_kg, pressure_pa[row]),
            });
        }
        all
    }

    /// What flows in over a row by the balance at one of its ends, kg.
    fn gain_kg(
        &self,
        (mass_kg, pressure_pa): (f64, f64),
        rise_pa: f64,
        dt_s: f64,
        (heat_transfer, fills): (f64, bool),
    ) -> f64 {
        let ratio = self.gas.heat_capacity_ratio;
        let temperature_k = self.temperature_k(mass_kg, pressure_pa);
        let heat_j = heat_transfer * self.surface_m2 * (self.wall_k - temperature_k) * dt_s;
        let stored_j = self.volume_m3 * rise_pa / (ratio - 1.0);
        let carried_k = if fills { self.supply_k } else { temperature_k };
        (stored_j - heat_j) / (self.gas.heat_capacity_at_constant_pressure() * carried_k)
    }

    fn temperature_k(&self, mass_kg: f64, pressure_pa: f64) -> f64 {
        pressure_pa * self.volume_m3 / (mass_kg * self.gas.gas_constant_j_per_kg_k)
    }

    /// Time in which the gas takes the wall's temperature, s.
    pub fn settling_s(&self, mass_kg: f64, heat_transfer: f64) -> f64 {
        let ratio = self.gas.heat_capacity_ratio;
        let heat_capacity = mass_kg * self.gas.gas_constant_j_per_kg_k / (ratio - 1.0);
        heat_capacity / (heat_transfer * self.surface_m2).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vessel() -> Vessel {
        Vessel {
            volume_m3: 1e-3,
            surface_m2: 0.06,
            wall_k: 293.15,
            supply_k: 293.15,
            gas: Gas::new(1.4, 287.0),
        }
    }

    /// Known answers: without heat a vessel that empties cools by the isentropic law, and one that
    /// fills from nothing takes gamma times the supply's temperature.
    #[test]
    fn val_without_heat_the_limits_are_those_of_the_textbook() {
        let vessel = vessel();
        let time_s: Vec<f64> = (0..=20_000).map(|row| f64::from(row) * 1e-4).collect();
        let falling: Vec<f64> = time_s.iter().map(|time| 7e5 - 3e5 * time).collect();
        let start = vessel.settled(7e5);
        let emptied = vessel.contents(&time_s, &falling, start, (0.0, false));
        let end = emptied.last().expect("rows");
        let isentropic_k = 293.15 * (1.0_f64 / 7.0).powf(0.4 / 1.4);
        assert!((end.temperature_k - isentropic_k).abs() < 0.01, "{end:?}");
        let rising: Vec<f64> = time_s.iter().map(|time| 1e2 + 3.5e5 * time).collect();
        let filled = vessel.contents(&time_s, &rising, vessel.settled(1e2), (0.0, true));
        let hot_k = filled.last().expect("rows").temperature_k;
        assert!((hot_k - 1.4 * 293.15).abs() < 0.1, "{hot_k}");
    }

    /// A shut vessel keeps its mass: the pressure relaxes by heat alone.
    #[test]
    fn val_a_shut_vessel_keeps_its_mass() {
        let vessel = vessel();
        let hot = Content {
            mass_kg: vessel.settled(5e5).mass_kg,
            temperature_k: 350.0,
        };
        let settling_s = vessel.settling_s(hot.mass_kg, 30.0);
        let time_s: Vec<f64> = (0..20_000).map(|row| f64::from(row) * 1e-3).collect();
        let rise = 350.0 / 293.15 - 1.0;
        let pressure: Vec<f64> = time_s
            .iter()
            .map(|time| 5e5 * (1.0 + rise * (-time / settling_s).exp()))
            .collect();
        let contents = vessel.contents(&time_s, &pressure, hot, (30.0, true));
        let end = contents.last().expect("rows");
        assert!((end.mass_kg / hot.mass_kg - 1.0).abs() < 1e-6);
        assert!((end.temperature_k - 293.15).abs() < 1.0);
    }
}
