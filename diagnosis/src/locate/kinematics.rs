//! What the recorded position and the recorded velocity say of each other.
//!
//! No law needs v, and so no law misses anything where its sensor is wrong; but v is the rate of
//! x, and both are measured:
//!
//! ```text
//! x(t1) - x(t0) = integral of v from t0 to t1
//! ```
//!
//! in short windows, by the trapezoid rule. The noise of both is declared, hence that of the
//! difference: what is more is one of the two sensors. That is no law with parameters to fit, so
//! what is found has a place and a shape and no name: a velocity that is filtered (it comes
//! late), one whose gain is off. An error that comes again and again along the way, fitted as
//! A sin(2 pi x / period + phase) for every period that a scale may have, is the position's.
//!
//! A logger that reads one channel after the other shifts them by up to a row and a half, and a
//! position that was named as skewed is late by more: either is taken away first, from each
//! recording on its own.
//!
//! Limits: which of the two sensors is wrong the other laws must say, as they are driven by the
//! position; a velocity that was computed from the position shows nothing of either.

use crate::estimate::misfit::missed_from;
use crate::estimate::sensor_noise;
use crate::estimate::wave::{self, Wave};
use crate::inspect::{Moved, moved};
use crate::laws::{Law, Output, Track, median_step_s};
use crate::locate::{self, Located};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::text::plain;
use nalgebra::Vector2;

/// Rows of a window: few, as a filter shows in what is quick; and so many that the noise of the
/// position (some um against some mm/s) does not cover it.
const ROWS: usize = 10;
/// Rows by which channels that one logger reads in turn are apart at the most.
const SAMPLING_ROWS: f64 = 1.5;
/// A disagreement that is less than this part of the velocities is not material: what good
/// sensors of velocity are linear to. Chosen.
const MATERIAL: f64 = 0.01;
/// One number is what is wrong if it takes away all but this part of the energy.
const ONE_NUMBER: f64 = 0.1;
/// A periodic error of the position is material from this amplitude on, m: a third of what the
/// axis is to hold its place to. Chosen.
const MATERIAL_WAVE_M: f64 = 1e-5;
/// A window moves whose way is so many times what its noise is.
const PLAINLY: f64 = 5.0;

/// One window of a recording.
#[derive(Clone)]
struct Window {
    moved: Moved,
    /// Position at its begin and its end, m.
    at_m: (f64, f64),
    /// Change of the position less the way by the velocity, m.
    apart_m: f64,
    /// Rise of the velocity over the window, m/s: what one second of lateness comes to.
    rise_m_per_s: f64,
    /// Deviation of `apart_m` by the sensors' noise, m.
    noise_m: f64,
}

