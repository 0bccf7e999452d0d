//! Which column of the file fills which place of the log.

use crate::error::{Error, Place, closest, printable};
use crate::header::{ColumnMapping, JointLabel, Meaning, list, mapped, meaning};
use crate::quantity::Quantity;
use idim_model::JointKind;
use std::collections::BTreeMap;

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

struct Finder<'a> {
    file: &'a str,
    headers: &'a [String],
    joints: &'a [JointLabel],
    free: Vec<usize>,
    found: BTreeMap<(Quantity, usize), Vec<Source>>,
    unknown_units: BTreeMap<(Quantity, usize), (usize, String)>,
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
    finder.note_units(&mut layout);
    finder.note_ignored(&mut layout);
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

impl<'a> Finder<'a> {
    fn new(
        headers: &'a [String],
        joints: &'a [JointLabel],
        mapping: &ColumnMapping,
        file: &'a str,
    ) -> Result<Self, Error> {
        let mut finder = Self {
            file,
            headers,
            joints,
            free: (0..joints.len()).filter(|&i| !joints[i].held).collect(),
            found: BTreeMap::new(),
            unknown_units: BTreeMap::new(),
        };
        let explicit = mapped(mapping, headers, joints, file)?;
        let mut others = Vec::new();
        for (column, header) in headers.iter().enumerate() {
            let stated = explicit.iter().find(|(at, _)| *at == column);
            let meaning = match stated {
                Some((_, meaning)) => meaning.clone(),
                None => meaning(header, joints),
            };
            match meaning {
                Meaning::Column {
                    quantity,
                    joint,
                    factor,
                    declared,
                } => {
                    // What the mapping states goes before what a name suggests.
                    let by_mapping = explicit.iter().any(|(_, m)| {
                        matches!(m, Meaning::Column { quantity: a, joint: b, .. } if (*a, *b) == (quantity, joint))
                    });
                    if stated.is_some() || !by_mapping {
                        let sources = finder.found.entry((quantity, joint)).or_default();
                        sources.push(Source {
                            column,
                            factor,
                            declared,
                        });
                    }
                }
                Meaning::UnknownUnit {
                    quantity,
                    joint,
                    unit,
                } => {
                    if stated.is_some() {
                        return Err(finder.unknown_unit(quantity, joint, column, &unit));
                    }
                    let first = finder.unknown_units.entry((quantity, joint));
                    first.or_insert((column, unit));
                }
                Meaning::OtherJoint { number } => others.push((column, number)),
                Meaning::Other => {}
            }
        }
        match others.first() {
            Some(&(column, number)) => Err(finder.other_joint(column, number)),
            None => Ok(finder),
        }
    }

    fn other_joint(&self, column: usize, number: usize) -> Error {
        let n = self.joints.len();
        let rule = if number == 0 {
            "columns count joints from 1 (`q1` is the joint next to the base); rename them or give a mapping"
                .to_string()
        } else {
            "use the robot file this log belongs to, or rename columns that are not joints".into()
        };
        Error::log(
            "joint-count",
            Place::file(self.file).column(&self.headers[column]),
            format!("a column of joint {number}, where the robot has {n} joints"),
            rule,
        )
    }

    /// The one column of a quantity, `None` if there is none, an error if there are two.
    fn pick(&self, quantity: Quantity, joint: usize) -> Result<Option<Source>, Error> {
        let sources = self.found.get(&(quantity, joint));
        match sources.map_or(&[][..], Vec::as_slice) {
            [] => Ok(None),
            [one] => Ok(Some(*one)),
            many => {
                let names: Vec<&str> = many.iter().map(|s| self.header(s.column)).collect();
                let at: Vec<String> = many.iter().map(|s| (s.column + 1).to_string()).collect();
                Err(Error::log(
                    "ambiguous-column",
                    self.place(quantity, joint),
                    format!(
                        "{} (columns {}) for {}",
                        list("two headers", &names, ""),
                        at.join(", "),
                        self.what(quantity, joint)
                    ),
                    "keep one of them, or name the one meant in a mapping",
                ))
            }
        }
    }

    fn any(&self, quantity: Quantity) -> bool {
        let known = self.found.keys().chain(self.unknown_units.keys());
        known
            .filter(|k| k.0 == quantity)
            .any(|k| self.free.contains(&k.1))
    }

    fn needed(&self, quantity: Quantity) -> Result<Vec<Source>, Error> {
        let joints = self.free.iter();
        joints
            .map(|&joint| match self.pick(quantity, joint)? {
                Some(source) => Ok(source),
                None => Err(self.missing(quantity, joint)),
            })
            .collect()
    }

