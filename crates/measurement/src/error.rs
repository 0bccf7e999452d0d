//! What can be wrong with a log, and where.

use serde::Serialize;
use std::fmt;

/// Where something stands in a log; only what is known is filled in.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Place {
    /// Name of the file.
    pub file: String,
    /// Line, from 1.
    pub line: Option<u64>,
    /// Time on the log's clock, s.
    pub time: Option<f64>,
    /// Header of the column.
    pub column: Option<String>,
    /// Name of the joint.
    pub joint: Option<String>,
}

impl Place {
    /// A whole file.
    pub fn file(file: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            ..Self::default()
        }
    }

    /// The same place, at a line.
    #[must_use]
    pub fn line(mut self, line: u64) -> Self {
        self.line = Some(line);
        self
    }

    /// The same place, at a time (s).
    #[must_use]
    pub fn time(mut self, time: f64) -> Self {
        self.time = Some(time);
        self
    }

    /// The same place, in a column.
    #[must_use]
    pub fn column(mut self, column: impl Into<String>) -> Self {
        self.column = Some(column.into());
        self
    }

    /// The same place, at a joint.
    #[must_use]
    pub fn joint(mut self, joint: impl Into<String>) -> Self {
        self.joint = Some(joint.into());
        self
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&printable(&self.file))?;
        if let Some(line) = self.line {
            write!(f, ", line {line}")?;
        }
        if let Some(column) = &self.column {
            write!(f, ", column {}", printable(column))?;
        }
        if let Some(joint) = &self.joint {
            write!(f, ", joint {}", printable(joint))?;
        }
        if let Some(time) = self.time {
            write!(f, ", t = {time} s")?;
        }
        Ok(())
    }
}

/// A log or a setting that cannot be used: the place, the value met, the rule broken with the next step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The log.
    #[error("{place}: {met}; {rule}")]
    Log {
        /// Short stable name of the rule, `time-order`.
        code: &'static str,
        /// Where.
        place: Box<Place>,
        /// The value met.
        met: String,
        /// The rule broken and what to do.
        rule: String,
    },
    /// A setting that does not fit the data.
    #[error("{setting} {value}: {rule}")]
    Setting {
        /// Which setting.
        setting: &'static str,
        /// Its value.
        value: f64,
        /// The rule broken and what to do.
        rule: String,
    },
}

impl Error {
    pub(crate) fn log(
        code: &'static str,
        place: Place,
        met: impl Into<String>,
        rule: impl Into<String>,
    ) -> Self {
        Self::Log {
            code,
            place: Box::new(place),
            met: met.into(),
            rule: rule.into(),
        }
    }

    pub(crate) fn setting(setting: &'static str, value: f64, rule: impl Into<String>) -> Self {
        Self::Setting {
            setting,
            value,
            rule: rule.into(),
        }
    }

    /// Short stable name of the rule broken: `time-order`, `degrees`, `setting`.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Log { code, .. } => code,
            Self::Setting { .. } => "setting",
        }
    }
}

/// Longest text quoted from a file.
const QUOTE_LIMIT: usize = 60;

/// Text from a file made fit for a message: control characters escaped, cut at 60 characters.
pub(crate) fn printable(text: &str) -> String {
    let mut out = String::new();
    for (n, c) in text.chars().enumerate() {
        if n == QUOTE_LIMIT {
            out.push('…');
            break;
        }
        if c.is_control() {
            out.extend(c.escape_debug());
        } else {
            out.push(c);
        }
    }
    out
}

/// The candidates nearest to a word by edit distance, at most three, none farther than half its length.
pub(crate) fn closest<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Vec<&'a str> {
    let word = word.to_lowercase();
    let mut near: Vec<_> = candidates
        .into_iter()
        .map(|c| (edit_distance(&word, &c.to_lowercase()), c))
        .filter(|(d, c)| 2 * d <= word.chars().count().max(c.chars().count()))
        .collect();
    near.sort_unstable();
    near.into_iter().take(3).map(|(_, c)| c).collect()
}

fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().take(QUOTE_LIMIT).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().take(QUOTE_LIMIT).enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let change = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = change.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}
