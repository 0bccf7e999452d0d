//! The shortest duration of a segment under limits of velocity and acceleration.

use crate::limits::Limits;
use crate::segment::{Ends, quadratic_roots};

/// A limit is met to this fraction of it: some thousand roundings of the formulas below.
pub(crate) const LIMIT_TOLERANCE: f64 = 1e-12;
/// Steps towards the duration: four are usual, 24 the most in 8000 random segments (end speeds at their limit). A
/// duration cut short by this would be too short, and the certificate of the path would say so.
const MAX_STEPS: usize = 1000;

/// Shortest duration, s, at which every joint keeps its limits; `None` where every duration does (nothing moves).
///
/// With `r = 1/duration` and `s = u/duration`, velocity and acceleration at a fixed `s` are polynomials in `r`:
/// ```text
/// qd  = A r g(s) + c(s)            g = 30 s²(1−s)²,  c = qd_a (1 − 18s² + 32s³ − 15s⁴) − qd_b (12s² − 28s³ + 15s⁴)
/// qdd = A r² G(s) + r C(s)         G = g', C = c'
/// ```
/// Every `r` at which one of them exceeds its limit at one `s` is too large. So from an `r` that is certainly too large,
/// take the worst `s` of any joint, go down to the next `r` at which that one instant keeps its limit, and repeat: the
/// steps pass over no feasible duration and shrink like Newton's. Gautier & Khalil 1991, section 5, minimise over
/// the duration taking the largest acceleration to fall with it; that holds for the velocity (it is convex in
/// |A| r with its least value at 0) but not always for the acceleration: between two points passed at the same
/// speed, the duration A/qd needs none at all, and longer ones do.
///
/// End speeds must be within the limits.
pub(crate) fn shortest_duration(ends: &[Ends], limits: &Limits) -> Option<f64> {
    let joints: Vec<_> = (0..ends.len())
        .map(|j| Joint {
            distance: ends[j].q[1] - ends[j].q[0],
            qd: ends[j].qd,
            // End speeds at the limit but for rounding are at the limit.
            velocity: ends[j]
                .qd
                .iter()
                .fold(limits.velocity[j], |v, qd| v.max(qd.abs())),
            acceleration: limits.acceleration[j],
        })
        .collect();
    let mut r = joints
        .iter()
        .map(Joint::too_large)
        .fold(f64::INFINITY, f64::min);
    if r == f64::INFINITY {
        return None;
    }
    for _ in 0..MAX_STEPS {
        let worst = joints
            .iter()
            .flat_map(|joint| [joint.fastest(r), joint.hardest(r)])
            .max_by(|a, b| a.fraction.total_cmp(&b.fraction))?;
        if worst.fraction <= 1.0 + LIMIT_TOLERANCE {
            break;
        }
        // A step that rounding keeps from moving goes on by one unit of the tolerance.
        r = worst.next.min(r * (1.0 - 0.1 * LIMIT_TOLERANCE));
    }
    Some(1.0 / r)
}

struct Joint {
    distance: f64,
    qd: [f64; 2],
    velocity: f64,
    acceleration: f64,
}

/// The instant at which a joint uses most of a limit, and the next smaller `r` at which that instant keeps it.
struct Worst {
    fraction: f64,
    next: f64,
}

impl Joint {
    /// An `r` above which this joint breaks a limit for certain; infinite if it stands still.
    fn too_large(&self) -> f64 {
        let [va, vb] = self.qd;
        if self.distance != 0.0 {
            // The middle of the segment: g = 30/16, c = −(7/16)(qd_a + qd_b).
            let ends = 0.4375 * (va.abs() + vb.abs());
            return (self.velocity + ends) / (1.875 * self.distance.abs());
        }
        // No distance: qdd = r C(s), taken at its own largest |C|.
        let largest = peak(-(3.0 * va + 2.0 * vb), 2.0 * va + 3.0 * vb).0;
        self.acceleration / largest.abs()
    }

    /// The velocity of largest magnitude, at the root of qdd or at an end.
    fn fastest(&self, r: f64) -> Worst {
        let [va, vb] = self.qd;
        let [e0, e1] = self.ends_of_acceleration(r);
        let s = e0 / (e0 - e1);
        let s = if s > 0.0 && s < 1.0 { s } else { 0.0 };
        let slope = self.distance * 30.0 * s * s * (1.0 - s) * (1.0 - s);
        let rest = va * (1.0 - s * s * (18.0 - s * (32.0 - 15.0 * s)))
            - vb * s * s * (12.0 - s * (28.0 - 15.0 * s));
        let qd = slope * r + rest;
        Worst {
            fraction: qd.abs() / self.velocity,
            next: (self.velocity.copysign(qd) - rest) / slope,
        }
    }

    /// The acceleration of largest magnitude.
    fn hardest(&self, r: f64) -> Worst {
        let [va, vb] = self.qd;
        let [e0, e1] = self.ends_of_acceleration(r);
        let (peak, s) = peak(e0, e1);
        let qdd = 12.0 * peak;
        let shape = 12.0 * s * (1.0 - s);
        let square = shape * 5.0 * self.distance * (1.0 - 2.0 * s);
        let linear = shape * (-(3.0 * va + 2.0 * vb) * (1.0 - s) + (2.0 * va + 3.0 * vb) * s);
        // Of the crossings below r the nearest: the roots of square r² + linear r = ±limit.
        let next = [self.acceleration, -self.acceleration]
            .into_iter()
            .flat_map(|limit| quadratic_roots(-limit, linear, square))
            .filter(|&root| root < r && root > 0.0)
            .fold(0.0, f64::max);
        Worst {
            fraction: qdd.abs() / self.acceleration,
            next,
        }
    }

    /// `qdd = 12 s (1 − s) (e0 (1 − s) + e1 s)`.
    fn ends_of_acceleration(&self, r: f64) -> [f64; 2] {
        let [va, vb] = self.qd;
        let square = 5.0 * self.distance * r * r;
        [
            square - r * (3.0 * va + 2.0 * vb),
            -square + r * (2.0 * va + 3.0 * vb),
        ]
    }
}

/// Value of largest magnitude of `s (1 − s) (e0 (1 − s) + e1 s)` on [0, 1], and its place.
fn peak(e0: f64, e1: f64) -> (f64, f64) {
    let value = |s: f64| s * (1.0 - s) * (e0 * (1.0 - s) + e1 * s);
    let d = e1 - e0;
    // Derivative: e0 + 2 (d − e0) s − 3 d s².
    quadratic_roots(e0, 2.0 * (d - e0), -3.0 * d)
        .into_iter()
        .filter(|s| *s > 0.0 && *s < 1.0)
        .map(|s| (value(s), s))
        .fold((0.0, 0.5), |a, b| if b.0.abs() > a.0.abs() { b } else { a })
}
