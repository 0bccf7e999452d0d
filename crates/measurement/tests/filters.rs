//! Filters, differences and decimation against scipy and against what they must do exactly.
#![allow(clippy::unwrap_used)]

use idim_measurement::{
    Decimator, butterworth, chebyshev, filter_zero_phase, first_difference, padding,
    second_difference, settling,
};
use proptest::prelude::*;
use serde_json::Value;

/// Agreement with scipy, of the largest input: the file's stated tolerance.
const ORACLE: f64 = 1e-10;
/// Rounding of a recursive filter at ordinary cutoffs, of the largest input.
const ROUNDING: f64 = 1e-11;

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| v.abs().max(m))
}

#[track_caller]
fn assert_close(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (k, (x, y)) in a.iter().zip(b).enumerate() {
        assert!((x - y).abs() <= tolerance, "sample {k}: {x} against {y}");
    }
}

#[test]
fn oracle_zero_phase_filters_agree_with_scipy() {
    let text = include_str!("../../../fixtures/oracles/filters.json");
    let oracle: Value = serde_json::from_str(text).unwrap();
    let x = numbers(&oracle["x"]);
    let rate = oracle["sample_rate"].as_f64().unwrap();
    let tolerance = ORACLE * largest(&x);
    let cases = oracle["butterworth"].as_array().unwrap();
    assert_eq!(cases.len(), 18);
    for case in cases {
        let order = case["order"].as_u64().unwrap() as usize;
        let sections = butterworth(order, case["cutoff"].as_f64().unwrap(), rate);
        assert_close(
            &filter_zero_phase(&sections, &x),
            &numbers(&case["y"]),
            tolerance,
        );
    }
    for case in oracle["chebyshev"].as_array().unwrap() {
        let factor = case["factor"].as_f64().unwrap();
        let sections = chebyshev(8, 0.05, 0.8, 2.0 * factor);
        assert_close(
            &filter_zero_phase(&sections, &x),
            &numbers(&case["y"]),
            tolerance,
        );
    }
}

#[test]
fn identity_gain_is_one_at_rest_and_one_half_at_the_cutoff() {
    for order in 1..=8 {
        let sections = butterworth(order, 50.0, 1000.0);
        assert_eq!(padding(&sections), 3 * (order + 1));
        let rest = filter_zero_phase(&sections, &[0.7; 200]);
        assert_close(&rest, &[0.7; 200], ROUNDING);
        // A cosine at the cutoff keeps half its amplitude, away from the edges.
        let x: Vec<f64> = (0..4000)
            .map(|k| (0.1 * std::f64::consts::PI * f64::from(k)).cos())
            .collect();
        let y = filter_zero_phase(&sections, &x);
        let edge = 10 * settling(&sections);
        let half: Vec<f64> = x.iter().map(|v| 0.5 * v).collect();
        assert_close(&y[edge..4000 - edge], &half[edge..4000 - edge], 1e-9);
    }
}

#[test]
fn identity_a_slow_sine_passes_unchanged_after_trimming() {
    // Ten octaves below the cutoff of order 4 the gain differs from one by (1/16)^8.
    let sections = butterworth(4, 16.0, 1000.0);
    let x: Vec<f64> = (0..6000)
        .map(|k| (std::f64::consts::TAU * 1e-3 * f64::from(k)).sin())
        .collect();
    let y = filter_zero_phase(&sections, &x);
    let edge = 3 * settling(&sections);
    assert_close(&y[edge..6000 - edge], &x[edge..6000 - edge], 1e-8);
}

#[test]
fn identity_edges_have_settled_after_the_trim() {
    // Two halves that differ only before the cut must agree to a thousandth after the settling time.
    let sections = butterworth(4, 8.0, 500.0);
    let trim = settling(&sections);
    let mut a = vec![0.0; 2000];
    let b = filter_zero_phase(&sections, &a);
    a[0] = 1.0;
    let a = filter_zero_phase(&sections, &a);
    let worst = |r: std::ops::Range<usize>| largest(&a[r.clone()]).max(largest(&b[r]));
    assert!(worst(0..trim) > 1e-2, "{}", worst(0..trim));
    assert!(worst(trim..2000) < 2e-3, "{}", worst(trim..2000));
    assert!(
        (140..220).contains(&trim),
        "{trim} samples, about 2.9 / cutoff"
    );
}

