//! The spool behind its command, figures 2 and 3 of the paper.
//!
//! Law: dead time, play, and a second-order lag whose speed is limited,
//!
//! ```text
//! s = g (spool - null)      spool'' = w^2 (played - spool) - 2 zeta w spool',  |spool'| <= rate
//! ```
//!
//! The limit is one of the spool's own speed. The model's command path has it in front of the lag:
//! the same for steps that the spool follows, and a little later where it does not.
//!
//! All numbers are fitted to all recordings at once: slow triangles show gain, null and play,
//! sines of several amplitudes the lag and, where gain and phase depend on the amplitude, the
//! rate. What of play, dead time and rate limit is there is decided by Schwarz's criterion.

use std::f64::consts::TAU;

use grey_box::fit::Parameter;
use grey_box::laws::{Track, median_step_s};
use grey_box::rig::Rig;
use model_core::left_out::ValveHysteresis;

use crate::least_squares::{Solved, correlation_length, fitted};
use crate::outcome::{Kind, Number, Outcome, Picture, Stretch};
use crate::sines::{Response, Sine, sines};
use crate::steady;

/// Rows that are compared at the most: more say nothing that these do not.
const MOST_ROWS: usize = 20_000;
/// Steps of the lag are short against it, rad.
const STEP_ANGLE: f64 = 0.15;
/// What the law leaves open of gain, frequency, damping, play and rate, as a part of them: steps of the
/// integration at the limit, a spring that is not quite linear (chosen).
const LAW_ERROR: f64 = 1e-3;
/// A logger's instants are known to this part of a row: one deviation of a dead time at least.
const INSTANT_ROWS: f64 = 0.05;
/// Points of a picture.
const SHOWN: usize = 2000;
/// Frequencies that are sought, Hz, and where the search begins.
const START_HZ: f64 = 60.0;
const FREQUENCIES_HZ: (f64, f64) = (1.0, 2000.0);
/// Longest dead time, s, and fastest spool, V/s.
const LONGEST_DELAY_S: f64 = 0.02;
const FASTEST_V_PER_S: f64 = 1e5;

/// Null, gain, frequency, damping, width of the play, dead time, rate.
const NULL: usize = 0;
const GAIN: usize = 1;
const FREQUENCY: usize = 2;
const DAMPING: usize = 3;
const PLAY: usize = 4;
const DELAY: usize = 5;
const RATE: usize = 6;

