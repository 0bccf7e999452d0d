//! The way out along the chain: motions of the links and axes of the joints, as every link sees them.
//!
//! Decisions are taken once for all registers of a cell; what is between two decisions goes from memory to memory.

use crate::frame::{LinkPose, Rotation, shift_where};
use crate::kinematics::{LinkMotion, Screw, Travel, zero_motion};
use crate::lane::{Lane, V3, minus, read, splat, times, write, zero};
use crate::model::{Direction, KernelJoint, Model};
use crate::robot::JointKind;
use crate::wrench_map::WrenchMap;

/// Motions and axes of one sample or eight.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics<C> {
    pub(crate) n: usize,
    /// Sine and cosine, or travel, of every joint.
    travel: Vec<[C; 2]>,
    /// Motion of every link; its acceleration only where the link's frame stands apart from its joint's.
    pub(crate) motion: Vec<LinkMotion<C>>,
    /// Acceleration of every joint's origin, in the axes of the link below.
    origin: Vec<V3<C>>,
    /// The map of the link whose turn it is.
    pub(crate) map: WrenchMap<C>,
    /// At `link * n + d`: direction `d` of the link's path; the last one is z and stays.
    pub(crate) direction: Vec<V3<C>>,
    /// At `link * n + k`: speed of the link's origin per unit speed of the `k`-th joint on its path, if it turns; zero for
    /// the link's own.
    pub(crate) linear: Vec<V3<C>>,
}

impl<C: Copy> Kinematics<C> {
    /// `zero` and `one` in every sample.
    pub(crate) fn new(model: &Model, [zero, one]: [C; 2]) -> Self {
        let n = model.n_joints();
        Self {
            n,
            travel: vec![[zero; 2]; n],
            motion: vec![zero_motion(zero); n],
            origin: vec![[zero; 3]; n],
            map: WrenchMap::cells(zero),
            direction: vec![[zero, zero, one]; n * n],
            linear: vec![[zero; 3]; n * n],
        }
    }

    /// Axis of the `k`-th joint on the path of link `j`, of direction `d`, at the frame of the link.
    #[inline(always)]
    pub(crate) fn axis<T: Lane<Cell = C>>(
        &self,
        at: T::At,
        j: usize,
        d: &Direction,
        k: usize,
    ) -> Screw<T> {
        let direction = read(at, &self.direction[j * self.n + d.index]);
        match d.kind {
            JointKind::Revolute => Screw {
                angular: direction,
                linear: read(at, &self.linear[j * self.n + k]),
            },
            JointKind::Prismatic => Screw {
                angular: zero(at),
                linear: direction,
            },
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
        // The same lines for every step, compiled once for each simple one.
        let joint = &model.joints[j];
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let speeds = [T::read(at, qd), T::read(at, qdd)];
            let travel = Travel::read(at, joint.kind, &self.travel[j]);
            match (joint.step.rotation, travel) {
                (Rotation::Quarter, Travel::Turn { s, c }) => {
                    let step = (Rotation::Quarter, Travel::Turn { s, c });
                    self.carry_axes(at, model, j, step);
                    self.move_link(at, model, j, step, speeds);
                }
                (Rotation::None, Travel::Turn { s, c }) => {
                    let step = (Rotation::None, Travel::Turn { s, c });
                    self.carry_axes(at, model, j, step);
                    self.move_link(at, model, j, step, speeds);
                }
                step => {
                    self.carry_axes(at, model, j, step);
                    self.move_link(at, model, j, step, speeds);
                }
            }
        }
    }

