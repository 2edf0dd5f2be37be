//! A scenario file to structs, every complaint with its line.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::time_grid::on_time_grid;
use super::{Command, FORMAT, Initial, Pulse, Scenario, ScenarioError, Segment, Shape};
use crate::recording::Recording;
use crate::rig::{
    COMMAND, Column, Limits, PRESSURE, PositionZero, Rig, Signal, Signals, TEMPERATURE, limits,
    line_at, numeric, positive, read_text, shown,
};
use crate::text::{expected_one_of, one_line};
use crate::units::Unit;

/// Rows of one simulation: at twelve numbers each, half a gigabyte.
const MOST_ROWS: usize = 5_000_000;
/// Integration steps in a row; a finer one shows nothing but rounding.
const MOST_STEPS_PER_SAMPLE: f64 = 10_000.0;
/// How far from whole a count of steps may be by rounding of decimals.
const WHOLE_TOLERANCE: f64 = 1e-6;
const DEFAULT_SAMPLE_S: f64 = 1e-3;

const DURATION: Limits = positive(1e6, "seconds above 0 and at most 1000000");
const STEP: Limits = positive(1.0, "seconds above 0 and at most 1 (is this ms?)");
const TIME: Limits = limits(0.0, 1e6, "seconds from 0 to 1000000");
const POSITION: Limits = limits(-100.0, 100.0, "metres within 100 (is this mm?)");
const VELOCITY: Limits = limits(-100.0, 100.0, "m/s within 100 (is this mm/s?)");
const FREQUENCY: Limits = positive(1e5, "Hz above 0 and at most 100000");
const PHASE: Limits = limits(-100.0, 100.0, "radians within 100");
const SEED: Limits = limits(0.0, 9e15, "a whole number from 0 to 9e15");

const TOP_KEYS: &[&str] = &[
    "format",
    "rig",
    "duration_s",
    "sample_s",
    "step_s",
    "initial",
    "command",
    "noise",
    "record",
];
const INITIAL_KEYS: &[&str] = &[
    "position_m",
    "velocity_m_s",
    "pressure_a_Pa",
    "pressure_b_Pa",
    "temperature_K",
    "command_V",
];

/// A kind of segment, its keys, and what reads them.
struct Kind {
    name: &'static str,
    keys: &'static [&'static str],
    read: fn(&Fields, &Context) -> Result<Shape, ScenarioError>,
}

const KINDS: &[Kind] = &[
    Kind {
        name: "constant",
        keys: &["value_V"],
        read: constant,
    },
    Kind {
        name: "step",
        keys: &["at_s", "from_V", "to_V"],
        read: step,
    },
    Kind {
        name: "pulses",
        keys: &["from_V", "pulses"],
        read: pulses,
    },
    Kind {
        name: "ramp",
        keys: &["from_V", "to_V", "over_s", "at_s"],
        read: ramp,
    },
    Kind {
        name: "sine",
        keys: &["amplitude_V", "frequency_Hz", "center_V", "phase_rad"],
        read: sine,
    },
    Kind {
        name: "chirp",
        keys: &["amplitude_V", "from_Hz", "to_Hz", "over_s", "center_V"],
        read: chirp,
    },
    Kind {
        name: "multisine",
        keys: &["amplitude_V", "frequencies_Hz", "center_V"],
        read: multisine,
    },
    Kind {
        name: "table",
        keys: &["file"],
        read: table,
    },
];

type Entry<'t> = Spanned<DeValue<'t>>;

/// What a segment takes from the rest of the scenario.
struct Context<'a> {
    folder: &'a Path,
    null_v: Option<f64>,
    /// Length of the segment, s.
    length_s: f64,
}

/// The whole file, for complaints.
#[derive(Clone, Copy)]
struct Source<'t> {
    name: &'t str,
    text: &'t str,
}

/// One table of the file.
struct Fields<'e, 't> {
    source: Source<'t>,
    /// What stands before its keys in a complaint: empty at the top.
    path: String,
    table: &'e DeTable<'t>,
    span: Option<Range<usize>>,
}

impl Scenario {
    /// Reads a scenario file and its rig.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ScenarioError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let text = read_text(path, &name, "a scenario file")?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::parse(&text, &name, folder)
    }

    /// Reads the text of a scenario; `folder` is where its paths start from,
    /// `name` what error lines call it.
    pub fn parse(text: &str, name: &str, folder: &Path) -> Result<Self, ScenarioError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let source = Source { name, text };
        let document = DeTable::parse(text).map_err(|error| {
            let problem = format!("not valid TOML: {}", one_line(error.message()));
            source.error(error.span(), None, problem, "")
        })?;
        let top = Fields {
            source,
            path: String::new(),
            table: document.get_ref(),
            span: None,
        };
        read_scenario(&top, folder)
    }
}

