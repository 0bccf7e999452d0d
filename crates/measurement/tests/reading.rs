//! What the reader understands without being told, and what it says it assumed.
#![allow(clippy::unwrap_used)]

mod common;

use common::{good, labels, read, robot, table, two};
use idim_measurement::{
    ColumnMapping, Drive, MappedColumn, Measurements, Quantity, check_log, joint_labels, read_csv,
};

#[test]
fn units_in_headers_are_converted() {
    let header = "t_ms,q1_deg,q_elbow_mrad,qd1_rpm,qd_elbow [deg/s],tau1_mNm,tau_elbow_Nm";
    let log = read(&table(header, 20, |k| {
        vec![10.0 * k as f64, 90.0, 500.0, 60.0, 180.0, 250.0, 3.0]
    }))
    .unwrap();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-14, "{a} is not {b}");
    let turn = std::f64::consts::TAU;
    near(log.time[1], 0.01);
    near(log.q[0][3], turn / 4.0);
    near(log.q[1][3], 0.5);
    let qd = log.qd.unwrap();
    near(qd[0][3], turn);
    near(qd[1][3], turn / 2.0);
    let Drive::Torque(tau) = log.drive else {
        panic!("torque is recorded")
    };
    near(tau[0][3], 0.25);
    near(tau[1][3], 3.0);
    assert!(
        log.notes.iter().all(|n| !n.contains("SI assumed")),
        "{:?}",
        log.notes
    );
}

#[test]
fn assumptions_are_stated() {
    let text = good(20).replace("qd2", "mode");
    let log = read(&text).unwrap();
    assert!(log.qd.is_none());
    let notes = log.notes.join("\n");
    for part in [
        "columns separated by comma, decimal point",
        "no unit declared, SI assumed: t in s, q in rad, tau in N·m",
        "no column for qd of joint 2 (elbow)",
        "columns left out: qd1, mode",
    ] {
        assert!(notes.contains(part), "`{part}` is missing in: {notes}");
    }
}

