//! What an experiment gives: numbers, the stretches that they came from, pictures, notes.

use std::collections::BTreeMap;
use std::ops::Range;

use grey_box::recording::Recording;
use grey_box::rig::{Rig, Valve, describe};
use grey_box::text::rounded;
use serde::Serialize;

/// What an experiment gives.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Outcome {
    /// What was measured.
    pub title: &'static str,
    /// How, in a few sentences.
    pub method: &'static str,
    /// What came out.
    pub numbers: Vec<Number>,
    /// The valve's areas, where these are what came out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub areas: Vec<AreaPoint>,
    /// What of the recordings was used.
    pub stretches: Vec<Stretch>,
    /// What a reader must know.
    pub notes: Vec<String>,
    /// The law beside the points.
    pub pictures: Vec<Picture>,
}

/// A number with its deviation, in SI.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Number {
    /// `section.key` of the rig file, or a name of its own where the file has no key for it.
    pub key: String,
    /// What it is.
    pub what: String,
    /// Value.
    pub value: f64,
    /// One standard deviation.
    pub deviation: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Unit in which it is shown, and how many of it make one of `unit`.
    #[serde(skip)]
    pub shown_in: (&'static str, f64),
}

/// Areas of both paths at one opening.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AreaPoint {
    /// Opening, V.
    pub opening_v: f64,
    /// From the supply and to the exhaust, m2; none where that path was not measured.
    pub area_m2: [Option<f64>; 2],
    /// Their standard deviations, m2.
    pub deviation_m2: [f64; 2],
}

/// A part of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stretch {
    /// The file.
    pub recording: String,
    /// First moment, s.
    pub from_s: f64,
    /// Last moment, s.
    pub to_s: f64,
    /// What it shows.
    pub what: String,
}

/// A chart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Picture {
    /// What it shows.
    pub title: String,
    /// The horizontal axis.
    pub x: Scale,
    /// The vertical axis.
    pub y: Scale,
    /// What is drawn.
    pub curves: Vec<Curve>,
}

/// Name and unit of an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scale {
    /// The quantity.
    pub name: String,
    /// Its unit.
    pub unit: String,
}

/// One curve of a chart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Its name.
    pub name: String,
    /// How it is drawn.
    pub kind: Kind,
    /// Its points.
    pub points: Vec<(f64, f64)>,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Points that were measured.
    Points,
    /// A second family of points.
    OtherPoints,
    /// A signal that was recorded.
    Recorded,
    /// The law with the numbers found.
    Law,
    /// The law of the rig file.
    Given,
}

impl Stretch {
    /// These rows of a recording, of which there must be one at least.
    pub fn of(recording: &Recording, rows: &Range<usize>, what: impl Into<String>) -> Self {
        Self {
            recording: recording.name.clone(),
            from_s: recording.time_s[rows.start],
            to_s: recording.time_s[rows.end - 1],
            what: what.into(),
        }
    }
}

impl Number {
    /// A number under a key of the rig file, in that key's unit.
    pub fn of_key(key: &str, value: f64, deviation: f64) -> Self {
        let facts = describe(key);
        let unit = facts.map_or("", |facts| facts.unit);
        Self {
            key: key.to_owned(),
            what: facts.map_or_else(|| key.to_owned(), |facts| facts.what.to_owned()),
            value,
            deviation,
            unit,
            shown_in: (unit, 1.0),
        }
    }

    /// A number that the rig file has no key for.
    pub fn named(
        key: &str,
        what: &str,
        unit: &'static str,
        (value, deviation): (f64, f64),
    ) -> Self {
        Self {
            key: key.to_owned(),
            what: what.to_owned(),
            value,
            deviation,
            unit,
            shown_in: (unit, 1.0),
        }
    }

    /// The same, shown in another unit.
    #[must_use]
    pub fn shown_in(self, unit: &'static str, per_si: f64) -> Self {
        Self {
            shown_in: (unit, per_si),
            ..self
        }
    }
}

