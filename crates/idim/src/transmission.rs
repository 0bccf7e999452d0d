//! Logs of the motors, brought to the joints.

use crate::error::Error;
use idim_measurement::{Drive, Log};
use idim_model::{LogSide, Robot};
use nalgebra::DMatrix;

/// The log on the joint side: `q = T⁻¹ q_motor + zero`, `τ = Tᵀ τ_motor`, for whatever the robot file says is the motors'.
///
/// Currents of a robot without couplings are left to [`idim_measurement::Measurements::from_log`].
///
/// # Errors
/// A gear ratio or torque constant that the robot file does not state.
pub(crate) fn joint_side(mut log: Log, robot: &Robot) -> Result<Log, Error> {
    let drives = robot.drives();
    let positions = drives.positions == LogSide::Motor;
    let coupled_currents = matches!(log.drive, Drive::Current(_)) && !drives.couplings.is_empty();
    let torques = matches!(log.drive, Drive::Torque(_)) && drives.torques == LogSide::Motor;
    if !(positions || torques || coupled_currents) {
        return Ok(log);
    }
    let transmission = robot.transmission()?;
    if positions {
        let Some(inverse) = transmission.clone().try_inverse() else {
            return Err(Error::input(
                "transmission",
                "a singular matrix",
                "correct the gear ratios or couplings of the robot file",
            ));
        };
        log.q = mixed(&inverse, &log.q);
        for (q, zero) in log.q.iter_mut().zip(robot.motor_zeros()) {
            for v in q.iter_mut() {
                *v += zero;
            }
        }
        log.qd = log.qd.map(|qd| mixed(&inverse, &qd));
        log.qdd = log.qdd.map(|qdd| mixed(&inverse, &qdd));
        log.notes.push(
            "positions of the motors, taken to the joints by the robot file's transmission".into(),
        );
    }
    let motor = match &log.drive {
        Drive::Torque(torque) if torques => Some(torque.clone()),
        Drive::Current(current) if coupled_currents => Some(motor_torque(current, robot, &log)?),
        _ => None,
    };
    if let Some(motor) = motor {
        log.drive = Drive::Torque(mixed(&transmission.transpose(), &motor));
        log.notes.push(
            "torques of the motors, taken to the joints by the robot file's transmission".into(),
        );
    }
    Ok(log)
}

/// Torque of each motor from its current, N·m.
fn motor_torque(current: &[Vec<f64>], robot: &Robot, log: &Log) -> Result<Vec<Vec<f64>>, Error> {
    let joints = current.iter().zip(robot.joints());
    joints
        .map(|(current, joint)| {
            let Some(constant) = joint.actuator.torque_constant else {
                return Err(Error::input(
                    format!("{}, joint {}", log.file, joint.name),
                    "recorded as a current, but the robot file states no torque_constant",
                    "add torque_constant (N·m/A, before the gear) to this joint's actuator",
                ));
            };
            Ok(current.iter().map(|i| constant * i).collect())
        })
        .collect()
}

/// `out[i] = Σ_j matrix[i, j] columns[j]`, sample by sample.
fn mixed(matrix: &DMatrix<f64>, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
    (0..matrix.nrows())
        .map(|i| {
            let mut out = vec![0.0; columns[0].len()];
            for (j, column) in columns.iter().enumerate() {
                let factor = matrix[(i, j)];
                if factor != 0.0 {
                    for (o, c) in out.iter_mut().zip(column) {
                        *o += factor * c;
                    }
                }
            }
            out
        })
        .collect()
}
