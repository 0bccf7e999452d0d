//! ROS 2 bags in SQLite.

use super::file_name;
use super::joint_state::{Collector, damaged, decode_joint_state, one_topic};
use crate::error::Error;
use crate::header::JointLabel;
use crate::log::Log;
use crate::mapping::ColumnMapping;
use rusqlite::{Connection, OpenFlags};
use std::path::Path;

/// Reads the JointState messages of a ROS 2 bag (`.db3`), in the order they were received. The file is not touched.
///
/// # Errors
/// A damaged file, no topic of JointState or several and none named, and those of [`read_csv`](crate::read_csv).
pub fn read_rosbag2(
    path: &Path,
    joints: &[JointLabel],
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    let file = &file_name(path);
    if !path.is_file() {
        return Err(super::unreadable(
            path,
            &std::io::ErrorKind::NotFound.into(),
        ));
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let bag = Connection::open_with_flags(path, flags).map_err(|e| damaged(file, e))?;
    let mut collector = Collector::default();
    let wanted = mapping.topic.as_deref();
    let topic = read_messages(&bag, wanted, file, &mut collector)?;
    collector.finish(file, &topic, joints, mapping)
}

fn read_messages(
    bag: &Connection,
    wanted: Option<&str>,
    file: &str,
    collector: &mut Collector,
) -> Result<String, Error> {
    let sql = |e: rusqlite::Error| damaged(file, e);
    let mut topics = bag
        .prepare("SELECT name, id FROM topics WHERE type = 'sensor_msgs/msg/JointState' AND serialization_format = 'cdr' ORDER BY id")
        .map_err(sql)?;
    let found = topics
        .query_map([], |row| {
            Ok((row.get::<_, String>(0)?, row.get::<_, i64>(1)?))
        })
        .and_then(Iterator::collect::<Result<Vec<_>, _>>)
        .map_err(sql)?;
    let (topic, id) = one_topic(&found, wanted, file)?;
    let mut messages = bag
        .prepare("SELECT timestamp, data FROM messages WHERE topic_id = ?1 ORDER BY timestamp, id")
        .map_err(sql)?;
    let mut rows = messages.query([id]).map_err(sql)?;
    while let Some(row) = rows.next().map_err(sql)? {
        let received: i64 = row.get(0).map_err(sql)?;
        let data = row.get_ref(1).map_err(sql)?;
        let data = data.as_blob().map_err(|e| damaged(file, e))?;
        let message = decode_joint_state(data)
            .map_err(|e| damaged(file, format!("message at {received} ns: {e}")))?;
        collector.push(&message, received, file)?;
    }
    Ok(topic)
}
