//! RON robot files: the three conventions, both forms of inertial values, and what joins bodies.

#![allow(clippy::unwrap_used)]

use idim_model::{
    Columns, InertialParameters, JointKind, JointState, Model, Robot, inverse_dynamics,
    random_states, robot_from_ron, robot_to_ron, torque_regressor,
};
use nalgebra::{Matrix3, Vector3};

const ALL: [&str; 7] = [
    idim_fixtures::PUMA3R,
    idim_fixtures::PUMA560,
    idim_fixtures::CRS_A460,
    idim_fixtures::KR300,
    idim_fixtures::TX40,
    idim_fixtures::PLANAR2R,
    idim_fixtures::PLANAR2R_HORIZONTAL,
];

/// Relative to the largest torque; poses pass through other products of the same factors.
const TOLERANCE: f64 = 1e-12;

fn file(joints: &str) -> String {
    format!(
        "(\n    name: \"test\",\n    angles: Degrees,\n    gravity: (0, 0, -9.81),\n    joints: {joints},\n)"
    )
}

fn robot(joints: &str) -> Robot {
    robot_from_ron(&file(joints)).unwrap()
}

#[track_caller]
fn assert_same_regressor(a: &Robot, b: &Robot) {
    let columns = Columns::inertial(a.n_joints());
    let (model_a, model_b) = (Model::new(a), Model::new(b));
    let states = random_states(a, 5, 1);
    for k in 0..5 {
        let ya = torque_regressor(&model_a, &columns, &states.state(k));
        let yb = torque_regressor(&model_b, &columns, &states.state(k));
        assert!((&ya - &yb).amax() <= TOLERANCE * ya.amax(), "{}", a.name());
    }
}

/// The complete file of the format's description.
#[test]
fn identity_the_documented_file_is_read() {
    let page = include_str!("../../../docs/robot-file.md");
    let text = page
        .split("```ron\n")
        .nth(1)
        .unwrap()
        .split("```")
        .next()
        .unwrap();
    let robot = robot_from_ron(text).unwrap();
    assert_eq!(robot.n_joints(), 2);
    assert_eq!(robot.links()[1].name, "forearm");
    assert_eq!(robot.notes(), [""; 0]);
}

#[test]
fn identity_every_robot_survives_writing_and_reading() {
    for text in ALL {
        let robot = robot_from_ron(text).unwrap();
        let back = robot_from_ron(&robot_to_ron(&robot)).unwrap();
        assert_eq!(back.gravity(), robot.gravity());
        assert_eq!(back.links(), robot.links());
        for (a, b) in back.joints().iter().zip(robot.joints()) {
            assert_eq!((&a.name, a.parent, a.limits), (&b.name, b.parent, b.limits));
            assert_eq!((a.kind, a.actuator), (b.kind, b.actuator));
        }
        assert_same_regressor(&robot, &back);
    }
}

/// `Rx(alpha)` of standard DH stands at the far end of a link, that of modified DH at the near end of the next.
#[test]
fn identity_modified_and_standard_dh_describe_the_same_arm() {
    let standard = robot(
        "StandardDh([
            (name: \"a\", frame: (theta: 20, d: 0.3, a: 0.1, alpha: 90)),
            (name: \"b\", kind: Prismatic, frame: (theta: 50, d: 0.2, a: 0.4, alpha: -35)),
            (name: \"c\", frame: (theta: 10, d: 0.5)),
        ])",
    );
    let modified = robot(
        "ModifiedDh([
            (name: \"a\", frame: (theta: 20, r: 0.3)),
            (name: \"b\", kind: Prismatic, frame: (d: 0.1, alpha: 90, theta: 50, r: 0.2)),
            (name: \"c\", frame: (d: 0.4, alpha: -35, theta: 10, r: 0.5)),
        ])",
    );
    for q in [[0.1, 0.2, 0.3], [-1.0, 0.0, 2.0]] {
        let tip = |r: &Robot| {
            let joints = r.joints().iter().zip(q);
            joints.map(|(j, q)| j.pose(q)).reduce(|a, b| a * b).unwrap()
        };
        let (a, b) = (tip(&standard), tip(&modified));
        assert!((a.rotation - b.rotation).amax() < 1e-15);
        assert!((a.translation - b.translation).amax() < 1e-15);
    }
}

#[test]
fn identity_a_pose_with_a_link_frame_is_a_distal_frame() {
    let standard =
        robot("StandardDh([(name: \"a\", frame: (theta: 20, d: 0.3, a: 0.1, alpha: 90))])");
    let poses = robot(
        "Poses([(
            name: \"a\",
            frame: (axis: (0, 0, 1), offset: 20, link_xyz: (0.1, 0, 0.3), link_rpy: (90, 0, 0)),
        )])",
    );
    assert_same_regressor(&standard, &poses);
}

