//! Eigenvalues of a small symmetric matrix, without eigenvectors.
//!
//! Householder reflections to a tridiagonal, then the QL method without square roots. For the few dozen columns of an arm
//! this takes a third of the time of a general library.
//! Sources: Golub & Van Loan 2013, sections 8.3.1 and 8.3.5; the rational QL is that of Parlett 1998, section 8.15
//! (Pal, Walker and Kahan).

use faer::MatRef;

/// Entries of a row summed side by side.
const LANES: usize = 8;
/// Sweeps an eigenvalue may take; two are usual.
const MAX_SWEEPS: usize = 60;

/// Eigenvalues of a symmetric matrix (its lower triangle), smallest first; `None` if an entry is not finite.
///
/// Absolute errors are some roundings of the largest. The same bits on every machine.
pub(crate) fn symmetric_eigenvalues(a: MatRef<'_, f64>) -> Option<Vec<f64>> {
    let n = a.nrows();
    let stride = n.next_multiple_of(LANES);
    let mut m = vec![0.0; n * stride];
    let mut largest = 0.0_f64;
    for j in 0..n {
        for i in j..n {
            let x = a[(i, j)];
            if !x.is_finite() {
                return None;
            }
            largest = largest.max(x.abs());
            m[i * stride + j] = x;
            m[j * stride + i] = x;
        }
    }
    if largest == 0.0 {
        return Some(vec![0.0; n]);
    }
    // By a power of two: squares neither overflow nor vanish, and nothing is rounded.
    let scale = 2.0_f64.powi(-(largest.log2().floor() as i32));
    for x in &mut m {
        *x *= scale;
    }
    let mut tridiagonal = Tridiagonal {
        diagonal: vec![0.0; n],
        off: vec![0.0; n],
    };
    pulp::Arch::new().dispatch(Reduce {
        m: &mut m,
        stride,
        out: &mut tridiagonal,
    });
    let mut values = tridiagonal.eigenvalues()?;
    for x in &mut values {
        *x /= scale;
    }
    values.sort_by(f64::total_cmp);
    Some(values)
}

struct Tridiagonal {
    diagonal: Vec<f64>,
    /// `off[k]` between `k` and `k + 1`; the last is zero.
    off: Vec<f64>,
}

/// Reflections from the first row on; `m` is full and padded with zeros.
struct Reduce<'a> {
    m: &'a mut [f64],
    stride: usize,
    out: &'a mut Tridiagonal,
}

impl pulp::WithSimd for Reduce<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { m, stride, out } = self;
        let n = out.diagonal.len();
        let (mut v, mut w) = (vec![0.0; stride], vec![0.0; stride]);
        for k in 0..n {
            let row = &m[k * stride..][..stride];
            out.diagonal[k] = row[k];
            if k + 2 >= n {
                if k + 1 < n {
                    out.off[k] = row[k + 1];
                }
                continue;
            }
            v[..=k].fill(0.0);
            v[k + 1..].copy_from_slice(&row[k + 1..]);
            let alpha = v[k + 1];
            let rest = sum_of_products(&v[k + 2..n], &v[k + 2..n]);
            if rest == 0.0 {
                out.off[k] = alpha;
                continue;
            }
            let norm = alpha.mul_add(alpha, rest).sqrt();
            let beta = if alpha < 0.0 { norm } else { -norm };
            out.off[k] = beta;
            v[k + 1] = alpha - beta;
            let tau = 1.0 / (norm * (norm + alpha.abs()));
            let from = (k + 1) / LANES * LANES;
            times_vector(m, (stride, k + 1, n), &v, &mut w[from..], from);
            let half = 0.5 * tau * sum_of_products(&v[k + 1..n], &w[k + 1..n]);
            for (w, v) in w[from..].iter_mut().zip(&v[from..]) {
                *w = tau * half.mul_add(-v, *w);
            }
            for i in k + 1..n {
                let (vi, wi) = (-v[i], -w[i]);
                let row = &mut m[i * stride + from..][..stride - from];
                for ((x, v), w) in row.iter_mut().zip(&v[from..]).zip(&w[from..]) {
                    *x = vi.mul_add(*w, wi.mul_add(*v, *x));
                }
            }
        }
    }
}

/// `Σ_i v_i m_i` over rows `first..end`, from column `from` on: the product of a symmetric matrix with `v`.
#[inline(always)]
fn times_vector(
    m: &[f64],
    (stride, first, end): (usize, usize, usize),
    v: &[f64],
    out: &mut [f64],
    from: usize,
) {
    for (block, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
        let column = from + block * LANES;
        // Two sums: one would wait for itself.
        let (mut even, mut odd) = ([0.0; LANES], [0.0; LANES]);
        let mut i = first;
        while i + 1 < end {
            let row = &m[i * stride + column..][..LANES];
            let next = &m[(i + 1) * stride + column..][..LANES];
            for l in 0..LANES {
                even[l] = v[i].mul_add(row[l], even[l]);
            }
            for l in 0..LANES {
                odd[l] = v[i + 1].mul_add(next[l], odd[l]);
            }
            i += 2;
        }
        if i < end {
            let row = &m[i * stride + column..][..LANES];
            for l in 0..LANES {
                even[l] = v[i].mul_add(row[l], even[l]);
            }
        }
        for l in 0..LANES {
            out[l] = even[l] + odd[l];
        }
    }
}