/// Evaluates recordings of command and spool.
///
/// # Errors
/// If command or spool are not recorded.
pub fn measure(rig: &Rig, tracks: &[Track<'_>]) -> Result<Outcome, String> {
    let bench = Bench::of(rig, tracks)?;
    let solved = bench.best()?;
    let correlated = correlation_length(&bench.residuals(&solved.values)).sqrt();
    Ok(Outcome {
        title: "Spool",
        method: "Dead time, play, rate limit and a second-order lag between command and spool are fitted to all \
                 recordings at once; of play, dead time and rate limit those are kept that the recordings show.",
        numbers: numbers(rig, &solved, correlated, bench.row_s()),
        stretches: tracks.iter().map(stretch).collect(),
        notes: notes(&solved),
        pictures: bench.pictures(&solved),
        ..Outcome::default()
    })
}

fn stretch(track: &Track<'_>) -> Stretch {
    let time_s = &track.recording.time_s;
    let command = track.recording.signal("u").unwrap_or(&[]);
    let found = sines(time_s, command).len();
    let what = match found {
        0 => "command and spool".to_owned(),
        _ => format!("{found} sines"),
    };
    Stretch::of(track.recording, &(0..track.len()), what)
}

fn numbers(rig: &Rig, solved: &Solved, correlated: f64, row_s: f64) -> Vec<Number> {
    let at = |place: usize| {
        let value = solved.values[place];
        let law_error = if place == NULL {
            0.0
        } else {
            LAW_ERROR * value
        };
        (
            value,
            (solved.deviations[place] * correlated).hypot(law_error),
        )
    };
    let of_key = |key: &str, place: usize| {
        let (value, deviation) = at(place);
        Number::of_key(key, value, deviation)
    };
    let is_length = rig
        .signals
        .get("spool")
        .is_some_and(|one| one.unit.dimension().si_unit() == "m");
    let gain = if is_length {
        of_key("valve.spool_gain_m_V", GAIN).shown_in("mm/V", 1e3)
    } else {
        let what = "spool reading per volt of command";
        Number::named("spool_gain_per_V", what, "1/V", at(GAIN))
    };
    let mut numbers = vec![
        of_key("valve.null_V", NULL),
        gain,
        of_key("effects.spool-dynamics.natural_frequency_Hz", FREQUENCY),
        of_key("effects.spool-dynamics.damping_ratio", DAMPING),
    ];
    if is_free(solved, PLAY) {
        numbers.push(of_key("effects.valve-hysteresis.width", PLAY).shown_in("V", 1.0));
    }
    if is_free(solved, DELAY) {
        let (value, deviation) = at(DELAY);
        let deviation = deviation.hypot(INSTANT_ROWS * row_s);
        let delay = Number::of_key("effects.valve-delay.delay_s", value, deviation);
        numbers.push(delay.shown_in("ms", 1e3));
    }
    if is_free(solved, RATE) {
        let (value, deviation) = at(RATE);
        for key in ["rising_per_s", "falling_per_s"] {
            // The parameter is the time per volt.
            let (rate, of_rate) = (1.0 / value, deviation / value.powi(2));
            let key = format!("effects.slew-limit.{key}");
            numbers.push(Number::of_key(&key, rate, of_rate).shown_in("V/s", 1.0));
        }
    }
    numbers
}

/// Whether a number was sought: one that is held has no deviation.
fn is_free(solved: &Solved, place: usize) -> bool {
    solved.values[place] > 0.0
        && solved.deviations[place].is_finite()
        && solved.deviations[place] > 0.0
}

fn notes(solved: &Solved) -> Vec<String> {
    let absent = [(PLAY, "play"), (DELAY, "dead time"), (RATE, "rate limit")];
    let null = "the null is the command at which the spool's sensor reads nought".to_owned();
    let absent = absent
        .into_iter()
        .filter(|(place, _)| !is_free(solved, *place))
        .map(|(_, name)| format!("the recordings show no {name}"));
    std::iter::once(null).chain(absent).collect()
}

struct Bench<'a> {
    tracks: &'a [Track<'a>],
    noise: f64,
    every: usize,
    start: [f64; 2],
}

