//! The three conventions, each brought to the one form of [`Joint`](crate::Joint).

use super::format::{AngleUnit, Kind, ModifiedDh, Number, PoseFrame, StandardDh};
use super::snapping::Snapping;
use crate::pose::Pose;
use nalgebra::Vector3;

/// Where a joint stands and how it moves.
pub(super) struct Placement {
    pub(super) parent_from_joint: Pose,
    pub(super) axis: Vector3<f64>,
    pub(super) offset: f64,
    pub(super) joint_from_link: Pose,
}

/// What turns the numbers of a joint into radians and metres.
pub(super) struct Reader<'a> {
    pub(super) unit: AngleUnit,
    pub(super) snapping: &'a mut Snapping,
    pub(super) place: String,
}

impl Reader<'_> {
    fn angle(&mut self, value: Number) -> f64 {
        let radians = radians(self.unit, value.0);
        self.snapping.angle(&self.place, radians)
    }

    fn length(&mut self, value: Number) -> f64 {
        self.snapping.length(&self.place, value.0)
    }

    pub(super) fn pose(&mut self, xyz: [Number; 3], rpy: [Number; 3]) -> Pose {
        let xyz = xyz.map(|v| self.length(v));
        let rpy = rpy.map(|v| self.angle(v));
        Pose::from_xyz_rpy(xyz, rpy)
    }
}

/// A convention's frame as a placement; prismatic joints move along the axis that revolute ones turn about.
pub(super) trait Frame {
    fn placement(&self, kind: Kind, reader: &mut Reader) -> Option<Placement>;
}

impl Frame for ModifiedDh {
    fn placement(&self, kind: Kind, reader: &mut Reader) -> Option<Placement> {
        let (gamma, alpha) = (reader.angle(self.gamma), reader.angle(self.alpha));
        let theta = reader.angle(self.theta);
        let [b, d, r] = [self.b, self.d, self.r].map(|v| reader.length(v));
        let before = Pose::from_rotation_z(gamma)
            * Pose::from_translation(0.0, 0.0, b)
            * Pose::from_rotation_x(alpha)
            * Pose::from_translation(d, 0.0, 0.0);
        let (constant, offset) = along_z(kind, theta, r);
        Some(Placement {
            parent_from_joint: before * constant,
            axis: Vector3::z(),
            offset,
            joint_from_link: Pose::identity(),
        })
    }
}

impl Frame for StandardDh {
    fn placement(&self, kind: Kind, reader: &mut Reader) -> Option<Placement> {
        let (theta, alpha) = (reader.angle(self.theta), reader.angle(self.alpha));
        let [d, a] = [self.d, self.a].map(|v| reader.length(v));
        let (constant, offset) = along_z(kind, theta, d);
        let distal = Pose::from_translation(a, 0.0, 0.0) * Pose::from_rotation_x(alpha);
        Some(Placement {
            parent_from_joint: Pose::identity(),
            axis: Vector3::z(),
            offset,
            joint_from_link: constant * distal,
        })
    }
}

/// Turn and shift about the same z: the one that does not move, and where the moving one starts.
fn along_z(kind: Kind, theta: f64, r: f64) -> (Pose, f64) {
    match kind {
        Kind::Revolute | Kind::Fixed => (Pose::from_translation(0.0, 0.0, r), theta),
        Kind::Prismatic => (Pose::from_rotation_z(theta), r),
    }
}

impl Frame for PoseFrame {
    /// `None` when a moving joint states no axis.
    fn placement(&self, kind: Kind, reader: &mut Reader) -> Option<Placement> {
        let axis = match (self.axis, kind) {
            (Some(axis), _) => {
                let axis = Vector3::from(axis.map(|v| v.0));
                reader.snapping.axis(&reader.place, axis)
            }
            (None, Kind::Fixed) => Vector3::z(),
            (None, _) => return None,
        };
        let offset = match kind {
            Kind::Prismatic => self.offset.0,
            Kind::Revolute | Kind::Fixed => reader.angle(self.offset),
        };
        Some(Placement {
            parent_from_joint: reader.pose(self.xyz, self.rpy),
            axis,
            offset,
            joint_from_link: reader.pose(self.link_xyz, self.link_rpy),
        })
    }
}

pub(super) fn radians(unit: AngleUnit, value: f64) -> f64 {
    match unit {
        AngleUnit::Degrees => value.to_radians(),
        AngleUnit::Radians => value,
    }
}
