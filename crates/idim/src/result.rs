//! `result.json`, schema `idim-result/1`: the boundary to whoever reads an identification by machine.
//!
//! docs/result.md defines every number.

use crate::check::CheckedFinding;
use serde::Serialize;

/// Name of the schema.
pub const SCHEMA: &str = "idim-result/1";

/// Everything one run found.
#[derive(Debug, Clone, Default, Serialize)]
pub struct IdentificationResult {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Version of idim.
    pub version: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// Seed of everything random.
    pub seed: u64,
    /// What the motors can feel.
    pub reduction: ReductionResult,
    /// The values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<EstimateResult>,
    /// Errors on the data the estimate was made from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub train: Option<ErrorResult>,
    /// Errors on data held out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<ErrorResult>,
    /// Errors on data held out, torques filtered and decimated as the fit has them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation_in_band: Option<ErrorResult>,
    /// Errors of simpler models on the data held out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub baselines: Vec<BaselineResult>,
    /// Friction terms tried on each joint.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub friction: Vec<FrictionResult>,
    /// The motion and what it reveals.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excitation: Option<serde_json::Value>,
    /// Ours beside the printed numbers.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub paper: Vec<PaperNumber>,
    /// How the files were read and which units were assumed or inferred, one sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub inferred: Vec<String>,
    /// What the log doctor found, log by log.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<CheckedFinding>,
    /// How the log became samples, one sentence a choice.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub conditioning: Vec<String>,
    /// Error on blocks held out over the cutoff of the low-pass, Hz, where it was chosen by it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cutoff: Option<HeldOutChoice>,
    /// What a reader must know before trusting the numbers.
    pub warnings: Vec<String>,
}

/// A number chosen by the error of the predicted torque on blocks held out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutChoice {
    /// What was tried, rising.
    pub tried: Vec<f64>,
    /// Relative error of each on the blocks, each joint in units of its residual; `null` where not determined.
    pub held_out_error: Vec<Option<f64>>,
    /// The one taken.
    pub chosen: f64,
}

/// Categories of the parameters.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ReductionResult {
    /// All columns.
    pub standard: Vec<String>,
    /// No torque depends on them.
    pub unidentifiable: Vec<String>,
    /// Can be told apart from all others.
    pub identifiable_alone: Vec<String>,
    /// Regrouped into the base parameters.
    pub combined: Vec<String>,
    /// The base parameters.
    pub base: Vec<BaseParameter>,
    /// Ratio of the last pivot kept to the first dropped.
    pub rank_gap: f64,
}

/// A base parameter.
#[derive(Debug, Clone, Serialize)]
pub struct BaseParameter {
    /// Name, with an R where something is regrouped.
    pub name: String,
    /// As people write it: `ZZR1 = ZZ1 + YY2 + 0.4 MZ3`.
    pub relation: String,
}

/// The estimate.
#[derive(Debug, Clone, Default, Serialize)]
pub struct EstimateResult {
    /// How it was made.
    pub method: String,
    /// Values with their uncertainty.
    pub parameters: Vec<ParameterResult>,
    /// Of the rows the estimate was made from.
    pub condition_number: ConditionResult,
    /// Parameters that the residual does not miss: left out, not zero.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub dropped: Vec<DroppedResult>,
    /// Spans of time that a robust fit took the say from.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub down_weighted: Vec<DownWeightedResult>,
}

/// One parameter.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterResult {
    /// Name of the base parameter.
    pub name: String,
    /// SI; `null` where the data do not determine it.
    pub value: Option<f64>,
    /// Standard deviation, SI.
    pub std: Option<f64>,
    /// Standard deviation over size of the value; `null` for a value of zero.
    pub relative_std: Option<f64>,
}

/// 2-norm condition numbers.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct ConditionResult {
    /// Of W in SI units.
    pub raw: Option<f64>,
    /// Of W with unit columns.
    pub equilibrated: Option<f64>,
    /// Of W with its rows whitened by the noise of the joints.
    pub weighted: Option<f64>,
}

/// Errors of predicted torque.
#[derive(Debug, Clone, Serialize)]
pub struct ErrorResult {
    /// `‖τ - τ̂‖ / ‖τ‖` over all joints.
    pub relative_error: f64,
    /// Joint by joint.
    pub joints: Vec<JointError>,
}

/// Errors of one joint.
#[derive(Debug, Clone, Serialize)]
pub struct JointError {
    /// Name of the joint.
    pub name: String,
    /// Root mean square of the residual, N·m.
    pub rms: f64,
    /// `‖τ - τ̂‖ / ‖τ‖`.
    pub relative_error: f64,
    /// `1 - Σ(τ - τ̂)² / Σ(τ - mean τ)²`.
    pub r2: f64,
    /// Largest size of the residual, N·m.
    pub largest: f64,
}

/// A parameter left out of an essential fit.
#[derive(Debug, Clone, Serialize)]
pub struct DroppedResult {
    /// Name of the base parameter.
    pub name: String,
    /// Its value in the full fit.
    pub value: f64,
    /// Lower end of its 95 % interval in the full fit.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Its relative standard deviation when it went; `null` for a value of zero.
    pub relative_std: Option<f64>,
}

/// A span of time that lost its say.
#[derive(Debug, Clone, Serialize)]
pub struct DownWeightedResult {
    /// The log.
    pub log: String,
    /// First time, s.
    pub from: f64,
    /// Last time, s.
    pub to: f64,
    /// Joints concerned, counted from 1.
    pub joints: Vec<usize>,
    /// Lowest weight within, in [0, 1].
    pub lowest_weight: f64,
}

/// A simpler model on the held-out samples.
#[derive(Debug, Clone, Serialize)]
pub struct BaselineResult {
    /// What it is.
    pub name: String,
    /// Its errors.
    pub errors: ErrorResult,
}

/// The friction of a joint and how it was chosen.
#[derive(Debug, Clone, Serialize)]
pub struct FrictionResult {
    /// Name of the joint.
    pub joint: String,
    /// The terms it has.
    pub chosen: String,
    /// Everything that was tried, in order.
    pub tried: Vec<FrictionTrial>,
}

/// One choice of friction terms of a joint.
#[derive(Debug, Clone, Serialize)]
pub struct FrictionTrial {
    /// The terms.
    pub terms: String,
    /// Number of parameters.
    pub size: usize,
    /// RMS of the joint's residual on held-out blocks, filtered and decimated as the fit has it, N·m; `null` where not determined.
    pub held_out_rms: Option<f64>,
}

/// A printed number and ours.
#[derive(Debug, Clone, Serialize)]
pub struct PaperNumber {
    /// What it is and where it is printed.
    pub what: String,
    /// As printed, or as the project's own reference has it (then `what` says so).
    pub printed: Option<f64>,
    /// Ours.
    pub ours: f64,
    /// What to know when comparing.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
}

impl PaperNumber {
    pub(crate) fn new(
        what: impl Into<String>,
        printed: Option<f64>,
        ours: f64,
        note: &str,
    ) -> Self {
        Self {
            what: what.into(),
            printed,
            ours,
            note: note.into(),
        }
    }
}
