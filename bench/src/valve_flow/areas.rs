//! Areas over the command, the leakage of closed paths, and the null.

use grey_box::fit::Parameter;
use grey_box::rig::{FeedsAWhen, Valve};
use model_core::valve::{AreaTable, FlowLaw};

use super::number;
use crate::flow_point::{FlowPoint, by_command};
use crate::iso6358;
use crate::least_squares::{Solved, fitted, linear};
use crate::outcome::{AreaPoint, Number};
use crate::steady;
use nalgebra::{DMatrix, DVector};

/// Up to this opening all paths are closed: overlaps are 0.2 to 0.5 V. What flows there is leakage.
const CLOSED_UP_TO_V: f64 = 0.12;
/// Null and leakage are found in turns.
const TURNS: usize = 4;
/// How far the null may be from the rig's, V.
const NULL_RANGE_V: f64 = 0.5;
/// What a smooth curve through the points may be off by between them, as a part of the area.
const BETWEEN_POINTS: f64 = 5e-3;
/// The part of the largest area between which a path's first rise is read.
const RISE: (f64, f64) = (0.03, 0.3);
/// Over so much of the opening a slope is read, V.
const STRETCH_V: f64 = 1.0;
/// Points of a branch from which a curve is read.
const LEAST_POINTS: usize = 4;
/// The most points of a table of the rig file.
const MOST_POINTS: usize = 48;

/// What the law's shape leaves in an area, as a part of it: both laws are smooth curves for one
/// that is not quite either (chosen).
const SHAPE_ERROR: f64 = 2e-3;

/// Opening, area and its deviation of one command.
type OpenPoint = (f64, f64, f64);

/// What the flows say of the areas.
pub(super) struct Areas {
    paths: [Vec<OpenPoint>; 2],
    null_v: f64,
    /// Null and the exhaust's factor, where both branches were measured.
    alike: Option<Solved>,
    leakage_m2: Option<f64>,
    leakage_deviation_m2: f64,
    sign: f64,
    /// What the deviation of the law's shape does to an area, as a part of it.
    shape_share: f64,
    pub(super) notes: Vec<String>,
}

pub(super) fn measure(
    points: &[FlowPoint],
    law: &FlowLaw<f64>,
    valve: &Valve,
) -> Result<Areas, String> {
    let sign = match valve.feeds_a_when {
        FeedsAWhen::AboveNull => 1.0,
        FeedsAWhen::BelowNull => -1.0,
    };
    let mut areas = Areas {
        paths: [Vec::new(), Vec::new()],
        null_v: valve.null_v,
        alike: None,
        leakage_m2: None,
        leakage_deviation_m2: 0.0,
        sign,
        shape_share: 0.0,
        notes: Vec::new(),
    };
    areas.check_direction(points)?;
    for _ in 0..TURNS {
        areas.find_leakage(points, law);
        areas.find_paths(points, law);
        let Some(alike) = areas.null_of_both(valve.null_v) else {
            break;
        };
        areas.null_v = alike.values[0];
        areas.alike = Some(alike);
    }
    areas.find_leakage(points, law);
    areas.find_paths(points, law);
    areas.say_what_is_missing(valve.null_v);
    if areas.paths.iter().all(|path| path.len() < 2) {
        return Err("no path was open at two commands: a curve of areas needs more".into());
    }
    Ok(areas)
}

impl Areas {
    fn opening_v(&self, point: &FlowPoint) -> f64 {
        self.sign * (point.command_v - self.null_v)
    }

    /// A valve whose other side feeds port A would give areas below nought.
    fn check_direction(&self, points: &[FlowPoint]) -> Result<(), String> {
        let work: f64 = points
            .iter()
            .map(|one| self.opening_v(one) * one.flow_kg_per_s)
            .sum();
        if work < 0.0 {
            return Err("the flow into port A falls with the command though feeds_a_when says that it rises: \
                        correct feeds_a_when, or the sign of flow_a (into port A is positive)"
                .into());
        }
        Ok(())
    }

