//! Several CSV files of one recording, side by side.

use crate::csv_log::read_csv;
use crate::dialect::{decode, find_head, separator, without_hint};
use crate::error::{Error, Place};
use crate::header::JointLabel;
use crate::log::Log;
use crate::mapping::ColumnMapping;

/// Reads a recording whose columns are spread over several CSV files with the same number of lines.
///
/// `files`: bytes and name of each. A header that stands in more than one file is known by `FILE:HEADER`, as a mapping
/// may name it: `motor_torques.csv:Joint_1`.
///
/// # Errors
/// Files of different length or separator, and those of [`read_csv`].
pub fn read_csv_files(
    files: &[(&[u8], &str)],
    joints: &[JointLabel],
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    if let [(bytes, file)] = files {
        return read_csv(bytes, file, joints, mapping);
    }
    let mut texts = Vec::new();
    for (bytes, file) in files {
        texts.push(without_hint(decode(bytes, file)?));
    }
    let mut tables: Vec<Table<'_>> = Vec::new();
    for (text, (_, file)) in texts.iter().zip(files) {
        tables.push(Table::new(text, file)?);
    }
    let Some(first) = tables.first() else {
        let rule = "give at least one file";
        return Err(Error::setting("files", 0.0, rule));
    };
    for table in &tables[1..] {
        let refuse = |met: String, rule: &str| {
            Err(Error::log(
                "field-count",
                Place::file(table.file),
                met,
                rule,
            ))
        };
        if table.separator != first.separator {
            return refuse(
                format!(
                    "columns separated by `{}`, in {} by `{}`",
                    table.separator, first.file, first.separator
                ),
                "the files of one recording have one dialect; save them alike",
            );
        }
        if table.lines.len() != first.lines.len() {
            return refuse(
                format!(
                    "{} lines, where {} has {}",
                    table.lines.len(),
                    first.file,
                    first.lines.len()
                ),
                "the files of one recording have one line a sample; cut them to the same samples",
            );
        }
    }
    let text = joined(&tables);
    let names: Vec<&str> = files.iter().map(|(_, file)| *file).collect();
    read_csv(text.as_bytes(), &names.join(" + "), joints, mapping)
}

struct Table<'a> {
    file: &'a str,
    separator: char,
    headers: Vec<&'a str>,
    lines: Vec<&'a str>,
}

impl<'a> Table<'a> {
    fn new(text: &'a str, file: &'a str) -> Result<Self, Error> {
        let head = find_head(text, file)?;
        let separator = separator(head.header);
        let mut lines = text
            .lines()
            .filter(|l| !l.starts_with('#') && !l.trim().is_empty());
        if !head.commented {
            lines.next();
        }
        let headers = head
            .header
            .split(separator)
            .map(|h| h.trim().trim_matches('"'));
        Ok(Self {
            file,
            separator,
            headers: headers.collect(),
            lines: lines.collect(),
        })
    }
}

fn joined(tables: &[Table<'_>]) -> String {
    let separator = tables[0].separator.to_string();
    let shared = |header: &str| {
        tables
            .iter()
            .filter(|t| t.headers.contains(&header))
            .count()
            > 1
    };
    let headers = tables.iter().flat_map(|t| {
        t.headers.iter().map(|h| {
            if shared(h) {
                format!("{}:{h}", t.file)
            } else {
                (*h).to_string()
            }
        })
    });
    let mut text = headers.collect::<Vec<_>>().join(&separator);
    for k in 0..tables[0].lines.len() {
        text.push('\n');
        let cells: Vec<&str> = tables.iter().map(|t| t.lines[k].trim_end()).collect();
        text.push_str(&cells.join(&separator));
    }
    text
}
