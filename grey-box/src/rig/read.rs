//! A rig file to structs: every key known, every value sane, every complaint
//! with its line.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fs::{self, File};
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use firmware::settings::Gains;
use model_core::valve::TABLE_CAPACITY;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

mod board;

use super::facts::Limits;
use super::keys::{
    CHOICES, ChoiceKey, NUMBERS, NumberKey, SECTIONS, section_names, uncertainty_is_absolute,
};
use super::signals::{SIGNALS, signal_key, signal_key_names};
use super::stated_flow::{CRITICAL_RATIO, STATED_FLOW, StatedFlow, StatedFlowFault, deviates};
use super::valve_table::ValveTable;
use super::{
    Actuator, Axis, Carriage, ChamberModel, Chambers, Column, Cylinder, EffectFault, Environment,
    FORMAT, Friction, Gas, Horizon, Rig, RigError, Signal, Supply, Valve, Vessel,
};
use crate::effects;
use crate::text::{closest, expected_one_of, one_line};
use crate::units::{Dimension, Unit};

/// A rig file is typed by a person; anything larger is some other file.
const LARGEST_FILE_BYTES: u64 = 1 << 20;
/// Areas come with tolerance and seals: above this share of the bore's
/// circle an area is a slip.
const AREA_OVER_BORE: f64 = 1.1;
/// Below this share of it too: no rod takes more than half of a bore's circle.
const LEAST_AREA_OVER_BORE: f64 = 0.3;
/// Static friction below this share of the Coulomb friction is a slip.
const STATIC_OVER_COULOMB: f64 = 0.5;

/// Judges one `[effects.NAME]`: its name and parameters, or what is wrong.
pub type EffectCheck<'a> = &'a dyn Fn(&str, &BTreeMap<String, f64>) -> Result<(), EffectFault>;

type Entry<'t> = Spanned<DeValue<'t>>;
type Name<'t> = Spanned<Cow<'t, str>>;

impl Rig {
    /// Reads a rig file; its effects must be in [`effects::EFFECTS`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, RigError> {
        Self::read_with(path, &effects::check)
    }

    /// Reads a rig file with another judge of its effects.
    pub fn read_with(path: impl AsRef<Path>, effects: EffectCheck) -> Result<Self, RigError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let text = read_text(path, &name, "a rig file")?;
        Self::parse_with(&text, &name, effects)
    }

    /// Reads a rig file with all that is wrong in it, see [`Rig::faults`]; fails only where the
    /// file cannot be read.
    pub fn read_faults(path: impl AsRef<Path>) -> Result<(Self, Vec<RigError>), RigError> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let text = read_text(path, &name, "a rig file")?;
        Ok(Self::faults(&text, &name))
    }

    /// Reads the text of a rig file; `name` is what error lines call it.
    pub fn parse(text: &str, name: &str) -> Result<Self, RigError> {
        Self::parse_with(text, name, &effects::check)
    }

    /// As [`Rig::parse`], with another judge of the effects' names and parameters.
    pub fn parse_with(text: &str, name: &str, effects: EffectCheck) -> Result<Self, RigError> {
        let (rig, mut faults) = Self::parse_all(text, name, effects);
        if faults.is_empty() {
            return Ok(rig);
        }
        Err(faults.swap_remove(0))
    }

    /// All that is wrong with the text of a rig file, and the rig of what is right in it. Where
    /// the text is no TOML at all only the first fault is known.
    pub fn faults(text: &str, name: &str) -> (Self, Vec<RigError>) {
        Self::parse_all(text, name, &effects::check)
    }

    fn parse_all(text: &str, name: &str, effects: EffectCheck) -> (Self, Vec<RigError>) {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader = Reader::new(text, name);
        match DeTable::parse(text) {
            Ok(document) => reader.read(document.get_ref(), effects),
            Err(error) => {
                let problem = format!("not valid TOML: {}", one_line(error.message()));
                let fault = reader.error(error.span(), None, problem, "");
                reader.faults.push(fault);
            }
        }
        (reader.rig, reader.faults)
    }

    /// Reads a rig that stands as a table inside of another file's text.
    pub fn from_table(table: &DeTable, text: &str, name: &str) -> Result<Self, RigError> {
        let mut reader = Reader::new(text, name);
        reader.read(table, &effects::check);
        match reader.faults.is_empty() {
            true => Ok(reader.rig),
            false => Err(reader.faults.swap_remove(0)),
        }
    }
}

/// The text of a file of this kind, called by `name` in messages.
pub fn read_text(path: &Path, name: &str, kind: &str) -> Result<String, RigError> {
    let error = |problem: String| RigError {
        file: name.into(),
        line: None,
        key: None,
        problem,
        expected: kind.into(),
    };
    let cannot = |cause: std::io::Error| error(format!("cannot be read: {cause}"));
    let metadata = fs::metadata(path).map_err(cannot)?;
    if metadata.is_dir() {
        return Err(error("is a directory".into()));
    }
    // Devices have no length: read one byte beyond the limit instead.
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(cannot)?;
    let mut limited = file.take(LARGEST_FILE_BYTES + 1);
    let read = limited.read_to_end(&mut bytes).map_err(cannot)?;
    if u64::try_from(read).is_ok_and(|read| read > LARGEST_FILE_BYTES) {
        return Err(error("is larger than 1 MiB".into()));
    }
    String::from_utf8(bytes).map_err(|_| error("is not UTF-8 text".into()))
}