fn read_scenario(top: &Fields, folder: &Path) -> Result<Scenario, ScenarioError> {
    check_format(top)?;
    top.only(TOP_KEYS)?;
    let (rig, rig_name) = read_rig(top, folder)?;
    let duration_s = top.needed_number("duration_s", &DURATION)?;
    let sample_s = top.number("sample_s", &STEP)?.unwrap_or(DEFAULT_SAMPLE_S);
    check_rows(top, duration_s, sample_s)?;
    Ok(Scenario {
        name: top.source.name.into(),
        duration_s,
        sample_s,
        steps_per_sample: steps_per_sample(top, sample_s)?,
        initial: read_initial(top, &rig)?,
        command: read_command(top, folder, &rig, duration_s)?,
        noise_seed: read_seed(top)?,
        records_states: reads_states(top)?,
        rig,
        rig_name,
        files: named_files(top, folder)?,
    })
}

/// The files that a scenario names beside itself.
fn named_files(top: &Fields, folder: &Path) -> Result<Vec<PathBuf>, ScenarioError> {
    let text = |fields: &Fields, key: &str| {
        let entry = fields.table.get(key)?;
        entry.get_ref().as_str().map(|file| folder.join(file))
    };
    let commands = top.children("command", "[command] or [[command]] with its kind")?;
    let of_commands = commands.iter().filter_map(|fields| text(fields, "file"));
    Ok(text(top, "rig").into_iter().chain(of_commands).collect())
}

fn check_format(top: &Fields) -> Result<(), ScenarioError> {
    let expected = format!("format = \"{FORMAT}\"");
    if top.needed_text("format", &expected)? == FORMAT {
        return Ok(());
    }
    Err(top.wrong("format", &expected))
}

/// The rig's file, or the rig itself.
fn read_rig(top: &Fields, folder: &Path) -> Result<(Rig, String), ScenarioError> {
    let Some(entry) = top.table.get("rig") else {
        return Err(top.missing("rig", "the rig file's name, or the rig as [rig]"));
    };
    if let DeValue::Table(table) = entry.get_ref() {
        let rig = Rig::from_table(table, top.source.text, top.source.name);
        let rig = rig.map_err(|error| ScenarioError {
            key: error.key.map(|key| top.key(&format!("rig.{key}"))),
            ..error
        })?;
        return Ok((rig, top.source.name.into()));
    }
    let file = top.needed_text("rig", "the rig file's name, or the rig as [rig]")?;
    let path = folder.join(file);
    if !path.is_file() {
        let problem = format!("there is no file {}", one_line(&path.display().to_string()));
        return Err(top.at("rig", problem, "a path relative to the scenario file"));
    }
    Ok((Rig::read(&path)?, path.display().to_string()))
}

/// Rows from 0 to the duration, both included.
pub(super) fn rows(duration_s: f64, sample_s: f64) -> usize {
    (duration_s / sample_s + WHOLE_TOLERANCE).floor() as usize + 1
}

fn check_rows(top: &Fields, duration_s: f64, sample_s: f64) -> Result<(), ScenarioError> {
    let rows = rows(duration_s, sample_s);
    if rows < 2 {
        let expected = format!("at least one sample_s, {sample_s} s");
        return Err(top.wrong("duration_s", &expected));
    }
    if rows <= MOST_ROWS {
        return Ok(());
    }
    let problem = format!("{rows} rows of {sample_s} s");
    Err(top.at("duration_s", problem, &format!("at most {MOST_ROWS} rows")))
}

fn steps_per_sample(top: &Fields, sample_s: f64) -> Result<u32, ScenarioError> {
    let Some(step_s) = top.number("step_s", &STEP)? else {
        return Ok(1);
    };
    let steps = (sample_s / step_s).round();
    let whole = (sample_s / step_s - steps).abs() <= WHOLE_TOLERANCE * steps;
    if !whole || !(1.0..=MOST_STEPS_PER_SAMPLE).contains(&steps) {
        let expected = format!(
            "sample_s = {sample_s} divided by a whole number up to {MOST_STEPS_PER_SAMPLE}"
        );
        return Err(top.wrong("step_s", &expected));
    }
    Ok(steps as u32)
}

