//! What the torques of a motion are predicted to be before anything was identified, and what they may reach.

use crate::Error;
use idim_model::{
    Columns, DriveColumns, JointStates, Model, ParameterKind, Robot, inverse_dynamics_batch,
    torque_contraction_gradient,
};

/// The inertial values of a robot's file as a prediction of its torques, held within a share of its torque limits.
///
/// ```text
/// |τ(t)| ≤ share · limit,   τ = Y π + Ia q̈ + Fv q̇ + Fc sign(q̇)
/// ```
///
/// with the rotor inertia and friction of the actuators where they are stated. Coulomb friction counts with its full
/// size at every instant. Joints without a torque limit are free.
#[derive(Debug, Clone, PartialEq)]
pub struct TorquePrior {
    robot: Robot,
    share: f64,
    /// Inertial columns, then Ia and Fv.
    columns: Columns,
    values: Vec<f64>,
    rotor: Vec<f64>,
    viscous: Vec<f64>,
    coulomb: Vec<f64>,
    /// As stated, N·m; infinite where none is.
    limit: Vec<f64>,
}

impl TorquePrior {
    /// `share`: the part of each torque limit a motion may use, by the prior; typical 0.8.
    ///
    /// # Errors
    /// A link without inertial values, no torque limit at all, a share that is not between zero and one, Coulomb friction
    /// that leaves nothing of a limit.
    pub fn new(robot: &Robot, share: f64) -> Result<Self, Error> {
        let n = robot.n_joints();
        if !(share > 0.0 && share <= 1.0) {
            return Err(Error::input(
                "share of the torque limits",
                format!("{share}"),
                "give a number above zero and at most one",
            ));
        }
        let Some(inertial) = robot.standard_parameters() else {
            let unknown = robot.links().iter().find(|l| l.inertial.is_none());
            return Err(Error::input(
                format!("link {}", unknown.map_or("", |l| &l.name)),
                "no inertial values",
                "torques cannot be predicted without; state them in the robot file, or leave torques out",
            ));
        };
        let drive = DriveColumns {
            rotor: true,
            viscous: true,
            ..DriveColumns::NONE
        };
        let of = |pick: fn(&idim_model::Actuator) -> Option<f64>| -> Vec<f64> {
            let joints = robot.joints().iter();
            joints.map(|j| pick(&j.actuator).unwrap_or(0.0)).collect()
        };
        let rotor = of(|a| Some(a.rotor_inertia? * a.gear_ratio?.powi(2)));
        let (viscous, coulomb) = (of(|a| a.viscous_friction), of(|a| a.coulomb_friction));
        let columns = Columns::standard(n, drive);
        let value = |p: &idim_model::Parameter| match p.kind.inertial_index() {
            Some(k) => inertial[10 * p.index + k],
            None if p.kind == ParameterKind::Ia => rotor[p.index],
            None => viscous[p.index],
        };
        let values = columns.0.iter().map(value).collect();
        let joints = robot.joints().iter();
        let limit: Vec<f64> = joints
            .map(|j| j.limits.torque.unwrap_or(f64::INFINITY))
            .collect();
        if limit.iter().all(|l| l.is_infinite()) {
            return Err(Error::input(
                format!("robot {}", robot.name()),
                "no torque limit",
                "state `torque` in the limits of its joints, or leave torques out",
            ));
        }
        for (j, joint) in robot.joints().iter().enumerate() {
            if coulomb[j] >= share * limit[j] {
                return Err(Error::input(
                    format!("joint {}", joint.name),
                    format!("Coulomb friction {} N·m", coulomb[j]),
                    format!(
                        "it leaves nothing of {share} times the torque limit {} N·m; check both",
                        limit[j]
                    ),
                ));
            }
        }
        Ok(Self {
            robot: robot.clone(),
            share,
            columns,
            values,
            rotor,
            viscous,
            coulomb,
            limit,
        })
    }

    /// The part of each limit a motion may use.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Torque limit of a joint as stated, N·m; infinite where none is.
    pub fn limit(&self, joint: usize) -> f64 {
        self.limit[joint]
    }

    pub(crate) fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Rotor inertia and viscous friction of a joint.
    pub(crate) fn drive(&self, joint: usize) -> [f64; 2] {
        [self.rotor[joint], self.viscous[joint]]
    }

    /// Predicted torque without Coulomb friction, joint by joint.
    pub fn smooth_torque(&self, model: &Model, states: &JointStates) -> Vec<f64> {
        let n = self.robot.n_joints();
        let mut ten = vec![0.0; 10 * n];
        for (p, v) in self.columns.0.iter().zip(&self.values) {
            if let Some(k) = p.kind.inertial_index() {
                ten[10 * p.index + k] = *v;
            }
        }
        let mut torque = inverse_dynamics_batch(model, &ten, states);
        let n_samples = states.n_samples();
        for (j, torque) in torque.chunks_exact_mut(n_samples.max(1)).enumerate() {
            let rates = states.qd(j).iter().zip(states.qdd(j));
            for (t, (qd, qdd)) in torque.iter_mut().zip(rates) {
                *t += self.rotor[j] * qdd + self.viscous[j] * qd;
            }
        }
        torque
    }

    /// Fraction of a joint's limit that a torque without Coulomb friction uses at most.
    pub(crate) fn used(&self, joint: usize, smooth_torque: f64) -> f64 {
        (smooth_torque.abs() + self.coulomb[joint]) / self.limit[joint]
    }

    /// Gradient of `Σ slope · τ` by the states; `slope` joint by joint as the torques.
    pub(crate) fn gradient(
        &self,
        model: &Model,
        states: &JointStates,
        slope: &[f64],
    ) -> JointStates {
        torque_contraction_gradient(model, &self.columns, states, slope, &self.values)
    }
}
