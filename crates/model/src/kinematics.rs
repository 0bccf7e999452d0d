//! The outward recursion: what every link of an arm feels of the motion of the joints below it.

use crate::frame::{Offset, shift};
use crate::lane::{Lane, V3, add, cross, minus, read, splat, write, zero};
use crate::model::{KernelJoint, Model};
use crate::robot::JointKind;

/// All zero, in memory.
pub(crate) fn zero_motion<C: Copy>(zero: C) -> LinkMotion<C> {
    LinkMotion {
        w: [zero; 3],
        wd: [zero; 3],
        a: [zero; 3],
    }
}

/// All zero, in memory.
pub(crate) fn zero_screw<C: Copy>(zero: C) -> Screw<C> {
    Screw {
        angular: [zero; 3],
        linear: [zero; 3],
    }
}

/// Motion of a link at its joint's frame, in the axes of that frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinkMotion<T> {
    /// Angular velocity ω, rad/s.
    pub(crate) w: V3<T>,
    /// Angular acceleration ω̇, rad/s².
    pub(crate) wd: V3<T>,
    /// Acceleration of the origin minus gravity, m/s².
    pub(crate) a: V3<T>,
}

/// Six-vector: angular part and linear part at the origin of the frame it is given in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Screw<T> {
    /// Angular part.
    pub(crate) angular: V3<T>,
    /// Linear part.
    pub(crate) linear: V3<T>,
}

/// The moving part of a joint: cosine and sine of a revolute one, travel of a prismatic one.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Travel<T> {
    Turn { s: T, c: T },
    Slide { d: T },
}

impl<T: Lane> Travel<T> {
    #[inline(always)]
    pub(crate) fn new(joint: &KernelJoint, q: T) -> Self {
        match joint.kind {
            JointKind::Revolute => {
                let Offset { quarters, rest } = joint.offset;
                let (s, c) = (q + q.like(rest)).sin_cos(quarters);
                Self::Turn { s, c }
            }
            JointKind::Prismatic => Self::Slide { d: q },
        }
    }

    /// From memory.
    #[inline(always)]
    pub(crate) fn read(at: T::At, kind: JointKind, cells: &[T::Cell; 2]) -> Self {
        match kind {
            JointKind::Revolute => Self::Turn {
                s: T::read(at, &cells[0]),
                c: T::read(at, &cells[1]),
            },
            JointKind::Prismatic => Self::Slide {
                d: T::read(at, &cells[0]),
            },
        }
    }

    /// To memory.
    #[inline(always)]
    pub(crate) fn write(self, at: T::At, cells: &mut [T::Cell; 2]) {
        match self {
            Self::Turn { s, c } => {
                s.write(at, &mut cells[0]);
                c.write(at, &mut cells[1]);
            }
            Self::Slide { d } => d.write(at, &mut cells[0]),
        }
    }

    /// `Rᵀ v`.
    #[inline(always)]
    pub(crate) fn inward(self, v: V3<T>) -> V3<T> {
        match self {
            Self::Turn { s, c } => [
                c.mul_add(v[0], s * v[1]),
                c.mul_add(v[1], -(s * v[0])),
                v[2],
            ],
            Self::Slide { .. } => v,
        }
    }

    /// A vector of the joint below's frame in this joint's.
    #[inline(always)]
    pub(crate) fn into_joint(self, joint: &KernelJoint, v: V3<T>) -> V3<T> {
        self.inward(joint.step.rotation.inward(v))
    }

    /// A vector of this joint's frame in that of the joint below.
    #[inline(always)]
    pub(crate) fn out_of_joint(self, joint: &KernelJoint, v: V3<T>) -> V3<T> {
        joint.step.rotation.outward(self.outward(v))
    }

    /// `R v`.
    #[inline(always)]
    pub(crate) fn outward(self, v: V3<T>) -> V3<T> {
        match self {
            Self::Turn { s, c } => [
                c.mul_add(v[0], -(s * v[1])),
                s.mul_add(v[0], c * v[1]),
                v[2],
            ],
            Self::Slide { .. } => v,
        }
    }
}

/// `ω̇ × p + ω × (ω × p)`: acceleration of a point of a turning frame.
#[inline(always)]
pub(crate) fn turning<T: Lane>(m: &LinkMotion<T>, p: V3<T>) -> V3<T> {
    add(cross(m.wd, p), cross(m.w, cross(m.w, p)))
}

impl<T: Lane> LinkMotion<T> {
    /// The base: at rest, accelerated against gravity.
    #[inline(always)]
    pub(crate) fn base(at: T::At, model: &Model) -> Self {
        Self {
            w: zero(at),
            wd: zero(at),
            a: minus(splat(at, model.gravity)),
        }
    }

    /// From memory.
    #[inline(always)]
    pub(crate) fn read(at: T::At, cells: &LinkMotion<T::Cell>) -> Self {
        Self {
            w: read(at, &cells.w),
            wd: read(at, &cells.wd),
            a: read(at, &cells.a),
        }
    }

