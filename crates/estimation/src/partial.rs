//! Weighted and robust least squares of rows some of which are left out: joints that stand still, contacts.

use crate::autocorrelation::effective_sample_size;
use crate::error::Error;
use crate::information::InformationFactor;
use crate::jackknife::BlockJackknife;
use crate::noise::NoiseCovariance;
use crate::quantile::student_t_quantile;
use crate::robust::{HUBER_K, MAD_TO_SIGMA, RobustLoss};
use crate::solve::{Estimate, RankDeficiency, Solution, solve};
use crate::weighted::Weighting;
use faer::Mat;
use std::collections::BTreeMap;

/// Rows of `W` and `y`, `row = sample · n_joints + joint`, row-major, and which of them are used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartialRows<'a> {
    /// Entries of `W`, `m × n`.
    pub w: &'a [f64],
    /// Observations, `m`.
    pub y: &'a [f64],
    /// Whether a row is used, `m`.
    pub used: &'a [bool],
    /// Rows a sample.
    pub n_joints: usize,
}

/// Options of [`partial_least_squares`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartialOptions {
    /// Which part of the residual covariance weights the rows.
    pub weighting: Weighting,
    /// How outliers lose their say; `None`: they keep it.
    pub loss: Option<RobustLoss>,
    /// Weighted fits at most, of each loss; 20 typical.
    pub n_iterations: usize,
    /// Stop when no value moves by more than this share of its standard deviation; 1e-2 typical.
    pub tolerance: f64,
}

impl Default for PartialOptions {
    /// Full covariance, no loss, up to 20 fits, 1e-2.
    fn default() -> Self {
        Self {
            weighting: Weighting::Full,
            loss: None,
            n_iterations: 20,
            tolerance: 1e-2,
        }
    }
}

/// A weighted fit and everything it was made with.
#[derive(Debug, Clone, PartialEq)]
pub struct PartialEstimate {
    /// The fit of the whitened rows. Its covariance believes that noise is white over time.
    pub estimate: Estimate,
    /// The ordinary fit it started from; its condition number is that of `W`.
    pub ordinary: Estimate,
    /// Covariance of the joints' noise within a sample.
    pub noise: NoiseCovariance,
    /// Weight of each row in [0, 1]: 0 where it is not used, 1 without a loss.
    pub weights: Vec<f64>,
    /// Triangle of the whitened rows, for tests of what the fit can do without.
    pub factor: InformationFactor,
    /// Standard deviation of each value that holds for noise which remembers: the larger of the white one and that of the fits without
    /// one block of consecutive samples.
    pub standard_deviation: Vec<f64>,
    /// Covariance with these standard deviations and the correlations of the white one.
    pub covariance: Mat<f64>,
    /// Samples a block: several times what the noise remembers.
    pub block_samples: usize,
    /// Weighted fits made.
    pub n_iterations: usize,
    /// Largest last move of a value, in standard deviations.
    pub last_change: f64,
    /// Whether `last_change` is below the tolerance.
    pub converged: bool,
}

