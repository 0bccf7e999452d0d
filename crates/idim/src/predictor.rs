//! The identified model as source code for a controller: Rust and C, without dependencies and without allocation.
//!
//! The base parameters stand where the standard parameters of their columns stand, all others are zero: that robot has the
//! torques of the identified one, so recursive Newton-Euler (Luh, Walker & Paul 1980) predicts them. Drives, coupled motors,
//! known torques and friction are added term by term.

mod constants;
mod drives;
mod language;

use crate::columns::ModelColumns;
use constants::constants;
use drives::drives;
use idim_model::{Columns, JointKind, Robot};
use language::{Language, comment};
use std::fmt::Write as _;

const RUST_CORE: &str = include_str!("predictor/core.rs.txt");
const C_CORE: &str = include_str!("predictor/core.c.txt");

/// What a predictor predicts with.
#[derive(Debug, Clone, Copy)]
pub struct PredictedModel<'a> {
    /// The robot as identified.
    pub robot: &'a Robot,
    /// The columns that have a value.
    pub columns: &'a ModelColumns,
    /// Their values, SI.
    pub values: &'a [f64],
    /// Speed over which each joint's Coulomb torque changes sign; empty or 0 is the sign itself.
    pub reversal: &'a [f64],
    /// The ten parameters of each link whose torque loads the gears; empty where no friction depends on the load.
    pub load: &'a [[f64; 10]],
}

/// The model as a Rust module with a function `torque`.
pub fn predictor_rust(model: &PredictedModel) -> String {
    check(model);
    let mut text = format!(
        "//! Torques of {}, identified by idim {}. No dependencies, no allocation, no unsafe code.\n//!\n{}#![allow(dead_code, unused_parens, clippy::all)]\n\n/// Number of joints.\npub const N: usize = {};\n",
        comment(model.robot.name()),
        env!("CARGO_PKG_VERSION"),
        about(model.robot, "//! "),
        model.robot.n_joints()
    );
    text += &constants(model, Language::Rust);
    text += RUST_CORE;
    text += &drives(model, Language::Rust);
    text
}

/// The model as C99 with a function `idim_torque`; needs `-lm` on some systems.
pub fn predictor_c(model: &PredictedModel) -> String {
    check(model);
    let mut text = format!(
        "/* Torques of {}, identified by idim {}. C99 and libm, no allocation.\n *\n{} */\n#include <math.h>\n\n/* Number of joints. */\nenum {{ N = {} }};\n",
        comment(model.robot.name()),
        env!("CARGO_PKG_VERSION"),
        about(model.robot, " * "),
        model.robot.n_joints()
    );
    text += &constants(model, Language::C);
    text += C_CORE;
    text += &drives(model, Language::C);
    text += "\n/* Torque of every joint at one instant: rad, rad/s, rad/s^2 (m for sliding joints) in, N.m (N) out. */\nvoid idim_torque(const double q[N], const double qd[N], const double qdd[N], double out[N]) {\n    rigid_body(BODY, q, qd, qdd, out);\n    drives(q, qd, qdd, out);\n}\n";
    text
}

/// The joints in the order of the arrays, and what was changed on the robot.
fn about(robot: &Robot, margin: &str) -> String {
    let mut text = format!("{margin}Joints in the order of the arrays:\n");
    for (j, joint) in robot.joints().iter().enumerate() {
        let units = match joint.kind {
            JointKind::Revolute => "rad, N.m",
            JointKind::Prismatic => "m, N",
        };
        let _ = writeln!(text, "{margin}  [{j}] {} ({units})", comment(&joint.name));
    }
    for note in robot.notes() {
        let _ = writeln!(text, "{margin}{}", comment(note));
    }
    text
}

#[track_caller]
fn check(model: &PredictedModel) {
    assert_eq!(
        model.columns.len(),
        model.values.len(),
        "columns and values"
    );
}

/// The ten of each link that these columns and values make; zero where there is no column.
pub(crate) fn bodies(n_links: usize, columns: &Columns, values: &[f64]) -> Vec<[f64; 10]> {
    let mut bodies = vec![[0.0; 10]; n_links];
    for (p, &value) in columns.0.iter().zip(values) {
        if let Some(k) = p.kind.inertial_index() {
            bodies[p.index][k] = value;
        }
    }
    bodies
}
