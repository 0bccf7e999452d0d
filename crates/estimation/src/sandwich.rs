//! Covariance of an unweighted fit whose rows are not equally noisy.

use crate::error::Error;
use crate::information::InformationFactor;
use crate::rank::rank_factor;
use crate::solve::unit_covariance;
use crate::triangular::column_norms;
use faer::Mat;

/// `(WᵀW)⁻¹ (SᵀS) (WᵀW)⁻¹`: `bread` has seen the rows of `W`, `meat` the rows of `S` (its observations do not matter).
///
/// With `S` the rows `Lᵀ W_t` ([`crate::NoiseCovariance::colour`]) this is the covariance of ordinary least squares under joint noise `Ω = L Lᵀ`;
/// with one row `Σ W_tᵀ r_t` for each block of consecutive samples it holds for noise that is correlated within the blocks (White
/// 1980). `None` if `W` is rank-deficient: [`crate::solve`] then says why.
///
/// # Errors
/// [`Error::Overflow`].
///
/// # Panics
/// If the factors have different numbers of columns.
#[track_caller]
pub fn sandwich_covariance(
    bread: &InformationFactor,
    meat: &InformationFactor,
) -> Result<Option<Mat<f64>>, Error> {
    let n = bread.n_columns();
    assert_eq!(
        n,
        meat.n_columns(),
        "bread of {n} columns, meat of {}",
        meat.n_columns()
    );
    let parts = bread.parts();
    let norms = column_norms(parts.r.as_ref());
    if norms.iter().any(|d| !d.is_finite()) {
        return Err(Error::Overflow {
            n_rows: bread.n_rows(),
        });
    }
    if rank_factor(parts.r.as_ref(), &parts.z).rank < n {
        return Ok(None);
    }
    let half = meat.parts().r * unit_covariance(&parts, &norms);
    Ok(Some(half.transpose() * &half))
}
