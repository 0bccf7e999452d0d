//! What of a predicted torque is friction, over the velocity that it depends on.

use crate::columns::ExtraColumn;
use crate::fit::Fit;
use crate::plan::SamplingPlan;
use crate::samples::{Stretch, predict};
use idim_model::{ParameterKind, Robot};

/// The friction of a predicted torque over the velocity, joint by joint.
#[derive(Debug, Clone)]
pub struct FrictionPart {
    /// Velocity of the joint, rad/s (m/s).
    pub velocity: Vec<Vec<f64>>,
    /// Torque of the joint's own friction and offset, N·m (N); that of coupled motors is not in it.
    pub torque: Vec<Vec<f64>>,
    /// Motors that turn with several joints.
    pub motors: Vec<MotorFriction>,
}

/// The friction of a motor that turns with several joints, seen at its own joint.
#[derive(Debug, Clone)]
pub struct MotorFriction {
    /// The motor, by the joint it drives.
    pub motor: usize,
    /// Its velocity over its gear ratio, rad/s (m/s).
    pub velocity: Vec<f64>,
    /// Its torque on its own joint, N·m (N).
    pub torque: Vec<f64>,
}

impl FrictionPart {
    /// Of a fit on a stretch: the prediction with everything but friction set to zero.
    pub(crate) fn of(robot: &Robot, fit: &Fit, stretch: &Stretch, plan: &SamplingPlan) -> Self {
        let inertial = |k: ParameterKind| k.inertial_index().is_some() || k == ParameterKind::Ia;
        let n = fit.columns.standard.len();
        let only = |kept: &dyn Fn(usize) -> bool| {
            let values = fit.values.iter().enumerate();
            let values: Vec<f64> = values
                .map(|(k, &v)| if kept(k) { v } else { 0.0 })
                .collect();
            predict(robot, &fit.columns, &values, stretch, &plan.reversal)
        };
        let own = |k: usize| match k.checked_sub(n) {
            None => !inertial(fit.columns.standard.0[k].kind),
            Some(k) => matches!(fit.columns.extra[k], ExtraColumn::Friction { .. }),
        };
        let motor_friction = |k: usize| match fit.columns.extra.get(k.checked_sub(n)?) {
            Some(ExtraColumn::Motor { motor, kind, turns }) if !inertial(*kind) => {
                Some((*motor, turns))
            }
            _ => None,
        };
        let mut motors: Vec<(usize, &Vec<f64>)> =
            (0..fit.values.len()).filter_map(motor_friction).collect();
        motors.dedup_by_key(|m| m.0);
        let of_motor = |(motor, turns): (usize, &Vec<f64>)| {
            let mut velocity = vec![0.0; stretch.states.n_samples()];
            for (j, ratio) in turns.iter().enumerate() {
                let speeds = velocity.iter_mut().zip(stretch.states.qd(j));
                speeds.for_each(|(sum, v)| *sum += ratio * v);
            }
            let mut torque = only(&|k| motor_friction(k).is_some_and(|m| m.0 == motor));
            MotorFriction {
                motor,
                velocity,
                torque: torque.swap_remove(motor),
            }
        };
        Self {
            velocity: (0..robot.n_joints())
                .map(|j| stretch.states.qd(j).to_vec())
                .collect(),
            torque: only(&own),
            motors: motors.into_iter().map(of_motor).collect(),
        }
    }
}
