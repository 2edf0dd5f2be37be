//! The time column: numbers in the rig's unit, clock times, or dates with a clock time.
//!
//! - Numbers of an epoch (seconds, ms, us or ns since 1970 or 1904) and texts count from the
//!   first row. The difference is taken in whole decimals or nanoseconds before it becomes a
//!   float, so no digit of a nanosecond stamp is lost. Other numbers stay as they are.
//! - A counter that wraps is unwrapped where the step across the wrap is a usual one.
//! - A clock time that falls by more than half a day has passed midnight.
//!
//! Limits: dates without a time zone are taken as they stand, also across a change to or from
//! summer time; fractions beyond the nanosecond are dropped.

use std::ops::RangeInclusive;
use std::str::FromStr;

use jiff::Timestamp;
use jiff::civil::Date;

use super::number::{CellFault, Numbers, is_no_value};
use crate::rig::Signal;
use crate::text::{one_line, plain};
use crate::units::Unit;

/// Numbers from here on are instants since an epoch: three years is no recording.
const EPOCH_FROM_S: f64 = 1e8;
/// Beyond the year 5000: the unit is wrong.
const EPOCH_TO_S: f64 = 1e11;
const NANOSECONDS: i128 = 1_000_000_000;
const HOUR: i128 = 3600 * NANOSECONDS;
const DAY: i128 = 24 * HOUR;
/// The steps before a wrap that say what a usual one is.
const USUAL_ROWS: usize = 64;
/// Share of a usual step by which the step across a wrap may differ: rounding of a decimal.
const STEP_MARGIN: f64 = 0.01;
/// A fall from the last of this share of a counter's range into the first is called a wrap.
const WRAP_SHARE: f64 = 0.01;
/// A stamp may run backward by so many steps where the stamps are late.
const LATE_STEPS: f64 = 5.0;
/// Up to this share of repeated stamps is a slip of the logger; more is its clock.
const FEW_REPEATS: f64 = 0.01;
/// Steps of recordings; outside of them the unit is doubted.
const USUAL_STEPS_S: RangeInclusive<f64> = 1e-6..=100.0;
/// A time this close to the first one, as a share of the time since, starts another run.
const NEXT_RUN_SHARE: f64 = 0.01;

/// Counters that loggers stamp rows with: period in the column's unit, and its name.
const COUNTERS: [(f64, &str); 10] = [
    (65_536.0, "16-bit counter"),
    (16_777_216.0, "24-bit counter"),
    (4_294_967_296.0, "32-bit counter"),
    // Microseconds written as milliseconds or seconds, milliseconds as seconds.
    (4_294_967.296, "32-bit counter"),
    (4_294.967_296, "32-bit counter"),
    (65.536, "16-bit counter"),
    // Clocks in seconds and in milliseconds. Runs of a minute or an hour are common, and a second
    // one that follows in the same file is none of them.
    (86_400.0, "clock at midnight"),
    (86_400_000.0, "clock at midnight"),
    (604_800.0, "clock of GPS at the week's end"),
    (604_800_000.0, "clock of GPS at the week's end"),
];

/// What the cells of the column are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Number,
    Epoch {
        first: f64,
        exact: Option<Exact>,
    },
    Date {
        first: i128,
    },
    /// Starts again after each period (a day; an hour where no hours are written).
    Clock {
        first: i128,
        period: i128,
    },
}

/// The time column while it grows.
pub(super) struct TimeColumn<'s> {
    pub signal: &'s Signal,
    kind: Option<Kind>,
    /// Added to what is recorded: whole periods of a counter.
    wrapped: f64,
    /// Added to clock times: whole periods of the clock.
    turned: i128,
    /// Line of the first wrap, what wrapped there, and how often it did.
    wraps: Option<(u32, &'static str, usize)>,
    last_recorded: f64,
    /// Line of the first repeated stamp, the line that it repeats.
    repeated: Option<(u32, u32)>,
    repeats: usize,
    /// Time of the rows, s.
    pub values: Vec<f64>,
    origin: Option<String>,
}

impl<'s> TimeColumn<'s> {
    pub(super) fn new(signal: &'s Signal, rows: usize) -> Self {
        Self {
            signal,
            kind: None,
            wrapped: 0.0,
            turned: 0,
            wraps: None,
            last_recorded: 0.0,
            repeated: None,
            repeats: 0,
            values: Vec::with_capacity(rows),
            origin: None,
        }
    }

