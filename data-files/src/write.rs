//! Columns as files of other programs.

use std::collections::{BTreeMap, HashMap};
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema};
use matrw::{MatFile, MatVariable, MatlabType, NumericArray, save_matfile_v7};
use mcap::records::MessageHeader;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::properties::WriterProperties;
use serde_json::{Map, Value, json};

use crate::groups::{Cells, Column};
use crate::said;

/// What a file is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Parquet; units are metadata of the fields.
    Parquet,
    /// MATLAB 7: column vectors.
    Matlab,
    /// MCAP: a topic of JSON messages, a message a row.
    Mcap,
}

impl Target {
    /// By the ending of a file's name.
    pub fn of_ending(ending: &str) -> Option<Self> {
        match ending {
            "parquet" => Some(Self::Parquet),
            "mat" => Some(Self::Matlab),
            "mcap" => Some(Self::Mcap),
            _ => None,
        }
    }
}

/// The bytes of a file with these columns of numbers (in Parquet, also of texts), at these instants.
///
/// # Errors
/// In words, where the format cannot hold them.
pub fn write(target: Target, columns: &[Column], time_s: &[f64]) -> Result<Vec<u8>, String> {
    match target {
        Target::Parquet => parquet(columns),
        Target::Matlab => matlab(columns),
        Target::Mcap => mcap(columns, time_s),
    }
}

fn parquet(columns: &[Column]) -> Result<Vec<u8>, String> {
    let field = |column: &Column| {
        let facts = [("unit", &column.unit), ("description", &column.description)];
        let told = facts
            .iter()
            .filter_map(|(key, text)| Some(((*key).to_owned(), (*text).clone()?)));
        let told: HashMap<String, String> = told.collect();
        let kind = match column.cells {
            Cells::Texts(_) => DataType::Utf8,
            Cells::Reals(_) | Cells::Wholes(_) => DataType::Float64,
        };
        Field::new(&column.name, kind, false).with_metadata(told)
    };
    let fields: Vec<Field> = columns.iter().map(field).collect();
    let schema = Arc::new(Schema::new(fields));
    let array = |column: &Column| match &column.cells {
        Cells::Texts(texts) => Arc::new(StringArray::from(texts.clone())) as ArrayRef,
        numbers => Arc::new(Float64Array::from(numbers.reals())) as ArrayRef,
    };
    let arrays = columns.iter().map(array).collect();
    let batch = RecordBatch::try_new(schema.clone(), arrays).map_err(said)?;
    let compression = Compression::ZSTD(ZstdLevel::default());
    let properties = WriterProperties::builder()
        .set_compression(compression)
        .build();
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, schema, Some(properties)).map_err(said)?;
    writer.write(&batch).map_err(said)?;
    writer.close().map_err(said)?;
    Ok(bytes)
}

fn matlab(columns: &[Column]) -> Result<Vec<u8>, String> {
    let mut file = MatFile::new();
    let mut names: BTreeMap<String, &str> = BTreeMap::new();
    for column in columns {
        let name = variable_name(&column.name);
        if let Some(other) = names.insert(name.clone(), &column.name) {
            return Err(format!(
                "\"{other}\" and \"{}\" would both be the variable {name}",
                column.name
            ));
        }
        let values = column.cells.reals();
        let rows = values.len();
        let array =
            NumericArray::new(vec![rows, 1], MatlabType::F64(values), None).map_err(said)?;
        file.insert(&name, MatVariable::NumericArray(array));
    }
    // The library writes to a path and says nothing of a full disk.
    let mut copy = tempfile::NamedTempFile::new().map_err(said)?;
    let path = copy
        .path()
        .to_str()
        .ok_or("the folder of temporary files is no text")?
        .to_owned();
    save_matfile_v7(&path, file, true).map_err(said)?;
    let mut bytes = Vec::new();
    copy.seek(SeekFrom::Start(0)).map_err(said)?;
    copy.read_to_end(&mut bytes).map_err(said)?;
    let written = crate::matlab::read(&bytes)?;
    let whole = written
        .iter()
        .map(|group| group.columns.len())
        .sum::<usize>()
        == columns.len();
    if whole {
        Ok(bytes)
    } else {
        Err("it could not be written whole; is the disk full?".into())
    }
}

