//! How much of each limit a motion uses, and when: exact extrema, not samples.

use crate::fourier::FourierSeries;
use crate::limits::Limits;
use crate::trigonometric::{TrigonometricPolynomial, sampling_factor};

/// A motion that touches a limit is inside; this much of the limit is left to rounding.
pub const USE_TOLERANCE: f64 = 1e-9;

/// An extreme value and the time of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremum {
    /// The value met, with its sign: rad, rad/s or rad/s² (m for prismatic).
    pub value: f64,
    /// When, s from the start of the motion.
    pub time: f64,
    /// No instant goes beyond this; the value itself up to rounding.
    pub bound: f64,
}

/// Extrema of one joint over the whole motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointExtrema {
    /// Lowest position.
    pub lowest: Extremum,
    /// Highest position.
    pub highest: Extremum,
    /// Velocity of largest magnitude.
    pub velocity: Extremum,
    /// Acceleration of largest magnitude.
    pub acceleration: Extremum,
}

/// Largest use of one limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitUse {
    /// Fraction of the limit used, 1 at the limit; of positions, distance from the centre over half the range.
    pub fraction: f64,
    /// When, s.
    pub time: f64,
    /// No instant uses more than this fraction.
    pub bound: f64,
}

/// Largest use of the limits of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointUse {
    /// Of the position range.
    pub position: LimitUse,
    /// Of the speed.
    pub velocity: LimitUse,
    /// Of the acceleration.
    pub acceleration: LimitUse,
}

/// Which limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    /// Position, rad or m.
    Position,
    /// Velocity, rad/s or m/s.
    Velocity,
    /// Acceleration, rad/s² or m/s².
    Acceleration,
}

/// What a motion uses of its limits, guaranteed for every instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// One entry a joint.
    pub joints: Vec<JointUse>,
    /// No instant goes beyond any limit by more than [`USE_TOLERANCE`] of it.
    pub certified: bool,
}

impl Certificate {
    /// From the extrema of a motion.
    ///
    /// # Panics
    /// If there are limits for another number of joints.
    #[track_caller]
    pub fn new(extrema: &[JointExtrema], limits: &Limits) -> Self {
        assert_eq!(extrema.len(), limits.n_joints(), "joints of the limits");
        let joints: Vec<_> = extrema
            .iter()
            .enumerate()
            .map(|(j, e)| {
                let (centre, half) = (limits.centre(j), limits.half_range(j));
                let low = limit_use(&e.lowest, centre, half);
                let high = limit_use(&e.highest, centre, half);
                let larger = if high.fraction >= low.fraction {
                    high
                } else {
                    low
                };
                JointUse {
                    position: LimitUse {
                        bound: low.bound.max(high.bound),
                        ..larger
                    },
                    velocity: limit_use(&e.velocity, 0.0, limits.velocity[j]),
                    acceleration: limit_use(&e.acceleration, 0.0, limits.acceleration[j]),
                }
            })
            .collect();
        let bounds = joints
            .iter()
            .flat_map(|j| [&j.position, &j.velocity, &j.acceleration]);
        // A comparison with a value that is not a number must not certify.
        let certified = bounds.into_iter().all(|u| u.bound <= 1.0 + USE_TOLERANCE);
        Self { joints, certified }
    }

    /// The limit used most: joint, which limit, how much.
    pub fn largest(&self) -> (usize, LimitKind, LimitUse) {
        let mut largest = (0, LimitKind::Position, self.joints[0].position);
        for (j, joint) in self.joints.iter().enumerate() {
            for (kind, limit) in [
                (LimitKind::Position, joint.position),
                (LimitKind::Velocity, joint.velocity),
                (LimitKind::Acceleration, joint.acceleration),
            ] {
                if limit.fraction > largest.2.fraction {
                    largest = (j, kind, limit);
                }
            }
        }
        largest
    }
}

fn limit_use(extremum: &Extremum, centre: f64, half: f64) -> LimitUse {
    LimitUse {
        fraction: (extremum.value - centre).abs() / half,
        time: extremum.time,
        bound: (extremum.bound - centre).abs() / half,
    }
}

impl FourierSeries {
    /// Extrema of every joint over a period, by branch and bound: exact up to rounding, none missed.
    ///
    /// The derivative of an extremum with respect to the coefficients is the basis at its time
    /// ([`FourierBasis::at`](crate::FourierBasis::at)): the time itself does not count to first order.
    pub fn extrema(&self) -> Vec<JointExtrema> {
        let joint = |j| {
            let [q, qd, qdd] = self.polynomials(j);
            JointExtrema {
                lowest: self.lowest(&q),
                highest: self.highest(&q),
                velocity: self.largest(&qd),
                acceleration: self.largest(&qdd),
            }
        };
        (0..self.n_joints()).map(joint).collect()
    }

    /// Largest use of the limits, certified for every instant.
    ///
    /// # Panics
    /// If there are limits for another number of joints.
    #[track_caller]
    pub fn certificate(&self, limits: &Limits) -> Certificate {
        Certificate::new(&self.extrema(), limits)
    }

    /// Upper bounds of `|q − centre|`, `|qd|`, `|qdd|` of every joint from `n_samples` equal steps of the period: the
    /// largest sample over [`sampling_factor`]. Cheaper and looser than [`extrema`](Self::extrema).
    ///
    /// # Panics
    /// Unless `n_samples > 2 * n_harmonics`.
    #[track_caller]
    pub fn sampled_bounds(&self, centres: &[f64], n_samples: usize) -> Vec<[f64; 3]> {
        assert_eq!(centres.len(), self.n_joints(), "one centre per joint");
        let factor = sampling_factor(self.n_harmonics(), n_samples);
        let joint = |j: usize| {
            let [q, qd, qdd] = self.polynomials(j);
            [
                q.largest_sample(centres[j], n_samples) / factor,
                qd.largest_sample(0.0, n_samples) / factor,
                qdd.largest_sample(0.0, n_samples) / factor,
            ]
        };
        (0..self.n_joints()).map(joint).collect()
    }

    fn highest(&self, p: &TrigonometricPolynomial) -> Extremum {
        let m = p.maximum();
        Extremum {
            value: m.value,
            time: m.theta / self.omega(),
            bound: m.bound,
        }
    }

    fn lowest(&self, p: &TrigonometricPolynomial) -> Extremum {
        let m = self.highest(&p.negated());
        Extremum {
            value: -m.value,
            bound: -m.bound,
            ..m
        }
    }

    fn largest(&self, p: &TrigonometricPolynomial) -> Extremum {
        let (low, high) = (self.lowest(p), self.highest(p));
        if high.value >= -low.value { high } else { low }
    }
}
