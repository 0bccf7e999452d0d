//! What single channels, friction and limits suspect of a column. Each speaks of one joint and cannot say all: friction
//! that drives may be a turned torque or a turned position; a recorded velocity may be wrong itself. The rigid body decides
//! between them on less evidence than it asks for where nothing is suspected.

use super::faults::Fault;
use idim_measurement::doctor::Finding;
use idim_model::Robot;

/// What a finding suspects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Suspicion {
    /// The unit or the gear side of a position; recorded over true, where it is known.
    PositionFactor(usize, Option<f64>),
    PositionSign(usize),
    /// The unit or the gear side of a torque, with the code of the finding.
    TorqueFactor(usize, &'static str),
    /// The sign of a torque or of its position.
    Sign(usize),
    /// The order of torques or positions.
    Order(usize, usize),
}

/// Deviation of a factor from the one suspected, relative.
const NEAR: f64 = 0.1;

impl Suspicion {
    /// What a finding in a torque's size suspects; `None` if it is of no single joint.
    pub(crate) fn of_size(finding: &Finding, robot: &Robot) -> Option<Self> {
        joint_of(finding, robot).map(|j| Self::TorqueFactor(j, finding.code))
    }

    /// What a finding in a channel suspects; `None` if nothing that the rigid body could judge.
    pub(crate) fn of(finding: &Finding, robot: &Robot) -> Option<Self> {
        let j = joint_of(finding, robot)?;
        Some(match finding.code {
            "degrees" | "gear-side" => Self::PositionFactor(j, finding.value),
            "position-range" => Self::PositionFactor(j, None),
            "velocity-sign" => Self::PositionSign(j),
            "torque-sign" => Self::Sign(j),
            "joint-order" => {
                let other = finding.value? as usize;
                Self::Order(j, other.checked_sub(1)?)
            }
            _ => return None,
        })
    }

    /// Whether two logs suspect the same; factors measured in both differ a little.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        match (*self, *other) {
            (Self::PositionFactor(j, _), Self::PositionFactor(i, _)) => i == j,
            _ => self == other,
        }
    }

    /// Whether a fault is what was suspected.
    pub(crate) fn covers(&self, fault: &Fault) -> bool {
        let same = |a: usize, b: usize, i: usize, k: usize| (a, b) == (i, k) || (a, b) == (k, i);
        match (*self, fault) {
            (
                Self::PositionFactor(j, by),
                Fault::PositionFactor {
                    joint, recorded, ..
                },
            ) => {
                joint.is_none_or(|i| i == j)
                    && by.is_none_or(|by| (recorded / by - 1.0).abs() < NEAR)
            }
            (Self::TorqueFactor(j, said), Fault::TorqueFactor { joint, code, .. }) => {
                joint.is_none_or(|i| i == j) && (*code == said || said == "torque-range")
            }
            (Self::PositionSign(j), Fault::PositionSign(i))
            | (Self::Sign(j), Fault::TorqueSign(i) | Fault::PositionSign(i)) => *i == j,
            (Self::Order(a, b), Fault::TorqueOrder(i, k) | Fault::PositionOrder(i, k)) => {
                same(a, b, *i, *k)
            }
            _ => false,
        }
    }
}

/// The joint a finding is about.
pub(crate) fn joint_of(finding: &Finding, robot: &Robot) -> Option<usize> {
    let name = finding.place.joint.as_deref()?;
    robot.joints().iter().position(|joint| joint.name == name)
}
