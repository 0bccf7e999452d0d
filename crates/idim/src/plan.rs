//! How the samples of all logs are made: decided once from the data, or fixed by options.

use crate::samples::{ORDER, median_interval};
use idim_measurement::{Derivatives, Measurements};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// What the caller fixes of the sampling; the rest is chosen from the data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SamplingOptions {
    /// Take q, q̇, q̈ and torque as they are.
    pub as_recorded: bool,
    /// Low-pass of positions and velocities, Hz; by the error on blocks held out where `None`.
    pub cutoff: Option<f64>,
    /// Rows a second after the parallel decimation, Hz; from the cutoff where `None`. 20 to 100 typical.
    pub rate: Option<f64>,
    /// Differentiate positions though velocities are recorded.
    pub derive_velocity: bool,
    /// Speed below which a joint's rows are left out, rad/s (m/s): one for all, or one a joint; 0.05 to 0.1 typical, 0 for
    /// none. A fiftieth of each joint's largest speed where empty and Coulomb friction is asked for.
    pub dead_band: Vec<f64>,
}

/// What the training logs say of their sampling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    /// Bandwidth of the velocities, Hz.
    pub(crate) bandwidth: f64,
    /// Lowest sample rate, Hz.
    pub(crate) rate: f64,
    /// Duration of the shortest log, s.
    pub(crate) shortest: f64,
    /// Whether recorded velocities serve.
    pub(crate) recorded: bool,
}

/// Parallel low-pass and decimation of regressor and torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Parallel {
    /// Butterworth at a cutoff, Hz, one sample in `factor` kept.
    Butterworth { cutoff: f64, factor: usize },
    /// Butterworth at 0.8 of half the new rate, to about this many rows a second.
    ToRate(f64),
}

/// How the samples of all logs are made, decided once from the data.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SamplingPlan {
    /// What the choices rest on; `None` takes q, q̇, q̈ as recorded.
    pub(crate) motion: Option<Motion>,
    /// Low-pass of positions and velocities, Hz; `None` takes q, q̇, q̈ as recorded.
    pub(crate) cutoff: Option<f64>,
    /// Left out at both ends of a stretch, s; where `None`, until the low-pass has settled.
    pub(crate) trim: Option<f64>,
    /// Parallel low-pass of regressor and torque, and the rows kept after it.
    pub(crate) parallel: Option<Parallel>,
    /// Whether the recorded velocity serves, or positions are differentiated.
    pub(crate) derivatives: Derivatives,
    /// Speed below which a joint's rows are left out, rad/s, joint by joint.
    pub(crate) dead_band: Vec<f64>,
    /// Speed over which each joint's Coulomb torque changes sign, rad/s: `tanh(q̇/v₀)`; 0 is the sign itself.
    pub(crate) reversal: Vec<f64>,
    /// The choices in words.
    pub(crate) choices: Vec<String>,
}

/// Cutoff of the low-pass before a stated rate, as a share of half of it: as MATLAB's `decimate`, but a Butterworth's edges
/// settle in a fifth of the time.
pub(crate) const PASS_BAND: f64 = 0.8;
/// The motion's bandwidth holds this share of the energy of the velocities.
const BANDWIDTH_SHARE: f64 = 0.99;
/// Low-pass of the positions, in bandwidths: far enough that the motion passes untouched.
const POSITION_CUTOFF: f64 = 20.0;
/// Highest cutoff as a share of the sample rate.
const HIGHEST_CUTOFF: f64 = 0.4;
/// Half the rate after decimation, in cutoffs of the parallel low-pass.
const DECIMATED_BAND: f64 = 1.25;

impl SamplingPlan {
    /// From the options, and from the bandwidth of the motion in the training logs where they leave a choice.
    pub(crate) fn new(training: &[Measurements], options: &SamplingOptions) -> Self {
        let n = training.first().map_or(0, Measurements::n_joints);
        let plan = if options.as_recorded {
            Self::as_recorded()
        } else {
            let motion = Motion::of(training, options);
            let cutoff = options.cutoff.unwrap_or_else(|| motion.far_cutoff());
            let why = if options.cutoff.is_some() {
                "as stated"
            } else {
                "20 bandwidths of the motion"
            };
            Self::of_motion(motion, cutoff, cutoff, why, options)
        };
        let plan = Self {
            reversal: vec![0.0; n],
            ..plan
        };
        if options.dead_band.is_empty() {
            return plan;
        }
        let of = |j: usize| options.dead_band[j.min(options.dead_band.len() - 1)];
        plan.with_dead_band((0..n).map(of).collect(), "as stated")
    }

    fn as_recorded() -> Self {
        Self {
            motion: None,
            cutoff: None,
            trim: None,
            parallel: None,
            derivatives: Derivatives::OfVelocities,
            dead_band: Vec::new(),
            reversal: Vec::new(),
            choices: vec![
                "q, qd, qdd and torque as recorded: no filter, no differentiation, no decimation"
                    .into(),
            ],
        }
    }

