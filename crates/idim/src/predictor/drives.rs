//! What the drives add to the rigid body's torque, column by column.

use super::PredictedModel;
use super::language::{Language, comment};
use crate::columns::{ExtraColumn, FrictionTerm, motor_reversal};
use idim_model::{Function, KnownTorque, Notation, ParameterKind};
use std::fmt::Write as _;

/// The functions of the drives: helpers, one function a known torque, and `drives` itself.
pub(super) fn drives(model: &PredictedModel, language: Language) -> String {
    let mut known = String::new();
    for (k, (torque, _)) in known_torques(model).enumerate() {
        known += &known_torque(k, torque, language);
    }
    let load = if model.load.is_empty() {
        ""
    } else {
        match language {
            Language::Rust => "    let load = rigid_body(&LOADING_BODY, q, qd, qdd);\n",
            Language::C => "    double load[N];\n    rigid_body(LOADING_BODY, q, qd, qdd, load);\n",
        }
    };
    let statements = statements(model, language);
    let body = match language {
        Language::Rust => format!(
            "\n// What the drives add to the rigid body's torque.\n#[allow(unused_variables)]\nfn drives(q: &[f64; N], qd: &[f64; N], qdd: &[f64; N], out: &mut [f64; N]) {{\n{load}{statements}}}\n"
        ),
        Language::C => format!(
            "\n/* What the drives add to the rigid body's torque. */\nstatic void drives(const double q[N], const double qd[N], const double qdd[N], double out[N]) {{\n    (void)q, (void)qd, (void)qdd, (void)out;\n{load}{statements}}}\n"
        ),
    };
    helpers(&(known.clone() + &body), language) + &known + &body
}

const SMOOTH_SIGN: [&str; 2] = [
    "
/// Sign of a speed, smoothed over `reversal`; the sign itself for 0.
fn smooth_sign(speed: f64, reversal: f64) -> f64 {
    if reversal > 0.0 {
        (speed / reversal).tanh()
    } else if speed == 0.0 {
        0.0
    } else {
        speed.signum()
    }
}
",
    "
/* Sign of a speed, smoothed over reversal; the sign itself for 0. */
static double smooth_sign(double speed, double reversal) {
    if (reversal > 0.0) return tanh(speed / reversal);
    return (speed > 0.0) - (speed < 0.0);
}
",
];

const BETWEEN: [&str; 2] = [
    "
/// Linear between points `(q, torque)`, constant beyond the ends.
fn between(points: &[[f64; 2]], q: f64) -> f64 {
    let mut after = 0;
    while after < points.len() && points[after][0] <= q {
        after += 1;
    }
    if after == 0 {
        return points[0][1];
    }
    let [q0, t0] = points[after - 1];
    if after == points.len() {
        return t0;
    }
    let [q1, t1] = points[after];
    t0 + (t1 - t0) * (q - q0) / (q1 - q0)
}
",
    "
/* Linear between points (q, torque), constant beyond the ends. */
static double between(const double points[][2], int n, double q) {
    int after = 0;
    while (after < n && points[after][0] <= q) after++;
    if (after == 0) return points[0][1];
    const double q0 = points[after - 1][0], t0 = points[after - 1][1];
    if (after == n) return t0;
    return t0 + (points[after][1] - t0) * (q - q0) / (points[after][0] - q0);
}
",
];

const SIGNUM_C: &str =
    "\nstatic double signum(double x) { return isnan(x) ? x : copysign(1.0, x); }\n";
const FRACT_C: &str = "\nstatic double fract(double x) { return x - trunc(x); }\n";

/// The helpers a text calls: C compilers warn of those that nobody calls.
fn helpers(text: &str, language: Language) -> String {
    let mut out = String::new();
    for (call, sources) in [
        (" smooth_sign(", SMOOTH_SIGN),
        (" between(", BETWEEN),
        ("signum(", ["", SIGNUM_C]),
        ("fract(", ["", FRACT_C]),
    ] {
        if text.contains(call) {
            out += sources[usize::from(language == Language::C)];
        }
    }
    out
}

/// Known torques with the values of their scales.
fn known_torques<'a>(model: &PredictedModel<'a>) -> impl Iterator<Item = (&'a KnownTorque, f64)> {
    let values = &model.values[model.columns.standard.len()..];
    let all = model.columns.extra.iter().zip(values);
    all.filter_map(|(column, &value)| match column {
        ExtraColumn::Known(torque) => Some((torque, value)),
        _ => None,
    })
}

