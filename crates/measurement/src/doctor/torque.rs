//! Findings from torques without a model: a joint's own friction and inertia must be positive, and its own.

use crate::clock::read_clock;
use crate::conditioning::{ConditioningOptions, LowPass, Segment, condition};
use crate::doctor::finding::{Finding, Severity};
use crate::doctor::regression::{Basis, dot, lowest, norm};
use crate::doctor::signals::drive;
use crate::error::Place;
use crate::log::Log;
use crate::measurements::Measurements;

/// Cutoff, Hz, of the motion the doctor looks at.
const CUTOFF: f64 = 10.0;
/// Rows the doctor looks at.
const ROWS: usize = 3000;
/// Longest delay looked for, s.
const LONGEST: f64 = 0.08;

/// Smoothed samples, and what is needed to shift one channel against the others.
pub(crate) struct Samples {
    segment: Segment,
    rows: Vec<usize>,
    reach: usize,
}

impl Samples {
    /// The longest stretch of the log without a gap, low-passed; `None` if it is too short to say anything.
    pub(crate) fn new(log: &Log) -> Option<Self> {
        let rate = 1.0 / read_clock(&log.time).interval;
        let low_pass = Some(LowPass {
            order: 2,
            cutoff: CUTOFF.min(0.2 * rate),
        });
        let options = ConditioningOptions {
            low_pass,
            torque_low_pass: low_pass,
            ..ConditioningOptions::default()
        };
        let measured = Measurements {
            file: log.file.clone(),
            joints: log.joints.clone(),
            time: log.time.clone(),
            q: log.q.clone(),
            qd: None,
            qdd: None,
            torque: drive(log).to_vec(),
        };
        let segments = condition(&measured, &options).ok()?.segments;
        let segment = segments.into_iter().max_by_key(|s| s.time.len())?;
        let n = segment.time.len();
        let reach = (LONGEST / segment.interval).ceil() as usize;
        let columns = 3 * log.n_joints() + 3;
        if n < 2 * reach + 10 * columns {
            return None;
        }
        let stride = n.div_ceil(ROWS);
        let rows = (reach..n - reach).step_by(stride).collect();
        Some(Self {
            segment,
            rows,
            reach,
        })
    }

    fn torque(&self, joint: usize) -> Vec<f64> {
        let x = &self.segment.torque[joint];
        self.rows.iter().map(|&k| x[k]).collect()
    }

    fn column(&self, f: impl Fn(usize) -> f64) -> Vec<f64> {
        self.rows.iter().map(|&k| f(k)).collect()
    }

    /// Sign of a speed that fades below a fiftieth of the largest: noise at rest has no sign.
    fn friction(&self, joint: usize) -> Vec<f64> {
        let qd = self.segment.states.qd(joint);
        let width = 0.02
            * qd.iter()
                .fold(0.0f64, |m, v| m.max(v.abs()))
                .max(f64::MIN_POSITIVE);
        self.column(|k| (qd[k] / width).tanh())
    }

    /// Columns that any arm's gravity and inertia are close to: a constant, and the sine, the cosine and the acceleration
    /// of every joint. More of them would explain friction away on motions of few frequencies.
    fn common(&self) -> Basis {
        let states = &self.segment.states;
        let mut basis = Basis::new([self.column(|_| 1.0)]);
        for j in 0..states.n_joints() {
            let (q, qdd) = (states.q(j), states.qdd(j));
            basis.push(self.column(|k| q[k].sin()));
            basis.push(self.column(|k| q[k].cos()));
            basis.push(self.column(|k| qdd[k]));
        }
        basis
    }
}

/// Correlation of a torque with its friction, gravity and inertia taken off, from which its sign is believed.
const BELIEVED: f64 = 0.3;
/// Share of the strongest correlation that the joint's own must have.
const STRONGEST: f64 = 0.8;
/// Correlation from which a torque's owner is believed.
const OWNED: f64 = 0.5;

/// What the friction of joint `i` explains of torque `j`, signed: `share[j][i]`.
pub(crate) fn friction_shares(samples: &Samples) -> Vec<Vec<f64>> {
    let n = samples.segment.torque.len();
    let common = samples.common();
    let frictions: Vec<Vec<f64>> = (0..n)
        .map(|i| common.residual(samples.friction(i)))
        .collect();
    (0..n)
        .map(|j| {
            let torque = common.residual(samples.torque(j));
            frictions
                .iter()
                .map(|f| {
                    let length = norm(f) * norm(&torque);
                    if length > 0.0 {
                        dot(f, &torque) / length
                    } else {
                        0.0
                    }
                })
                .collect()
        })
        .collect()
}

