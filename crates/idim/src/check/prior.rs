//! What the robot file states about torques: prior masses and limits.

use super::rows::Samples;
use idim_measurement::doctor::{Finding, Severity, examine_torque};
use idim_measurement::{Measurements, Place};
use idim_model::{Model, Robot, inverse_dynamics_batch};

/// Findings of measured torques against those of the robot file's masses; none where it states none.
pub(crate) fn prior_masses(samples: &Samples, robot: &Robot, file: &str) -> Vec<Finding> {
    let Some(parameters) = robot.standard_parameters() else {
        return Vec::new();
    };
    let segment = samples.longest();
    let torque = inverse_dynamics_batch(&Model::new(robot), &parameters, &segment.states);
    let predicted: Vec<Vec<f64>> = torque
        .chunks_exact(segment.states.n_samples())
        .map(<[f64]>::to_vec)
        .collect();
    examine_torque(segment, &predicted, robot, file)
}

/// Torque, in limits, that cannot be: peaks are short and limits have a reserve.
const BEYOND: f64 = 3.0;
/// Largest torque of any joint, in limits, below which a unit is doubted: gravity alone takes more.
const BELOW: f64 = 0.02;
/// Share of the samples that a torque must stay within to be called its size.
const SIZE: f64 = 0.99;

/// Findings of measured torques against the limits of the robot file.
pub(crate) fn torque_limits(measured: &Measurements, robot: &Robot) -> Vec<Finding> {
    let used: Vec<Option<f64>> = robot
        .joints()
        .iter()
        .zip(&measured.torque)
        .map(|(joint, torque)| {
            let limit = joint.limits.torque.filter(|l| *l > 0.0)?;
            Some(size(torque) / limit)
        })
        .collect();
    let known = || used.iter().filter_map(|u| *u);
    if known().next().is_none() {
        return Vec::new();
    }
    let largest = known().fold(0.0, f64::max);
    if largest < BELOW {
        return vec![Finding {
            code: "torque-range",
            severity: Severity::Error,
            place: Place::file(&measured.file),
            value: Some(largest),
            met: format!("no torque reaches more than {:.2} % of its joint's limit", 100.0 * largest),
            rule: format!("gravity alone takes more than {:.0} %", 100.0 * BELOW),
            next_step: "are the torques the motors' (then say so in the robot file's `log`), currents, or in kN·m?".into(),
        }];
    }
    let joints = robot.joints().iter().zip(&used);
    joints
        .filter_map(|(joint, used)| {
            let used = (*used)?;
            if used < BEYOND {
                return None;
            }
            let gear = joint.actuator.gear_ratio.map_or(f64::NAN, f64::abs);
            let fits = |factor: f64| (BELOW..BEYOND).contains(&(used / factor));
            let (code, value, next) = if fits(1e3) {
                ("torque-unit", 1e3, "is it in N·mm? name it `tau1_Nmm`")
            } else if fits(gear) {
                (
                    "gear-side",
                    gear,
                    "was it multiplied by the gear ratio twice, or is it the joint's already?",
                )
            } else {
                (
                    "torque-range",
                    used,
                    "check the unit of the column and the limit in the robot file",
                )
            };
            Some(Finding {
                code,
                severity: Severity::Error,
                place: Place::file(&measured.file).joint(&joint.name),
                value: Some(value),
                met: format!("torques reach {used:.1} times the joint's limit"),
                rule: format!("no drive gives {BEYOND} times its limit"),
                next_step: next.into(),
            })
        })
        .collect()
}

/// What a torque stays within but for a hundredth of the samples.
fn size(torque: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = torque.iter().map(|t| t.abs()).collect();
    let at = ((SIZE * sizes.len() as f64) as usize).min(sizes.len().saturating_sub(1));
    *sizes.select_nth_unstable_by(at, f64::total_cmp).1
}
