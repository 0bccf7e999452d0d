//! Folding a block of rows into a triangle: `QR([R; B]) -> R`, in place.
//!
//! Householder reflections that know the upper part is a triangle: reflection `k` touches row `k` of `R` and the block only.
//! Four reflections are gathered (compact WY in its sequential form) and applied together, so that the block is read from cache a
//! quarter as often. A column of exact zeros is an identity reflection and leaves its row of `R` zero: the unpivoted QR of faer does not
//! advance the row there, and its diagonal then belongs to other columns. Sums run in a fixed order for a given vector width: one
//! processor always gives the same bits.
//!
//! Sources: Bierman 1977, chapter V (square-root information filter); Golub & Van Loan 2013, section 5.2.

use pulp::Simd;

/// Reflections applied together; the width of a triangle is padded to a multiple of it.
pub(crate) const PANEL: usize = 4;
/// Rows of a block. 128 rows of 49 columns are 50 kB: they stay in the second-level cache.
pub(crate) const BLOCK_ROWS: usize = 128;
/// Distance of a block's columns. Were it a power of two, the entries of a row would share four sets of the first-level cache.
pub(crate) const STRIDE: usize = BLOCK_ROWS + LANES;
/// A block is zero-filled to a multiple of this many rows: the widest vector, so that no loop has a tail.
const LANES: usize = 8;

/// Folds the first `n_rows` rows of `block` into the triangle.
///
/// `triangle`: `width × width`, column-major, upper; `block`: `BLOCK_ROWS × width`, column-major at distance `STRIDE`, destroyed.
/// `width` is a multiple of `PANEL`.
pub(crate) fn fold(triangle: &mut [f64], block: &mut [f64], width: usize, n_rows: usize) {
    assert_eq!(
        width % PANEL,
        0,
        "width {width} is not a multiple of {PANEL}"
    );
    assert_eq!(triangle.len(), width * width);
    assert_eq!(block.len(), STRIDE * width);
    let used = n_rows.next_multiple_of(LANES);
    assert!(
        used <= BLOCK_ROWS,
        "{n_rows} rows in a block of {BLOCK_ROWS}"
    );
    for column in block.chunks_exact_mut(STRIDE) {
        column[n_rows..used].fill(0.0);
    }
    pulp::Arch::new().dispatch(Fold {
        triangle,
        block,
        width,
        used,
    });
}

/// The fold, compiled once for every instruction set and chosen at run time.
struct Fold<'a> {
    triangle: &'a mut [f64],
    block: &'a mut [f64],
    width: usize,
    used: usize,
}

impl pulp::WithSimd for Fold<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            triangle,
            block,
            width,
            used,
        } = self;
        for first in (0..width).step_by(PANEL) {
            let (left, trailing) = block.split_at_mut((first + PANEL) * STRIDE);
            let panel = &mut left[first * STRIDE..];
            let scale = factor_panel(simd, triangle, panel, width, first, used);
            let v = [
                lanes::<S>(panel, used),
                lanes::<S>(&panel[STRIDE..], used),
                lanes::<S>(&panel[2 * STRIDE..], used),
                lanes::<S>(&panel[3 * STRIDE..], used),
            ];
            let gram = gram(simd, v);
            let mut upper = (first + PANEL) * width + first;
            for pair in trailing.chunks_exact_mut(2 * STRIDE) {
                let (a, b) = pair.split_at_mut(STRIDE);
                let (a, b) = (lanes_mut::<S>(a, used), lanes_mut::<S>(b, used));
                let (dots_a, dots_b) = dots_of_two(simd, v, a, b);
                let wa = reflect_row(&mut triangle[upper..upper + PANEL], dots_a, &scale, &gram);
                let wb = reflect_row(
                    &mut triangle[upper + width..upper + width + PANEL],
                    dots_b,
                    &scale,
                    &gram,
                );
                subtract_from_two(simd, v, wa, wb, a, b);
                upper += 2 * width;
            }
        }
    }
}

