//! Outliers, superfluous parameters, noisy columns.
#![allow(clippy::unwrap_used)]

mod common;

use common::{factor, normals, rng, times, worst};
use idim_estimation::{
    DriveGainSample, Error, EssentialOptions, HUBER_K, InformationFactor, RobustEstimate,
    RobustLoss, RobustOptions, RobustSolution, SpanOptions, TUKEY_C, TotalLeastSquares,
    TotalSolution, down_weighted_spans, essential_parameters, mad_scale, robust_least_squares,
    robust_weights, solve, total_least_squares,
};
use rand_chacha::ChaCha8Rng;

const JOINTS: usize = 2;
const TRUTH: [f64; 4] = [3.0, -1.0, 0.5, 8.0];
const SIGMA: [f64; 2] = [0.3, 0.02];

/// Two joints, the second a fifteenth as noisy.
fn problem(rng: &mut ChaCha8Rng, n_samples: usize) -> (Vec<f64>, Vec<f64>) {
    let w = normals(rng, n_samples * JOINTS * 4);
    let e = normals(rng, n_samples * JOINTS);
    let y = times(&w, &TRUTH)
        .iter()
        .zip(e)
        .enumerate()
        .map(|(row, (y, e))| y + SIGMA[row % 2] * e)
        .collect();
    (w, y)
}

fn robust(w: &[f64], y: &[f64], loss: RobustLoss) -> RobustEstimate {
    let options = RobustOptions {
        loss,
        ..RobustOptions::default()
    };
    match robust_least_squares(4, JOINTS, &options, |sink| sink(w, y)).unwrap() {
        RobustSolution::Determined(estimate) => estimate,
        RobustSolution::RankDeficient(outcome) => panic!("{outcome:?}"),
    }
}

const HUBER: RobustLoss = RobustLoss::Huber { k: HUBER_K };
const TUKEY: RobustLoss = RobustLoss::Tukey { c: TUKEY_C };

#[test]
fn identity_weights_of_the_two_losses() {
    assert_eq!([0.0, 1.0, HUBER_K].map(|u| HUBER.weight(u)), [1.0; 3]);
    assert!((HUBER.weight(-2.0 * HUBER_K) - 0.5).abs() < 1e-15);
    assert_eq!(
        (TUKEY.weight(0.0), TUKEY.weight(TUKEY_C), TUKEY.weight(-9.0)),
        (1.0, 0.0, 0.0)
    );
    assert!((TUKEY.weight(TUKEY_C / 2.0) - 0.5625).abs() < 1e-15);
    // Medians of even and odd counts, joint by joint: |1 2 3 4| -> 2.5 and |5 1 9 1| -> 3.
    let scale = mad_scale(&[-1.0, 5.0, 2.0, -1.0, 3.0, 9.0, -4.0, 1.0], 2);
    assert!(
        (scale[0] / 2.5 - 1.4826022185056018).abs() < 1e-15
            && (scale[1] / 3.0 - 1.4826022185056018).abs() < 1e-15
    );
    assert!((mad_scale(&[3.0, -1.0, 2.0], 1)[0] / 2.0 - 1.4826022185056018).abs() < 1e-15);
    // The median absolute deviation of normal noise is its sigma: 1.17 % one standard error at 5000, four of them.
    let noise = normals(&mut rng(1), 5000);
    assert!((mad_scale(&noise, 1)[0] - 1.0).abs() < 0.047);
    // A joint that fits exactly in most rows: exact rows keep their say.
    assert_eq!(
        robust_weights(&[0.0, 0.0, 0.0, 1.0], 1, HUBER).weights,
        [1.0, 1.0, 1.0, 0.0]
    );
}

#[test]
fn identity_robust_fit_of_clean_data_is_nearly_the_weighted_one() {
    let mut rng = rng(2);
    let (w, y) = problem(&mut rng, 3000);
    let scaled = |v: &[f64], per_row: usize| -> Vec<f64> {
        v.iter()
            .enumerate()
            .map(|(k, v)| v / SIGMA[k / per_row % 2])
            .collect()
    };
    let best = solve(&factor(&scaled(&w, 4), &scaled(&y, 1), 4))
        .unwrap()
        .determined()
        .unwrap();
    for loss in [HUBER, TUKEY] {
        let fit = robust(&w, &y, loss);
        assert!(fit.converged);
        // 95 % efficient: standard deviations 2.6 % larger, give or take the scale's own uncertainty.
        for i in 0..4 {
            let ratio = fit.standard_deviation[i] / best.standard_deviation[i];
            assert!((0.98..1.08).contains(&ratio), "{loss:?} {ratio}");
            assert!((fit.values[i] - TRUTH[i]).abs() < 4.0 * fit.standard_deviation[i]);
        }
    }
}

