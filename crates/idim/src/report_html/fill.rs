//! From what a run has at hand to the parts of a report.

use super::data::{CutoffCurve, LogSummary, ReportData, ReportedFinding};
use super::report_html;
use crate::check::CheckedFinding;
use crate::identify::{Identification, Prediction, TRAINING_SHARE};
use crate::log_spec::LogSpec;
use crate::result::{HeldOutChoice, IdentificationResult};
use idim_measurement::Measurements;
use idim_measurement::doctor::Severity;
use idim_model::Robot;
use std::path::Path;

/// Summaries of all logs, training first.
pub(crate) fn summaries(training: &[Measurements], validation: &[Measurements]) -> Vec<LogSummary> {
    let train = training.iter().map(|m| LogSummary::new(m, true));
    let held_out = validation.iter().map(|m| LogSummary::new(m, false));
    train.chain(held_out).collect()
}

/// The command as a person would type it, an option a line: words that a shell would take apart are quoted.
pub(crate) fn shell_line(words: impl IntoIterator<Item = String>) -> String {
    let quoted = |word: String| {
        let plain = |c: char| c.is_alphanumeric() || "-_=./,:+@".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    let mut line = String::new();
    for (k, word) in words.into_iter().enumerate() {
        line += match (k, word.starts_with("--")) {
            (0, _) => "",
            (_, true) => " \\\n    ",
            (_, false) => " ",
        };
        line += &quoted(word);
    }
    line
}

/// Files that went in, by name.
pub(crate) fn file_settings(
    robot: &Path,
    logs: &[LogSpec],
    validate: &[LogSpec],
) -> Vec<(String, String)> {
    let list = |files: &[LogSpec]| {
        files
            .iter()
            .map(LogSpec::name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let mut settings = vec![
        ("robot file".into(), robot.display().to_string()),
        ("training logs".into(), list(logs)),
    ];
    if validate.is_empty() {
        settings.push((
            "held out".into(),
            format!(
                "the last {:.0} % of each log",
                100.0 * (1.0 - TRAINING_SHARE)
            ),
        ));
    } else {
        settings.push(("held-out logs".into(), list(validate)));
    }
    settings
}

/// A finding of the log doctor in words.
fn reported(checked: &CheckedFinding) -> ReportedFinding {
    let f = &checked.finding;
    ReportedFinding {
        code: f.code.into(),
        severity: match (f.severity, checked.waived) {
            (_, true) => "error, waived",
            (Severity::Error, false) => "error",
            (Severity::Warning, false) => "warning",
            (Severity::Note, false) => "note",
        },
        grave: checked.waived,
        place: f.place.to_string(),
        met: f.met.clone(),
        rule: [f.rule.as_str(), &f.next_step]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join("; "),
    }
}

/// The curve of a cutoff chosen by it, without the cutoffs that were not determined.
fn curve(choice: &HeldOutChoice) -> CutoffCurve {
    let tried = choice.tried.iter().zip(&choice.held_out_error);
    let (cutoff, error) = tried.filter_map(|(c, e)| Some((*c, (*e)?))).unzip();
    CutoffCurve {
        cutoff,
        error,
        chosen: choice.chosen,
    }
}

/// The page of an identification from logs.
pub(crate) fn page_of_logs(
    found: &Identification,
    robot: &Robot,
    command: &str,
    settings: &[(String, String)],
) -> String {
    let findings: Vec<ReportedFinding> = found.result.findings.iter().map(reported).collect();
    let cutoff = found.result.cutoff.as_ref().map(curve);
    report_html(&ReportData {
        result: &found.result,
        robot,
        predictions: &found.predictions,
        logs: &found.logs,
        spectrum: Some(&found.spectrum),
        cutoff: cutoff.as_ref(),
        findings: Some(&findings),
        figures: &[],
        paper: None,
        command,
        settings,
    })
}

/// The page of a paper's reproduction: simulated torques and the pictures of the motions.
pub(crate) fn page_of_paper(
    paper: &str,
    result: &IdentificationResult,
    robot: &Robot,
    predictions: &[Prediction],
    figures: &[(String, String)],
    command: &str,
) -> String {
    report_html(&ReportData {
        result,
        robot,
        predictions,
        logs: &[],
        spectrum: None,
        cutoff: None,
        findings: None,
        figures,
        paper: Some(paper),
        command,
        settings: &[],
    })
}