    /// With a cutoff, Hz, for the states, and one for the parallel low-pass where the options leave its rate open.
    fn of_motion(
        motion: Motion,
        cutoff: f64,
        parallel: f64,
        why: &str,
        options: &SamplingOptions,
    ) -> Self {
        let parallel = match options.rate {
            Some(wanted) => Parallel::ToRate(wanted),
            // A cutoff above the highest that a decimated rate can have leaves the rows as they are.
            None => Parallel::Butterworth {
                cutoff: parallel,
                factor: ((0.5 * motion.rate / (DECIMATED_BAND * parallel)).floor() as usize).max(1),
            },
        };
        Self {
            motion: Some(motion),
            cutoff: Some(cutoff),
            trim: None,
            parallel: Some(parallel),
            derivatives: if motion.recorded {
                Derivatives::OfVelocities
            } else {
                Derivatives::OfPositions
            },
            dead_band: Vec::new(),
            reversal: Vec::new(),
            choices: choices(motion, cutoff, parallel, why),
        }
    }

    /// The same plan with another cutoff of the states; regressor and torque stay in the same band.
    pub(crate) fn with_cutoff(&self, cutoff: f64, why: &str, options: &SamplingOptions) -> Self {
        let Some(motion) = self.motion else {
            return self.clone();
        };
        let mut plan = Self {
            reversal: self.reversal.clone(),
            dead_band: self.dead_band.clone(),
            ..Self::of_motion(motion, cutoff, motion.far_cutoff(), why, options)
        };
        let said = self.choices.iter().skip(plan.choices.len()).cloned();
        plan.choices.extend(said);
        plan
    }

    /// The same plan with a dead band, rad/s (m/s), joint by joint.
    pub(crate) fn with_dead_band(mut self, dead_band: Vec<f64>, why: &str) -> Self {
        self.choices.push(if dead_band.iter().any(|v| *v > 0.0) {
            format!(
                "dead band: rows of a joint slower than {} rad/s left out, {why}",
                texts(&dead_band)
            )
        } else {
            format!("dead band: none, {why}")
        });
        self.dead_band = dead_band;
        self
    }

    /// The same plan with the Coulomb torque of each joint smoothed over a speed, rad/s (m/s).
    pub(crate) fn with_reversal(&self, reversal: Vec<f64>, why: &str) -> Self {
        let mut plan = self.clone();
        plan.choices.push(format!(
            "Coulomb friction: tanh(qd / v) with v = {} rad/s, {why}",
            texts(&reversal)
        ));
        plan.reversal = reversal;
        plan
    }
}

impl Motion {
    fn of(training: &[Measurements], options: &SamplingOptions) -> Self {
        let recorded = !options.derive_velocity && training.iter().all(|m| m.qd.is_some());
        let mut motion = Self {
            bandwidth: 0.0,
            rate: f64::INFINITY,
            shortest: f64::INFINITY,
            recorded,
        };
        for m in training {
            let dt = median_interval(&m.time);
            motion.rate = motion.rate.min(1.0 / dt);
            motion.shortest = motion.shortest.min(dt * m.n_samples() as f64);
            for j in 0..m.n_joints() {
                let velocity = match &m.qd {
                    Some(qd) if recorded => qd[j].clone(),
                    _ => m.q[j].windows(2).map(|w| (w[1] - w[0]) / dt).collect(),
                };
                motion.bandwidth = motion.bandwidth.max(bandwidth(&velocity, dt));
            }
        }
        motion
    }

    /// A cutoff far above the motion, Hz.
    pub(crate) fn far_cutoff(&self) -> f64 {
        (POSITION_CUTOFF * self.bandwidth).min(self.highest_cutoff())
    }

    /// Highest cutoff a low-pass can have, Hz: beyond it the bilinear transform bends it out of shape.
    pub(crate) fn highest_cutoff(&self) -> f64 {
        HIGHEST_CUTOFF * self.rate
    }
}

/// One number where all are the same, else all; three digits.
fn texts(numbers: &[f64]) -> String {
    let shown = if numbers.iter().all(|v| *v == numbers[0]) {
        &numbers[..1]
    } else {
        numbers
    };
    let three = |v: &f64| format!("{v:.2e}").parse().unwrap_or(*v).to_string();
    let words: Vec<String> = shown.iter().map(three).collect();
    words.join(", ")
}

fn choices(motion: Motion, cutoff: f64, parallel: Parallel, why: &str) -> Vec<String> {
    vec![
        format!(
            "bandwidth of the motion: {:.3} Hz ({:.0} % of the energy of the velocities)",
            motion.bandwidth,
            100.0 * BANDWIDTH_SHARE
        ),
        format!(
            "low-pass of positions and velocities: {cutoff:.2} Hz, zero-phase Butterworth of order {ORDER}, {why}"
        ),
        format!(
            "velocities: {}",
            if motion.recorded {
                "recorded, low-passed; accelerations from them"
            } else {
                "from positions"
            }
        ),
        match parallel {
            Parallel::Butterworth { cutoff, factor } => format!(
                "parallel decimation of regressor and torque: one sample in {factor}, after a Butterworth low-pass at {cutoff:.2} Hz"
            ),
            Parallel::ToRate(rate) => format!(
                "parallel decimation of regressor and torque: to {rate} Hz, after a Butterworth low-pass at 0.8 of half that rate, as stated"
            ),
        },
    ]
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
