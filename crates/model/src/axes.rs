//! The way out along the chain: motions of the links and axes of the joints, as every link sees them.
//!
//! Decisions are taken once for all registers of a cell; what is between two decisions goes from memory to memory.

use crate::frame::{Fixed, Rotation, shift_where};
use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{Lane, V3, minus, read, splat, times, write, zero};
use crate::model::{Direction, KernelJoint, Model};
use crate::robot::JointKind;
use crate::wrench_map::WrenchMap;

/// Motions and axes of one sample or eight.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics<C> {
    /// Sine and cosine, or travel, of every joint.
    travel: Vec<[C; 2]>,
    pub(crate) links: Vec<LinkAxes<C>>,
    /// The map of a link at its own frame, where that stands apart from its joint's.
    pub(crate) posed: WrenchMap<C>,
}

/// What is known of a link at its joint's frame, in the axes of that frame.
#[derive(Debug, Clone)]
pub(crate) struct LinkAxes<C> {
    /// Angular velocity, rad/s.
    pub(crate) w: V3<C>,
    pub(crate) map: WrenchMap<C>,
    /// Directions of the axes on the link's path; the last one is z and stays.
    pub(crate) direction: Vec<V3<C>>,
    /// Speed of the link's origin per unit speed of each joint on its path, if that turns; zero for the link's own.
    pub(crate) linear: Vec<V3<C>>,
}

impl<C: Copy> Kinematics<C> {
    /// `zero` and `one` in every sample.
    pub(crate) fn new(model: &Model, [zero, one]: [C; 2]) -> Self {
        let of_link = |joint: &KernelJoint| LinkAxes {
            w: [zero; 3],
            map: WrenchMap::cells(zero),
            direction: vec![[zero, zero, one]; joint.directions.len()],
            linear: vec![[zero; 3]; joint.path.len()],
        };
        Self {
            travel: vec![[zero; 2]; model.n_joints()],
            links: model.joints.iter().map(of_link).collect(),
            posed: WrenchMap::cells(zero),
        }
    }

    /// Sines and cosines of all joints: side by side, for they wait for nothing but themselves.
    #[inline(always)]
    pub(crate) fn turn_joints<T: Lane<Cell = C>>(&mut self, at: T::At, model: &Model, q: &[C]) {
        for ((joint, q), travel) in model.joints.iter().zip(q).zip(&mut self.travel) {
            for part in 0..T::PARTS {
                let at = T::part(at, part);
                Travel::new(joint, T::read(at, q)).write(at, travel);
            }
        }
    }

    /// Takes link `j` from the link below: its motion, its map and the axes on its path.
    #[inline(always)]
    pub(crate) fn go_out<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        [qd, qdd]: [&C; 2],
    ) {
        let joint = &model.joints[j];
        let travel = &self.travel[j];
        let (before, rest) = self.links.split_at_mut(j);
        let Some(here) = rest.first_mut() else { return };
        let below = joint.parent.map(|p| (&model.joints[p], &before[p]));
        // The same lines for every step, compiled once for each simple one.
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let speeds = [T::read(at, qd), T::read(at, qdd)];
            let travel = Travel::read(at, joint.kind, travel);
            let Some((parent, below)) = below else {
                here.start(at, model.gravity, joint, travel, speeds);
                continue;
            };
            let link = Outward {
                joint,
                parent,
                below,
            };
            match (joint.step.rotation, travel) {
                (Rotation::Quarter, Travel::Turn { s, c }) => {
                    let step = (Rotation::Quarter, Travel::Turn { s, c });
                    link.carry_axes(at, step, here);
                    link.move_link(at, step, speeds, here);
                }
                (Rotation::None, Travel::Turn { s, c }) => {
                    let step = (Rotation::None, Travel::Turn { s, c });
                    link.carry_axes(at, step, here);
                    link.move_link(at, step, speeds, here);
                }
                step => {
                    link.carry_axes(at, step, here);
                    link.move_link(at, step, speeds, here);
                }
            }
        }
    }
}

impl<C: Copy> LinkAxes<C> {
    /// Axis of the `k`-th joint on the link's path, of direction `d`, at the frame of its joint.
    #[inline(always)]
    pub(crate) fn axis<T: Lane<Cell = C>>(&self, at: T::At, d: &Direction, k: usize) -> Screw<T> {
        let direction = read(at, &self.direction[d.index]);
        match d.kind {
            JointKind::Revolute => Screw {
                angular: direction,
                linear: read(at, &self.linear[k]),
            },
            JointKind::Prismatic => Screw {
                angular: zero(at),
                linear: direction,
            },
        }
    }

    /// Motion of a link on the base.
    #[inline(always)]
    fn start<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        gravity: [f64; 3],
        joint: &KernelJoint,
        travel: Travel<T>,
        [qd, qdd]: [T; 2],
    ) {
        let up = joint.step.rotation.inward(minus(gravity));
        let a = splat(at, up);
        let vertical = up[0] == 0.0 && up[1] == 0.0;
        let carried = LinkMotion {
            w: zero(at),
            wd: zero(at),
            a: if vertical { a } else { travel.inward(a) },
        };
        let motion = carried.moved(travel, qd, qdd);
        self.put(at, &motion, &WrenchMap::planar(&motion));
    }

    /// Puts down what is known of the link.
    #[inline(always)]
    fn put<T: Lane<Cell = C>>(&mut self, at: T::At, motion: &LinkMotion<T>, map: &WrenchMap<T>) {
        write(at, motion.w, &mut self.w);
        map.write(at, &mut self.map);
    }
}

