//! A rig back to text that reads back equal.

use std::fmt::Write;

use super::board::{self, BoardChannel, Stated};
use super::keys::{CHOICES, NUMBERS, SECTIONS};
use super::stated_flow::CRITICAL_RATIO;
use super::stated_flow::STATED_FLOW;
use super::valve_table::ValveTable;
use super::{Column, FORMAT, Rig, Signal};

impl Rig {
    /// The rig as a rig file. Reading it back gives an equal rig.
    pub fn to_toml(&self) -> String {
        let mut text = format!("format = {}\n", quoted(FORMAT));
        self.write_signals(&mut text);
        for section in SECTIONS {
            self.write_section(&mut text, section.name);
        }
        self.write_uncertainty(&mut text);
        self.write_controller(&mut text);
        self.write_board(&mut text);
        self.write_effects(&mut text);
        text
    }

    fn write_signals(&self, text: &mut String) {
        if self.signals.by_name.is_empty() {
            return;
        }
        text.push_str("\n[signals]\n");
        for (name, signal) in self.signals.iter() {
            line(text, name, &signal_table(signal));
        }
    }

    fn write_section(&self, text: &mut String, section: &str) {
        if !self.has_section(section) {
            return;
        }
        let _ = writeln!(text, "\n[{section}]");
        for choice in CHOICES {
            if let (Some(key), Some(word)) = (key_in(choice.name, section), (choice.get)(self)) {
                line(text, key, &quoted(choice.words[word]));
            }
        }
        let stated = self
            .valve
            .as_ref()
            .and_then(|valve| valve.stated_flow.clone());
        for number in NUMBERS {
            // It follows from the stated flow.
            if stated.is_some() && number.name == CRITICAL_RATIO {
                continue;
            }
            if let (Some(key), Some(value)) = (key_in(number.name, section), (number.get)(self)) {
                line(text, key, &float(value));
            }
        }
        let Some(valve) = self.valve.as_ref().filter(|_| section == "valve") else {
            return;
        };
        if let Some(mut flow) = stated {
            for key in STATED_FLOW {
                if let (Some(name), Some(value)) =
                    (key_in(key.name, section), *(key.field)(&mut flow))
                {
                    line(text, name, &float(value));
                }
            }
            return;
        }
        for table in ValveTable::ALL {
            if let Some(key) = key_in(table.key(), section) {
                let points: Vec<String> = table.points(valve).iter().copied().map(float).collect();
                line(text, key, &format!("[{}]", points.join(", ")));
            }
        }
    }

    fn has_section(&self, section: &str) -> bool {
        match section {
            "gas" => self.gas.is_some(),
            "environment" => self.environment.is_some(),
            "supply" => self.supply.is_some(),
            "valve" => self.valve.is_some(),
            "cylinder" => self.cylinder.is_some(),
            "vessel" => self.vessel.is_some(),
            "actuator" => self.actuator.is_some(),
            "chambers" => self.chambers.is_some(),
            "axis" => self.axis.is_some(),
            "carriage" => self.carriage.is_some(),
            "friction" => self.friction.is_some(),
            "horizon" => self.horizon.is_some(),
            _ => false,
        }
    }

    fn write_uncertainty(&self, text: &mut String) {
        if self.uncertainty.is_empty() {
            return;
        }
        text.push_str("\n[uncertainty]\n");
        for (key, value) in &self.uncertainty {
            line(text, &quoted(key), &float(*value));
        }
    }

    fn write_controller(&self, text: &mut String) {
        if self.controller.is_empty() {
            return;
        }
        text.push_str("\n[controller]\n");
        for (key, value) in &self.controller {
            line(text, key, &float(*value));
        }
    }

    fn write_board(&self, text: &mut String) {
        for (signal, sensor) in &self.board {
            let Some(channel) = BoardChannel::of(signal) else {
                continue;
            };
            let _ = writeln!(text, "\n[board.{signal}]");
            for (key, value) in board::stated(channel, sensor) {
                let value = match value {
                    Stated::Ends([from, to]) => format!("[{}, {}]", float(from), float(to)),
                    Stated::Word(word) => quoted(word),
                };
                line(text, key, &value);
            }
        }
    }

    fn write_effects(&self, text: &mut String) {
        for (name, parameters) in &self.effects {
            let _ = writeln!(text, "\n[effects.{}]", bare_or_quoted(name));
            for (key, value) in parameters {
                line(text, &bare_or_quoted(key), &float(*value));
            }
        }
    }
}

fn line(text: &mut String, key: &str, value: &str) {
    let _ = writeln!(text, "{key} = {value}");
}

pub(super) fn key_in<'a>(name: &'a str, section: &str) -> Option<&'a str> {
    name.strip_prefix(section)?.strip_prefix('.')
}

fn signal_table(signal: &Signal) -> String {
    let column = match &signal.column {
        Column::Name(name) => format!("column = {}", quoted(name)),
        Column::Number(number) => format!("column = {number}"),
        Column::Constant(value) => format!("constant = {}", float(*value)),
        Column::Every(value) => format!("every = {}", float(*value)),
    };
    let mut table = format!("{{ {column}, unit = {}", quoted(signal.unit.as_str()));
    let numbers = [
        ("noise", signal.noise),
        ("resolution", signal.resolution),
        ("scale", signal.scale),
        ("offset", signal.offset),
    ];
    for (key, value) in numbers {
        if let Some(value) = value {
            let _ = write!(table, ", {key} = {}", float(value));
        }
    }
    table.push_str(" }");
    table
}

/// The shortest spelling that reads back to the same number.
pub(super) fn float(value: f64) -> String {
    if value.is_nan() {
        return "nan".into();
    }
    format!("{value:?}")
}

pub(super) fn bare_or_quoted(key: &str) -> String {
    let bare = !key.is_empty()
        && key
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-');
    if bare { key.into() } else { quoted(key) }
}

/// A TOML basic string.
pub fn quoted(text: &str) -> String {
    let mut shown = String::from("\"");
    for character in text.chars() {
        match character {
            '"' => shown.push_str("\\\""),
            '\\' => shown.push_str("\\\\"),
            control if control.is_control() => {
                let _ = write!(shown, "\\u{:04X}", u32::from(control));
            }
            plain => shown.push(plain),
        }
    }
    shown.push('"');
    shown
}
