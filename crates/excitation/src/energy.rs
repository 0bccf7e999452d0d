//! Energy rows, a few in a microsecond.
//!
//! The same `h(q, q̇)` as [`idim_model::energy_regressor`], without an allocation a call, for one choice of columns;
//! the optimisers of this crate evaluate it millions of times.

use crate::Error;
use idim_model::{Columns, JointKind, Pose, Robot};
use nalgebra::{Matrix3, Vector3};

/// What one joint contributes, with its axis turned onto z.
#[derive(Debug, Clone)]
pub(crate) struct EnergyJoint {
    pub(crate) parent: Option<usize>,
    pub(crate) kind: JointKind,
    pub(crate) offset: f64,
    pub(crate) before: Step,
    /// `None` where the link's frame is the moved joint frame (modified DH).
    pub(crate) after: Option<Step>,
}

/// A constant change of frame, `to_from_here`, origin of the new frame seen from here.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) origin: Vector3<f64>,
}

/// What travels along the chain, in the axes of the link: angular velocity, velocity of the origin, gravity, and
/// gravity times the position of the origin.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    pub(crate) w: Vector3<f64>,
    pub(crate) v: Vector3<f64>,
    pub(crate) g: Vector3<f64>,
    pub(crate) height: f64,
}

/// The energy model of a robot for a choice of columns: `H = h(q, q̇) X`.
#[derive(Debug, Clone)]
pub(crate) struct EnergyModel {
    pub(crate) joints: Vec<EnergyJoint>,
    gravity: Vector3<f64>,
    /// Of each link: (column, which of the ten).
    pub(crate) entries: Vec<Vec<(usize, usize)>>,
    n_columns: usize,
}

/// Scratch of one evaluation: the motion of every link, and of every joint frame after the joint moved.
#[derive(Debug, Clone)]
pub(crate) struct EnergyScratch {
    pub(crate) links: Vec<Motion>,
    pub(crate) moved: Vec<Motion>,
    pub(crate) sin_cos: Vec<(f64, f64)>,
    pub(crate) adjoint: Vec<Motion>,
}

impl EnergyModel {
    /// # Errors
    /// A column that is not inertial: friction and rotors are not part of the energy of the links.
    pub(crate) fn new(robot: &Robot, columns: &Columns) -> Result<Self, Error> {
        let mut entries = vec![Vec::new(); robot.n_joints()];
        for (column, parameter) in columns.0.iter().enumerate() {
            let Some(k) = parameter.kind.inertial_index() else {
                return Err(Error::input(
                    format!("column {parameter}"),
                    "a parameter of the drive",
                    "the energy model knows the inertial parameters of the links only; leave it out",
                ));
            };
            entries[parameter.index].push((column, k));
        }
        let joints = robot.joints().iter().map(|joint| {
            let turned = turn_onto_z(&joint.axis);
            let after = turned.inverse() * joint.joint_from_link;
            EnergyJoint {
                parent: joint.parent,
                kind: joint.kind,
                offset: joint.offset,
                before: Step::new(&(joint.parent_from_joint * turned)),
                after: (after != Pose::identity()).then(|| Step::new(&after)),
            }
        });
        Ok(Self {
            joints: joints.collect(),
            gravity: robot.gravity(),
            entries,
            n_columns: columns.len(),
        })
    }

    pub(crate) fn n_joints(&self) -> usize {
        self.joints.len()
    }

    pub(crate) fn n_columns(&self) -> usize {
        self.n_columns
    }

    pub(crate) fn scratch(&self) -> EnergyScratch {
        let n = self.joints.len();
        EnergyScratch {
            links: vec![Motion::default(); n],
            moved: vec![Motion::default(); n],
            sin_cos: vec![(0.0, 1.0); n],
            adjoint: vec![Motion::default(); n],
        }
    }

    fn base(&self) -> Motion {
        Motion {
            g: self.gravity,
            ..Motion::default()
        }
    }

    /// Energy per unit of each column, `h(q, q̇)`; leaves the motion of the links in `scratch`.
    pub(crate) fn row(&self, q: &[f64], qd: &[f64], scratch: &mut EnergyScratch, out: &mut [f64]) {
        for (i, joint) in self.joints.iter().enumerate() {
            let parent = joint
                .parent
                .map_or_else(|| self.base(), |p| scratch.links[p]);
            let mut m = joint.before.forward(&parent);
            let amount = q[i] + joint.offset;
            match joint.kind {
                JointKind::Revolute => {
                    let (s, c) = amount.sin_cos();
                    scratch.sin_cos[i] = (s, c);
                    for u in [&mut m.w, &mut m.v, &mut m.g] {
                        (u.x, u.y) = (c * u.x + s * u.y, c * u.y - s * u.x);
                    }
                    m.w.z += qd[i];
                }
                JointKind::Prismatic => {
                    m.v.x += m.w.y * amount;
                    m.v.y -= m.w.x * amount;
                    m.v.z += qd[i];
                    m.height += m.g.z * amount;
                }
            }
            scratch.moved[i] = m;
            scratch.links[i] = joint.after.as_ref().map_or(m, |step| step.forward(&m));
        }
        for (m, entries) in scratch.links.iter().zip(&self.entries) {
            let ten = m.ten();
            for &(column, k) in entries {
                out[column] = ten[k];
            }
        }
    }
}

impl Step {
    fn new(here_from_there: &Pose) -> Self {
        Self {
            rotation: here_from_there.rotation.transpose(),
            origin: here_from_there.translation,
        }
    }

    fn forward(&self, m: &Motion) -> Motion {
        Motion {
            w: self.rotation * m.w,
            v: self.rotation * (m.v + m.w.cross(&self.origin)),
            g: self.rotation * m.g,
            height: m.height + m.g.dot(&self.origin),
        }
    }
}

impl Motion {
    /// Kinetic plus potential energy per unit of each of the ten: `½ ωᵀIω + h·(v×ω) + ½ m v²` and `-g·h - m g·p`.
    fn ten(&self) -> [f64; 10] {
        let (w, v, g) = (&self.w, &self.v, &self.g);
        let first = v.cross(w) - g;
        [
            0.5 * w.x * w.x,
            w.x * w.y,
            w.x * w.z,
            0.5 * w.y * w.y,
            w.y * w.z,
            0.5 * w.z * w.z,
            first.x,
            first.y,
            first.z,
            0.5 * v.dot(v) - self.height,
        ]
    }
}

/// A rotation whose z axis is `axis` (unit); exactly the identity for z itself.
fn turn_onto_z(axis: &Vector3<f64>) -> Pose {
    let mut pose = Pose::identity();
    if *axis == Vector3::z() {
        return pose;
    }
    let helper = if axis.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let y = axis.cross(&helper).normalize();
    let x = y.cross(axis);
    pose.rotation = Matrix3::from_columns(&[x, y, *axis]);
    pose
}
