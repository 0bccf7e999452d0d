//! How near the bodies of a robot come to each other and to the ground.

use crate::Error;
use crate::segments::{nearest, point};
use idim_model::{Capsule, JointKind, JointStates, Pose, Robot, random_states};
use nalgebra::Vector3;

/// One thing that must keep clear of another: a capsule of the list, or the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Body {
    Capsule(usize),
    Ground,
}

/// The distances a motion has to keep: which bodies, and how far.
///
/// Bodies of one link, and of links a joint connects, are not looked at; neither are pairs the robot's file lets touch.
/// Where only two joints lie between two links and they are too near in every position tried, their capsules were drawn
/// too wide to tell anything, and they are left out as well ([`always_near`](Self::always_near)).
#[derive(Debug, Clone, PartialEq)]
pub struct Clearance {
    robot: Robot,
    /// Of the base, then of the links; a parent's before its children's.
    capsules: Vec<(Option<usize>, Capsule)>,
    pairs: Vec<[Body; 2]>,
    /// Joints each pair's distance depends on.
    movers: Vec<[Vec<usize>; 2]>,
    ground: f64,
    smallest: f64,
    always_near: Vec<[String; 2]>,
}

/// Pairs that more joints move, and those with something that stands still, are never left out.
const NEIGHBOURS: usize = 2;
/// Positions a pair is tried in before it counts as always near.
const TRIED: usize = 300;
/// The draw of these positions: the same on every run.
const SEED: u64 = 1;

/// Places of all bodies at one position of the joints.
pub(crate) struct Placed {
    base_from_link: Vec<Pose>,
    /// Of each joint's motion, base frame.
    axis: Vec<Vector3<f64>>,
    origin: Vec<Vector3<f64>>,
    ends: Vec<[Vector3<f64>; 2]>,
}

impl Clearance {
    /// `smallest`: the distance to keep between surfaces, m; typical 0.02. `None` where the robot has no shapes, or none
    /// of them can meet.
    ///
    /// # Errors
    /// A distance that is below zero or not finite; names of links that may touch which the robot does not have.
    pub fn new(robot: &Robot, smallest: f64) -> Result<Option<Self>, Error> {
        if !(smallest >= 0.0 && smallest.is_finite()) {
            return Err(Error::input(
                "clearance",
                format!("{smallest}"),
                "give a distance in m, not below zero",
            ));
        }
        let shapes = robot.shapes();
        let mut capsules: Vec<_> = shapes
            .capsules
            .iter()
            .map(|c| (c.link, c.capsule))
            .collect();
        capsules.sort_by_key(|c| c.0);
        let mut new = Self {
            robot: robot.clone(),
            capsules,
            pairs: Vec::new(),
            movers: Vec::new(),
            ground: shapes.ground.unwrap_or(f64::NEG_INFINITY),
            smallest,
            always_near: Vec::new(),
        };
        let n = new.capsules.len();
        for i in 0..n {
            for k in i + 1..n {
                new.consider([Body::Capsule(i), Body::Capsule(k)]);
            }
            if shapes.ground.is_some() {
                new.consider([Body::Capsule(i), Body::Ground]);
            }
        }
        new.leave_out_always_near();
        Ok((!new.pairs.is_empty()).then_some(new))
    }

    /// Pairs that were left out because they are too near in every position tried.
    pub fn always_near(&self) -> &[[String; 2]] {
        &self.always_near
    }

    /// The distance to keep, m.
    pub fn smallest(&self) -> f64 {
        self.smallest
    }

    pub(crate) fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Number of pairs looked at.
    pub fn n_pairs(&self) -> usize {
        self.pairs.len()
    }

    /// Names of the links of a pair.
    pub fn names(&self, pair: usize) -> [String; 2] {
        self.pairs[pair].map(|b| self.name(b))
    }

    fn link(&self, body: Body) -> Option<usize> {
        match body {
            Body::Capsule(c) => self.capsules[c].0,
            Body::Ground => None,
        }
    }

