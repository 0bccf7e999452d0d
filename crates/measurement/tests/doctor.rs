//! Faults planted in a good log are found and named; a good log raises no alarm.
#![allow(clippy::unwrap_used)]

mod common;
mod faults;

use common::robot;
use faults::{FAULTS, VELOCITY_FAULTS, drive, late, missed, names, scale, synthetic};
use idim_measurement::doctor::{Finding, Severity, examine_log, examine_torque, torque_lag};
use idim_measurement::{ConditioningOptions, Drive, LowPass, Measurements, condition};
use idim_model::Robot;

#[test]
fn a_good_log_raises_no_alarm() {
    let found = examine_log(&synthetic(), &robot(&["j1", "j2", "j3"]));
    assert!(
        found.iter().all(|f| f.severity == Severity::Note),
        "{found:#?}"
    );
    assert!(
        found
            .iter()
            .any(|f| f.code == "sample-rate" && f.value.is_some_and(|v| (v - 200.0).abs() < 1e-6)),
        "{found:#?}"
    );
}

#[test]
fn planted_faults_are_named_with_their_joint() {
    let log = synthetic();
    assert_eq!(missed(&log, &FAULTS), Vec::<String>::new());
    assert_eq!(missed(&log, &VELOCITY_FAULTS), Vec::<String>::new());
}

#[test]
fn a_finding_says_place_value_rule_and_next_step() {
    let mut log = synthetic();
    scale(&mut drive(&mut log)[1], -1.0);
    let found = examine_log(&log, &robot(&["j1", "j2", "j3"]));
    let text = found[0].to_string();
    for part in [
        "error [torque-sign] run.csv, joint j2: friction drives the motion",
        "friction opposes motion",
        "change the sign of this joint's torque",
    ] {
        assert!(text.contains(part), "`{part}` is missing in: {text}");
    }
    let json = serde_json::to_value(&found[0]).unwrap();
    assert_eq!(json["code"], "torque-sign");
    assert_eq!(json["severity"], "error");
    assert_eq!(json["place"]["joint"], "j2");
    assert_eq!(json["value"], -1.0);
    let unreadable = common::read("t,q1\n").unwrap_err();
    let finding = Finding::from(&unreadable);
    assert_eq!(
        (finding.code, finding.severity),
        ("missing-column", Severity::Error)
    );
    assert!(finding.next_step.contains("closest names") || finding.rule.contains("name it"));
}

type Change = fn(&mut Measurements);

fn against_prediction(change: impl Fn(&mut Measurements)) -> Vec<Finding> {
    let log = synthetic();
    let plain = robot(&["j1", "j2", "j3"]);
    let mut joints = plain.joints().to_vec();
    for joint in &mut joints {
        joint.actuator.torque_constant = Some(0.07);
    }
    let arm = Robot::new("arm", plain.gravity(), joints, plain.links().to_vec()).unwrap();
    let mut measured = Measurements::from_log(&log, &arm).unwrap();
    change(&mut measured);
    let low_pass = Some(LowPass {
        order: 4,
        cutoff: 10.0,
    });
    let options = ConditioningOptions {
        low_pass,
        ..ConditioningOptions::default()
    };
    let segment = condition(&measured, &options).unwrap().segments.remove(0);
    // A prior with masses half as large again, without inertia or friction.
    let predicted: Vec<Vec<f64>> = [30.0, 15.0, 10.0]
        .iter()
        .enumerate()
        .map(|(j, load)| segment.states.q(j).iter().map(|q| load * q.cos()).collect())
        .collect();
    examine_torque(&segment, &predicted, &arm, "run.csv")
}

#[test]
fn a_prediction_tells_signs_scales_order_and_compensation() {
    let found = against_prediction(|_| {});
    assert!(found.is_empty(), "{found:#?}");
    let cases: [(Change, &str, Option<&str>); 7] = [
        (|m| scale(&mut m.torque[1], -1.0), "torque-sign", Some("j2")),
        (|m| scale(&mut m.torque[0], 1e3), "torque-unit", Some("j1")),
        (|m| scale(&mut m.torque[2], 0.01), "gear-side", Some("j3")),
        (
            |m| scale(&mut m.torque[0], 1.0 / 7.0),
            "torque-is-current",
            Some("j1"),
        ),
        (|m| scale(&mut m.torque[0], 8.0), "torque-scale", Some("j1")),
        (|m| m.torque.swap(0, 2), "joint-order", Some("j3")),
        (
            |m| {
                for (j, load) in [20.0, 10.0, 20.0 / 3.0].into_iter().enumerate() {
                    for (x, q) in m.torque[j].iter_mut().zip(&m.q[j]) {
                        *x -= load * q.cos();
                    }
                }
            },
            "gravity-compensated",
            None,
        ),
    ];
    for (change, code, joint) in cases {
        let found = against_prediction(change);
        assert!(names(&found, code, joint), "{code}: {found:#?}");
    }
}

#[test]
fn identity_the_lag_behind_given_columns_is_found() {
    let log = synthetic();
    let (Drive::Torque(torque), Some(qd)) = (&log.drive, &log.qd) else {
        panic!("torque and velocity")
    };
    let qdd = idim_measurement::first_difference(
        &idim_measurement::filter_zero_phase(
            &idim_measurement::butterworth(2, 10.0, 200.0),
            &qd[0],
        ),
        0.005,
    );
    let columns = vec![
        vec![1.0; 4000],
        log.q[0].iter().map(|q| q.cos()).collect(),
        qd[0].clone(),
        qd[0].iter().map(|v| (v / 0.01).tanh()).collect(),
        qdd,
    ];
    let mut late_torque = torque[0].clone();
    assert!(
        torque_lag(&late_torque, &columns, 0.005, 0.06)
            .unwrap()
            .abs()
            < 1e-3
    );
    late(&mut late_torque, 0.02, &log.time);
    let lag = torque_lag(&late_torque, &columns, 0.005, 0.06).unwrap();
    assert!((lag - 0.02).abs() < 1e-3, "{lag}");
}