#[test]
fn identity_a_contact_is_found_and_does_not_bend_the_fit() {
    let mut rng = rng(3);
    let (w, mut y) = problem(&mut rng, 1000);
    // Samples 400 to 459: a contact on both joints; 700 to 719: a stop of the second alone.
    for sample in 400..460 {
        y[2 * sample] += 15.0;
        y[2 * sample + 1] += 4.0;
    }
    for sample in 700..720 {
        y[2 * sample + 1] = 0.0;
    }
    let plain = solve(&factor(&w, &y, 4)).unwrap().determined().unwrap();
    let fit = robust(&w, &y, TUKEY);
    assert!(fit.converged, "{}", fit.last_change);
    let error = |values: &[f64]| worst(values, &TRUTH);
    assert!(
        error(&fit.values) < 0.02 && error(&plain.values) > 5.0 * error(&fit.values),
        "{} {}",
        error(&fit.values),
        error(&plain.values)
    );
    assert!((fit.weights.scale[1] / SIGMA[1] - 1.0).abs() < 0.3);
    let spans = down_weighted_spans(
        &fit.weights.weights,
        JOINTS,
        &SpanOptions {
            least: 5,
            ..SpanOptions::default()
        },
    );
    assert_eq!(spans.len(), 2, "{spans:?}");
    assert!(
        spans[0].first.abs_diff(400) <= 5
            && spans[0].last.abs_diff(459) <= 5
            && spans[0].joints == [0, 1]
    );
    assert!(
        spans[1].first.abs_diff(700) <= 5
            && spans[1].last.abs_diff(719) <= 5
            && spans[1].joints.contains(&1)
    );
    assert_eq!(spans[0].lowest_weight, 0.0);
}

#[test]
fn identity_spans_bridge_gaps_and_drop_chance() {
    let mut weights = vec![1.0; 60];
    for sample in [5, 6, 9, 10, 40, 41, 55] {
        weights[sample] = 0.1;
    }
    let options = SpanOptions {
        weight: 0.5,
        bridge: 3,
        least: 2,
    };
    let spans = down_weighted_spans(&weights, 1, &options);
    let ends: Vec<(usize, usize)> = spans.iter().map(|s| (s.first, s.last)).collect();
    assert_eq!(ends, [(5, 10), (40, 41)]);
    assert!(down_weighted_spans(&[1.0; 12], 3, &options).is_empty());
}

#[test]
fn identity_robust_intervals_cover_under_contamination() {
    // 10 % of the rows have tenfold noise. 400 runs at 95 %: 380 ± 4.36 each; four of them and Huber's asymptotics leave 355..=398.
    let (runs, mut hits) = (400, [0; 4]);
    let mut rng = rng(4);
    for _ in 0..runs {
        let (w, mut y) = problem(&mut rng, 150);
        let wild = normals(&mut rng, 30);
        for (k, e) in wild.into_iter().enumerate() {
            y[10 * k + 1] += 10.0 * SIGMA[1] * e;
        }
        let fit = robust(&w, &y, HUBER);
        for i in 0..4 {
            hits[i] +=
                usize::from((fit.values[i] - TRUTH[i]).abs() < 1.96 * fit.standard_deviation[i]);
        }
    }
    assert!(
        hits.iter().all(|h| (355..=398).contains(h)),
        "{hits:?} of {runs}"
    );
}

#[test]
fn robust_fit_reports_what_it_cannot_do() {
    let options = RobustOptions::default();
    let outcome = robust_least_squares(2, 1, &options, |sink| {
        sink(&[1.0, 0.0, 2.0, 0.0, 3.0, 0.0], &[1.0, 2.0, 4.0]);
    })
    .unwrap();
    assert!(matches!(outcome, RobustSolution::RankDeficient(ref d) if d.undetermined == [1]));
    let outcome = robust_least_squares(1, 1, &options, |sink| {
        sink(&[1.0, 1.0, 0.0, 0.0, 0.0], &[1.0, 2.0, 0.0, 0.0, 0.0]);
    });
    assert!(
        matches!(outcome, Err(Error::NotPositiveDefinite { joint: 0, .. })),
        "{outcome:?}"
    );
}

