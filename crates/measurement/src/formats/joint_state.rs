//! `sensor_msgs/msg/JointState` in CDR, and a log from a sequence of them.

use crate::columns::{NamedColumn, log_from_columns};
use crate::error::{Error, Place, printable};
use crate::header::JointLabel;
use crate::log::Log;
use crate::mapping::ColumnMapping;

/// One message.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointState {
    /// Stamp of the header, ns.
    pub stamp: i64,
    /// Names of the joints.
    pub name: Vec<String>,
    /// Positions, rad (m).
    pub position: Vec<f64>,
    /// Velocities, rad/s (m/s); may be empty.
    pub velocity: Vec<f64>,
    /// Torques, N·m (N); may be empty.
    pub effort: Vec<f64>,
}

/// Reads a message in CDR (XCDR1, either byte order).
///
/// # Errors
/// What is wrong and at which byte; no length is trusted beyond the bytes that are there.
pub fn decode_joint_state(bytes: &[u8]) -> Result<JointState, String> {
    let little = match bytes.get(..4) {
        Some([0, 1, ..]) => true,
        Some([0, 0, ..]) => false,
        _ => return Err("no plain CDR header in bytes 0 to 4".into()),
    };
    let mut reader = Reader {
        bytes: &bytes[4..],
        at: 0,
        little,
    };
    let seconds = reader.u32()?.cast_signed();
    let nanoseconds = reader.u32()?;
    reader.string()?;
    let n_names = reader.count(4)?;
    let name = (0..n_names)
        .map(|_| reader.string())
        .collect::<Result<_, _>>()?;
    Ok(JointState {
        stamp: i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds),
        name,
        position: reader.numbers()?,
        velocity: reader.numbers()?,
        effort: reader.numbers()?,
    })
}

/// Reads CDR; offsets count from after the header, and numbers are aligned to their size.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let at = self.at.next_multiple_of(N);
        let taken = self
            .bytes
            .get(at..at + N)
            .and_then(|b| b.first_chunk::<N>());
        let taken = taken.ok_or_else(|| {
            format!(
                "the message ends at byte {}, in the middle of a number",
                self.bytes.len() + 4
            )
        })?;
        self.at = at + N;
        Ok(*taken)
    }

    fn u32(&mut self) -> Result<u32, String> {
        let bytes = self.take()?;
        Ok(if self.little {
            u32::from_le_bytes(bytes)
        } else {
            u32::from_be_bytes(bytes)
        })
    }

    /// A length, checked against what the remaining bytes can hold at `size` each.
    fn count(&mut self, size: usize) -> Result<usize, String> {
        let at = self.at + 4;
        let count = self.u32()? as usize;
        let room = (self.bytes.len() - self.at) / size;
        if count > room {
            return Err(format!(
                "a length of {count} at byte {at}, where {room} fit"
            ));
        }
        Ok(count)
    }

    fn string(&mut self) -> Result<String, String> {
        let length = self.count(1)?;
        let text = &self.bytes[self.at..self.at + length];
        self.at += length;
        let text = text.strip_suffix(&[0]).unwrap_or(text);
        String::from_utf8(text.to_vec())
            .map_err(|_| format!("a name that is not UTF-8 before byte {}", self.at + 4))
    }

    fn numbers(&mut self) -> Result<Vec<f64>, String> {
        let count = self.count(8)?;
        (0..count)
            .map(|_| {
                let bytes = self.take()?;
                Ok(if self.little {
                    f64::from_le_bytes(bytes)
                } else {
                    f64::from_be_bytes(bytes)
                })
            })
            .collect()
    }
}

/// Collects messages into columns `q_NAME`, `qd_NAME`, `tau_NAME`; joints are matched by name in every message.
#[derive(Default)]
pub(crate) struct Collector {
    names: Vec<String>,
    stamps: Vec<i64>,
    received: Vec<i64>,
    /// Positions, velocities, efforts; each joint by joint.
    values: [Vec<Vec<f64>>; 3],
    complete: [bool; 3],
}

