//! A scale that is off along its way, told by the laws that the position drives.
//!
//! A velocity that was computed from the position contradicts nothing ([`crate::locate::kinematics`]). But
//! where the position is off by e(x), the carriage seems to be accelerated by d2e/dt2 more, and the
//! balance of forces misses
//!
//! ```text
//! - M sum phi'' e(x) dt / sum phi dt
//! ```
//!
//! which grows with the square of the speed, as no force along the way does. An error that comes
//! again and again, A sin(2 pi x / period + phase), is looked for in what no effect explains. The
//! chambers, whose volumes are off by the same, are asked once more behind the position as it is
//! without.
//!
//! Limits: an error that does not come again is not found, nor what a bump of 40 ms averages out.

use crate::diagnose::known::Known;
use crate::estimate::sliding::{self, Row, Sliding};
use crate::estimate::wave::{self, Wave};
use crate::estimate::{Bench, Fitted};
use crate::finding::{self, Finding};
use crate::laws::{Law, Output, Track};
use crate::locate::{self, Located};
use crate::recording::Recording;

const OUTPUT: Output = Output {
    signal: "x",
    place: "sensor.x",
    unit: "m",
};

/// Says that the position is wrong where that explains what the carriage misses, and of the
/// chambers where it explains more than any other input.
pub(crate) fn blame(known: &Known<'_>, laws: &mut [Finding]) {
    let is_open = |law: &&mut Finding| law.is_unexplained();
    let mut open: Vec<&mut Finding> = laws.iter_mut().filter(is_open).collect();
    let of = |law: Law| open.iter().position(|one| one.law == law);
    let (carriage, chambers) = (of(Law::Carriage), of(Law::Chambers));
    let Some(carriage) = carriage else { return };
    let tracks: Vec<Track<'_>> = known.train.iter().map(Track::new).collect();
    let mut bench = Bench::new(Law::Balance, &known.rig, &tracks);
    bench.noise.clone_from(&open[carriage].noise);
    let Some((wave, share)) = scale_wave(&bench, &open[carriage].baseline) else {
        return;
    };
    let located = |share: f64| located(&bench, &wave, share);
    open[carriage].input = Some(located(share));
    if let Some(chambers) = chambers {
        let chambers = &mut open[chambers];
        let share = behind(&wave, known, chambers).unwrap_or(0.0);
        if chambers
            .input
            .as_ref()
            .is_none_or(|input| input.share < share)
        {
            chambers.input = Some(located(share));
        }
    }
}

/// The periodic error of the position that explains most of what the balance misses while
/// sliding, and the part of it, if no force along the way explains as much.
fn scale_wave(bench: &Bench<'_>, baseline: &Fitted) -> Option<(Wave, f64)> {
    let mass_kg = bench.value_in(baseline, "carriage.mass_kg")?;
    let curvatures = sliding::curvatures(bench);
    let sliding = Sliding::of(bench, baseline, &curvatures)?;
    let periods_m = wave::of_a_scale_m(sliding.way_m);
    let wave = sliding.largest(periods_m, |row, per_m| row.curved(per_m) * -mass_kg)?;
    let pushed = sliding.largest(periods_m, Row::pushed)?;
    let held = sliding.largest(periods_m, Row::held)?;
    let missed = sliding.missed();
    let is_it = wave.explains(missed) && wave.gain > pushed.gain.max(held.gain);
    is_it.then_some((wave, (wave.gain / missed).min(1.0)))
}

/// What the chambers' misfit comes to behind the position without its error: the part of it that
/// is explained.
fn behind(wave: &Wave, known: &Known<'_>, chambers: &Finding) -> Option<f64> {
    let mended: Vec<Recording> = known.train.iter().map(|one| mended(wave, one)).collect();
    let tracks: Vec<Track<'_>> = mended.iter().map(Track::new).collect();
    let mut bench = Bench::new(chambers.law, &known.rig, &tracks);
    bench.noise.clone_from(&chambers.noise);
    let refitted = bench.fit(&[], Some(&chambers.baseline))?;
    Some(finding::explained(
        &chambers.baseline,
        &refitted,
        &chambers.noise,
    ))
}

fn mended(wave: &Wave, recording: &Recording) -> Recording {
    let mut mended = recording.clone();
    if let Some(position_m) = mended.signals.get_mut("x") {
        for (place_m, off_m) in position_m.iter_mut().zip(off_m(wave, recording)) {
            *place_m -= off_m;
        }
    }
    mended
}

/// What the position is off by along a recording, m.
fn off_m(wave: &Wave, recording: &Recording) -> Vec<f64> {
    let position_m = recording.signal("x").unwrap_or_default().iter();
    position_m.map(|&place_m| wave.at_m(place_m)).collect()
}

fn located(bench: &Bench<'_>, wave: &Wave, share: f64) -> Located {
    let off_m = |track: &Track<'_>| off_m(wave, track.recording);
    let columns = bench.tracks.iter().map(off_m).collect();
    let (rig, tracks) = (bench.rig, bench.tracks);
    Located {
        share,
        when: wave.in_words(),
        ..locate::of_quantity(
            Law::Carriage,
            rig,
            tracks,
            &OUTPUT,
            locate::POSITION,
            columns,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use truth_plant::{Kind, Request, Strength};

    /// What the balance alone says, without the recorded velocity, of a case.
    fn found(request: &Request) -> Option<Wave> {
        let (rig, recordings) = drawn::read(request);
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        let (bench, baseline) = drawn::searched(Law::Balance, &rig, &tracks);
        scale_wave(&bench, &baseline).map(|(wave, _)| wave)
    }

    #[test]
    fn val_a_wave_of_the_scale_shows_in_the_balance_of_forces() {
        let request = Request::new(5, Kind::OffList).with_noise(1.0);
        let request = request.with_effect("position-sensor-wave").unwrap();
        let request = request.with_strength(Strength::Strong);
        let truth = &request.draw().truth.effects[0].parameters;
        let wave = found(&request).unwrap();
        println!("{wave:?} of {truth:?}");
        assert!((wave.amplitude_m() / truth["amplitude_m"] - 1.0).abs() < 0.15);
        assert!((wave.period_m / truth["period_m"] - 1.0).abs() < 0.01);
    }

    /// Both go with the position; the friction does not grow with the square of the speed.
    #[test]
    fn prop_a_wave_of_friction_is_no_error_of_the_scale() {
        for seed in [3, 5] {
            let request = Request::new(seed, Kind::Single).with_noise(1.0);
            let request = request.with_effect("position-dependent-friction").unwrap();
            let wave = found(&request.with_strength(Strength::Strong));
            assert!(wave.is_none(), "seed {seed}: {wave:?}");
        }
    }
}
