//! Errors on blocks held out, comparable between ways to make the same samples.

use crate::error::Error;
use crate::fit::{factor_of_used, only};
use crate::samples::Rows;
use idim_base_params::{ReductionOptions, TriangularFactor, reduce};
use idim_estimation::{InformationFactor, Solution, solve};

/// Blocks of consecutive samples: enough for their scatter to say how sure an error is.
pub(crate) const BLOCKS: usize = 20;
/// Parts that are held out in turn, each of every fifth block: what is left moves as all of it does.
const FOLDS: usize = 5;
/// A joint that is fitted exactly has this share of its torque as residual.
const EXACT: f64 = 1e-9;
/// Rows folded at a time: they stay in cache.
const FOLDED_ROWS: usize = 256;

/// Rows that all others are compared with: the columns they determine, and how large each joint's residual is.
pub(crate) struct Reference {
    n_joints: usize,
    /// Columns that are determined.
    kept: Vec<usize>,
    /// Standard deviation of each joint's residual, N·m.
    sigma: Vec<f64>,
    /// Rows that train and are judged.
    used: Vec<bool>,
    /// `Σ (y/σ)²` over these rows.
    total: f64,
}

/// Squared errors on each block.
pub(crate) type BlockErrors = Vec<f64>;

impl Reference {
    /// Of these rows, those that are used. `None` where they determine nothing.
    pub(crate) fn new(rows: &Rows, n_joints: usize) -> Result<Option<Self>, Error> {
        let p = rows.w.len().checked_div(rows.y.len()).unwrap_or(0);
        let used = rows.used.iter().filter(|u| **u).count();
        if p == 0 || used <= p || rows.y.len() / n_joints < BLOCKS {
            return Ok(None);
        }
        let mut kept: Vec<usize> = (0..p).collect();
        let mut solution = solve(&factor_of_used(rows, n_joints)?)?;
        if matches!(solution, Solution::RankDeficient(_)) {
            let mut factor = TriangularFactor::new(p);
            for (row, _) in rows.w.chunks_exact(p).zip(&rows.used).filter(|(_, u)| **u) {
                factor.push_rows(row);
            }
            kept = reduce(&factor, &kept, &ReductionOptions::default()).base;
            if kept.is_empty() {
                return Ok(None);
            }
            solution = solve(&factor_of_used(&only(rows, p, &kept), n_joints)?)?;
        }
        let Solution::Determined(estimate) = solution else {
            return Ok(None);
        };
        let (mut residual, mut torque) = (vec![0.0; n_joints], vec![0.0; n_joints]);
        let mut counts = vec![0.0_f64; n_joints];
        for (row, w) in rows.w.chunks_exact(p).enumerate() {
            if rows.used[row] {
                let joint = row % n_joints;
                let predicted: f64 = kept
                    .iter()
                    .zip(&estimate.values)
                    .map(|(&k, x)| w[k] * x)
                    .sum();
                residual[joint] += (rows.y[row] - predicted).powi(2);
                torque[joint] += rows.y[row].powi(2);
                counts[joint] += 1.0;
            }
        }
        let sigma: Vec<f64> = (0..n_joints)
            .map(|j| {
                let square = residual[j].max(EXACT * EXACT * torque[j]) / counts[j].max(1.0);
                if square > 0.0 { square.sqrt() } else { 1.0 }
            })
            .collect();
        let total = (0..rows.y.len())
            .filter(|&row| rows.used[row])
            .map(|row| (rows.y[row] / sigma[row % n_joints]).powi(2))
            .sum();
        Ok(Some(Self {
            n_joints,
            kept,
            sigma,
            used: rows.used.clone(),
            total,
        }))
    }

