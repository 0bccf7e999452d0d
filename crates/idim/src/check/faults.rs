//! Faults a rigid body betrays, in words.

use idim_measurement::Place;
use idim_measurement::doctor::{Finding, Severity};
use idim_model::Robot;
use nalgebra::Vector3;

/// What is wrong with the columns of a log, or with the robot it is said to be of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fault {
    TorqueSign(usize),
    PositionSign(usize),
    /// Both signs: the axis points the other way.
    Axis(usize),
    TorqueOrder(usize, usize),
    PositionOrder(usize, usize),
    /// Both columns of two joints.
    Relabelled(usize, usize),
    /// `recorded`: recorded torque per true torque; of all joints where `joint` is `None`.
    TorqueFactor {
        joint: Option<usize>,
        recorded: f64,
        /// The factors of all joints are not of one sign.
        turns: bool,
        code: &'static str,
        meaning: &'static str,
    },
    /// The same of positions.
    PositionFactor {
        joint: Option<usize>,
        recorded: f64,
        code: &'static str,
        meaning: &'static str,
    },
    Gravity(Vector3<f64>),
}

/// Complexity of a fault that is of the robot's description rather than of a column.
pub(crate) const OF_THE_ROBOT: f64 = 3.0;
/// How findings about torques begin; those about positions begin otherwise.
pub(crate) const OF_TORQUES: &str = "the torque";
/// Rule of everything the rigid body betrays.
const RULE: &str = "the joints share masses and inertias, so their torques must agree about them";

impl Fault {
    /// A torque to be multiplied by a factor that has no name.
    pub(crate) fn plain_torque_factor(joint: usize, factor: f64) -> Self {
        Self::TorqueFactor {
            joint: Some(joint),
            recorded: 1.0 / factor,
            turns: false,
            code: "torque-scale",
            meaning: "no unit or gear ratio of the robot file: is it a current, in percent, or on the motor side?",
        }
    }

    /// Simple faults go before contrived ones that explain a log as well. A column may have been left on the side of the
    /// gears where the others are not; another unit in one column is rarer, and a factor without a name has one number
    /// more to fit.
    pub(crate) fn complexity(&self) -> f64 {
        match self {
            Self::TorqueSign(_)
            | Self::PositionSign(_)
            | Self::TorqueOrder(..)
            | Self::PositionOrder(..) => 0.0,
            Self::TorqueFactor { code, turns, .. } => match *code {
                "torque-scale" => 2.0,
                // Signs alone may be what explains the log.
                _ if *turns => OF_THE_ROBOT,
                "gear-side" => 1.0,
                _ => 1.5,
            },
            Self::PositionFactor { .. } => 1.0,
            Self::Axis(_) | Self::Relabelled(..) | Self::Gravity(_) => OF_THE_ROBOT,
        }
    }

    /// In a few words, where faults are listed.
    pub(crate) fn summary(&self, robot: &Robot) -> String {
        let name = |j: usize| robot.joints()[j].name.as_str();
        let whose = |joint: Option<usize>| joint.map_or("all joints", name);
        match *self {
            Self::TorqueSign(j) => format!("the torque of {} turned", name(j)),
            Self::PositionSign(j) => format!("the position of {} turned", name(j)),
            Self::Axis(j) => format!("the axis of {} turned", name(j)),
            Self::TorqueOrder(i, k) => format!("torques of {} and {} exchanged", name(i), name(k)),
            Self::PositionOrder(i, k) => {
                format!("positions of {} and {} exchanged", name(i), name(k))
            }
            Self::Relabelled(i, k) => format!("columns of {} and {} exchanged", name(i), name(k)),
            Self::TorqueFactor {
                joint, recorded, ..
            } => format!("the torque of {} divided by {recorded:.4e}", whose(joint)),
            Self::PositionFactor {
                joint, recorded, ..
            } => format!("the position of {} divided by {recorded:.4e}", whose(joint)),
            Self::Gravity(g) => {
                format!("gravity along ({:.2}, {:.2}, {:.2}) m/s²", g.x, g.y, g.z)
            }
        }
    }

