//! What the numbers mean, in plain words.

use super::data::{ReportData, ReportedFinding};
use crate::result::{ErrorResult, EstimateResult, IdentificationResult};
use crate::table::number;

/// Held-out R2 of every joint from which a model serves feed-forward and collision detection; what good fits of industrial arms reach.
const GOOD_R2: f64 = 0.95;
/// Below this a joint's torque is mostly not explained: friction or data are wrong.
const FAIR_R2: f64 = 0.80;
/// A held-out error this many times the training error is a model that learnt its log by heart, or another kind of motion.
const OVERFIT: f64 = 2.0;
/// Equilibrated condition numbers up to 100 are those of well-chosen motions (Gautier & Khalil 1991).
const WELL_EXCITED: f64 = 100.0;
/// From here on values move with the noise by a thousand times their share.
const POORLY_EXCITED: f64 = 1000.0;
/// Half width of the 95 % interval, in standard deviations.
pub(super) const INTERVAL: f64 = 1.96;
/// Relative standard deviation up to which a parameter counts as known.
const KNOWN: f64 = 0.1;

/// How far to trust the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    Good,
    Fair,
    Poor,
}

/// The verdict: a word, a sentence, and what it rests on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlainVerdict {
    level: Level,
    pub(super) word: &'static str,
    pub(super) headline: String,
    pub(super) points: Vec<String>,
}

impl PlainVerdict {
    /// The word of the style sheet.
    pub(super) fn class(&self) -> &'static str {
        match self.level {
            Level::Good => "good",
            Level::Fair => "fair",
            Level::Poor => "poor",
        }
    }
}

/// The verdict on a model identified from logs in a line, and whether the model is to be trusted at all.
pub(crate) fn verdict_line(result: &IdentificationResult) -> (String, bool) {
    let (level, word, headline) = of_logs(result);
    (format!("{word} {headline}"), level != Level::Poor)
}

fn of_logs(result: &IdentificationResult) -> (Level, &'static str, String) {
    match &result.validation {
        Some(v) if !v.joints.is_empty() => of_held_out(v),
        _ => (
            Level::Poor,
            "Not proved.",
            "No motion was held out, so nothing says how the model does on another one.".into(),
        ),
    }
}

pub(super) fn verdict(data: &ReportData) -> PlainVerdict {
    let r = data.result;
    let (level, word, headline) = match data.paper {
        Some(paper) => (
            Level::Good,
            "Reproduced.",
            format!(
                "The numbers of {paper}, computed anew, stand beside the printed ones below; simulated experiments show what they mean."
            ),
        ),
        None => of_logs(r),
    };
    let mut points = Vec::new();
    if let (Some(train), Some(v)) = (&r.train, &r.validation) {
        points.push(of_both(train, v, data.paper.is_some()));
    }
    let both = r.validation.as_ref().zip(r.validation_in_band.as_ref());
    points.extend(both.and_then(|(all, in_band)| of_band(all, in_band)));
    if let Some(estimate) = &r.estimate {
        points.extend(of_parameters(r, estimate));
        points.extend(of_condition(estimate, data.paper.is_some()));
    }
    points.extend(data.findings.map(of_findings));
    PlainVerdict {
        level,
        word,
        headline,
        points,
    }
}

fn of_findings(findings: &[ReportedFinding]) -> String {
    let remarks = match findings.len() {
        0 => return "The log doctor found nothing wrong with the data.".into(),
        1 => "one remark".to_owned(),
        n => format!("{n} remarks"),
    };
    match findings.iter().filter(|f| f.grave).count() {
        0 => format!("The log doctor made {remarks} on the data, none that spoils the result."),
        g => format!(
            "The log doctor made {remarks} on the data; {g} would spoil the result and had to be waived by name."
        ),
    }
}

fn of_held_out(v: &ErrorResult) -> (Level, &'static str, String) {
    let by_r2 =
        |a: &&crate::result::JointError, b: &&crate::result::JointError| a.r2.total_cmp(&b.r2);
    let Some(worst) = v.joints.iter().min_by(by_r2) else {
        return (Level::Poor, "Not proved.", "No joint was held out.".into());
    };
    let percent = 100.0 * worst.r2;
    if worst.r2 >= GOOD_R2 {
        return (
            Level::Good,
            "Good.",
            format!(
                "On motion it has not seen, the model explains at least {percent:.1} % of the variance of every joint's torque (least at {}). It can serve feed-forward, simulation and collision detection.",
                worst.name
            ),
        );
    }
    let weak: Vec<&str> = v
        .joints
        .iter()
        .filter(|j| j.r2 < GOOD_R2)
        .map(|j| j.name.as_str())
        .collect();
    if worst.r2 >= FAIR_R2 {
        return (
            Level::Fair,
            "Usable with care.",
            format!(
                "On motion it has not seen, the model explains {percent:.1} % of the variance of the torque of {}, its weakest joint. Look at {} below before you rely on it.",
                worst.name,
                weak.join(", ")
            ),
        );
    }
    let lost: Vec<&str> = v
        .joints
        .iter()
        .filter(|j| j.r2 < FAIR_R2)
        .map(|j| j.name.as_str())
        .collect();
    let share = if percent > 0.0 {
        format!("only {percent:.1} % of the variance")
    } else {
        "nothing".to_owned()
    };
    (
        Level::Poor,
        "Not to be trusted.",
        format!(
            "On motion it has not seen, the model fails at {}: it explains {share} of the torque of {}. Friction, units, signs or too small a motion are the usual reasons.",
            lost.join(", "),
            worst.name
        ),
    )
}