struct Reader<'t> {
    file: &'t str,
    text: &'t str,
    rig: Rig,
    /// What was found wrong, in the order in which it was found.
    faults: Vec<RigError>,
    /// Where each `section.key`, and each section, stands.
    places: BTreeMap<String, Range<usize>>,
}

impl<'t> Reader<'t> {
    fn new(text: &'t str, file: &'t str) -> Self {
        Self {
            file,
            text,
            rig: Rig::default(),
            faults: Vec::new(),
            places: BTreeMap::new(),
        }
    }

    fn read(&mut self, root: &DeTable<'t>, effects: EffectCheck) {
        self.note_places(root);
        let format = self.check_format(root);
        self.note(format);
        for (name, entry) in root {
            let section = self.read_top(name, entry);
            self.note(section);
        }
        self.check_whole();
        if let Some(entry) = root.get("uncertainty") {
            let section = self.read_uncertainty(entry);
            self.note(section);
        }
        self.check_effects(effects);
    }

    /// Keeps a fault and gives what was read without one.
    fn note<T>(&mut self, outcome: Result<T, RigError>) -> Option<T> {
        match outcome {
            Ok(read) => Some(read),
            Err(fault) => {
                self.faults.push(fault);
                None
            }
        }
    }

    fn note_places(&mut self, root: &DeTable<'t>) {
        for (name, entry) in root {
            self.places.insert(name.get_ref().to_string(), name.span());
            for (key, _) in entry.get_ref().as_table().into_iter().flatten() {
                let full = format!("{}.{}", name.get_ref(), key.get_ref());
                self.places.insert(full, key.span());
            }
        }
    }

    fn check_format(&self, root: &DeTable<'t>) -> Result<(), RigError> {
        let expected = format!("format = \"{FORMAT}\"");
        let Some(entry) = root.get("format") else {
            return Err(self.error(None, Some("format"), "missing", &expected));
        };
        if entry.get_ref().as_str() == Some(FORMAT) {
            return Ok(());
        }
        let problem = format!("{} is unknown", shown(entry));
        Err(self.error(Some(entry.span()), Some("format"), problem, &expected))
    }

    fn read_top(&mut self, name: &Name<'t>, entry: &Entry<'t>) -> Result<(), RigError> {
        let section = name.get_ref().as_ref();
        match section {
            "format" | "uncertainty" => Ok(()),
            "signals" => self.read_signals(entry),
            "controller" => self.read_controller(entry),
            "board" => self.read_board(entry),
            "effects" => self.read_effects(entry),
            known if SECTIONS.iter().any(|one| one.name == known) => {
                self.read_section(known, entry)
            }
            _ => {
                let known: Vec<&str> = section_names().chain(["format"]).collect();
                let expected = expected_one_of(section, &known);
                let key = one_line(section);
                Err(self.error(Some(name.span()), Some(&key), "unknown section", &expected))
            }
        }
    }

