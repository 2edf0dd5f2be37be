//! MATLAB files of versions 5 to 7, as `matrw` reads them. (7.3 is HDF5.)
//!
//! A vector is a column, a matrix is its columns `name(:,1)`, `name(:,2)`, a structure's fields are
//! the columns of a table of its own. What has one length is one table.

use matrw::{MatVariable, MatlabType, load_matfile_from_u8};

use crate::groups::{Cells, Column, Group, below, by_length, columns_of_matlab};

/// The text that begins a file is free; the library knows MATLAB's own.
const BEGINNING: &[u8] = b"MATLAB 5.0 MAT-file, ";
/// A deeper structure is no recording.
const DEEPEST: usize = 8;

pub(crate) fn read(bytes: &[u8]) -> Result<Vec<Group>, String> {
    check_elements(bytes)?;
    let mut bytes = bytes.to_vec();
    let text = bytes.get_mut(..BEGINNING.len()).ok_or("truncated")?;
    text.copy_from_slice(BEGINNING);
    // The library's own words are a trace of its parser.
    let file = load_matfile_from_u8(&bytes).map_err(|_| "it is damaged or truncated")?;
    let variables = file
        .iter()
        .map(|(name, variable)| (name.as_str(), variable));
    let mut groups = Vec::new();
    gather("", variables.collect(), &mut groups, 0);
    Ok(groups)
}

/// The library takes what is damaged for the end of the file: elements must follow each other up to
/// the end, each with its length.
fn check_elements(bytes: &[u8]) -> Result<(), String> {
    const HEADER: usize = 128;
    const TAG: usize = 8;
    let is_big = bytes.get(126..HEADER) == Some(b"MI");
    let mut rest = bytes.get(HEADER..).ok_or("truncated")?;
    while !rest.is_empty() {
        let length = rest.get(4..TAG).and_then(|field| field.first_chunk());
        let length = length.map(|field| match is_big {
            true => u32::from_be_bytes(*field),
            false => u32::from_le_bytes(*field),
        });
        let end = length.and_then(|length| TAG.checked_add(usize::try_from(length).ok()?));
        let next = end.and_then(|end| rest.get(end..));
        rest = next.ok_or("truncated: it ends inside a variable")?;
    }
    Ok(())
}

/// The columns among variables as tables, and those of the structures among them.
fn gather<'v>(
    name: &str,
    variables: Vec<(&'v str, &'v MatVariable)>,
    groups: &mut Vec<Group>,
    depth: usize,
) {
    let mut columns = Vec::new();
    let mut structures = Vec::new();
    for (own, variable) in variables {
        match variable {
            MatVariable::NumericArray(_) => columns.extend(columns_of(own, variable)),
            MatVariable::Structure(structure) if depth < DEEPEST => {
                structures.push((own, structure))
            }
            _ => {}
        }
    }
    groups.extend(by_length(name, columns));
    for (own, structure) in structures {
        let name = below(name, '.', own);
        let fields = structure.fieldnames();
        let fields = fields
            .iter()
            .filter_map(|field| Some((field.as_str(), structure.get(field)?)));
        gather(&name, fields.collect(), groups, depth + 1);
    }
}

/// A vector as a column, a matrix as its columns; scalars and text are none.
fn columns_of(name: &str, variable: &MatVariable) -> Vec<Column> {
    let [rows, columns] = variable.dim()[..] else {
        return Vec::new();
    };
    let Some(cells) = variable.numeric_type().and_then(cells) else {
        return Vec::new();
    };
    if variable.is_complex() == Some(true) || cells.len() != rows * columns || cells.len() < 2 {
        return Vec::new();
    }
    if rows == 1 || columns == 1 {
        return vec![Column::new(name, cells)];
    }
    columns_of_matlab(name, &cells.reals(), rows)
}

/// The numbers of a variable; whole ones of 64 bits have more digits than a real.
fn cells(values: &MatlabType) -> Option<Cells> {
    fn all<T: Copy + Into<f64>>(values: &[T]) -> Cells {
        Cells::Reals(values.iter().map(|value| (*value).into()).collect())
    }
    Some(match values {
        MatlabType::U8(values) => all(values),
        MatlabType::I8(values) => all(values),
        MatlabType::U16(values) => all(values),
        MatlabType::I16(values) => all(values),
        MatlabType::U32(values) => all(values),
        MatlabType::I32(values) => all(values),
        MatlabType::U64(values) => Cells::Texts(values.iter().map(u64::to_string).collect()),
        MatlabType::I64(values) => Cells::Wholes(values.clone()),
        MatlabType::F32(values) => all(values),
        MatlabType::F64(values) => Cells::Reals(values.clone()),
        MatlabType::BOOL(values) => all(&values
            .iter()
            .map(|value| u8::from(*value))
            .collect::<Vec<u8>>()),
        MatlabType::UTF8(_) | MatlabType::UTF16(_) => return None,
    })
}