/// Least squares weighted by the covariance of the joints' residuals, and by each residual under a robust loss, iterated.
///
/// A sample whose rows are not all used is whitened with the covariance of those that are. Robust weights `v` stand for noise of
/// covariance `V^-½ Ω V^-½`. `Err` of the inner result: the columns of the used rows are dependent.
/// Sources: Gautier & Poignet 2001; Zellner 1962; Huber 1981; Bell & McCaffrey 2002 for the blocks.
///
/// # Errors
/// As [`InformationFactor::push_rows`] and [`solve`]; [`Error::NotPositiveDefinite`] for a joint that fits exactly or whose
/// residual is that of others.
///
/// # Panics
/// If the lengths do not agree.
#[track_caller]
pub fn partial_least_squares(
    rows: &PartialRows<'_>,
    options: &PartialOptions,
) -> Result<Result<PartialEstimate, RankDeficiency>, Error> {
    let n = rows.n_columns();
    let ordinary = match solve(&rows.folded(n, None, &[])?)? {
        Solution::Determined(estimate) => estimate,
        Solution::RankDeficient(deficiency) => return Ok(Err(deficiency)),
    };
    let losses = match options.loss {
        None => vec![None],
        Some(RobustLoss::Tukey { .. }) => {
            vec![Some(RobustLoss::Huber { k: HUBER_K }), options.loss]
        }
        huber => vec![huber],
    };
    let mut values = ordinary.values.clone();
    let mut n_iterations = 0;
    let mut out: Option<PartialEstimate> = None;
    for loss in losses {
        for _ in 0..options.n_iterations.max(1) {
            let residuals = rows.residuals(&values);
            let weights = rows.weights(&residuals, loss);
            let noise = rows.noise(&residuals, &weights, n, options.weighting)?;
            let factor = rows.folded(n, Some(&noise), &weights)?;
            let estimate = match solve(&factor)? {
                Solution::Determined(estimate) => estimate,
                Solution::RankDeficient(deficiency) => return Ok(Err(deficiency)),
            };
            n_iterations += 1;
            let last_change = std::iter::zip(&estimate.values, &values)
                .zip(&estimate.standard_deviation)
                .map(|((new, old), s)| (new - old).abs() / s)
                .fold(0.0, f64::max);
            values.clone_from(&estimate.values);
            let converged = last_change < options.tolerance;
            out = Some(PartialEstimate {
                standard_deviation: estimate.standard_deviation.clone(),
                covariance: estimate.covariance.clone(),
                estimate,
                ordinary: ordinary.clone(),
                noise,
                weights,
                factor,
                block_samples: 1,
                n_iterations,
                last_change,
                converged,
            });
            if converged {
                break;
            }
        }
    }
    let mut out = out.unwrap_or_else(|| unreachable!("at least one fit is made"));
    out.believe_blocks(rows)?;
    Ok(Ok(out))
}

/// The triangle of the used rows, whitened with a covariance of the joints and weighted row by row (0 leaves a row out).
///
/// # Errors
/// As [`InformationFactor::push_rows`]; [`Error::NotPositiveDefinite`].
///
/// # Panics
/// If the lengths do not agree.
#[track_caller]
pub fn whitened_factor(
    rows: &PartialRows<'_>,
    noise: &NoiseCovariance,
    weights: &[f64],
) -> Result<InformationFactor, Error> {
    assert_eq!(weights.len(), rows.y.len(), "one weight a row");
    rows.folded(rows.n_columns(), Some(noise), weights)
}

/// Blocks must be this many times longer than the noise remembers.
const BLOCK_MEMORIES: f64 = 4.0;
/// Normal quantile at 97.5 %.
const NORMAL_QUANTILE: f64 = 1.959963984540054;
/// Fewest blocks that say something of their scatter.
const FEWEST_BLOCKS: usize = 20;