fn read_initial(top: &Fields, rig: &Rig) -> Result<Initial, ScenarioError> {
    let Some(fields) = top.child("initial")? else {
        return Ok(Initial::default());
    };
    fields.only(INITIAL_KEYS)?;
    let initial = Initial {
        position_m: fields.number("position_m", &POSITION)?,
        velocity_m_s: fields.number("velocity_m_s", &VELOCITY)?,
        pressure_a_pa: fields.number("pressure_a_Pa", &PRESSURE)?,
        pressure_b_pa: fields.number("pressure_b_Pa", &PRESSURE)?,
        temperature_k: fields.number("temperature_K", &TEMPERATURE)?,
        command_v: fields.number("command_V", &COMMAND)?,
    };
    if let (Some(position_m), Some([low, high])) = (initial.position_m, stroke_range_m(rig))
        && !(low..=high).contains(&position_m)
    {
        let expected = format!("metres within the stroke, {low} to {high}");
        return Err(fields.wrong("position_m", &expected));
    }
    Ok(initial)
}

/// Where the carriage can be, m, when the rig has a stroke.
pub(crate) fn stroke_range_m(rig: &Rig) -> Option<[f64; 2]> {
    let cylinder = rig.cylinder.as_ref()?;
    let stroke_m = cylinder.stroke_m?;
    match cylinder.position_zero? {
        PositionZero::MidStroke => Some([-0.5 * stroke_m, 0.5 * stroke_m]),
        PositionZero::EndA => Some([0.0, stroke_m]),
    }
}

fn read_seed(top: &Fields) -> Result<Option<u64>, ScenarioError> {
    let Some(fields) = top.child("noise")? else {
        return Ok(None);
    };
    fields.only(&["seed"])?;
    let seed = fields.needed_number("seed", &SEED)?;
    if seed.fract() > 0.0 {
        return Err(fields.wrong("seed", SEED.expected));
    }
    Ok(Some(seed as u64))
}

fn reads_states(top: &Fields) -> Result<bool, ScenarioError> {
    let Some(fields) = top.child("record")? else {
        return Ok(false);
    };
    fields.only(&["states"])?;
    match fields.table.get("states").map(Spanned::get_ref) {
        None => Ok(false),
        Some(DeValue::Boolean(states)) => Ok(*states),
        Some(_) => Err(fields.wrong("states", "true or false")),
    }
}

// [command]

fn read_command(
    top: &Fields,
    folder: &Path,
    rig: &Rig,
    duration_s: f64,
) -> Result<Command, ScenarioError> {
    let all = top.children("command", "[command] or [[command]] with its kind")?;
    let mut segments = Vec::new();
    let mut start_s = 0.0;
    for (index, fields) in all.iter().enumerate() {
        let last = index + 1 == all.len();
        let length_s = segment_length_s(fields, last)?;
        let context = Context {
            folder,
            null_v: rig.value("valve.null_V"),
            length_s: length_s.unwrap_or(duration_s - start_s),
        };
        let shape = read_shape(fields, &context)?;
        segments.push(Segment { start_s, shape });
        start_s = on_time_grid(start_s + length_s.unwrap_or(0.0));
    }
    Ok(Command { segments })
}

fn segment_length_s(fields: &Fields, last: bool) -> Result<Option<f64>, ScenarioError> {
    if last {
        return fields.number("duration_s", &DURATION);
    }
    fields.needed_number("duration_s", &DURATION).map(Some)
}

fn read_shape(fields: &Fields, context: &Context) -> Result<Shape, ScenarioError> {
    let names: Vec<&str> = KINDS.iter().map(|kind| kind.name).collect();
    let one_of = format!("one of: {}", names.join(", "));
    let name = fields.needed_text("kind", &one_of)?;
    let Some(kind) = KINDS.iter().find(|kind| kind.name == name) else {
        return Err(fields.wrong("kind", &expected_one_of(name, &names)));
    };
    fields.only(&[&["kind", "duration_s"], kind.keys].concat())?;
    (kind.read)(fields, context)
}

fn constant(fields: &Fields, _: &Context) -> Result<Shape, ScenarioError> {
    Ok(Shape::Constant {
        value_v: fields.needed_number("value_V", &COMMAND)?,
    })
}

fn step(fields: &Fields, _: &Context) -> Result<Shape, ScenarioError> {
    Ok(Shape::Step {
        at_s: fields.needed_number("at_s", &TIME)?,
        from_v: fields.needed_number("from_V", &COMMAND)?,
        to_v: fields.needed_number("to_V", &COMMAND)?,
    })
}

