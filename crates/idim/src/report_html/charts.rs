//! The curves of the page as numbers in JSON, thinned to what an eye can use.

use super::data::{CutoffCurve, ReportData, Spectrum, drive_words, position_unit};
use crate::friction::FrictionPart;
use crate::plot::{Part, side_by_side};
use crate::plots::torque_runs;
use serde::Serialize;

/// Samples drawn over all joints; more are thinned. Three curves at some four bytes a number make two megabytes.
const SAMPLES: usize = 150_000;
/// Dots of a friction picture.
const DOTS: usize = 2500;
/// Steps between lowest and highest value of a curve: far finer than a pixel even when zoomed.
const LEVELS: f64 = 32_000.0;
/// The same of times: one sample of a long log is told from the next.
const TIME_LEVELS: f64 = 16_000_000.0;

/// One picture: panels above each other over the same axis.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Chart {
    x_label: String,
    /// Charts of one link are zoomed together.
    #[serde(skip_serializing_if = "Option::is_none")]
    link: Option<&'static str>,
    /// Whether the axis is logarithmic: `x` then has logarithms to base 10.
    x_log: bool,
    /// Room on both sides, as a share of the range.
    pad: f64,
    /// What the curves stand over; each names one by its position.
    x: Vec<Coded>,
    panels: Vec<Panel>,
}

#[derive(Debug, Clone, Serialize)]
struct Panel {
    y_label: String,
    log: bool,
    height: u32,
    series: Vec<Series>,
    /// Spans of the axis: runs that trained, runs that were held out.
    spans: Vec<Span>,
    marks: Vec<Mark>,
}

#[derive(Debug, Clone, Serialize)]
struct Span {
    from: f64,
    to: f64,
    label: &'static str,
    shaded: bool,
}

#[derive(Debug, Clone, Serialize)]
struct Series {
    name: &'static str,
    class: &'static str,
    mode: &'static str,
    x: usize,
    y: Coded,
}

#[derive(Debug, Clone, Serialize)]
struct Mark {
    x: f64,
    label: String,
}

/// Numbers as whole steps from one to the next.
#[derive(Debug, Clone, Serialize)]
struct Coded {
    from: f64,
    step: f64,
    d: Vec<i64>,
}

impl Coded {
    fn new(values: impl Iterator<Item = f64> + Clone, levels: f64) -> Self {
        let (low, high) = values
            .clone()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(v), b.max(v))
            });
        let step = if high > low {
            (high - low) / levels
        } else {
            1.0
        };
        let mut last = 0;
        let d = values
            .map(|v| {
                let k = ((v - low) / step).round() as i64;
                k - std::mem::replace(&mut last, k)
            })
            .collect();
        Self {
            from: if low.is_finite() { low } else { 0.0 },
            step,
            d,
        }
    }
}

/// Measured and predicted torque of one joint, the residual below.
pub(super) fn torque_chart(data: &ReportData, joint: usize) -> Chart {
    let (quantity, unit) = drive_words(data.robot.joints()[joint].kind);
    let runs = torque_runs(data.predictions, joint);
    let (times, shifted) = side_by_side(&runs);
    let total: usize = runs.iter().map(|r| r.time.len()).sum();
    let budget = SAMPLES / data.robot.n_joints();
    let mut x = Vec::new();
    let mut upper = Vec::new();
    let mut lower = Vec::new();
    let mut spans = Vec::new();
    for (run, time) in runs.iter().zip(&times) {
        let residual: Vec<f64> = run
            .measured
            .iter()
            .zip(run.predicted)
            .map(|(m, p)| m - p)
            .collect();
        let kept = thin(
            &[run.measured, &residual],
            budget * time.len() / total.max(1),
        );
        let pick = |v: &[f64], levels| {
            let values: Vec<f64> = kept.iter().map(|&k| v[k]).collect();
            Coded::new(values.iter().copied(), levels)
        };
        let line = |name, class, v: &[f64]| Series {
            name,
            class,
            mode: "line",
            x: x.len(),
            y: pick(v, LEVELS),
        };
        upper.push(line("measured", "a", run.measured));
        upper.push(line("predicted", "b", run.predicted));
        lower.push(line("residual", "c", &residual));
        x.push(pick(time, TIME_LEVELS));
        if let (Some(&from), Some(&to)) = (time.first(), time.last()) {
            let shaded = run.part == Part::Validation;
            let label = if shaded { "held out" } else { "training" };
            spans.push(Span {
                from,
                to,
                label,
                shaded,
            });
        }
    }
    let panel = |y_label, height, series| Panel {
        y_label,
        log: false,
        height,
        series,
        spans: spans.clone(),
        marks: Vec::new(),
    };
    Chart {
        x_label: if shifted {
            "time / s (runs one after another)".into()
        } else {
            "time / s".into()
        },
        link: Some("time"),
        x_log: false,
        pad: 0.0,
        x,
        panels: vec![
            panel(format!("{quantity} / {unit}"), 210, upper),
            panel(format!("residual / {unit}"), 110, lower),
        ],
    }
}

