//! Weighted least squares with the noise of the joints estimated from their residuals.

use crate::error::Error;
use crate::information::{InformationFactor, visit_dense};
use crate::noise::{NoiseCovariance, ResidualCovariance};
use crate::solve::{Estimate, RankDeficiency, Solution, solve};
use faer::MatRef;

/// Which part of the residual covariance weights the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Weighting {
    /// One variance a joint (Gautier & Poignet 2001).
    Diagonal,
    /// Variances and correlations between the joints of one sample.
    #[default]
    Full,
}

/// Options of [`weighted_least_squares`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightingOptions {
    /// Which part of the covariance is used.
    pub weighting: Weighting,
    /// Weighted fits at most; 1 is the classic two-step method, 3 to 10 typical when iterated.
    pub n_iterations: usize,
    /// Stop when the covariance changes by less than this share (Frobenius norm); 1e-2 typical.
    pub tolerance: f64,
}

impl Default for WeightingOptions {
    /// Full covariance, up to 10 fits, 1e-2.
    fn default() -> Self {
        Self {
            weighting: Weighting::Full,
            n_iterations: 10,
            tolerance: 1e-2,
        }
    }
}

/// Outcome of [`weighted_least_squares`].
#[derive(Debug, Clone, PartialEq)]
#[must_use]
#[expect(
    clippy::large_enum_variant,
    reason = "one value a fit, never stored in bulk"
)]
pub enum WeightedSolution {
    /// Every unknown has a value.
    Determined(WeightedEstimate),
    /// The columns of `W` are dependent.
    RankDeficient(RankDeficiency),
}

/// A weighted fit and what it was weighted with.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightedEstimate {
    /// The fit of the whitened rows: its sigma is near 1 and its condition number is that of the weighted problem.
    pub estimate: Estimate,
    /// The ordinary fit it started from; its condition number is that of `W`.
    pub ordinary: Estimate,
    /// The covariance the rows of `estimate` were whitened with, in units of the observations squared.
    pub noise: NoiseCovariance,
    /// Weighted fits made.
    pub n_iterations: usize,
    /// Share by which the covariance of the residuals still differs from `noise`.
    pub last_change: f64,
    /// Whether `last_change` is below the tolerance.
    pub converged: bool,
}

/// Ordinary least squares, then weighted with the covariance of the residuals, iterated.
///
/// `visit` hands all rows to its argument, in blocks of whole samples (`row = sample · n_joints + joint`, row-major), the same at each
/// call; it is called `2 + 2 n_iterations` times at most. `W` is never stored.
/// Sources: Gautier & Poignet 2001 (one variance a joint); Zellner 1962 (full covariance, iterated).
///
/// # Errors
/// As [`InformationFactor::push_rows`], [`solve`] and [`ResidualCovariance::full`].
#[track_caller]
pub fn weighted_least_squares(
    n_columns: usize,
    n_joints: usize,
    options: &WeightingOptions,
    mut visit: impl FnMut(&mut dyn FnMut(&[f64], &[f64])),
) -> Result<WeightedSolution, Error> {
    let ordinary = match solve(&stream(n_columns, None, &mut visit)?)? {
        Solution::Determined(estimate) => estimate,
        Solution::RankDeficient(deficiency) => {
            return Ok(WeightedSolution::RankDeficient(deficiency));
        }
    };
    let mut noise = residual_noise(&ordinary.values, n_joints, options.weighting, &mut visit)?;
    let mut n_iterations = 0;
    loop {
        let estimate = match solve(&stream(n_columns, Some(&noise), &mut visit)?)? {
            Solution::Determined(estimate) => estimate,
            Solution::RankDeficient(deficiency) => {
                return Ok(WeightedSolution::RankDeficient(deficiency));
            }
        };
        n_iterations += 1;
        let next = residual_noise(&estimate.values, n_joints, options.weighting, &mut visit)?;
        let last_change =
            (next.covariance() - noise.covariance()).norm_l2() / noise.covariance().norm_l2();
        let converged = last_change < options.tolerance;
        if converged || n_iterations >= options.n_iterations {
            return Ok(WeightedSolution::Determined(WeightedEstimate {
                estimate,
                ordinary,
                noise,
                n_iterations,
                last_change,
                converged,
            }));
        }
        noise = next;
    }
}

/// [`weighted_least_squares`] of a dense `W` (`m × n`, rows sample by sample) and `y`.
///
/// # Errors
/// As [`weighted_least_squares`].
///
/// # Panics
/// If the rows are not whole samples.
#[track_caller]
pub fn weighted_least_squares_dense(
    w: MatRef<'_, f64>,
    y: &[f64],
    n_joints: usize,
    options: &WeightingOptions,
) -> Result<WeightedSolution, Error> {
    assert_eq!(
        y.len() % n_joints,
        0,
        "{} rows are not whole samples of {n_joints} joints",
        y.len()
    );
    // About 256 rows at a time stay in cache.
    let block_rows = n_joints * 256_usize.div_ceil(n_joints);
    weighted_least_squares(w.ncols(), n_joints, options, |sink| {
        let delivered = visit_dense(w, y, block_rows, |w, y| {
            sink(w, y);
            Ok(())
        });
        debug_assert_eq!(delivered, Ok(()));
    })
}

/// Folds all rows, whitened if a covariance is given.
fn stream(
    n_columns: usize,
    noise: Option<&NoiseCovariance>,
    visit: &mut impl FnMut(&mut dyn FnMut(&[f64], &[f64])),
) -> Result<InformationFactor, Error> {
    let mut factor = InformationFactor::new(n_columns);
    let mut outcome = Ok(());
    let (mut whitened_w, mut whitened_y) = (Vec::new(), Vec::new());
    visit(&mut |w, y| {
        if outcome.is_err() {
            return;
        }
        outcome = match noise {
            None => factor.push_rows(w, y),
            Some(noise) => {
                whitened_w.clear();
                whitened_w.extend_from_slice(w);
                whitened_y.clear();
                whitened_y.extend_from_slice(y);
                noise.whiten(&mut whitened_w, &mut whitened_y);
                factor.push_rows(&whitened_w, &whitened_y)
            }
        };
    });
    outcome.map(|()| factor)
}

fn residual_noise(
    values: &[f64],
    n_joints: usize,
    weighting: Weighting,
    visit: &mut impl FnMut(&mut dyn FnMut(&[f64], &[f64])),
) -> Result<NoiseCovariance, Error> {
    let mut residuals = ResidualCovariance::new(n_joints);
    visit(&mut |w, y| residuals.push_rows(w, y, values));
    match weighting {
        Weighting::Full => residuals.full(values.len()),
        Weighting::Diagonal => residuals.diagonal(values.len()),
    }
}
