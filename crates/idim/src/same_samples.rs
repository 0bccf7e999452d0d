//! Logs that hold the same samples under other names: another path, a copy, another format.

use crate::error::Error;
use crate::log_spec::LogSpec;
use idim_measurement::{Drive, Log, Measurements};
use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Samples in common from which two logs are one recording: noise and a moving arm repeat no sample to seven digits.
const IN_COMMON: usize = 50;

/// A log's name and what tells its samples from others'.
pub(crate) struct Prints<'a> {
    name: &'a str,
    samples: HashSet<u64>,
}

impl<'a> Prints<'a> {
    /// Of joint positions and torques, of the samples that the arm has moved for.
    fn new(name: &'a str, q: &[Vec<f64>], torque: &[Vec<f64>]) -> Self {
        let n = q.first().map_or(0, Vec::len);
        let moved = |k: &usize| q.iter().any(|q| q[*k] != q[k - 1]);
        let print = |k: usize| {
            let mut hasher = DefaultHasher::new();
            for channel in q.iter().chain(torque) {
                // A copy in another format or unit may differ in the last digits.
                (channel[k] as f32).to_bits().hash(&mut hasher);
            }
            hasher.finish()
        };
        Self {
            name,
            samples: (1..n).filter(moved).map(print).collect(),
        }
    }

    /// Of a log as it was read.
    pub(crate) fn of_log(name: &'a str, log: &Log) -> Self {
        let (Drive::Torque(drive) | Drive::Current(drive)) = &log.drive;
        Self::new(name, &log.q, drive)
    }

    /// Of measurements.
    pub(crate) fn of_measurements(name: &'a str, m: &Measurements) -> Self {
        Self::new(name, &m.q, &m.torque)
    }

    /// Samples in both, if there are as many as only one recording has.
    fn shared(&self, other: &Self) -> Option<usize> {
        let shared = self.samples.intersection(&other.samples).count();
        (shared >= IN_COMMON).then_some(shared)
    }
}

/// What must not be given twice, and what to do instead.
const COUNTED_TWICE: &str = "samples counted twice make every interval too narrow; give each log once, or ranges of it that do not overlap (FILE@A..B)";

/// Refuses logs of one option that share samples.
///
/// # Errors
/// The later of two such logs.
pub(crate) fn refuse_repeated(logs: &[Prints<'_>]) -> Result<(), Error> {
    for (k, log) in logs.iter().enumerate() {
        for before in &logs[..k] {
            if let Some(shared) = before.shared(log) {
                return Err(refusal(log.name, shared, before.name, "", COUNTED_TWICE));
            }
        }
    }
    Ok(())
}

/// Refuses a log of one option that shares samples with one of another, `option`; `rule` says why and what to do.
///
/// # Errors
/// The log of `logs`.
pub(crate) fn refuse_shared(
    logs: &[Prints<'_>],
    others: &[Prints<'_>],
    option: &str,
    rule: &str,
) -> Result<(), Error> {
    for log in logs {
        for other in others {
            if let Some(shared) = other.shared(log) {
                return Err(refusal(log.name, shared, other.name, option, rule));
            }
        }
    }
    Ok(())
}

fn refusal(name: &str, shared: usize, other: &str, option: &str, rule: &str) -> Error {
    let space = if option.is_empty() { "" } else { " " };
    let met = format!("holds {shared} samples that{space}{option} {other} holds too");
    Error::input(name, met, rule)
}

/// Refuses a log that is named under two options by the same file and overlapping ranges, before it is read.
///
/// # Errors
/// The log of `logs`.
pub(crate) fn refuse_same_files(
    logs: &[LogSpec],
    others: &[LogSpec],
    options: &str,
    rule: &str,
) -> Result<(), Error> {
    let twice = logs.iter().find(|l| others.iter().any(|o| o.overlaps(l)));
    twice.map_or(Ok(()), |l| {
        Err(Error::input(
            l.name(),
            format!("given both as {options}"),
            rule,
        ))
    })
}

/// Why a model is not proved on what it was made from.
pub(crate) const PROVED_ON_ITSELF: &str = "a model is proved on motions it has not seen; give another file, or another range of samples (FILE@A..B)";
/// Why runs with a load cannot be those without.
pub(crate) const LOADED_ALREADY: &str =
    "the load is what runs with it and without it differ in; give a recording of each";
