//! What simpler models predict on the held-out samples: the measure of whether identification was worth it.

use crate::columns::ModelColumns;
use crate::error::Error;
use crate::fit::{EstimationOptions, Fit, fit};
use crate::identify::{Prediction, errors};
use crate::plan::SamplingPlan;
use crate::result::BaselineResult;
use crate::samples::{Stretch, predict};
use idim_model::{Columns, JointStates, ParameterKind, Robot};

/// Errors of simpler models: no torque at all; the identified arm standing still; the robot file's own inertial values
/// with friction fitted to the training samples, where it has them.
pub(crate) fn baselines(
    robot: &Robot,
    joints: &[String],
    found: &Fit,
    train: &[Stretch],
    held_out: &[Stretch],
    plan: &SamplingPlan,
) -> Result<Vec<BaselineResult>, Error> {
    let mut out = Vec::new();
    let mut add = |name: &str, predicted: &dyn Fn(&Stretch) -> Vec<Vec<f64>>| {
        let predictions: Vec<Prediction> = held_out
            .iter()
            .map(|s| Prediction {
                training: false,
                time: s.time.clone(),
                measured: s.torque.clone(),
                predicted: predicted(s),
                friction: None,
            })
            .collect();
        if let Some(errors) = errors(joints, &predictions, false) {
            out.push(BaselineResult {
                name: name.to_owned(),
                errors,
            });
        }
    };
    add("zero", &|s| vec![vec![0.0; s.time.len()]; joints.len()]);
    add("gravity alone, as identified", &|s| {
        let n = s.states.n_samples();
        let still = vec![0.0; n * joints.len()];
        let q: Vec<f64> = (0..joints.len())
            .flat_map(|j| s.states.q(j).to_vec())
            .collect();
        let held = Stretch::of_states(JointStates::from_columns(
            joints.len(),
            q,
            still.clone(),
            still,
        ));
        predict(robot, &found.columns, &found.values, &held, &plan.reversal)
    });
    if let Some(prior) = robot.standard_parameters() {
        let model = PriorWithFriction::new(robot, prior, found, train, plan)?;
        add("robot file's inertial values, friction fitted", &|s| {
            model.predict(robot, s, plan)
        });
    }
    Ok(out)
}

/// A rigid body that is believed, and drives fitted to what it leaves.
struct PriorWithFriction {
    prior: Vec<f64>,
    drives: Fit,
}

impl PriorWithFriction {
    fn new(
        robot: &Robot,
        prior: Vec<f64>,
        found: &Fit,
        train: &[Stretch],
        plan: &SamplingPlan,
    ) -> Result<Self, Error> {
        let standard: Vec<_> = found
            .columns
            .standard
            .0
            .iter()
            .copied()
            .filter(|p| p.kind.inertial_index().is_none())
            .collect();
        // A rotor may stand for a link's inertia among the base parameters; beside a prior every joint has its own.
        let rotors = (0..robot.n_joints())
            .map(|index| idim_model::Parameter {
                kind: ParameterKind::Ia,
                index,
            })
            .filter(|p| !standard.contains(p));
        let columns = ModelColumns {
            standard: Columns(rotors.chain(standard.iter().copied()).collect()),
            extra: found.columns.extra.clone(),
        };
        let left: Vec<Stretch> = train
            .iter()
            .map(|s| {
                let mut s = s.clone();
                let rigid = rigid(robot, &prior, &s);
                for (torque, rigid) in s.torque.iter_mut().zip(rigid) {
                    torque.iter_mut().zip(rigid).for_each(|(t, r)| *t -= r);
                }
                s
            })
            .collect();
        let names = columns.names(idim_model::Notation::Gautier);
        let options = EstimationOptions::default();
        let drives = fit(robot, &columns, &names, &left, plan, &options)?;
        Ok(Self { prior, drives })
    }

    fn predict(&self, robot: &Robot, stretch: &Stretch, plan: &SamplingPlan) -> Vec<Vec<f64>> {
        let drives = &self.drives;
        let mut torque = predict(
            robot,
            &drives.columns,
            &drives.values,
            stretch,
            &plan.reversal,
        );
        for (torque, rigid) in torque.iter_mut().zip(rigid(robot, &self.prior, stretch)) {
            torque.iter_mut().zip(rigid).for_each(|(t, r)| *t += r);
        }
        torque
    }
}

fn rigid(robot: &Robot, prior: &[f64], stretch: &Stretch) -> Vec<Vec<f64>> {
    let columns = ModelColumns {
        standard: Columns::inertial(robot.n_joints()),
        extra: Vec::new(),
    };
    predict(robot, &columns, prior, stretch, &[])
}
