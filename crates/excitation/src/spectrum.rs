//! Smooth criteria through the eigenvalues of the information matrix, with exact gradients by the rows.
//!
//! With `A = WᵀW = V diag(λ) Vᵀ` and a criterion `f(λ)`: `df = ⟨G, dW⟩`, `G = 2 W V diag(∂f/∂λ) Vᵀ`.

use crate::criterion::{Criterion, Scaling};
#[cfg(test)]
use faer::MatMut;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par, Side};

/// Eigenvalues closer to zero than this share of the largest are rounding of `WᵀW`: the criterion is infinite there.
const RANK_TOLERANCE: f64 = 1e-15;

/// A smooth criterion of the rows; its logarithm is what is evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SmoothCriterion {
    function: Spectral,
    scaling: Scaling,
}

/// Functions of the eigenvalues; all decrease as `W` gets better.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Spectral {
    /// `½ log(λ₁ / λ_b)`: log of the 2-norm condition number.
    LogCondition,
    /// `(1/p) ½ (log Σ λᵖ + log Σ λ⁻ᵖ)`, from above towards the one before as p grows; times `factor`.
    Schatten { power: f64, factor: f64 },
    /// `-Σ log λ`.
    LogDet,
    /// `log Σ 1/λ`.
    LogTraceInverse,
    /// `-½ log λ_b`.
    LogWorst,
    /// `(1/p) ½ log Σ λ⁻ᵖ`, from above towards the one before as p grows.
    WorstNorm { power: f64 },
}

/// A criterion at one information matrix.
pub(crate) struct SpectralPoint {
    pub(crate) value: f64,
    /// Eigenvalues of the scaled information, smallest first, and the derivative by each.
    pub(crate) lambda: Vec<f64>,
    pub(crate) slope: Vec<f64>,
    /// Their eigenvectors.
    pub(crate) vectors: Mat<f64>,
    scaled: Mat<f64>,
    scale: Vec<f64>,
}

impl SmoothCriterion {
    /// `None` for the criteria that are not smooth functions of the eigenvalues.
    pub(crate) fn new(criterion: Criterion) -> Option<Self> {
        let (function, scaling) = match criterion {
            Criterion::TwoNorm(scaling) => (Spectral::LogCondition, scaling),
            // ‖A‖_F ‖A⁻¹‖_F is the square of the Schatten form with p = 2.
            Criterion::Frobenius(scaling) => (
                Spectral::Schatten {
                    power: 2.0,
                    factor: 2.0,
                },
                scaling,
            ),
            Criterion::LogDet => (Spectral::LogDet, Scaling::Raw),
            Criterion::TraceInverse => (Spectral::LogTraceInverse, Scaling::Raw),
            Criterion::WorstDirection => (Spectral::LogWorst, Scaling::Raw),
            Criterion::PivotedQr(_) | Criterion::Equilibrium | Criterion::WeightedSum { .. } => {
                return None;
            }
        };
        Some(Self { function, scaling })
    }

    /// Value for `w`; infinite when its columns are dependent to rounding. With `gradient`, the derivative by
    /// every entry of `w` as well (zero where infinite).
    #[cfg(test)]
    pub(crate) fn evaluate(
        &self,
        w: MatRef<'_, f64>,
        n_samples: usize,
        gradient: Option<MatMut<'_, f64>>,
    ) -> f64 {
        let n = w.ncols();
        let mut information = Mat::zeros(n, n);
        let a = information.as_mut();
        matmul(a, Accum::Replace, w.transpose(), w, 1.0, Par::Seq);
        let point = self.at(information.as_ref(), n_samples);
        if let Some(g) = gradient {
            let by_information = self.by_information(&point);
            matmul(g, Accum::Replace, w, by_information.as_ref(), 2.0, Par::Seq);
        }
        point.value
    }

    /// The same, smoother: extreme eigenvalues of a condition number or of the worst direction give way to norms of
    /// this power, which tend to them from above.
    pub(crate) fn smoothed(self, power: f64) -> Self {
        let function = match self.function {
            Spectral::LogCondition => Spectral::Schatten { power, factor: 1.0 },
            Spectral::LogWorst => Spectral::WorstNorm { power },
            other => other,
        };
        Self { function, ..self }
    }

