//! What others get of a model: robots that move the same, values that say where they are from.
#![allow(clippy::unwrap_used)]

use idim::export::{Source, complete, exports};
use idim::{Identification, IdentifyOptions, LoadedRobot, identify};
use idim_measurement::Measurements;
use idim_model::{
    DriveColumns, JointStates, Model, Robot, inverse_dynamics_batch, random_states, robot_from_ron,
    robot_from_urdf,
};
use std::path::Path;

/// The arm of the tutorial, identified from a log of its own with a little noise.
fn tutorial_arm() -> (Robot, Identification) {
    let text = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/tutorials/arm.urdf"),
    )
    .unwrap();
    let robot = robot_from_urdf(&text).unwrap();
    let states = random_states(&robot, 2000, 3);
    let torque = inverse_dynamics_batch(
        &Model::new(&robot),
        &robot.standard_parameters().unwrap(),
        &states,
    );
    let n = states.n_samples();
    let series = |of: fn(&JointStates, usize) -> &[f64]| {
        (0..4).map(|j| of(&states, j).to_vec()).collect::<Vec<_>>()
    };
    let mut torque: Vec<Vec<f64>> = torque.chunks_exact(n).map(<[f64]>::to_vec).collect();
    for (j, t) in torque.iter_mut().enumerate() {
        let a = robot.joints()[j].actuator;
        for (k, t) in t.iter_mut().enumerate() {
            let v = states.qd(j)[k];
            let ripple = 0.3 * ((k * (j + 3)) as f64 * 1.618).sin();
            *t +=
                a.viscous_friction.unwrap() * v + a.coulomb_friction.unwrap() * v.signum() + ripple;
        }
    }
    let log = Measurements {
        file: "simulated".into(),
        joints: robot.joints().iter().map(|j| j.name.clone()).collect(),
        time: (0..n).map(|k| 0.01 * k as f64).collect(),
        q: series(JointStates::q),
        qd: Some(series(JointStates::qd)),
        qdd: Some(series(JointStates::qdd)),
        torque,
    };
    let loaded = LoadedRobot {
        described: robot.clone(),
        robot: robot.clone(),
    };
    let columns = DriveColumns {
        rotor: false,
        ..DriveColumns::ALL
    };
    let options = IdentifyOptions {
        columns,
        sampling: idim::SamplingOptions {
            as_recorded: true,
            ..idim::SamplingOptions::default()
        },
        seed: 1,
        ..IdentifyOptions::default()
    };
    let found = identify(&loaded, vec![log], Vec::new(), &options).unwrap();
    (robot, found)
}

#[test]
fn identity_completed_robots_move_as_the_data_say() {
    let (robot, found) = tutorial_arm();
    let files = exports(&found, &robot);
    let text = |name: &str| &files.iter().find(|f| f.0 == name).unwrap().1;
    let completion = complete(&found, &robot).unwrap();
    assert_eq!(completion.widened, 1.0);
    // The mass of the first link is felt by nobody, the last link's first moment by everybody.
    assert_eq!(
        (completion.sources[0][9], completion.sources[3][6]),
        (Source::Prior, Source::Data)
    );

    let states = random_states(&robot, 40, 11);
    let torque = |robot: &Robot| {
        inverse_dynamics_batch(
            &Model::new(robot),
            &robot.standard_parameters().unwrap(),
            &states,
        )
    };
    let ron = robot_from_ron(text("model/robot.ron")).unwrap();
    let urdf = robot_from_urdf(text("model/robot.urdf")).unwrap();
    let (truth, a, b) = (torque(&robot), torque(&ron), torque(&urdf));
    let largest = truth.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for k in 0..truth.len() {
        // The two files describe one robot; it is the true one but for the ripple.
        assert!(
            (a[k] - b[k]).abs() < 1e-9 * largest,
            "{} against {}",
            a[k],
            b[k]
        );
        assert!(
            (a[k] - truth[k]).abs() < 0.01 * largest,
            "{} instead of {}",
            a[k],
            truth[k]
        );
    }
    let friction = urdf.joints()[1].actuator;
    assert!(
        (friction.viscous_friction.unwrap() - 4.0).abs() < 0.1
            && (friction.coulomb_friction.unwrap() - 5.0).abs() < 0.1
    );
    let yaml = text("model/parameters.yaml");
    for words in [
        "schema: idim-parameters/1",
        "relation: ZZR1 = ",
        "source: prior",
        "source: combination",
        "viscous_friction:",
    ] {
        assert!(yaml.contains(words), "`{words}` is not in {yaml}");
    }
}
