//! Where a search for a motion starts: random series inside the limits.

use crate::certificate::JointExtrema;
use crate::fourier::FourierSeries;
use crate::limits::Limits;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Size of the random set of velocities of Radkhah, Kulić & Croft 2007, section III.A.
const GUESS_VELOCITIES: usize = 100;

/// The series that comes closest to `velocities[joint]`, given at equal steps of one period (s): least squares.
///
/// `a_l = 2/M Σ_k v_k cos(ω l t_k)`, `b_l = 2/M Σ_k v_k sin(ω l t_k)`: the solution `(A'A)⁻¹ A' v` of Radkhah, Kulić &
/// Croft 2007, eq. (8), where A has the columns cos, sin of their velocity and so `A'A = M/2 I`. The matrix printed
/// there has the columns of a position (sin/(ω l), cos/(ω l), 1) beside a right side of velocities; the offset q0
/// does not appear in a velocity, so it is an argument here (rad, one a joint).
///
/// # Panics
/// If joints differ in their number of velocities, or have not more than `2 * n_harmonics`, or the period is not above
/// zero.
#[track_caller]
pub fn fit_velocities(
    velocities: &[Vec<f64>],
    q0: &[f64],
    n_harmonics: usize,
    period: f64,
) -> FourierSeries {
    assert_eq!(velocities.len(), q0.len(), "one offset per joint");
    let m = velocities[0].len();
    assert!(
        m > 2 * n_harmonics,
        "{m} velocities determine fewer than {n_harmonics} harmonics"
    );
    let table: Vec<_> = (0..m)
        .map(|k| (TAU * k as f64 / m as f64).sin_cos())
        .collect();
    let mut coefficients = Vec::new();
    for (v, q0) in velocities.iter().zip(q0) {
        assert_eq!(v.len(), m, "velocities per joint");
        coefficients.push(*q0);
        for pick in [|sc: &(f64, f64)| sc.1, |sc: &(f64, f64)| sc.0] {
            for l in 1..=n_harmonics {
                let sum: f64 = (0..m).map(|k| v[k] * pick(&table[k * l % m])).sum();
                coefficients.push(2.0 / m as f64 * sum);
            }
        }
    }
    series(period, q0.len(), n_harmonics, &coefficients)
}

/// Initial guess of Radkhah, Kulić & Croft 2007, section III.A: a hundred random velocities within the limits, fitted by
/// [`fit_velocities`] about the centre of the position range, then made smaller where it leaves the limits.
///
/// `period` s. More velocities are drawn where a hundred would not determine the harmonics.
///
/// # Panics
/// If there is no harmonic, or the period is not above zero.
pub fn initial_guess(limits: &Limits, n_harmonics: usize, period: f64, seed: u64) -> FourierSeries {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n = GUESS_VELOCITIES.max(4 * n_harmonics);
    let velocities: Vec<Vec<f64>> = limits
        .velocity
        .iter()
        .map(|&v| (0..n).map(|_| rng.random_range(-v..v)).collect())
        .collect();
    let centres: Vec<_> = (0..limits.n_joints()).map(|j| limits.centre(j)).collect();
    fit_velocities(&velocities, &centres, n_harmonics, period).shrunk_into(limits)
}

/// Random motion that reaches a limit with every joint and exceeds none; `period` s.
///
/// Velocity coefficients uniform, so that all harmonics move the joint alike fast; the joint's middle position uniform in the room
/// its swing leaves.
///
/// # Panics
/// If there is no harmonic, or the period is not above zero.
pub fn random_series(limits: &Limits, n_harmonics: usize, period: f64, seed: u64) -> FourierSeries {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let n_joints = limits.n_joints();
    let coefficients: Vec<_> = (0..n_joints * (2 * n_harmonics + 1))
        .map(|_| rng.random_range(-1.0..1.0))
        .collect();
    let shape = series(period, n_joints, n_harmonics, &coefficients);
    let extrema = shape.extrema();
    let scale: Vec<_> = (0..n_joints)
        .map(|j| largest_scale(&extrema[j], limits, j))
        .collect();
    let q0 = (0..n_joints)
        .map(|j| {
            let [low, high] = room(&shape, &extrema[j], scale[j], limits, j);
            low + (high - low) * rng.random_range(0.0..1.0)
        })
        .collect();
    shape.rescaled(&scale, q0)
}

impl FourierSeries {
    /// The same motion with each joint's swing made smaller, and its offset moved, only as far as the limits ask.
    ///
    /// # Panics
    /// If there are limits for another number of joints.
    #[must_use]
    #[track_caller]
    pub fn shrunk_into(&self, limits: &Limits) -> Self {
        assert_eq!(self.n_joints(), limits.n_joints(), "joints of the limits");
        let extrema = self.extrema();
        let scale: Vec<_> = (0..self.n_joints())
            .map(|j| largest_scale(&extrema[j], limits, j).min(1.0))
            .collect();
        let q0 = (0..self.n_joints())
            .map(|j| {
                let [low, high] = room(self, &extrema[j], scale[j], limits, j);
                self.mean_position()[j].max(low).min(high)
            })
            .collect();
        self.rescaled(&scale, q0)
    }
}

/// Largest factor on a joint's harmonics that velocity, acceleration and position range allow.
fn largest_scale(e: &JointExtrema, limits: &Limits, joint: usize) -> f64 {
    let swing = e.highest.bound - e.lowest.bound;
    let [low, high] = limits.position[joint];
    ((high - low) / swing)
        .min(limits.velocity[joint] / e.velocity.bound.abs())
        .min(limits.acceleration[joint] / e.acceleration.bound.abs())
}

/// Lowest and highest offset q0 (rad) that keep the scaled joint inside its position limits.
fn room(
    series: &FourierSeries,
    e: &JointExtrema,
    scale: f64,
    limits: &Limits,
    joint: usize,
) -> [f64; 2] {
    let mean = series.mean_position()[joint];
    let [low, high] = limits.position[joint];
    let from = low - scale * (e.lowest.bound - mean);
    let to = high - scale * (e.highest.bound - mean);
    // Where the swing fills the range the two agree but for rounding.
    if from <= to {
        [from, to]
    } else {
        [f64::midpoint(from, to); 2]
    }
}

fn series(period: f64, n_joints: usize, n_harmonics: usize, coefficients: &[f64]) -> FourierSeries {
    FourierSeries::from_coefficients(TAU / period, n_joints, n_harmonics, coefficients)
        .expect("the period is above zero, there is a harmonic, and the velocities are finite")
}