fn pulses(fields: &Fields, _: &Context) -> Result<Shape, ScenarioError> {
    let expected = "a list: pulses = [{ at_s = 0.1, duration_s = 0.05, to_V = 6.0 }]";
    let pulses = fields.children("pulses", expected)?;
    Ok(Shape::Pulses {
        from_v: fields.needed_number("from_V", &COMMAND)?,
        pulses: pulses.iter().map(pulse).collect::<Result<_, _>>()?,
    })
}

fn pulse(fields: &Fields) -> Result<Pulse, ScenarioError> {
    fields.only(&["at_s", "duration_s", "to_V"])?;
    Ok(Pulse {
        at_s: fields.needed_number("at_s", &TIME)?,
        duration_s: fields.needed_number("duration_s", &DURATION)?,
        to_v: fields.needed_number("to_V", &COMMAND)?,
    })
}

fn ramp(fields: &Fields, _: &Context) -> Result<Shape, ScenarioError> {
    Ok(Shape::Ramp {
        at_s: fields.number("at_s", &TIME)?.unwrap_or(0.0),
        over_s: fields.needed_number("over_s", &DURATION)?,
        from_v: fields.needed_number("from_V", &COMMAND)?,
        to_v: fields.needed_number("to_V", &COMMAND)?,
    })
}

fn sine(fields: &Fields, context: &Context) -> Result<Shape, ScenarioError> {
    Ok(Shape::Sine {
        center_v: center_v(fields, context)?,
        amplitude_v: fields.needed_number("amplitude_V", &COMMAND)?,
        frequency_hz: fields.needed_number("frequency_Hz", &FREQUENCY)?,
        phase_rad: fields.number("phase_rad", &PHASE)?.unwrap_or(0.0),
    })
}

fn chirp(fields: &Fields, context: &Context) -> Result<Shape, ScenarioError> {
    let over_s = fields.number("over_s", &DURATION)?;
    Ok(Shape::Chirp {
        center_v: center_v(fields, context)?,
        amplitude_v: fields.needed_number("amplitude_V", &COMMAND)?,
        from_hz: fields.needed_number("from_Hz", &FREQUENCY)?,
        to_hz: fields.needed_number("to_Hz", &FREQUENCY)?,
        // A segment that begins after the end is never asked.
        over_s: over_s.unwrap_or(context.length_s.max(DEFAULT_SAMPLE_S)),
    })
}

fn multisine(fields: &Fields, context: &Context) -> Result<Shape, ScenarioError> {
    Ok(Shape::Multisine {
        center_v: center_v(fields, context)?,
        amplitude_v: fields.needed_number("amplitude_V", &COMMAND)?,
        frequencies_hz: fields.needed_numbers("frequencies_Hz", &FREQUENCY)?,
    })
}

/// The middle of an oscillation: the valve's null unless said.
fn center_v(fields: &Fields, context: &Context) -> Result<f64, ScenarioError> {
    let center_v = fields.number("center_V", &COMMAND)?.or(context.null_v);
    center_v.ok_or_else(|| fields.missing("center_V", "a command, as the rig has no valve"))
}

fn table(fields: &Fields, context: &Context) -> Result<Shape, ScenarioError> {
    let file = fields.needed_text("file", "a file name")?;
    let problem = |error: &dyn ToString| fields.at("file", error.to_string(), "");
    let unit = |text| Unit::parse(text).map_err(|error| problem(&error));
    let signals = Signals {
        by_name: BTreeMap::from([
            ("t".into(), column(0, unit("s")?)),
            ("u".into(), column(1, unit("V")?)),
        ]),
        ..Signals::default()
    };
    let recording =
        Recording::read(context.folder.join(file), &signals).map_err(|error| problem(&error))?;
    Ok(Shape::Table {
        command_v: recording.signal("u").unwrap_or(&[]).to_vec(),
        time_s: recording.time_s,
    })
}

fn column(number: usize, unit: Unit) -> Signal {
    Signal {
        column: Column::Number(number),
        unit,
        noise: None,
        resolution: None,
        scale: None,
        offset: None,
    }
}

impl<'e, 't> Fields<'e, 't> {
    fn key(&self, name: &str) -> String {
        match self.path.as_str() {
            "" => name.into(),
            path => format!("{path}.{name}"),
        }
    }

    /// Refuses every key that is not known here.
    fn only(&self, known: &[&str]) -> Result<(), ScenarioError> {
        let stranger = self
            .table
            .iter()
            .find(|(name, _)| !known.contains(&name.get_ref().as_ref()));
        let Some((name, _)) = stranger else {
            return Ok(());
        };
        let key = self.key(&one_line(name.get_ref()));
        let expected = expected_one_of(name.get_ref(), known);
        let span = Some(name.span());
        Err(self
            .source
            .error(span, Some(&key), "unknown key".into(), &expected))
    }

