//! HDF5, MATLAB 7.3 among it, as `hdf5-reader` reads it.
//!
//! A dataset of one row or column is a column, one with several is its columns `name[0]`, `name[1]`,
//! of records their fields; a group is a table. `unit` or `units` and `description` or `long_name`
//! of a dataset are what the file says of it.

use hdf5_reader::group::Group as Folder;
use hdf5_reader::{ByteOrder, CompoundField, Dataset, Datatype, Hdf5File};

use crate::groups::{Cells, Column, Group, below, by_length, columns_of_matlab, columns_of_rows};
use crate::said;

/// A deeper tree is no recording.
const DEEPEST: usize = 16;

pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    let file = Hdf5File::from_bytes(bytes).map_err(said)?;
    let root = file.root_group().map_err(said)?;
    let mut groups = Vec::new();
    gather("", &root, &mut groups, 0)?;
    Ok(groups)
}

fn gather(
    path: &str,
    folder: &Folder,
    groups: &mut Vec<Group>,
    depth: usize,
) -> Result<(), String> {
    let (folders, datasets) = folder.members().map_err(said)?;
    let mut columns = Vec::new();
    for dataset in &datasets {
        if let Datatype::Compound { .. } = dataset.dtype() {
            let path = below(path, '/', own(dataset.name()));
            groups.extend(by_length(&path, records(dataset)?));
        } else {
            columns.extend(columns_of(dataset)?);
        }
    }
    groups.extend(by_length(path, columns));
    // `#refs#` and such are MATLAB's own.
    let folders = folders
        .iter()
        .filter(|folder| !folder.name().starts_with('#'));
    for folder in folders.filter(|_| depth < DEEPEST) {
        gather(
            &below(path, '/', own(folder.name())),
            folder,
            groups,
            depth + 1,
        )?;
    }
    Ok(())
}

/// A name without the path that the library may put before it.
fn own(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// The columns of a dataset of numbers.
fn columns_of(dataset: &Dataset) -> Result<Vec<Column>, String> {
    let shape: Vec<usize> = dataset.shape().iter().map(|side| *side as usize).collect();
    let is_column = match shape[..] {
        [_] => true,
        [rows, columns] => rows == 1 || columns == 1,
        _ => return Ok(Vec::new()),
    };
    let name = own(dataset.name());
    let Some(cells) = cells(dataset)?.map(|cells| scaled(dataset, cells)) else {
        return Ok(Vec::new());
    };
    if cells.len() < 2 {
        return Ok(Vec::new());
    }
    let told = |column: Column| {
        let said = |keys: [&str; 2]| keys.into_iter().find_map(|key| attribute(dataset, key));
        column.with_facts(said(["unit", "units"]), said(["description", "long_name"]))
    };
    if is_column {
        return Ok(vec![told(Column::new(name, cells))]);
    }
    if dataset.attribute("MATLAB_class").is_ok() {
        // MATLAB writes its columns one after the other, and HDF5 calls them rows.
        return Ok(columns_of_matlab(name, &cells.reals(), shape[1]));
    }
    let columns = columns_of_rows(&cells.reals(), shape[1]);
    let number = |(place, column)| {
        told(Column::new(
            format!("{name}[{place}]"),
            Cells::Reals(column),
        ))
    };
    Ok(columns.into_iter().enumerate().map(number).collect())
}

/// Values as their attributes say what they mean (the conventions of netCDF): `_FillValue` and
/// `missing_value` are none, `scale_factor` and `add_offset` lead to the unit.
fn scaled(dataset: &Dataset, cells: Cells) -> Cells {
    let number = |key: &str| dataset.attribute(key).ok()?.read_as_f64().ok();
    let missing = [number("_FillValue"), number("missing_value")];
    let (scale, offset) = (number("scale_factor"), number("add_offset"));
    if missing == [None; 2] && scale.is_none() && offset.is_none() {
        return cells;
    }
    let value = |raw: f64| {
        let is_missing = missing
            .iter()
            .flatten()
            .any(|none| none.to_bits() == raw.to_bits());
        let value = raw * scale.unwrap_or(1.0) + offset.unwrap_or(0.0);
        if is_missing { f64::NAN } else { value }
    };
    Cells::Reals(cells.reals().into_iter().map(value).collect())
}

fn attribute(dataset: &Dataset, key: &str) -> Option<String> {
    dataset.attribute(key).ok()?.read_string().ok()
}

/// The numbers of a dataset; `None` where it holds none.
fn cells(dataset: &Dataset) -> Result<Option<Cells>, String> {
    macro_rules! read {
        ($number:ty) => {
            dataset.read_array::<$number>().map_err(said)?.into_iter()
        };
    }
    Ok(Some(match dataset.dtype() {
        Datatype::FloatingPoint { size: 4, .. } => {
            Cells::Reals(read!(f32).map(f64::from).collect())
        }
        Datatype::FloatingPoint { size: 8, .. } => Cells::Reals(read!(f64).collect()),
        Datatype::FixedPoint { size, signed, .. } => Cells::Wholes(match (size, signed) {
            (1, true) => read!(i8).map(i64::from).collect(),
            (1, false) => read!(u8).map(i64::from).collect(),
            (2, true) => read!(i16).map(i64::from).collect(),
            (2, false) => read!(u16).map(i64::from).collect(),
            (4, true) => read!(i32).map(i64::from).collect(),
            (4, false) => read!(u32).map(i64::from).collect(),
            (8, true) => read!(i64).collect(),
            (8, false) => read!(u64).map(|value| value as i64).collect(),
            _ => return Ok(None),
        }),
        _ => return Ok(None),
    }))
}

/// The fields of records that are numbers.
fn records(dataset: &Dataset) -> Result<Vec<Column>, String> {
    let Datatype::Compound { size, fields } = dataset.dtype() else {
        return Ok(Vec::new());
    };
    let bytes = dataset.read_raw_bytes().map_err(said)?;
    let column = |field: &CompoundField| {
        let at = field.byte_offset as usize;
        let records = bytes.chunks_exact(*size as usize);
        let values = records.map(|record| number(&field.datatype, record.get(at..)?));
        let cells = match values.collect::<Option<Vec<Number>>>()? {
            numbers if numbers.iter().all(|one| matches!(one, Number::Whole(_))) => {
                Cells::Wholes(numbers.into_iter().map(Number::whole).collect())
            }
            numbers => Cells::Reals(numbers.into_iter().map(Number::real).collect()),
        };
        Some(Column::new(field.name.clone(), cells))
    };
    Ok(fields.iter().filter_map(column).collect())
}

/// A number of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Number {
    Real(f64),
    Whole(i64),
}

