//! A log from named columns of numbers, whatever file they came from.

use crate::error::{Error, Place};
use crate::header::JointLabel;
use crate::layout::find_layout;
use crate::left_out::BadRows;
use crate::log::{Log, Parts, assemble, objection};
use crate::mapping::ColumnMapping;
use crate::quantity::Quantity;
use std::collections::BTreeMap;

/// A named column of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedColumn {
    /// Name as a CSV file's header would have it, `q1_deg`.
    pub name: String,
    /// One value a sample; `None` where the column holds something that is not a number.
    pub values: Option<Vec<f64>>,
}

/// A log from columns named as those of a CSV file; every value is checked as it is there.
///
/// `file` names the source in messages, `format` is the first note.
///
/// # Errors
/// Those of [`read_csv`](crate::read_csv), with rows in place of lines.
pub fn log_from_columns(
    file: &str,
    format: String,
    columns: &[NamedColumn],
    joints: &[JointLabel],
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    let headers: Vec<String> = columns.iter().map(|c| c.name.clone()).collect();
    let layout = find_layout(&headers, joints, mapping, file)?;
    let mut needed: Vec<Vec<f64>> = Vec::new();
    let mut bad: BTreeMap<usize, Error> = BTreeMap::new();
    for (quantity, source) in layout.sources() {
        let column = &columns[source.column];
        let place = || Place::file(file).column(&column.name);
        let Some(values) = &column.values else {
            return Err(Error::log(
                "not-a-number",
                place(),
                "a column that does not hold numbers",
                "store it as floating point or integers",
            ));
        };
        if let Some(first) = needed.first()
            && first.len() != values.len()
        {
            return Err(Error::log(
                "field-count",
                place(),
                format!(
                    "{} values, where the first column has {}",
                    values.len(),
                    first.len()
                ),
                "every column has one value a sample; repair the file (it may be cut off)",
            ));
        }
        let mut scaled = Vec::with_capacity(values.len());
        for (row, &number) in values.iter().enumerate() {
            let value = number * source.factor;
            if let Some((code, rule)) = objection(quantity, number, value) {
                let met = format!("{number:e} in row {}", row + 1);
                let error = Error::log(code, place(), met, rule);
                if !mapping.drop_bad {
                    return Err(error);
                }
                bad.entry(row).or_insert(error);
            }
            scaled.push(value);
        }
        needed.push(scaled);
    }
    let bad = without_bad(&mut needed, bad)?;
    let repeated = if layout.time.is_some() {
        let name = layout.time.map_or("", |s| headers[s.column].as_str());
        drop_repeated(file, name, &mut needed)?
    } else {
        0
    };
    let parts = Parts {
        layout,
        columns: needed,
        lines: Vec::new(),
        format,
        repeated,
        bad,
    };
    assemble(file, joints, mapping, parts)
}

/// Leaves out rows that break a rule of their own.
fn without_bad(columns: &mut [Vec<f64>], found: BTreeMap<usize, Error>) -> Result<BadRows, Error> {
    let mut bad = BadRows::default();
    let rows: Vec<usize> = found.keys().copied().collect();
    for (passed, (row, error)) in found.into_iter().enumerate() {
        bad.note(row - passed, error)?;
    }
    for column in columns.iter_mut().filter(|_| !rows.is_empty()) {
        let mut row = 0;
        column.retain(|_| {
            row += 1;
            rows.binary_search(&(row - 1)).is_err()
        });
    }
    Ok(bad)
}

/// Leaves out rows that repeat the one before; refuses time that does not rise. The first column is time.
fn drop_repeated(file: &str, name: &str, columns: &mut [Vec<f64>]) -> Result<usize, Error> {
    let n = columns[0].len();
    let mut keep = vec![true; n];
    for k in 1..n {
        let (before, now) = (columns[0][k - 1], columns[0][k]);
        if now > before {
            continue;
        }
        if columns.iter().all(|c| c[k] == c[k - 1]) {
            keep[k] = false;
            continue;
        }
        let start = columns[0][0];
        let hint = if now <= start {
            "the clock starts again, so these are two recordings: split the file here"
        } else {
            "sort the samples, or correct the clock"
        };
        return Err(Error::log(
            "time-order",
            Place::file(file).column(name).time(now),
            format!(
                "{} {now} s in row {} after {before} s",
                Quantity::Time.symbol(),
                k + 1
            ),
            format!("time must rise from sample to sample; {hint}"),
        ));
    }
    let repeated = keep.iter().filter(|k| !**k).count();
    if repeated > 0 {
        for column in columns {
            let mut keep = keep.iter();
            column.retain(|_| keep.next().copied().unwrap_or(true));
        }
    }
    Ok(repeated)
}
