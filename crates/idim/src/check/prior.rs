//! What the robot file states about torques: prior masses and limits.

use super::readings::Reading;
use super::rows::{Motors, Samples};
use idim_measurement::doctor::{Finding, Severity, examine_torque, torque_fits};
use idim_measurement::{Measurements, Place, Segment};
use idim_model::{Model, Robot, inverse_dynamics_batch};

/// Torques of the robot file's masses, and the stretch they are of; `None` where it states no masses. The columns are read
/// as the rigid body reads them, so that its faults are not found twice.
fn predicted(
    samples: &Samples,
    robot: &Robot,
    reading: &Reading,
) -> Option<(Segment, Vec<Vec<f64>>)> {
    let parameters = robot.standard_parameters()?;
    let segment = samples.longest_as(&Motors::new(robot), reading);
    let turned = robot.clone().with_gravity(reading.gravity);
    let model = Model::new(turned.as_ref().unwrap_or(robot));
    let torque = inverse_dynamics_batch(&model, &parameters, &segment.states);
    let of_joints = torque.chunks_exact(segment.states.n_samples());
    let predicted = of_joints.map(<[f64]>::to_vec).collect();
    Some((segment, predicted))
}

/// Findings of measured torques against those of the robot file's masses; none where it states none.
pub(crate) fn prior_masses(
    samples: &Samples,
    robot: &Robot,
    reading: &Reading,
    file: &str,
) -> Vec<Finding> {
    let predicted = predicted(samples, robot, reading);
    predicted.map_or_else(Vec::new, |(segment, torque)| {
        examine_torque(&segment, &torque, robot, file)
    })
}

/// Share of a torque that masses must have before its correlation with theirs says something.
const LOADED: f64 = 0.1;

/// Best correlation of a joint's torque with that of the robot file's masses.
pub(crate) fn follows(samples: &[Samples], robot: &Robot, reading: &Reading) -> Option<f64> {
    let of_log = samples.iter().filter_map(|samples| {
        let (segment, torque) = predicted(samples, robot, reading)?;
        let fits = torque_fits(&segment, &torque);
        let own = fits.iter().enumerate().map(|(j, of_joint)| of_joint[j]);
        let loaded = own.filter(|fit| fit.weight > LOADED);
        Some(loaded.map(|fit| fit.correlation).fold(0.0, f64::max))
    });
    of_log.reduce(f64::max)
}

/// Torque, in limits, that cannot be: peaks are short and limits have a reserve.
const BEYOND: f64 = 3.0;
/// Largest torque of any joint, in limits, below which a unit is doubted: gravity alone takes more.
const BELOW: f64 = 0.02;
/// Share of the samples that a torque must stay within to be called its size.
const SIZE: f64 = 0.99;

/// Findings of measured torques, read in a way, against the limits of the robot file.
pub(crate) fn torque_limits(
    measured: &Measurements,
    robot: &Robot,
    reading: &Reading,
) -> Vec<Finding> {
    let torques = Motors::new(robot).torques(measured.torque.clone(), reading);
    let used: Vec<Option<f64>> = robot
        .joints()
        .iter()
        .zip(&torques)
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
