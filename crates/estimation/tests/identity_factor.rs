//! The running factor is the batch factor, however the rows arrive.
#![allow(clippy::unwrap_used)]

mod common;

use common::{distance, factor, normals, random_rows, rng, times, worst};
use faer::Mat;
use idim_estimation::{Error, Estimate, InformationFactor, Place, Solution, solve};
use proptest::prelude::*;
use rand::RngExt;

/// Batch and sequential answers, relative, entry by entry (issue: 1e-12).
const SAME: f64 = 1e-12;
/// `‖RᵀR - WᵀW‖ / ‖WᵀW‖`: a backward error of a few hundred ε.
const BACKWARD: f64 = 1e-13;

fn estimate(factor: &InformationFactor) -> Estimate {
    solve(factor).unwrap().determined().unwrap()
}

fn gram(r: &Mat<f64>) -> Mat<f64> {
    r.transpose() * r
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn identity_factor_keeps_the_normal_equations(m in 1_usize..400, n in 1_usize..20, seed: u64) {
        let mut rng = rng(seed);
        let (w, y) = (random_rows(&mut rng, m, n), normals(&mut rng, m));
        let parts = factor(&w, &y, n).parts();
        let w = common::dense(&w, n);
        let y_column = Mat::from_fn(m, 1, |i, _| y[i]);
        let z = Mat::from_fn(n, 1, |i, _| parts.z[i]);
        prop_assert!((gram(&parts.r) - gram(&w)).norm_l2() <= BACKWARD * gram(&w).norm_l2());
        let moment = w.transpose() * &y_column;
        prop_assert!((parts.r.transpose() * &z - &moment).norm_l2() <= BACKWARD * w.norm_l2() * y_column.norm_l2());
        prop_assert!((parts.observation_norm() / y_column.norm_l2() - 1.0).abs() <= BACKWARD);
    }

    #[test]
    fn identity_sequential_equals_batch(m in 60_usize..700, n in 1_usize..16, cuts in prop::collection::vec(0.0..1.0, 0..12), seed: u64) {
        let mut rng = rng(seed);
        let (w, y) = (random_rows(&mut rng, m, n), normals(&mut rng, m));
        let batch = estimate(&factor(&w, &y, n));
        let mut cuts: Vec<usize> = cuts.into_iter().map(|c: f64| (c * m as f64) as usize).collect();
        cuts.extend([0, m]);
        cuts.sort_unstable();
        let pieces: Vec<InformationFactor> =
            cuts.windows(2).map(|c| factor(&w[c[0] * n..c[1] * n], &y[c[0]..c[1]], n)).collect();
        let mut chunked = InformationFactor::new(n);
        for c in cuts.windows(2) {
            chunked.push_rows(&w[c[0] * n..c[1] * n], &y[c[0]..c[1]]).unwrap();
        }
        // A random merge tree: any two of the factors left, in either order.
        let mut forest = pieces;
        while forest.len() > 1 {
            let other = forest.swap_remove(rng.random_range(0..forest.len()));
            let at = rng.random_range(0..forest.len());
            forest[at].merge(&other);
        }
        for (how, other) in [("chunked", &chunked), ("merged", &forest[0])] {
            prop_assert_eq!(other.n_rows(), m);
            let other = estimate(other);
            prop_assert!(distance(&other.values, &batch.values) <= SAME, "{} values", how);
            prop_assert!(worst(&other.standard_deviation, &batch.standard_deviation) <= SAME, "{} std", how);
            prop_assert!((other.residual_norm / batch.residual_norm - 1.0).abs() <= SAME, "{} residual", how);
        }
    }

    #[test]
    fn identity_zero_columns_change_nothing(m in 40_usize..300, n in 2_usize..12, at in 0_usize..12, seed: u64) {
        let mut rng = rng(seed);
        let (w, y) = (random_rows(&mut rng, m, n), normals(&mut rng, m));
        let at = at % (n + 1);
        let wide: Vec<f64> = w.chunks_exact(n).flat_map(|row| [&row[..at], &[0.0], &row[at..]].concat()).collect();
        let plain = factor(&w, &y, n);
        let padded = factor(&wide, &y, n + 1);
        let others: Vec<usize> = (0..=n).filter(|&j| j != at).collect();
        let selected = estimate(&padded.select(&others));
        let expected = estimate(&plain);
        prop_assert!(distance(&selected.values, &expected.values) <= SAME);
        prop_assert!((padded.residual_norm() / plain.residual_norm() - 1.0).abs() <= SAME);
        let Solution::RankDeficient(outcome) = solve(&padded).unwrap() else { panic!("a zero column has no value") };
        prop_assert_eq!(outcome.undetermined, vec![at]);
        for (i, &j) in others.iter().enumerate() {
            prop_assert!((outcome.values[j].unwrap() - expected.values[i]).abs() <= 1e-11 * expected.standard_deviation[i].max(expected.values[i].abs()));
        }
    }

    #[test]
    fn identity_selected_columns_are_a_fit_of_their_own(m in 40_usize..200, n in 2_usize..10, seed: u64) {
        let mut rng = rng(seed);
        let (w, y) = (random_rows(&mut rng, m, n), normals(&mut rng, m));
        let columns: Vec<usize> = (0..n).rev().filter(|j| j % 2 == 0).collect();
        let narrow: Vec<f64> = w.chunks_exact(n).flat_map(|row| columns.iter().map(|&j| row[j])).collect();
        let selected = estimate(&factor(&w, &y, n).select(&columns));
        let direct = estimate(&factor(&narrow, &y, columns.len()));
        prop_assert!(distance(&selected.values, &direct.values) <= SAME);
        prop_assert!(worst(&selected.standard_deviation, &direct.standard_deviation) <= SAME);
    }
}