impl PartialEstimate {
    /// Raises the standard deviations to what blocks of consecutive samples scatter by.
    fn believe_blocks(&mut self, rows: &PartialRows<'_>) -> Result<(), Error> {
        let n = rows.n_columns();
        let n_samples = rows.y.len() / rows.n_joints;
        let residuals = rows.residuals(&self.estimate.values);
        let memory = (0..rows.n_joints)
            .map(|joint| {
                let at = (joint..rows.y.len()).step_by(rows.n_joints);
                let own: Vec<f64> = at
                    .filter(|&row| rows.used[row])
                    .map(|row| residuals[row] * self.weights[row].sqrt())
                    .collect();
                if own.len() < 10 {
                    1.0
                } else {
                    own.len() as f64 / effective_sample_size(&own)
                }
            })
            .fold(1.0, f64::max);
        self.block_samples = ((BLOCK_MEMORIES * memory).ceil() as usize)
            .min(n_samples / FEWEST_BLOCKS)
            .max(1);
        let parts = self.factor.parts();
        let mut jackknife = BlockJackknife::new(parts.r.as_ref());
        let mut whitener = Whitener::new(&self.noise);
        for sample in 0..n_samples {
            let (w, y) = whitener.sample(rows, sample, &self.weights)?;
            for (row, y) in w.chunks_exact(n).zip(y) {
                jackknife.push(row, y - dot(row, &self.estimate.values));
            }
            if (sample + 1) % self.block_samples == 0 || sample + 1 == n_samples {
                jackknife.end_block();
            }
        }
        // What neighbouring blocks share is missing from both: a block of L samples of noise with a memory of m lacks
        // (m - 1/m)/2L of its variance, exactly so for first-order noise.
        let ends =
            1.0 / (1.0 - (memory - 1.0 / memory) / (2.0 * self.block_samples as f64)).max(0.5);
        // Few blocks know their own scatter badly: Student's quantile in place of the normal one at 95 %.
        let freedom = (jackknife.n_blocks() as f64 - 1.0).max(1.0);
        let few = student_t_quantile(0.975, freedom) / NORMAL_QUANTILE;
        for (deviation, variance) in self.standard_deviation.iter_mut().zip(jackknife.variance()) {
            let blocks = few * (ends * variance).sqrt();
            if blocks.is_finite() {
                *deviation = deviation.max(blocks);
            }
        }
        let white = &self.estimate.standard_deviation;
        let scale = |k: usize| self.standard_deviation[k] / white[k];
        self.covariance = Mat::from_fn(n, n, |i, j| {
            self.estimate.covariance[(i, j)] * scale(i) * scale(j)
        });
        Ok(())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    std::iter::zip(a, b).map(|(a, b)| a * b).sum()
}

impl PartialRows<'_> {
    /// Number of columns.
    ///
    /// # Panics
    /// If the lengths do not agree.
    #[track_caller]
    pub fn n_columns(&self) -> usize {
        let m = self.y.len();
        assert_eq!(self.used.len(), m, "one flag a row");
        assert_eq!(m % self.n_joints, 0, "whole samples");
        let n = self.w.len().checked_div(m).unwrap_or(0);
        assert_eq!(self.w.len(), n * m, "whole rows");
        n
    }

    fn residuals(&self, values: &[f64]) -> Vec<f64> {
        let rows = self.w.chunks_exact(values.len()).zip(self.y);
        rows.map(|(w, y)| y - dot(w, values)).collect()
    }

    /// 0 where a row is not used; by the residual over the joint's robust scale where there is a loss.
    fn weights(&self, residuals: &[f64], loss: Option<RobustLoss>) -> Vec<f64> {
        let scale: Vec<f64> = (0..self.n_joints)
            .map(|joint| {
                let at = (joint..self.y.len()).step_by(self.n_joints);
                let used = at.filter(|&row| self.used[row]);
                let mut sizes: Vec<f64> = used.map(|row| residuals[row].abs()).collect();
                sizes.sort_by(f64::total_cmp);
                MAD_TO_SIGMA * sizes.get(sizes.len() / 2).copied().unwrap_or(0.0)
            })
            .collect();
        (0..self.y.len())
            .map(|row| match (self.used[row], loss) {
                (false, _) => 0.0,
                (true, None) => 1.0,
                (true, Some(_)) if residuals[row] == 0.0 => 1.0,
                (true, Some(loss)) => loss.weight(residuals[row] / scale[row % self.n_joints]),
            })
            .collect()
    }

