//! Weighted fits, joint statistics, and uncertainty that covers the truth as often as it says.
#![allow(clippy::unwrap_used)]

mod common;

use common::{dense, distance, factor, normals, rng, times, worst};
use faer::Mat;
use idim_estimation::{
    Error, InformationFactor, NoiseCovariance, ResidualStatistics, Solution, WeightedEstimate,
    WeightedSolution, Weighting, WeightingOptions, sandwich_covariance, solve,
    solve_with_known_noise, weighted_least_squares, weighted_least_squares_dense,
};
use rand_chacha::ChaCha8Rng;

/// A made-up arm of three joints, six parameters, of which the joints see different parts.
const JOINTS: usize = 3;
const PARAMETERS: usize = 6;
const TRUTH: [f64; PARAMETERS] = [2.0, -0.7, 0.05, 11.0, 0.3, -4.0];

fn arm_rows(rng: &mut ChaCha8Rng, n_samples: usize) -> Vec<f64> {
    let mut w = normals(rng, JOINTS * n_samples * PARAMETERS);
    for (row, entries) in w.chunks_exact_mut(PARAMETERS).enumerate() {
        entries[..2 * (row % JOINTS)].fill(0.0);
    }
    w
}

/// Noise of the joints: unequal by a factor of 40, strongly correlated between the first two.
fn arm_noise() -> NoiseCovariance {
    let sigma = [2.0, 0.5, 0.05];
    let correlation = [[1.0, 0.8, 0.1], [0.8, 1.0, 0.0], [0.1, 0.0, 1.0]];
    NoiseCovariance::new(
        Mat::from_fn(3, 3, |i, j| sigma[i] * sigma[j] * correlation[i][j]).as_ref(),
    )
    .unwrap()
}

/// Observations with noise of covariance `L Lᵀ`.
fn noisy(rng: &mut ChaCha8Rng, w: &[f64], noise: &NoiseCovariance) -> Vec<f64> {
    let l = noise.covariance().llt(faer::Side::Lower).unwrap();
    let mut y = times(w, &TRUTH);
    for sample in y.chunks_exact_mut(JOINTS) {
        let e = normals(rng, JOINTS);
        for i in 0..JOINTS {
            sample[i] += (0..=i).map(|k| l.L()[(i, k)] * e[k]).sum::<f64>();
        }
    }
    y
}

fn weighted(w: &[f64], y: &[f64], options: &WeightingOptions) -> WeightedEstimate {
    match weighted_least_squares_dense(dense(w, PARAMETERS).as_ref(), y, JOINTS, options).unwrap() {
        WeightedSolution::Determined(fit) => fit,
        WeightedSolution::RankDeficient(outcome) => panic!("{outcome:?}"),
    }
}

#[test]
fn identity_weighted_equals_rows_divided_by_their_sigma() {
    let mut rng = rng(1);
    let w = arm_rows(&mut rng, 300);
    let y = noisy(&mut rng, &w, &arm_noise());
    let sigma = [2.0, 0.5, 0.05];
    let (mut ww, mut yw) = (w.clone(), y.clone());
    NoiseCovariance::diagonal(&sigma)
        .unwrap()
        .whiten(&mut ww, &mut yw);
    let by_hand: Vec<f64> = w
        .iter()
        .enumerate()
        .map(|(k, v)| v / sigma[k / PARAMETERS % JOINTS])
        .collect();
    let y_hand: Vec<f64> = y
        .iter()
        .enumerate()
        .map(|(k, v)| v / sigma[k % JOINTS])
        .collect();
    let one = solve(&factor(&ww, &yw, PARAMETERS))
        .unwrap()
        .determined()
        .unwrap();
    let two = solve(&factor(&by_hand, &y_hand, PARAMETERS))
        .unwrap()
        .determined()
        .unwrap();
    assert!(worst(&one.values, &two.values) < 1e-12);
    assert!(worst(&one.standard_deviation, &two.standard_deviation) < 1e-12);
}

