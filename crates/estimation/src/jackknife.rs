//! How a fit scatters when every block of consecutive rows is left out in turn.
//!
//! The sandwich of block scores uses residuals of a fit that has seen the block: with `p` parameters and `G` blocks it is too small
//! by some `p/G`, a third in a log of half a minute. A residual of a fit without the block is not.

use crate::triangular::{invert_upper, solve_upper};
use faer::{Mat, MatRef};

/// Covariance of an estimate for noise correlated within blocks, without a model of the noise.
///
/// With `A = WᵀW = RᵀR`, `A_g` and `s_g = W_gᵀ r_g` of a block, leaving it out moves the estimate by `(A - A_g)⁻¹ s_g`, exactly.
/// Source: Bell & McCaffrey 2002, estimator CR3; MacKinnon, Nielsen & Webb 2023.
#[derive(Debug, Clone)]
pub(crate) struct BlockJackknife<'a> {
    r: MatRef<'a, f64>,
    inverse: Mat<f64>,
    /// `A_g`, lower half.
    gram: Mat<f64>,
    score: Vec<f64>,
    squares: Vec<f64>,
    n_blocks: usize,
}

/// A block may determine this share of a direction; of more, what the others say is rounding.
const LARGEST_SHARE: f64 = 1.0 - 1e-6;

impl<'a> BlockJackknife<'a> {
    /// Of a fit with this triangle, whose diagonal is free of zeros.
    pub(crate) fn new(r: MatRef<'a, f64>) -> Self {
        let n = r.ncols();
        Self {
            r,
            inverse: invert_upper(r),
            gram: Mat::zeros(n, n),
            score: vec![0.0; n],
            squares: vec![0.0; n],
            n_blocks: 0,
        }
    }

    /// Adds a row of the block and its residual.
    pub(crate) fn push(&mut self, row: &[f64], residual: f64) {
        for (j, &x) in row.iter().enumerate() {
            self.score[j] += x * residual;
            for (i, &y) in row.iter().enumerate().skip(j) {
                self.gram[(i, j)] += x * y;
            }
        }
    }

    /// Ends a block.
    pub(crate) fn end_block(&mut self) {
        let n = self.score.len();
        let gram = Mat::from_fn(n, n, |i, j| self.gram[(i.max(j), i.min(j))]);
        // In the coordinates `R x`: the others' share of the information is 1 - M.
        let m = self.inverse.transpose() * gram * &self.inverse;
        let score: Vec<f64> = (0..n)
            .map(|k| (0..=k).map(|i| self.inverse[(i, k)] * self.score[i]).sum())
            .collect();
        let moved = solve_upper(self.r, &without_block(&m, score));
        for (square, moved) in self.squares.iter_mut().zip(moved) {
            *square += moved * moved;
        }
        self.gram.fill(0.0);
        self.score.fill(0.0);
        self.n_blocks += 1;
    }

    /// Number of blocks ended.
    pub(crate) fn n_blocks(&self) -> usize {
        self.n_blocks
    }

    /// Variance of each value.
    pub(crate) fn variance(&self) -> Vec<f64> {
        let g = self.n_blocks as f64;
        self.squares.iter().map(|s| s * (g - 1.0) / g).collect()
    }
}

/// `(1 - M)⁻¹ s` by Cholesky; directions that the block alone determines are held at [`LARGEST_SHARE`].
fn without_block(m: &Mat<f64>, mut s: Vec<f64>) -> Vec<f64> {
    let n = s.len();
    let mut l = Mat::<f64>::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            let unit = if i == j { 1.0 } else { 0.0 };
            let inner: f64 = (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum();
            let entry = unit - m[(i, j)] - inner;
            l[(i, j)] = if i == j {
                entry.max(1.0 - LARGEST_SHARE).sqrt()
            } else {
                entry / l[(j, j)]
            };
        }
    }
    for i in 0..n {
        let inner: f64 = (0..i).map(|k| l[(i, k)] * s[k]).sum();
        s[i] = (s[i] - inner) / l[(i, i)];
    }
    for i in (0..n).rev() {
        let inner: f64 = (i + 1..n).map(|k| l[(k, i)] * s[k]).sum();
        s[i] = (s[i] - inner) / l[(i, i)];
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::information::InformationFactor;
    use crate::solve::solve;

    #[test]
    #[expect(clippy::unwrap_used, reason = "a test")]
    fn identity_leaving_a_block_out_is_a_fit_without_it() {
        let (n, blocks, per) = (3, 6, 5);
        let rows: Vec<([f64; 3], f64)> = (0..blocks * per)
            .map(|k| {
                let t = f64::from(k);
                let row = [(0.7 * t).sin(), (0.3 * t).cos(), 0.1 * t - 1.0];
                (row, row[0] - 2.0 * row[1] + (t * t).sin())
            })
            .collect();
        let fit = |without: Option<usize>| {
            let mut factor = InformationFactor::new(n);
            for (k, (row, y)) in rows.iter().enumerate() {
                if without != Some(k / per as usize) {
                    factor.push_rows(row, &[*y]).unwrap();
                }
            }
            let values = solve(&factor).unwrap().determined().unwrap().values;
            (factor, values)
        };
        let (factor, all) = fit(None);
        let parts = factor.parts();
        let mut jackknife = BlockJackknife::new(parts.r.as_ref());
        let mut by_hand = vec![0.0; n];
        for block in 0..blocks as usize {
            for (row, y) in &rows[block * per as usize..][..per as usize] {
                let predicted: f64 = row.iter().zip(&all).map(|(w, x)| w * x).sum();
                jackknife.push(row, y - predicted);
            }
            jackknife.end_block();
            let without = fit(Some(block)).1;
            for k in 0..n {
                by_hand[k] += (without[k] - all[k]).powi(2) * 5.0 / 6.0;
            }
        }
        assert_eq!(jackknife.n_blocks(), 6);
        for (ours, theirs) in jackknife.variance().iter().zip(&by_hand) {
            assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
        }
    }
}
