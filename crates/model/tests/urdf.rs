//! URDF files: the tree and what is folded, held, snapped and left unstated.

#![allow(clippy::unwrap_used)]

use idim_model::{
    Columns, JointKind, Model, Robot, random_states, robot_from_ron, robot_from_urdf,
    robot_from_urdf_with, torque_regressor,
};
use nalgebra::{Matrix3, Vector3};

fn joint(name: &str, kind: &str, parent: &str, child: &str, inside: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{inside}</joint>\n"
    )
}

fn urdf(links: &[&str], joints: &[String]) -> String {
    let links: Vec<String> = links
        .iter()
        .map(|l| format!("<link name=\"{l}\"/>\n"))
        .collect();
    let links = links.concat();
    format!(
        "<robot name=\"test\">\n{links}{}</robot>\n",
        joints.concat()
    )
}

fn inertial(mass: f64, centre: &str) -> String {
    format!(
        "<inertial><mass value=\"{mass}\"/><origin xyz=\"{centre}\" rpy=\"0 0 0\"/>
         <inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial>"
    )
}

fn names(robot: &Robot) -> Vec<&str> {
    robot.joints().iter().map(|j| j.name.as_str()).collect()
}

#[test]
fn identity_joints_stand_depth_first_in_document_order() {
    // root - a - b - c; a - d; root - e, written in another order.
    let text = urdf(
        &["lb", "lc", "root", "la", "ld", "le"],
        &[
            joint("c", "prismatic", "lb", "lc", ""),
            joint("a", "revolute", "root", "la", ""),
            joint("b", "continuous", "la", "lb", ""),
            joint("e", "revolute", "root", "le", ""),
            joint("d", "revolute", "la", "ld", ""),
        ],
    );
    let robot = robot_from_urdf(&text).unwrap();
    assert_eq!(names(&robot), ["a", "b", "c", "d", "e"]);
    let parents: Vec<Option<usize>> = robot.joints().iter().map(|j| j.parent).collect();
    assert_eq!(parents, [None, Some(0), Some(1), Some(0), None]);
    assert_eq!(robot.joints()[2].kind, JointKind::Prismatic);
    assert_eq!(robot.links()[3].name, "ld");
    assert_eq!(robot.gravity(), Vector3::new(0.0, 0.0, -9.81));
}

#[test]
fn identity_inertial_values_stand_about_the_link_frame_in_its_axes() {
    // A quarter turn about z: the body's x is the link's y.
    let body =
        "<inertial><origin xyz=\"0.1 0.2 0.3\" rpy=\"0 0 1.5707963267948966\"/><mass value=\"2\"/>
        <inertia ixx=\"1\" ixy=\"0.1\" ixz=\"0.2\" iyy=\"1.5\" iyz=\"0.3\" izz=\"2\"/></inertial>";
    let text = urdf(&["root"], &[joint("a", "revolute", "root", "la", "")]).replace(
        "</robot>",
        &format!("<link name=\"la\">{body}</link></robot>"),
    );
    let own = robot_from_urdf(&text).unwrap().links()[0].inertial.unwrap();
    let turned = Matrix3::new(1.5, -0.1, -0.3, -0.1, 1.0, 0.2, -0.3, 0.2, 2.0);
    let centre = Vector3::new(0.1, 0.2, 0.3);
    let expected = idim_model::InertialParameters::from_centre_of_mass(2.0, centre, &turned);
    for (a, b) in own.0.iter().zip(expected.0) {
        assert!((a - b).abs() < 1e-15, "{own:?} {expected:?}");
    }
}

#[test]
fn regress_missing_and_zero_values_are_not_stated() {
    let limit = "<limit lower=\"0\" upper=\"0\" velocity=\"0\" effort=\"0\"/><dynamics damping=\"0\" friction=\"0\"/>";
    let zero = inertial(0.0, "0 0 0").replace("0.1", "0");
    let text = urdf(
        &["root", "lb"],
        &[
            joint("a", "revolute", "root", "la", limit),
            joint("b", "revolute", "la", "lb", ""),
        ],
    )
    .replace(
        "</robot>",
        &format!("<link name=\"la\">{zero}</link></robot>"),
    );
    let robot = robot_from_urdf(&text).unwrap();
    assert_eq!(robot.links()[0].inertial, None);
    assert_eq!(robot.links()[1].inertial, None);
    assert_eq!(robot.standard_parameters(), None);
    let joint = &robot.joints()[0];
    assert_eq!(joint.limits, idim_model::JointLimits::default());
    assert_eq!(joint.actuator, idim_model::Actuator::default());
    let notes = robot.notes().join("\n");
    for part in [
        "a URDF states no gravity: (0, 0, -9.81) m/s² in the frame of link root",
        "zeros that count as not stated: velocity of joint a, effort of joint a, lower and upper of joint a, inertial of link la",
        "links without inertial, so without a prior: la, lb",
    ] {
        assert!(notes.contains(part), "{part:?} is not in\n{notes}");
    }
}

