//! Limits of a motion: the robot file's, and what the command line says beside it.

use crate::error::Error;
use idim_model::Robot;
use idim_trajectory::Limits;

/// Limits given beside the robot file, one number for all joints or one a joint; empty where none were.
#[derive(Debug, Clone, Copy)]
pub(super) struct GivenLimits<'a> {
    /// Half ranges about zero, rad (m).
    pub(super) position: &'a [f64],
    /// rad/s (m/s).
    pub(super) velocity: &'a [f64],
    /// rad/s² (m/s²).
    pub(super) acceleration: &'a [f64],
}

/// The narrower of both; never one that neither states.
pub(super) fn motion_limits(robot: &Robot, given: &GivenLimits<'_>) -> Result<Limits, Error> {
    let n = robot.n_joints();
    let position = for_joints("--position", given.position, n)?;
    let velocity = for_joints("--velocity", given.velocity, n)?;
    let acceleration = for_joints("--acceleration", given.acceleration, n)?;
    let mut limits = (Vec::new(), Vec::new(), Vec::new());
    for (j, joint) in robot.joints().iter().enumerate() {
        let stated = &joint.limits;
        let narrower = |stated: Option<f64>, given: Option<f64>| match (stated, given) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        let range = match (stated.position, position[j]) {
            (Some([low, high]), Some(half)) => Some([low.max(-half), high.min(half)]),
            (Some(range), None) => Some(range),
            (None, half) => half.map(|h| [-h, h]),
        };
        let missing = |what: &str, option: &str| {
            Error::input(
                format!("joint {}", joint.name),
                format!("no {what} limit in the robot file"),
                format!(
                    "there is no safe default: add it to this joint's `limits` (docs/robot-file.md), or give {option}"
                ),
            )
        };
        limits
            .0
            .push(range.ok_or_else(|| missing("position", "--position, rad"))?);
        let v = narrower(stated.velocity, velocity[j]);
        limits
            .1
            .push(v.ok_or_else(|| missing("velocity", "--velocity, rad/s"))?);
        let a = narrower(stated.acceleration, acceleration[j]);
        limits
            .2
            .push(a.ok_or_else(|| missing("acceleration", "--acceleration, rad/s²"))?);
    }
    Ok(Limits::new(limits.0, limits.1, limits.2)?)
}

/// One value a joint, from one for all or one each.
pub(super) fn for_joints(
    option: &str,
    values: &[f64],
    n_joints: usize,
) -> Result<Vec<Option<f64>>, Error> {
    if let Some(bad) = values.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
        return Err(Error::input(
            option,
            format!("{bad}"),
            "it must be above zero",
        ));
    }
    match values.len() {
        0 => Ok(vec![None; n_joints]),
        1 => Ok(vec![Some(values[0]); n_joints]),
        m if m == n_joints => Ok(values.iter().copied().map(Some).collect()),
        m => Err(Error::input(
            option,
            format!("{m} numbers"),
            format!("give one for all joints, or one for each of the {n_joints}"),
        )),
    }
}
