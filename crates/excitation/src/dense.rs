//! Small symmetric matrices, row by row in slices: what a design of a few dozen rows needs in a microsecond.

/// `WᵀW` of rows of length `n`, both triangles.
pub(crate) fn gram(rows: &[f64], n: usize, out: &mut [f64]) {
    out.fill(0.0);
    for row in rows.chunks_exact(n) {
        for (i, &wi) in row.iter().enumerate() {
            for (a, &wj) in out[i * n..=i * n + i].iter_mut().zip(row) {
                *a += wi * wj;
            }
        }
    }
    for i in 0..n {
        for j in 0..i {
            out[j * n + i] = out[i * n + j];
        }
    }
}

/// Lower Cholesky factor over the lower triangle; `false` when `a` is not positive definite.
pub(crate) fn cholesky(a: &mut [f64], n: usize) -> bool {
    for i in 0..n {
        let (above, row) = a.split_at_mut(i * n);
        for j in 0..i {
            let other = &above[j * n..j * n + j];
            let dot = dot(&row[..j], other);
            row[j] = (row[j] - dot) / above[j * n + j];
        }
        let d = row[i] - dot(&row[..i], &row[..i]);
        if d.is_nan() || d <= 0.0 {
            return false;
        }
        row[i] = d.sqrt();
    }
    true
}

/// `A⁻¹` from the lower factor, both triangles; `scratch` takes the inverse of the factor.
pub(crate) fn inverse_of_factor(l: &[f64], n: usize, scratch: &mut [f64], out: &mut [f64]) {
    // Row i of L⁻¹ is -(Σ_{k<i} l_ik row_k) / l_ii, with 1 / l_ii on the diagonal.
    for i in 0..n {
        let (above, row) = scratch.split_at_mut(i * n);
        let row = &mut row[..n];
        row.fill(0.0);
        for k in 0..i {
            let factor = l[i * n + k];
            for (r, &a) in row.iter_mut().zip(&above[k * n..=k * n + k]) {
                *r -= factor * a;
            }
        }
        let inverse = 1.0 / l[i * n + i];
        for r in &mut row[..i] {
            *r *= inverse;
        }
        row[i] = inverse;
    }
    // A⁻¹ = L⁻ᵀ L⁻¹ is the Gram matrix of the rows of L⁻¹.
    gram(&scratch[..n * n], n, out);
}

/// Sum of squares.
pub(crate) fn norm_squared(a: &[f64]) -> f64 {
    dot(a, a)
}

/// Inner product in four fixed lanes, so that it vectorises and always sums in the same order.
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
