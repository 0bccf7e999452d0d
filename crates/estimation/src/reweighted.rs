//! Fits that contacts, emergency stops and dropped packets do not bend.

use crate::error::Error;
use crate::information::InformationFactor;
use crate::robust::{HUBER_K, RobustLoss, RobustWeights, robust_weights};
use crate::solve::{RankDeficiency, Solution, solve, solve_with_known_noise};
use faer::Mat;

/// Options of [`robust_least_squares`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustOptions {
    /// Loss; Tukey starts from Huber's fit.
    pub loss: RobustLoss,
    /// Re-weighted fits at most, of each loss; 30 typical.
    pub n_iterations: usize,
    /// Stop when no value moves by more than this share of its standard deviation; 1e-3 typical.
    pub tolerance: f64,
}

impl Default for RobustOptions {
    /// Huber at [`HUBER_K`], 30 fits, 1e-3.
    fn default() -> Self {
        Self {
            loss: RobustLoss::Huber { k: HUBER_K },
            n_iterations: 30,
            tolerance: 1e-3,
        }
    }
}

/// Outcome of [`robust_least_squares`].
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub enum RobustSolution {
    /// Every unknown has a value.
    Determined(RobustEstimate),
    /// The columns of `W`, or of what the weights left of it, are dependent.
    RankDeficient(RankDeficiency),
}

/// A fit with weights by residual.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustEstimate {
    /// The values.
    pub values: Vec<f64>,
    /// Standard deviation of each value.
    pub standard_deviation: Vec<f64>,
    /// Huber's covariance of an M-estimate, `K² Σψ²/(m-n) / (mean ψ')² (WᵀS⁻²W)⁻¹` (Huber 1981, 6.8), `S` the joints' scales.
    pub covariance: Mat<f64>,
    /// Weights and scales of the last fit.
    pub weights: RobustWeights,
    /// Re-weighted fits made.
    pub n_iterations: usize,
    /// Largest last move of a value, in standard deviations.
    pub last_change: f64,
    /// Whether `last_change` is below the tolerance.
    pub converged: bool,
}

/// Iteratively re-weighted least squares with one robust scale a joint.
///
/// `visit` as in [`crate::weighted_least_squares`]. One residual a row is kept: 8 bytes a row, the one part of the crate that grows with
/// the log.
///
/// # Errors
/// As [`InformationFactor::push_rows`] and [`solve`]; [`Error::NotPositiveDefinite`] if half of a joint's rows fit exactly.
pub fn robust_least_squares(
    n_columns: usize,
    n_joints: usize,
    options: &RobustOptions,
    mut visit: impl FnMut(&mut dyn FnMut(&[f64], &[f64])),
) -> Result<RobustSolution, Error> {
    let mut plain = InformationFactor::new(n_columns);
    let mut outcome = Ok(());
    visit(&mut |w, y| {
        if outcome.is_ok() {
            outcome = plain.push_rows(w, y);
        }
    });
    outcome?;
    let mut values = match solve(&plain)? {
        Solution::Determined(estimate) => estimate.values,
        Solution::RankDeficient(deficiency) => {
            return Ok(RobustSolution::RankDeficient(deficiency));
        }
    };
    let mut n_iterations = 0;
    let losses = match options.loss {
        RobustLoss::Huber { .. } => vec![options.loss],
        RobustLoss::Tukey { .. } => vec![RobustLoss::Huber { k: HUBER_K }, options.loss],
    };
    let mut last = None;
    for loss in losses {
        for _ in 0..options.n_iterations.max(1) {
            let step = match reweight(&values, n_joints, loss, &mut visit)? {
                Ok(step) => step,
                Err(deficiency) => return Ok(RobustSolution::RankDeficient(deficiency)),
            };
            n_iterations += 1;
            let change = std::iter::zip(&step.values, &values)
                .zip(&step.standard_deviation)
                .map(|((new, old), s)| (new - old).abs() / s)
                .fold(0.0, f64::max);
            values.clone_from(&step.values);
            let converged = change < options.tolerance;
            last = Some(RobustEstimate {
                n_iterations,
                last_change: change,
                converged,
                ..step
            });
            if converged {
                break;
            }
        }
    }
    Ok(last.map_or_else(
        || unreachable!("there is a loss and at least one fit"),
        RobustSolution::Determined,
    ))
}

/// One fit with the weights that the residuals of `values` ask for.
fn reweight(
    values: &[f64],
    n_joints: usize,
    loss: RobustLoss,
    visit: &mut impl FnMut(&mut dyn FnMut(&[f64], &[f64])),
) -> Result<Result<RobustEstimate, RankDeficiency>, Error> {
    let n = values.len();
    let mut residuals = Vec::new();
    visit(&mut |w, y| {
        residuals.extend(y.iter().enumerate().map(|(row, y)| {
            y - std::iter::zip(&w[row * n..][..n], values)
                .map(|(w, x)| w * x)
                .sum::<f64>()
        }));
    });
    let weights = robust_weights(&residuals, n_joints, loss);
    if let Some(joint) = weights.scale.iter().position(|s| *s == 0.0) {
        return Err(Error::NotPositiveDefinite {
            joint,
            variance: 0.0,
        });
    }
    let (mut weighted, mut scaled) = (InformationFactor::new(n), InformationFactor::new(n));
    let (mut row_w, mut row_s) = (vec![0.0; n], vec![0.0; n]);
    let mut at = 0;
    let mut outcome = Ok(());
    visit(&mut |w, y| {
        for (row, y) in w.chunks_exact(n).zip(y) {
            let s = 1.0 / weights.scale[at % n_joints];
            let root = weights.weights[at].sqrt() * s;
            for k in 0..n {
                row_w[k] = row[k] * root;
                row_s[k] = row[k] * s;
            }
            if outcome.is_ok() {
                outcome = weighted
                    .push_rows(&row_w, &[y * root])
                    .and_then(|()| scaled.push_rows(&row_s, &[y * s]));
            }
            at += 1;
        }
    });
    outcome?;
    let fit = match solve(&weighted)?.determined() {
        Ok(fit) => fit,
        Err(deficiency) => return Ok(Err(deficiency)),
    };
    let unit = match solve_with_known_noise(&scaled, 1.0)?.determined() {
        Ok(unit) => unit,
        Err(deficiency) => return Ok(Err(deficiency)),
    };
    let factor = variance_factor(&residuals, &weights, n_joints, loss, n);
    Ok(Ok(RobustEstimate {
        values: fit.values,
        standard_deviation: unit
            .standard_deviation
            .iter()
            .map(|s| s * factor.sqrt())
            .collect(),
        covariance: unit.covariance * faer::Scale(factor),
        weights,
        n_iterations: 0,
        last_change: f64::INFINITY,
        converged: false,
    }))
}

/// What Huber's covariance multiplies `(WᵀS⁻²W)⁻¹` by.
fn variance_factor(
    residuals: &[f64],
    weights: &RobustWeights,
    n_joints: usize,
    loss: RobustLoss,
    n: usize,
) -> f64 {
    let m = residuals.len() as f64;
    let (mut influence, mut slope, mut slope_square) = (0.0, 0.0, 0.0);
    for (row, r) in residuals.iter().enumerate() {
        let u = r / weights.scale[row % n_joints];
        let d = loss.influence_slope(u);
        influence += (u * weights.weights[row]).powi(2);
        slope += d;
        slope_square += d * d;
    }
    let mean = slope / m;
    let variance = slope_square / m - mean * mean;
    let correction = 1.0 + n as f64 / m * variance / (mean * mean);
    correction * correction * influence / (m - n as f64) / (mean * mean)
}