#[test]
fn identity_weighting_finds_the_noise_and_a_fixed_point() {
    let mut rng = rng(2);
    let w = arm_rows(&mut rng, 4000);
    let noise = arm_noise();
    let y = noisy(&mut rng, &w, &noise);
    let options = WeightingOptions {
        n_iterations: 50,
        tolerance: 1e-11,
        ..WeightingOptions::default()
    };
    let fit = weighted(&w, &y, &options);
    assert!(
        fit.converged && fit.n_iterations < 50,
        "{} {}",
        fit.n_iterations,
        fit.last_change
    );
    // 4000 samples know a standard deviation to 1.1 %, one sigma.
    assert!(worst(&fit.noise.standard_deviation(), &noise.standard_deviation()) < 0.05);
    assert!((fit.noise.correlation(1, 0) - 0.8).abs() < 0.02);
    assert!(
        (fit.estimate.sigma - 1.0).abs() < 1e-3,
        "{}",
        fit.estimate.sigma
    );
    // The fixed point is the fit whitened by its own noise.
    let (mut ww, mut yw) = (w.clone(), y.clone());
    fit.noise.whiten(&mut ww, &mut yw);
    let again = solve(&factor(&ww, &yw, PARAMETERS))
        .unwrap()
        .determined()
        .unwrap();
    assert!(distance(&again.values, &fit.estimate.values) < 1e-12);
    // Weighting pays: the stated uncertainty of what the noisy joint hides falls by the correlation's worth.
    let plain = &fit.ordinary;
    assert!(
        fit.estimate
            .standard_deviation
            .iter()
            .zip(&plain.standard_deviation)
            .all(|(w, o)| w < o)
    );
    assert!(distance(&fit.estimate.values, &TRUTH) < distance(&plain.values, &TRUTH));
}

#[test]
fn identity_streamed_weighting_equals_dense() {
    let mut rng = rng(3);
    let w = arm_rows(&mut rng, 500);
    let y = noisy(&mut rng, &w, &arm_noise());
    for weighting in [Weighting::Diagonal, Weighting::Full] {
        let options = WeightingOptions {
            weighting,
            n_iterations: 3,
            tolerance: 0.0,
        };
        let dense = weighted(&w, &y, &options);
        let mut calls = 0;
        let streamed = weighted_least_squares(PARAMETERS, JOINTS, &options, |sink| {
            calls += 1;
            // 37 samples at a time.
            for (w, y) in w
                .chunks(37 * JOINTS * PARAMETERS)
                .zip(y.chunks(37 * JOINTS))
            {
                sink(w, y);
            }
        });
        let WeightedSolution::Determined(streamed) = streamed.unwrap() else {
            panic!("determined")
        };
        assert_eq!(
            (calls, streamed.n_iterations, streamed.converged),
            (8, 3, false)
        );
        assert!(worst(&streamed.estimate.values, &dense.estimate.values) < 1e-12);
        assert!(
            worst(
                &streamed.estimate.standard_deviation,
                &dense.estimate.standard_deviation
            ) < 1e-12
        );
        let expected_correlation = if weighting == Weighting::Full {
            0.8
        } else {
            0.0
        };
        assert!((streamed.noise.correlation(0, 1) - expected_correlation).abs() < 0.1);
    }
}

#[test]
fn weighting_reports_what_it_cannot_do() {
    let mut rng = rng(4);
    let mut w = arm_rows(&mut rng, 50);
    let y = noisy(&mut rng, &w, &arm_noise());
    // A joint that never moves.
    w.chunks_exact_mut(PARAMETERS).for_each(|row| row[2] = 0.0);
    let outcome = weighted_least_squares_dense(
        dense(&w, PARAMETERS).as_ref(),
        &y,
        JOINTS,
        &WeightingOptions::default(),
    )
    .unwrap();
    assert!(
        matches!(outcome, WeightedSolution::RankDeficient(ref d) if d.undetermined == [2]),
        "{outcome:?}"
    );
    // A joint without torque and without parameters has no noise to weigh by.
    let w: Vec<f64> = (0..60)
        .flat_map(|k| {
            if k % 3 == 2 {
                [0.0, 0.0]
            } else {
                [f64::from(k).sin(), f64::from(k).cos()]
            }
        })
        .collect();
    let y: Vec<f64> = (0..60)
        .map(|k| if k % 3 == 2 { 0.0 } else { f64::from(k % 7) })
        .collect();
    let outcome =
        weighted_least_squares_dense(dense(&w, 2).as_ref(), &y, 3, &WeightingOptions::default());
    assert!(
        matches!(outcome, Err(Error::NotPositiveDefinite { joint: 2, .. })),
        "{outcome:?}"
    );
    // A NaN within the stream.
    let outcome = weighted_least_squares(1, 1, &WeightingOptions::default(), |sink| {
        sink(&[1.0, 2.0], &[1.0, 1.0]);
        sink(&[f64::NAN], &[1.0]);
    });
    assert!(
        matches!(outcome, Err(Error::NonFinite { row: 2, .. })),
        "{outcome:?}"
    );
}

