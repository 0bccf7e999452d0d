//! What can be wrong with a robot description.

/// A robot that cannot be used, with the place, the value met, the rule broken and the next step.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The description is well formed but no robot can be like that.
    #[error("{place}: {met}; {rule}")]
    Robot {
        /// Joint, link or field.
        place: String,
        /// The value met.
        met: String,
        /// The rule broken and what to do.
        rule: String,
    },
    /// The text of a robot file cannot be read, or describes a robot that cannot be.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was met, what is expected, what to do.
        message: String,
    },
}

impl Error {
    pub(crate) fn robot(
        place: impl Into<String>,
        met: impl Into<String>,
        rule: impl Into<String>,
    ) -> Self {
        Self::Robot {
            place: place.into(),
            met: met.into(),
            rule: rule.into(),
        }
    }

    pub(crate) fn syntax(line: usize, column: usize, message: impl Into<String>) -> Self {
        Self::Syntax {
            line,
            column,
            message: message.into(),
        }
    }

    /// The same finding with its place in the text of the file it came from.
    pub(crate) fn at(self, line: usize, column: usize) -> Self {
        match self {
            Self::Robot { .. } => Self::syntax(line, column, self.to_string()),
            located => located,
        }
    }
}