#[test]
fn dialects_hold_the_same_numbers() {
    let plain = read(&good(40)).unwrap();
    let text = good(40);
    let cases = [
        ("semicolons", text.replace(',', ";")),
        ("tabs", text.replace(',', "\t")),
        ("spaces", text.replace(',', "   ")),
        ("decimal comma", text.replace(',', ";").replace('.', ",")),
        (
            "decimal comma and tabs",
            text.replace(',', "\t").replace('.', ","),
        ),
        ("Windows lines", text.replace('\n', "\r\n")),
        ("byte order mark", format!("\u{feff}{text}")),
        (
            "comments",
            format!("# made by a robot\n\n{text}# the end\n"),
        ),
        ("header as a comment", format!("# {text}")),
        ("quotes", quoted(&text)),
        ("blank end", format!("{text}\n\n")),
        (
            "a spreadsheet's hint",
            format!("sep=;\n{}", text.replace(',', ";")),
        ),
    ];
    let mut files: Vec<(&str, Vec<u8>)> = cases
        .into_iter()
        .map(|(name, text)| (name, text.into_bytes()))
        .collect();
    let units = || text.encode_utf16();
    let little = [0xff, 0xfe].into_iter();
    let little = little.chain(units().flat_map(u16::to_le_bytes)).collect();
    let big = [0xfe, 0xff].into_iter();
    let big = big.chain(units().flat_map(u16::to_be_bytes)).collect();
    files.extend([("UTF-16", little), ("UTF-16, big end first", big)]);
    for (name, bytes) in files {
        let log = common::read_bytes(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(
            (&log.time, &log.q, &log.qd),
            (&plain.time, &plain.q, &plain.qd),
            "{name}"
        );
    }
}

fn quoted(text: &str) -> String {
    let lines = text
        .lines()
        .map(|l| format!("\"{}\"\n", l.replace(',', "\",\"")));
    lines.collect()
}

#[test]
fn lines_keep_their_numbers_past_comments() {
    let text = format!("# one\n# two\n{}", good(20));
    let log = read(&text).unwrap();
    assert_eq!((log.lines[0], log.lines[19]), (4, 23));
    assert_eq!(log.place(3).to_string(), "run.csv, line 7");
}

#[test]
fn repeated_lines_are_left_out_and_counted() {
    let text = good(20);
    let repeated: Vec<&str> = text.lines().flat_map(|l| [l, l]).skip(1).collect();
    let log = read(&repeated.join("\n")).unwrap();
    assert_eq!(log.n_samples(), 20);
    assert!(
        log.notes
            .iter()
            .any(|n| n == "20 repeated samples left out")
    );
}

#[test]
fn a_mapping_names_foreign_columns() {
    let header = "stamp_ns,actual_q_0,actual_q_1,effort_0,effort_1";
    let text = table(header, 20, |k| vec![1e6 * k as f64, 45.0, 0.1, 7.0, 8.0]);
    let column = |header: &str, quantity, joint: Option<&str>, unit: Option<&str>| MappedColumn {
        header: header.into(),
        quantity,
        joint: joint.map(str::to_string),
        unit: unit.map(str::to_string),
        factor: None,
    };
    let mapping = ColumnMapping {
        columns: vec![
            column("stamp_ns", Quantity::Time, None, Some("ns")),
            column("actual_q_0", Quantity::Position, Some("1"), Some("deg")),
            column("actual_q_1", Quantity::Position, Some("elbow"), None),
            column("effort_0", Quantity::Torque, Some("shoulder"), None),
            column("effort_1", Quantity::Torque, Some("2"), None),
        ],
        ..ColumnMapping::default()
    };
    let log = read_csv(text.as_bytes(), "run.csv", &labels(&two()), &mapping).unwrap();
    assert!((log.time[2] - 2e-3).abs() < 1e-15);
    assert_eq!(log.q[0][0], 45f64.to_radians());
    assert_eq!(log.q[1][0], 0.1);
    assert_eq!(log.drive, Drive::Torque(vec![vec![7.0; 20], vec![8.0; 20]]));
}

#[test]
fn a_mapping_goes_before_names() {
    let mapping = ColumnMapping {
        columns: vec![MappedColumn {
            header: "qd1".into(),
            quantity: Quantity::Position,
            joint: Some("1".into()),
            unit: None,
            factor: None,
        }],
        ..ColumnMapping::default()
    };
    let log = read_csv(good(20).as_bytes(), "run.csv", &labels(&two()), &mapping).unwrap();
    assert_eq!(log.q[0][0], 1.0);
}

#[test]
fn a_log_without_clock_takes_the_stated_rate() {
    let text = table("q1,q2,tau1,tau2", 20, |_| vec![0.0; 4]);
    let mapping = ColumnMapping {
        sample_rate: Some(5000.0),
        ..ColumnMapping::default()
    };
    let log = read_csv(text.as_bytes(), "run.csv", &labels(&two()), &mapping).unwrap();
    assert_eq!(log.time[10], 0.002);
    check_log(&log, &two()).unwrap();
}

#[test]
fn held_joints_keep_or_lose_their_numbers() {
    let described = robot(&["torso", "shoulder", "elbow"]);
    let arm = described.lock(0, 0.3);
    let labels = joint_labels(&arm, &described);
    let own = table("t,q1,q2,q3,tau1,tau2,tau3", 20, |k| {
        vec![0.01 * k as f64, 1.0, 2.0, 3.0, 10.0, 20.0, 30.0]
    });
    let log = read_csv(
        own.as_bytes(),
        "run.csv",
        &labels,
        &ColumnMapping::default(),
    )
    .unwrap();
    assert_eq!((log.q[0][0], log.q[1][0]), (2.0, 3.0));
    let renumbered = table("t,q1,q2,tau1,tau2", 20, |k| {
        vec![0.01 * k as f64, 2.0, 3.0, 20.0, 30.0]
    });
    let log = read_csv(
        renumbered.as_bytes(),
        "run.csv",
        &labels,
        &ColumnMapping::default(),
    );
    let log = log.unwrap();
    assert_eq!((log.q[0][0], log.q[1][0]), (2.0, 3.0));
    assert!(
        log.notes
            .iter()
            .any(|n| n.contains("joints that are not held"))
    );
    assert_eq!(log.joints, ["shoulder", "elbow"]);
}

#[test]
fn joint_names_that_begin_alike_are_told_apart() {
    let arm = robot(&["arm", "arm_1", "arm_10"]);
    let header = "t,q_arm,q_arm_1,q_arm_10,tau_arm,tau_arm_1,tau_arm_10_Nm";
    let text = table(header, 20, |k| {
        vec![0.01 * k as f64, 1., 2., 3., 10., 20., 30.]
    });
    let log = read_csv(
        text.as_bytes(),
        "run.csv",
        &labels(&arm),
        &ColumnMapping::default(),
    );
    let log = log.unwrap();
    assert_eq!([log.q[0][0], log.q[1][0], log.q[2][0]], [1.0, 2.0, 3.0]);
}

#[test]
fn torque_is_gear_ratio_times_constant_times_current() {
    let mut joints = two().joints().to_vec();
    for (joint, (ratio, constant)) in joints.iter_mut().zip([(-100.0, 0.05), (50.0, 0.2)]) {
        joint.actuator.gear_ratio = Some(ratio);
        joint.actuator.torque_constant = Some(constant);
    }
    let gravity = two().gravity();
    let arm = idim_model::Robot::new("arm", gravity, joints, two().links().to_vec()).unwrap();
    let text = good(20).replace("tau1,tau2", "current1_A,current2_mA");
    let log = read(&text).unwrap();
    let measured = Measurements::from_log(&log, &arm).unwrap();
    let t = 0.01 * 7.0;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    near(measured.torque[0][7], -5.0 * 5.0 * f64::sin(t));
    near(measured.torque[1][7], 10.0 * 1e-3 * t);
}

#[test]
fn oracle_the_recorded_ur10_log_reads_without_a_mapping() {
    let Some(path) = idim_fixtures::shared_dir().map(|d| d.join("data/ur10/exciting.csv")) else {
        eprintln!("skipped: the recorded UR10 log is not here (set IDIM_DATA)");
        return;
    };
    let Ok(bytes) = std::fs::read(&path) else {
        eprintln!("skipped: no {}", path.display());
        return;
    };
    let arm = robot(&["pan", "lift", "elbow", "wrist1", "wrist2", "wrist3"]);
    let log = read_csv(
        &bytes,
        "exciting.csv",
        &labels(&arm),
        &ColumnMapping::default(),
    )
    .unwrap();
    assert_eq!(log.n_joints(), 6);
    assert_eq!(log.q[1][0], -1.8644074);
    assert_eq!(log.qd.as_ref().unwrap()[5][0], -0.0230156124);
    let warnings = idim_measurement::check_velocity(&log, &arm).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let clock = idim_measurement::read_clock(&log.time);
    assert!(
        (clock.interval - 0.008).abs() < 1e-9 && clock.gaps.is_empty(),
        "{clock:?}"
    );
    assert!(log.n_samples() > 3000, "{}", log.n_samples());
}
