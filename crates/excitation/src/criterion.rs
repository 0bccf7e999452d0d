//! How well a stack of rows `W` reveals its parameters: the criteria of both papers.

use faer::{Mat, MatRef};

/// Whether a condition number is that of `W` or of `W` with columns of unit length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scaling {
    /// `W` as it is: depends on the units of the parameters.
    Raw,
    /// Every column divided by its 2-norm.
    Equilibrated,
}

/// A scalar that an optimiser lowers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// `σ₁ / σ_b` by the singular values (Gautier & Khalil 1991, eq. 16).
    TwoNorm(Scaling),
    /// `|R₁₁| / |R_bb|` of the column-pivoted QR, an estimate of the above (their measure ii).
    PivotedQr(Scaling),
    /// `‖A‖_F ‖A⁻¹‖_F` with `A = WᵀW` (their eqs. 21, 22): about the square of the above.
    Frobenius(Scaling),
    /// `S = max|W| / min|W|` (their eq. 19).
    Equilibrium,
    /// `λ₁ Cond₂(W) + λ₂ S` (their eq. 18).
    WeightedSum {
        /// `λ₁`, weight of the raw 2-norm condition number.
        condition: f64,
        /// `λ₂`, weight of `S`.
        equilibrium: f64,
    },
    /// `-log det(WᵀW / n_samples)`: d-optimality.
    ///
    /// Radkhah, Kulić & Croft print `-log det M` of the *covariance* `M`; that is a slip of sign.
    LogDet,
    /// `tr (WᵀW / n_samples)⁻¹`: a-optimality, the sum of the variances.
    TraceInverse,
    /// `√n_samples / σ_b`: e-optimality, the worst standard deviation.
    WorstDirection,
}

impl Criterion {
    /// Value for the rows `w` of `n_samples` samples; smaller is better, infinite where `W` is rank deficient.
    ///
    /// # Panics
    /// If `w` has fewer rows than columns or an entry that is not finite.
    #[track_caller]
    pub fn evaluate(&self, w: MatRef<'_, f64>, n_samples: usize) -> f64 {
        match *self {
            Self::TwoNorm(scaling) => two_norm(&singular_values(scaled(w, scaling).as_ref())),
            Self::PivotedQr(scaling) => pivoted_estimate(scaled(w, scaling).as_ref()),
            Self::Frobenius(scaling) => frobenius(&singular_values(scaled(w, scaling).as_ref())),
            Self::Equilibrium => equilibrium(w).ratio,
            Self::WeightedSum {
                condition,
                equilibrium: weight,
            } => condition * two_norm(&singular_values(w)) + weight * equilibrium(w).ratio,
            Self::LogDet => -log_det(&singular_values(w), n_samples),
            Self::TraceInverse => trace_inverse(&singular_values(w), n_samples),
            Self::WorstDirection => worst_direction(&singular_values(w), n_samples),
        }
    }

    /// What the optimisers lower: the logarithm, or the value itself where it is one already.
    ///
    /// The minimum is the same; quadratics fit it over the many orders of magnitude between start and end.
    pub(crate) fn logarithm(&self, value: f64) -> f64 {
        match self {
            Self::LogDet => value,
            _ => value.ln(),
        }
    }

    /// Inverse of [`Self::logarithm`].
    pub(crate) fn value_of_logarithm(&self, logarithm: f64) -> f64 {
        match self {
            Self::LogDet => logarithm,
            _ => logarithm.exp(),
        }
    }
}

/// The three condition numbers of one matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionNumbers {
    /// `σ₁ / σ_b`.
    pub two_norm: f64,
    /// `|R₁₁| / |R_bb|` of the column-pivoted QR.
    pub pivoted_qr: f64,
    /// `‖A‖_F ‖A⁻¹‖_F` with `A = WᵀW`.
    pub frobenius: f64,
}

/// `S = max|W| / min|W|` and what stands behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equilibrium {
    /// `S`; infinite when an entry is zero.
    pub ratio: f64,
    /// Number of entries that are zero to rounding.
    pub n_zero: usize,
    /// `max|W|` over the smallest entry that is not zero.
    pub nonzero_ratio: f64,
}

/// Every criterion for one stack of rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditioning {
    /// Of `W` as it is.
    pub raw: ConditionNumbers,
    /// Of `W` with unit columns.
    pub equilibrated: ConditionNumbers,
    /// Entries of `W`; `None` when only a triangular factor was given.
    pub equilibrium: Option<Equilibrium>,
    /// `log det(WᵀW / n_samples)`; minus infinity where `W` is rank deficient.
    pub log_det: f64,
    /// Smallest singular value of `W / √n_samples` (E-optimality).
    pub smallest_singular_value: f64,
    /// `tr (WᵀW / n_samples)⁻¹` (A-optimality).
    pub trace_inverse: f64,
}

