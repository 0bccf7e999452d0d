//! Robots from RON text and back; `docs/robot-file.md` describes the format.

pub(crate) mod assembly;
mod drives;
mod format;
mod frames;
mod plausibility;
mod refusal;
pub(crate) mod snapping;
mod values;
mod write;

pub use write::robot_to_ron;

use crate::error::Error;
use crate::pose::Pose;
use crate::robot::{Joint, JointKind, Link, LinkCapsule, Robot, Shapes};
use assembly::{DescribedJoint, MAX_JOINTS, assemble};
use format::{Entry, File, Joints, Kind};
use frames::{Frame, Reader};
use nalgebra::Vector3;
use ron::extensions::Extensions;
use snapping::Snapping;
use values::{actuator, capsules, inertial, limits};

/// A robot from the text of a RON robot file: modified DH, standard DH or general poses.
///
/// Fixed joints are folded into their parents, rounded angles moved onto the multiple of π/12 they mean, and
/// inertial values that no rigid body can have are kept; [`Robot::notes`] says so for each.
///
/// # Errors
/// [`Error::Syntax`] with line and column: text that is not RON, a field that does not exist (with the nearest that
/// does), one that is missing, a number that is not finite, an unknown parent, a name used twice, a zero axis, a
/// mass below zero, limits that contradict each other.
///
/// # Examples
/// ```
/// let robot = idim_model::robot_from_ron(
///     "(
///         name: \"pendulum\",
///         angles: Degrees,
///         gravity: (0, 0, -9.81),
///         joints: StandardDh([(name: \"swing\", frame: (alpha: 90, a: 0.5))]),
///     )",
/// )?;
/// assert_eq!(robot.n_joints(), 1);
/// # Ok::<(), idim_model::Error>(())
/// ```
pub fn robot_from_ron(text: &str) -> Result<Robot, Error> {
    let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let mut file: File = options.from_str(text).map_err(|e| refusal::from_ron(&e))?;
    let mut snapping = Snapping::default();
    let base = file.base.take().unwrap_or_default();
    let mut reader = Reader {
        unit: file.angles,
        snapping: &mut snapping,
        place: "base".to_owned(),
    };
    let base = reader.pose(base.xyz, base.rpy);
    let described = match &file.joints {
        Joints::ModifiedDh(entries) => describe(text, entries, &base, &mut reader),
        Joints::StandardDh(entries) => describe(text, entries, &base, &mut reader),
        Joints::Poses(entries) => describe(text, entries, &base, &mut reader),
    }?;
    let gravity = Vector3::from(file.gravity.map(|v| v.0));
    let shapes = shapes(&file, &described)?;
    let robot = assemble(&file.name, gravity, described, shapes)?;
    let known = &file.known_torques;
    let drives = drives::drives(&file.joints, file.log, known, file.angles, &robot)?;
    Ok(robot.with_drives(drives)?.with_notes(snapping.into_notes()))
}

/// Obstacles, the ground and pairs that may touch, by the names of links.
fn shapes(file: &File, described: &[DescribedJoint]) -> Result<Shapes, Error> {
    let links = || described.iter().map(|d| d.link.name.as_str());
    for name in file.may_touch.iter().flat_map(|(a, b)| [a, b]) {
        let known = [BASE, GROUND].contains(&name.as_str()) || links().any(|l| l == name);
        if !known {
            return Err(Error::robot(
                "may_touch",
                format!("unknown link {name}"),
                crate::suggestion::did_you_mean(name, links().chain([BASE, GROUND])),
            ));
        }
    }
    let obstacle = |capsule| LinkCapsule {
        link: None,
        capsule,
    };
    let pairs = file.may_touch.iter().cloned();
    Ok(Shapes {
        capsules: capsules(&file.obstacles)
            .into_iter()
            .map(obstacle)
            .collect(),
        ground: file.ground.map(f64::from),
        may_touch: pairs.map(<[String; 2]>::from).collect(),
    })
}

