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
    /// Low-pass of positions and velocities, Hz; from the bandwidth of the motion where `None`.
    pub cutoff: Option<f64>,
    /// Rows a second after the parallel decimation, Hz; from the cutoff where `None`. 20 to 100 typical.
    pub rate: Option<f64>,
    /// Differentiate positions though velocities are recorded.
    pub derive_velocity: bool,
    /// Speed below which a joint's rows are left out, rad/s (m/s): one for all, or one a joint; 0.05 to 0.1 typical.
    pub dead_band: Vec<f64>,
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
    /// Low-pass of positions and velocities, Hz; `None` takes q, q̇, q̈ as recorded.
    pub(crate) cutoff: Option<f64>,
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
/// Half the rate after decimation, in cutoffs of the parallel low-pass.
const DECIMATED_BAND: f64 = 1.25;

impl SamplingPlan {
    /// From the options, and from the bandwidth of the motion in the training logs where they leave a choice.
    pub(crate) fn new(training: &[Measurements], options: &SamplingOptions) -> Self {
        let n = training.first().map_or(0, Measurements::n_joints);
        let mut plan = if options.as_recorded {
            Self::as_recorded()
        } else {
            Self::from_motion(training, options)
        };
        plan.reversal = vec![0.0; n];
        if !options.dead_band.is_empty() {
            plan.dead_band = (0..n)
                .map(|j| options.dead_band[j.min(options.dead_band.len() - 1)])
                .collect();
            plan.choices.push(format!(
                "dead band: rows of a joint slower than {} rad/s left out, as stated",
                texts(&options.dead_band)
            ));
        }
        plan
    }

    fn as_recorded() -> Self {
        Self {
            cutoff: None,
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

    fn from_motion(training: &[Measurements], options: &SamplingOptions) -> Self {
        let recorded = !options.derive_velocity && training.iter().all(|m| m.qd.is_some());
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
        let cutoff = options
            .cutoff
            .unwrap_or_else(|| (POSITION_CUTOFF * band).min(0.4 * rate));
        let factor = ((0.5 * rate / (DECIMATED_BAND * cutoff)).floor() as usize).max(1);
        let parallel = match options.rate {
            Some(wanted) => Parallel::ToRate(wanted),
            // A cutoff above the highest that a decimated rate can have leaves the rows as they are.
            None => Parallel::Butterworth { cutoff, factor },
        };
        Self {
            cutoff: Some(cutoff),
            parallel: Some(parallel),
            derivatives: if recorded {
                Derivatives::OfVelocities
            } else {
                Derivatives::OfPositions
            },
            dead_band: Vec::new(),
            reversal: Vec::new(),
            choices: choices(band, recorded, cutoff, parallel, options),
        }
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

/// One number where all are the same, else all.
fn texts(numbers: &[f64]) -> String {
    let shown = if numbers.iter().all(|v| *v == numbers[0]) {
        &numbers[..1]
    } else {
        numbers
    };
    let words: Vec<String> = shown.iter().map(f64::to_string).collect();
    words.join(", ")
}

fn choices(
    band: f64,
    recorded: bool,
    cutoff: f64,
    parallel: Parallel,
    options: &SamplingOptions,
) -> Vec<String> {
    let stated = |fixed: bool| if fixed { ", as stated" } else { "" };
    vec![
        format!(
            "bandwidth of the motion: {band:.3} Hz ({:.0} % of the energy of the velocities)",
            100.0 * BANDWIDTH_SHARE
        ),
        format!(
            "low-pass of positions and velocities: {cutoff:.2} Hz, zero-phase Butterworth of order {ORDER}{}",
            stated(options.cutoff.is_some())
        ),
        format!(
            "velocities: {}",
            if recorded {
                "recorded, low-passed; accelerations from them"
            } else {
                "from positions"
            }
        ),
        match parallel {
            Parallel::Butterworth { factor, .. } => format!(
                "parallel decimation of regressor and torque: one sample in {factor}, after the same low-pass"
            ),
            Parallel::ToRate(rate) => format!(
                "parallel decimation of regressor and torque: to {rate} Hz, after a Butterworth low-pass at 0.8 of half that rate{}",
                stated(true)
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
