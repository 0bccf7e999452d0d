//! Noise that differs and correlates between joints.
//!
//! Rows come sample by sample, `row = sample · n_joints + joint`; noise is independent from sample to sample.

use crate::error::Error;
use faer::{Mat, MatRef};

/// Entries across the diagonal may differ by this share of the diagonal: the rounding of a product.
const SYMMETRY: f64 = 1e-10;
/// A joint whose variance, given the joints before it, is below this share of its own is no independent witness.
const DEFINITE: f64 = 1e-14;

/// Covariance `Ω` of the noise of the joints within one sample, symmetric positive definite; units of the observations squared.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseCovariance {
    covariance: Mat<f64>,
    /// `L` of `Ω = L Lᵀ`.
    cholesky: Mat<f64>,
}

impl NoiseCovariance {
    /// From the matrix.
    ///
    /// # Errors
    /// [`Error::NotSymmetric`], [`Error::NotPositiveDefinite`] (also for entries that are not finite).
    ///
    /// # Panics
    /// If the matrix is not square.
    #[track_caller]
    pub fn new(covariance: MatRef<'_, f64>) -> Result<Self, Error> {
        let n = covariance.nrows();
        assert_eq!(
            n,
            covariance.ncols(),
            "a covariance of {n} x {}",
            covariance.ncols()
        );
        for row in 0..n {
            for column in 0..row {
                let (value, mirror) = (covariance[(row, column)], covariance[(column, row)]);
                let size = (covariance[(row, row)] * covariance[(column, column)])
                    .abs()
                    .sqrt();
                if (value - mirror).abs() > SYMMETRY * size {
                    return Err(Error::NotSymmetric {
                        row,
                        column,
                        value,
                        mirror,
                    });
                }
            }
        }
        let mut l = Mat::<f64>::zeros(n, n);
        for j in 0..n {
            let variance = covariance[(j, j)] - (0..j).map(|k| l[(j, k)] * l[(j, k)]).sum::<f64>();
            // Written so that NaN and infinity fail too.
            if !(variance > DEFINITE * covariance[(j, j)] && variance.is_finite()) {
                return Err(Error::NotPositiveDefinite { joint: j, variance });
            }
            l[(j, j)] = variance.sqrt();
            for i in j + 1..n {
                let inner: f64 = (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum();
                l[(i, j)] = (covariance[(i, j)] - inner) / l[(j, j)];
            }
        }
        Ok(Self {
            covariance: covariance.to_owned(),
            cholesky: l,
        })
    }

    /// From one standard deviation a joint, without correlation.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a standard deviation that is not positive and finite.
    pub fn diagonal(standard_deviation: &[f64]) -> Result<Self, Error> {
        let n = standard_deviation.len();
        if let Some(&value) = standard_deviation
            .iter()
            .find(|s| !(**s > 0.0 && s.is_finite()))
        {
            return Err(Error::OutOfRange {
                name: "the standard deviation of a joint",
                value,
                rule: "positive and finite",
            });
        }
        let diagonal = |power: i32| {
            Mat::from_fn(n, n, |i, j| {
                if i == j {
                    standard_deviation[i].powi(power)
                } else {
                    0.0
                }
            })
        };
        Ok(Self {
            covariance: diagonal(2),
            cholesky: diagonal(1),
        })
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.covariance.nrows()
    }

    /// `Ω`.
    pub fn covariance(&self) -> MatRef<'_, f64> {
        self.covariance.as_ref()
    }

    /// Standard deviation of each joint's noise.
    pub fn standard_deviation(&self) -> Vec<f64> {
        (0..self.n_joints())
            .map(|j| self.covariance[(j, j)].sqrt())
            .collect()
    }

    /// Correlation of two joints' noise.
    pub fn correlation(&self, joint: usize, other: usize) -> f64 {
        let c = &self.covariance;
        c[(joint, other)] / (c[(joint, joint)] * c[(other, other)]).sqrt()
    }

    /// Turns rows into `L⁻¹ [W_t | y_t]` in place, sample by sample: their noise is then white, of unit variance.
    ///
    /// # Panics
    /// If the rows are not whole samples, or `w` does not have the same number of columns in each.
    #[track_caller]
    pub fn whiten(&self, w: &mut [f64], y: &mut [f64]) {
        let columns = self.shape(w, y);
        let n = self.n_joints();
        for (t, y) in y.chunks_exact_mut(n).enumerate() {
            self.whiten_sample(&mut w[t * n * columns..][..n * columns], columns);
            self.whiten_sample(y, 1);
        }
    }

    /// Turns rows into `Lᵀ [W_t | y_t]` in place: the inner factor of the covariance of an unweighted fit under this noise.
    ///
    /// # Panics
    /// As [`NoiseCovariance::whiten`].
    #[track_caller]
    pub fn colour(&self, w: &mut [f64], y: &mut [f64]) {
        let columns = self.shape(w, y);
        let n = self.n_joints();
        for (t, y) in y.chunks_exact_mut(n).enumerate() {
            self.colour_sample(&mut w[t * n * columns..][..n * columns], columns);
            self.colour_sample(y, 1);
        }
    }

