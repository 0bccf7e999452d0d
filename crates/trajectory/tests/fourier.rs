//! Identities of Fourier series, their basis and their certified extrema.
#![allow(clippy::unwrap_used)]

mod common;

use common::{config, grid, largest, limits, series};
use idim_model::JointStates;
use idim_trajectory::{
    FourierBasis, FourierSeries, Limits, constraint_rows, fit_velocities, initial_guess,
    random_series, rest_rows, sampling_factor,
};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// Some hundred roundings of a sum of eight harmonics.
const ROUNDING: f64 = 1e-12;

/// `Σ (|a_l| + |b_l|) (ω l)^power`: bounds the derivative of that order above qd.
fn magnitude(series: &FourierSeries, joint: usize, power: i32) -> f64 {
    let terms = series.a(joint).iter().zip(series.b(joint)).enumerate();
    terms
        .map(|(i, (a, b))| (a.abs() + b.abs()) * (series.omega() * (i + 1) as f64).powi(power))
        .sum()
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn identity_derivatives_match_central_differences(s in series(), phase in 0.0..1.0f64) {
        // Step where truncation h²/6 of the third derivative and rounding ε/h of the value are alike.
        let h = 1e-5 / s.omega();
        let t = phase * s.period();
        let x = s.states(&[t - h, t, t + h]);
        for j in 0..s.n_joints() {
            let scale = s.mean_position()[j].abs() + magnitude(&s, j, -1);
            let slope = (x.q(j)[2] - x.q(j)[0]) / (2.0 * h);
            let tolerance = h * h / 6.0 * magnitude(&s, j, 2) + 8.0 * f64::EPSILON * scale / h;
            prop_assert!((slope - x.qd(j)[1]).abs() <= tolerance);
            let slope = (x.qd(j)[2] - x.qd(j)[0]) / (2.0 * h);
            let tolerance = h * h / 6.0 * magnitude(&s, j, 3) + 8.0 * f64::EPSILON * magnitude(&s, j, 0) / h;
            prop_assert!((slope - x.qdd(j)[1]).abs() <= tolerance);
        }
    }

    #[test]
    fn identity_motion_repeats_after_a_period_and_averages_to_its_offset(s in series(), phase in 0.0..1.0f64) {
        let t = phase * s.period();
        let x = s.states(&[t, t + s.period()]);
        let m = s.equispaced_states(40);
        for j in 0..s.n_joints() {
            let scale = 1.0 + magnitude(&s, j, 1);
            prop_assert!((x.q(j)[0] - x.q(j)[1]).abs() <= ROUNDING * (scale + magnitude(&s, j, -1)));
            prop_assert!((x.qdd(j)[0] - x.qdd(j)[1]).abs() <= ROUNDING * scale * s.n_harmonics() as f64);
            let mean = m.q(j).iter().sum::<f64>() / 40.0;
            prop_assert!((mean - s.mean_position()[j]).abs() <= ROUNDING * (2.0 + magnitude(&s, j, -1)));
        }
    }

    #[test]
    fn identity_coefficients_survive_the_round_trip(s in series()) {
        let again = FourierSeries::from_coefficients(s.omega(), s.n_joints(), s.n_harmonics(), &s.coefficients());
        prop_assert_eq!(again.unwrap(), s);
    }

    #[test]
    fn identity_basis_gives_the_states(s in series(), n in 1..60usize) {
        let period = s.period();
        let times: Vec<_> = (0..n).map(|k| k as f64 * period / n as f64).collect();
        let direct = s.states(&times);
        for basis in [
            FourierBasis::equispaced(period, s.n_harmonics(), n),
            FourierBasis::at(s.omega(), s.n_harmonics(), &times),
        ] {
            let x = basis.states(&s.coefficients());
            for j in 0..s.n_joints() {
                for k in 0..n {
                    let position = s.mean_position()[j].abs() + magnitude(&s, j, -1);
                    prop_assert!((x.q(j)[k] - direct.q(j)[k]).abs() <= ROUNDING * position);
                    prop_assert!((x.qd(j)[k] - direct.qd(j)[k]).abs() <= ROUNDING * magnitude(&s, j, 0));
                    prop_assert!((x.qdd(j)[k] - direct.qdd(j)[k]).abs() <= ROUNDING * magnitude(&s, j, 1));
                }
            }
        }
    }

    #[test]
    fn identity_pull_back_is_the_transpose_of_the_basis(s in series(), n in 1..40usize, seed in 0..1000u64) {
        let basis = FourierBasis::equispaced(s.period(), s.n_harmonics(), n);
        let c = s.coefficients();
        let x = basis.states(&c);
        let wave = |start: f64| (0..s.n_joints() * n).map(|i| (start + i as f64 * 1.7).sin()).collect();
        let f = seed as f64;
        let g = JointStates::from_columns(s.n_joints(), wave(f), wave(f + 0.3), wave(f + 0.6));
        let (mut left, mut size) = (0.0, 0.0);
        for j in 0..s.n_joints() {
            for k in 0..n {
                for product in [x.q(j)[k] * g.q(j)[k], x.qd(j)[k] * g.qd(j)[k], x.qdd(j)[k] * g.qdd(j)[k]] {
                    left += product;
                    size += product.abs();
                }
            }
        }
        let right: f64 = basis.pull_back(&g).iter().zip(&c).map(|(a, b)| a * b).sum();
        prop_assert!((left - right).abs() <= ROUNDING * 10.0 * size);
    }

    #[test]
    fn identity_extrema_bound_a_hundredfold_grid_and_are_attained(s in series()) {
        let period = s.period();
        let n = 100 * (2 * s.n_harmonics() + 1);
        let dense = s.states(&grid(period, n));
        let h = period / n as f64;
        for (j, e) in s.extrema().iter().enumerate() {
            for (values, low, high, curvature) in [
                (dense.q(j), Some(e.lowest), Some(e.highest), magnitude(&s, j, 1)),
                (dense.qd(j), None, Some(e.velocity), magnitude(&s, j, 2)),
                (dense.qdd(j), None, Some(e.acceleration), magnitude(&s, j, 3)),
            ] {
                let slack = curvature * h * h / 8.0 + ROUNDING * (largest(values) + curvature);
                let (low, high) = (low.unwrap_or(high.unwrap()), high.unwrap());
                if low == high {
                    prop_assert!(largest(values) <= high.bound.abs());
                    prop_assert!(largest(values) >= high.value.abs() - slack);
                } else {
                    let top = values.iter().copied().fold(f64::MIN, f64::max);
                    let bottom = values.iter().copied().fold(f64::MAX, f64::min);
                    prop_assert!(top <= high.bound && bottom >= low.bound);
                    prop_assert!(top >= high.value - slack && bottom <= low.value + slack);
                }
            }
            let at = s.states(&[e.lowest.time, e.highest.time, e.velocity.time, e.acceleration.time]);
            let scale = 1.0 + s.mean_position()[j].abs() + magnitude(&s, j, 1) + magnitude(&s, j, -1);
            for (found, stated) in [
                (at.q(j)[0], e.lowest),
                (at.q(j)[1], e.highest),
                (at.qd(j)[2], e.velocity),
                (at.qdd(j)[3], e.acceleration),
            ] {
                prop_assert!((found - stated.value).abs() <= ROUNDING * scale);
                prop_assert!((stated.bound - stated.value).abs() <= ROUNDING * scale);
                prop_assert!((0.0..=period).contains(&stated.time));
            }
        }
    }

    #[test]
    fn identity_sampled_bounds_hold_and_are_tight_within_the_factor(s in series(), more in 1..40usize) {
        let n = 2 * s.n_harmonics() + more;
        let factor = sampling_factor(s.n_harmonics(), n);
        let centres = vec![0.1; s.n_joints()];
        for (j, (bounds, e)) in s.sampled_bounds(&centres, n).iter().zip(s.extrema()).enumerate() {
            let position = (e.highest.value - 0.1).abs().max((e.lowest.value - 0.1).abs());
            for (bound, value) in bounds.iter().zip([position, e.velocity.value.abs(), e.acceleration.value.abs()]) {
                prop_assert!(*bound >= value * (1.0 - ROUNDING), "joint {}", j);
                prop_assert!(*bound <= value / factor * (1.0 + ROUNDING), "joint {}", j);
            }
        }
    }

    #[test]
    fn identity_a_motion_that_meets_its_rows_is_certified(
        limits in limits(2), harmonics in 1..6usize, period in 1.0..20.0f64, more in 1..60usize, seed in 0..1000u64,
    ) {
        let n = 2 * harmonics + more;
        let rows = constraint_rows(&limits, harmonics, period, n);
        prop_assert_eq!(rows.n_rows(), 6 * 2 * n);
        // About the centre all limits scale alike, so the motion can be made to touch one row exactly.
        let mut c = random_series(&limits, harmonics, period, seed).coefficients();
        let width = 2 * harmonics + 1;
        for j in 0..2 {
            c[j * width] = limits.centre(j);
        }
        let mut touching = c.clone();
        let centred = |c: &[f64]| {
            let mut centre = vec![0.0; c.len()];
            (0..2).for_each(|j| centre[j * width] = limits.centre(j));
            let at_centre = rows.residuals(&centre);
            let residuals = rows.residuals(c);
            residuals.iter().zip(&at_centre).map(|(r, r0)| (r - r0) / -r0).fold(0.0, f64::max)
        };
        let used = centred(&c);
        for j in 0..2 {
            touching[j * width + 1..(j + 1) * width].iter_mut().for_each(|v| *v /= used);
        }
        let worst = rows.residuals(&touching).into_iter().fold(f64::MIN, f64::max);
        let scale = 1.0 + largest(&rows.right_side);
        prop_assert!(worst.abs() <= ROUNDING * scale);
        let motion = FourierSeries::from_coefficients(TAU / period, 2, harmonics, &touching).unwrap();
        let certificate = motion.certificate(&limits);
        prop_assert!(certificate.certified);
        let factor = sampling_factor(harmonics, n);
        prop_assert!(certificate.largest().2.fraction >= factor * (1.0 - 1e-9));
        // One part in a thousand beyond the limits themselves is refused.
        let beyond = 1.001 / certificate.largest().2.fraction;
        let mut c = motion.coefficients();
        for j in 0..2 {
            c[j * width + 1..(j + 1) * width].iter_mut().for_each(|v| *v *= beyond);
        }
        let motion = FourierSeries::from_coefficients(TAU / period, 2, harmonics, &c).unwrap();
        prop_assert!(!motion.certificate(&limits).certified);
    }

    #[test]
    fn identity_rest_rows_start_at_rest_at_home(s in series()) {
        let (n, width) = (s.n_harmonics(), 2 * s.n_harmonics() + 1);
        let home: Vec<_> = (0..s.n_joints()).map(|j| 0.3 * j as f64).collect();
        let rows = rest_rows(s.n_joints(), n, s.period(), Some(&home));
        prop_assert_eq!(rows.n_rows(), 3 * s.n_joints());
        let mut c = s.coefficients();
        // What the rows miss of zero is what the start misses of rest and home.
        let x = s.states(&[0.0]);
        let residuals = rows.residuals(&c);
        for j in 0..s.n_joints() {
            let tolerance = ROUNDING * (1.0 + magnitude(&s, j, 1) + magnitude(&s, j, -1));
            prop_assert!((residuals[3 * j] - x.qd(j)[0]).abs() <= tolerance);
            prop_assert!((residuals[3 * j + 1] * s.omega() - x.qdd(j)[0]).abs() <= tolerance);
            prop_assert!((residuals[3 * j + 2] - (x.q(j)[0] - home[j])).abs() <= tolerance);
            // Solve them for a_1, b_1 and q0, which appear with coefficient 1.
            c[j * width + 1] -= residuals[3 * j];
            c[j * width + n + 1] -= residuals[3 * j + 1];
            c[j * width] -= residuals[3 * j + 2] + residuals[3 * j + 1] / s.omega();
        }
        let s = FourierSeries::from_coefficients(s.omega(), s.n_joints(), n, &c).unwrap();
        let x = s.states(&[0.0, s.period()]);
        for j in 0..s.n_joints() {
            let tolerance = ROUNDING * (1.0 + magnitude(&s, j, 1) + magnitude(&s, j, -1));
            for k in 0..2 {
                prop_assert!((x.q(j)[k] - home[j]).abs() <= tolerance);
                prop_assert!(x.qd(j)[k].abs() <= tolerance);
                prop_assert!(x.qdd(j)[k].abs() <= 10.0 * tolerance);
            }
        }
    }

    #[test]
    fn identity_a_series_is_the_fit_of_its_own_velocities(s in series(), more in 1..50usize) {
        let n = 2 * s.n_harmonics() + more;
        let x = s.equispaced_states(n);
        let velocities: Vec<_> = (0..s.n_joints()).map(|j| x.qd(j).to_vec()).collect();
        let fit = fit_velocities(&velocities, s.mean_position(), s.n_harmonics(), s.period());
        for (a, b) in fit.coefficients().iter().zip(s.coefficients()) {
            prop_assert!((a - b).abs() <= ROUNDING * 100.0);
        }
    }

    #[test]
    fn identity_random_motions_reach_a_limit_with_every_joint_and_exceed_none(
        limits in limits(3), harmonics in 1..7usize, period in 0.5..20.0f64, seed in 0..1000u64,
    ) {
        let certificate = random_series(&limits, harmonics, period, seed).certificate(&limits);
        prop_assert!(certificate.certified);
        for joint in certificate.joints {
            let speed = joint.velocity.fraction.max(joint.acceleration.fraction);
            // A swing as wide as the range is centred, so it reaches both ends.
            prop_assert!((speed.max(joint.position.fraction) - 1.0).abs() <= 1e-9);
        }
        let guess = initial_guess(&limits, harmonics, period, seed);
        prop_assert!(guess.certificate(&limits).certified);
    }
}

