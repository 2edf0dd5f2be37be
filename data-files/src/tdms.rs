//! TDMS, as `tedium` reads it: chunks, interleaved values, either order of bytes.
//!
//! A group is a table, or several where its channels have different lengths; the waveform properties
//! of a channel (`wf_increment`, `wf_start_offset`) are the clock of its rows, `unit_string` its unit.

use std::io::Cursor;

use tedium::{ChannelPath, PropertyPath, PropertyValue, TdmsError, TdmsFile, TdmsStorageType};

use crate::groups::{Cells, Clock, Column, Group, by_length};
use crate::said;

/// Bytes before a segment's metadata: tag, mask, version, two lengths.
const LEAD_IN: usize = 28;
/// The bit of the mask that says that numbers have their high bytes first.
const HIGH_BYTES_FIRST: u8 = 1 << 6;

type File<'b> = TdmsFile<Cursor<&'b [u8]>>;

pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    check_segments(bytes)?;
    let mut file = TdmsFile::new(Cursor::new(bytes)).map_err(said)?;
    let names: Vec<String> = file.list_groups().map(str::to_owned).collect();
    let mut groups = Vec::new();
    for name in names {
        let folder = PropertyPath::group(&name);
        let channels: Vec<ChannelPath> = file.list_channels_in_group(&folder).collect();
        let mut columns = Vec::new();
        for channel in &channels {
            columns.extend(column(&mut file, channel)?);
        }
        for mut table in by_length(&name, '/', columns) {
            let rows = table.rows();
            let own = channels
                .iter()
                .filter(|channel| length(&file, channel) == rows);
            table.clock = clock(&file, own, rows);
            groups.push(table);
        }
    }
    Ok(groups)
}

/// A file that ends inside a segment would be read without it.
fn check_segments(bytes: &[u8]) -> Result<(), String> {
    let mut rest = bytes;
    while !rest.is_empty() {
        let length = rest.get(12..20).and_then(|field| field.first_chunk());
        let has_high_first = rest.get(4).is_some_and(|mask| mask & HIGH_BYTES_FIRST != 0);
        let length = length.map(|field| match has_high_first {
            true => u64::from_be_bytes(*field),
            false => u64::from_le_bytes(*field),
        });
        let length = length.and_then(|length| usize::try_from(length).ok());
        let next = length.and_then(|length| rest.get(LEAD_IN.checked_add(length)?..));
        let next = next.filter(|_| rest.starts_with(b"TDSm"));
        rest = next.ok_or("truncated: it ends inside a segment")?;
    }
    Ok(())
}

fn length(file: &File<'_>, channel: &ChannelPath) -> usize {
    let length = file.channel_length(channel).unwrap_or(0);
    usize::try_from(length).unwrap_or(0)
}

/// A channel of numbers; `None` for text, instants and what has no value.
fn column(file: &mut File<'_>, channel: &ChannelPath) -> Result<Option<Column>, String> {
    let Some(cells) = cells(file, channel)? else {
        return Ok(None);
    };
    let name = channel.channel_name();
    let properties = |key: &str| file.read_property(channel.as_ref(), key).ok().flatten();
    let scales = properties("NI_Number_Of_Scales");
    if scales.is_some_and(|number| *number != PropertyValue::U32(0))
        && matches!(cells, Cells::Wholes(_))
    {
        return Err(format!(
            "channel \"{name}\" holds raw codes and a scale: export it with scaled values"
        ));
    }
    let text = |key: &str| match properties(key) {
        Some(PropertyValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let facts = (text("unit_string"), text("description"));
    Ok(Some(Column::new(name, cells).with_facts(facts.0, facts.1)))
}

/// The values of a channel, of whichever type of number they are.
fn cells(file: &mut File<'_>, channel: &ChannelPath) -> Result<Option<Cells>, String> {
    macro_rules! wholes {
        ($($number:ty),*) => {
            $(if let Some(values) = values::<$number>(file, channel)? {
                let values = values.into_iter().map(i64::from);
                return Ok(Some(Cells::Wholes(values.collect())));
            })*
        };
    }
    if let Some(values) = values::<f64>(file, channel)? {
        return Ok(Some(Cells::Reals(values)));
    }
    if let Some(values) = values::<f32>(file, channel)? {
        return Ok(Some(Cells::Reals(
            values.into_iter().map(f64::from).collect(),
        )));
    }
    wholes!(i16, i32, i64, u16, u32, i8, u8);
    if let Some(values) = values::<u64>(file, channel)? {
        return Ok(Some(Cells::Reals(
            values.into_iter().map(|one| one as f64).collect(),
        )));
    }
    Ok(None)
}

/// The values of a channel if they are of this type.
fn values<D: TdmsStorageType + Default + Clone>(
    file: &mut File<'_>,
    channel: &ChannelPath,
) -> Result<Option<Vec<D>>, String> {
    let length = length(file, channel);
    if length == 0 {
        return Ok(None);
    }
    // A damaged file may claim any length: one value tells the type before room is made for all.
    match file.read_channel(channel, &mut [D::default()]) {
        Ok(()) => {}
        Err(TdmsError::DataTypeMismatch(..)) => return Ok(None),
        Err(cause) => return Err(said(cause)),
    }
    let mut values = Vec::new();
    values.try_reserve_exact(length).map_err(said)?;
    values.resize(length, D::default());
    file.read_channel(channel, &mut values).map_err(said)?;
    Ok(Some(values))
}

/// The waveform's instants, where every channel has the same.
fn clock<'c>(
    file: &File<'_>,
    channels: impl Iterator<Item = &'c ChannelPath>,
    rows: usize,
) -> Option<Clock> {
    let number = |channel: &ChannelPath, key: &str| match file.read_property(channel.as_ref(), key)
    {
        Ok(Some(PropertyValue::DoubleFloat(value))) => Some(*value),
        _ => None,
    };
    let of_channel = |channel: &ChannelPath| {
        let step_s = number(channel, "wf_increment").filter(|step| *step > 0.0)?;
        Some((number(channel, "wf_start_offset").unwrap_or(0.0), step_s))
    };
    let mut all = channels.map(of_channel);
    let first = all.next()??;
    if !all.all(|other| other == Some(first)) {
        return None;
    }
    let (start_s, step_s) = first;
    Some(Clock {
        seconds: (0..rows).map(|row| start_s + step_s * row as f64).collect(),
        says: format!("that of the waveform (wf_increment = {step_s} s)"),
    })
}