    fn table<'e>(&self, name: &str, entry: &'e Entry<'t>) -> Result<&'e DeTable<'t>, RigError> {
        entry.get_ref().as_table().ok_or_else(|| {
            let problem = format!("is {}", shown(entry));
            self.error(Some(entry.span()), Some(name), problem, "a table")
        })
    }

    // [signals]

    fn read_signals(&mut self, entry: &Entry<'t>) -> Result<(), RigError> {
        let table = self.table("signals", entry)?;
        for (name, entry) in table {
            let signal = self.read_named_signal(name, entry);
            self.note(signal);
        }
        Ok(())
    }

    fn read_named_signal(&mut self, name: &Name<'t>, entry: &Entry<'t>) -> Result<(), RigError> {
        let key = format!("signals.{}", one_line(name.get_ref()));
        let Some(known) = signal_key(name.get_ref()) else {
            let known: Vec<&str> = SIGNALS.iter().map(|signal| signal.name).collect();
            let expected = expected_one_of(name.get_ref(), &known);
            return Err(self.error(Some(name.span()), Some(&key), "unknown signal", &expected));
        };
        let signal = self.read_signal(&key, entry, known.dimensions)?;
        self.check_column_is_free(name.span(), &key, &signal)?;
        self.rig.signals.by_name.insert(known.name.into(), signal);
        Ok(())
    }

    fn read_signal(
        &self,
        key: &str,
        entry: &Entry<'t>,
        dimensions: &[Dimension],
    ) -> Result<Signal, RigError> {
        let table = self.table(key, entry)?;
        let known = signal_key_names();
        for (name, _) in table {
            if !known.contains(&name.get_ref().as_ref()) {
                let key = format!("{key}.{}", one_line(name.get_ref()));
                let expected = expected_one_of(name.get_ref(), &known);
                return Err(self.error(Some(name.span()), Some(&key), "unknown key", &expected));
            }
        }
        let number = |name: &str, limits: &Limits| {
            let key = format!("{key}.{name}");
            let entry = table.get(name);
            entry
                .map(|entry| self.number(&key, entry, limits))
                .transpose()
        };
        let scale = number("scale", &SCALE)?;
        if scale == Some(0.0) {
            let key = format!("{key}.scale");
            return Err(self.error(
                Some(entry.span()),
                Some(&key),
                "is 0",
                "a gain that is not 0",
            ));
        }
        Ok(Signal {
            column: self.column(key, entry, table)?,
            unit: self.unit(key, entry, table, dimensions, scale.is_some())?,
            noise: number("noise", &POSITIVE)?,
            resolution: number("resolution", &POSITIVE)?,
            scale,
            offset: number("offset", &ANY)?,
        })
    }

    fn column(
        &self,
        key: &str,
        whole: &Entry<'t>,
        table: &DeTable<'t>,
    ) -> Result<Column, RigError> {
        let in_place = if key == "signals.t" {
            "every"
        } else {
            "constant"
        };
        let stands_in = self.in_place_of_column(key, (in_place, table))?;
        let other = if in_place == "every" {
            "constant"
        } else {
            "every"
        };
        if let Some(entry) = table.get(other) {
            let (key, expected) = (format!("{key}.{other}"), format!("{in_place}, or a column"));
            return Err(self.error(
                Some(entry.span()),
                Some(&key),
                "is of no use here",
                &expected,
            ));
        }
        let key = format!("{key}.column");
        let expected = "a header name or a column number counted from 0";
        let Some(entry) = table.get("column") else {
            if let Some(column) = stands_in {
                return Ok(column);
            }
            return Err(self.error(Some(whole.span()), Some(&key), "missing", expected));
        };
        if stands_in.is_some() {
            let problem = format!("stands beside {in_place}");
            return Err(self.error(Some(entry.span()), Some(&key), problem, "one of both"));
        }
        let column = match entry.get_ref() {
            DeValue::String(name) if !name.trim().is_empty() => {
                Some(Column::Name(name.trim().into()))
            }
            DeValue::Integer(number) => usize::from_str_radix(number.as_str(), number.radix())
                .ok()
                .map(Column::Number),
            _ => None,
        };
        column.ok_or_else(|| {
            let problem = format!("is {}", shown(entry));
            self.error(Some(entry.span()), Some(&key), problem, expected)
        })
    }

    /// A value that was not recorded, or the distance of rows without a time.
    fn in_place_of_column(
        &self,
        key: &str,
        (name, table): (&str, &DeTable<'t>),
    ) -> Result<Option<Column>, RigError> {
        let Some(entry) = table.get(name) else {
            return Ok(None);
        };
        let key = format!("{key}.{name}");
        Ok(Some(match name {
            "every" => Column::Every(self.number(&key, entry, &POSITIVE)?),
            _ => Column::Constant(self.number(&key, entry, &ANY)?),
        }))
    }

    fn unit(
        &self,
        key: &str,
        whole: &Entry<'t>,
        table: &DeTable<'t>,
        dimensions: &[Dimension],
        scaled: bool,
    ) -> Result<Unit, RigError> {
        let key = format!("{key}.unit");
        let wanted: Vec<&str> = dimensions.iter().map(|one| one.expectation()).collect();
        let wanted = wanted.join(" or ");
        let Some(entry) = table.get("unit") else {
            return Err(self.error(Some(whole.span()), Some(&key), "missing", &wanted));
        };
        let Some(text) = entry.get_ref().as_str() else {
            let problem = format!("is {}", shown(entry));
            return Err(self.error(Some(entry.span()), Some(&key), problem, &wanted));
        };
        let unit = Unit::parse(text).map_err(|error| {
            self.error(
                Some(entry.span()),
                Some(&key),
                error.problem,
                &error.expected,
            )
        })?;
        if unit.dimension() == Dimension::Count && !scaled {
            let size = dimensions.first().map_or("?", |one| one.si_unit());
            let problem = format!("unit \"{unit}\" is unknown without a scale");
            let expected =
                format!("scale = {size} per count beside it (an encoder of 5 um: scale = 5e-6)");
            return Err(self.error(Some(entry.span()), Some(&key), problem, &expected));
        }
        let raw = matches!(
            unit.dimension(),
            Dimension::Voltage | Dimension::Fraction | Dimension::Count
        );
        if dimensions.contains(&unit.dimension()) || (scaled && raw) {
            return Ok(unit);
        }
        let problem = format!(
            "\"{unit}\" does not fit, it is {}",
            unit.dimension().expectation()
        );
        Err(self.error(Some(entry.span()), Some(&key), problem, &wanted))
    }

    fn check_column_is_free(
        &self,
        span: Range<usize>,
        key: &str,
        signal: &Signal,
    ) -> Result<(), RigError> {
        let taken = self
            .rig
            .signals
            .iter()
            .find(|(_, other)| other.column == signal.column && !is_constant(&other.column));
        let Some((other, _)) = taken else {
            return Ok(());
        };
        let problem = format!("reads the same column as signals.{other}");
        Err(self.error(Some(span), Some(key), problem, "a column of its own"))
    }

    // the sections of numbers, choices and tables

    fn read_section(&mut self, section: &str, entry: &Entry<'t>) -> Result<(), RigError> {
        let table = self.table(section, entry)?;
        self.open_section(section);
        for (name, entry) in table {
            let read = self.read_key(section, name, entry);
            self.note(read);
        }
        self.check_complete(section);
        Ok(())
    }

    fn read_key(
        &mut self,
        section: &str,
        name: &Name<'t>,
        entry: &Entry<'t>,
    ) -> Result<(), RigError> {
        let key = format!("{section}.{}", name.get_ref());
        if let Some(number) = NUMBERS.iter().find(|number| number.name == key) {
            let value = self.number(&key, entry, &number.limits)?;
            (number.set)(&mut self.rig, value);
        } else if let Some(choice) = CHOICES.iter().find(|choice| choice.name == key) {
            let word = self.choice(choice, entry)?;
            (choice.set)(&mut self.rig, word);
        } else if let Some(table) = ValveTable::from_key(&key) {
            let points = self.points(table, entry)?;
            if let Some(valve) = &mut self.rig.valve {
                *table.points_mut(valve) = points;
            }
        } else if let Some(stated) = STATED_FLOW.iter().find(|stated| stated.name == key) {
            let value = self.number(&key, entry, &stated.limits)?;
            if let Some(valve) = &mut self.rig.valve {
                let flow = valve.stated_flow.get_or_insert_with(StatedFlow::default);
                *(stated.field)(flow) = Some(value);
            }
        } else {
            let known = section_keys(section);
            let expected = expected_one_of(name.get_ref(), &known);
            let key = one_line(&key);
            return Err(self.error(Some(name.span()), Some(&key), "unknown key", &expected));
        }
        Ok(())
    }

    fn open_section(&mut self, section: &str) {
        let rig = &mut self.rig;
        match section {
            "gas" => rig.gas = Some(Gas::default()),
            "environment" => rig.environment = Some(Environment::default()),
            "supply" => rig.supply = Some(Supply::default()),
            "valve" => rig.valve = Some(Valve::default()),
            "cylinder" => rig.cylinder = Some(Cylinder::default()),
            "vessel" => rig.vessel = Some(Vessel::default()),
            "actuator" => rig.actuator = Some(Actuator::default()),
            "chambers" => rig.chambers = Some(Chambers::default()),
            "axis" => rig.axis = Some(Axis::default()),
            "carriage" => rig.carriage = Some(Carriage::default()),
            "friction" => rig.friction = Some(Friction::default()),
            _ => rig.horizon = Some(Horizon::default()),
        }
    }

    fn check_complete(&mut self, section: &str) {
        let numbers = NUMBERS
            .iter()
            .filter(|number| number.required)
            .map(|number| (number.name, number.limits.expected.to_owned()));
        let choices = CHOICES
            .iter()
            .filter(|choice| choice.required)
            .map(|choice| (choice.name, words(choice)));
        let tables = ValveTable::ALL.map(|table| {
            (
                table.key(),
                format!("a list of {}", table.limits().expected),
            )
        });
        let required = numbers.chain(choices).chain(tables);
        let missing: Vec<RigError> = required
            .filter(|(name, _)| in_section(name, section).is_some())
            .filter(|(name, _)| !self.places.contains_key(*name) && !self.follows(name))
            .map(|(name, expected)| {
                let span = self.places.get(section).cloned();
                self.error(span, Some(name), "missing", &expected)
            })
            .collect();
        self.faults.extend(missing);
    }

    /// Whether a key follows from the flow that the valve states in its place.
    fn follows(&self, key: &str) -> bool {
        let valve = self.rig.valve.as_ref();
        let stated = valve.is_some_and(|valve| valve.stated_flow.is_some());
        stated && (key == CRITICAL_RATIO || ValveTable::from_key(key).is_some())
    }

    fn number(&self, key: &str, entry: &Entry<'t>, limits: &Limits) -> Result<f64, RigError> {
        let value = numeric(entry).filter(|value| value.is_finite());
        let Some(value) = value else {
            let problem = format!("is {}", shown(entry));
            return Err(self.error(Some(entry.span()), Some(key), problem, limits.expected));
        };
        if limits.admit(value) {
            return Ok(value);
        }
        let problem = format!("{value} is out of range");
        Err(self.error(Some(entry.span()), Some(key), problem, limits.expected))
    }

    fn choice(&self, choice: &ChoiceKey, entry: &Entry<'t>) -> Result<usize, RigError> {
        let text = entry.get_ref().as_str();
        let place = text.and_then(|text| choice.words.iter().position(|word| *word == text));
        place.ok_or_else(|| {
            let problem = format!("is {}", shown(entry));
            let span = Some(entry.span());
            self.error(span, Some(choice.name), problem, &words(choice))
        })
    }

    fn points(&self, table: ValveTable, entry: &Entry<'t>) -> Result<Vec<f64>, RigError> {
        let limits = table.limits();
        let Some(array) = entry.get_ref().as_array() else {
            let problem = format!("is {}", shown(entry));
            let expected = format!("a list of {}", limits.expected);
            return Err(self.error(Some(entry.span()), Some(table.key()), problem, &expected));
        };
        let points: Vec<f64> = array
            .iter()
            .enumerate()
            .map(|(place, point)| {
                let key = format!("{}[{place}]", table.key());
                self.number(&key, point, &limits)
            })
            .collect::<Result<_, _>>()?;
        if points.len() < 2 {
            let problem = format!("has {} points", points.len());
            let span = Some(entry.span());
            return Err(self.error(span, Some(table.key()), problem, "at least 2"));
        }
        Ok(points)
    }

    // [controller]

    /// Judged as the board judges them, with the line.
    fn read_controller(&mut self, entry: &Entry<'t>) -> Result<(), RigError> {
        for (name, entry) in self.table("controller", entry)? {
            let gain = self.gain(name, entry);
            if let Some(value) = self.note(gain) {
                let name = name.get_ref().to_string();
                self.rig.controller.insert(name, value);
            }
        }
        Ok(())
    }

    fn gain(&self, name: &Name<'t>, entry: &Entry<'t>) -> Result<f64, RigError> {
        let known: Vec<_> = Gains::default().fields().collect();
        let key = format!("controller.{}", name.get_ref());
        let Some(gain) = known.iter().find(|gain| gain.name == key) else {
            let names = known.iter().map(|gain| gain.name);
            let keys: Vec<&str> = names
                .map(|name| in_section(name, "controller").unwrap_or(name))
                .collect();
            let expected = expected_one_of(name.get_ref(), &keys);
            let key = one_line(&key);
            return Err(self.error(Some(name.span()), Some(&key), "unknown key", &expected));
        };
        let value = numeric(entry).filter(|value| value.is_finite());
        let range = f64::from(gain.lowest)..=f64::from(gain.highest);
        value.filter(|value| range.contains(value)).ok_or_else(|| {
            let problem = format!("is {}", shown(entry));
            let expected = format!("a number from {} to {}", gain.lowest, gain.highest);
            self.error(Some(entry.span()), Some(&key), problem, &expected)
        })
    }

    // [effects.NAME] and [uncertainty]

    fn read_effects(&mut self, entry: &Entry<'t>) -> Result<(), RigError> {
        for (name, entry) in self.table("effects", entry)? {
            let effect = self.read_effect(name, entry);
            self.note(effect);
        }
        Ok(())
    }

    fn read_effect(&mut self, name: &Name<'t>, entry: &Entry<'t>) -> Result<(), RigError> {
        let key = format!("effects.{}", name.get_ref());
        self.places.insert(key.clone(), name.span());
        self.check_name(&key, name)?;
        let mut parameters = BTreeMap::new();
        for (parameter, entry) in self.table(&key, entry)? {
            let key = format!("{key}.{}", parameter.get_ref());
            self.places.insert(key.clone(), parameter.span());
            let value = self.check_name(&key, parameter);
            let value = value.and_then(|()| self.number(&key, entry, &ANY));
            if let Some(value) = self.note(value) {
                parameters.insert(parameter.get_ref().to_string(), value);
            }
        }
        let name = name.get_ref().to_string();
        self.rig.effects.insert(name, parameters);
        Ok(())
    }

    /// A dot or a blank inside a name would make `effects.NAME.key` ambiguous.
    fn check_name(&self, key: &str, name: &Name<'t>) -> Result<(), RigError> {
        let plain = |one: char| one.is_alphanumeric() || one == '_' || one == '-';
        if !name.get_ref().is_empty() && name.get_ref().chars().all(plain) {
            return Ok(());
        }
        let expected = "letters, digits, - and _";
        let key = one_line(key);
        Err(self.error(Some(name.span()), Some(&key), "is no name", expected))
    }

    fn check_effects(&mut self, check: EffectCheck) {
        let judged = |(name, parameters): (&String, &BTreeMap<String, f64>)| {
            let fault = check(name, parameters).err()?;
            let key = match &fault.parameter {
                Some(parameter) => format!("effects.{name}.{parameter}"),
                None => format!("effects.{name}"),
            };
            Some(self.at(&key, fault.problem, &fault.expected))
        };
        let faults: Vec<RigError> = self.rig.effects.iter().filter_map(judged).collect();
        self.faults.extend(faults);
    }

    fn read_uncertainty(&mut self, entry: &Entry<'t>) -> Result<(), RigError> {
        for (name, entry) in self.table("uncertainty", entry)? {
            let deviation = self.deviation(name, entry);
            if let Some(value) = self.note(deviation) {
                for key in deviates(&self.rig, name.get_ref()) {
                    self.rig.uncertainty.insert(key.into(), value);
                }
            }
        }
        Ok(())
    }

    fn deviation(&self, name: &Name<'t>, entry: &Entry<'t>) -> Result<f64, RigError> {
        let target = name.get_ref().as_ref();
        let key = format!("uncertainty.\"{}\"", one_line(target));
        if entry.get_ref().is_table() {
            let expected = "quotes around the whole key: \"section.key\" = value";
            return Err(self.error(Some(name.span()), Some(&key), "is a table", expected));
        }
        // A value that was refused has its own line already.
        let refused =
            self.places.contains_key(target) && NUMBERS.iter().any(|one| one.name == target);
        let means_a_value = |key: &&str| self.rig.value(key).is_some();
        if !refused && !deviates(&self.rig, target).iter().all(means_a_value) {
            return Err(self.no_such_value(name.span(), &key, target));
        }
        let limits = if uncertainty_is_absolute(target) {
            &ABSOLUTE_DEVIATION
        } else {
            &RELATIVE_DEVIATION
        };
        self.number(&key, entry, limits)
    }

    fn no_such_value(&self, span: Range<usize>, key: &str, target: &str) -> RigError {
        let known = NUMBERS.iter().find(|number| number.name == target);
        if let (Some(number), Some((section, name))) = (known, target.split_once('.')) {
            return self.error(
                Some(span),
                Some(key),
                format!("is of a number that the rig file does not state: [{section}] {name}"),
                &format!(
                    "{name} = a value in {} (typical {}), or no uncertainty of it",
                    number.facts.unit, number.facts.typical
                ),
            );
        }
        let known = self.rig.value_keys();
        let expected = match closest(target, known.iter().map(String::as_str)) {
            Some(name) => format!("a number of this rig, did you mean \"{name}\"?"),
            None => "a number of this rig, such as \"supply.pressure_Pa\"".into(),
        };
        self.error(
            Some(span),
            Some(key),
            "names no number of this rig",
            &expected,
        )
    }

    // what several keys must agree on

    fn check_whole(&mut self) {
        self.rig.signals.gauge_zero_pa = self.rig.ambient_pressure_pa();
        let derived = self.derive_valve();
        self.note(derived);
        let checks = [
            Self::check_time_column,
            Self::check_valve,
            Self::check_supply,
            Self::check_cylinder,
            Self::check_chambers,
            Self::check_friction,
        ];
        for check in checks {
            let checked = check(self);
            self.note(checked);
        }
    }

    /// Areas and critical ratio of a valve that states its flow.
    fn derive_valve(&mut self) -> Result<(), RigError> {
        let Some(valve) = self.rig.valve.as_ref() else {
            return Ok(());
        };
        let Some(flow) = valve.stated_flow.as_ref() else {
            return Ok(());
        };
        let tables = ValveTable::ALL.map(ValveTable::key);
        let mut both = tables.into_iter().chain([CRITICAL_RATIO]);
        if let Some(key) = both.find(|key| self.places.contains_key(*key)) {
            let expected =
                "either areas and critical_pressure_ratio, or the flow of the data sheet with b";
            return Err(self.at(key, "stands beside a stated flow", expected));
        }
        let fault = |(key, problem, expected): StatedFlowFault| {
            let place = self.place(key).or_else(|| self.place("valve"));
            self.error(place, Some(key), problem, &expected)
        };
        // A refused null or ratio has its own line.
        if valve.laminar_pressure_ratio <= 0.0 {
            return Ok(());
        }
        let derived = flow.derive(valve.null_v, valve.laminar_pressure_ratio);
        let derived = derived.map_err(fault)?;
        if let Some(valve) = &mut self.rig.valve {
            valve.critical_pressure_ratio = derived.critical_pressure_ratio;
            valve.opening_v = derived.opening_v;
            valve.supply_area_m2.clone_from(&derived.area_m2);
            valve.exhaust_area_m2 = derived.area_m2;
        }
        Ok(())
    }

    fn check_time_column(&self) -> Result<(), RigError> {
        if self.rig.signals.by_name.is_empty() || self.rig.signals.contains("t") {
            return Ok(());
        }
        let span = self.place("signals");
        let expected = "the time column: t = { column = ..., unit = \"s\" }";
        Err(self.error(span, Some("signals.t"), "missing", expected))
    }

    fn check_valve(&self) -> Result<(), RigError> {
        let whole = |valve: &&Valve| {
            ValveTable::ALL
                .iter()
                .all(|table| !table.points(valve).is_empty())
        };
        // What is missing or was refused has its own line.
        let Some(valve) = self.rig.valve.as_ref().filter(whole) else {
            return Ok(());
        };
        self.check_opening(valve)?;
        for table in [ValveTable::SupplyArea, ValveTable::ExhaustArea] {
            let (points, openings) = (table.points(valve).len(), valve.opening_v.len());
            if points != openings {
                let problem = format!("has {points} points");
                let expected = format!("{openings}, as valve.opening_V has");
                return Err(self.at(table.key(), problem, &expected));
            }
            self.check_areas(table, valve)?;
        }
        let laminar_read = valve.laminar_pressure_ratio > 0.0;
        if laminar_read && valve.laminar_pressure_ratio <= valve.critical_pressure_ratio {
            let problem = format!("{} is out of range", valve.laminar_pressure_ratio);
            let expected = format!(
                "a ratio above valve.critical_pressure_ratio = {}",
                valve.critical_pressure_ratio
            );
            return Err(self.at("valve.laminar_pressure_ratio", problem, &expected));
        }
        Ok(())
    }

    fn check_opening(&self, valve: &Valve) -> Result<(), RigError> {
        let key = "valve.opening_V";
        let points = valve.opening_v.len();
        if points > TABLE_CAPACITY {
            let expected = format!(
                "{TABLE_CAPACITY} at most: thin the table, leaving out points that lie nearly \
                 on a line between their neighbours, in the areas too"
            );
            return Err(self.at(key, format!("has {points} points"), &expected));
        }
        if let Some(first) = valve.opening_v.first().filter(|first| **first > 0.0) {
            let problem = format!("point 0 is {first}");
            let expected = "0: the first point is the leakage of the closed path";
            return Err(self.at(key, problem, expected));
        }
        for (place, pair) in valve.opening_v.windows(2).enumerate() {
            if pair[1] > pair[0] {
                continue;
            }
            let problem = format!("point {} is {} after {}", place + 1, pair[1], pair[0]);
            return Err(self.at(key, problem, "strictly increasing openings"));
        }
        Ok(())
    }

    fn check_areas(&self, table: ValveTable, valve: &Valve) -> Result<(), RigError> {
        for (place, pair) in table.points(valve).windows(2).enumerate() {
            if pair[1] >= pair[0] {
                continue;
            }
            let problem = format!("point {} is {} after {}", place + 1, pair[1], pair[0]);
            return Err(self.at(table.key(), problem, "areas that never fall"));
        }
        Ok(())
    }

    fn check_supply(&self) -> Result<(), RigError> {
        let Some(supply) = &self.rig.supply else {
            return Ok(());
        };
        let ambient_pa = self.rig.ambient_pressure_pa();
        // One that was refused has its own line.
        if supply.pressure_pa > ambient_pa || supply.pressure_pa <= 0.0 {
            return Ok(());
        }
        let problem = format!(
            "{} is not above the ambient pressure {ambient_pa}",
            supply.pressure_pa
        );
        let expected = "absolute Pa (is this a gauge pressure?)";
        Err(self.at("supply.pressure_Pa", problem, expected))
    }

    fn check_cylinder(&self) -> Result<(), RigError> {
        let Some(cylinder) = &self.rig.cylinder else {
            return Ok(());
        };
        let zero_is_absent = !self.places.contains_key("cylinder.position_zero");
        if cylinder.stroke_m.is_some() && zero_is_absent {
            let expected = "\"mid-stroke\" or \"end-a\", as there is a stroke";
            let span = self.place("cylinder");
            let key = Some("cylinder.position_zero");
            return Err(self.error(span, key, "missing", expected));
        }
        let Some(bore_m) = cylinder.bore_m else {
            return Ok(());
        };
        let circle_m2 = PI / 4.0 * bore_m * bore_m;
        let areas = [
            ("cylinder.area_a_m2", cylinder.area_a_m2),
            ("cylinder.area_b_m2", cylinder.area_b_m2),
        ];
        for (key, area_m2) in areas {
            let Some(area_m2) = area_m2 else { continue };
            let (than, limit) = if area_m2 > AREA_OVER_BORE * circle_m2 {
                ("larger", format!("at most {circle_m2:.4e}"))
            } else if area_m2 < LEAST_AREA_OVER_BORE * circle_m2 {
                let least_m2 = LEAST_AREA_OVER_BORE * circle_m2;
                ("much smaller", format!("at least {least_m2:.4e}"))
            } else {
                continue;
            };
            let problem = format!("{area_m2} is {than} than the bore's circle");
            let expected = format!("{limit} m2 for cylinder.bore_m = {bore_m}");
            return Err(self.at(key, problem, &expected));
        }
        Ok(())
    }

    fn check_chambers(&self) -> Result<(), RigError> {
        let Some(chambers) = &self.rig.chambers else {
            return Ok(());
        };
        let (model, needed): (_, &[&str]) = match chambers.model {
            ChamberModel::EnergyBalance => (
                "energy-balance",
                &[
                    "chambers.heat_transfer_charging_W_m2K",
                    "chambers.heat_transfer_discharging_W_m2K",
                ],
            ),
            ChamberModel::Polytropic => (
                "polytropic",
                &["chambers.expansion_index", "chambers.compression_index"],
            ),
            ChamberModel::PolytropicProcess => {
                ("polytropic-process", &["chambers.polytropic_index"])
            }
        };
        let missing = needed.iter().find(|key| !self.places.contains_key(**key));
        match missing {
            None => Ok(()),
            Some(key) => {
                let expected = format!("a number, as the model is \"{model}\"");
                Err(self.error(self.place("chambers"), Some(key), "missing", &expected))
            }
        }
    }

    fn check_friction(&self) -> Result<(), RigError> {
        let Some(friction) = &self.rig.friction else {
            return Ok(());
        };
        let (Some(static_n), Some(coulomb_n)) = (friction.static_n, friction.coulomb_n) else {
            return Ok(());
        };
        // Both are estimates: a little below is a wrong estimate, not a slip.
        if static_n >= STATIC_OVER_COULOMB * coulomb_n {
            return Ok(());
        }
        let problem = format!("{static_n} is far below friction.coulomb_N = {coulomb_n}");
        let expected = "static friction about as large as Coulomb friction, or larger";
        Err(self.at("friction.static_N", problem, expected))
    }

    // errors with their place

    fn place(&self, key: &str) -> Option<Range<usize>> {
        self.places.get(key).cloned()
    }

    fn at(&self, key: &str, problem: impl Into<String>, expected: &str) -> RigError {
        self.error(self.place(key), Some(key), problem, expected)
    }

    fn error(
        &self,
        span: Option<Range<usize>>,
        key: Option<&str>,
        problem: impl Into<String>,
        expected: &str,
    ) -> RigError {
        RigError {
            file: self.file.into(),
            line: span.map(|span| self.line_of(span.start)),
            key: key.map(String::from),
            problem: problem.into(),
            expected: expected.into(),
        }
    }

    fn line_of(&self, offset: usize) -> usize {
        line_at(self.text, offset)
    }
}

