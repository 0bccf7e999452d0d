//! Ranks in doubt, columns that nearly vanish, and callers' mistakes.
#![allow(clippy::unwrap_used)]

use idim_base_params::{Reduction, ReductionOptions, TriangularFactor, reduce};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const N_ROWS: usize = 60;

/// Rows of six independent columns; `edit` may change each row.
fn rows(edit: impl Fn(&mut [f64; 6], &mut ChaCha8Rng)) -> TriangularFactor {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut factor = TriangularFactor::new(6);
    for _ in 0..N_ROWS {
        let mut row = [0.0; 6].map(|_: f64| rng.random_range(-1.0..1.0));
        edit(&mut row, &mut rng);
        factor.push_rows(&row);
    }
    factor
}

fn reduce_in_order(factor: &TriangularFactor) -> Reduction {
    reduce(factor, &[0, 1, 2, 3, 4, 5], &ReductionOptions::default())
}

#[test]
fn a_noisy_relation_is_ambiguous_and_named() {
    let noisy =
        rows(|row, rng| row[4] = 2.0 * row[1] - row[2] + 1e-6 * rng.random_range(-1.0..1.0));
    let reduction = reduce_in_order(&noisy);
    let ambiguity = reduction.ambiguity.unwrap();
    assert_eq!((ambiguity.lower_rank, ambiguity.upper_rank), (5, 6));
    assert!(ambiguity.gap > 1e4);
    assert_eq!(reduction.base, [0, 1, 2, 3, 5]);
    // Column 4 - 2 column 1 + column 2, the largest entry being 1, and nothing else.
    for (value, expected) in ambiguity
        .combination
        .iter()
        .zip([0.0, -1.0, 0.5, 0.0, 0.5, 0.0])
    {
        assert!(
            (value - expected).abs() <= 1e-5 * f64::abs(expected),
            "{:?}",
            ambiguity.combination
        );
    }
}

#[test]
fn a_relation_to_rounding_is_clear() {
    let reduction = reduce_in_order(&rows(|row, _| row[4] = 2.0 * row[1] - row[2]));
    assert!(reduction.ambiguity.is_none());
    assert!(reduction.rank_gap > 1e10);
    assert_eq!(reduction.column_coefficients(4).len(), 2);
}

#[test]
fn a_poorly_excited_direction_counts_unless_a_smaller_gap_is_asked_for() {
    let reduction = reduce_in_order(&rows(|row, rng| {
        row[4] = row[1] + 1e-3 * rng.random_range(-1.0..1.0);
    }));
    // 1e-3 is a poorly excited direction, not a relation: it stands far above the rounding.
    assert!(reduction.ambiguity.is_none());
    assert_eq!(reduction.rank(), 6);
    let strict = ReductionOptions {
        min_gap: 1e2,
        ..ReductionOptions::default()
    };
    let ambiguity = reduce(
        &rows(|row, rng| row[4] = row[1] + 1e-3 * rng.random_range(-1.0..1.0)),
        &[0, 1, 2, 3, 4, 5],
        &strict,
    )
    .ambiguity
    .unwrap();
    assert_eq!((ambiguity.lower_rank, ambiguity.upper_rank), (5, 6));
}

