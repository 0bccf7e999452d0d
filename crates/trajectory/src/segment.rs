//! One fifth-order polynomial from one (q, qd) to the next, and where it is extreme.

use crate::certificate::Extremum;

/// `q(u) = a0 + a1 u + … + a5 u⁵` of one joint, `u` in `[0, duration]`; rad, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quintic {
    pub(crate) a: [f64; 6],
    pub(crate) duration: f64,
}

/// Ends of a segment of one joint: rad, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ends {
    pub(crate) q: [f64; 2],
    pub(crate) qd: [f64; 2],
}

impl Quintic {
    /// Zero acceleration at both ends. Source: Gautier & Khalil 1991, eq. (24) to (28), printed correctly but for the dots of (27).
    pub(crate) fn between(ends: &Ends, duration: f64) -> Self {
        let [qa, qb] = ends.q;
        let [va, vb] = ends.qd;
        let (u, d) = (duration, qb - qa);
        let a = [
            qa,
            va,
            0.0,
            (10.0 * d / u - (6.0 * va + 4.0 * vb)) / (u * u),
            (-15.0 * d / u + (8.0 * va + 7.0 * vb)) / (u * u * u),
            (6.0 * d / u - 3.0 * (va + vb)) / (u * u * u * u),
        ];
        Self { a, duration }
    }

    pub(crate) fn q(&self, u: f64) -> f64 {
        let [a0, a1, a2, a3, a4, a5] = self.a;
        a0 + u * (a1 + u * (a2 + u * (a3 + u * (a4 + u * a5))))
    }

    pub(crate) fn qd(&self, u: f64) -> f64 {
        let [_, a1, a2, a3, a4, a5] = self.a;
        a1 + u * (2.0 * a2 + u * (3.0 * a3 + u * (4.0 * a4 + u * 5.0 * a5)))
    }

    pub(crate) fn qdd(&self, u: f64) -> f64 {
        let [_, _, a2, a3, a4, a5] = self.a;
        2.0 * a2 + u * (6.0 * a3 + u * (12.0 * a4 + u * 20.0 * a5))
    }

    /// Instants between which the velocity is monotone: the ends and the roots of qdd inside, in order.
    ///
    /// qdd vanishes at the ends, so besides them it has one root: `qdd = u (T − u) (α + β u)` with
    /// `α = 6 a3 / T`, `β = −20 a5`.
    fn turns_of_velocity(&self) -> [f64; 3] {
        let t = self.duration;
        let root = 6.0 * self.a[3] / (20.0 * self.a[5] * t);
        let inside = if root > 0.0 && root < t { root } else { 0.0 };
        [0.0, inside, t]
    }

    /// Lowest and highest position.
    pub(crate) fn position_extrema(&self) -> [Extremum; 2] {
        let [u0, u1, u2] = self.turns_of_velocity();
        let candidates = [
            u0,
            u2,
            self.root_of_velocity(u0, u1),
            self.root_of_velocity(u1, u2),
        ];
        self.extremes(&candidates, Self::q)
    }

    /// Velocity of largest magnitude.
    pub(crate) fn velocity_extremum(&self) -> Extremum {
        let [low, high] = self.extremes(&self.turns_of_velocity(), Self::qd);
        larger(low, high)
    }

    /// Acceleration of largest magnitude; the roots of the jerk `6 a3 + 24 a4 u + 60 a5 u²`.
    pub(crate) fn acceleration_extremum(&self) -> Extremum {
        let [_, _, _, a3, a4, a5] = self.a;
        let t = self.duration;
        // In w = u / T, all three terms of one size.
        let roots = quadratic_roots(a3, 4.0 * a4 * t, 10.0 * a5 * t * t);
        let [r0, r1] = roots.map(|w| if w > 0.0 && w < 1.0 { w * t } else { 0.0 });
        let [low, high] = self.extremes(&[0.0, r0, r1, t], Self::qdd);
        larger(low, high)
    }

    /// Largest magnitude of the jerk `6 a3 + 24 a4 u + 60 a5 u²`.
    pub(crate) fn largest_jerk(&self) -> f64 {
        let [_, _, _, a3, a4, a5] = self.a;
        let t = self.duration;
        let jerk = |w: f64| {
            (60.0 * a5 * t * t)
                .mul_add(w, 24.0 * a4 * t)
                .mul_add(w, 6.0 * a3)
        };
        let turn = -0.2 * a4 / (a5 * t);
        let turn = if turn > 0.0 && turn < 1.0 { turn } else { 0.0 };
        let all = [0.0, turn, 1.0].map(|w| jerk(w).abs());
        all.into_iter().fold(0.0, f64::max)
    }

    /// Instant between two turns where the velocity changes sign; an end where it does not.
    fn root_of_velocity(&self, from: f64, to: f64) -> f64 {
        let (mut low, mut high) = (from, to);
        let rising = self.qd(low) < 0.0;
        if rising == (self.qd(high) < 0.0) {
            return from;
        }
        // Bisection to the last bit: monotone in between, so nothing can go wrong.
        loop {
            let middle = f64::midpoint(low, high);
            if middle <= low || middle >= high {
                return middle;
            }
            if (self.qd(middle) < 0.0) == rising {
                low = middle;
            } else {
                high = middle;
            }
        }
    }

    fn extremes(&self, candidates: &[f64], value: fn(&Self, f64) -> f64) -> [Extremum; 2] {
        let at = |u: f64| {
            let value = value(self, u);
            Extremum {
                value,
                time: u,
                bound: value,
            }
        };
        let first = at(candidates[0]);
        let mut extremes = [first, first];
        for &u in &candidates[1..] {
            let e = at(u);
            if e.value < extremes[0].value {
                extremes[0] = e;
            }
            if e.value > extremes[1].value {
                extremes[1] = e;
            }
        }
        extremes
    }
}

/// The one of larger magnitude.
pub(crate) fn larger(a: Extremum, b: Extremum) -> Extremum {
    if b.value.abs() > a.value.abs() { b } else { a }
}

/// Real roots of `c0 + c1 x + c2 x²`, without cancellation; NaN where there are fewer.
pub(crate) fn quadratic_roots(c0: f64, c1: f64, c2: f64) -> [f64; 2] {
    let discriminant = c1 * c1 - 4.0 * c0 * c2;
    let half = -0.5 * (c1 + discriminant.sqrt().copysign(c1));
    [half / c2, c0 / half]
}
