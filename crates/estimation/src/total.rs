//! Total least squares, and the drive gains it finds.

use crate::error::Error;
use crate::information::InformationFactor;
use crate::rank::rank_factor;
use crate::solve::{RankDeficiency, Solution, solve_with_known_noise};
use crate::triangular::column_norms;
use faer::Mat;

/// Values when the columns are as noisy as the observations.
#[derive(Debug, Clone, PartialEq)]
pub struct TotalLeastSquares {
    /// The values.
    pub values: Vec<f64>,
    /// Standard deviation of each value, to first order, for equal relative noise in all columns.
    pub standard_deviation: Vec<f64>,
    /// Smallest singular value over the next one, of `[W y]` with unit columns. Near 0: one clear relation between the columns; near 1: the
    /// last two cannot be told apart and the values mean nothing. Below 0.1 is sound.
    pub validity: f64,
    /// All singular values of `[W y]` with unit columns, largest first.
    pub singular_values: Vec<f64>,
}

/// Outcome of [`total_least_squares`].
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub enum TotalSolution {
    /// Every unknown has a value.
    Determined(TotalLeastSquares),
    /// The columns of `W` are dependent.
    RankDeficient(RankDeficiency),
    /// The observations are orthogonal to the smallest singular vector (all zero, for one): no relation contains them.
    Unrelated,
}

/// Total least squares: the `x` for which `[W y]`, with columns of unit length, needs the smallest change to make `W x = y` exact.
///
/// The last right singular vector of the triangle `[R z; 0 e]`, whose singular values are those of `[W y]`. Where ordinary least
/// squares is biased towards zero by noise in `W`, this is not, as long as noise is in proportion to the columns' length.
/// Source: Van Huffel & Vandewalle 1991; Gautier & Briot 2014.
///
/// # Errors
/// [`Error::TooFewRows`], [`Error::Overflow`], [`Error::NoConvergence`].
pub fn total_least_squares(factor: &InformationFactor) -> Result<TotalSolution, Error> {
    let (m, n) = (factor.n_rows(), factor.n_columns());
    if m < n + 1 {
        return Err(Error::TooFewRows {
            n_rows: m,
            n_columns: n,
            needed: n + 1,
        });
    }
    let parts = factor.parts();
    let mut whole = Mat::zeros(n + 1, n + 1);
    whole.as_mut().submatrix_mut(0, 0, n, n).copy_from(&parts.r);
    for i in 0..n {
        whole[(i, n)] = parts.z[i];
    }
    whole[(n, n)] = parts.e;
    let norms = column_norms(whole.as_ref());
    if norms.iter().any(|d| !d.is_finite()) {
        return Err(Error::Overflow { n_rows: m });
    }
    if rank_factor(parts.r.as_ref(), &parts.z).rank < n {
        return match solve_with_known_noise(factor, 1.0)? {
            Solution::RankDeficient(deficiency) => Ok(TotalSolution::RankDeficient(deficiency)),
            Solution::Determined(_) => unreachable!("one rank decision for both"),
        };
    }
    if norms[n] == 0.0 {
        return Ok(TotalSolution::Unrelated);
    }
    let unit = Mat::from_fn(n + 1, n + 1, |i, j| whole[(i, j)] / norms[j]);
    let svd = unit.svd().map_err(|_| Error::NoConvergence { n: n + 1 })?;
    let s: Vec<f64> = svd.S().column_vector().iter().copied().collect();
    let v = svd.V();
    let last = v[(n, n)];
    if last.abs() < UNRELATED {
        return Ok(TotalSolution::Unrelated);
    }
    let values: Vec<f64> = (0..n)
        .map(|j| -v[(j, n)] / last * norms[n] / norms[j])
        .collect();
    // C = σ² (1 + ‖x‖²) (WᵀW - s² 1)⁻¹ in unit columns; the eigenvectors of the inverse are those of the leading block.
    let (least, next) = (s[n], if n == 0 { f64::INFINITY } else { s[n - 1] });
    let variance = least * least / (m - n) as f64 / (last * last);
    let leading = unit.as_ref().submatrix(0, 0, n + 1, n);
    let shifted =
        leading.transpose() * leading - Mat::<f64>::identity(n, n) * faer::Scale(least * least);
    let inverse =
        faer::linalg::solvers::Solve::solve(&shifted.partial_piv_lu(), Mat::<f64>::identity(n, n));
    let standard_deviation = (0..n)
        .map(|j| (variance * inverse[(j, j)].max(0.0)).sqrt() * norms[n] / norms[j])
        .collect();
    Ok(TotalSolution::Determined(TotalLeastSquares {
        values,
        standard_deviation,
        validity: least / next,
        singular_values: s,
    }))
}

/// A last component below this is rounding: the solution would be larger than the digits of `f64` can tell from infinity.
const UNRELATED: f64 = 1e-12;

/// Rows of one sample for the drive gains, `V g - W x - W_u x_u = W_k x_k`.
///
/// `V` is diagonal: joint `j`'s torque is `g_j v_j` with `v_j` the drive's signal (current, or torque by nominal gains). Unknowns in
/// order: the `n` gains, the arm's base parameters `x`, the load's unknown parameters `x_u`. What is known of the load (its weighed mass)
/// gives the observations and with them the scale of everything: all values are in proportion to it.
/// Source: Gautier & Briot 2014.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveGainSample<'a> {
    /// Signal of each drive, `n`.
    pub signal: &'a [f64],
    /// Regressor of the arm, `n × p`, row-major.
    pub arm: &'a [f64],
    /// Regressor of the load's unknown parameters, `n × p_u`, row-major; zeros in a run without load.
    pub load: &'a [f64],
    /// Torque of the load's known parameters, `n`; zeros in a run without load.
    pub known_torque: &'a [f64],
}

impl DriveGainSample<'_> {
    /// Folds the sample in, each joint's row multiplied by its weight (one over the joint's noise).
    ///
    /// # Errors
    /// [`Error::NonFinite`].
    ///
    /// # Panics
    /// If the lengths do not agree with each other and with `factor`.
    #[track_caller]
    pub fn push(&self, weights: &[f64], factor: &mut InformationFactor) -> Result<(), Error> {
        let n = self.signal.len();
        assert_eq!(
            [weights.len(), self.known_torque.len()],
            [n, n],
            "weights and known torques of {n} joints"
        );
        let (p, u) = (self.arm.len() / n, self.load.len() / n);
        assert_eq!(
            [self.arm.len(), self.load.len(), factor.n_columns()],
            [n * p, n * u, n + p + u],
            "arm, load and columns"
        );
        let mut row = vec![0.0; n + p + u];
        for joint in 0..n {
            let weight = weights[joint];
            row[..n].fill(0.0);
            row[joint] = weight * self.signal[joint];
            for k in 0..p {
                row[n + k] = -weight * self.arm[joint * p + k];
            }
            for k in 0..u {
                row[n + p + k] = -weight * self.load[joint * u + k];
            }
            factor.push_rows(&row, &[weight * self.known_torque[joint]])?;
        }
        Ok(())
    }
}
