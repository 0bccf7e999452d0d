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
    /// The axes on the link's path: of each [`Direction`] the direction itself and then, joint by joint, the speed of the
    /// link's origin per unit speed of the joint, if that turns. The link's own direction is z and stays; the speed of its
    /// own joint is zero and stays.
    pub(crate) axes: Vec<V3<C>>,
}

impl<C: Copy> Kinematics<C> {
    /// `zero` and `one` in every sample.
    pub(crate) fn new(model: &Model, [zero, one]: [C; 2]) -> Self {
        let of_link = |joint: &KernelJoint| {
            let mut axes = vec![[zero; 3]; joint.directions.len() + joint.path.len()];
            for d in &joint.directions {
                axes[d.place] = [zero, zero, one];
            }
            LinkAxes {
                w: [zero; 3],
                map: WrenchMap::cells(zero),
                axes,
            }
        };
        Self {
            travel: vec![[zero; 2]; model.n_joints()],
            links: model.joints.iter().map(of_link).collect(),
            posed: WrenchMap::cells(zero),
        }
    }

    /// Sine and cosine of joint `j`.
    #[inline(always)]
    pub(crate) fn turn_joint<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        q: &C,
    ) {
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            Travel::new(&model.joints[j], T::read(at, q)).write(at, &mut self.travel[j]);
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
        let direction = read(at, &self.axes[d.place]);
        match d.kind {
            JointKind::Revolute => Screw {
                angular: direction,
                linear: read(at, &self.axes[d.place + 1 + k - d.range.start]),
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
        let Fixed {
            reaches,
            translation: reach,
            ..
        } = self.joint.step;
        // The link below has the same axes in the same order; its own come last.
        let (mut from, mut to) = (self.below.axes.as_slice(), here.axes.as_mut_slice());
        for d in others {
            let n = 1 + d.range.end - d.range.start;
            let (Some([outside, inside @ ..]), Some([turned, out @ ..])) =
                (from.split_off(..n), to.split_off_mut(..n))
            else {
                return;
            };
            let outside = read(at, outside);
            let direction = into_joint(step, outside);
            write(at, direction, turned);
            if d.kind == JointKind::Prismatic {
                continue;
            }
            for (inside, out) in inside.iter().zip(out) {
                let shifted = shift_where(reaches, reach, read(at, inside), outside);
                write(at, carried_speed(step, direction, shifted), out);
            }
        }
        let ([_, inside @ ..], [turned, out @ ..]) = (from, to) else {
            return;
        };
        // The axis of the joint below itself is z there, and stays z where the two are parallel.
        let direction = if self.joint.directions.len() == others.len() + 1 {
            z_axis(at)
        } else {
            let direction = z_beyond(at, step);
            write(at, direction, turned);
            direction
        };
        if own.kind == JointKind::Prismatic {
            return;
        }
        for (inside, out) in inside.iter().zip(out) {
            let shifted = shift_about_z(reach, read(at, inside));
            write(at, carried_speed(step, direction, shifted), out);
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