/// Runs seeded experiments and counts how often the 95 % interval of each parameter holds the truth.
fn coverage(
    runs: u64,
    mut interval: impl FnMut(&[f64], &[f64]) -> (Vec<f64>, Vec<f64>),
) -> [u64; PARAMETERS] {
    let mut rng = rng(20_260_101);
    let w = arm_rows(&mut rng, 60);
    let noise = arm_noise();
    let mut hits = [0; PARAMETERS];
    for _ in 0..runs {
        let y = noisy(&mut rng, &w, &noise);
        let (values, std) = interval(&w, &y);
        for i in 0..PARAMETERS {
            hits[i] += u64::from((values[i] - TRUTH[i]).abs() <= 1.959_964 * std[i]);
        }
    }
    hits
}

/// Bounds on a binomial count of 2000 at 0.95: 1900 ± 4 standard deviations of 9.75, exceeded once in 16 000 counts.
const RUNS: u64 = 2000;
const COVERED: std::ops::RangeInclusive<u64> = 1861..=1939;

#[test]
fn identity_whitened_fit_covers_the_truth_as_stated() {
    let noise = arm_noise();
    let hits = coverage(RUNS, |w, y| {
        let (mut w, mut y) = (w.to_vec(), y.to_vec());
        noise.whiten(&mut w, &mut y);
        let fit = solve_with_known_noise(&factor(&w, &y, PARAMETERS), 1.0)
            .unwrap()
            .determined()
            .unwrap();
        (fit.values, fit.standard_deviation)
    });
    assert!(
        hits.iter().all(|h| COVERED.contains(h)),
        "{hits:?} of {RUNS}"
    );
}

#[test]
fn identity_sandwich_covers_where_the_plain_covariance_does_not() {
    let noise = arm_noise();
    let plain = coverage(RUNS, |w, y| {
        let fit = solve(&factor(w, y, PARAMETERS))
            .unwrap()
            .determined()
            .unwrap();
        (fit.values, fit.standard_deviation)
    });
    // One common sigma for joints that differ 40 times: far too sure of what the noisy joint alone sees.
    assert!(plain.iter().any(|h| *h < 1600), "{plain:?}");
    let sandwich = coverage(RUNS, |w, y| {
        let bread = factor(w, y, PARAMETERS);
        let fit = solve(&bread).unwrap().determined().unwrap();
        let (mut w, mut y) = (w.to_vec(), y.to_vec());
        noise.colour(&mut w, &mut y);
        let covariance = sandwich_covariance(&bread, &factor(&w, &y, PARAMETERS))
            .unwrap()
            .unwrap();
        (
            fit.values,
            (0..PARAMETERS).map(|i| covariance[(i, i)].sqrt()).collect(),
        )
    });
    assert!(
        sandwich.iter().all(|h| COVERED.contains(h)),
        "{sandwich:?} of {RUNS}"
    );
}

#[test]
fn identity_weighted_fit_with_estimated_noise_covers_nearly_as_stated() {
    // 60 samples estimate six covariances: the intervals are some percent short, as theory says, no more.
    let hits = coverage(RUNS, |w, y| {
        let fit = weighted(w, y, &WeightingOptions::default());
        (fit.estimate.values, fit.estimate.standard_deviation)
    });
    assert!(
        hits.iter().all(|h| (1800..=1939).contains(h)),
        "{hits:?} of {RUNS}"
    );
}

#[test]
fn identity_chi_square_of_the_residual() {
    // (‖ρ‖/σ)² over its degrees of freedom is 1 within 4 σ of its own scatter, √(2/ν).
    let mut rng = rng(8);
    let w = arm_rows(&mut rng, 2000);
    let noise = arm_noise();
    let (mut w, mut y) = (w.clone(), noisy(&mut rng, &w, &noise));
    noise.whiten(&mut w, &mut y);
    let fit = solve_with_known_noise(&factor(&w, &y, PARAMETERS), 1.0)
        .unwrap()
        .determined()
        .unwrap();
    let nu = fit.degrees_of_freedom as f64;
    assert!((fit.residual_norm.powi(2) / nu - 1.0).abs() < 4.0 * (2.0 / nu).sqrt());
}