    fn name(&self, body: Body) -> String {
        match (body, self.link(body)) {
            (Body::Ground, _) => "ground".into(),
            (_, None) => "base".into(),
            (_, Some(link)) => self.robot.links()[link].name.clone(),
        }
    }

    fn consider(&mut self, pair: [Body; 2]) {
        let [a, b] = pair.map(|body| self.link(body));
        let below = |link: Option<usize>| link.map(|l| self.robot.joints()[l].parent);
        if a == b || below(a) == Some(b) || below(b) == Some(a) {
            return;
        }
        let names = pair.map(|body| self.name(body));
        let may = self.robot.shapes().may_touch.iter();
        for [p, q] in may {
            if [p, q] == [&names[0], &names[1]] || [q, p] == [&names[0], &names[1]] {
                return;
            }
        }
        let (mut from_a, mut from_b) = (self.path(a), self.path(b));
        // What moves both moves neither against the other.
        let shared = from_a
            .iter()
            .zip(&from_b)
            .take_while(|(x, y)| x == y)
            .count();
        from_a.drain(..shared);
        from_b.drain(..shared);
        self.pairs.push(pair);
        self.movers.push([from_a, from_b]);
    }

    /// Joints from the base to a link, itself included.
    fn path(&self, link: Option<usize>) -> Vec<usize> {
        let mut path = Vec::new();
        let mut here = link;
        while let Some(j) = here {
            path.push(j);
            here = self.robot.joints()[j].parent;
        }
        path.reverse();
        path
    }

    fn leave_out_always_near(&mut self) {
        let states = random_states(&self.robot, TRIED, SEED);
        let mut far = vec![false; self.pairs.len()];
        for k in 0..TRIED {
            let placed = self.place(&states.state(k).q);
            for (pair, far) in far.iter_mut().enumerate() {
                *far |= self.distance(&placed, pair) > self.smallest;
            }
        }
        let all = std::mem::take(&mut self.pairs).into_iter();
        let movers = std::mem::take(&mut self.movers);
        for ((pair, movers), far) in all.zip(movers).zip(far) {
            let stands = pair.iter().any(|b| self.link(*b).is_none());
            if far || stands || movers[0].len() + movers[1].len() > NEIGHBOURS {
                self.pairs.push(pair);
                self.movers.push(movers);
            } else {
                let names = pair.map(|body| self.name(body));
                if !self.always_near.contains(&names) {
                    self.always_near.push(names);
                }
            }
        }
    }

    /// Where everything is at these positions of the joints.
    pub(crate) fn place(&self, q: &[f64]) -> Placed {
        let joints = self.robot.joints();
        let mut placed = Placed {
            base_from_link: Vec::with_capacity(q.len()),
            axis: Vec::with_capacity(q.len()),
            origin: Vec::with_capacity(q.len()),
            ends: Vec::with_capacity(self.capsules.len()),
        };
        for (joint, q) in joints.iter().zip(q) {
            let below = joint
                .parent
                .map_or_else(Pose::identity, |p| placed.base_from_link[p]);
            let joint_frame = below * joint.parent_from_joint;
            placed.axis.push(joint_frame.rotation * joint.axis);
            placed.origin.push(joint_frame.translation);
            placed.base_from_link.push(below * joint.pose(*q));
        }
        for (link, capsule) in &self.capsules {
            placed.ends.push(match link {
                Some(l) => capsule.expressed_in(&placed.base_from_link[*l]).ends,
                None => capsule.ends,
            });
        }
        placed
    }

    /// Distance between the surfaces of a pair, m; below zero where they overlap.
    pub(crate) fn distance(&self, placed: &Placed, pair: usize) -> f64 {
        self.nearest_points(placed, pair).0
    }

