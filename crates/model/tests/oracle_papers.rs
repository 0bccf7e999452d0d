//! Regressors against an independent program written from the two papers.

#![allow(clippy::unwrap_used)]

use idim_model::{
    Columns, JointState, Model, Robot, energy_regressor, robot_from_ron, torque_regressor,
};
use serde_json::Value;

/// Relative to the largest entry; two programs, the same doubles in.
const TOLERANCE: f64 = 1e-13;

fn oracle() -> Value {
    let text = include_str!("../../../fixtures/oracles/papers_regressors.json");
    serde_json::from_str(text).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
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

fn assert_torque_regressor(robot: &Robot, arm: &Value) {
    let model = Model::new(robot);
    let samples = arm["samples"].as_array().unwrap();
    assert!(!samples.is_empty());
    for sample in samples {
        let [q, qd, qdd] = ["q", "qd", "qdd"].map(|key| numbers(&sample[key]));
        let regressor = torque_regressor(&model, &Columns::inertial(6), &JointState { q, qd, qdd });
        let ours: Vec<f64> = regressor.transpose().iter().copied().collect();
        let theirs: Vec<f64> = sample["torque"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(numbers)
            .collect();
        assert_close(arm["name"].as_str().unwrap(), &ours, &theirs);
    }
}

fn arm(name: &str) -> Value {
    let arms = oracle()["torque"].as_array().unwrap().clone();
    arms.into_iter().find(|a| a["name"] == name).unwrap()
}

#[test]
fn oracle_energy_regressor_of_gautier_and_khalil() {
    let model = Model::new(&robot_from_ron(idim_fixtures::PUMA3R).unwrap());
    let file = oracle();
    let samples = file["energy"].as_array().unwrap();
    assert_eq!(samples.len(), 12);
    for sample in samples {
        let (q, qd) = (numbers(&sample["q"]), numbers(&sample["qd"]));
        let row = energy_regressor(&model, &Columns::inertial(3), &q, &qd);
        assert_close("energy", &row, &numbers(&sample["energy"]));
    }
}

#[test]
fn oracle_torque_regressor_of_the_crs_a460_in_standard_dh() {
    let robot = robot_from_ron(idim_fixtures::CRS_A460).unwrap();
    assert_torque_regressor(&robot, &arm("SDH_CTU"));
}

/// Craig's names for the same convention: his `a` of the link before is `d` here, his `d` is `r`.
#[test]
fn oracle_torque_regressor_of_the_crs_a460_in_modified_dh() {
    let arm = arm("MDH");
    let [alpha, a, d, theta] = ["alpha", "a", "d", "off"].map(|key| numbers(&arm[key]));
    let joints: Vec<String> = (0..6)
        .map(|i| {
            let frame = format!(
                "alpha: {}, d: {}, r: {}, theta: {}",
                alpha[i], a[i], d[i], theta[i]
            );
            format!("(name: \"joint{}\", frame: ({frame})),", i + 1)
        })
        .collect();
    let text = format!(
        "(name: \"CRS\", angles: Radians, gravity: (0, 0, -9.81), joints: ModifiedDh([{}]))",
        joints.concat()
    );
    assert_torque_regressor(&robot_from_ron(&text).unwrap(), &arm);
}