    /// What passes while all paths are closed. A meter at the port sees what leaks in less what
    /// leaks out; both leakages are taken to be in the ratio of the open areas.
    fn find_leakage(&mut self, points: &[FlowPoint], law: &FlowLaw<f64>) {
        let factor = self.alike.as_ref().map_or(1.0, |alike| alike.values[1]);
        let rows: Vec<(f64, f64)> = points
            .iter()
            .filter(|one| self.opening_v(one).abs() < CLOSED_UP_TO_V)
            .map(|one| {
                let [fed, vented] = one.per_area(law);
                (
                    (fed - factor * vented) / one.deviation_kg_per_s,
                    one.flow_kg_per_s / one.deviation_kg_per_s,
                )
            })
            .collect();
        let product: f64 = rows.iter().map(|(per_area, flow)| per_area * flow).sum();
        let square: f64 = rows.iter().map(|(per_area, _)| per_area * per_area).sum();
        self.leakage_m2 = (square > 0.0).then(|| (product / square).max(0.0));
        // A meter's zero and a gauge are off by the same in all points: they are not averaged.
        let sharpest = rows
            .iter()
            .map(|(per_area, _)| per_area.abs())
            .fold(0.0, f64::max);
        self.leakage_deviation_m2 = if sharpest > 0.0 {
            sharpest.recip()
        } else {
            0.0
        };
    }

    /// Leakage of the supply's and of the exhaust's shut path, m2.
    pub(super) fn leakages_m2(&self) -> [f64; 2] {
        let factor = self.alike.as_ref().map_or(1.0, |alike| alike.values[1]);
        let leakage_m2 = self.leakage_m2.unwrap_or(0.0);
        [leakage_m2, factor * leakage_m2]
    }

    /// The points with what passes the closed path added to what was measured.
    pub(super) fn without_leakage(
        &self,
        points: &[FlowPoint],
        law: &FlowLaw<f64>,
    ) -> Vec<FlowPoint> {
        let factor = self.alike.as_ref().map_or(1.0, |alike| alike.values[1]);
        let leakage_m2 = self.leakage_m2.unwrap_or(0.0);
        let of = |point: &FlowPoint| {
            let [fed, vented] = point.per_area(law);
            let leaks = if point.is_fed() {
                factor * vented
            } else {
                -fed
            };
            FlowPoint {
                flow_kg_per_s: point.flow_kg_per_s + leakage_m2 * leaks,
                ..*point
            }
        };
        points.iter().map(of).collect()
    }