    /// The instant that a cell states, s; `None` where it states none.
    pub(super) fn read(
        &mut self,
        cell: &[u8],
        line: u32,
        numbers: &mut Numbers,
    ) -> Result<Option<f64>, CellFault> {
        let text = std::str::from_utf8(cell).unwrap_or("\u{fffd}");
        let kind = match self.kind {
            Some(kind) => kind,
            None if is_no_value(text) => return Ok(None),
            None => self.decide(text, line, numbers)?,
        };
        match kind {
            Kind::Number => self.number(cell, line, numbers),
            _ if is_no_value(text) => Ok(None),
            Kind::Epoch { first, exact } => {
                let since = match (Exact::of(text), exact) {
                    (Some(now), Some(first)) => now.minus(first),
                    _ => None,
                };
                let since = match since {
                    Some(since) => since,
                    None => numbers.read(cell)?.unwrap_or(first) - first,
                };
                Ok(Some(self.signal.to_si(since, 0.0)))
            }
            Kind::Date { first } => {
                let now = date_and_clock(text).ok_or_else(|| no_time(text))?;
                Ok(Some(self.since(now - first)))
            }
            Kind::Clock { first, period } => {
                let (now, _) = clock(text).ok_or_else(|| no_time(text))?;
                self.clocked(now - first, period, line)
            }
        }
    }

    /// What the column holds, by its first cell.
    fn decide(&mut self, text: &str, line: u32, numbers: &mut Numbers) -> Result<Kind, CellFault> {
        let shown = one_line(text);
        let (kind, origin) = match numbers.read(text.as_bytes()) {
            Ok(value) => {
                let first = value.unwrap_or(0.0);
                let first_s = self.signal.to_si(first, 0.0).abs();
                if first_s < EPOCH_FROM_S {
                    (Kind::Number, None)
                } else if first_s > EPOCH_TO_S {
                    return Err(self.wrong_unit(first));
                } else {
                    let exact = Exact::of(text);
                    (Kind::Epoch { first, exact }, Some(shown))
                }
            }
            Err(fault) => {
                let kind = if let Some(first) = date_and_clock(text) {
                    Kind::Date { first }
                } else if let Some((first, period)) = clock(text) {
                    Kind::Clock { first, period }
                } else if text.contains(['/', ':', '-'])
                    && text.contains(|one: char| one.is_ascii_digit())
                    && !text.starts_with(char::is_alphabetic)
                {
                    return Err(no_time(text));
                } else {
                    return Err(fault);
                };
                (kind, Some(shown))
            }
        };
        self.origin = origin.map(|origin| format!("time counts from {origin} (line {line})"));
        self.kind = Some(kind);
        Ok(kind)
    }

    fn wrong_unit(&self, recorded: f64) -> CellFault {
        let fits = |unit: &&str| {
            let factor = Unit::parse(unit).map_or(0.0, |unit| unit.factor());
            (EPOCH_FROM_S..EPOCH_TO_S).contains(&(recorded.abs() * factor))
        };
        let unit = ["ms", "us", "ns"].into_iter().find(fits);
        CellFault {
            problem: format!("{recorded} {} is no time of a recording", self.signal.unit),
            expected: unit.map_or_else(
                || "a time in the unit of the rig".into(),
                |unit| format!("unit = \"{unit}\" in the rig (a time since 1970?)"),
            ),
        }
    }

    fn number(
        &mut self,
        cell: &[u8],
        line: u32,
        numbers: &mut Numbers,
    ) -> Result<Option<f64>, CellFault> {
        let Some(recorded) = numbers.read(cell)? else {
            return Ok(None);
        };
        let mut time_s = self.signal.to_si(recorded + self.wrapped, 0.0);
        if self.values.last().is_some_and(|last_s| time_s < *last_s) {
            time_s = self.unwrapped(recorded, line)?.unwrap_or(time_s);
        }
        self.last_recorded = recorded;
        Ok(Some(time_s))
    }

    /// The time across a wrap of a counter; `None` where the fall is no wrap.
    fn unwrapped(&mut self, recorded: f64, line: u32) -> Result<Option<f64>, CellFault> {
        let last_s = self.values.last().copied().unwrap_or(0.0);
        let usual = self.usual_steps_s();
        for (period, name) in COUNTERS {
            let time_s = self.signal.to_si(recorded + self.wrapped + period, 0.0);
            if usual.contains(&(time_s - last_s)) {
                self.wrapped += period;
                self.note_wrap(line, name);
                return Ok(Some(time_s));
            }
        }
        let wraps = |(period, _): &&(f64, &str)| {
            let near_end = |end: f64| {
                (end - WRAP_SHARE * period..end).contains(&self.last_recorded)
                    && (end - period..end - period + WRAP_SHARE * period).contains(&recorded)
            };
            recorded.fract() == 0.0
                && period.fract() == 0.0
                && (near_end(*period) || near_end(period / 2.0))
        };
        COUNTERS.iter().find(wraps).map_or(Ok(None), |(period, name)| {
            Err(CellFault {
                problem: format!(
                    "the time wraps from {} to {recorded} (a {name}) with a step that is not the usual one",
                    self.last_recorded
                ),
                expected: format!(
                    "a time without wraps: add {period} from this line on, or cut the file here"
                ),
            })
        })
    }

