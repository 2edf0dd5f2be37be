//! A table or an equation in the place of what no effect of the list explains.
//!
//! An effect of no list has no law to fit, but it has a shape. Where the force
//! balance misses something and no effect explains it, a force that is piecewise
//! linear over the position, or over the velocity, is fitted together with all
//! ordinary parameters; where chambers with a valve do, a shift of the valve's openings
//! over themselves (an amplifier that gives less the more it is asked for, edges that are worn), or
//! an error of a gauge over its pressure (a wrong gain, a bow).
//! It stays if stretches that were left out of the fit are plainly
//! better predicted with it than with the effects that were found (as well, if those come and go
//! at moments that were chosen to suit them), and then goes into
//! the improved rig as `[effects.unknown-force]`, `[effects.unknown-opening]` or
//! `[effects.unknown-reading]`: the simulator holds it like any effect, and so does the controller
//! but for a gauge's. The held-out recordings judge it as they judge a named one.
//!
//! Where a short equation of the force (`missing_force`) does as well as the best table, it stands
//! in its place: fewer numbers, and they mean something.
//!
//! Limits: nine knots over what was recorded (over the root of an opening), so a wave shorter than a quarter of it
//! does not show. A valve's openings are the same to either side. What goes with time, or has a
//! memory of its own, is located only.

use crate::effects::flow::unknown_opening::{opening_knots, shift_key};
use crate::effects::load::unknown_force::force_key;
use crate::effects::sensing::unknown_reading::error_key;
use crate::estimate::candidates::Candidate;
use crate::estimate::fold_squares::FoldSquares;
use crate::estimate::{Bench, Fitted};
use crate::fit::law_problem::{Folds, FreeParameter};
use crate::inspect::quantile;
use crate::laws::{Law, Track};
use crate::model::Side;
use crate::search::plain_ratio;
use crate::thresholds::AS_WELL;
use crate::unlisted::equation::Equation;
use crate::unlisted::missing_force;
use model_core::left_out::{KNOTS, knots};

/// A table that after a few iterations leaves so many times the amplitude that the named effects
/// leave will not end below them.
const HOPELESS: f64 = 5.0;

/// What is a table of what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A force over the position.
    ForceOverPosition,
    /// A force over the velocity.
    ForceOverVelocity,
    /// A shift of the valve's openings over the opening.
    ShiftOfOpenings,
    /// An error of a chamber's gauge over the pressure.
    ErrorOfGauge(Side),
}

/// What stands for a law that nobody has named.
#[derive(Clone, Debug)]
pub enum Stand {
    /// A table.
    Table(Shape),
    /// An equation, with its numbers as fitted.
    Equation(Equation),
}

impl Stand {
    /// The name in a rig file; no verdict names it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Table(shape) => shape.name(),
            Self::Equation(_) => missing_force::NAME,
        }
    }

    /// Its place in a verdict.
    pub fn place(&self) -> &'static str {
        match self {
            Self::Table(shape) => shape.place(),
            Self::Equation(_) => missing_force::PLACE,
        }
    }

    /// What it is, in words.
    pub fn phrase(&self) -> String {
        match self {
            Self::Table(shape) => format!("{}, as a table", shape.phrase()),
            Self::Equation(equation) => equation.phrase(),
        }
    }
}

/// A table or an equation that stood up to data it was not fitted to.
#[derive(Clone, Debug)]
pub struct Term {
    /// Its candidate.
    pub candidate: usize,
    /// What it is.
    pub stand: Stand,
    /// Part of the amplitude of the misfit, above the noise, that it takes away in
    /// data it was not fitted to.
    pub share: f64,
}

impl Term {
    /// Whether it is an equation.
    pub fn is_equation(&self) -> bool {
        matches!(self.stand, Stand::Equation(_))
    }

    /// Part of the misfit's energy above the noise that it takes away.
    pub fn explained(&self) -> f64 {
        1.0 - (1.0 - self.share).powi(2)
    }
}

