//! From jittered, broken, noisy records to smooth states.
#![allow(clippy::unwrap_used)]

mod common;

use common::assert_says;
use idim_measurement::{
    ConditioningOptions, Derivatives, LowPass, Measurements, condition, interpolate, read_clock,
    uniform_grid,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn measured(time: Vec<f64>) -> Measurements {
    let column = |f: fn(f64) -> f64| vec![time.iter().map(|&t| f(t)).collect()];
    Measurements {
        file: "run.csv".into(),
        joints: vec!["shoulder".into()],
        q: column(f64::sin),
        qd: Some(column(f64::cos)),
        qdd: None,
        torque: column(|t| (1.5 * t).cos()),
        time,
    }
}

fn jittered(n: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    (0..n)
        .map(|k| 0.004 * (k as f64 + rng.random_range(-0.3..0.3)))
        .collect()
}

#[test]
fn identity_resampling_is_exact_for_cubics() {
    let time = jittered(50);
    let cubic = |t: f64| 1.0 - 2.0 * t + 30.0 * t * t - 200.0 * t.powi(3);
    let values: Vec<f64> = time.iter().map(|&t| cubic(t)).collect();
    let grid = uniform_grid(&time, 0.001);
    assert!(grid.len() > 190 && grid[grid.len() - 1] <= time[49]);
    for (t, v) in grid.iter().zip(interpolate(&time, &values, &grid)) {
        assert!((v - cubic(*t)).abs() < 1e-13, "at {t}");
    }
}

#[test]
fn a_jittered_clock_is_put_onto_a_grid() {
    let options = ConditioningOptions {
        low_pass: Some(LowPass {
            order: 4,
            cutoff: 10.0,
        }),
        ..ConditioningOptions::default()
    };
    let done = condition(&measured(jittered(2000)), &options).unwrap();
    let [segment] = done.segments.as_slice() else {
        panic!("one segment")
    };
    for (k, t) in segment.time.iter().enumerate() {
        assert!((segment.states.q(0)[k] - t.sin()).abs() < 1e-6);
        assert!((segment.states.qd(0)[k] - t.cos()).abs() < 1e-4);
        assert!((segment.states.qdd(0)[k] + t.sin()).abs() < 1e-2);
        assert!((segment.torque[0][k] - (1.5 * t).cos()).abs() < 1e-6);
    }
    let text: Vec<String> = done.choices.iter().map(ToString::to_string).collect();
    let text = text.join("\n");
    for part in [
        "sample rate: 2",
        "low-pass of positions and velocities: 10 Hz (zero-phase Butterworth of order 4",
        "left out at both ends: 0.2",
        "resampled, clock jitter: ",
        "velocity and acceleration from positions",
    ] {
        assert!(text.contains(part), "`{part}` is missing in:\n{text}");
    }
}

#[test]
fn nothing_is_interpolated_across_a_gap() {
    let mut time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
    time.drain(400..450);
    time.drain(700..703);
    let done = condition(&measured(time), &ConditioningOptions::default()).unwrap();
    let spans: Vec<(f64, f64)> = done
        .segments
        .iter()
        .map(|s| (s.time[0], s.time[s.time.len() - 1]))
        .collect();
    assert_eq!(spans.len(), 3, "{spans:?}");
    assert!(
        (spans[0].1 - 3.99).abs() < 1e-9 && (spans[1].0 - 4.5).abs() < 1e-9,
        "{spans:?}"
    );
    assert!(
        (spans[1].1 - 7.49).abs() < 1e-9 && (spans[2].0 - 7.53).abs() < 1e-9,
        "{spans:?}"
    );
    let gaps = done.choices.iter().find(|c| c.what == "gaps").unwrap();
    assert!(
        gaps.value == 2.0 && gaps.why.contains("0.5100 s, after t = 3.9900 s"),
        "{gaps}"
    );
}

#[test]
fn a_short_stretch_between_gaps_is_left_out_and_counted() {
    let mut time: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
    time.drain(520..600);
    time.drain(500..510);
    let options = ConditioningOptions {
        low_pass: Some(LowPass {
            order: 4,
            cutoff: 5.0,
        }),
        ..ConditioningOptions::default()
    };
    let done = condition(&measured(time), &options).unwrap();
    assert_eq!(done.segments.len(), 2);
    let dropped = done
        .choices
        .iter()
        .find(|c| c.what.contains("too short"))
        .unwrap();
    assert_eq!(dropped.value, 10.0);
}

#[test]
fn recorded_velocities_are_used_when_asked_for() {
    let mut m = measured((0..500).map(|k| 0.01 * f64::from(k)).collect());
    let options = ConditioningOptions {
        derivatives: Derivatives::OfVelocities,
        ..ConditioningOptions::default()
    };
    for v in &mut m.qd.as_mut().unwrap()[0] {
        *v += 0.25;
    }
    let done = condition(&m, &options).unwrap();
    let s = &done.segments[0];
    assert_eq!(s.time.len(), 500);
    assert!((s.states.qd(0)[100] - (1f64.cos() + 0.25)).abs() < 1e-12);
    assert!((s.states.qdd(0)[100] + 1f64.sin()).abs() < 1e-4);
    m.qd = None;
    assert_says(
        condition(&m, &options),
        "missing-column",
        &["run.csv", "no recorded qd"],
    );
}

#[test]
fn settings_that_do_not_fit_are_refused() {
    let m = measured((0..500).map(|k| 0.01 * f64::from(k)).collect());
    let low_pass = |order, cutoff| ConditioningOptions {
        low_pass: Some(LowPass { order, cutoff }),
        ..ConditioningOptions::default()
    };
    assert_says(
        condition(&m, &low_pass(4, 60.0)),
        "setting",
        &["cutoff (Hz) 60", "50"],
    );
    assert_says(
        condition(&m, &low_pass(4, f64::NAN)),
        "setting",
        &["cutoff (Hz) NaN"],
    );
    assert_says(
        condition(&m, &low_pass(0, 6.0)),
        "setting",
        &["filter order 0"],
    );
    assert_says(
        condition(&m, &low_pass(4, 0.5)),
        "too-few-samples",
        &[
            "run.csv: 500 samples in 1 segments",
            "record a longer motion",
        ],
    );
    let trim = ConditioningOptions {
        trim: Some(-1.0),
        ..ConditioningOptions::default()
    };
    assert_says(condition(&m, &trim), "setting", &["trim (s) -1"]);
    let rate = ConditioningOptions {
        sample_rate: Some(0.0),
        ..ConditioningOptions::default()
    };
    assert_says(condition(&m, &rate), "setting", &["sample rate (Hz) 0"]);
}

#[test]
fn a_clock_full_of_gaps_is_refused() {
    let time: Vec<f64> = (0..500)
        .map(|k| 0.01 * f64::from(k + 5 * (k / 10)))
        .collect();
    assert_eq!(read_clock(&time).gaps.len(), 49);
    assert_says(
        condition(&measured(time), &ConditioningOptions::default()),
        "gaps",
        &[
            "run.csv, t = 0.09 s",
            "49 gaps in 500 samples",
            "record again",
        ],
    );
}

#[test]
fn another_rate_is_a_choice() {
    let m = measured((0..1000).map(|k| 0.01 * f64::from(k)).collect());
    let options = ConditioningOptions {
        sample_rate: Some(150.0),
        trim: Some(0.5),
        ..ConditioningOptions::default()
    };
    let done = condition(&m, &options).unwrap();
    let s = &done.segments[0];
    assert!((s.time[0] - 0.5).abs() < 1e-9 && (s.interval - 1.0 / 150.0).abs() < 1e-15);
    for (k, t) in s.time.iter().enumerate() {
        assert!((s.states.q(0)[k] - t.sin()).abs() < 1e-8);
    }
}