/// A joint, the one it stands on, and what is known of the link between.
struct Outward<'a, C> {
    joint: &'a KernelJoint,
    parent: &'a KernelJoint,
    below: &'a LinkAxes<C>,
}

impl<C: Copy> Outward<'_, C> {
    /// Motion of the link about its joint's frame.
    #[inline(always)]
    fn move_link<T: Lane<Cell = C>>(
        &self,
        at: T::At,
        step: (Rotation, Travel<T>),
        [qd, qdd]: [T; 2],
        here: &mut LinkAxes<C>,
    ) {
        let Fixed {
            reaches,
            translation,
            ..
        } = self.joint.step;
        let below = self.below;
        let origin = below.map.acceleration_where(at, reaches, translation);
        // Each arm goes through to the end: where they met, all of a motion would have to be put down.
        if self.parent.planar {
            let z = z_beyond(at, step);
            let carried = LinkMotion {
                w: times(T::read(at, &below.w[2]), z),
                wd: times(T::read(at, &below.map.wd[2]), z),
                a: into_joint(step, origin),
            };
            let motion = carried.moved(step.1, qd, qdd);
            if self.joint.planar {
                here.put(at, &motion, &WrenchMap::planar(&motion));
            } else {
                here.put(at, &motion, &WrenchMap::new(&motion));
            }
        } else {
            let carried = LinkMotion {
                w: into_joint(step, read(at, &below.w)),
                wd: into_joint(step, read(at, &below.map.wd)),
                a: into_joint(step, origin),
            };
            let motion = carried.moved(step.1, qd, qdd);
            here.put(at, &motion, &WrenchMap::new(&motion));
        }
    }

    /// Carries the axes of the link below out to the link.
    #[inline(always)]
    fn carry_axes<T: Lane<Cell = C>>(
        &self,
        at: T::At,
        step: (Rotation, Travel<T>),
        here: &mut LinkAxes<C>,
    ) {
        let Some((own, others)) = self.parent.directions.split_last() else {
            return;
        };
        let reach = self.joint.step.translation;
        // Side by side, not by index: where each of them ends is all there is to check.
        let mut from = self.below.linear.iter();
        let mut to = here.linear.iter_mut();
        let mut turned = here.direction.iter_mut();
        let mut straight = self.below.direction.iter();
        for d in others {
            let (Some(outside), Some(turned)) = (straight.next(), turned.next()) else {
                return;
            };
            let outside = read(at, outside);
            let direction = into_joint(step, outside);
            write(at, direction, turned);
            for _ in d.range.start..d.range.end {
                let (Some(from), Some(to)) = (from.next(), to.next()) else {
                    return;
                };
                if d.kind == JointKind::Prismatic {
                    continue;
                }
                let inside = read(at, from);
                let shifted = shift_where(self.joint.step.reaches, reach, inside, outside);
                write(at, carried_speed(step, direction, shifted), to);
            }
        }
        // The axis of the joint below itself is z there, and stays z where the two are parallel.
        let direction = if self.joint.directions.len() == others.len() + 1 {
            z_axis(at)
        } else {
            let direction = z_beyond(at, step);
            let Some(turned) = turned.next() else { return };
            write(at, direction, turned);
            direction
        };
        if own.kind == JointKind::Prismatic {
            return;
        }
        // The link's own joint has no speed there.
        while let (Some(from), Some(to)) = (from.next(), to.next()) {
            let shifted = shift_about_z(reach, read(at, from));
            write(at, carried_speed(step, direction, shifted), to);
        }
    }
}

/// A vector of the joint below's frame in a joint's.
#[inline(always)]
fn into_joint<T: Lane>((rotation, travel): (Rotation, Travel<T>), v: V3<T>) -> V3<T> {
    travel.inward(rotation.inward(v))
}

/// A speed at the joint's frame, still in the axes of the link below, at the link's own frame in its axes.
#[inline(always)]
fn carried_speed<T: Lane>(step: (Rotation, Travel<T>), direction: V3<T>, v: V3<T>) -> V3<T> {
    let mut linear = into_joint(step, v);
    if let Travel::Slide { d } = step.1 {
        linear[0] = direction[1].mul_add(d, linear[0]);
        linear[1] = (-direction[0]).mul_add(d, linear[1]);
    }
    linear
}

#[inline(always)]
fn z_axis<T: Lane>(at: T::At) -> V3<T> {
    splat(at, [0.0, 0.0, 1.0])
}

/// The axis of the joint below in the frame of a joint.
#[inline(always)]
fn z_beyond<T: Lane>(at: T::At, step: (Rotation, Travel<T>)) -> V3<T> {
    match step {
        (Rotation::Quarter, Travel::Turn { s, c }) => [s, c, s.like(0.0)],
        _ => into_joint(step, z_axis(at)),
    }
}

/// `z × p + v`.
#[inline(always)]
fn shift_about_z<T: Lane>(p: [f64; 3], v: V3<T>) -> V3<T> {
    [v[0] - v[0].like(p[1]), v[1] + v[1].like(p[0]), v[2]]
}