impl<'a> Bench<'a> {
    fn of(rig: &Rig, tracks: &'a [Track<'a>]) -> Result<Self, String> {
        let mut noise: f64 = 0.0;
        let (mut commands, mut spools) = (Vec::new(), Vec::new());
        let mut rows = 0;
        for track in tracks {
            let signal = |name: &str| {
                track
                    .recording
                    .signal(name)
                    .ok_or(format!("{}: {name} is not recorded", track.recording.name))
            };
            let (command, spool) = (signal("u")?, signal("spool")?);
            noise = noise.max(steady::signal_noise(rig, "spool", spool));
            rows += track.len();
            commands.extend_from_slice(command);
            spools.extend_from_slice(spool);
        }
        let gain = steady::slope(&commands, &spools);
        if gain == 0.0 {
            return Err("the spool does not move with the command".into());
        }
        let null_v = steady::mean(&commands) - steady::mean(&spools) / gain;
        Ok(Self {
            tracks,
            noise,
            every: rows.div_ceil(MOST_ROWS),
            start: [null_v, gain],
        })
    }

    /// The shortest row of the recordings, s.
    fn row_s(&self) -> f64 {
        let rows = self
            .tracks
            .iter()
            .map(|track| median_step_s(&track.recording.time_s));
        rows.fold(f64::INFINITY, f64::min)
    }

    /// The law of those parts that the recordings show: of all of them those go without which
    /// Schwarz's criterion is lower.
    fn best(&self) -> Result<Solved, String> {
        let plain = self.fit(&[], None)?;
        let mut parts = vec![PLAY, DELAY, RATE];
        let mut best = self.fit(&parts, Some(&plain))?;
        for part in [PLAY, DELAY, RATE] {
            let without: Vec<usize> = parts.iter().copied().filter(|one| *one != part).collect();
            let solved = self.fit(&without, Some(&best))?;
            if solved.bic() < best.bic() {
                (parts, best) = (without, solved);
            }
        }
        Ok(best)
    }

    fn fit(&self, parts: &[usize], from: Option<&Solved>) -> Result<Solved, String> {
        let [null_v, gain] = self.start;
        let start = |place: usize, otherwise: f64| from.map_or(otherwise, |one| one.values[place]);
        let part = |place: usize, first: f64, most: f64| {
            if parts.contains(&place) {
                let was = start(place, 0.0);
                Parameter::new(if was > 0.0 { was } else { first })
                    .bounded(0.0, most)
                    .with_scale(first)
            } else {
                Parameter::new(0.0).bounded(0.0, 0.0)
            }
        };
        let parameters = [
            Parameter::new(start(NULL, null_v)).with_scale(1.0),
            Parameter::new(start(GAIN, gain)),
            Parameter::new(start(FREQUENCY, START_HZ)).bounded(FREQUENCIES_HZ.0, FREQUENCIES_HZ.1),
            Parameter::new(start(DAMPING, 0.7)).bounded(0.05, 5.0),
            part(PLAY, 0.02, 1.0),
            part(DELAY, 5e-4, LONGEST_DELAY_S),
            part(RATE, 1e-3, 1.0),
        ];
        fitted(&parameters, &|numbers: &[f64]| self.residuals(numbers))
    }

    fn residuals(&self, numbers: &[f64]) -> Vec<f64> {
        let mut all = Vec::new();
        for track in self.tracks {
            let spool = track.recording.signal("spool").unwrap_or(&[]);
            let law = law(numbers, track);
            let rows = (0..track.len()).step_by(self.every);
            all.extend(rows.map(|row| (spool[row] - law[row]) / self.noise));
        }
        all
    }

    fn pictures(&self, solved: &Solved) -> Vec<Picture> {
        let mut quasi_static =
            Picture::new("Spool over the command", ("command", "V"), ("spool", "mm"));
        let mut responses: Vec<(Response, Response)> = Vec::new();
        for track in self.tracks {
            let signal = |name: &str| track.recording.signal(name).unwrap_or(&[]);
            let (command, spool) = (signal("u"), signal("spool"));
            let law = law(&solved.values, track);
            let found = sines(&track.recording.time_s, command);
            if found.is_empty() {
                let name = &track.recording.name;
                quasi_static = quasi_static
                    .with(
                        format!("{name}, recorded"),
                        Kind::Recorded,
                        shown(command, spool),
                    )
                    .with(format!("{name}, law"), Kind::Law, shown(command, &law));
            }
            let response =
                |sine: &Sine, all: &[f64]| sine.response(&track.recording.time_s, command, all);
            responses.extend(
                found
                    .iter()
                    .map(|sine| (response(sine, spool), response(sine, &law))),
            );
        }
        let still = solved.values[GAIN].abs();
        let gains = over_frequency(
            &responses,
            ("Gain over the frequency", "gain", "dB"),
            &|one| 20.0 * (one.gain / still).log10(),
        );
        let phases = over_frequency(
            &responses,
            ("Phase over the frequency", "phase", "°"),
            &|one| one.phase_rad.to_degrees(),
        );
        let all = [quasi_static, gains, phases];
        all.into_iter()
            .filter(|one| !one.curves.is_empty())
            .collect()
    }
}

/// Some of the rows: the command in volts, the spool in mm.
fn shown(command: &[f64], spool: &[f64]) -> Vec<(f64, f64)> {
    let every = command.len().div_ceil(SHOWN).max(1);
    let rows = command.iter().zip(spool).step_by(every);
    rows.map(|(command, spool)| (*command, 1e3 * spool))
        .collect()
}