    /// Covariance of the weighted residuals, each pair of joints over the samples that have both.
    fn noise(
        &self,
        residuals: &[f64],
        weights: &[f64],
        n_parameters: usize,
        weighting: Weighting,
    ) -> Result<NoiseCovariance, Error> {
        let n = self.n_joints;
        let mut sums = Mat::<f64>::zeros(n, n);
        let mut counts = Mat::<f64>::zeros(n, n);
        for (r, v) in residuals.chunks_exact(n).zip(weights.chunks_exact(n)) {
            for i in (0..n).filter(|&i| v[i] > 0.0) {
                for j in (0..=i).filter(|&j| v[j] > 0.0) {
                    let weight = (v[i] * v[j]).sqrt();
                    sums[(i, j)] += weight * r[i] * r[j];
                    counts[(i, j)] += weight;
                }
            }
        }
        let n_rows = self.used.iter().filter(|u| **u).count();
        if n_rows <= n_parameters {
            return Err(Error::TooFewRows {
                n_rows,
                n_columns: n_parameters,
                needed: n_parameters + 1,
            });
        }
        // The parameters cost every joint the same share of its samples.
        let left = 1.0 - n_parameters as f64 / n_rows as f64;
        let entry = |i: usize, j: usize| {
            let (i, j) = (i.max(j), i.min(j));
            if i != j && (weighting == Weighting::Diagonal || counts[(i, j)] == 0.0) {
                return 0.0;
            }
            sums[(i, j)] / (counts[(i, j)] * left)
        };
        // A joint of which nothing is used has no noise to be known; any number serves.
        let own = |i: usize| {
            if counts[(i, i)] == 0.0 {
                1.0
            } else {
                entry(i, i)
            }
        };
        let covariance = Mat::from_fn(n, n, |i, j| if i == j { own(i) } else { entry(i, j) });
        NoiseCovariance::new(covariance.as_ref())
    }

    /// All used rows folded, whitened if a covariance is given.
    fn folded(
        &self,
        n: usize,
        noise: Option<&NoiseCovariance>,
        weights: &[f64],
    ) -> Result<InformationFactor, Error> {
        let mut factor = InformationFactor::new(n);
        let (mut w, mut y) = (Vec::new(), Vec::new());
        let mut whitener = noise.map(Whitener::new);
        let n_samples = self.y.len() / self.n_joints;
        for sample in 0..n_samples {
            match &mut whitener {
                Some(whitener) => {
                    let (more_w, more_y) = whitener.sample(self, sample, weights)?;
                    w.extend_from_slice(more_w);
                    y.extend_from_slice(more_y);
                }
                None => {
                    for row in sample * self.n_joints..(sample + 1) * self.n_joints {
                        if self.used[row] {
                            w.extend_from_slice(&self.w[row * n..][..n]);
                            y.push(self.y[row]);
                        }
                    }
                }
            }
            if y.len() >= FOLDED_ROWS || sample + 1 == n_samples {
                factor.push_rows(&w, &y)?;
                w.clear();
                y.clear();
            }
        }
        Ok(factor)
    }
}

/// Rows folded at a time: they stay in cache.
const FOLDED_ROWS: usize = 256;

/// Whitens the used rows of one sample after the other, with the covariance of just these joints.
struct Whitener<'a> {
    noise: &'a NoiseCovariance,
    of_joints: BTreeMap<Vec<usize>, NoiseCovariance>,
    w: Vec<f64>,
    y: Vec<f64>,
}

impl<'a> Whitener<'a> {
    fn new(noise: &'a NoiseCovariance) -> Self {
        Self {
            noise,
            of_joints: BTreeMap::new(),
            w: Vec::new(),
            y: Vec::new(),
        }
    }

    fn sample(
        &mut self,
        rows: &PartialRows<'_>,
        sample: usize,
        weights: &[f64],
    ) -> Result<(&[f64], &[f64]), Error> {
        let n = rows.w.len() / rows.y.len();
        let first = sample * rows.n_joints;
        let joints: Vec<usize> = (0..rows.n_joints)
            .filter(|&j| weights[first + j] > 0.0)
            .collect();
        self.w.clear();
        self.y.clear();
        for &joint in &joints {
            let row = first + joint;
            let root = weights[row].sqrt();
            let entries = &rows.w[row * n..][..n];
            self.w.extend(entries.iter().map(|w| root * w));
            self.y.push(root * rows.y[row]);
        }
        if joints.len() == rows.n_joints {
            self.noise.whiten(&mut self.w, &mut self.y);
        } else if !joints.is_empty() {
            if !self.of_joints.contains_key(&joints) {
                let c = self.noise.covariance();
                let part =
                    Mat::from_fn(joints.len(), joints.len(), |i, j| c[(joints[i], joints[j])]);
                self.of_joints
                    .insert(joints.clone(), NoiseCovariance::new(part.as_ref())?);
            }
            self.of_joints[&joints].whiten(&mut self.w, &mut self.y);
        }
        Ok((&self.w, &self.y))
    }
}