    /// The steps of the last rows, with a margin.
    fn usual_steps_s(&self) -> RangeInclusive<f64> {
        let recent = &self.values[self.values.len().saturating_sub(USUAL_ROWS)..];
        let steps = recent.windows(2).map(|pair| pair[1] - pair[0]);
        let (shortest, longest) = steps.fold((f64::INFINITY, 0.0_f64), |(low, high), step| {
            (low.min(step), high.max(step))
        });
        shortest * (1.0 - STEP_MARGIN)..=longest * (1.0 + STEP_MARGIN)
    }

    fn clocked(
        &mut self,
        since_first: i128,
        period: i128,
        line: u32,
    ) -> Result<Option<f64>, CellFault> {
        let last_s = self.values.last().copied().unwrap_or(0.0);
        let mut time_s = self.since(since_first + self.turned);
        if last_s - time_s > self.since(period) / 2.0 {
            self.turned += period;
            time_s = self.since(since_first + self.turned);
            let name = if period == DAY {
                "clock at midnight"
            } else {
                "clock at the full hour"
            };
            self.note_wrap(line, name);
        }
        Ok(Some(time_s))
    }

    fn note_wrap(&mut self, line: u32, name: &'static str) {
        let (_, _, count) = self.wraps.get_or_insert((line, name, 0));
        *count += 1;
    }

    /// What was decided on the times.
    pub(super) fn remarks(&self) -> Vec<String> {
        let mut remarks: Vec<String> = self.origin.iter().cloned().collect();
        if let Some((line, name, count)) = self.wraps {
            let times = if count > 1 {
                format!(", the first of {count} times")
            } else {
                String::new()
            };
            remarks.push(format!(
                "the time wraps (a {name}) at line {line}{times}: unwrapped"
            ));
        }
        let (first_s, last_s) = (self.values.first(), self.values.last());
        let span_s = last_s
            .zip(first_s)
            .map_or(0.0, |(last, first)| last - first);
        let step_s = span_s / (self.values.len() as f64 - 1.0);
        if self.values.len() > 1 && !USUAL_STEPS_S.contains(&step_s) {
            remarks.push(format!(
                "rows are {step_s:.2e} s apart on average: is the unit of the time right?"
            ));
        }
        remarks
    }

    /// Nanoseconds as the rig scales the column, s.
    fn since(&self, nanoseconds: i128) -> f64 {
        nanoseconds as f64 / NANOSECONDS as f64 * self.signal.scale.unwrap_or(1.0)
            + self.signal.offset.unwrap_or(0.0)
    }

    /// What is wrong with a time that does not rise, if it runs backward.
    pub(super) fn backward(&self, time_s: f64, last_line: u32) -> Option<CellFault> {
        let (first_s, last_s) = (*self.values.first()?, *self.values.last()?);
        if time_s >= last_s {
            return None;
        }
        let next_run = time_s - first_s <= NEXT_RUN_SHARE * (last_s - first_s);
        let hint = if self.values.len() < 2 {
            "the newest row stands first? reverse the rows"
        } else if next_run {
            "another run begins here? cut the file before this line"
        } else if self.is_again(time_s) {
            "rows stand here again, or the clock was set back? cut the file before this line"
        } else {
            "sort the rows by time"
        };
        Some(CellFault {
            problem: format!("time {time_s} s runs backward from line {last_line} ({last_s} s)"),
            expected: format!("strictly increasing time; {hint}"),
        })
    }

    /// Whether a stamp that runs backward begins a stretch that stands above already, by more than
    /// jitter.
    fn is_again(&self, time_s: f64) -> bool {
        self.values.contains(&time_s) || !self.may_be_late(time_s)
    }

    /// Whether a stamp runs backward by no more than late stamps of even rows may.
    pub(super) fn may_be_late(&self, time_s: f64) -> bool {
        let recent = &self.values[self.values.len().saturating_sub(USUAL_ROWS)..];
        let (Some(first_s), Some(last_s)) = (recent.first(), recent.last()) else {
            return false;
        };
        let step_s = (last_s - first_s) / (recent.len() - 1).max(1) as f64;
        last_s - time_s < LATE_STEPS * step_s
    }

