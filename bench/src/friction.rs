//! Friction at constant speeds, figures 10 to 13 of the paper.
//!
//! At constant speed the friction is what is left of the forces,
//!
//! ```text
//! Ff = (pa - p0) Aa - (pb - p0) Ab - F        F: the test machine's force against +x
//! ```
//!
//! and its curve over the speed is the paper's (11), at every pressure shifted by what the seals
//! are pressed with (figures 12 and 13):
//!
//! ```text
//! Ff = sign(v) [FC + (FS - FC) exp(-(v/vs)^2) + km (pa + pb - 2 p0)/2 + kd |pa - pb|] + s2 v + zero
//! ```
//!
//! Which terms the points show is decided by Schwarz's criterion; those that no point can show
//! (a fall at low speed without low speeds, a growth with pressure at one pressure) are not
//! sought. A force sensor's zero is free in every recording that moves both ways: the mean of both
//! directions is not friction.

use grey_box::fit::Parameter;
use grey_box::laws::Track;
use grey_box::model::Values;
use grey_box::rig::Rig;

use crate::least_squares::{Solved, fitted};
use crate::outcome::{Kind, Number, Outcome, Picture, Stretch};
use crate::steady;

/// The outcome depends on numbers under these sections.
pub const DEPENDS_ON: &[&str] = &["cylinder.", "environment."];
/// Speeds that differ by less than this factor are one speed.
const ONE_SPEED: f64 = 1.3;
/// Speeds of one direction from which a fall at low speed is sought, and what they must span: over
/// less, friction that differs by direction passes for it.
const SPEEDS_OF_A_CURVE: usize = 4;
const SPAN_OF_A_CURVE: f64 = 5.0;
/// What two speeds of one direction must span to show a viscous part.
const SPAN_OF_A_SLOPE: f64 = 2.0;
/// Pressures that differ by less are one pressure, Pa: a regulator holds some kPa.
const ONE_PRESSURE_PA: f64 = 2e4;

/// Part of the zeros' squares that a line over the pressures' force takes, if that is their cause.
const SHARED: f64 = 0.9;

/// One stretch at constant speed.
#[derive(Clone, Copy, Debug)]
struct Point {
    recording: usize,
    speed_m_per_s: f64,
    force_n: f64,
    deviation_n: f64,
    mean_gauge_pa: f64,
    difference_pa: f64,
    /// What the pressures push with.
    gas_n: f64,
}

/// Terms of the law that are sought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Terms {
    viscous: bool,
    falling: bool,
    with_mean: bool,
    with_difference: bool,
}

/// The law with its numbers.
struct Fitted {
    terms: Terms,
    zeros: Vec<Option<usize>>,
    solved: Solved,
}