#[test]
fn identity_a_turned_base_is_turned_gravity() {
    let joint = "StandardDh([(name: \"a\", frame: (theta: 30, d: 0.1, a: 0.5, alpha: 90)), (name: \"b\", frame: (a: 0.3))])";
    let turned = file(joint).replace(
        "joints:",
        "base: (xyz: (1, 2, 3), rpy: (180, 0, 0)),\n    joints:",
    );
    let turned = robot_from_ron(&turned).unwrap();
    let upright = robot(joint)
        .with_gravity(Vector3::new(0.0, 0.0, 9.81))
        .unwrap();
    assert_same_regressor(&upright, &turned);
}

#[test]
fn identity_angles_in_degrees_are_angles_in_radians() {
    let degrees = robot(
        "ModifiedDh([(name: \"a\", frame: (alpha: 90, theta: 45), limits: (position: (-90, 180), velocity: 180, acceleration: 360))])",
    );
    let radians = file(
        "ModifiedDh([(name: \"a\", frame: (alpha: 1.5707963267948966, theta: 0.7853981633974483),
            limits: (position: (-1.5707963267948966, 3.141592653589793), velocity: 3.141592653589793, acceleration: 6.283185307179586))])",
    )
    .replace("Degrees", "Radians");
    assert_eq!(degrees, robot_from_ron(&radians).unwrap());
}

#[test]
fn identity_limits_of_a_prismatic_joint_are_metres() {
    let robot = robot(
        "ModifiedDh([(name: \"a\", kind: Prismatic, frame: (), limits: (position: (-0.5, 0.5), velocity: 2))])",
    );
    let joint = &robot.joints()[0];
    assert_eq!(joint.kind, JointKind::Prismatic);
    assert_eq!(joint.limits.position, Some([-0.5, 0.5]));
    assert_eq!(joint.limits.velocity, Some(2.0));
}

#[test]
fn identity_both_forms_of_inertial_values_agree() {
    let inertia = Matrix3::new(0.3, 0.01, 0.02, 0.01, 0.4, 0.03, 0.02, 0.03, 0.5);
    let expected =
        InertialParameters::from_centre_of_mass(2.0, Vector3::new(0.1, 0.2, 0.3), &inertia);
    let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = expected.0;
    let centre = robot(
        "ModifiedDh([(name: \"a\", frame: (), inertial: CentreOfMass(mass: 2, centre: (0.1, 0.2, 0.3),
            inertia: (xx: 0.3, yy: 0.4, zz: 0.5, xy: 0.01, xz: 0.02, yz: 0.03)))])",
    );
    let origin = robot(&format!(
        "ModifiedDh([(name: \"a\", frame: (), inertial: Standard(XX: {xx}, XY: {xy}, XZ: {xz}, YY: {yy}, YZ: {yz},
            ZZ: {zz}, MX: {mx}, MY: {my}, MZ: {mz}, M: {m}))])"
    ));
    assert_eq!(centre.links()[0].inertial, Some(expected));
    assert_eq!(origin.links()[0].inertial, Some(expected));
}