/// Friction that drives, or that belongs to another joint.
pub(crate) fn friction(log: &Log, samples: &Samples, out: &mut Vec<Finding>) {
    let shares = friction_shares(samples);
    let owners: Vec<usize> = shares.iter().map(|s| owner(s)).collect();
    for (j, shares_of_j) in shares.iter().enumerate() {
        let place = Place::file(&log.file).joint(&log.joints[j]);
        let (i, own) = (owners[j], shares_of_j[j]);
        let strange = i != j && shares_of_j[i] > OWNED && own < 0.5 * shares_of_j[i];
        // Whose torque is here must itself be somewhere else.
        if strange && owners[i] != i {
            out.push(Finding::new(
                "joint-order",
                Severity::Error,
                place,
                i as f64 + 1.0,
                format!(
                    "the torque changes with the direction of joint {}, not with its own",
                    log.joints[i]
                ),
                "positions and torques must list the joints in one order",
                format!("this column belongs to {}", log.joints[i]),
            ));
        } else if own < -BELIEVED && shares_of_j.iter().all(|s| STRONGEST * s.abs() <= own.abs()) {
            out.push(Finding::new(
                "torque-sign",
                Severity::Error,
                place,
                -1.0,
                format!("friction drives the motion (correlation {own:.2})"),
                "friction opposes motion, so positive torque must go with positive speed",
                "change the sign of this joint's torque, or of its position",
            ));
        }
    }
}

/// The joint whose friction a torque shows most.
fn owner(shares: &[f64]) -> usize {
    (0..shares.len())
        .max_by(|&a, &b| shares[a].total_cmp(&shares[b]))
        .unwrap_or(0)
}

/// Delay worth a warning, s; single joints scatter by as much on real arms.
const DELAY: f64 = 0.008;
/// Delay of the torques behind the positions, one finding for the log.
pub(crate) fn delay(log: &Log, samples: &Samples, out: &mut Vec<Finding>) {
    let states = &samples.segment.states;
    let fits: Vec<(&[f64], Basis)> = (0..states.n_joints())
        .map(|j| {
            let mut basis = samples.common();
            let qd = states.qd(j);
            basis.push(samples.friction(j));
            basis.push(samples.column(|k| qd[k]));
            (samples.segment.torque[j].as_slice(), basis)
        })
        .collect();
    let interval = samples.segment.interval;
    let independent = samples.segment.time.len() as f64 * interval * 2.0 * CUTOFF;
    let Some(lag) = common_lag(&fits, &samples.rows, samples.reach, independent) else {
        return;
    };
    let lag = lag * interval;
    if lag.abs() > DELAY.max(1.5 * interval) {
        out.push(Finding::new(
            "torque-delay",
            Severity::Warning,
            Place::file(&log.file),
            lag,
            format!("torques lag positions by {:.1} ms", 1e3 * lag),
            "channels must be of one instant",
            format!(
                "take it out with --delay {:.1} (ms), or log both at one clock",
                1e3 * lag
            ),
        ));
    }
}

/// Log-likelihood ratio from which a lag is believed over none and over the longest ones.
///
/// Far above what noise gives, because what a simple model leaves is no noise.
const BELIEVED_LAG: f64 = 40.0;

/// Lag, in samples, of torques behind the columns that explain them; zero where the best one hardly differs from none, `None` where
/// none up to `reach` stands out.
///
/// For independent errors of unknown size the log-likelihood of a lag is minus the number of samples times the sum of
/// the logarithms of what it leaves, so all joints speak, each with its own weight. Each basis holds its columns at
/// `rows`, which stay `reach` away from both ends.
fn common_lag(
    torques: &[(&[f64], Basis)],
    rows: &[usize],
    reach: usize,
    independent: f64,
) -> Option<f64> {
    let step = (2 * reach).div_ceil(60).max(1);
    let half = reach / step;
    let curve: Vec<f64> = (0..=2 * half)
        .map(|l| {
            let shift = |k: usize| k + l * step - half * step;
            let left = torques.iter().map(|(torque, basis)| {
                let shifted = rows.iter().map(|&k| torque[shift(k)]).collect();
                norm(&basis.residual(shifted)).max(f64::MIN_POSITIVE).ln()
            });
            independent * left.sum::<f64>()
        })
        .collect();
    let at = lowest(&curve);
    let low = curve[at.round() as usize];
    let stands_out = |l: usize| curve[l] - low > BELIEVED_LAG;
    if !(stands_out(0) && stands_out(2 * half)) {
        return None;
    }
    let lag = (at - half as f64) * step as f64;
    Some(if stands_out(half) { lag } else { 0.0 })
}

/// Lag (s) of a torque behind the regressor columns of its joint, up to `longest` (s); `None` where none stands out.
///
/// `columns[column][sample]` and `torque` of the same samples, `interval` (s) apart.
///
/// # Panics
/// If the lengths differ.
#[track_caller]
pub fn torque_lag(
    torque: &[f64],
    columns: &[Vec<f64>],
    interval: f64,
    longest: f64,
) -> Option<f64> {
    let n = torque.len();
    for column in columns {
        assert_eq!(column.len(), n, "samples of a column and of the torque");
    }
    let reach = (longest / interval).ceil() as usize;
    if n < 2 * reach + 10 * columns.len() {
        return None;
    }
    let rows: Vec<usize> = (reach..n - reach).step_by(n.div_ceil(ROWS)).collect();
    let picked = columns.iter().map(|c| rows.iter().map(|&k| c[k]).collect());
    let basis = Basis::new(picked);
    Some(common_lag(&[(torque, basis)], &rows, reach, rows.len() as f64)? * interval)
}
