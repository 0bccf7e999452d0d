//! What the doctor says, for people.

use super::{CheckResult, CheckedFinding, CheckedLog};
use crate::table::{aligned, number};
use idim_measurement::doctor::Severity;
use std::fmt::Write as _;

/// All logs, one table each, and what to do.
pub fn check_text(result: &CheckResult) -> String {
    let mut out = String::new();
    for log in &result.logs {
        out += &log_text(&result.robot, log);
    }
    let warnings = count(result, Severity::Warning);
    let verdict = match result.blocking {
        0 => "nothing that would spoil a result".to_owned(),
        1 => "1 finding would spoil a result".to_owned(),
        n => format!("{n} findings would spoil a result"),
    };
    let _ = writeln!(
        out,
        "{verdict}; {warnings} warning{}",
        if warnings == 1 { "" } else { "s" }
    );
    out
}

fn count(result: &CheckResult, severity: Severity) -> usize {
    let all = result.logs.iter().flat_map(|l| &l.findings);
    all.filter(|f| f.finding.severity == severity).count()
}

fn log_text(robot: &str, log: &CheckedLog) -> String {
    let mut out = format!("{}, a log of {robot}", log.log);
    if log.n_samples > 0 {
        let _ = write!(out, ": {} samples, {:.3} s", log.n_samples, log.duration_s);
    }
    out.push('\n');
    for statement in &log.inferred {
        let _ = writeln!(out, "  {statement}");
    }
    out.push('\n');
    let rows = log.findings.iter().map(|f| {
        let place = &f.finding.place;
        let at = match (place.line, place.time) {
            (Some(line), _) => format!("line {line}"),
            (None, Some(time)) => format!("t = {} s", number(time)),
            (None, None) => String::new(),
        };
        [
            weight(f).to_owned(),
            f.finding.code.to_owned(),
            place
                .joint
                .as_deref()
                .map_or_else(|| "-".into(), str::to_owned),
            at,
            f.finding.value.map_or_else(|| "-".into(), number),
            f.finding.met.clone(),
        ]
    });
    out += &aligned(["", "code", "joint", "where", "value", "found"], rows, [4]);
    let steps: Vec<&CheckedFinding> = log
        .findings
        .iter()
        .filter(|f| f.finding.severity > Severity::Note)
        .collect();
    if !steps.is_empty() {
        out += "\nWhat to do\n";
    }
    for f in steps {
        let joint = f.finding.place.joint.as_deref();
        let whose = joint.map_or_else(String::new, |j| format!(":{j}"));
        let _ = writeln!(
            out,
            "  {}{whose}: {}{}",
            f.finding.code,
            f.finding.next_step,
            if f.finding.rule.is_empty() {
                String::new()
            } else {
                format!(" ({})", f.finding.rule)
            }
        );
    }
    out.push('\n');
    out
}

/// How a finding weighs, in a word.
fn weight(f: &CheckedFinding) -> &'static str {
    match f.finding.severity {
        _ if f.waived => "waived",
        Severity::Error => "ERROR",
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}
