//! Periods, their average and its noise; harmonics and their derivatives.
#![allow(clippy::unwrap_used)]

use idim_measurement::{average_periods, find_period, fit_harmonics};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

fn series(t: f64, joint: usize) -> [f64; 3] {
    let (w, j) = (0.7, joint as f64);
    let mut x = [0.3 * j, 0.0, 0.0];
    for l in 1..=4 {
        let (a, b) = (
            (f64::from(l) + j).sin() / f64::from(l),
            (2.0 * f64::from(l) - j).cos() / f64::from(l),
        );
        let v = w * f64::from(l);
        let (s, c) = (v * t).sin_cos();
        x[0] += a * c + b * s;
        x[1] += v * (b * c - a * s);
        x[2] -= v * v * (a * c + b * s);
    }
    x
}

const PERIOD: f64 = std::f64::consts::TAU / 0.7;

fn recording(
    n_joints: usize,
    samples_per_period: f64,
    n: usize,
    noise: f64,
    seed: u64,
) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n_joints)
        .map(|j| {
            (0..n)
                .map(|k| {
                    let e: f64 = StandardNormal.sample(&mut rng);
                    series(k as f64 / samples_per_period * PERIOD, j)[0] + noise * e
                })
                .collect()
        })
        .collect()
}

#[test]
fn identity_the_period_is_found_to_a_fraction_of_a_sample() {
    for (samples, n) in [(200.0, 900), (337.4, 2100), (8976.3, 40_000)] {
        let found = find_period(&recording(3, samples, n, 1e-3, 7)).unwrap();
        let error = (found.samples - samples).abs();
        assert!(error < 0.1 + 1e-4 * samples, "{found:?} for {samples}");
        assert!(found.mismatch < 1e-3, "{found:?}");
    }
}

#[test]
fn motion_that_does_not_repeat_has_no_period() {
    assert!(find_period(&recording(3, 600.0, 900, 0.0, 7)).is_none());
    let chirp = (0..2000).map(|k| (1e-5 * f64::from(k * k)).sin()).collect();
    assert!(find_period(&[chirp]).is_none());
    assert!(find_period(&[vec![1.0; 500]]).is_none());
    assert!(find_period(&[]).is_none());
}

#[test]
fn identity_noise_covariance_is_unbiased() {
    // Correlated noise e = L n of known covariance L Lᵀ on three channels.
    let l = [[1.0, 0.0, 0.0], [0.5, 2.0, 0.0], [-0.4, 0.3, 0.7]];
    let (samples, periods, runs) = (50, 4, 400);
    let mut mean = [[0.0; 3]; 3];
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..runs {
        let mut columns = recording(3, samples as f64, samples * (periods + 1), 0.0, 0);
        for k in 0..columns[0].len() {
            let n: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            for (c, l) in columns.iter_mut().zip(l) {
                c[k] += l.iter().zip(n).map(|(l, n)| l * n).sum::<f64>();
            }
        }
        // A transient in the first period must not count.
        columns[1][0] += 100.0;
        let refs: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let average = average_periods(&refs, samples, 1).unwrap();
        assert_eq!(average.n_periods, periods);
        for (mean, row) in mean.iter_mut().zip(&average.noise_covariance) {
            for (mean, value) in mean.iter_mut().zip(row) {
                *mean += value / f64::from(runs);
            }
        }
    }
    // Standard error of a variance v over 60000 degrees of freedom: v sqrt(2 / 60000) = 0.6 %; four of them.
    for a in 0..3 {
        for b in 0..3 {
            let truth: f64 = (0..3).map(|k| l[a][k] * l[b][k]).sum();
            let scale: f64 = (0..3).map(|k| l[a][k].powi(2)).sum::<f64>().sqrt()
                * (0..3).map(|k| l[b][k].powi(2)).sum::<f64>().sqrt();
            let error = (mean[a][b] - truth).abs() / scale;
            assert!(
                error < 0.024,
                "covariance {a} {b}: {} for {truth}",
                mean[a][b]
            );
        }
    }
}

#[test]
fn averaging_needs_two_periods() {
    let column = vec![0.0; 150];
    let message = average_periods(&[&column], 100, 0).unwrap_err().to_string();
    assert!(
        message.contains("150 samples hold 1 whole periods"),
        "{message}"
    );
    assert!(average_periods(&[&column], 50, 2).is_err());
    average_periods(&[&column], 50, 1).unwrap();
}

#[test]
fn identity_harmonics_give_exact_derivatives() {
    let period = recording(3, 64.0, 64, 0.0, 0);
    let fit = fit_harmonics(&period, PERIOD, 4).unwrap();
    let times: Vec<f64> = (0..37).map(|k| 0.21 * f64::from(k)).collect();
    let states = fit.states(&times);
    for j in 0..3 {
        assert!(fit.residual[j] < 1e-14);
        for (k, &t) in times.iter().enumerate() {
            let [q, qd, qdd] = series(t, j);
            assert!((states.q(j)[k] - q).abs() < 1e-13);
            assert!((states.qd(j)[k] - qd).abs() < 1e-12);
            assert!((states.qdd(j)[k] - qdd).abs() < 1e-12);
        }
    }
    // One harmonic too few leaves what it lacks: amplitude / sqrt(2).
    let short = fit_harmonics(&period, PERIOD, 3).unwrap();
    let (a, b) = (fit.cosine[1][3], fit.sine[1][3]);
    assert!((short.residual[1] - a.hypot(b) / 2f64.sqrt()).abs() < 1e-13);
    assert!(fit_harmonics(&period, PERIOD, 32).is_err());
}
