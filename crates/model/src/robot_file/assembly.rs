//! From described joints, fixed ones among them, to a checked robot: what RON and URDF files have in common.

use super::plausibility::impossibility;
use crate::error::Error;
use crate::parameter::InertialParameters;
use crate::robot::{Capsule, Joint, Link, LinkCapsule, Robot, Shapes};
use nalgebra::Vector3;

/// Most joints of one robot: the work on a tree of joints grows with the square.
pub(crate) const MAX_JOINTS: usize = 1000;

/// A joint as a file describes it, with its place in the text; parents stand before children.
pub(crate) struct DescribedJoint {
    /// The joint; its parent is an index into the described list.
    pub(crate) joint: Joint,
    /// The link it carries.
    pub(crate) link: Link,
    /// Bodies around the link, in its frame.
    pub(crate) capsules: Vec<Capsule>,
    /// It does not move; `joint` holds some revolute joint at position zero.
    pub(crate) fixed: bool,
    /// Line of the joint in the file.
    pub(crate) line: usize,
    /// Column of the joint in the file.
    pub(crate) column: usize,
}

/// Checks each joint where it stands in the file, folds the fixed ones into their parents and says so.
///
/// `shapes`: what is not of a link; the links' own capsules are added.
pub(crate) fn assemble(
    name: &str,
    gravity: Vector3<f64>,
    mut described: Vec<DescribedJoint>,
    mut shapes: Shapes,
) -> Result<Robot, Error> {
    for d in &described {
        let checked = d.joint.check().and_then(|()| d.link.check());
        checked.map_err(|e| e.at(d.line, d.column))?;
    }
    let mut notes = implausible(&described);
    notes.extend(folded(&described));
    for d in &mut described {
        if d.fixed && d.link.inertial.is_none() {
            // A frame without a body; what is mounted on it must still reach the link below.
            d.link.inertial = Some(InertialParameters::ZERO);
        }
    }
    if described.iter().all(|d| d.fixed) {
        return Err(Error::robot(
            name,
            "no moving joint",
            "an arm needs at least one revolute or prismatic joint",
        ));
    }
    let fixed: Vec<usize> = (0..described.len())
        .filter(|&i| described[i].fixed)
        .collect();
    for (link, d) in described.iter_mut().enumerate() {
        let own = std::mem::take(&mut d.capsules).into_iter();
        shapes.capsules.extend(own.map(|capsule| LinkCapsule {
            link: Some(link),
            capsule,
        }));
    }
    let (joints, links) = described.into_iter().map(|d| (d.joint, d.link)).unzip();
    let mut robot = Robot::new(name, gravity, joints, links)?.with_shapes(shapes)?;
    // From the tips inwards, so that what a fixed joint carries is complete when it is folded.
    for &i in fixed.iter().rev() {
        robot = robot.lock(i, 0.0);
    }
    Ok(robot.with_notes(notes))
}

/// One sentence a link whose inertial values no rigid body has.
fn implausible(described: &[DescribedJoint]) -> Vec<String> {
    let moving = described
        .iter()
        .filter(|d| !d.fixed || carrier(described, d).is_some());
    let note = |d: &DescribedJoint| {
        let reason = d.link.inertial.as_ref().and_then(impossibility)?;
        let name = &d.link.name;
        Some(format!(
            "link {name}: no rigid body has this inertial: {reason}; kept as stated, unfit as a prior"
        ))
    };
    moving.filter_map(note).collect()
}

/// What became of the fixed joints: one sentence a fate.
fn folded(described: &[DescribedJoint]) -> Vec<String> {
    let (mut on_base, mut frames, mut bodies, mut lost) = (vec![], vec![], vec![], vec![]);
    for d in described.iter().filter(|d| d.fixed) {
        let name = d.link.name.as_str();
        match carrier(described, d) {
            None => on_base.push(name.to_owned()),
            Some(_) if d.link.inertial.is_none() => frames.push(name.to_owned()),
            Some(c) if c.link.inertial.is_some() => {
                bodies.push(format!("{name} into {}", c.link.name));
            }
            Some(c) => lost.push(format!("{name} into {}", c.link.name)),
        }
    }
    let fates = [
        (
            "links fixed to the base, which take no part in the dynamics",
            on_base,
        ),
        (
            "fixed links without inertial, which contribute nothing",
            frames,
        ),
        ("fixed links folded into the link that carries them", bodies),
        (
            "fixed links folded into a link without inertial, their own inertial not used",
            lost,
        ),
    ];
    fates
        .into_iter()
        .filter_map(|(fate, links)| listed(fate, &links))
        .collect()
}

/// Names listed in one note; the rest are counted.
const MAX_NAMED: usize = 6;

/// `what: a, b and 3 more`; `None` where there is nothing to list.
pub(crate) fn listed(what: &str, names: &[String]) -> Option<String> {
    let named = names[..names.len().min(MAX_NAMED)].join(", ");
    match names.len() {
        0 => None,
        n if n <= MAX_NAMED => Some(format!("{what}: {named}")),
        n => Some(format!("{what}: {named} and {} more", n - MAX_NAMED)),
    }
}

/// The moving joint whose link a fixed one becomes part of; `None` for the base.
fn carrier<'a>(
    described: &'a [DescribedJoint],
    fixed: &DescribedJoint,
) -> Option<&'a DescribedJoint> {
    let mut below = fixed.joint.parent;
    while let Some(d) = below.map(|i| &described[i]) {
        if !d.fixed {
            return Some(d);
        }
        below = d.joint.parent;
    }
    None
}
