//! A person's rig file with changed values: comments, order and spelling of all else kept.
//!
//! Both rigs are laid out as entries, a path of names to a value each. Where an entry differs the
//! document is changed at its path; what is equal is not touched.

use std::collections::BTreeMap;

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::board::{self, BoardChannel, Stated};
use super::keys::{CHOICES, NUMBERS};
use super::stated_flow::CRITICAL_RATIO;
use super::stated_flow::{STATED_FLOW, deviates};
use super::valve_table::ValveTable;
use super::write::float;
use super::{Column, FORMAT, Rig, RigError, Signal, Valve, read_text};

/// The names from the top of the file down to a key.
type Path = Vec<String>;

#[derive(Clone, Debug, PartialEq)]
enum Entry {
    Number(f64),
    Word(String),
    Points(Vec<f64>),
}

impl Rig {
    /// The text of a rig file with the values of another rig. What is equal in both keeps its
    /// bytes; a changed value keeps its place and its comment; what the text lacks is added at the
    /// end of its section or of the file; what the other rig lacks is removed.
    ///
    /// A text that is no rig file is replaced by [`Rig::to_toml`] of the other rig.
    pub fn edited(original_text: &str, improved: &Self) -> String {
        let bare = original_text.trim_start_matches('\u{feff}');
        let original = Self::parse_with(bare, FORMAT, &|_, _| Ok(()));
        let (Ok(original), Ok(mut document)) = (original, bare.parse::<DocumentMut>()) else {
            return improved.to_toml();
        };
        let (before, after) = (entries(&original), entries(improved));
        for path in before.keys().filter(|path| !after.contains_key(*path)) {
            remove(document.as_table_mut(), path);
        }
        for (path, entry) in &after {
            if before.get(path) != Some(entry) {
                set(document.as_table_mut(), path, entry);
            }
        }
        if original.states_flow() && !improved.states_flow() {
            rename_deviations(&mut document, &original, improved);
        }
        with_line_ends_of(bare, &document.to_string())
    }

    /// As [`Rig::edited`], of a rig file.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn edited_file(path: &std::path::Path, improved: &Self) -> Result<String, RigError> {
        let name = path.display().to_string();
        let text = read_text(path, &name, "a rig file")?;
        Ok(Self::edited(&text, improved))
    }
}

/// `toml_edit` writes line feeds; a file of carriage returns keeps them.
fn with_line_ends_of(original: &str, text: &str) -> String {
    if original.contains("\r\n") {
        text.replace("\r\n", "\n").replace('\n', "\r\n")
    } else {
        text.to_owned()
    }
}

/// All that a rig states, by its path in the file.
fn entries(rig: &Rig) -> BTreeMap<Path, Entry> {
    let mut all = BTreeMap::new();
    let mut add = |path: &[&str], entry: Entry| {
        all.insert(path.iter().map(|name| (*name).to_owned()).collect(), entry);
    };
    for (name, signal) in rig.signals.iter() {
        for (key, entry) in of_signal(signal) {
            add(&["signals", name, key], entry);
        }
    }
    for choice in CHOICES {
        if let (Some(word), Some((section, key))) = ((choice.get)(rig), choice.name.split_once('.'))
        {
            add(&[section, key], Entry::Word(choice.words[word].into()));
        }
    }
    let stated = rig.states_flow();
    for number in NUMBERS {
        let follows = stated && number.name == CRITICAL_RATIO;
        if let (Some(value), Some((section, key)), false) =
            ((number.get)(rig), number.name.split_once('.'), follows)
        {
            add(&[section, key], Entry::Number(value));
        }
    }
    for (name, entry) in rig.valve.iter().flat_map(of_curve) {
        if let Some((section, key)) = name.split_once('.') {
            add(&[section, key], entry);
        }
    }
    for (section, values) in [
        ("uncertainty", &rig.uncertainty),
        ("controller", &rig.controller),
    ] {
        for (key, value) in values {
            add(&[section, key], Entry::Number(*value));
        }
    }
    for (signal, sensor) in &rig.board {
        let channel = BoardChannel::of(signal);
        for (key, value) in channel.iter().flat_map(|one| board::stated(one, sensor)) {
            let entry = match value {
                Stated::Ends(ends) => Entry::Points(ends.into()),
                Stated::Word(word) => Entry::Word(word.into()),
            };
            add(&["board", signal, key], entry);
        }
    }
    for (name, parameters) in &rig.effects {
        for (key, value) in parameters {
            add(&["effects", name, key], Entry::Number(*value));
        }
    }
    all
}

/// The tables of a valve, or the flow that stands in their place.
fn of_curve(valve: &Valve) -> Vec<(&'static str, Entry)> {
    let Some(mut flow) = valve.stated_flow.clone() else {
        let points = |table: ValveTable| Entry::Points(table.points(valve).clone());
        return ValveTable::ALL
            .map(|table| (table.key(), points(table)))
            .into();
    };
    let stated = STATED_FLOW.iter().filter_map(|stated| {
        let value = *(stated.field)(&mut flow);
        Some((stated.name, Entry::Number(value?)))
    });
    stated.collect()
}

