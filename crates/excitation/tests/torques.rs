//! The proof of torques where the robot file has springs and coupled motors.
#![allow(clippy::unwrap_used)]

use idim_excitation::{Error, FourierOptions, TorquePrior, optimise_fourier};
use idim_model::{
    Columns, Model, Parameter, ParameterKind, Robot, inverse_dynamics, robot_from_ron,
};
use idim_trajectory::Limits;

/// A planar arm whose second motor also turns with the first joint; `more` are further fields of the file.
fn arm(more: &str) -> Robot {
    let text = format!(
        "(
            name: \"planar\", angles: Radians, gravity: (0, -9.81, 0), {more}
            joints: StandardDh([
                (name: \"a\", frame: (a: 0.5),
                 limits: (position: (-1.5, 1.5), velocity: 2, acceleration: 8, torque: 60),
                 actuator: (gear_ratio: 50, rotor_inertia: 2e-4, viscous_friction: 0.2, coulomb_friction: 0.5),
                 inertial: CentreOfMass(mass: 2, centre: (-0.25, 0, 0), inertia: (xx: 0.01, yy: 0.05, zz: 0.05))),
                (name: \"b\", frame: (a: 0.4),
                 limits: (position: (-2.5, 2.5), velocity: 3, acceleration: 10, torque: 20),
                 actuator: (gear_ratio: 40, rotor_inertia: 3e-4, coupled: {{\"a\": 60}}),
                 inertial: CentreOfMass(mass: 1, centre: (-0.2, 0, 0), inertia: (xx: 0.005, yy: 0.02, zz: 0.02))),
            ]),
        )"
    );
    robot_from_ron(&text).unwrap()
}

const SPRINGS: &str = "known_torques: [
    (name: \"balance\", joint: \"a\", formula: \"12*sqrt(1.2 - cos(q - 0.3))*sin(q)\"),
    (name: \"stop\", joint: \"b\", table: [(-2, 6), (-1, 0), (1, 0), (2, -6)]),
],";

fn columns() -> Columns {
    use ParameterKind::{MX, MY, ZZ};
    let named = [(ZZ, 0), (MX, 0), (MY, 0), (ZZ, 1), (MX, 1), (MY, 1)];
    Columns(
        named
            .map(|(kind, index)| Parameter { kind, index })
            .to_vec(),
    )
}

fn options(robot: &Robot) -> FourierOptions {
    FourierOptions {
        period: 6.0,
        n_harmonics: 3,
        n_samples: 60,
        n_starts: 2,
        n_rounds: 0,
        torque: Some(TorquePrior::new(robot, 0.8).unwrap()),
        ..FourierOptions::default()
    }
}

#[test]
fn identity_springs_and_coupled_motors_count_against_the_torque_limits() {
    let robot = arm(SPRINGS);
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let found = optimise_fourier(&model, &columns(), &limits, &options(&robot)).unwrap();
    let certificate = found.torque.unwrap();
    let inertial = robot.standard_parameters().unwrap();
    let states = found.series.equispaced_states(6000);
    let mut most: [f64; 2] = [0.0; 2];
    for k in 0..6000 {
        let s = states.state(k);
        let tau = inverse_dynamics(&model, &inertial, &s);
        // Written out: motor 2 turns 60 a and 40 b.
        let (first, second) = (50.0 * s.qdd[0], 60.0 * s.qdd[0] + 40.0 * s.qdd[1]);
        let rotors = [
            50.0 * 2e-4 * first + 60.0 * 3e-4 * second,
            40.0 * 3e-4 * second,
        ];
        let balance = 12.0 * (1.2 - (s.q[0] - 0.3).cos()).sqrt() * s.q[0].sin();
        let stop = -6.0 * s.q[1].signum() * (s.q[1].abs() - 1.0).clamp(0.0, 1.0);
        let torque = [
            tau[0] + rotors[0] + balance + 0.2 * s.qd[0],
            tau[1] + rotors[1] + stop,
        ];
        let used = [(torque[0].abs() + 0.5) / 60.0, torque[1].abs() / 20.0];
        for j in 0..2 {
            most[j] = most[j].max(used[j]);
            let bound = certificate.joints[j].unwrap().bound;
            assert!(used[j] <= bound && bound <= 0.8, "{}, {bound}", used[j]);
        }
    }
    // What the certificate says was found is what is there, to what lies between its samples.
    for j in 0..2 {
        let stated = certificate.joints[j].unwrap().fraction;
        assert!((stated - most[j]).abs() < 0.01, "{stated}, {}", most[j]);
    }
}

#[test]
fn regress_a_spring_stronger_than_the_joint_is_never_certified() {
    let robot =
        arm("known_torques: [(name: \"spring\", joint: \"a\", table: [(-1, 200), (1, 201)])],");
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let found = optimise_fourier(&model, &columns(), &limits, &options(&robot));
    assert!(
        matches!(found, Err(Error::NoFeasibleMotion { .. })),
        "{found:?}"
    );
}

#[test]
fn regress_what_cannot_be_bounded_is_refused_by_name() {
    let pole = arm("known_torques: [(name: \"pole\", joint: \"a\", formula: \"1/(q - 0.1)\")],");
    let message = TorquePrior::new(&pole, 0.8).unwrap_err().to_string();
    assert!(
        message.contains("known torque pole on joint a"),
        "{message}"
    );
    let text = "(
        name: \"one\", angles: Radians, gravity: (0, -9.81, 0),
        joints: StandardDh([
            (name: \"a\", frame: (a: 0.5), limits: (torque: 30), actuator: (rotor_inertia: 2e-4),
             inertial: CentreOfMass(mass: 2, centre: (-0.25, 0, 0), inertia: (xx: 0.01, yy: 0.05, zz: 0.05))),
        ]),
    )";
    let robot = robot_from_ron(text).unwrap();
    let message = TorquePrior::new(&robot, 0.8).unwrap_err().to_string();
    assert!(message.contains("gear_ratio"), "{message}");
}