    /// Squared errors of rows on each block, predicted from the other parts; of the samples that the reference uses.
    ///
    /// `None` where those do not determine the columns, or the rows are of other samples.
    pub(crate) fn errors(&self, rows: &Rows) -> Result<Option<BlockErrors>, Error> {
        let n_samples = rows.y.len() / self.n_joints;
        let p = rows.w.len().checked_div(rows.y.len()).unwrap_or(0);
        if rows.y.len() != self.used.len() {
            return Ok(None);
        }
        let block = |sample: usize| sample * BLOCKS / n_samples;
        let mut parts = Vec::new();
        for fold in 0..FOLDS {
            let mut factor = InformationFactor::new(self.kept.len());
            let (mut w, mut y) = (Vec::new(), Vec::new());
            for sample in (0..n_samples).filter(|&s| block(s) % FOLDS == fold) {
                for joint in 0..self.n_joints {
                    let row = sample * self.n_joints + joint;
                    if self.used[row] {
                        let scale = 1.0 / self.sigma[joint];
                        w.extend(self.kept.iter().map(|&k| scale * rows.w[row * p + k]));
                        y.push(scale * rows.y[row]);
                    }
                }
                if y.len() >= FOLDED_ROWS {
                    factor.push_rows(&w, &y)?;
                    w.clear();
                    y.clear();
                }
            }
            factor.push_rows(&w, &y)?;
            parts.push(factor);
        }
        let mut squares = vec![0.0; BLOCKS];
        for fold in 0..FOLDS {
            let mut others = InformationFactor::new(self.kept.len());
            for part in (0..FOLDS).filter(|&k| k != fold) {
                others.merge(&parts[part]);
            }
            if others.n_rows() <= self.kept.len() {
                return Ok(None);
            }
            let Solution::Determined(estimate) = solve(&others)? else {
                return Ok(None);
            };
            for sample in (0..n_samples).filter(|&s| block(s) % FOLDS == fold) {
                for joint in 0..self.n_joints {
                    let row = sample * self.n_joints + joint;
                    if self.used[row] {
                        let entries = self.kept.iter().map(|&k| rows.w[row * p + k]);
                        let predicted: f64 =
                            entries.zip(&estimate.values).map(|(w, x)| w * x).sum();
                        squares[block(sample)] +=
                            ((rows.y[row] - predicted) / self.sigma[joint]).powi(2);
                    }
                }
            }
        }
        Ok(Some(squares))
    }

    /// `√(Σ e²/σ²) / √(Σ y²/σ²)`.
    pub(crate) fn relative(&self, errors: &BlockErrors) -> f64 {
        (errors.iter().sum::<f64>() / self.total).sqrt()
    }
}

/// The first candidate whose error is within one standard error of the least, and the one of the least.
///
/// The standard error is that of the difference between the two, over the blocks: what makes a block hard is the same for both.
/// Source: Breiman, Friedman, Olshen & Stone 1984, for the rule.
pub(crate) fn first_within_one_error(candidates: &[Option<BlockErrors>]) -> Option<(usize, usize)> {
    let total = |errors: &BlockErrors| errors.iter().sum::<f64>();
    let known = || {
        let all = candidates.iter().enumerate();
        all.filter_map(|(k, errors)| Some((k, errors.as_ref()?)))
    };
    let (least, best) = known().min_by(|a, b| total(a.1).total_cmp(&total(b.1)))?;
    let within = |errors: &BlockErrors| {
        let n = errors.len() as f64;
        let differences: Vec<f64> = std::iter::zip(errors, best).map(|(a, b)| a - b).collect();
        let mean = differences.iter().sum::<f64>() / n;
        let square: f64 = differences.iter().map(|d| (d - mean).powi(2)).sum();
        mean <= (square / (n - 1.0) / n).sqrt()
    };
    let first = known().find(|(_, errors)| within(errors))?.0;
    Some((first, least))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn identity_the_first_within_one_standard_error_is_taken() {
        // Differences to the least: 4 ± 0.58, 0.5 ± 0.29 and 0.25 ± 0.25 on four blocks.
        let far = Some(vec![5.0, 7.0, 6.0, 6.0]);
        let near = Some(vec![2.0, 3.0, 3.0, 2.0]);
        let close = Some(vec![3.0, 2.0, 2.0, 2.0]);
        let best = Some(vec![2.0, 2.0, 2.0, 2.0]);
        let all = [
            None,
            far.clone(),
            near.clone(),
            close,
            best.clone(),
            far.clone(),
        ];
        assert_eq!(first_within_one_error(&all), Some((3, 4)));
        assert_eq!(
            first_within_one_error(&[far, None, near, best]),
            Some((3, 3))
        );
        assert_eq!(first_within_one_error(&[None, None]), None);
    }

    #[test]
    fn identity_exact_rows_have_no_error_and_noisy_columns_have_more() {
        // y = 2 a - b on two joints; the second set of columns is off by an alternating tenth.
        let (mut exact, mut noisy) = (Rows::default(), Rows::default());
        for k in 0..400 {
            let t = f64::from(k) * 0.1;
            let (a, b) = (t.sin(), (1.7 * t).cos());
            let off = if k % 4 < 2 { 0.1 } else { -0.1 };
            for (rows, off) in [(&mut exact, 0.0), (&mut noisy, off)] {
                rows.w.extend([a + off, b]);
                rows.y.push(2.0 * a - b);
                rows.used.push(k % 7 != 0);
            }
        }
        let reference = Reference::new(&noisy, 2).unwrap().unwrap();
        let error = |rows: &Rows| {
            let errors = reference.errors(rows).unwrap().unwrap();
            reference.relative(&errors)
        };
        assert!(error(&exact) < 1e-12, "{}", error(&exact));
        // 2 · 0.1 beside √(2² + 1)/√2, somewhat more for not having been seen.
        let expected = 0.2 / 2.5_f64.sqrt();
        assert!(
            (error(&noisy) / expected - 1.0).abs() < 0.1,
            "{}",
            error(&noisy)
        );
    }
}
