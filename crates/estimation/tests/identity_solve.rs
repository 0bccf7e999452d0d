//! Values, covariance, weights and outcomes of the fit.
#![allow(clippy::unwrap_used)]

mod common;

use common::{distance, factor, normals, random_rows, rng, times, worst};
use faer::Mat;
use idim_estimation::{
    Error, Estimate, InformationFactor, NoiseCovariance, ResidualCovariance, Solution,
    condition_number, matrix_error_bound, observation_error_bound, sandwich_covariance, solve,
    solve_with_known_noise,
};
use proptest::prelude::*;

/// Two routes to the same number, relative.
const SAME: f64 = 1e-11;

fn estimate(solution: Solution) -> Estimate {
    solution.determined().unwrap()
}

/// A well-conditioned covariance of `n` joints.
fn covariance(rng: &mut rand_chacha::ChaCha8Rng, n: usize) -> Mat<f64> {
    let a = normals(rng, n * n);
    let a = Mat::from_fn(n, n, |i, j| a[i * n + j]);
    &a * a.transpose() + Mat::<f64>::identity(n, n)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn identity_noise_free_rows_return_the_truth(m in 1_usize..150, n in 1_usize..16, seed: u64) {
        let mut rng = rng(seed);
        let w = random_rows(&mut rng, 2 * n + m, n);
        let x = normals(&mut rng, n);
        let fit = estimate(solve(&factor(&w, &times(&w, &x), n)).unwrap());
        // Reflections are backward stable: of the values in units of their columns, all together, not each by itself.
        let lengths: Vec<f64> = (0..n)
            .map(|j| w.iter().skip(j).step_by(n).map(|x| x * x).sum::<f64>().sqrt())
            .collect();
        let in_units = |v: &[f64]| -> Vec<f64> { v.iter().zip(&lengths).map(|(v, l)| v * l).collect() };
        let rounding = w.len() as f64 * f64::EPSILON * fit.condition_number.equilibrated;
        let error = distance(&in_units(&fit.values), &in_units(&x));
        prop_assert!(error <= rounding, "{error} of {rounding}");
        prop_assert!(fit.relative_error() <= 1e-14);
        prop_assert_eq!(fit.rank, n);
    }

    #[test]
    fn identity_covariance_is_the_inverse_of_the_gram(m in 30_usize..100, n in 1_usize..8, sigma in 0.01..100.0_f64, seed: u64) {
        let mut rng = rng(seed);
        let (w, y) = (random_rows(&mut rng, m, n), normals(&mut rng, m));
        let factor = factor(&w, &y, n);
        let known = estimate(solve_with_known_noise(&factor, sigma).unwrap());
        let dense = common::dense(&w, n);
        let product = &known.covariance * (dense.transpose() * &dense);
        for i in 0..n {
            for j in 0..n {
                let expected = if i == j { sigma * sigma } else { 0.0 };
                let scale = (known.covariance[(i, i)] / known.covariance[(j, j)]).sqrt();
                prop_assert!((product[(i, j)] - expected).abs() <= 1e-10 * sigma * sigma * scale.max(1.0));
            }
        }
        // The two uncertainties differ by the sigma of the residual alone.
        let shown = estimate(solve(&factor).unwrap());
        prop_assert_eq!(&shown.values, &known.values);
        let ratio: Vec<f64> = known.standard_deviation.iter().map(|s| s / sigma * shown.sigma).collect();
        prop_assert!(worst(&ratio, &shown.standard_deviation) <= SAME);
        prop_assert!((shown.sigma - known.residual_sigma()).abs() <= SAME * shown.sigma);
    }

    #[test]
    fn identity_scaling_columns_scales_values(m in 30_usize..100, n in 1_usize..8, seed: u64) {
        let mut rng = rng(seed);
        let (w, y) = (random_rows(&mut rng, m, n), normals(&mut rng, m));
        let units: Vec<f64> = (0..n).map(|j| 2_f64.powi(j as i32 * 3 - 9)).collect();
        let scaled: Vec<f64> = w.chunks_exact(n).flat_map(|row| row.iter().zip(&units).map(|(a, u)| a * u)).collect();
        let plain = estimate(solve(&factor(&w, &y, n)).unwrap());
        let other = estimate(solve(&factor(&scaled, &y, n)).unwrap());
        let back: Vec<f64> = other.values.iter().zip(&units).map(|(v, u)| v * u).collect();
        prop_assert!(worst(&back, &plain.values) <= SAME);
        prop_assert!(worst(&other.relative_std, &plain.relative_std) <= SAME);
        // Equilibration forgets the units, the raw number does not.
        prop_assert!((other.condition_number.equilibrated / plain.condition_number.equilibrated - 1.0).abs() <= SAME);
    }

    #[test]
    fn identity_whitening_is_the_inverse_covariance(n_joints in 1_usize..7, n_samples in 1_usize..6, n in 1_usize..5, seed: u64) {
        let mut rng = rng(seed);
        let omega = covariance(&mut rng, n_joints);
        let noise = NoiseCovariance::new(omega.as_ref()).unwrap();
        let rows = n_joints * n_samples;
        let (w, y) = (random_rows(&mut rng, rows, n), normals(&mut rng, rows));
        let (mut ww, mut yw) = (w.clone(), y.clone());
        noise.whiten(&mut ww, &mut yw);
        // Σ Wᵗ Ω⁻¹ W sample by sample, with an inverse by another route.
        let inverse = faer::linalg::solvers::Solve::solve(&omega.partial_piv_lu(), Mat::<f64>::identity(n_joints, n_joints));
        let (dense, white) = (common::dense(&w, n), common::dense(&ww, n));
        let mut expected = Mat::<f64>::zeros(n, n);
        for t in 0..n_samples {
            let block = dense.as_ref().subrows(t * n_joints, n_joints);
            expected += block.transpose() * &inverse * block;
        }
        let got = white.transpose() * &white;
        prop_assert!((&got - &expected).norm_l2() <= SAME * expected.norm_l2());
        // Colouring with Lᵀ: the Gram becomes Σ Wᵗ Ω W.
        let (mut wc, mut yc) = (w, y);
        noise.colour(&mut wc, &mut yc);
        let coloured = common::dense(&wc, n);
        let mut expected = Mat::<f64>::zeros(n, n);
        for t in 0..n_samples {
            let block = dense.as_ref().subrows(t * n_joints, n_joints);
            expected += block.transpose() * &omega * block;
        }
        prop_assert!((coloured.transpose() * &coloured - &expected).norm_l2() <= SAME * expected.norm_l2());
    }

    #[test]
    fn identity_sandwich_of_white_noise_is_the_plain_covariance(m in 10_usize..40, n in 1_usize..6, seed: u64) {
        let mut rng = rng(seed);
        let (mut w, mut y) = (random_rows(&mut rng, 3 * m, n), normals(&mut rng, 3 * m));
        let bread = factor(&w, &y, n);
        let plain = estimate(solve_with_known_noise(&bread, 0.3).unwrap());
        NoiseCovariance::diagonal(&[0.3; 3]).unwrap().colour(&mut w, &mut y);
        let sandwich = sandwich_covariance(&bread, &factor(&w, &y, n)).unwrap().unwrap();
        for i in 0..n {
            prop_assert!((sandwich[(i, i)].sqrt() / plain.standard_deviation[i] - 1.0).abs() <= SAME);
        }
    }

    #[test]
    fn identity_dependent_columns_are_named(n in 3_usize..9, a in 0_usize..9, b in 0_usize..9, seed: u64) {
        let mut rng = rng(seed);
        let (a, b) = (a % n, b % n);
        prop_assume!(a != b);
        // Column n is 2 (column a) - 3 (column b), in its own units.
        let w = random_rows(&mut rng, 80, n);
        let x = normals(&mut rng, n);
        let y = times(&w, &x);
        let wide: Vec<f64> =
            w.chunks_exact(n).flat_map(|row| [row, &[2.0 * row[a] - 3.0 * row[b]]].concat()).collect();
        let Solution::RankDeficient(outcome) = solve(&factor(&wide, &y, n + 1)).unwrap() else { panic!("dependent columns") };
        let mut expected = vec![a, b, n];
        expected.sort_unstable();
        prop_assert_eq!(outcome.rank, n);
        prop_assert_eq!(&outcome.undetermined, &expected);
        prop_assert!(outcome.vanishing.is_empty());
        prop_assert!(outcome.pivots[0] > 1e-3 && outcome.pivots[1] < 1e-13);
        // The combination is the planted one up to a factor.
        let v = &outcome.null_combinations[0];
        prop_assert!((v[a] / v[n] + 2.0).abs() < 1e-9 && (v[b] / v[n] - 3.0).abs() < 1e-9);
        for j in 0..n {
            if j != a && j != b {
                prop_assert!((outcome.values[j].unwrap() - x[j]).abs() < 1e-9, "{} {}", outcome.values[j].unwrap(), x[j]);
            } else {
                prop_assert_eq!(outcome.values[j], None);
            }
        }
    }

    #[test]
    fn identity_observation_bound_12_holds_for_square_w(n in 1_usize..8, k in 1e-6..1e-1_f64, seed: u64) {
        let mut rng = rng(seed);
        let (w, x) = (random_rows(&mut rng, n, n), normals(&mut rng, n));
        let y = times(&w, &x);
        let dy: Vec<f64> = normals(&mut rng, n).into_iter().map(|e| e * k).collect();
        let disturbed: Vec<f64> = y.iter().zip(&dy).map(|(a, b)| a + b).collect();
        let fit = estimate(solve_with_known_noise(&factor(&w, &disturbed, n), 1.0).unwrap());
        prop_assume!(fit.condition_number.raw < 1e8);
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let bound = observation_error_bound(fit.condition_number.raw, norm(&dy), norm(&y));
        prop_assert!(distance(&fit.values, &x) <= bound * (1.0 + 1e-6) + 1e-12);
    }
}

