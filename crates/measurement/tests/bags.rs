//! ROS 2 bags hold the numbers that were recorded; damaged ones are refused.
#![cfg(any(feature = "rosbag2", feature = "mcap"))]
#![allow(clippy::unwrap_used)]

mod common;

use common::{assert_says, good, labels, two};
use idim_measurement::ColumnMapping;
use idim_measurement::formats::{JointState, decode_joint_state, read_log};
use std::path::Path;

/// Encodes a message as CDR, for the tests alone.
fn encode(message: &JointState, little: bool) -> Vec<u8> {
    let mut body: Vec<u8> = Vec::new();
    let u32_bytes = |v: u32| {
        if little {
            v.to_le_bytes()
        } else {
            v.to_be_bytes()
        }
    };
    let f64_bytes = |v: f64| {
        if little {
            v.to_le_bytes()
        } else {
            v.to_be_bytes()
        }
    };
    let pad = |body: &mut Vec<u8>, size: usize| body.resize(body.len().next_multiple_of(size), 0);
    let string = |body: &mut Vec<u8>, text: &str| {
        pad(body, 4);
        body.extend(u32_bytes(text.len() as u32 + 1));
        body.extend(text.bytes());
        body.push(0);
    };
    body.extend(u32_bytes((message.stamp / 1_000_000_000) as u32));
    body.extend(u32_bytes((message.stamp % 1_000_000_000) as u32));
    string(&mut body, "base");
    pad(&mut body, 4);
    body.extend(u32_bytes(message.name.len() as u32));
    for name in &message.name {
        string(&mut body, name);
    }
    for list in [&message.position, &message.velocity, &message.effort] {
        pad(&mut body, 4);
        body.extend(u32_bytes(list.len() as u32));
        if !list.is_empty() {
            pad(&mut body, 8);
        }
        for v in list {
            body.extend(f64_bytes(*v));
        }
    }
    let mut bytes = vec![0, u8::from(little), 0, 0];
    bytes.extend(body);
    bytes
}

fn message(k: i64) -> JointState {
    let t = 0.01 * k as f64;
    JointState {
        stamp: 1_700_000_000_500_000_000 + 10_000_000 * k,
        name: vec!["finger".into(), "elbow".into(), "shoulder".into()],
        position: vec![0.0, (2.0 * t).cos(), t.sin()],
        velocity: vec![0.0, -2.0 * (2.0 * t).sin(), t.cos()],
        effort: vec![0.0, t, 5.0 * t.sin()],
    }
}

/// The messages as another publisher might order them.
fn shuffled(k: i64) -> JointState {
    let mut m = message(k);
    if k % 2 == 1 {
        m.name.swap(0, 2);
        for list in [&mut m.position, &mut m.velocity, &mut m.effort] {
            list.swap(0, 2);
        }
    }
    m
}

#[test]
fn identity_messages_survive_encoding() {
    for little in [true, false] {
        let bytes = encode(&message(7), little);
        assert_eq!(decode_joint_state(&bytes).unwrap(), message(7));
        let mut empty = message(3);
        empty.velocity.clear();
        assert_eq!(decode_joint_state(&encode(&empty, little)).unwrap(), empty);
    }
}

#[test]
fn damaged_messages_are_refused_at_their_byte() {
    let bytes = encode(&message(7), true);
    for end in 0..bytes.len() {
        assert!(decode_joint_state(&bytes[..end]).is_err(), "cut at {end}");
    }
    let mut greedy = bytes.clone();
    greedy[24..28].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = decode_joint_state(&greedy).unwrap_err();
    assert!(error.contains("4294967295"), "{error}");
    let mut odd = bytes;
    odd[1] = 7;
    assert!(
        decode_joint_state(&odd)
            .unwrap_err()
            .contains("no plain CDR header")
    );
}

/// What `common::good` holds, by name.
#[track_caller]
fn assert_good(log: &idim_measurement::Log) {
    let csv = common::read(&good(20)).unwrap();
    assert_eq!((&log.q, &log.qd, &log.drive), (&csv.q, &csv.qd, &csv.drive));
    for (a, b) in log.time.iter().zip(&csv.time) {
        assert!((a - 0.5 - b).abs() < 1e-12, "{a} against {b}");
    }
    let notes = log.notes.join("\n");
    for part in [
        "topic /joint_states",
        "header stamps, less 1700000000 s",
        "q_finger",
    ] {
        assert!(notes.contains(part), "`{part}` is missing in: {notes}");
    }
}

