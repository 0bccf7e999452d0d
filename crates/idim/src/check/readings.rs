//! Other ways to read the columns of a log, each with the fault it would mean.

use super::faults::Fault;
use idim_model::Robot;
use nalgebra::Vector3;

/// How the columns of a log become the channels of the joints.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reading {
    /// Column that holds each joint's position.
    pub(crate) position: Vec<usize>,
    /// What it is multiplied by.
    pub(crate) position_scale: Vec<f64>,
    /// Column that holds each joint's torque.
    pub(crate) torque: Vec<usize>,
    /// What it is multiplied by.
    pub(crate) torque_scale: Vec<f64>,
    /// Gravity in the base frame, m/s².
    pub(crate) gravity: Vector3<f64>,
}

impl Reading {
    /// As recorded.
    pub(crate) fn as_recorded(robot: &Robot) -> Self {
        let n = robot.n_joints();
        Self {
            position: (0..n).collect(),
            position_scale: vec![1.0; n],
            torque: (0..n).collect(),
            torque_scale: vec![1.0; n],
            gravity: robot.gravity(),
        }
    }

    /// Whether both have the same rows of the regressor.
    pub(crate) fn same_rows(&self, other: &Self) -> bool {
        self.position == other.position
            && self.position_scale == other.position_scale
            && self.gravity == other.gravity
    }

    /// Whether the torques are read as they were recorded.
    pub(crate) fn torque_as_recorded(&self) -> bool {
        let in_order = self.torque.iter().enumerate().all(|(j, &c)| j == c);
        in_order && self.torque_scale.iter().all(|&by| by == 1.0)
    }

    fn torque_times(&self, joints: &[usize], factor: impl Fn(usize) -> f64) -> Self {
        let mut new = self.clone();
        for &j in joints {
            new.torque_scale[j] *= factor(j);
        }
        new
    }

    fn position_times(&self, joints: &[usize], factor: impl Fn(usize) -> f64) -> Self {
        let mut new = self.clone();
        for &j in joints {
            new.position_scale[j] *= factor(j);
        }
        new
    }

    fn exchanged(&self, i: usize, k: usize, positions: bool, torques: bool) -> Self {
        let mut new = self.clone();
        if positions {
            new.position.swap(i, k);
            new.position_scale.swap(i, k);
        }
        if torques {
            new.torque.swap(i, k);
            new.torque_scale.swap(i, k);
        }
        new
    }
}

/// A reading and what is wrong with the log if it is the right one.
pub(crate) type Candidate = (Fault, Reading);

/// Radians per degree.
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Readings one fault away from `now`, simple ones first.
pub(crate) fn candidates(robot: &Robot, now: &Reading) -> Vec<Candidate> {
    let n = robot.n_joints();
    let all: Vec<usize> = (0..n).collect();
    let gear: Vec<f64> = ratios(robot);
    let mut out = Vec::new();
    for j in 0..n {
        out.push((Fault::TorqueSign(j), now.torque_times(&[j], |_| -1.0)));
    }
    for j in 0..n {
        out.push((Fault::PositionSign(j), now.position_times(&[j], |_| -1.0)));
    }
    for i in 0..n {
        for k in i + 1..n {
            out.push((Fault::TorqueOrder(i, k), now.exchanged(i, k, false, true)));
            out.push((Fault::PositionOrder(i, k), now.exchanged(i, k, true, false)));
        }
    }
    for j in 0..n {
        let joint = &robot.joints()[j];
        for (factor, code, meaning) in torque_factors(gear[j], joint.actuator.torque_constant) {
            let fault = Fault::TorqueFactor {
                joint: Some(j),
                recorded: 1.0 / factor,
                turns: false,
                code,
                meaning,
            };
            out.push((fault, now.torque_times(&[j], |_| factor)));
        }
        let fault = |recorded, code, meaning| Fault::PositionFactor {
            joint: Some(j),
            recorded,
            code,
            meaning,
        };
        out.push((
            fault(1.0 / DEGREE, "degrees", "180/π: the column is in degrees"),
            now.position_times(&[j], |_| DEGREE),
        ));
        if gear[j].is_finite() && gear[j].abs() > 1.5 {
            out.push((
                fault(
                    gear[j],
                    "gear-side",
                    "the gear ratio: the column is the motor's",
                ),
                now.position_times(&[j], |j| 1.0 / gear[j]),
            ));
            out.push((
                fault(
                    1.0 / gear[j],
                    "gear-side",
                    "one over the gear ratio: the column was divided by it twice, or is the joint's already",
                ),
                now.position_times(&[j], |j| gear[j]),
            ));
        }
    }
    whole_log(robot, now, &gear, &all, &mut out);
    for j in 0..n {
        let axis = now.torque_times(&[j], |_| -1.0);
        out.push((Fault::Axis(j), axis.position_times(&[j], |_| -1.0)));
        for k in j + 1..n {
            out.push((Fault::Relabelled(j, k), now.exchanged(j, k, true, true)));
        }
    }
    out
}