#[test]
fn identity_matrix_bound_13_holds_for_square_w() {
    for seed in 0..40 {
        let mut rng = rng(seed);
        let n = 5;
        let (w, x) = (normals(&mut rng, n * n), normals(&mut rng, n));
        let y = times(&w, &x);
        let dw: Vec<f64> = normals(&mut rng, n * n)
            .into_iter()
            .map(|e| e * 1e-3)
            .collect();
        let disturbed: Vec<f64> = w.iter().zip(&dw).map(|(a, b)| a + b).collect();
        let fit = estimate(solve_with_known_noise(&factor(&disturbed, &y, n), 1.0).unwrap());
        let cond = condition_number(&factor(&w, &y, n)).unwrap().raw;
        let largest = |w: &[f64]| common::dense(w, n).singular_values().unwrap()[0];
        let bound = matrix_error_bound(cond, largest(&dw), largest(&w));
        // (13) divides by the disturbed solution.
        let error = distance(&x, &fit.values);
        assert!(error <= bound * (1.0 + 1e-9), "{error} > {bound}");
        assert!(bound < 1e4 * error, "a bound that could not fail");
    }
}

#[test]
fn identity_residual_covariance_by_hand() {
    let mut rng = rng(9);
    let (n_joints, samples, p) = (3, 40, 4);
    let (w, y) = (
        random_rows(&mut rng, n_joints * samples, p),
        normals(&mut rng, n_joints * samples),
    );
    let x = normals(&mut rng, p);
    let mut residuals = ResidualCovariance::new(n_joints);
    residuals.push_rows(&w[..60 * p], &y[..60], &x);
    residuals.push_rows(&w[60 * p..], &y[60..], &x);
    let omega = residuals.full(p).unwrap();
    let diagonal = residuals.diagonal(p).unwrap();
    let r: Vec<f64> = y.iter().zip(times(&w, &x)).map(|(y, f)| y - f).collect();
    let divisor = samples as f64 - p as f64 / n_joints as f64;
    for i in 0..n_joints {
        for j in 0..n_joints {
            let sum: f64 = r.chunks_exact(n_joints).map(|r| r[i] * r[j]).sum();
            assert!(
                (omega.covariance()[(i, j)] - sum / divisor).abs()
                    < 1e-12 * omega.covariance()[(i, i)]
            );
        }
        assert_eq!(diagonal.covariance()[(i, i)], omega.covariance()[(i, i)]);
    }
    assert!((omega.correlation(1, 1) - 1.0).abs() < 1e-15);
}

