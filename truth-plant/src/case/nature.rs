//! How a rig lies outside of what its file can say.
//!
//! In the laboratory the rig file's laws hold to the letter, and only its numbers are wrong, by
//! draws from their stated uncertainties. On the shop floor the valve's curve is smooth and its
//! table has few points, measured to a per cent; discharge, laminar range, bristles, surroundings,
//! noise and scales are those of another specimen than the data sheet's. None of that is an
//! effect.

use core::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::nameplate::{AMBIENT, LAMINAR_RATIO};
use crate::plant::Physics;
use crate::plant::gas::{Node, PAPER_DISCHARGE};
use crate::plant::valve::{AreaCurve, OPENINGS_V};
use crate::random::Random;

/// Where a rig stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nature {
    /// The rig file's laws hold exactly.
    #[default]
    Laboratory,
    /// They hold nearly.
    ShopFloor,
}

impl Nature {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Laboratory, Self::ShopFloor];

    /// Its name, as in `truth.json`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Laboratory => "laboratory",
            Self::ShopFloor => "shop-floor",
        }
    }
}

impl fmt::Display for Nature {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// There is no nature of this name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownNature(pub String);

impl fmt::Display for UnknownNature {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = Nature::ALL.map(Nature::name).join(" or ");
        write!(formatter, "unknown nature `{}`: expected {names}", self.0)
    }
}

impl std::error::Error for UnknownNature {}

impl FromStr for Nature {
    type Err = UnknownNature;

    fn from_str(name: &str) -> Result<Self, UnknownNature> {
        let named = Self::ALL.into_iter().find(|nature| nature.name() == name);
        named.ok_or_else(|| UnknownNature(name.to_owned()))
    }
}

/// Distance of the points between which a smooth curve is linear, V: a chord misses less than a
/// ten-thousandth of the area.
const FINE_V: f64 = 0.004;
/// Openings at which engineers measured their valves, by the number of points.
const TABLES_V: [&[f64]; 4] = [
    &[0.0, 0.2, 0.3, 0.4, 0.6, 1.0, 2.0, 3.5, 5.0],
    &[0.0, 0.15, 0.3, 0.45, 0.6, 0.9, 1.5, 2.5, 3.5, 5.0],
    &[0.0, 0.2, 0.25, 0.3, 0.4, 0.6, 0.8, 1.0, 1.6, 2.5, 3.6, 5.0],
    &OPENINGS_V,
];

/// The form of a valve's curve over the opening that is left past the overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    /// That of [`AreaCurve`].
    Tanh,
    /// A circular port that a straight edge uncovers: a power of a sine.
    Sine,
    /// An edge that is rounded over so much, V, and slots that choke.
    Rounded(f64),
}

impl Form {
    fn area_m2(self, curve: &AreaCurve, opening_v: f64) -> f64 {
        let free_v = opening_v - curve.overlap_v;
        let open = match self {
            Self::Tanh => return curve.area_m2(opening_v),
            Self::Sine => {
                let part = (free_v / (1.6 * curve.span_v)).clamp(0.0, 1.0);
                let quarter = 0.5 * core::f64::consts::PI;
                libm::pow(libm::sin(quarter * part), curve.shape)
            }
            Self::Rounded(over_v) => {
                let rounded_v = over_v * libm::log1p(libm::exp((free_v / over_v).min(500.0)));
                -libm::expm1(-libm::pow(rounded_v / curve.span_v, curve.shape))
            }
        };
        curve.leak_m2 + curve.largest_m2 * open
    }
}

/// One rig's departures.
#[derive(Clone, Debug)]
pub(super) struct Departure {
    form: Form,
    exhaust_late_v: f64,
    discharge: [f64; 3],
    laminar_ratio: f64,
    /// Factors on stiffness and damping.
    bristles: [f64; 2],
    ambient: Node,
    pressure_gain: [f64; 2],
    pressure_offset_pa: [f64; 2],
    position_gain: f64,
    /// Declared over true noise, of pressures and of position.
    pub(super) declared_noise: [f64; 2],
    /// Openings of the table that is typed ...
    pub(super) openings_v: Vec<f64>,
    /// ... and the factor by which each area was measured wrongly.
    pub(super) measured: Vec<f64>,
}

