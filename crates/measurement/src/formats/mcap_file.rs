//! ROS 2 bags in MCAP.

use super::joint_state::{Collector, damaged, decode_joint_state, one_topic};
use crate::error::Error;
use crate::header::JointLabel;
use crate::log::Log;
use crate::mapping::ColumnMapping;
use mcap::MessageStream;

/// Reads the JointState messages of an MCAP file, in the order they were received.
///
/// # Errors
/// A damaged file, no topic of JointState or several and none named, and those of [`read_csv`](crate::read_csv).
pub fn read_mcap(
    bytes: &[u8],
    file: &str,
    joints: &[JointLabel],
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    let wanted = mapping.topic.as_deref();
    let mut topics: Vec<(String, ())> = Vec::new();
    let mut messages: Vec<(i64, Vec<u8>)> = Vec::new();
    for message in MessageStream::new(bytes).map_err(|e| damaged(file, e))? {
        let message = message.map_err(|e| damaged(file, e))?;
        let channel = &message.channel;
        let schema = channel.schema.as_ref().map_or("", |s| s.name.as_str());
        if schema != "sensor_msgs/msg/JointState" || channel.message_encoding != "cdr" {
            continue;
        }
        if topics.iter().all(|(topic, ())| *topic != channel.topic) {
            topics.push((channel.topic.clone(), ()));
        }
        if wanted.is_some_and(|w| *w != channel.topic) {
            continue;
        }
        messages.push((message.log_time.cast_signed(), message.data.into_owned()));
    }
    let (topic, ()) = one_topic(&topics, wanted, file)?;
    // Chunks of several writers may overlap.
    messages.sort_by_key(|(received, _)| *received);
    let mut collector = Collector::default();
    for (received, data) in messages {
        let message = decode_joint_state(&data)
            .map_err(|e| damaged(file, format!("message at {received} ns: {e}")))?;
        collector.push(&message, received, file)?;
    }
    collector.finish(file, &topic, joints, mapping)
}
