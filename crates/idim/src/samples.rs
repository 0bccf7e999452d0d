//! From a log to rows of the base regressor and torques: conditioned, filtered and decimated alike.

use crate::error::Error;
use idim_measurement::{
    ConditioningOptions, Decimator, Derivatives, LowPass, Measurements, condition,
};
use idim_model::{
    Columns, JointKind, JointStates, Model, ParameterKind, Robot, visit_torque_regressor,
};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// How the samples of all logs are made, decided once from the data.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SamplingPlan {
    /// Low-pass of positions and velocities, Hz; `None` takes q, q̇, q̈ as recorded.
    pub(crate) cutoff: Option<f64>,
    /// Parallel low-pass of regressor and torque, Hz, and samples per row kept after it.
    pub(crate) parallel: Option<(f64, usize)>,
    /// Whether the recorded velocity serves, or positions are differentiated.
    pub(crate) derivatives: Derivatives,
    /// Speed over which the Coulomb torque changes sign, rad/s: `tanh(q̇/v₀)`; 0 is the sign itself.
    pub(crate) coulomb_speed: f64,
    /// The choices in words.
    pub(crate) choices: Vec<String>,
}

/// The motion's bandwidth holds this share of the energy of the velocities.
const BANDWIDTH_SHARE: f64 = 0.99;
/// Low-pass of the positions, in bandwidths: far enough that the motion passes untouched.
const POSITION_CUTOFF: f64 = 20.0;
/// Half the rate after decimation, in cutoffs of the parallel low-pass.
const DECIMATED_BAND: f64 = 1.25;
/// Order of the Butterworth low-pass of positions.
const ORDER: usize = 4;
/// A prismatic joint's smoothing speed, m/s, per rad/s of a revolute one.
const PRISMATIC_SPEED: f64 = 0.1;

impl SamplingPlan {
    /// q, q̇, q̈ and torque taken as they are.
    pub(crate) fn as_recorded() -> Self {
        Self {
            cutoff: None,
            parallel: None,
            derivatives: Derivatives::OfVelocities,
            coulomb_speed: 0.0,
            choices: vec![
                "q, qd, qdd and torque as recorded: no filter, no differentiation, no decimation"
                    .into(),
            ],
        }
    }

    /// From the bandwidth of the motion in the training logs.
    pub(crate) fn from_motion(training: &[Measurements]) -> Self {
        let recorded = training.iter().all(|m| m.qd.is_some());
        let (mut band, mut rate) = (0.0_f64, f64::INFINITY);
        for m in training {
            let dt = median_interval(&m.time);
            rate = rate.min(1.0 / dt);
            for j in 0..m.n_joints() {
                let velocity = match &m.qd {
                    Some(qd) if recorded => qd[j].clone(),
                    _ => m.q[j].windows(2).map(|w| (w[1] - w[0]) / dt).collect(),
                };
                band = band.max(bandwidth(&velocity, dt));
            }
        }
        let cutoff = (POSITION_CUTOFF * band).min(0.4 * rate);
        let factor = ((0.5 * rate / (DECIMATED_BAND * cutoff)).floor() as usize).max(1);
        let choices = vec![
            format!(
                "bandwidth of the motion: {band:.3} Hz ({:.0} % of the energy of the velocities)",
                100.0 * BANDWIDTH_SHARE
            ),
            format!(
                "low-pass of positions and velocities: {cutoff:.2} Hz, zero-phase Butterworth of order {ORDER}"
            ),
            format!(
                "velocities: {}",
                if recorded {
                    "recorded, low-passed; accelerations from them"
                } else {
                    "from positions"
                }
            ),
            format!(
                "parallel decimation of regressor and torque: one sample in {factor}, after the same low-pass",
            ),
        ];
        Self {
            cutoff: Some(cutoff),
            parallel: Some((cutoff, factor)),
            derivatives: if recorded {
                Derivatives::OfVelocities
            } else {
                Derivatives::OfPositions
            },
            coulomb_speed: 0.0,
            choices,
        }
    }
}

impl SamplingPlan {
    /// The same plan with the Coulomb torque smoothed over a speed, rad/s.
    pub(crate) fn with_coulomb_speed(&self, speed: f64) -> Self {
        let mut plan = self.clone();
        plan.coulomb_speed = speed;
        plan.choices.push(format!(
            "Coulomb friction: tanh(qd / {speed} rad/s), the smoothing that fits the training data best"
        ));
        plan
    }
}

/// A stretch of samples with everything the equations need.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    /// Time on the log's clock, s.
    pub(crate) time: Vec<f64>,
    /// Conditioned states.
    pub(crate) states: JointStates,
    /// Recorded torque, joint by joint.
    pub(crate) torque: Vec<Vec<f64>>,
}

/// The stretches of a log under a plan; never one across a gap.
///
/// # Errors
/// A log the plan does not fit: too short, full of gaps, or a recorded quantity missing.
pub(crate) fn stretches(
    measured: &Measurements,
    plan: &SamplingPlan,
) -> Result<Vec<Stretch>, Error> {
    let Some(cutoff) = plan.cutoff else {
        return Ok(vec![Stretch {
            time: measured.time.clone(),
            states: measured.states_as_recorded()?,
            torque: measured.torque.clone(),
        }]);
    };
    let options = ConditioningOptions {
        low_pass: Some(LowPass {
            order: ORDER,
            cutoff,
        }),
        derivatives: plan.derivatives,
        ..ConditioningOptions::default()
    };
    let conditioned = condition(measured, &options)?;
    Ok(conditioned
        .segments
        .into_iter()
        .map(|s| Stretch {
            time: s.time,
            states: s.states,
            torque: s.torque,
        })
        .collect())
}

