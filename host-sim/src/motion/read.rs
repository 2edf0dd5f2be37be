//! The motion file: what is asked of the load, and what happens to it meanwhile.
//!
//! ```toml
//! format = "motion/1"
//! start_m = 0.0                # where the load rests at the beginning
//!
//! [limits]                     # of the moves; may be left out
//! velocity_m_s = 0.5
//! acceleration_m_s2 = 2.5
//! jerk_m_s3 = 60.0
//!
//! [[segment]]
//! kind = "hold"
//! seconds = 1.0
//!
//! [[segment]]
//! kind = "move"
//! to_m = 0.06
//!
//! [[segment]]
//! kind = "sine"
//! amplitude_m = 0.06
//! frequency_Hz = 0.5
//! periods = 6                  # the swelling and the fading one included
//!
//! [[event]]                    # may be left out
//! at_s = 4.0
//! kind = "push"                # force_N along +x; or "payload" with mass_kg,
//! force_N = 10.0               # the whole moving mass; or "supply" with
//!                              # pressure_Pa; from then on
//! ```

use super::{Limits, Motion, Segment};
use crate::plant::{Change, Event};
use crate::rig::{RigError, line_at, read_text};
use serde::Deserialize;
use std::path::Path;

/// The only format there is.
const FORMAT: &str = "motion/1";

