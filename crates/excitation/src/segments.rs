//! Nearest points of two segments.

use nalgebra::Vector3;

/// Below this share of the squared lengths two segments count as parallel: any pair of nearest points serves.
const PARALLEL: f64 = 1e-14;

/// Where on each segment, 0 at the first end and 1 at the second, the two come nearest; some pair where many do.
///
/// Source: Ericson 2005, section 5.1.9.
pub(crate) fn nearest(a: &[Vector3<f64>; 2], b: &[Vector3<f64>; 2]) -> [f64; 2] {
    let (d1, d2, r) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (aa, ee, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    if aa == 0.0 && ee == 0.0 {
        return [0.0, 0.0];
    }
    if aa == 0.0 {
        return [0.0, (f / ee).clamp(0.0, 1.0)];
    }
    let c = d1.dot(&r);
    if ee == 0.0 {
        return [(-c / aa).clamp(0.0, 1.0), 0.0];
    }
    let b12 = d1.dot(&d2);
    let denominator = aa * ee - b12 * b12;
    let mut s = if denominator > PARALLEL * aa * ee {
        ((b12 * f - c * ee) / denominator).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut t = (b12 * s + f) / ee;
    if t < 0.0 {
        t = 0.0;
        s = (-c / aa).clamp(0.0, 1.0);
    } else if t > 1.0 {
        t = 1.0;
        s = ((b12 - c) / aa).clamp(0.0, 1.0);
    }
    [s, t]
}

pub(crate) fn point(segment: &[Vector3<f64>; 2], s: f64) -> Vector3<f64> {
    segment[0] + (segment[1] - segment[0]) * s
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn segment() -> impl Strategy<Value = [Vector3<f64>; 2]> {
        let end = || prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from);
        // Some have no length, some are along an axis.
        (end(), end(), 0..4_u32).prop_map(|(a, b, kind)| match kind {
            0 => [a, a],
            1 => [a, a + Vector3::new(b.x, 0.0, 0.0)],
            _ => [a, b],
        })
    }

    fn distance(a: &[Vector3<f64>; 2], b: &[Vector3<f64>; 2]) -> f64 {
        let [s, t] = nearest(a, b);
        (point(a, s) - point(b, t)).norm()
    }

    proptest! {
        #[test]
        fn identity_distance_does_not_depend_on_order_or_direction(a in segment(), b in segment()) {
            let d = distance(&a, &b);
            for other in [distance(&b, &a), distance(&[a[1], a[0]], &b), distance(&a, &[b[1], b[0]])] {
                // Nearly parallel segments lose half of the digits of where, not of how far.
                prop_assert!((d - other).abs() < 1e-7, "{} against {}", d, other);
            }
        }

        #[test]
        fn oracle_no_pair_of_points_is_nearer(a in segment(), b in segment()) {
            let d = distance(&a, &b);
            let n = 40;
            let mut least = f64::INFINITY;
            for i in 0..=n {
                for k in 0..=n {
                    let (s, t) = (f64::from(i) / f64::from(n), f64::from(k) / f64::from(n));
                    least = least.min((point(&a, s) - point(&b, t)).norm());
                }
            }
            prop_assert!(d <= least + 1e-7, "{} but {} was found", d, least);
            // Half a step on either segment.
            let step = ((a[1] - a[0]).norm() + (b[1] - b[0]).norm()) / f64::from(2 * n);
            prop_assert!(least - d <= step + 1e-12);
        }
    }
}