#[test]
fn regress_stated_values_are_read() {
    let inside = "<limit lower=\"-1\" upper=\"2\" velocity=\"3\" effort=\"40\"/><dynamics damping=\"0.5\" friction=\"0.7\"/>";
    let text = urdf(
        &["root", "la"],
        &[joint("a", "revolute", "root", "la", inside)],
    );
    let joint = robot_from_urdf(&text).unwrap().joints()[0].clone();
    assert_eq!(joint.limits.position, Some([-1.0, 2.0]));
    assert_eq!(
        (joint.limits.velocity, joint.limits.torque),
        (Some(3.0), Some(40.0))
    );
    assert_eq!(joint.actuator.viscous_friction, Some(0.5));
    assert_eq!(joint.actuator.coulomb_friction, Some(0.7));
    // Without an axis URDF means x.
    assert_eq!(joint.axis, Vector3::x());
    let text = text.replace("revolute", "continuous");
    let joint = robot_from_urdf(&text).unwrap().joints()[0].clone();
    assert_eq!(
        (joint.limits.position, joint.limits.velocity),
        (None, Some(3.0))
    );
}

#[test]
fn regress_fixed_links_fold_and_frames_contribute_nothing() {
    let text = urdf(
        &["world", "flange", "tool0"],
        &[
            joint("mount", "fixed", "world", "base", "<origin xyz=\"0 0 1\"/>"),
            joint("a", "revolute", "base", "la", "<axis xyz=\"0 0 1\"/>"),
            joint("f", "fixed", "la", "flange", "<origin xyz=\"0 0 0.5\"/>"),
            joint("g", "fixed", "flange", "gripper", "<origin xyz=\"0.2 0 0\"/>"),
            joint("t", "fixed", "gripper", "tool0", ""),
        ],
    )
    .replace(
        "</robot>",
        &format!(
            "<link name=\"base\">{}</link><link name=\"la\">{}</link><link name=\"gripper\">{}</link></robot>",
            inertial(9.0, "0 0 0"),
            inertial(3.0, "0 0 0.1"),
            inertial(1.0, "0 0 0.1")
        ),
    );
    let robot = robot_from_urdf(&text).unwrap();
    assert_eq!(names(&robot), ["a"]);
    let p = robot.links()[0].inertial.unwrap();
    assert_eq!(p.mass(), 4.0);
    assert!((p.first_moment() - Vector3::new(0.2, 0.0, 3.0 * 0.1 + 0.6)).amax() < 1e-15);
    assert_eq!(
        robot.joints()[0].parent_from_joint.translation,
        Vector3::new(0.0, 0.0, 1.0)
    );
    let notes = robot.notes().join("\n");
    for part in [
        "links fixed to the base, which take no part in the dynamics: base",
        "fixed links without inertial, which contribute nothing: flange, tool0",
        "fixed links folded into the link that carries them: gripper into la",
        "in the frame of link world",
    ] {
        assert!(notes.contains(part), "{part:?} is not in\n{notes}");
    }
}

fn gripper() -> String {
    urdf(
        &["root", "la", "left", "right"],
        &[
            joint("a", "revolute", "root", "la", ""),
            joint("finger", "prismatic", "la", "left", "<axis xyz=\"0 1 0\"/>"),
            joint(
                "follower",
                "prismatic",
                "la",
                "right",
                "<axis xyz=\"0 1 0\"/><mimic joint=\"finger\" multiplier=\"-2\" offset=\"0.1\"/>",
            ),
        ],
    )
}

#[test]
fn regress_a_mimic_joint_is_refused_unless_it_is_held() {
    let message = robot_from_urdf(&gripper()).unwrap_err().to_string();
    for part in [
        "line 8, column 1",
        "joint follower: it mimics joint finger",
        "hold it: --lock finger=0 holds both",
    ] {
        assert!(message.contains(part), "{message}");
    }
    let own = robot_from_urdf_with(&gripper(), &[("follower".into(), 0.0)]).unwrap();
    assert_eq!(names(&own), ["a", "finger"]);
    let both = robot_from_urdf_with(&gripper(), &[("finger".into(), 0.03)]).unwrap();
    assert_eq!(names(&both), ["a"]);
    let notes = both.notes().join("\n");
    assert!(notes.contains("joint finger is held at 0.03"), "{notes}");
    assert!(notes.contains("joint follower is held at 0.04"), "{notes}");
}