    fn find_paths(&mut self, points: &[FlowPoint], law: &FlowLaw<f64>) {
        let factor = self.alike.as_ref().map_or(1.0, |alike| alike.values[1]);
        let leakage_m2 = self.leakage_m2.unwrap_or(0.0);
        let mut paths = [Vec::new(), Vec::new()];
        for group in by_command(points) {
            let opening_v = self.opening_v(&group[0]);
            let path = usize::from(opening_v < 0.0);
            if opening_v.abs() < CLOSED_UP_TO_V {
                continue;
            }
            let (mut sum, mut weights, mut leaks) = (0.0, 0.0, 0.0);
            for point in &group {
                let [fed, vented] = point.per_area(law);
                let (open, shut, signed) = match path {
                    0 => (fed, factor * vented, point.flow_kg_per_s),
                    _ => (vented, fed, -point.flow_kg_per_s),
                };
                let area_m2 = (signed + leakage_m2 * shut) / open.max(f64::MIN_POSITIVE);
                let weight = (open / point.deviation_kg_per_s).powi(2);
                sum += weight * area_m2;
                weights += weight;
                leaks += weight * shut / open.max(f64::MIN_POSITIVE);
            }
            if weights > 0.0 {
                let by_leakage = self.leakage_deviation_m2 * leaks / weights;
                let deviation_m2 = weights.sqrt().recip().hypot(by_leakage);
                paths[path].push((opening_v.abs(), sum / weights, deviation_m2));
            }
        }
        for path in &mut paths {
            path.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        self.paths = paths;
    }

    /// The null by which the exhaust's curve is the supply's times a factor.
    fn null_of_both(&self, stated_v: f64) -> Option<Solved> {
        let [supply, exhaust] = &self.paths;
        if supply.len() < LEAST_POINTS || exhaust.len() < LEAST_POINTS {
            return None;
        }
        let commands = |path: &[OpenPoint], sign: f64| -> Vec<OpenPoint> {
            path.iter()
                .map(|one| (self.null_v + sign * one.0, one.1, one.2))
                .collect()
        };
        let (fed, vented) = (commands(supply, self.sign), commands(exhaust, -self.sign));
        let residuals = |numbers: &[f64]| -> Vec<f64> {
            let opening = |one: &OpenPoint, sign: f64| sign * (one.0 - numbers[0]);
            let curve: Vec<OpenPoint> = fed
                .iter()
                .map(|one| (opening(one, self.sign), one.1, one.2))
                .collect();
            let Some(table) = smooth(&curve, self.leakage_m2) else {
                return vec![f64::NAN; vented.len()];
            };
            let of = |one: &OpenPoint| {
                let alike_m2 = numbers[1] * table.area_m2(opening(one, -self.sign));
                let deviation = one
                    .2
                    .hypot(BETWEEN_POINTS * one.1)
                    .hypot(nearest(&curve, opening(one, -self.sign)));
                (one.1 - alike_m2) / deviation
            };
            vented.iter().map(of).collect()
        };
        let parameters = [
            Parameter::new(self.null_v)
                .bounded(stated_v - NULL_RANGE_V, stated_v + NULL_RANGE_V)
                .with_scale(0.1),
            Parameter::new(1.0).bounded(0.2, 5.0),
        ];
        fitted(&parameters, &residuals).ok()
    }

    fn say_what_is_missing(&mut self, stated_v: f64) {
        if self.alike.is_none() {
            self.notes.push(format!(
                "one side of the null was measured only: the null stays at {stated_v} V, and the other path gets the same areas"
            ));
        }
        if self.leakage_m2.is_none() {
            self.notes.push(format!(
                "no flow within {CLOSED_UP_TO_V} V of the null: the leakage of the closed paths is taken as nothing"
            ));
        }
    }

    pub(super) fn numbers(&self) -> Vec<Number> {
        let null = self
            .alike
            .iter()
            .map(|alike| number("valve.null_V", alike.at(0)));
        let dead_zones = [0, 1].into_iter().filter_map(|path| self.dead_zone(path));
        let saturations = [0, 1].into_iter().filter_map(|path| self.saturation(path));
        null.chain(dead_zones).chain(saturations).collect()
    }

    /// Where a path has all but opened: the area rises half as fast as at its steepest.
    fn saturation(&self, path: usize) -> Option<Number> {
        let points = &self.paths[path];
        let windows: Vec<(f64, f64)> = (0..points.len())
            .filter_map(|first| {
                let until = points.partition_point(|one| one.0 <= points[first].0 + STRETCH_V);
                let (openings, areas): (Vec<f64>, Vec<f64>) = points[first..until]
                    .iter()
                    .map(|one| (one.0, one.1))
                    .unzip();
                let is_whole = *openings.last()? > points[first].0 + 0.5 * STRETCH_V;
                is_whole.then(|| (steady::mean(&openings), steady::slope(&openings, &areas)))
            })
            .collect();
        let steepest = windows.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let flat = windows
            .iter()
            .find(|one| one.0 > steepest.0 && one.1 < 0.5 * steepest.1)?;
        let key = ["saturation_supply_V", "saturation_exhaust_V"][path];
        let what = [
            "opening from which the supply path opens half as fast",
            "opening from which the exhaust path opens half as fast",
        ];
        // Between this stretch and the one before: as near as the commands are.
        let apart_v = points
            .windows(2)
            .map(|pair| pair[1].0 - pair[0].0)
            .fold(0.0, f64::max);
        Some(Number::named(
            key,
            what[path],
            "V",
            (flat.0, apart_v / 12_f64.sqrt()),
        ))
    }

    /// Where the line through the first of a path's rise meets the leakage.
    fn dead_zone(&self, path: usize) -> Option<Number> {
        let points = &self.paths[path];
        let leakage_m2 = self.leakages_m2()[path];
        let largest_m2 = points.iter().map(|one| one.1).fold(0.0, f64::max);
        let rising: Vec<&OpenPoint> = points
            .iter()
            .filter(|one| (RISE.0 * largest_m2..RISE.1 * largest_m2).contains(&one.1))
            .collect();
        if rising.len() < 3 {
            return None;
        }
        let design = DMatrix::from_fn(rising.len(), 2, |row, column| {
            [rising[row].1 - leakage_m2, 1.0][column]
        });
        let wanted = DVector::from_iterator(rising.len(), rising.iter().map(|one| one.0));
        let line = linear(&design, &wanted).ok()?;
        let left_v = (line.squares / (rising.len() as f64 - 2.0).max(1.0)).sqrt();
        let key = ["dead_zone_supply_V", "dead_zone_exhaust_V"][path];
        let what = [
            "opening at which the supply path begins to rise",
            "opening at which the exhaust path begins to rise",
        ];
        // Rows are in volts, not in units of a deviation: what they leave is the deviation.
        let deviation = left_v * line.deviations[1].min(1.0);
        Some(Number::named(
            key,
            what[path],
            "V",
            (line.values[1], deviation),
        ))
    }

    /// Opening, area and deviation of a path's commands.
    pub(super) fn of_path(&self, path: usize) -> &[OpenPoint] {
        &self.paths[path]
    }

    /// The area that was found for a point's command.
    pub(super) fn area_at(&self, point: &FlowPoint) -> Option<f64> {
        let opening_v = self.opening_v(point);
        let path = &self.paths[usize::from(opening_v < 0.0)];
        let near = |one: &&OpenPoint| (one.0 - opening_v.abs()).abs() < 0.01;
        path.iter().find(near).map(|one| one.1)
    }

    /// Flows of the widest command, of those that were held over several pressures if there are such.
    pub(super) fn largest_path(&self, points: &[FlowPoint]) -> Vec<(FlowPoint, f64)> {
        let groups = by_command(points);
        let most = groups.iter().map(Vec::len).max().unwrap_or(0);
        let held_over = if most >= iso6358::LEAST_POINTS {
            iso6358::LEAST_POINTS
        } else {
            1
        };
        let of_several = groups.into_iter().filter(|group| group.len() >= held_over);
        let widest = of_several.max_by(|a, b| {
            let key = |group: &[FlowPoint]| (group[0].is_fed(), self.opening_v(&group[0]).abs());
            let (a, b) = (key(a), key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        let group = widest.unwrap_or_default();
        let area = group
            .first()
            .and_then(|one| self.area_at(one))
            .unwrap_or(0.0);
        group.into_iter().map(|one| (one, area)).collect()
    }

    pub(super) fn with_shape_share(mut self, share: f64) -> Self {
        self.shape_share = share.hypot(SHAPE_ERROR);
        self
    }

    /// Of an area at an opening: of the point, of what the curve is between points, of the null,
    /// which moves the curve, and of the law's shape.
    fn deviation_m2(&self, path: usize, opening_v: f64) -> f64 {
        let points = &self.paths[path];
        let above = points
            .partition_point(|one| one.0 < opening_v)
            .clamp(1, points.len().max(2) - 1);
        let (Some(from), Some(to)) = (points.get(above - 1), points.get(above)) else {
            return f64::INFINITY;
        };
        let slope = (to.1 - from.1) / (to.0 - from.0);
        let null_v = self.alike.as_ref().map_or(0.0, |alike| alike.deviations[0]);
        let area_m2 = from.1 + slope * (opening_v - from.0);
        nearest(points, opening_v)
            .hypot(slope * null_v)
            .hypot(self.shape_share * area_m2)
    }

    /// Both paths at the openings of either, the closed one first; as many points as a table has.
    pub(super) fn table(&self) -> Vec<AreaPoint> {
        let leakage_m2 = self.leakage_m2.unwrap_or(0.0);
        let factor = self.alike.as_ref().map_or(1.0, |alike| alike.values[1]);
        let base = usize::from(self.paths[0].len() < 2);
        let curves = self
            .paths
            .each_ref()
            .map(|path| smooth(path, self.leakage_m2));
        let mut table = vec![AreaPoint {
            opening_v: 0.0,
            area_m2: [Some(leakage_m2), Some(factor * leakage_m2)],
            deviation_m2: [0.0; 2],
        }];
        let mut largest = [leakage_m2, factor * leakage_m2];
        for one in &self.paths[base] {
            let mut area = |path: usize| {
                let curve = curves[path].as_ref()?;
                let last_v = self.paths[path].last()?.0;
                // A table's areas never fall: what does is noise.
                (one.0 <= last_v + 0.05).then(|| {
                    largest[path] = largest[path].max(curve.area_m2(one.0));
                    largest[path]
                })
            };
            table.push(AreaPoint {
                opening_v: one.0,
                area_m2: [area(0), area(1)],
                deviation_m2: [0, 1].map(|path| self.deviation_m2(path, one.0)),
            });
        }
        thinned(table)
    }
}

/// A smooth curve through points, from the leakage on.
fn smooth(points: &[OpenPoint], leakage_m2: Option<f64>) -> Option<AreaTable<f64>> {
    let leakage_m2 = leakage_m2.unwrap_or(0.0);
    let (mut openings, mut areas) = (vec![0.0], vec![leakage_m2]);
    for &(opening_v, area_m2, _) in points {
        let before_v = openings[openings.len() - 1];
        if opening_v > before_v + 1e-6 {
            openings.push(opening_v);
            areas.push(area_m2.max(areas[areas.len() - 1]));
        }
    }
    let keep = MOST_POINTS.min(openings.len());
    let place = |slot: usize| slot * (openings.len() - 1) / (keep - 1).max(1);
    let pick = |all: &[f64]| -> Vec<f64> { (0..keep).map(|slot| all[place(slot)]).collect() };
    let table = AreaTable::new(&pick(&openings), &pick(&areas)).ok()?;
    Some(table.curved(None, 1.0))
}

/// The deviation of the point next to an opening.
fn nearest(points: &[OpenPoint], opening_v: f64) -> f64 {
    let distance = |one: &&OpenPoint| (one.0 - opening_v).abs();
    let next = points
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    next.map_or(f64::INFINITY, |one| one.2)
}

/// As many points as a rig file's table has: the ones nearest to their neighbours' chord go.
fn thinned(mut table: Vec<AreaPoint>) -> Vec<AreaPoint> {
    while table.len() > MOST_POINTS {
        let off_chord = |place: usize| {
            let [from, at, to] = [-1, 0, 1].map(|by: isize| table[place.saturating_add_signed(by)]);
            let along = (at.opening_v - from.opening_v) / (to.opening_v - from.opening_v);
            let of = |path: usize| {
                let area = |one: AreaPoint| one.area_m2[path].unwrap_or(0.0);
                (area(at) - area(from) - along * (area(to) - area(from))).abs()
            };
            of(0).max(of(1))
        };
        let flattest = (1..table.len() - 1).min_by(|a, b| off_chord(*a).total_cmp(&off_chord(*b)));
        table.remove(flattest.unwrap_or(1));
    }
    table
}