fn of_signal(signal: &Signal) -> Vec<(&'static str, Entry)> {
    let column = match &signal.column {
        Column::Name(name) => ("column", Entry::Word(name.clone())),
        Column::Number(number) => ("column", Entry::Number(*number as f64)),
        Column::Constant(value) => ("constant", Entry::Number(*value)),
        Column::Every(value) => ("every", Entry::Number(*value)),
    };
    let unit = Entry::Word(signal.unit.as_str().to_owned());
    let numbers = [
        ("noise", signal.noise),
        ("resolution", signal.resolution),
        ("scale", signal.scale),
        ("offset", signal.offset),
    ];
    let numbers = numbers
        .into_iter()
        .filter_map(|(key, value)| Some((key, Entry::Number(value?))));
    [column, ("unit", unit)]
        .into_iter()
        .chain(numbers)
        .collect()
}

fn remove(table: &mut dyn TableLike, path: &[String]) {
    match path {
        [] => {}
        [key] => {
            table.remove(key);
        }
        [name, rest @ ..] => {
            let Some(inner) = table.get_mut(name).and_then(Item::as_table_like_mut) else {
                return;
            };
            remove(inner, rest);
            if inner.is_empty() {
                table.remove(name);
            }
        }
    }
}

fn set(table: &mut dyn TableLike, path: &[String], entry: &Entry) {
    match path {
        [] => {}
        [key] => set_key(table, key, entry),
        [name, rest @ ..] => {
            if !table.contains_key(name) {
                table.insert(name, new_table(rest.len() > 1));
            }
            let item = table.get_mut(name);
            match (item, rest) {
                (Some(Item::Value(Value::InlineTable(inline))), [key])
                    if !inline.contains_key(key) =>
                {
                    append(inline, key, value_of(entry));
                }
                (item, _) => {
                    if let Some(inner) = item.and_then(Item::as_table_like_mut) {
                        set(inner, rest, entry);
                    }
                }
            }
        }
    }
}

/// A key at the end of `{ ... }`: the blank before the bracket stays there.
fn append(inline: &mut InlineTable, key: &str, mut value: Value) {
    if let Some((_, last)) = inline.iter_mut().last() {
        let suffix = last.decor().suffix().cloned().unwrap_or_default();
        last.decor_mut().set_suffix("");
        value.decor_mut().set_prefix(" ");
        value.decor_mut().set_suffix(suffix);
    }
    inline.insert(key, value);
}

/// A section; one that holds sections alone has no line of its own.
fn new_table(holds_sections: bool) -> Item {
    let mut table = Table::new();
    table.set_implicit(holds_sections);
    table.decor_mut().set_prefix("\n");
    Item::Table(table)
}

fn set_key(table: &mut dyn TableLike, key: &str, entry: &Entry) {
    let Some(value) = table.get_mut(key).and_then(Item::as_value_mut) else {
        table.insert(key, Item::Value(value_of(entry)));
        return;
    };
    match (value.as_array_mut(), entry) {
        (Some(array), Entry::Points(points)) if array.len() == points.len() => {
            for (slot, point) in array.iter_mut().zip(points) {
                if number_of(slot) != Some(*point) {
                    replace(slot, number(*point));
                }
            }
        }
        _ => replace(value, value_of(entry)),
    }
}

/// Another value with the blanks and the comment of the old one.
fn replace(slot: &mut Value, mut value: Value) {
    *value.decor_mut() = slot.decor().clone();
    *slot = value;
}

fn value_of(entry: &Entry) -> Value {
    match entry {
        Entry::Number(value) => number(*value),
        Entry::Word(word) => word.as_str().into(),
        Entry::Points(points) => {
            Value::Array(points.iter().copied().map(number).collect::<Array>())
        }
    }
}

/// The shortest spelling that reads back to the same number.
fn number(value: f64) -> Value {
    float(value).parse().unwrap_or_else(|_| value.into())
}

fn number_of(value: &Value) -> Option<f64> {
    let integer = || value.as_integer().map(|integer| integer as f64);
    value.as_float().or_else(integer)
}

