//! Which column of the file fills which place of the log.

use crate::error::{Error, Place};
use crate::finder::Finder;
use crate::header::{JointLabel, Meaning, list, meaning};
use crate::mapping::ColumnMapping;
use crate::quantity::Quantity;
use idim_model::JointKind;

/// A column of the file and the factor to SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Source {
    pub(crate) column: usize,
    pub(crate) factor: f64,
    pub(crate) declared: bool,
}

/// Where everything stands in the file; joint by joint over the joints that are not held.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Layout {
    pub(crate) time: Option<Source>,
    pub(crate) position: Vec<Source>,
    pub(crate) velocity: Option<Vec<Source>>,
    pub(crate) acceleration: Option<Vec<Source>>,
    pub(crate) drive: (Quantity, Vec<Source>),
    pub(crate) notes: Vec<String>,
}

impl Layout {
    /// Every needed column in the order of the log: time, positions, velocities, accelerations, drive.
    pub(crate) fn sources(&self) -> Vec<(Quantity, Source)> {
        let mut sources: Vec<(Quantity, Source)> = Vec::new();
        sources.extend(self.time.map(|s| (Quantity::Time, s)));
        let groups = [
            (Quantity::Position, Some(&self.position)),
            (Quantity::Velocity, self.velocity.as_ref()),
            (Quantity::Acceleration, self.acceleration.as_ref()),
            (self.drive.0, Some(&self.drive.1)),
        ];
        for (quantity, group) in groups {
            sources.extend(group.into_iter().flatten().map(|&s| (quantity, s)));
        }
        sources
    }
}

/// Finds the columns the robot needs, or says what is missing, doubled or in an unknown unit.
pub(crate) fn find_layout(
    headers: &[String],
    joints: &[JointLabel],
    mapping: &ColumnMapping,
    file: &str,
) -> Result<Layout, Error> {
    let mut notes = Vec::new();
    let renumbered = renumber(headers, joints, &mut notes);
    let joints = renumbered.as_deref().unwrap_or(joints);
    let finder = Finder::new(headers, joints, mapping, file)?;

    let time = finder.pick(Quantity::Time, 0)?;
    if time.is_none() && mapping.sample_rate.is_none() {
        finder.unit_error(Quantity::Time, 0)?;
        return Err(Error::log(
            "missing-column",
            Place::file(file),
            format!("no time column; {}", finder.what_is_there()),
            "name it `t` (s) or `t_ms`, or give the sample rate in the mapping",
        ));
    }
    let position = finder.needed(Quantity::Position)?;
    let torque = finder.any(Quantity::Torque);
    let current = finder.any(Quantity::Current);
    let drive = match (torque, current) {
        (false, true) => Quantity::Current,
        _ => Quantity::Torque,
    };
    if torque && current {
        notes.push("torque and current recorded: torque is used, current is left out".into());
    }
    let drive = (drive, finder.needed(drive)?);
    let velocity = finder.optional(Quantity::Velocity, &mut notes)?;
    let acceleration = finder.optional(Quantity::Acceleration, &mut notes)?;

    let mut layout = Layout {
        time,
        position,
        velocity,
        acceleration,
        drive,
        notes,
    };
    note_units(&finder, &mut layout);
    note_ignored(&finder, &mut layout);
    Ok(layout)
}

/// A held joint without columns where the numbers run over the free joints: `q1..q6` of an arm on a held torso.
fn renumber(
    headers: &[String],
    joints: &[JointLabel],
    notes: &mut Vec<String>,
) -> Option<Vec<JointLabel>> {
    let numbers: Vec<usize> = headers
        .iter()
        .filter_map(|h| match meaning(h, joints) {
            Meaning::Column {
                quantity: Quantity::Position,
                joint,
                ..
            } => Some(joints[joint].number),
            _ => None,
        })
        .collect();
    let n_free = joints.iter().filter(|j| !j.held).count();
    let in_order = numbers.len() == n_free && (1..=n_free).all(|n| numbers.contains(&n));
    let held_in_between = joints[..n_free.min(joints.len())].iter().any(|j| j.held);
    if !(in_order && held_in_between) {
        return None;
    }
    notes.push(format!(
        "columns q1 to q{n_free} taken as the joints that are not held, in order"
    ));
    let mut next = 0;
    let mut labels = joints.to_vec();
    for label in &mut labels {
        // Held joints get numbers nobody writes.
        label.number = usize::MAX;
        if !label.held {
            next += 1;
            label.number = next;
        }
    }
    Some(labels)
}

fn note_units(finder: &Finder<'_>, layout: &mut Layout) {
    let (drive, drive_sources) = &layout.drive;
    let time: Vec<Source> = layout.time.into_iter().collect();
    let groups = [
        (Quantity::Time, Some(&time)),
        (Quantity::Position, Some(&layout.position)),
        (Quantity::Velocity, layout.velocity.as_ref()),
        (Quantity::Acceleration, layout.acceleration.as_ref()),
        (*drive, Some(drive_sources)),
    ];
    let mut assumed = Vec::new();
    for (quantity, sources) in groups {
        let undeclared = |s: &&Source| !s.declared;
        let Some(at) = sources.and_then(|s| s.iter().position(|s| undeclared(&s))) else {
            continue;
        };
        let kind = match quantity {
            Quantity::Time => JointKind::Revolute,
            _ => finder.joints[finder.free[at]].kind,
        };
        assumed.push(format!("{} in {}", quantity.symbol(), quantity.si(kind)));
    }
    if !assumed.is_empty() {
        let what = assumed.join(", ");
        layout
            .notes
            .push(format!("no unit declared, SI assumed: {what}"));
    }
}

fn note_ignored(finder: &Finder<'_>, layout: &mut Layout) {
    let mut used: Vec<usize> = layout.time.iter().map(|s| s.column).collect();
    let groups = [
        Some(&layout.position),
        layout.velocity.as_ref(),
        layout.acceleration.as_ref(),
        Some(&layout.drive.1),
    ];
    for group in groups.into_iter().flatten() {
        used.extend(group.iter().map(|s| s.column));
    }
    let ignored: Vec<&str> = (0..finder.headers.len())
        .filter(|c| !used.contains(c) && !finder.header(*c).is_empty())
        .map(|c| finder.header(c))
        .collect();
    if !ignored.is_empty() {
        layout.notes.push(list("columns left out:", &ignored, ""));
    }
}