/// Factors the panel's own columns; `panel` is left holding the reflection vectors, their scales are returned.
#[inline(always)]
fn factor_panel<S: Simd>(
    simd: S,
    triangle: &mut [f64],
    panel: &mut [f64],
    width: usize,
    first: usize,
    used: usize,
) -> [f64; PANEL] {
    let mut scale = [0.0; PANEL];
    for k in 0..PANEL {
        let pivot = first + k;
        let (head, tail) = panel.split_at_mut((k + 1) * STRIDE);
        let x = lanes_mut::<S>(&mut head[k * STRIDE..], used);
        let square = dot(simd, x, x);
        // Nothing to annihilate (also below 1e-154, where squares vanish): the reflection is the identity, its row of R stays.
        if square == 0.0 {
            x.fill(simd.splat_f64s(0.0));
            continue;
        }
        let alpha = triangle[pivot * width + pivot];
        let norm = (square + alpha * alpha).sqrt();
        let beta = if alpha < 0.0 { norm } else { -norm };
        let inverse = simd.splat_f64s(1.0 / (alpha - beta));
        for x in x.iter_mut() {
            *x = simd.mul_f64s(*x, inverse);
        }
        scale[k] = (beta - alpha) / beta;
        triangle[pivot * width + pivot] = beta;
        for (offset, c) in tail.chunks_exact_mut(STRIDE).enumerate() {
            let c = lanes_mut::<S>(c, used);
            let r = &mut triangle[(pivot + 1 + offset) * width + pivot];
            let w = scale[k] * (*r + dot(simd, x, c));
            *r -= w;
            let w = simd.splat_f64s(-w);
            for (c, x) in c.iter_mut().zip(x.iter()) {
                *c = simd.mul_add_f64s(w, *x, *c);
            }
        }
    }
    scale
}

/// Products of the reflection vectors below the triangle; above it they meet in no row.
#[inline(always)]
fn gram<S: Simd>(simd: S, v: [&[S::f64s]; PANEL]) -> [[f64; PANEL]; PANEL] {
    let mut gram = [[0.0; PANEL]; PANEL];
    for i in 1..PANEL {
        for k in 0..i {
            gram[i][k] = dot(simd, v[i], v[k]);
        }
    }
    gram
}

/// Applies the panel to its rows of `R` in one column; returns the multiples of the vectors to take from the block's column.
#[inline(always)]
fn reflect_row(
    r: &mut [f64],
    dots: [f64; PANEL],
    scale: &[f64; PANEL],
    gram: &[[f64; PANEL]; PANEL],
) -> [f64; PANEL] {
    let mut w = [0.0; PANEL];
    for k in 0..PANEL {
        let mut s = r[k] + dots[k];
        for i in 0..k {
            s -= gram[k][i] * w[i];
        }
        w[k] = scale[k] * s;
        r[k] -= w[k];
    }
    w
}

#[inline(always)]
fn dots_of_two<S: Simd>(
    simd: S,
    v: [&[S::f64s]; PANEL],
    a: &[S::f64s],
    b: &[S::f64s],
) -> ([f64; PANEL], [f64; PANEL]) {
    let [v0, v1, v2, v3] = v;
    let zero = simd.splat_f64s(0.0);
    let (mut a0, mut a1, mut a2, mut a3) = (zero, zero, zero, zero);
    let (mut b0, mut b1, mut b2, mut b3) = (zero, zero, zero, zero);
    for (((((&a, &b), &v0), &v1), &v2), &v3) in a.iter().zip(b).zip(v0).zip(v1).zip(v2).zip(v3) {
        a0 = simd.mul_add_f64s(v0, a, a0);
        b0 = simd.mul_add_f64s(v0, b, b0);
        a1 = simd.mul_add_f64s(v1, a, a1);
        b1 = simd.mul_add_f64s(v1, b, b1);
        a2 = simd.mul_add_f64s(v2, a, a2);
        b2 = simd.mul_add_f64s(v2, b, b2);
        a3 = simd.mul_add_f64s(v3, a, a3);
        b3 = simd.mul_add_f64s(v3, b, b3);
    }
    (
        [
            simd.reduce_sum_f64s(a0),
            simd.reduce_sum_f64s(a1),
            simd.reduce_sum_f64s(a2),
            simd.reduce_sum_f64s(a3),
        ],
        [
            simd.reduce_sum_f64s(b0),
            simd.reduce_sum_f64s(b1),
            simd.reduce_sum_f64s(b2),
            simd.reduce_sum_f64s(b3),
        ],
    )
}