/// Deviations of a data sheet's flow become those of the tables in its place.
fn rename_deviations(document: &mut DocumentMut, original: &Rig, improved: &Rig) {
    let Some(section) = document
        .get_mut("uncertainty")
        .and_then(Item::as_table_like_mut)
    else {
        return;
    };
    for stated in STATED_FLOW {
        if section.remove(stated.name).is_none() {
            continue;
        }
        for key in deviates(original, stated.name) {
            if let Some(deviation) = improved.uncertainty.get(key) {
                set_key(section, key, &Entry::Number(*deviation));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Signals;

    const TEXT: &str = "\
# my axis, 2024
format = \"rig/1\"

[supply] # regulator by the door
pressure_Pa = 7e5   # read at noon

[signals]
t = { column = \"t\", unit = \"s\" } # logger
x = { column = \"x\", unit = \"mm\", noise = 4e-6 }

[valve]
null_V = 5 # data sheet
feeds_a_when = \"above-null\"
critical_pressure_ratio = 0.29
laminar_pressure_ratio = 0.98
opening_V = [0, 0.3, 5.0]
supply_area_m2 = [
    1e-7, # leakage
    1e-7,
    1.67e-5, # full
]
exhaust_area_m2 = [1e-7, 1e-7, 1.67e-5]

[uncertainty]
\"valve.null_V\" = 0.1 # guess

# the end
";

    fn rig(text: &str) -> Rig {
        Rig::parse(text, "rig.toml").unwrap_or_else(|error| panic!("{error}"))
    }

    fn changed(values: &[(&str, f64)]) -> Rig {
        let values = values
            .iter()
            .map(|(key, value)| ((*key).to_owned(), *value));
        rig(TEXT).with_values(&values.collect())
    }

    #[test]
    fn prop_an_equal_rig_leaves_every_byte() {
        for text in [TEXT.to_owned(), TEXT.replace('\n', "\r\n")] {
            assert_eq!(Rig::edited(&text, &rig(&text)), text);
        }
    }

    #[test]
    fn regress_changed_numbers_keep_place_and_comment() {
        let improved = changed(&[("supply.pressure_Pa", 6.9e5), ("valve.null_V", 5.07)]);
        let expected = TEXT
            .replace("pressure_Pa = 7e5 ", "pressure_Pa = 690000.0 ")
            .replace("null_V = 5 #", "null_V = 5.07 #");
        assert_eq!(Rig::edited(TEXT, &improved), expected);
    }

    #[test]
    fn regress_points_change_in_their_places() {
        let improved = changed(&[("valve.supply_area_m2", 2.0)]);
        let expected = TEXT.replace(
            "    1e-7, # leakage\n    1e-7,\n    1.67e-5, # full",
            "    2e-7, # leakage\n    2e-7,\n    3.34e-5, # full",
        );
        assert_eq!(Rig::edited(TEXT, &improved), expected);
    }

    #[test]
    fn regress_effects_are_added_and_removed_and_reading_back_gives_the_rig() {
        let improved = changed(&[
            ("effects.tube-line.length_m", 1.5),
            ("effects.spool-dynamics.natural_frequency_Hz", 80.0),
        ]);
        let text = Rig::edited(TEXT, &improved);
        assert_eq!(rig(&text), improved);
        assert!(
            text.contains("\n\n[effects.tube-line]\nlength_m = 1.5\n"),
            "{text}"
        );
        assert!(text.contains("# the end"), "{text}");
        assert_eq!(text.matches("[effects]").count(), 0, "{text}");
        let back = Rig::edited(&text, &rig(TEXT));
        assert_eq!(rig(&back), rig(TEXT));
        assert!(!back.contains("effects"), "{back}");
    }

    #[test]
    fn prop_signals_and_deviations_follow_too() {
        let mut improved = rig(TEXT);
        improved.uncertainty = BTreeMap::from([("supply.pressure_Pa".to_owned(), 0.01)]);
        let mut position = improved.signals.get("x").cloned().expect("a position");
        position.scale = Some(1.02);
        let mut by_name = improved.signals.by_name.clone();
        by_name.insert("x".into(), position);
        improved.signals = Signals {
            by_name,
            ..improved.signals
        };
        let text = Rig::edited(TEXT, &improved);
        assert_eq!(rig(&text), improved);
        assert!(text.contains("noise = 4e-6, scale = 1.02 }"), "{text}");
        assert!(
            text.contains("{ column = \"t\", unit = \"s\" } # logger"),
            "{text}"
        );
    }

    #[test]
    fn prop_a_stated_flow_gives_way_to_fitted_tables() {
        let stated = "format = \"rig/1\"\n[valve]\nfeeds_a_when = \"above-null\"\nnull_V = 5.0\n\
            laminar_pressure_ratio = 0.98\nnominal_flow_l_min = 700 # data sheet\nb = 0.29\n\
            [uncertainty]\n\"valve.nominal_flow_l_min\" = 0.3 # wide\n\"valve.b\" = 0.2\n";
        let given = rig(stated);
        assert_eq!(given.uncertainty_sd("valve.supply_area_m2"), Some(0.3));
        assert_eq!(Rig::edited(stated, &given), stated);
        assert_eq!(rig(&given.to_toml()), given);
        let scale = BTreeMap::from([("valve.supply_area_m2".to_owned(), 1.1)]);
        let improved = given.with_values(&scale);
        let text = Rig::edited(stated, &improved);
        assert_eq!(rig(&text), improved);
        assert!(!text.contains("nominal_flow"), "{text}");
    }
}
