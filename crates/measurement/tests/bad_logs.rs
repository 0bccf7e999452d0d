//! Every way a log can be wrong is refused with its place, the value met, the rule broken and the next step.
#![allow(clippy::unwrap_used)]

mod common;

use common::{assert_says, good, labels, read, read_bytes, robot, table, two, with_cell};
use idim_measurement::{
    ColumnMapping, MappedColumn, Measurements, Quantity, check_log, check_motion, read_csv,
};
use idim_model::Robot;

fn scaled(q: f64, qd: f64) -> String {
    table("t,q1,q2,qd1,qd2,tau1,tau2", 300, |k| {
        let t = 0.01 * k as f64;
        let (a, b) = (t.sin(), (2.0 * t).cos());
        vec![t, a, q * b, t.cos(), -2.0 * qd * (2.0 * t).sin(), a, b]
    })
}

#[track_caller]
fn assert_check_says(text: &str, robot: &Robot, code: &str, parts: &[&str]) {
    let log = read_csv(
        text.as_bytes(),
        "run.csv",
        &labels(robot),
        &ColumnMapping::default(),
    );
    assert_says(check_log(&log.unwrap(), robot), code, parts);
}

#[test]
fn a_missing_column_names_what_is_there_and_what_comes_close() {
    let text = good(20).replace("tau2", "torq2");
    assert_says(
        read(&text),
        "missing-column",
        &[
            "run.csv, joint elbow: no column for tau of joint 2 (elbow) (1 of 2 joints have one)",
            "the file has t, q1, q2",
            "name it `tau2` or `tau_elbow`",
            "closest names: torq2",
            "mapping",
        ],
    );
}

#[test]
fn a_missing_time_column_is_refused() {
    let text = good(20).replacen("t,", "clock,", 1);
    assert_says(
        read(&text),
        "missing-column",
        &[
            "run.csv: no time column",
            "clock",
            "`t_ms`",
            "sample rate in the mapping",
        ],
    );
}

#[test]
fn two_columns_for_one_quantity_are_ambiguous() {
    let text = good(20).replace("qd1", "q1_deg");
    assert_says(
        read(&text),
        "ambiguous-column",
        &[
            "joint shoulder",
            "q1, q1_deg (columns 2, 4)",
            "q of joint 1 (shoulder)",
            "mapping",
        ],
    );
    let text = good(20).replace("qd1", "q1");
    assert_says(read(&text), "ambiguous-column", &["q1, q1 (columns 2, 4)"]);
}

#[test]
fn a_wrong_number_of_joints_is_refused() {
    let text = good(20).replace("qd2", "q3");
    assert_says(
        read(&text),
        "joint-count",
        &[
            "column q3",
            "joint 3",
            "the robot has 2 joints",
            "robot file this log belongs to",
        ],
    );
    let fewer = table("t,q1,tau1", 20, |k| vec![k as f64 * 0.01, 0.0, 0.0]);
    assert_says(
        read(&fewer),
        "missing-column",
        &["joint elbow", "1 of 2 joints have one", "q_elbow"],
    );
    let zero = table("t,q0,q1,tau0,tau1", 20, |k| {
        vec![k as f64 * 0.01, 0., 0., 0., 0.]
    });
    assert_says(
        read(&zero),
        "joint-count",
        &["column q0", "count joints from 1"],
    );
}

#[test]
fn an_unknown_unit_is_refused_when_its_column_is_needed() {
    let text = good(20).replace("q1,", "q1_grad,");
    assert_says(
        read(&text),
        "unit",
        &[
            "column q1_grad",
            "unit `grad`",
            "rad, mrad, deg, rev",
            "rename",
        ],
    );
    let text = good(20).replacen("t,", "t_min,", 1);
    assert_says(read(&text), "unit", &["unit `min`", "s, ms, us, ns"]);
    // Beside a column that can be read it is one of those left out.
    let text = good(20).replace("qd2", "q2_ref");
    let log = read(&text).unwrap();
    assert!(
        log.notes
            .iter()
            .any(|n| n.contains("left out") && n.contains("q2_ref"))
    );
}

#[test]
fn cells_that_are_no_finite_number_are_refused_with_line_and_column() {
    let cases = [
        ("NaN", "not-finite", "finite number"),
        ("inf", "not-finite", "finite number"),
        ("-Infinity", "not-finite", "finite number"),
        ("", "not-finite", "an empty cell"),
        ("1e400", "not-finite", "finite number"),
        ("1e-315", "not-plausible", "damaged"),
        ("1e226", "not-plausible", "damaged"),
        ("0x1f", "not-a-number", "-0.25 or 1.5e-3"),
        ("0.5rad", "not-a-number", "without units"),
        ("\u{2212}0.5", "not-a-number", "typographic minus"),
    ];
    for (cell, code, words) in cases {
        let text = with_cell(&good(20), 7, 2, cell);
        assert_says(read(&text), code, &["run.csv, line 7, column q2", words]);
    }
    // A column nobody needs may hold anything.
    let text = with_cell(&good(20).replace("qd1,qd2", "state,mode"), 7, 3, "moving");
    read(&text).unwrap();
}