    fn optional(
        &self,
        quantity: Quantity,
        notes: &mut Vec<String>,
    ) -> Result<Option<Vec<Source>>, Error> {
        if !self.any(quantity) {
            return Ok(None);
        }
        let mut sources = Vec::new();
        for &joint in &self.free {
            let Some(source) = self.pick(quantity, joint)? else {
                self.unit_error(quantity, joint)?;
                notes.push(format!(
                    "no column for {}, so the recorded {} is left out for all joints",
                    self.what(quantity, joint),
                    quantity.symbol()
                ));
                return Ok(None);
            };
            sources.push(source);
        }
        Ok(Some(sources))
    }

    fn missing(&self, quantity: Quantity, joint: usize) -> Error {
        if let Err(unit) = self.unit_error(quantity, joint) {
            return unit;
        }
        let label = &self.joints[joint];
        let symbol = quantity.symbol();
        let wanted = [
            format!("{symbol}{}", label.number),
            format!("{symbol}_{}", label.name),
        ];
        let near = self.close_to(quantity, label);
        let alternative = match quantity {
            Quantity::Torque => " (or `current1` with torque constants in the robot file)",
            _ => "",
        };
        let present = self
            .free
            .iter()
            .filter(|&&j| self.found.contains_key(&(quantity, j)))
            .count();
        let count = format!("{present} of {} joints have one", self.free.len());
        Error::log(
            "missing-column",
            self.place(quantity, joint),
            format!(
                "no column for {} ({count}); {}",
                self.what(quantity, joint),
                self.what_is_there()
            ),
            format!(
                "name it `{}` or `{}`{alternative}, or give a mapping; {}",
                wanted[0],
                printable(&wanted[1]),
                list("closest names:", &near, "no name comes close")
            ),
        )
    }

    /// Headers nobody claims that resemble what labs call such a column.
    fn close_to(&self, quantity: Quantity, label: &JointLabel) -> Vec<&'a str> {
        let claimed: Vec<usize> = self.found.values().flatten().map(|s| s.column).collect();
        let unclaimed: Vec<&str> = (0..self.headers.len())
            .filter(|c| !claimed.contains(c))
            .map(|c| self.header(c))
            .collect();
        let mut near: Vec<&str> = Vec::new();
        for word in quantity.words() {
            for name in [
                format!("{word}{}", label.number),
                format!("{word}_{}", label.name),
            ] {
                near.extend(closest(&name, unclaimed.iter().copied()));
            }
        }
        near.sort_unstable();
        near.dedup();
        near.truncate(5);
        near
    }

    /// An error if the only column for it has a unit that is none.
    fn unit_error(&self, quantity: Quantity, joint: usize) -> Result<(), Error> {
        match self.unknown_units.get(&(quantity, joint)) {
            Some((column, unit)) => Err(self.unknown_unit(quantity, joint, *column, unit)),
            None => Ok(()),
        }
    }

    fn unknown_unit(&self, quantity: Quantity, joint: usize, column: usize, unit: &str) -> Error {
        Error::log(
            "unit",
            self.place(quantity, joint).column(&self.headers[column]),
            format!("unit `{}`", printable(unit)),
            format!(
                "{} may be in {}; rename the column, or state the unit in a mapping",
                self.what(quantity, joint),
                quantity.unit_names(self.kind(quantity, joint))
            ),
        )
    }

    fn note_units(&self, layout: &mut Layout) {
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
                _ => self.joints[self.free[at]].kind,
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

    fn note_ignored(&self, layout: &mut Layout) {
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
        let ignored: Vec<&str> = (0..self.headers.len())
            .filter(|c| !used.contains(c) && !self.header(*c).is_empty())
            .map(|c| self.header(c))
            .collect();
        if !ignored.is_empty() {
            layout.notes.push(list("columns left out:", &ignored, ""));
        }
    }

    fn what_is_there(&self) -> String {
        let headers: Vec<&str> = self.headers.iter().map(String::as_str).collect();
        list("the file has", &headers, "the file has no columns")
    }

    fn what(&self, quantity: Quantity, joint: usize) -> String {
        match quantity {
            Quantity::Time => "time".into(),
            _ => format!(
                "{} of joint {} ({})",
                quantity.symbol(),
                self.joints[joint].number,
                printable(&self.joints[joint].name)
            ),
        }
    }

    fn place(&self, quantity: Quantity, joint: usize) -> Place {
        match quantity {
            Quantity::Time => Place::file(self.file),
            _ => Place::file(self.file).joint(&self.joints[joint].name),
        }
    }

    fn kind(&self, quantity: Quantity, joint: usize) -> JointKind {
        match quantity {
            Quantity::Time => JointKind::Revolute,
            _ => self.joints[joint].kind,
        }
    }

    fn header(&self, column: usize) -> &'a str {
        self.headers[column].trim()
    }
}
