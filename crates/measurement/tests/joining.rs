//! One recording in several files.
#![allow(clippy::unwrap_used)]

mod common;

use common::{assert_says, labels, robot, table, two};
use idim_measurement::{ColumnMapping, Drive, MappedColumn, Quantity, read_csv_files};

fn column(header: &str, quantity: Quantity, joint: usize) -> MappedColumn {
    MappedColumn {
        header: header.into(),
        quantity,
        joint: Some(joint.to_string()),
        unit: None,
        factor: None,
    }
}

#[test]
fn columns_of_several_files_stand_side_by_side() {
    let position = table("Joint_1,Joint_2", 20, |k| vec![k as f64, 2.0 * k as f64]);
    let torque = table("Joint_1,Joint_2,mode", 20, |k| {
        vec![3.0 * k as f64, 4.0 * k as f64, 1.0]
    });
    let mapping = ColumnMapping {
        columns: vec![
            column("q.csv:Joint_1", Quantity::Position, 1),
            column("q.csv:Joint_2", Quantity::Position, 2),
            column("tau.csv:Joint_1", Quantity::Torque, 1),
            column("tau.csv:Joint_2", Quantity::Torque, 2),
        ],
        sample_rate: Some(100.0),
        ..ColumnMapping::default()
    };
    let read = |q: &str, tau: &str| {
        let files = [(q.as_bytes(), "q.csv"), (tau.as_bytes(), "tau.csv")];
        read_csv_files(&files, &labels(&two()), &mapping)
    };
    let log = read(&position, &torque).unwrap();
    assert_eq!(
        (log.file.as_str(), log.time[5], log.q[1][5]),
        ("q.csv + tau.csv", 0.05, 10.0)
    );
    let Drive::Torque(tau) = &log.drive else {
        panic!("torque is recorded")
    };
    assert_eq!((tau[0][5], tau[1][5]), (15.0, 20.0));
    let shorter = torque.trim_end().rsplit_once('\n').unwrap().0;
    assert_says(
        read(&position, shorter),
        "field-count",
        &["tau.csv: 19 lines, where q.csv has 20"],
    );
    let other = torque.replace(',', ";");
    assert_says(
        read(&position, &other),
        "field-count",
        &["tau.csv", "one dialect"],
    );
}

#[test]
fn oracle_the_recorded_tx40_reads_from_its_two_files() {
    let Some(dir) = idim_fixtures::shared_dir().map(|d| d.join("data/staubli-tx40")) else {
        eprintln!("skipped: the recorded TX40 logs are not here (set IDIM_DATA)");
        return;
    };
    let arm = robot(&["j1", "j2", "j3", "j4", "j5", "j6"]);
    let names = ["motor_positions.csv", "motor_torques.csv"];
    let bytes = names.map(|n| std::fs::read(dir.join(n)).unwrap());
    let mut columns = Vec::new();
    for joint in 1..=6 {
        for (file, quantity) in names.iter().zip([Quantity::Position, Quantity::Torque]) {
            columns.push(column(&format!("{file}:Joint_{joint}"), quantity, joint));
        }
    }
    let mapping = ColumnMapping {
        columns,
        sample_rate: Some(5000.0),
        ..ColumnMapping::default()
    };
    let files = [
        (bytes[0].as_slice(), names[0]),
        (bytes[1].as_slice(), names[1]),
    ];
    let log = read_csv_files(&files, &labels(&arm), &mapping).unwrap();
    assert_eq!(log.n_samples(), 45_000);
    assert_eq!((log.q[1][0], log.time[1]), (50.265, 2e-4));
}
