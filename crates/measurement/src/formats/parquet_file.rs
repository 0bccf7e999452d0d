//! Parquet tables with one row a sample.

use crate::columns::{NamedColumn, log_from_columns};
use crate::error::{Error, Place};
use crate::header::JointLabel;
use crate::log::Log;
use crate::mapping::ColumnMapping;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

/// Reads a Parquet table whose columns are named as those of a CSV file.
///
/// # Errors
/// A damaged file, and those of [`read_csv`](crate::read_csv).
pub fn read_parquet(
    bytes: Vec<u8>,
    file: &str,
    joints: &[JointLabel],
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    let damaged = |e: parquet::errors::ParquetError| {
        Error::log(
            "damaged",
            Place::file(file),
            e.to_string(),
            "the file is damaged, cut off or of a compression this build leaves out; write it again with snappy or zstd",
        )
    };
    let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).map_err(damaged)?;
    let schema = reader.metadata().file_metadata().schema();
    let mut columns: Vec<NamedColumn> = schema
        .get_fields()
        .iter()
        .map(|f| NamedColumn {
            name: f.name().to_string(),
            values: Some(Vec::new()),
        })
        .collect();
    for row in reader.get_row_iter(None).map_err(damaged)? {
        let row = row.map_err(damaged)?;
        for (column, (_, field)) in columns.iter_mut().zip(row.get_column_iter()) {
            match (number(field), &mut column.values) {
                (Some(value), Some(values)) => values.push(value),
                _ => column.values = None,
            }
        }
    }
    log_from_columns(file, "Parquet".into(), &columns, joints, mapping)
}

/// A null is not a number to compute with, so it becomes NaN and is refused where the column is needed.
fn number(field: &Field) -> Option<f64> {
    Some(match *field {
        Field::Null => f64::NAN,
        Field::Double(v) => v,
        Field::Float(v) => f64::from(v),
        Field::Int(v) => f64::from(v),
        Field::Short(v) => f64::from(v),
        Field::UInt(v) => f64::from(v),
        Field::UShort(v) => f64::from(v),
        Field::Long(v) => v as f64,
        Field::ULong(v) => v as f64,
        // Timestamps come in their unit's seconds, so that `t` needs none.
        Field::TimestampMillis(v) => v as f64 * 1e-3,
        Field::TimestampMicros(v) => v as f64 * 1e-6,
        _ => return None,
    })
}
