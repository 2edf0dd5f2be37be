//! The quantities of an axis that are followed from night to night.
//!
//! From which change on each matters is about the least that an engineer would care about: a tenth of
//! what the heads of the effects in `model_core::left_out` call typical, or the step that data sheets
//! of parts guarantee (valve null and areas, gauges of class 0.5).

use crate::laws::Law;

/// A quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watched {
    /// Its key in a rig file.
    pub key: &'static str,
    /// What a person calls it.
    pub title: &'static str,
    /// What changes where it does, in words of the trade.
    pub physics: &'static str,
    /// The law that shows it.
    pub of: Half,
    /// Where a fit of it begins; the rig's own value where none is told.
    pub start: Option<f64>,
    /// Between which it lies; the rig file's bounds where none are told.
    pub bounds: Option<(f64, f64)>,
    /// The change from which on it matters: in the unit of the key, or as a share of the value that
    /// it had.
    pub matters: Size,
    /// The unit in which it is said.
    pub unit: &'static str,
    /// How many of those one of the key's is.
    pub per_si: f64,
}

/// Which law shows a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Half {
    /// That of the chambers.
    Gas,
    /// That of the carriage.
    Forces,
}

impl Half {
    /// Whether a law is of this half.
    pub fn is_of(self, law: Law) -> bool {
        match self {
            Self::Gas => law == Law::Chambers,
            Self::Forces => matches!(law, Law::Carriage | Law::Force),
        }
    }
}

/// A size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// In the key's unit.
    Of(f64),
    /// As a share.
    Share(f64),
}

impl Size {
    /// In the key's unit, of something that is this large.
    pub fn at(self, value: f64) -> f64 {
        match self {
            Self::Of(size) => size,
            Self::Share(share) => share * value.abs(),
        }
    }
}

const fn effect(
    key: &'static str,
    (title, physics): (&'static str, &'static str),
    of: Half,
    (start, bounds): (f64, (f64, f64)),
    (matters, unit, per_si): (f64, &'static str, f64),
) -> Watched {
    Watched {
        key,
        title,
        physics,
        of,
        start: Some(start),
        bounds: Some(bounds),
        matters: Size::Of(matters),
        unit,
        per_si,
    }
}

const fn number(
    key: &'static str,
    (title, physics): (&'static str, &'static str),
    of: Half,
    matters: Size,
    (unit, per_si): (&'static str, f64),
) -> Watched {
    Watched {
        key,
        title,
        physics,
        of,
        start: None,
        bounds: None,
        matters,
        unit,
        per_si,
    }
}

/// What is followed.
#[rustfmt::skip]
pub const WATCHED: &[Watched] = &[
    effect("effects.piston-leakage.orifice_m2", ("leak past the piston", "piston seal"), Half::Gas, (1e-9, (0.0, 1e-5)), (2.5e-8, "mm²", 1e6)),
    effect("effects.chamber-leakage.orifice_a_m2", ("leak of chamber A", "leak to the surroundings"), Half::Gas, (1e-9, (0.0, 1e-5)), (1.5e-8, "mm²", 1e6)),
    effect("effects.chamber-leakage.orifice_b_m2", ("leak of chamber B", "leak to the surroundings"), Half::Gas, (1e-9, (0.0, 1e-5)), (1.5e-8, "mm²", 1e6)),
    effect("effects.pressure-sensor-offset.offset_a_Pa", ("offset of gauge A", "gauge"), Half::Gas, (0.0, (-1e5, 1e5)), (3e3, "kPa", 1e-3)),
    effect("effects.pressure-sensor-offset.offset_b_Pa", ("offset of gauge B", "gauge"), Half::Gas, (0.0, (-1e5, 1e5)), (3e3, "kPa", 1e-3)),
    effect("effects.valve-delay.delay_s", ("response time of the valve", "valve response"), Half::Gas, (1e-4, (0.0, 0.05)), (1e-3, "ms", 1e3)),
    effect("effects.valve-hysteresis.width", ("hysteresis of the valve", "valve sticking"), Half::Gas, (0.01, (0.0, 2.0)), (0.03, "command units", 1.0)),
    number("valve.null_V", ("null of the valve", "valve null"), Half::Gas, Size::Of(0.02), ("V", 1.0)),
    number("valve.supply_area_m2", ("supply paths of the valve", "valve or supply line"), Half::Gas, Size::Share(0.05), ("", 1.0)),
    number("valve.exhaust_area_m2", ("exhaust paths of the valve", "valve or silencer"), Half::Gas, Size::Share(0.05), ("", 1.0)),
    number("supply.pressure_Pa", ("supply pressure", "supply"), Half::Gas, Size::Share(0.03), ("kPa", 1e-3)),
    number("friction.coulomb_N", ("dry friction", "seals and guide"), Half::Forces, Size::Share(0.15), ("N", 1.0)),
    number("friction.viscous_Ns_m", ("viscous friction", "lubrication"), Half::Forces, Size::Share(0.25), ("N s/m", 1.0)),
    effect("effects.constant-force.force_N", ("constant force", "load, inclination, or the zero of a gauge"), Half::Forces, (0.0, (-1e4, 1e4)), (1.5, "N", 1.0)),
];

/// The misfit of a pressure is followed too, as a logarithm: a half more of it matters. A change that
/// no watched quantity follows shows there.
pub const MISFIT_MATTERS: f64 = 0.405;
/// Before the signal in the key of its misfit.
pub const MISFIT: &str = "misfit.";

/// The quantity of a key.
pub fn watched(key: &str) -> Option<&'static Watched> {
    WATCHED.iter().find(|one| one.key == key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::numeric_keys;

    /// A key that no rig file has would be followed by nobody.
    #[test]
    fn prop_every_watched_key_is_one_of_a_rig_file() {
        let known: Vec<&str> = numeric_keys().collect();
        for one in WATCHED {
            let is_effect = one.key.strip_prefix("effects.").is_some_and(|rest| {
                rest.split_once('.').is_some_and(|(effect, key)| {
                    crate::effects::effect(effect)
                        .is_some_and(|effect| effect.parameter(key).is_some())
                })
            });
            let is_table = one.key.starts_with("valve.") && one.key.ends_with("_area_m2");
            let is_number = known.contains(&one.key);
            assert!(is_effect || is_table || is_number, "{}", one.key);
        }
    }
}
