//! The two halves of the curvature an interior-point step uses: learned of the criterion, exact of the limits.

use crate::dense::dot;
use crate::fourier_limits::JointBounds;

/// A step that gains less than this share of what the model expects is blended with it, so that the model stays
/// positive definite (Powell 1978).
const DAMPING: f64 = 0.2;

/// Quasi-Newton model of a criterion's second derivatives: BFGS, damped.
#[derive(Debug, Clone)]
pub(crate) struct LearnedCurvature {
    n: usize,
    /// Full, row by row.
    b: Vec<f64>,
    fresh: bool,
}

impl LearnedCurvature {
    pub(crate) fn new(n: usize) -> Self {
        let mut new = Self {
            n,
            b: vec![0.0; n * n],
            fresh: true,
        };
        new.reset(1.0);
        new
    }

    fn reset(&mut self, curvature: f64) {
        self.b.fill(0.0);
        for i in 0..self.n {
            self.b[i * self.n + i] = curvature;
        }
    }

    /// All entries, row by row.
    pub(crate) fn matrix(&self) -> &[f64] {
        &self.b
    }

    /// Learns from a step `s` that changed the gradient by `y`.
    pub(crate) fn learn(&mut self, s: &[f64], y: &[f64]) {
        let n = self.n;
        let sy = dot(s, y);
        if self.fresh && sy > 0.0 {
            self.reset(dot(y, y) / sy);
            self.fresh = false;
        }
        let bs: Vec<f64> = self.b.chunks_exact(n).map(|row| dot(row, s)).collect();
        let sbs = dot(s, &bs);
        if sbs.is_nan() || sbs <= 0.0 {
            return;
        }
        let theta = if sy >= DAMPING * sbs {
            1.0
        } else {
            (1.0 - DAMPING) * sbs / (sbs - sy)
        };
        let r: Vec<f64> = y
            .iter()
            .zip(&bs)
            .map(|(y, b)| theta * y + (1.0 - theta) * b)
            .collect();
        let sr = dot(s, &r);
        for (i, row) in self.b.chunks_exact_mut(n).enumerate() {
            let (p, q) = (r[i] / sr, bs[i] / sbs);
            for ((b, r), bs) in row.iter_mut().zip(&r).zip(&bs) {
                *b += p * r - q * bs;
            }
        }
    }
}

/// Columns multiplied together, so that a weighted one is read once for all of them.
const TOGETHER: usize = 4;

/// Adds `Σ weight · row rowᵀ` of a joint's bounds to the lower triangle of its block of `out`, row by row.
///
/// `first`: its first variable; `n`: variables of all joints.
#[inline(always)]
pub(crate) fn add_bound_curvature<S: pulp::Simd>(
    simd: S,
    bounds: &JointBounds,
    weights: &[f64],
    scratch: &mut Vec<f64>,
    (first, n): (usize, usize),
    out: &mut [f64],
) {
    scratch.resize(weights.len(), 0.0);
    for (a, column) in bounds.columns.iter().enumerate() {
        for ((s, c), w) in scratch.iter_mut().zip(column).zip(weights) {
            *s = c * w;
        }
        let row = &mut out[(first + a) * n + first..][..=a];
        for (row, others) in row
            .chunks_mut(TOGETHER)
            .zip(bounds.columns.chunks(TOGETHER))
        {
            let mut others = others.iter();
            let mut next = || others.next().map_or(&scratch[..], |c| &c[..]);
            let sums = products(simd, scratch, [next(), next(), next(), next()]);
            for (o, sum) in row.iter_mut().zip(sums) {
                *o += sum;
            }
        }
    }
}

/// Inner products of one vector with several, all of whole blocks of eight; the order of the sums is the same for
/// registers of every width.
#[inline(always)]
fn products<S: pulp::Simd>(simd: S, x: &[f64], others: [&[f64]; TOGETHER]) -> [f64; TOGETHER] {
    const LANES: usize = JointBounds::BLOCK;
    let registers = LANES / S::F64_LANES;
    let x = S::as_simd_f64s(x).0;
    let others = others.map(|y| &S::as_simd_f64s(y).0[..x.len()]);
    let mut lanes = [[0.0; LANES]; TOGETHER];
    for r in 0..registers {
        let mut sums = [simd.splat_f64s(0.0); TOGETHER];
        for i in (r..x.len()).step_by(registers) {
            for (sum, other) in sums.iter_mut().zip(others) {
                *sum = simd.mul_add_f64s(x[i], other[i], *sum);
            }
        }
        for (lanes, sum) in lanes.iter_mut().zip(sums) {
            S::as_mut_simd_f64s(lanes).0[r] = sum;
        }
    }
    lanes.map(|s| ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7])))
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Add<'a>(&'a JointBounds, &'a [f64], &'a mut [f64]);
    impl pulp::WithSimd for Add<'_> {
        type Output = ();
        fn with_simd<S: pulp::Simd>(self, simd: S) {
            add_bound_curvature(simd, self.0, self.1, &mut Vec::new(), (1, 8), self.2);
        }
    }

    #[test]
    fn identity_the_learned_curvature_reproduces_the_last_step_and_stays_positive() {
        let n = 5;
        let mut learned = LearnedCurvature::new(n);
        let vector =
            |k: usize| -> Vec<f64> { (0..n).map(|i| ((3 * k + i * i) as f64).sin()).collect() };
        for k in 0..20 {
            let s = vector(k);
            // Some steps meet negative curvature and must be blended, others are taken as they are.
            let y: Vec<f64> = s
                .iter()
                .enumerate()
                .map(|(i, s)| (i as f64 - 0.5) * s)
                .collect();
            let before = learned.clone();
            learned.learn(&s, &y);
            let bs: Vec<f64> = learned
                .matrix()
                .chunks_exact(n)
                .map(|row| dot(row, &s))
                .collect();
            let old: Vec<f64> = before
                .matrix()
                .chunks_exact(n)
                .map(|row| dot(row, &s))
                .collect();
            let expected = if before.fresh { 0.0 } else { dot(&s, &old) };
            if dot(&s, &y) >= DAMPING * expected && dot(&s, &y) > 0.0 {
                for (b, y) in bs.iter().zip(&y) {
                    assert!((b - y).abs() < 1e-10, "{b} against {y}");
                }
            }
            let mut l = learned.matrix().to_vec();
            assert!(crate::dense::cholesky(&mut l, n));
        }
    }

    #[test]
    fn identity_bound_curvature_is_the_sum_of_rows() {
        let bounds = JointBounds {
            columns: (0..6)
                .map(|a| (0..24).map(|i| f64::from(a * i + a).cos()).collect())
                .collect(),
            offset: vec![0.0; 24],
        };
        let weights: Vec<f64> = (0..24).map(|i| 1.0 + f64::from(i)).collect();
        let mut wide = vec![0.0; 64];
        pulp::Arch::new().dispatch(Add(&bounds, &weights, &mut wide));
        for a in 0..6 {
            for b in 0..=a {
                let sum: f64 = (0..24)
                    .map(|i| weights[i] * bounds.columns[a][i] * bounds.columns[b][i])
                    .sum();
                // Rounding of 24 terms of size 24.
                assert!((wide[(1 + a) * 8 + 1 + b] - sum).abs() < 1e-12);
            }
        }
        // The same bits from registers of one number.
        let mut narrow = vec![0.0; 64];
        pulp::WithSimd::with_simd(Add(&bounds, &weights, &mut narrow), pulp::Scalar::new());
        assert_eq!(wide, narrow);
    }
}