    /// Line of the first stamp that repeats the one before, where few do.
    pub(super) fn few_repeats(&self) -> Option<u32> {
        let (line, _) = self.repeated?;
        let is_few = self.repeats as f64 <= FEW_REPEATS * self.values.len() as f64;
        is_few.then_some(line)
    }

    /// Notes that a row has the stamp of the row before.
    pub(super) fn note_repeat(&mut self, line: u32, last_line: u32) {
        self.repeated.get_or_insert((line, last_line));
        self.repeats += 1;
    }

    /// What is wrong with the stamps of the whole column, and the line where it shows first.
    pub(super) fn repeats(&self) -> Option<(u32, CellFault)> {
        let (line, last_line) = self.repeated?;
        let rows = self.values.len();
        let mut steps: Vec<f64> = self
            .values
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        let mean_s = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
        steps.retain(|step| *step > 0.0);
        steps.sort_by(f64::total_cmp);
        let problem = format!("the time repeats that of line {last_line}");
        let fault = if (self.repeats as f64) <= FEW_REPEATS * rows as f64 {
            CellFault {
                problem: format!("{problem}, with other values"),
                expected: "strictly increasing time; delete one of the rows".into(),
            }
        } else {
            let tick = steps.get(steps.len() / 2).map(|tick_s| {
                let ms = plain(tick_s * 1e3, 4);
                format!(": the clock ticks each {ms} ms")
            });
            let rate =
                (mean_s > 0.0).then(|| format!(" ({} Hz on average)", plain(1.0 / mean_s, 4)));
            CellFault {
                problem: format!(
                    "{problem}, as in {} of {rows} rows{}",
                    self.repeats,
                    tick.unwrap_or_default()
                ),
                expected: format!(
                    "a time of its own for each row: log a finer clock, or number the rows by the sampling rate{}",
                    rate.unwrap_or_default()
                ),
            }
        };
        Some((line, fault))
    }
}

fn no_time(text: &str) -> CellFault {
    CellFault {
        problem: format!("\"{}\" is no time that can be read", one_line(text)),
        expected:
            "a number, a clock time (09:12:31.250) or a date with it (2026-03-02T09:12:31.250)"
                .into(),
    }
}

/// Whether a text is a clock time or a date with one.
pub(super) fn is_time(text: &str) -> bool {
    text.contains([':', 'T']) && (clock(text).is_some() || date_and_clock(text).is_some())
}

/// A decimal number without rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Exact {
    mantissa: i128,
    decimals: u32,
}

impl Exact {
    fn of(text: &str) -> Option<Self> {
        let (whole, decimals) = text.split_once(['.', ',']).unwrap_or((text, ""));
        Some(Self {
            mantissa: format!("{whole}{decimals}").parse().ok()?,
            decimals: u32::try_from(decimals.len()).ok()?,
        })
    }

    /// The difference, rounded once; `None` where it has too many digits.
    fn minus(self, other: Self) -> Option<f64> {
        let decimals = self.decimals.max(other.decimals);
        let whole = |one: Self| {
            let factor = 10_i128.checked_pow(decimals - one.decimals)?;
            one.mantissa.checked_mul(factor)
        };
        let difference = whole(self)?.checked_sub(whole(other)?)?;
        Some(difference as f64 / 10_f64.powi(i32::try_from(decimals).ok()?))
    }
}

/// Nanoseconds since 1970 of a date with a clock time; without a zone as if in UTC.
fn date_and_clock(text: &str) -> Option<i128> {
    if let Ok(instant) = Timestamp::from_str(text) {
        return Some(instant.as_nanosecond());
    }
    let (date, time) = text.split_once([' ', 'T', '_'])?;
    let (time, period) = clock(time.trim())?;
    let days = days(date)?;
    (period == DAY).then_some(days * DAY + time)
}

/// Months as programs abbreviate them.
const MONTHS: [&str; 12] = [
    "jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec",
];

/// Days since 1970 of `2026-03-02`, `2026/03/02`, `2026.03.02`, `02.03.2026` or `02-Mar-2026`.
/// Which is the day of two numbers before a year, with slashes or dashes, is anybody's guess.
fn days(date: &str) -> Option<i128> {
    let parts: Vec<&str> = date.split(['-', '/', '.']).collect();
    let [first, month, last] = parts[..] else {
        return None;
    };
    let lower = month.to_ascii_lowercase();
    let named = MONTHS.iter().position(|name| *name == lower);
    let (year, day) = match (first.len(), last.len()) {
        (4, _) => (first, last),
        (_, 4) if date.contains('.') || named.is_some() => (last, first),
        _ => return None,
    };
    let month = match named {
        Some(place) => i8::try_from(place + 1).ok()?,
        None => month.parse().ok()?,
    };
    let date = Date::new(year.parse().ok()?, month, day.parse().ok()?).ok()?;
    let since = date.since(Date::constant(1970, 1, 1)).ok()?;
    Some(i128::from(since.get_days()))
}

