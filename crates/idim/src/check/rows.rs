//! Smooth samples of a log and the rows a robot has at them.

use super::moments::FOLDS;
use super::readings::Reading;
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
    /// Independent samples in the time the arm moves: two a period of the low-pass.
    pub(crate) independent: f64,
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
        let cutoff = CUTOFF.min(0.2 * rate);
        let low_pass = Some(LowPass { order: 2, cutoff });
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
        let intervals = moving.iter().map(|&(s, _)| segments[s].interval);
        let independent = 2.0 * cutoff * intervals.sum::<f64>();
        let stride = moving.len().div_ceil(SAMPLES).max(1);
        let at: Vec<(usize, usize)> = moving.into_iter().step_by(stride).collect();
        if at.len() < 10 * n.max(4) {
            return None;
        }
        let fold = (0..at.len()).map(|k| (k * STRETCHES / at.len()) % FOLDS);
        let mut samples = Self {
            fold: fold.collect(),
            independent,
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

    /// The longest stretch, its columns read in a way.
    pub(crate) fn longest_as(&self, motors: &Motors, reading: &Reading) -> Segment {
        let longest = (0..self.segments.len()).max_by_key(|&s| self.segments[s].time.len());
        let mut segment = self.segments[longest.unwrap_or(0)].clone();
        segment.states = motors.states(&segment.states, &reading.position, &reading.position_scale);
        segment.torque = motors.torques(segment.torque, reading);
        segment
    }

    /// Range of a joint's position, rad or m.
    pub(crate) fn range(&self, joint: usize) -> f64 {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let q = self.states.q(joint).iter();
        let (low, high) = q.fold(ends, |(a, b), &x| (a.min(x), b.max(x)));
        high - low
    }

    /// When each sample was taken, from -1/2 at the first to 1/2 at the last.
    pub(crate) fn moments_in_time(&self) -> Vec<f64> {
        let time: Vec<f64> = self
            .at
            .iter()
            .map(|&(s, k)| self.segments[s].time[k])
            .collect();
        let (first, last) = (time[0], time[time.len() - 1]);
        let at = |t: &f64| (t - first) / (last - first) - 0.5;
        time.iter().map(at).collect()
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
        let states = motors.states(&self.states, from, scale);
        let fastest = (0..states.n_joints()).map(|j| {
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
    joints_from_columns: Vec<f64>,
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
        let forward = turns.transpose();
        let inverse = forward.clone().try_inverse().filter(|_| coupled);
        let by_rows = |m: DMatrix<f64>| (0..n * n).map(|k| m[(k / n, k % n)]).collect();
        Self {
            joints_from_columns: by_rows(forward),
            columns_from_joints: inverse.map(by_rows),
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
    pub(crate) fn change_of_positions(&self, from: &[usize], scale: &[f64]) -> Vec<f64> {
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

    /// States when the columns of the positions are read otherwise.
    fn states(&self, recorded: &JointStates, from: &[usize], scale: &[f64]) -> JointStates {
        let mut states = recorded.clone();
        let (n, count) = (states.n_joints(), states.n_samples());
        let change = self.change_of_positions(from, scale);
        for j in 0..n {
            for k in 0..count {
                let (mut q, mut qd, mut qdd) = (self.zero[j], 0.0, 0.0);
                for i in 0..n {
                    let by = change[j * n + i];
                    if by != 0.0 {
                        q += by * (recorded.q(i)[k] - self.zero[i]);
                        qd += by * recorded.qd(i)[k];
                        qdd += by * recorded.qdd(i)[k];
                    }
                }
                states.q_mut(j)[k] = q;
                states.qd_mut(j)[k] = qd;
                states.qdd_mut(j)[k] = qdd;
            }
        }
        states
    }

    /// Torques of the joints when their columns are read otherwise.
    pub(crate) fn torques(&self, recorded: Vec<Vec<f64>>, reading: &Reading) -> Vec<Vec<f64>> {
        if reading.torque_as_recorded() {
            return recorded;
        }
        let change = self.change_of_torques(&reading.torque, &reading.torque_scale);
        let columns = mixed(&change, &self.columns(recorded));
        match self.columns_from_joints {
            Some(_) => mixed(&self.joints_from_columns, &columns),
            None => columns,
        }
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

/// Shares of the friction next to standstill and of that at full speed in the friction at a speed: a straight line
/// between both opposes every motion where both values do, even if friction falls with speed.
fn ends(speed: f64, fastest: f64) -> [f64; 2] {
    let share = speed / fastest;
    [(share / TURNING).tanh() - share, share]
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

    /// Columns whose values cannot be negative: frictions at standstill and at full speed.
    pub(crate) fn positive(&self) -> Vec<usize> {
        let kinds = [ParameterKind::Fc, ParameterKind::Fv];
        let own = (0..self.columns.len()).filter(|&c| kinds.contains(&self.columns.0[c].kind));
        let first = self.columns.len();
        let motors = (0..self.coupled.len()).flat_map(|at| [1, 2].map(|k| first + 3 * at + k));
        own.chain(motors).collect()
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
        let friction: Vec<[Option<usize>; 2]> = (0..n)
            .map(|j| [ParameterKind::Fc, ParameterKind::Fv].map(|kind| self.column_of(kind, j)))
            .collect();
        visit_torque_regressor(&model, &self.columns, states, |block| {
            for lane in 0..block.n_samples() {
                let k = block.first_sample() + lane;
                for j in 0..n {
                    let row = &mut rows[(k * n + j) * p..][..own];
                    block.copy_row(j, lane, row);
                    if let [Some(c), Some(v)] = friction[j] {
                        [row[c], row[v]] = ends(states.qd(j)[k], fastest[j]);
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
                    [row[c + 1], row[c + 2]] = ends(qd, top).map(|x| share * x);
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
