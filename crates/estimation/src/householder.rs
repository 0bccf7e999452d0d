//! Folding a block of rows into a triangle: `QR([R; B]) -> R`, in place.
//!
//! Householder reflections that know the upper part is a triangle: reflection `k` touches row `k` of `R` and the block only.
//! Four reflections are gathered (compact WY in its sequential form) and applied together, so that the block is read from cache a
//! quarter as often. Lanes and order of every sum are fixed in the code and products are fused explicitly, so that all machines with
//! fused multiply-add give the same bits. A column of exact zeros is an identity reflection and leaves its row of `R` zero: the
//! unpivoted QR of faer does not advance the row there, and its diagonal then belongs to other columns.
//!
//! Sources: Bierman 1977, chapter V (square-root information filter); Golub & Van Loan 2013, section 5.2.

/// Reflections applied together; the width of a triangle is padded to a multiple of it.
pub(crate) const PANEL: usize = 4;
/// Rows of a block. 128 rows of 49 columns are 50 kB: they stay in the second-level cache.
pub(crate) const BLOCK_ROWS: usize = 128;
/// Rows that travel together; a block is zero-filled to a multiple of it.
pub(crate) const LANES: usize = 8;

type Lane = [f64; LANES];

/// Folds the first `n_rows` rows of `block` into the triangle.
///
/// `triangle`: `width × width`, column-major, upper; `block`: `BLOCK_ROWS × width`, column-major, destroyed. `width` is a multiple
/// of `PANEL`.
pub(crate) fn fold(triangle: &mut [f64], block: &mut [f64], width: usize, n_rows: usize) {
    assert_eq!(
        width % PANEL,
        0,
        "width {width} is not a multiple of {PANEL}"
    );
    assert_eq!(triangle.len(), width * width);
    assert_eq!(block.len(), BLOCK_ROWS * width);
    let used = n_rows.next_multiple_of(LANES);
    assert!(
        used <= BLOCK_ROWS,
        "{n_rows} rows in a block of {BLOCK_ROWS}"
    );
    for column in block.chunks_exact_mut(BLOCK_ROWS) {
        column[n_rows..used].fill(0.0);
    }
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || fold_panels(triangle, block, width, used),
    );
}

#[inline(always)]
fn fold_panels(triangle: &mut [f64], block: &mut [f64], width: usize, used: usize) {
    for first in (0..width).step_by(PANEL) {
        let (left, trailing) = block.split_at_mut((first + PANEL) * BLOCK_ROWS);
        let panel = &mut left[first * BLOCK_ROWS..];
        let scale = factor_panel(triangle, panel, width, first, used);
        let v: [&[Lane]; PANEL] = std::array::from_fn(|k| column(panel, k, used));
        let gram = gram(v);
        let mut upper = first + PANEL;
        let mut pairs = trailing.chunks_exact_mut(2 * BLOCK_ROWS);
        for pair in &mut pairs {
            let (a, b) = pair.split_at_mut(BLOCK_ROWS);
            let (a, b) = (lanes_mut(&mut a[..used]), lanes_mut(&mut b[..used]));
            let [dot_a, dot_b] = dots_of_two(v, a, b);
            let wa = reflect_row(
                &mut triangle[upper * width + first..][..PANEL],
                dot_a,
                &scale,
                &gram,
            );
            let wb = reflect_row(
                &mut triangle[(upper + 1) * width + first..][..PANEL],
                dot_b,
                &scale,
                &gram,
            );
            subtract_from_two(v, wa, wb, a, b);
            upper += 2;
        }
    }
}

