//! The arm of Gautier & Khalil and its inferred limits.

// Each test file uses a part.
#![allow(clippy::unwrap_used, dead_code)]

use idim_excitation::{EnergyDesign, PointLimits};
use idim_model::ParameterKind::{MX, MY, XX, XY, XZ, YZ, ZZ};
use idim_model::{
    Actuator, Columns, Joint, JointKind, JointLimits, JointStates, Link, Parameter, Pose, Robot,
};
use nalgebra::Vector3;
use std::f64::consts::PI;

/// Table 1: modified DH.
pub(crate) fn gk_robot() -> Robot {
    let geometry = [(0.0, 0.0, 0.0), (-PI / 2.0, 0.0, 0.0), (0.0, 0.5, 0.2)];
    let joints = geometry
        .iter()
        .enumerate()
        .map(|(j, &(alpha, d, r))| Joint {
            name: format!("joint{}", j + 1),
            kind: JointKind::Revolute,
            parent: j.checked_sub(1),
            parent_from_joint: Pose::from_rotation_x(alpha) * Pose::from_translation(d, 0.0, r),
            axis: Vector3::z(),
            offset: 0.0,
            joint_from_link: Pose::identity(),
            limits: JointLimits::default(),
            actuator: Actuator::default(),
        });
    let links = (1..=3).map(|j| Link {
        name: format!("link{j}"),
        inertial: None,
    });
    Robot::new(
        "gk",
        Vector3::new(0.0, 0.0, -9.81),
        joints.collect(),
        links.collect(),
    )
    .unwrap()
}

/// The fifteen kept columns, in the paper's order.
pub(crate) fn gk_columns() -> Columns {
    let names = [
        (ZZ, 0),
        (XX, 1),
        (XY, 1),
        (XZ, 1),
        (YZ, 1),
        (ZZ, 1),
        (MX, 1),
        (MY, 1),
        (XX, 2),
        (XY, 2),
        (XZ, 2),
        (YZ, 2),
        (ZZ, 2),
        (MX, 2),
        (MY, 2),
    ];
    Columns(
        names
            .iter()
            .map(|&(kind, index)| Parameter { kind, index })
            .collect(),
    )
}

/// Inferred limits of the points (fixtures/papers/gk_tables.ron).
pub(crate) fn gk_limits() -> PointLimits {
    let (q2, q3) = (60_f64.to_radians(), 70_f64.to_radians());
    PointLimits {
        position: vec![[-PI, PI], [-q2, q2], [-q3, q3]],
        velocity: vec![0.69, 0.61, 0.64],
    }
}

pub(crate) fn gk_design() -> EnergyDesign {
    EnergyDesign::new(&gk_robot(), &gk_columns(), gk_limits()).unwrap()
}

/// Points of the file `[q2, q3, qd1, qd2, qd3]` as states, q1 at zero.
pub(crate) fn gk_points(points: &[[f64; 5]]) -> JointStates {
    let mut states = JointStates::zeros(3, points.len());
    for (k, p) in points.iter().enumerate() {
        for j in 0..3 {
            if j > 0 {
                states.q_mut(j)[k] = p[j - 1];
            }
            states.qd_mut(j)[k] = p[j + 2];
        }
    }
    states
}

pub(crate) fn gk_oracle() -> serde_json::Value {
    let text = include_str!("../../../../fixtures/oracles/gk_points.json");
    serde_json::from_str(text).unwrap()
}
