//! Transmission matrices and known torques of robot files.

#![allow(clippy::unwrap_used)]

use idim_model::{KnownTorque, LogSide, robot_from_ron, robot_to_ron};
use nalgebra::DVector;

/// Relative; a handful of operations.
const TOLERANCE: f64 = 1e-14;

#[test]
fn identity_power_is_the_same_on_both_sides_of_the_gears() {
    let robot = robot_from_ron(idim_fixtures::TX40).unwrap();
    let t = robot.transmission().unwrap();
    let (qd, motor_torque) = (
        DVector::from_fn(6, |i, _| (i as f64 + 1.0).sin()),
        DVector::from_fn(6, |i, _| (3.0 * i as f64).cos()),
    );
    let at_motors = motor_torque.dot(&(&t * &qd));
    let at_joints = (t.transpose() * &motor_torque).dot(&qd);
    assert!((at_motors - at_joints).abs() < TOLERANCE * at_motors.abs().max(100.0));
    // The wrist: motor 6 turns with joints 5 and 6, so joint 5 feels motor 6.
    assert_eq!((t[(5, 4)], t[(5, 5)], t[(4, 5)]), (32.0, 32.0, 0.0));
    assert_eq!(robot.drives().positions, LogSide::Motor);
}

#[test]
fn identity_drives_survive_the_file_and_back() {
    for text in [idim_fixtures::TX40, idim_fixtures::KR300] {
        let robot = robot_from_ron(text).unwrap();
        let back = robot_from_ron(&robot_to_ron(&robot)).unwrap();
        assert_eq!(back.drives(), robot.drives());
        assert_eq!(back.motor_zeros(), robot.motor_zeros());
    }
}

#[test]
fn identity_a_held_joint_turns_the_motors_coupled_to_it_by_a_constant() {
    let robot = robot_from_ron(idim_fixtures::TX40).unwrap();
    let held = robot.hold_joints(&[("joint_5".into(), 0.7)]).unwrap();
    // All joints at their zeros but joint 5: motor 6 reads 32 · 0.7, and its joint stands at zero.
    let motor_6 = 32.0 * 0.7;
    let q6 = motor_6 / held.transmission().unwrap()[(4, 4)] + held.motor_zeros()[4];
    assert!(q6.abs() < TOLERANCE);
    assert!(held.drives().couplings.is_empty());
    // Joint 2 held: the coupling of joints 5 and 6 moves one place up.
    let held = robot.hold_joints(&[("joint_2".into(), 0.7)]).unwrap();
    assert_eq!(held.transmission().unwrap()[(4, 3)], 32.0);
}

#[test]
fn identity_the_counterbalance_is_the_derivative_of_its_gas_energy() {
    // The makers' geometry: force p(x) A along the rod of length l(q), so torque = -d/dq ∫ p A dl up to its sign.
    let robot = robot_from_ron(idim_fixtures::KR300).unwrap();
    let torque = &robot.drives().known_torques[0];
    let (area, d, k) = (
        std::f64::consts::PI * (0.055_f64.powi(2) - 0.030_f64.powi(2)) / 4.0,
        0.8_f64,
        0.2_f64,
    );
    let energy = |q: f64| {
        let delta = q + 95_f64.to_radians();
        let stroke = (d * d + k * k - 2.0 * d * k * delta.cos()).sqrt() - (d - k);
        -(1.01 * 296.8 * 328.0 * 0.159) * (0.00096 - stroke * area).ln()
    };
    for q in [-1.5, -0.4, 0.0, 0.3, 1.1] {
        let h = 1e-4;
        let derivative = (energy(q + h) - energy(q - h)) / (2.0 * h);
        assert!((torque.at(q) / derivative - 1.0).abs() < 1e-6, "{q}");
    }
}

#[test]
fn identity_a_table_is_linear_between_its_points_and_constant_beyond() {
    let table =
        KnownTorque::from_table("spring", 0, vec![[-1.0, 4.0], [0.0, 0.0], [2.0, 1.0]]).unwrap();
    let values: Vec<f64> = [-3.0, -1.0, -0.25, 0.0, 1.0, 2.0, 9.0]
        .map(|q| table.at(q))
        .to_vec();
    assert_eq!(values, [4.0, 4.0, 1.0, 0.0, 0.5, 1.0, 1.0]);
}