/// A motion file that cannot be used: file, line, key, problem, expectation.
pub type MotionError = RigError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    #[serde(default)]
    start_m: f64,
    limits: Option<FileLimits>,
    segment: Vec<FileSegment>,
    #[serde(default)]
    event: Vec<FileEvent>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileLimits {
    velocity_m_s: f64,
    acceleration_m_s2: f64,
    jerk_m_s3: f64,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum FileSegment {
    Hold {
        seconds: f64,
    },
    Move {
        to_m: f64,
    },
    Sine {
        amplitude_m: f64,
        #[serde(rename = "frequency_Hz")]
        frequency_hz: f64,
        periods: u32,
    },
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum FileEvent {
    Push {
        at_s: f64,
        #[serde(rename = "force_N")]
        force_n: f64,
    },
    Payload {
        at_s: f64,
        mass_kg: f64,
    },
    Supply {
        at_s: f64,
        #[serde(rename = "pressure_Pa")]
        pressure_pa: f64,
    },
}

/// Reads a motion file.
pub fn read(path: &Path) -> Result<(Motion, Vec<Event>), MotionError> {
    let name = path.display().to_string();
    parse(&read_text(path, &name, "motion")?, &name)
}

/// Reads the text of a motion file, which is named in errors.
pub fn parse(text: &str, name: &str) -> Result<(Motion, Vec<Event>), MotionError> {
    let complaint = |key: Option<String>, problem: String, expected: &str| MotionError {
        file: name.into(),
        line: None,
        key,
        problem,
        expected: expected.into(),
    };
    let file: File = toml::from_str(text).map_err(|error| MotionError {
        line: error.span().map(|span| line_at(text, span.start)),
        ..complaint(None, error.message().to_owned(), "a motion file")
    })?;
    if file.format != FORMAT {
        let problem = format!("is \"{}\"", file.format);
        return Err(complaint(Some("format".into()), problem, "\"motion/1\""));
    }
    for (key, value, bounds, expected) in file.numbers() {
        if !(bounds[0]..=bounds[1]).contains(&value) {
            return Err(complaint(Some(key), format!("is {value}"), expected));
        }
    }
    Ok((file.motion(), file.events()))
}

/// A number of the file: its key, its value, what it may be, and in words.
type Number = (String, f64, [f64; 2], &'static str);

const POSITION: ([f64; 2], &str) = ([-100.0, 100.0], "metres within 100 (is this mm?)");
const SECONDS: ([f64; 2], &str) = ([0.0, 1e5], "seconds from 0 to 100000");
const LIMIT: ([f64; 2], &str) = ([1e-6, 1e6], "a number from 0.000001 to 1000000");

impl File {
    fn numbers(&self) -> Vec<Number> {
        let number = |key: String, value, (bounds, expected): ([f64; 2], &'static str)| {
            (key, value, bounds, expected)
        };
        let mut all = vec![number("start_m".into(), self.start_m, POSITION)];
        if let Some(limits) = &self.limits {
            for (key, value) in [
                ("limits.velocity_m_s", limits.velocity_m_s),
                ("limits.acceleration_m_s2", limits.acceleration_m_s2),
                ("limits.jerk_m_s3", limits.jerk_m_s3),
            ] {
                all.push(number(key.into(), value, LIMIT));
            }
        }
        for (place, segment) in self.segment.iter().enumerate() {
            let key = |name: &str| format!("segment {} {name}", place + 1);
            match segment {
                FileSegment::Hold { seconds } => {
                    all.push(number(key("seconds"), *seconds, SECONDS));
                }
                FileSegment::Move { to_m } => all.push(number(key("to_m"), *to_m, POSITION)),
                FileSegment::Sine {
                    amplitude_m,
                    frequency_hz,
                    periods,
                } => {
                    let frequency = ([1e-3, 1e3], "Hz from 0.001 to 1000");
                    let count = ([2.0, 1e6], "2 periods or more");
                    all.push(number(key("amplitude_m"), *amplitude_m, POSITION));
                    all.push(number(key("frequency_Hz"), *frequency_hz, frequency));
                    all.push(number(key("periods"), f64::from(*periods), count));
                }
            }
        }
        for (place, event) in self.event.iter().enumerate() {
            let key = |name: &str| format!("event {} {name}", place + 1);
            let (at_s, changed) = match event {
                FileEvent::Push { at_s, force_n } => {
                    let force = ([-1e6, 1e6], "newtons within 1000000");
                    (at_s, number(key("force_N"), *force_n, force))
                }
                FileEvent::Payload { at_s, mass_kg } => {
                    let mass = ([1e-3, 1e6], "kg from 0.001 to 1000000");
                    (at_s, number(key("mass_kg"), *mass_kg, mass))
                }
                FileEvent::Supply { at_s, pressure_pa } => {
                    let pressure = ([1e4, 1e8], "absolute Pa from 10 kPa to 100 MPa");
                    (at_s, number(key("pressure_Pa"), *pressure_pa, pressure))
                }
            };
            all.push(number(key("at_s"), *at_s, SECONDS));
            all.push(changed);
        }
        all
    }

    fn motion(&self) -> Motion {
        let limits = self.limits.as_ref().map_or(Limits::BRISK, |limits| Limits {
            velocity_m_per_s: limits.velocity_m_s,
            acceleration_m_per_s2: limits.acceleration_m_s2,
            jerk_m_per_s3: limits.jerk_m_s3,
        });
        let segments: Vec<Segment> = self.segment.iter().map(FileSegment::segment).collect();
        Motion::new(self.start_m, limits, &segments)
    }

    fn events(&self) -> Vec<Event> {
        self.event.iter().map(FileEvent::event).collect()
    }
}

impl FileSegment {
    fn segment(&self) -> Segment {
        match *self {
            Self::Hold { seconds } => Segment::Hold { seconds },
            Self::Move { to_m } => Segment::Move { to_m },
            Self::Sine {
                amplitude_m,
                frequency_hz,
                periods,
            } => Segment::Sine {
                amplitude_m,
                frequency_hz,
                periods,
            },
        }
    }
}

impl FileEvent {
    fn event(&self) -> Event {
        let (at_s, change) = match *self {
            Self::Push { at_s, force_n } => (at_s, Change::Push(force_n)),
            Self::Payload { at_s, mass_kg } => (at_s, Change::Mass(mass_kg)),
            Self::Supply { at_s, pressure_pa } => (at_s, Change::SupplyPressure(pressure_pa)),
        };
        Event { at_s, change }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "format = \"motion/1\"\n";

    #[test]
    fn prop_a_file_says_what_is_asked_and_what_happens() {
        let text = format!(
            "{HEAD}start_m = 0.01\n[[segment]]\nkind = \"move\"\nto_m = 0.05\n\
             [[segment]]\nkind = \"sine\"\namplitude_m = 0.02\nfrequency_Hz = 2\nperiods = 3\n\
             [[event]]\nkind = \"push\"\nat_s = 1\nforce_N = 5\n"
        );
        let (motion, events) = parse(&text, "m.toml").unwrap();
        assert!((motion.start_m() - 0.01).abs() < 1e-12);
        assert!((motion.end_m() - 0.05).abs() < 1e-12);
        assert_eq!(motion.parts().len(), 2);
        assert_eq!(
            events,
            [Event {
                at_s: 1.0,
                change: Change::Push(5.0)
            }]
        );
    }

    #[test]
    fn prop_a_slip_is_named_on_one_line() {
        for (body, told) in [
            ("[[segment]]\nkind = \"hold\"\nsecond = 1\n", "second"),
            ("[[segment]]\nkind = \"jump\"\n", "jump"),
            (
                "[[segment]]\nkind = \"hold\"\nseconds = -1\n",
                "segment 1 seconds: is -1",
            ),
            ("segment = [\n", "m.toml:2"),
            ("", "segment"),
        ] {
            let error = parse(&format!("{HEAD}{body}"), "m.toml").unwrap_err();
            let line = error.to_string();
            assert!(line.contains(told), "{line}");
            assert!(!line.contains('\n'), "{line}");
        }
    }
}
