//! What a person reads first: tables on the terminal.

use crate::identify::Identification;
use crate::report_html::verdict_line;
use crate::result::{
    ErrorResult, EstimateResult, FrictionResult, FrictionTrial, IdentificationResult, PaperNumber,
    ReductionResult,
};
use crate::table::{number, optional, table};
use std::fmt::Write as _;

/// The structure of a robot.
pub fn reduction_text(robot: &str, reduction: &ReductionResult) -> String {
    let mut out = format!(
        "{robot}: {} base parameters of {} standard ones ({} unidentifiable, {} regrouped, {} of the base identifiable alone); rank gap {}\n\n",
        reduction.base.len(),
        reduction.standard.len(),
        reduction.unidentifiable.len(),
        reduction.combined.len(),
        reduction.identifiable_alone.len(),
        number(reduction.rank_gap),
    );
    for base in &reduction.base {
        let _ = writeln!(out, "  {}", base.relation);
    }
    if !reduction.unidentifiable.is_empty() {
        let _ = writeln!(
            out,
            "\n  no torque depends on: {}",
            reduction.unidentifiable.join(" ")
        );
    }
    out
}

/// A whole identification from logs.
pub fn identification_text(identification: &Identification) -> String {
    let r = &identification.result;
    let mut out = reduction_text(&r.robot, &r.reduction);
    if !r.conditioning.is_empty() {
        out += "\nData\n";
        for choice in r.inferred.iter().chain(&r.conditioning) {
            let _ = writeln!(out, "  {choice}");
        }
    }
    if let Some(estimate) = &r.estimate {
        out += &estimate_text(estimate);
    }
    out += &friction_text(&r.friction);
    out += &errors_text(r);
    out += &baselines_text(r);
    out += &warnings_text(&r.warnings);
    let _ = writeln!(out, "\nVerdict: {}", verdict_line(r).0);
    out
}

fn estimate_text(estimate: &EstimateResult) -> String {
    let rows = estimate.parameters.iter().map(|p| {
        let percent = p
            .relative_std
            .map_or_else(|| "-".into(), |s| format!("{:.1}", 100.0 * s));
        [p.name.clone(), optional(p.value), optional(p.std), percent]
    });
    let c = &estimate.condition_number;
    let mut more = String::new();
    for d in &estimate.dropped {
        let _ = writeln!(
            more,
            "  not needed, not zero: {} in [{}, {}]",
            d.name,
            number(d.low),
            number(d.high)
        );
    }
    for s in &estimate.down_weighted {
        let joints: Vec<String> = s.joints.iter().map(usize::to_string).collect();
        let _ = writeln!(
            more,
            "  lost its say: {} from {:.3} to {:.3} s, joints {}, lowest weight {:.2}",
            s.log,
            s.from,
            s.to,
            joints.join(" "),
            s.lowest_weight
        );
    }
    format!(
        "\nParameters (SI), {}\n{}condition number (2-norm): raw {}, equilibrated {}, weighted {}\n{more}",
        estimate.method,
        table(["parameter", "value", "std", "std %"], rows),
        optional(c.raw),
        optional(c.equilibrated),
        optional(c.weighted),
    )
}

fn errors_text(r: &IdentificationResult) -> String {
    let (Some(train), validation) = (&r.train, &r.validation) else {
        return String::new();
    };
    let rows = train.joints.iter().enumerate().map(|(k, t)| {
        let v = validation.as_ref().map(|v| &v.joints[k]);
        [
            t.name.clone(),
            number(t.rms),
            percent(t.relative_error),
            format!("{:.4}", t.r2),
            v.map_or_else(String::new, |v| number(v.rms)),
            v.map_or_else(String::new, |v| percent(v.relative_error)),
            v.map_or_else(String::new, |v| format!("{:.4}", v.r2)),
        ]
    });
    let overall = |e: &ErrorResult| percent(e.relative_error);
    format!(
        "\nPredicted against recorded torque (relative error: rms of the residual over rms of the torque)\n{}all joints: training {} %, held out {} %\n",
        table(
            [
                "joint",
                "train rms N·m",
                "rel. %",
                "R2",
                "held-out rms N·m",
                "rel. %",
                "R2"
            ],
            rows
        ),
        overall(train),
        validation.as_ref().map_or_else(|| "-".into(), overall),
    )
}

/// Choices shown a joint, best first.
const SHOWN: usize = 6;

fn friction_text(friction: &[FrictionResult]) -> String {
    if friction.is_empty() {
        return String::new();
    }
    let rows = friction.iter().flat_map(|f| {
        let mut tried: Vec<&FrictionTrial> = f.tried.iter().collect();
        let error = |t: &FrictionTrial| t.held_out_rms.unwrap_or(f64::INFINITY);
        tried.sort_by(|a, b| error(a).total_cmp(&error(b)));
        let chosen = |t: &FrictionTrial| t.terms == f.chosen;
        let shown = tried
            .iter()
            .position(|t| chosen(t))
            .map_or(SHOWN, |k| SHOWN.max(k + 1));
        tried.truncate(shown);
        tried.into_iter().map(move |t| {
            let mark = if chosen(t) { "chosen" } else { "" };
            [
                f.joint.clone(),
                t.size.to_string(),
                optional(t.held_out_rms),
                mark.to_owned(),
                t.terms.clone(),
            ]
        })
    });
    let header = ["joint", "parameters", "held-out rms N·m", "", "terms"];
    format!(
        "\nFriction tried, on blocks of the training motions held out in turn (best first; a parameter must earn 3 % of the mean square)\n{}",
        table(header, rows)
    )
}

/// Simpler models beside the identified one, held out.
fn baselines_text(r: &IdentificationResult) -> String {
    let Some(validation) = r.validation.as_ref().filter(|_| !r.baselines.is_empty()) else {
        return String::new();
    };
    let all = std::iter::once(("identified", validation))
        .chain(r.baselines.iter().map(|b| (b.name.as_str(), &b.errors)));
    let mut out = String::from("\nHeld-out R2 beside simpler models\n");
    if let Some(in_band) = &r.validation_in_band {
        let r2: Vec<String> = in_band
            .joints
            .iter()
            .map(|j| format!("{:>8.3}", j.r2))
            .collect();
        let _ = writeln!(
            out,
            "  {} identified, torques filtered and decimated as the fit has them",
            r2.join(" ")
        );
    }
    for (name, errors) in all {
        let r2: Vec<String> = errors
            .joints
            .iter()
            .map(|j| format!("{:>8.3}", j.r2))
            .collect();
        let _ = writeln!(out, "  {} {name}", r2.join(" "));
    }
    out
}

fn percent(x: f64) -> String {
    format!("{:.2}", 100.0 * x)
}

/// Ours beside the printed numbers.
pub fn paper_text(numbers: &[PaperNumber]) -> String {
    let rows = numbers.iter().map(|n| {
        [
            n.what.clone(),
            optional(n.printed),
            number(n.ours),
            n.note.clone(),
        ]
    });
    table(["", "printed", "ours", ""], rows)
}

/// What a reader must know.
pub fn warnings_text(warnings: &[String]) -> String {
    if warnings.is_empty() {
        return String::new();
    }
    let mut out = String::from("\nMind\n");
    for w in warnings {
        let _ = writeln!(out, "  - {w}");
    }
    out
}