/// Rows of W and y, sample by sample: row `sample · n_joints + joint`, row-major.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    /// Entries of W.
    pub(crate) w: Vec<f64>,
    /// Torques.
    pub(crate) y: Vec<f64>,
}

/// Appends the decimated rows of a stretch; nothing when it is too short for the filter.
pub(crate) fn push_rows(
    rows: &mut Rows,
    robot: &Robot,
    columns: &Columns,
    stretch: &Stretch,
    plan: &SamplingPlan,
) -> Result<(), Error> {
    let rate = 1.0 / median_interval(&stretch.time);
    let decimator = match plan.parallel {
        Some((cutoff, factor)) => Decimator::butterworth(factor, ORDER, cutoff, rate)?,
        None => Decimator::chebyshev(1)?,
    };
    let n_samples = stretch.states.n_samples();
    if n_samples < decimator.fewest_samples() {
        return Ok(());
    }
    let (n, p) = (robot.n_joints(), columns.len());
    let kept = decimator.kept(n_samples).len();
    let start = rows.y.len();
    rows.w.resize((start + kept * n) * p, 0.0);
    rows.y.resize(start + kept * n, 0.0);
    for joint in 0..n {
        // One joint at a time: its columns over all samples are the largest thing in memory.
        let mut entries = vec![0.0; p * n_samples];
        visit_rows(
            robot,
            columns,
            &stretch.states,
            plan.coulomb_speed,
            |sample, i, row| {
                if i == joint {
                    for (c, &x) in row.iter().enumerate() {
                        entries[c * n_samples + sample] = x;
                    }
                }
            },
        );
        let mut series: Vec<&[f64]> = entries.chunks_exact(n_samples).collect();
        series.push(&stretch.torque[joint]);
        let decimated = decimator.decimate_columns(&series);
        for k in 0..kept {
            let row = start + k * n + joint;
            for c in 0..p {
                rows.w[row * p + c] = decimated[c][k];
            }
            rows.y[row] = decimated[p][k];
        }
    }
    Ok(())
}

/// Hands out every row of the regressor with the Coulomb entries smoothed: (sample, joint, row).
pub(crate) fn visit_rows(
    robot: &Robot,
    columns: &Columns,
    states: &JointStates,
    coulomb_speed: f64,
    mut visit: impl FnMut(usize, usize, &[f64]),
) {
    let model = Model::new(robot);
    let coulomb: Vec<Option<usize>> = (0..robot.n_joints())
        .map(|j| {
            columns
                .0
                .iter()
                .position(|p| p.kind == ParameterKind::Fc && p.index == j)
        })
        .collect();
    let speed = reversal_speeds(robot, coulomb_speed);
    let mut row = vec![0.0; columns.len()];
    visit_torque_regressor(&model, columns, states, |block| {
        for lane in 0..block.n_samples() {
            let sample = block.first_sample() + lane;
            for joint in 0..block.n_joints() {
                block.copy_row(joint, lane, &mut row);
                if let (Some(c), true) = (coulomb[joint], coulomb_speed > 0.0) {
                    row[c] = (states.qd(joint)[sample] / speed[joint]).tanh();
                }
                visit(sample, joint, &row);
            }
        }
    });
}

/// Speed over which each joint's Coulomb torque changes sign, rad/s (m/s), from that of a revolute one.
pub(crate) fn reversal_speeds(robot: &Robot, coulomb_speed: f64) -> Vec<f64> {
    let joints = robot.joints().iter();
    let speed = |kind| match kind {
        JointKind::Revolute => coulomb_speed,
        JointKind::Prismatic => coulomb_speed * PRISMATIC_SPEED,
    };
    joints.map(|j| speed(j.kind)).collect()
}

/// Predicted torque of every sample, joint by joint.
pub(crate) fn predict(
    robot: &Robot,
    columns: &Columns,
    values: &[f64],
    stretch: &Stretch,
    plan: &SamplingPlan,
) -> Vec<Vec<f64>> {
    let mut torque = vec![vec![0.0; stretch.states.n_samples()]; robot.n_joints()];
    visit_rows(
        robot,
        columns,
        &stretch.states,
        plan.coulomb_speed,
        |sample, joint, row| {
            torque[joint][sample] = row.iter().zip(values).map(|(w, x)| w * x).sum();
        },
    );
    torque
}

/// Frequency, Hz, below which lies [`BANDWIDTH_SHARE`] of the energy of a signal's variation.
fn bandwidth(signal: &[f64], dt: f64) -> f64 {
    let n = signal.len();
    let mean = signal.iter().sum::<f64>() / n as f64;
    // A window keeps the jump between last and first sample from posing as fast motion.
    let mut spectrum: Vec<Complex<f64>> = signal
        .iter()
        .enumerate()
        .map(|(k, x)| {
            let hann = (std::f64::consts::PI * k as f64 / n as f64).sin().powi(2);
            Complex::new((x - mean) * hann, 0.0)
        })
        .collect();
    FftPlanner::new().plan_fft_forward(n).process(&mut spectrum);
    let energy: Vec<f64> = spectrum[..=n / 2].iter().map(Complex::norm_sqr).collect();
    let total: f64 = energy.iter().sum();
    let mut sum = 0.0;
    let bin = energy.iter().position(|e| {
        sum += e;
        sum >= BANDWIDTH_SHARE * total
    });
    bin.unwrap_or(0).max(1) as f64 / (n as f64 * dt)
}

fn median_interval(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps[steps.len() / 2]
}