impl Number {
    fn real(self) -> f64 {
        match self {
            Self::Real(value) => value,
            Self::Whole(value) => value as f64,
        }
    }

    fn whole(self) -> i64 {
        match self {
            Self::Real(value) => value as i64,
            Self::Whole(value) => value,
        }
    }
}

/// A number that begins with the first of the bytes; `None` for another kind of field.
fn number(kind: &Datatype, bytes: &[u8]) -> Option<Number> {
    let (Datatype::FloatingPoint { size, byte_order }
    | Datatype::FixedPoint {
        size, byte_order, ..
    }) = kind
    else {
        return None;
    };
    let mut own = bytes.get(..usize::from(*size))?.to_vec();
    if *byte_order == ByteOrder::BigEndian {
        own.reverse();
    }
    let is_negative = own.last().is_some_and(|highest| highest & 0x80 != 0);
    match kind {
        Datatype::FloatingPoint { size: 4, .. } => Some(Number::Real(
            f32::from_le_bytes(own.try_into().ok()?).into(),
        )),
        Datatype::FloatingPoint { .. } => {
            Some(Number::Real(f64::from_le_bytes(own.try_into().ok()?)))
        }
        Datatype::FixedPoint { signed, .. } => {
            own.resize(8, if *signed && is_negative { 0xff } else { 0 });
            Some(Number::Whole(i64::from_le_bytes(own.try_into().ok()?)))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_numbers_of_records_in_either_order_of_bytes() {
        let fixed = |size, signed, byte_order| Datatype::FixedPoint {
            size,
            signed,
            byte_order,
        };
        let big = ByteOrder::BigEndian;
        let little = ByteOrder::LittleEndian;
        let cases: [(Datatype, &[u8], f64); 6] = [
            (fixed(2, true, little), &[0xfe, 0xff, 7], -2.0),
            (fixed(2, false, little), &[0xfe, 0xff, 7], 65534.0),
            (fixed(4, true, big), &[0, 0, 1, 0], 256.0),
            (fixed(1, true, big), &[0x80], -128.0),
            (
                Datatype::FloatingPoint {
                    size: 4,
                    byte_order: big,
                },
                &(-1.5_f32).to_be_bytes(),
                -1.5,
            ),
            (
                Datatype::FloatingPoint {
                    size: 8,
                    byte_order: little,
                },
                &0.1_f64.to_le_bytes(),
                0.1,
            ),
        ];
        for (kind, bytes, expected) in cases {
            let read = number(&kind, bytes).map(|one| one.real().to_bits());
            assert_eq!(read, Some(expected.to_bits()), "{kind:?}");
        }
        assert_eq!(number(&fixed(4, true, little), &[1, 2]), None);
    }
}
