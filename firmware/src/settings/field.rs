//! One number of the settings with what it may be, and what is wrong with settings.

use core::fmt;
use model_core::valve::{TABLE_CAPACITY, TableFault};

/// A number of the settings with its name and the range that it must be in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// `section.name`.
    pub name: &'static str,
    /// The number.
    pub value: f32,
    /// The least that is admitted.
    pub lowest: f32,
    /// The most that is admitted.
    pub highest: f32,
    /// Nought is admitted beside the range: it switches off what the number belongs to.
    pub or_none: bool,
}

/// Why settings make no controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SettingsFault {
    /// Infinite, or no number.
    NotFinite(&'static str),
    /// Nought or below, where only a positive number makes sense.
    NonPositive(&'static str),
    /// Beyond what any such rig has.
    OutOfRange(Field),
    /// A table that is none.
    Table(&'static str, TableFault),
    /// Two numbers that cannot both be right: the name of the one, and what is
    /// wrong with it.
    Contradiction(&'static str, &'static str),
}

impl SettingsFault {
    /// The name of the field at fault.
    pub fn field(&self) -> &'static str {
        match self {
            Self::NotFinite(name)
            | Self::NonPositive(name)
            | Self::Table(name, _)
            | Self::Contradiction(name, _) => name,
            Self::OutOfRange(field) => field.name,
        }
    }
}

impl fmt::Display for SettingsFault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite(name) => write!(out, "{name}: is no finite number"),
            Self::NonPositive(name) => write!(out, "{name}: expected a number above 0"),
            Self::OutOfRange(field) => {
                let or_none = if field.or_none { ", or 0" } else { "" };
                write!(
                    out,
                    "{}: {} is out of range, expected {} to {}{or_none}",
                    field.name, field.value, field.lowest, field.highest
                )
            }
            Self::Table(name, fault) => write_table_fault(out, name, fault),
            Self::Contradiction(name, problem) => write!(out, "{name}: {problem}"),
        }
    }
}

fn write_table_fault(out: &mut fmt::Formatter<'_>, name: &str, fault: &TableFault) -> fmt::Result {
    match fault {
        TableFault::Length(count) => write!(
            out,
            "{name}: has {count} points, expected 2 to {TABLE_CAPACITY}"
        ),
        TableFault::LengthsDiffer => write!(out, "{name}: expected as many areas as openings"),
        TableFault::OpeningNotRising(point) => write!(
            out,
            "{name}: opening {point} (counted from 0) does not rise, or the first is not 0"
        ),
        TableFault::AreaNotRising(point) => write!(
            out,
            "{name}: area {point} (counted from 0) is below the one before"
        ),
    }
}

impl Field {
    /// Apart: in every place that asks it takes a kilobyte of code more.
    #[inline(never)]
    pub(super) fn check(&self) -> Result<(), SettingsFault> {
        if !self.value.is_finite() {
            return Err(SettingsFault::NotFinite(self.name));
        }
        if self.or_none && self.value == 0.0 {
            return Ok(());
        }
        if self.value <= 0.0 && self.lowest > 0.0 && !self.or_none {
            return Err(SettingsFault::NonPositive(self.name));
        }
        if self.value < self.lowest || self.value > self.highest {
            return Err(SettingsFault::OutOfRange(*self));
        }
        Ok(())
    }
}

/// The name of a number and the range that it must be in: a row of a table that lies in flash.
#[derive(Clone, Copy)]
pub(super) struct Range {
    name: &'static str,
    lowest: f32,
    highest: f32,
    or_none: bool,
}

impl Range {
    pub(super) const fn field(name: &'static str, lowest: f32, highest: f32) -> Self {
        Self {
            name,
            lowest,
            highest,
            or_none: false,
        }
    }

    /// Of a number that switches something off where it is nought. Next to nothing is neither: what
    /// divides by it is infinite.
    pub(super) const fn or_none(name: &'static str, lowest: f32, highest: f32) -> Self {
        Self {
            or_none: true,
            ..Self::field(name, lowest, highest)
        }
    }

    /// A number in this range, or not.
    pub(super) fn of(&self, value: f32) -> Field {
        Field {
            name: self.name,
            value,
            lowest: self.lowest,
            highest: self.highest,
            or_none: self.or_none,
        }
    }
}

/// Numbers and the ranges that they must be in; the last range is that of all that follow.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub ranges: &'static [Range],
    pub values: &'a [f32],
}

impl<'a> Rows<'a> {
    /// One after the other.
    pub(super) fn iter(self) -> impl Iterator<Item = Field> + 'a {
        let of_the_rest = self.ranges.last().into_iter().cycle();
        let rows = self.ranges.iter().chain(of_the_rest).zip(self.values);
        rows.map(|(range, value)| range.of(*value))
    }

    /// The first number out of its range. In one loop for all tables: one for each takes three
    /// kilobytes of code more.
    pub(super) fn check(self) -> Result<(), SettingsFault> {
        self.check_to(f32::INFINITY)
    }

    /// The same, where no number may be larger than this.
    #[inline(never)]
    pub(super) fn check_to(self, most: f32) -> Result<(), SettingsFault> {
        self.iter().try_for_each(|mut one| {
            one.highest = one.highest.min(most);
            one.check()
        })
    }
}

/// Numbers, each with a range of its own.
pub(super) struct Fields<const N: usize> {
    pub ranges: &'static [Range; N],
    pub values: [f32; N],
}

impl<const N: usize> Fields<N> {
    pub(super) fn rows(&self) -> Rows<'_> {
        Rows {
            ranges: self.ranges,
            values: &self.values,
        }
    }

    /// One after the other.
    pub(super) fn iter(self) -> impl ExactSizeIterator<Item = Field> {
        let rows = self.ranges.iter().zip(self.values);
        rows.map(|(range, value)| range.of(value))
    }
}

/// Fields out of `field(name, value, lowest, highest)` and `or_none(...)`. The names and
/// ranges become a table: built number by number they take two kilobytes of code more.
macro_rules! fields {
    ($($kind:ident($name:expr, $value:expr, $lowest:expr, $highest:expr $(,)?)),* $(,)?) => {{
        const COUNT: usize = [$($name),*].len();
        const RANGES: &[$crate::settings::field::Range; COUNT] =
            &[$($crate::settings::field::Range::$kind($name, $lowest, $highest)),*];
        $crate::settings::field::Fields {
            ranges: RANGES,
            values: [$($value),*],
        }
    }};
}
pub(super) use fields;

pub(super) const fn field(name: &'static str, value: f32, lowest: f32, highest: f32) -> Field {
    Field {
        name,
        value,
        lowest,
        highest,
        or_none: false,
    }
}