#[test]
fn unexcited_and_dependent_columns_come_in_one_report() {
    let mut rng = rng(4);
    let w: Vec<f64> = (0..50)
        .flat_map(|_| {
            let r = normals(&mut rng, 2);
            // Columns: free, copy of the free one, cos(π/2) dust, free.
            [r[0], 2.0 * r[0], 6e-17 * r[1], r[1]]
        })
        .collect();
    let y = normals(&mut rng, 50);
    let Solution::RankDeficient(outcome) = solve(&factor(&w, &y, 4)).unwrap() else {
        panic!("rank 2 of 4")
    };
    assert_eq!(
        (outcome.rank, outcome.vanishing, outcome.undetermined),
        (2, vec![2], vec![0, 1, 2])
    );
    assert_eq!(outcome.null_combinations.len(), 2);
    assert!(outcome.values[3].is_some() && outcome.standard_deviation[3].unwrap() > 0.0);
    // What is determined agrees with the fit without the redundant columns.
    let kept = estimate(solve(&factor(&w, &y, 4).select(&[1, 3])).unwrap());
    assert!((kept.values[1] - outcome.values[3].unwrap()).abs() < 1e-13);
    assert!((kept.standard_deviation[1] - outcome.standard_deviation[3].unwrap()).abs() < 1e-13);
    assert!((kept.residual_norm / outcome.residual_norm - 1.0).abs() < 1e-13);
}

