//! From the triangle to the parameters and their uncertainty.

use crate::conditioning::{ConditionNumber, NEAR_SINGULAR_CONDITION, condition_of};
use crate::error::Error;
use crate::information::{InformationFactor, Parts};
use crate::quantile::student_t_quantile;
use crate::rank::{RankFactor, rank_factor};
use crate::triangular::{column_norms, invert_upper, solve_upper};
use faer::Mat;

/// What the rows say of the unknowns.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub enum Solution {
    /// Every unknown has a value.
    Determined(Estimate),
    /// The columns of `W` are dependent: some unknowns have no value, and which ones is the answer.
    RankDeficient(RankDeficiency),
}

impl Solution {
    /// The estimate, or the deficiency that forbids one.
    ///
    /// # Errors
    /// The [`RankDeficiency`].
    #[expect(
        clippy::result_large_err,
        reason = "both sides are results, neither is rare"
    )]
    pub fn determined(self) -> Result<Estimate, RankDeficiency> {
        match self {
            Self::Determined(estimate) => Ok(estimate),
            Self::RankDeficient(deficiency) => Err(deficiency),
        }
    }
}

/// Least-squares values and how sure they are; entries in the order of the columns of `W`.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The values, in the units of the parameters.
    pub values: Vec<f64>,
    /// Standard deviation of each value.
    pub standard_deviation: Vec<f64>,
    /// Standard deviation over size of the value; infinite for a value of zero.
    pub relative_std: Vec<f64>,
    /// Covariance of the values, `n × n`.
    pub covariance: Mat<f64>,
    /// Standard deviation of one row: estimated from the residual by [`solve`], as given in [`solve_with_known_noise`].
    pub sigma: f64,
    /// Where `sigma` comes from; decides between Student's t and the normal distribution in [`Estimate::confidence_interval`].
    pub noise: NoiseSource,
    /// Rank of `W`, the number of columns.
    pub rank: usize,
    /// Rows of `W`.
    pub n_rows: usize,
    /// Rows beyond the unknowns.
    pub degrees_of_freedom: usize,
    /// `‖y - W x‖`.
    pub residual_norm: f64,
    /// `‖y‖`.
    pub observation_norm: f64,
    /// Of the rows as pushed (of the weighted problem when they were whitened).
    pub condition_number: ConditionNumber,
    /// Whether the condition of unit columns exceeds [`NEAR_SINGULAR_CONDITION`]: the values then carry few correct digits even
    /// without noise.
    pub near_singular: bool,
}

impl Estimate {
    /// `‖y - W x‖ / ‖y‖`.
    pub fn relative_error(&self) -> f64 {
        self.residual_norm / self.observation_norm
    }

    /// The interval that holds the true value of one parameter with probability `level`, if the noise is as assumed.
    ///
    /// Student's t with the degrees of freedom where sigma was estimated, normal where it was given.
    ///
    /// # Panics
    /// If there is no such column, or `level` is not inside (0, 1).
    #[track_caller]
    pub fn confidence_interval(&self, column: usize, level: f64) -> [f64; 2] {
        let freedom = match self.noise {
            NoiseSource::Residual => self.degrees_of_freedom as f64,
            NoiseSource::Given => f64::INFINITY,
        };
        let half = student_t_quantile(0.5 + 0.5 * level, freedom) * self.standard_deviation[column];
        [self.values[column] - half, self.values[column] + half]
    }

    /// Standard deviation of one row as the residual shows it; not a number without degrees of freedom.
    pub fn residual_sigma(&self) -> f64 {
        self.residual_norm / (self.degrees_of_freedom as f64).sqrt()
    }
}