    /// Value at an information matrix `A = WᵀW` (its lower triangle) and what the gradient needs; infinite when `A`
    /// is singular to rounding.
    pub(crate) fn at(&self, information: MatRef<'_, f64>, n_samples: usize) -> SpectralPoint {
        let n = information.ncols();
        let scale = self.column_scale(information);
        let scaled = Mat::from_fn(n, n, |i, j| {
            let (i, j) = (i.max(j), i.min(j));
            information[(i, j)] * scale[i] * scale[j]
        });
        let mut point = SpectralPoint {
            value: f64::INFINITY,
            lambda: vec![0.0; n],
            slope: vec![0.0; n],
            vectors: Mat::zeros(n, n),
            scaled,
            scale,
        };
        let Ok(eigen) = point.scaled.self_adjoint_eigen(Side::Lower) else {
            return point;
        };
        for k in 0..n {
            point.lambda[k] = eigen.S().column_vector()[k];
        }
        let largest = point.lambda.last().copied().unwrap_or(1.0);
        if !largest.is_finite() || point.lambda[0] <= RANK_TOLERANCE * largest {
            return point;
        }
        point.vectors.copy_from(eigen.U());
        (point.value, point.slope) = self.function.value_and_slope(&point.lambda, n_samples);
        point
    }

    /// Derivative of the value by the information matrix, symmetric.
    pub(crate) fn by_information(&self, point: &SpectralPoint) -> Mat<f64> {
        let n = point.scale.len();
        let v = point.vectors.as_ref();
        let middle = Mat::from_fn(n, n, |i, k| v[(i, k)] * point.slope[k]);
        let mut out = Mat::zeros(n, n);
        let s = out.as_mut();
        let (a, b) = (middle.as_ref(), v.transpose());
        matmul(s, Accum::Replace, a, b, 1.0, Par::Seq);
        self.back_through_scale(&mut out, &point.scaled, &point.scale);
        out
    }

    /// One, or the inverse norm of each column.
    fn column_scale(&self, information: MatRef<'_, f64>) -> Vec<f64> {
        let n = information.ncols();
        match self.scaling {
            Scaling::Raw => vec![1.0; n],
            Scaling::Equilibrated => (0..n).map(|j| 1.0 / information[(j, j)].sqrt()).collect(),
        }
    }

    /// From `S = ∂f/∂(D A D)` to `∂f/∂A`, where the scale `D` depends on the diagonal of `A`.
    ///
    /// `d(D A D) = D dA D - ½ (B E + E B)` with `B = D A D`, `E = D diag(dA) D`: a diagonal correction `-(S B)_jj d_j²`.
    fn back_through_scale(&self, s: &mut Mat<f64>, scaled: &Mat<f64>, scale: &[f64]) {
        if self.scaling == Scaling::Raw {
            return;
        }
        let n = scale.len();
        let correction: Vec<f64> = (0..n)
            .map(|j| (0..n).map(|k| s[(j, k)] * scaled[(k, j)]).sum())
            .collect();
        for j in 0..n {
            for i in 0..n {
                s[(i, j)] *= scale[i] * scale[j];
            }
            s[(j, j)] -= correction[j] * scale[j] * scale[j];
        }
    }
}

