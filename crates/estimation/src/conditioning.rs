//! How far errors of the data are magnified.

use crate::error::Error;
use crate::information::InformationFactor;
use crate::triangular::{column_norms, ratio_of_extremes, singular_values};
use faer::{Mat, MatRef};

/// Beyond this condition number of unit columns half of the digits of `f64` are lost to the first order, and the second-order term
/// `cond² ε ‖ρ‖/‖y‖` of the perturbation theory (Wedin 1973) reaches the size of the solution. `1/√ε`.
pub const NEAR_SINGULAR_CONDITION: f64 = 6.7e7;

/// Condition numbers of `W` in the 2-norm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionNumber {
    /// Of `W` as it stands: depends on the units of the parameters.
    pub raw: f64,
    /// Of `W` with columns of unit length: within `√n` of the least that any units can reach (van der Sluis 1969).
    pub equilibrated: f64,
}

/// Condition numbers of the rows pushed so far; infinite where a column is zero.
///
/// Of whitened rows this is the condition of the weighted problem.
///
/// # Errors
/// [`Error::NoConvergence`], [`Error::Overflow`].
pub fn condition_number(factor: &InformationFactor) -> Result<ConditionNumber, Error> {
    let parts = factor.parts();
    if !parts.observation_norm().is_finite()
        || column_norms(parts.r.as_ref())
            .iter()
            .any(|d| !d.is_finite())
    {
        return Err(Error::Overflow {
            n_rows: factor.n_rows(),
        });
    }
    condition_of(parts.r.as_ref())
}

pub(crate) fn condition_of(r: MatRef<'_, f64>) -> Result<ConditionNumber, Error> {
    let norms = column_norms(r);
    let raw = ratio_of_extremes(&singular_values(r)?);
    let equilibrated = if norms.contains(&0.0) {
        f64::INFINITY
    } else {
        let unit = Mat::from_fn(r.nrows(), r.ncols(), |i, j| r[(i, j)] / norms[j]);
        ratio_of_extremes(&singular_values(unit.as_ref())?)
    };
    Ok(ConditionNumber { raw, equilibrated })
}

/// Bound (12) of Gautier & Khalil on `‖δX‖/‖X‖` for an error `δY` of the observations: `Cond(W) ‖δY‖/‖Y‖`.
///
/// Holds as it stands for square `W` (r = b); for r > b with `‖Y‖` replaced by `‖W X‖`. All norms Euclidean.
///
/// # Panics
/// If `observation_norm` is not positive.
#[track_caller]
pub fn observation_error_bound(
    condition_number: f64,
    error_norm: f64,
    observation_norm: f64,
) -> f64 {
    assert!(observation_norm > 0.0, "norm of Y is {observation_norm}");
    condition_number * error_norm / observation_norm
}

/// Bound (13) of Gautier & Khalil on `‖δX‖/‖X + δX‖` for an error `δW` of the matrix: `Cond(W) ‖δW‖/‖W‖`.
///
/// Holds for square `W`; 2-norms of matrices.
///
/// # Panics
/// If `matrix_norm` is not positive.
#[track_caller]
pub fn matrix_error_bound(condition_number: f64, error_norm: f64, matrix_norm: f64) -> f64 {
    assert!(matrix_norm > 0.0, "norm of W is {matrix_norm}");
    condition_number * error_norm / matrix_norm
}
