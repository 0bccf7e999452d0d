//! What RON says about a text, in words that lead on; and where in the text a joint stands.

use crate::error::Error;
use crate::suggestion::did_you_mean;
use ron::error::{Error as Ron, SpannedError};

/// Where the format is described.
const REFERENCE: &str = "docs/robot-file.md describes the format";
/// For those who know modified DH from Craig's book.
const KHALIL: &str = "d is the distance along x (Craig's a), r the one along z (Craig's d)";

/// The line and column of what cannot be read, what is allowed there, and the nearest word that is.
pub(super) fn from_ron(error: &SpannedError) -> Error {
    let inside =
        |outer: &Option<String>| outer.as_ref().map_or(String::new(), |o| format!(" in {o}"));
    let (what, next) = match &error.code {
        Ron::NoSuchStructField {
            found,
            outer: Some(outer),
            ..
        } if outer == "ModifiedDh" && found == "a" => {
            (format!("there is no field a in {outer}"), KHALIL.to_owned())
        }
        Ron::NoSuchStructField {
            expected,
            found,
            outer,
        } => {
            let met = format!("there is no field {found}{}", inside(outer));
            (met, did_you_mean(found, expected.iter().copied()))
        }
        Ron::NoSuchEnumVariant {
            expected,
            found,
            outer,
        } => {
            let met = format!("{found} is not a choice{}", inside(outer));
            (met, did_you_mean(found, expected.iter().copied()))
        }
        Ron::MissingStructField { field, outer } => {
            let met = format!("the field {field} is missing{}", inside(outer));
            (met, example(field).to_owned())
        }
        Ron::DuplicateStructField { field, outer } => {
            let met = format!("the field {field} stands twice{}", inside(outer));
            (met, "leave one".to_owned())
        }
        Ron::Message(text) => (text.clone(), REFERENCE.to_owned()),
        Ron::Eof => (
            "the text ends too early".to_owned(),
            "is a bracket left open?".to_owned(),
        ),
        other => (first_lower(&other.to_string()), REFERENCE.to_owned()),
    };
    let (line, column) = position(error);
    Error::syntax(line, column, format!("{what}; {next}"))
}

/// RON stops behind the word it does not know, and before the value it cannot use.
fn position(error: &SpannedError) -> (usize, usize) {
    let (start, end) = (error.span.start, error.span.end);
    match &error.code {
        Ron::Message(_) => (start.line, start.col),
        Ron::NoSuchStructField { found, .. } | Ron::NoSuchEnumVariant { found, .. } => (
            end.line,
            end.col.saturating_sub(found.chars().count()).max(1),
        ),
        _ => (end.line, end.col),
    }
}

/// What to write for a field that has no default.
fn example(field: &str) -> &'static str {
    match field {
        "gravity" => "in the base frame, m/s², for example gravity: (0, 0, -9.81)",
        "angles" => "add angles: Degrees or angles: Radians, for the whole file",
        "joints" => "add joints: ModifiedDh([..]), StandardDh([..]) or Poses([..])",
        "frame" => "say where the joint stands, for example frame: (alpha: 90, d: 0.5)",
        "name" => "add name: \"..\"",
        _ => REFERENCE,
    }
}

fn first_lower(text: &str) -> String {
    let mut characters = text.chars();
    let first = characters.next().map(char::to_lowercase);
    first.into_iter().flatten().chain(characters).collect()
}

/// Finds the joints of a file in its text, in order: RON keeps no positions of what it could read.
pub(super) struct Places<'a> {
    text: &'a str,
    from: usize,
}

impl<'a> Places<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { text, from: 0 }
    }

    /// Line and column of the next `name: "…"` with this name; where the search stands if there is none.
    pub(super) fn next_name(&mut self, name: &str) -> (usize, usize) {
        let quoted = format!("{name:?}");
        let mut search = self.from;
        while let Some(found) = self.text[search..].find(&quoted).map(|at| search + at) {
            search = found + quoted.len();
            let before = self.text[..found].trim_end();
            let key = before.strip_suffix(':').map(str::trim_end);
            if key.is_some_and(|k| k.ends_with("name")) {
                self.from = search;
                return line_and_column(self.text, found);
            }
        }
        line_and_column(self.text, self.from)
    }
}

fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = &text[..at];
    let line = 1 + before.matches('\n').count();
    let column = 1 + before.chars().rev().take_while(|&c| c != '\n').count();
    (line, column)
}
