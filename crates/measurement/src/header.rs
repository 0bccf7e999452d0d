//! From header names to quantities of joints.

use crate::error::printable;
use crate::quantity::Quantity;
use idim_model::{JointKind, Robot};

/// A joint as its columns may name it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JointLabel {
    /// Name of the joint, as in `q_shoulder`.
    pub name: String,
    /// Number, from 1, as in `q1`.
    pub number: usize,
    /// Decides which units it may have.
    pub kind: JointKind,
    /// Held in place: its columns are left out.
    pub held: bool,
}

/// Labels of the joints of `described`; those that `robot` no longer has (locked) are marked as held.
///
/// Columns keep the numbers of the robot as described, so `q7` of an arm on a held torso stays `q7`.
pub fn joint_labels(robot: &Robot, described: &Robot) -> Vec<JointLabel> {
    let joints = described.joints().iter().enumerate();
    joints
        .map(|(i, joint)| JointLabel {
            name: joint.name.clone(),
            number: i + 1,
            kind: joint.kind,
            held: robot.joint_index(&joint.name).is_none(),
        })
        .collect()
}

/// What a header means.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Meaning {
    /// A quantity of a joint (index into the labels; 0 for time), SI units per unit, whether the unit was stated.
    Column {
        quantity: Quantity,
        joint: usize,
        factor: f64,
        declared: bool,
    },
    /// The same with a word in place of the unit that is none.
    UnknownUnit {
        quantity: Quantity,
        joint: usize,
        unit: String,
    },
    /// A quantity of a joint that the robot does not have.
    OtherJoint { number: usize },
    /// Nothing known.
    Other,
}

/// Reads a header by its name alone.
pub(crate) fn meaning(header: &str, joints: &[JointLabel]) -> Meaning {
    let header = normalise(header);
    for stem in ["time", "t"] {
        if let Some(rest) = header.strip_prefix(stem)
            && let Some(unit) = unit_suffix(rest)
        {
            return with_unit(Quantity::Time, 0, JointKind::Revolute, unit);
        }
    }
    for quantity in Quantity::OF_A_JOINT {
        let Some(rest) = header.strip_prefix(quantity.symbol()) else {
            continue;
        };
        if let Some((joint, unit)) = named_joint(rest, joints) {
            return with_unit(quantity, joint, joints[joint].kind, unit);
        }
        let rest = rest.strip_prefix('_').unwrap_or(rest);
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        let Ok(number) = rest[..digits].parse::<usize>() else {
            continue;
        };
        let Some(unit) = unit_suffix(&rest[digits..]) else {
            continue;
        };
        return match joints.iter().position(|j| j.number == number) {
            Some(joint) => with_unit(quantity, joint, joints[joint].kind, unit),
            None => Meaning::OtherJoint { number },
        };
    }
    Meaning::Other
}

/// Lower case, `q1 [rad/s]` as `q1_rad/s`.
pub(crate) fn normalise(header: &str) -> String {
    let mut out = String::new();
    for c in header.trim().to_lowercase().chars() {
        let c = match c {
            '[' | '(' | ' ' => '_',
            ']' | ')' => continue,
            c => c,
        };
        if !(c == '_' && out.ends_with('_')) {
            out.push(c);
        }
    }
    out
}

/// The unit of `_unit`, empty where nothing follows; `None` where something else does.
fn unit_suffix(rest: &str) -> Option<&str> {
    if rest.is_empty() {
        Some(rest)
    } else {
        rest.strip_prefix('_')
    }
}

fn named_joint<'a>(rest: &'a str, joints: &[JointLabel]) -> Option<(usize, &'a str)> {
    let rest = rest.strip_prefix('_')?;
    let mut order: Vec<usize> = (0..joints.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(joints[i].name.len()));
    order.into_iter().find_map(|i| {
        let after = rest.strip_prefix(normalise(&joints[i].name).as_str())?;
        Some((i, unit_suffix(after)?))
    })
}

pub(crate) fn with_unit(quantity: Quantity, joint: usize, kind: JointKind, unit: &str) -> Meaning {
    let factor = if unit.is_empty() {
        Some(1.0)
    } else {
        quantity.factor(kind, unit)
    };
    match factor {
        Some(factor) => Meaning::Column {
            quantity,
            joint,
            factor,
            declared: !unit.is_empty(),
        },
        None => Meaning::UnknownUnit {
            quantity,
            joint,
            unit: unit.to_string(),
        },
    }
}

/// `words a, b` or, where there is nothing to list, `otherwise`.
pub(crate) fn list(words: &str, items: &[&str], otherwise: &str) -> String {
    if items.is_empty() {
        return otherwise.to_string();
    }
    let shown: Vec<String> = items.iter().take(40).map(|s| printable(s)).collect();
    let more = if items.len() > shown.len() {
        format!(" and {} more", items.len() - shown.len())
    } else {
        String::new()
    };
    format!("{words} {}{more}", shown.join(", "))
}
