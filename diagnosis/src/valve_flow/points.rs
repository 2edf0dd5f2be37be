//! The measured valve, and the rig file that has it.

use super::areas::{Areas, Grid};
use super::{Alignment, Point, ValveFlow};
use crate::rig::Rig;
use model_core::valve::AreaTable;

/// Points that a table gets at the most.
const MOST_POINTS: usize = 24;
/// How far a table may be from the estimate between its points, as a part of the area there and of
/// the full area: a tenth of what the estimate is good for.
const LOCAL_ERROR: f64 = 0.005;
const FULL_ERROR: f64 = 2e-4;
/// What heat, volumes and the smoothing of the motion leave in an area, one standard deviation, as a
/// part of it: rms over the exhausts of drawn axes with usual noise (seeds 501 to 506 of another
/// plant, `cargo run -p diagnosis --example valve_flow 501 507`).
const BALANCE_ERROR: f64 = 0.03;
/// One standard deviation of both areas as a whole, as a part of them: on drawn axes they are off by
/// 1 to 5 % where the recordings open that far (the same example).
pub(super) const AREA_DEVIATION: f64 = 0.05;
/// That of the openings, likewise.
const OPENING_DEVIATION: f64 = 0.01;
/// Of a valve that is later than this, s, twice what the spool of a data sheet is, the curve is known no better than
/// the rig states: it has taken up what the valve's lag is unlike the one that was tried. (Behind a spool of
/// 16 Hz the openings came out 8 % and the exhausts 24 % off.)
const LATE_S: f64 = 5e-3;
/// The numbers of the curve, as parts of the tables.
const CURVE: [&str; 3] = [
    "valve.opening_V",
    "valve.supply_area_m2",
    "valve.exhaust_area_m2",
];
/// That of the null, V.
const NULL_DEVIATION_V: f64 = 0.01;
/// That of dead volumes, as a part of them.
const DEAD_VOLUME_DEVIATION: f64 = 0.1;

pub(super) fn measured(
    grid: &Grid,
    areas: &Areas,
    at: Alignment,
    critical_pressure_ratio: f64,
) -> ValveFlow {
    let point = |(place, opening_v): (usize, &f64)| Point {
        opening_v: *opening_v,
        area_m2: areas.area_m2.each_ref().map(|curve| curve[place]),
        deviation_m2: [0, 1].map(|path| {
            areas.deviation_m2[path][place].hypot(BALANCE_ERROR * areas.area_m2[path][place])
        }),
    };
    ValveFlow {
        null_v: at.null_v,
        lag_s: at.lag_s,
        critical_pressure_ratio,
        points: grid.opening_v.iter().enumerate().map(point).collect(),
        dead_volume_m3: areas.dead_volume_m3,
        piston_leak_m2: areas.leak_m2,
        misfit: areas.misfit,
    }
}

impl ValveFlow {
    /// The points that a table needs: between them the estimate is a chord.
    pub fn table(&self) -> Vec<Point> {
        let last = self.points.len() - 1;
        let mut kept = vec![0, last];
        while kept.len() < MOST_POINTS {
            let worst = kept
                .windows(2)
                .flat_map(|pair| {
                    (pair[0] + 1..pair[1])
                        .map(|place| (self.off_chord(pair[0], pair[1], place), place))
                })
                .max_by(|one, other| one.0.total_cmp(&other.0));
            let Some((_, place)) = worst.filter(|(off, _)| *off > 1.0) else {
                break;
            };
            kept.push(place);
            kept.sort_unstable();
        }
        kept.into_iter().map(|place| self.points[place]).collect()
    }

    /// How far a point is from the chord of two others, in units of what is allowed.
    fn off_chord(&self, from: usize, to: usize, place: usize) -> f64 {
        let [from, to, at] = [from, to, place].map(|place| self.points[place]);
        let along = (at.opening_v - from.opening_v) / (to.opening_v - from.opening_v);
        let of_path = |path: usize| {
            let chord_m2 = from.area_m2[path] + along * (to.area_m2[path] - from.area_m2[path]);
            let full_m2 = self.points.last().map_or(0.0, |last| last.area_m2[path]);
            let allowed_m2 = LOCAL_ERROR * at.area_m2[path] + FULL_ERROR * full_m2;
            (at.area_m2[path] - chord_m2).abs() / allowed_m2
        };
        of_path(0).max(of_path(1))
    }

    /// The rig with the measured valve. Beyond the largest recorded opening its own curve goes on.
    pub fn applied(&self, rig: &Rig) -> Rig {
        let mut improved = rig.clone();
        let Some(valve) = improved.valve.as_mut() else {
            return improved;
        };
        let table = self.table();
        let before = std::mem::take(&mut valve.opening_v);
        let curves = [
            std::mem::take(&mut valve.supply_area_m2),
            std::mem::take(&mut valve.exhaust_area_m2),
        ];
        valve.opening_v = table.iter().map(|point| point.opening_v).collect();
        let mut areas = [0, 1].map(|path| {
            table
                .iter()
                .map(|point| point.area_m2[path])
                .collect::<Vec<f64>>()
        });
        if let (Some(shown), Some(&full_v)) = (table.last(), before.last())
            && full_v > 1.02 * shown.opening_v
        {
            valve.opening_v.push(full_v);
            for (path, curve) in curves.iter().enumerate() {
                let there = AreaTable::new(&before, curve).map(|own| own.area_m2(shown.opening_v));
                let full = curve.last().copied().zip(there.ok());
                let grown = full.map_or(1.0, |(full, there)| (full / there).max(1.0));
                areas[path].push(shown.area_m2[path] * grown);
            }
        }
        [valve.supply_area_m2, valve.exhaust_area_m2] = areas;
        for numbers in [
            &mut valve.opening_v,
            &mut valve.supply_area_m2,
            &mut valve.exhaust_area_m2,
        ] {
            numbers.iter_mut().for_each(|one| *one = rounded(*one));
        }
        valve.null_v = rounded(self.null_v);
        valve.critical_pressure_ratio = rounded(self.critical_pressure_ratio);
        valve.stated_flow = None;
        if let Some(cylinder) = improved.cylinder.as_mut() {
            cylinder.dead_volume_a_m3 = Some(rounded(self.dead_volume_m3[0]));
            cylinder.dead_volume_b_m3 = Some(rounded(self.dead_volume_m3[1]));
        }
        self.state_deviations(rig, &mut improved);
        improved
    }

    /// How well its numbers are known, in place of what the rig states.
    fn state_deviations(&self, rig: &Rig, improved: &mut Rig) {
        for (key, deviation) in [
            ("valve.null_V", NULL_DEVIATION_V),
            ("valve.opening_V", OPENING_DEVIATION),
            ("valve.supply_area_m2", AREA_DEVIATION),
            ("valve.exhaust_area_m2", AREA_DEVIATION),
            ("cylinder.dead_volume_a_m3", DEAD_VOLUME_DEVIATION),
            ("cylinder.dead_volume_b_m3", DEAD_VOLUME_DEVIATION),
        ] {
            // What the balance is off by beyond what it allows, the numbers may be off by as well (the
            // scale factor of Birge 1932).
            let measured = self.misfit.max(1.0) * deviation;
            let stated = CURVE
                .contains(&key)
                .then(|| rig.uncertainty_sd(key))
                .flatten();
            let deviation = match stated {
                Some(stated) if self.lag_s > LATE_S => stated.max(measured),
                _ => measured,
            };
            improved.uncertainty.insert(key.to_owned(), deviation);
        }
    }
}

/// Five digits: a tenth of what any of the estimates is good for.
fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}