impl Shape {
    /// The shapes that a law can hold.
    fn of(bench: &Bench<'_>) -> Vec<Self> {
        match bench.law {
            Law::Balance | Law::Force => vec![Self::ForceOverPosition, Self::ForceOverVelocity],
            Law::Chambers => {
                let openings = bench.rig.valve.as_ref().map(|_| Self::ShiftOfOpenings);
                let gauges = Side::BOTH.map(Self::ErrorOfGauge);
                openings.into_iter().chain(gauges).collect()
            }
            Law::Carriage | Law::Actuator | Law::ValveFlow | Law::Spool => Vec::new(),
        }
    }

    /// The name in a rig file; no verdict names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::ForceOverPosition | Self::ForceOverVelocity => "unknown-force",
            Self::ShiftOfOpenings => "unknown-opening",
            Self::ErrorOfGauge(_) => "unknown-reading",
        }
    }

    /// Its place in a verdict.
    pub fn place(self) -> &'static str {
        match self {
            Self::ForceOverPosition | Self::ForceOverVelocity => "force-balance",
            Self::ShiftOfOpenings => "valve-command",
            Self::ErrorOfGauge(side) => side.gauge_place(),
        }
    }

    /// What is tabled, and its unit.
    pub fn quantity(self) -> (&'static str, &'static str) {
        match self {
            Self::ForceOverPosition | Self::ForceOverVelocity => ("force", "N"),
            Self::ShiftOfOpenings => ("valve opening error", "V"),
            Self::ErrorOfGauge(_) => ("gauge error", "Pa"),
        }
    }

    /// What it is tabled over, and its unit.
    pub fn variable(self) -> (&'static str, &'static str) {
        match self {
            Self::ForceOverPosition => ("position", "m"),
            Self::ForceOverVelocity => ("velocity", "m/s"),
            Self::ShiftOfOpenings => ("opening", "V"),
            Self::ErrorOfGauge(_) => ("pressure", "Pa"),
        }
    }

    /// What is tabled, in words.
    pub fn phrase(self) -> String {
        let (quantity, variable) = (self.quantity().0, self.variable().0);
        let begins_with_a_vowel = quantity.starts_with(['a', 'e', 'i', 'o', 'u']);
        let article = if begins_with_a_vowel { "an" } else { "a" };
        format!("{article} {quantity} over the {variable}")
    }

    /// Least and largest value of the variable in the recordings.
    fn range(self, bench: &Bench<'_>) -> Option<(f64, f64)> {
        let empty = (f64::INFINITY, f64::NEG_INFINITY);
        let within = |(least, most): (f64, f64), value: f64| (least.min(value), most.max(value));
        let motions = || {
            bench
                .tracks
                .iter()
                .filter_map(|track| track.motion.as_ref())
        };
        let (from, to) = match self {
            Self::ForceOverPosition => motions()
                .flat_map(|motion| motion.position_m.iter().copied())
                .fold(empty, within),
            Self::ForceOverVelocity => motions()
                .flat_map(|motion| motion.velocity_m_per_s.iter().copied())
                .fold(empty, within),
            // A shut valve's opening says nothing: the knots are those of nine even pieces of its
            // root, but for the first.
            Self::ShiftOfOpenings => {
                let usual_v = usual_opening_v(bench)?;
                (usual_v / (KNOTS * KNOTS) as f64, usual_v)
            }
            Self::ErrorOfGauge(side) => {
                let tracks = bench.tracks.iter();
                tracks
                    .filter_map(|track| track.recording.signal(side.pressure_signal()))
                    .flat_map(|shown_pa| shown_pa.iter().copied())
                    .fold(empty, within)
            }
        };
        (from < to).then_some((from, to))
    }

    /// Where the knots lie.
    fn knots(self, from: f64, to: f64) -> [f64; KNOTS] {
        match self {
            Self::ShiftOfOpenings => opening_knots(from, to),
            _ => knots(from, to),
        }
    }

    fn candidate(self, bench: &Bench<'_>) -> Option<Candidate> {
        let (from, to) = self.range(bench)?;
        let mut ends = vec![("from", from), ("to", to)];
        if self == Self::ForceOverVelocity {
            ends.push(("of_velocity", 1.0));
        }
        let key = |knot| match self {
            Self::ForceOverPosition | Self::ForceOverVelocity => force_key(knot),
            Self::ShiftOfOpenings => shift_key(knot),
            Self::ErrorOfGauge(side) => error_key(side, knot),
        };
        let size = match self {
            Self::ForceOverPosition | Self::ForceOverVelocity => bench.largest_force_n(),
            Self::ShiftOfOpenings => LARGEST_SHIFT * to,
            Self::ErrorOfGauge(_) => LARGEST_ERROR * to,
        };
        let keys: Vec<String> = (0..KNOTS).map(key).collect();
        Some(Candidate::table(
            self.name(),
            self.place(),
            &ends,
            &keys,
            size,
        ))
    }
}

