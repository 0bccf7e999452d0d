//! NumPy archives: `t`, and `q`, `qd`, `qdd`, `tau`, `current` of samples × joints, or one array a column.

use crate::columns::{NamedColumn, log_from_columns};
use crate::error::{Error, Place, printable};
use crate::header::JointLabel;
use crate::log::Log;
use crate::mapping::ColumnMapping;
use npyz::npz::NpzArchive;
use npyz::{Deserialize, NpyFile, Order};
use std::io::{Cursor, Read};

/// Reads an archive of `numpy.savez`: one-dimensional arrays are columns; an array of samples × joints named `q_deg` is
/// the columns `q1_deg`, `q2_deg`, ….
///
/// # Errors
/// A damaged archive, an array of another shape, and those of [`read_csv`](crate::read_csv).
pub fn read_npz(
    bytes: &[u8],
    file: &str,
    joints: &[JointLabel],
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    let damaged = |e: std::io::Error| {
        Error::log(
            "damaged",
            Place::file(file),
            e.to_string(),
            "the archive is damaged or cut off; write it again with numpy.savez",
        )
    };
    let mut archive = NpzArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    let mut names: Vec<String> = archive.array_names().map(str::to_string).collect();
    names.sort();
    let mut columns = Vec::new();
    for name in names {
        let Some(array) = archive.by_name(&name).map_err(damaged)? else {
            continue;
        };
        let shape: Vec<usize> = array.shape().iter().map(|&n| n as usize).collect();
        let order = array.order();
        let values = numbers(array).map_err(damaged)?;
        match *shape.as_slice() {
            [_] => columns.push(NamedColumn { name, values }),
            [rows, n_columns] => {
                columns.extend(split(&name, values.as_deref(), [rows, n_columns], order));
            }
            // A scalar or a stack of matrices is no series.
            _ => columns.push(NamedColumn {
                name: printable(&name),
                values: None,
            }),
        }
    }
    log_from_columns(file, "NumPy archive".into(), &columns, joints, mapping)
}

/// The columns of a matrix, numbered from 1: `q_deg` becomes `q1_deg`, `q2_deg`, ….
fn split(
    name: &str,
    values: Option<&[f64]>,
    [rows, n_columns]: [usize; 2],
    order: Order,
) -> Vec<NamedColumn> {
    let (stem, unit) = name
        .split_once('_')
        .map_or((name, String::new()), |(s, u)| (s, format!("_{u}")));
    let at = |row: usize, column: usize| match order {
        Order::C => row * n_columns + column,
        Order::Fortran => column * rows + row,
    };
    (0..n_columns)
        .map(|column| NamedColumn {
            name: format!("{stem}{}{unit}", column + 1),
            values: values.map(|v| (0..rows).map(|row| v[at(row, column)]).collect()),
        })
        .collect()
}

/// Values of any real type as f64; `None` for text, records and complex numbers.
fn numbers<R: Read>(array: NpyFile<R>) -> std::io::Result<Option<Vec<f64>>> {
    let read = widen(array, |v: f64| v)
        .or_else(|array| widen(array, |v: f32| f64::from(v)))
        .or_else(|array| widen(array, |v: i64| v as f64))
        .or_else(|array| widen(array, |v: i32| f64::from(v)))
        .or_else(|array| widen(array, |v: i16| f64::from(v)))
        .or_else(|array| widen(array, |v: u64| v as f64))
        .or_else(|array| widen(array, |v: u32| f64::from(v)));
    match read {
        Ok(values) => values.map(Some),
        Err(_) => Ok(None),
    }
}

/// The values if the array is of this type, else the array.
fn widen<R: Read, T: Deserialize>(
    array: NpyFile<R>,
    to_f64: fn(T) -> f64,
) -> Result<std::io::Result<Vec<f64>>, NpyFile<R>> {
    let data = array.try_data::<T>()?;
    Ok(data.map(|v| v.map(to_f64)).collect())
}
