//! The log doctor: what is wrong with a recording, before anything is computed from it.

mod finding;
mod prediction;
mod regression;
mod signals;
mod torque;
mod velocity;

pub use finding::{Finding, Severity};
pub use prediction::{TorqueFit, examine_torque, torque_fits};
pub use signals::clipped_at;
pub use torque::torque_lag;

use crate::error::Place;
use crate::log::Log;
use crate::plausibility::position_doubts;
use idim_model::Robot;

/// Everything that can be found in a log without a model of its masses; most serious first, in order of the joints.
///
/// Sample rate, jitter, gaps, stale samples; position jumps, torque spikes, saturation, quantisation; standstill and
/// joints that hardly move; recorded velocity against `dq/dt` (degrees, sign, gear, order, delay); positions against
/// limits; friction that drives or belongs to another joint; delay of the torques.
///
/// # Panics
/// If the log was read for another number of joints.
#[track_caller]
pub fn examine_log(log: &Log, robot: &Robot) -> Vec<Finding> {
    let mut out = examine_channels(log, robot);
    out.extend(examine_friction(log));
    out.sort_by_key(|f| std::cmp::Reverse(f.severity));
    out
}

/// What friction says of signs and order without a model: friction that drives or belongs to another joint.
///
/// Whether the torque's column or the position's is at fault, friction cannot tell.
pub fn examine_friction(log: &Log) -> Vec<Finding> {
    let mut out = Vec::new();
    if let Some(samples) = torque::Samples::new(log) {
        torque::friction(log, &samples, &mut out);
    }
    out
}

/// As [`examine_log`], all but friction.
///
/// # Panics
/// If the log was read for another number of joints.
#[track_caller]
pub fn examine_channels(log: &Log, robot: &Robot) -> Vec<Finding> {
    assert_eq!(
        log.n_joints(),
        robot.n_joints(),
        "joints of the log and of the robot"
    );
    let mut out = Vec::new();
    signals::clock(log, &mut out);
    signals::stale(log, &mut out);
    signals::jumps(log, &mut out);
    signals::saturation(log, &mut out);
    signals::quantisation(log, &mut out);
    signals::standstill(log, robot, &mut out);
    velocity::velocity(log, robot, &mut out);
    for doubt in position_doubts(log, robot) {
        let (rule, next) = doubt.rule.split_once("; ").unwrap_or((&doubt.rule, ""));
        out.push(Finding::new(
            "position-range",
            if doubt.impossible {
                Severity::Error
            } else {
                Severity::Warning
            },
            Place::file(&log.file).joint(&doubt.joint),
            doubt.times,
            doubt.met,
            rule,
            next,
        ));
    }
    if let Some(samples) = torque::Samples::new(log) {
        torque::delay(log, &samples, &mut out);
    }
    out.sort_by_key(|f| std::cmp::Reverse(f.severity));
    out
}
