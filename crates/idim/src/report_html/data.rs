//! What a report is made of; a part that a run does not have stays out of the page.

use crate::identify::Prediction;
use crate::result::IdentificationResult;
use idim_measurement::Measurements;
use idim_model::{JointKind, Robot};

/// Everything `report.html` shows.
#[derive(Debug, Clone)]
pub struct ReportData<'a> {
    /// What went into `result.json`.
    pub result: &'a IdentificationResult,
    /// The robot as identified.
    pub robot: &'a Robot,
    /// Measured and predicted torques, training stretches first.
    pub predictions: &'a [Prediction],
    /// The logs as read.
    pub logs: &'a [LogSummary],
    /// Singular values of the rows the estimate was made from.
    pub spectrum: Option<&'a Spectrum>,
    /// Held-out error over the cutoff of the low-pass, where the cutoff was chosen by it.
    pub cutoff: Option<&'a CutoffCurve>,
    /// What the log doctor found; `None` where it was not asked.
    pub findings: Option<&'a [ReportedFinding]>,
    /// Pictures as SVG text with their titles.
    pub figures: &'a [(String, String)],
    /// The published work that the run repeats, if it repeats one.
    pub paper: Option<&'a str>,
    /// The command that makes this result again.
    pub command: &'a str,
    /// Files and options that went in, name and value.
    pub settings: &'a [(String, String)],
}

/// A log in a few numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSummary {
    /// Name of the file.
    pub file: String,
    /// Whether the estimate was made from it (or from its first part).
    pub training: bool,
    /// Samples.
    pub n_samples: usize,
    /// From first to last sample, s.
    pub duration: f64,
    /// Of the median interval, Hz.
    pub rate: f64,
    /// Whether velocities were recorded.
    pub has_velocity: bool,
    /// Lowest and highest position, joint by joint, rad (m).
    pub position: Vec<[f64; 2]>,
    /// Largest torque in size, joint by joint, N·m (N).
    pub torque: Vec<f64>,
}

impl LogSummary {
    /// Of a log.
    pub fn new(m: &Measurements, training: bool) -> Self {
        let mut steps: Vec<f64> = m.time.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        let range = |x: &Vec<f64>| {
            x.iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &v| {
                    [low.min(v), high.max(v)]
                })
        };
        let largest = |x: &Vec<f64>| x.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        Self {
            file: m.file.clone(),
            training,
            n_samples: m.n_samples(),
            duration: m
                .time
                .last()
                .zip(m.time.first())
                .map_or(0.0, |(b, a)| b - a),
            rate: steps.get(steps.len() / 2).map_or(0.0, |dt| 1.0 / dt),
            has_velocity: m.qd.is_some(),
            position: m.q.iter().map(range).collect(),
            torque: m.torque.iter().map(largest).collect(),
        }
    }
}

/// Singular values of the rows, falling.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spectrum {
    /// Of W in SI units.
    pub raw: Vec<f64>,
    /// Of W with unit columns.
    pub equilibrated: Vec<f64>,
}

/// How the held-out error depends on the cutoff of the low-pass.
#[derive(Debug, Clone, PartialEq)]
pub struct CutoffCurve {
    /// Cutoffs tried, Hz, rising.
    pub cutoff: Vec<f64>,
    /// Error on held-out blocks at each, relative.
    pub error: Vec<f64>,
    /// The one taken, Hz.
    pub chosen: f64,
}

/// A finding of the log doctor, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportedFinding {
    /// Its code.
    pub code: String,
    /// How bad it is: `note`, `warning`, `error`; and whether it was waived.
    pub severity: &'static str,
    /// Whether it would spoil a result.
    pub grave: bool,
    /// File, joint, time.
    pub place: String,
    /// What was met.
    pub met: String,
    /// The rule and what to do.
    pub rule: String,
}

/// Quantity and unit of what a joint is driven by.
pub(super) fn drive_words(kind: JointKind) -> (&'static str, &'static str) {
    match kind {
        JointKind::Revolute => ("torque", "N·m"),
        JointKind::Prismatic => ("force", "N"),
    }
}

/// Unit of a joint's coordinate.
pub(super) fn position_unit(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "rad",
        JointKind::Prismatic => "m",
    }
}
