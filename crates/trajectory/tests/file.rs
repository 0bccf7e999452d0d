//! Trajectory files and limits: round trips and refusals.
#![allow(clippy::unwrap_used)]

mod common;

use common::{config, limits, points, series};
use idim_trajectory::{Limits, Motion, QuinticPath, TrajectoryFile};
use proptest::prelude::*;

fn names(n: usize) -> Vec<String> {
    (1..=n).map(|j| format!("q{j}")).collect()
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn identity_numbers_survive_the_file_to_the_last_bit(s in series(), limits in limits(2), seed in 0..1000u64) {
        let path = QuinticPath::shortest(&points(&limits, seed, 3), &limits).unwrap();
        for motion in [Motion::Fourier(s), Motion::Quintic(path)] {
            let n = match &motion {
                Motion::Fourier(s) => s.n_joints(),
                Motion::Quintic(p) => p.n_joints(),
            };
            let file = TrajectoryFile::new(names(n), &motion, "a test");
            let ron = TrajectoryFile::from_ron(&file.to_ron()).unwrap();
            let json = TrajectoryFile::from_json(&file.to_json()).unwrap();
            prop_assert_eq!(&ron, &file);
            prop_assert_eq!(&json, &file);
            prop_assert_eq!(json.motion().unwrap(), motion);
        }
    }
}

const SMALL: &str = r#"(
    schema: "idim-trajectory/1",
    joints: ["q1"],
    motion: Fourier(omega: 1.0, q0: [0.0], a: [[1.0]], b: [[0.5]]),
)"#;

#[test]
fn identity_bad_files_are_refused_with_their_place() {
    assert!(TrajectoryFile::from_ron(SMALL).is_ok());
    let refused = |from: &str, to: &str| {
        assert!(SMALL.contains(from));
        TrajectoryFile::from_ron(&SMALL.replace(from, to))
            .unwrap_err()
            .to_string()
    };
    assert!(refused("trajectory/1", "trajectory/2").starts_with("schema: idim-trajectory/2"));
    assert!(refused("joints: [\"q1\"],", "joints: [\"q1\"], color: 3,").starts_with("line 3"));
    assert!(refused("[\"q1\"]", "[\"q1\", \"q2\"]").starts_with("joints: 2 names, 1 joints move"));
    assert!(refused("b: [[0.5]]", "b: [[]]").starts_with("joint 1: 1 sine and 0 cosine"));
    assert!(
        TrajectoryFile::from_json("{\n \"schema\": 1}")
            .unwrap_err()
            .to_string()
            .starts_with("line 2")
    );
}

#[test]
fn identity_a_path_whose_segments_do_not_meet_is_refused() {
    let limits = Limits::new(vec![[-1.0, 1.0]], vec![1.0], vec![1.0]).unwrap();
    let path = QuinticPath::shortest(&points(&limits, 1, 3), &limits).unwrap();
    let mut segments = path.coefficients();
    assert_eq!(QuinticPath::from_coefficients(&segments).unwrap(), path);
    segments[1].1[0][1] += 0.01;
    let error = QuinticPath::from_coefficients(&segments)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("segments 1 and 2, joint 1: velocity jumps"),
        "{error}"
    );
}

#[test]
fn identity_bad_limits_are_refused_with_their_place() {
    let refused = |p: [f64; 2], v: f64, a: f64| {
        Limits::new(vec![[-1.0, 1.0], p], vec![1.0, v], vec![1.0, a])
            .unwrap_err()
            .to_string()
    };
    assert!(refused([1.0, 1.0], 1.0, 1.0).starts_with("joint 2: position limits 1 to 1"));
    assert!(
        refused([0.0, f64::INFINITY], 1.0, 1.0).starts_with("joint 2: position limits 0 to inf")
    );
    assert!(refused([0.0, 1.0], 0.0, 1.0).starts_with("joint 2: velocity limit 0"));
    assert!(refused([0.0, 1.0], 1.0, f64::NAN).starts_with("joint 2: acceleration limit NaN"));
    let uneven = Limits::new(vec![[-1.0, 1.0]], vec![1.0], vec![]).unwrap_err();
    assert!(
        uneven
            .to_string()
            .contains("1 position, 1 velocity, 0 acceleration")
    );
}

#[test]
fn identity_limits_shrink_about_their_centre() {
    let limits = Limits::new(vec![[-1.0, 3.0]], vec![2.0], vec![5.0]).unwrap();
    let small = limits.scaled(0.5, 0.25, 0.1);
    assert_eq!(small.position, [[0.0, 2.0]]);
    assert_eq!((small.velocity[0], small.acceleration[0]), (0.5, 0.5));
    assert_eq!(limits.scaled(1.0, 1.0, 1.0), limits);
}

#[test]
fn identity_a_robot_without_an_acceleration_limit_names_the_joint() {
    use idim_model::{Actuator, Joint, JointKind, JointLimits, Link, Pose, Robot};
    let robot = |acceleration| {
        let joint = Joint {
            name: "elbow".into(),
            kind: JointKind::Revolute,
            parent: None,
            parent_from_joint: Pose::from_translation(0.0, 0.0, 0.0),
            axis: nalgebra::Vector3::new(0.0, 0.0, 1.0),
            offset: 0.0,
            joint_from_link: Pose::from_translation(0.0, 0.0, 0.0),
            limits: JointLimits {
                position: Some([-1.0, 2.0]),
                velocity: Some(3.0),
                acceleration,
                torque: None,
            },
            actuator: Actuator::default(),
        };
        let link = Link {
            name: "forearm".into(),
            inertial: None,
        };
        Robot::new("one", nalgebra::Vector3::zeros(), vec![joint], vec![link]).unwrap()
    };
    let limits = Limits::from_robot(&robot(Some(4.0))).unwrap();
    assert_eq!(
        limits,
        Limits::new(vec![[-1.0, 2.0]], vec![3.0], vec![4.0]).unwrap()
    );
    let error = Limits::from_robot(&robot(None)).unwrap_err().to_string();
    assert!(
        error.starts_with("joint elbow: no acceleration limit"),
        "{error}"
    );
}