#[cfg(feature = "rosbag2")]
mod rosbag2 {
    use super::*;
    use rusqlite::{Connection, params};

    fn bag(path: &Path, topics: &[(&str, &str)], message: fn(i64) -> JointState) {
        let bag = Connection::open(path).unwrap();
        bag.execute_batch(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);",
        )
        .unwrap();
        for (id, (name, kind)) in (1i64..).zip(topics) {
            bag.execute(
                "INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr')",
                params![id, name, kind],
            )
            .unwrap();
            for k in 0..20 {
                let data = if *kind == KIND {
                    encode(&message(k), true)
                } else {
                    vec![9]
                };
                bag.execute(
                    "INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)",
                    params![id, 1000 * k, data],
                )
                .unwrap();
            }
        }
    }

    const KIND: &str = "sensor_msgs/msg/JointState";

    #[test]
    fn identity_a_bag_holds_what_was_recorded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run_0.db3");
        bag(
            &path,
            &[("/tf", "tf2_msgs/msg/TFMessage"), ("/joint_states", KIND)],
            shuffled,
        );
        let before = std::fs::read(&path).unwrap();
        let mapping = ColumnMapping::default();
        assert_good(&read_log(&path, &labels(&two()), &mapping).unwrap());
        assert_good(&read_log(folder.path(), &labels(&two()), &mapping).unwrap());
        assert_eq!(std::fs::read(&path).unwrap(), before);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn bags_that_say_nothing_or_too_much_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let read = |name: &str, topics: &[(&str, &str)]| {
            let path = folder.path().join(name);
            bag(&path, topics, message);
            read_log(&path, &labels(&two()), &ColumnMapping::default())
        };
        let none = read("a.db3", &[("/tf", "tf2_msgs/msg/TFMessage")]);
        assert_says(
            none,
            "missing-column",
            &["a.db3", "no topic of sensor_msgs"],
        );
        let both = read("b.db3", &[("/left", KIND), ("/right", KIND)]);
        assert_says(
            both,
            "missing-column",
            &["2 topics", "/left, /right", "--topic"],
        );
        let path = folder.path().join("b.db3");
        let of = |topic: &str| {
            let mapping = ColumnMapping {
                topic: Some(topic.into()),
                ..ColumnMapping::default()
            };
            read_log(&path, &labels(&two()), &mapping)
        };
        let right = of("/right").unwrap();
        assert!(right.notes.join("\n").contains("topic /right"));
        assert_eq!(right.n_samples(), 20);
        assert_says(of("/up"), "missing-column", &["/up", "/left, /right"]);
        let path = folder.path().join("c.db3");
        std::fs::write(&path, b"SQLite format 3\0 but no more").unwrap();
        let cut = read_log(&path, &labels(&two()), &ColumnMapping::default());
        assert_says(cut, "damaged", &["c.db3", "damaged or cut off"]);
        let gone = folder.path().join("d.db3");
        let gone = read_log(&gone, &labels(&two()), &ColumnMapping::default());
        assert_says(gone, "unreadable", &["d.db3"]);
    }

    #[test]
    fn oracle_the_recorded_ur10_bag_holds_the_numbers_of_its_csv() {
        let Some(dir) = idim_fixtures::shared_dir().map(|d| d.join("data/ur10")) else {
            eprintln!("skipped: the recorded UR10 log is not here (set IDIM_DATA)");
            return;
        };
        let names = [
            "shoulder_pan_joint",
            "shoulder_lift_joint",
            "elbow_joint",
            "wrist_1_joint",
            "wrist_2_joint",
            "wrist_3_joint",
        ];
        let arm = common::robot(&names);
        let mapping = ColumnMapping::default();
        let read = |file: &str| read_log(&dir.join(file), &labels(&arm), &mapping).unwrap();
        let (bag, csv) = (read("exciting_rosbag2.db3"), read("exciting.csv"));
        assert_eq!(bag.n_samples(), csv.n_samples());
        // The CSV keeps nine significant digits.
        let near = |a: &[f64], b: &[f64]| {
            for (a, b) in a.iter().zip(b) {
                assert!((a - b).abs() <= 1e-8 * (1.0 + b.abs()), "{a} against {b}");
            }
        };
        near(&bag.time, &csv.time);
        let (idim_measurement::Drive::Torque(a), idim_measurement::Drive::Torque(b)) =
            (&bag.drive, &csv.drive)
        else {
            panic!("both record torque")
        };
        for j in 0..6 {
            near(&bag.q[j], &csv.q[j]);
            near(&bag.qd.as_ref().unwrap()[j], &csv.qd.as_ref().unwrap()[j]);
            near(&a[j], &b[j]);
        }
    }
}

