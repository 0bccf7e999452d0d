//! Whether each joint moved enough to tell anything.

use crate::error::{Error, Place};
use crate::measurements::Measurements;
use crate::plausibility::range;
use idim_model::{JointKind, Robot};

/// How much a joint moved.
#[derive(Debug, Clone, PartialEq)]
pub struct JointMotion {
    /// Name of the joint.
    pub joint: String,
    /// Highest minus lowest position, rad (m).
    pub range: f64,
    /// Largest mean speed over a span of 0.1 s, rad/s (m/s).
    pub speed: f64,
    /// Whether it moved.
    pub moved: bool,
}

/// Range of a revolute joint, rad, below which gear play and noise pass for motion.
const STILL_ANGLE: f64 = 0.02;
/// The same for a prismatic joint, m.
const STILL_LENGTH: f64 = 0.002;
/// Span over which a speed is measured, s: long against noise.
const SPAN: f64 = 0.1;

/// Range below which a joint stands still, rad (m).
pub(crate) fn still(kind: JointKind) -> f64 {
    match kind {
        JointKind::Revolute => STILL_ANGLE,
        JointKind::Prismatic => STILL_LENGTH,
    }
}

/// Range and speed of every joint.
pub fn joint_motion(measured: &Measurements, robot: &Robot) -> Vec<JointMotion> {
    let joints = robot.joints().iter().zip(&measured.q);
    joints
        .map(|(joint, q)| {
            let (low, high) = range(q);
            JointMotion {
                joint: joint.name.clone(),
                range: high - low,
                speed: largest_speed(&measured.time, q),
                moved: high - low > still(joint.kind),
            }
        })
        .collect()
}

fn largest_speed(time: &[f64], q: &[f64]) -> f64 {
    let mut first = 0;
    let mut largest = 0.0f64;
    for k in 0..q.len() {
        while time[k] - time[first + 1] >= SPAN {
            first += 1;
        }
        let span = time[k] - time[first];
        if span >= SPAN {
            largest = largest.max(((q[k] - q[first]) / span).abs());
        }
    }
    largest
}

/// Warnings for the joints that stood still, one sentence each.
///
/// # Errors
/// No joint moved at all.
pub fn check_motion(measured: &Measurements, robot: &Robot) -> Result<Vec<String>, Error> {
    let motion = joint_motion(measured, robot);
    if motion.iter().all(|m| !m.moved) {
        let widest = motion.iter().map(|m| m.range).fold(0.0, f64::max);
        return Err(Error::log(
            "no-motion",
            Place::file(&measured.file),
            format!("the widest range of any joint is {widest:.2e}"),
            "no joint moved, so nothing can be identified; record an exciting motion",
        ));
    }
    let still = motion.iter().filter(|m| !m.moved);
    Ok(still
        .map(|m| {
            format!(
                "{}, joint {}: range {:.2e}, so it stood still; parameters only it can reveal are not identified, record a motion of this joint",
                measured.file, m.joint, m.range
            )
        })
        .collect())
}
