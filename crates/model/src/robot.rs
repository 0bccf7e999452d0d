//! The robot as described: joints, links, actuators, limits; checked once, constant afterwards.

use crate::error::Error;
use crate::parameter::InertialParameters;
use crate::pose::Pose;
use crate::suggestion::did_you_mean;
use nalgebra::Vector3;

mod check;
mod drives;
mod formula;
mod formula_slope;
mod interval;
mod known_torque;
mod shapes;

pub use drives::{Coupling, Drives, LogSide};
pub use formula::{Formula, Function, Operation};
pub use known_torque::KnownTorque;
pub use shapes::{Capsule, LinkCapsule, Shapes};

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
    /// Joint coordinate where the motor reads zero, rad (m); 0 where not stated.
    pub zero: Option<f64>,
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
    drives: Drives,
    shapes: Shapes,
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
            drives: Drives::default(),
            shapes: Shapes::default(),
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
        robot.turn_coupled_motors(joint, position - held.actuator.zero.unwrap_or(0.0));
        robot.drives = self.drives.without(joint);
        robot.pass_capsules_on(joint, held.parent, &parent_from_link);
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

    /// The robot with these joints held at these positions (rad or m): fingers, a torso.
    ///
    /// A note says so for each, and says it too where the position lies outside the joint's limits.
    ///
    /// # Errors
    /// A joint that the robot does not have, one given twice, a position that is not finite, no joint left to move.
    pub fn hold_joints(&self, held: &[(String, f64)]) -> Result<Self, Error> {
        let mut robot = self.clone();
        for (k, (name, position)) in held.iter().enumerate() {
            let place = || format!("held joint {name}");
            if held[..k].iter().any(|(other, _)| other == name) {
                return Err(Error::robot(place(), "given twice", "hold it once"));
            }
            let Some(joint) = robot.joint_index(name) else {
                let rule = did_you_mean(name, self.joints.iter().map(|j| j.name.as_str()));
                return Err(Error::robot(place(), "no such joint that moves", rule));
            };
            if !position.is_finite() {
                return Err(Error::robot(
                    place(),
                    format!("position {position}"),
                    FINITE,
                ));
            }
            if robot.n_joints() == 1 {
                return Err(Error::robot(
                    place(),
                    "no joint left to move",
                    "hold one less",
                ));
            }
            robot.notes.push(format!(
                "joint {name} is held at {position}: its link is part of its parent"
            ));
            if let Some([low, high]) = robot.joints[joint].limits.position
                && !(low..=high).contains(position)
            {
                robot.notes.push(format!(
                    "joint {name} is held at {position}, outside its limits {low} to {high}"
                ));
            }
            robot = robot.lock(joint, *position);
        }
        Ok(robot)
    }
}

const FINITE: &str = "give a finite number, rad or m";

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
}
