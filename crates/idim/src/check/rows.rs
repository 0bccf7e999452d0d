//! Smooth samples of a log and the rows a robot has at them.

use super::moments::FOLDS;
use crate::structure::{KeepOrder, Structure};
use idim_measurement::{ConditioningOptions, LowPass, Measurements, Segment, condition};
use idim_model::{
    Columns, DriveColumns, JointStates, LogSide, Model, ParameterKind, Robot,
    visit_torque_regressor,
};
use nalgebra::DMatrix;

/// Low-pass of positions and torques alike, Hz: what arms are moved with.
const CUTOFF: f64 = 10.0;
/// Samples looked at: more tell no more within a motion of some seconds.
const SAMPLES: usize = 480;
/// Stretches the log is cut into, dealt out to the folds in turn.
const STRETCHES: usize = 3 * FOLDS;
/// Longest delay looked for, s.
pub(crate) const LONGEST: f64 = 0.08;
/// Speed, as a share of the joint's largest, below which it stands.
const STANDING: f64 = 0.01;
/// Speed over which friction turns, as a share of the joint's largest.
const TURNING: f64 = 0.02;

/// Smooth samples of a log, thinned, without those at which the whole arm stands.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    segments: Vec<Segment>,
    /// Segment and sample of each.
    at: Vec<(usize, usize)>,
    /// Fold of each.
    pub(crate) fold: Vec<usize>,
    /// States at the samples.
    pub(crate) states: JointStates,
    /// Torques at the samples, joint by joint.
    pub(crate) torque: Vec<Vec<f64>>,
}

impl Samples {
    /// `None` where the log is too short to say anything.
    pub(crate) fn new(measured: &Measurements) -> Option<Self> {
        let n = measured.n_joints();
        let steps = measured.time.len().max(2) - 1;
        let rate = steps as f64 / (measured.time[steps] - measured.time[0]);
        let low_pass = Some(LowPass {
            order: 2,
            cutoff: CUTOFF.min(0.2 * rate),
        });
        let options = ConditioningOptions {
            low_pass,
            torque_low_pass: low_pass,
            ..ConditioningOptions::default()
        };
        let segments = condition(measured, &options).ok()?.segments;
        let fastest: Vec<f64> = (0..n)
            .map(|j| {
                let speeds = segments.iter().flat_map(|s| s.states.qd(j));
                speeds.fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()))
            })
            .collect();
        let mut moving = Vec::new();
        for (s, segment) in segments.iter().enumerate() {
            let reach = (LONGEST / segment.interval).ceil() as usize;
            for k in reach..segment.time.len().saturating_sub(reach) {
                if (0..n).any(|j| segment.states.qd(j)[k].abs() > STANDING * fastest[j]) {
                    moving.push((s, k));
                }
            }
        }
        let stride = moving.len().div_ceil(SAMPLES).max(1);
        let at: Vec<(usize, usize)> = moving.into_iter().step_by(stride).collect();
        if at.len() < 10 * n.max(4) {
            return None;
        }
        let fold = (0..at.len()).map(|k| (k * STRETCHES / at.len()) % FOLDS);
        let mut samples = Self {
            fold: fold.collect(),
            states: JointStates::zeros(n, at.len()),
            torque: Vec::new(),
            segments,
            at,
        };
        for (k, &(s, i)) in samples.at.iter().enumerate() {
            let from = &samples.segments[s].states;
            for j in 0..n {
                samples.states.q_mut(j)[k] = from.q(j)[i];
                samples.states.qd_mut(j)[k] = from.qd(j)[i];
                samples.states.qdd_mut(j)[k] = from.qdd(j)[i];
            }
        }
        samples.torque = samples.late_torque(0.0);
        Some(samples)
    }

    /// Torques `lag` seconds after the samples, joint by joint.
    pub(crate) fn late_torque(&self, lag: f64) -> Vec<Vec<f64>> {
        let n = self.states.n_joints();
        let value = |j: usize, s: usize, k: usize| {
            let segment = &self.segments[s];
            let shift = (lag / segment.interval).round() as isize;
            segment.torque[j][k.saturating_add_signed(shift).min(segment.time.len() - 1)]
        };
        (0..n)
            .map(|j| self.at.iter().map(|&(s, k)| value(j, s, k)).collect())
            .collect()
    }

    /// The longest stretch, whole.
    pub(crate) fn longest(&self) -> &Segment {
        let longest = (0..self.segments.len()).max_by_key(|&s| self.segments[s].time.len());
        &self.segments[longest.unwrap_or(0)]
    }

    /// Interval of the log, s.
    pub(crate) fn interval(&self) -> f64 {
        self.segments[self.at[0].0].interval
    }

    /// States with column `from[j]` times `scale[j]` in the place of joint `j`, and their largest speeds.
    pub(crate) fn read_as(
        &self,
        motors: &Motors,
        from: &[usize],
        scale: &[f64],
    ) -> (JointStates, Vec<f64>) {
        let mut states = self.states.clone();
        let (n, count) = (states.n_joints(), states.n_samples());
        let change = motors.change_of_positions(from, scale);
        for j in 0..n {
            for k in 0..count {
                let (mut q, mut qd, mut qdd) = (motors.zero[j], 0.0, 0.0);
                for i in 0..n {
                    let by = change[j * n + i];
                    if by != 0.0 {
                        q += by * (self.states.q(i)[k] - motors.zero[i]);
                        qd += by * self.states.qd(i)[k];
                        qdd += by * self.states.qdd(i)[k];
                    }
                }
                states.q_mut(j)[k] = q;
                states.qd_mut(j)[k] = qd;
                states.qdd_mut(j)[k] = qdd;
            }
        }
        let fastest = (0..n).map(|j| {
            let speeds = states.qd(j).iter();
            speeds.fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()))
        });
        let fastest = fastest.collect();
        (states, fastest)
    }
}