/// Faults of every joint at once, and of how the robot stands.
fn whole_log(robot: &Robot, now: &Reading, gear: &[f64], all: &[usize], out: &mut Vec<Candidate>) {
    let geared = gear.iter().all(|g| g.is_finite()) && gear.iter().any(|g| g.abs() > 1.5);
    let turns = gear.iter().any(|g| g * gear[0] < 0.0);
    if geared {
        let torque = |recorded, meaning| Fault::TorqueFactor {
            joint: None,
            recorded,
            turns,
            code: "gear-side",
            meaning,
        };
        out.push((
            torque(
                1.0 / gear[0],
                "one over the gear ratio: all torques are the motors'",
            ),
            now.torque_times(all, |j| gear[j]),
        ));
        out.push((
            torque(
                gear[0],
                "the gear ratio: all torques were multiplied by it twice",
            ),
            now.torque_times(all, |j| 1.0 / gear[j]),
        ));
        let position = Fault::PositionFactor {
            joint: None,
            recorded: gear[0],
            code: "gear-side",
            meaning: "the gear ratio: all positions are the motors'",
        };
        out.push((position, now.position_times(all, |j| 1.0 / gear[j])));
    }
    let degrees = Fault::PositionFactor {
        joint: None,
        recorded: 1.0 / DEGREE,
        code: "degrees",
        meaning: "180/π: all positions are in degrees",
    };
    out.push((degrees, now.position_times(all, |_| DEGREE)));
    let constants: Option<Vec<f64>> = robot
        .joints()
        .iter()
        .map(|j| j.actuator.torque_constant)
        .collect();
    if let Some(constants) = constants.filter(|_| geared) {
        let fault = Fault::TorqueFactor {
            joint: None,
            recorded: 1.0 / (gear[0] * constants[0]),
            turns,
            code: "torque-is-current",
            meaning: "one over gear ratio and torque constant: all torques are currents",
        };
        out.push((fault, now.torque_times(all, |j| gear[j] * constants[j])));
    }
    let size = now.gravity.norm();
    let (x, y) = (Vector3::x() * size, Vector3::y() * size);
    for gravity in [
        -now.gravity,
        x,
        -x,
        y,
        -y,
        Vector3::z() * size,
        Vector3::z() * -size,
    ] {
        if (gravity - now.gravity).norm() > 0.1 * size {
            let new = Reading {
                gravity,
                ..now.clone()
            };
            out.push((Fault::Gravity(gravity), new));
        }
    }
}

/// Readings of one torque by factors without a name: powers of four.
pub(crate) fn plain_factors(n: usize, now: &Reading) -> Vec<Candidate> {
    let mut out = Vec::new();
    for j in 0..n {
        for k in [-10, -8, -6, -4, -2, 2, 4, 6, 8, 10] {
            let factor = f64::from(k).exp2();
            out.push((
                Fault::plain_torque_factor(j, factor),
                now.torque_times(&[j], |_| factor),
            ));
        }
    }
    out
}

/// The same factor, a little larger or smaller.
pub(crate) fn finer(fault: &Fault, now: &Reading) -> Vec<Candidate> {
    let Fault::TorqueFactor {
        joint: Some(j),
        code: "torque-scale",
        recorded,
        ..
    } = *fault
    else {
        return Vec::new();
    };
    (-8..=8)
        .map(|k| {
            let by = (f64::from(k) / 8.0).exp2();
            (
                Fault::plain_torque_factor(j, by / recorded),
                now.torque_times(&[j], |_| by),
            )
        })
        .collect()
}

/// What a torque column may have to be multiplied by.
fn torque_factors(gear: f64, constant: Option<f64>) -> Vec<(f64, &'static str, &'static str)> {
    let constant = constant.unwrap_or(f64::NAN);
    let all = [
        (
            gear,
            "gear-side",
            "one over the gear ratio: the torque is the motor's",
        ),
        (1e-3, "torque-unit", "1000: the torque is in N·mm or mN·m"),
        (1e3, "torque-unit", "1/1000: the torque is in kN·m"),
        (
            gear * constant,
            "torque-is-current",
            "one over gear ratio and torque constant: the column is a current",
        ),
        (
            1.0 / gear,
            "gear-side",
            "the gear ratio: the torque was multiplied by it twice",
        ),
        (
            constant,
            "torque-is-current",
            "one over the torque constant: the column is gear ratio times current",
        ),
    ];
    let known = all.into_iter().filter(|(f, ..)| f.is_finite());
    known.filter(|(f, ..)| f.abs().ln().abs() > 0.5).collect()
}

fn ratios(robot: &Robot) -> Vec<f64> {
    let joints = robot.joints().iter();
    joints
        .map(|j| j.actuator.gear_ratio.unwrap_or(f64::NAN))
        .collect()
}
