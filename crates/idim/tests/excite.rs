//! `idim excite` from the command line to the files it leaves, and what it refuses.
#![allow(clippy::unwrap_used)]

use clap::Parser;
use idim::{KeepOrder, Structure};
use idim_model::{
    Columns, DriveColumns, JointState, Model, energy_regressor, observation_matrix, robot_from_ron,
};
use idim_trajectory::{FourierSeries, Limits, Motion, TrajectoryFile};
use std::fmt::Write as _;
use std::path::PathBuf;

#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: idim::cli::Command,
}

fn run(arguments: &[&str]) -> Result<String, String> {
    let parsed = Arguments::try_parse_from(["idim", "excite"].iter().chain(arguments))
        .map_err(|e| e.to_string())?;
    let mut out = Vec::new();
    idim::cli::run(&parsed.command, &mut out).map_err(|e| e.to_string())?;
    Ok(String::from_utf8(out).unwrap())
}

/// A folder with an upright arm of two links.
struct Bench(tempfile::TempDir);

const LIMITS: [&str; 6] = [
    "--position",
    "1.2",
    "--velocity",
    "2,3",
    "--acceleration",
    "8",
];
/// A second of work at most.
const SMALL: [&str; 8] = [
    "--harmonics",
    "3",
    "--period",
    "6",
    "--starts",
    "2",
    "--rounds",
    "1",
];

impl Bench {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("arm.ron"), idim_fixtures::PLANAR2R).unwrap();
        Self(dir)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn excite(&self, out: &str, more: &[&str]) -> Result<String, String> {
        let (robot, out) = (self.path("arm.ron"), self.path(out));
        let mut arguments = vec!["--robot", robot.to_str().unwrap()];
        arguments.extend(["--out", out.to_str().unwrap()]);
        arguments.extend(SMALL);
        arguments.extend(more);
        run(&arguments)
    }

    fn file(&self, out: &str, name: &str) -> String {
        let robot = std::fs::read_dir(self.path(out))
            .unwrap()
            .next()
            .unwrap()
            .unwrap();
        std::fs::read_to_string(robot.path().join(name)).unwrap()
    }

    fn series(&self, out: &str) -> FourierSeries {
        let file = TrajectoryFile::from_ron(&self.file(out, "motion.ron")).unwrap();
        let Motion::Fourier(series) = file.motion().unwrap() else {
            panic!("not a Fourier motion")
        };
        series
    }
}

#[test]
fn regress_a_motion_with_its_files_comes_out_certified() {
    let bench = Bench::new();
    let text = bench.excite("out", &LIMITS).unwrap();
    for word in [
        "Cond, raw",
        "Cond, equilibrated",
        "log det F",
        "S: max |W| / min |W|",
        "by the eigenvalues of the information matrix",
        "best random",
        "most used",
    ] {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
    let series = bench.series("out");
    let json = TrajectoryFile::from_json(&bench.file("out", "motion.json")).unwrap();
    assert_eq!(json.motion().unwrap(), Motion::Fourier(series.clone()));
    let limits = Limits::new(vec![[-1.2, 1.2]; 2], vec![2.0, 3.0], vec![8.0; 2]).unwrap();
    assert!(series.certificate(&limits).certified);
    // The samples are those of the motion, both ends included.
    let csv = bench.file("out", "samples.csv");
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines[0], "t,q1,q2,qd1,qd2,qdd1,qdd2");
    assert_eq!(lines.len(), 1 + 601);
    let row: Vec<f64> = lines[124].split(',').map(|v| v.parse().unwrap()).collect();
    let state = series.states(&[1.23]).state(0);
    assert_eq!(row[0], 1.23);
    assert_eq!(&row[1..], &[state.q, state.qd, state.qdd].concat());
    let certificate: serde_json::Value =
        serde_json::from_str(&bench.file("out", "certificate.json")).unwrap();
    assert_eq!(certificate["certified"], true);
    assert_eq!(certificate["search"]["reproducible"], true);
    assert_eq!(certificate["joints"][1]["velocity"]["limit"], 3.0);
    let most = certificate["largest_use"]["use"].as_f64().unwrap();
    assert!((0.99..=1.0).contains(&most), "{most}");
    assert!(bench.file("out", "motion.svg").starts_with("<svg"));
    // Better than chance, and the same again.
    let search = &certificate["search"];
    assert!(search["value"].as_f64().unwrap() < search["best_random"].as_f64().unwrap());
    bench.excite("again", &LIMITS).unwrap();
    assert_eq!(bench.series("again"), series);
}

