//! Powell's method on functions with known minima.

#![allow(clippy::unwrap_used)]

use idim_excitation::{PowellOptions, powell};
use proptest::prelude::*;

fn options(max_evaluations: usize) -> PowellOptions {
    PowellOptions {
        first_step: 0.3,
        longest_step: 20.0,
        accuracy: 1e-6,
        max_evaluations,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// A positive definite quadratic form of n variables.
    #[test]
    fn identity_quadratic_forms_end_after_conjugate_directions(
        entries in prop::collection::vec(-1.0..1.0_f64, 36),
        minimum in prop::collection::vec(-2.0..2.0_f64, 6),
        n in 2..=6_usize,
    ) {
        // A = BᵀB + 1, well conditioned enough that rounding plays no part.
        let a = |i: usize, j: usize| {
            let product: f64 = (0..n).map(|k| entries[6 * k + i] * entries[6 * k + j]).sum();
            product + f64::from(u8::from(i == j))
        };
        let f = |x: &[f64]| -> f64 {
            (0..n)
                .flat_map(|i| (0..n).map(move |j| (i, j)))
                .map(|(i, j)| a(i, j) * (x[i] - minimum[i]) * (x[j] - minimum[j]))
                .sum()
        };
        let found = powell(f, &vec![0.0; n], &options(100_000));
        prop_assert!(found.converged);
        // The test that guards against dependent directions may keep old ones, each of which costs an iteration; one
        // more confirms that nothing moves.
        prop_assert!(found.n_iterations <= 8 * n, "{} iterations", found.n_iterations);
        prop_assert!(found.value < 1e-9, "{}", found.value);
    }
}

#[test]
fn oracle_rosenbrock() {
    let f = |x: &[f64]| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2);
    let found = powell(f, &[-1.2, 1.0], &options(2000));
    assert!(found.converged);
    assert!(
        (found.x[0] - 1.0).abs() < 1e-4 && (found.x[1] - 1.0).abs() < 1e-4,
        "{found:?}"
    );
    // Powell (1964) reports some 150 evaluations; this may take a few times as many.
    assert!(found.n_evaluations < 600, "{}", found.n_evaluations);
}

#[test]
fn oracle_powell_singular_function() {
    let f = |x: &[f64]| {
        (x[0] + 10.0 * x[1]).powi(2)
            + 5.0 * (x[2] - x[3]).powi(2)
            + (x[1] - 2.0 * x[2]).powi(4)
            + 10.0 * (x[0] - x[3]).powi(4)
    };
    let found = powell(f, &[3.0, -1.0, 0.0, 1.0], &options(5000));
    assert!(found.value < 1e-9, "{found:?}");
}

#[test]
fn identity_the_outcome_is_the_objective_and_never_worse_than_the_start() {
    // A function that is not finite on half of the plane.
    let f = |x: &[f64]| {
        if x[0] < 0.0 {
            f64::INFINITY
        } else {
            (x[0] - 0.01).powi(2) + (x[1] - 3.0).powi(2) + x[0] * x[1]
        }
    };
    let found = powell(f, &[2.0, -1.0], &options(4000));
    assert_eq!(found.value, f(&found.x));
    assert!(found.value < f(&[2.0, -1.0]));
}

#[test]
fn regress_evaluations_run_out_with_the_best_so_far() {
    let f = |x: &[f64]| x.iter().map(|v| (v - 1.0).powi(4)).sum::<f64>();
    let found = powell(f, &[5.0; 10], &options(30));
    assert!(!found.converged);
    assert!(found.value < f(&[5.0; 10]));
    // The current iteration is finished: at most six evaluations a direction beyond the limit.
    assert!(
        found.n_evaluations < 30 + 6 * 11 + 1,
        "{}",
        found.n_evaluations
    );
}
