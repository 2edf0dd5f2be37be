//! MDF 4, as `mdf4-rs` reads it: sorted files, with packed blocks (`##DZ`) and lists of blocks.
//!
//! A channel group is a table; its master channel of time is the clock of its rows.

use mdf4_rs::index::{ByteRangeReader, IndexedChannelGroup, MdfIndex};
use mdf4_rs::{DecodedValue, Error};

use crate::groups::{Cells, Clock, Column, Group};
use crate::said;

/// The type of a channel that holds the instants of the rows, or what else they are counted by.
const MASTER: u8 = 2;

pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    if bytes
        .get(8..10)
        .is_some_and(|version| version < b"4.".as_slice())
    {
        return Err("its version is below 4".into());
    }
    let size = bytes.len() as u64;
    let left = size.saturating_mul(MOST_READINGS);
    let mut blocks = Blocks { bytes, left };
    let index = MdfIndex::from_reader(&mut blocks, size).map_err(said)?;
    let all = 0..index.channel_groups.len();
    all.map(|place| table(&index, place, &mut blocks)).collect()
}

/// So many times its size is read of a file at the most, once for each channel: blocks that point
/// in a circle would be read for ever.
const MOST_READINGS: u64 = 4096;

/// The bytes of the file, by range.
struct Blocks<'b> {
    bytes: &'b [u8],
    /// Bytes that may still be read.
    left: u64,
}

impl ByteRangeReader for Blocks<'_> {
    type Error = Error;

    fn read_range(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, Error> {
        let range = usize::try_from(offset)
            .ok()
            .zip(usize::try_from(length).ok());
        let range =
            range.and_then(|(from, length)| self.bytes.get(from..from.checked_add(length)?));
        let fault = |text: &str| Error::IOError(std::io::Error::other(text));
        let range = range.ok_or_else(|| fault("truncated: it ends inside a block"))?;
        let left = self.left.checked_sub(length.max(1));
        self.left = left.ok_or_else(|| fault("its blocks point in a circle"))?;
        Ok(range.to_vec())
    }
}

fn table(index: &MdfIndex, place: usize, blocks: &mut Blocks<'_>) -> Result<Group, String> {
    let group = &index.channel_groups[place];
    let name = name(group, place);
    if group.record_id_size > 0 {
        return Err(format!(
            "the records of group \"{name}\" are unsorted: sort the file, asammdf does on saving"
        ));
    }
    let mut columns = Vec::new();
    let mut clock = None;
    for (at, channel) in group.channels.iter().enumerate() {
        let own = channel.name.clone().unwrap_or_default();
        let values = index.read_channel_values(place, at, blocks).map_err(said)?;
        // A record that lies across two blocks would be lost.
        if values.len() as u64 != group.record_count {
            let (found, stated) = (values.len(), group.record_count);
            return Err(format!(
                "channel \"{own}\" of group \"{name}\" has {found} values of {stated}"
            ));
        }
        let cells = cells(values);
        let unit_s = channel.unit.as_deref().and_then(seconds_per);
        let is_master = channel.channel_type == MASTER && clock.is_none();
        if let Some(unit_s) = unit_s.filter(|_| is_master) {
            let instants = cells.reals().into_iter();
            clock = Some(Clock {
                seconds: instants.map(|instant| instant * unit_s).collect(),
                says: format!("that of the master channel \"{own}\""),
            });
        }
        columns.push(Column::new(own, cells).with_facts(channel.unit.clone(), None));
    }
    Ok(Group {
        name,
        columns,
        clock,
    })
}

/// A unit of time in s; a master may count angles, ways or rows as well.
fn seconds_per(unit: &str) -> Option<f64> {
    match unit.trim() {
        "s" => Some(1.0),
        "ms" => Some(1e-3),
        "us" | "µs" => Some(1e-6),
        "ns" => Some(1e-9),
        _ => None,
    }
}

/// The group's name, or else its comment or number.
fn name(group: &IndexedChannelGroup, place: usize) -> String {
    let own = [&group.name, &group.comment].into_iter().flatten();
    let mut named = own.map(|name| name.trim()).filter(|name| !name.is_empty());
    named
        .next()
        .map_or_else(|| format!("group {place}"), str::to_owned)
}

fn cells(values: Vec<Option<DecodedValue>>) -> Cells {
    let is_text = |value: &Option<DecodedValue>| matches!(value, Some(DecodedValue::String(_)));
    if values.iter().any(is_text) {
        let text =
            |value: Option<DecodedValue>| value.map_or_else(String::new, |one| one.to_string());
        return Cells::Texts(values.into_iter().map(text).collect());
    }
    let number = |value: &Option<DecodedValue>| value.as_ref().and_then(DecodedValue::as_f64);
    Cells::Reals(
        values
            .iter()
            .map(|value| number(value).unwrap_or(f64::NAN))
            .collect(),
    )
}
