//! Completed robots as robot files: RON in this program's own format, and URDF.

use super::completion::{Completion, DRIVE_KINDS, Source};
use crate::columns::ExtraColumn;
use crate::meaning::parameter_unit;
use askama::Template;
use idim_model::{
    Drives, Joint, JointKind, Link, Notation, Parameter, ParameterKind, Pose, Robot, robot_to_ron,
};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write as _;

/// The robot with the completed values as its own.
///
/// # Errors
/// What a robot file cannot hold.
pub(super) fn completed_ron(robot: &Robot, c: &Completion) -> Result<String, idim_model::Error> {
    let mut text = format!(
        "// Identified by idim {}: inertia completed by the prior of the robot file.\n// Where each value comes from: data (known for itself), combination (the data fix a sum it stands in), prior.\n",
        env!("CARGO_PKG_VERSION")
    );
    for (link, sources) in robot.links().iter().zip(&c.sources) {
        let _ = writeln!(text, "// {}: {}", one_line(&link.name), words(sources));
    }
    for line in beside(robot, c) {
        let _ = writeln!(text, "// {}", one_line(&line));
    }
    Ok(text + &robot_to_ron(&completed(robot, c)?) + "\n")
}

/// Drives and everything else beside the bodies, a line each: a robot file holds only part of it.
fn beside(robot: &Robot, c: &Completion) -> Vec<String> {
    let mut lines = vec!["Drives, at the joint, SI:".to_owned()];
    for (j, (joint, drives)) in robot.joints().iter().zip(&c.drives).enumerate() {
        let values: Vec<String> = DRIVE_KINDS
            .iter()
            .zip(drives)
            .filter_map(|(&kind, value)| {
                let (value, source) = (*value)?;
                let name = Parameter { kind, index: j }.name(Notation::Gautier);
                let unit = parameter_unit(&name, robot);
                Some(format!("{name} {value} {unit} ({})", source.word()))
            })
            .collect();
        if !values.is_empty() {
            lines.push(format!("  {}: {}", joint.name, values.join(", ")));
        }
    }
    lines.extend(c.extra.iter().map(|(column, value, source)| {
        let name = column.name();
        let unit = parameter_unit(&name, robot);
        let within = match column {
            ExtraColumn::Known(_) => "; the robot below has it in its known torque",
            _ => "",
        };
        format!(
            "  {name} {value} {unit} ({}): {}{within}",
            source.word(),
            column.meaning(robot)
        )
    }));
    lines
}

/// Rotors and positive friction of the joints go into their actuators, scales into the known torques.
fn completed(robot: &Robot, c: &Completion) -> Result<Robot, idim_model::Error> {
    let links = robot.links().iter().zip(&c.links);
    let links: Vec<Link> = links
        .map(|(l, &inertial)| Link {
            name: l.name.clone(),
            inertial: Some(inertial),
        })
        .collect();
    let motor_rotor = |j: usize| {
        let own = |e: &ExtraColumn| matches!(e, ExtraColumn::Motor { motor, kind: ParameterKind::Ia, .. } if *motor == j);
        c.extra.iter().find(|(e, ..)| own(e)).map(|e| e.1)
    };
    let joints: Vec<Joint> = robot
        .joints()
        .iter()
        .zip(&c.drives)
        .enumerate()
        .map(|(j, (joint, drives))| {
            let [ia, fv, fc, _] = drives.map(|v| v.map(|(value, _)| value));
            let mut joint = joint.clone();
            let a = &mut joint.actuator;
            a.viscous_friction = fv.filter(|v| *v >= 0.0).or(a.viscous_friction);
            a.coulomb_friction = fc.filter(|v| *v >= 0.0).or(a.coulomb_friction);
            // The rotor of a coupled motor is seen at its joint by a column of its own.
            let seen = motor_rotor(j).or(ia);
            let rotor = seen.zip(a.gear_ratio).map(|(ia, gear)| ia / (gear * gear));
            a.rotor_inertia = rotor.or(a.rotor_inertia);
            joint
        })
        .collect();
    let drives = Drives {
        known_torques: c.known_torques.clone(),
        ..robot.drives().clone()
    };
    Robot::new(robot.name(), robot.gravity(), joints, links)?
        .with_drives(drives)?
        .with_shapes(robot.shapes().clone())
}