/// What the columns of a log were multiplied by on their way to the joints. Torques of
/// motors that turn with several joints are judged as the motors'; a fault of their positions at their own joints.
#[derive(Debug, Clone)]
pub(crate) struct Motors {
    /// Torques of the columns from torques of the joints, where motors turn with several joints; `[column · n + joint]`.
    columns_from_joints: Option<Vec<f64>>,
    /// Gear ratios where positions and torques are recorded at the motors, else ones.
    position_gear: Vec<f64>,
    torque_gear: Vec<f64>,
    /// The joints where the positions' columns are zero.
    zero: Vec<f64>,
}

impl Motors {
    pub(crate) fn new(robot: &Robot) -> Self {
        let n = robot.n_joints();
        let drives = robot.drives();
        let positions = drives.positions == LogSide::Motor;
        let torques = drives.torques == LogSide::Motor;
        let gear = |side: bool| -> Vec<f64> {
            let own = robot.joints().iter().map(|j| j.actuator.gear_ratio);
            own.map(|g| if side { g.unwrap_or(1.0) } else { 1.0 })
                .collect()
        };
        // Torques of the joints are those of the motors, each times its own ratio, through `turns` transposed.
        let mut turns = DMatrix::identity(n, n);
        for c in &drives.couplings {
            let own = robot.joints()[c.motor].actuator.gear_ratio;
            turns[(c.motor, c.joint)] = c.ratio / own.unwrap_or(1.0);
        }
        let coupled = torques && !drives.couplings.is_empty();
        let inverse = turns.transpose().try_inverse().filter(|_| coupled);
        Self {
            columns_from_joints: inverse.map(|m| (0..n * n).map(|k| m[(k / n, k % n)]).collect()),
            position_gear: gear(positions),
            torque_gear: gear(torques),
            zero: if positions {
                robot.motor_zeros()
            } else {
                vec![0.0; n]
            },
        }
    }

    /// Joint positions from joint positions, when the motors' columns are read otherwise.
    fn change_of_positions(&self, from: &[usize], scale: &[f64]) -> Vec<f64> {
        let n = from.len();
        let mut reading = vec![0.0; n * n];
        for (j, (&i, &by)) in from.iter().zip(scale).enumerate() {
            // A column under another joint's name was divided by that joint's ratio.
            reading[j * n + i] = by * self.position_gear[i] / self.position_gear[j];
        }
        reading
    }

    /// Torque of each column's own joint from all columns, when they are read otherwise: `[joint · n + column]`.
    pub(crate) fn change_of_torques(&self, from: &[usize], scale: &[f64]) -> Vec<f64> {
        let n = from.len();
        let mut reading = vec![0.0; n * n];
        for (j, (&i, &by)) in from.iter().zip(scale).enumerate() {
            // A column under another joint's name was multiplied by that joint's ratio.
            reading[j * n + i] = by * self.torque_gear[j] / self.torque_gear[i];
        }
        reading
    }

    /// Torques of the columns from torques of the joints.
    pub(crate) fn columns(&self, torque: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        match &self.columns_from_joints {
            Some(change) => mixed(change, &torque),
            None => torque,
        }
    }

    /// Rows of the columns from rows of the joints, `p` numbers each.
    pub(crate) fn rows_of_columns(&self, rows: Vec<f64>, p: usize) -> Vec<f64> {
        let Some(change) = &self.columns_from_joints else {
            return rows;
        };
        let n = self.zero.len();
        let mut out = vec![0.0; rows.len()];
        for (to, from) in out.chunks_exact_mut(n * p).zip(rows.chunks_exact(n * p)) {
            for (k, &by) in change.iter().enumerate() {
                if by == 0.0 {
                    continue;
                }
                let to = &mut to[k / n * p..][..p];
                for (t, f) in to.iter_mut().zip(&from[k % n * p..][..p]) {
                    *t += by * f;
                }
            }
        }
        out
    }
}