/// The joints of a file one after another, each with its place in the text.
fn describe<F: Frame>(
    text: &str,
    entries: &[Entry<F>],
    base: &Pose,
    reader: &mut Reader,
) -> Result<Vec<DescribedJoint>, Error> {
    if entries.len() > MAX_JOINTS {
        let met = format!("{} joints", entries.len());
        let rule = format!("no arm has more than {MAX_JOINTS}; is this one robot?");
        return Err(Error::robot("joints", met, rule).at(1, 1));
    }
    let mut described: Vec<DescribedJoint> = Vec::with_capacity(entries.len());
    let mut places = refusal::Places::new(text);
    for (i, entry) in entries.iter().enumerate() {
        let (line, column) = places.next_name(&entry.name);
        let joint = describe_joint(entry, i, &described, base, reader);
        let (joint, link) = joint.map_err(|e| e.at(line, column))?;
        let same = |d: &DescribedJoint| d.joint.name == joint.name || d.link.name == link.name;
        if let Some(other) = described.iter().find(|d| same(d)) {
            let (which, name) = if other.joint.name == joint.name {
                ("joint", &joint.name)
            } else {
                ("link", &link.name)
            };
            let met = format!("name used twice, first on line {}", other.line);
            return Err(
                Error::robot(format!("{which} {name}"), met, "rename one of them").at(line, column),
            );
        }
        let fixed = entry.kind == Kind::Fixed;
        described.push(DescribedJoint {
            joint,
            link,
            capsules: capsules(&entry.capsules),
            fixed,
            line,
            column,
        });
    }
    Ok(described)
}

fn describe_joint<F: Frame>(
    entry: &Entry<F>,
    index: usize,
    earlier: &[DescribedJoint],
    base: &Pose,
    reader: &mut Reader,
) -> Result<(Joint, Link), Error> {
    let place = format!("joint {}", entry.name);
    reader.place.clone_from(&place);
    let parent = parent(entry, earlier)?;
    let Some(frame) = entry.frame.placement(entry.kind, reader) else {
        let rule = "a joint that moves needs one, for example axis: (0, 0, 1)";
        return Err(Error::robot(place, "no axis in its frame", rule));
    };
    let kind = match entry.kind {
        Kind::Prismatic => JointKind::Prismatic,
        Kind::Revolute | Kind::Fixed => JointKind::Revolute,
    };
    if entry.kind == Kind::Fixed && (entry.limits.is_some() || entry.actuator.is_some()) {
        let rule = "it does not move: leave them out, or make it Revolute or Prismatic";
        return Err(Error::robot(
            place,
            "a fixed joint with limits or an actuator",
            rule,
        ));
    }
    let mounting = if parent.is_none() {
        *base
    } else {
        Pose::identity()
    };
    let joint = Joint {
        name: entry.name.clone(),
        kind,
        parent,
        parent_from_joint: mounting * frame.parent_from_joint,
        axis: frame.axis,
        offset: frame.offset,
        joint_from_link: frame.joint_from_link,
        limits: limits(entry.limits.as_ref(), kind, reader.unit),
        actuator: actuator(entry.actuator.as_ref(), kind, reader.unit),
    };
    let link = Link {
        name: entry
            .link
            .clone()
            .unwrap_or_else(|| format!("link{}", index + 1)),
        inertial: entry.inertial.as_ref().map(inertial),
    };
    Ok((joint, link))
}

/// What stands for the base where a parent is asked for.
const BASE: &str = "base";
/// What stands for the ground where links may touch it.
const GROUND: &str = "ground";

/// The entry an entry is mounted on: the one named, by its joint or else its link; the one before where none is named.
fn parent<F>(entry: &Entry<F>, earlier: &[DescribedJoint]) -> Result<Option<usize>, Error> {
    let name = match entry.parent.as_deref() {
        None => return Ok(earlier.len().checked_sub(1)),
        Some(BASE) => return Ok(None),
        Some(name) => name,
    };
    let by_joint = earlier.iter().position(|d| d.joint.name == name);
    let found = by_joint.or_else(|| earlier.iter().position(|d| d.link.name == name));
    if found.is_some() {
        return Ok(found);
    }
    let names = earlier
        .iter()
        .flat_map(|d| [d.joint.name.as_str(), d.link.name.as_str()]);
    let nearest = crate::suggestion::did_you_mean(name, names.chain([BASE]));
    Err(Error::robot(
        format!("joint {}", entry.name),
        format!("unknown parent {name}"),
        format!("a parent is a joint or link further up in the file, or base; {nearest}"),
    ))
}
