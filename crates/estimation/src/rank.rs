//! Which columns the rows can tell apart.

use crate::triangular::column_norms;
use faer::{Mat, MatRef};

/// A column shorter than this share of the longest vanishes. Columns born of cos(π/2) = 6e-17 are some 1e-16 of the longest;
/// honest columns in SI units stay above 1e-9.
pub const VANISHING_COLUMN: f64 = 1e-13;

/// A pivot of the equilibrated triangle below this share of the first is rounding. Dependent columns leave some 1e-16 to 1e-15, and
/// the worst honest problem in use as a test (NIST Filip) 1e-10.
pub const RANK_TOLERANCE: f64 = 1e-12;

/// A unit column enters a vanishing combination when its coefficient exceeds this share of the largest: the rounding of the combination,
/// `ε` over the smallest pivot kept, stays below the square root of `ε` for every well-separated rank.
const PARTICIPATION: f64 = 1e-8;

/// Pivoted QR of the triangle with unit columns, cut at the rank.
pub(crate) struct RankFactor {
    /// Columns of `W` in pivot order, the vanishing ones last.
    pub(crate) order: Vec<usize>,
    pub(crate) rank: usize,
    pub(crate) vanishing: Vec<usize>,
    /// Norms of the columns, in the order of `W`; 1 for those that vanish.
    pub(crate) scale: Vec<f64>,
    /// Upper triangular, `rank × n`, unit columns in pivot order (zero for those that vanish).
    pub(crate) r: Mat<f64>,
    /// `Q'` of this factorisation applied to `z`; the first `rank` entries.
    pub(crate) z: Vec<f64>,
    /// Smallest pivot kept and largest dropped, relative to the first.
    pub(crate) kept: f64,
    pub(crate) dropped: f64,
}

pub(crate) fn rank_factor(r: MatRef<'_, f64>, z: &[f64]) -> RankFactor {
    let n = r.ncols();
    let norms = column_norms(r);
    let longest = norms.iter().copied().fold(0.0, f64::max);
    let (active, vanishing): (Vec<usize>, Vec<usize>) =
        (0..n).partition(|&j| norms[j] > VANISHING_COLUMN * longest);
    let mut scale = vec![1.0; n];
    for &j in &active {
        scale[j] = norms[j];
    }

    let unit = Mat::from_fn(n, active.len(), |i, j| r[(i, active[j])] / scale[active[j]]);
    let qr = unit.col_piv_qr();
    let pivoted = qr.R();
    let pivot = |k: usize| pivoted[(k, k)].abs();
    let first = if active.is_empty() { 1.0 } else { pivot(0) };
    let rank = (0..active.len())
        .take_while(|&k| pivot(k) > RANK_TOLERANCE * first)
        .count();
    let (forward, _) = qr.P().arrays();
    let order: Vec<usize> = forward
        .iter()
        .map(|&k| active[k])
        .chain(vanishing.iter().copied())
        .collect();
    let q = qr.compute_Q();
    let z = (0..rank)
        .map(|k| (0..n).map(|i| q[(i, k)] * z[i]).sum())
        .collect();
    RankFactor {
        kept: if rank == 0 {
            0.0
        } else {
            pivot(rank - 1) / first
        },
        dropped: if rank < active.len() {
            pivot(rank) / first
        } else {
            0.0
        },
        r: Mat::from_fn(rank, n, |i, j| {
            if j < active.len() && i <= j {
                pivoted[(i, j)]
            } else {
                0.0
            }
        }),
        order,
        rank,
        vanishing,
        scale,
        z,
    }
}

impl RankFactor {
    /// Combinations of columns that vanish, `W v = 0`: one for each column beyond the rank, whose coefficient is 1.
    ///
    /// Entries that are rounding are exactly zero.
    pub(crate) fn null_combinations(&self) -> Vec<Vec<f64>> {
        let n = self.order.len();
        let leading = self.r.as_ref().submatrix(0, 0, self.rank, self.rank);
        (self.rank..n)
            .map(|k| {
                let column: Vec<f64> = (0..self.rank).map(|i| -self.r[(i, k)]).collect();
                let coefficients = crate::triangular::solve_upper(leading, &column);
                let largest = coefficients.iter().fold(1.0_f64, |a, c| a.max(c.abs()));
                let mut v = vec![0.0; n];
                v[self.order[k]] = 1.0;
                for (i, c) in coefficients.into_iter().enumerate() {
                    if c.abs() > PARTICIPATION * largest {
                        v[self.order[i]] =
                            c / self.scale[self.order[i]] * self.scale[self.order[k]];
                    }
                }
                v
            })
            .collect()
    }
}