/// Part of the rows whose openings the knots lie over: all but spikes. Where a twentieth went
/// beyond the last knot, the table of an amplifier that saturates fitted the training recordings,
/// and failed on held-out ones that went there.
const USUAL: f64 = 0.999;

/// What few of the recorded openings go beyond, V.
fn usual_opening_v(bench: &Bench<'_>) -> Option<f64> {
    let null_v = bench.rig.value("valve.null_V")?;
    let commands = bench
        .tracks
        .iter()
        .filter_map(|track| track.recording.signal("u"));
    let openings_v = commands
        .flatten()
        .map(|command_v| (command_v - null_v).abs());
    let mut openings_v: Vec<f64> = openings_v.collect();
    (!openings_v.is_empty()).then(|| quantile(&mut openings_v, USUAL))
}

/// Part of the largest opening by which openings may be off, one standard deviation; chosen.
const LARGEST_SHIFT: f64 = 0.1;
/// Part of the largest pressure by which a gauge may be off, one standard deviation; chosen.
const LARGEST_ERROR: f64 = 0.03;

/// Variable, value and its deviation at every knot of a table of this shape.
pub fn table(shape: Shape, candidate: &Candidate, model: &Fitted) -> Vec<(f64, f64, f64)> {
    let end = |which: &str| {
        let key = format!("effects.{}.{which}", candidate.effect);
        let switch = candidate.switches.iter().find(|(name, _)| *name == key);
        switch.map_or(f64::NAN, |(_, value)| *value)
    };
    let knot = |(x, free): (f64, &FreeParameter)| {
        let place = model.place(&free.key)?;
        let deviation = model.standard_deviations[place].unwrap_or(f64::INFINITY);
        Some((x, model.values[place], deviation))
    };
    shape
        .knots(end("from"), end("to"))
        .into_iter()
        .zip(&candidate.free)
        .filter_map(knot)
        .collect()
}

/// The table or the equation that explains most of what the baseline misses, with the model that
/// holds it; `None` where none predicts data that it was not fitted to plainly better than
/// the `named` effects do. The bench gets its candidate.
pub fn find(bench: &mut Bench<'_>, baseline: &Fitted, named: &Fitted) -> Option<(Term, Fitted)> {
    let lengths: Vec<usize> = bench.tracks.iter().map(Track::len).collect();
    let folds = std::mem::replace(&mut bench.folds, Folds::interleaved(&lengths));
    let found = best(bench, baseline, named);
    bench.folds = folds;
    found
}

fn best(bench: &mut Bench<'_>, baseline: &Fitted, named: &Fitted) -> Option<(Term, Fitted)> {
    let before = bench.candidates.len();
    let mut best: Option<(Term, Fitted)> = None;
    let equation = missing_force::equation(bench, baseline);
    let least = least_share(equation.as_ref());
    for (stand, candidate) in stands(bench, equation) {
        let index = bench.candidates.len();
        bench.candidates.push(candidate);
        let stood_up = stood_up(bench, index, baseline, named);
        let Some((share, model)) = stood_up.filter(|(share, _)| *share > least) else {
            continue;
        };
        let stand = match stand {
            Stand::Equation(equation) => {
                Stand::Equation(missing_force::as_fitted(equation, &model))
            }
            table @ Stand::Table(_) => table,
        };
        let term = Term {
            candidate: index,
            stand,
            share,
        };
        // Equations come last.
        let worth = match term.stand {
            Stand::Table(_) => term.share,
            Stand::Equation(_) => term.share + AS_WELL,
        };
        if best.as_ref().is_none_or(|(best, _)| best.share < worth) {
            best = Some((term, model));
        }
    }
    if best.is_none() {
        bench.candidates.truncate(before);
    }
    best
}

