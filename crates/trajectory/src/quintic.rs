//! Paths of fifth-order polynomials through points (q, qd).

use crate::certificate::{Certificate, Extremum, JointExtrema};
use crate::error::Error;
use crate::limits::Limits;
use crate::segment::{Ends, Quintic, larger};
use crate::shortest::{LIMIT_TOLERANCE, shortest_duration};
use idim_model::JointStates;

/// A point a path passes: positions, rad (m), and velocities, rad/s (m/s), of all joints; accelerations are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPoint {
    /// Positions.
    pub q: Vec<f64>,
    /// Velocities.
    pub qd: Vec<f64>,
}

impl PathPoint {
    /// A point at rest.
    pub fn at_rest(q: &[f64]) -> Self {
        Self {
            q: q.to_vec(),
            qd: vec![0.0; q.len()],
        }
    }
}

/// A motion through points, with continuous q, qd and qdd; one fifth-order polynomial a joint between two points.
///
/// Source: Gautier & Khalil 1991, section 5.
#[derive(Debug, Clone, PartialEq)]
pub struct QuinticPath {
    /// Times of the points, s, the first zero.
    times: Vec<f64>,
    /// Segment by segment, joint by joint.
    segments: Vec<Vec<Quintic>>,
}

/// Where a path leaves the position limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overshoot {
    /// Joint, from 0.
    pub joint: usize,
    /// Segment, from 0: between point `segment` and the next.
    pub segment: usize,
    /// When, s.
    pub time: f64,
    /// The position there, rad (m).
    pub position: f64,
    /// How far beyond the limit, rad (m).
    pub amount: f64,
}

/// The least excess over a position limit that counts as one, as a fraction of half the range: rounding.
const OVERSHOOT_TOLERANCE: f64 = 1e-12;
/// Neighbouring segments of a file meet to this fraction of their values, or this much of one unit.
const JOIN_TOLERANCE: f64 = 1e-9;

impl QuinticPath {
    /// The shortest path through `points` under velocity and acceleration limits: each segment reaches one of them.
    ///
    /// The limits are those of the path; its positions may leave their limits between points, see
    /// [`overshoot`](Self::overshoot). The remedy of Gautier & Khalil 1991, section 5, is to find the points again
    /// under smaller limits ([`Limits::scaled`]).
    ///
    /// # Errors
    /// Fewer than two points, points of other sizes than the limits, numbers that are not finite, a point faster
    /// than the path's limit, a rest repeated.
    pub fn shortest(points: &[PathPoint], limits: &Limits) -> Result<Self, Error> {
        check_points(points, limits.n_joints())?;
        for (i, point) in points.iter().enumerate() {
            for (j, (qd, limit)) in point.qd.iter().zip(&limits.velocity).enumerate() {
                if qd.abs() > limit * (1.0 + LIMIT_TOLERANCE) {
                    return Err(Error::PointTooFast {
                        point: i + 1,
                        joint: j + 1,
                        speed: qd.abs(),
                        limit: *limit,
                    });
                }
            }
        }
        let mut durations = Vec::with_capacity(points.len() - 1);
        for (i, pair) in points.windows(2).enumerate() {
            let duration = shortest_duration(&ends(&pair[0], &pair[1]), limits);
            durations.push(duration.ok_or_else(|| {
                Error::motion(
                    format!("points {} and {}", i + 1, i + 2),
                    "the same point at rest",
                    "leave one of them out",
                )
            })?);
        }
        Self::through(points, &durations)
    }

    /// The path through `points` with these durations between them, s.
    ///
    /// # Errors
    /// Fewer than two points, not one duration between each two, a duration that is not above zero, points of
    /// different sizes, numbers that are not finite.
    pub fn through(points: &[PathPoint], durations: &[f64]) -> Result<Self, Error> {
        check_points(points, points.first().map_or(0, |p| p.q.len()))?;
        if durations.len() + 1 != points.len() {
            return Err(Error::motion(
                "path",
                format!("{} points, {} durations", points.len(), durations.len()),
                "give one duration between each two points",
            ));
        }
        let segment = |(pair, &duration): (&[PathPoint], &f64)| {
            ends(&pair[0], &pair[1])
                .iter()
                .map(|e| Quintic::between(e, duration))
                .collect()
        };
        // Durations are checked where the segments are.
        Self::joined(points.windows(2).zip(durations).map(segment).collect())
    }

