//! Looking up columns, and saying what is missing, doubled or in an unknown unit.

use crate::error::{Error, Place, closest, printable};
use crate::header::{JointLabel, Meaning, list, meaning};
use crate::layout::Source;
use crate::mapping::{ColumnMapping, mapped};
use crate::quantity::Quantity;
use idim_model::JointKind;
use std::collections::BTreeMap;

/// What every header of a file means.
pub(crate) struct Finder<'a> {
    file: &'a str,
    pub(crate) headers: &'a [String],
    pub(crate) joints: &'a [JointLabel],
    pub(crate) free: Vec<usize>,
    found: BTreeMap<(Quantity, usize), Vec<Source>>,
    unknown_units: BTreeMap<(Quantity, usize), (usize, String)>,
}

impl<'a> Finder<'a> {
    pub(crate) fn new(
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
    pub(crate) fn pick(&self, quantity: Quantity, joint: usize) -> Result<Option<Source>, Error> {
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

    pub(crate) fn any(&self, quantity: Quantity) -> bool {
        let known = self.found.keys().chain(self.unknown_units.keys());
        known
            .filter(|k| k.0 == quantity)
            .any(|k| self.free.contains(&k.1))
    }

    pub(crate) fn needed(&self, quantity: Quantity) -> Result<Vec<Source>, Error> {
        let joints = self.free.iter();
        joints
            .map(|&joint| match self.pick(quantity, joint)? {
                Some(source) => Ok(source),
                None => Err(self.missing(quantity, joint)),
            })
            .collect()
    }

    pub(crate) fn optional(
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
    pub(crate) fn unit_error(&self, quantity: Quantity, joint: usize) -> Result<(), Error> {
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

    pub(crate) fn what_is_there(&self) -> String {
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

    pub(crate) fn header(&self, column: usize) -> &'a str {
        self.headers[column].trim()
    }
}