/// Torques of the joints from channels.
pub(crate) fn mixed(share: &[f64], channels: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = channels.len();
    (0..n)
        .map(|j| {
            let mut out = vec![0.0; channels[0].len()];
            for (c, channel) in channels.iter().enumerate() {
                let by = share[j * n + c];
                if by != 0.0 {
                    for (o, x) in out.iter_mut().zip(channel) {
                        *o += by * x;
                    }
                }
            }
            out
        })
        .collect()
}

/// What a robot's rows are made of: base columns, and those of couplings and known torques.
#[derive(Debug, Clone)]
pub(crate) struct RowMaker {
    robot: Robot,
    columns: Columns,
    /// Columns of the model alone, then three a coupled motor, then one a known torque.
    pub(crate) p: usize,
    coupled: Vec<usize>,
}

impl RowMaker {
    pub(crate) fn new(robot: &Robot) -> Self {
        let structure = Structure::of_torque(robot, DriveColumns::ALL, KeepOrder::Links);
        let columns = structure.base_columns();
        let drives = robot.drives();
        let coupled: Vec<usize> = (0..robot.n_joints())
            .filter(|&m| drives.couplings.iter().any(|c| c.motor == m))
            .collect();
        Self {
            p: columns.len() + 3 * coupled.len() + drives.known_torques.len(),
            robot: robot.clone(),
            columns,
            coupled,
        }
    }

    /// The same columns of the robot under another gravity.
    pub(crate) fn with_gravity(&self, gravity: nalgebra::Vector3<f64>) -> Option<Self> {
        let robot = self.robot.clone().with_gravity(gravity).ok()?;
        Some(Self {
            robot,
            ..self.clone()
        })
    }

    /// Columns of a kind of parameter, one a joint where it is there.
    pub(crate) fn column_of(&self, kind: ParameterKind, joint: usize) -> Option<usize> {
        let here = |c: &idim_model::Parameter| c.kind == kind && c.index == joint;
        self.columns.0.iter().position(here)
    }

    /// Rows of all samples, `(sample · n + joint) · p`. `fastest`: largest speed of each joint.
    pub(crate) fn rows(&self, states: &JointStates, fastest: &[f64]) -> Vec<f64> {
        let (n, p, own) = (self.robot.n_joints(), self.p, self.columns.len());
        let model = Model::new(&self.robot);
        let mut rows = vec![0.0; states.n_samples() * n * p];
        let friction: Vec<Option<usize>> = (0..n)
            .map(|j| self.column_of(ParameterKind::Fc, j))
            .collect();
        let turn = |v: f64, fastest: f64| (v / (TURNING * fastest)).tanh();
        visit_torque_regressor(&model, &self.columns, states, |block| {
            for lane in 0..block.n_samples() {
                let k = block.first_sample() + lane;
                for j in 0..n {
                    let row = &mut rows[(k * n + j) * p..][..own];
                    block.copy_row(j, lane, row);
                    if let Some(c) = friction[j] {
                        row[c] = turn(states.qd(j)[k], fastest[j]);
                    }
                }
            }
        });
        for (at, &motor) in self.coupled.iter().enumerate() {
            let shares = self.shares(motor);
            let top: f64 = shares.iter().map(|&(j, s)| s.abs() * fastest[j]).sum();
            for k in 0..states.n_samples() {
                let (mut qd, mut qdd) = (0.0, 0.0);
                for &(j, share) in &shares {
                    qd += share * states.qd(j)[k];
                    qdd += share * states.qdd(j)[k];
                }
                for &(j, share) in &shares {
                    let row = &mut rows[(k * n + j) * p..][..p];
                    let c = own + 3 * at;
                    row[c] = share * qdd;
                    row[c + 1] = share * qd;
                    row[c + 2] = share * turn(qd, top);
                }
            }
        }
        let first = own + 3 * self.coupled.len();
        for (at, known) in self.robot.drives().known_torques.iter().enumerate() {
            let j = known.joint();
            for k in 0..states.n_samples() {
                let torque = known.at(states.q(j)[k]);
                // A reading in degrees may lie where the formula has no value.
                rows[(k * n + j) * p + first + at] = if torque.is_finite() { torque } else { 0.0 };
            }
        }
        rows
    }

    /// Turns of a motor per turn of each joint, its own joint counting one.
    fn shares(&self, motor: usize) -> Vec<(usize, f64)> {
        let own = self.robot.joints()[motor]
            .actuator
            .gear_ratio
            .unwrap_or(1.0);
        let others = self.robot.drives().couplings.iter();
        let others = others.filter(|c| c.motor == motor);
        std::iter::once((motor, 1.0))
            .chain(others.map(|c| (c.joint, c.ratio / own)))
            .collect()
    }
}