/// Recorded responses and those of the law, a curve for each amplitude.
fn over_frequency(
    responses: &[(Response, Response)],
    (title, name, unit): (&str, &str, &str),
    of: &dyn Fn(&Response) -> f64,
) -> Picture {
    let mut picture = Picture::new(title, ("frequency", "Hz"), (name, unit));
    let mut amplitudes: Vec<f64> = responses.iter().map(|one| one.0.amplitude).collect();
    amplitudes.sort_by(f64::total_cmp);
    amplitudes.dedup_by(|next, before| *next < 1.1 * *before);
    for amplitude in amplitudes {
        let near = |one: &&(Response, Response)| (one.0.amplitude / amplitude - 1.0).abs() < 0.1;
        let point = |one: &Response| (one.frequency_hz, of(one));
        let these: Vec<&(Response, Response)> = responses.iter().filter(near).collect();
        let recorded = these.iter().map(|one| point(&one.0)).collect();
        let law = these.iter().map(|one| point(&one.1)).collect();
        picture = picture
            .with(
                format!("{amplitude:.1} V, recorded"),
                Kind::Points,
                recorded,
            )
            .with(format!("{amplitude:.1} V, law"), Kind::Law, law);
    }
    picture
}

/// The spool by the law at every row, from rest at the first command.
fn law(numbers: &[f64], track: &Track<'_>) -> Vec<f64> {
    let (time_s, command) = (
        &track.recording.time_s,
        track.recording.signal("u").unwrap_or(&[]),
    );
    let step_s = median_step_s(time_s);
    let lag = Lag {
        per_s: TAU * numbers[FREQUENCY],
        damping: numbers[DAMPING],
        fastest_v_per_s: if numbers[RATE] > 1.0 / FASTEST_V_PER_S {
            1.0 / numbers[RATE]
        } else {
            f64::INFINITY
        },
    };
    let play = ValveHysteresis {
        width: numbers[PLAY],
    };
    let mut played = command.first().copied().unwrap_or(0.0);
    let mut state = [played, 0.0];
    let late = Late::of(command, numbers[DELAY] / step_s);
    let mut all = Vec::with_capacity(command.len());
    for row in 0..command.len() {
        all.push(numbers[GAIN] * (state[0] - numbers[NULL]));
        for (target, length) in late.of_row(row) {
            played = play.step(played, target);
            state = lag.advance(state, played, length * step_s);
        }
    }
    all
}

/// A second-order lag whose speed is limited.
struct Lag {
    per_s: f64,
    damping: f64,
    fastest_v_per_s: f64,
}

impl Lag {
    /// Position and speed after a time with a held target: fourth-order steps (Kutta), short
    /// against the lag.
    fn advance(&self, mut state: [f64; 2], target: f64, length_s: f64) -> [f64; 2] {
        let steps = (length_s * self.per_s / STEP_ANGLE).ceil().max(1.0);
        let h = length_s / steps;
        for _ in 0..steps as usize {
            let moved =
                |by: [f64; 2], over: f64| [state[0] + over * by[0], state[1] + over * by[1]];
            let first = self.rate(state, target);
            let second = self.rate(moved(first, 0.5 * h), target);
            let third = self.rate(moved(second, 0.5 * h), target);
            let fourth = self.rate(moved(third, h), target);
            for place in 0..2 {
                state[place] +=
                    h / 6.0 * (first[place] + 2.0 * (second[place] + third[place]) + fourth[place]);
            }
            state[1] = state[1].clamp(-self.fastest_v_per_s, self.fastest_v_per_s);
        }
        state
    }

    fn rate(&self, [position, speed]: [f64; 2], target: f64) -> [f64; 2] {
        let limited = speed.clamp(-self.fastest_v_per_s, self.fastest_v_per_s);
        let pull = self.per_s * self.per_s * (target - position);
        [limited, pull - 2.0 * self.damping * self.per_s * limited]
    }
}

/// A command that holds from row to row, some rows late.
struct Late<'a> {
    command: &'a [f64],
    whole: usize,
    part: f64,
}

impl<'a> Late<'a> {
    fn of(command: &'a [f64], rows: f64) -> Self {
        let whole = rows.max(0.0) as usize;
        Self {
            command,
            whole,
            part: rows.max(0.0) - whole as f64,
        }
    }

    /// What it is from a row to the next, and for which parts of that time.
    fn of_row(&self, row: usize) -> [(f64, f64); 2] {
        let at = |late: usize| self.command[row.saturating_sub(late)];
        [
            (at(self.whole + 1), self.part),
            (at(self.whole), 1.0 - self.part),
        ]
    }
}
