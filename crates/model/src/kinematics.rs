//! The outward recursion: what every link of an arm feels of the motion of the joints below it.

use crate::lane::{Lane, V3, add, cross, zero};
use crate::model::{KernelJoint, Model};
use crate::robot::JointKind;

/// Motion of a link's frame, in its own axes.
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
    pub(crate) fn new(kind: JointKind, q: T) -> Self {
        match kind {
            JointKind::Revolute => {
                let (s, c) = q.sin_cos();
                Self::Turn { s, c }
            }
            JointKind::Prismatic => Self::Slide { d: q },
        }
    }

    /// `Rᵀ v`.
    #[inline(always)]
    pub(crate) fn to_inner(self, v: V3<T>) -> V3<T> {
        match self {
            Self::Turn { s, c } => [
                c.mul_add(v[0], s * v[1]),
                c.mul_add(v[1], -(s * v[0])),
                v[2],
            ],
            Self::Slide { .. } => v,
        }
    }

    /// `R v`.
    #[inline(always)]
    pub(crate) fn to_outer(self, v: V3<T>) -> V3<T> {
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
    pub(crate) fn base(model: &Model) -> Self {
        Self {
            w: zero(),
            wd: zero(),
            a: model.gravity.map(|g| T::splat(-g)),
        }
    }

    /// Motion of the link a joint carries, from that of the link it stands on.
    #[inline(always)]
    pub(crate) fn beyond(&self, joint: &KernelJoint, travel: Travel<T>, qd: T, qdd: T) -> Self {
        self.carried(joint, travel).moved(joint, travel, qd, qdd)
    }

    /// Motion of the link below at the joint, in the joint's turned axes; the joint itself held still.
    #[inline(always)]
    pub(crate) fn carried(&self, joint: &KernelJoint, travel: Travel<T>) -> Self {
        let mut a = self.a;
        if joint.before.has_translation() {
            a = add(a, turning(self, joint.before.translation()));
        }
        let inner = |v| travel.to_inner(joint.before.to_inner(v));
        Self {
            w: inner(self.w),
            wd: inner(self.wd),
            a: inner(a),
        }
    }

    /// The joint's own motion on top of what carries it, at the link's frame.
    #[inline(always)]
    pub(crate) fn moved(self, joint: &KernelJoint, travel: Travel<T>, qd: T, qdd: T) -> Self {
        let mut m = self;
        match travel {
            Travel::Turn { .. } => {
                // ω × z q̇, then the joint's own motion about z.
                m.wd[0] = m.w[1].mul_add(qd, m.wd[0]);
                m.wd[1] = m.w[0].mul_add(-qd, m.wd[1]);
                m.wd[2] = m.wd[2] + qdd;
                m.w[2] = m.w[2] + qd;
            }
            Travel::Slide { d } => {
                let z = T::splat(0.0);
                let moved = turning(&m, [z, z, d]);
                let coriolis = qd + qd;
                m.a = add(m.a, moved);
                m.a[0] = m.w[1].mul_add(coriolis, m.a[0]);
                m.a[1] = m.w[0].mul_add(-coriolis, m.a[1]);
                m.a[2] = m.a[2] + qdd;
            }
        }
        if joint.after.has_translation() {
            m.a = add(m.a, turning(&m, joint.after.translation()));
        }
        m.map(|v| joint.after.to_inner(v))
    }

    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(V3<T>) -> V3<T>) -> Self {
        Self {
            w: f(self.w),
            wd: f(self.wd),
            a: f(self.a),
        }
    }
}

impl<T: Lane> Screw<T> {
    /// The joint's own axis in the frame of its link.
    #[inline(always)]
    pub(crate) fn axis(joint: &KernelJoint) -> Self {
        let (o, i) = (T::splat(0.0), T::splat(1.0));
        let z = [o, o, i];
        let (angular, linear) = match joint.kind {
            JointKind::Revolute => (z, joint.after.shift(zero(), z)),
            JointKind::Prismatic => (zero(), z),
        };
        Self {
            angular: joint.after.to_inner(angular),
            linear: joint.after.to_inner(linear),
        }
    }

    /// A motion (velocity-like) of the link below, in the frame of the link the joint carries.
    #[inline(always)]
    pub(crate) fn beyond(&self, joint: &KernelJoint, travel: Travel<T>) -> Self {
        let shifted = joint.before.shift(self.linear, self.angular);
        let inner = |v| travel.to_inner(joint.before.to_inner(v));
        let angular = inner(self.angular);
        let mut linear = inner(shifted);
        if let Travel::Slide { d } = travel {
            linear[0] = angular[1].mul_add(d, linear[0]);
            linear[1] = angular[0].mul_add(-d, linear[1]);
        }
        Self {
            angular: joint.after.to_inner(angular),
            linear: joint.after.to_inner(joint.after.shift(linear, angular)),
        }
    }

    /// A wrench (moment, force) at the link the joint carries, at the link below.
    #[inline(always)]
    pub(crate) fn wrench_below(&self, joint: &KernelJoint, travel: Travel<T>) -> Self {
        let force = joint.after.to_outer(self.linear);
        let moment = arm(&joint.after, joint.after.to_outer(self.angular), force);
        let (mut moment, force) = (moment, force);
        if let Travel::Slide { d } = travel {
            moment[0] = force[1].mul_add(-d, moment[0]);
            moment[1] = force[0].mul_add(d, moment[1]);
        }
        let outer = |v| joint.before.to_outer(travel.to_outer(v));
        let force = outer(force);
        Self {
            angular: arm(&joint.before, outer(moment), force),
            linear: force,
        }
    }
}

/// `n + p × f`.
#[inline(always)]
fn arm<T: Lane>(pose: &crate::model::FixedPose, n: V3<T>, f: V3<T>) -> V3<T> {
    let minus = [-f[0], -f[1], -f[2]];
    pose.shift(n, minus)
}