#[test]
fn a_matrix_of_zeros_determines_nothing() {
    let Solution::RankDeficient(outcome) = solve(&factor(&[0.0; 6], &[1.0, 2.0, 2.0], 2)).unwrap()
    else {
        panic!("rank 0")
    };
    assert_eq!((outcome.rank, outcome.undetermined), (0, vec![0, 1]));
    assert!((outcome.residual_norm - 3.0).abs() < 1e-15);
    let condition = condition_number(&factor(&[0.0; 6], &[1.0; 3], 2)).unwrap();
    assert_eq!(
        (condition.raw, condition.equilibrated),
        (f64::INFINITY, f64::INFINITY)
    );
}

#[test]
fn too_few_rows_are_refused() {
    let square = factor(&[1.0, 2.0, 3.0, 5.0], &[1.0, 2.0], 2);
    assert_eq!(
        solve(&square),
        Err(Error::TooFewRows {
            n_rows: 2,
            n_columns: 2,
            needed: 3
        })
    );
    assert!(matches!(
        solve_with_known_noise(&square, 1.0),
        Ok(Solution::Determined(_))
    ));
    let flat = factor(&[1.0, 2.0], &[1.0], 2);
    assert_eq!(
        solve_with_known_noise(&flat, 1.0),
        Err(Error::TooFewRows {
            n_rows: 1,
            n_columns: 2,
            needed: 2
        })
    );
    assert!(matches!(
        solve_with_known_noise(&square, 0.0),
        Err(Error::OutOfRange { .. })
    ));
    assert!(matches!(
        solve_with_known_noise(&square, f64::NAN),
        Err(Error::OutOfRange { .. })
    ));
    assert!(matches!(
        solve(&InformationFactor::new(3)),
        Err(Error::TooFewRows { n_rows: 0, .. })
    ));
}

#[test]
fn covariances_that_are_none_are_refused() {
    let matrix = |a: [[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| a[i][j]);
    let of = |a| NoiseCovariance::new(matrix(a).as_ref());
    assert!(matches!(
        of([[1.0, 0.5], [0.2, 1.0]]),
        Err(Error::NotSymmetric {
            row: 1,
            column: 0,
            ..
        })
    ));
    assert!(matches!(
        of([[1.0, 1.0], [1.0, 1.0]]),
        Err(Error::NotPositiveDefinite { joint: 1, .. })
    ));
    assert!(matches!(
        of([[0.0, 0.0], [0.0, 1.0]]),
        Err(Error::NotPositiveDefinite { joint: 0, .. })
    ));
    assert!(matches!(
        of([[f64::NAN, 0.0], [0.0, 1.0]]),
        Err(Error::NotPositiveDefinite { joint: 0, .. })
    ));
    assert!(matches!(
        NoiseCovariance::diagonal(&[1.0, -2.0]),
        Err(Error::OutOfRange { value: -2.0, .. })
    ));
    let noise = of([[4.0, 1.0], [1.0, 9.0]]).unwrap();
    assert_eq!(noise.standard_deviation(), [2.0, 3.0]);
    assert!((noise.correlation(0, 1) - 1.0 / 6.0).abs() < 1e-16);
}