#[test]
fn ghosts_are_reported_and_not_kept() {
    for size in [1e-6, 1.3e-9] {
        let reduction = reduce_in_order(&rows(|row, _| {
            row[0] *= size;
            row[3] *= 0.5 * size;
        }));
        assert_eq!(reduction.base, [1, 2, 4, 5]);
        assert_eq!(reduction.unidentifiable, [0, 3]);
        assert_eq!(
            reduction
                .ghosts
                .iter()
                .map(|ghost| ghost.column)
                .collect::<Vec<_>>(),
            [0, 3]
        );
        assert!((reduction.ghosts[0].relative_norm / size - 1.0).abs() < 0.5);
        let ambiguity = reduction.ambiguity.unwrap();
        assert_eq!((ambiguity.lower_rank, ambiguity.upper_rank), (4, 6));
        assert_eq!(ambiguity.combination, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
}

#[test]
fn two_ghosts_of_one_direction_count_once() {
    let reduction = reduce_in_order(&rows(|row, _| {
        row[0] *= 1e-6;
        row[3] = -2.0 * row[0];
    }));
    assert_eq!(reduction.ghosts.len(), 2);
    let ambiguity = reduction.ambiguity.unwrap();
    assert_eq!((ambiguity.lower_rank, ambiguity.upper_rank), (4, 5));
}

#[test]
fn regress_columns_of_rounding_vanish_before_scaling() {
    // cos(pi/2) = 6e-17 in place of zero; scaled to unit norm these columns would look independent.
    let reduction = reduce_in_order(&rows(|row, _| {
        row[0] *= 6e-17;
        row[2] *= 1e-13;
        row[5] = 0.0;
    }));
    assert_eq!(reduction.base, [1, 3, 4]);
    assert_eq!(reduction.unidentifiable, [0, 2, 5]);
    assert!(reduction.ghosts.is_empty() && reduction.ambiguity.is_none());
}

#[test]
fn a_small_column_that_depends_on_large_ones_is_combined() {
    // A lever of a millimetre: its square is no ghost, it is regrouped exactly.
    let reduction = reduce_in_order(&rows(|row, _| row[0] = 1e-6 * (row[1] - row[4])));
    assert!(reduction.ambiguity.is_none() && reduction.ghosts.is_empty());
    assert_eq!(reduction.combined, [0]);
    assert_eq!(reduction.base, [1, 2, 3, 4, 5]);
    for (base, alpha) in reduction.column_coefficients(0) {
        let expected = if base == 1 { 1e-6 } else { -1e-6 };
        assert!((alpha - expected).abs() < 1e-9 * 1e-6, "{base}: {alpha}");
    }
}

#[test]
fn the_order_decides_who_is_kept() {
    let factor = rows(|row, _| row[4] = row[1] + row[3]);
    let options = ReductionOptions::default();
    for (order, base, combined) in [
        ([0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 5], 4),
        ([5, 4, 3, 2, 1, 0], [5, 4, 3, 2, 0], 1),
        ([4, 1, 0, 2, 3, 5], [4, 1, 0, 2, 5], 3),
    ] {
        let reduction = reduce(&factor, &order, &options);
        assert_eq!(reduction.base, base);
        assert_eq!(reduction.combined, [combined]);
    }
    let names = ["A1", "B1", "C1", "D2", "E2", "F"].map(String::from);
    let reduction = reduce(&factor, &[4, 1, 0, 2, 3, 5], &options);
    assert_eq!(
        reduction.base_names(&names),
        ["ER2", "BR1", "A1", "C1", "F"]
    );
    assert_eq!(reduction.relation(0, &names), "ER2 = E2 + D2");
    assert_eq!(reduction.relation(1, &names), "BR1 = B1 - D2");
    assert_eq!(reduction.relation(4, &names), "F");
    assert_eq!(reduction.column_relation(3, &names), "D2 = E2 - B1");
}

#[test]
fn too_few_rows_leave_the_rank_in_doubt() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut factor = TriangularFactor::new(6);
    for _ in 0..4 {
        factor.push_rows(&[0.0; 6].map(|_: f64| rng.random_range(-1.0..1.0)));
    }
    let ambiguity = reduce_in_order(&factor).ambiguity.unwrap();
    assert_eq!((ambiguity.lower_rank, ambiguity.upper_rank), (4, 6));
}

#[test]
fn nothing_at_all_is_unidentifiable() {
    for factor in [TriangularFactor::new(6), rows(|row, _| *row = [0.0; 6])] {
        let reduction = reduce_in_order(&factor);
        assert_eq!(reduction.unidentifiable, [0, 1, 2, 3, 4, 5]);
        assert_eq!(reduction.rank(), 0);
        assert!(reduction.ambiguity.is_none());
        assert!(reduction.base_parameters(&[1.0; 6]).is_empty());
    }
}

#[test]
fn a_poor_order_shows_in_the_condition() {
    // Columns 0 and 1 nearly parallel, column 2 their difference: kept first they are a poor base.
    let factor = rows(|row, _| {
        let difference = row[1];
        row[1] = row[0] + 1e-5 * difference;
        row[2] = difference;
    });
    let kept_first = reduce_in_order(&factor);
    assert_eq!(kept_first.base, [0, 1, 3, 4, 5]);
    assert!(kept_first.is_poorly_ordered());
    let better = reduce(&factor, &[0, 2, 1, 3, 4, 5], &ReductionOptions::default());
    assert_eq!(better.base, [0, 2, 3, 4, 5]);
    assert!(!better.is_poorly_ordered());
}

#[test]
#[should_panic(expected = "row 1, column 2 is NaN")]
fn rows_must_be_finite() {
    TriangularFactor::new(3).push_rows(&[1.0, 2.0, 3.0, 4.0, 5.0, f64::NAN]);
}

#[test]
#[should_panic(expected = "7 numbers are not rows of 3 columns")]
fn rows_must_be_whole() {
    TriangularFactor::new(3).push_rows(&[0.0; 7]);
}

#[test]
#[should_panic(expected = "name each of 6 columns once")]
fn the_order_must_name_each_column_once() {
    reduce(
        &rows(|_, _| ()),
        &[0, 1, 2, 3, 4, 4],
        &ReductionOptions::default(),
    );
}