/// A function of the joint's coordinate: the torque for a scale of 1.
fn known_torque(number: usize, torque: &KnownTorque, language: Language) -> String {
    let name = comment(torque.name());
    let mut inside = String::new();
    if let Some(points) = torque.table() {
        let rows: Vec<String> = points.iter().map(|p| language.row(p)).collect();
        let (n, list) = (points.len(), language.list(&rows));
        let lookup = match language {
            Language::Rust => {
                format!("    const POINTS: [[f64; 2]; {n}] = {list};\n    between(&POINTS, x0)\n")
            }
            Language::C => format!(
                "    static const double points[{n}][2] = {list};\n    return between(points, {n}, x0);\n"
            ),
        };
        inside += &lookup;
    }
    let steps = torque.steps().unwrap_or_default();
    for (k, (quantity, formula)) in steps.iter().enumerate() {
        let (source, k) = (language.formula(formula), k + 1);
        let _ = match (language, k == steps.len()) {
            (Language::Rust, true) => writeln!(inside, "    {source}"),
            (Language::C, true) => writeln!(inside, "    return {source};"),
            (Language::Rust, false) => {
                writeln!(
                    inside,
                    "    let x{k}: f64 = {source}; // {}",
                    comment(quantity)
                )
            }
            (Language::C, false) => writeln!(
                inside,
                "    const double x{k} = {source}; /* {} */\n    (void)x{k};",
                comment(quantity)
            ),
        };
    }
    match language {
        Language::Rust => format!(
            "\n// {name}: torque at a coordinate for a scale of 1.\n#[allow(unused_variables)]\nfn known_{number}(x0: f64) -> f64 {{\n{inside}}}\n"
        ),
        Language::C => format!(
            "\n/* {name}: torque at a coordinate for a scale of 1. */\nstatic double known_{number}(double x0) {{\n    (void)x0;\n{inside}}}\n"
        ),
    }
}

/// One statement a parameter and joint.
fn statements(model: &PredictedModel, language: Language) -> String {
    let mut text = String::new();
    let names = model.columns.names(Notation::Gautier);
    let reversal = |joint: usize| model.reversal.get(joint).copied().unwrap_or(0.0);
    let sign = |speed: &str, v: f64| format!("smooth_sign({speed}, {})", language.number(v));
    let mut add = |joint: usize, value: f64, course: &str, k: usize| {
        let (value, name) = (language.number(value), comment(&names[k]));
        let _ = match language {
            Language::Rust => writeln!(text, "    out[{joint}] += {value} * {course}; // {name}"),
            Language::C => writeln!(text, "    out[{joint}] += {value} * {course}; /* {name} */"),
        };
    };
    let (standard, extra) = model.values.split_at(model.columns.standard.len());
    for (k, (p, &value)) in model.columns.standard.0.iter().zip(standard).enumerate() {
        let j = p.index;
        let course = match p.kind {
            ParameterKind::Ia => format!("qdd[{j}]"),
            ParameterKind::Fv => format!("qd[{j}]"),
            ParameterKind::Fc => sign(&format!("qd[{j}]"), reversal(j)),
            ParameterKind::Offset => "1.0".into(),
            _ => continue,
        };
        add(j, value, &course, k);
    }
    let mut known = 0;
    for (k, (column, &value)) in model.columns.extra.iter().zip(extra).enumerate() {
        let k = standard.len() + k;
        match column {
            ExtraColumn::Motor { motor, kind, turns } => {
                let turned = |rate: &str| {
                    let all = turns.iter().enumerate().filter(|(_, r)| **r != 0.0);
                    let terms = all.map(|(j, &r)| format!("{} * {rate}[{j}]", language.number(r)));
                    format!("({})", terms.collect::<Vec<_>>().join(" + "))
                };
                let course = match kind {
                    ParameterKind::Ia => turned("qdd"),
                    ParameterKind::Fv => turned("qd"),
                    _ => sign(&turned("qd"), motor_reversal(reversal(*motor))),
                };
                for (j, &ratio) in turns.iter().enumerate().filter(|(_, r)| **r != 0.0) {
                    add(j, value * ratio, &course, k);
                }
            }
            ExtraColumn::Known(torque) => {
                let j = torque.joint();
                add(j, value, &format!("known_{known}(q[{j}])"), k);
                known += 1;
            }
            ExtraColumn::Friction { joint, term } => {
                let course = friction(*joint, *term, reversal(*joint), language);
                add(*joint, value, &course, k);
            }
        }
    }
    text
}

/// The course of a friction term.
fn friction(j: usize, term: FrictionTerm, reversal: f64, language: Language) -> String {
    let speed = format!("qd[{j}]");
    let size = language.call(Function::Abs, &speed);
    let sign = format!("smooth_sign({speed}, {})", language.number(reversal));
    match term {
        FrictionTerm::Asymmetric => size,
        FrictionTerm::Cubic => format!("({speed} * {speed} * {speed})"),
        FrictionTerm::Root => {
            let root = language.call(Function::Sqrt, &size);
            format!("{root} * {sign}")
        }
        FrictionTerm::Stribeck(scale) => {
            let share = format!("({speed} / {})", language.number(scale));
            let fall = language.call(Function::Exp, &format!("-({share} * {share})"));
            format!("{fall} * {sign}")
        }
        FrictionTerm::Load => {
            let load = language.call(Function::Abs, &format!("load[{j}]"));
            format!("{load} * {sign}")
        }
    }
}
