//! Dead volumes of chambers that are shut, with the piston at several places.
//!
//! At rest the gas has the wall's temperature, so that a chamber that keeps its mass has
//!
//! ```text
//! p (Vd + A l) = m R T_wall
//! ```
//!
//! at every place: two unknowns, linear. A piston that leaks moves mass from one chamber into the
//! other in proportion to what was recorded, the time integral of `pa^2 - pb^2` for a gap, of
//! `sign(pa - pb) sqrt|pa^2 - pb^2|` for a hole: one unknown more, the same in both chambers.

use std::ops::Range;

use grey_box::laws::Track;
use grey_box::model::{Side, Values};
use grey_box::rig::Rig;
use nalgebra::{DMatrix, DVector};

use crate::least_squares::{Solved, linear};
use crate::outcome::{Kind, Number, Outcome, Picture, Stretch};
use crate::settling::{self, Reference, settled};
use crate::steady;

/// The outcome depends on numbers under these sections.
pub const DEPENDS_ON: &[&str] = &[
    "cylinder.area",
    "cylinder.stroke_m",
    "environment.temperature_K",
    "environment.pressure_Pa",
];
/// A piston that moves less is at rest, m ...
const AT_REST_M: f64 = 2e-4;
/// ... for this time at least, s: the gas takes the wall's temperature in about one.
const LEAST_DWELL_S: f64 = 2.0;
/// Places that are closer than this part of the stroke are one.
const ONE_PLACE_SHARE: f64 = 0.02;

/// One chamber at one place, settled.
#[derive(Clone, Copy, Debug)]
struct Point {
    chamber: usize,
    recording: usize,
    length_m: f64,
    pressure_pa: f64,
    deviation_pa: f64,
    /// Time integrals of a gap's and of a hole's flow from chamber A to B, Pa2 s and Pa s.
    leaked: [f64; 2],
}

/// How the piston may leak, and the unit in which its number is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Leak {
    None,
    Gap,
    Hole,
}