#[test]
fn identity_essential_parameters_are_those_the_residual_misses() {
    let mut rng = rng(5);
    // Columns 1 and 3 multiply nothing; 4 is real but small: 0.02 with a standard deviation of 0.1/√500/.. about 0.0045.
    let truth = [2.0, 0.0, -1.0, 0.0, 0.02];
    let w = normals(&mut rng, 500 * 5);
    let y: Vec<f64> = times(&w, &truth)
        .iter()
        .zip(normals(&mut rng, 500))
        .map(|(y, e)| y + 0.1 * e)
        .collect();
    let options = EssentialOptions {
        relative_std: 0.2,
        level: 0.95,
    };
    let full = factor(&w, &y, 5);
    let outcome = essential_parameters(&full, &options).unwrap().unwrap();
    assert_eq!(outcome.kept, [0, 2, 4]);
    let mut dropped: Vec<usize> = outcome.dropped.iter().map(|d| d.column).collect();
    dropped.sort_unstable();
    assert_eq!(dropped, [1, 3]);
    assert!(outcome.f_statistic < outcome.f_limit);
    let fit = solve(&full).unwrap().determined().unwrap();
    for d in &outcome.dropped {
        // The interval of the full fit, around its value, holds zero.
        assert_eq!(d.interval, fit.confidence_interval(d.column, 0.95));
        assert!(d.interval[0] < 0.0 && d.interval[1] > 0.0 && d.relative_std > 0.2);
    }
    // F by its definition.
    let f = (outcome.estimate.residual_norm.powi(2) - fit.residual_norm.powi(2))
        / 2.0
        / (fit.residual_norm.powi(2) / 495.0);
    assert!((f / outcome.f_statistic - 1.0).abs() < 1e-9);
    // A limit of 10 % also offers column 4, whose relative deviation is 0.22; the F-test protects it.
    assert!(fit.relative_std[4] > 0.1);
    let strict = essential_parameters(
        &full,
        &EssentialOptions {
            relative_std: 0.1,
            level: 0.95,
        },
    )
    .unwrap()
    .unwrap();
    assert_eq!(strict.kept, [0, 2, 4]);
    // Nothing to drop, nothing dropped.
    let lenient = essential_parameters(
        &full,
        &EssentialOptions {
            relative_std: f64::INFINITY,
            level: 0.95,
        },
    )
    .unwrap()
    .unwrap();
    assert_eq!(
        (
            lenient.kept.len(),
            lenient.dropped.len(),
            lenient.f_statistic
        ),
        (5, 0, 0.0)
    );
    assert!(
        essential_parameters(
            &full,
            &EssentialOptions {
                relative_std: 0.1,
                level: 1.0
            }
        )
        .is_err()
    );
}

fn total(factor: &InformationFactor) -> TotalLeastSquares {
    match total_least_squares(factor).unwrap() {
        TotalSolution::Determined(total) => total,
        other => panic!("{other:?}"),
    }
}

#[test]
fn identity_total_least_squares_without_noise_is_least_squares() {
    let mut rng = rng(6);
    let (w, x) = (common::random_rows(&mut rng, 60, 7), normals(&mut rng, 7));
    let fit = total(&factor(&w, &times(&w, &x), 7));
    assert!(worst(&fit.values, &x) < 1e-9);
    assert!(fit.validity < 1e-12 && fit.singular_values.len() == 8);
}

#[test]
fn identity_total_least_squares_is_not_biased_by_noise_of_the_columns() {
    let mut rng = rng(7);
    let (n, m) = (3, 20_000);
    let truth = [1.0, -2.0, 0.5];
    let w = normals(&mut rng, m * n);
    // Noise in proportion to the length of each column, y's included: σ_y = 0.2 ‖(1, -2, 0.5)‖.
    let size = truth.iter().map(|x| x * x).sum::<f64>().sqrt();
    let y: Vec<f64> = times(&w, &truth)
        .iter()
        .zip(normals(&mut rng, m))
        .map(|(y, e)| y + 0.2 * size * e)
        .collect();
    let noisy: Vec<f64> = w
        .iter()
        .zip(normals(&mut rng, m * n))
        .map(|(w, e)| w + 0.2 * e)
        .collect();
    let factor = factor(&noisy, &y, n);
    let ordinary = solve(&factor).unwrap().determined().unwrap();
    let total = total(&factor);
    for i in 0..n {
        // Ordinary least squares shrinks by 1/(1 + 0.04).
        assert!(
            (ordinary.values[i] / truth[i] - 1.0 / 1.04).abs() < 4.0 * ordinary.relative_std[i]
        );
        assert!(
            (total.values[i] - truth[i]).abs() < 4.0 * total.standard_deviation[i],
            "{:?}",
            total.values
        );
    }
    let (o, t) = (
        worst(&ordinary.values, &truth),
        worst(&total.values, &truth),
    );
    assert!(o > 0.03 && t < 0.015, "{o} {t}");
}