/// The outcome of a `W` with dependent columns.
///
/// A column is undetermined when it enters a combination `W v = 0`; the others have one value in every least-squares solution,
/// and get it.
#[derive(Debug, Clone, PartialEq)]
pub struct RankDeficiency {
    /// Number of independent columns.
    pub rank: usize,
    /// Number of columns.
    pub n_columns: usize,
    /// Columns without any excitation: shorter than [`crate::VANISHING_COLUMN`] of the longest.
    pub vanishing: Vec<usize>,
    /// Columns whose parameter the rows do not determine, the vanishing ones among them, ascending.
    pub undetermined: Vec<usize>,
    /// A basis of the combinations that vanish, `W v = 0`; one column has coefficient 1, those that do not enter have exactly 0.
    pub null_combinations: Vec<Vec<f64>>,
    /// Smallest pivot kept and largest dropped, of unit columns, relative to the first pivot; the cut is [`crate::RANK_TOLERANCE`].
    pub pivots: [f64; 2],
    /// The value of each parameter that is determined.
    pub values: Vec<Option<f64>>,
    /// Its standard deviation.
    pub standard_deviation: Vec<Option<f64>>,
    /// Standard deviation of one row: as estimated or as given. `None` without degrees of freedom.
    pub sigma: Option<f64>,
    /// `‖y - W x‖`.
    pub residual_norm: f64,
    /// `‖y‖`.
    pub observation_norm: f64,
    /// Rows of `W`.
    pub n_rows: usize,
}

/// Where the standard deviation of a row comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseSource {
    /// Estimated from the residual.
    Residual,
    /// Given by the caller.
    Given,
}

/// How noisy a row is.
#[derive(Clone, Copy)]
enum Noise {
    FromResidual,
    Known(f64),
}

/// Ordinary least squares: `min ‖y - W x‖`, rows equally noisy, their noise estimated from the residual.
///
/// `C = σ² (WᵀW)⁻¹` with `σ² = ‖y - W x̂‖² / (m - rank)`; true for independent rows of equal variance only.
/// Source: Gautier & Khalil 1991, section 3 and the end of section 6.
///
/// # Errors
/// [`Error::TooFewRows`] without a row to spare, [`Error::Overflow`], [`Error::NoConvergence`].
///
/// # Examples
/// ```
/// use idim_estimation::{InformationFactor, Solution, solve};
///
/// let mut factor = InformationFactor::new(2);
/// factor.push_rows(&[1.0, 0.0, 1.0, 1.0, 1.0, 2.0], &[1.0, 3.0, 5.0])?;
/// let Solution::Determined(line) = solve(&factor)? else { panic!("two points make a line") };
/// assert!((line.values[1] - 2.0).abs() < 1e-14);
/// # Ok::<(), idim_estimation::Error>(())
/// ```
pub fn solve(factor: &InformationFactor) -> Result<Solution, Error> {
    solve_with(factor, Noise::FromResidual)
}

/// Least squares with rows of known standard deviation `sigma` (1 for whitened rows): `C = σ² (WᵀW)⁻¹`, whatever the residual.
///
/// `(residual_norm / sigma)²` is then a χ² variable of `degrees_of_freedom` and tests the model.
///
/// # Errors
/// As [`solve`], save that no row needs to be spare; [`Error::OutOfRange`] for a sigma that is not positive.
pub fn solve_with_known_noise(factor: &InformationFactor, sigma: f64) -> Result<Solution, Error> {
    if !(sigma > 0.0 && sigma.is_finite()) {
        return Err(Error::OutOfRange {
            name: "the standard deviation of a row",
            value: sigma,
            rule: "positive and finite",
        });
    }
    solve_with(factor, Noise::Known(sigma))
}

fn solve_with(factor: &InformationFactor, noise: Noise) -> Result<Solution, Error> {
    let (m, n) = (factor.n_rows(), factor.n_columns());
    let spare = usize::from(matches!(noise, Noise::FromResidual));
    if m < n + spare {
        return Err(Error::TooFewRows {
            n_rows: m,
            n_columns: n,
            needed: n + spare,
        });
    }
    let parts = factor.parts();
    let norms = column_norms(parts.r.as_ref());
    if !parts.observation_norm().is_finite() || norms.iter().any(|d| !d.is_finite()) {
        return Err(Error::Overflow { n_rows: m });
    }
    let rank = rank_factor(parts.r.as_ref(), &parts.z);
    if rank.rank < n {
        return Ok(Solution::RankDeficient(deficient(&parts, &rank, m, noise)));
    }
    determined(&parts, &norms, m, noise).map(Solution::Determined)
}