    /// To memory.
    #[inline(always)]
    pub(crate) fn write(&self, at: T::At, cells: &mut LinkMotion<T::Cell>) {
        write(at, self.w, &mut cells.w);
        write(at, self.wd, &mut cells.wd);
        write(at, self.a, &mut cells.a);
    }

    /// Motion of the link a joint carries, from that of the link it stands on.
    #[inline(always)]
    pub(crate) fn beyond(&self, joint: &KernelJoint, travel: Travel<T>, qd: T, qdd: T) -> Self {
        self.carried(joint, travel).moved(travel, qd, qdd)
    }

    /// Motion of the link below at the joint, in the joint's turned axes; the joint itself held still.
    #[inline(always)]
    pub(crate) fn carried(&self, joint: &KernelJoint, travel: Travel<T>) -> Self {
        let mut m = *self;
        if joint.step.has_translation() {
            m.a = add(m.a, turning(self, joint.step.translation(self.w[0])));
        }
        m.turned(joint, travel)
    }

    /// In the axes of the joint's frame.
    #[inline(always)]
    pub(crate) fn turned(&self, joint: &KernelJoint, travel: Travel<T>) -> Self {
        Self {
            w: travel.into_joint(joint, self.w),
            wd: travel.into_joint(joint, self.wd),
            a: travel.into_joint(joint, self.a),
        }
    }

    /// The joint's own motion on top of what carries it.
    #[inline(always)]
    pub(crate) fn moved(self, travel: Travel<T>, qd: T, qdd: T) -> Self {
        let mut m = self;
        match travel {
            Travel::Turn { .. } => {
                // ω × z q̇, then the joint's own motion about z.
                m.wd[0] = m.w[1].mul_add(qd, m.wd[0]);
                m.wd[1] = (-m.w[0]).mul_add(qd, m.wd[1]);
                m.wd[2] = m.wd[2] + qdd;
                m.w[2] = m.w[2] + qd;
            }
            Travel::Slide { d } => {
                let z = d.like(0.0);
                let moved = turning(&m, [z, z, d]);
                let coriolis = qd + qd;
                m.a = add(m.a, moved);
                m.a[0] = m.w[1].mul_add(coriolis, m.a[0]);
                m.a[1] = (-m.w[0]).mul_add(coriolis, m.a[1]);
                m.a[2] = m.a[2] + qdd;
            }
        }
        m
    }
}

impl<T: Lane> Screw<T> {
    #[inline(always)]
    pub(crate) fn zero(at: T::At) -> Self {
        Self {
            angular: zero(at),
            linear: zero(at),
        }
    }

    /// From memory.
    #[inline(always)]
    pub(crate) fn read(at: T::At, cells: &Screw<T::Cell>) -> Self {
        Self {
            angular: read(at, &cells.angular),
            linear: read(at, &cells.linear),
        }
    }

    /// To memory.
    #[inline(always)]
    pub(crate) fn write(&self, at: T::At, cells: &mut Screw<T::Cell>) {
        write(at, self.angular, &mut cells.angular);
        write(at, self.linear, &mut cells.linear);
    }

    /// A motion (velocity-like) of the link below, in the frame of the joint.
    #[inline(always)]
    pub(crate) fn beyond(&self, joint: &KernelJoint, travel: Travel<T>) -> Self {
        let shifted = shift(joint.step.translation, self.linear, self.angular);
        let angular = travel.into_joint(joint, self.angular);
        let mut linear = travel.into_joint(joint, shifted);
        if let Travel::Slide { d } = travel {
            linear[0] = angular[1].mul_add(d, linear[0]);
            linear[1] = (-angular[0]).mul_add(d, linear[1]);
        }
        Self { angular, linear }
    }

    /// A wrench (moment, force) at the joint, in the frame of the joint below.
    #[inline(always)]
    pub(crate) fn wrench_below(&self, joint: &KernelJoint, travel: Travel<T>) -> Self {
        let (mut moment, force) = (self.angular, self.linear);
        if let Travel::Slide { d } = travel {
            moment[0] = (-force[1]).mul_add(d, moment[0]);
            moment[1] = force[0].mul_add(d, moment[1]);
        }
        let force = travel.out_of_joint(joint, force);
        let moment = travel.out_of_joint(joint, moment);
        // n + p × f.
        Self {
            angular: shift(joint.step.translation, moment, minus(force)),
            linear: force,
        }
    }

    /// Torque or force of a wrench along the joint's own axis.
    #[inline(always)]
    pub(crate) fn along_axis(&self, kind: JointKind) -> T {
        match kind {
            JointKind::Revolute => self.angular[2],
            JointKind::Prismatic => self.linear[2],
        }
    }

    /// A speed of the joint on top of this motion.
    #[inline(always)]
    pub(crate) fn plus_axis(mut self, kind: JointKind, speed: T) -> Self {
        match kind {
            JointKind::Revolute => self.angular[2] = self.angular[2] + speed,
            JointKind::Prismatic => self.linear[2] = self.linear[2] + speed,
        }
        self
    }
}