    /// Whether it concerns a joint.
    pub(crate) fn concerns(&self, joint: usize) -> bool {
        match *self {
            Self::TorqueSign(j) | Self::PositionSign(j) | Self::Axis(j) => j == joint,
            Self::TorqueOrder(i, k) | Self::PositionOrder(i, k) | Self::Relabelled(i, k) => {
                joint == i || joint == k
            }
            Self::TorqueFactor { joint: j, .. } | Self::PositionFactor { joint: j, .. } => {
                j.is_none_or(|j| j == joint)
            }
            Self::Gravity(_) => false,
        }
    }

    /// As findings, one a joint concerned. `gain`: fall of the joints' summed logarithmic errors; `sure`: enough
    /// to refuse the log.
    pub(crate) fn findings(
        &self,
        robot: &Robot,
        file: &str,
        gain: f64,
        sure: bool,
    ) -> Vec<Finding> {
        let name = |j: usize| robot.joints()[j].name.as_str();
        let at = |j: usize| Place::file(file).joint(name(j));
        let better = format!(
            "the errors of all joints then shrink {:.1} times",
            gain.exp()
        );
        let finding = |code, place, value: f64, met: String, next: String| Finding {
            code,
            severity: if sure {
                Severity::Error
            } else {
                Severity::Warning
            },
            place,
            value: value.is_finite().then_some(value),
            met,
            rule: RULE.into(),
            next_step: next,
        };
        let factor = |what: &str, joint: Option<usize>, recorded, code, meaning: &str| {
            let whose = joint.map_or_else(|| "all joints".to_owned(), |j| name(j).to_owned());
            finding(
                code,
                joint.map_or_else(|| Place::file(file), at),
                recorded,
                format!(
                    "{what} of {whose} is {recorded:.4e} times what the other joints say; {better}"
                ),
                format!("that is {meaning}; convert the column, or declare its unit"),
            )
        };
        match *self {
            Self::TorqueSign(j) => vec![finding(
                "torque-sign",
                at(j),
                -1.0,
                format!("{OF_TORQUES} has the wrong sign; turned, {better}"),
                "change the sign of this joint's torque".into(),
            )],
            Self::PositionSign(j) => vec![finding(
                "position-sign",
                at(j),
                -1.0,
                format!("the position has the wrong sign; turned, {better}"),
                "change the sign of this joint's position and velocity".into(),
            )],
            Self::Axis(j) => vec![finding(
                "joint-axis",
                at(j),
                -1.0,
                format!("position and torque have the wrong sign; both turned, {better}"),
                "turn the joint's axis in the robot file, or the sign of both columns".into(),
            )],
            Self::TorqueOrder(i, k) | Self::PositionOrder(i, k) | Self::Relabelled(i, k) => {
                let columns = match self {
                    Self::TorqueOrder(..) => "torques",
                    Self::PositionOrder(..) => "positions",
                    _ => "columns",
                };
                [(i, k), (k, i)]
                    .map(|(j, other)| {
                        finding(
                            "joint-order",
                            at(j),
                            other as f64 + 1.0,
                            format!(
                                "the {columns} of {} and {} are exchanged; {better}",
                                name(i),
                                name(k)
                            ),
                            format!("this joint's {columns} are under {}", name(other)),
                        )
                    })
                    .to_vec()
            }
            Self::TorqueFactor {
                joint,
                recorded,
                code,
                meaning,
                ..
            } => vec![factor(OF_TORQUES, joint, recorded, code, meaning)],
            Self::PositionFactor {
                joint,
                recorded,
                code,
                meaning,
            } => vec![factor("the position", joint, recorded, code, meaning)],
            Self::Gravity(g) => vec![finding(
                "gravity-direction",
                Place::file(file),
                f64::NAN,
                format!(
                    "gravity along ({:.2}, {:.2}, {:.2}) m/s² explains the torques better; {better}",
                    g.x, g.y, g.z
                ),
                "state how the robot is mounted with --gravity or in the robot file".into(),
            )],
        }
    }
}
