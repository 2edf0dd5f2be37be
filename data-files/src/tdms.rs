//! TDMS, as `tedium` reads it: chunks, interleaved values, either order of bytes.
//!
//! A group is a table, or several where its channels have different lengths; the waveform properties
//! of a channel (`wf_increment`, `wf_start_offset`) are the clock of its rows, `unit_string` its unit.

use std::io::Cursor;

use tedium::{
    ChannelPath, DataType, PropertyPath, PropertyValue, TdmsError, TdmsFile, TdmsStorageType,
};

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
    let channels_of = |file: &File<'_>, name: &str| -> Vec<ChannelPath> {
        let folder = PropertyPath::group(name);
        file.list_channels_in_group(&folder).collect()
    };
    for name in &names {
        for channel in channels_of(&file, name) {
            check_type(&mut file, &channel)?;
        }
    }
    let mut groups = Vec::new();
    let mut starts = Vec::new();
    for name in names {
        let channels = channels_of(&file, &name);
        let mut columns = Vec::new();
        for channel in &channels {
            columns.extend(column(&mut file, channel)?);
        }
        for mut table in by_length(&name, columns) {
            let rows = table.rows();
            let own = channels
                .iter()
                .filter(|channel| length(&file, channel) == rows);
            let (clock, start_s) = clock(&file, own, rows).unzip();
            table.clock = clock;
            starts.push(start_s.flatten());
            groups.push(table);
        }
    }
    count_from_the_first(&mut groups, &starts);
    Ok(groups)
}

/// Clocks of several waveforms count from the start of the first. One that does not state its start
/// beside others that do tells no time.
fn count_from_the_first(groups: &mut [Group], starts_s: &[Option<f64>]) {
    let Some(first_s) = starts_s.iter().flatten().copied().reduce(f64::min) else {
        return;
    };
    for (group, start_s) in groups.iter_mut().zip(starts_s) {
        match (start_s, &mut group.clock) {
            (Some(start_s), Some(clock)) => {
                let late_s = start_s - first_s;
                clock
                    .seconds
                    .iter_mut()
                    .for_each(|instant| *instant += late_s);
            }
            _ => group.clock = None,
        }
    }
}

/// The type of a channel that has values.
fn type_of(file: &mut File<'_>, channel: &ChannelPath) -> Result<Option<DataType>, String> {
    if length(file, channel) == 0 {
        return Ok(None);
    }
    // One value tells the type before room is made for all: a damaged file may claim any length.
    match file.read_channel(channel, &mut [0.0_f64]) {
        Ok(()) => Ok(Some(DataType::DoubleFloat)),
        Err(TdmsError::DataTypeMismatch(own, _)) => Ok(Some(own)),
        Err(cause) => Err(said(cause)),
    }
}

/// The library counts a stamp with half of its bytes, and finds what stands behind it in the wrong
/// place.
fn check_type(file: &mut File<'_>, channel: &ChannelPath) -> Result<(), String> {
    if type_of(file, channel)? != Some(DataType::Timestamp) {
        return Ok(());
    }
    let name = channel.channel_name();
    Err(format!(
        "channel \"{name}\" holds absolute stamps, which are not read: export it without"
    ))
}