#[test]
fn regress_a_held_joint_that_does_not_exist_is_refused() {
    let error =
        robot_from_urdf_with(idim_fixtures::UR5_URDF, &[("elbow".into(), 0.0)]).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("held joint elbow: no such joint that moves; allowed: shoulder_pan_joint"),
        "{error}"
    );
}

/// Columns that vanish must vanish exactly: `1.570796325` unsnapped leaves entries of 2e-9.
#[test]
fn regress_rounded_right_angles_become_exact() {
    for (text, rounding) in [
        (idim_fixtures::PUMA560_URDF, "1.8e-9"),
        (idim_fixtures::UR5_URDF, "4.9e-12"),
        (idim_fixtures::PANDA_URDF, "4.9e-12"),
    ] {
        let robot = robot_from_urdf(text).unwrap();
        let rotations = robot.joints().iter().map(|j| j.parent_from_joint.rotation);
        assert!(
            rotations
                .flat_map(|r| r.iter().copied().collect::<Vec<_>>())
                .all(|v| v == 0.0 || v.abs() == 1.0)
        );
        let notes = robot.notes().join("\n");
        assert!(
            notes.contains("moved onto it: joint") && notes.contains(rounding),
            "{notes}"
        );
    }
    assert_eq!(
        robot_from_urdf(idim_fixtures::PANDA_URDF)
            .unwrap()
            .n_joints(),
        7
    );
}

#[test]
fn regress_axes_are_brought_to_length_one_and_freed_of_noise() {
    let text = urdf(
        &["root", "la"],
        &[joint(
            "a",
            "revolute",
            "root",
            "la",
            "<axis xyz=\"4.9e-12 0 2\"/>",
        )],
    );
    let robot = robot_from_urdf(&text).unwrap();
    assert_eq!(robot.joints()[0].axis, Vector3::z());
    let notes = robot.notes().join("\n");
    assert!(
        notes.contains("axes brought to length 1: joint a"),
        "{notes}"
    );
    assert!(
        notes.contains("coordinate direction moved onto it: joint a"),
        "{notes}"
    );
}

#[test]
fn regress_an_impossible_inertia_is_kept_and_reported() {
    let body = inertial(1.0, "0 0 0").replace("izz=\"0.1\"", "izz=\"0.3\"");
    let text = urdf(&["root"], &[joint("a", "revolute", "root", "la", "")]).replace(
        "</robot>",
        &format!("<link name=\"la\">{body}</link></robot>"),
    );
    let robot = robot_from_urdf(&text).unwrap();
    assert_eq!(robot.links()[0].inertial.unwrap().0[5], 0.3);
    let notes = robot.notes().join("\n");
    assert!(
        notes.contains("link la: no rigid body has this inertial") && notes.contains("33.33 %"),
        "{notes}"
    );
}

#[test]
fn regress_names_from_anywhere_stay_text() {
    let joint = joint("j &quot;1&quot;", "revolute", "root", "&lt;b&gt;la", "");
    let robot = robot_from_urdf(&urdf(&["root", "&lt;b&gt;la"], &[joint])).unwrap();
    assert_eq!(robot.links()[0].name, "<b>la");
    assert_eq!(robot.joints()[0].name, "j \"1\"");
}

/// The recorded TX40: the URDF beside its log and the robot file here are the same arm.
#[test]
fn oracle_tx40_robot_file_is_its_urdf() {
    let Some(shared) = idim_fixtures::shared_dir() else {
        eprintln!("skipped: no recorded data beside the repository");
        return;
    };
    let text = std::fs::read_to_string(shared.join("data/staubli-tx40/tx40.urdf")).unwrap();
    let urdf = robot_from_urdf(&text).unwrap();
    let file = robot_from_ron(idim_fixtures::TX40).unwrap();
    let columns = Columns::inertial(6);
    let states = random_states(&file, 5, 3);
    for k in 0..5 {
        let ours = torque_regressor(&Model::new(&file), &columns, &states.state(k));
        let theirs = torque_regressor(&Model::new(&urdf), &columns, &states.state(k));
        assert!((&ours - &theirs).amax() <= 1e-12 * theirs.amax());
    }
    for (a, b) in file.joints().iter().zip(urdf.joints()) {
        assert_eq!((&a.name, a.limits), (&b.name, b.limits));
    }
    // Its link 6 states a mass without inertia, its tool frame nothing.
    assert!(
        urdf.notes()
            .iter()
            .any(|n| n.contains("contribute nothing: tool0")),
        "{:?}",
        urdf.notes()
    );
}
