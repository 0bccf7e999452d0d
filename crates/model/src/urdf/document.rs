//! The links and joints of a URDF, read and placed; everything else in the file is left alone.

use super::collision::read_collisions;
use super::xml::{Xml, child};
use crate::error::Error;
use crate::parameter::InertialParameters;
use crate::pose::Pose;
use crate::robot::{Actuator, Capsule, JointLimits};
use crate::robot_file::assembly::MAX_JOINTS;
use crate::robot_file::snapping::Snapping;
use crate::suggestion::did_you_mean;
use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;

pub(super) struct UrdfLink {
    pub(super) name: String,
    pub(super) inertial: Option<InertialParameters>,
    /// Bodies that enclose the collision shapes.
    pub(super) capsules: Vec<Capsule>,
    /// Collision shapes that were left out.
    pub(super) n_meshes: usize,
    pub(super) line: usize,
    pub(super) column: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum UrdfKind {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
}

pub(super) struct Mimic {
    pub(super) joint: String,
    pub(super) multiplier: f64,
    pub(super) offset: f64,
}

pub(super) struct UrdfJoint {
    pub(super) name: String,
    pub(super) kind: UrdfKind,
    pub(super) parent: String,
    pub(super) child: String,
    pub(super) origin: Pose,
    pub(super) axis: Vector3<f64>,
    pub(super) limits: JointLimits,
    pub(super) actuator: Actuator,
    pub(super) mimic: Option<Mimic>,
    pub(super) line: usize,
    pub(super) column: usize,
}

/// What a URDF says about bodies and joints, in document order.
pub(super) struct Description {
    pub(super) name: String,
    pub(super) links: Vec<UrdfLink>,
    pub(super) joints: Vec<UrdfJoint>,
    /// Values that count as not stated, one entry each.
    pub(super) not_stated: Vec<String>,
}

pub(super) fn read(xml: &Xml, snapping: &mut Snapping) -> Result<Description, Error> {
    let root = xml.document.root_element();
    if !root.has_tag_name("robot") {
        let met = format!("<{}> as the outermost element", root.tag_name().name());
        return Err(xml.refuse(
            root,
            "file",
            &met,
            "a URDF starts with <robot>; export it as URDF",
        ));
    }
    let mut description = Description {
        name: root.attribute("name").unwrap_or("robot").to_owned(),
        links: Vec::new(),
        joints: Vec::new(),
        not_stated: Vec::new(),
    };
    for node in root.children().filter(Node::is_element) {
        match node.tag_name().name() {
            "link" => {
                let link = read_link(xml, node, &mut description.not_stated)?;
                description.links.push(link);
            }
            "joint" => {
                let joint = read_joint(xml, node, snapping, &mut description.not_stated)?;
                description.joints.push(joint);
            }
            _ => {}
        }
        if description.joints.len().max(description.links.len()) > MAX_JOINTS {
            let rule = "no arm has that many; is this a world and not a robot?";
            return Err(xml.refuse(
                node,
                "file",
                &format!("more than {MAX_JOINTS} joints or links"),
                rule,
            ));
        }
    }
    Ok(description)
}

fn read_link(xml: &Xml, node: Node, not_stated: &mut Vec<String>) -> Result<UrdfLink, Error> {
    let name = xml.required(node, "name", "link")?;
    let mut inertial = None;
    if let Some(element) = child(node, "inertial") {
        let read = read_inertial(xml, element, &format!("link {name}"))?;
        if read.0.iter().all(|&v| v == 0.0) {
            not_stated.push(format!("inertial of link {name}"));
        } else {
            inertial = Some(read);
        }
    }
    let (capsules, n_meshes) = read_collisions(xml, node, &format!("link {name}"))?;
    let (line, column) = xml.position(node.range().start);
    Ok(UrdfLink {
        name: name.to_owned(),
        inertial,
        capsules,
        n_meshes,
        line,
        column,
    })
}

/// About the origin of the link's frame, from mass, centre and the tensor about the centre in its own axes.
fn read_inertial(xml: &Xml, node: Node, place: &str) -> Result<InertialParameters, Error> {
    let part = |name: &str| {
        let missing = || {
            let met = format!("<inertial> without <{name}>");
            xml.refuse(
                node,
                place,
                &met,
                "state it, or leave the whole inertial out if not known",
            )
        };
        child(node, name).ok_or_else(missing)
    };
    let mass_element = part("mass")?;
    xml.required(mass_element, "value", place)?;
    let mass = xml
        .number(mass_element, "value", place)?
        .unwrap_or_default();
    if mass < 0.0 {
        let rule = "a mass cannot be below zero; correct it, or leave the inertial out";
        return Err(xml.refuse(mass_element, place, &format!("mass {mass} kg"), rule));
    }
    let tensor = part("inertia")?;
    let entry = |name: &str| {
        xml.required(tensor, name, place)?;
        Ok(xml.number(tensor, name, place)?.unwrap_or_default())
    };
    let (xx, xy, xz) = (entry("ixx")?, entry("ixy")?, entry("ixz")?);
    let (yy, yz, zz) = (entry("iyy")?, entry("iyz")?, entry("izz")?);
    let own = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let [xyz, rpy] = read_origin(xml, node, place)?;
    let link_from_own = Pose::from_xyz_rpy(xyz, rpy);
    let (r, centre) = (link_from_own.rotation, link_from_own.translation);
    let about_centre = r * own * r.transpose();
    Ok(InertialParameters::from_centre_of_mass(
        mass,
        centre,
        &about_centre,
    ))
}

/// `xyz` and `rpy` of the `<origin>` of an element, zero where not stated.
pub(super) fn read_origin(xml: &Xml, node: Node, place: &str) -> Result<[[f64; 3]; 2], Error> {
    let Some(origin) = child(node, "origin") else {
        return Ok([[0.0; 3]; 2]);
    };
    let xyz = xml.numbers(origin, "xyz", place)?.unwrap_or_default();
    let rpy = xml.numbers(origin, "rpy", place)?.unwrap_or_default();
    Ok([xyz, rpy])
}

fn read_joint(
    xml: &Xml,
    node: Node,
    snapping: &mut Snapping,
    not_stated: &mut Vec<String>,
) -> Result<UrdfJoint, Error> {
    let name = xml.required(node, "name", "joint")?;
    let place = format!("joint {name}");
    let kind = read_kind(xml, node, &place)?;
    let link = |role: &str| {
        let missing = || {
            let met = format!("<joint> without <{role}>");
            xml.refuse(
                node,
                &place,
                &met,
                "a joint connects a parent link with a child link",
            )
        };
        let element = child(node, role).ok_or_else(missing)?;
        Ok(xml.required(element, "link", &place)?.to_owned())
    };
    let (parent, child_link) = (link("parent")?, link("child")?);
    let [xyz, rpy] = read_origin(xml, node, &place)?;
    let origin = Pose::from_xyz_rpy(
        xyz.map(|v| snapping.length(&place, v)),
        rpy.map(|v| snapping.angle(&place, v)),
    );
    let stated_axis = match child(node, "axis") {
        Some(axis) if kind != UrdfKind::Fixed => xml.numbers(axis, "xyz", &place)?,
        _ => None,
    };
    // Without an axis URDF means x.
    let axis = snapping.axis(&place, stated_axis.map_or_else(Vector3::x, Vector3::from));
    let (line, column) = xml.position(node.range().start);
    Ok(UrdfJoint {
        name: name.to_owned(),
        kind,
        parent,
        child: child_link,
        origin,
        axis,
        limits: read_limits(xml, node, kind, &place, not_stated)?,
        actuator: read_dynamics(xml, node, &place)?,
        mimic: read_mimic(xml, node, &place)?,
        line,
        column,
    })
}

fn read_kind(xml: &Xml, node: Node, place: &str) -> Result<UrdfKind, Error> {
    let word = xml.required(node, "type", place)?;
    match word {
        "revolute" => Ok(UrdfKind::Revolute),
        "continuous" => Ok(UrdfKind::Continuous),
        "prismatic" => Ok(UrdfKind::Prismatic),
        "fixed" => Ok(UrdfKind::Fixed),
        "floating" | "planar" => {
            let rule = "it moves in several directions at once and no single drive moves it; make it fixed";
            Err(xml.refuse(node, place, &format!("type {word}"), rule))
        }
        _ => {
            let rule = did_you_mean(word, ["revolute", "continuous", "prismatic", "fixed"]);
            Err(xml.refuse(node, place, &format!("unknown type {word:?}"), &rule))
        }
    }
}

/// Zeros that exporters write for what they do not know count as not stated.
fn read_limits(
    xml: &Xml,
    node: Node,
    kind: UrdfKind,
    place: &str,
    not_stated: &mut Vec<String>,
) -> Result<JointLimits, Error> {
    let Some(limit) = child(node, "limit").filter(|_| kind != UrdfKind::Fixed) else {
        return Ok(JointLimits::default());
    };
    let mut positive = |name: &str| {
        let value = xml.number(limit, name, place)?;
        if value == Some(0.0) {
            not_stated.push(format!("{name} of {place}"));
        }
        Ok(value.filter(|&v| v != 0.0))
    };
    let (velocity, torque) = (positive("velocity")?, positive("effort")?);
    let lower = xml.number(limit, "lower", place)?;
    let upper = xml.number(limit, "upper", place)?;
    let stated = kind != UrdfKind::Continuous && (lower.is_some() || upper.is_some());
    let mut position = stated.then(|| [lower.unwrap_or(0.0), upper.unwrap_or(0.0)]);
    if position == Some([0.0; 2]) {
        not_stated.push(format!("lower and upper of {place}"));
        position = None;
    }
    Ok(JointLimits {
        position,
        velocity,
        acceleration: None,
        torque,
    })
}

/// Damping and friction, the truth of a simulation; the zeros of a template say nothing.
fn read_dynamics(xml: &Xml, node: Node, place: &str) -> Result<Actuator, Error> {
    let Some(dynamics) = child(node, "dynamics") else {
        return Ok(Actuator::default());
    };
    let stated = |name| Ok(xml.number(dynamics, name, place)?.filter(|&v| v != 0.0));
    Ok(Actuator {
        viscous_friction: stated("damping")?,
        coulomb_friction: stated("friction")?,
        ..Actuator::default()
    })
}

fn read_mimic(xml: &Xml, node: Node, place: &str) -> Result<Option<Mimic>, Error> {
    let Some(mimic) = child(node, "mimic") else {
        return Ok(None);
    };
    Ok(Some(Mimic {
        joint: xml.required(mimic, "joint", place)?.to_owned(),
        multiplier: xml.number(mimic, "multiplier", place)?.unwrap_or(1.0),
        offset: xml.number(mimic, "offset", place)?.unwrap_or(0.0),
    }))
}