    /// From `(duration, [joint][a0 … a5])` of each segment: the inverse of [`coefficients`](Self::coefficients).
    ///
    /// # Errors
    /// No segment, segments with different numbers of joints, a duration that is not above zero, numbers that are
    /// not finite, neighbours that do not meet in q, qd and qdd.
    pub fn from_coefficients(segments: &[(f64, Vec<[f64; 6]>)]) -> Result<Self, Error> {
        let quintics = |(duration, joints): &(f64, Vec<[f64; 6]>)| {
            let of_joint = |a: &[f64; 6]| Quintic {
                a: *a,
                duration: *duration,
            };
            joints.iter().map(of_joint).collect()
        };
        let path = Self::joined(segments.iter().map(quintics).collect())?;
        path.check_joins()?;
        Ok(path)
    }

    /// Duration (s) and `[joint][a0 … a5]` of each segment: `q = Σ a_i u^i`, `u` s from the start of the segment.
    pub fn coefficients(&self) -> Vec<(f64, Vec<[f64; 6]>)> {
        let of_segment = |s: &Vec<Quintic>| (s[0].duration, s.iter().map(|p| p.a).collect());
        self.segments.iter().map(of_segment).collect()
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.segments[0].len()
    }

    /// Number of segments, one less than points.
    pub fn n_segments(&self) -> usize {
        self.segments.len()
    }

    /// Times of the points, s; the first is zero.
    pub fn point_times(&self) -> &[f64] {
        &self.times
    }

    /// From the first point to the last, s.
    pub fn duration(&self) -> f64 {
        self.times[self.segments.len()]
    }

    /// States at these times, s; before the first point and after the last one the states of these points.
    pub fn states(&self, times: &[f64]) -> JointStates {
        let mut states = JointStates::zeros(self.n_joints(), times.len());
        for (k, &t) in times.iter().enumerate() {
            let later = self.times.partition_point(|start| *start <= t);
            let segment = later.saturating_sub(1).min(self.segments.len() - 1);
            let duration = self.segments[segment][0].duration;
            let u = (t - self.times[segment]).clamp(0.0, duration);
            for (j, p) in self.segments[segment].iter().enumerate() {
                states.q_mut(j)[k] = p.q(u);
                states.qd_mut(j)[k] = p.qd(u);
                states.qdd_mut(j)[k] = p.qdd(u);
            }
        }
        states
    }

    /// Largest magnitudes of every joint on a segment: position, rad (m), acceleration, rad/s², and jerk, rad/s³.
    ///
    /// # Panics
    /// If there is no such segment.
    #[track_caller]
    pub fn magnitudes(&self, segment: usize) -> Vec<[f64; 3]> {
        let of_joint = |p: &Quintic| {
            let [low, high] = p.position_extrema().map(|e| e.value.abs());
            let acceleration = p.acceleration_extremum().value.abs();
            [low.max(high), acceleration, p.largest_jerk()]
        };
        self.segments[segment].iter().map(of_joint).collect()
    }

    /// Extrema of every joint over the whole path: roots of the derivatives, none missed.
    pub fn extrema(&self) -> Vec<JointExtrema> {
        let mut joints: Vec<JointExtrema> = Vec::with_capacity(self.n_joints());
        for j in 0..self.n_joints() {
            let mut segments = (0..self.n_segments())
                .map(|i| segment_extrema(&self.segments[i][j], self.times[i]));
            let Some(first) = segments.next() else { break };
            joints.push(segments.fold(first, |all, e| JointExtrema {
                lowest: if e.lowest.value < all.lowest.value {
                    e.lowest
                } else {
                    all.lowest
                },
                highest: if e.highest.value > all.highest.value {
                    e.highest
                } else {
                    all.highest
                },
                velocity: larger(all.velocity, e.velocity),
                acceleration: larger(all.acceleration, e.acceleration),
            }));
        }
        joints
    }

    /// Largest use of the limits, certified for every instant.
    ///
    /// # Panics
    /// If there are limits for another number of joints.
    #[track_caller]
    pub fn certificate(&self, limits: &Limits) -> Certificate {
        Certificate::new(&self.extrema(), limits)
    }

    /// Every excursion beyond the position limits: one entry per segment, joint and side, in this order.
    ///
    /// # Panics
    /// If there are limits for another number of joints.
    #[track_caller]
    pub fn overshoot(&self, limits: &Limits) -> Vec<Overshoot> {
        assert_eq!(self.n_joints(), limits.n_joints(), "joints of the limits");
        let mut found = Vec::new();
        for (segment, joints) in self.segments.iter().enumerate() {
            for (joint, p) in joints.iter().enumerate() {
                let [low, high] = limits.position[joint];
                let [lowest, highest] = p.position_extrema();
                for (e, amount) in [
                    (lowest, low - lowest.value),
                    (highest, highest.value - high),
                ] {
                    if amount > OVERSHOOT_TOLERANCE * limits.half_range(joint) {
                        found.push(Overshoot {
                            joint,
                            segment,
                            time: self.times[segment] + e.time,
                            position: e.value,
                            amount,
                        });
                    }
                }
            }
        }
        found
    }