/// Positions of at most about `most` samples that keep the extremes of every curve; samples that are not finite are left out.
fn thin(curves: &[&[f64]], most: usize) -> Vec<usize> {
    let n = curves.first().map_or(0, |c| c.len());
    let finite: Vec<usize> = (0..n)
        .filter(|&k| curves.iter().all(|c| c[k].is_finite()))
        .collect();
    if finite.len() <= most {
        return finite;
    }
    let stretches = (most / (2 * curves.len())).max(1);
    let mut kept = Vec::with_capacity(most);
    for stretch in finite.chunks(finite.len().div_ceil(stretches)) {
        let mut extremes = Vec::with_capacity(2 * curves.len());
        for c in curves {
            extremes.extend(
                stretch
                    .iter()
                    .copied()
                    .min_by(|&a, &b| c[a].total_cmp(&c[b])),
            );
            extremes.extend(
                stretch
                    .iter()
                    .copied()
                    .max_by(|&a, &b| c[a].total_cmp(&c[b])),
            );
        }
        extremes.sort_unstable();
        extremes.dedup();
        kept.extend(extremes);
    }
    kept
}

/// Friction of one joint over its velocity: what the model leaves for friction, and the friction it has.
pub(super) fn friction_chart(data: &ReportData, joint: usize) -> Option<Chart> {
    let unit = position_unit(data.robot.joints()[joint].kind);
    let label = format!("velocity / ({unit}/s)");
    over_velocity(data, joint, label, |f| {
        Some((&f.velocity[joint], &f.torque[joint]))
    })
}

/// The same of a motor that turns with several joints, over its own velocity.
pub(super) fn motor_friction_chart(data: &ReportData, motor: usize) -> Option<Chart> {
    let unit = position_unit(data.robot.joints()[motor].kind);
    let label = format!("velocity of the motor over its gear ratio / ({unit}/s)");
    over_velocity(data, motor, label, |f| {
        let own = f.motors.iter().find(|m| m.motor == motor)?;
        Some((&own.velocity, &own.torque))
    })
}

/// A friction over the velocity it depends on, and what the residual of a joint adds to it.
fn over_velocity<'a>(
    data: &ReportData<'a>,
    joint: usize,
    x_label: String,
    of: impl Fn(&'a FrictionPart) -> Option<(&'a Vec<f64>, &'a Vec<f64>)>,
) -> Option<Chart> {
    let (quantity, unit) = drive_words(data.robot.joints()[joint].kind);
    let total: usize = data
        .predictions
        .iter()
        .filter(|p| p.friction.is_some())
        .map(|p| p.time.len())
        .sum();
    let every = total.div_ceil(DOTS).max(1);
    let (mut velocity, mut seen, mut model) = (Vec::new(), Vec::new(), Vec::new());
    for p in data.predictions {
        let Some((speed, friction)) = p.friction.as_ref().and_then(&of) else {
            continue;
        };
        for k in (0..p.time.len()).step_by(every) {
            let f = friction[k];
            let left = p.measured[joint][k] - p.predicted[joint][k] + f;
            if left.is_finite() && f.is_finite() {
                velocity.push(speed[k]);
                seen.push(left);
                model.push(f);
            }
        }
    }
    let dots = |name, class, v: Vec<f64>| Series {
        name,
        class,
        mode: "dots",
        x: 0,
        y: Coded::new(v.into_iter(), LEVELS),
    };
    (!velocity.is_empty() && model.iter().any(|f| *f != 0.0)).then(|| Chart {
        x_label,
        link: None,
        x_log: false,
        pad: 0.03,
        x: vec![Coded::new(velocity.into_iter(), LEVELS)],
        panels: vec![Panel {
            y_label: format!("friction {quantity} / {unit}"),
            log: false,
            height: 210,
            series: vec![
                dots("from the data", "a", seen),
                dots("of the model", "b", model),
            ],
            spans: Vec::new(),
            marks: Vec::new(),
        }],
    })
}

/// Singular values over their number.
pub(super) fn spectrum_chart(spectrum: &Spectrum) -> Option<Chart> {
    let line = |name, class, v: &[f64]| Series {
        name,
        class,
        mode: "both",
        x: 0,
        // The smallest double keeps a zero on the page.
        y: Coded::new(v.iter().map(|s| s.max(f64::MIN_POSITIVE).log10()), LEVELS),
    };
    let n = spectrum.raw.len();
    (n > 0 && spectrum.equilibrated.len() == n).then(|| Chart {
        x_label: "number of the singular value".into(),
        link: None,
        x_log: false,
        pad: 0.02,
        x: vec![Coded::new((1..=n).map(|k| k as f64), (n.max(2) - 1) as f64)],
        panels: vec![Panel {
            y_label: "singular value".into(),
            log: true,
            height: 210,
            series: vec![
                line("of W in SI units", "b", &spectrum.raw),
                line("with unit columns", "c", &spectrum.equilibrated),
            ],
            spans: Vec::new(),
            marks: Vec::new(),
        }],
    })
}

/// Held-out error over the cutoff.
pub(super) fn cutoff_chart(curve: &CutoffCurve) -> Chart {
    Chart {
        x_label: "cutoff of the low-pass / Hz".into(),
        link: None,
        x_log: true,
        pad: 0.03,
        x: vec![Coded::new(
            curve.cutoff.iter().map(|c| c.log10()),
            TIME_LEVELS,
        )],
        panels: vec![Panel {
            y_label: "held-out error / %".into(),
            log: false,
            height: 210,
            series: vec![Series {
                name: "held-out error",
                class: "c",
                mode: "both",
                x: 0,
                y: Coded::new(curve.error.iter().map(|e| 100.0 * e), LEVELS),
            }],
            spans: Vec::new(),
            marks: vec![Mark {
                x: curve.chosen.log10(),
                label: "taken".into(),
            }],
        }],
    }
}