/// The part of the misfit's amplitude that a table takes away where it is more than an equation for
/// which the model has no place, as it is one of time.
fn least_share(equation: Option<&Equation>) -> f64 {
    let of_time = equation.filter(|equation| missing_force::candidate(equation).is_none());
    of_time.map_or(f64::NEG_INFINITY, |equation| {
        1.0 - (1.0 - equation.share).max(0.0).sqrt()
    })
}

/// The tables that a law can hold, and last its equation, if it has one.
fn stands(bench: &Bench<'_>, equation: Option<Equation>) -> Vec<(Stand, Candidate)> {
    let tables = Shape::of(bench).into_iter();
    let tables = tables.filter_map(|shape| Some((Stand::Table(shape), shape.candidate(bench)?)));
    let equation = equation
        .and_then(|equation| Some((missing_force::candidate(&equation)?, equation)))
        .map(|(candidate, equation)| (Stand::Equation(equation), candidate));
    tables.chain(equation).collect()
}

/// What a candidate takes away of the misfit in data that it was not fitted to, and the model with
/// it; `None` where that is not plainly better than what is named.
fn stood_up(
    bench: &Bench<'_>,
    index: usize,
    baseline: &Fitted,
    named: &Fitted,
) -> Option<(f64, Fitted)> {
    let most = if named.presence.is_some() {
        1.0
    } else {
        plain_ratio(named.set.len())
    };
    let energy = |model: &Fitted| model.energy_above(&bench.noise);
    let hopeful = |start: &Fitted| {
        let begun = bench.ranked(&[index], start)?;
        let hope = ratio(energy(&begun), energy(named)) < HOPELESS;
        if hope { bench.finished(&begun) } else { None }
    };
    // A refit that bent itself around what is missing may lie far from both.
    let given = bench.as_given(baseline);
    let fits = [baseline, &given].into_iter().filter_map(hopeful);
    let with = fits.min_by(|a, b| energy(a).total_cmp(&energy(b)))?;
    let fitted = |model: &Fitted| above_noise(bench, &bench.by_fold(model));
    let left = |model: &Fitted| above_noise(bench, &bench.cross_validate(model));
    // What was not fitted is predicted no better than what was, and takes four fits to know.
    if ratio(fitted(&with), fitted(named)) > most {
        return None;
    }
    let [by_stand, by_named] = [&with, named].map(left);
    if ratio(by_stand, by_named) > most {
        return None;
    }
    let by_baseline = if named.set.is_empty() {
        by_named
    } else {
        left(baseline)
    };
    Some((1.0 - ratio(by_stand, by_baseline), with))
}

/// Amplitude of one misfit over that of another.
fn ratio(energy: f64, other: f64) -> f64 {
    (energy / other).sqrt()
}