#[test]
fn time_must_rise() {
    let text = with_cell(&good(20), 9, 0, "0.03");
    assert_says(
        read(&text),
        "time-order",
        &[
            "run.csv, line 9, column t",
            "time 0.03 s after 0.06 s",
            "sort the lines",
        ],
    );
    let text = with_cell(&good(20), 9, 0, "0.06");
    assert_says(
        read(&text),
        "time-order",
        &["line 9", "time 0.06 s twice", "remove one line"],
    );
    let mut text = good(20);
    text += good(20).split_once('\n').unwrap().1;
    assert_says(
        read(&text),
        "time-order",
        &["line 22", "two recordings", "split the file here"],
    );
}

#[test]
fn a_clock_in_milliseconds_is_found() {
    let text = table("t,q1,q2,tau1,tau2", 50, |k| {
        vec![4.0 * k as f64, 0.01 * k as f64, 0.0, 0.0, 0.0]
    });
    assert_check_says(
        &text,
        &two(),
        "time-unit",
        &[
            "run.csv: dt = 4 s from a clock without a unit",
            "did you mean ms",
            "`t_ms`",
        ],
    );
    let counted = text.replace("t,", "t_s,");
    let log = read(&counted).unwrap();
    check_log(&log, &two()).unwrap();
}

#[test]
fn degrees_for_radians_show_against_the_recorded_velocity() {
    assert_check_says(
        &scaled(57.295_779_5, 1.0),
        &two(),
        "degrees",
        &[
            "joint elbow",
            "q changes 57.29",
            "180/π",
            "q is in degrees; give its header the suffix `_deg`",
        ],
    );
    assert_check_says(
        &scaled(1.0, 57.295_779_5),
        &two(),
        "degrees",
        &["joint elbow", "0.0175", "qd is in degrees a second"],
    );
}

#[test]
fn signs_gears_and_units_show_against_the_recorded_velocity() {
    let cases = [
        (-1.0, 1.0, "velocity-sign", "opposite signs"),
        (100.0, 1.0, "gear-side", "q is on the motor side"),
        (1.0, 100.0, "gear-side", "qd is on the motor side"),
        (
            1.0,
            30.0 / std::f64::consts::PI,
            "velocity-unit",
            "turns a minute",
        ),
        (1.0, 1e3, "velocity-unit", "factor of 1000"),
        (1.0, -57.295_78, "degrees", "wrong sign"),
        (1.0, 0.4, "velocity-factor", "2.5"),
    ];
    for (q, qd, code, words) in cases {
        assert_check_says(&scaled(q, qd), &two(), code, &["joint elbow", words]);
    }
}

#[test]
fn degrees_without_recorded_velocity_show_against_the_limits() {
    let degrees = |amplitude: f64| {
        table("t,q1,q2,tau1,tau2", 300, |k| {
            let t = 0.01 * k as f64;
            vec![t, t.sin(), amplitude * (2.0 * t).sin(), 0.0, 0.0]
        })
    };
    assert_check_says(
        &degrees(60.0),
        &two(),
        "position-range",
        &[
            "joint elbow",
            "q from -59.9",
            "limits are -2 to 2",
            "degrees",
        ],
    );
    let warned = check_log(&read(&degrees(5.0)).unwrap(), &two()).unwrap();
    assert!(
        warned.len() == 1 && warned[0].contains("elbow"),
        "{warned:?}"
    );
    assert!(
        check_log(&read(&degrees(2.0)).unwrap(), &two())
            .unwrap()
            .is_empty()
    );
}

#[test]
fn too_few_samples_are_refused() {
    assert_says(
        read(&good(4)),
        "too-few-samples",
        &[
            "run.csv: 4 samples",
            "at least 10",
            "record a longer motion",
        ],
    );
    assert_says(
        read("t,q1,q2,tau1,tau2\n"),
        "too-few-samples",
        &["0 samples"],
    );
}

#[test]
fn joints_that_stand_still_are_named() {
    let still = |amplitude: f64| {
        let text = table("t,q1,q2,tau1,tau2", 100, |k| {
            let t = 0.01 * k as f64;
            vec![t, amplitude * t.sin(), 1e-4 * t.cos(), 0.0, 0.0]
        });
        Measurements::from_log(&read(&text).unwrap(), &two()).unwrap()
    };
    let warned = check_motion(&still(1.0), &two()).unwrap();
    assert_eq!(warned.len(), 1);
    assert!(warned[0].contains("run.csv, joint elbow") && warned[0].contains("record a motion"));
    assert_says(
        check_motion(&still(1e-3), &two()),
        "no-motion",
        &["run.csv", "no joint moved", "record an exciting motion"],
    );
}