fn file(joints: &str, rest: &str) -> String {
    format!(
        "(name: \"test\", angles: Degrees, gravity: (0, 0, -9.81), {rest} joints: ModifiedDh([{joints}]))"
    )
}

#[test]
fn regress_drives_that_cannot_be_are_refused() {
    let two = |a: &str, b: &str, rest: &str| {
        let joints = format!("(name: \"a\", frame: (){a}), (name: \"b\", frame: (d: 1){b})");
        robot_from_ron(&file(&joints, rest))
            .unwrap_err()
            .to_string()
    };
    let cases = [
        (
            two("", ", actuator: (coupled: {\"c\": 2})", ""),
            "no moving joint c",
        ),
        (
            two("", ", actuator: (coupled: {\"a\": 2})", ""),
            "gear_ratio",
        ),
        (
            two(
                ", actuator: (gear_ratio: 2)",
                ", actuator: (gear_ratio: 2, coupled: {\"b\": 2})",
                "",
            ),
            "own joint",
        ),
        (
            two(
                ", actuator: (gear_ratio: 2)",
                ", actuator: (gear_ratio: 2, coupled: {\"a\": 0})",
                "",
            ),
            "other than zero",
        ),
        (
            two(
                ", actuator: (gear_ratio: 2, coupled: {\"b\": 2})",
                ", actuator: (gear_ratio: 2, coupled: {\"a\": 2})",
                "",
            ),
            "singular",
        ),
        (two("", "", "log: (torques: Motor),"), "gear_ratio"),
        (
            two("", "", "known_torques: [(name: \"s\", joint: \"a\")],"),
            "table",
        ),
        (
            two(
                "",
                "",
                "known_torques: [(name: \"s\", joint: \"a\", formula: \"sin(x)\")],",
            ),
            "`x` is not known",
        ),
        (
            two(
                "",
                "",
                "known_torques: [(name: \"s\", joint: \"a\", formula: \"sin(q\")],",
            ),
            "no formula",
        ),
        (
            two(
                "",
                "",
                "known_torques: [(name: \"s\", joint: \"a\", table: [(1, 0), (0, 1)])],",
            ),
            "rise",
        ),
        (
            two(
                "",
                "",
                "known_torques: [(name: \"s\", joint: \"z\", formula: \"q\")],",
            ),
            "no moving joint z",
        ),
    ];
    for (message, part) in cases {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

#[test]
fn identity_a_range_holds_every_value_between_and_closes_on_them() {
    let table =
        KnownTorque::from_table("t", 0, vec![[-1.0, 2.0], [0.0, -3.0], [0.5, 4.0]]).unwrap();
    let formulas = [
        "3*sin(2*q) - q^3/4 + 1",
        "sqrt(1.3 - cos(q))*tanh(q) + abs(q - 0.2)",
        "exp(-q^2)/(2 + sin(q)) + atan(q)",
        "cos(q)^2 - 2^q + max(q, 0.1) - tan(q/4)",
        "-q^2 + PI*cosh(q) - ln(3 + q)*floor(3*q)",
    ];
    let quantity = vec![("l".to_owned(), "sqrt(0.5 + q^2)".to_owned())];
    let mut all = vec![table];
    all.extend(formulas.map(|f| KnownTorque::from_formula("f", 0, &[], f).unwrap()));
    all.push(KnownTorque::from_formula("g", 0, &quantity, "2*(l - 0.4)*q/l").unwrap());
    for (which, torque) in all.iter().enumerate() {
        for k in 0..200 {
            let low = -1.5 + 0.015 * f64::from(k);
            let high = low + 0.01 * f64::from(k % 20);
            let [least, most] = torque.range(low, high);
            for i in 0..=20 {
                let value = torque.at(low + (high - low) * f64::from(i) / 20.0);
                assert!(
                    least <= value && value <= most,
                    "{which}: {value} not in {least} .. {most}"
                );
            }
            // No steeper than 40 anywhere here but for the floor's steps, each at most 2 high.
            let steps = if which == 5 { 2.0 } else { 0.0 };
            assert!(
                most - least <= 40.0 * (high - low) + steps + 1e-12,
                "{which}: {least} .. {most}"
            );
        }
    }
    let pole = KnownTorque::from_formula("p", 0, &[], "1/q").unwrap();
    assert_eq!(pole.range(-0.1, 0.1), [f64::NEG_INFINITY, f64::INFINITY]);
    assert!(pole.range(0.1, 0.2)[1] < 11.0);
}
