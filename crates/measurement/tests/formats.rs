//! The same numbers from every format, and damaged files refused.
#![allow(clippy::unwrap_used)]

mod common;

use common::{assert_says, good, labels, two};
use idim_measurement::formats::read_log;
use idim_measurement::{ColumnMapping, NamedColumn, log_from_columns};
use std::path::Path;

#[test]
fn the_ending_tells_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        read_log(&path, &labels(&two()), &ColumnMapping::default())
    };
    for name in ["run.csv", "run.TXT", "run.tsv"] {
        assert_eq!(read(name, good(20).as_bytes()).unwrap().n_samples(), 20);
    }
    assert_says(
        read("run.xlsx", b""),
        "format",
        &["run.xlsx", "ending `xlsx`", ".csv, .parquet"],
    );
    let missing = read_log(
        Path::new("no/such.csv"),
        &labels(&two()),
        &ColumnMapping::default(),
    );
    assert_says(missing, "unreadable", &["no/such.csv", "give the path"]);
    let empty = read_log(folder.path(), &labels(&two()), &ColumnMapping::default());
    assert_says(empty, "format", &["0 bag files", "give the one"]);
}

#[test]
fn columns_in_memory_are_checked_as_those_of_a_file() {
    let column = |name: &str, values: Vec<f64>| NamedColumn {
        name: name.into(),
        values: Some(values),
    };
    let time: Vec<f64> = (0..20).map(|k| 0.01 * f64::from(k)).collect();
    let make = |change: &dyn Fn(&mut Vec<NamedColumn>)| {
        let mut columns = vec![column("t", time.clone())];
        for name in ["q1_deg", "q2", "tau1", "tau2"] {
            columns.push(column(name, time.clone()));
        }
        change(&mut columns);
        let mapping = ColumnMapping::default();
        log_from_columns("memory", "test".into(), &columns, &labels(&two()), &mapping)
    };
    let log = make(&|_| {}).unwrap();
    assert_eq!(log.q[0][7], time[7] * (std::f64::consts::PI / 180.0));
    let set = |column: usize, row: usize, value: f64| {
        move |c: &mut Vec<NamedColumn>| c[column].values.as_mut().unwrap()[row] = value
    };
    assert_says(
        make(&set(2, 5, f64::NAN)),
        "not-finite",
        &["memory, column q2", "NaN in row 6"],
    );
    assert_says(
        make(&set(0, 5, 0.0)),
        "time-order",
        &["row 6", "two recordings"],
    );
    assert_says(
        make(&set(0, 5, 0.035)),
        "time-order",
        &["row 6 after 0.04 s", "sort the samples"],
    );
    let short = |c: &mut Vec<NamedColumn>| c[3].values.as_mut().unwrap().truncate(15);
    assert_says(
        make(&short),
        "field-count",
        &["column tau1", "15 values, where the first column has 20"],
    );
    let text = |c: &mut Vec<NamedColumn>| c[4].values = None;
    assert_says(
        make(&text),
        "not-a-number",
        &["column tau2", "does not hold numbers"],
    );
    let twice = |c: &mut Vec<NamedColumn>| {
        for c in c {
            let values = c.values.as_mut().unwrap();
            values.insert(3, values[3]);
        }
    };
    assert_eq!(make(&twice).unwrap().n_samples(), 20);
}

#[cfg(not(feature = "mcap"))]
#[test]
fn a_format_left_out_names_its_feature() {
    let result = read_log(
        Path::new("run.mcap"),
        &labels(&two()),
        &ColumnMapping::default(),
    );
    assert_says(result, "format", &["run.mcap", "cargo feature `mcap`"]);
}

#[cfg(feature = "npz")]
mod npz {
    use super::*;
    use idim_measurement::formats::read_npz;
    use npyz::WriterBuilder;
    use npyz::npz::NpzWriter;