#[inline(always)]
fn subtract_from_two<S: Simd>(
    simd: S,
    v: [&[S::f64s]; PANEL],
    wa: [f64; PANEL],
    wb: [f64; PANEL],
    a: &mut [S::f64s],
    b: &mut [S::f64s],
) {
    let [v0, v1, v2, v3] = v;
    let [wa0, wa1, wa2, wa3] = [
        simd.splat_f64s(-wa[0]),
        simd.splat_f64s(-wa[1]),
        simd.splat_f64s(-wa[2]),
        simd.splat_f64s(-wa[3]),
    ];
    let [wb0, wb1, wb2, wb3] = [
        simd.splat_f64s(-wb[0]),
        simd.splat_f64s(-wb[1]),
        simd.splat_f64s(-wb[2]),
        simd.splat_f64s(-wb[3]),
    ];
    for (((((a, b), &v0), &v1), &v2), &v3) in a.iter_mut().zip(b).zip(v0).zip(v1).zip(v2).zip(v3) {
        let (mut x, mut y) = (*a, *b);
        x = simd.mul_add_f64s(wa0, v0, x);
        y = simd.mul_add_f64s(wb0, v0, y);
        x = simd.mul_add_f64s(wa1, v1, x);
        y = simd.mul_add_f64s(wb1, v1, y);
        x = simd.mul_add_f64s(wa2, v2, x);
        y = simd.mul_add_f64s(wb2, v2, y);
        *a = simd.mul_add_f64s(wa3, v3, x);
        *b = simd.mul_add_f64s(wb3, v3, y);
    }
}

#[inline(always)]
fn dot<S: Simd>(simd: S, a: &[S::f64s], b: &[S::f64s]) -> f64 {
    // Two sums hide half of the latency of the fused multiply-add.
    let mut even = simd.splat_f64s(0.0);
    let mut odd = even;
    let (pairs_a, last_a) = pulp::as_arrays::<2, _>(a);
    let (pairs_b, last_b) = pulp::as_arrays::<2, _>(b);
    for ([a0, a1], [b0, b1]) in pairs_a.iter().zip(pairs_b) {
        even = simd.mul_add_f64s(*a0, *b0, even);
        odd = simd.mul_add_f64s(*a1, *b1, odd);
    }
    for (a, b) in last_a.iter().zip(last_b) {
        even = simd.mul_add_f64s(*a, *b, even);
    }
    simd.reduce_sum_f64s(simd.add_f64s(even, odd))
}

#[inline(always)]
fn lanes<S: Simd>(column: &[f64], used: usize) -> &[S::f64s] {
    S::as_simd_f64s(&column[..used]).0
}

#[inline(always)]
fn lanes_mut<S: Simd>(column: &mut [f64], used: usize) -> &mut [S::f64s] {
    S::as_mut_simd_f64s(&mut column[..used]).0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries of `RᵀR` under two vector widths, relative to the largest.
    const SAME: f64 = 1e-14;

    #[test]
    fn identity_scalar_and_widest_vectors_agree() {
        let (width, n_rows) = (12, 77);
        let block: Vec<f64> = (0..STRIDE * width)
            .map(|k| (1.7 * k as f64).sin())
            .collect();
        let gram_of = |widest: bool| {
            let (mut triangle, mut block) = (vec![0.0; width * width], block.clone());
            if widest {
                fold(&mut triangle, &mut block, width, n_rows);
            } else {
                for column in block.chunks_exact_mut(STRIDE) {
                    column[n_rows..].fill(0.0);
                }
                pulp::Scalar::new().vectorize(Fold {
                    triangle: &mut triangle,
                    block: &mut block,
                    width,
                    used: n_rows.next_multiple_of(LANES),
                });
            }
            let entry = |i: usize, j: usize| -> f64 {
                (0..=i.min(j))
                    .map(|k| triangle[i * width + k] * triangle[j * width + k])
                    .sum()
            };
            (0..width * width)
                .map(|k| entry(k % width, k / width))
                .collect::<Vec<f64>>()
        };
        let direct = |i: usize, j: usize| -> f64 {
            (0..n_rows)
                .map(|k| block[i * STRIDE + k] * block[j * STRIDE + k])
                .sum()
        };
        let (wide, scalar) = (gram_of(true), gram_of(false));
        for k in 0..width * width {
            let expected = direct(k % width, k / width);
            assert!((wide[k] - expected).abs() <= SAME * n_rows as f64);
            assert!((scalar[k] - expected).abs() <= SAME * n_rows as f64);
        }
    }
}
