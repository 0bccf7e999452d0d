//! What the equations need of a robot, constant: a tree of fixed poses around joints that move about or along z.

use crate::lane::{Lane, V3};
use crate::pose::Pose;
use crate::robot::{JointKind, Robot};
use nalgebra::{Matrix3, Vector3};

/// Constants of the equations of motion, made once from a [`Robot`].
///
/// Every joint becomes `link_parent_from_link = before · motion_z(q) · after`; zeros and quarter turns of the two
/// fixed poses are found here once, so that the kernels skip them.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) gravity: [f64; 3],
    pub(crate) joints: Vec<KernelJoint>,
}

/// A joint as the kernels see it.
#[derive(Debug, Clone)]
pub(crate) struct KernelJoint {
    pub(crate) parent: Option<usize>,
    pub(crate) kind: JointKind,
    pub(crate) before: FixedPose,
    pub(crate) after: FixedPose,
    /// Joints from the base to this one, itself included: the rows this link's parameters appear in.
    pub(crate) path: Vec<usize>,
}

/// A constant pose with its structure found out.
#[derive(Debug, Clone)]
pub(crate) struct FixedPose {
    rotation: FixedRotation,
    pub(crate) translation: [f64; 3],
}

#[derive(Debug, Clone)]
enum FixedRotation {
    Identity,
    /// Rotation about x by +90°.
    QuarterX,
    /// Rotation about x by -90°.
    BackQuarterX,
    /// Row-major matrix.
    General([[f64; 3]; 3]),
}

/// Entries of a rotation this close to 0 or ±1 are what the maker meant: rounding of an angle, not a tilt.
const EXACT: f64 = 4.0 * f64::EPSILON;

impl FixedPose {
    fn new(pose: &Pose) -> Self {
        let clean = pose.rotation.map(|x| {
            let near = x.round();
            if (x - near).abs() < EXACT { near } else { x }
        });
        let quarter = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
        let rotation = if clean == Matrix3::identity() {
            FixedRotation::Identity
        } else if clean == quarter {
            FixedRotation::QuarterX
        } else if clean == quarter.transpose() {
            FixedRotation::BackQuarterX
        } else {
            FixedRotation::General(std::array::from_fn(|i| {
                std::array::from_fn(|j| clean[(i, j)])
            }))
        };
        Self {
            rotation,
            translation: pose.translation.into(),
        }
    }

    /// `Rᵀ v`: a vector of the outer frame in the inner one.
    #[inline(always)]
    pub(crate) fn to_inner<T: Lane>(&self, v: V3<T>) -> V3<T> {
        match &self.rotation {
            FixedRotation::Identity => v,
            FixedRotation::QuarterX => [v[0], v[2], -v[1]],
            FixedRotation::BackQuarterX => [v[0], -v[2], v[1]],
            FixedRotation::General(r) => std::array::from_fn(|k| {
                let [a, b, c] = [r[0][k], r[1][k], r[2][k]].map(T::splat);
                v[0].mul_add(a, v[1].mul_add(b, v[2] * c))
            }),
        }
    }

    /// `R v`: a vector of the inner frame in the outer one.
    #[inline(always)]
    pub(crate) fn to_outer<T: Lane>(&self, v: V3<T>) -> V3<T> {
        match &self.rotation {
            FixedRotation::Identity => v,
            FixedRotation::QuarterX => [v[0], -v[2], v[1]],
            FixedRotation::BackQuarterX => [v[0], v[2], -v[1]],
            FixedRotation::General(r) => std::array::from_fn(|k| {
                let [a, b, c] = r[k].map(T::splat);
                v[0].mul_add(a, v[1].mul_add(b, v[2] * c))
            }),
        }
    }

    /// `w × p + v` with the pose's translation `p`: zero components cost nothing.
    #[inline(always)]
    pub(crate) fn shift<T: Lane>(&self, v: V3<T>, w: V3<T>) -> V3<T> {
        let mut out = v;
        let [px, py, pz] = self.translation;
        if px != 0.0 {
            let p = T::splat(px);
            out[1] = w[2].mul_add(p, out[1]);
            out[2] = w[1].mul_add(-p, out[2]);
        }
        if py != 0.0 {
            let p = T::splat(py);
            out[0] = w[2].mul_add(-p, out[0]);
            out[2] = w[0].mul_add(p, out[2]);
        }
        if pz != 0.0 {
            let p = T::splat(pz);
            out[0] = w[1].mul_add(p, out[0]);
            out[1] = w[0].mul_add(-p, out[1]);
        }
        out
    }

    /// Whether there is a translation at all.
    #[inline(always)]
    pub(crate) fn has_translation(&self) -> bool {
        self.translation != [0.0; 3]
    }

    /// The translation in every lane.
    #[inline(always)]
    pub(crate) fn translation<T: Lane>(&self) -> V3<T> {
        self.translation.map(T::splat)
    }
}

impl Model {
    /// Constants of a robot.
    pub fn new(robot: &Robot) -> Self {
        let mut joints: Vec<KernelJoint> = Vec::with_capacity(robot.n_joints());
        for (index, joint) in robot.joints().iter().enumerate() {
            let align = rotation_from_z(&joint.axis);
            let offset = match joint.kind {
                JointKind::Revolute => Pose::from_rotation_z(joint.offset),
                JointKind::Prismatic => Pose::from_translation(0.0, 0.0, joint.offset),
            };
            let mut path = joint
                .parent
                .map_or_else(Vec::new, |p| joints[p].path.clone());
            path.push(index);
            joints.push(KernelJoint {
                parent: joint.parent,
                kind: joint.kind,
                before: FixedPose::new(&(joint.parent_from_joint * align * offset)),
                after: FixedPose::new(&(align.inverse() * joint.joint_from_link)),
                path,
            });
        }
        Self {
            gravity: robot.gravity().into(),
            joints,
        }
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// Joints whose torque the parameters of this link enter, from the base to the link's own.
    pub fn path(&self, link: usize) -> &[usize] {
        &self.joints[link].path
    }

    /// The same arm without weight.
    pub(crate) fn weightless(&self) -> Self {
        Self {
            gravity: [0.0; 3],
            joints: self.joints.clone(),
        }
    }
}

/// A rotation that takes z to a unit axis; exact for the axes of the frame.
fn rotation_from_z(axis: &Vector3<f64>) -> Pose {
    let z = Vector3::z();
    let exact = [
        (z, Matrix3::identity()),
        (
            -z,
            Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0),
        ),
        (
            Vector3::x(),
            Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
        ),
        (
            -Vector3::x(),
            Matrix3::new(0.0, 0.0, -1.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
        ),
        (
            Vector3::y(),
            Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0),
        ),
        (
            -Vector3::y(),
            Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0),
        ),
    ];
    let rotation = exact
        .into_iter()
        .find(|(a, _)| a == axis)
        .map_or_else(|| general_rotation_from_z(axis), |(_, r)| r);
    Pose {
        rotation,
        translation: Vector3::zeros(),
    }
}

fn general_rotation_from_z(axis: &Vector3<f64>) -> Matrix3<f64> {
    // Any unit vector across the axis serves; the smallest component gives the best one.
    let across = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    Matrix3::from_columns(&[across, axis.cross(&across), *axis])
}
