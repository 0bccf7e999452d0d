//! Identities of paths through points, and closed forms of the shortest ones.
#![allow(clippy::unwrap_used)]

mod common;

use common::{config, grid, largest, limits, points};
use idim_trajectory::{Error, Limits, PathPoint, QuinticPath};
use proptest::prelude::*;

/// Samples of a segment.
const FINE: usize = 4000;

/// Some thousand roundings of a polynomial of degree five.
const ROUNDING: f64 = 1e-12;

fn one_joint(from: [f64; 2], to: [f64; 2]) -> [PathPoint; 2] {
    [from, to].map(|[q, qd]| PathPoint {
        q: vec![q],
        qd: vec![qd],
    })
}

fn one_limit(velocity: f64, acceleration: f64) -> Limits {
    Limits::new(vec![[-1.0, 1.0]], vec![velocity], vec![acceleration]).unwrap()
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn identity_paths_meet_their_points_with_zero_acceleration(
        limits in limits(2), seed in 0..1000u64, durations in prop::collection::vec(0.1..5.0f64, 4),
    ) {
        let points = points(&limits, seed, 5);
        let path = QuinticPath::through(&points, &durations).unwrap();
        for (segment, (duration, joints)) in path.coefficients().iter().enumerate() {
            for (j, a) in joints.iter().enumerate() {
                for (u, point) in [(0.0, &points[segment]), (*duration, &points[segment + 1])] {
                    let terms = |factors: [f64; 6], down: i32| -> (f64, f64) {
                        let t: Vec<_> = (down..6).map(|i| factors[i as usize] * a[i as usize] * u.powi(i - down)).collect();
                        (t.iter().sum(), t.iter().map(|v| v.abs()).sum::<f64>() + 1.0)
                    };
                    let (q, size) = terms([1.0; 6], 0);
                    prop_assert!((q - point.q[j]).abs() <= ROUNDING * size);
                    let (qd, size) = terms([0.0, 1.0, 2.0, 3.0, 4.0, 5.0], 1);
                    prop_assert!((qd - point.qd[j]).abs() <= ROUNDING * size);
                    let (qdd, size) = terms([0.0, 0.0, 2.0, 6.0, 12.0, 20.0], 2);
                    prop_assert!(qdd.abs() <= ROUNDING * size);
                }
            }
        }
        let x = path.states(path.point_times());
        for (k, point) in points.iter().enumerate() {
            for j in 0..2 {
                prop_assert!((x.q(j)[k] - point.q[j]).abs() <= 1e-11);
                prop_assert!((x.qd(j)[k] - point.qd[j]).abs() <= 1e-10);
            }
        }
    }

    #[test]
    fn identity_magnitudes_of_a_segment_are_reached_and_not_exceeded(
        limits in limits(2), seed in 0..1000u64, durations in prop::collection::vec(0.1..5.0f64, 3),
    ) {
        let path = QuinticPath::through(&points(&limits, seed, 4), &durations).unwrap();
        for (segment, (duration, joints)) in path.coefficients().iter().enumerate() {
            for (a, stated) in joints.iter().zip(path.magnitudes(segment)) {
                let mut most = [0.0_f64; 3];
                for k in 0..=FINE {
                    let u = duration * k as f64 / FINE as f64;
                    let sum = |c: [f64; 6], down: i32| -> f64 {
                        (down..6).map(|i| c[i as usize] * a[i as usize] * u.powi(i - down)).sum()
                    };
                    let here = [
                        sum([1.0; 6], 0),
                        sum([0.0, 0.0, 2.0, 6.0, 12.0, 20.0], 2),
                        sum([0.0, 0.0, 0.0, 6.0, 24.0, 60.0], 3),
                    ];
                    for (most, x) in most.iter_mut().zip(here) {
                        *most = most.max(x.abs());
                    }
                }
                for (found, stated) in most.into_iter().zip(stated) {
                    // Between samples a turn is missed by the square of their distance at most.
                    prop_assert!(found <= stated * (1.0 + 1e-9) && stated <= found * (1.0 + 1e-5) + 1e-9, "{found} {stated}");
                }
            }
        }
    }

    #[test]
    fn identity_derivatives_match_central_differences(limits in limits(2), seed in 0..1000u64, phase in 0.01..0.99f64) {
        let points = points(&limits, seed, 2);
        let path = QuinticPath::through(&points, &[2.0]).unwrap();
        let (t, h) = (2.0 * phase, 1e-5);
        let x = path.states(&[t - h, t, t + h]);
        for j in 0..2 {
            let a = path.coefficients()[0].1[j];
            // Third and fourth derivative on [0, 2].
            let third = 6.0 * a[3].abs() + 48.0 * a[4].abs() + 240.0 * a[5].abs();
            let fourth = 24.0 * a[4].abs() + 240.0 * a[5].abs();
            let value: f64 = a.iter().enumerate().map(|(i, v)| v.abs() * 2f64.powi(i as i32)).sum();
            let slope = (x.q(j)[2] - x.q(j)[0]) / (2.0 * h);
            prop_assert!((slope - x.qd(j)[1]).abs() <= h * h / 6.0 * third + 8.0 * f64::EPSILON * value / h);
            let slope = (x.qd(j)[2] - x.qd(j)[0]) / (2.0 * h);
            prop_assert!((slope - x.qdd(j)[1]).abs() <= h * h / 6.0 * (fourth + 120.0 * a[5].abs()) + 40.0 * f64::EPSILON * value / h);
        }
    }

    #[test]
    fn identity_extrema_bound_a_dense_grid_and_are_attained(
        limits in limits(2), seed in 0..1000u64, durations in prop::collection::vec(0.2..5.0f64, 3),
    ) {
        let points = points(&limits, seed, 4);
        let path = QuinticPath::through(&points, &durations).unwrap();
        let dense = path.states(&grid(path.duration(), 20_000));
        for (j, e) in path.extrema().iter().enumerate() {
            let top = dense.q(j).iter().copied().fold(f64::MIN, f64::max);
            let bottom = dense.q(j).iter().copied().fold(f64::MAX, f64::min);
            let at = path.states(&[e.lowest.time, e.highest.time, e.velocity.time, e.acceleration.time]);
            for (dense, stated, found) in [
                (-bottom, -e.lowest.value, -at.q(j)[0]),
                (top, e.highest.value, at.q(j)[1]),
                (largest(dense.qd(j)), e.velocity.value.abs(), at.qd(j)[2].abs()),
                (largest(dense.qdd(j)), e.acceleration.value.abs(), at.qdd(j)[3].abs()),
            ] {
                let scale = 1.0 + stated.abs();
                prop_assert!(dense <= stated + 1e-11 * scale, "{} above {}", dense, stated);
                prop_assert!((found - stated).abs() <= 1e-9 * scale);
                // The grid's step against the shortest segment: 20 000 steps of at most 15 s.
                prop_assert!(dense >= stated - 1e-3 * scale);
            }
        }
    }

    #[test]
    fn identity_shortest_paths_keep_the_limits_and_reach_one_in_each_segment(
        limits in limits(3), seed in 0..1000u64, slower in 0.3..1.0f64,
    ) {
        // Points up to the path's own speed limit, and below it.
        let points = points(&limits.scaled(1.0, slower.min(0.9) / 0.9, 1.0), seed, 4);
        let path = QuinticPath::shortest(&points, &limits).unwrap();
        let dense = path.states(&grid(path.duration(), 5000));
        for j in 0..3 {
            prop_assert!(largest(dense.qd(j)) <= limits.velocity[j] * (1.0 + 1e-9));
            prop_assert!(largest(dense.qdd(j)) <= limits.acceleration[j] * (1.0 + 1e-9));
        }
        let wide = Limits::new(vec![[-1e3, 1e3]; 3], limits.velocity.clone(), limits.acceleration.clone()).unwrap();
        prop_assert!(path.certificate(&wide).certified);
        for (i, (duration, _)) in path.coefficients().iter().enumerate() {
            let ends = &points[i..i + 2];
            let uses = |duration: f64| {
                let segment = QuinticPath::through(ends, &[duration]).unwrap();
                segment.certificate(&wide).largest().2.fraction
            };
            prop_assert!((uses(*duration) - 1.0).abs() <= 1e-9, "segment {}: {}", i, uses(*duration));
            // No shorter one: also where the acceleration does not grow steadily as the duration shrinks. Within
            // a thousandth an end speed at its limit leaves an excess below the tolerance of the limits.
            for k in 1..200 {
                let shorter = duration * (0.999 - 0.004_95 * f64::from(k - 1));
                prop_assert!(uses(shorter) > 1.0, "segment {} also in {} of {} s", i, shorter, duration);
            }
        }
    }

    #[test]
    fn identity_overshoot_is_what_a_dense_grid_sees(limits in limits(2), seed in 0..1000u64) {
        let points = points(&limits, seed, 4);
        let path = QuinticPath::shortest(&points, &limits).unwrap();
        let dense = path.states(&grid(path.duration(), 20_000));
        let stated = path.largest_overshoot(&limits);
        for j in 0..2 {
            let [low, high] = limits.position[j];
            let seen = dense.q(j).iter().map(|q| (q - high).max(low - q)).fold(0.0, f64::max);
            prop_assert!(seen <= stated[j] + 1e-11);
            // Steps of h see all but max|qdd| h²/8.
            let h = path.duration() / 20_000.0;
            prop_assert!(seen >= stated[j] - limits.acceleration[j] * h * h / 8.0 - 1e-11);
        }
        for o in path.overshoot(&limits) {
            let position = path.states(&[o.time]).q(o.joint)[0];
            prop_assert!((position - o.position).abs() <= 1e-9);
            prop_assert!(path.point_times()[o.segment] <= o.time && o.time <= path.point_times()[o.segment + 1]);
            let [low, high] = limits.position[o.joint];
            prop_assert!((o.amount - (position - high).max(low - position)).abs() <= 1e-9);
        }
    }
}

