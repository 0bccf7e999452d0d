//! What chance gives: the condition number of random chains of points (Gautier & Khalil 1991, table 2).

use crate::EnergyDesign;
use crate::criterion::{Criterion, Scaling};
use rayon::prelude::*;

/// Condition numbers (2-norm, raw) over random draws of one length.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionStatistics {
    /// Rows `r` of each draw.
    pub n_rows: usize,
    /// Number of draws.
    pub n_draws: usize,
    /// Smallest.
    pub min: f64,
    /// 5 % quantile.
    pub q05: f64,
    /// Median.
    pub median: f64,
    /// Mean; heavy tailed when `n_rows` is near the number of columns.
    pub mean: f64,
    /// 95 % quantile.
    pub q95: f64,
    /// Largest.
    pub max: f64,
}

/// Statistics of `Cond₂(W)` over `n_draws` random sequences of `n_rows` rows.
///
/// Same numbers for the same seed, whatever the number of threads.
///
/// # Panics
/// If `n_draws` is zero or `n_rows` is below the number of columns.
#[track_caller]
pub fn random_condition_statistics(
    design: &EnergyDesign,
    n_rows: usize,
    n_draws: usize,
    seed: u64,
) -> ConditionStatistics {
    assert!(n_draws > 0, "statistics of no draws");
    let mut values: Vec<f64> = (0..n_draws)
        .into_par_iter()
        .map(|draw| {
            let points = design.random_points(n_rows, seed, draw as u64);
            let w = design.observation_matrix(&points);
            Criterion::TwoNorm(Scaling::Raw).evaluate(w.as_ref(), n_rows)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    // Linear interpolation between order statistics.
    let quantile = |p: f64| {
        let place = p * (n_draws - 1) as f64;
        let (low, part) = (place.floor() as usize, place.fract());
        let high = (low + 1).min(n_draws - 1);
        values[low] + part * (values[high] - values[low])
    };
    ConditionStatistics {
        n_rows,
        n_draws,
        min: values[0],
        q05: quantile(0.05),
        median: quantile(0.5),
        mean: values.iter().sum::<f64>() / n_draws as f64,
        q95: quantile(0.95),
        max: values[n_draws - 1],
    }
}