/// Evaluates recordings with shut chambers.
///
/// # Errors
/// If there are not enough places, or the rig does not say areas and stroke.
pub fn measure(rig: &Rig, tracks: &[Track<'_>]) -> Result<Outcome, String> {
    let geometry = Geometry::of(rig)?;
    let mut points = Vec::new();
    let mut stretches = Vec::new();
    for (recording, track) in tracks.iter().enumerate() {
        let position_m = track
            .recording
            .signal("x")
            .ok_or("no position is recorded: the piston's place says how the volume changes")?;
        let leaked = leaked(track);
        for rows in dwells(track, position_m) {
            let mut said = format!(
                "at {:.1} mm:",
                1e3 * steady::mean(&position_m[rows.clone()])
            );
            for side in Side::BOTH {
                if let Some(point) = geometry.point(rig, track, (side, recording), &rows, &leaked) {
                    said += &format!(
                        " chamber {} {:.2} ± {:.2} kPa",
                        side.letter().to_ascii_uppercase(),
                        1e-3 * point.pressure_pa,
                        1e-3 * point.deviation_pa
                    );
                    points.push(point);
                }
            }
            stretches.push(Stretch::of(track.recording, &rows, said));
        }
    }
    let chambers: Vec<usize> = (0..2)
        .filter(|one| geometry.has_places(&points, *one))
        .collect();
    if chambers.is_empty() {
        return Err(format!(
            "a dead volume needs a shut chamber with the piston at rest at three places, {LEAST_DWELL_S} s at each; {} were found",
            stretches.len()
        ));
    }
    points.retain(|one| chambers.contains(&one.chamber));
    outcome(&geometry, &chambers, &points, stretches)
}

fn outcome(
    geometry: &Geometry,
    chambers: &[usize],
    points: &[Point],
    stretches: Vec<Stretch>,
) -> Result<Outcome, String> {
    let mut best = (Leak::None, solve(geometry, chambers, points, Leak::None)?);
    for leak in [Leak::Gap, Leak::Hole] {
        if chambers.len() == 2
            && let Ok(solved) = solve(geometry, chambers, points, leak)
            && solved.rows > solved.free
            && solved.bic() < best.1.bic()
        {
            best = (leak, solved);
        }
    }
    let (leak, solved) = best;
    let mut numbers = Vec::new();
    for (place, chamber) in chambers.iter().enumerate() {
        let key = ["cylinder.dead_volume_a_m3", "cylinder.dead_volume_b_m3"][*chamber];
        let (value, deviation) = solved.at(place);
        numbers.push(Number::of_key(key, value, deviation).shown_in("cm3", 1e6));
    }
    let mut notes = Vec::new();
    if leak != Leak::None {
        notes.push(
            "gas passes the piston while the chambers are shut; it is taken into account, and `pneuma diagnose` says whether it matters".into(),
        );
    }
    Ok(Outcome {
        title: "Dead volume",
        method: "With both ports shut and the gas at the wall's temperature, pressure times volume stays: from the \
                 settled pressures at several places of the piston the volume that is left at the end of the stroke \
                 follows by linear least squares.",
        numbers,
        stretches,
        notes,
        pictures: vec![picture(geometry, chambers, points, &solved)],
        ..Outcome::default()
    })
}

struct Geometry {
    area_m2: [Option<f64>; 2],
    length_m: [Box<dyn Fn(f64) -> f64>; 2],
    stroke_m: f64,
}

impl Geometry {
    fn of(rig: &Rig) -> Result<Self, String> {
        let mut probe = rig.clone();
        // The dead volumes are what is sought: a rig without them has the lengths all the same.
        if let Some(cylinder) = probe.cylinder.as_mut() {
            cylinder.dead_volume_a_m3.get_or_insert(0.0);
            cylinder.dead_volume_b_m3.get_or_insert(0.0);
        }
        let values = Values::<f64>::of(&probe);
        let of = |side: Side| values.geometry(side);
        let missing = "[cylinder] must say stroke_m, position_zero and the piston areas";
        if Side::BOTH.iter().all(|side| of(*side).is_none()) {
            return Err(missing.into());
        }
        let length = |side: Side| -> Box<dyn Fn(f64) -> f64> {
            let geometry = of(side);
            Box::new(move |position_m| geometry.map_or(0.0, |one| one.length_m(position_m)))
        };
        Ok(Self {
            area_m2: Side::BOTH.map(|side| of(side).map(|one| one.area_m2)),
            length_m: [length(Side::A), length(Side::B)],
            stroke_m: values.get("cylinder.stroke_m").ok_or(missing)?,
        })
    }

    fn point(
        &self,
        rig: &Rig,
        track: &Track<'_>,
        (side, recording): (Side, usize),
        rows: &Range<usize>,
        leaked: &[[f64; 2]],
    ) -> Option<Point> {
        let chamber = side as usize;
        self.area_m2[chamber]?;
        let pressure_pa = track.recording.signal(side.pressure_signal())?;
        let noise_pa = steady::signal_noise(rig, side.pressure_signal(), pressure_pa);
        let heat_ratio = Values::<f64>::of(rig).gas().heat_capacity_ratio;
        let time_s = &track.recording.time_s;
        let last = rows.end - 1;
        let leak = settling::Leak::steady(&time_s[rows.clone()]);
        let settled = settled(
            &time_s[rows.clone()],
            &pressure_pa[rows.clone()],
            (&leak, Reference::End),
            (noise_pa, heat_ratio),
        )
        .ok()?;
        let position_m = track.recording.signal("x")?;
        Some(Point {
            chamber,
            recording,
            length_m: (self.length_m[chamber])(steady::mean(&position_m[rows.clone()])),
            pressure_pa: settled.pressure_pa,
            deviation_pa: settled
                .deviation_pa
                .hypot(steady::GAUGE_LINEARITY * settled.pressure_pa),
            leaked: leaked[last],
        })
    }

    fn has_places(&self, points: &[Point], chamber: usize) -> bool {
        let mut lengths: Vec<f64> = points
            .iter()
            .filter(|one| one.chamber == chamber)
            .map(|one| one.length_m)
            .collect();
        lengths.sort_by(f64::total_cmp);
        lengths.dedup_by(|next, before| *next - *before < ONE_PLACE_SHARE * self.stroke_m);
        lengths.len() >= 3
    }
}

/// Stretches in which the piston rests.
fn dwells(track: &Track<'_>, position_m: &[f64]) -> Vec<Range<usize>> {
    let time_s = &track.recording.time_s;
    steady::held(position_m, AT_REST_M)
        .into_iter()
        .filter(|rows| time_s[rows.end - 1] - time_s[rows.start] >= LEAST_DWELL_S)
        .collect()
}

/// What a gap and a hole of unit size let past the piston up to each row.
fn leaked(track: &Track<'_>) -> Vec<[f64; 2]> {
    let recording = track.recording;
    let (Some(a), Some(b)) = (recording.signal("p_a"), recording.signal("p_b")) else {
        return vec![[0.0; 2]; recording.len()];
    };
    let mut sum = [0.0; 2];
    let mut all = vec![sum];
    for row in 1..recording.len() {
        let dt_s = recording.time_s[row] - recording.time_s[row - 1];
        let squares = a[row].powi(2) - b[row].powi(2);
        sum[0] += dt_s * squares;
        sum[1] += dt_s * squares.signum() * squares.abs().sqrt();
        all.push(sum);
    }
    all
}

/// Unknowns: dead volumes of the chambers, the constant of each chamber in each recording, the leak.
fn solve(
    geometry: &Geometry,
    chambers: &[usize],
    points: &[Point],
    leak: Leak,
) -> Result<Solved, String> {
    let mut constants: Vec<(usize, usize)> = points
        .iter()
        .map(|one| (one.chamber, one.recording))
        .collect();
    constants.sort_unstable();
    constants.dedup();
    let first = chambers.len();
    let unknowns = first + constants.len() + usize::from(leak != Leak::None);
    let mut design = DMatrix::zeros(points.len(), unknowns);
    let mut wanted = DVector::zeros(points.len());
    for (row, point) in points.iter().enumerate() {
        let area_m2 = geometry.area_m2[point.chamber].unwrap_or(0.0);
        let place = chambers
            .iter()
            .position(|one| *one == point.chamber)
            .unwrap_or(0);
        let stroke_m3 = area_m2 * point.length_m;
        // p (Vd + A l) = c - k I; the deviation is that of the pressure times the volume.
        let deviation = point.deviation_pa * (stroke_m3 + typical_dead_m3(geometry, point.chamber));
        let constant = constants
            .iter()
            .position(|one| *one == (point.chamber, point.recording))
            .unwrap_or(0);
        design[(row, place)] = point.pressure_pa / deviation;
        design[(row, first + constant)] = -1.0 / deviation;
        let lost = if point.chamber == 0 { 1.0 } else { -1.0 };
        match leak {
            Leak::None => {}
            Leak::Gap => design[(row, unknowns - 1)] = lost * point.leaked[0] / deviation,
            Leak::Hole => design[(row, unknowns - 1)] = lost * point.leaked[1] / deviation,
        }
        wanted[row] = -point.pressure_pa * stroke_m3 / deviation;
    }
    linear(&design, &wanted)
}

/// What a dead volume is about, m3: for the weights of the points only.
fn typical_dead_m3(geometry: &Geometry, chamber: usize) -> f64 {
    0.1 * geometry.area_m2[chamber].unwrap_or(0.0) * geometry.stroke_m
}

fn picture(geometry: &Geometry, chambers: &[usize], points: &[Point], solved: &Solved) -> Picture {
    let mut picture = Picture::new(
        "Volume per pressure: a straight line that meets the stroke's end at the dead volume",
        ("length of the chamber", "mm"),
        ("mass over pressure, as a volume", "cm³"),
    );
    let kinds = [Kind::Points, Kind::OtherPoints];
    for (place, chamber) in chambers.iter().enumerate() {
        let area_m2 = geometry.area_m2[*chamber].unwrap_or(0.0);
        let dead_m3 = solved.values[place];
        let of_chamber = points.iter().filter(|one| one.chamber == *chamber);
        let first = of_chamber.clone().next().map_or(0.0, |one| {
            one.pressure_pa * (dead_m3 + area_m2 * one.length_m)
        });
        let measured = of_chamber.map(|one| (1e3 * one.length_m, 1e6 * first / one.pressure_pa));
        let letter = ["A", "B"][*chamber];
        picture = picture.with(
            format!("chamber {letter}, settled"),
            kinds[place],
            measured.collect(),
        );
        let line = [0.0, geometry.stroke_m]
            .map(|length_m| (1e3 * length_m, 1e6 * (dead_m3 + area_m2 * length_m)));
        picture = picture.with(format!("chamber {letter}, law"), Kind::Law, line.to_vec());
    }
    picture
}