const HAND: &str = "ModifiedDh([
    (name: \"shoulder\", frame: (), inertial: CentreOfMass(mass: 3, centre: (0.1, 0.2, 0.3), inertia: (xx: 1, yy: 1, zz: 1))),
    (name: \"mount\", link: \"flange\", kind: Fixed, frame: (alpha: 30, d: 0.4, theta: 50, r: 0.1)),
    (name: \"elbow\", frame: (alpha: -90, d: 0.2), inertial: CentreOfMass(mass: 2, centre: (0, 0.1, 0.1), inertia: (xx: 0.3, yy: 0.4, zz: 0.5))),
    (name: \"camera\", link: \"lens\", parent: \"flange\", kind: Fixed, frame: (d: 0.3), inertial: CentreOfMass(mass: 1, centre: (0, 0, 0.1), inertia: (xx: 0.1, yy: 0.1, zz: 0.1))),
    (name: \"finger\", parent: \"link1\", frame: (alpha: 90, gamma: 20, b: 0.3), inertial: CentreOfMass(mass: 0.5, centre: (0.1, 0, 0), inertia: (xx: 0.1, yy: 0.1, zz: 0.1))),
])";

#[test]
fn identity_fixed_joints_fold_into_their_parents_and_say_so() {
    let folded = robot(HAND);
    let names: Vec<&str> = folded.joints().iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["shoulder", "elbow", "finger"]);
    assert_eq!(folded.joints()[1].parent, Some(0));
    assert_eq!(folded.joints()[2].parent, Some(0));
    assert_eq!(folded.links()[0].inertial.unwrap().mass(), 4.0);
    assert_eq!(
        folded.notes(),
        [
            "fixed links without inertial, which contribute nothing: flange",
            "fixed links folded into the link that carries them: lens into link1",
        ]
    );
    // The same arm, the fixed joints moving joints that stand still: the torques of the others agree.
    let moving = robot(&HAND.replace("kind: Fixed, ", ""));
    let mut parameters = vec![0.0; 50];
    for (i, link) in moving.links().iter().enumerate() {
        let own = link.inertial.unwrap_or(InertialParameters::ZERO);
        parameters[10 * i..][..10].copy_from_slice(&own.0);
    }
    assert_held_agree(&moving, &parameters, &folded, [0, 2, 4], [0.0, 0.0]);
}

/// The torques of `reduced` are those of `full` at `kept` while its joints 1 and 3 stand at `held`.
fn assert_held_agree(
    full: &Robot,
    parameters: &[f64],
    reduced: &Robot,
    kept: [usize; 3],
    held: [f64; 2],
) {
    let (q, qd, qdd) = ([0.3, -0.7, 1.1], [1.0, 2.0, -1.5], [3.0, -4.0, 5.0]);
    let spread = |values: [f64; 3], others: [f64; 2]| {
        let mut all = vec![0.0; 5];
        kept.iter().zip(values).for_each(|(&k, v)| all[k] = v);
        (all[1], all[3]) = (others[0], others[1]);
        all
    };
    let state = JointState {
        q: spread(q, held),
        qd: spread(qd, [0.0; 2]),
        qdd: spread(qdd, [0.0; 2]),
    };
    let all = inverse_dynamics(&Model::new(full), parameters, &state);
    let own = reduced.standard_parameters().unwrap();
    let state = JointState {
        q: q.to_vec(),
        qd: qd.to_vec(),
        qdd: qdd.to_vec(),
    };
    let torque = inverse_dynamics(&Model::new(reduced), &own, &state);
    for (i, &k) in kept.iter().enumerate() {
        assert!(
            (torque[i] - all[k]).abs() < TOLERANCE * all[k].abs().max(1.0),
            "joint {k}"
        );
    }
}

#[test]
fn identity_held_joints_fold_at_their_position_and_say_so() {
    let five = HAND.replace("kind: Fixed, frame: (alpha: 30", "frame: (alpha: 30").replace(
        "theta: 50, r: 0.1)",
        "theta: 50, r: 0.1), limits: (position: (-10, 10)), inertial: Standard(XX: 0, XY: 0, XZ: 0, YY: 0, YZ: 0, ZZ: 0, MX: 0, MY: 0, MZ: 0, M: 0)",
    );
    let five = robot(&five.replace("kind: Fixed, ", ""));
    let held = five
        .hold_joints(&[("mount".into(), 0.4), ("camera".into(), -0.2)])
        .unwrap();
    let parameters = five.standard_parameters().unwrap();
    assert_held_agree(&five, &parameters, &held, [0, 2, 4], [0.4, -0.2]);
    assert!(
        held.notes()[0].starts_with("joint mount is held at 0.4"),
        "{:?}",
        held.notes()
    );
    assert!(
        held.notes()[1].contains("outside its limits"),
        "{:?}",
        held.notes()
    );
}

#[test]
fn regress_rounded_angles_become_exact_and_are_reported() {
    let text =
        file("ModifiedDh([(name: \"a\", frame: (alpha: 1.5708))])").replace("Degrees", "Radians");
    let robot = robot_from_ron(&text).unwrap();
    assert_eq!(robot.joints()[0].parent_from_joint.rotation[(1, 1)], 0.0);
    assert_eq!(robot.notes().len(), 1);
    assert!(
        robot.notes()[0].contains("pi/12 moved onto it: joint a"),
        "{:?}",
        robot.notes()
    );
}

#[test]
fn regress_an_impossible_inertia_is_kept_and_reported() {
    let robot = robot(
        "ModifiedDh([(name: \"a\", frame: (), inertial: CentreOfMass(mass: 1, centre: (0, 0, 0), inertia: (xx: 1, yy: 1, zz: 3)))])",
    );
    assert_eq!(robot.links()[0].inertial.unwrap().0[5], 3.0);
    let note = &robot.notes()[0];
    assert!(
        note.contains("link link1: no rigid body has this inertial") && note.contains("33.33 %"),
        "{note}"
    );
}

/// The published values of two links of the PUMA 560 are such: no mass of link 1, a rounded link 3.
#[test]
fn regress_published_puma_values_are_reported_where_impossible() {
    let notes = robot_from_ron(idim_fixtures::PUMA560)
        .unwrap()
        .notes()
        .to_vec();
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("link1") && notes[0].contains("mass 0"));
    assert!(notes[1].contains("link3") && notes[1].contains("8.72 %"));
}