#[cfg(feature = "mcap")]
mod mcap_files {
    use super::*;
    use std::collections::BTreeMap;

    fn file(message: fn(i64) -> JointState) -> Vec<u8> {
        file_of(message, false)
    }

    fn file_of(message: fn(i64) -> JointState, two_topics: bool) -> Vec<u8> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut writer = mcap::Writer::new(&mut bytes).unwrap();
        let schema = writer
            .add_schema("sensor_msgs/msg/JointState", "ros2msg", b"")
            .unwrap();
        let channel = writer
            .add_channel(schema, "/joint_states", "cdr", &BTreeMap::new())
            .unwrap();
        let other = writer
            .add_channel(0, "/log", "json", &BTreeMap::new())
            .unwrap();
        let second = two_topics.then(|| {
            let no_more = BTreeMap::new();
            writer
                .add_channel(schema, "/gripper", "cdr", &no_more)
                .unwrap()
        });
        for k in 0..20 {
            let of_gripper = JointState {
                name: vec!["finger".into()],
                position: vec![0.0],
                ..message(k)
            };
            let both = [
                Some((other, b"{}".to_vec())),
                second.map(|id| (id, encode(&of_gripper, true))),
                Some((channel, encode(&message(k), true))),
            ];
            for (channel_id, data) in both.into_iter().flatten() {
                let header = mcap::records::MessageHeader {
                    channel_id,
                    sequence: k as u32,
                    log_time: 1000 * k as u64,
                    publish_time: 0,
                };
                writer.write_to_known_channel(&header, &data).unwrap();
            }
        }
        writer.finish().unwrap();
        drop(writer);
        bytes.into_inner()
    }

    #[test]
    fn identity_an_mcap_file_holds_what_was_recorded() {
        let bytes = file(shuffled);
        let mapping = ColumnMapping::default();
        let read = |bytes: &[u8]| {
            idim_measurement::formats::read_mcap(bytes, "run.mcap", &labels(&two()), &mapping)
        };
        assert_good(&read(&bytes).unwrap());
        assert_says(
            read(&bytes[..bytes.len() / 2]),
            "damaged",
            &["run.mcap", "damaged or cut off"],
        );
        assert_says(read(b"not mcap"), "damaged", &["run.mcap"]);
    }

    #[test]
    fn identity_one_of_two_topics_is_read_by_its_name() {
        let bytes = file_of(shuffled, true);
        let read = |topic: Option<&str>| {
            let mapping = ColumnMapping {
                topic: topic.map(str::to_owned),
                ..ColumnMapping::default()
            };
            idim_measurement::formats::read_mcap(&bytes, "run.mcap", &labels(&two()), &mapping)
        };
        assert_good(&read(Some("/joint_states")).unwrap());
        let words = ["2 topics", "/gripper, /joint_states", "--topic"];
        assert_says(read(None), "missing-column", &words);
        assert_says(
            read(Some("/joints")),
            "missing-column",
            &["/joints", words[0]],
        );
    }

    #[test]
    fn a_message_that_lacks_a_joint_is_refused() {
        let bytes = file(|k| {
            let mut m = message(k);
            if k == 5 {
                m.name[1] = "other".into();
            }
            m
        });
        let mapping = ColumnMapping::default();
        let result =
            idim_measurement::formats::read_mcap(&bytes, "run.mcap", &labels(&two()), &mapping);
        assert_says(result, "field-count", &["joint elbow", "message 6"]);
    }
}
