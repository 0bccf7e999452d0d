//! Small dense helpers on the triangle.

use crate::error::Error;
use faer::{Mat, MatRef};

/// Euclidean norm of every column.
pub(crate) fn column_norms(r: MatRef<'_, f64>) -> Vec<f64> {
    (0..r.ncols()).map(|j| r.col(j).norm_l2()).collect()
}

/// Solves `R x = b` for upper triangular `R` with a diagonal free of zeros.
pub(crate) fn solve_upper(r: MatRef<'_, f64>, b: &[f64]) -> Vec<f64> {
    let mut x = b.to_vec();
    for j in (0..r.ncols()).rev() {
        x[j] /= r[(j, j)];
        for i in 0..j {
            x[i] -= r[(i, j)] * x[j];
        }
    }
    x
}

/// Inverse of upper triangular `R` with a diagonal free of zeros.
pub(crate) fn invert_upper(r: MatRef<'_, f64>) -> Mat<f64> {
    let n = r.ncols();
    let mut inverse = Mat::zeros(n, n);
    let mut unit = vec![0.0; n];
    for k in 0..n {
        unit.fill(0.0);
        unit[k] = 1.0;
        let x = solve_upper(r, &unit);
        for i in 0..=k {
            inverse[(i, k)] = x[i];
        }
    }
    inverse
}

/// Singular values, largest first.
pub(crate) fn singular_values(r: MatRef<'_, f64>) -> Result<Vec<f64>, Error> {
    r.singular_values()
        .map_err(|_| Error::NoConvergence { n: r.ncols() })
}

/// Ratio of the extreme singular values; infinite when the smallest is zero.
pub(crate) fn ratio_of_extremes(singular_values: &[f64]) -> f64 {
    match (singular_values.first(), singular_values.last()) {
        (Some(&largest), Some(&smallest)) if smallest > 0.0 => largest / smallest,
        (None, None) => 1.0,
        _ => f64::INFINITY,
    }
}