/// The line, from 1, that holds the byte at `offset`.
pub fn line_at(text: &str, offset: usize) -> usize {
    let before = &text.as_bytes()[..offset.min(text.len())];
    1 + before.iter().filter(|byte| **byte == b'\n').count()
}

const ANY: Limits = Limits {
    low: f64::MIN,
    high: f64::MAX,
    low_included: true,
    high_included: true,
    expected: "a finite number",
};
const POSITIVE: Limits = Limits {
    low: 0.0,
    high: f64::MAX,
    low_included: false,
    high_included: true,
    expected: "a number above 0, in SI units",
};
const SCALE: Limits = Limits {
    expected: "a finite gain",
    ..ANY
};
const RELATIVE_DEVIATION: Limits = Limits {
    low: 0.0,
    high: 10.0,
    low_included: true,
    high_included: true,
    expected: "a standard deviation relative to the value, 0 to 10 (0.05 is 5 %)",
};
const ABSOLUTE_DEVIATION: Limits = Limits {
    low: 0.0,
    high: 1000.0,
    low_included: true,
    high_included: true,
    expected: "a standard deviation in volts, 0 to 1000",
};

/// A number of a file, whole or not.
pub fn numeric(entry: &Entry) -> Option<f64> {
    match entry.get_ref() {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
            .ok()
            .map(whole_as_float),
        _ => None,
    }
}