#[test]
fn regress_rest_weights_and_a_time_budget_are_heard() {
    let bench = Bench::new();
    let more = [
        "--rest",
        "--noise",
        "0.1,0.5",
        "--criterion",
        "d,cond-equilibrated=0.5",
    ];
    let budget = ["--time-budget", "2", "--columns", "viscous"];
    let text = bench
        .excite("out", &[&LIMITS[..], &more, &budget].concat())
        .unwrap();
    assert!(
        text.contains("1 log d + 0.5 log cond-equilibrated"),
        "{text}"
    );
    assert!(text.contains("Cond, weighted"), "{text}");
    assert!(text.contains("from rest to rest"), "{text}");
    let start = bench.series("out").states(&[0.0]).state(0);
    assert!(start.qd.iter().chain(&start.qdd).all(|v| v.abs() < 1e-10));
    // `--rounds` given and done long before the budget: nothing was cut short, or the text says so.
    let certificate = bench.file("out", "certificate.json");
    let reproducible = certificate.contains("\"reproducible\": true");
    assert_ne!(reproducible, text.contains("another machine"), "{text}");
}

/// Entries of added columns, joint by joint.
type Added<'a> = &'a dyn Fn(&JointState) -> Vec<Vec<f64>>;

/// A robot file's own columns: the coupled motor of a wrist, a counterbalance.
#[test]
fn identity_a_motion_is_designed_for_the_columns_that_identify_uses() {
    let tx40 = |s: &JointState| {
        // Motor 6 turns with joints 5 and 6 alike.
        let (speed, acceleration) = (s.qd[4] + s.qd[5], s.qdd[4] + s.qdd[5]);
        let motor = [acceleration, speed, speed.signum()];
        let on = |joint| {
            if joint >= 4 {
                motor.to_vec()
            } else {
                vec![0.0; 3]
            }
        };
        (0..6).map(on).collect::<Vec<_>>()
    };
    let kr300 = |s: &JointState| {
        let robot = robot_from_ron(idim_fixtures::KR300).unwrap();
        let known = robot.drives().known_torques[0].at(s.q[1]);
        let on = |joint| vec![if joint == 1 { known } else { 0.0 }];
        (0..6).map(on).collect::<Vec<_>>()
    };
    let cases: [(&str, &[&str], Added<'_>); 2] = [
        (idim_fixtures::TX40, &["IaM6", "FvM6", "FcM6"], &tx40),
        (idim_fixtures::KR300, &["counterbalance"], &kr300),
    ];
    for (text, names, added) in cases {
        let bench = Bench::new();
        std::fs::write(bench.path("arm.ron"), text).unwrap();
        let limits = "--position 0.8 --velocity 1 --acceleration 3 --rounds 0 --starts 1";
        let more: Vec<&str> = limits.split(' ').collect();
        let (robot, out) = (bench.path("arm.ron"), bench.path("out"));
        let files = [
            "--robot",
            robot.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
        ];
        run(&[&files[..], &more].concat()).unwrap();
        let certificate: serde_json::Value =
            serde_json::from_str(&bench.file("out", "certificate.json")).unwrap();
        let base: Vec<&str> = certificate["base_parameters"]
            .as_array()
            .unwrap()
            .iter()
            .map(|name| name.as_str().unwrap())
            .collect();
        assert!(base.ends_with(names), "{base:?}");
        // The condition number of all of them, over the samples of the report.
        let robot = robot_from_ron(text).unwrap();
        let structure = Structure::of_drives(&robot, Columns::standard(6, DriveColumns::ALL));
        let columns = structure.base_columns();
        let (n_samples, p) = (1000, columns.len());
        let states = bench.series("out").equispaced_states(n_samples);
        let y = observation_matrix(&Model::new(&robot), &columns, &states);
        let extra: Vec<Vec<Vec<f64>>> = (0..n_samples).map(|k| added(&states.state(k))).collect();
        let w = faer::Mat::from_fn(6 * n_samples, p + names.len(), |row, column| {
            if column < p {
                y[(row, column)]
            } else {
                extra[row / 6][row % 6][column - p]
            }
        });
        let sigma = w.singular_values().unwrap();
        let expected = sigma[0] / sigma[sigma.len() - 1];
        let found = certificate["criteria"]["condition_number"]["raw"]
            .as_f64()
            .unwrap();
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }
}

/// The log of two slow sines, by these names of its columns; `sign` of the second velocity.
fn sines(header: &str, sign: f64) -> String {
    let mut log = format!("{header}\n");
    for k in 0..1000 {
        let t = 0.01 * f64::from(k);
        let joint = |w: f64, sign: f64| {
            let (s, c) = (w * t).sin_cos();
            [s, sign * w * c, -w * w * s, 3.0 * w * c - 2.0 * w * w * s]
        };
        let (a, b) = (joint(2.0, 1.0), joint(3.1, sign));
        let _ = write!(log, "{t}");
        for (a, b) in a.iter().zip(b) {
            let _ = write!(log, ",{a},{b}");
        }
        log.push('\n');
    }
    log
}

/// What the log of two slow sines tells need not be asked again.
#[test]
fn identity_earlier_logs_change_what_is_asked_of_the_motion() {
    let bench = Bench::new();
    let log = sines("t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2", 1.0);
    std::fs::write(bench.path("log.csv"), log).unwrap();
    let path = bench.path("log.csv");
    let given = ["--log", path.to_str().unwrap(), "--criterion", "d"];
    let text = bench
        .excite("out", &[&LIMITS[..], &given].concat())
        .unwrap();
    assert!(text.contains("1 earlier logs"), "{text}");
    // How it became samples is that of `identify`, and said.
    assert!(text.contains("whose error on held-out blocks"), "{text}");
    assert!(text.contains("dead band"), "{text}");
    let alone = bench.excite("alone", &[&LIMITS[..], &["--criterion", "d"]].concat());
    alone.unwrap();
    assert_ne!(bench.series("out"), bench.series("alone"));
    // Together they tell more than the motion alone does.
    let value = |out: &str| -> f64 {
        let json: serde_json::Value =
            serde_json::from_str(&bench.file(out, "certificate.json")).unwrap();
        json["search"]["value"].as_f64().unwrap()
    };
    assert!(value("out") < value("alone"));
}

#[test]
fn regress_earlier_logs_are_read_by_a_mapping_and_findings_can_be_waived() {
    let bench = Bench::new();
    let header = "t,one,two,qd1,qd2,qdd1,qdd2,tau1,tau2";
    std::fs::write(bench.path("log.csv"), sines(header, -1.0)).unwrap();
    let mapping = r#"(columns: [
        (header: "one", quantity: q, joint: "1"), (header: "two", quantity: q, joint: "2"),
    ])"#;
    std::fs::write(bench.path("map.ron"), mapping).unwrap();
    let (log, map) = (bench.path("log.csv"), bench.path("map.ron"));
    let (log, map) = (log.to_str().unwrap(), map.to_str().unwrap());
    let ask = |more: &[&str]| bench.excite("out", &[&LIMITS[..], &["--log", log], more].concat());
    let message = ask(&[]).unwrap_err();
    assert!(
        message.contains("log.csv") && message.contains("one"),
        "{message}"
    );
    let message = ask(&["--mapping", map]).unwrap_err();
    assert!(message.contains("velocity-sign"), "{message}");
    assert!(!bench.path("out").exists());
    ask(&["--mapping", map, "--waive", "velocity-sign"]).unwrap();
    let alone = bench.excite("alone", &[&LIMITS[..], &["--mapping", map]].concat());
    assert!(alone.unwrap_err().contains("--log"));
}