    fn archive(add: impl Fn(&mut NpzWriter<std::io::Cursor<&mut Vec<u8>>>)) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut npz = NpzWriter::new(std::io::Cursor::new(&mut bytes));
        add(&mut npz);
        drop(npz);
        bytes
    }

    fn put<T: npyz::Serialize + npyz::AutoSerialize>(
        npz: &mut NpzWriter<std::io::Cursor<&mut Vec<u8>>>,
        name: &str,
        shape: &[u64],
        order: npyz::Order,
        values: impl IntoIterator<Item = T>,
    ) {
        let options = zip_options();
        let writer = npz
            .array(name, options)
            .unwrap()
            .default_dtype()
            .order(order)
            .shape(shape);
        let mut writer = writer.begin_nd().unwrap();
        writer.extend(values).unwrap();
        writer.finish().unwrap();
    }

    fn zip_options() -> npyz::zip::write::FileOptions {
        npyz::zip::write::FileOptions::default()
    }

    #[test]
    fn identity_matrices_are_columns_in_either_order() {
        let csv = common::read(&good(20)).unwrap();
        let by_rows = |x: &[Vec<f64>]| -> Vec<f64> {
            (0..20).flat_map(|k| x.iter().map(move |c| c[k])).collect()
        };
        let idim_measurement::Drive::Torque(torque) = &csv.drive else {
            panic!("torque is recorded")
        };
        let bytes = archive(|npz| {
            put(
                npz,
                "t_ms",
                &[20],
                npyz::Order::C,
                (0..20i64).map(|k| 10 * k),
            );
            put(npz, "q", &[20, 2], npyz::Order::C, by_rows(&csv.q));
            put(
                npz,
                "qd_rad_s",
                &[20, 2],
                npyz::Order::Fortran,
                csv.qd.clone().unwrap().concat(),
            );
            put(npz, "tau1", &[20], npyz::Order::C, torque[0].clone());
            put(npz, "tau2_Nm", &[20], npyz::Order::C, torque[1].clone());
            put(npz, "mass", &[2, 2, 2], npyz::Order::C, vec![1f32; 8]);
        });
        let mapping = ColumnMapping::default();
        let log = read_npz(&bytes, "run.npz", &labels(&two()), &mapping).unwrap();
        assert_eq!((&log.q, &log.qd, &log.drive), (&csv.q, &csv.qd, &csv.drive));
        assert!(log.notes.iter().any(|n| n.contains("mass")));
        let cut = read_npz(&bytes[..100], "run.npz", &labels(&two()), &mapping);
        assert_says(cut, "damaged", &["run.npz", "numpy.savez"]);
    }
}

#[cfg(feature = "parquet")]
mod parquet_files {
    use super::*;
    use idim_measurement::formats::read_parquet;
    use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use std::sync::Arc;

    fn table() -> Vec<u8> {
        let csv = common::read(&good(20)).unwrap();
        let schema = "message log { required int64 t_ms; required double q1; required double q2; optional double tau1; required double tau2; required binary mode (UTF8); }";
        let schema = Arc::new(parquet::schema::parser::parse_message_type(schema).unwrap());
        let idim_measurement::Drive::Torque(torque) = &csv.drive else {
            panic!("torque is recorded")
        };
        let mut bytes = Vec::new();
        let codec = parquet::basic::Compression::SNAPPY;
        let properties = Arc::new(WriterProperties::builder().set_compression(codec).build());
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties).unwrap();
        let mut group = writer.next_row_group().unwrap();
        let time: Vec<i64> = (0..20).map(|k| 10 * k).collect();
        let mut column = group.next_column().unwrap().unwrap();
        column
            .typed::<Int64Type>()
            .write_batch(&time, None, None)
            .unwrap();
        column.close().unwrap();
        for (values, levels) in [
            (&csv.q[0], None),
            (&csv.q[1], None),
            (&torque[0], Some([1i16; 20])),
            (&torque[1], None),
        ] {
            let mut column = group.next_column().unwrap().unwrap();
            let levels = levels.as_ref().map(<[i16; 20]>::as_slice);
            column
                .typed::<DoubleType>()
                .write_batch(values, levels, None)
                .unwrap();
            column.close().unwrap();
        }
        let mut column = group.next_column().unwrap().unwrap();
        let words = vec![ByteArray::from("run"); 20];
        column
            .typed::<ByteArrayType>()
            .write_batch(&words, None, None)
            .unwrap();
        column.close().unwrap();
        group.close().unwrap();
        writer.close().unwrap();
        bytes
    }

    #[test]
    fn identity_a_table_holds_what_was_recorded() {
        let csv = common::read(&good(20)).unwrap();
        let bytes = table();
        let mapping = ColumnMapping::default();
        let read =
            |bytes: &[u8]| read_parquet(bytes.to_vec(), "run.parquet", &labels(&two()), &mapping);
        let log = read(&bytes).unwrap();
        assert_eq!((&log.q, &log.drive), (&csv.q, &csv.drive));
        assert!(
            log.notes
                .iter()
                .any(|n| n.contains("columns left out: mode"))
        );
        assert_says(read(&bytes[..bytes.len() / 2]), "damaged", &["run.parquet"]);
    }
}