/// `a · b`, summed in eight fixed lanes.
#[inline(always)]
fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let ((a8, a_rest), (b8, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    for (a, b) in a8.iter().zip(b8) {
        for l in 0..LANES {
            lanes[l] = a[l].mul_add(b[l], lanes[l]);
        }
    }
    for (l, (a, b)) in a_rest.iter().zip(b_rest).enumerate() {
        lanes[l] = a.mul_add(*b, lanes[l]);
    }
    let [a0, a1, a2, a3, a4, a5, a6, a7] = lanes;
    ((a0 + a4) + (a2 + a6)) + ((a1 + a5) + (a3 + a7))
}

impl Tridiagonal {
    /// Eigenvalues, unsorted; `None` should a sweep not converge.
    fn eigenvalues(mut self) -> Option<Vec<f64>> {
        let n = self.diagonal.len();
        let d = &mut self.diagonal;
        // Squares from here on.
        let e = &mut self.off;
        for x in e.iter_mut() {
            *x *= *x;
        }
        for l in 0..n {
            let mut sweeps = 0;
            loop {
                // Relative to the neighbours, or negligible beside the whole, whose largest entry is about one.
                let small = |m: usize| {
                    let beside = (d[m] * d[m + 1]).abs().max(f64::EPSILON * f64::EPSILON);
                    e[m] <= f64::EPSILON * f64::EPSILON * beside
                };
                let m = (l..n - 1).find(|&m| small(m)).unwrap_or(n - 1);
                if m < n - 1 {
                    e[m] = 0.0;
                }
                if m == l {
                    break;
                }
                sweeps += 1;
                if sweeps > MAX_SWEEPS {
                    return None;
                }
                sweep(d, e, l, m);
            }
        }
        Some(self.diagonal)
    }
}

/// One rational QL sweep over `l..=m` with the shift of Wilkinson; `e` holds squares.
fn sweep(d: &mut [f64], e: &mut [f64], l: usize, m: usize) {
    let root = e[l].sqrt();
    let sigma = (d[l + 1] - d[l]) / (2.0 * root);
    let r = sigma.mul_add(sigma, 1.0).sqrt();
    let shift = d[l] - root / (sigma + r.copysign(sigma));
    let (mut c, mut s) = (1.0, 0.0);
    let mut gamma = d[m] - shift;
    let mut p = gamma * gamma;
    for i in (l..m).rev() {
        let b = e[i];
        let r = p + b;
        if i != m - 1 {
            e[i + 1] = s * r;
        }
        let old_c = c;
        c = p / r;
        s = b / r;
        let old_gamma = gamma;
        let alpha = d[i];
        gamma = c * (alpha - shift) - s * old_gamma;
        d[i + 1] = old_gamma + (alpha - gamma);
        p = if c == 0.0 {
            old_c * b
        } else {
            gamma * gamma / c
        };
    }
    e[l] = s * p;
    d[l] = shift + gamma;
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use faer::{Mat, Side};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn identity_eigenvalues_are_those_of_a_general_solver(
            n in 1..40_usize,
            entries in prop::collection::vec(-1.0..1.0_f64, 1600),
            spread in 0.0..6.0_f64,
        ) {
            // A Gram matrix whose columns differ in size by up to six orders of magnitude.
            let w = Mat::from_fn(n, n, |i, j| entries[40 * i + j] * 10_f64.powf(-spread * j as f64 / n as f64));
            let a = w.transpose() * &w;
            let expected = a.self_adjoint_eigenvalues(Side::Lower).unwrap();
            let found = symmetric_eigenvalues(a.as_ref()).unwrap();
            let largest = expected[n - 1];
            for (x, y) in found.iter().zip(&expected) {
                // Some roundings a reflection.
                prop_assert!((x - y).abs() <= 4.0 * n as f64 * f64::EPSILON * largest, "{x} {y}");
            }
        }
    }

    #[test]
    fn oracle_matrices_that_are_diagonal_or_nothing() {
        let diagonal = Mat::from_fn(3, 3, |i, j| if i == j { 3.0 - i as f64 } else { 0.0 });
        let found = symmetric_eigenvalues(diagonal.as_ref()).unwrap();
        assert_eq!(found, [1.0, 2.0, 3.0]);
        let nothing = Mat::<f64>::zeros(4, 4);
        assert_eq!(symmetric_eigenvalues(nothing.as_ref()).unwrap(), [0.0; 4]);
        let hole = Mat::from_fn(2, 2, |_, _| f64::NAN);
        assert_eq!(symmetric_eigenvalues(hole.as_ref()), None);
    }
}