/// A file that ends inside a segment would be read without it, and a channel without its name where
/// that has an apostrophe (written twice).
fn check_segments(bytes: &[u8]) -> Result<(), String> {
    let mut rest = bytes;
    while !rest.is_empty() {
        if rest.get(12..20) == Some(&[0xff; 8]) {
            return Err("its last segment was never finished: open and save it once".into());
        }
        let has_high_first = rest.get(4).is_some_and(|mask| mask & HIGH_BYTES_FIRST != 0);
        let field = |at: usize| -> Option<usize> {
            let bytes = rest.get(at..)?.first_chunk()?;
            let value = if has_high_first {
                u64::from_be_bytes(*bytes)
            } else {
                u64::from_le_bytes(*bytes)
            };
            usize::try_from(value).ok()
        };
        let (length, metadata) = (field(12), field(20));
        let named = metadata.and_then(|length| rest.get(LEAD_IN..LEAD_IN.checked_add(length)?));
        if named.is_some_and(|text| text.windows(2).any(|pair| pair == b"''")) {
            return Err("a name in it has an apostrophe, which is not read".into());
        }
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

/// A channel of numbers; `None` for text and what has no value.
fn column(file: &mut File<'_>, channel: &ChannelPath) -> Result<Option<Column>, String> {
    let Some(cells) = cells(file, channel)? else {
        return Ok(None);
    };
    let name = channel.channel_name();
    let properties = |key: &str| file.read_property(channel.as_ref(), key).ok().flatten();
    let text = |key: &str| match properties(key) {
        Some(PropertyValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let has_scales =
        properties("NI_Number_Of_Scales").is_some_and(|number| *number != PropertyValue::U32(0));
    let is_scaled = text("NI_Scaling_Status").is_some_and(|status| status == "scaled");
    if has_scales && !is_scaled {
        return Err(format!(
            "channel \"{name}\" holds raw values and a scale: export it with scaled values"
        ));
    }
    let facts = (text("unit_string"), text("description"));
    Ok(Some(Column::new(name, cells).with_facts(facts.0, facts.1)))
}

/// The values of a channel, of whichever type of number they are.
fn cells(file: &mut File<'_>, channel: &ChannelPath) -> Result<Option<Cells>, String> {
    macro_rules! wholes {
        ($number:ty) => {
            Cells::Wholes(
                values::<$number>(file, channel)?
                    .into_iter()
                    .map(i64::from)
                    .collect(),
            )
        };
    }
    let reals = |values: Vec<u64>| Cells::Reals(values.into_iter().map(|one| one as f64).collect());
    Ok(Some(match type_of(file, channel)? {
        Some(DataType::DoubleFloat) => Cells::Reals(values::<f64>(file, channel)?),
        Some(DataType::SingleFloat) => {
            let values = values::<f32>(file, channel)?.into_iter();
            Cells::Reals(values.map(f64::from).collect())
        }
        Some(DataType::I8) => wholes!(i8),
        Some(DataType::I16) => wholes!(i16),
        Some(DataType::I32) => wholes!(i32),
        Some(DataType::I64) => wholes!(i64),
        Some(DataType::U8) => wholes!(u8),
        Some(DataType::U16) => wholes!(u16),
        Some(DataType::U32) => wholes!(u32),
        Some(DataType::U64) => reals(values::<u64>(file, channel)?),
        _ => return Ok(None),
    }))
}

/// All values of a channel of this type.
fn values<D: TdmsStorageType + Default + Clone>(
    file: &mut File<'_>,
    channel: &ChannelPath,
) -> Result<Vec<D>, String> {
    let length = length(file, channel);
    let mut values = Vec::new();
    values.try_reserve_exact(length).map_err(said)?;
    values.resize(length, D::default());
    file.read_channel(channel, &mut values).map_err(said)?;
    Ok(values)
}

/// The waveform's instants since its start, and that, s; where every channel has the same.
fn clock<'c>(
    file: &File<'_>,
    channels: impl Iterator<Item = &'c ChannelPath>,
    rows: usize,
) -> Option<(Clock, Option<f64>)> {
    let number = |channel: &ChannelPath, key: &str| match file.read_property(channel.as_ref(), key)
    {
        Ok(Some(PropertyValue::DoubleFloat(value))) => Some(*value),
        Ok(Some(PropertyValue::SingleFloat(value))) => Some(f64::from(*value)),
        Ok(Some(PropertyValue::Timestamp(stamp))) => Some(stamp.to_unix_epoch()),
        _ => None,
    };
    let of_channel = |channel: &ChannelPath| {
        let step_s = number(channel, "wf_increment").filter(|step| *step > 0.0)?;
        let offset_s = number(channel, "wf_start_offset").unwrap_or(0.0);
        Some((offset_s, step_s, number(channel, "wf_start_time")))
    };
    let mut all = channels.map(of_channel);
    let first = all.next()??;
    if !all.all(|other| other == Some(first)) {
        return None;
    }
    let (offset_s, step_s, start_s) = first;
    let clock = Clock {
        seconds: (0..rows)
            .map(|row| offset_s + step_s * row as f64)
            .collect(),
        says: format!("that of the waveform (wf_increment = {step_s} s)"),
    };
    Some((clock, start_s))
}