/// Evaluates recordings at constant speeds.
///
/// # Errors
/// If no recording has them, or the rig lacks what the forces need.
pub fn measure(rig: &Rig, tracks: &[Track<'_>]) -> Result<Outcome, String> {
    let forces = Forces::of(rig, tracks)?;
    let mut points = Vec::new();
    let mut stretches = Vec::new();
    for (recording, track) in tracks.iter().enumerate() {
        for rows in steady::at_one_speed(track, rig) {
            let point = forces.point(track, recording, rows.clone());
            stretches.push(stretch(track, &rows, &point));
            points.push(point);
        }
    }
    if points.len() < 2 {
        return Err(
            "no stretches at constant speed were found: a friction curve needs several speeds, \
             each held over some millimetres"
                .into(),
        );
    }
    let best = best_law(&points, tracks.len(), forces.has_sensor)?;
    Ok(Outcome {
        title: "Friction",
        method: "Stretches at constant speed are found in the recorded position; there the friction \
                 is what is left of the forces. The curve is the paper's (11), fitted to the means of \
                 the stretches; terms that they do not show are left out.",
        numbers: numbers(&best),
        notes: notes(&best, &points, forces.has_sensor),
        pictures: pictures(rig, &best, &points),
        stretches,
        ..Outcome::default()
    })
}

/// What the forces of a row need.
struct Forces {
    ambient_pa: f64,
    area_m2: [f64; 2],
    external_n: f64,
    has_sensor: bool,
}

impl Forces {
    fn of(rig: &Rig, tracks: &[Track<'_>]) -> Result<Self, String> {
        let has = |signal: &str| {
            tracks
                .iter()
                .all(|one| one.recording.signal(signal).is_some())
        };
        if !has("x") {
            return Err("no position is recorded: friction is measured over the speed".into());
        }
        let has_sensor = has("force");
        let has_both_pressures = has("p_a") && has("p_b");
        if !(has_sensor || has_both_pressures) {
            return Err("neither a force nor both pressures are recorded: nothing says what moves the carriage".into());
        }
        let mut area_m2 = [0.0; 2];
        for (side, signal) in ["p_a", "p_b"].iter().enumerate() {
            let key = ["cylinder.area_a_m2", "cylinder.area_b_m2"][side];
            if has(signal) {
                area_m2[side] = rig.value(key).ok_or(format!(
                    "{key} is missing: {signal} is recorded and pushes the piston"
                ))?;
            }
        }
        let values = Values::<f64>::of(rig);
        let external_n = if has_sensor {
            0.0
        } else {
            values.carriage().external_force_n
        };
        Ok(Self {
            ambient_pa: rig.ambient_pressure_pa(),
            area_m2,
            external_n,
            has_sensor,
        })
    }

    fn point(&self, track: &Track<'_>, recording: usize, rows: std::ops::Range<usize>) -> Point {
        let signal = |name: &str| track.recording.signal(name).map(|all| &all[rows.clone()]);
        let gauge =
            |name: &str, row: usize| signal(name).map_or(0.0, |all| all[row] - self.ambient_pa);
        let time_s = &track.recording.time_s[rows.clone()];
        let position_m = signal("x").unwrap_or(&[]);
        let force_n: Vec<f64> = (0..rows.len())
            .map(|row| {
                let gas_n =
                    gauge("p_a", row) * self.area_m2[0] - gauge("p_b", row) * self.area_m2[1];
                gas_n - signal("force").map_or(0.0, |all| all[row]) - self.external_n
            })
            .collect();
        let (mean_n, deviation_n) = steady::mean_of_batches(&force_n);
        let over_rows = |of: &dyn Fn(usize) -> f64| {
            steady::mean(&(0..rows.len()).map(of).collect::<Vec<f64>>())
        };
        Point {
            recording,
            speed_m_per_s: steady::slope(time_s, position_m),
            force_n: mean_n,
            deviation_n: deviation_n.hypot(steady::FORCE_LINEARITY * mean_n),
            mean_gauge_pa: over_rows(&|row| 0.5 * (gauge("p_a", row) + gauge("p_b", row))),
            gas_n: over_rows(&|row| {
                gauge("p_a", row) * self.area_m2[0] - gauge("p_b", row) * self.area_m2[1]
            }),
            difference_pa: over_rows(&|row| (gauge("p_a", row) - gauge("p_b", row)).abs()),
        }
    }
}

fn stretch(track: &Track<'_>, rows: &std::ops::Range<usize>, point: &Point) -> Stretch {
    let what = format!(
        "{:.2} mm/s: {:.2} ± {:.2} N at {:.2} bar gauge in the mean",
        1e3 * point.speed_m_per_s,
        point.force_n,
        point.deviation_n,
        1e-5 * point.mean_gauge_pa
    );
    Stretch::of(track.recording, rows, what)
}

/// The law of the terms that the points show.
fn best_law(points: &[Point], recordings: usize, has_sensor: bool) -> Result<Fitted, String> {
    let zeros = zeros(points, recordings, has_sensor);
    let flags = [false, true];
    let mut best: Option<Fitted> = None;
    let can = shown_by(points);
    for with_mean in flags.into_iter().filter(|on| !on || can.with_mean) {
        for with_difference in flags.into_iter().filter(|on| !on || can.with_difference) {
            for viscous in flags.into_iter().filter(|on| !on || can.viscous) {
                for falling in flags.into_iter().filter(|on| !on || can.falling) {
                    let terms = Terms {
                        viscous,
                        falling,
                        with_mean,
                        with_difference,
                    };
                    if let Some(one) = fit(points, terms, &zeros)
                        && best
                            .as_ref()
                            .is_none_or(|best| one.solved.bic() < best.solved.bic())
                    {
                        best = Some(one);
                    }
                }
            }
        }
    }
    best.ok_or_else(|| {
        format!(
            "{} stretches at constant speed do not determine a friction",
            points.len()
        )
    })
}

/// Which recordings' zero of force is free, by its place among the zeros.
fn zeros(points: &[Point], recordings: usize, has_sensor: bool) -> Vec<Option<usize>> {
    let mut count = 0;
    (0..recordings)
        .map(|recording| {
            let moves = |sign: f64| {
                points
                    .iter()
                    .any(|one| one.recording == recording && one.speed_m_per_s * sign > 0.0)
            };
            (has_sensor && moves(1.0) && moves(-1.0)).then(|| {
                count += 1;
                count - 1
            })
        })
        .collect()
}

/// Which terms the points can show at all.
fn shown_by(points: &[Point]) -> Terms {
    let speeds = |sign: f64| {
        let mut speeds: Vec<f64> = points
            .iter()
            .map(|one| one.speed_m_per_s * sign)
            .filter(|speed| *speed > 0.0)
            .collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup_by(|next, before| *next < ONE_SPEED * *before);
        speeds
    };
    let both = [speeds(1.0), speeds(-1.0)];
    let span = |speeds: &[f64]| match (speeds.first(), speeds.last()) {
        (Some(slowest), Some(fastest)) => fastest / slowest,
        _ => 1.0,
    };
    let any = |count: usize, least_span: f64| {
        both.iter()
            .any(|speeds| speeds.len() >= count && span(speeds) >= least_span)
    };
    let spread = |of: fn(&Point) -> f64| {
        let all = points.iter().map(of);
        all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
    };
    Terms {
        viscous: any(2, SPAN_OF_A_SLOPE),
        falling: any(SPEEDS_OF_A_CURVE, SPAN_OF_A_CURVE),
        with_mean: spread(|one| one.mean_gauge_pa) > ONE_PRESSURE_PA,
        with_difference: spread(|one| one.difference_pa) > ONE_PRESSURE_PA,
    }
}

/// What the points span: sizes for starts and bounds.
struct Spans {
    largest_n: f64,
    fastest: f64,
    slowest: f64,
}

impl Spans {
    fn of(points: &[Point]) -> Self {
        let speeds = points.iter().map(|one| one.speed_m_per_s.abs());
        let forces = points.iter().map(|one| one.force_n.abs());
        Self {
            largest_n: forces.fold(0.0, f64::max),
            fastest: speeds.clone().fold(0.0, f64::max),
            slowest: speeds.fold(f64::INFINITY, f64::min),
        }
    }

    /// Coulomb level, viscous friction, further static level, Stribeck velocity, both growths; those
    /// that are not sought are held at nothing.
    fn parameters(&self, terms: Terms, stribeck_start: f64) -> Vec<Parameter> {
        let free = |on: bool, start: f64, (lower, upper): (f64, f64)| {
            let start = if on { start } else { 0.0 };
            let (lower, upper) = if on { (lower, upper) } else { (start, start) };
            Parameter::new(start).bounded(lower, upper)
        };
        let (largest_n, per_pa) = (self.largest_n, self.largest_n / 1e5);
        let levels = (0.0, 10.0 * largest_n);
        let viscous = largest_n / self.fastest;
        let velocities = (0.3 * self.slowest, self.fastest);
        let velocity = (stribeck_start * self.slowest).clamp(velocities.0, velocities.1);
        let held = (velocity, velocity);
        let growths = (-per_pa, per_pa);
        vec![
            free(true, 0.7 * largest_n, levels),
            free(terms.viscous, 0.0, (0.0, 100.0 * viscous)).with_scale(viscous),
            free(terms.falling, 0.2 * largest_n, levels).with_scale(largest_n),
            free(
                true,
                velocity,
                if terms.falling { velocities } else { held },
            ),
            free(terms.with_mean, 0.0, growths).with_scale(0.01 * per_pa),
            free(terms.with_difference, 0.0, growths).with_scale(0.01 * per_pa),
        ]
    }
}

/// The numbers of some terms, and the zeros.
fn fit(points: &[Point], terms: Terms, zeros: &[Option<usize>]) -> Option<Fitted> {
    let spans = Spans::of(points);
    let starts: &[f64] = if terms.falling {
        &[1.5, 4.0, 10.0]
    } else {
        &[1.0]
    };
    let residuals = |numbers: &[f64]| -> Vec<f64> {
        let off = |one: &Point| (one.force_n - law_n(numbers, one, zeros)) / one.deviation_n;
        points.iter().map(off).collect()
    };
    let mut best: Option<Solved> = None;
    for start in starts {
        let mut parameters = spans.parameters(terms, *start);
        let zero = Parameter::new(0.0).with_scale(1.0);
        parameters.extend(zeros.iter().flatten().map(|_| zero));
        let solved = fitted(&parameters, &residuals).ok()?;
        if best
            .as_ref()
            .is_none_or(|best| solved.squares < best.squares)
        {
            best = Some(solved);
        }
    }
    Some(Fitted {
        terms,
        zeros: zeros.to_vec(),
        solved: best.filter(|solved| solved.rows > solved.free)?,
    })
}

fn law_n(numbers: &[f64], point: &Point, zeros: &[Option<usize>]) -> f64 {
    let zero_n = zeros[point.recording].map_or(0.0, |place| numbers[6 + place]);
    zero_n
        + friction_n(
            numbers,
            point.speed_m_per_s,
            [point.mean_gauge_pa, point.difference_pa],
        )
}

fn friction_n(numbers: &[f64], speed_m_per_s: f64, [mean_pa, difference_pa]: [f64; 2]) -> f64 {
    let fall = (-(speed_m_per_s / numbers[3]).powi(2)).exp();
    let dry_n = numbers[0] + numbers[2] * fall + numbers[4] * mean_pa + numbers[5] * difference_pa;
    speed_m_per_s.signum() * dry_n + numbers[1] * speed_m_per_s
}

fn numbers(fitted: &Fitted) -> Vec<Number> {
    let (solved, terms) = (&fitted.solved, fitted.terms);
    let coulomb = solved.at(0);
    let mut numbers = vec![Number::of_key("friction.coulomb_N", coulomb.0, coulomb.1)];
    if terms.viscous {
        let (value, deviation) = solved.at(1);
        numbers.push(Number::of_key("friction.viscous_Ns_m", value, deviation));
    }
    if terms.falling {
        let static_n = coulomb.0 + solved.values[2];
        numbers.push(Number::of_key(
            "friction.static_N",
            static_n,
            solved.deviation_of_sum(0, 2),
        ));
        let (value, deviation) = solved.at(3);
        let number = Number::of_key("friction.stribeck_velocity_m_s", value, deviation);
        numbers.push(number.shown_in("mm/s", 1e3));
    }
    let effect = "effects.pressure-dependent-friction";
    for (place, on, key) in [
        (4, terms.with_mean, "per_mean_pressure_N_Pa"),
        (5, terms.with_difference, "per_pressure_difference_N_Pa"),
    ] {
        if on {
            let (value, deviation) = solved.at(place);
            let number = Number::of_key(&format!("{effect}.{key}"), value, deviation);
            numbers.push(number.shown_in("N/bar", 1e5));
        }
    }
    numbers
}

fn notes(fitted: &Fitted, points: &[Point], has_sensor: bool) -> Vec<String> {
    let mut notes = Vec::new();
    if !has_sensor {
        notes.push(
            "no force is recorded: whatever moves the carriage beside the pressures passes for friction"
                .into(),
        );
    }
    let can = shown_by(points);
    let terms = fitted.terms;
    if !can.viscous {
        notes.push(
            "the speeds of each direction span less than a factor of two: a viscous part cannot be told from the dry one"
                .into(),
        );
    } else if !terms.viscous {
        notes.push("the points show no viscous friction".into());
    }
    if !can.falling {
        notes.push(format!(
            "no direction has {SPEEDS_OF_A_CURVE} speeds that span a factor of {SPAN_OF_A_CURVE}: static friction and Stribeck velocity were not sought"
        ));
    } else if !terms.falling {
        notes.push("the friction does not fall with the speed where it was measured: static friction and Stribeck velocity stay as they are; measure at lower speeds".into());
    }
    if !can.with_mean {
        let pressure_bar = 1e-5
            * steady::mean(
                &points
                    .iter()
                    .map(|one| one.mean_gauge_pa)
                    .collect::<Vec<f64>>(),
            );
        notes.push(format!(
            "all stretches are at {pressure_bar:.1} bar gauge: friction grows with pressure as a rule, and these levels hold there"
        ));
    }
    notes.extend(area_off(fitted, points));
    for (recording, place) in fitted.zeros.iter().enumerate() {
        if let Some(place) = place {
            let (zero_n, deviation_n) = fitted.solved.at(6 + place);
            if zero_n.abs() > 3.0 * deviation_n {
                notes.push(format!(
                    "in recording {} both directions differ by twice {zero_n:.2} ± {deviation_n:.2} N: the zero of the force sensor, a weight, or friction that differs by direction",
                    recording + 1
                ));
            }
        }
    }
    notes
}

/// Zeros that grow with the pressures' force say that an area or a gauge's gain is off.
fn area_off(fitted: &Fitted, points: &[Point]) -> Option<String> {
    let zeros: Vec<(f64, f64)> = (0..fitted.zeros.len())
        .filter_map(|recording| {
            let zero_n = fitted.solved.values[6 + fitted.zeros[recording]?];
            let gas_n = points.iter().filter(|one| one.recording == recording);
            let gas_n: Vec<f64> = gas_n.map(|one| one.gas_n).collect();
            Some((steady::mean(&gas_n), zero_n))
        })
        .collect();
    let (gas_n, zero_n): (Vec<f64>, Vec<f64>) = zeros.into_iter().unzip();
    if gas_n.len() < 3 {
        return None;
    }
    let share = steady::slope(&gas_n, &zero_n);
    let (gas_middle, zero_middle) = (steady::mean(&gas_n), steady::mean(&zero_n));
    let squares =
        |of: &dyn Fn(usize) -> f64| (0..gas_n.len()).map(|one| of(one).powi(2)).sum::<f64>();
    let all = squares(&|one| zero_n[one] - zero_middle);
    let left = squares(&|one| zero_n[one] - zero_middle - share * (gas_n[one] - gas_middle));
    (left < (1.0 - SHARED) * all).then(|| {
        format!(
            "the mean of both directions grows with the pressures' force, by {:.1} % of it: a piston area, or the gain of a gauge or of the force sensor, is off by so much",
            100.0 * share
        )
    })
}

fn pictures(rig: &Rig, fitted: &Fitted, points: &[Point]) -> Vec<Picture> {
    let numbers = &fitted.solved.values;
    let level = |one: &Point| (one.mean_gauge_pa / ONE_PRESSURE_PA).round();
    let mut levels: Vec<(f64, [f64; 2])> = Vec::new();
    for point in points {
        if !levels.iter().any(|(of, _)| (of - level(point)).abs() < 0.5) {
            levels.push((level(point), [point.mean_gauge_pa, point.difference_pa]));
        }
    }
    let fastest = points
        .iter()
        .map(|one| one.speed_m_per_s.abs())
        .fold(0.0, f64::max);
    let mut curve = Picture::new(
        "Friction over the speed",
        ("speed", "mm/s"),
        ("friction", "N"),
    );
    for (of, pressures_pa) in &levels {
        let shown = points.iter().filter(|one| (level(one) - of).abs() < 0.5);
        let zero_n =
            |one: &Point| fitted.zeros[one.recording].map_or(0.0, |place| numbers[6 + place]);
        let measured = shown.map(|one| (1e3 * one.speed_m_per_s, one.force_n - zero_n(one)));
        let at = format!("{:.1} bar gauge", 1e-5 * pressures_pa[0]);
        curve = curve.with(format!("measured, {at}"), Kind::Points, measured.collect());
        let law =
            speeds(fastest).map(|speed| (1e3 * speed, friction_n(numbers, speed, *pressures_pa)));
        curve = curve.with(format!("law, {at}"), Kind::Law, law.collect());
    }
    let declared = Values::<f64>::of(rig);
    if rig.friction.is_some() {
        let (levels, bristle) = (declared.friction_levels(), declared.bristle());
        let law = speeds(fastest).map(|speed| (1e3 * speed, levels.steady_n(&bristle, speed)));
        curve = curve.with("rig file", Kind::Given, law.collect());
    }
    let mut left = Picture::new(
        "What the law leaves",
        ("speed", "mm/s"),
        ("measured less law", "N"),
    );
    let residual = |one: &Point| {
        (
            1e3 * one.speed_m_per_s,
            one.force_n - law_n(numbers, one, &fitted.zeros),
        )
    };
    left = left.with(
        "stretches",
        Kind::Points,
        points.iter().map(residual).collect(),
    );
    let mut pictures = vec![curve];
    pictures.extend(over_pressure(fitted, points));
    pictures.push(left);
    pictures
}

/// The dry friction of every stretch over the pressure that it grows with, figures 12 and 13.
fn over_pressure(fitted: &Fitted, points: &[Point]) -> Option<Picture> {
    let numbers = &fitted.solved.values;
    let terms = fitted.terms;
    let (name, place, of): (&str, usize, fn(&Point) -> f64) =
        if terms.with_difference && !terms.with_mean {
            ("pressure difference", 5, |one| one.difference_pa)
        } else if terms.with_mean {
            ("mean gauge pressure", 4, |one| one.mean_gauge_pa)
        } else {
            return None;
        };
    let dry_n = |one: &Point| {
        let zero_n = fitted.zeros[one.recording].map_or(0.0, |place| numbers[6 + place]);
        let fall = (-(one.speed_m_per_s / numbers[3]).powi(2)).exp();
        let sliding_n = (one.force_n - zero_n - numbers[1] * one.speed_m_per_s).abs();
        (1e-5 * of(one), sliding_n - numbers[2] * fall)
    };
    let highest_pa = points.iter().map(of).fold(0.0, f64::max);
    let line = [0.0, highest_pa].map(|at_pa| (1e-5 * at_pa, numbers[0] + numbers[place] * at_pa));
    let title = format!("Coulomb friction over the {name}");
    let picture = Picture::new(title, (name, "bar"), ("friction", "N")).with(
        "stretches, less viscous part and rise at low speed",
        Kind::Points,
        points.iter().map(dry_n).collect(),
    );
    Some(picture.with("law", Kind::Law, line.to_vec()))
}

/// Speeds for a curve in both directions, dense where it falls.
fn speeds(fastest: f64) -> impl Iterator<Item = f64> {
    const HALF: i32 = 120;
    (-HALF..=HALF)
        .filter(|place| *place != 0)
        .map(move |place| {
            fastest * f64::from(place).signum() * (f64::from(place) / f64::from(HALF)).powi(2)
        })
}