#[test]
fn oracle_rest_to_rest_has_its_closed_form() {
    // Velocity 15/8 A/T at the middle; acceleration (10/√3) A/T² at s = (1 ∓ 1/√3)/2.
    for (a, v, acceleration) in [(0.7, 0.5, 100.0), (0.7, 50.0, 1.3), (-1.2, 1.0, 4.0)] {
        let path = QuinticPath::shortest(
            &one_joint([0.1, 0.0], [0.1 + a, 0.0]),
            &one_limit(v, acceleration),
        )
        .unwrap();
        let a: f64 = a;
        let expected =
            (1.875 * a.abs() / v).max((10.0 / 3f64.sqrt() * a.abs() / acceleration).sqrt());
        assert!(
            (path.duration() / expected - 1.0).abs() < 1e-12,
            "{} {expected}",
            path.duration()
        );
    }
}

#[test]
fn oracle_reversal_in_place_has_its_closed_form() {
    // From (0, v) to (0, −v): qdd = −12 (v/T) s (1 − s), so T = 3 v / qdd_max; q = v T (s − 2 s³ + s⁴), highest at
    // the middle with 5/16 v T.
    let (v, acceleration) = (0.6, 2.0);
    let limits = Limits::new(vec![[-0.1, 0.1]], vec![v], vec![acceleration]).unwrap();
    let path = QuinticPath::shortest(&one_joint([0.0, v], [0.0, -v]), &limits).unwrap();
    let duration = 3.0 * v / acceleration;
    assert!((path.duration() / duration - 1.0).abs() < 1e-11);
    let overshoot = path.overshoot(&limits);
    assert_eq!(overshoot.len(), 1);
    assert_eq!((overshoot[0].joint, overshoot[0].segment), (0, 0));
    assert!((overshoot[0].amount - (0.3125 * v * duration - 0.1)).abs() < 1e-11);
    assert!((overshoot[0].time - 0.5 * duration).abs() < 1e-7);
}