#[test]
fn identity_a_joint_that_stands_still_has_its_offset_as_extrema() {
    let s = FourierSeries::new(1.0, vec![0.3], vec![vec![0.0; 3]], vec![vec![0.0; 3]]).unwrap();
    let e = s.extrema()[0];
    assert_eq!([e.lowest.value, e.highest.value], [0.3, 0.3]);
    assert_eq!([e.velocity.value, e.acceleration.value], [0.0, 0.0]);
    let limits = Limits::new(vec![[0.0, 1.0]], vec![1.0], vec![1.0]).unwrap();
    assert_eq!(s.shrunk_into(&limits), s);
}

#[test]
fn identity_a_flat_top_is_bounded() {
    // cos θ − cos 3θ / 9: its curvature vanishes at the top, where the search closes in most slowly.
    let s = FourierSeries::new(
        1.0,
        vec![0.0],
        vec![vec![1.0, 0.0, -1.0 / 9.0]],
        vec![vec![0.0; 3]],
    )
    .unwrap();
    let e = s.extrema()[0].velocity;
    let dense = s.states(&grid(TAU, 100_000));
    assert!(e.bound.abs() >= largest(dense.qd(0)));
    assert!((e.value.abs() - largest(dense.qd(0))).abs() < 1e-9);
    assert!((e.bound - e.value).abs() < 1e-12);
}