impl Collector {
    /// Adds a message received at `received` (ns); `file` and its number for errors.
    pub(crate) fn push(
        &mut self,
        message: &JointState,
        received: i64,
        file: &str,
    ) -> Result<(), Error> {
        let number = self.stamps.len() + 1;
        let place = || Place::file(file).time(received as f64 * 1e-9);
        let first = self.names.is_empty();
        if first {
            self.names.clone_from(&message.name);
            self.complete = [true; 3];
            for values in &mut self.values {
                *values = vec![Vec::new(); self.names.len()];
            }
        }
        let lists = [&message.position, &message.velocity, &message.effort];
        for (list, (values, complete)) in lists
            .into_iter()
            .zip(self.values.iter_mut().zip(&mut self.complete))
        {
            *complete &= list.len() == message.name.len();
            if !*complete {
                continue;
            }
            for (joint, name) in self.names.iter().enumerate() {
                let at = message.name.iter().position(|n| n == name).ok_or_else(|| {
                    Error::log(
                        "field-count",
                        place().joint(name),
                        format!("message {number} does not name this joint"),
                        "every message of a topic names the same joints; record one publisher, or convert to CSV",
                    )
                })?;
                values[joint].push(list[at]);
            }
        }
        self.stamps.push(message.stamp);
        self.received.push(received);
        Ok(())
    }

    pub(crate) fn finish(
        self,
        file: &str,
        topic: &str,
        joints: &[JointLabel],
        mapping: &ColumnMapping,
    ) -> Result<Log, Error> {
        let stamped = self.stamps.iter().any(|s| *s != 0);
        let clock = if stamped {
            &self.stamps
        } else {
            &self.received
        };
        // Seconds of an epoch leave 0.2 µs in a double; whole seconds of the first stamp are taken off.
        let origin = clock
            .first()
            .map_or(0, |s| s.div_euclid(1_000_000_000) * 1_000_000_000);
        let time = clock.iter().map(|s| (s - origin) as f64 * 1e-9).collect();
        let mut columns = vec![NamedColumn {
            name: "t_s".into(),
            values: Some(time),
        }];
        let symbols = ["q", "qd", "tau"];
        for ((symbol, values), complete) in symbols.into_iter().zip(self.values).zip(self.complete)
        {
            for (name, values) in self.names.iter().zip(values) {
                if complete {
                    columns.push(NamedColumn {
                        name: format!("{symbol}_{name}"),
                        values: Some(values),
                    });
                }
            }
        }
        let source = if stamped {
            "header stamps"
        } else {
            "times of reception"
        };
        let format = format!(
            "JointState messages of topic {}, clock from {source}, less {} s, effort taken as joint torque",
            printable(topic),
            origin / 1_000_000_000
        );
        log_from_columns(file, format, &columns, joints, mapping)
    }
}

/// The topic of JointState messages that is wanted, or the only one; an error lists what is there.
pub(crate) fn one_topic<T: Clone>(
    topics: &[(String, T)],
    wanted: Option<&str>,
    file: &str,
) -> Result<(String, T), Error> {
    let found = match (wanted, topics) {
        (Some(name), _) => topics.iter().find(|t| t.0 == name),
        (None, [one]) => Some(one),
        _ => None,
    };
    if let Some(found) = found {
        return Ok(found.clone());
    }
    let names: Vec<&str> = topics.iter().map(|t| t.0.as_str()).collect();
    let there = crate::header::list(
        &format!("{} topics of sensor_msgs/msg/JointState:", names.len()),
        &names,
        "no topic of sensor_msgs/msg/JointState",
    );
    let (met, rule) = match wanted {
        Some(name) => (
            format!("no such topic as {}; {there}", printable(name)),
            "give the one of the arm, as it is written in the bag",
        ),
        None if names.is_empty() => (there, "record the joint states of the arm"),
        None => (
            there,
            "say which is the arm's with --topic NAME, or as `topic` in the mapping",
        ),
    };
    Err(Error::log("missing-column", Place::file(file), met, rule))
}

pub(crate) fn damaged(file: &str, what: impl std::fmt::Display) -> Error {
    Error::log(
        "damaged",
        Place::file(file),
        what.to_string(),
        "the file is damaged or cut off; copy it again, or recover it with the tools of its format",
    )
}
