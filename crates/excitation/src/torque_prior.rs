//! What the torques of a motion are predicted to be before anything was identified, and what they may reach.

use crate::Error;
use idim_model::{
    Columns, DriveColumns, JointStates, KnownTorque, Model, Robot, inverse_dynamics_batch,
    torque_contraction_gradient,
};

/// The inertial values of a robot's file as a prediction of its torques, held within a share of its torque limits.
///
/// ```text
/// |τ(t)| ≤ share · limit,   τ = Y π + Tᵀ J T q̈ + Fv q̇ + Fc sign(q̇) + known(q)
/// ```
///
/// with the rotors `J` seen through the transmission `T`, so that a coupled motor acts on every joint it turns with, the
/// friction of the actuators where it is stated, and the known torques (springs, counterbalances) as described, at scale 1.
/// Coulomb friction counts with its full size at every instant. Joints without a torque limit are free.
#[derive(Debug, Clone, PartialEq)]
pub struct TorquePrior {
    robot: Robot,
    share: f64,
    /// Inertial columns and Fv.
    columns: Columns,
    values: Vec<f64>,
    /// `Tᵀ J T`, row by row, kg·m².
    rotor: Vec<f64>,
    /// Of the joints with a limit.
    known: Vec<KnownTorque>,
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
    /// that leaves nothing of a limit, a rotor inertia without gear ratio, a known torque that nothing bounds.
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
            viscous: true,
            ..DriveColumns::NONE
        };
        let of = |pick: fn(&idim_model::Actuator) -> Option<f64>| -> Vec<f64> {
            let joints = robot.joints().iter();
            joints.map(|j| pick(&j.actuator).unwrap_or(0.0)).collect()
        };
        let (viscous, coulomb) = (of(|a| a.viscous_friction), of(|a| a.coulomb_friction));
        let columns = Columns::standard(n, drive);
        let value = |p: &idim_model::Parameter| match p.kind.inertial_index() {
            Some(k) => inertial[10 * p.index + k],
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
            rotor: rotors(robot)?,
            known: bounded_torques(robot, &limit)?,
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

    /// What a joint feels per acceleration of every joint, from the rotors, kg·m².
    pub(crate) fn rotor_row(&self, joint: usize) -> &[f64] {
        let n = self.robot.n_joints();
        &self.rotor[joint * n..][..n]
    }

    /// Viscous friction of a joint, N·m·s/rad.
    pub(crate) fn viscous(&self, joint: usize) -> f64 {
        self.viscous[joint]
    }

    /// How far the known torques of a joint can be from their values at `q` anywhere within `way` of it, N·m.
    pub(crate) fn known_change(&self, joint: usize, q: f64, way: f64) -> f64 {
        let change = |known: &KnownTorque| {
            let (here, [low, high]) = (known.at(q), known.range(q - way, q + way));
            (high - here).max(here - low)
        };
        self.known_of(joint).map(change).sum()
    }

    fn known_of(&self, joint: usize) -> impl Iterator<Item = &KnownTorque> {
        self.known.iter().filter(move |k| k.joint() == joint)
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
            for (t, qd) in torque.iter_mut().zip(states.qd(j)) {
                *t += self.viscous[j] * qd;
            }
            let rotors = self.rotor_row(j).iter().enumerate();
            for (i, inertia) in rotors.filter(|(_, inertia)| **inertia != 0.0) {
                for (t, qdd) in torque.iter_mut().zip(states.qdd(i)) {
                    *t += inertia * qdd;
                }
            }
            for known in self.known_of(j) {
                for (t, q) in torque.iter_mut().zip(states.q(j)) {
                    *t += known.at(*q);
                }
            }
        }
        torque
    }

    /// Fraction of a joint's limit that a torque without Coulomb friction uses at most; all of it and more where the torque
    /// is not a number.
    pub fn used(&self, joint: usize, smooth_torque: f64) -> f64 {
        if smooth_torque.is_nan() {
            return f64::INFINITY;
        }
        (smooth_torque.abs() + self.coulomb[joint]) / self.limit[joint]
    }

    /// Gradient of `Σ slope · τ` by the states; `slope` joint by joint as the torques.
    pub(crate) fn gradient(
        &self,
        model: &Model,
        states: &JointStates,
        slope: &[f64],
    ) -> JointStates {
        let mut by_states =
            torque_contraction_gradient(model, &self.columns, states, slope, &self.values);
        let n_samples = states.n_samples();
        for j in 0..self.robot.n_joints() {
            let slope = &slope[j * n_samples..][..n_samples];
            let rotors = self.rotor_row(j).iter().enumerate();
            for (i, inertia) in rotors.filter(|(_, inertia)| **inertia != 0.0) {
                for (g, s) in by_states.qdd_mut(i).iter_mut().zip(slope) {
                    *g += inertia * s;
                }
            }
            for known in self.known_of(j) {
                for (k, s) in slope.iter().enumerate().filter(|(_, s)| **s != 0.0) {
                    let q = states.q(j)[k];
                    by_states.q_mut(j)[k] += s * known.slope(q);
                }
            }
        }
        by_states
    }
}

/// Positions looked at where a joint states no limits: a turn either way.
const TURN: f64 = std::f64::consts::TAU;
/// Halvings of a range before a formula counts as unbounded.
const HALVINGS: usize = 12;

/// `Tᵀ J T`, row by row.
fn rotors(robot: &Robot) -> Result<Vec<f64>, Error> {
    let n = robot.n_joints();
    let mut seen = vec![0.0; n * n];
    for (motor, joint) in robot.joints().iter().enumerate() {
        let Some(inertia) = joint.actuator.rotor_inertia else {
            continue;
        };
        let Some(ratio) = joint.actuator.gear_ratio else {
            return Err(Error::input(
                format!("joint {}", joint.name),
                "a rotor_inertia, but no gear_ratio",
                "what the joint feels of it is not known; add gear_ratio (1 for a direct drive) to its actuator",
            ));
        };
        let mut turns = vec![0.0; n];
        turns[motor] = ratio;
        for c in &robot.drives().couplings {
            if c.motor == motor {
                turns[c.joint] = c.ratio;
            }
        }
        for i in 0..n {
            for j in 0..n {
                seen[i * n + j] += turns[i] * inertia * turns[j];
            }
        }
    }
    Ok(seen)
}

/// The known torques that count against a limit; each is bounded over all positions of its joint.
fn bounded_torques(robot: &Robot, limit: &[f64]) -> Result<Vec<KnownTorque>, Error> {
    let known = robot.drives().known_torques.iter();
    let counted = known.filter(|k| limit[k.joint()].is_finite());
    counted
        .map(|known| {
            let joint = &robot.joints()[known.joint()];
            let [low, high] = joint.limits.position.unwrap_or([-TURN, TURN]);
            match unbounded(known, low, high, HALVINGS) {
                None => Ok(known.clone()),
                Some(at) => Err(Error::input(
                    format!("known torque {} on joint {}", known.name(), joint.name),
                    format!("nothing bounds its formula near q = {at:.4}"),
                    "a motion is proved safe only where every torque has a bound; correct the formula, give a table, or leave torques out",
                )),
            }
        })
        .collect()
}

/// A position near which nothing bounds a known torque.
fn unbounded(known: &KnownTorque, low: f64, high: f64, halvings: usize) -> Option<f64> {
    if known.range(low, high).iter().all(|v| v.is_finite()) {
        return None;
    }
    let middle = f64::midpoint(low, high);
    if halvings == 0 {
        return Some(middle);
    }
    unbounded(known, low, middle, halvings - 1)
        .or_else(|| unbounded(known, middle, high, halvings - 1))
}
