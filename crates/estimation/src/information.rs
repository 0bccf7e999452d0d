//! The square-root information filter: any number of rows in a few kilobytes.

use crate::error::{Error, Place};
use crate::householder::{BLOCK_ROWS, PANEL, STRIDE, fold};
use faer::{Mat, MatRef};

/// The running QR `[W | y] -> [R z; 0 e]` of the rows pushed so far: all that least squares needs to know of them.
///
/// `‖y - W x‖² = ‖z - R x‖² + e²` for every `x`, so the fit, its covariance and its residual follow from the triangle alone.
/// The answer is that of the batch to rounding, however the rows are cut and however factors are merged; memory is
/// `O(n_columns²)`. Columns of exact zeros are harmless.
/// Source: Bierman 1977, chapter V.
#[derive(Debug, Clone, PartialEq)]
pub struct InformationFactor {
    n_columns: usize,
    n_rows: usize,
    /// `n_columns + 1` padded to a multiple of the kernel's panel.
    width: usize,
    /// `width × width`, column-major, upper.
    triangle: Vec<f64>,
    /// Rows not yet folded, `BLOCK_ROWS × width` at distance `STRIDE`, column-major.
    block: Vec<f64>,
    n_pending: usize,
}

impl InformationFactor {
    /// A factor of no rows for `n_columns` unknowns.
    pub fn new(n_columns: usize) -> Self {
        let width = (n_columns + 1).next_multiple_of(PANEL);
        Self {
            n_columns,
            n_rows: 0,
            width,
            triangle: vec![0.0; width * width],
            block: vec![0.0; width * STRIDE],
            n_pending: 0,
        }
    }

    /// From the entries `(row, column)` of `[R z; 0 e]`, asked for where `row <= column`.
    pub(crate) fn of_triangle(
        n_columns: usize,
        n_rows: usize,
        entry: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let mut factor = Self::new(n_columns);
        factor.n_rows = n_rows;
        for j in 0..=n_columns {
            for i in 0..=j {
                factor.triangle[j * factor.width + i] = entry(i, j);
            }
        }
        factor
    }

    /// Folds rows in: `w` holds rows of `W` one after another (row-major), `y` one observation a row.
    ///
    /// # Errors
    /// [`Error::NonFinite`] with the row; the factor is then as before.
    ///
    /// # Panics
    /// If `w.len() != y.len() * n_columns`.
    #[track_caller]
    pub fn push_rows(&mut self, w: &[f64], y: &[f64]) -> Result<(), Error> {
        let n = self.n_columns;
        assert_eq!(
            w.len(),
            y.len() * n,
            "{} entries of W for {} observations and {n} columns",
            w.len(),
            y.len()
        );
        self.refuse_non_finite(w, y)?;
        for (row, &observation) in y.iter().enumerate() {
            self.push_row(&w[row * n..(row + 1) * n], observation);
        }
        self.n_rows += y.len();
        Ok(())
    }

    /// Folds in everything the other factor has seen.
    ///
    /// # Panics
    /// If the factors have different numbers of columns.
    #[track_caller]
    pub fn merge(&mut self, other: &Self) {
        let n = self.n_columns;
        assert_eq!(
            n, other.n_columns,
            "factors of {n} and {} columns",
            other.n_columns
        );
        let parts = other.parts();
        let mut row = vec![0.0; n];
        for i in 0..n {
            (0..n).for_each(|j| row[j] = parts.r[(i, j)]);
            self.push_row(&row, parts.z[i]);
        }
        row.fill(0.0);
        self.push_row(&row, parts.e);
        self.n_rows += other.n_rows;
    }

    /// The same rows with only these columns of `W`, in this order.
    ///
    /// # Panics
    /// If a column is out of range.
    #[must_use]
    #[track_caller]
    pub fn select(&self, columns: &[usize]) -> Self {
        let n = self.n_columns;
        assert!(
            columns.iter().all(|&c| c < n),
            "columns {columns:?} of a factor of {n} columns"
        );
        let parts = self.parts();
        let mut out = Self::new(columns.len());
        let mut row = vec![0.0; columns.len()];
        for i in 0..n {
            for (to, &from) in row.iter_mut().zip(columns) {
                *to = parts.r[(i, from)];
            }
            out.push_row(&row, parts.z[i]);
        }
        row.fill(0.0);
        out.push_row(&row, parts.e);
        out.n_rows = self.n_rows;
        out
    }