fn of_both(train: &ErrorResult, held_out: &ErrorResult, simulated: bool) -> String {
    let (a, b) = (
        100.0 * train.relative_error,
        100.0 * held_out.relative_error,
    );
    let mut text = format!(
        "The predicted torque is off by {b:.2} % (rms) on held-out motion and by {a:.2} % on the training motion."
    );
    if !simulated && held_out.relative_error > OVERFIT * train.relative_error {
        text += " That gap is large: the held-out motion is of another kind, or the training motion was too short.";
    }
    text
}

/// A relative error smaller by this factor in the band of the fit says that most of the rest is not the model's.
const IN_BAND: f64 = 0.8;

/// What is left when noise above the motion and rows at rest are taken off, as the fit has the torques.
fn of_band(all: &ErrorResult, in_band: &ErrorResult) -> Option<String> {
    if in_band.relative_error > IN_BAND * all.relative_error {
        return None;
    }
    let worst = in_band.joints.iter().min_by(|a, b| a.r2.total_cmp(&b.r2))?;
    Some(format!(
        "With the held-out torques filtered as for the fit, the least share of the variance explained is {:.1} % (at {}): the rest of the error above lies outside the band of the motion or in rows left out.",
        100.0 * worst.r2,
        worst.name
    ))
}

fn of_parameters(r: &IdentificationResult, estimate: &EstimateResult) -> Vec<String> {
    let (found, base) = (estimate.parameters.len(), r.reduction.base.len());
    let excited = if !estimate.dropped.is_empty() {
        format!(
            "{found} parameters are kept; {} are left out because the residual does not miss them.",
            estimate.dropped.len()
        )
    } else if found < base {
        format!(
            "The log excites {found} of the {base} base parameters only; the motors could feel more on a richer motion."
        )
    } else {
        let further = match found - base {
            0 => String::new(),
            1 => " One further friction term stands beside them.".into(),
            n => format!(" {n} further friction terms stand beside them."),
        };
        format!(
            "The motors can feel {base} base parameters of {} standard ones, and the log excites them all.{further}",
            r.reduction.standard.len()
        )
    };
    let known = estimate
        .parameters
        .iter()
        .filter(|p| p.relative_std.is_some_and(|s| s <= KNOWN))
        .count();
    let lost: Vec<&str> = estimate
        .parameters
        .iter()
        .filter(|p| {
            p.value
                .zip(p.std)
                .is_some_and(|(v, s)| v.abs() < INTERVAL * s)
        })
        .map(|p| p.name.as_str())
        .collect();
    let sure = format!(
        "{known} of {found} are known to within {:.0} % (one standard deviation)",
        100.0 * KNOWN
    );
    let zero = match lost.len() {
        0 => "; none could as well be zero.".into(),
        n if n <= 8 => format!("; these could as well be zero: {}.", lost.join(", ")),
        n => format!("; {n} could as well be zero, small ones that this motion hardly shows."),
    };
    vec![excited, sure + &zero]
}

fn of_condition(estimate: &EstimateResult, simulated: bool) -> Option<String> {
    let c = estimate.condition_number.equilibrated?;
    let meaning = match c {
        c if c <= WELL_EXCITED => "the motion shows all parameters about equally well",
        c if c <= POORLY_EXCITED => {
            "some combinations of parameters are shown faintly; a motion designed for this robot would do better"
        }
        _ => {
            "some combinations of parameters are hardly shown; single values mean little, though predictions of similar motions may be good"
        }
    };
    (!simulated).then(|| {
        format!(
            "The condition number with unit columns is {}: {meaning}.",
            number(c)
        )
    })
}

/// Whether a held-out R2 is one to worry about.
pub(super) fn low_r2(r2: f64) -> bool {
    r2 < FAIR_R2
}

/// Error of a joint as the caption of its picture says it.
pub(super) fn quoted(data: &ReportData, joint: usize, unit: &str) -> String {
    let of = |e: &Option<ErrorResult>| {
        e.as_ref()
            .filter(|e| e.joints.len() == data.robot.n_joints())
            .map(|e| number(e.joints[joint].rms))
    };
    match (of(&data.result.train), of(&data.result.validation)) {
        (Some(a), Some(b)) => {
            format!("RMS of the residual: {a} {unit} training, {b} {unit} held out.")
        }
        (Some(a), None) | (None, Some(a)) => format!("RMS of the residual: {a} {unit}."),
        (None, None) => String::new(),
    }
}