    /// Distance, the nearest points of the two axes, and the unit vector from the second to the first.
    fn nearest_points(
        &self,
        placed: &Placed,
        pair: usize,
    ) -> (f64, [Vector3<f64>; 2], Vector3<f64>) {
        let [a, b] = self.pairs[pair];
        let Body::Capsule(a) = a else {
            return (f64::INFINITY, [Vector3::zeros(); 2], Vector3::zeros());
        };
        let (first, radius) = (&placed.ends[a], self.capsules[a].1.radius);
        let Body::Capsule(b) = b else {
            let low = if first[0].z <= first[1].z {
                first[0]
            } else {
                first[1]
            };
            let below = Vector3::new(low.x, low.y, self.ground);
            return (low.z - self.ground - radius, [low, below], Vector3::z());
        };
        let second = &placed.ends[b];
        let [s, t] = nearest(first, second);
        let (p, q) = (point(first, s), point(second, t));
        let apart = p - q;
        let length = apart.norm();
        let normal = if length > 0.0 {
            apart / length
        } else {
            // The axes cross: any way across both leads out.
            let across = (first[1] - first[0]).cross(&(second[1] - second[0]));
            across.try_normalize(0.0).unwrap_or_else(Vector3::z)
        };
        (length - radius - self.capsules[b].1.radius, [p, q], normal)
    }

    /// Distance of a pair, and `slope(distance)` times its gradient added to one number a joint of `gradient`.
    pub(crate) fn add_gradient(
        &self,
        placed: &Placed,
        pair: usize,
        slope: f64,
        mut add: impl FnMut(usize, f64),
    ) {
        let (_, points, normal) = self.nearest_points(placed, pair);
        for ((movers, point), sign) in self.movers[pair].iter().zip(points).zip([1.0, -1.0]) {
            for &j in movers {
                let axis = placed.axis[j];
                let speed = match self.robot.joints()[j].kind {
                    JointKind::Revolute => axis.cross(&(point - placed.origin[j])),
                    JointKind::Prismatic => axis,
                };
                add(j, slope * sign * normal.dot(&speed));
            }
        }
    }

    /// For each pair: joints and how far a unit of each can change the distance at most, m (m/m).
    ///
    /// `travel`: largest coordinate of each joint that slides.
    pub(crate) fn rates(&self, travel: &[f64]) -> Vec<Vec<(usize, f64)>> {
        let rates_of = |(pair, movers): (&[Body; 2], &[Vec<usize>; 2])| {
            let mut rates = Vec::new();
            for (body, movers) in pair.iter().zip(movers) {
                let Body::Capsule(c) = *body else { continue };
                let (Some(link), capsule) = self.capsules[c] else {
                    continue;
                };
                let seen = capsule.expressed_in(&self.robot.joints()[link].joint_from_link);
                // From the joint's axis to the far end, each step at its largest.
                let mut reach = seen.ends[0].norm().max(seen.ends[1].norm());
                for &j in movers.iter().rev() {
                    let joint = &self.robot.joints()[j];
                    let slides = joint.kind == JointKind::Prismatic;
                    if slides {
                        reach += travel[j] + joint.offset.abs();
                    }
                    rates.push((j, if slides { 1.0 } else { reach }));
                    let below = joint
                        .parent
                        .map_or_else(Pose::identity, |p| self.robot.joints()[p].joint_from_link);
                    reach += (below * joint.parent_from_joint).translation.norm();
                }
            }
            rates
        };
        self.pairs.iter().zip(&self.movers).map(rates_of).collect()
    }

    /// The nearest pair at every sample and how near it is.
    pub fn nearest(&self, states: &JointStates) -> Vec<(usize, f64)> {
        let of_sample = |k| {
            let placed = self.place(&states.state(k).q);
            let pairs = 0..self.pairs.len();
            let distances = pairs.map(|pair| (pair, self.distance(&placed, pair)));
            let smaller = |a: (usize, f64), b: (usize, f64)| if b.1 < a.1 { b } else { a };
            distances.fold((0, f64::INFINITY), smaller)
        };
        (0..states.n_samples()).map(of_sample).collect()
    }
}
