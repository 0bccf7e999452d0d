//! Joint states: one, and many.

use crate::robot::Robot;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Position, velocity and acceleration of every joint at one instant; rad, rad/s, rad/s² (m for prismatic).
#[derive(Debug, Clone, PartialEq)]
pub struct JointState {
    /// Positions.
    pub q: Vec<f64>,
    /// Velocities.
    pub qd: Vec<f64>,
    /// Accelerations.
    pub qdd: Vec<f64>,
}

/// Many joint states, joint by joint: sample `k` of joint `j` stands at `j * n_samples + k`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointStates {
    n_joints: usize,
    n_samples: usize,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

impl JointStates {
    /// All zero.
    pub fn zeros(n_joints: usize, n_samples: usize) -> Self {
        let zeros = vec![0.0; n_joints * n_samples];
        Self {
            n_joints,
            n_samples,
            q: zeros.clone(),
            qd: zeros.clone(),
            qdd: zeros,
        }
    }

    /// From three arrays of `n_joints * n_samples`, joint by joint.
    ///
    /// # Panics
    /// If the lengths differ from `n_joints * n_samples`.
    #[track_caller]
    pub fn from_columns(n_joints: usize, q: Vec<f64>, qd: Vec<f64>, qdd: Vec<f64>) -> Self {
        let n_samples = q.len().checked_div(n_joints).unwrap_or(0);
        for (name, x) in [("q", &q), ("qd", &qd), ("qdd", &qdd)] {
            assert_eq!(
                x.len(),
                n_joints * n_samples,
                "{name} is not {n_joints} joints × {n_samples} samples"
            );
        }
        Self {
            n_joints,
            n_samples,
            q,
            qd,
            qdd,
        }
    }

    /// One after another.
    ///
    /// # Panics
    /// If the states differ in their number of joints.
    #[track_caller]
    pub fn from_states(states: &[JointState]) -> Self {
        let n_joints = states.first().map_or(0, |s| s.q.len());
        let mut all = Self::zeros(n_joints, states.len());
        for (k, s) in states.iter().enumerate() {
            assert_eq!(
                s.q.len(),
                n_joints,
                "sample {k} has another number of joints"
            );
            for j in 0..n_joints {
                all.q[j * states.len() + k] = s.q[j];
                all.qd[j * states.len() + k] = s.qd[j];
                all.qdd[j * states.len() + k] = s.qdd[j];
            }
        }
        all
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.n_joints
    }

    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// Positions of a joint over the samples.
    pub fn q(&self, joint: usize) -> &[f64] {
        &self.q[joint * self.n_samples..][..self.n_samples]
    }

    /// Velocities of a joint over the samples.
    pub fn qd(&self, joint: usize) -> &[f64] {
        &self.qd[joint * self.n_samples..][..self.n_samples]
    }

    /// Accelerations of a joint over the samples.
    pub fn qdd(&self, joint: usize) -> &[f64] {
        &self.qdd[joint * self.n_samples..][..self.n_samples]
    }

    /// Positions of a joint, to fill in.
    pub fn q_mut(&mut self, joint: usize) -> &mut [f64] {
        &mut self.q[joint * self.n_samples..][..self.n_samples]
    }

    /// Velocities of a joint, to fill in.
    pub fn qd_mut(&mut self, joint: usize) -> &mut [f64] {
        &mut self.qd[joint * self.n_samples..][..self.n_samples]
    }

    /// Accelerations of a joint, to fill in.
    pub fn qdd_mut(&mut self, joint: usize) -> &mut [f64] {
        &mut self.qdd[joint * self.n_samples..][..self.n_samples]
    }

    /// Positions, velocities and accelerations, joints × samples each.
    pub(crate) fn arrays(&self) -> [&[f64]; 3] {
        [&self.q, &self.qd, &self.qdd]
    }

    /// One sample.
    pub fn state(&self, sample: usize) -> JointState {
        let pick = |x: &[f64]| {
            (0..self.n_joints)
                .map(|j| x[j * self.n_samples + sample])
                .collect()
        };
        JointState {
            q: pick(&self.q),
            qd: pick(&self.qd),
            qdd: pick(&self.qdd),
        }
    }

    /// The samples at these positions, in this order.
    #[must_use]
    pub fn select(&self, samples: &[usize]) -> Self {
        let pick = |x: &[f64]| {
            (0..self.n_joints)
                .flat_map(|j| samples.iter().map(move |&k| x[j * self.n_samples + k]))
                .collect()
        };
        Self {
            n_joints: self.n_joints,
            n_samples: samples.len(),
            q: pick(&self.q),
            qd: pick(&self.qd),
            qdd: pick(&self.qdd),
        }
    }
}

/// Span of a prismatic joint (m) drawn from where the robot states no position limits.
const PRISMATIC_SPAN: f64 = 1.0;
/// Speed (rad/s, m/s) drawn from where the robot states none.
const DEFAULT_SPEED: f64 = 2.0;
/// Acceleration (rad/s², m/s²) drawn from where the robot states none.
const DEFAULT_ACCELERATION: f64 = 10.0;

/// Uniform random states within the robot's limits; ±π, ±2 rad/s and ±10 rad/s² where it states none.
///
/// The structure of the regressor does not depend on the distribution, only on it being generic.
pub fn random_states(robot: &Robot, n_samples: usize, seed: u64) -> JointStates {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut states = JointStates::zeros(robot.n_joints(), n_samples);
    for k in 0..n_samples {
        for (j, joint) in robot.joints().iter().enumerate() {
            let span = match joint.kind {
                crate::robot::JointKind::Revolute => std::f64::consts::PI,
                crate::robot::JointKind::Prismatic => PRISMATIC_SPAN,
            };
            let [low, high] = joint.limits.position.unwrap_or([-span, span]);
            let speed = joint.limits.velocity.unwrap_or(DEFAULT_SPEED);
            let acceleration = joint.limits.acceleration.unwrap_or(DEFAULT_ACCELERATION);
            states.q_mut(j)[k] = rng.random_range(low..high);
            states.qd_mut(j)[k] = rng.random_range(-speed..speed);
            states.qdd_mut(j)[k] = rng.random_range(-acceleration..acceleration);
        }
    }
    states
}
