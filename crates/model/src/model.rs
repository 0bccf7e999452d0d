//! What the equations need of a robot, constant: joint frames with z along the axis, chosen so that little is left to do.
//!
//! The axis of a joint fixes its frame but for a turn about z. That turn is chosen such that the rotation from one joint
//! to the next is about x alone (the modified Denavit-Hartenberg form), most often by 0 or 90°; what is left of it is
//! an offset of the joint's position. Zeros that follow from this structure are found here, once.

use crate::frame::{Fixed, LinkPose, Offset, Rotation, about_z};
use crate::pose::Pose;
use crate::robot::{JointKind, Robot};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Constants of the equations of motion, made once from a [`Robot`].
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) gravity: [f64; 3],
    pub(crate) joints: Vec<KernelJoint>,
}

/// A joint as the kernels see it; its frame moves about or along its own z.
#[derive(Debug, Clone)]
pub(crate) struct KernelJoint {
    pub(crate) parent: Option<usize>,
    pub(crate) children: Vec<usize>,
    pub(crate) kind: JointKind,
    /// From the frame of the joint below (the base) to this one's at position zero.
    pub(crate) step: Fixed,
    /// Added to the position of a revolute joint.
    pub(crate) offset: Offset,
    /// The link's own frame, which its parameters are given in, seen from the joint's.
    pub(crate) link: LinkPose,
    /// Joints from the base to this one, itself included: the rows this link's parameters appear in.
    pub(crate) path: Vec<usize>,
    /// The path cut where the direction of the axes changes; the last one is this joint's own, z.
    pub(crate) directions: Vec<Direction>,
    /// Whether the link only ever turns about this joint's z.
    pub(crate) planar: bool,
}

/// Joints on a link's path whose axes stay parallel.
#[derive(Debug, Clone)]
pub(crate) struct Direction {
    /// Where it stands among the axes of the path (see `LinkAxes`), the same for every link further out.
    pub(crate) place: usize,
    /// Positions on the path.
    pub(crate) range: Range<usize>,
    /// A slide stands alone: its axis has no angular part to share.
    pub(crate) kind: JointKind,
    /// Never has a part along z of the link's joint.
    pub(crate) across: bool,
}

impl Model {
    /// Constants of a robot.
    pub fn new(robot: &Robot) -> Self {
        let steps = raw_steps(robot);
        // The turn about z that suits the first joint each joint carries.
        let turns: Vec<Matrix3<f64>> = (0..robot.n_joints())
            .map(|j| {
                let first = robot.joints().iter().position(|c| c.parent == Some(j));
                first.map_or_else(Matrix3::identity, |c| turn_towards(&steps[c].rotation))
            })
            .collect();
        let mut joints: Vec<KernelJoint> = Vec::with_capacity(robot.n_joints());
        for (index, joint) in robot.joints().iter().enumerate() {
            let mut step = steps[index];
            let mut turn = turns[index];
            if let Some(p) = joint.parent {
                joints[p].children.push(index);
                let back = Pose {
                    rotation: turns[p].transpose(),
                    translation: Vector3::zeros(),
                };
                step = back * step;
                if let Some(rest) = turn_after_x(&step.rotation) {
                    step.rotation *= rest.transpose();
                    turn = rest * turn;
                }
            }
            if joint.kind == JointKind::Prismatic {
                // A slide cannot take up a turn.
                step.rotation *= turn;
                turn = Matrix3::identity();
            }
            let after = axis_pose(&joint.axis).inverse() * joint.joint_from_link;
            let link = Pose {
                rotation: turns[index].transpose(),
                translation: Vector3::zeros(),
            } * after;
            let below = joint.parent.map(|p| &joints[p]);
            joints.push(KernelJoint::new(
                (index, joint.kind, joint.parent),
                below,
                Fixed::new(&step),
                Offset::new(&turn),
                LinkPose::new(&link),
            ));
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

    /// Ten parameters a link, given in the link frames, in the joint frames of the kernels.
    pub(crate) fn kernel_parameters(&self, parameters: &[f64]) -> Vec<f64> {
        let ten = parameters.chunks_exact(10);
        let moved = |(joint, ten): (&KernelJoint, &[f64])| joint.link.parameters(ten);
        self.joints.iter().zip(ten).flat_map(moved).collect()
    }
}

impl KernelJoint {
    fn new(
        (index, kind, parent): (usize, JointKind, Option<usize>),
        below: Option<&Self>,
        step: Fixed,
        offset: Offset,
        link: LinkPose,
    ) -> Self {
        let mut path = below.map_or_else(Vec::new, |b| b.path.clone());
        let mut directions = below.map_or_else(Vec::new, |b| b.directions.clone());
        path.push(index);
        let here = path.len() - 1;
        let turns = step.rotation != Rotation::None;
        let n_below = directions.len();
        for (k, d) in directions.iter_mut().enumerate() {
            let next = k + 1 == n_below;
            d.across = (d.across && !turns) || (next && step.rotation == Rotation::Quarter);
        }
        match directions.last_mut() {
            Some(last) if !turns && last.kind == kind && kind == JointKind::Revolute => {
                last.range.end = here + 1;
            }
            _ => directions.push(Direction {
                // Before it stand one direction each and the joints.
                place: n_below + here,
                range: here..here + 1,
                kind,
                across: false,
            }),
        }
        let planar = below.is_none_or(|b| b.planar && step.rotation == Rotation::None);
        Self {
            parent,
            children: Vec::new(),
            kind,
            step,
            offset,
            link,
            path,
            directions,
            planar,
        }
    }
}

/// Pose of every joint's frame at position zero in that of the joint below, z along the axes, as the robot file has them.
fn raw_steps(robot: &Robot) -> Vec<Pose> {
    robot
        .joints()
        .iter()
        .map(|joint| {
            let below = joint.parent.map_or_else(Pose::identity, |p| {
                let parent = &robot.joints()[p];
                axis_pose(&parent.axis).inverse() * parent.joint_from_link
            });
            let offset = match joint.kind {
                JointKind::Revolute => Pose::from_rotation_z(joint.offset),
                JointKind::Prismatic => Pose::from_translation(0.0, 0.0, joint.offset),
            };
            below * joint.parent_from_joint * axis_pose(&joint.axis) * offset
        })
        .collect()
}

/// `Rz(a)` of `R = Rz(a) Rx(α) Rz(b)` with α between 0 and π; the identity where the axes are parallel.
fn turn_towards(r: &Matrix3<f64>) -> Matrix3<f64> {
    let (c, s) = (-r[(1, 2)], r[(0, 2)]);
    if crate::frame::clean(c.abs().max(s.abs())) == 0.0 {
        return Matrix3::identity();
    }
    about_z(c, s)
}

/// `Rz(b)` if the rotation is `Rx(α) Rz(b)`.
fn turn_after_x(r: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    (crate::frame::clean(r[(0, 2)]) == 0.0).then(|| about_z(r[(0, 0)], -r[(0, 1)]))
}

/// A rotation that takes z to a unit axis; exact for the axes of the frame.
fn axis_pose(axis: &Vector3<f64>) -> Pose {
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
