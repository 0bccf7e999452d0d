//! The running triangular factor of a tall matrix.

use faer::MatRef;

/// Columns handled side by side: one AVX-512 register, two of AVX2.
const LANES: usize = 8;
/// Rows eliminated together: 48 rows of 64 columns fill 24 KiB and stay in the first-level cache.
const BLOCK_ROWS: usize = 48;

/// Triangle `R` of `W = Q R`, kept up to date as rows of `W` arrive.
///
/// `Rᵀ R = Wᵀ W`, so `R` has the column norms, the rank and the linear relations of `W`, in `n × n` numbers. Signs of its
/// rows are free. A column of exact zeros costs nothing and stays zero (libraries that skip its row return an echelon form
/// whose diagonal lies about the rank).
///
/// The same calls give the same bits on every machine: sums run in a fixed order whatever the width of the registers.
/// Source: Householder elimination of rows below a triangle, Golub and Van Loan, section 5.1.
#[derive(Clone, Debug)]
pub struct TriangularFactor {
    n_columns: usize,
    n_rows: usize,
    /// Columns of a stored row, a multiple of `LANES`; those past `n_columns` are zero.
    stride: usize,
    /// `n_columns` rows of `stride` numbers.
    r: Vec<f64>,
}

impl TriangularFactor {
    /// The factor of no rows at all, for rows of `n_columns`.
    pub fn new(n_columns: usize) -> Self {
        let stride = n_columns.next_multiple_of(LANES);
        Self {
            n_columns,
            n_rows: 0,
            stride,
            r: vec![0.0; n_columns * stride],
        }
    }

    /// Takes in rows of `W`, row-major, any number of them; a call with 48 rows or more is the fastest.
    ///
    /// # Panics
    ///
    /// If the length is not a multiple of the number of columns, or a number is not finite.
    #[track_caller]
    pub fn push_rows(&mut self, rows: &[f64]) {
        let n = self.n_columns;
        assert!(
            n > 0 && rows.len().is_multiple_of(n),
            "push_rows: {} numbers are not rows of {n} columns",
            rows.len()
        );
        if let Some(at) = rows.iter().position(|value| !value.is_finite()) {
            panic!(
                "push_rows: row {}, column {} is {}, not a finite number",
                at / n,
                at % n,
                rows[at]
            );
        }
        let mut block = vec![0.0; BLOCK_ROWS.min(rows.len() / n) * self.stride];
        for chunk in rows.chunks(BLOCK_ROWS * n) {
            let block = &mut block[..chunk.len() / n * self.stride];
            for (padded, row) in block
                .chunks_exact_mut(self.stride)
                .zip(chunk.chunks_exact(n))
            {
                padded[..n].copy_from_slice(row);
                padded[n..].fill(0.0);
            }
            self.eliminate(block);
        }
        self.n_rows += rows.len() / n;
    }

    /// Takes in all rows of another factor: the result is the factor of both stacks of rows.
    ///
    /// # Panics
    ///
    /// If the numbers of columns differ.
    #[track_caller]
    pub fn merge(&mut self, other: &Self) {
        assert!(
            self.n_columns == other.n_columns,
            "merge: {} columns with {} columns",
            self.n_columns,
            other.n_columns
        );
        for rows in other.r.chunks(BLOCK_ROWS * self.stride.max(1)) {
            self.eliminate(&mut rows.to_vec());
        }
        self.n_rows += other.n_rows;
    }

    /// The upper triangle, `n_columns × n_columns`.
    pub fn r(&self) -> MatRef<'_, f64> {
        MatRef::from_row_major_slice_with_stride(
            &self.r,
            self.n_columns,
            self.n_columns,
            self.stride,
        )
    }

    /// Number of columns of `W`.
    pub fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// Number of rows taken in so far.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    fn eliminate(&mut self, block: &mut [f64]) {
        let (r, stride, n) = (&mut self.r, self.stride, self.n_columns);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || eliminate(r, block, stride, n),
        );
    }
}

/// Householder elimination of the rows of `block` below the triangle `r`; both have rows of `stride` numbers.
///
/// Reflection `k` touches only row `k` of `r`, for the rows below it are zero in column `k` already.
#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "compiled once for each instruction set by the caller"
)]
fn eliminate(r: &mut [f64], block: &mut [f64], stride: usize, n: usize) {
    let mut v = [0.0; BLOCK_ROWS];
    for (k, r_k) in r.chunks_exact_mut(stride).enumerate().take(n) {
        let mut below = 0.0;
        for (v_i, row) in v.iter_mut().zip(block.chunks_exact_mut(stride)) {
            *v_i = row[k];
            row[k] = 0.0;
            below += *v_i * *v_i;
        }
        // Nothing to eliminate; past underflow a reflection could not be scaled.
        if below < f64::MIN_POSITIVE {
            continue;
        }
        let head = r_k[k];
        let norm = (head * head + below).sqrt();
        // The sign that avoids cancellation.
        let r_kk = if head > 0.0 { -norm } else { norm };
        let v_k = head - r_kk;
        let scale = 1.0 / (norm * (norm + head.abs()));
        // Columns of the lane group left of k, and k itself, are zero by now and stay so.
        r_k[k] = 0.0;
        for first in (k / LANES * LANES..stride).step_by(LANES) {
            let group = first..first + LANES;
            let mut w = [0.0; LANES];
            for (w, r) in w.iter_mut().zip(&r_k[group.clone()]) {
                *w = v_k * r;
            }
            for (v_i, row) in v.iter().zip(block.chunks_exact(stride)) {
                for (w, b) in w.iter_mut().zip(&row[group.clone()]) {
                    *w += v_i * b;
                }
            }
            for (w, r) in w.iter_mut().zip(&mut r_k[group.clone()]) {
                *w *= scale;
                *r -= v_k * *w;
            }
            for (v_i, row) in v.iter().zip(block.chunks_exact_mut(stride)) {
                for (w, b) in w.iter().zip(&mut row[group.clone()]) {
                    *b -= v_i * w;
                }
            }
        }
        r_k[k] = r_kk;
    }
}
