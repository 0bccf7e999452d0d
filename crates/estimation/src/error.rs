//! What can be wrong with the data handed to this crate. Fields count from 0; messages, which people read, from 1.

use thiserror::Error;

/// Bad data: the place, the value met, the rule, the next step.
///
/// Numerical outcomes (rank, conditioning, convergence) are fields of the results, never errors.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A row of `[W | y]` holds a NaN or an infinity.
    #[error(
        "row {} of all that were pushed, {place}: {value} is not finite; drop the sample or mend the log", .row + 1
    )]
    NonFinite {
        /// Row counted from 0 over all rows pushed so far.
        row: usize,
        /// Which entry of the row.
        place: Place,
        /// The value met.
        value: f64,
    },
    /// The squares of the entries leave the range of `f64`.
    #[error(
        "the triangle of {n_rows} rows is not finite: entries above 1e150 overflow; rescale columns or observations"
    )]
    Overflow {
        /// Rows folded so far.
        n_rows: usize,
    },
    /// Fewer equations than the question needs.
    #[error(
        "{n_rows} rows for {n_columns} unknowns, at least {needed} needed; record longer or ask for fewer parameters"
    )]
    TooFewRows {
        /// Rows at hand.
        n_rows: usize,
        /// Unknowns.
        n_columns: usize,
        /// Rows the question needs.
        needed: usize,
    },
    /// A covariance matrix is not symmetric.
    #[error(
        "covariance entry ({}, {}) is {value} but its mirror is {mirror}; give a symmetric matrix", .row + 1, .column + 1
    )]
    NotSymmetric {
        /// Row of the entry.
        row: usize,
        /// Column of the entry.
        column: usize,
        /// The entry.
        value: f64,
        /// The entry across the diagonal.
        mirror: f64,
    },
    /// A covariance matrix is not positive definite.
    #[error(
        "the noise covariance is not positive definite: given the joints before it, joint {} has variance {variance}; \
         a joint without noise cannot be weighted: drop its rows or state its noise", .joint + 1
    )]
    NotPositiveDefinite {
        /// Joint counted from 0.
        joint: usize,
        /// Its variance given the joints before it.
        variance: f64,
    },
    /// A standard deviation, level or scale is outside its range.
    #[error("{name} is {value}; it must be {rule}")]
    OutOfRange {
        /// What the number is.
        name: &'static str,
        /// The value met.
        value: f64,
        /// The rule it breaks.
        rule: &'static str,
    },
    /// The prior of a link is no body.
    #[error(
        "the prior of link {} in the list of links cannot be a rigid body: its pseudo-inertia has eigenvalue {eigenvalue}; \
         check mass, centre and triangle inequality, or take the prior from the link's geometry", .link + 1
    )]
    UnphysicalPrior {
        /// Link counted from 0 in the list given.
        link: usize,
        /// Smallest eigenvalue of its pseudo-inertia.
        eigenvalue: f64,
    },
    /// A free standard parameter that no row determines.
    #[error(
        "standard parameter {} is free, and no row determines it; give it a prior or leave it out", .column + 1
    )]
    UndeterminedStandard {
        /// Its column.
        column: usize,
    },
    /// An iterative decomposition did not converge (a singular value decomposition of finite numbers always should).
    #[error(
        "the singular value decomposition of a {n} x {n} triangle did not converge; check the data for extreme values"
    )]
    NoConvergence {
        /// Size of the triangle.
        n: usize,
    },
}

/// An entry of a row of `[W | y]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Column of `W`, counted from 0.
    Column(usize),
    /// The observation `y`.
    Observation,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Column(column) => write!(f, "column {} of W", column + 1),
            Self::Observation => f.write_str("the observation"),
        }
    }
}