#[test]
fn currents_need_the_torque_constant_of_every_joint() {
    let text = good(20).replace("tau1,tau2", "current1_A,current2_mA");
    let log = read(&text).unwrap();
    assert_says(
        Measurements::from_log(&log, &two()),
        "torque-constant",
        &["run.csv, joint shoulder", "no torque_constant", "N·m/A"],
    );
}

#[test]
fn files_that_are_not_text_are_refused() {
    let utf16: Vec<u8> = [0xff, 0xfe]
        .into_iter()
        .chain(good(20).encode_utf16().flat_map(u16::to_le_bytes))
        .collect();
    assert_says(
        read_bytes(&utf16[..utf16.len() - 1]),
        "encoding",
        &["damaged UTF-16", "save the file as UTF-8"],
    );
    assert_says(read_bytes(&utf16[2..]), "encoding", &["zero bytes"]);
    let mut latin = good(20).into_bytes();
    latin.extend(b"\xb0,0,0,0,0,0,0\n");
    assert_says(read_bytes(&latin), "encoding", &["line 22", "not UTF-8"]);
    let mut long = good(20);
    long += &"1".repeat(2 << 20);
    assert_says(read(&long), "line-length", &["line 22", "bytes"]);
    assert_says(read(""), "header", &["no line with text"]);
    assert_says(read("# nothing\n\n"), "header", &["no line with text"]);
}

#[test]
fn a_file_without_header_is_refused() {
    let text = good(20);
    let data = text.split_once('\n').unwrap().1;
    assert_says(
        read(data),
        "header",
        &["line 1", "the first line names the columns"],
    );
}

#[test]
fn a_line_cut_off_is_refused() {
    let mut text = good(20);
    text.truncate(text.len() - 8);
    let cells = text.lines().last().unwrap().split(',').count();
    assert!(cells < 7, "the cut must fall before the last comma");
    assert_says(
        read(&text),
        "field-count",
        &[
            "run.csv, line 21",
            "cells, where the header has 7",
            "cut off",
        ],
    );
}

#[test]
fn numbers_with_two_readings_are_refused() {
    let text = good(20).replace(',', ";");
    let row = "0,2;1,234;1,234;1,234;1,234;1,234;1,234\n";
    // `0,2` has one reading, so the comma is the decimal mark.
    let commas = text.replace('.', ",") + row;
    read(&commas).unwrap();
    let doubt = format!("{}\n1;1,234;1;1;1;1;1\n", text.lines().next().unwrap());
    assert_says(
        read(&doubt),
        "decimal-mark",
        &["line 2", "`1,234`", "decimal point"],
    );
    let mixed = text + "0.2;1.234,5;1;1;1;1;1\n";
    assert_says(read(&mixed), "decimal-mark", &["`1.234,5`"]);
}

#[test]
fn a_mapping_that_does_not_fit_is_refused() {
    let map = |header: &str, joint: Option<&str>, unit: Option<&str>| ColumnMapping {
        columns: vec![MappedColumn {
            header: header.into(),
            quantity: Quantity::Position,
            joint: joint.map(str::to_string),
            unit: unit.map(str::to_string),
            factor: None,
        }],
        ..ColumnMapping::default()
    };
    let read = |mapping| read_csv(good(20).as_bytes(), "run.csv", &labels(&two()), &mapping);
    let cases = [
        (map("Q_1", Some("1"), None), "mapping", "the closest are q1"),
        (
            map("q1", Some("elbo"), None),
            "mapping",
            "the closest are elbow",
        ),
        (map("q1", None, None), "mapping", "q of no joint"),
        (map("q1", Some("1"), Some("ell")), "unit", "unit `ell`"),
    ];
    for (mapping, code, words) in cases {
        assert_says(read(mapping), code, &[words]);
    }
    let rate = ColumnMapping {
        sample_rate: Some(-5.0),
        ..ColumnMapping::default()
    };
    let text = good(20).replacen("t,", "x,", 1);
    let result = read_csv(text.as_bytes(), "run.csv", &labels(&two()), &rate);
    assert_says(result, "setting", &["sample rate -5"]);
}

#[test]
fn hostile_headers_stay_harmless_in_messages() {
    let text = good(20).replace("tau2", "tau2\u{1b}[31m");
    let message = read(&text).unwrap_err().to_string();
    assert!(!message.contains('\u{1b}'), "{message}");
    let one = robot(&["a\u{7}b"]);
    let result = read_csv(
        b"t,x\n",
        "run.csv",
        &labels(&one),
        &ColumnMapping::default(),
    );
    let message = result.unwrap_err().to_string();
    assert!(!message.contains('\u{7}'), "{message}");
}
