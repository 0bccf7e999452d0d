//! The chapter about friction: what the joints have, and what was tried.

use super::blocks::{Block, figures as digits, word};
use super::charts::{friction_chart, motor_friction_chart};
use super::data::{ReportData, drive_words};
use crate::result::{FrictionResult, FrictionTrial};
use crate::table::optional;
use idim_model::JointKind;

const KEYS: &[(&str, &str)] = &[("a", "from the data"), ("b", "of the model")];

/// Choices shown a joint, best first.
const SHOWN: usize = 6;

pub(super) fn friction(data: &ReportData) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    for (j, joint) in data.robot.joints().iter().enumerate() {
        if let Some(chart) = friction_chart(data, j) {
            blocks.push(Block::figure(
                format!("friction-{}", j + 1),
                &joint.name,
                "Friction over the velocity of the joint.",
                KEYS,
                &chart,
            ));
        }
        let name = joint.name.as_str();
        let own = data.result.friction.iter().find(|f| f.joint == name);
        blocks.extend(own.and_then(|f| tried(f, joint.kind)));
    }
    for motor in coupled_motors(data) {
        if let Some(chart) = motor_friction_chart(data, motor) {
            blocks.push(Block::figure(
                format!("friction-motor-{}", motor + 1),
                format!("Motor of {}", data.robot.joints()[motor].name),
                "Friction of a motor that turns with several joints, seen at its own joint.",
                KEYS,
                &chart,
            ));
        }
    }
    if !blocks.is_empty() {
        blocks.insert(0, Block::Soft(
            "Dots from the data: measured torque less everything the model predicts but this friction. Dots of the model: its friction at the same samples; more than one branch where it depends on the load too.".into(),
        ));
    }
    blocks
}

fn coupled_motors(data: &ReportData) -> Vec<usize> {
    let first = data.predictions.iter().find_map(|p| p.friction.as_ref());
    first.map_or_else(Vec::new, |f| f.motors.iter().map(|m| m.motor).collect())
}

/// The best choices of a joint's terms, with the one taken.
fn tried(friction: &FrictionResult, kind: JointKind) -> Option<Block> {
    let mut best: Vec<&FrictionTrial> = friction.tried.iter().collect();
    if best.len() < 2 {
        return None;
    }
    let error = |t: &FrictionTrial| t.held_out_rms.unwrap_or(f64::INFINITY);
    best.sort_by(|a, b| error(a).total_cmp(&error(b)));
    let chosen = |t: &FrictionTrial| t.terms == friction.chosen;
    let place = best.iter().position(|t| chosen(t));
    best.truncate(place.map_or(SHOWN, |k| SHOWN.max(k + 1)));
    let unit = drive_words(kind).1;
    let header = vec![
        word("terms"),
        digits("parameters"),
        digits(format!("held-out rms / {unit}")),
        word(""),
    ];
    let rows = best.iter().map(|t| {
        vec![
            word(&t.terms),
            digits(t.size.to_string()),
            digits(optional(t.held_out_rms)),
            word(if chosen(t) { "taken" } else { "" }),
        ]
    });
    let caption = format!(
        "{}: the best {} of {} choices of terms, on blocks of the training motions held out in turn. A parameter must earn 3 % of the mean square, over all joints.",
        friction.joint,
        best.len(),
        friction.tried.len()
    );
    Some(Block::table(&caption, header, rows.collect()))
}