/// Energy above the noise of squares by output and fold, each output in its noise.
fn above_noise(bench: &Bench<'_>, judged: &[FoldSquares]) -> f64 {
    let outputs = judged.iter().zip(&bench.noise);
    outputs
        .map(|(squares, noise)| (squares.mean() / noise.powi(2) - 1.0).max(f64::MIN_POSITIVE))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::rig::Rig;
    use crate::search;
    use truth_plant::{Kind, Request, Strength};

    /// A bench with the noise that its refit shows.
    fn refitted<'a>(law: Law, rig: &'a Rig, tracks: &'a [Track<'a>]) -> (Bench<'a>, Fitted) {
        let mut bench = Bench::new(law, rig, tracks);
        let baseline = search::baseline(&bench).unwrap();
        bench.learn_noise(&baseline, &[]);
        (bench, baseline)
    }

    fn tabled(term: &Term) -> Shape {
        match term.stand {
            Stand::Table(shape) => shape,
            Stand::Equation(_) => panic!("an equation"),
        }
    }

    /// How much of a function a table holds, beside a straight line, by least squares: how much
    /// of drag is viscous, and of a shift a stretch, the declared numbers decide.
    fn part_of(table: &[(f64, f64, f64)], function: impl Fn(f64) -> f64) -> f64 {
        let row = |&(x, _, _): &(f64, f64, f64)| [function(x), x, 1.0];
        let rows: Vec<f64> = table.iter().flat_map(row).collect();
        let values = table.iter().map(|&(_, value, _)| value);
        let matrix = nalgebra::DMatrix::from_row_slice(table.len(), 3, &rows);
        let right = nalgebra::DVector::from_iterator(table.len(), values);
        matrix.svd(true, true).solve(&right, 1e-12).unwrap()[0]
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_drag_that_grows_with_the_square_of_the_speed_comes_out_as_its_equation() {
        let (rig, recordings) = drawn::off_list(77, Strength::Medium, "quadratic-friction");
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (mut bench, baseline) = refitted(Law::Balance, &rig, &tracks);
        let (term, model) = find(&mut bench, &baseline, &baseline).unwrap();
        let Stand::Equation(equation) = &term.stand else {
            panic!("{:?}", term.stand);
        };
        println!("{}; {} of the misfit", equation.text(), term.share);
        assert_eq!(bench.candidates[term.candidate].effect, "force-equation");
        // Drawn were 39.02 N s2/m2.
        let drag = model.value("effects.force-equation.drag_Ns2_m2").unwrap();
        assert!(term.share > 0.8, "{}", term.share);
        assert!((drag / 39.02 - 1.0).abs() < 0.15, "{drag}");
    }

    /// The more it is asked for the less it gives: asked for 2.4 V it opens by 2 V.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_an_amplifier_that_compresses_comes_out_as_its_table() {
        const PER_V: f64 = 0.1;
        let (rig, mut recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        let null_v = rig.value("valve.null_V").unwrap();
        for recording in &mut recordings {
            for command_v in recording.signals.get_mut("u").unwrap() {
                let opening_v = *command_v - null_v;
                *command_v += PER_V * opening_v * opening_v.abs();
            }
        }
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (mut bench, baseline) = refitted(Law::Chambers, &rig, &tracks);
        let (term, model) = find(&mut bench, &baseline, &baseline).unwrap();
        assert_eq!(tabled(&term), Shape::ShiftOfOpenings);
        let mut table = table(tabled(&term), &bench.candidates[term.candidate], &model);
        println!("{table:?}, {} of the misfit", term.share);
        assert!(term.share > 0.8, "{}", term.share);
        // Within the dead zone nothing is told.
        table.retain(|&(_, _, deviation_v)| deviation_v < 0.05);
        // asked = opens + PER_V opens^2
        let opens_v = |asked_v: f64| ((1.0 + 4.0 * PER_V * asked_v).sqrt() - 1.0) / (2.0 * PER_V);
        let part = part_of(&table, |asked_v| opens_v(asked_v) - asked_v);
        assert!((part - 1.0).abs() < 0.3, "{part}");
    }

    /// A gauge that shows 3 % too much, and bows by 12 kPa in the midst of its ten bar.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_a_gauge_of_a_wrong_gain_that_bows_comes_out_as_its_table() {
        const BOW_PA: f64 = 12e3;
        let bow = |pressure_pa: f64| 4.0 * pressure_pa / 1e6 * (1.0 - pressure_pa / 1e6);
        let (rig, mut recordings) = drawn::read(&Request::new(1, Kind::Nothing));
        for recording in &mut recordings {
            for pressure_pa in recording.signals.get_mut("p_b").unwrap() {
                *pressure_pa += 0.03 * *pressure_pa + BOW_PA * bow(*pressure_pa);
            }
        }
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (mut bench, baseline) = refitted(Law::Chambers, &rig, &tracks);
        let (term, model) = find(&mut bench, &baseline, &baseline).unwrap();
        assert_eq!(tabled(&term), Shape::ErrorOfGauge(Side::B));
        let mut table = table(tabled(&term), &bench.candidates[term.candidate], &model);
        println!("{table:?}, {} of the misfit", term.share);
        assert!(term.share > 0.8, "{}", term.share);
        // Pressures that are met for a few rows only say little.
        table.retain(|&(_, _, deviation_pa)| deviation_pa < 1e3);
        for (pressure_pa, error_pa, _) in table {
            let built_in_pa = 0.03 * pressure_pa + BOW_PA * bow(pressure_pa);
            assert!(
                (error_pa - built_in_pa).abs() < 3e3,
                "{error_pa} of {built_in_pa} Pa"
            );
        }
    }
}
