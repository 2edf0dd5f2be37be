//! A bench's outputs in the noise that each model makes of what was recorded.
//!
//! A balance of recorded forces has nothing but noise of its inputs, and a model that scales all
//! forces down scales that too: left to itself it leaves less and has explained nothing. (A
//! friction of 16 N/bar of the 49 N/bar that drive the piston, with the mass down to two
//! thirds, under ten times the pressures' noise.) So what a model leaves of a balance is
//! counted in units of the noise that it has itself, and where that is much it is fitted so
//! ([`crate::fit::own_noise`]).

use super::bench::Bench;
use super::fitted::Fitted;
use crate::estimate::draws::Doubts;
use crate::estimate::draws::{Draws, Shaken};
use crate::estimate::noise;
use crate::estimate::sensor_noise;
use crate::fit::law_problem::LawProblem;
use crate::fit::own_noise::{Draw, InOwnNoise, OwnNoise};
use crate::laws::{Law, balance};
use crate::rig::Rig;

/// Models are fitted in their own noise where the noise is so many times what the law itself is
/// known to: where that of the inputs is not under three quarters of it.
const NOISE_OF_INPUTS: f64 = 1.25;

impl Bench<'_> {
    /// Learns the noise of the outputs, that of the inputs included as a model carries it on; with
    /// what is not understood of these, by recording.
    pub(crate) fn learn_noise(&mut self, model: &Fitted, doubts: &[Doubts]) {
        let shaken = noise::shaken(self, doubts);
        self.noise = self.floor_under(model, &shaken);
        self.draws = Draws::default();
        if self.law == Law::Balance {
            let of_pressures = shaken.but("x", self.tracks);
            self.draws = Draws {
                beside_pressures: self.noise_beside(model, &of_pressures),
                of_pressures,
                of_all: shaken,
            };
        }
    }

    /// The noise of each output without what one more draw of some of it changes.
    fn noise_beside(&self, model: &Fitted, shaken: &Shaken) -> Vec<f64> {
        let own = self.noise_of_outputs(self.rig).into_iter();
        let with = self.floor_under(model, shaken).into_iter().zip(own);
        let noise = self.noise.iter().zip(with);
        noise
            .map(|(noise, (with, own))| {
                let beside = noise.powi(2) - (with.powi(2) - own.powi(2)).max(0.0);
                beside.max(own.powi(2)).sqrt()
            })
            .collect()
    }

    /// The noise floor of each output as a model carries on what one more draw of noise changes.
    pub(crate) fn floor_under(&self, model: &Fitted, shaken: &Shaken) -> Vec<f64> {
        let tracks = shaken.tracks();
        let [still, moved] =
            [self.tracks, &tracks].map(|tracks| self.predicted_by_output(model, tracks));
        noise::floor(self, model, [&still, &moved])
    }

    /// The noise of each output that is not of the inputs, SI.
    pub(crate) fn noise_of_outputs(&self, rig: &Rig) -> Vec<f64> {
        let mut noise = sensor_noise::of_outputs(self.law, rig, self.tracks);
        if self.law == Law::Balance {
            noise[balance::BREAKAWAY] = self.break_aways_known_to_n;
        }
        noise
    }

    /// Whether models are fitted in their own noise too: where that of the inputs is not well
    /// under what is looked for anyway.
    pub(crate) fn is_fitted_in_own_noise(&self) -> bool {
        let own = self.noise_of_outputs(self.rig);
        let outputs = own.iter().zip(&self.noise).enumerate();
        // Single events are too few to tell a model's noise by.
        let mut rows = outputs.filter(|(output, _)| !self.is_of_events(*output));
        !self.draws.of_all.is_empty()
            && rows.any(|(_, (own, noise))| *noise > NOISE_OF_INPUTS * own)
    }

    /// A model that was fitted before the noise was learned, in its own noise where that counts.
    pub(crate) fn in_own_noise(&self, model: Fitted) -> Fitted {
        let again = self.is_fitted_in_own_noise();
        let fitted = again.then(|| self.fit(&model.set, Some(&model))).flatten();
        fitted.unwrap_or(model)
    }

    /// By output, what a model leaves in squares over what that would be with the bench's noise.
    /// It is asked of balances, and what is left of one is what is predicted.
    pub(crate) fn squares_of_own_noise(
        &self,
        model: &Fitted,
        residuals: &[Vec<Vec<f64>>],
    ) -> Vec<f64> {
        if self.draws.of_all.is_empty() {
            return vec![1.0; self.noise.len()];
        }
        let moved = self.predicted_by_output(model, &self.draws.of_all.tracks());
        let own = noise::floor(self, model, [residuals, &moved]).into_iter();
        own.zip(&self.noise)
            .map(|(own, noise)| (own / noise).powi(2))
            .collect()
    }

    /// A balance in the noise that its recordings make of it; with a load behind a spring in that
    /// of the pressures alone: a load with play can be bent to carry on so much of the position's
    /// that whatever it misses is lost in it.
    pub(crate) fn in_own_noise_around<'p>(
        &self,
        set: &[usize],
        values: &[f64],
        problem: LawProblem<'p>,
    ) -> Option<InOwnNoise<'p>> {
        let (shaken, other) = if self.carries_a_load(set) {
            (
                &self.draws.of_pressures,
                self.draws.beside_pressures.clone(),
            )
        } else {
            let own = self.noise_of_outputs(self.rig);
            (&self.draws.of_all, own)
        };
        let shaken = shaken.tracks();
        let draw = Draw {
            shaken: &shaken,
            other,
            noise: &self.noise,
            events: balance::BREAKAWAY,
        };
        let noise = OwnNoise::around(values, &problem, &draw)?;
        Some(InOwnNoise { problem, noise })
    }

    /// Whether one of some effects is a load behind a spring.
    pub(crate) fn carries_a_load(&self, set: &[usize]) -> bool {
        let mut free = set.iter().flat_map(|&index| &self.candidates[index].free);
        free.any(|free| free.key.ends_with(".load_mass_kg"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use crate::estimate::predictions::mean_squares;
    use crate::fit::{LeastSquares, NormalEquations, ResidualSums, RowWeighting};
    use crate::laws::Track;
    use crate::recording::Recording;
    use crate::rig::Rig;
    use truth_plant::{Kind, Request, Strength};

    /// Friction by pressure under ten times the usual noise, of which it makes less by taking all
    /// forces down.
    fn friction_by_pressure_under_noise() -> (Rig, Vec<Recording>, f64) {
        let request = Request::new(1, Kind::Single).with_noise(10.0);
        let request = request.with_effect("pressure-dependent-friction").unwrap();
        let request = request.with_strength(Strength::Medium);
        let truth = request.draw().truth.effects[0].parameters["per_pressure_difference_N_Pa"];
        let (rig, recordings) = drawn::read(&request);
        (rig, recordings, truth)
    }

    /// 1.3 N/bar came out as 7.6 +- 1.3: least squares in newtons prefer forces scaled down.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn regress_noise_of_the_forces_is_no_friction() {
        let (rig, recordings, truth) = friction_by_pressure_under_noise();
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        let effect = "pressure-dependent-friction";
        let set = [drawn::tried(&bench, effect, "force-balance")];
        let model = bench.fit(&set, Some(&baseline)).unwrap();
        let key = "effects.pressure-dependent-friction.per_pressure_difference_N_Pa";
        let place = model.place(key).unwrap();
        let (found, known_to) = (
            model.values[place],
            model.standard_deviations[place].unwrap(),
        );
        println!("{found} +- {known_to} of {truth}");
        assert!((found - truth).abs() < 2.0 * known_to);
        assert!((found - truth).abs() < 2e-5, "N/Pa: 2 N/bar");
    }

    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_derivatives_in_own_noise_are_differences() {
        let (rig, recordings, _) = friction_by_pressure_under_noise();
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        bench.with_model(&baseline, |problem| {
            let begun: Vec<f64> = baseline.values.iter().map(|value| 0.9 * value).collect();
            let around = |values: &[f64]| {
                let noise = bench.in_own_noise_around(&[], values, *problem);
                noise.unwrap()
            };
            let (mut problem, mut there) = (around(&begun), around(&baseline.values));
            let mut equations = NormalEquations::new(baseline.values.len(), RowWeighting::Squares);
            problem.accumulate(&baseline.values, &mut equations);
            let mut cost = |place: usize, by: f64| {
                let mut values = baseline.values.clone();
                values[place] += by;
                let mut sums = ResidualSums::new(RowWeighting::Squares);
                problem.accumulate_cost(&values, &mut sums);
                sums.cost()
            };
            // A tenth away it is what it is there.
            let mut sums = ResidualSums::new(RowWeighting::Squares);
            there.accumulate_cost(&baseline.values, &mut sums);
            let ratio = cost(0, 0.0) / sums.cost();
            assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
            for (place, name) in baseline.names.iter().enumerate() {
                let by = 1e-3 * baseline.values[place];
                let difference = (cost(place, by) - cost(place, -by)) / (2.0 * by);
                let curved = equations.cost_curvature()[(place, place)];
                let apart = (equations.gradient()[place] - difference) / curved.sqrt();
                println!("{name}: {} {difference}", equations.gradient()[place]);
                assert!(apart.abs() < 0.05, "{name}: {apart} deviations");
            }
        });
    }

    /// Under ten times the noise a gauge that was off was a friction of 16 N/bar, with the mass 18
    /// deviations down: that takes a third off all forces, their noise with them.
    #[test]
    fn regress_what_takes_the_forces_down_with_their_noise_explains_nothing() {
        let (rig, recordings) = drawn::weak_offset_under_noise();
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        let set = [drawn::tried(
            &bench,
            "pressure-dependent-friction",
            "force-balance",
        )];
        let begun = bench.begun(&set, &baseline, 0);
        let area_m2 = rig.value("cylinder.area_a_m2").unwrap();
        let smaller = |(name, &value): (&String, &f64)| match name.as_str() {
            "friction.stribeck_velocity_m_s" => value,
            name if name.ends_with("per_pressure_difference_N_Pa") => area_m2 / 3.0,
            name if name.starts_with("effects.") => 0.0,
            _ => value * 2.0 / 3.0,
        };
        let values = begun.names.iter().zip(&begun.values).map(smaller).collect();
        let smaller = bench.with_values(&begun, values);
        let in_newtons = |model: &Fitted| mean_squares(&bench.residuals_of(model))[0];
        // By two thirds squared; 0.46 and 0.90.
        assert!(in_newtons(&smaller) < 0.6 * in_newtons(&baseline));
        assert!(smaller.mean_square[0] > 0.8 * baseline.mean_square[0]);
        let refitted = bench.with_values(&baseline, baseline.values.clone());
        for (square, known) in refitted.mean_square.iter().zip(&baseline.mean_square) {
            assert!(
                (square / known - 1.0).abs() < 1e-9,
                "its noise is the bench's"
            );
        }
    }
}
