//! An axis' nights by quantity, without what its whole group does.
//!
//! Weather, the air of a hall and its compressor move all axes alike: what the middle one of a group
//! does, in units of the size that matters, is taken off each of its axes and followed as a series of
//! the group.

use super::change::{DEVIATION_PER_MEDIAN, Point, median};
use super::plan::{AxisPlan, Plan};
use super::store::{Outcome, Store};
use super::watched::{MISFIT, MISFIT_MATTERS, Size, watched};
use super::work::{Estimate, NightResult};
use std::collections::BTreeMap;

/// A quantity of an axis, or of a group, over its nights.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its key.
    pub key: String,
    /// The nights in which it was found.
    pub points: Vec<Point>,
    /// The change from which on it matters, in the key's unit.
    pub matters: f64,
    /// Whether it is of a group: then in units of that.
    pub of_group: bool,
}

/// An axis with the results of its nights.
#[derive(Clone, Debug)]
pub struct Axis<'p> {
    /// Its plan.
    pub plan: &'p AxisPlan,
    /// By key.
    pub series: Vec<Series>,
    /// What is wrong with recordings: the place of the night, and sentences.
    pub faults: Vec<(usize, Vec<String>)>,
    /// Nights without a result yet.
    pub open: usize,
}

/// Fewer axes than this say nothing of what they have in common.
const LEAST_GROUP: usize = 5;

/// A deviation of a quantity that a fit left open counts as this many sizes that matter.
const OPEN_MATTERS: f64 = 3.0;

/// All axes with what their nights gave.
pub fn axes<'p>(plan: &'p Plan, store: &Store) -> Vec<Axis<'p>> {
    plan.axes.iter().map(|axis| of_axis(axis, store)).collect()
}

fn of_axis<'p>(plan: &'p AxisPlan, store: &Store) -> Axis<'p> {
    let mut found: BTreeMap<String, Vec<Point>> = BTreeMap::new();
    let (mut faults, mut open) = (Vec::new(), 0);
    for (place, night) in plan.nights.iter().enumerate() {
        match store.read::<NightResult>(&night.job) {
            None => open += 1,
            Some(Outcome::Failed(why)) => faults.push((place, vec![why])),
            Some(Outcome::Done(result)) if !result.faults.is_empty() => {
                faults.push((place, result.faults));
            }
            Some(Outcome::Done(result)) => {
                for estimate in result.estimates {
                    let point = point(night.day, &estimate);
                    found.entry(estimate.key).or_default().push(point);
                }
            }
        }
    }
    let series = found
        .into_iter()
        .map(|(key, points)| of_key(key, points, plan.reference));
    Axis {
        plan,
        series: series.collect(),
        faults,
        open,
    }
}

fn point(day: f64, estimate: &Estimate) -> Point {
    let left_open = || OPEN_MATTERS * matters(&estimate.key, estimate.value);
    Point {
        day,
        value: estimate.value,
        standard_deviation: estimate.standard_deviation.unwrap_or_else(left_open),
    }
}

fn of_key(key: String, points: Vec<Point>, reference: usize) -> Series {
    let first = points.iter().take(reference).map(|one| one.value).collect();
    Series {
        matters: matters(&key, median(first)),
        of_group: false,
        points,
        key,
    }
}

/// From which change on a quantity of that value matters.
fn matters(key: &str, value: f64) -> f64 {
    let size = watched(key).map_or(Size::Of(MISFIT_MATTERS), |one| one.matters);
    size.at(value)
}

/// Takes off each axis what its group does, and gives that as series of the groups, by name.
pub fn apart(axes: &mut [Axis<'_>]) -> Vec<(String, Vec<Series>)> {
    let names = axes.iter().map(|axis| axis.plan.group.clone());
    let mut groups: Vec<String> = names.filter(|name| !name.is_empty()).collect();
    groups.sort();
    groups.dedup();
    let all = groups.into_iter().filter_map(|group| {
        let members: Vec<&mut Axis<'_>> = axes
            .iter_mut()
            .filter(|axis| axis.plan.group == group)
            .collect();
        (members.len() >= LEAST_GROUP).then(|| (group, common(members)))
    });
    all.collect()
}

/// What the members have in common, by key; taken off them.
fn common(mut members: Vec<&mut Axis<'_>>) -> Vec<Series> {
    let mut keys: Vec<String> = members
        .iter()
        .flat_map(|axis| axis.series.iter().map(|series| series.key.clone()))
        .filter(|key| !key.starts_with(MISFIT))
        .collect();
    keys.sort();
    keys.dedup();
    keys.into_iter()
        .filter_map(|key| of_group(key, &mut members))
        .collect()
}

fn of_group(key: String, members: &mut [&mut Axis<'_>]) -> Option<Series> {
    let mut own: Vec<(&mut Series, f64)> = Vec::new();
    for axis in members.iter_mut() {
        let reference = axis.plan.reference;
        let Some(series) = axis.series.iter_mut().find(|one| one.key == key) else {
            continue;
        };
        let first = series.points.iter().take(reference).map(|one| one.value);
        let was = median(first.collect());
        own.push((series, was));
    }
    let mut by_day: BTreeMap<u64, (f64, Vec<f64>)> = BTreeMap::new();
    for (series, was) in &own {
        for point in &series.points {
            let off = (point.value - was) / series.matters;
            let entry = by_day
                .entry(point.day.to_bits())
                .or_insert((point.day, Vec::new()));
            entry.1.push(off);
        }
    }
    by_day.retain(|_, (_, offs)| offs.len() >= LEAST_GROUP);
    let mut points: Vec<Point> = Vec::new();
    for (day, offs) in by_day.values() {
        let middle = median(offs.clone());
        let spread = median(offs.iter().map(|off| (off - middle).abs()).collect());
        points.push(Point {
            day: *day,
            value: middle,
            // Of a median of so many.
            standard_deviation: 1.25 * DEVIATION_PER_MEDIAN * spread / (offs.len() as f64).sqrt(),
        });
    }
    points.sort_by(|one, other| one.day.total_cmp(&other.day));
    for (series, _) in &mut own {
        for point in &mut series.points {
            let same_day = points
                .iter()
                .find(|one| one.day.to_bits() == point.day.to_bits());
            point.value -= same_day.map_or(0.0, |one| one.value * series.matters);
        }
    }
    let key_known = watched(&key).is_some();
    (key_known && points.len() > 1).then_some(Series {
        key,
        points,
        matters: 1.0,
        of_group: true,
    })
}
