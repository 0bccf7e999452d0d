//! The outward recursion run backwards: derivatives handed from a link to the joint that carries it and to the link below.
//!
//! A bar marks the derivative of one scalar with respect to a quantity; it has that quantity's type.

use crate::frame::outer;
use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{Lane, V3, add, cross, dot, like, times, zero};
use crate::model::KernelJoint;
use crate::newton_euler::tensor_times;

/// Derivative with respect to a joint's position, velocity and acceleration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointBar<T> {
    pub(crate) q: T,
    pub(crate) qd: T,
    pub(crate) qdd: T,
}

impl<T: Lane> JointBar<T> {
    #[inline(always)]
    pub(crate) fn zero(at: T::At) -> Self {
        let q = T::splat(at, 0.0);
        Self { q, qd: q, qdd: q }
    }

    /// From memory.
    #[inline(always)]
    pub(crate) fn read(at: T::At, cells: &JointBar<T::Cell>) -> Self {
        Self {
            q: T::read(at, &cells.q),
            qd: T::read(at, &cells.qd),
            qdd: T::read(at, &cells.qdd),
        }
    }

    /// To memory.
    #[inline(always)]
    pub(crate) fn write(&self, at: T::At, cells: &mut JointBar<T::Cell>) {
        self.q.write(at, &mut cells.q);
        self.qd.write(at, &mut cells.qd);
        self.qdd.write(at, &mut cells.qdd);
    }
}

impl<T: Lane> LinkMotion<T> {
    #[inline(always)]
    pub(crate) fn zero(at: T::At) -> Self {
        Self {
            w: zero(at),
            wd: zero(at),
            a: zero(at),
        }
    }

    #[inline(always)]
    pub(crate) fn plus(&self, o: &Self) -> Self {
        Self {
            w: add(self.w, o.w),
            wd: add(self.wd, o.wd),
            a: add(self.a, o.a),
        }
    }
}

/// `x̄` of `ā · (ω̇ × p + ω × (ω × p))`, added to the bars of ω and ω̇.
#[inline(always)]
fn turning_bar<T: Lane>(bar: &mut LinkMotion<T>, w: V3<T>, p: V3<T>) {
    bar.wd = add(bar.wd, cross(p, bar.a));
    bar.w = add(bar.w, double_cross_bar(bar.a, w, p));
}

/// Derivative of `f · (ω × (ω × h))` with respect to ω: `f (ω·h) + h (ω·f) - 2 (f·h) ω`.
#[inline(always)]
fn double_cross_bar<T: Lane>(f: V3<T>, w: V3<T>, h: V3<T>) -> V3<T> {
    let (wh, wf, fh) = (dot(w, h), dot(w, f), dot(f, h));
    let factor = -(fh + fh);
    [
        f[0].mul_add(wh, h[0].mul_add(wf, factor * w[0])),
        f[1].mul_add(wh, h[1].mul_add(wf, factor * w[1])),
        f[2].mul_add(wh, h[2].mul_add(wf, factor * w[2])),
    ]
}

/// A vector carried through a turn moves by `-z × v dq`.
#[inline(always)]
fn turned_bar<T: Lane>(v: V3<T>, bar: V3<T>) -> T {
    bar[0].mul_add(v[1], -(bar[1] * v[0]))
}