impl Departure {
    /// None at all.
    pub(super) fn none() -> Self {
        Self {
            form: Form::Tanh,
            exhaust_late_v: 0.0,
            discharge: PAPER_DISCHARGE,
            laminar_ratio: LAMINAR_RATIO,
            bristles: [1.0; 2],
            ambient: AMBIENT,
            pressure_gain: [1.0; 2],
            pressure_offset_pa: [0.0; 2],
            position_gain: 1.0,
            declared_noise: [1.0; 2],
            openings_v: OPENINGS_V.to_vec(),
            measured: vec![1.0; OPENINGS_V.len()],
        }
    }

    /// Those of a shop floor.
    pub(super) fn draw(random: &mut Random) -> Self {
        let rounded = Form::Rounded(random.between(0.01, 0.03));
        let form = *random.one_of(&[Form::Tanh, Form::Sine, rounded]);
        let discharge = [
            random.between(0.79, 0.84),
            random.between(0.06, 0.13),
            random.between(-0.13, -0.07),
        ];
        let factor = |random: &mut Random, most: f64| {
            let most = libm::log(most);
            libm::exp(random.between(-most, most))
        };
        let openings_v = random.one_of(&TABLES_V).to_vec();
        let mut measured = vec![1.0; openings_v.len()];
        for one in &mut measured {
            *one = 1.0 + 0.005 * random.normal();
        }
        Self {
            form,
            exhaust_late_v: random.between(-0.01, 0.01),
            discharge,
            laminar_ratio: random.between(0.968, 0.996),
            bristles: [factor(random, 2.0), factor(random, 1.5)],
            ambient: Node {
                pressure_pa: AMBIENT.pressure_pa + random.between(-2000.0, 1500.0),
                temperature_k: AMBIENT.temperature_k + random.between(-5.0, 7.0),
            },
            pressure_gain: [0.0; 2].map(|_| 1.0 + 0.001 * random.normal()),
            pressure_offset_pa: [0.0; 2].map(|_| 150.0 * random.normal()),
            position_gain: 1.0 + 0.0005 * random.normal(),
            declared_noise: [factor(random, 2.0), factor(random, 2.0)],
            openings_v,
            measured,
        }
    }

    /// Puts them into a plant.
    pub(super) fn apply(&self, curve: &AreaCurve, physics: &mut Physics) {
        if self.form != Form::Tanh || self.exhaust_late_v != 0.0 {
            let points = (OPENINGS_V[OPENINGS_V.len() - 1] / FINE_V) as usize + 1;
            let areas = &mut physics.areas;
            areas.openings_v = (0..points).map(|point| FINE_V * point as f64).collect();
            let area = |opening_v: &f64| self.area_m2(curve, *opening_v);
            areas.supply_m2 = areas.openings_v.iter().map(area).collect();
            areas.exhaust_late_v = self.exhaust_late_v;
        }
        let network = &mut physics.network;
        network.flow.discharge = self.discharge;
        network.flow.laminar_ratio = self.laminar_ratio;
        network.ambient = self.ambient;
        let friction = &mut physics.mechanics.friction;
        friction.stiffness_n_per_m *= self.bristles[0];
        friction.damping_n_s_per_m *= self.bristles[1];
        let sensors = &mut physics.sensors;
        sensors.pressure_gain = self.pressure_gain;
        sensors.pressure_offset_pa = self.pressure_offset_pa;
        sensors.position_gain = self.position_gain;
    }

    /// Area of a supply path at an opening.
    pub(super) fn area_m2(&self, curve: &AreaCurve, opening_v: f64) -> f64 {
        self.form.area_m2(curve, opening_v)
    }
}