/// Rounds beyond 2^53, where every key's limits refuse the value anyway.
fn whole_as_float(integer: i64) -> f64 {
    integer as f64
}

/// What stands there, for an error line.
pub fn shown(entry: &Entry) -> String {
    match entry.get_ref() {
        DeValue::String(text) => format!("the text \"{}\"", one_line(text)),
        DeValue::Integer(integer) => one_line(integer.as_str()),
        DeValue::Float(float) => one_line(float.as_str()),
        DeValue::Boolean(value) => format!("{value}"),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Array(_) => "a list".into(),
        DeValue::Table(_) => "a table".into(),
    }
}

fn words(choice: &ChoiceKey) -> String {
    let quoted: Vec<String> = choice
        .words
        .iter()
        .map(|word| format!("\"{word}\""))
        .collect();
    quoted.join(" or ")
}

fn in_section<'a>(name: &'a str, section: &str) -> Option<&'a str> {
    name.strip_prefix(section)?.strip_prefix('.')
}

fn section_keys(section: &str) -> Vec<&'static str> {
    let numbers = NUMBERS.iter().map(|number: &NumberKey| number.name);
    let choices = CHOICES.iter().map(|choice| choice.name);
    let tables = ValveTable::ALL.map(ValveTable::key);
    let stated = STATED_FLOW.iter().map(|stated| stated.name);
    numbers
        .chain(choices)
        .chain(tables)
        .chain(stated)
        .filter_map(|name| in_section(name, section))
        .collect()
}

/// Whether a signal has no column of its own to be shared.
fn is_constant(column: &Column) -> bool {
    matches!(column, Column::Constant(_))
}
