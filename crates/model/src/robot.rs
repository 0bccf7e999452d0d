//! The robot as described: joints, links, actuators, limits; checked once, constant afterwards.

use crate::error::Error;
use crate::parameter::InertialParameters;
use crate::pose::Pose;
use nalgebra::Vector3;

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Rotation about the axis, rad.
    Revolute,
    /// Translation along the axis, m.
    Prismatic,
}

/// Limits of a joint as the maker states them; absent where he states none. Rad or m, and their rates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointLimits {
    /// Lowest and highest position.
    pub position: Option<[f64; 2]>,
    /// Largest speed.
    pub velocity: Option<f64>,
    /// Largest acceleration.
    pub acceleration: Option<f64>,
    /// Largest torque (N·m) or force (N).
    pub torque: Option<f64>,
}

/// The drive of a joint; every field is optional knowledge.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Actuator {
    /// Motor turns per joint turn (rad/m for a prismatic joint); the sign says whether they turn the same way.
    pub gear_ratio: Option<f64>,
    /// Motor torque per ampere, N·m/A, before the gear.
    pub torque_constant: Option<f64>,
    /// Inertia of the rotor, kg·m², before the gear.
    pub rotor_inertia: Option<f64>,
    /// Encoder counts per motor turn, after quadrature.
    pub encoder_counts: Option<f64>,
    /// Viscous friction at the joint, N·m·s/rad: the truth of a simulation.
    pub viscous_friction: Option<f64>,
    /// Coulomb friction at the joint, N·m: the truth of a simulation.
    pub coulomb_friction: Option<f64>,
}

/// A joint and the way to its link.
///
/// `parent_link_from_link(q) = parent_from_joint · motion(axis, q + offset) · joint_from_link`.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name, unique in the robot.
    pub name: String,
    /// Revolute or prismatic.
    pub kind: JointKind,
    /// The link it is mounted on (index into the links), `None` for the base.
    pub parent: Option<usize>,
    /// Pose of the joint frame in the parent link's frame, before motion.
    pub parent_from_joint: Pose,
    /// Unit axis of motion, joint frame.
    pub axis: Vector3<f64>,
    /// Added to the joint's coordinate before it moves: a constant of the convention, rad or m.
    pub offset: f64,
    /// Pose of the link's frame after motion: the identity but for distal frames (standard DH).
    pub joint_from_link: Pose,
    /// Limits.
    pub limits: JointLimits,
    /// Drive.
    pub actuator: Actuator,
}

/// The body a joint moves.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Name, unique in the robot.
    pub name: String,
    /// Prior or simulated truth, link frame; `None` is "not known", never zero.
    pub inertial: Option<InertialParameters>,
}

/// An arm as described and checked: a tree of links, link `i` moved by joint `i`, parents before children.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    name: String,
    gravity: Vector3<f64>,
    joints: Vec<Joint>,
    links: Vec<Link>,
    notes: Vec<String>,
}

impl Robot {
    /// Checks and keeps a description. `gravity` in the base frame, m/s².
    ///
    /// # Errors
    /// A name used twice, a parent that is not an earlier link, an axis without length, limits that contradict each
    /// other, a mass below zero, a number that is not finite.
    pub fn new(
        name: impl Into<String>,
        gravity: Vector3<f64>,
        joints: Vec<Joint>,
        links: Vec<Link>,
    ) -> Result<Self, Error> {
        let mut robot = Self {
            name: name.into(),
            gravity,
            joints,
            links,
            notes: Vec::new(),
        };
        robot.check()?;
        for joint in &mut robot.joints {
            joint.axis.normalize_mut();
        }
        Ok(robot)
    }

