//! Random problems, seeded.
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "each test file uses its part"
)]

use faer::Mat;
use idim_estimation::InformationFactor;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub(crate) fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub(crate) fn normals(rng: &mut ChaCha8Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| StandardNormal.sample(rng)).collect()
}

/// Rows of a random `W`, row-major, columns of very different length.
pub(crate) fn random_rows(rng: &mut ChaCha8Rng, m: usize, n: usize) -> Vec<f64> {
    let mut w = normals(rng, m * n);
    for row in w.chunks_exact_mut(n) {
        for (j, entry) in row.iter_mut().enumerate() {
            *entry *= 10_f64.powi((j % 5) as i32 - 2);
        }
    }
    w
}

pub(crate) fn times(w: &[f64], x: &[f64]) -> Vec<f64> {
    w.chunks_exact(x.len())
        .map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum())
        .collect()
}

pub(crate) fn dense(w: &[f64], n: usize) -> Mat<f64> {
    Mat::from_fn(w.len() / n, n, |i, j| w[i * n + j])
}

pub(crate) fn factor(w: &[f64], y: &[f64], n: usize) -> InformationFactor {
    let mut factor = InformationFactor::new(n);
    factor.push_rows(w, y).unwrap();
    factor
}

/// `‖a - b‖ / ‖b‖`.
pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut a.iter().zip(b).map(|(a, b)| a - b)) / norm(&mut b.iter().copied())
}

/// Largest relative difference, entry by entry.
pub(crate) fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs() / b.abs())
        .fold(0.0, f64::max)
}