    /// Number of unknowns.
    pub fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// Number of rows seen.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// `[R z; 0 e]`.
    pub fn parts(&self) -> Parts {
        let (n, width) = (self.n_columns, self.width);
        let mut triangle = self.triangle.clone();
        if self.n_pending > 0 {
            fold(
                &mut triangle,
                &mut self.block.clone(),
                width,
                self.n_pending,
            );
        }
        Parts {
            r: Mat::from_fn(
                n,
                n,
                |i, j| if i <= j { triangle[j * width + i] } else { 0.0 },
            ),
            z: triangle[n * width..][..n].to_vec(),
            e: triangle[n * width + n],
        }
    }

    /// `‖y - W x̂‖` of the least-squares fit.
    pub fn residual_norm(&self) -> f64 {
        self.parts().e.abs()
    }

    /// `‖y‖`.
    pub fn observation_norm(&self) -> f64 {
        self.parts().observation_norm()
    }

    fn push_row(&mut self, w: &[f64], y: f64) {
        let at = self.n_pending;
        for (column, &value) in self.block.chunks_exact_mut(STRIDE).zip(w) {
            column[at] = value;
        }
        self.block[self.n_columns * STRIDE + at] = y;
        self.n_pending += 1;
        if self.n_pending == BLOCK_ROWS {
            fold(&mut self.triangle, &mut self.block, self.width, BLOCK_ROWS);
            self.n_pending = 0;
        }
    }

    fn refuse_non_finite(&self, w: &[f64], y: &[f64]) -> Result<(), Error> {
        // Without an early exit the compiler tests eight entries at a time.
        let bad = |values: &[f64]| values.iter().fold(false, |bad, v| bad | !v.is_finite());
        if !bad(w) && !bad(y) {
            return Ok(());
        }
        let in_w = w.iter().position(|v| !v.is_finite());
        let in_y = y.iter().position(|v| !v.is_finite());
        let n = self.n_columns.max(1);
        let (row, place, value) = match (in_w, in_y) {
            (Some(k), None) => (k / n, Place::Column(k % n), w[k]),
            (Some(k), Some(row)) if k / n <= row => (k / n, Place::Column(k % n), w[k]),
            (_, Some(row)) => (row, Place::Observation, y[row]),
            (None, None) => return Ok(()),
        };
        Err(Error::NonFinite {
            row: self.n_rows + row,
            place,
            value,
        })
    }
}

/// The triangle `[R z; 0 e]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// `R`, upper triangular, `n × n`; the sign of a row is arbitrary. `RᵀR = WᵀW`.
    pub r: Mat<f64>,
    /// `z`, `n`. `Rᵀz = Wᵀy`.
    pub z: Vec<f64>,
    /// `e`; its size is the norm of the residual.
    pub e: f64,
}

impl Parts {
    /// `‖y‖`.
    pub fn observation_norm(&self) -> f64 {
        self.z
            .iter()
            .map(|z| z * z)
            .sum::<f64>()
            .sqrt()
            .hypot(self.e)
    }
}

/// The factor of a dense `W` (`m × n`) and `y` (`m`).
///
/// # Errors
/// [`Error::NonFinite`].
///
/// # Panics
/// If `y` has not one entry a row.
#[track_caller]
pub fn factor_of(w: MatRef<'_, f64>, y: &[f64]) -> Result<InformationFactor, Error> {
    let mut factor = InformationFactor::new(w.ncols());
    visit_dense(w, y, w.nrows().max(1), |w, y| factor.push_rows(w, y))?;
    Ok(factor)
}

/// Hands a dense matrix out as row-major blocks of whole samples.
#[track_caller]
pub(crate) fn visit_dense(
    w: MatRef<'_, f64>,
    y: &[f64],
    block_rows: usize,
    mut sink: impl FnMut(&[f64], &[f64]) -> Result<(), Error>,
) -> Result<(), Error> {
    assert_eq!(
        w.nrows(),
        y.len(),
        "W has {} rows, y has {}",
        w.nrows(),
        y.len()
    );
    let n = w.ncols();
    let mut rows = Vec::new();
    for (block, y) in y.chunks(block_rows).enumerate() {
        rows.clear();
        for i in 0..y.len() {
            rows.extend((0..n).map(|j| w[(block * block_rows + i, j)]));
        }
        sink(&rows, y)?;
    }
    Ok(())
}