#[test]
fn identity_a_seed_gives_the_same_motion() {
    let limits = Limits::new(vec![[-1.0, 2.0]; 2], vec![1.0; 2], vec![3.0; 2]).unwrap();
    assert_eq!(
        random_series(&limits, 4, 5.0, 3),
        random_series(&limits, 4, 5.0, 3)
    );
    assert_ne!(
        random_series(&limits, 4, 5.0, 3),
        random_series(&limits, 4, 5.0, 4)
    );
    assert_ne!(
        initial_guess(&limits, 4, 5.0, 3),
        initial_guess(&limits, 4, 5.0, 4)
    );
}

#[test]
fn identity_bad_series_are_refused_with_their_place() {
    let ones = || vec![vec![1.0, 1.0]; 2];
    let refused = |omega, q0, a, b| FourierSeries::new(omega, q0, a, b).unwrap_err().to_string();
    assert!(refused(0.0, vec![0.0; 2], ones(), ones()).starts_with("fundamental: 0 rad/s"));
    assert!(refused(1.0, vec![0.0; 3], ones(), ones()).contains("3 q0, 2 a, 2 b"));
    assert!(
        refused(1.0, vec![0.0; 2], vec![vec![1.0, 1.0], vec![1.0]], ones())
            .starts_with("joint 2: 1 sine")
    );
    assert!(
        refused(1.0, vec![0.0, f64::NAN], ones(), ones()).starts_with("joint 2: coefficient NaN")
    );
}
