//! What must hold for every matrix.
#![allow(clippy::unwrap_used)]

use faer::Mat;
use idim_base_params::{Reduction, ReductionOptions, TriangularFactor, reduce};
use proptest::prelude::*;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rounding of some hundred operations, beside the largest number involved.
const ROUNDING: f64 = 1e-12;

/// `W`, rows × columns of the given rank, with vanishing columns, columns of very different norm, and columns that are
/// combinations of a few others (as in a robot) rather than of all.
fn low_rank(rng: &mut ChaCha8Rng, n_rows: usize, n_columns: usize) -> (Mat<f64>, usize) {
    let mut w = Mat::<f64>::zeros(n_rows, n_columns);
    let mut rank = 0;
    for j in 0..n_columns {
        let kind = rng.random_range(0..10);
        if kind < 2 {
            continue;
        }
        if kind < 5 && j > 0 {
            for _ in 0..3 {
                let from = rng.random_range(0..j);
                let factor = rng.random_range(0.3..1.0) * [-1.0, 1.0][rng.random_range(0..2)];
                for i in 0..n_rows {
                    w[(i, j)] += factor * w[(i, from)];
                }
            }
            continue;
        }
        let size = 10f64.powf(rng.random_range(-0.5..0.5));
        for i in 0..n_rows {
            w[(i, j)] = size * rng.random_range(-1.0..1.0);
        }
        rank += 1;
    }
    (w, rank)
}

fn row_major(w: &Mat<f64>) -> Vec<f64> {
    (0..w.nrows())
        .flat_map(|i| (0..w.ncols()).map(move |j| w[(i, j)]))
        .collect()
}

fn factor_of(w: &Mat<f64>) -> TriangularFactor {
    let mut factor = TriangularFactor::new(w.ncols());
    factor.push_rows(&row_major(w));
    factor
}

fn shuffled(rng: &mut ChaCha8Rng, n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    order.shuffle(rng);
    order
}

/// Largest entry of `a - b` beside the largest of `b`.
fn difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
    (a - b).norm_max() / b.norm_max().max(f64::MIN_POSITIVE)
}

/// Columns left over by cancellation carry more rounding than `ROUNDING`; columns kept nearly parallel lose digits in
/// proportion to their condition, and the result says so. Both are rare in `low_rank`, and tests of their own.
fn is_well_posed(w: &Mat<f64>, reduction: &Reduction) -> bool {
    let norms: Vec<f64> = (0..w.ncols()).map(|j| w.col(j).norm_l2()).collect();
    let largest = norms.iter().copied().fold(0.0, f64::max);
    let is_small = |norm: &f64| *norm > 0.0 && *norm < 1e-3 * largest;
    reduction.base_condition < 1e3 && !norms.iter().any(is_small)
}

