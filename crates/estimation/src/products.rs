//! The normal equations: the triangle of rows known by their products alone.

use crate::conditioning::condition_of;
use crate::information::InformationFactor;
use faer::{Mat, MatRef};

/// Largest condition number of unit columns for which products of the rows serve in place of the rows.
///
/// Cholesky's method does not feel the units of the columns (van der Sluis 1969), and its values carry relative errors of
/// about `n u cond²` (`n` columns, `u = 1.1e-16`): 5e-7 for fifty columns here, far below any noise.
pub const PRODUCTS_LIMIT: f64 = 1.0e4;
/// Least share of the residual in the observations, squared, that products still tell from rounding: a relative error of the
/// residual's norm of `n u / 2` over this, 3e-3 for fifty columns.
const LEAST_RESIDUAL: f64 = 1.0e-12;

impl InformationFactor {
    /// The factor of rows known by `[W | y]ᵀ [W | y]`, `(n + 1) × (n + 1)`: their Cholesky factor.
    ///
    /// A sixth of the work of the running QR on the rows, and half its digits. `None` where that is not enough: the
    /// condition of unit columns exceeds [`PRODUCTS_LIMIT`], the residual drowns in the rounding of the products, or a product
    /// is not finite. Fold the rows in then.
    /// Source: Golub & Van Loan 2013, section 5.3.2.
    ///
    /// # Panics
    /// If the products are not square, or there are none.
    #[track_caller]
    pub fn from_products(products: MatRef<'_, f64>, n_rows: usize) -> Option<Self> {
        assert!(
            products.nrows() == products.ncols() && products.ncols() > 0,
            "products are {} × {}, not those of columns and an observation",
            products.nrows(),
            products.ncols()
        );
        let n = products.ncols() - 1;
        let norms: Vec<f64> = (0..=n).map(|k| products[(k, k)].sqrt()).collect();
        if !norms.iter().all(|d| *d > 0.0 && d.is_finite()) {
            return None;
        }
        let unit = Mat::from_fn(n + 1, n + 1, |i, j| {
            products[(i.min(j), i.max(j))] / (norms[i] * norms[j])
        });
        let r = cholesky(unit.as_ref())?;
        if r[(n, n)].powi(2) < LEAST_RESIDUAL {
            return None;
        }
        let condition = condition_of(r.get(..n, ..n)).ok()?;
        if condition.equilibrated > PRODUCTS_LIMIT {
            return None;
        }
        Some(Self::of_triangle(n, n_rows, |i, j| r[(i, j)] * norms[j]))
    }
}

/// Upper `R` with `RᵀR = A`; `None` where a pivot is not positive.
fn cholesky(a: MatRef<'_, f64>) -> Option<Mat<f64>> {
    let n = a.nrows();
    let mut r = Mat::zeros(n, n);
    for j in 0..n {
        for i in 0..=j {
            let mut rest = a[(i, j)];
            for k in 0..i {
                rest -= r[(k, i)] * r[(k, j)];
            }
            if i < j {
                r[(i, j)] = rest / r[(i, i)];
            } else if rest > 0.0 {
                r[(j, j)] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(r)
}