#[test]
fn identity_wide_triangles_cross_every_panel_and_block_border() {
    // Widths around the panel of four, row counts around the block of 128.
    for n in [1, 2, 3, 4, 5, 47, 48] {
        for m in [n + 1, 127, 128, 129, 255, 256, 257] {
            let mut rng = rng((n * 1000 + m) as u64);
            let w = random_rows(&mut rng, m.max(n + 1), n);
            let x = normals(&mut rng, n);
            let fit = estimate(&factor(&w, &times(&w, &x), n));
            let tolerance = 100.0 * f64::EPSILON * fit.condition_number.raw;
            assert!(
                distance(&fit.values, &x) <= tolerance,
                "{m} x {n}: {}",
                distance(&fit.values, &x)
            );
        }
    }
}

#[test]
fn identity_same_rows_same_bits() {
    let mut rng = rng(3);
    let (w, y) = (random_rows(&mut rng, 1000, 9), normals(&mut rng, 1000));
    assert_eq!(factor(&w, &y, 9).parts(), factor(&w, &y, 9).parts());
}

#[test]
fn non_finite_entries_are_refused_with_their_place() {
    let mut factor = InformationFactor::new(2);
    factor.push_rows(&[1.0, 2.0], &[3.0]).unwrap();
    let before = factor.clone();
    let outcome = factor.push_rows(&[1.0, 2.0, 3.0, f64::NAN], &[1.0, 2.0]);
    assert!(
        matches!(
            outcome,
            Err(Error::NonFinite {
                row: 2,
                place: Place::Column(1),
                ..
            })
        ),
        "{outcome:?}"
    );
    let outcome = factor.push_rows(&[1.0, 2.0], &[f64::INFINITY]);
    assert!(
        matches!(
            outcome,
            Err(Error::NonFinite {
                row: 1,
                place: Place::Observation,
                ..
            })
        ),
        "{outcome:?}"
    );
    let outcome = factor.push_rows(&[1.0, 2.0, f64::INFINITY, 1.0], &[f64::NAN, 0.0]);
    assert!(
        matches!(
            outcome,
            Err(Error::NonFinite {
                row: 1,
                place: Place::Observation,
                ..
            })
        ),
        "{outcome:?}"
    );
    assert_eq!(factor, before);
    assert_eq!(
        Error::NonFinite {
            row: 2,
            place: Place::Column(1),
            value: f64::NAN
        }
        .to_string(),
        "row 3 of all that were pushed, column 2 of W: NaN is not finite; drop the sample or mend the log"
    );
}

#[test]
fn overflowing_rows_are_refused() {
    let outcome = solve(&factor(&[1e200, 1e200, 2e200], &[1.0, 2.0, 3.0], 1));
    assert!(
        matches!(outcome, Err(Error::Overflow { .. })),
        "{outcome:?}"
    );
}

#[test]
#[should_panic(expected = "3 entries of W for 2 observations and 2 columns")]
fn wrong_shape_is_a_callers_bug() {
    let _ = InformationFactor::new(2).push_rows(&[1.0, 2.0, 3.0], &[1.0, 2.0]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// The normal equations lose half the digits at most: `n u cond²` of a condition of at most 100 here, or they decline.
    #[test]
    fn identity_products_give_the_factor_of_the_rows(m in 60_usize..300, n in 1_usize..16, seed: u64) {
        let mut rng = rng(seed);
        let (w, y) = (random_rows(&mut rng, m, n), normals(&mut rng, m));
        let rows = factor(&w, &y, n);
        let mut whole = common::dense(&w, n);
        whole.resize_with(m, n + 1, |i, _| y[i]);
        let products = whole.transpose() * &whole;
        let by_products = InformationFactor::from_products(products.as_ref(), m).unwrap();
        prop_assert_eq!(by_products.n_rows(), m);
        let (a, b) = (estimate(&by_products), estimate(&rows));
        prop_assert!(distance(&a.values, &b.values) <= 1e-11);
        prop_assert!((a.residual_norm / b.residual_norm - 1.0).abs() <= 1e-11);
    }
}

#[test]
fn identity_products_decline_what_they_cannot_carry() {
    let mut rng = rng(5);
    let (m, n) = (200, 4);
    let w = random_rows(&mut rng, m, n);
    let products = |w: &[f64], y: &[f64]| {
        let mut whole = common::dense(w, n);
        whole.resize_with(m, n + 1, |i, _| y[i]);
        whole.transpose() * &whole
    };
    let noise = normals(&mut rng, m);
    assert!(InformationFactor::from_products(products(&w, &noise).as_ref(), m).is_some());
    // Columns that differ by one part in 1e5.
    let mut near = w.clone();
    for row in near.chunks_exact_mut(n) {
        row[1] = row[0] + 1e-5 * row[1];
    }
    assert!(InformationFactor::from_products(products(&near, &noise).as_ref(), m).is_none());
    // Observations that the columns explain to rounding.
    let exact: Vec<f64> = w.chunks_exact(n).map(|row| row.iter().sum()).collect();
    assert!(InformationFactor::from_products(products(&w, &exact).as_ref(), m).is_none());
    // A column that never moves, and a number that is none.
    let mut still = w.clone();
    still.chunks_exact_mut(n).for_each(|row| row[2] = 0.0);
    assert!(InformationFactor::from_products(products(&still, &noise).as_ref(), m).is_none());
    let mut none = w;
    none[7] = f64::NAN;
    assert!(InformationFactor::from_products(products(&none, &noise).as_ref(), m).is_none());
}
