//! A log: what a recording says, in SI units.

use crate::error::{Error, Place};
use crate::header::JointLabel;
use crate::layout::Layout;
use crate::left_out::BadRows;
use crate::mapping::ColumnMapping;
use crate::quantity::Quantity;

/// What drove the joints, joint by joint.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// Joint torque, N·m (N).
    Torque(Vec<Vec<f64>>),
    /// Motor current, A.
    Current(Vec<Vec<f64>>),
}

/// A log as recorded, in SI units; every quantity joint by joint, `q[joint][sample]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Log {
    /// Name of the file, for messages.
    pub file: String,
    /// Names of the joints, in order.
    pub joints: Vec<String>,
    /// Whether the file declares the unit of its clock.
    pub time_unit_declared: bool,
    /// Time, s, rising.
    pub time: Vec<f64>,
    /// Positions, rad (m).
    pub q: Vec<Vec<f64>>,
    /// Velocities, rad/s (m/s), where recorded for all joints.
    pub qd: Option<Vec<Vec<f64>>>,
    /// Accelerations, rad/s² (m/s²), where recorded for all joints.
    pub qdd: Option<Vec<Vec<f64>>>,
    /// Torques or currents.
    pub drive: Drive,
    /// What was assumed or left out, one sentence each.
    pub notes: Vec<String>,
    /// Line of each sample in the file, from 1; empty for formats without lines.
    pub lines: Vec<u64>,
}

impl Log {
    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.time.len()
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.q.len()
    }

    /// The samples of a range.
    ///
    /// # Panics
    /// If the range is not within the samples.
    #[must_use]
    #[track_caller]
    pub fn slice(&self, samples: std::ops::Range<usize>) -> Self {
        let cut = |x: &[Vec<f64>]| -> Vec<Vec<f64>> {
            x.iter().map(|c| c[samples.clone()].to_vec()).collect()
        };
        let lines = self.lines.get(samples.clone());
        Self {
            file: self.file.clone(),
            joints: self.joints.clone(),
            time_unit_declared: self.time_unit_declared,
            time: self.time[samples.clone()].to_vec(),
            q: cut(&self.q),
            qd: self.qd.as_deref().map(cut),
            qdd: self.qdd.as_deref().map(cut),
            drive: match &self.drive {
                Drive::Torque(x) => Drive::Torque(cut(x)),
                Drive::Current(x) => Drive::Current(cut(x)),
            },
            notes: self.notes.clone(),
            lines: lines.map(<[u64]>::to_vec).unwrap_or_default(),
        }
    }

    /// Where a sample stands.
    pub fn place(&self, sample: usize) -> Place {
        let place = Place::file(&self.file);
        match self.lines.get(sample) {
            Some(&line) => place.line(line),
            None => place.time(self.time[sample]),
        }
    }
}

/// Fewest samples that make a log.
const FEWEST_SAMPLES: usize = 10;
/// Largest value of any quantity but time, SI: no arm reaches a million of anything.
const LARGEST: f64 = 1e6;
/// Smallest value but zero: what is below is a number read from the wrong bytes.
const SMALLEST: f64 = 1e-300;

/// Why a number cannot be a measurement: the rule's name and text; `None` where it can.
///
/// `number` as written, `value` in SI units.
pub(crate) fn objection(
    quantity: Quantity,
    number: f64,
    value: f64,
) -> Option<(&'static str, &'static str)> {
    if !number.is_finite() {
        return Some((
            "not-finite",
            "every sample needs a finite number, and a value is never made up; leave such rows out with --drop-bad, or cut the log where it is whole",
        ));
    }
    let absurd = quantity != Quantity::Time && value.abs() > LARGEST;
    (absurd || (number != 0.0 && number.abs() < SMALLEST)).then_some((
        "not-plausible",
        "no joint has such a value (between 1e-300 and 1e6 in SI units); the file is damaged or the unit is wrong",
    ))
}

/// The needed columns of a recording, in the order of [`Layout::sources`], checked and in SI units.
pub(crate) struct Parts {
    pub(crate) layout: Layout,
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) lines: Vec<u64>,
    pub(crate) format: String,
    pub(crate) repeated: usize,
    pub(crate) bad: BadRows,
}

pub(crate) fn assemble(
    file: &str,
    joints: &[JointLabel],
    mapping: &ColumnMapping,
    parts: Parts,
) -> Result<Log, Error> {
    let n_samples = parts.columns.first().map_or(0, Vec::len);
    if n_samples < FEWEST_SAMPLES {
        return Err(Error::log(
            "too-few-samples",
            Place::file(file),
            format!("{n_samples} samples"),
            format!("a log needs at least {FEWEST_SAMPLES}; record a longer motion"),
        ));
    }
    let layout = parts.layout;
    let mut notes = vec![parts.format];
    notes.extend(layout.notes);
    notes.extend(parts.bad.stated(n_samples)?);
    if parts.repeated > 0 {
        notes.push(format!("{} repeated samples left out", parts.repeated));
    }
    let mut columns = parts.columns.into_iter();
    let time = match layout.time {
        Some(_) => columns.next().unwrap_or_default(),
        None => clock_of_rate(
            n_samples,
            &parts.bad.before,
            mapping.sample_rate,
            &mut notes,
        )?,
    };
    let n = layout.position.len();
    let mut take = || columns.by_ref().take(n).collect::<Vec<_>>();
    let q = take();
    let qd = layout.velocity.is_some().then(&mut take);
    let qdd = layout.acceleration.is_some().then(&mut take);
    let drive = match layout.drive.0 {
        Quantity::Current => Drive::Current(take()),
        _ => Drive::Torque(take()),
    };
    let free = joints.iter().filter(|j| !j.held);
    let log = Log {
        file: file.to_string(),
        joints: free.map(|j| j.name.clone()).collect(),
        time_unit_declared: layout.time.is_none_or(|s| s.declared),
        time,
        q,
        qd,
        qdd,
        drive,
        notes,
        lines: parts.lines,
    };
    Ok(log.with_gaps_before(&parts.bad.before))
}

fn clock_of_rate(
    n_samples: usize,
    bad_before: &[usize],
    sample_rate: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<Vec<f64>, Error> {
    let rate = sample_rate.unwrap_or(f64::NAN);
    if !(rate > 0.0 && rate.is_finite()) {
        let rule = "samples a second must be a number above zero";
        return Err(Error::setting("sample rate", rate, rule));
    }
    notes.push(format!(
        "no time column: {rate} samples a second, as stated"
    ));
    // The clock runs on through rows that are left out.
    let mut bad = bad_before.iter().peekable();
    let mut passed = 0;
    Ok((0..n_samples)
        .map(|k| {
            while bad.next_if(|b| **b <= k).is_some() {
                passed += 1;
            }
            (k + passed) as f64 / rate
        })
        .collect())
}
