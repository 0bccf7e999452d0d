//! Completed robots as robot files: RON in this program's own format, and URDF.

use super::completion::{Completion, Source};
use askama::Template;
use idim_model::{Joint, JointKind, Link, ParameterKind, Pose, Robot, robot_to_ron};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write as _;

/// The robot with the completed values as its own.
pub(super) fn completed_ron(robot: &Robot, c: &Completion) -> String {
    let mut text = format!(
        "// Identified by idim {}: inertia completed by the prior of the robot file.\n// Where each value comes from: data (known for itself), combination (the data fix a sum it stands in), prior.\n",
        env!("CARGO_PKG_VERSION")
    );
    for (link, sources) in robot.links().iter().zip(&c.sources) {
        let _ = writeln!(text, "// {}: {}", one_line(&link.name), words(sources));
    }
    text + &robot_to_ron(&completed(robot, c)) + "\n"
}

fn completed(robot: &Robot, c: &Completion) -> Robot {
    let links = robot.links().iter().zip(&c.links);
    let links: Vec<Link> = links
        .map(|(l, &inertial)| Link {
            name: l.name.clone(),
            inertial: Some(inertial),
        })
        .collect();
    let joints: Vec<Joint> = robot
        .joints()
        .iter()
        .zip(&c.drives)
        .map(|(joint, [ia, fv, fc])| {
            let mut joint = joint.clone();
            let a = &mut joint.actuator;
            a.viscous_friction = fv.or(a.viscous_friction);
            a.coulomb_friction = fc.or(a.coulomb_friction);
            let rotor = ia.zip(a.gear_ratio).map(|(ia, gear)| ia / (gear * gear));
            a.rotor_inertia = rotor.or(a.rotor_inertia);
            joint
        })
        .collect();
    let same = Robot::new(robot.name(), robot.gravity(), joints, links);
    same.and_then(|r| r.with_drives(robot.drives().clone()))
        .expect("a checked robot with real bodies is a robot")
}

#[derive(Template)]
#[template(path = "robot.urdf", escape = "html")]
struct Urdf {
    version: &'static str,
    name: String,
    root: String,
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
        damping: c.drives[j][1].unwrap_or(0.0),
        friction: c.drives[j][2].unwrap_or(0.0),
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

/// A name in a comment or an attribute: control characters have no place there.
fn one_line(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}
