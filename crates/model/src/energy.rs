//! Energy, power and momentum, linear in the same parameters as the torque.

use crate::frame::{LinkPose, inner, shift};
use crate::kinematics::{Screw, Travel};
use crate::lane::{Lane, cross, dot, like};
use crate::model::Model;
use crate::parameter::{Columns, ParameterKind};
use crate::regressor::torque_regressor;
use crate::states::JointState;
use nalgebra::DMatrix;

/// Total energy per unit of each parameter: the row `h(q, q̇)` with `H = E + U = h · π`, J per SI unit of `π`.
///
/// The potential energy is zero at the origin of the base frame. Rotor inertia stores `½ q̇²`; friction and offset
/// store nothing, their columns are zero. `d(h·π)/dt` is the power of the torques, [`power_regressor`].
/// Source: Gautier & Khalil 1988, eqs (4) to (6) of the 1991 paper.
///
/// # Panics
/// If `q`, `qd` or a column do not fit the model.
#[track_caller]
pub fn energy_regressor(model: &Model, columns: &Columns, q: &[f64], qd: &[f64]) -> Vec<f64> {
    let n = model.n_joints();
    assert!(
        q.len() == n && qd.len() == n,
        "the state has another number of joints than the model"
    );
    let mut links = vec![[0.0; 10]; n];
    link_energies(model, q, qd, &mut links);
    columns
        .0
        .iter()
        .map(|p| match (p.kind.inertial_index(), p.kind) {
            (Some(k), _) => links[p.index][k],
            (None, ParameterKind::Ia) => 0.5 * qd[p.index] * qd[p.index],
            _ => 0.0,
        })
        .collect()
}

/// `h(b) - h(a)`, a row of the energy-difference model (Gautier & Khalil 1991, eq. 7); each point is `(q, q̇)`.
///
/// # Panics
/// If a point or a column does not fit the model.
#[track_caller]
pub fn energy_difference(
    model: &Model,
    columns: &Columns,
    a: (&[f64], &[f64]),
    b: (&[f64], &[f64]),
) -> Vec<f64> {
    let mut row = energy_regressor(model, columns, b.0, b.1);
    for (x, y) in row
        .iter_mut()
        .zip(energy_regressor(model, columns, a.0, a.1))
    {
        *x -= y;
    }
    row
}

/// Power of the joint torques per unit of each parameter, `q̇ᵀ Y`, W per SI unit.
///
/// # Panics
/// If the state or a column does not fit the model.
#[track_caller]
pub fn power_regressor(model: &Model, columns: &Columns, state: &JointState) -> Vec<f64> {
    let y = torque_regressor(model, columns, state);
    y.column_iter()
        .map(|column| column.iter().zip(&state.qd).map(|(e, v)| e * v).sum())
        .collect()
}

/// Generalised momentum `p = M(q) q̇` per unit of each parameter, `n × p`; friction and offset columns are zero.
///
/// `Y(q, 0, q̇)` without gravity. `dp/dt = τ + ∂L/∂q`, the form that needs no acceleration.
///
/// # Panics
/// If `q`, `qd` or a column do not fit the model.
#[track_caller]
pub fn momentum_regressor(model: &Model, columns: &Columns, q: &[f64], qd: &[f64]) -> DMatrix<f64> {
    let state = JointState {
        q: q.to_vec(),
        qd: vec![0.0; qd.len()],
        qdd: qd.to_vec(),
    };
    let mut y = torque_regressor(&model.weightless(), columns, &state);
    for (mut column, p) in y.column_iter_mut().zip(&columns.0) {
        if matches!(
            p.kind,
            ParameterKind::Fv | ParameterKind::Fc | ParameterKind::Offset
        ) {
            column.fill(0.0);
        }
    }
    y
}

/// Velocity of a link and gravity in its axes, and the height term of its origin.
#[derive(Clone, Copy)]
struct LinkEnergy<T> {
    velocity: Screw<T>,
    gravity: [T; 3],
    /// `-g · p` of the origin, J/kg.
    potential: T,
}

/// The ten energies of every link: kinetic `½ ωᵀ I ω + v·(ω × h) + ½ m v²`, potential `-g·(m p + R h)`.
pub(crate) fn link_energies<T: Lane<At = ()>>(
    model: &Model,
    q: &[T],
    qd: &[T],
    links: &mut [[T; 10]],
) {
    let zero = T::splat((), 0.0);
    let base = LinkEnergy {
        velocity: Screw {
            angular: [zero; 3],
            linear: [zero; 3],
        },
        gravity: model.gravity.map(|g| T::splat((), g)),
        potential: zero,
    };
    let mut all: Vec<LinkEnergy<T>> = Vec::with_capacity(model.n_joints());
    for (j, joint) in model.joints.iter().enumerate() {
        let travel = Travel::new(joint, q[j]);
        let below = joint.parent.map_or(base, |p| all[p]);
        let gravity = travel.inward(joint.step.rotation.inward(below.gravity));
        let mut potential = below.potential - dot(below.gravity, joint.step.translation(q[j]));
        if let Travel::Slide { d } = travel {
            potential = potential - gravity[2] * d;
        }
        let here = LinkEnergy {
            velocity: below
                .velocity
                .beyond(joint, travel)
                .plus_axis(joint.kind, qd[j]),
            gravity,
            potential,
        };
        all.push(here);
        let ten = match &joint.link {
            LinkPose::Along(_) => here.ten(),
            LinkPose::Posed {
                rotation,
                translation,
                ..
            } => here.at(rotation, *translation).ten(),
        };
        for (k, x) in links[j].iter_mut().enumerate() {
            let (from, sign) = joint.link.entry(k);
            *x = ten[from] * q[j].like(sign);
        }
    }
}

impl<T: Lane> LinkEnergy<T> {
    /// At a frame that moves with the link.
    fn at(&self, rotation: &[[f64; 3]; 3], translation: [f64; 3]) -> Self {
        let linear = shift(translation, self.velocity.linear, self.velocity.angular);
        Self {
            velocity: Screw {
                angular: inner(rotation, self.velocity.angular),
                linear: inner(rotation, linear),
            },
            gravity: inner(rotation, self.gravity),
            potential: self.potential - dot(self.gravity, like(self.potential, translation)),
        }
    }

    /// Energy per unit of the ten parameters in this frame.
    fn ten(&self) -> [T; 10] {
        let half = self.potential.like(0.5);
        let [x, y, z] = self.velocity.angular;
        let v = self.velocity.linear;
        let first = cross(v, self.velocity.angular);
        [
            half * x * x,
            x * y,
            x * z,
            half * y * y,
            y * z,
            half * z * z,
            first[0] - self.gravity[0],
            first[1] - self.gravity[1],
            first[2] - self.gravity[2],
            half.mul_add(dot(v, v), self.potential),
        ]
    }
}
