//! For tests: a dual number as a lane, and random robots.

use crate::lane::Lane;
use crate::{
    Actuator, InertialParameters, Joint, JointKind, JointLimits, JointState, Link, Pose, Robot,
};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use std::ops::{Add, Mul, Neg, Sub};

/// `re + ε · du` with `ε² = 0`: exact derivatives of anything written for a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Dual {
    pub(crate) re: f64,
    pub(crate) du: f64,
}

pub(crate) fn dual(re: f64, du: f64) -> Dual {
    Dual { re, du }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        dual(self.re + o.re, self.du + o.du)
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        dual(self.re - o.re, self.du - o.du)
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        dual(self.re * o.re, self.re * o.du + self.du * o.re)
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        dual(-self.re, -self.du)
    }
}
impl Lane for Dual {
    type At = ();
    type Cell = Self;
    const PARTS: usize = 1;
    fn part((): (), _: usize) {}
    fn splat((): (), x: f64) -> Self {
        dual(x, 0.0)
    }
    fn like(self, x: f64) -> Self {
        dual(x, 0.0)
    }
    fn read((): (), cell: &Self) -> Self {
        *cell
    }
    fn write(self, (): (), cell: &mut Self) {
        *cell = self;
    }
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    fn sin_cos(self, quarters: u64) -> (Self, Self) {
        let (s, c) = Lane::sin_cos(self.re, quarters);
        (dual(s, c * self.du), dual(c, -s * self.du))
    }
    fn sign(self) -> Self {
        dual(self.re.signum(), 0.0)
    }
    fn flipped(self, sign: f64) -> Self {
        if sign.is_sign_negative() { -self } else { self }
    }
}

/// The instruction sets of this machine the kernels are compiled for.
pub(crate) fn architectures() -> Vec<pulp::Arch> {
    let mut all = vec![pulp::Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    all.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
    #[cfg(target_arch = "x86_64")]
    all.extend(pulp::x86::V4::try_new().map(pulp::Arch::V4));
    all
}

/// Any tree of 1 to 8 joints, revolute and prismatic, with generic frames and physical links; and a state for it.
pub(crate) fn robot_and_state() -> impl Strategy<Value = (Robot, JointState)> {
    (1..=8_usize).prop_flat_map(|n| {
        let joint = (
            any::<bool>(),
            0..=n,
            prop::array::uniform32(-1.0..1.0_f64),
            0..4_u8,
        );
        let state = prop::collection::vec(-3.0..3.0_f64, 3 * n);
        (prop::collection::vec(joint, n), state).prop_map(move |(joints, s)| {
            let (joints, links) = joints
                .into_iter()
                .enumerate()
                .map(|(i, j)| body(i, &j))
                .unzip();
            let gravity = Vector3::new(1.0, -2.0, -9.0);
            let robot = Robot::new("random", gravity, joints, links).expect("a valid robot");
            let part = |k: usize| s[k * n..(k + 1) * n].to_vec();
            let state = JointState {
                q: part(0),
                qd: part(1),
                qdd: part(2),
            };
            (robot, state)
        })
    })
}

fn body(i: usize, (slide, parent, x, style): &(bool, usize, [f64; 32], u8)) -> (Joint, Link) {
    let pose = |k: usize| {
        Pose::from_xyz_rpy(
            [x[k], x[k + 1], x[k + 2]],
            [3.0 * x[k + 3], 3.0 * x[k + 4], 3.0 * x[k + 5]],
        )
    };
    // The special structures the kernels know, and the general case.
    let (before, after, axis) = match style {
        0 => (
            Pose::from_rotation_x(std::f64::consts::FRAC_PI_2),
            Pose::identity(),
            Vector3::z(),
        ),
        1 => (
            Pose::identity(),
            Pose::from_translation(0.0, x[1], x[2])
                * Pose::from_rotation_x(-std::f64::consts::FRAC_PI_2),
            -Vector3::y(),
        ),
        2 => (pose(0), Pose::identity(), -Vector3::x()),
        _ => (pose(0), pose(6), Vector3::new(x[12], x[13], 1.0 + x[14])),
    };
    let joint = Joint {
        name: format!("j{i}"),
        kind: if *slide {
            JointKind::Prismatic
        } else {
            JointKind::Revolute
        },
        parent: if i == 0 || *parent == 0 {
            None
        } else {
            Some((*parent - 1).min(i - 1))
        },
        parent_from_joint: before,
        axis,
        offset: x[15],
        joint_from_link: after,
        limits: JointLimits::default(),
        actuator: Actuator::default(),
    };
    // A positive definite pseudo-inertia from any matrix: mass points all around.
    let a = Matrix3::from_column_slice(&x[16..25]);
    let sigma = a * a.transpose() + Matrix3::identity() * 0.1;
    let inertia = Matrix3::identity() * sigma.trace() - sigma;
    let mass = 1.5 + x[25];
    let centre = Vector3::new(x[26], x[27], x[28]);
    let link = Link {
        name: format!("l{i}"),
        inertial: Some(InertialParameters::from_centre_of_mass(
            mass, centre, &inertia,
        )),
    };
    (joint, link)
}

/// Largest difference relative to the largest entry of `b` (at least 1).
pub(crate) fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    let scale = b.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    a.iter()
        .zip(b)
        .fold(0.0_f64, |m, (x, y)| m.max((x - y).abs()))
        / scale
}
