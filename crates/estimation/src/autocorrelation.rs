//! Residuals that follow each other: filtered or sampled faster than the noise changes.
//!
//! Least squares believes every row. When neighbours repeat each other the stated deviations are too small by `√(N/N_eff)`; the sandwich of
//! block scores is right without a model of the noise.

use crate::error::Error;
use crate::information::InformationFactor;
use crate::quantile::chi_square_quantile;

/// Autocorrelation of a series at lags 1 to `n_lags`, about its mean; not a number for a constant series.
///
/// # Panics
/// If there are not more values than lags.
#[track_caller]
pub fn autocorrelation(series: &[f64], n_lags: usize) -> Vec<f64> {
    let n = series.len();
    assert!(n > n_lags, "{n} values for {n_lags} lags");
    let centred = centre(series);
    let variance = product(&centred, 0);
    (1..=n_lags)
        .map(|lag| product(&centred, lag) / variance)
        .collect()
}

fn centre(series: &[f64]) -> Vec<f64> {
    let mean = series.iter().sum::<f64>() / series.len() as f64;
    series.iter().map(|v| v - mean).collect()
}

/// Sum of products of the series with itself `lag` places on.
fn product(centred: &[f64], lag: usize) -> f64 {
    std::iter::zip(centred, &centred[lag..])
        .map(|(a, b)| a * b)
        .sum()
}

/// How many independent values the mean of a series is worth, `N / (1 + 2 Σ ρ_k)`.
///
/// The sum stops where two neighbouring autocorrelations no longer add to a positive number (Geyer 1992), at a tenth of the length at
/// most; never more than `N`.
///
/// # Panics
/// If the series is empty.
#[track_caller]
pub fn effective_sample_size(series: &[f64]) -> f64 {
    let n = series.len();
    assert!(n > 0, "an empty series");
    let centred = centre(series);
    let variance = product(&centred, 0);
    let mut sum = 0.0;
    // Geyer's first pair is lags 0 and 1; here it is 1 and 2: one lag late, on the careful side.
    for lag in (1..n / 10).step_by(2) {
        let pair = (product(&centred, lag) + product(&centred, lag + 1)) / variance;
        if lag > 1 && pair <= 0.0 {
            break;
        }
        sum += pair;
    }
    n as f64 / (1.0 + 2.0 * sum.max(0.0))
}

/// The test of Ljung and Box for white residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LjungBox {
    /// `N (N + 2) Σ ρ_k²/(N - k)`.
    pub statistic: f64,
    /// The quantile of χ² with as many degrees of freedom as lags.
    pub limit: f64,
    /// Whether the statistic stays below.
    pub white: bool,
}

/// Tests residuals for autocorrelation up to `n_lags` at a level (0.95 typical).
///
/// Source: Ljung & Box 1978.
///
/// # Panics
/// If there are not more values than lags, no lag, or `level` is not inside (0, 1).
#[track_caller]
pub fn ljung_box(residuals: &[f64], n_lags: usize, level: f64) -> LjungBox {
    let n = residuals.len() as f64;
    let sum: f64 = autocorrelation(residuals, n_lags)
        .iter()
        .enumerate()
        .map(|(k, rho)| rho * rho / (n - (k + 1) as f64))
        .sum();
    let statistic = n * (n + 2.0) * sum;
    let limit = chi_square_quantile(level, n_lags as f64);
    LjungBox {
        statistic,
        limit,
        white: statistic < limit,
    }
}

/// The inner factor of [`crate::sandwich_covariance`] for noise correlated over time and joints: one row `Σ W_tᵀ r_t` a block of
/// consecutive samples.
///
/// Blocks must be several times longer than the noise remembers, and many (50 or more): the covariance then holds without a model
/// of the noise. One sample a block allows any covariance between joints but none over time (White 1980).
#[derive(Debug, Clone)]
pub struct BlockScores {
    rows_per_block: usize,
    n_rows: usize,
    score: Vec<f64>,
    meat: InformationFactor,
}

impl BlockScores {
    /// No row yet; `rows_per_block` is samples times joints.
    ///
    /// # Panics
    /// If `rows_per_block` is zero.
    #[track_caller]
    pub fn new(n_columns: usize, rows_per_block: usize) -> Self {
        assert!(rows_per_block > 0, "blocks of no rows");
        Self {
            rows_per_block,
            n_rows: 0,
            score: vec![0.0; n_columns],
            meat: InformationFactor::new(n_columns),
        }
    }

    /// Adds rows in the order of time; `values` are the parameters of the fit.
    ///
    /// # Errors
    /// [`Error::NonFinite`].
    ///
    /// # Panics
    /// If the lengths do not agree.
    #[track_caller]
    pub fn push_rows(&mut self, w: &[f64], y: &[f64], values: &[f64]) -> Result<(), Error> {
        let n = self.score.len();
        assert_eq!(values.len(), n, "{} values for {n} columns", values.len());
        assert_eq!(
            w.len(),
            y.len() * n,
            "{} entries of W for {} rows of {n}",
            w.len(),
            y.len()
        );
        for (row, y) in w.chunks_exact(n).zip(y) {
            let residual = y - std::iter::zip(row, values).map(|(w, x)| w * x).sum::<f64>();
            for (score, w) in self.score.iter_mut().zip(row) {
                *score += w * residual;
            }
            self.n_rows += 1;
            if self.n_rows.is_multiple_of(self.rows_per_block) {
                self.meat.push_rows(&self.score, &[0.0])?;
                self.score.fill(0.0);
            }
        }
        Ok(())
    }

    /// The factor, the last block included though it may be short.
    ///
    /// # Errors
    /// [`Error::NonFinite`].
    pub fn meat(&self) -> Result<InformationFactor, Error> {
        let mut meat = self.meat.clone();
        meat.push_rows(&self.score, &[0.0])?;
        Ok(meat)
    }
}
