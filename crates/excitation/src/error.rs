//! What can be wrong with a question put to this crate.

/// A design that cannot be started, with the place, the value met, the rule broken and the next step.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Limits, columns or options that contradict the robot or each other.
    #[error("{place}: {met}; {rule}")]
    Input {
        /// Limit, column or option.
        place: String,
        /// The value met.
        met: String,
        /// The rule broken and what to do.
        rule: String,
    },
    /// No motion inside the limits was found and certified.
    #[error("no motion certified inside the limits after {starts} starts; {rule}")]
    NoFeasibleMotion {
        /// Starts tried.
        starts: usize,
        /// What to do.
        rule: String,
    },
}

impl Error {
    pub(crate) fn input(
        place: impl Into<String>,
        met: impl Into<String>,
        rule: impl Into<String>,
    ) -> Self {
        Self::Input {
            place: place.into(),
            met: met.into(),
            rule: rule.into(),
        }
    }
}