/// Factors the panel's own columns; `panel` is left holding the reflection vectors, their scales are returned.
#[inline(always)]
fn factor_panel(
    triangle: &mut [f64],
    panel: &mut [f64],
    width: usize,
    first: usize,
    used: usize,
) -> [f64; PANEL] {
    let mut scale = [0.0; PANEL];
    for k in 0..PANEL {
        let pivot = first + k;
        let (head, tail) = panel.split_at_mut((k + 1) * BLOCK_ROWS);
        let x = lanes_mut(&mut head[k * BLOCK_ROWS..][..used]);
        let square = dot(x, x);
        // Nothing to annihilate (also below 1e-154, where squares vanish): the reflection is the identity, its row of R stays.
        if square == 0.0 {
            x.fill([0.0; LANES]);
            continue;
        }
        let alpha = triangle[pivot * width + pivot];
        let norm = square.sqrt().hypot(alpha);
        let beta = if alpha < 0.0 { norm } else { -norm };
        let inverse = 1.0 / (alpha - beta);
        x.iter_mut().flatten().for_each(|x| *x *= inverse);
        scale[k] = (beta - alpha) / beta;
        triangle[pivot * width + pivot] = beta;
        for (offset, c) in tail.chunks_exact_mut(BLOCK_ROWS).enumerate() {
            let c = lanes_mut(&mut c[..used]);
            let r = &mut triangle[(pivot + 1 + offset) * width + pivot];
            let w = scale[k] * (*r + dot(x, c));
            *r -= w;
            for (c, x) in c.iter_mut().zip(x.iter()) {
                for l in 0..LANES {
                    c[l] = (-w).mul_add(x[l], c[l]);
                }
            }
        }
    }
    scale
}

/// Products of the reflection vectors below the triangle; above it they meet in no row.
#[inline(always)]
fn gram(v: [&[Lane]; PANEL]) -> [[f64; PANEL]; PANEL] {
    let mut gram = [[0.0; PANEL]; PANEL];
    for i in 1..PANEL {
        for k in 0..i {
            gram[i][k] = dot(v[i], v[k]);
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
fn dots_of_two(v: [&[Lane]; PANEL], a: &[Lane], b: &[Lane]) -> [[f64; PANEL]; 2] {
    // Half a lane at a time: the eight sums then fit in the registers of AVX2.
    const HALF: usize = LANES / 2;
    let n = a.len();
    let (v, b) = (v.map(|v| &v[..n]), &b[..n]);
    let mut sum_a = [[0.0; HALF]; PANEL];
    let mut sum_b = [[0.0; HALF]; PANEL];
    for i in 0..n {
        for half in 0..2 {
            for k in 0..PANEL {
                for l in 0..HALF {
                    let v = v[k][i][half * HALF + l];
                    sum_a[k][l] = v.mul_add(a[i][half * HALF + l], sum_a[k][l]);
                    sum_b[k][l] = v.mul_add(b[i][half * HALF + l], sum_b[k][l]);
                }
            }
        }
    }
    [sum_a, sum_b].map(|sums| sums.map(|s| (s[0] + s[2]) + (s[1] + s[3])))
}

#[inline(always)]
fn subtract_from_two(
    v: [&[Lane]; PANEL],
    wa: [f64; PANEL],
    wb: [f64; PANEL],
    a: &mut [Lane],
    b: &mut [Lane],
) {
    let n = a.len();
    let (v, b) = (v.map(|v| &v[..n]), &mut b[..n]);
    for i in 0..n {
        for l in 0..LANES {
            let (mut x, mut y) = (a[i][l], b[i][l]);
            for k in 0..PANEL {
                x = (-wa[k]).mul_add(v[k][i][l], x);
                y = (-wb[k]).mul_add(v[k][i][l], y);
            }
            a[i][l] = x;
            b[i][l] = y;
        }
    }
}

#[inline(always)]
fn dot(a: &[Lane], b: &[Lane]) -> f64 {
    let mut sum = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..LANES {
            sum[l] = a[l].mul_add(b[l], sum[l]);
        }
    }
    ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]))
}

#[inline(always)]
fn column(columns: &[f64], k: usize, used: usize) -> &[Lane] {
    columns[k * BLOCK_ROWS..][..used].as_chunks().0
}

#[inline(always)]
fn lanes_mut(column: &mut [f64]) -> &mut [Lane] {
    column.as_chunks_mut().0
}