/// Letters, digits and underscores, a letter first, at most 63.
fn variable_name(name: &str) -> String {
    let allowed = |one: char| {
        if one.is_ascii_alphanumeric() {
            one
        } else {
            '_'
        }
    };
    let name: String = name.chars().map(allowed).collect();
    let name = if name.starts_with(|one: char| one.is_ascii_alphabetic()) {
        name
    } else {
        format!("x{name}")
    };
    name.chars().take(63).collect()
}

/// Where messages of a recording stand.
const TOPIC: &str = "/recording";

fn mcap(columns: &[Column], time_s: &[f64]) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut bytes).map_err(said)?;
    let property = |column: &Column| {
        let unit = column.unit.as_deref().unwrap_or_default();
        (
            column.name.clone(),
            json!({ "type": "number", "description": unit }),
        )
    };
    let properties: Map<String, Value> = columns.iter().map(property).collect();
    let schema = json!({ "type": "object", "properties": properties }).to_string();
    let schema = writer
        .add_schema("recording", "jsonschema", schema.as_bytes())
        .map_err(said)?;
    let channel = writer
        .add_channel(schema, TOPIC, "json", &BTreeMap::new())
        .map_err(said)?;
    let values: Vec<Vec<f64>> = columns.iter().map(|column| column.cells.reals()).collect();
    let first_s = time_s.first().copied().unwrap_or(0.0);
    for (row, instant_s) in time_s.iter().enumerate() {
        let cell =
            |(column, values): (&Column, &Vec<f64>)| (column.name.clone(), json!(values[row]));
        let message: Map<String, Value> = columns.iter().zip(&values).map(cell).collect();
        // Before a trigger time is below zero, a stamp never.
        let stamp_ns = ((instant_s - first_s) * 1e9).round() as u64;
        let header = MessageHeader {
            channel_id: channel,
            sequence: u32::try_from(row).unwrap_or(u32::MAX),
            log_time: stamp_ns,
            publish_time: stamp_ns,
        };
        let message = Value::Object(message).to_string();
        writer
            .write_to_known_channel(&header, message.as_bytes())
            .map_err(said)?;
    }
    writer.finish().map_err(said)?;
    drop(writer);
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::groups::Cells;
    use crate::{Contents, Kind, read};

    #[test]
    fn prop_what_is_written_is_read_with_the_same_bits() {
        let column = |name: &str, values: &[f64]| {
            Column::new(name, Cells::Reals(values.to_vec())).with_facts(Some("V".into()), None)
        };
        let columns = [
            column("t", &[-0.001, 0.0, 0.0010000000000000002]),
            column("p a", &[1e-300, -0.1, 5e15]),
        ];
        for (target, kind) in [
            (Target::Parquet, Kind::Parquet),
            (Target::Matlab, Kind::Matlab),
            (Target::Mcap, Kind::Mcap),
        ] {
            let bytes = write(target, &columns, &columns[0].cells.reals()).unwrap();
            assert_eq!(Kind::of(&bytes), Some(kind));
            let Contents::Groups(groups) = read(kind, &bytes).unwrap() else {
                panic!("{kind}: sheets");
            };
            for column in &columns {
                let name = match target {
                    Target::Matlab => variable_name(&column.name),
                    _ => column.name.clone(),
                };
                let place = groups[0].find(&name).unwrap();
                let read = groups[0].columns[place].cells.reals();
                assert_eq!(
                    format!("{read:?}"),
                    format!("{:?}", column.cells.reals()),
                    "{kind}"
                );
            }
        }
        let same = [column("p a", &[1.0, 2.0]), column("p_a", &[1.0, 2.0])];
        assert!(write(Target::Matlab, &same, &[0.0, 1.0]).is_err());
    }
}