fn rank_of(w: &Mat<f64>, columns: &[usize]) -> usize {
    let picked = Mat::from_fn(w.nrows(), columns.len(), |i, k| {
        let column = w.col(columns[k]);
        column[i] / column.norm_l2()
    });
    if columns.is_empty() {
        return 0;
    }
    let values = picked.singular_values().unwrap();
    values
        .iter()
        .filter(|value| **value > 1e-9 * values[0])
        .count()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn identity_triangle_has_the_gram_matrix_of_the_rows(seed: u64, n in 1usize..40, n_rows in 1usize..150) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (w, _) = low_rank(&mut rng, n_rows, n);
        let factor = factor_of(&w);
        let r = factor.r();
        prop_assert_eq!(factor.n_rows(), n_rows);
        prop_assert!(difference(&(r.transpose() * r), &(w.transpose() * &w)) < ROUNDING);
        for j in 0..n {
            for i in j + 1..n {
                prop_assert_eq!(r[(i, j)], 0.0);
            }
            if w.col(j).norm_max() == 0.0 {
                prop_assert_eq!(r.col(j).norm_max(), 0.0);
            }
        }
    }

    #[test]
    fn identity_chunks_and_merges_equal_the_batch(seed: u64, n in 1usize..30, cut in 1usize..99) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (w, _) = low_rank(&mut rng, 100, n);
        let rows = row_major(&w);
        let (first, second) = rows.split_at(cut * n);
        let mut merged = TriangularFactor::new(n);
        for row in first.chunks(n) {
            merged.push_rows(row);
        }
        let mut other = TriangularFactor::new(n);
        other.push_rows(second);
        merged.merge(&other);
        prop_assert_eq!(merged.n_rows(), 100);
        let gram = merged.r().transpose() * merged.r();
        prop_assert!(difference(&gram, &(w.transpose() * &w)) < ROUNDING);
    }

    #[test]
    fn identity_regrouping_preserves_every_product(seed: u64, n in 1usize..40) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (w, rank) = low_rank(&mut rng, 5 * n, n);
        let order = shuffled(&mut rng, n);
        let reduction = reduce(&factor_of(&w), &order, &ReductionOptions::default());
        prop_assert_eq!(reduction.rank(), rank);
        prop_assert!(reduction.ambiguity.is_none());
        prop_assert!(reduction.ghosts.is_empty());
        prop_assume!(is_well_posed(&w, &reduction));
        let w_b = Mat::from_fn(w.nrows(), rank, |i, b| w[(i, reduction.base[b])]);
        prop_assert!(difference(&(&w_b * &reduction.regrouping), &w) < ROUNDING);

        let x: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let base_parameters = reduction.base_parameters(&x);
        for i in 0..w.nrows() {
            let full: f64 = (0..n).map(|j| w[(i, j)] * x[j]).sum();
            let reduced: f64 = (0..rank).map(|b| w_b[(i, b)] * base_parameters[b]).sum();
            prop_assert!((full - reduced).abs() <= ROUNDING * w.norm_max() * n as f64);
        }
    }

    #[test]
    fn identity_categories_are_those_of_the_rank_tests(seed: u64, n in 1usize..25) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (w, _) = low_rank(&mut rng, 5 * n, n);
        let order = shuffled(&mut rng, n);
        let reduction = reduce(&factor_of(&w), &order, &ReductionOptions::default());
        prop_assume!(is_well_posed(&w, &reduction));
        let (u, s, d, base) = categories_by_rank_tests(&w, &order);
        prop_assert_eq!(&reduction.unidentifiable, &u);
        prop_assert_eq!(&reduction.identifiable_alone, &s);
        prop_assert_eq!(&reduction.combined, &d);
        prop_assert_eq!(&reduction.base, &base);
        for &column in &d {
            let mut left = w.col(column).to_owned();
            for (base, alpha) in reduction.column_coefficients(column) {
                left -= alpha * w.col(base);
            }
            prop_assert!(left.norm_l2() < ROUNDING * w.norm_l2());
        }
    }

    #[test]
    fn identity_units_and_rows_in_another_order_change_no_name(seed: u64, n in 2usize..25) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (w, _) = low_rank(&mut rng, 5 * n, n);
        let order = shuffled(&mut rng, n);
        let reference = reduce(&factor_of(&w), &order, &ReductionOptions::default());
        let units: Vec<f64> = (0..n).map(|_| 10f64.powf(rng.random_range(-0.5..0.5))).collect();
        let rows = shuffled(&mut rng, w.nrows());
        let other = Mat::from_fn(w.nrows(), n, |i, j| w[(rows[i], j)] * units[j]);
        let reduction = reduce(&factor_of(&other), &order, &ReductionOptions::default());
        prop_assume!(is_well_posed(&w, &reference) && is_well_posed(&other, &reduction));
        prop_assert_eq!(&reduction.base, &reference.base);
        prop_assert_eq!(&reduction.combined, &reference.combined);
        // K of the new columns: diag(units of base)⁻¹ K diag(units).
        let expected = Mat::from_fn(reduction.rank(), n, |b, j| {
            reference.regrouping[(b, j)] * units[j] / units[reference.base[b]]
        });
        if reduction.rank() > 0 {
            prop_assert!(difference(&reduction.regrouping, &expected) < 1e-10);
        }
    }
}

/// Section II.B of Radkhah, Kulić and Croft to the letter: steps 3 to 5, with ranks by singular values.
fn categories_by_rank_tests(
    w: &Mat<f64>,
    order: &[usize],
) -> (Vec<usize>, Vec<usize>, Vec<usize>, Vec<usize>) {
    let (unidentifiable, mut phi): (Vec<usize>, Vec<usize>) = order
        .iter()
        .partition(|j| w.col(**j).norm_max() <= 1e-13 * w.norm_max());
    let rank = rank_of(w, &phi);
    let (mut alone, mut combined, mut base) = (Vec::new(), Vec::new(), Vec::new());
    for &column in &phi.clone() {
        let without: Vec<usize> = phi.iter().copied().filter(|j| *j != column).collect();
        let mut extended = base.clone();
        extended.push(column);
        if rank_of(w, &without) < rank {
            alone.push(column);
            base.push(column);
        } else if rank_of(w, &extended) > rank_of(w, &base) {
            base.push(column);
        } else {
            phi = without;
            combined.push(column);
        }
    }
    (unidentifiable, alone, combined, base)
}

#[test]
fn identity_same_input_same_bits() {
    let run = || -> Reduction {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let (w, _) = low_rank(&mut rng, 300, 60);
        reduce(
            &factor_of(&w),
            &(0..60).collect::<Vec<_>>(),
            &ReductionOptions::default(),
        )
    };
    let (a, b) = (run(), run());
    assert_eq!(a.regrouping, b.regrouping);
    assert_eq!(a.rank_gap.to_bits(), b.rank_gap.to_bits());
}
