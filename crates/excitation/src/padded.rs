//! Small symmetric matrices in padded rows: what a design of a few dozen rows needs in a microsecond.
//!
//! A matrix of `n` columns has rows of [`stride`]`(n)` entries, the last ones zero, so that every loop runs over whole
//! blocks of eight and vectorises; callers put a `pulp` dispatch around a chain of these functions. No sum changes its
//! order with the width of the registers, so neither do its bits.

use crate::dense;

/// Entries of a block.
const LANES: usize = 8;

/// Length of a padded row.
pub(crate) fn stride(n: usize) -> usize {
    n.next_multiple_of(LANES)
}

/// `WᵀW` of padded rows of `n` columns, all entries.
#[inline(always)]
pub(crate) fn gram(rows: &[f64], n: usize, out: &mut [f64]) {
    let stride = stride(n);
    for (i, out) in out.chunks_exact_mut(stride).take(n).enumerate() {
        for (block, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let mut sum = [0.0; LANES];
            for row in rows.chunks_exact(stride) {
                let (wi, w) = (row[i], &row.as_chunks::<LANES>().0[block]);
                for k in 0..LANES {
                    sum[k] += wi * w[k];
                }
            }
            *out = sum;
        }
    }
}

/// `A B` of square padded matrices, or of padded rows `A` with a square `B`.
#[inline(always)]
pub(crate) fn product(a: &[f64], b: &[f64], n: usize, out: &mut [f64]) {
    let stride = stride(n);
    for (a, out) in a.chunks_exact(stride).zip(out.chunks_exact_mut(stride)) {
        for (block, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let mut sum = [0.0; LANES];
            for (a, b) in a.iter().zip(b.chunks_exact(stride)) {
                let b = &b.as_chunks::<LANES>().0[block];
                for k in 0..LANES {
                    sum[k] += a * b[k];
                }
            }
            *out = sum;
        }
    }
}

/// Lower Cholesky factor over the lower triangle; `false` when `a` is not positive definite.
#[inline(always)]
pub(crate) fn cholesky(a: &mut [f64], n: usize) -> bool {
    dense::cholesky_strided(a, n, stride(n))
}

/// `A⁻¹` from the lower factor; `scratch` takes the inverse of the factor.
#[inline(always)]
pub(crate) fn inverse_of_factor(l: &[f64], n: usize, scratch: &mut [f64], out: &mut [f64]) {
    let stride = stride(n);
    // Row i of L⁻¹ is -(Σ_{k<i} l_ik row_k) / l_ii, with 1 / l_ii on the diagonal; it ends at the diagonal, so whole
    // padded rows may be added.
    for i in 0..n {
        let (above, row) = scratch.split_at_mut(i * stride);
        let row = &mut row[..stride];
        row.fill(0.0);
        for (factor, above) in l[i * stride..].iter().zip(above.chunks_exact(stride)) {
            for (r, a) in row.iter_mut().zip(above) {
                *r -= factor * a;
            }
        }
        let inverse = 1.0 / l[i * stride + i];
        for r in row.iter_mut() {
            *r *= inverse;
        }
        row[i] = inverse;
    }
    // A⁻¹ = L⁻ᵀ L⁻¹ is the Gram matrix of the rows of L⁻¹.
    gram(&scratch[..n * stride], n, out);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value that differs from entry to entry.
    fn entry(i: usize, j: usize) -> f64 {
        ((7 * i + 3 * j * j + 1) % 11) as f64 - 4.5
    }

    #[test]
    fn identity_products_inverses_and_padding() {
        let (n, rows) = (11, 20);
        let stride = stride(n);
        assert_eq!(stride, 16);
        let mut w = vec![0.0; rows * stride];
        for i in 0..rows {
            for j in 0..n {
                w[i * stride + j] = entry(i, j) + if i == j { 30.0 } else { 0.0 };
            }
        }
        let mut a = vec![f64::NAN; n * stride];
        gram(&w, n, &mut a);
        for i in 0..n {
            for j in 0..stride {
                let sum: f64 = (0..rows)
                    .map(|k| w[k * stride + i] * w[k * stride + j])
                    .sum();
                // Integers and halves: exact whatever the order.
                assert_eq!(a[i * stride + j], sum, "{i} {j}");
            }
        }
        let mut factor = a.clone();
        assert!(cholesky(&mut factor, n));
        let (mut scratch, mut inverse) = (a.clone(), a.clone());
        inverse_of_factor(&factor, n, &mut scratch, &mut inverse);
        let mut one = a.clone();
        product(&a, &inverse, n, &mut one);
        for i in 0..n {
            for j in 0..stride {
                let expected = if i == j { 1.0 } else { 0.0 };
                // Rounding times the condition number, below a hundred.
                assert!((one[i * stride + j] - expected).abs() < 1e-12, "{i} {j}");
            }
        }
    }
}
