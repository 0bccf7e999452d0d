//! A path through exciting points keeps torques and distances where the robot file has what it takes.
#![allow(clippy::unwrap_used)]

mod command;

use command::run;
use idim_excitation::{Clearance, TorquePrior};
use idim_model::{Model, inverse_dynamics_batch, robot_from_ron};
use idim_trajectory::{Motion, TrajectoryFile};

/// An upright arm of two links beside a post.
fn robot(post: &str) -> String {
    format!(
        "(
            name: \"planar\", angles: Radians, gravity: (0, -9.81, 0),
            obstacles: [(from: ({post}, -1), to: ({post}, 1), radius: 0.05)],
            joints: StandardDh([
                (name: \"a\", frame: (a: 0.5),
                 limits: (position: (-1.5, 1.5), velocity: 2, acceleration: 8, torque: 17),
                 actuator: (viscous_friction: 0.2, coulomb_friction: 0.5),
                 inertial: CentreOfMass(mass: 2, centre: (-0.25, 0, 0), inertia: (xx: 0.01, yy: 0.05, zz: 0.05)),
                 capsules: [(from: (-0.5, 0, 0), to: (0, 0, 0), radius: 0.05)]),
                (name: \"b\", frame: (a: 0.4),
                 limits: (position: (-2.5, 2.5), velocity: 3, acceleration: 10, torque: 3),
                 inertial: CentreOfMass(mass: 1, centre: (-0.2, 0, 0), inertia: (xx: 0.005, yy: 0.02, zz: 0.02)),
                 capsules: [(from: (-0.4, 0, 0), to: (0, 0, 0), radius: 0.04)]),
            ]),
        )"
    )
}

/// What the command says of this robot, and where its results are.
fn points(folder: &tempfile::TempDir, text: &str, more: &[&str]) -> Result<String, String> {
    let file = folder.path().join("planar.ron");
    std::fs::write(&file, text).unwrap();
    let out = folder.path().join("out");
    let files = [
        "excite",
        "--family",
        "points",
        "--robot",
        file.to_str().unwrap(),
    ];
    let quick = [
        "--starts",
        "2",
        "--rounds",
        "1",
        "--out",
        out.to_str().unwrap(),
    ];
    run(&[&files[..], &quick, more].concat())
}

#[test]
fn identity_paths_through_points_keep_torques_and_distances() {
    let folder = tempfile::tempdir().unwrap();
    let text = robot("0.45, 0.45");
    let read =
        |name: &str| std::fs::read_to_string(folder.path().join("out/planar").join(name)).unwrap();
    let robot = robot_from_ron(&text).unwrap();
    let (model, inertial) = (Model::new(&robot), robot.standard_parameters().unwrap());
    let clearance = Clearance::new(&robot, 0.02).unwrap().unwrap();
    let prior = TorquePrior::new(&robot, 0.8).unwrap();
    let looked_at = || {
        let Motion::Quintic(path) = TrajectoryFile::from_ron(&read("motion.ron"))
            .unwrap()
            .motion()
            .unwrap()
        else {
            panic!("not a path");
        };
        let n = 2000 * path.n_segments();
        let times: Vec<f64> = (0..n)
            .map(|k| path.duration() * k as f64 / n as f64)
            .collect();
        let states = path.states(&times);
        let tau = inverse_dynamics_batch(&model, &inertial, &states);
        let mut used = [0.0_f64; 2];
        for (j, joint) in robot.joints().iter().enumerate() {
            let viscous = joint.actuator.viscous_friction.unwrap_or(0.0);
            let coulomb = joint.actuator.coulomb_friction.unwrap_or(0.0);
            for (tau, qd) in tau[n * j..].iter().zip(states.qd(j)) {
                used[j] = used[j].max(((tau + viscous * qd).abs() + coulomb) / prior.limit(j));
            }
        }
        let nearest = clearance.nearest(&states).into_iter().map(|n| n.1);
        (used, nearest.fold(f64::INFINITY, f64::min))
    };
    points(
        &folder,
        &text,
        &[
            "--torque-share",
            "0",
            "--may-touch",
            "base,link2",
            "--may-touch",
            "base,link1",
        ],
    )
    .unwrap();
    // Without them both are broken: they are what holds the path.
    let (used, least) = looked_at();
    assert!(
        used[0].max(used[1]) > 0.8 && least < 0.02,
        "{used:?} {least}"
    );
    let said = points(&folder, &text, &[]).unwrap();
    assert!(
        said.contains("torques: by the inertial values") && said.contains("clearance: "),
        "{said}"
    );
    let (used, least) = looked_at();
    let certificate: serde_json::Value = serde_json::from_str(&read("certificate.json")).unwrap();
    for (j, used) in used.into_iter().enumerate() {
        let bound = certificate["joints"][j]["torque"]["bound"]
            .as_f64()
            .unwrap();
        assert!(
            used <= bound && bound <= 0.8,
            "joint {}: {used}, {bound}",
            j + 1
        );
    }
    let bound = certificate["clearance"]["bound"].as_f64().unwrap();
    assert!(least >= bound && bound >= 0.02, "{least}, {bound}");
    assert_eq!(certificate["torque_share"], 0.8);
    assert!(certificate["certified"].as_bool().unwrap());
    // Without time for more than one search the points are drawn in until the path keeps all of it.
    points(&folder, &text, &["--time-budget", "0.05"]).unwrap();
    let (used, least) = looked_at();
    assert!(
        used[0].max(used[1]) <= 0.8 && least >= 0.02,
        "{used:?} {least}"
    );
}

#[test]
fn regress_where_no_path_can_begin_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |text: &str, more: &[&str], words: &[&str]| {
        let message = points(&folder, text, more).unwrap_err();
        for word in words {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
        assert!(!folder.path().join("out").exists(), "{message}");
    };
    // A post where the arm stands amid its limits.
    refused(
        &robot("0.7, 0"),
        &[],
        &["amid the position limits", "--clearance", "--may-touch"],
    );
    refused(
        &robot("0.45, 0.45"),
        &["--torque-share", "0.2"],
        &["holds its weight", "joint a", "--torque-share"],
    );
}
