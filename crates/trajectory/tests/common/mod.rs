//! Random motions and limits for the identities.
#![allow(dead_code, clippy::unwrap_used)]

use idim_trajectory::{FourierSeries, Limits, PathPoint};
use proptest::prelude::*;

/// No file of failures: a failing case is printed, and becomes a test of its own.
pub(crate) fn config() -> ProptestConfig {
    ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Fourier series of 1 to 3 joints and 1 to 8 harmonics; slow and fast, small and large.
pub(crate) fn series() -> impl Strategy<Value = FourierSeries> {
    (1..4usize, 1..9usize, 0.3..8.0f64).prop_flat_map(|(joints, harmonics, omega)| {
        prop::collection::vec(-2.0..2.0f64, joints * (2 * harmonics + 1)).prop_map(move |c| {
            FourierSeries::from_coefficients(omega, joints, harmonics, &c).unwrap()
        })
    })
}

/// Limits of this many joints, not centred on zero.
pub(crate) fn limits(n_joints: usize) -> impl Strategy<Value = Limits> {
    let joint = (-2.0..1.0f64, 0.2..4.0f64, 0.3..3.0f64, 0.5..10.0f64);
    prop::collection::vec(joint, n_joints).prop_map(|joints| {
        Limits::new(
            joints.iter().map(|j| [j.0, j.0 + j.1]).collect(),
            joints.iter().map(|j| j.2).collect(),
            joints.iter().map(|j| j.3).collect(),
        )
        .unwrap()
    })
}

/// Points inside limits, a third of the velocities at the limit, as optimised points are.
pub(crate) fn points(limits: &Limits, seed: u64, n_points: usize) -> Vec<PathPoint> {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let n = limits.n_joints();
    let mut point = || PathPoint {
        q: (0..n)
            .map(|j| rng.random_range(limits.position[j][0]..limits.position[j][1]))
            .collect(),
        qd: (0..n)
            .map(|j| {
                let x: f64 = rng.random_range(-1.5..1.5);
                limits.velocity[j] * x.clamp(-1.0, 1.0)
            })
            .collect(),
    };
    (0..n_points).map(|_| point()).collect()
}

/// `n + 1` equal steps from 0 to `end`.
pub(crate) fn grid(end: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| end * k as f64 / n as f64).collect()
}

/// Largest magnitude.
pub(crate) fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| m.max(v.abs()))
}