    /// Motion of link `j` about its joint's frame, from that of the link below.
    #[inline(always)]
    fn move_link<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        step: (Rotation, Travel<T>),
        speeds: [T; 2],
    ) {
        let joint = &model.joints[j];
        let below = joint.parent.map(|p| (p, &model.joints[p]));
        // Each arm goes through to the end: where they met, all of a motion would have to be put down.
        match below {
            None => {
                let up = joint.step.rotation.inward(minus(model.gravity));
                let a = splat(at, up);
                let vertical = up[0] == 0.0 && up[1] == 0.0;
                let carried = LinkMotion {
                    w: zero(at),
                    wd: zero(at),
                    a: if vertical { a } else { step.1.inward(a) },
                };
                let motion = carried.moved(step.1, speeds[0], speeds[1]);
                self.put_map(at, model, j, &motion, WrenchMap::planar(&motion));
            }
            Some((p, KernelJoint { planar: true, .. })) => {
                let z = z_beyond(at, step);
                let below = &self.motion[p];
                let carried = LinkMotion {
                    w: times(T::read(at, &below.w[2]), z),
                    wd: times(T::read(at, &below.wd[2]), z),
                    a: into_joint(step, read(at, &self.origin[j])),
                };
                let motion = carried.moved(step.1, speeds[0], speeds[1]);
                if joint.planar {
                    self.put_map(at, model, j, &motion, WrenchMap::planar(&motion));
                } else {
                    self.put_map(at, model, j, &motion, WrenchMap::new(&motion));
                }
            }
            Some((p, _)) => {
                let below = &self.motion[p];
                let carried = LinkMotion {
                    w: into_joint(step, read(at, &below.w)),
                    wd: into_joint(step, read(at, &below.wd)),
                    a: into_joint(step, read(at, &self.origin[j])),
                };
                let motion = carried.moved(step.1, speeds[0], speeds[1]);
                self.put_map(at, model, j, &motion, WrenchMap::new(&motion));
            }
        }
    }

    /// Puts down what is known of link `j`, and what it does at the joints it carries.
    #[inline(always)]
    fn put_map<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        motion: &LinkMotion<T>,
        map: WrenchMap<T>,
    ) {
        map.write(at, &mut self.map);
        let known = &mut self.motion[j];
        write(at, motion.w, &mut known.w);
        write(at, motion.wd, &mut known.wd);
        if let LinkPose::Posed { .. } = model.joints[j].link {
            write(at, motion.a, &mut known.a);
        }
        for &c in &model.joints[j].children {
            let step = &model.joints[c].step;
            let a = map.acceleration_at(step.translation);
            write(at, a, &mut self.origin[c]);
        }
    }

    /// Carries the axes of the link below out to link `j`.
    #[inline(always)]
    fn carry_axes<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        step: (Rotation, Travel<T>),
    ) {
        let joint = &model.joints[j];
        let Some(p) = joint.parent else { return };
        let Some((own, others)) = model.joints[p].directions.split_last() else {
            return;
        };
        let (from, to) = (p * self.n, j * self.n);
        let (reaches, reach) = (joint.step.reaches, joint.step.translation);
        for d in others {
            let outside = read(at, &self.direction[from + d.index]);
            let direction = into_joint(step, outside);
            write(at, direction, &mut self.direction[to + d.index]);
            if d.kind == JointKind::Prismatic {
                continue;
            }
            for k in d.range.start..d.range.end {
                let inside = read(at, &self.linear[from + k]);
                let shifted = shift_where(reaches, reach, inside, outside);
                let linear = carried_speed(step, direction, shifted);
                write(at, linear, &mut self.linear[to + k]);
            }
        }
        // The axis of the joint below itself is z there, and stays z where the two are parallel.
        let stays = joint.directions.len() == others.len() + 1;
        let direction = if stays {
            z_axis(at)
        } else {
            z_beyond(at, step)
        };
        if !stays {
            write(at, direction, &mut self.direction[to + own.index]);
        }
        if own.kind == JointKind::Prismatic {
            return;
        }
        for k in own.range.start..own.range.end {
            let shifted = shift_about_z(reach, read(at, &self.linear[from + k]));
            let linear = carried_speed(step, direction, shifted);
            write(at, linear, &mut self.linear[to + k]);
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