fn determined(parts: &Parts, norms: &[f64], m: usize, noise: Noise) -> Result<Estimate, Error> {
    let n = parts.z.len();
    let residual_norm = parts.e.abs();
    let degrees_of_freedom = m - n;
    let (sigma, source) = match noise {
        Noise::Known(sigma) => (sigma, NoiseSource::Given),
        Noise::FromResidual => (
            residual_norm / (degrees_of_freedom as f64).sqrt(),
            NoiseSource::Residual,
        ),
    };
    let values = solve_upper(parts.r.as_ref(), &parts.z);
    let covariance = unit_covariance(parts, norms) * faer::Scale(sigma * sigma);
    let standard_deviation: Vec<f64> = (0..n).map(|i| covariance[(i, i)].sqrt()).collect();
    let relative_std = std::iter::zip(&standard_deviation, &values)
        .map(|(s, v)| {
            if *v == 0.0 {
                f64::INFINITY
            } else {
                s / v.abs()
            }
        })
        .collect();
    let condition_number = condition_of(parts.r.as_ref())?;
    Ok(Estimate {
        values,
        standard_deviation,
        relative_std,
        covariance,
        sigma,
        noise: source,
        rank: n,
        n_rows: m,
        degrees_of_freedom,
        residual_norm,
        observation_norm: parts.observation_norm(),
        condition_number,
        near_singular: condition_number.equilibrated > NEAR_SINGULAR_CONDITION,
    })
}

/// `(RᵀR)⁻¹`, through unit columns.
pub(crate) fn unit_covariance(parts: &Parts, norms: &[f64]) -> Mat<f64> {
    let n = norms.len();
    let unit = Mat::from_fn(n, n, |i, j| parts.r[(i, j)] / norms[j]);
    let inverse = invert_upper(unit.as_ref());
    let product = &inverse * inverse.transpose();
    Mat::from_fn(n, n, |i, j| {
        product[(i.max(j), i.min(j))] / (norms[i] * norms[j])
    })
}

fn deficient(parts: &Parts, factor: &RankFactor, m: usize, noise: Noise) -> RankDeficiency {
    let (n, rank) = (parts.z.len(), factor.rank);
    let null_combinations = factor.null_combinations();
    let undetermined: Vec<usize> = (0..n)
        .filter(|&j| null_combinations.iter().any(|v| v[j] != 0.0))
        .collect();
    // ‖y - W x̂‖² = e² + the part of z outside the range of R.
    let inside: f64 = factor.z.iter().map(|z| z * z).sum();
    let all: f64 = parts.z.iter().map(|z| z * z).sum();
    let residual_norm = parts.e.hypot((all - inside).max(0.0).sqrt());
    let sigma = match noise {
        Noise::Known(sigma) => Some(sigma),
        Noise::FromResidual => (m > rank).then(|| residual_norm / ((m - rank) as f64).sqrt()),
    };
    let leading = factor.r.as_ref().submatrix(0, 0, rank, rank);
    let basic = solve_upper(leading, &factor.z);
    let inverse = invert_upper(leading);
    let mut values = vec![None; n];
    let mut standard_deviation = vec![None; n];
    for (i, &column) in factor.order[..rank].iter().enumerate() {
        if undetermined.binary_search(&column).is_err() {
            values[column] = Some(basic[i] / factor.scale[column]);
            let row = (i..rank)
                .map(|k| inverse[(i, k)].powi(2))
                .sum::<f64>()
                .sqrt();
            standard_deviation[column] = sigma.map(|s| s * row / factor.scale[column]);
        }
    }
    RankDeficiency {
        rank,
        n_columns: n,
        vanishing: factor.vanishing.clone(),
        undetermined,
        null_combinations,
        pivots: [factor.kept, factor.dropped],
        values,
        standard_deviation,
        sigma,
        residual_norm,
        observation_norm: parts.observation_norm(),
        n_rows: m,
    }
}