    fn number(&self, name: &str, limits: &Limits) -> Result<Option<f64>, ScenarioError> {
        let Some(entry) = self.table.get(name) else {
            return Ok(None);
        };
        let key = self.key(name);
        self.source.number(&key, entry, limits).map(Some)
    }

    fn needed_number(&self, name: &str, limits: &Limits) -> Result<f64, ScenarioError> {
        let number = self.number(name, limits)?;
        number.ok_or_else(|| self.missing(name, limits.expected))
    }

    fn needed_numbers(&self, name: &str, limits: &Limits) -> Result<Vec<f64>, ScenarioError> {
        let expected = format!("a list of {}", limits.expected);
        let Some(entry) = self.table.get(name) else {
            return Err(self.missing(name, &expected));
        };
        let list = entry.get_ref().as_array().filter(|list| !list.is_empty());
        let list = list.ok_or_else(|| self.wrong(name, &expected))?;
        let number = |(place, entry): (usize, &Entry)| {
            let key = format!("{}[{place}]", self.key(name));
            self.source.number(&key, entry, limits)
        };
        list.iter().enumerate().map(number).collect()
    }

    fn needed_text(&self, name: &str, expected: &str) -> Result<&'e str, ScenarioError> {
        let Some(entry) = self.table.get(name) else {
            return Err(self.missing(name, expected));
        };
        let text = entry.get_ref().as_str();
        text.ok_or_else(|| self.wrong(name, expected))
    }

    fn child(&self, name: &str) -> Result<Option<Self>, ScenarioError> {
        let Some(entry) = self.table.get(name) else {
            return Ok(None);
        };
        let table = entry.get_ref().as_table();
        let table = table.ok_or_else(|| self.wrong(name, "a table"))?;
        Ok(Some(self.inside(self.key(name), table, entry)))
    }

    /// A list of tables; one table is a list of one.
    fn children(&self, name: &str, expected: &str) -> Result<Vec<Self>, ScenarioError> {
        let Some(entry) = self.table.get(name) else {
            return Err(self.missing(name, expected));
        };
        if let DeValue::Table(table) = entry.get_ref() {
            return Ok(vec![self.inside(self.key(name), table, entry)]);
        }
        let list = entry.get_ref().as_array().filter(|list| !list.is_empty());
        let list = list.ok_or_else(|| self.wrong(name, expected))?;
        let child = |(place, entry): (usize, &'e Entry<'t>)| {
            let table = entry.get_ref().as_table();
            let table = table.ok_or_else(|| self.wrong(name, expected))?;
            Ok(self.inside(format!("{}[{place}]", self.key(name)), table, entry))
        };
        list.iter().enumerate().map(child).collect()
    }

    fn inside(&self, path: String, table: &'e DeTable<'t>, entry: &Entry<'t>) -> Self {
        Fields {
            source: self.source,
            path,
            table,
            span: Some(entry.span()),
        }
    }

    fn missing(&self, name: &str, expected: &str) -> ScenarioError {
        let key = self.key(name);
        self.source
            .error(self.span.clone(), Some(&key), "missing".into(), expected)
    }

    /// What stands there is not what was expected.
    fn wrong(&self, name: &str, expected: &str) -> ScenarioError {
        let found = self.table.get(name).map(shown).unwrap_or_default();
        self.at(name, format!("is {found}"), expected)
    }

    fn at(&self, name: &str, problem: String, expected: &str) -> ScenarioError {
        let span = self.table.get(name).map(Spanned::span);
        let key = self.key(name);
        self.source.error(span, Some(&key), problem, expected)
    }
}

impl Source<'_> {
    fn number(&self, key: &str, entry: &Entry, limits: &Limits) -> Result<f64, ScenarioError> {
        let value = numeric(entry).filter(|value| limits.admit(*value));
        value.ok_or_else(|| {
            let problem = format!("is {}", shown(entry));
            self.error(Some(entry.span()), Some(key), problem, limits.expected)
        })
    }

    fn error(
        &self,
        span: Option<Range<usize>>,
        key: Option<&str>,
        problem: String,
        expected: &str,
    ) -> ScenarioError {
        ScenarioError {
            file: self.name.into(),
            line: span.map(|span| line_at(self.text, span.start)),
            key: key.map(String::from),
            problem,
            expected: expected.into(),
        }
    }
}