/// Where position and velocity contradict each other by more than their noise; `None` where
/// they agree, or where one was not recorded or has no declared noise. The position is what is
/// wrong where the laws that it drives miss something (`is_position`).
pub(crate) fn contradiction(
    rig: &Rig,
    tracks: &[Track<'_>],
    is_skew_named: bool,
    is_position: bool,
) -> Option<Located> {
    let as_recorded: Vec<Vec<Window>> = tracks
        .iter()
        .map(|track| windows(rig, track.recording))
        .collect::<Option<_>>()?;
    let mut together = as_recorded.clone();
    for (windows, track) in together.iter_mut().zip(tracks) {
        let row_s = median_step_s(&track.recording.time_s);
        let most_s = if is_skew_named {
            f64::INFINITY
        } else {
            SAMPLING_ROWS * row_s
        };
        bring_together(windows, most_s);
    }
    let all = together.concat();
    let wave = scale_wave(&all);
    if wave.is_none() && !is_material(&all) {
        return None;
    }
    // A filter is late by all that it is late, a logger's share of that or not.
    let windows = if is_skew_named { together } else { as_recorded };
    let output = Output {
        signal: "v",
        place: if is_position || wave.is_some() {
            "sensor.x"
        } else {
            "sensor.v"
        },
        unit: "m/s",
    };
    let quantity = "rate of position less velocity";
    let columns = columns(&windows, tracks);
    let mut located = locate::of_quantity(Law::Carriage, rig, tracks, &output, quantity, columns);
    located.share = 1.0;
    let words = wave.map(|wave| format!("as if the position were {}", wave.in_words()));
    if let Some(number) = words.or_else(|| in_one_number(&windows.concat())) {
        located.when = format!("{}: {number}", located.when);
    }
    Some(located)
}

/// The windows of a recording, where both sensors are known.
fn windows(rig: &Rig, recording: &Recording) -> Option<Vec<Window>> {
    let (of_x, of_v) = (
        sensor_noise::declared(rig, "x")?,
        sensor_noise::declared(rig, "v")?,
    );
    let (x, v) = (recording.signal("x")?, recording.signal("v")?);
    let window = |moved: Moved| {
        let (from, to) = moved.rows;
        let of_path_m = of_v * moved.seconds / (ROWS as f64).sqrt();
        Window {
            moved,
            at_m: (x[from], x[to]),
            apart_m: moved.moved_m - moved.path_m,
            rise_m_per_s: v[to] - v[from],
            noise_m: (2.0 * of_x * of_x + of_path_m * of_path_m).sqrt(),
        }
    };
    Some(moved(recording, ROWS)?.into_iter().map(window).collect())
}

/// Takes the shift between the channels of a recording away, as far as it may be one.
fn bring_together(windows: &mut [Window], most_s: f64) {
    let late_s = slope(windows, |window| window.rise_m_per_s).clamp(-most_s, most_s);
    for window in windows {
        window.apart_m -= late_s * window.rise_m_per_s;
    }
}

/// How much of a quantity the windows are apart by, least squares.
fn slope(windows: &[Window], by: impl Fn(&Window) -> f64) -> f64 {
    let sums = windows
        .iter()
        .fold((0.0, 0.0), |(product, square), window| {
            let (weight, by) = (window.noise_m.powi(-2), by(window));
            (
                product + weight * by * window.apart_m,
                square + weight * by * by,
            )
        });
    if sums.1 > 0.0 { sums.0 / sums.1 } else { 0.0 }
}

/// Energy of what the windows are apart by, in units of the noise's.
fn energy(windows: &[Window], apart_m: impl Fn(&Window) -> f64) -> f64 {
    let squares = windows
        .iter()
        .map(|window| (apart_m(window) / window.noise_m).powi(2));
    squares.sum::<f64>() / windows.len() as f64
}

/// Whether the sensors disagree by more than noise, and by so much that it matters.
fn is_material(windows: &[Window]) -> bool {
    let over_noise = energy(windows, |window| window.apart_m) - 1.0;
    let of_way = energy(windows, |window| window.moved.path_m);
    over_noise > missed_from(windows.len()) && over_noise > MATERIAL * MATERIAL * of_way
}

/// The periodic error of the position that most of the disagreement comes to, if it is material.
/// Where the carriage rests, the noise of a position that is thought to lie in a wave is the
/// noise of what it is held against: only windows that move say something.
fn scale_wave(windows: &[Window]) -> Option<Wave> {
    let moves = |window: &&Window| window.moved.path_m.abs() > PLAINLY * window.noise_m;
    let windows: Vec<Window> = windows.iter().filter(moves).cloned().collect();
    let places = || windows.iter().map(|window| window.at_m.0);
    let way_m = places().reduce(f64::max)? - places().reduce(f64::min)?;
    let missed = windows.len() as f64 * (energy(&windows, |window| window.apart_m) - 1.0);
    let change = |window: &Window, radians_per_m: f64| {
        let (from, to) = (window.at_m.0 * radians_per_m, window.at_m.1 * radians_per_m);
        let change = Vector2::new(to.cos() - from.cos(), to.sin() - from.sin());
        (change / window.noise_m, window.apart_m / window.noise_m)
    };
    let wave = wave::largest(way_m, wave::of_a_scale_m(way_m), |radians_per_m| {
        windows
            .iter()
            .map(move |window| change(window, radians_per_m))
    })?;
    (wave.explains(missed) && wave.amplitude_m() > MATERIAL_WAVE_M).then_some(wave)
}

/// The one number that is wrong, in words, if it is one.
fn in_one_number(windows: &[Window]) -> Option<String> {
    let (late_s, left_by_late) = explained(windows, |window| window.rise_m_per_s);
    let (more, left_by_more) = explained(windows, |window| window.moved.path_m);
    let (slow_m_per_s, left_by_slow) = explained(windows, |window| window.moved.seconds);
    let which = if late_s > 0.0 { "late" } else { "early" };
    let late = format!("were {} ms {which}", plain(1e3 * late_s.abs(), 2));
    let gain = plain(1.0 / (1.0 + more), 3);
    let gain = format!(
        "were {gain} times the rate of the position (the scale of either sensor may be wrong)"
    );
    let off = format!("were off by {} mm/s", plain(-1e3 * slow_m_per_s, 2));
    let numbers = [
        (left_by_late, late),
        (left_by_more, gain),
        (left_by_slow, off),
    ];
    let (left, words) = numbers.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let missed = energy(windows, |window| window.apart_m) - 1.0;
    (left < ONE_NUMBER * missed).then(|| format!("as if the velocity {words}"))
}

/// How much of a quantity explains most of what the windows are apart by, and what energy above
/// the noise's that leaves.
fn explained(windows: &[Window], by: fn(&Window) -> f64) -> (f64, f64) {
    let size = slope(windows, by);
    let left = energy(windows, |window| window.apart_m - size * by(window)) - 1.0;
    (size, left)
}

/// What the windows are apart by per second, at each of their rows.
fn columns(windows: &[Vec<Window>], tracks: &[Track<'_>]) -> Vec<Vec<f64>> {
    let column = |(windows, track): (&Vec<Window>, &Track<'_>)| {
        let mut column = vec![f64::NAN; track.len()];
        for Window { moved, apart_m, .. } in windows {
            column[moved.rows.0..moved.rows.1].fill(apart_m / moved.seconds);
        }
        column
    };
    windows.iter().zip(tracks).map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use truth_plant::{Kind, Request, Strength};

    fn found(request: &Request, change: impl Fn(&mut Vec<f64>)) -> Option<Located> {
        let (rig, mut recordings) = drawn::read(request);
        for recording in &mut recordings {
            change(recording.signals.get_mut("v").unwrap());
        }
        at(&rig, &recordings, false)
    }

    fn at(rig: &Rig, recordings: &[Recording], is_skew_named: bool) -> Option<Located> {
        let tracks: Vec<Track<'_>> = recordings.iter().map(Track::new).collect();
        contradiction(rig, &tracks, is_skew_named, false)
    }

    fn healthy() -> Request {
        Request::new(1, Kind::Nothing).with_noise(1.0)
    }

    #[test]
    fn prop_sound_sensors_agree() {
        for seed in 1..5 {
            let request = Request::new(seed, Kind::Nothing).with_noise(1.0);
            assert!(found(&request, |_| ()).is_none(), "seed {seed}");
        }
    }

    #[test]
    fn val_a_filter_of_8_ms_comes_out_as_its_delay() {
        let filtered = |v: &mut Vec<f64>| {
            let mut shown = v[0];
            for value in v {
                shown += (*value - shown) / 8.0;
                *value = shown;
            }
        };
        let located = found(&healthy(), filtered).unwrap();
        assert_eq!(located.place, "sensor.v");
        // Rows of 1 ms: the mean age of what an exponential mean holds is 7 ms.
        assert!(located.when.contains("7.0 ms late"), "{}", located.when);
        assert_eq!(located.leading().unwrap().name, "acceleration");
    }

    #[test]
    fn val_a_gain_of_0_95_comes_out_as_it_is() {
        let located = found(&healthy(), |v| v.iter_mut().for_each(|v| *v *= 0.95)).unwrap();
        let number = located.when.split("velocity were ").nth(1).unwrap();
        let gain: f64 = number.split(' ').next().unwrap().parse().unwrap();
        assert!((gain - 0.95).abs() < 0.002, "{}", located.when);
    }

    /// 26 um in 0.6 per cent of the velocity: less than its sensor may be off by.
    #[test]
    fn val_a_wave_of_the_scale_comes_out_as_it_is() {
        let request = Request::new(731_401_162, Kind::OffList).with_noise(1.0);
        let request = request.with_effect("position-sensor-wave").unwrap();
        let request = request.with_strength(Strength::Weak);
        let truth = &request.draw().truth.effects[0].parameters;
        let (rig, recordings) = drawn::read(&request);
        let windows: Vec<Vec<Window>> = recordings
            .iter()
            .map(|recording| windows(&rig, recording).unwrap())
            .collect();
        let wave = scale_wave(&windows.concat()).unwrap();
        assert!(
            (wave.amplitude_m() / truth["amplitude_m"] - 1.0).abs() < 0.1,
            "{wave:?}"
        );
        assert!(
            (wave.period_m / truth["period_m"] - 1.0).abs() < 0.02,
            "{wave:?}"
        );
        let located = at(&rig, &recordings, false).unwrap();
        assert_eq!(located.place, "sensor.x");
        assert!(located.when.contains("wavelength 18."), "{}", located.when);
    }

    /// Rests under ten times the usual noise were a wave of 13 um every 1.36 mm.
    #[test]
    fn regress_the_noise_of_a_rest_is_no_wave() {
        let request = Request::new(257_271_279, Kind::Single).with_noise(10.0);
        let request = request.with_effect("dwell-stiction").unwrap();
        let request = request.with_strength(Strength::Strong);
        let located = found(&request, |_| ());
        assert!(located.is_none(), "{}", located.unwrap().when);
    }

    /// Over 20 mm a gain is as straight as a part of a long wave.
    #[test]
    fn prop_a_gain_over_a_short_way_is_no_wave() {
        let (rig, mut recordings) = drawn::read(&healthy());
        for recording in &mut recordings {
            let x = &recording.signals["x"];
            let first_m = x[0];
            let end = x.iter().position(|x| (x - first_m).abs() > 0.02);
            *recording = recording.part(0..end.unwrap_or(recording.len()));
            let v = recording.signals.get_mut("v").unwrap();
            v.iter_mut().for_each(|v| *v *= 0.9);
        }
        let located = at(&rig, &recordings, false).unwrap();
        assert_eq!(located.place, "sensor.v", "{}", located.when);
    }

    #[test]
    fn prop_what_no_engineer_would_mind_is_no_contradiction() {
        let slightly = |v: &mut Vec<f64>| v.iter_mut().for_each(|v| *v *= 0.995);
        assert!(found(&healthy(), slightly).is_none());
        let by_a_row = |v: &mut Vec<f64>| v.rotate_right(1);
        assert!(found(&healthy(), by_a_row).is_none());
    }

    #[test]
    fn prop_a_skew_that_was_named_contradicts_nothing() {
        let (rig, recordings) =
            drawn::of_kind(Kind::Single, 5, Strength::Strong, "position-time-skew");
        assert!(at(&rig, &recordings, true).is_none());
    }
}
