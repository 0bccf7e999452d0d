//! The log doctor at work: everything that can be said against a log of a robot before anything is computed from it.
//!
//! [`diagnose`] joins what single channels show (clock, gaps, saturation, standstill, recorded velocity), what the torques
//! of all joints together show of a rigid body, and what prior masses and torque limits of the robot file show.

mod command;
mod consistency;
mod diagnosis;
mod faults;
mod moments;
mod prior;
mod proportions;
mod readings;
mod rows;
mod suspicions;
mod text;
mod verdict;

pub use command::CheckArgs;
pub(crate) use command::run_check;
pub use diagnosis::diagnose;
pub use text::check_text;

use crate::error::Error;
use idim_measurement::doctor::{Finding, Severity};
use serde::Serialize;
use std::str::FromStr;

/// Name of the schema of `idim check --json`.
pub const CHECK_SCHEMA: &str = "idim-check/1";

/// Everything `idim check` says.
#[derive(Debug, Clone, Serialize)]
pub struct CheckResult {
    /// [`CHECK_SCHEMA`].
    pub schema: &'static str,
    /// Version of idim.
    pub version: &'static str,
    /// Name of the robot.
    pub robot: String,
    /// Log by log.
    pub logs: Vec<CheckedLog>,
    /// Findings that would spoil a result and are not waived.
    pub blocking: usize,
}

/// What was said of one log.
#[derive(Debug, Clone, Serialize)]
pub struct CheckedLog {
    /// As named on the command line.
    pub log: String,
    /// Samples; 0 where it cannot be read.
    pub n_samples: usize,
    /// From the first to the last sample, s.
    pub duration_s: f64,
    /// How it was read and what was inferred, one sentence each.
    pub inferred: Vec<String>,
    /// Most serious first.
    pub findings: Vec<CheckedFinding>,
}

/// A finding, and what it means for an identification.
#[derive(Debug, Clone, Serialize)]
pub struct CheckedFinding {
    /// What was found.
    #[serde(flatten)]
    pub finding: Finding,
    /// It stops `identify`.
    pub blocks: bool,
    /// It would, but was waived by name.
    pub waived: bool,
}

impl CheckedFinding {
    /// Whether a reader of the result must know it.
    pub(crate) fn is_doubt(&self) -> bool {
        self.finding.severity > Severity::Note
    }
}

/// Codes of what can be found in a log that can be read.
pub const CODES: [&str; 35] = [
    "sample-rate",
    "time-unit",
    "jitter",
    "gaps",
    "stale-samples",
    "position-jump",
    "torque-spike",
    "saturation",
    "quantised-position",
    "quantised-torque",
    "standstill",
    "unexcited-joint",
    "position-range",
    "degrees",
    "velocity-unit",
    "velocity-sign",
    "velocity-factor",
    "velocity-delay",
    "velocity-unrelated",
    "torque-sign",
    "position-sign",
    "joint-axis",
    "joint-order",
    "gear-side",
    "torque-unit",
    "torque-is-current",
    "torque-scale",
    "gravity-direction",
    "gravity-compensated",
    "torque-range",
    "torque-delay",
    "torque-drift",
    "few-samples",
    "wrong-robot",
    "unexplained-torque",
];

/// A finding accepted by name: `CODE`, or `CODE:JOINT` for one joint only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Waiver {
    /// Code of the finding.
    pub code: String,
    /// Name of the joint; any where `None`.
    pub joint: Option<String>,
}

impl FromStr for Waiver {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (code, joint) = match text.split_once(':') {
            Some((code, joint)) => (code, Some(joint.to_owned())),
            None => (text, None),
        };
        if code.is_empty() || joint.as_ref().is_some_and(String::is_empty) {
            return Err("write CODE or CODE:JOINT, as `idim check` prints them".into());
        }
        if !CODES.contains(&code) {
            return Err(format!(
                "no finding has the code `{code}`; those of a log that can be read are {}",
                CODES.join(", ")
            ));
        }
        Ok(Self {
            code: code.to_owned(),
            joint,
        })
    }
}

impl Waiver {
    fn covers(&self, finding: &Finding) -> bool {
        let joint = self.joint.as_ref();
        self.code == finding.code
            && joint.is_none_or(|j| finding.place.joint.as_deref() == Some(j.as_str()))
    }
}

/// Marks what stops an identification.
pub fn marked(findings: Vec<Finding>, waivers: &[Waiver]) -> Vec<CheckedFinding> {
    let mark = |finding: Finding| {
        let serious = finding.severity == Severity::Error;
        let waived = waivers.iter().any(|w| w.covers(&finding));
        CheckedFinding {
            blocks: serious && !waived,
            waived: serious && waived,
            finding,
        }
    };
    findings.into_iter().map(mark).collect()
}

/// Whether a finding doubts what a torque is worth: its unit, its sign, the side of the gear it stands on.
pub(crate) fn doubts_a_torque(finding: &Finding) -> bool {
    match finding.code {
        "torque-sign" | "torque-unit" | "torque-is-current" | "torque-scale" | "torque-range" => {
            true
        }
        "gear-side" => finding.met.contains("torque"),
        _ => false,
    }
}

/// Refuses to go on with findings that would spoil the result.
///
/// # Errors
/// [`Error::Findings`] that lists them.
pub fn gate(findings: &[CheckedFinding]) -> Result<(), Error> {
    let blocking = || findings.iter().filter(|f| f.blocks);
    match blocking().count() {
        0 => Ok(()),
        count => {
            let lines: Vec<String> = blocking().map(|f| f.finding.to_string()).collect();
            Err(Error::Findings {
                count,
                text: lines.join("\n") + "\n",
            })
        }
    }
}
