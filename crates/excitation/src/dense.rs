//! Inner products in a fixed order, and the Cholesky factor of a matrix kept row by row.

/// Lower Cholesky factor over the lower triangle; `false` when `a` is not positive definite.
pub(crate) fn cholesky(a: &mut [f64], n: usize) -> bool {
    cholesky_strided(a, n, n)
}

/// The same for rows `stride` apart.
#[inline(always)]
pub(crate) fn cholesky_strided(a: &mut [f64], n: usize, stride: usize) -> bool {
    for i in 0..n {
        let (above, row) = a.split_at_mut(i * stride);
        for j in 0..i {
            let other = &above[j * stride..][..=j];
            row[j] = (row[j] - dot(&row[..j], &other[..j])) / other[j];
        }
        let d = row[i] - dot(&row[..i], &row[..i]);
        if d.is_nan() || d <= 0.0 {
            return false;
        }
        row[i] = d.sqrt();
    }
    true
}

/// Sum of squares.
#[inline(always)]
pub(crate) fn norm_squared(a: &[f64]) -> f64 {
    dot(a, a)
}

/// Inner product in four fixed lanes, so that it vectorises and always sums in the same order.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a4
        .remainder()
        .iter()
        .zip(b4.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in a4.zip(b4) {
        for k in 0..4 {
            lanes[k] += x[k] * y[k];
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + tail
}