proptest! {
    #[test]
    fn identity_zero_phase_commutes_with_reversal(
        x in prop::collection::vec(-1.0..1.0f64, 80..160), order in 1..7usize, cutoff in 20.0..200.0f64
    ) {
        // The steady-state start of each pass sees the other end, so the two agree once the edges have settled.
        let sections = butterworth(order, cutoff, 500.0);
        let mut padded = vec![0.0; 400];
        padded.extend(&x);
        padded.extend([0.0; 400]);
        let forwards = filter_zero_phase(&sections, &padded);
        padded.reverse();
        let mut backwards = filter_zero_phase(&sections, &padded);
        backwards.reverse();
        assert_close(&forwards, &backwards, 1e-9);
    }

    #[test]
    fn identity_differences_are_exact_for_quadratics(
        a in -3.0..3.0f64, b in -3.0..3.0f64, c in -3.0..3.0f64, h in 1e-3..1e-1f64
    ) {
        let t: Vec<f64> = (0..30).map(|k| h * f64::from(k)).collect();
        let q: Vec<f64> = t.iter().map(|t| a + b * t + c * t * t).collect();
        let qd: Vec<f64> = t.iter().map(|t| b + 2.0 * c * t).collect();
        // Rounding of positions up to 30, with coefficients up to 4, over h and over h².
        assert_close(&first_difference(&q, h), &qd, 4e-14 / h);
        assert_close(&second_difference(&q, h), &[2.0 * c; 30], 1e-13 / (h * h));
    }

    #[test]
    fn identity_decimation_commutes_with_linear_maps(
        columns in prop::collection::vec(prop::collection::vec(-1.0..1.0f64, 900), 11), factor in 2..6usize
    ) {
        let decimator = Decimator::chebyshev(factor).unwrap();
        let beta: Vec<f64> = (0..11).map(|k| f64::from(k) - 4.5).collect();
        let mix = |c: &[Vec<f64>]| -> Vec<f64> {
            (0..c[0].len()).map(|k| c.iter().zip(&beta).map(|(c, b)| c[k] * b).sum()).collect()
        };
        let refs: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let after = decimator.decimate_columns(&refs);
        assert_close(&decimator.decimate(&mix(&columns)), &mix(&after), 1e-10);
        // Eight side by side are the same bits as one.
        prop_assert_eq!(&decimator.decimate(&columns[9]), &after[9]);
    }
}

#[test]
fn identity_decimation_keeps_slow_and_removes_fast_motion() {
    let n = 4000;
    let wave = |f: f64| -> Vec<f64> {
        (0..n)
            .map(|k| (std::f64::consts::TAU * f * f64::from(k) / 1000.0).sin())
            .collect()
    };
    let decimator = Decimator::chebyshev(10).unwrap();
    let kept = decimator.kept(n as usize);
    let (slow, fast) = (wave(3.0), wave(97.0));
    let expected: Vec<f64> = kept.iter().map(|&k| slow[k]).collect();
    // Two passes of a ripple of 0.05 dB: 1.2 %.
    assert_close(&decimator.decimate(&slow), &expected, 0.0125);
    // 97 Hz would alias to 3 Hz; at the very ends a thousandth of the edge is left.
    let alias = decimator.decimate(&fast);
    assert!(largest(&alias) < 2e-3);
    assert!(largest(&alias[30..alias.len() - 30]) < 1e-6);
    assert_eq!(kept[1] - kept[0], 10);
    assert!(kept[0] == decimator.trim() && kept[kept.len() - 1] < n as usize - decimator.trim());
    let exact = Decimator::butterworth(10, 4, 30.0, 1000.0).unwrap();
    let expected: Vec<f64> = exact.kept(n as usize).iter().map(|&k| slow[k]).collect();
    assert_close(&exact.decimate(&slow), &expected, 2e-3);
}

#[test]
fn a_decimation_that_would_alias_is_refused() {
    let message = Decimator::butterworth(10, 4, 60.0, 1000.0)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("60") && message.contains("50 Hz"),
        "{message}"
    );
    assert!(Decimator::chebyshev(0).is_err());
    let whole = Decimator::chebyshev(1).unwrap();
    assert_eq!(whole.decimate(&[1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    assert_eq!(whole.fewest_samples(), 1);
}
