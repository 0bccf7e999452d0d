//! `result.json`, schema `idim-result/1`: the boundary to whoever reads an identification by machine.
//!
//! docs/result.md defines every number.

use crate::check::CheckedFinding;
use serde::Serialize;

/// Name of the schema.
pub const SCHEMA: &str = "idim-result/1";

/// Everything one run found.
#[derive(Debug, Clone, Serialize)]
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
    /// What a reader must know before trusting the numbers.
    pub warnings: Vec<String>,
}

/// Categories of the parameters.
#[derive(Debug, Clone, Serialize)]
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
#[derive(Debug, Clone, Serialize)]
pub struct EstimateResult {
    /// How it was made.
    pub method: String,
    /// Values with their uncertainty.
    pub parameters: Vec<ParameterResult>,
    /// Of the rows the estimate was made from.
    pub condition_number: ConditionResult,
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