/// Nanoseconds of a clock time and the period after which it starts again: `9:12:31.250`,
/// `09:12:31:250`, `12:31.25` (minutes and seconds, as spreadsheets show it), `9:12:31 PM`.
fn clock(text: &str) -> Option<(i128, i128)> {
    let (text, noon) = match text.rsplit_once(' ') {
        Some((time, half)) if half.eq_ignore_ascii_case("PM") => (time, Some(12)),
        Some((time, half)) if half.eq_ignore_ascii_case("AM") => (time, Some(0)),
        _ => (text, None),
    };
    let parts: Vec<&str> = text.split(':').collect();
    let (hours, minutes, seconds, fraction) = match parts[..] {
        [hours, minutes, seconds, thousandths] if thousandths.len() == 3 => {
            (Some(hours), minutes, seconds, thousandths)
        }
        [hours, minutes, seconds] => {
            let (seconds, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, "0"));
            (Some(hours), minutes, seconds, fraction)
        }
        [minutes, seconds] => {
            let (seconds, fraction) = seconds.split_once(['.', ','])?;
            (None, minutes, seconds, fraction)
        }
        _ => return None,
    };
    let hour = hours.map_or(Some(0), |hours| whole(hours, u32::MAX.into()))?;
    let hour = noon.map_or(hour, |noon| hour % 12 + noon);
    let clock = (hour * 60 + whole(minutes, 60)?) * 60 + whole(seconds, 60)?;
    let nanoseconds = clock * NANOSECONDS + nanoseconds(fraction)?;
    Some((nanoseconds, if hours.is_some() { DAY } else { HOUR }))
}

/// A number of digits below a limit.
fn whole(text: &str, limit: i128) -> Option<i128> {
    let digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse().ok().filter(|value| digits && *value < limit)
}

/// Nanoseconds of the digits behind the decimal mark.
fn nanoseconds(fraction: &str) -> Option<i128> {
    whole(fraction, i128::MAX)?;
    format!("{fraction:0<9}")[..9].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_clock_times() {
        for (text, milliseconds) in [
            ("09:12:31.250", 33_151_250),
            ("9:12:31,25", 33_151_250),
            ("09:12:31:250", 33_151_250),
            ("09:12:31", 33_151_000),
            ("9:12:31.25 PM", 76_351_250),
            ("12:00:01 AM", 1_000),
            ("12:31.5", 751_500),
        ] {
            let (nanoseconds, _) = clock(text).expect(text);
            assert_eq!(nanoseconds, milliseconds * 1_000_000, "{text}");
        }
        for text in ["12:31", "1:2:3:4:5", "09:61:00", "a:b:c", "::", "-1:00:00"] {
            assert_eq!(clock(text), None, "{text}");
        }
    }

    #[test]
    fn val_dates_with_a_clock_time() {
        let expected = 1_772_442_751_250_000_000;
        for text in [
            "2026-03-02 09:12:31.250",
            "2026-03-02T09:12:31,25",
            "2026-03-02T09:12:31.25Z",
            "2026-03-02T10:12:31.25+01:00",
            "2026/03/02 09:12:31.25",
            "02.03.2026 09:12:31,250",
            "02-Mar-2026 09:12:31.250",
        ] {
            assert_eq!(date_and_clock(text), Some(expected), "{text}");
        }
        for text in ["03/02/2026 09:12:31", "2026-13-02 09:12:31", "2026-03-02"] {
            assert_eq!(date_and_clock(text), None, "{text}");
        }
    }

    #[test]
    fn prop_differences_of_long_decimals_are_rounded_once() {
        let minus = |one: &str, other: &str| Exact::of(one)?.minus(Exact::of(other)?);
        let first = "1772442751250000000";
        assert_eq!(minus("1772442751250000001", first), Some(1.0));
        assert_eq!(minus("1772442751.001", "1772442751"), Some(0.001));
        assert_eq!(minus("1e9", "0"), None);
        let (long, short) = (format!("1.{}", "0".repeat(60)), "1");
        assert_eq!(minus(&long, short), None);
    }
}
