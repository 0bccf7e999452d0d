//! The parameters a log can do without.

use crate::error::Error;
use crate::information::InformationFactor;
use crate::quantile::f_quantile;
use crate::solve::{Estimate, RankDeficiency, Solution, solve};

/// Options of [`essential_parameters`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EssentialOptions {
    /// Only parameters with a relative standard deviation above this may be dropped; 0.1 to 0.3 typical.
    pub relative_std: f64,
    /// Level of the F-test and of the intervals stated for what is dropped; 0.95 typical.
    pub level: f64,
}

impl Default for EssentialOptions {
    /// 0.3 and 0.95.
    fn default() -> Self {
        Self {
            relative_std: 0.3,
            level: 0.95,
        }
    }
}

/// Outcome of [`essential_parameters`].
#[derive(Debug, Clone, PartialEq)]
pub struct EssentialParameters {
    /// Columns kept, ascending.
    pub kept: Vec<usize>,
    /// The fit of the kept columns alone.
    pub estimate: Estimate,
    /// The columns left out, in the order they went. Their parameters are unknown within the interval, not zero.
    pub dropped: Vec<DroppedParameter>,
    /// Increase of the residual by all that was dropped, as Fisher's F against the full fit; 0 when nothing was.
    pub f_statistic: f64,
    /// The quantile that `f_statistic` stays below.
    pub f_limit: f64,
}

/// A parameter that the residual does not miss.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DroppedParameter {
    /// Its column.
    pub column: usize,
    /// Value in the full fit.
    pub value: f64,
    /// Interval of the full fit at the level asked for.
    pub interval: [f64; 2],
    /// Relative standard deviation at the moment it went.
    pub relative_std: f64,
}

/// Drops parameters one at a time, the least certain first, as long as the residual does not notice.
///
/// A column goes if its relative standard deviation is above the limit and the F-test of everything dropped so far, against the full
/// fit, accepts: `F = (‖ρ_e‖² - ‖ρ‖²)/(b - b_e) / (‖ρ‖²/(m - b))` below its quantile. When the test protects the least certain column the next one
/// is tried. Rows should be whitened first. `Err` of the inner result: the full `W` is rank-deficient.
/// Source: Gautier 1997; Pham & Gautier 1991.
///
/// # Errors
/// As [`solve`]; [`Error::OutOfRange`] for a level outside (0, 1).
pub fn essential_parameters(
    factor: &InformationFactor,
    options: &EssentialOptions,
) -> Result<Result<EssentialParameters, RankDeficiency>, Error> {
    if !(options.level > 0.0 && options.level < 1.0) {
        return Err(Error::OutOfRange {
            name: "the level of the F-test",
            value: options.level,
            rule: "inside (0, 1)",
        });
    }
    let full = match solve(factor)? {
        Solution::Determined(estimate) => estimate,
        Solution::RankDeficient(deficiency) => return Ok(Err(deficiency)),
    };
    let mut out = EssentialParameters {
        kept: (0..factor.n_columns()).collect(),
        estimate: full.clone(),
        dropped: Vec::new(),
        f_statistic: 0.0,
        f_limit: f64::INFINITY,
    };
    while let Some(next) = drop_one(factor, options, &full, &out)? {
        out = next;
    }
    Ok(Ok(out))
}

/// The state with one column fewer, if any column may go.
fn drop_one(
    factor: &InformationFactor,
    options: &EssentialOptions,
    full: &Estimate,
    now: &EssentialParameters,
) -> Result<Option<EssentialParameters>, Error> {
    let mut candidates: Vec<usize> = (0..now.kept.len())
        .filter(|&i| now.estimate.relative_std[i] > options.relative_std)
        .collect();
    candidates
        .sort_by(|&a, &b| now.estimate.relative_std[b].total_cmp(&now.estimate.relative_std[a]));
    let n_dropped = (now.dropped.len() + 1) as f64;
    let f_limit = f_quantile(options.level, n_dropped, full.degrees_of_freedom as f64);
    for i in candidates {
        let column = now.kept[i];
        let kept: Vec<usize> = now.kept.iter().copied().filter(|&k| k != column).collect();
        let Solution::Determined(estimate) = solve(&factor.select(&kept))? else {
            continue;
        };
        let increase = (estimate.residual_norm.powi(2) - full.residual_norm.powi(2)) / n_dropped;
        let f_statistic = increase / full.sigma.powi(2);
        if f_statistic < f_limit {
            let mut dropped = now.dropped.clone();
            dropped.push(DroppedParameter {
                column,
                value: full.values[column],
                interval: full.confidence_interval(column, options.level),
                relative_std: now.estimate.relative_std[i],
            });
            return Ok(Some(EssentialParameters {
                kept,
                estimate,
                dropped,
                f_statistic,
                f_limit,
            }));
        }
    }
    Ok(None)
}
