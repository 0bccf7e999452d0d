//! The lines of a CSV file behind its header, whatever its dialect.

use crate::dialect::{Dialect, find_dialect, find_head};
use crate::error::{Error, Place, printable};

/// A CSV text: its dialect, its headers and the lines after them.
pub(crate) struct Sheet<'a> {
    pub(crate) dialect: Dialect,
    pub(crate) headers: Vec<String>,
    file: &'a str,
    reader: csv::Reader<&'a [u8]>,
    record: csv::StringRecord,
}

/// A line that holds something: its number, from 1, and its cells.
pub(crate) struct Line<'a> {
    pub(crate) number: u64,
    pub(crate) cells: Vec<&'a str>,
}

impl<'a> Sheet<'a> {
    /// Finds dialect and header. `text` without a spreadsheet's hint; `file` names it in messages.
    pub(crate) fn open(text: &'a str, file: &'a str) -> Result<Self, Error> {
        let head = find_head(text, file)?;
        let dialect = find_dialect(text, &head, file)?;
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .comment(Some(b'#'))
            .delimiter(dialect.separator as u8)
            .from_reader(text.as_bytes());
        let mut sheet = Self {
            dialect,
            headers: Vec::new(),
            file,
            reader,
            record: csv::StringRecord::new(),
        };
        sheet.headers = if head.commented {
            let cells = head.header.split(dialect.separator).map(str::trim);
            cells
                .filter(|c| !c.is_empty())
                .map(str::to_string)
                .collect()
        } else {
            sheet.read()?;
            sheet.cells().map(|f| f.trim().to_string()).collect()
        };
        Ok(sheet)
    }

    /// The next line that holds something.
    pub(crate) fn next_line(&mut self) -> Result<Option<Line<'_>>, Error> {
        while self.read()? {
            let mut cells = self.cells();
            let first = cells.next().is_some_and(|c| !c.trim().is_empty());
            if first || cells.next().is_some() {
                return Ok(Some(Line {
                    number: self.record.position().map_or(0, csv::Position::line),
                    cells: self.cells().collect(),
                }));
            }
        }
        Ok(None)
    }

    fn read(&mut self) -> Result<bool, Error> {
        self.reader.read_record(&mut self.record).map_err(|e| {
            let line = e.position().map_or(0, csv::Position::line);
            Error::log(
                "syntax",
                Place::file(self.file).line(line),
                e.to_string(),
                "repair the line",
            )
        })
    }

    fn cells(&self) -> impl Iterator<Item = &str> {
        let runs = self.dialect.separator == ' ';
        self.record.iter().filter(move |f| !runs || !f.is_empty())
    }
}

impl Line<'_> {
    /// Every line has a cell for each header.
    pub(crate) fn check_count(&self, n_headers: usize, file: &str) -> Result<(), Error> {
        if self.cells.len() == n_headers {
            return Ok(());
        }
        Err(Error::log(
            "field-count",
            Place::file(file).line(self.number),
            format!(
                "{} cells, where the header has {n_headers}",
                self.cells.len()
            ),
            "every line has a cell for each column; repair or remove the line (the last one may be cut off)",
        ))
    }
}

/// The number in a cell; where there is none the rule broken: its name, what was met, its text.
pub(crate) fn number(
    cell: &str,
    dialect: Dialect,
) -> Result<f64, (&'static str, String, &'static str)> {
    let cell = cell.trim();
    if cell.is_empty() {
        return Err((
            "not-finite",
            "an empty cell".into(),
            "every sample needs a value, and none is made up; leave such rows out with --drop-bad, or cut the log where it is whole",
        ));
    }
    let parsed = if dialect.decimal == ',' && cell.contains(',') {
        cell.replace(',', ".").parse::<f64>()
    } else {
        cell.parse::<f64>()
    };
    parsed.map_err(|_| {
        let rule = if cell.contains('\u{2212}') {
            "this is a typographic minus; write numbers with the sign on the keyboard"
        } else {
            "write numbers such as -0.25 or 1.5e-3, without units or thousands marks"
        };
        ("not-a-number", format!("`{}`", printable(cell)), rule)
    })
}
