//! Parquet and Arrow files, as `parquet` and `arrow-ipc` read them.
//!
//! Units and descriptions are those of the fields' metadata (`unit` or `units`, `description`).
//! Instants become dates with all their digits.

use std::io::Cursor;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int64Type};
use arrow_array::{Array, ArrayRef, RecordBatch, StringArray};
use arrow_cast::cast;
use arrow_ipc::reader::FileReader;
use arrow_schema::{ArrowError, DataType, Field, Schema, TimeUnit};
use bytes::Bytes;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use crate::groups::{Cells, Column, Group};
use crate::said;
use crate::text::clock_text;

pub(crate) fn parquet(bytes: &[u8]) -> Result<Vec<Group>, String> {
    let bytes = Bytes::copy_from_slice(bytes);
    let builder = ParquetRecordBatchReaderBuilder::try_new(bytes).map_err(said)?;
    let schema = builder.schema().clone();
    table(&schema, builder.build().map_err(said)?)
}

pub(crate) fn arrow(bytes: &[u8]) -> Result<Vec<Group>, String> {
    let reader = FileReader::try_new(Cursor::new(bytes), None).map_err(said)?;
    let schema = reader.schema();
    table(&schema, reader)
}

fn table(
    schema: &Schema,
    batches: impl Iterator<Item = Result<RecordBatch, ArrowError>>,
) -> Result<Vec<Group>, String> {
    let mut columns: Vec<Column> = schema.fields().iter().map(|field| empty(field)).collect();
    for batch in batches {
        let batch = batch.map_err(said)?;
        for (column, array) in columns.iter_mut().zip(batch.columns()) {
            extend(&mut column.cells, array)?;
        }
    }
    Ok(vec![Group {
        name: String::new(),
        columns,
        clock: None,
    }])
}

/// A column without rows.
fn empty(field: &Field) -> Column {
    let fact = |keys: [&str; 2]| {
        keys.into_iter()
            .find_map(|key| field.metadata().get(key).cloned())
    };
    let kind = field.data_type();
    let is_real = kind.is_numeric() && !kind.is_integer() || *kind == DataType::Boolean;
    let cells = if is_real {
        Cells::Reals(Vec::new())
    } else {
        Cells::Texts(Vec::new())
    };
    let facts = (fact(["unit", "units"]), fact(["description", "comment"]));
    Column::new(field.name(), cells).with_facts(facts.0, facts.1)
}

/// Puts the values of a batch below those of the batches before.
fn extend(cells: &mut Cells, array: &ArrayRef) -> Result<(), String> {
    match cells {
        Cells::Reals(cells) => {
            let numbers = cast(array, &DataType::Float64).map_err(said)?;
            let numbers = numbers.as_primitive::<Float64Type>();
            cells.extend(numbers.iter().map(|number| number.unwrap_or(f64::NAN)));
        }
        // A whole number may be missing, which only text says.
        Cells::Wholes(_) => {}
        Cells::Texts(cells) => match texts(array) {
            Ok(texts) => {
                let texts = texts.as_string::<i32>();
                cells.extend(texts.iter().map(|text| text.unwrap_or_default().to_owned()));
            }
            // Lists and the like: no column of a recording.
            Err(_) => cells.extend(std::iter::repeat_n(String::new(), array.len())),
        },
    }
    Ok(())
}

/// Values as text: whole numbers with all their digits, instants as dates, durations as clock
/// texts, from which no unit of the file is left.
fn texts(array: &ArrayRef) -> Result<ArrayRef, ArrowError> {
    let per_s = match array.data_type() {
        DataType::Duration(unit) | DataType::Time32(unit) | DataType::Time64(unit) => match unit {
            TimeUnit::Second => 1,
            TimeUnit::Millisecond => 1_000,
            TimeUnit::Microsecond => 1_000_000,
            TimeUnit::Nanosecond => 1_000_000_000,
        },
        _ => return cast(array, &DataType::Utf8),
    };
    let counts = cast(array, &DataType::Int64)?;
    let counts = counts.as_primitive::<Int64Type>().iter();
    let texts = counts.map(|count| count.map(|count| clock_text(count, per_s)));
    Ok(Arc::new(texts.collect::<StringArray>()))
}
