//! Joint positions and torques over time, as recorded.

use crate::error::{Error, Place};
use crate::log::{Drive, Log};
use idim_model::{JointStates, Robot};

/// Positions and torques on the joint side, SI, every quantity joint by joint: `q[joint][sample]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurements {
    /// Name of the log, for messages.
    pub file: String,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Time, s, rising.
    pub time: Vec<f64>,
    /// Positions, rad (m).
    pub q: Vec<Vec<f64>>,
    /// Velocities as recorded, rad/s (m/s).
    pub qd: Option<Vec<Vec<f64>>>,
    /// Accelerations as recorded, rad/s² (m/s²).
    pub qdd: Option<Vec<Vec<f64>>>,
    /// Joint torques, N·m (N).
    pub torque: Vec<Vec<f64>>,
}

impl Measurements {
    /// From a log; `τ = gear_ratio · torque_constant · i` where the log has currents.
    ///
    /// # Errors
    /// A joint recorded as a current whose torque constant or gear ratio the robot file does not state.
    ///
    /// # Panics
    /// If the log was read for another number of joints.
    #[track_caller]
    pub fn from_log(log: &Log, robot: &Robot) -> Result<Self, Error> {
        assert_eq!(
            log.n_joints(),
            robot.n_joints(),
            "joints of the log and of the robot"
        );
        let torque = match &log.drive {
            Drive::Torque(torque) => torque.clone(),
            Drive::Current(current) => torque_from_current(current, robot, &log.file)?,
        };
        Ok(Self {
            file: log.file.clone(),
            joints: log.joints.clone(),
            time: log.time.clone(),
            q: log.q.clone(),
            qd: log.qd.clone(),
            qdd: log.qdd.clone(),
            torque,
        })
    }

    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.time.len()
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.q.len()
    }

    /// The recorded states, taken as they are.
    ///
    /// # Errors
    /// No recorded velocity or acceleration.
    pub fn states_as_recorded(&self) -> Result<JointStates, Error> {
        let need = |x: &Option<Vec<Vec<f64>>>, name: &str| {
            x.as_ref().map(|x| x.concat()).ok_or_else(|| {
                Error::log(
                    "missing-column",
                    Place::file(&self.file),
                    format!("no recorded {name}"),
                    format!("data taken as recorded needs `{name}1`, `{name}2`, … for every joint; record them, or let the samples be filtered and differentiated"),
                )
            })
        };
        let (qd, qdd) = (need(&self.qd, "qd")?, need(&self.qdd, "qdd")?);
        Ok(JointStates::from_columns(
            self.n_joints(),
            self.q.concat(),
            qd,
            qdd,
        ))
    }

    /// The samples of a range, for example the first 70 %.
    ///
    /// # Panics
    /// If the range is not within the samples.
    #[must_use]
    #[track_caller]
    pub fn slice(&self, samples: std::ops::Range<usize>) -> Self {
        let cut = |x: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            x.iter().map(|c| c[samples.clone()].to_vec()).collect()
        };
        Self {
            file: self.file.clone(),
            joints: self.joints.clone(),
            time: self.time[samples.clone()].to_vec(),
            q: cut(&self.q),
            qd: self.qd.as_ref().map(cut),
            qdd: self.qdd.as_ref().map(cut),
            torque: cut(&self.torque),
        }
    }
}

fn torque_from_current(
    current: &[Vec<f64>],
    robot: &Robot,
    file: &str,
) -> Result<Vec<Vec<f64>>, Error> {
    let joints = current.iter().zip(robot.joints());
    joints
        .map(|(current, joint)| {
            let need = |value: Option<f64>, field: &str, hint: &str| {
                value.ok_or_else(|| {
                    Error::log(
                        "torque-constant",
                        Place::file(file).joint(&joint.name),
                        format!("recorded as a current, but the robot file states no {field}"),
                        format!("add {field} {hint}"),
                    )
                })
            };
            let constant = need(
                joint.actuator.torque_constant,
                "torque_constant",
                "(N·m/A, before the gear) to this joint's actuator",
            )?;
            let ratio = need(
                joint.actuator.gear_ratio,
                "gear_ratio",
                "(motor turns per joint turn; 1 for a direct drive) to this joint's actuator",
            )?;
            Ok(current.iter().map(|i| ratio * constant * i).collect())
        })
        .collect()
}
