//! Torque, regressors and energies against Pinocchio, on random trees and on known robots, from the URDF text on.

#![allow(clippy::unwrap_used)]

use idim_model::{
    Columns, JointState, Model, Robot, energy_regressor, inverse_dynamics, robot_from_urdf_with,
    torque_regressor,
};
use serde_json::Value;

/// Relative to the largest entry of what is compared: two programs, the same doubles in.
const TOLERANCE: f64 = 1e-12;

fn oracles() -> Vec<Value> {
    let text = include_str!("../../../fixtures/oracles/pinocchio.json");
    let file: Value = serde_json::from_str(text).unwrap();
    file["robots"].as_array().unwrap().clone()
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

fn read(oracle: &Value) -> Robot {
    let held = oracle["held"].as_array().unwrap().iter();
    let held: Vec<(String, f64)> = held
        .map(|pair| {
            (
                pair[0].as_str().unwrap().to_owned(),
                pair[1].as_f64().unwrap(),
            )
        })
        .collect();
    robot_from_urdf_with(oracle["urdf"].as_str().unwrap(), &held).unwrap()
}

/// Place in Pinocchio's order of each of our joints.
fn theirs(oracle: &Value, robot: &Robot) -> Vec<usize> {
    let names: Vec<&str> = oracle["joints"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_str().unwrap())
        .collect();
    assert_eq!(names.len(), robot.n_joints(), "{}", oracle["name"]);
    let place = |name: &str| names.iter().position(|n| *n == name).unwrap();
    robot.joints().iter().map(|j| place(&j.name)).collect()
}

/// `values` in blocks of `width`, brought into our order of joints.
fn ours(values: &[f64], order: &[usize], width: usize) -> Vec<f64> {
    order
        .iter()
        .flat_map(|&j| values[j * width..][..width].iter().copied())
        .collect()
}

#[track_caller]
fn assert_close(what: &str, ours: &[f64], theirs: &[f64]) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    let scale = theirs.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (k, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!(
            (a - b).abs() <= TOLERANCE * scale,
            "{what}, entry {k}: {a} against {b}"
        );
    }
}

fn check(oracle: &Value) {
    let name = oracle["name"].as_str().unwrap();
    let robot = read(oracle);
    let order = theirs(oracle, &robot);
    let model = Model::new(&robot);
    let columns = Columns::inertial(robot.n_joints());
    let parameters = ours(&numbers(&oracle["parameters"]), &order, 10);
    // What the reader made of the inertial values, fixed links folded.
    let stated = robot.standard_parameters().unwrap();
    assert_close(&format!("{name}, parameters"), &stated, &parameters);
    for state in oracle["states"].as_array().unwrap() {
        let [q, qd, qdd] = ["q", "qd", "qdd"].map(|key| ours(&numbers(&state[key]), &order, 1));
        let torque = ours(&numbers(&state["torque"]), &order, 1);
        let state_here = JointState { q, qd, qdd };
        let computed = inverse_dynamics(&model, &parameters, &state_here);
        assert_close(&format!("{name}, torque"), &computed, &torque);

        let rows: Vec<Vec<f64>> = state["regressor"]
            .as_array()
            .unwrap()
            .iter()
            .map(numbers)
            .collect();
        let regressor = torque_regressor(&model, &columns, &state_here);
        let computed: Vec<f64> = regressor.transpose().iter().copied().collect();
        let expected: Vec<f64> = order
            .iter()
            .flat_map(|&j| ours(&rows[j], &order, 10))
            .collect();
        assert_close(&format!("{name}, regressor"), &computed, &expected);

        let energy = energy_regressor(&model, &columns, &state_here.q, &state_here.qd);
        let expected = ours(&numbers(&state["energy_regressor"]), &order, 10);
        assert_close(&format!("{name}, energy regressor"), &energy, &expected);

        let [kinetic, potential] =
            ["kinetic_energy", "potential_energy"].map(|key| state[key].as_f64().unwrap());
        let total: f64 = energy.iter().zip(&parameters).map(|(h, p)| h * p).sum();
        let scale = kinetic.abs() + potential.abs();
        assert!(
            (total - kinetic - potential).abs() <= TOLERANCE * scale,
            "{name}, energy"
        );
    }
}

#[test]
fn oracle_pinocchio_agrees_on_random_trees() {
    let trees: Vec<Value> = oracles()
        .into_iter()
        .filter(|o| o["name"].as_str().unwrap().starts_with("tree"))
        .collect();
    assert!(trees.len() >= 30);
    for tree in &trees {
        check(tree);
    }
}

#[test]
fn oracle_pinocchio_agrees_on_known_robots() {
    let known: Vec<Value> = oracles()
        .into_iter()
        .filter(|o| !o["name"].as_str().unwrap().starts_with("tree"))
        .collect();
    assert_eq!(known.len(), 6);
    for robot in &known {
        check(robot);
    }
}
