//! Robots from URDF text.

mod collision;
mod document;
mod tree;
mod xml;

use crate::error::Error;
use crate::pose::Pose;
use crate::robot::{Joint, JointKind, Link, LinkCapsule, Robot, Shapes};
use crate::robot_file::assembly::{DescribedJoint, assemble, listed};
use crate::robot_file::snapping::Snapping;
use document::{Description, UrdfJoint, UrdfKind};
use nalgebra::Vector3;
use tree::{Branch, Tree, tree};

/// Gravity in the frame of the root link, m/s²: URDF states none, and its z points up.
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// A robot from the text of a URDF, [`robot_from_urdf_with`] no joint held.
///
/// # Errors
/// As [`robot_from_urdf_with`].
pub fn robot_from_urdf(text: &str) -> Result<Robot, Error> {
    robot_from_urdf_with(text, &[])
}

/// A robot from the text of a URDF, these joints held at these positions (rad or m): fingers, a torso.
///
/// Joints stand depth first from the root link, children in document order, so parents stand first. Fixed joints are
/// folded into their parents; links fixed to the root take no part. A joint that mimics a held one is held where that
/// puts it. Gravity is (0, 0, -9.81) m/s² in the root link's frame ([`Robot::with_gravity`] changes it). A link without
/// inertial has no prior, which is not a mass of zero; a mass of zero without inertia, a limit of zero and a friction of
/// zero count as not stated. Rounded angles, lengths and axes are made exact. [`Robot::notes`] says so for each.
///
/// # Errors
/// [`Error::Syntax`] with line and column: no well-formed XML, a DOCTYPE, unexpanded xacro, no tree (a name used twice,
/// two roots, a loop, an unknown link), a floating or planar joint, a mimic joint that is not held, a zero axis, a mass
/// below zero, limits that contradict each other, a number that is not finite. [`Error::Robot`]: a held joint that the
/// robot does not have, no joint left to move.
pub fn robot_from_urdf_with(text: &str, held: &[(String, f64)]) -> Result<Robot, Error> {
    let xml = xml::parse(text)?;
    let mut snapping = Snapping::default();
    let description = document::read(&xml, &mut snapping)?;
    let tree = tree(&description)?;
    let all_held = with_mimics(&description, held)?;
    let described = tree
        .order
        .iter()
        .map(|branch| describe(&description, branch))
        .collect();
    let mut notes = vec![gravity_note(&description, &tree)];
    notes.extend(listed(
        "zeros that count as not stated",
        &description.not_stated,
    ));
    notes.extend(listed(
        "links without inertial, so without a prior",
        &unknown(&description, &tree),
    ));
    notes.extend(snapping.into_notes());
    notes.extend(listed(
        "links whose collision meshes are left out: give them capsules where they may touch",
        &meshes(&description),
    ));
    let of_root = description.links[tree.root].capsules.iter();
    let shapes = Shapes {
        capsules: of_root
            .map(|&capsule| LinkCapsule {
                link: None,
                capsule,
            })
            .collect(),
        ..Shapes::default()
    };
    let gravity = Vector3::from(GRAVITY);
    let robot = assemble(&description.name, gravity, described, shapes)?;
    robot.with_notes(notes).hold_joints(&all_held)
}

fn gravity_note(description: &Description, tree: &Tree) -> String {
    let root = &description.links[tree.root].name;
    format!("a URDF states no gravity: (0, 0, -9.81) m/s² in the frame of link {root}")
}

fn meshes(description: &Description) -> Vec<String> {
    let links = description.links.iter().filter(|l| l.n_meshes > 0);
    links.map(|l| l.name.clone()).collect()
}

/// Links that move and state no inertial.
fn unknown(description: &Description, tree: &Tree) -> Vec<String> {
    let moving = tree
        .order
        .iter()
        .filter(|b| description.joints[b.joint].kind != UrdfKind::Fixed);
    let links = moving.map(|b| &description.links[b.link]);
    links
        .filter(|l| l.inertial.is_none())
        .map(|l| l.name.clone())
        .collect()
}

/// The joints asked for and those that mimic them, each at its position; a mimic joint left over is refused.
fn with_mimics(
    description: &Description,
    held: &[(String, f64)],
) -> Result<Vec<(String, f64)>, Error> {
    let mut all = held.to_vec();
    let mut open: Vec<&UrdfJoint> = description
        .joints
        .iter()
        .filter(|j| j.kind != UrdfKind::Fixed)
        .collect();
    loop {
        let before = all.len();
        open.retain(|joint| {
            let Some(mimic) = &joint.mimic else {
                return false;
            };
            if all.iter().any(|(name, _)| *name == joint.name) {
                return false;
            }
            let leader = all.iter().find(|(name, _)| *name == mimic.joint);
            let follows = leader.map(|(_, q)| mimic.multiplier * q + mimic.offset);
            all.extend(follows.map(|position| (joint.name.clone(), position)));
            follows.is_none()
        });
        if all.len() == before {
            break;
        }
    }
    let Some(joint) = open.first() else {
        return Ok(all);
    };
    let leader = joint.mimic.as_ref().map_or("", |m| m.joint.as_str());
    let error = Error::robot(
        format!("joint {}", joint.name),
        format!("it mimics joint {leader}, so it is no joint of its own"),
        format!("hold it: --lock {leader}=0 holds both"),
    );
    Err(error.at(joint.line, joint.column))
}

fn describe(description: &Description, branch: &Branch) -> DescribedJoint {
    let joint = &description.joints[branch.joint];
    let link = &description.links[branch.link];
    DescribedJoint {
        joint: Joint {
            name: joint.name.clone(),
            kind: match joint.kind {
                UrdfKind::Prismatic => JointKind::Prismatic,
                UrdfKind::Revolute | UrdfKind::Continuous | UrdfKind::Fixed => JointKind::Revolute,
            },
            parent: branch.parent,
            parent_from_joint: joint.origin,
            axis: joint.axis,
            offset: 0.0,
            joint_from_link: Pose::identity(),
            limits: joint.limits,
            actuator: joint.actuator,
        },
        link: Link {
            name: link.name.clone(),
            inertial: link.inertial,
        },
        capsules: link.capsules.clone(),
        fixed: joint.kind == UrdfKind::Fixed,
        line: joint.line,
        column: joint.column,
    }
}
