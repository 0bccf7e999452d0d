//! Where descents of chained points start: random chains, and disturbed good ones.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

use crate::EnergyDesign;

/// Harmonics of a random path of positions.
const HARMONICS: usize = 3;

/// Variables in `[-1, 1]`, point after point: positions along a smooth random path, velocities at the ends of their
/// ranges or anywhere between.
///
/// Good chains look like this: a row is a difference, so far jumps let gravity drown the rest, while velocities that
/// change between extremes tell the inertias apart.
pub(crate) fn random_start(design: &EnergyDesign, n_rows: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let (n, m) = (design.n_variables(), design.position_variables().len());
    let mut x = vec![0.0; n * (n_rows + 1)];
    for k in 0..m {
        let waves: Vec<(f64, f64)> = (0..HARMONICS)
            .map(|_| (rng.random_range(-1.0..1.0), rng.random_range(0.0..TAU)))
            .collect();
        for (point, x) in x.chunks_exact_mut(n).enumerate() {
            let turn = TAU * point as f64 / n_rows as f64;
            let wave = |(l, (size, phase)): (usize, &(f64, f64))| {
                size * ((l as f64 + 0.5) * turn + phase).sin() / (l as f64 + 1.0)
            };
            let sum: f64 = waves.iter().enumerate().map(wave).sum();
            x[k] = sum.clamp(-1.0, 1.0);
        }
    }
    for x in x.chunks_exact_mut(n) {
        for v in &mut x[m..] {
            *v = match rng.random_range(0..3) {
                0 => -1.0,
                1 => 1.0,
                _ => rng.random_range(-1.0..1.0),
            };
        }
    }
    x
}

/// Disturbs a chain in one of several ways; the first `m` of the `n` variables of a point are positions.
///
/// Of the ways tried, those that led to better points most often: small shakes and the tail of another chain foremost.
pub(crate) fn disturb(x: &mut [f64], other: &[f64], m: usize, n: usize, rng: &mut ChaCha8Rng) {
    let n_points = x.len() / n;
    match rng.random_range(0..6) {
        0 => shake(x, 0.1, rng),
        1 => shake(x, 0.03, rng),
        2 => redraw_velocities(x, m, n, (n_points / 4).max(1), rng),
        3 => redraw_velocities(x, m, n, 1, rng),
        4 => swap_velocities(x, m, n, rng),
        _ => {
            // The tail of another good chain.
            let cut = rng.random_range(1..n_points) * n;
            x[cut..].copy_from_slice(&other[cut..]);
        }
    }
}

/// Every variable a little.
fn shake(x: &mut [f64], size: f64, rng: &mut ChaCha8Rng) {
    for v in x {
        let z: f64 = StandardNormal.sample(rng);
        *v = (*v + size * z).clamp(-1.0, 1.0);
    }
}

/// The velocities of a stretch of at most `longest` points.
fn redraw_velocities(x: &mut [f64], m: usize, n: usize, longest: usize, rng: &mut ChaCha8Rng) {
    let n_points = x.len() / n;
    let length = rng.random_range(1..=longest);
    let first = rng.random_range(0..=n_points - length);
    for point in x[first * n..(first + length) * n].chunks_exact_mut(n) {
        for v in &mut point[m..] {
            *v = rng.random_range(-1.0..1.0);
        }
    }
}

/// The velocities of a few pairs of points exchanged.
fn swap_velocities(x: &mut [f64], m: usize, n: usize, rng: &mut ChaCha8Rng) {
    let n_points = x.len() / n;
    for _ in 0..rng.random_range(1..=3) {
        let (a, b) = (rng.random_range(0..n_points), rng.random_range(0..n_points));
        for j in m..n {
            x.swap(a * n + j, b * n + j);
        }
    }
}