#[test]
fn regress_a_steady_passage_is_found_although_longer_ones_need_more_acceleration() {
    // At speed v over A the duration A/v needs no acceleration; 3 A/v needs more than it is allowed here, and a search
    // that takes the acceleration to fall with the duration would never come back.
    let (v, a) = (1.0, 1.0);
    let ends = one_joint([0.0, v], [a, v]);
    let limits = one_limit(2.0, 0.05);
    let path = QuinticPath::shortest(&ends, &limits).unwrap();
    assert!(path.duration() < a / v && path.duration() > 0.9 * a / v);
    let longer = QuinticPath::through(&ends, &[2.0 * a / v]).unwrap();
    assert!(!longer.certificate(&one_limit(2.0, 0.05)).certified);
}

#[test]
fn identity_outside_its_time_a_path_stays_at_its_ends() {
    let path =
        QuinticPath::shortest(&one_joint([0.0, 0.0], [1.0, 0.0]), &one_limit(1.0, 1.0)).unwrap();
    let x = path.states(&[-1.0, 0.0, path.duration(), path.duration() + 1.0]);
    assert_eq!(x.q(0)[0], 0.0);
    assert!((x.q(0)[3] - 1.0).abs() < ROUNDING && x.qd(0)[3].abs() < 1e-11);
    assert_eq!(x.q(0)[2], x.q(0)[3]);
}

#[test]
fn identity_bad_points_are_refused_with_their_place() {
    let limits = one_limit(1.0, 1.0);
    let shortest = |points: &[PathPoint]| QuinticPath::shortest(points, &limits);
    let error = shortest(&one_joint([0.0, 0.5], [1.0, -1.5])).unwrap_err();
    assert_eq!(
        error,
        Error::PointTooFast {
            point: 2,
            joint: 1,
            speed: 1.5,
            limit: 1.0
        }
    );
    let text = |e: Result<QuinticPath, Error>| e.unwrap_err().to_string();
    assert!(
        text(shortest(&one_joint([0.2, 0.0], [0.2, 0.0])))
            .starts_with("points 1 and 2: the same point at rest")
    );
    assert!(text(shortest(&one_joint([0.0, 0.0], [f64::NAN, 0.0]))).starts_with("point 2: NaN"));
    assert!(text(shortest(&[PathPoint::at_rest(&[0.0])])).starts_with("path: 1 points"));
    assert!(
        text(shortest(&[
            PathPoint::at_rest(&[0.0]),
            PathPoint::at_rest(&[0.0, 1.0])
        ]))
        .starts_with("point 2: 2 positions")
    );
    let ends = one_joint([0.0, 0.0], [1.0, 0.0]);
    assert!(text(QuinticPath::through(&ends, &[])).contains("2 points, 0 durations"));
    assert!(text(QuinticPath::through(&ends, &[0.0])).starts_with("segment 1: duration 0 s"));
}
