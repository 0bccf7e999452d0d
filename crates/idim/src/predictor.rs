//! The identified model as source code for a controller: Rust and C, without dependencies and without allocation.
//!
//! The base parameters stand where the standard parameters of their columns stand, all others are zero: that robot has the
//! torques of the identified one, so recursive Newton-Euler (Luh, Walker & Paul 1980) predicts them.

use idim_model::{Columns, Joint, JointKind, Notation, ParameterKind, Pose, Robot};
use std::fmt::Write as _;

const RUST_CORE: &str = include_str!("predictor/core.rs.txt");
const C_CORE: &str = include_str!("predictor/core.c.txt");

/// What a predictor predicts with.
#[derive(Debug, Clone, Copy)]
pub struct PredictedModel<'a> {
    /// The robot as identified.
    pub robot: &'a Robot,
    /// The columns that have a value.
    pub columns: &'a Columns,
    /// Their values, SI.
    pub values: &'a [f64],
    /// Speed over which each joint's Coulomb torque changes sign; empty or 0 is the sign itself.
    pub reversal: &'a [f64],
}

/// A language of predictors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Language {
    Rust,
    C,
}

/// The model as a Rust module with a function `torque`.
pub fn predictor_rust(model: &PredictedModel) -> String {
    let mut text = format!(
        "//! Torques of {}, identified by idim {}. No dependencies, no allocation, no unsafe code.\n#![allow(dead_code, clippy::all)]\n\n/// Number of joints.\npub const N: usize = {};\n",
        one_line(model.robot.name()),
        env!("CARGO_PKG_VERSION"),
        model.robot.n_joints()
    );
    constants(&mut text, model, Language::Rust);
    text += RUST_CORE;
    text += "\n// What the drives add to the rigid body's torque.\n#[allow(unused_variables)]\nfn drives(q: &[f64; N], qd: &[f64; N], qdd: &[f64; N], out: &mut [f64; N]) {\n    let load = *out;\n";
    text += &statements(model);
    text += "}\n";
    text
}

/// The model as C99 with a function `idim_torque`; needs `-lm` on some systems.
pub fn predictor_c(model: &PredictedModel) -> String {
    let mut text = format!(
        "/* Torques of {}, identified by idim {}. C99 and libm, no allocation. */\n#include <math.h>\n\n/* Number of joints. */\nenum {{ N = {} }};\n",
        one_line(model.robot.name()).replace("*/", "* /"),
        env!("CARGO_PKG_VERSION"),
        model.robot.n_joints()
    );
    constants(&mut text, model, Language::C);
    text += &C_CORE.replace("PREFIX", "idim");
    text += "\n/* What the drives add to the rigid body's torque. */\nstatic void drives(const double q[N], const double qd[N], const double qdd[N], double out[N]) {\n    double load[N];\n    for (int k = 0; k < N; k++) load[k] = out[k];\n    (void)q, (void)qd, (void)qdd, (void)load, (void)smooth_sign, (void)magnitude, (void)square_root, (void)exponential;\n";
    text += &statements(model);
    text += "}\n";
    text
}