#[test]
fn identity_statistics_of_a_joint_by_hand() {
    let measured = [1.0e6 + 1.0, 1.0e6 + 2.0, 1.0e6 + 4.0, 1.0e6 + 5.0];
    let predicted = [1.0e6 + 1.5, 1.0e6 + 2.0, 1.0e6 + 3.0, 1.0e6 + 5.5];
    let mut statistics = ResidualStatistics::new(2);
    for (m, p) in measured.iter().zip(predicted) {
        statistics.push(1, *m, p);
    }
    let joint = statistics.joint(1);
    // Residuals -0.5, 0, 1, -0.5: squares sum to 1.5; deviations -2, -1, 1, 2: squares sum to 10.
    assert_eq!(joint.n, 4);
    assert!((joint.rms - (1.5_f64 / 4.0).sqrt()).abs() < 1e-15);
    assert!(
        (joint.r2 - 0.85).abs() < 1e-10,
        "the offset of 1e6 must not cost digits: {}",
        joint.r2
    );
    assert!((joint.max_abs - 1.0).abs() < 1e-15 && joint.mean.abs() < 1e-15);
    let norm = measured.iter().map(|m| m * m).sum::<f64>().sqrt();
    assert!((joint.relative_error - 1.5_f64.sqrt() / norm).abs() < 1e-18);
    assert!((statistics.relative_error() - joint.relative_error).abs() < 1e-18);
    assert!((statistics.rms() - joint.rms).abs() < 1e-15);
    // The joint without samples says nothing; a NaN is not forgotten.
    let empty = statistics.joint(0);
    assert!(empty.n == 0 && empty.rms.is_nan() && empty.max_abs.is_nan() && empty.r2.is_nan());
    statistics.push(1, f64::NAN, 0.0);
    statistics.push(1, 1.0, 0.0);
    assert!(statistics.joint(1).rms.is_nan() && statistics.joint(1).r2.is_nan());
}

#[test]
fn identity_residual_statistics_agree_with_the_fit() {
    let mut rng = rng(10);
    let w = arm_rows(&mut rng, 100);
    let y = noisy(&mut rng, &w, &arm_noise());
    let mut by_row = InformationFactor::new(PARAMETERS);
    for (row, y) in w.chunks_exact(PARAMETERS).zip(&y) {
        by_row.push_rows(row, &[*y]).unwrap();
    }
    let Solution::Determined(fit) = solve(&by_row).unwrap() else {
        panic!("determined")
    };
    let mut statistics = ResidualStatistics::new(JOINTS);
    for (row, (measured, predicted)) in y.iter().zip(times(&w, &fit.values)).enumerate() {
        statistics.push(row % JOINTS, *measured, predicted);
    }
    assert!((statistics.relative_error() / fit.relative_error() - 1.0).abs() < 1e-12);
    let squares: f64 = statistics
        .all()
        .iter()
        .map(|j| j.rms * j.rms * j.n as f64)
        .sum();
    assert!((squares.sqrt() / fit.residual_norm - 1.0).abs() < 1e-12);
}

#[test]
fn identity_student_intervals_cover_with_few_rows() {
    // Five rows, two unknowns: the normal interval would cover 86 %. 3000 ± 11.9 at 0.95, four of them.
    let (runs, mut hits) = (3000, 0_u32);
    let mut rng = rng(11);
    let w = normals(&mut rng, 10);
    for _ in 0..runs {
        let y: Vec<f64> = times(&w, &[1.0, -2.0])
            .iter()
            .zip(normals(&mut rng, 5))
            .map(|(y, e)| y + e)
            .collect();
        let fit = solve(&factor(&w, &y, 2)).unwrap().determined().unwrap();
        let [low, high] = fit.confidence_interval(1, 0.95);
        hits += u32::from((low..=high).contains(&-2.0));
    }
    assert!((2803..=2897).contains(&hits), "{hits} of {runs}");
}
