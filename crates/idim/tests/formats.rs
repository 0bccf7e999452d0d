//! One recording in several formats gives one model.
#![allow(clippy::unwrap_used)]

use clap::Parser;
use std::path::Path;

#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: idim::cli::Command,
}

/// The result of an identification.
fn identified(robot: &Path, log: &Path, more: &[&str]) -> serde_json::Value {
    let out = tempfile::tempdir().unwrap();
    let mut arguments = vec!["idim", "identify", "--robot", robot.to_str().unwrap()];
    arguments.extend(["--log", log.to_str().unwrap()]);
    arguments.extend(["--out", out.path().to_str().unwrap()]);
    arguments.extend(more);
    let parsed = Arguments::try_parse_from(arguments).unwrap();
    idim::cli::run(&parsed.command, &mut std::io::sink()).unwrap();
    let folder = std::fs::read_dir(out.path()).unwrap().next().unwrap();
    let json = std::fs::read_to_string(folder.unwrap().path().join("result.json")).unwrap();
    serde_json::from_str(&json).unwrap()
}

fn r2(result: &serde_json::Value) -> Vec<f64> {
    let joints = result["validation"]["joints"].as_array().unwrap();
    joints.iter().map(|j| j["r2"].as_f64().unwrap()).collect()
}

#[test]
fn oracle_the_recorded_ur10_gives_the_same_model_from_csv_and_bag() {
    let Some(dir) = idim_fixtures::shared_dir().map(|d| d.join("data/ur10")) else {
        eprintln!("skipped: the recorded UR10 log is not here (set IDIM_DATA)");
        return;
    };
    let robot = dir.join("ur10.urdf");
    let csv = identified(&robot, &dir.join("exciting.csv"), &[]);
    let bag = identified(&robot, &dir.join("exciting_rosbag2.db3"), &[]);
    // What a low-pass of 8 Hz and the same columns reach.
    let least = [0.966, 0.985, 0.995, 0.984, 0.952, 0.961];
    let (a, b) = (r2(&csv), r2(&bag));
    eprintln!("UR10, held-out R2: {a:.4?}");
    for j in 0..6 {
        assert!(a[j] >= least[j], "joint {}: R2 {}", j + 1, a[j]);
        // The CSV keeps nine significant digits.
        assert!((a[j] - b[j]).abs() < 1e-6, "{} against {}", a[j], b[j]);
    }
    let inferred = bag["inferred"].to_string();
    for part in ["JointState messages of topic", "SI assumed"] {
        assert!(inferred.contains(part), "`{part}` is missing in {inferred}");
    }
}

#[test]
fn identity_a_mapping_names_columns_units_and_signs() {
    let dir = tempfile::tempdir().unwrap();
    let robot = dir.path().join("arm.ron");
    std::fs::write(&robot, idim_fixtures::PLANAR2R).unwrap();
    let (mut plain, mut foreign) = (
        String::from("t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2\n"),
        String::new(),
    );
    foreign += "stamp,pos_0,pos_1,vel_shoulder,vel_elbow,a0,a1,effort_0,effort_1\n";
    for k in 0..400 {
        let t = 0.01 * f64::from(k);
        let joint = |w: f64| {
            let (q, qd, qdd) = ((w * t).sin(), w * (w * t).cos(), -w * w * (w * t).sin());
            [q, qd, qdd, 2.0 * qdd + 3.0 * qd]
        };
        let (a, b) = (joint(2.0), joint(3.1));
        for (text, t, turn, sign) in [
            (&mut plain, t, 1.0, 1.0),
            (&mut foreign, 1e3 * t, 180.0 / std::f64::consts::PI, -1.0),
        ] {
            let cells = [
                t,
                turn * a[0],
                turn * b[0],
                a[1],
                b[1],
                a[2],
                b[2],
                sign * a[3],
                sign * b[3],
            ];
            let cells: Vec<String> = cells.iter().map(f64::to_string).collect();
            *text += &(cells.join(",") + "\n");
        }
    }
    let names: Vec<String> = idim::load_robot(&robot, &idim::Changes::default())
        .unwrap()
        .robot
        .joints()
        .iter()
        .map(|j| j.name.clone())
        .collect();
    foreign = foreign
        .replacen("vel_shoulder", &format!("vel_{}", names[0]), 1)
        .replacen("vel_elbow", &format!("vel_{}", names[1]), 1);
    let mapping = "(columns: [
        (header: \"stamp\", quantity: t, unit: \"ms\"),
        (header: \"pos_{0}\", quantity: q, unit: \"deg\"),
        (header: \"vel_{name}\", quantity: qd),
        (header: \"a{0}\", quantity: qdd),
        (header: \"effort_{0}\", quantity: tau, factor: -1),
    ])";
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let (plain, foreign) = (write("plain.csv", &plain), write("foreign.csv", &foreign));
    let mapping = write("map.ron", mapping);
    let a = identified(&robot, &plain, &["--as-recorded"]);
    let more = ["--as-recorded", "--mapping", mapping.to_str().unwrap()];
    let b = identified(&robot, &foreign, &more);
    let values = |r: &serde_json::Value| -> Vec<f64> {
        let parameters = r["estimate"]["parameters"].as_array().unwrap();
        parameters
            .iter()
            .map(|p| p["value"].as_f64().unwrap())
            .collect()
    };
    for (a, b) in values(&a).iter().zip(values(&b)) {
        assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} against {b}");
    }
}
