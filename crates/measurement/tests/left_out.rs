//! Rows left out of a log, and torques that were recorded late.
#![allow(clippy::unwrap_used)]

mod common;

use common::{FILE, assert_says, good, labels, table, two, with_cell};
use idim_measurement::{
    ColumnMapping, Drive, Error, GAP, Log, NamedColumn, log_from_columns, read_clock, read_csv,
};

fn dropping(text: &str) -> Result<Log, Error> {
    let mapping = ColumnMapping {
        drop_bad: true,
        ..ColumnMapping::default()
    };
    read_csv(text.as_bytes(), FILE, &labels(&two()), &mapping)
}

#[test]
fn identity_bad_rows_are_left_out_and_leave_a_gap() {
    let whole = dropping(&good(200)).unwrap();
    // Line 51 is the sample at 0.49 s, line 151 that at 1.49 s.
    let text = with_cell(&with_cell(&good(200), 51, 5, "nan"), 151, 1, "x");
    let log = dropping(&text).unwrap();
    let notes = log.notes.join("\n");
    assert!(notes.contains("2 bad rows of 200 left out"), "{notes}");
    assert!(notes.contains("line 51, column tau1"), "{notes}");
    let gaps = read_clock(&log.time).gaps;
    let at: Vec<f64> = gaps.iter().map(|g| g.time).collect();
    assert_eq!(at, [0.48, 1.48]);
    assert!(gaps.iter().all(|g| g.length > GAP * 0.01));
    // What stays is what was recorded.
    for (k, t) in log.time.iter().enumerate() {
        let before = whole.time.iter().position(|w| w == t).unwrap();
        assert_eq!(log.q[1][k], whole.q[1][before]);
        assert_eq!(log.lines[k], whole.lines[before]);
    }
    assert!(log.n_samples() >= 192);
}

#[test]
fn regress_bad_rows_are_refused_where_nothing_else_is_said_or_they_are_the_rule() {
    let text = with_cell(&good(200), 51, 5, "nan");
    assert_says(common::read(&text), "not-finite", &["line 51"]);
    let cut = good(50) + "0.5,1,2\n";
    assert_says(common::read(&cut), "field-count", &["line 52"]);
    assert_eq!(dropping(&cut).unwrap().n_samples(), 50);
    let mostly = table("t,q1,q2,qd1,qd2,tau1,tau2", 40, |k| {
        let bad = if k % 3 == 0 { 1.0 } else { f64::NAN };
        vec![0.01 * k as f64, 1.0, 1.0, 1.0, 1.0, bad, 1.0]
    });
    assert_says(dropping(&mostly), "not-finite", &["line 3"]);
    // Time that runs backwards is of the whole file.
    assert_says(
        dropping(&with_cell(&good(50), 20, 0, "0.01")),
        "time-order",
        &["line 20"],
    );
}

#[test]
fn identity_a_clock_by_rate_runs_on_through_bad_rows() {
    let mapping = ColumnMapping {
        drop_bad: true,
        sample_rate: Some(100.0),
        ..ColumnMapping::default()
    };
    let text = table("q1,q2,tau1,tau2", 100, |k| {
        let t = 0.01 * k as f64;
        vec![t, t, if k == 40 { f64::NAN } else { t }, t]
    });
    let log = read_csv(text.as_bytes(), FILE, &labels(&two()), &mapping).unwrap();
    for (t, q) in log.time.iter().zip(&log.q[0]) {
        assert!((t - q).abs() < 1e-12, "{t} {q}");
    }
    // The same of columns that come from another format.
    let column = |name: &str| NamedColumn {
        name: name.into(),
        values: Some((0..100).map(|k| 0.01 * f64::from(k)).collect()),
    };
    let mut columns = ["q1", "q2", "tau1", "tau2"].map(column);
    columns[2].values.as_mut().unwrap()[40] = f64::INFINITY;
    let read = |mapping: &ColumnMapping| {
        log_from_columns("run.npz", "npz".into(), &columns, &labels(&two()), mapping)
    };
    let other = read(&mapping).unwrap();
    assert_eq!((&other.time, &other.q), (&log.time, &log.q));
    let strict = ColumnMapping {
        drop_bad: false,
        ..mapping
    };
    assert_says(read(&strict), "not-finite", &["row 41"]);
}

#[test]
fn identity_a_delay_is_taken_out_and_never_across_a_gap() {
    let f = |t: f64| (3.0 * t).sin();
    let text = |late: f64| {
        table("t,q1,q2,tau1,tau2", 300, |k| {
            let t = 0.01 * k as f64 + if k < 150 { 0.0 } else { 1.0 };
            vec![t, t.sin(), t.cos(), f(t - late), f(t - 2.0 * late)]
        })
    };
    for late in [0.04, 0.013, -0.02] {
        let log = common::read(&text(late)).unwrap();
        let mended = log.with_torque_delays(&[late, 2.0 * late]).unwrap();
        let Drive::Torque(torque) = &mended.drive else {
            unreachable!()
        };
        for (k, &t) in mended.time.iter().enumerate() {
            for own in torque {
                assert!((own[k] - f(t)).abs() < 1e-6, "{late}: {t}");
            }
            assert!((mended.q[0][k] - t.sin()).abs() < 1e-12);
        }
        let lost = 2 * (2.0 * late.abs() / 0.01).ceil() as usize;
        assert_eq!(mended.n_samples(), 300 - lost, "{late}");
        let note = mended.notes.last().unwrap();
        assert!(
            note.contains(&format!("{lost} samples")) && note.contains("ms"),
            "{note}"
        );
    }
    let log = common::read(&text(0.0)).unwrap();
    assert_says(
        log.with_torque_delays(&[40.0, 40.0]),
        "setting",
        &["is it in ms"],
    );
}

#[test]
fn identity_what_is_kept_is_parted_by_gaps() {
    let log = common::read(&good(100)).unwrap();
    let mut keep = vec![true; 100];
    keep[..10].fill(false);
    keep[50] = false;
    keep[70..80].fill(false);
    let kept = log.keeping(&keep);
    let gaps = read_clock(&kept.time).gaps;
    let at: Vec<f64> = gaps.iter().map(|g| g.time).collect();
    assert_eq!(at, [log.time[49], log.time[69]]);
    assert_eq!(kept.time[0], 0.1);
    // A hole of one sample takes two neighbours with it, one of ten none.
    assert!(
        (76..=77).contains(&kept.n_samples()),
        "{}",
        kept.n_samples()
    );
}
