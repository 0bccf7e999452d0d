//! Reading a log from the text of a CSV file.

use crate::dialect::{Dialect, decode, find_dialect, find_head, without_hint};
use crate::error::{Error, Place, printable};
use crate::header::JointLabel;
use crate::layout::{Layout, Source, find_layout};
use crate::log::{Log, Parts, assemble, objection};
use crate::mapping::ColumnMapping;
use crate::quantity::Quantity;

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
    let head = find_head(text, file)?;
    let dialect = find_dialect(text, &head, file)?;
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(dialect.separator as u8)
        .from_reader(text.as_bytes());
    let mut record = csv::StringRecord::new();
    let headers = if head.commented {
        let cells = head.header.split(dialect.separator).map(str::trim);
        cells
            .filter(|c| !c.is_empty())
            .map(str::to_string)
            .collect()
    } else {
        next(&mut reader, &mut record, file)?;
        fields(&record, dialect)
            .map(|f| f.trim().to_string())
            .collect::<Vec<_>>()
    };
    let layout = find_layout(&headers, joints, mapping, file)?;
    let mut table = Table::new(&headers, &layout, dialect, file);
    while next(&mut reader, &mut record, file)? {
        table.push(&record)?;
    }
    let parts = Parts {
        columns: table.columns,
        lines: table.lines,
        format: format!("CSV: {dialect}"),
        repeated: table.repeated,
        layout,
    };
    assemble(file, joints, mapping, parts)
}

fn next(
    reader: &mut csv::Reader<&[u8]>,
    record: &mut csv::StringRecord,
    file: &str,
) -> Result<bool, Error> {
    reader.read_record(record).map_err(|e| {
        let line = e.position().map_or(0, csv::Position::line);
        Error::log(
            "syntax",
            Place::file(file).line(line),
            e.to_string(),
            "repair the line",
        )
    })
}

fn fields(record: &csv::StringRecord, dialect: Dialect) -> impl Iterator<Item = &str> + use<'_> {
    let runs = dialect.separator == ' ';
    record.iter().filter(move |f| !runs || !f.is_empty())
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

    fn push(&mut self, record: &csv::StringRecord) -> Result<(), Error> {
        let line = record.position().map_or(0, csv::Position::line);
        let cells: Vec<&str> = fields(record, self.dialect).collect();
        if cells.len() == 1 && cells[0].trim().is_empty() {
            return Ok(());
        }
        if cells.len() != self.headers.len() {
            return Err(Error::log(
                "field-count",
                Place::file(self.file).line(line),
                format!(
                    "{} cells, where the header has {}",
                    cells.len(),
                    self.headers.len()
                ),
                "every line has a cell for each column; repair or remove the line (the last one may be cut off)",
            ));
        }
        let mut row = Vec::with_capacity(self.sources.len());
        for &(quantity, source) in &self.sources {
            row.push(self.value(quantity, source, cells[source.column], line)?);
        }
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
        let cell = cell.trim();
        let refuse = |code, met: String, rule: &str| {
            let place = Place::file(self.file).line(line);
            let place = place.column(&self.headers[source.column]);
            Err(Error::log(code, place, met, rule))
        };
        if cell.is_empty() {
            return refuse(
                "not-finite",
                "an empty cell".into(),
                "every sample needs a value; cut the log where it is whole, a value is never made up",
            );
        }
        let parsed = if self.dialect.decimal == ',' && cell.contains(',') {
            cell.replace(',', ".").parse::<f64>()
        } else {
            cell.parse::<f64>()
        };
        let Ok(number) = parsed else {
            let quoted = format!("`{}`", printable(cell));
            let rule = if cell.contains('\u{2212}') {
                "this is a typographic minus; write numbers with the sign on the keyboard"
            } else {
                "write numbers such as -0.25 or 1.5e-3, without units or thousands marks"
            };
            return refuse("not-a-number", quoted, rule);
        };
        let value = number * source.factor;
        if let Some((code, rule)) = objection(quantity, number, value) {
            return refuse(code, format!("`{}`", printable(cell)), rule);
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
