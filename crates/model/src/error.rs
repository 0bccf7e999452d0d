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
    /// The text of a robot file cannot be read.
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
}
