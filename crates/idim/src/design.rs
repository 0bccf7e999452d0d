//! Motions designed by the pipeline.

use crate::error::Error;
use idim_excitation::{Criterion, FourierOptions, Scaling, optimise_fourier};
use idim_model::{Columns, Model, Robot};
use idim_trajectory::{FourierSeries, Limits};

/// Period of a designed motion, s, that of the CRS A460's experiments.
const PERIOD: f64 = 10.0;
/// Harmonics of a designed motion, as there.
const HARMONICS: usize = 5;

/// Searches of a round, and rounds after the first: a few seconds of work.
const N_STARTS: usize = 8;
const N_ROUNDS: usize = 3;

/// A motion of small raw condition number, certified within the limits.
///
/// # Errors
/// Limits that leave no room.
pub(crate) fn motion_for(
    robot: &Robot,
    columns: &Columns,
    limits: &Limits,
    seed: u64,
) -> Result<FourierSeries, Error> {
    let options = FourierOptions {
        period: PERIOD,
        n_harmonics: HARMONICS,
        criterion: Criterion::TwoNorm(Scaling::Raw),
        n_starts: N_STARTS,
        n_rounds: N_ROUNDS,
        seed,
        ..FourierOptions::default()
    };
    Ok(optimise_fourier(&Model::new(robot), columns, limits, &options)?.series)
}