    /// Largest excursion of each joint beyond its position limits, rad (m); zero where it stays inside.
    ///
    /// # Panics
    /// If there are limits for another number of joints.
    #[track_caller]
    pub fn largest_overshoot(&self, limits: &Limits) -> Vec<f64> {
        let mut largest = vec![0.0_f64; self.n_joints()];
        for o in self.overshoot(limits) {
            largest[o.joint] = largest[o.joint].max(o.amount);
        }
        largest
    }

    fn joined(segments: Vec<Vec<Quintic>>) -> Result<Self, Error> {
        let n_joints = segments.first().map_or(0, Vec::len);
        if n_joints == 0 {
            return Err(Error::motion(
                "path",
                "no segment, or no joint",
                "a path leads from one point to another",
            ));
        }
        let mut times = vec![0.0];
        for (i, segment) in segments.iter().enumerate() {
            let place = || format!("segment {}", i + 1);
            if segment.len() != n_joints {
                return Err(Error::motion(
                    place(),
                    format!("{} joints", segment.len()),
                    "all segments have the joints of the first",
                ));
            }
            let duration = segment[0].duration;
            if !(duration > 0.0 && duration.is_finite()) {
                return Err(Error::motion(
                    place(),
                    format!("duration {duration} s"),
                    "it must be finite and above zero",
                ));
            }
            if let Some(bad) = segment.iter().flat_map(|p| &p.a).find(|a| !a.is_finite()) {
                return Err(Error::motion(
                    place(),
                    format!("coefficient {bad}"),
                    "coefficients must be finite",
                ));
            }
            times.push(times[i] + duration);
        }
        Ok(Self { times, segments })
    }

    fn check_joins(&self) -> Result<(), Error> {
        for (i, pair) in self.segments.windows(2).enumerate() {
            for (j, (p, next)) in pair[0].iter().zip(&pair[1]).enumerate() {
                let u = p.duration;
                let ends = [
                    ("position", p.q(u), next.q(0.0)),
                    ("velocity", p.qd(u), next.qd(0.0)),
                    ("acceleration", p.qdd(u), next.qdd(0.0)),
                ];
                for (what, end, start) in ends {
                    let gap = (end - start).abs();
                    if gap.is_nan() || gap > JOIN_TOLERANCE * (1.0 + end.abs()) {
                        return Err(Error::motion(
                            format!("segments {} and {}, joint {}", i + 1, i + 2, j + 1),
                            format!("{what} jumps from {end} to {start}"),
                            "a segment starts where the one before it ends",
                        ));
                    }
                }
            }
        }
        Ok(())
    }
}

fn segment_extrema(p: &Quintic, start: f64) -> JointExtrema {
    let later = |e: Extremum| Extremum {
        time: start + e.time,
        ..e
    };
    let [lowest, highest] = p.position_extrema();
    JointExtrema {
        lowest: later(lowest),
        highest: later(highest),
        velocity: later(p.velocity_extremum()),
        acceleration: later(p.acceleration_extremum()),
    }
}

fn ends(from: &PathPoint, to: &PathPoint) -> Vec<Ends> {
    (0..from.q.len())
        .map(|j| Ends {
            q: [from.q[j], to.q[j]],
            qd: [from.qd[j], to.qd[j]],
        })
        .collect()
}

fn check_points(points: &[PathPoint], n_joints: usize) -> Result<(), Error> {
    if points.len() < 2 {
        return Err(Error::motion(
            "path",
            format!("{} points", points.len()),
            "a path needs at least two",
        ));
    }
    for (i, point) in points.iter().enumerate() {
        let place = format!("point {}", i + 1);
        if point.q.len() != n_joints || point.qd.len() != n_joints {
            return Err(Error::motion(
                place,
                format!("{} positions, {} velocities", point.q.len(), point.qd.len()),
                "give one of each for every joint",
            ));
        }
        if let Some(bad) = point.q.iter().chain(&point.qd).find(|v| !v.is_finite()) {
            return Err(Error::motion(
                place,
                format!("{bad}"),
                "positions and velocities must be finite",
            ));
        }
    }
    Ok(())
}