#[test]
fn identity_total_least_squares_deviations_match_their_scatter() {
    let (n, m, runs) = (2, 100, 600);
    let truth = [1.0, -2.0];
    let mut rng = rng(8);
    let w = normals(&mut rng, m * n);
    let mut z = [Vec::new(), Vec::new()];
    for _ in 0..runs {
        let y: Vec<f64> = times(&w, &truth)
            .iter()
            .zip(normals(&mut rng, m))
            .map(|(y, e)| y + 0.05 * 5_f64.sqrt() * e)
            .collect();
        let noisy: Vec<f64> = w
            .iter()
            .zip(normals(&mut rng, m * n))
            .map(|(w, e)| w + 0.05 * e)
            .collect();
        let fit = total(&factor(&noisy, &y, n));
        (0..n).for_each(|i| z[i].push((fit.values[i] - truth[i]) / fit.standard_deviation[i]));
    }
    for z in z {
        // Unit scatter: its own standard error is 2.9 %, four of them and a first-order formula.
        let scatter = (z.iter().map(|z| z * z).sum::<f64>() / f64::from(runs)).sqrt();
        assert!((0.87..1.15).contains(&scatter), "{scatter}");
    }
}

/// Gains of three drives from runs without and with a load whose mass is known, 1 % torque noise.
fn gains(known_scale: f64, noise: f64, n_samples: usize) -> (TotalLeastSquares, [f64; 3]) {
    let mut rng = rng(9);
    let truth = [12.0, 3.5, 0.8];
    let (arm, load) = ([2.0, -1.0, 0.7, 0.3, 1.1], [0.4, -0.2]);
    let mut factor = InformationFactor::new(3 + 5 + 2);
    for sample in 0..2 * n_samples {
        let w = normals(&mut rng, 15);
        let loaded = f64::from(u8::from(sample >= n_samples));
        let wu: Vec<f64> = normals(&mut rng, 6)
            .into_iter()
            .map(|v| v * loaded)
            .collect();
        let known: Vec<f64> = normals(&mut rng, 3)
            .into_iter()
            .map(|v| v * loaded)
            .collect();
        let e = normals(&mut rng, 3);
        let (a, l) = (times(&w, &arm), times(&wu, &load));
        let signal: Vec<f64> = (0..3)
            .map(|j| (a[j] + l[j] + known[j]) * (1.0 + noise * e[j]) / truth[j])
            .collect();
        let stated: Vec<f64> = known.iter().map(|k| k * known_scale).collect();
        DriveGainSample {
            signal: &signal,
            arm: &w,
            load: &wu,
            known_torque: &stated,
        }
        .push(&[1.0; 3], &mut factor)
        .unwrap();
    }
    (total(&factor), truth)
}

#[test]
fn identity_drive_gains_within_a_percent() {
    let (exact, truth) = gains(1.0, 0.0, 200);
    assert!(worst(&exact.values[..3], &truth) < 1e-11 && exact.validity < 1e-12);
    let (noisy, truth) = gains(1.0, 0.01, 2000);
    assert!(
        worst(&noisy.values[..3], &truth) < 0.01,
        "{:?}",
        noisy.values
    );
    assert!(noisy.validity < 0.1, "{}", noisy.validity);
}

#[test]
fn identity_drive_gains_rest_on_the_weighed_mass() {
    let (right, _) = gains(1.0, 0.01, 300);
    let (wrong, _) = gains(1.1, 0.01, 300);
    for (a, b) in wrong.values.iter().zip(&right.values) {
        assert!(
            (a / b - 1.1).abs() < 1e-9,
            "everything scales with the mass that was stated"
        );
    }
}

#[test]
fn drive_gains_without_a_load_have_no_scale() {
    let mut factor = InformationFactor::new(2);
    let mut rng = rng(10);
    for _ in 0..50 {
        let w = normals(&mut rng, 1);
        DriveGainSample {
            signal: &[2.0 * w[0]],
            arm: &w,
            load: &[],
            known_torque: &[0.0],
        }
        .push(&[1.0], &mut factor)
        .unwrap();
    }
    let outcome = total_least_squares(&factor).unwrap();
    // Signal and arm move together and no known torque tells how much either is worth.
    assert!(
        matches!(outcome, TotalSolution::RankDeficient(ref d) if d.undetermined == [0, 1]),
        "{outcome:?}"
    );
    assert!(matches!(
        total_least_squares(&InformationFactor::new(2)),
        Err(Error::TooFewRows { .. })
    ));
    let free = total_least_squares(&common::factor(&normals(&mut rng, 20), &[0.0; 20], 1)).unwrap();
    assert_eq!(free, TotalSolution::Unrelated);
}
