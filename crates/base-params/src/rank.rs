//! The rank, and how sure it is.

use faer::{Mat, MatRef};

/// Singular values below this share of the largest are rounding.
///
/// Double precision leaves some 1e-16 to 1e-15 of cancellation behind; a value counts as real only `min_gap` above this,
/// which for the usual 1e4 is 1e-10, the same limit as [`VANISHED`](crate::reduce::VANISHED) for a single column.
const NOISE: f64 = 1e-14;

/// What one sequence of falling values (singular values, pivots) says about the rank.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Reading {
    lower: usize,
    upper: usize,
    /// Ratio of the values on both sides of `lower`.
    gap: f64,
}

/// What all sequences together say.
pub(crate) struct Rank {
    /// Values that are certain.
    pub(crate) lower: usize,
    /// Values that may be real; equal to `lower` if the rank is clear.
    pub(crate) upper: usize,
    /// The smallest of the ratios across the rank `lower`.
    pub(crate) gap: f64,
    /// Residual of a unit column below which it depends on the kept ones: the geometric middle of the gap.
    pub(crate) tolerance: f64,
    /// 2-norm condition of the unit columns that a pivoted QR keeps.
    pub(crate) pivoted_condition: f64,
}

/// Rank of `unit` (columns of unit norm), confirmed by `raw` (the same columns, all divided by one number).
///
/// Three witnesses: pivots of a QR with column exchange and singular values, both of the unit columns, must show one and the
/// same gap, and the singular values of the raw columns must fall by as much across it. Unit columns alone would hide a
/// column that is nearly zero, raw columns alone a relation between two small ones.
pub(crate) fn rank(unit: MatRef<'_, f64>, raw: MatRef<'_, f64>, min_gap: f64) -> Rank {
    let n = unit.ncols();
    if n == 0 {
        return Rank {
            lower: 0,
            upper: 0,
            gap: f64::INFINITY,
            tolerance: 1.0,
            pivoted_condition: 1.0,
        };
    }
    let qr = unit.col_piv_qr();
    let pivots: Vec<f64> = (0..n).map(|i| qr.R()[(i, i)].abs()).collect();
    let unit_values = singular_values(unit);
    let raw_values = singular_values(raw);

    let by_pivots = read(&pivots, min_gap);
    let by_values = read(&unit_values, min_gap);
    let mut lower = by_pivots.lower.min(by_values.lower);
    let mut upper = by_pivots.upper.max(by_values.upper);
    let gap_at = |rank| {
        [&pivots, &unit_values, &raw_values]
            .iter()
            .map(|values| gap_after(values, rank))
            .fold(f64::INFINITY, f64::min)
    };
    if gap_after(&raw_values, lower) < min_gap {
        let by_raw = read(&raw_values, min_gap);
        lower = lower.min(by_raw.lower);
        upper = upper.max(by_raw.upper.min(n));
        if lower == upper {
            // The witnesses agree on the place and not on its clarity.
            if upper < n { upper += 1 } else { lower -= 1 }
        }
    }

    let floor = NOISE * unit_values[0];
    let below = unit_values
        .get(lower)
        .map_or(floor, |value| value.max(floor));
    let above = lower
        .checked_sub(1)
        .map_or(unit_values[0], |last| unit_values[last].max(floor));
    Rank {
        lower,
        upper,
        gap: gap_at(lower),
        tolerance: (above * below).sqrt(),
        pivoted_condition: condition(qr.R().get(..lower, ..lower)),
    }
}

/// 2-norm condition number; 1 for an empty matrix.
pub(crate) fn condition(matrix: MatRef<'_, f64>) -> f64 {
    if matrix.ncols() == 0 {
        return 1.0;
    }
    let values = singular_values(matrix);
    values[0] / values[values.len() - 1]
}

/// Singular values, falling.
pub(crate) fn singular_values(matrix: MatRef<'_, f64>) -> Vec<f64> {
    matrix
        .singular_values()
        .expect("singular values of a finite matrix converge")
}

/// Ratio of the values at both sides of `rank`, both lifted to the noise.
fn gap_after(values: &[f64], rank: usize) -> f64 {
    let floor = NOISE * values[0];
    let below = values.get(rank).map_or(floor, |value| value.max(floor));
    rank.checked_sub(1)
        .map_or(1.0, |last| values[last].max(floor) / below)
}

/// The ranks that a falling sequence allows: one that is followed by a gap of `min_gap`, or everything between the first
/// such and the last; where there is none, everything between its two largest gaps.
fn read(values: &[f64], min_gap: f64) -> Reading {
    let gaps: Vec<(usize, f64)> = (1..=values.len())
        .map(|rank| (rank, gap_after(values, rank)))
        .collect();
    let mut clear = gaps.iter().filter(|(_, gap)| *gap >= min_gap);
    if let Some(&(lower, gap)) = clear.next() {
        return Reading {
            lower,
            upper: clear.next_back().map_or(lower, |last| last.0),
            gap,
        };
    }
    let mut by_gap = gaps;
    by_gap.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let (first, gap) = by_gap[0];
    let second = by_gap.get(1).map_or(first, |next| next.0);
    Reading {
        lower: first.min(second),
        upper: first.max(second),
        gap,
    }
}

/// The columns `columns` of `r`, each divided by its entry of `divisors`.
pub(crate) fn scaled_columns(
    r: MatRef<'_, f64>,
    columns: &[usize],
    divisors: impl Fn(usize) -> f64,
) -> Mat<f64> {
    Mat::from_fn(r.nrows(), columns.len(), |i, j| {
        r[(i, columns[j])] / divisors(columns[j])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_gap_is_clear() {
        let reading = read(&[3.0, 1.0, 0.1, 1e-15, 1e-16], 1e4);
        assert_eq!((reading.lower, reading.upper), (3, 3));
        assert!(reading.gap > 1e12);
    }

    #[test]
    fn full_rank_is_a_gap_above_the_noise() {
        assert_eq!(
            read(&[1.0, 0.5, 0.01], 1e4),
            Reading {
                lower: 3,
                upper: 3,
                gap: 0.01 / NOISE
            }
        );
    }

    #[test]
    fn regress_puma_with_nine_digits_is_36_or_38_never_37() {
        // Singular values of a PUMA 560 whose right angles carry nine digits: 36 real ones, then 1.3e-9 and 7e-10.
        let mut values = vec![1.0; 35];
        values.extend([0.02, 1.3e-9, 7e-10, 2e-16, 1e-16]);
        let reading = read(&values, 1e4);
        assert_eq!((reading.lower, reading.upper), (36, 38));
    }

    #[test]
    fn without_any_gap_everything_between_the_two_largest() {
        let reading = read(&[1.0, 0.1, 1e-4, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13], 1e4);
        assert_eq!((reading.lower, reading.upper), (2, 4));
        assert!(reading.gap < 1e4);
    }
}
