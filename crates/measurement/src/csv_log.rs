//! Reading a log from the text of a CSV file.

use crate::dialect::{Dialect, decode, without_hint};
use crate::error::{Error, Place, printable};
use crate::header::JointLabel;
use crate::layout::{Layout, Source, find_layout};
use crate::left_out::BadRows;
use crate::log::{Log, Parts, assemble, objection};
use crate::mapping::ColumnMapping;
use crate::quantity::Quantity;
use crate::sheet::{Line, Sheet, number};

/// Reads a log from the bytes of a CSV file.
///
/// Headers are understood when named `t`, `q1`, `qd1`, `qdd1`, `tau1` or `current1`, or by the joint's name
/// (`q_shoulder`), with or without a unit (`t_ms`, `q1_deg`, `tau1_Nm`); others by `mapping`. A declared unit is
/// converted, an undeclared one is SI and noted. `file` names the file in messages.
///
/// # Errors
/// A needed column missing, doubled or in an unknown unit; columns of a joint the robot does not have; a cell that is
/// not a finite number; time that does not rise; too few samples; text that is not UTF-8.
pub fn read_csv(
    bytes: &[u8],
    file: &str,
    joints: &[JointLabel],
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    let text = decode(bytes, file)?;
    let text = without_hint(text);
    let text = text.as_ref();
    let mut sheet = Sheet::open(text, file)?;
    let (headers, dialect) = (sheet.headers.clone(), sheet.dialect);
    let layout = find_layout(&headers, joints, mapping, file)?;
    let mut table = Table::new(&headers, &layout, dialect, file);
    let mut bad = BadRows::default();
    while let Some(line) = sheet.next_line()? {
        match table.row(&line) {
            Ok(row) => table.push(row, line.number)?,
            Err(error) if mapping.drop_bad => bad.note(table.lines.len(), error)?,
            Err(error) => return Err(error),
        }
    }
    let parts = Parts {
        columns: table.columns,
        lines: table.lines,
        format: format!("CSV: {dialect}"),
        repeated: table.repeated,
        bad,
        layout,
    };
    assemble(file, joints, mapping, parts)
}

/// The needed columns, filled line by line.
struct Table<'a> {
    file: &'a str,
    headers: &'a [String],
    dialect: Dialect,
    sources: Vec<(Quantity, Source)>,
    columns: Vec<Vec<f64>>,
    lines: Vec<u64>,
    repeated: usize,
}

impl<'a> Table<'a> {
    fn new(headers: &'a [String], layout: &Layout, dialect: Dialect, file: &'a str) -> Self {
        let sources = layout.sources();
        Self {
            file,
            headers,
            dialect,
            columns: vec![Vec::new(); sources.len()],
            sources,
            lines: Vec::new(),
            repeated: 0,
        }
    }

    /// The needed cells of a line, in SI units.
    fn row(&self, line: &Line<'_>) -> Result<Vec<f64>, Error> {
        line.check_count(self.headers.len(), self.file)?;
        let sources = self.sources.iter();
        sources
            .map(|&(quantity, source)| {
                self.value(quantity, source, line.cells[source.column], line.number)
            })
            .collect()
    }

    fn push(&mut self, row: Vec<f64>, line: u64) -> Result<(), Error> {
        if self.sources[0].0 == Quantity::Time
            && let Some(&before) = self.columns[0].last()
            && row[0] <= before
        {
            let same = row
                .iter()
                .zip(&self.columns)
                .all(|(v, c)| c.last() == Some(v));
            if same {
                self.repeated += 1;
                return Ok(());
            }
            return Err(self.time_order(before, row[0], line));
        }
        for (column, value) in self.columns.iter_mut().zip(row) {
            column.push(value);
        }
        self.lines.push(line);
        Ok(())
    }

    fn value(
        &self,
        quantity: Quantity,
        source: Source,
        cell: &str,
        line: u64,
    ) -> Result<f64, Error> {
        let refuse = |code, met: String, rule: &str| {
            let place = Place::file(self.file).line(line);
            let place = place.column(&self.headers[source.column]);
            Error::log(code, place, met, rule)
        };
        let number =
            number(cell, self.dialect).map_err(|(code, met, rule)| refuse(code, met, rule))?;
        let value = number * source.factor;
        if let Some((code, rule)) = objection(quantity, number, value) {
            let met = format!("`{}`", printable(cell.trim()));
            return Err(refuse(code, met, rule));
        }
        Ok(value)
    }

    fn time_order(&self, before: f64, now: f64, line: u64) -> Error {
        let place = Place::file(self.file).line(line);
        let place = place.column(&self.headers[self.sources[0].1.column]);
        if now == before {
            return Error::log(
                "time-order",
                place,
                format!("time {now} s twice with different values"),
                "time must rise from line to line; remove one line, or correct the clock",
            );
        }
        let start = self.columns[0][0];
        let hint = if now <= start {
            "the clock starts again, so these are two recordings: split the file here"
        } else {
            "sort the lines, or correct the clock"
        };
        Error::log(
            "time-order",
            place,
            format!("time {now} s after {before} s, {:.3e} s back", before - now),
            format!("time must rise from line to line; {hint}"),
        )
    }
}
