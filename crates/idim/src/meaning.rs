//! What a parameter means, in words and units.

use crate::columns::{ExtraColumn, FrictionTerm};
use crate::table::number;
use idim_model::{JointKind, ParameterKind, Robot};

/// Unit of a parameter by its name (`ZZR1`, `mx2`, `Fv3`, `FcM6`, a known torque); empty for a word that is not known.
pub(crate) fn parameter_unit(name: &str, robot: &Robot) -> &'static str {
    use JointKind::{Prismatic, Revolute};
    let known = &robot.drives().known_torques;
    if known.iter().any(|k| k.name() == name) {
        return "1";
    }
    let word = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let number: Option<usize> = name[word.len()..].parse().ok();
    let kind = number
        .and_then(|n| robot.joints().get(n.checked_sub(1)?))
        .map_or(Revolute, |j| j.kind);
    let word = word.strip_suffix('R').unwrap_or(word);
    match (word, kind) {
        ("Ia" | "IaM", Prismatic) | ("M" | "m", _) => "kg",
        ("MX" | "MY" | "MZ" | "mx" | "my" | "mz", _) => "kg·m",
        ("Fv" | "FvM" | "Fva", Revolute) => "N·m·s/rad",
        ("Fv" | "FvM" | "Fva", Prismatic) => "N·s/m",
        ("Fc" | "FcM" | "Fs" | "off", Revolute) => "N·m",
        ("Fc" | "FcM" | "Fs" | "off", Prismatic) => "N",
        ("Fcub", Revolute) => "N·m·s³/rad³",
        ("Fcub", Prismatic) => "N·s³/m³",
        ("Froot", Revolute) => "N·m·√(s/rad)",
        ("Froot", Prismatic) => "N·√(s/m)",
        ("Fl", _) => "1",
        ("Ia" | "IaM", Revolute) => "kg·m²",
        (w, _) if is_inertia(w) => "kg·m²",
        _ => "",
    }
}

/// Groups of parameters by the words of their names, and what each group is.
const GROUPS: [(&[&str], &str); 11] = [
    (
        &[
            "XX", "YY", "ZZ", "XY", "XZ", "YZ", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz",
        ],
        "entries of the inertia tensor about the origin of the link's frame",
    ),
    (
        &["MX", "MY", "MZ", "mx", "my", "mz"],
        "first moments, mass times centre of mass",
    ),
    (&["M", "m"], "mass"),
    (&["Ia"], "rotor inertia seen at the joint"),
    (
        &["Fv", "Fva"],
        "viscous friction; Fva is what differs between the directions",
    ),
    (&["Fc"], "Coulomb friction"),
    (&["off"], "a constant torque"),
    (
        &["IaM", "FvM", "FcM"],
        "rotor inertia, viscous and Coulomb friction of a motor that turns with several joints, seen at its own joint",
    ),
    (
        &["Fcub", "Froot"],
        "friction with the third power and with the square root of the speed",
    ),
    (
        &["Fs"],
        "what static friction has above Coulomb's (Stribeck)",
    ),
    (&["Fl"], "friction in proportion to the load on the gear"),
];

/// What the words of these names mean, a sentence a group.
pub(crate) fn legend<'a>(names: impl Iterator<Item = &'a str>, robot: &Robot) -> Vec<String> {
    let known = &robot.drives().known_torques;
    let (mut words, mut scales) = (Vec::new(), Vec::new());
    for name in names {
        let word = name.trim_end_matches(|c: char| c.is_ascii_digit());
        if known.iter().any(|k| k.name() == name) {
            scales.push(name);
        } else {
            words.push(word.strip_suffix('R').unwrap_or(word));
        }
    }
    let present = |(group, meaning): &(&[&str], &str)| {
        let own = group.iter().filter(|w| words.contains(w));
        let own: Vec<&str> = own.copied().collect();
        (!own.is_empty()).then(|| format!("{}: {meaning}", own.join(", ")))
    };
    let mut legend: Vec<String> = GROUPS.iter().filter_map(present).collect();
    if !scales.is_empty() {
        legend.push(format!(
            "{}: scale of a known torque; 1 is as the robot file describes it",
            scales.join(", ")
        ));
    }
    legend
}

/// `XX` or `Ixx`: an entry of an inertia tensor.
fn is_inertia(word: &str) -> bool {
    let axes = word.strip_prefix('I').unwrap_or(word);
    axes.len() == 2 && axes.chars().all(|c| "XYZxyz".contains(c))
}

impl ExtraColumn {
    /// What the parameter multiplies, in words.
    pub fn meaning(&self, robot: &Robot) -> String {
        let name = |j: usize| robot.joints()[j].name.as_str();
        match self {
            Self::Motor { motor, kind, turns } => {
                let what = match kind {
                    ParameterKind::Ia => "rotor inertia",
                    ParameterKind::Fv => "viscous friction",
                    _ => "Coulomb friction",
                };
                let terms = turns.iter().enumerate().filter(|(_, r)| **r != 0.0);
                let turned: Vec<String> = terms
                    .map(|(j, r)| match *r {
                        1.0 => name(j).to_owned(),
                        r => format!("{} times {}", number(r), name(j)),
                    })
                    .collect();
                format!(
                    "{what} of the motor of {}, which turns with {}; seen at that joint",
                    name(*motor),
                    turned.join(" and ")
                )
            }
            Self::Known(torque) => format!(
                "scale of a known torque on {}; 1 is as the robot file describes it",
                name(torque.joint())
            ),
            Self::Friction { joint, term } => {
                let course = match term {
                    FrictionTerm::Asymmetric => "abs(qd)".to_owned(),
                    FrictionTerm::Cubic => "qd³".into(),
                    FrictionTerm::Root => "√abs(qd), with the sign of qd".into(),
                    FrictionTerm::Stribeck(v) => {
                        let unit = match robot.joints()[*joint].kind {
                            JointKind::Revolute => "rad/s",
                            JointKind::Prismatic => "m/s",
                        };
                        format!("exp(-(qd/v)²), with the sign of qd, v = {v} {unit} (Stribeck)")
                    }
                    FrictionTerm::Load => {
                        "abs(torque of the rigid body), with the sign of qd".into()
                    }
                };
                format!("friction of {}, times {course}", name(*joint))
            }
        }
    }
}