#[derive(Template)]
#[template(path = "robot.urdf", escape = "html")]
struct Urdf {
    version: &'static str,
    name: String,
    root: String,
    beside: Vec<String>,
    joints: Vec<UrdfJoint>,
}

struct UrdfJoint {
    name: String,
    kind: &'static str,
    parent: String,
    link: String,
    xyz: String,
    rpy: String,
    axis: String,
    limit: Option<String>,
    damping: f64,
    friction: f64,
    sources: String,
    centre: String,
    mass: f64,
    inertia: [f64; 6],
}

/// URDF has no frame behind the motion and no offset: link frames are those of the joints, and offsets stand before them.
///
/// Gravity is not part of a URDF; a robot that hangs or leans has to be mounted so again.
pub(super) fn completed_urdf(robot: &Robot, c: &Completion) -> String {
    let taken = |name: &str| robot.links().iter().any(|l| l.name == name);
    let mut root = "base".to_owned();
    while taken(&root) {
        root.push('_');
    }
    let joints = robot.joints().iter().enumerate();
    let page = Urdf {
        version: env!("CARGO_PKG_VERSION"),
        name: one_line(robot.name()),
        joints: joints
            .map(|(j, joint)| urdf_joint(robot, c, j, joint, &root))
            .collect(),
        root,
        beside: beside(robot, c)
            .iter()
            .map(|line| in_comment(line))
            .collect(),
    };
    page.render().expect("a string takes any text")
}

fn urdf_joint(robot: &Robot, c: &Completion, j: usize, joint: &Joint, root: &str) -> UrdfJoint {
    let before = joint
        .parent
        .map_or_else(Pose::identity, |p| robot.joints()[p].joint_from_link);
    let stop = Joint {
        joint_from_link: Pose::identity(),
        ..joint.clone()
    };
    let origin = before * stop.pose(0.0);
    let body = c.links[j].expressed_in(&joint.joint_from_link);
    let about_centre = body.inertia_about_centre_of_mass();
    let limits = &joint.limits;
    let limit = limits.position.map(|[low, high]| {
        let [velocity, effort] = [limits.velocity, limits.torque].map(|v| v.unwrap_or(0.0));
        format!("lower=\"{low}\" upper=\"{high}\" velocity=\"{velocity}\" effort=\"{effort}\"")
    });
    UrdfJoint {
        name: one_line(&joint.name),
        kind: match (joint.kind, &limit) {
            (JointKind::Prismatic, _) => "prismatic",
            (JointKind::Revolute, Some(_)) => "revolute",
            (JointKind::Revolute, None) => "continuous",
        },
        parent: joint
            .parent
            .map_or_else(|| root.to_owned(), |p| one_line(&robot.links()[p].name)),
        link: one_line(&robot.links()[j].name),
        xyz: triple(&origin.translation),
        rpy: triple(&roll_pitch_yaw(&origin.rotation)),
        axis: triple(&joint.axis),
        limit,
        damping: c.drives[j][1].map_or(0.0, |v| v.0.max(0.0)),
        friction: c.drives[j][2].map_or(0.0, |v| v.0.max(0.0)),
        sources: words(&c.sources[j]),
        centre: triple(&(body.first_moment() / body.mass())),
        mass: body.mass(),
        inertia: [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| about_centre[at]),
    }
}

fn triple(v: &Vector3<f64>) -> String {
    format!("{} {} {}", v.x, v.y, v.z)
}

/// Angles of `Rz(yaw) Ry(pitch) Rx(roll)`, rad.
fn roll_pitch_yaw(r: &Matrix3<f64>) -> Vector3<f64> {
    let (roll, pitch, yaw) = nalgebra::Rotation3::from_matrix_unchecked(*r).euler_angles();
    Vector3::new(roll, pitch, yaw)
}

fn words(sources: &[Source; 10]) -> String {
    let named = ParameterKind::INERTIAL.iter().zip(sources);
    named
        .map(|(kind, s)| format!("{kind:?} {}", s.word()))
        .collect::<Vec<_>>()
        .join(", ")
}

/// A line inside a comment of XML, which two dashes would end.
fn in_comment(line: &str) -> String {
    let mut text = one_line(line);
    while text.contains("--") {
        text = text.replace("--", "- -");
    }
    text
}

/// A name in a comment or an attribute: control characters have no place there.
fn one_line(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}