/// A name inside a comment of one line.
fn one_line(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

fn constants(text: &mut String, model: &PredictedModel, language: Language) {
    for (name, about, value) in geometry(model.robot, language)
        .into_iter()
        .chain([body_constant(model, language)])
    {
        // What one entry is made of, and how many numbers that are.
        let (rust, c, inner) = match name {
            "PARENT" => ("i32", "int", 1),
            "SLIDES" => ("bool", "int", 1),
            "ROTATION" | "LINK_ROTATION" => ("f64", "double", 9),
            "SHIFT" | "LINK_SHIFT" | "AXIS" => ("f64", "double", 3),
            "BODY" => ("f64", "double", 10),
            _ => ("f64", "double", 1),
        };
        let length = if name == "GRAVITY" { "3" } else { "N" };
        let _ = match (language, inner) {
            (Language::Rust, 1) => writeln!(
                text,
                "// {about}\nconst {name}: [{rust}; {length}] = {value};"
            ),
            (Language::Rust, k) => writeln!(
                text,
                "// {about}\nconst {name}: [[{rust}; {k}]; {length}] = {value};"
            ),
            (Language::C, 1) => writeln!(
                text,
                "/* {about} */\nstatic const {c} {name}[{length}] = {value};"
            ),
            (Language::C, k) => writeln!(
                text,
                "/* {about} */\nstatic const {c} {name}[{length}][{k}] = {value};"
            ),
        };
    }
}

/// Name, meaning and value of a constant.
type Constant = (&'static str, &'static str, String);

fn geometry(robot: &Robot, language: Language) -> [Constant; 9] {
    let joints = robot.joints();
    let list = |of: &dyn Fn(&Joint) -> String| {
        let items: Vec<String> = joints.iter().map(of).collect();
        bracketed(&items, language)
    };
    let numbers = |of: &dyn Fn(&Joint) -> Vec<f64>| list(&|j| row(&of(j), language));
    let rotation = |pose: &Pose| pose.rotation.transpose().as_slice().to_vec();
    let shift = |pose: &Pose| pose.translation.as_slice().to_vec();
    let parent = |j: &Joint| j.parent.map_or_else(|| "-1".into(), |p| p.to_string());
    let slides = |j: &Joint| match (language, j.kind == JointKind::Prismatic) {
        (Language::Rust, slides) => slides.to_string(),
        (Language::C, slides) => u8::from(slides).to_string(),
    };
    [
        (
            "PARENT",
            "Link each joint is mounted on, -1 for the base.",
            list(&parent),
        ),
        ("SLIDES", "Whether the joint slides.", list(&slides)),
        (
            "ROTATION",
            "Parent link from joint, before motion: rotation by rows.",
            numbers(&|j| rotation(&j.parent_from_joint)),
        ),
        (
            "SHIFT",
            "The same: translation, m.",
            numbers(&|j| shift(&j.parent_from_joint)),
        ),
        (
            "LINK_ROTATION",
            "Joint from link, after motion.",
            numbers(&|j| rotation(&j.joint_from_link)),
        ),
        (
            "LINK_SHIFT",
            "The same: translation, m.",
            numbers(&|j| shift(&j.joint_from_link)),
        ),
        (
            "AXIS",
            "Axis of motion in the joint's frame.",
            numbers(&|j| j.axis.as_slice().to_vec()),
        ),
        (
            "ZERO",
            "Added to the coordinate, rad (m).",
            list(&|j| literal(j.offset)),
        ),
        (
            "GRAVITY",
            "Gravity in the base frame, m/s2.",
            row(robot.gravity().as_slice(), language),
        ),
    ]
}

fn body_constant(model: &PredictedModel, language: Language) -> Constant {
    let rows: Vec<String> = bodies(model).iter().map(|b| row(b, language)).collect();
    (
        "BODY",
        "XX XY XZ YY YZ ZZ MX MY MZ M of each link: base parameters, zero where regrouped. No real bodies, the same torques.",
        bracketed(&rows, language),
    )
}

fn row(numbers: &[f64], language: Language) -> String {
    let items: Vec<String> = numbers.iter().map(|x| literal(*x)).collect();
    bracketed(&items, language)
}

fn bodies(model: &PredictedModel) -> Vec<Vec<f64>> {
    let mut bodies = vec![vec![0.0; 10]; model.robot.n_joints()];
    for (p, &value) in model.columns.0.iter().zip(model.values) {
        if let Some(k) = p.kind.inertial_index() {
            bodies[p.index][k] = value;
        }
    }
    bodies
}

fn bracketed(items: &[String], language: Language) -> String {
    let inside = items.join(", ");
    match language {
        Language::Rust => format!("[{inside}]"),
        Language::C => format!("{{{inside}}}"),
    }
}

/// The shortest text that reads back as the same number, in both languages.
fn literal(x: f64) -> String {
    format!("{x:?}")
}

/// One statement a parameter; both languages read the same.
fn statements(model: &PredictedModel) -> String {
    let mut text = String::new();
    let reversal = |joint: usize| model.reversal.get(joint).copied().unwrap_or(0.0);
    let names = model.columns.names(Notation::Gautier);
    for (k, (p, &value)) in model.columns.0.iter().zip(model.values).enumerate() {
        let j = p.index;
        let course = match p.kind {
            ParameterKind::Ia => format!("qdd[{j}]"),
            ParameterKind::Fv => format!("qd[{j}]"),
            ParameterKind::Fc => format!("smooth_sign(qd[{j}], {})", literal(reversal(j))),
            ParameterKind::Offset => "1.0".into(),
            _ => continue,
        };
        let _ = writeln!(
            text,
            "    out[{j}] += {} * {course}; // {}",
            literal(value),
            names[k]
        );
    }
    text
}
