//! `[board.SIGNAL]`: the sensors at a board's terminals, read and judged.

use toml::de::DeTable;

use super::super::board::{
    BOARD_CHANNELS, BoardChannel, BoardSensor, CURRENT_MA, LinearSensor, Output,
};
use super::super::facts::Limits;
use super::{Entry, Name, Reader, RigError, expected_one_of, one_line, shown};

impl<'t> Reader<'t> {
    pub(super) fn read_board(&mut self, entry: &Entry<'t>) -> Result<(), RigError> {
        for (name, entry) in self.table("board", entry)? {
            let sensor = self.board_sensor(name, entry);
            if let Some((signal, sensor)) = self.note(sensor) {
                self.rig.board.insert(signal, sensor);
            }
        }
        Ok(())
    }

    fn board_sensor(
        &self,
        name: &Name<'t>,
        entry: &Entry<'t>,
    ) -> Result<(String, BoardSensor), RigError> {
        let key = format!("board.{}", one_line(name.get_ref()));
        let Some(channel) = BoardChannel::of(name.get_ref()) else {
            let known: Vec<&str> = BOARD_CHANNELS.iter().map(|one| one.signal).collect();
            let expected = expected_one_of(name.get_ref(), &known);
            let problem = "no signal of a board";
            return Err(self.error(Some(name.span()), Some(&key), problem, &expected));
        };
        let table = self.table(&key, entry)?;
        let mut known = vec!["output_V", channel.range_key, "sensor"];
        known.extend(channel.takes_current.then_some("output_mA"));
        for (name, _) in table {
            if !known.contains(&name.get_ref().as_ref()) {
                let key = format!("{key}.{}", one_line(name.get_ref()));
                let expected = expected_one_of(name.get_ref(), &known);
                return Err(self.error(Some(name.span()), Some(&key), "unknown key", &expected));
            }
        }
        let sensor = match self.sensor_kind(&key, channel, table)? {
            "none" if table.iter().count() == 1 => BoardSensor::Absent,
            "none" => {
                let problem = "stands beside sensor = \"none\"";
                let expected = "no other key, or a sensor";
                return Err(self.error(Some(entry.span()), Some(&key), problem, expected));
            }
            kind => BoardSensor::Linear(LinearSensor {
                output: self.sensor_output(&key, (channel, entry), table)?,
                range: self.sensor_range(&key, (channel, entry), table)?,
                is_gauge: kind == "gauge",
            }),
        };
        Ok((channel.signal.into(), sensor))
    }

    fn sensor_kind(
        &self,
        key: &str,
        channel: &BoardChannel,
        table: &DeTable<'t>,
    ) -> Result<&'static str, RigError> {
        let Some(entry) = table.get("sensor") else {
            return Ok("absolute");
        };
        let words: &[&str] = match (channel.is_pressure(), channel.may_be_absent) {
            (true, true) => &["absolute", "gauge", "none"],
            (true, false) => &["absolute", "gauge"],
            (false, true) => &["absolute", "none"],
            (false, false) => &["absolute"],
        };
        let text = entry.get_ref().as_str();
        let word = text.and_then(|text| words.iter().find(|word| **word == text));
        word.copied().ok_or_else(|| {
            let key = format!("{key}.sensor");
            let expected = expected_one_of(text.unwrap_or_default(), words);
            let problem = format!("is {}", shown(entry));
            self.error(Some(entry.span()), Some(&key), problem, &expected)
        })
    }

    fn sensor_output(
        &self,
        key: &str,
        (channel, whole): (&BoardChannel, &Entry<'t>),
        table: &DeTable<'t>,
    ) -> Result<Output, RigError> {
        let (volts, current) = (table.get("output_V"), table.get("output_mA"));
        let (entry, name, limits) = match (volts, current) {
            (Some(entry), None) => (entry, "output_V", channel.input_limits()),
            (None, Some(entry)) => (entry, "output_mA", CURRENT_MA),
            (stated, _) => {
                let problem = stated.map_or("missing", |_| "stands beside output_mA");
                let key = format!("{key}.output_V");
                let span = Some(stated.unwrap_or(whole).span());
                let expected =
                    "what the sensor puts out, output_V = [0, 10] or output_mA = [4, 20]";
                return Err(self.error(span, Some(&key), problem, expected));
            }
        };
        let ends = self.two_ends(&format!("{key}.{name}"), entry, &limits)?;
        Ok(match name {
            "output_V" => Output::Volts(ends),
            _ => Output::Milliamperes(ends),
        })
    }

    fn sensor_range(
        &self,
        key: &str,
        (channel, whole): (&BoardChannel, &Entry<'t>),
        table: &DeTable<'t>,
    ) -> Result<[f64; 2], RigError> {
        let key = format!("{key}.{}", channel.range_key);
        match table.get(channel.range_key) {
            Some(entry) => self.two_ends(&key, entry, &channel.limits),
            None => {
                let expected = format!("two numbers, {}", channel.limits.expected);
                Err(self.error(Some(whole.span()), Some(&key), "missing", &expected))
            }
        }
    }

    /// Two numbers that differ.
    fn two_ends(
        &self,
        key: &str,
        entry: &Entry<'t>,
        limits: &Limits,
    ) -> Result<[f64; 2], RigError> {
        let unfit = |problem: String| {
            let expected = format!("a list of two numbers that differ, {}", limits.expected);
            self.error(Some(entry.span()), Some(key), problem, &expected)
        };
        let array = entry.get_ref().as_array();
        let ends: Vec<f64> = array
            .ok_or_else(|| unfit(format!("is {}", shown(entry))))?
            .iter()
            .map(|end| self.number(key, end, limits))
            .collect::<Result<_, _>>()?;
        match ends[..] {
            [from, to] if (from - to).abs() > 0.0 => Ok([from, to]),
            [_, _] => Err(unfit("has the same number twice".into())),
            _ => Err(unfit(format!("has {} numbers", ends.len()))),
        }
    }
}
