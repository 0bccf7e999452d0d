//! The dialect of a CSV file: separator, decimal mark, comments, encoding.

use crate::error::{Error, Place, printable};
use std::borrow::Cow;
use std::fmt;

/// How a CSV file separates its columns and writes its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Dialect {
    /// Separator of columns; a space stands for any run of spaces.
    pub(crate) separator: char,
    /// Decimal mark.
    pub(crate) decimal: char,
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |c| match c {
            '\t' => "tab",
            ',' => "comma",
            ';' => "semicolon",
            ' ' => "spaces",
            _ => "point",
        };
        write!(
            f,
            "columns separated by {}, decimal {}",
            name(self.separator),
            name(self.decimal)
        )
    }
}

/// Longest line read, bytes: a thousand columns take 20 kB.
const LINE_LIMIT: usize = 1 << 20;
/// Data lines looked at to find the decimal mark.
const SNIFFED_LINES: usize = 200;

/// The text of a file without its byte order mark: UTF-8, or UTF-16 that says so by its mark.
pub(crate) fn decode<'a>(bytes: &'a [u8], file: &str) -> Result<Cow<'a, str>, Error> {
    let refuse = |met: &str, rule: &str| Err(Error::log("encoding", Place::file(file), met, rule));
    for (mark, unit) in [
        ([0xff, 0xfe], u16::from_le_bytes as fn([u8; 2]) -> u16),
        ([0xfe, 0xff], u16::from_be_bytes),
    ] {
        if let Some(bytes) = bytes.strip_prefix(&mark) {
            let (pairs, rest) = bytes.as_chunks::<2>();
            let units: Vec<u16> = pairs.iter().map(|&p| unit(p)).collect();
            return match String::from_utf16(&units) {
                Ok(text) if rest.is_empty() => {
                    check_lines(text.as_bytes(), file)?;
                    Ok(Cow::Owned(text))
                }
                _ => refuse("damaged UTF-16 text", "save the file as UTF-8"),
            };
        }
    }
    if bytes.iter().take(4096).any(|&b| b == 0) {
        return refuse(
            "zero bytes, so UTF-16 without a mark or not text at all",
            "a CSV file is UTF-8 text; save it as that",
        );
    }
    let bytes = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes);
    check_lines(bytes, file)?;
    std::str::from_utf8(bytes).map(Cow::Borrowed).map_err(|e| {
        let line = bytes[..e.valid_up_to()].split(|&b| b == b'\n').count() as u64;
        Error::log(
            "encoding",
            Place::file(file).line(line),
            "a byte that is not UTF-8",
            "save the file as UTF-8",
        )
    })
}

/// The text with a spreadsheet's first line `sep=;` made a comment; the header says as much.
pub(crate) fn without_hint(text: Cow<'_, str>) -> Cow<'_, str> {
    let hint = text
        .get(..4)
        .is_some_and(|t| t.eq_ignore_ascii_case("sep="));
    if hint {
        Cow::Owned(format!("#{text}"))
    } else {
        text
    }
}

/// No line is longer than a table's can be.
fn check_lines(bytes: &[u8], file: &str) -> Result<(), Error> {
    for (n, line) in bytes.split(|&b| b == b'\n').enumerate() {
        if line.len() > LINE_LIMIT {
            return Err(Error::log(
                "line-length",
                Place::file(file).line(n as u64 + 1),
                format!("a line of {} bytes", line.len()),
                format!("a line has at most {LINE_LIMIT} bytes; is this a CSV file?"),
            ));
        }
    }
    Ok(())
}

/// Header line and the lines before it that are comments.
pub(crate) struct Head<'a> {
    /// Text of the header.
    pub(crate) header: &'a str,
    /// The header stood in a comment, so the first plain line is data already.
    pub(crate) commented: bool,
}

/// Finds the header: the first plain line, or the last comment before it where that line is all numbers.
pub(crate) fn find_head<'a>(text: &'a str, file: &str) -> Result<Head<'a>, Error> {
    let mut comment = None;
    for (n, line) in text.lines().enumerate() {
        let line = line.trim_end();
        if let Some(c) = line.strip_prefix('#') {
            comment = Some(c.trim());
            continue;
        }
        if line.trim().is_empty() {
            continue;
        }
        if line
            .chars()
            .any(|c| c.is_alphabetic() && c != 'e' && c != 'E')
        {
            return Ok(Head {
                header: line,
                commented: false,
            });
        }
        let fields = |s: &str| split(s, separator(line)).len();
        return match comment {
            Some(header) if split(header, separator(header)).len() == fields(line) => Ok(Head {
                header,
                commented: true,
            }),
            _ => Err(Error::log(
                "header",
                Place::file(file).line(n as u64 + 1),
                format!("`{}` where the header should be", printable(line)),
                "the first line names the columns: add one such as `t,q1,q2,tau1,tau2`",
            )),
        };
    }
    Err(Error::log(
        "header",
        Place::file(file),
        "no line with text",
        "a log has a header line and one line a sample",
    ))
}

/// Separator of a header line.
pub(crate) fn separator(header: &str) -> char {
    [';', '\t', ',']
        .into_iter()
        .find(|&c| header.contains(c))
        .unwrap_or(' ')
}

fn split(line: &str, separator: char) -> Vec<&str> {
    if separator == ' ' {
        line.split_whitespace().collect()
    } else {
        line.split(separator).collect()
    }
}

/// Finds the decimal mark from the first data lines.
pub(crate) fn find_dialect(text: &str, head: &Head<'_>, file: &str) -> Result<Dialect, Error> {
    let separator = separator(head.header);
    let mut dialect = Dialect {
        separator,
        decimal: '.',
    };
    if separator == ',' {
        return Ok(dialect);
    }
    let mut certain = false;
    let mut doubtful: Option<(u64, &str)> = None;
    let mut point = false;
    let lines = text.lines().enumerate();
    let data = lines.filter(|(_, l)| !l.starts_with('#') && !l.contains(head.header));
    for (n, line) in data.take(SNIFFED_LINES) {
        for cell in split(line, separator) {
            let cell = cell.trim().trim_matches('"');
            let Some((whole, fraction)) = cell.split_once(',') else {
                point |= cell.contains('.');
                continue;
            };
            let whole = whole.trim_start_matches(['-', '+']);
            // `1,234` reads as 1234 or as 1.234; `0,234`, `12,3` and `1,5e-3` have one reading.
            let thousands = fraction.len() == 3
                && fraction.bytes().all(|b| b.is_ascii_digit())
                && (1..=3).contains(&whole.len())
                && !whole.starts_with('0');
            if fraction.contains(['.', ',']) || whole.contains('.') {
                doubtful = Some((n as u64 + 1, cell));
                point = true;
            } else if thousands {
                doubtful = doubtful.or(Some((n as u64 + 1, cell)));
            } else {
                certain = true;
            }
        }
    }
    if let Some((line, cell)) = doubtful
        && (point || !certain)
    {
        return Err(Error::log(
            "decimal-mark",
            Place::file(file).line(line),
            format!("`{}`", printable(cell)),
            "this reads as thousands or as a decimal comma; save numbers with a decimal point and no thousands mark",
        ));
    }
    if certain {
        dialect.decimal = ',';
    }
    Ok(dialect)
}
