//! Parquet and Arrow files, as `parquet` and `arrow-ipc` read them.
//!
//! Units and descriptions are those of the fields' metadata (`unit` or `units`, `description`).
//! Instants become whole numbers of their unit, from which nothing is lost.

use std::io::Cursor;

use arrow_array::cast::AsArray;
use arrow_array::types::Float64Type;
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_cast::cast;
use arrow_ipc::reader::FileReader;
use arrow_schema::{ArrowError, DataType, Field, Schema, TimeUnit};
use bytes::Bytes;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use crate::groups::{Cells, Column, Group};
use crate::said;

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
        separator: '/',
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
    let of_instants = |unit: &TimeUnit| match unit {
        TimeUnit::Second => "s",
        TimeUnit::Millisecond => "ms",
        TimeUnit::Microsecond => "us",
        TimeUnit::Nanosecond => "ns",
    };
    let kind = field.data_type();
    let own_unit = match kind {
        DataType::Timestamp(unit, _) | DataType::Duration(unit) | DataType::Time64(unit) => {
            Some(of_instants(unit))
        }
        _ => None,
    };
    let is_real = kind.is_numeric() && !kind.is_integer() || *kind == DataType::Boolean;
    let cells = if is_real {
        Cells::Reals(Vec::new())
    } else {
        Cells::Texts(Vec::new())
    };
    let unit = fact(["unit", "units"]).or(own_unit.map(str::to_owned));
    Column::new(field.name(), cells).with_facts(unit, fact(["description", "comment"]))
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

/// Values as text: whole numbers with all their digits, instants as counts of their unit.
fn texts(array: &ArrayRef) -> Result<ArrayRef, ArrowError> {
    if has_instants(array.data_type()) {
        return cast(&cast(array, &DataType::Int64)?, &DataType::Utf8);
    }
    cast(array, &DataType::Utf8)
}

fn has_instants(kind: &DataType) -> bool {
    matches!(
        kind,
        DataType::Timestamp(..) | DataType::Duration(_) | DataType::Time64(_)
    )
}