    #[track_caller]
    fn shape(&self, w: &[f64], y: &[f64]) -> usize {
        let n = self.n_joints();
        assert_eq!(
            y.len() % n,
            0,
            "{} rows are not whole samples of {n} joints",
            y.len()
        );
        let columns = w.len().checked_div(y.len()).unwrap_or(0);
        assert_eq!(
            w.len(),
            columns * y.len(),
            "{} entries of W for {} rows",
            w.len(),
            y.len()
        );
        columns
    }

    /// Forward substitution over the rows of one sample.
    fn whiten_sample(&self, rows: &mut [f64], columns: usize) {
        for i in 0..self.n_joints() {
            let (before, row) = rows.split_at_mut(i * columns);
            let row = &mut row[..columns];
            for k in 0..i {
                let factor = self.cholesky[(i, k)];
                if factor != 0.0 {
                    for (r, b) in row.iter_mut().zip(&before[k * columns..]) {
                        *r -= factor * b;
                    }
                }
            }
            let scale = 1.0 / self.cholesky[(i, i)];
            for r in row {
                *r *= scale;
            }
        }
    }

    fn colour_sample(&self, rows: &mut [f64], columns: usize) {
        let n = self.n_joints();
        for i in 0..n {
            let (row, after) = rows[i * columns..].split_at_mut(columns);
            for r in row.iter_mut() {
                *r *= self.cholesky[(i, i)];
            }
            for k in i + 1..n {
                let factor = self.cholesky[(k, i)];
                if factor != 0.0 {
                    for (r, a) in row.iter_mut().zip(&after[(k - i - 1) * columns..]) {
                        *r += factor * a;
                    }
                }
            }
        }
    }
}

/// Running sum of the residuals' products, joint by joint.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualCovariance {
    n_joints: usize,
    n_samples: usize,
    /// `Σ r rᵀ`, row-major, lower half.
    products: Vec<f64>,
    residual: Vec<f64>,
}

impl ResidualCovariance {
    /// No residual yet.
    pub fn new(n_joints: usize) -> Self {
        Self {
            n_joints,
            n_samples: 0,
            products: vec![0.0; n_joints * n_joints],
            residual: vec![0.0; n_joints],
        }
    }

    /// Adds the residuals `y - W x` of rows of whole samples.
    ///
    /// # Panics
    /// If the rows are not whole samples or `w` has not `x.len()` columns.
    #[track_caller]
    pub fn push_rows(&mut self, w: &[f64], y: &[f64], x: &[f64]) {
        let (n, p) = (self.n_joints, x.len());
        assert_eq!(
            y.len() % n,
            0,
            "{} rows are not whole samples of {n} joints",
            y.len()
        );
        assert_eq!(
            w.len(),
            y.len() * p,
            "{} entries of W for {} rows of {p}",
            w.len(),
            y.len()
        );
        for (t, y) in y.chunks_exact(n).enumerate() {
            for i in 0..n {
                let row = &w[(t * n + i) * p..][..p];
                self.residual[i] = y[i] - std::iter::zip(row, x).map(|(w, x)| w * x).sum::<f64>();
                for k in 0..=i {
                    self.products[i * n + k] += self.residual[i] * self.residual[k];
                }
            }
            self.n_samples += 1;
        }
    }

    /// `Σ r rᵀ / (N - p/n)`: the `p` parameters cost every joint the same share of its `N` samples (their sum is exact).
    ///
    /// # Errors
    /// [`Error::TooFewRows`] if nothing is left after the parameters, [`Error::NotPositiveDefinite`] if a joint fits exactly.
    pub fn full(&self, n_parameters: usize) -> Result<NoiseCovariance, Error> {
        let (n, divisor) = (self.n_joints, self.divisor(n_parameters)?);
        let matrix = Mat::from_fn(n, n, |i, j| {
            self.products[i.max(j) * n + i.min(j)] / divisor
        });
        NoiseCovariance::new(matrix.as_ref())
    }

    /// The diagonal of [`ResidualCovariance::full`] alone: joints weighted, correlations ignored (Gautier & Poignet 2001).
    ///
    /// # Errors
    /// As [`ResidualCovariance::full`].
    pub fn diagonal(&self, n_parameters: usize) -> Result<NoiseCovariance, Error> {
        let (n, divisor) = (self.n_joints, self.divisor(n_parameters)?);
        let matrix = Mat::from_fn(n, n, |i, j| {
            if i == j {
                self.products[i * n + i] / divisor
            } else {
                0.0
            }
        });
        NoiseCovariance::new(matrix.as_ref())
    }

    fn divisor(&self, n_parameters: usize) -> Result<f64, Error> {
        let rows = self.n_samples * self.n_joints;
        if rows <= n_parameters {
            return Err(Error::TooFewRows {
                n_rows: rows,
                n_columns: n_parameters,
                needed: n_parameters + 1,
            });
        }
        Ok((rows - n_parameters) as f64 / self.n_joints as f64)
    }
}
