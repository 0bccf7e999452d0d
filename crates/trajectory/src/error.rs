//! What can be wrong with limits, a series, a path or a trajectory file.

/// Data that make no motion, with the place, the value met, the rule broken and the next step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A limit that cannot be one.
    #[error("{place}: {met}; {rule}")]
    Limit {
        /// Joint (numbered from 1) and limit.
        place: String,
        /// The value met.
        met: String,
        /// The rule broken and what to do.
        rule: &'static str,
    },
    /// The robot's description lacks a limit that every motion needs.
    #[error(
        "joint {joint}: no {limit} limit in the robot's description; add it to the limits of this joint in the \
         robot file, or give all limits yourself"
    )]
    MissingLimit {
        /// Name of the joint.
        joint: String,
        /// Position, velocity or acceleration.
        limit: &'static str,
    },
    /// Coefficients, points or durations that define no motion.
    #[error("{place}: {met}; {rule}")]
    Motion {
        /// Joint, harmonic, point or segment (numbered from 1).
        place: String,
        /// The value met.
        met: String,
        /// The rule broken and what to do.
        rule: &'static str,
    },
    /// A point passes faster than the path is allowed to move: no duration helps.
    #[error(
        "point {point}, joint {joint}: speed {speed} above the path's limit {limit}; lower the velocity limits of \
         the points or raise those of the path"
    )]
    PointTooFast {
        /// Point, from 1.
        point: usize,
        /// Joint, from 1.
        joint: usize,
        /// Its speed, rad/s (m/s).
        speed: f64,
        /// The path's limit, rad/s (m/s).
        limit: f64,
    },
    /// The text of a trajectory file cannot be read.
    #[error("line {line}, column {column}: {message}")]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was met.
        message: String,
    },
}

impl Error {
    pub(crate) fn motion(
        place: impl Into<String>,
        met: impl Into<String>,
        rule: &'static str,
    ) -> Self {
        Self::Motion {
            place: place.into(),
            met: met.into(),
            rule,
        }
    }
}