#[test]
fn identity_exciting_points_and_a_certified_path_through_them() {
    let bench = Bench::new();
    let robot = bench.path("arm.ron");
    let ask = |out: &str, more: &[&str]| {
        let out = bench.path(out);
        let files = [
            "--robot",
            robot.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
        ];
        let points = ["--family", "points", "--starts", "2", "--rounds", "1"];
        run(&[&files[..], &points, &LIMITS, more].concat())
    };
    let text = ask("out", &["--largest-s", "60"]).unwrap();
    for word in [
        "exciting points",
        "S at most 60: held",
        "best of 1000 random chains",
        "along the path",
    ] {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
    let file = TrajectoryFile::from_ron(&bench.file("out", "motion.ron")).unwrap();
    let Motion::Quintic(path) = file.motion().unwrap() else {
        panic!("not a path")
    };
    let limits = Limits::new(vec![[-1.2, 1.2]; 2], vec![2.0, 3.0], vec![8.0; 2]).unwrap();
    assert!(path.certificate(&limits).certified);
    // Twice as many energy differences as base parameters, and the way from home and back.
    assert_eq!(path.n_segments(), 2 * 6 + 2);
    let n = path.point_times().len();
    let points = path.states(&path.point_times()[1..n - 1]);
    let robot = robot_from_ron(idim_fixtures::PLANAR2R).unwrap();
    let structure = Structure::of_energy(&robot, KeepOrder::Links);
    let (model, columns) = (Model::new(&robot), structure.base_columns());
    let h = |k: usize| {
        let s = points.state(k);
        energy_regressor(&model, &columns, &s.q, &s.qd)
    };
    let w = faer::Mat::from_fn(12, 6, |i, j| h(i + 1)[j] - h(i)[j]);
    let sigma = w.singular_values().unwrap();
    let certificate: serde_json::Value =
        serde_json::from_str(&bench.file("out", "certificate.json")).unwrap();
    assert_eq!(certificate["certified"], true);
    let found = certificate["criteria"]["condition_number"]["raw"]
        .as_f64()
        .unwrap();
    // Points are read back from the polynomials between them.
    assert!(
        (found / (sigma[0] / sigma[5]) - 1.0).abs() < 1e-6,
        "{found}"
    );
    let search = &certificate["search"];
    assert_eq!(search["value"].as_f64().unwrap(), found);
    assert!(found < search["best_random"].as_f64().unwrap());
    assert_eq!(search["reproducible"], true);
    ask("again", &["--largest-s", "60"]).unwrap();
    assert_eq!(
        bench.file("again", "motion.json"),
        bench.file("out", "motion.json")
    );
    // Without time for another search, points are slowed down until the path keeps its limits.
    let text = ask("hurried", &["--time-budget", "1e-6"]).unwrap();
    assert!(text.contains("slowed down"), "{text}");
    let file = TrajectoryFile::from_ron(&bench.file("hurried", "motion.ron")).unwrap();
    let Motion::Quintic(path) = file.motion().unwrap() else {
        panic!("not a path")
    };
    assert!(path.certificate(&limits).certified);
    // What belongs to the other family is not dropped in silence.
    let refused = |more: &[&str], words: &[&str]| {
        let message = ask("refused", more).unwrap_err();
        for word in words {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
    };
    refused(&["--harmonics", "3"], &["--harmonics", "points"]);
    refused(&["--log", "log.csv"], &["--log"]);
    refused(
        &["--torque-share", "0.5"],
        &["no inertial values", "leave torques out"],
    );
    refused(&["--rows", "5"], &["5", "6 base columns"]);
    refused(&["--criterion", "d,e"], &["by one", "--lambda"]);
    refused(&["--largest-s", "1"], &["limit of S"]);
    let message = bench.excite("refused", &[&LIMITS[..], &["--rows", "20"]].concat());
    assert!(message.unwrap_err().contains("--rows"));
    assert!(!bench.path("refused").exists());
}

#[test]
fn identity_exciting_points_for_a_weighted_sum_of_cond_and_s() {
    let bench = Bench::new();
    let (robot, out) = (bench.path("arm.ron"), bench.path("out"));
    let (robot, out) = (robot.to_str().unwrap(), out.to_str().unwrap());
    let ask = |more: &[&str]| {
        let files = ["--robot", robot, "--out", out];
        let quick = ["--starts", "2", "--rounds", "1"];
        run(&[&files[..], &quick, &LIMITS, more].concat())
    };
    let points = |more: &[&'static str]| [&["--family", "points"][..], more].concat();
    let refused = |more: &[&str], words: &[&str]| {
        let message = ask(more).unwrap_err();
        for word in words {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
    };
    refused(&["--lambda", "1,0.1"], &["sampled", "--family points"]);
    refused(&points(&["--lambda", "1"]), &["two weights", "1,0.1"]);
    refused(&points(&["--lambda", "1,-2"]), &["above zero"]);
    let weighs = ["--lambda", "1,2", "--criterion", "d"];
    refused(&points(&weighs), &["against cond", "--criterion"]);
    let both = ["--lambda", "1,2", "--largest-s", "60"];
    refused(&points(&both), &["--largest-s", "either"]);
    assert!(!bench.path("out").exists());
    let text = ask(&points(&["--lambda", "1,0.5"])).unwrap();
    assert!(text.contains("lowered: 1 cond + 0.5 S"), "{text}");
    let certificate: serde_json::Value =
        serde_json::from_str(&bench.file("out", "certificate.json")).unwrap();
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    let (criteria, search) = (&certificate["criteria"], &certificate["search"]);
    let s = number(&criteria["equilibrium"]["ratio"]);
    let sum = number(&criteria["condition_number"]["raw"]) + 0.5 * s;
    assert_eq!(search["criterion"], "1 cond + 0.5 S");
    assert!((number(&search["value"]) / sum - 1.0).abs() < 1e-12);
    assert!(sum < number(&search["best_random"]));
}

#[test]
fn regress_questions_without_an_answer_are_refused_and_nothing_is_written() {
    let bench = Bench::new();
    let refused = |more: &[&str], words: &[&str]| {
        let message = bench.excite("out", more).unwrap_err();
        for word in words {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
        assert!(!bench.path("out").exists(), "{message}");
    };
    let with = |more: &[&'static str]| [&LIMITS[..], more].concat();
    refused(&[], &["no position limit", "--position", "robot-file.md"]);
    refused(&LIMITS[..4], &["no acceleration limit", "--acceleration"]);
    refused(
        &with(&["--criterion", "best"]),
        &["no criterion `best`", "cond-equilibrated"],
    );
    refused(&with(&["--criterion", "cond=-1"]), &["above zero"]);
    refused(&with(&["--rate", "0"]), &["--rate"]);
    refused(&with(&["--time-budget", "inf"]), &["--time-budget"]);
    refused(&with(&["--noise", "1,2,3"]), &["--noise", "3 numbers"]);
    refused(&with(&["--noise", "0"]), &["above zero"]);
    refused(&["--velocity", "1,2,3"], &["--velocity", "each of the 2"]);
    refused(&with(&["--log", "nowhere.csv"]), &["nowhere.csv"]);
}