impl Picture {
    /// A chart without curves.
    pub fn new(title: impl Into<String>, x: (&str, &str), y: (&str, &str)) -> Self {
        let scale = |(name, unit): (&str, &str)| Scale {
            name: name.to_owned(),
            unit: unit.to_owned(),
        };
        Self {
            title: title.into(),
            x: scale(x),
            y: scale(y),
            curves: Vec::new(),
        }
    }

    /// The same with a curve more.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, kind: Kind, points: Vec<(f64, f64)>) -> Self {
        let name = name.into();
        self.curves.push(Curve { name, kind, points });
        self
    }
}

impl Outcome {
    /// The number of this key.
    pub fn number(&self, key: &str) -> Option<&Number> {
        self.numbers.iter().find(|number| number.key == key)
    }

    /// Area of a path at an opening and its deviation, between the points of the estimate.
    pub fn area_at(&self, path: usize, opening_v: f64) -> Option<(f64, f64)> {
        let of =
            |one: &AreaPoint| Some((one.opening_v, one.area_m2[path]?, one.deviation_m2[path]));
        let points: Vec<(f64, f64, f64)> = self.areas.iter().filter_map(of).collect();
        let above = points.iter().position(|one| one.0 >= opening_v)?.max(1);
        let (from, to) = (points.get(above - 1)?, points.get(above)?);
        let along = (opening_v - from.0) / (to.0 - from.0);
        Some((
            from.1 + along * (to.1 - from.1),
            from.2 + along * (to.2 - from.2),
        ))
    }

    /// The rig with these numbers and their deviations; numbers without a key stay out.
    #[must_use]
    pub fn applied(&self, rig: &Rig) -> Rig {
        let mut improved = self.with_areas(rig);
        for number in &self.numbers {
            let mut value = BTreeMap::new();
            value.insert(number.key.clone(), rounded(number.value));
            let Ok(changed) = improved.try_with_values(&value) else {
                continue;
            };
            improved = changed;
            state_deviation(&mut improved, number);
        }
        improved
    }

    /// The numbers that have a key in this rig's file.
    pub fn of_rig_file<'a>(&'a self, rig: &'a Rig) -> impl Iterator<Item = &'a Number> {
        self.numbers.iter().filter(|number| {
            let one = [(number.key.clone(), number.value)].into();
            rig.try_with_values(&one).is_ok()
        })
    }

    fn with_areas(&self, rig: &Rig) -> Rig {
        let mut improved = rig.clone();
        if let Some(valve) = improved.valve.as_mut() {
            put_areas(valve, &self.areas);
        }
        improved
    }
}

/// Puts measured areas into a rig's valve: a path that was not measured gets the other's.
fn put_areas(valve: &mut Valve, areas: &[AreaPoint]) {
    if areas.len() < 2 {
        return;
    }
    valve.stated_flow = None;
    valve.opening_v = areas.iter().map(|one| rounded(one.opening_v)).collect();
    let of = |path: usize| -> Vec<f64> {
        let area = |one: &AreaPoint| one.area_m2[path].or(one.area_m2[1 - path]).unwrap_or(0.0);
        areas.iter().map(|one| rounded(area(one))).collect()
    };
    (valve.supply_area_m2, valve.exhaust_area_m2) = (of(0), of(1));
    // What described the shape between the points of another table.
    (valve.edge_v, valve.exhaust_shift_v) = (None, None);
}

/// Relative, or in volts where the key ends in `_V`.
fn state_deviation(rig: &mut Rig, number: &Number) {
    if !number.deviation.is_finite() || number.deviation <= 0.0 {
        return;
    }
    let is_absolute = number.key.ends_with("_V");
    let size = if is_absolute { 1.0 } else { number.value.abs() };
    if size > 0.0 {
        let stated = rounded(number.deviation / size);
        rig.uncertainty.insert(number.key.clone(), stated);
    }
}