    /// Name of the robot.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Gravity in the base frame, m/s².
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity
    }

    /// Joints, parents before children.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Links; link `i` is moved by joint `i`.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// What was changed on the way in (folded joints, snapped angles), one sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The same robot with these notes added.
    #[must_use]
    pub fn with_notes(mut self, notes: impl IntoIterator<Item = String>) -> Self {
        self.notes.extend(notes);
        self
    }

    /// The same robot under another gravity (base frame, m/s²): a wall-mounted or hanging arm.
    ///
    /// # Errors
    /// A component that is not finite.
    pub fn with_gravity(mut self, gravity: Vector3<f64>) -> Result<Self, Error> {
        self.gravity = gravity;
        self.check()?;
        Ok(self)
    }

    /// Index of the joint of this name.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|j| j.name == name)
    }

    /// The ten inertial parameters of every link one after another, `10 n`; `None` unless every link has them.
    pub fn standard_parameters(&self) -> Option<Vec<f64>> {
        let all: Option<Vec<_>> = self.links.iter().map(|l| l.inertial).collect();
        Some(all?.iter().flat_map(|p| p.0).collect())
    }

    /// The robot with one joint held at `position`: its link becomes part of the parent link.
    ///
    /// Links above move on to the parent; the inertial parameters add up when both are known. A fixed joint of a
    /// file is a joint locked at zero.
    #[must_use]
    pub fn lock(&self, joint: usize, position: f64) -> Self {
        let mut robot = self.clone();
        let held = robot.joints.remove(joint);
        let link = robot.links.remove(joint);
        let parent_from_link = held.pose(position);
        for j in &mut robot.joints {
            match j.parent {
                Some(p) if p == joint => {
                    j.parent = held.parent;
                    j.parent_from_joint = parent_from_link * j.parent_from_joint;
                }
                Some(p) if p > joint => j.parent = Some(p - 1),
                _ => {}
            }
        }
        if let (Some(parent), Some(own)) = (held.parent, link.inertial) {
            let parent = &mut robot.links[parent];
            parent.inertial = parent
                .inertial
                .map(|p| p.plus(&own.expressed_in(&parent_from_link)));
        }
        robot
    }

    fn check(&self) -> Result<(), Error> {
        if self.joints.is_empty() {
            return Err(Error::robot(
                &self.name,
                "no moving joint",
                "an arm needs at least one revolute or prismatic joint",
            ));
        }
        assert_eq!(self.joints.len(), self.links.len(), "one link per joint");
        if !self.gravity.iter().all(|g| g.is_finite()) {
            return Err(Error::robot(
                "gravity",
                format!("{:?}", self.gravity.as_slice()),
                "give three finite numbers in m/s², for example (0, 0, -9.81)",
            ));
        }
        for (i, (joint, link)) in self.joints.iter().zip(&self.links).enumerate() {
            if self.joints[..i].iter().any(|j| j.name == joint.name) {
                return Err(Error::robot(
                    format!("joint {}", joint.name),
                    "name used twice",
                    "rename one of them",
                ));
            }
            if self.links[..i].iter().any(|l| l.name == link.name) {
                return Err(Error::robot(
                    format!("link {}", link.name),
                    "name used twice",
                    "rename one of them",
                ));
            }
            if joint.parent.is_some_and(|p| p >= i) {
                return Err(Error::robot(
                    format!("joint {}", joint.name),
                    format!("parent link number {:?}", joint.parent.map(|p| p + 1)),
                    "a joint stands after the joint that moves its parent link",
                ));
            }
            joint.check()?;
            link.check()?;
        }
        Ok(())
    }
}

impl Joint {
    /// `parent_link_from_link` at position `q` (rad or m).
    pub fn pose(&self, q: f64) -> Pose {
        let amount = q + self.offset;
        let motion = match self.kind {
            JointKind::Revolute => Pose::from_axis_angle(&self.axis, amount),
            JointKind::Prismatic => {
                let t = self.axis * amount;
                Pose::from_translation(t.x, t.y, t.z)
            }
        };
        self.parent_from_joint * motion * self.joint_from_link
    }

    fn check(&self) -> Result<(), Error> {
        let place = format!("joint {}", self.name);
        let length = self.axis.norm();
        if !(length.is_finite() && length > 1e-9) {
            return Err(Error::robot(
                place,
                format!("axis {:?}", self.axis.as_slice()),
                "an axis needs a direction, for example (0, 0, 1)",
            ));
        }
        let poses = [&self.parent_from_joint, &self.joint_from_link];
        let finite = poses.iter().all(|p| {
            p.rotation
                .iter()
                .chain(p.translation.iter())
                .all(|v| v.is_finite())
        });
        if !finite || !self.offset.is_finite() {
            return Err(Error::robot(
                place,
                "a pose that is not finite",
                "give finite lengths and angles",
            ));
        }
        if let Some([low, high]) = self.limits.position
            && !(low < high)
        {
            return Err(Error::robot(
                place,
                format!("position limits {low} to {high}"),
                "the lower limit must be below the upper one",
            ));
        }
        let positive = [
            ("velocity limit", self.limits.velocity),
            ("acceleration limit", self.limits.acceleration),
            ("torque limit", self.limits.torque),
            ("torque constant", self.actuator.torque_constant),
            ("encoder counts", self.actuator.encoder_counts),
        ];
        for (what, value) in positive {
            if let Some(v) = value
                && !(v > 0.0 && v.is_finite())
            {
                return Err(Error::robot(
                    place,
                    format!("{what} {v}"),
                    "it must be above zero; leave it out if not known",
                ));
            }
        }
        let not_negative = [
            ("rotor inertia", self.actuator.rotor_inertia),
            ("viscous friction", self.actuator.viscous_friction),
            ("Coulomb friction", self.actuator.coulomb_friction),
        ];
        for (what, value) in not_negative {
            if let Some(v) = value
                && !(v >= 0.0 && v.is_finite())
            {
                return Err(Error::robot(
                    place,
                    format!("{what} {v}"),
                    "it cannot be below zero",
                ));
            }
        }
        if let Some(v) = self.actuator.gear_ratio
            && !(v != 0.0 && v.is_finite())
        {
            return Err(Error::robot(
                place,
                format!("gear ratio {v}"),
                "it must be a number other than zero",
            ));
        }
        Ok(())
    }
}

impl Link {
    fn check(&self) -> Result<(), Error> {
        let Some(p) = &self.inertial else {
            return Ok(());
        };
        let place = format!("link {}", self.name);
        if !p.0.iter().all(|v| v.is_finite()) {
            return Err(Error::robot(
                place,
                "an inertial value that is not finite",
                "give finite numbers, or leave the inertial out",
            ));
        }
        if p.mass() < 0.0 {
            return Err(Error::robot(
                place,
                format!("mass {} kg", p.mass()),
                "a mass cannot be below zero; correct it, or leave the inertial out",
            ));
        }
        Ok(())
    }
}
