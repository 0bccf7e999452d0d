//! Robots and logs that the tests share.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]

use idim_measurement::{ColumnMapping, Error, JointLabel, Log, joint_labels, read_csv};
use idim_model::{Actuator, Joint, JointKind, JointLimits, Link, Pose, Robot};
use nalgebra::Vector3;

pub const FILE: &str = "run.csv";

/// Joints stacked on z, limits ±2 rad, gear ratio 100.
pub fn robot(names: &[&str]) -> Robot {
    let joints = names.iter().enumerate().map(|(i, name)| Joint {
        name: (*name).to_string(),
        kind: JointKind::Revolute,
        parent: i.checked_sub(1),
        parent_from_joint: Pose::identity(),
        axis: Vector3::z(),
        offset: 0.0,
        joint_from_link: Pose::identity(),
        limits: JointLimits {
            position: Some([-2.0, 2.0]),
            ..JointLimits::default()
        },
        actuator: Actuator {
            gear_ratio: Some(100.0),
            ..Actuator::default()
        },
    });
    let links = (1..=names.len()).map(|i| Link {
        name: format!("link{i}"),
        inertial: None,
    });
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    Robot::new("test", gravity, joints.collect(), links.collect()).unwrap()
}

pub fn two() -> Robot {
    robot(&["shoulder", "elbow"])
}

pub fn labels(robot: &Robot) -> Vec<JointLabel> {
    joint_labels(robot, robot)
}

pub fn read(text: &str) -> Result<Log, Error> {
    read_bytes(text.as_bytes())
}

pub fn read_bytes(bytes: &[u8]) -> Result<Log, Error> {
    read_csv(bytes, FILE, &labels(&two()), &ColumnMapping::default())
}

/// A header and `n` lines made by `row(k)`.
pub fn table(header: &str, n: usize, row: impl Fn(usize) -> Vec<f64>) -> String {
    let mut text = format!("{header}\n");
    for k in 0..n {
        let cells: Vec<String> = row(k).iter().map(f64::to_string).collect();
        text += &(cells.join(",") + "\n");
    }
    text
}

/// A good log of two joints at 100 Hz: `t,q1,q2,qd1,qd2,tau1,tau2`.
pub fn good(n: usize) -> String {
    table("t,q1,q2,qd1,qd2,tau1,tau2", n, |k| {
        let t = 0.01 * k as f64;
        vec![
            t,
            t.sin(),
            (2.0 * t).cos(),
            t.cos(),
            -2.0 * (2.0 * t).sin(),
            5.0 * t.sin(),
            t,
        ]
    })
}

/// The same log with the cell of a line (from 1, the header is 1) and column (from 0) replaced.
pub fn with_cell(text: &str, line: usize, column: usize, cell: &str) -> String {
    let lines = text.lines().enumerate().map(|(n, l)| {
        let mut cells: Vec<&str> = l.split(',').collect();
        if n + 1 == line {
            cells[column] = cell;
        }
        cells.join(",")
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// The message of a refusal, checked to hold every part.
#[track_caller]
pub fn assert_says<T: std::fmt::Debug>(result: Result<T, Error>, code: &str, parts: &[&str]) {
    let error = result.expect_err("this input must be refused");
    let message = error.to_string();
    assert_eq!(error.code(), code, "{message}");
    for part in parts {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}
