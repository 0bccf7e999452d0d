//! A column mapping: which column is what, where the headers do not say it.

use crate::error::{Error, Place, closest, printable};
use crate::header::{JointLabel, Meaning, list, with_unit};
use crate::quantity::Quantity;
use idim_model::JointKind;
use serde::Deserialize;

/// Says by name which column holds what, where the header does not.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ColumnMapping {
    /// Columns that are not named as idim understands them.
    pub columns: Vec<MappedColumn>,
    /// Samples a second, Hz, for a log without a time column.
    pub sample_rate: Option<f64>,
    /// Topic of a bag that has several of JointState.
    pub topic: Option<String>,
    /// Leave out rows with a cell that is no finite number, and split the log there; refused otherwise.
    pub drop_bad: bool,
    /// How late the torques were recorded; not applied by readers, but by [`Log::with_torque_delays`](crate::Log::with_torque_delays).
    pub delays: Vec<TorqueDelay>,
}

/// How much later than the positions a torque was recorded.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorqueDelay {
    /// Name of the joint; of all that have none of their own where left out.
    #[serde(default)]
    pub joint: Option<String>,
    /// Delay, s; a few milliseconds typical.
    pub seconds: f64,
}

/// One column of a [`ColumnMapping`], or with `{}` in the header one of every joint.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MappedColumn {
    /// Header of the column, exactly. `{1}`, `{0}` and `{name}` stand for the joint's number from 1, from 0 and its name,
    /// and make one entry for every joint.
    pub header: String,
    /// What it holds: `t`, `q`, `qd`, `qdd`, `tau` or `current`.
    pub quantity: Quantity,
    /// Name or number of the joint; left out for time and for patterns.
    #[serde(default)]
    pub joint: Option<String>,
    /// Unit, `deg`; SI where left out.
    #[serde(default)]
    pub unit: Option<String>,
    /// What the column is multiplied by besides its unit; -1 turns a sign. 1 where left out.
    #[serde(default)]
    pub factor: Option<f64>,
}

/// What stands in the place of a pattern for a joint.
type Value = fn(&JointLabel) -> String;

/// What a pattern may hold, and what it stands for.
const PATTERNS: [(&str, Value); 3] = [
    ("{1}", |j| j.number.to_string()),
    ("{0}", |j| (j.number - 1).to_string()),
    ("{name}", |j| j.name.clone()),
];

/// The entries of a mapping with patterns written out for every joint that is not held.
fn written_out(mapping: &ColumnMapping, joints: &[JointLabel]) -> Vec<MappedColumn> {
    let mut columns = Vec::new();
    for column in &mapping.columns {
        let pattern = PATTERNS.iter().find(|(p, _)| column.header.contains(p));
        let Some((pattern, value)) = pattern else {
            columns.push(column.clone());
            continue;
        };
        columns.extend(joints.iter().filter(|j| !j.held).map(|j| MappedColumn {
            header: column.header.replace(pattern, &value(j)),
            joint: Some(j.name.clone()),
            ..column.clone()
        }));
    }
    columns
}

/// The meanings of a mapping's columns: position in the header and meaning.
pub(crate) fn mapped(
    mapping: &ColumnMapping,
    headers: &[String],
    joints: &[JointLabel],
    file: &str,
) -> Result<Vec<(usize, Meaning)>, Error> {
    let columns = written_out(mapping, joints);
    columns
        .iter()
        .map(|column| mapped_column(column, headers, joints, file))
        .collect()
}

fn mapped_column(
    column: &MappedColumn,
    headers: &[String],
    joints: &[JointLabel],
    file: &str,
) -> Result<(usize, Meaning), Error> {
    let place = || Place::file(file).column(&column.header);
    let refuse = |met: String, rule: String| Error::log("mapping", place(), met, rule);
    let here: Vec<usize> = (0..headers.len())
        .filter(|&i| headers[i].trim() == column.header.trim())
        .collect();
    let &[at] = here.as_slice() else {
        let near = closest(&column.header, headers.iter().map(String::as_str));
        return Err(refuse(
            format!("mapped, but {} columns have this header", here.len()),
            format!(
                "a mapping names one column of the file; {}",
                list("the closest are", &near, "correct the mapping")
            ),
        ));
    };
    let joint = match (&column.joint, column.quantity) {
        (_, Quantity::Time) => 0,
        (Some(name), _) => joint_by(name, joints, place)?,
        (None, _) => {
            return Err(refuse(
                format!("mapped to {} of no joint", column.quantity.symbol()),
                "give the joint's name or number in the mapping".to_string(),
            ));
        }
    };
    let kind = match column.quantity {
        Quantity::Time => JointKind::Revolute,
        _ => joints[joint].kind,
    };
    let by = column.factor.unwrap_or(1.0);
    if !(by.is_finite() && by != 0.0) {
        return Err(refuse(
            format!("factor {by}"),
            "a factor is a finite number other than zero; -1 turns a sign".to_string(),
        ));
    }
    let unit = column.unit.as_deref().unwrap_or("");
    let mut meaning = with_unit(column.quantity, joint, kind, unit);
    if let Meaning::Column { factor, .. } = &mut meaning {
        *factor *= by;
    }
    Ok((at, meaning))
}

/// The joint of this name or number.
fn joint_by(name: &str, joints: &[JointLabel], place: impl Fn() -> Place) -> Result<usize, Error> {
    let found = joints
        .iter()
        .position(|j| j.name == *name || j.number.to_string() == *name);
    found.ok_or_else(|| {
        let near = closest(name, joints.iter().map(|j| j.name.as_str()));
        Error::log(
            "mapping",
            place(),
            format!("mapped to joint `{}`", printable(name)),
            format!(
                "the robot has no such joint; {}",
                list("the closest are", &near, "give its name or number")
            ),
        )
    })
}
