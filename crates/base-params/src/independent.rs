//! Keeping the first independent columns.

use faer::Mat;

/// A column in terms of kept columns.
#[derive(Clone)]
pub(crate) struct Relation {
    /// One coefficient for each of the kept columns, or for the first of them.
    pub(crate) coefficients: Vec<f64>,
    /// Norm of what they leave of the column.
    pub(crate) residual: f64,
}

/// Columns kept so far, orthonormalised, and the relations of those that depend on them.
///
/// Source: Gautier 1991; Gram-Schmidt with a second pass, which keeps the basis orthogonal to rounding
/// (Giraud, Langou and Rozložník 2005).
pub(crate) struct KeptColumns {
    /// Position of each kept column in the list handed in.
    pub(crate) kept: Vec<usize>,
    /// The others, with their relations.
    pub(crate) dependent: Vec<(usize, Relation)>,
    /// Orthonormal basis of the kept columns.
    basis: Vec<Vec<f64>>,
    /// Whether a column was refused only because `limit` were kept already.
    pub(crate) exceeded: bool,
    /// Column `k` holds the `k + 1` coefficients of kept column `k` on the basis.
    triangle: Vec<Vec<f64>>,
}

impl KeptColumns {
    /// Goes through `columns` in order and keeps each that leaves a residual above `tolerance` after projection on those
    /// kept before it, up to `limit` of them.
    pub(crate) fn of(columns: &[Vec<f64>], tolerance: f64, limit: usize) -> Self {
        let mut result = Self {
            kept: Vec::new(),
            dependent: Vec::new(),
            exceeded: false,
            basis: Vec::new(),
            triangle: Vec::new(),
        };
        for (position, column) in columns.iter().enumerate() {
            let (mut projection, mut residual) = result.project(column);
            let norm = dot(&residual, &residual).sqrt();
            let independent = norm > tolerance;
            result.exceeded |= independent && result.kept.len() == limit;
            if independent && result.kept.len() < limit {
                for value in &mut residual {
                    *value /= norm;
                }
                projection.push(norm);
                result.kept.push(position);
                result.basis.push(residual);
                result.triangle.push(projection);
            } else {
                let coefficients = result.solve(projection);
                result.dependent.push((
                    position,
                    Relation {
                        coefficients,
                        residual: norm,
                    },
                ));
            }
        }
        result
    }

    /// Coefficients of `column` on the basis, and what is left of it.
    fn project(&self, column: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut residual = column.to_vec();
        let mut projection = vec![0.0; self.basis.len()];
        for _pass in 0..2 {
            for (p, q) in projection.iter_mut().zip(&self.basis) {
                let share = dot(q, &residual);
                *p += share;
                for (value, q) in residual.iter_mut().zip(q) {
                    *value -= share * q;
                }
            }
        }
        (projection, residual)
    }

    /// A column in terms of the kept columns.
    pub(crate) fn relation(&self, column: &[f64]) -> Relation {
        let (projection, residual) = self.project(column);
        Relation {
            coefficients: self.solve(projection),
            residual: dot(&residual, &residual).sqrt(),
        }
    }

    /// From coefficients on the basis to coefficients on the kept columns.
    fn solve(&self, mut x: Vec<f64>) -> Vec<f64> {
        for k in (0..x.len()).rev() {
            let column = &self.triangle[k];
            x[k] /= column[k];
            for i in 0..k {
                x[i] -= column[i] * x[k];
            }
        }
        x
    }

    /// The triangle of the kept columns.
    pub(crate) fn triangle(&self) -> Mat<f64> {
        let n = self.kept.len();
        Mat::from_fn(n, n, |i, j| if i <= j { self.triangle[j][i] } else { 0.0 })
    }
}

/// Scalar product in a fixed order, four sums side by side.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_chunks, a_rest) = a.as_chunks::<4>();
    let (b_chunks, b_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in a_chunks.iter().zip(b_chunks) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}