impl Spectral {
    /// Value and derivative by each eigenvalue (smallest first).
    fn value_and_slope(self, lambda: &[f64], n_samples: usize) -> (f64, Vec<f64>) {
        let n = lambda.len();
        let (small, large) = (lambda[0], lambda[n - 1]);
        let samples = n_samples as f64;
        let mut slope = vec![0.0; n];
        let value = match self {
            Self::LogCondition => {
                slope[n - 1] = 0.5 / large;
                slope[0] -= 0.5 / small;
                0.5 * (large / small).ln()
            }
            Self::Schatten { power, factor } => {
                let up: Vec<f64> = lambda.iter().map(|l| (l / large).powf(power)).collect();
                let down: Vec<f64> = lambda.iter().map(|l| (small / l).powf(power)).collect();
                let (sum_up, sum_down) = (up.iter().sum::<f64>(), down.iter().sum::<f64>());
                for k in 0..n {
                    slope[k] = 0.5 * factor * (up[k] / sum_up - down[k] / sum_down) / lambda[k];
                }
                0.5 * factor * ((large / small).ln() + (sum_up.ln() + sum_down.ln()) / power)
            }
            Self::LogDet => {
                for k in 0..n {
                    slope[k] = -1.0 / lambda[k];
                }
                lambda.iter().map(|l| -(l / samples).ln()).sum()
            }
            Self::LogTraceInverse => {
                let sum: f64 = lambda.iter().map(|l| 1.0 / l).sum();
                for k in 0..n {
                    slope[k] = -1.0 / (lambda[k] * lambda[k] * sum);
                }
                (samples * sum).ln()
            }
            Self::LogWorst => {
                slope[0] = -0.5 / small;
                0.5 * (samples / small).ln()
            }
            Self::WorstNorm { power } => {
                let down: Vec<f64> = lambda.iter().map(|l| (small / l).powf(power)).collect();
                let sum: f64 = down.iter().sum();
                for k in 0..n {
                    slope[k] = -0.5 * down[k] / (sum * lambda[k]);
                }
                0.5 * ((samples / small).ln() + sum.ln() / power)
            }
        };
        (value, slope)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use proptest::prelude::*;

    const CRITERIA: [Criterion; 7] = [
        Criterion::TwoNorm(Scaling::Raw),
        Criterion::TwoNorm(Scaling::Equilibrated),
        Criterion::Frobenius(Scaling::Raw),
        Criterion::Frobenius(Scaling::Equilibrated),
        Criterion::LogDet,
        Criterion::TraceInverse,
        Criterion::WorstDirection,
    ];

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(30))]

        #[test]
        fn identity_value_and_gradient_of_smooth_criteria(
            entries in prop::collection::vec(-1.0..1.0_f64, 50),
            direction in prop::collection::vec(-1.0..1.0_f64, 50),
        ) {
            // A spread diagonal keeps the eigenvalues apart: at a crossing the extreme ones have no derivative.
            let w = |t: f64| Mat::from_fn(10, 5, |i, j| {
                let k = 5 * i + j;
                let diagonal = if i == j { 3.0 * (j + 1) as f64 } else { 0.0 };
                entries[k] + diagonal + t * direction[k]
            });
            for criterion in CRITERIA {
                let smooth = SmoothCriterion::new(criterion).unwrap();
                let mut g = Mat::zeros(10, 5);
                let value = smooth.evaluate(w(0.0).as_ref(), 10, Some(g.as_mut()));
                let exact = criterion.logarithm(criterion.evaluate(w(0.0).as_ref(), 10));
                prop_assert!((value - exact).abs() < 1e-11, "{criterion:?}: {value} {exact}");
                let slope: f64 = (0..50).map(|k| g[(k / 5, k % 5)] * direction[k]).sum();
                // Five-point difference: truncation h⁴ = 1e-15, rounding 1e-16 / h = 1e-12, both times some hundred.
                let f = |t: f64| smooth.evaluate(w(t).as_ref(), 10, None);
                let h = 2e-4;
                let numeric = (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
                // Unit columns undo the spread: eigenvalues may come close, and the truncation grows with gap⁻⁴.
                let unit = matches!(
                    criterion,
                    Criterion::TwoNorm(Scaling::Equilibrated) | Criterion::Frobenius(Scaling::Equilibrated)
                );
                let tolerance = if unit { 1e-5 } else { 1e-9 };
                prop_assert!(
                    (slope - numeric).abs() < tolerance * slope.abs().max(1.0),
                    "{criterion:?}: {slope} {numeric}"
                );
            }
        }
    }

    #[test]
    fn identity_dependent_columns_are_infinite_with_no_direction() {
        let w = Mat::from_fn(6, 3, |i, j| {
            if j == 2 {
                2.0 * i as f64
            } else {
                (i + j * i * i) as f64
            }
        });
        let mut g = Mat::from_fn(6, 3, |_, _| 1.0);
        let smooth = SmoothCriterion::new(Criterion::LogDet).unwrap();
        let value = smooth.evaluate(w.as_ref(), 6, Some(g.as_mut()));
        assert_eq!(value, f64::INFINITY);
        assert_eq!(g.norm_l2(), 0.0);
    }
}
