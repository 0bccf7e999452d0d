//! The outward recursion run backwards: derivatives handed from a link to the joint that carries it and to the link below.
//!
//! A bar marks the derivative of one scalar with respect to a quantity; it has that quantity's type.

use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{Lane, V3, add, cross, dot, zero};
use crate::model::KernelJoint;

/// Derivative with respect to a joint's position, velocity and acceleration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointBar<T> {
    pub(crate) q: T,
    pub(crate) qd: T,
    pub(crate) qdd: T,
}

impl<T: Lane> JointBar<T> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let q = T::splat(0.0);
        Self { q, qd: q, qdd: q }
    }
}

impl<T: Lane> LinkMotion<T> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self {
            w: zero(),
            wd: zero(),
            a: zero(),
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
    let minus = -(fh + fh);
    std::array::from_fn(|k| f[k].mul_add(wh, h[k].mul_add(wf, minus * w[k])))
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
    let mut bar = bar.map(|v| joint.after.to_outer(v));
    let m = carried;
    if joint.after.has_translation() {
        let mut w = m.w;
        if let Travel::Turn { .. } = travel {
            w[2] = w[2] + qd;
        }
        turning_bar(&mut bar, w, joint.after.translation());
    }
    match travel {
        Travel::Turn { .. } => {
            out.qdd = out.qdd + bar.wd[2];
            let coriolis = bar.wd[0].mul_add(m.w[1], -(bar.wd[1] * m.w[0]));
            out.qd = out.qd + coriolis + bar.w[2];
            bar.w[1] = bar.wd[0].mul_add(qd, bar.w[1]);
            bar.w[0] = bar.wd[1].mul_add(-qd, bar.w[0]);
            // A vector carried through the turn moves by -z × v dq.
            let turned = |v: V3<T>, b: V3<T>| b[0].mul_add(v[1], -(b[1] * v[0]));
            out.q = out.q + (turned(m.w, bar.w) + (turned(m.wd, bar.wd) + turned(m.a, bar.a)));
        }
        Travel::Slide { d } => {
            out.qdd = out.qdd + bar.a[2];
            let across = bar.a[0].mul_add(m.w[1], -(bar.a[1] * m.w[0]));
            out.qd = out.qd + (across + across);
            let z = T::splat(0.0);
            let rate = crate::kinematics::turning(m, [z, z, T::splat(1.0)]);
            out.q = out.q + dot(bar.a, rate);
            turning_bar(&mut bar, m.w, [z, z, d]);
            let twice = qd + qd;
            bar.w[1] = bar.a[0].mul_add(twice, bar.w[1]);
            bar.w[0] = bar.a[1].mul_add(-twice, bar.w[0]);
        }
    }
    let mut bar = bar.map(|v| joint.before.to_outer(travel.to_outer(v)));
    if joint.before.has_translation() {
        turning_bar(&mut bar, below_w, joint.before.translation());
    }
    bar
}

/// Bar of a link's motion under `twist · wrench(motion, parameters)`.
#[inline(always)]
pub(crate) fn wrench_bar<T: Lane>(
    m: &LinkMotion<T>,
    twist: &Screw<T>,
    p: &[T; 10],
) -> LinkMotion<T> {
    let tensor = |v: V3<T>| -> V3<T> {
        [
            dot([p[0], p[1], p[2]], v),
            dot([p[1], p[3], p[4]], v),
            dot([p[2], p[4], p[5]], v),
        ]
    };
    let (x, f, h) = (twist.angular, twist.linear, [p[6], p[7], p[8]]);
    let gyroscopic = add(cross(tensor(m.w), x), tensor(cross(x, m.w)));
    let lever = cross(x, h);
    LinkMotion {
        w: add(gyroscopic, double_cross_bar(f, m.w, h)),
        wd: add(tensor(x), cross(h, f)),
        a: std::array::from_fn(|k| p[9].mul_add(f[k], lever[k])),
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

    /// This axis times a rate.
    #[inline(always)]
    pub(crate) fn times(&self, rate: T) -> Self {
        Self {
            angular: self.angular.map(|x| x * rate),
            linear: self.linear.map(|x| x * rate),
        }
    }
}
