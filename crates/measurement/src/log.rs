//! Reading a log from the text of a CSV file.

use crate::dialect::{Dialect, decode, find_dialect, find_head};
use crate::error::{Error, Place, printable};
use crate::header::{ColumnMapping, JointLabel};
use crate::layout::{Layout, Source, find_layout};
use crate::quantity::Quantity;

/// What drove the joints, joint by joint.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// Joint torque, N·m (N).
    Torque(Vec<Vec<f64>>),
    /// Motor current, A.
    Current(Vec<Vec<f64>>),
}

/// A log as recorded, in SI units; every quantity joint by joint, `q[joint][sample]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Name of the file, for messages.
    pub file: String,
    /// Names of the joints, in order.
    pub joints: Vec<String>,
    /// Whether the file declares the unit of its clock.
    pub time_unit_declared: bool,
    /// Time, s, rising.
    pub time: Vec<f64>,
    /// Positions, rad (m).
    pub q: Vec<Vec<f64>>,
    /// Velocities, rad/s (m/s), where recorded for all joints.
    pub qd: Option<Vec<Vec<f64>>>,
    /// Accelerations, rad/s² (m/s²), where recorded for all joints.
    pub qdd: Option<Vec<Vec<f64>>>,
    /// Torques or currents.
    pub drive: Drive,
    /// What was assumed or left out, one sentence each.
    pub notes: Vec<String>,
    /// Line of each sample in the file, from 1; empty for formats without lines.
    pub lines: Vec<u64>,
}

impl Log {
    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.time.len()
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.q.len()
    }

    /// Where a sample stands.
    pub fn place(&self, sample: usize) -> Place {
        let place = Place::file(&self.file);
        match self.lines.get(sample) {
            Some(&line) => place.line(line),
            None => place.time(self.time[sample]),
        }
    }
}

/// Fewest samples that make a log.
const FEWEST_SAMPLES: usize = 10;
/// Largest value of any quantity but time, SI: no arm reaches a million of anything.
const LARGEST: f64 = 1e6;
/// Smallest value but zero: what is below is a number read from the wrong bytes.
const SMALLEST: f64 = 1e-300;

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
    table.finish(joints, layout, mapping)
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
        let mut sources: Vec<(Quantity, Source)> = Vec::new();
        sources.extend(layout.time.map(|s| (Quantity::Time, s)));
        sources.extend(layout.position.iter().map(|&s| (Quantity::Position, s)));
        for &s in layout.velocity.iter().flatten() {
            sources.push((Quantity::Velocity, s));
        }
        for &s in layout.acceleration.iter().flatten() {
            sources.push((Quantity::Acceleration, s));
        }
        sources.extend(layout.drive.1.iter().map(|&s| (layout.drive.0, s)));
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
        if !number.is_finite() {
            return refuse(
                "not-finite",
                format!("`{}`", printable(cell)),
                "every sample needs a finite number; cut the log where it is whole, a value is never made up",
            );
        }
        let value = number * source.factor;
        let absurd = quantity != Quantity::Time && value.abs() > LARGEST;
        if absurd || (number != 0.0 && number.abs() < SMALLEST) {
            return refuse(
                "not-plausible",
                format!("{number:e}"),
                "no joint has such a value (between 1e-300 and 1e6 in SI units); the file is damaged or the unit is wrong",
            );
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

    fn finish(
        self,
        joints: &[JointLabel],
        layout: Layout,
        mapping: &ColumnMapping,
    ) -> Result<Log, Error> {
        let n_samples = self.lines.len();
        if n_samples < FEWEST_SAMPLES {
            return Err(Error::log(
                "too-few-samples",
                Place::file(self.file),
                format!("{n_samples} samples"),
                format!("a log needs at least {FEWEST_SAMPLES}; record a longer motion"),
            ));
        }
        let mut notes = vec![format!("CSV: {}", self.dialect)];
        notes.extend(layout.notes);
        if self.repeated > 0 {
            notes.push(format!("{} repeated lines left out", self.repeated));
        }
        let mut columns = self.columns.into_iter();
        let time = match layout.time {
            Some(_) => columns.next().unwrap_or_default(),
            None => clock_of_rate(n_samples, mapping.sample_rate, &mut notes)?,
        };
        let n = layout.position.len();
        let mut take = || columns.by_ref().take(n).collect::<Vec<_>>();
        let q = take();
        let qd = layout.velocity.is_some().then(&mut take);
        let qdd = layout.acceleration.is_some().then(&mut take);
        let drive = match layout.drive.0 {
            Quantity::Current => Drive::Current(take()),
            _ => Drive::Torque(take()),
        };
        let free = joints.iter().filter(|j| !j.held);
        Ok(Log {
            file: self.file.to_string(),
            joints: free.map(|j| j.name.clone()).collect(),
            time_unit_declared: layout.time.is_none_or(|s| s.declared),
            time,
            q,
            qd,
            qdd,
            drive,
            notes,
            lines: self.lines,
        })
    }
}

fn clock_of_rate(
    n_samples: usize,
    sample_rate: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<Vec<f64>, Error> {
    let rate = sample_rate.unwrap_or(f64::NAN);
    if !(rate > 0.0 && rate.is_finite()) {
        let rule = "samples a second must be a number above zero";
        return Err(Error::setting("sample rate", rate, rule));
    }
    notes.push(format!(
        "no time column: {rate} samples a second, as stated"
    ));
    Ok((0..n_samples).map(|k| k as f64 / rate).collect())
}
