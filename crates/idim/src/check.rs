//! The log doctor at work: everything that can be said against a log of a robot before anything is computed from it.
//!
//! [`diagnose`] joins what single channels show (clock, gaps, saturation, standstill, recorded velocity), what the torques
//! of all joints together show of a rigid body, and what prior masses and torque limits of the robot file show.

mod command;
mod consistency;
mod faults;
mod moments;
mod prior;
mod readings;
mod rows;
mod text;

pub use command::CheckArgs;
pub(crate) use command::run_check;
pub use text::check_text;

use crate::error::Error;
use idim_measurement::doctor::{Finding, Severity, examine_log};
use idim_measurement::{Log, Measurements, Place};
use idim_model::Robot;
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

/// A clock or positions so broken that a motion cannot be made of them.
const NO_MOTION: [&str; 3] = ["time-unit", "position-jump", "gaps"];
/// What is said of a torque factor that another finding names better.
const UNNAMED: &str = "torque-scale";
/// Names of torque factors.
const NAMED: [&str; 3] = ["gear-side", "torque-unit", "torque-is-current"];

/// Everything that can be said against logs of one robot: log by log, and, where there are several, of them together.
///
/// The last element belongs to all logs; it is empty for a single one. Each is sorted, most serious first.
///
/// # Panics
/// If a log was read for another number of joints.
#[track_caller]
pub fn diagnose(logs: &[Log], robot: &Robot) -> Vec<Vec<Finding>> {
    let mut all = Vec::new();
    let (mut together, mut names) = (Vec::new(), Vec::new());
    for log in logs {
        let (findings, samples) = diagnose_one(log, robot);
        let spoilt = findings.iter().any(|f| f.severity == Severity::Error);
        all.push(findings);
        // A log with a fault of its own would blur what the others agree about.
        if let Some(samples) = samples.filter(|_| !spoilt) {
            together.push(samples);
            names.push(log.file.as_str());
        }
    }
    let mut of_all = Vec::new();
    if together.len() > 1 {
        let examination = consistency::examine(&together, robot);
        of_all = consistency::findings(&examination, robot, &names.join(" + "));
    }
    all.push(tidied(of_all));
    all
}

fn diagnose_one(log: &Log, robot: &Robot) -> (Vec<Finding>, Option<rows::Samples>) {
    let mut out = examine_log(log, robot);
    let inferred = |n: &&String| n.starts_with("time unit inferred");
    if let Some(note) = log.notes.iter().find(inferred) {
        out.push(Finding {
            code: "time-unit",
            severity: Severity::Warning,
            place: Place::file(&log.file),
            value: None,
            met: note.clone(),
            rule: "a clock says its unit".into(),
            next_step: "name the column with its unit, for example `t_ms`".into(),
        });
    }
    let broken = |f: &Finding| f.severity == Severity::Error && NO_MOTION.contains(&f.code);
    let mut samples = None;
    if !out.iter().any(broken) {
        match Measurements::from_log(log, robot) {
            Ok(mut measured) => {
                measured.qd = None;
                samples = rows::Samples::new(&measured);
                let mut found = of_measurements(&measured, samples.as_ref(), robot);
                if stands_mostly(&out) {
                    suspect_only(&mut found);
                }
                out.extend(found);
            }
            Err(error) => out.push(Finding::from(&error)),
        }
    }
    (tidied(out), samples)
}

/// A log that stands still for longer shows too little of the arm to be sure of what its torques contradict.
const MOSTLY_STILL: f64 = 0.3;

fn stands_mostly(findings: &[Finding]) -> bool {
    let share = |f: &Finding| f.value.unwrap_or(0.0);
    findings
        .iter()
        .any(|f| f.code == "standstill" && f.place.joint.is_none() && share(f) > MOSTLY_STILL)
}

fn suspect_only(findings: &mut [Finding]) {
    for finding in findings {
        if finding.severity == Severity::Error {
            finding.severity = Severity::Warning;
        }
    }
}

fn of_measurements(
    measured: &Measurements,
    samples: Option<&rows::Samples>,
    robot: &Robot,
) -> Vec<Finding> {
    let mut out = Vec::new();
    if let Some(samples) = samples {
        let examination = consistency::examine(std::slice::from_ref(samples), robot);
        out.extend(consistency::findings(&examination, robot, &measured.file));
        out.extend(prior::prior_masses(samples, robot, &measured.file));
    }
    let known: Vec<Option<String>> = out
        .iter()
        .filter(|f| NAMED.contains(&f.code))
        .map(|f| f.place.joint.clone())
        .collect();
    let limits = prior::torque_limits(measured, robot);
    out.extend(
        limits
            .into_iter()
            .filter(|f| !known.contains(&f.place.joint)),
    );
    out
}

/// Most serious first, nothing twice.
fn tidied(findings: Vec<Finding>) -> Vec<Finding> {
    let named: Vec<Option<String>> = findings
        .iter()
        .filter(|f| NAMED.contains(&f.code))
        .map(|f| f.place.joint.clone())
        .collect();
    let mut out: Vec<Finding> = Vec::new();
    for finding in findings {
        let same = |f: &Finding| (f.code, &f.place.joint) == (finding.code, &finding.place.joint);
        // Two channels that saturate, or gaps at two places, are two findings of one kind.
        let once = !["saturation", "sample-rate"].contains(&finding.code);
        let better = finding.code == UNNAMED && named.contains(&finding.place.joint);
        if better || once && out.iter().any(same) {
            continue;
        }
        out.push(finding);
    }
    out.sort_by_key(|f| std::cmp::Reverse(f.severity));
    out
}