/// Reverse of [`LinkMotion::beyond`]: from the bar of a link's motion, the bar of the motion of the link below.
///
/// `carried` is the motion between [`LinkMotion::carried`] and [`LinkMotion::moved`]; `below_w` the link below's ω.
#[inline(always)]
pub(crate) fn beyond_bar<T: Lane>(
    joint: &KernelJoint,
    travel: Travel<T>,
    (qd, carried, below_w): (T, &LinkMotion<T>, V3<T>),
    bar: LinkMotion<T>,
    out: &mut JointBar<T>,
) -> LinkMotion<T> {
    let mut bar = bar;
    let m = carried;
    match travel {
        Travel::Turn { .. } => {
            out.qdd = out.qdd + bar.wd[2];
            let coriolis = bar.wd[0].mul_add(m.w[1], -(bar.wd[1] * m.w[0]));
            out.qd = out.qd + coriolis + bar.w[2];
            bar.w[1] = bar.wd[0].mul_add(qd, bar.w[1]);
            bar.w[0] = (-bar.wd[1]).mul_add(qd, bar.w[0]);
            out.q = out.q
                + (turned_bar(m.w, bar.w) + (turned_bar(m.wd, bar.wd) + turned_bar(m.a, bar.a)));
        }
        Travel::Slide { d } => {
            out.qdd = out.qdd + bar.a[2];
            let across = bar.a[0].mul_add(m.w[1], -(bar.a[1] * m.w[0]));
            out.qd = out.qd + (across + across);
            let z = d.like(0.0);
            let rate = crate::kinematics::turning(m, [z, z, d.like(1.0)]);
            out.q = out.q + dot(bar.a, rate);
            turning_bar(&mut bar, m.w, [z, z, d]);
            let twice = qd + qd;
            bar.w[1] = bar.a[0].mul_add(twice, bar.w[1]);
            bar.w[0] = bar.a[1].mul_add(-twice, bar.w[0]);
        }
    }
    let mut bar = LinkMotion {
        w: travel.out_of_joint(joint, bar.w),
        wd: travel.out_of_joint(joint, bar.wd),
        a: travel.out_of_joint(joint, bar.a),
    };
    if joint.step.has_translation() {
        turning_bar(&mut bar, below_w, joint.step.translation(below_w[0]));
    }
    bar
}

/// From the bar of the motion of a frame fixed in a link, the bar of the link's motion `m`.
#[inline(always)]
pub(crate) fn frame_bar<T: Lane>(
    m: &LinkMotion<T>,
    bar: LinkMotion<T>,
    rotation: &[[f64; 3]; 3],
    translation: [f64; 3],
) -> LinkMotion<T> {
    let mut bar = LinkMotion {
        w: outer(rotation, bar.w),
        wd: outer(rotation, bar.wd),
        a: outer(rotation, bar.a),
    };
    turning_bar(&mut bar, m.w, like(m.w[0], translation));
    bar
}

/// Bar of a link's motion under `twist · wrench(motion, parameters)`.
#[inline(always)]
pub(crate) fn wrench_bar<T: Lane>(
    m: &LinkMotion<T>,
    twist: &Screw<T>,
    p: &[T; 10],
) -> LinkMotion<T> {
    let (x, f, h) = (twist.angular, twist.linear, [p[6], p[7], p[8]]);
    let gyroscopic = add(
        cross(tensor_times(p, m.w), x),
        tensor_times(p, cross(x, m.w)),
    );
    let lever = cross(x, h);
    LinkMotion {
        w: add(gyroscopic, double_cross_bar(f, m.w, h)),
        wd: add(tensor_times(p, x), cross(h, f)),
        a: add(times(p[9], f), lever),
    }
}

impl<T: Lane> Screw<T> {
    /// This twist crossed with a wrench: `(ω × n + v × f, ω × f)`, minus the transpose of the motion cross product.
    #[inline(always)]
    pub(crate) fn cross_wrench(&self, wrench: &Self) -> Self {
        Self {
            angular: add(
                cross(self.angular, wrench.angular),
                cross(self.linear, wrench.linear),
            ),
            linear: cross(self.angular, wrench.linear),
        }
    }

    /// Power of a twist and a wrench.
    #[inline(always)]
    pub(crate) fn power(&self, wrench: &Self) -> T {
        dot(self.angular, wrench.angular) + dot(self.linear, wrench.linear)
    }

    /// Sum.
    #[inline(always)]
    pub(crate) fn plus(&self, o: &Self) -> Self {
        Self {
            angular: add(self.angular, o.angular),
            linear: add(self.linear, o.linear),
        }
    }
}