impl Conditioning {
    /// From the rows themselves.
    ///
    /// `n_samples` divides the information: rows for the energy model, samples (not rows) for the torque model.
    ///
    /// # Panics
    /// If `w` has fewer rows than columns or an entry that is not finite.
    #[track_caller]
    pub fn of_rows(w: MatRef<'_, f64>, n_samples: usize) -> Self {
        Self {
            equilibrium: Some(equilibrium(w)),
            ..Self::of_factor(w, n_samples)
        }
    }

    /// From any matrix `R` with `RᵀR = WᵀW`, such as the triangular factor of a running QR.
    ///
    /// # Panics
    /// If `r` has fewer rows than columns or an entry that is not finite.
    #[track_caller]
    pub fn of_factor(r: MatRef<'_, f64>, n_samples: usize) -> Self {
        let numbers = |m: MatRef<'_, f64>, sigma: &[f64]| ConditionNumbers {
            two_norm: two_norm(sigma),
            pivoted_qr: pivoted_estimate(m),
            frobenius: frobenius(sigma),
        };
        let sigma = singular_values(r);
        let unit = scaled(r, Scaling::Equilibrated);
        Self {
            raw: numbers(r, &sigma),
            equilibrated: numbers(unit.as_ref(), &singular_values(unit.as_ref())),
            equilibrium: None,
            log_det: log_det(&sigma, n_samples),
            smallest_singular_value: 1.0 / worst_direction(&sigma, n_samples),
            trace_inverse: trace_inverse(&sigma, n_samples),
        }
    }
}

fn two_norm(sigma: &[f64]) -> f64 {
    let (first, last) = (sigma.first(), sigma.last());
    first.zip(last).map_or(1.0, |(&a, &b)| ratio(a, b))
}

fn frobenius(sigma: &[f64]) -> f64 {
    let Some(&first) = sigma.first() else {
        return 1.0;
    };
    // Scaled by σ₁ so that fourth powers neither overflow nor vanish.
    let direct: f64 = sigma.iter().map(|s| (s / first).powi(4)).sum();
    let inverse: f64 = sigma.iter().map(|&s| ratio(first, s).powi(4)).sum();
    (direct * inverse).sqrt()
}

fn log_det(sigma: &[f64], n_samples: usize) -> f64 {
    let log_n = (n_samples as f64).ln();
    sigma.iter().map(|s| 2.0 * s.ln() - log_n).sum()
}

fn trace_inverse(sigma: &[f64], n_samples: usize) -> f64 {
    let n = n_samples as f64;
    sigma.iter().map(|s| n / (s * s)).sum()
}

fn worst_direction(sigma: &[f64], n_samples: usize) -> f64 {
    let smallest = sigma.last().copied().unwrap_or(f64::INFINITY);
    (n_samples as f64).sqrt() / smallest
}

fn pivoted_estimate(w: MatRef<'_, f64>) -> f64 {
    let n = w.ncols();
    if n == 0 {
        return 1.0;
    }
    let qr = w.col_piv_qr();
    let r = qr.thin_R();
    ratio(r[(0, 0)].abs(), r[(n - 1, n - 1)].abs())
}

fn ratio(large: f64, small: f64) -> f64 {
    if small > 0.0 {
        large / small
    } else {
        f64::INFINITY
    }
}

/// Entries below this share of the largest are rounding of what is zero: sums of a hundred terms, each to 1e-16.
const ZERO: f64 = 1e-14;

fn equilibrium(w: MatRef<'_, f64>) -> Equilibrium {
    let largest = w.norm_max();
    let (mut smallest, mut n_zero) = (f64::INFINITY, 0);
    for j in 0..w.ncols() {
        for i in 0..w.nrows() {
            let a = w[(i, j)].abs();
            if a <= ZERO * largest {
                n_zero += 1;
            } else {
                smallest = smallest.min(a);
            }
        }
    }
    let nonzero_ratio = largest / smallest;
    Equilibrium {
        ratio: if n_zero == 0 {
            nonzero_ratio
        } else {
            f64::INFINITY
        },
        n_zero,
        nonzero_ratio,
    }
}

fn scaled(w: MatRef<'_, f64>, scaling: Scaling) -> Mat<f64> {
    let mut unit = w.to_owned();
    if scaling == Scaling::Equilibrated {
        for j in 0..w.ncols() {
            let norm = w.col(j).norm_l2();
            if norm > 0.0 {
                for i in 0..w.nrows() {
                    unit[(i, j)] /= norm;
                }
            }
        }
    }
    unit
}

/// Singular values, largest first.
#[track_caller]
pub(crate) fn singular_values(w: MatRef<'_, f64>) -> Vec<f64> {
    assert!(
        w.nrows() >= w.ncols(),
        "{} rows cannot determine {} columns",
        w.nrows(),
        w.ncols()
    );
    let values = w.singular_values();
    assert!(
        values.is_ok(),
        "the observation matrix has an entry that is not finite"
    );
    values.unwrap_or_default()
}
