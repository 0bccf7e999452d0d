//! What exact gradients reach where the paper's method stops.

use crate::error::Error;
use idim_excitation::{
    Criterion, EnergyDesign, PointDesign, PointSearchOptions, Scaling, search_points,
};
use std::ops::ControlFlow;

/// Random starts, and rounds of sixteen disturbed descents: some seconds of work.
const STARTS: usize = 32;
const ROUNDS: usize = 12;
/// `S` of the paper's optimised sequence.
pub(super) const PRINTED_S: f64 = 175.0;

/// Points by exact gradients at the same limits.
#[derive(Debug, Clone)]
pub(super) struct ExactSearches {
    /// With `S` as it comes.
    pub(super) free: PointDesign,
    /// With `S` at most [`PRINTED_S`].
    pub(super) limited: PointDesign,
}

/// Lowers the raw condition number of `n_rows` rows, without and with the limit on `S`.
pub(super) fn exact_searches(
    design: &EnergyDesign,
    n_rows: usize,
    seed: u64,
) -> Result<ExactSearches, Error> {
    let search = |limit_of_equilibrium| {
        let options = PointSearchOptions {
            n_rows,
            criterion: Criterion::TwoNorm(Scaling::Raw),
            limit_of_equilibrium,
            n_starts: STARTS,
            n_rounds: ROUNDS,
            seed,
        };
        search_points(design, &options, &mut |_| ControlFlow::Continue(()))
    };
    Ok(ExactSearches {
        free: search(None)?,
        limited: search(Some(PRINTED_S))?,
    })
}
