//! Singular values of the rows, read from their triangle.

use super::data::Spectrum;
use faer::Mat;
use idim_estimation::InformationFactor;

impl Spectrum {
    /// Of the rows a factor has seen: `W` and its triangle have the same singular values.
    pub(crate) fn of_factor(factor: &InformationFactor) -> Self {
        let r = factor.parts().r;
        let n = r.ncols();
        let norms: Vec<f64> = (0..n).map(|j| r.col(j).norm_l2()).collect();
        let unit = Mat::from_fn(n, n, |i, j| {
            if norms[j] > 0.0 {
                r[(i, j)] / norms[j]
            } else {
                0.0
            }
        });
        // A decomposition that does not converge leaves an empty list, and the page without the picture.
        Self {
            raw: r.singular_values().unwrap_or_default(),
            equilibrated: unit.singular_values().unwrap_or_default(),
        }
    }
}
