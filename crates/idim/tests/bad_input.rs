//! What a user can hand over that is wrong: refused with place, value, rule and next step, and nothing written.
#![allow(clippy::unwrap_used)]

use clap::Parser;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: idim::cli::Command,
}

/// A folder with a planar arm and a good log of it.
struct Bench {
    dir: tempfile::TempDir,
}

const HEADER: &str = "t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2";

fn run(arguments: &[&str]) -> Result<String, String> {
    let all = ["idim"].iter().chain(arguments);
    let parsed = Arguments::try_parse_from(all).map_err(|e| e.to_string())?;
    let mut out = Vec::new();
    idim::cli::run(&parsed.command, &mut out).map_err(|e| e.to_string())?;
    Ok(String::from_utf8(out).unwrap())
}

/// One line of a good log: smooth motion, torques of an arm that is nothing but rotor inertia and friction.
fn line(k: usize) -> Vec<f64> {
    let t = 0.01 * k as f64;
    let joint = |w: f64| {
        let (q, qd, qdd) = ((w * t).sin(), w * (w * t).cos(), -w * w * (w * t).sin());
        (q, qd, qdd, 2.0 * qdd + 3.0 * qd)
    };
    let (a, b) = (joint(2.0), joint(3.1));
    vec![t, a.0, b.0, a.1, b.1, a.2, b.2, a.3, b.3]
}

fn csv(header: &str, lines: &[Vec<f64>]) -> String {
    let mut text = format!("{header}\n");
    for line in lines {
        let cells: Vec<String> = line.iter().map(f64::to_string).collect();
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

fn good() -> Vec<Vec<f64>> {
    (0..1000).map(line).collect()
}

impl Bench {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("arm.ron"), idim_fixtures::PLANAR2R).unwrap();
        Self { dir }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> String {
        std::fs::write(self.path(name), text).unwrap();
        self.path(name).display().to_string()
    }

    fn identify(&self, log: &str, more: &[&str]) -> Result<String, String> {
        let log = self.write("log.csv", log);
        let (robot, out) = (self.path("arm.ron"), self.path("out"));
        let mut arguments = vec![
            "identify",
            "--robot",
            robot.to_str().unwrap(),
            "--log",
            &log,
        ];
        arguments.extend(["--out", out.to_str().unwrap()]);
        arguments.extend(more);
        run(&arguments)
    }

    /// Refused, with these words in the message, and nothing written.
    #[track_caller]
    fn refused(&self, log: &str, words: &[&str]) {
        let message = self.identify(log, &[]).unwrap_err();
        for word in words {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
        assert!(
            !self.path("out").exists(),
            "something was written after: {message}"
        );
    }
}

#[test]
fn regress_a_good_log_is_identified_and_written() {
    let bench = Bench::new();
    let text = bench
        .identify(&csv(HEADER, &good()), &["--as-recorded"])
        .unwrap();
    assert!(text.contains("held out"), "{text}");
    let folder = std::fs::read_dir(bench.path("out"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let json = std::fs::read_to_string(folder.join("result.json")).unwrap();
    let result: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(result["schema"], "idim-result/1");
    assert!(result["validation"]["joints"][1]["r2"].as_f64().unwrap() > 0.999_999);
    let plots = std::fs::read_dir(&folder)
        .unwrap()
        .filter(|f| is_svg(&f.as_ref().unwrap().path()));
    assert_eq!(plots.count(), 2, "one plot a joint");
}

fn is_svg(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "svg")
}

#[test]
fn regress_a_cell_that_is_no_number_names_line_and_column() {
    let mut lines = csv(HEADER, &good());
    lines = lines.replacen(&line(10)[1].to_string(), "nan", 1);
    Bench::new().refused(&lines, &["log.csv", "line 12", "q1", "nan", "finite"]);
}

#[test]
fn regress_time_that_does_not_rise_names_the_line() {
    let mut lines = good();
    lines[100][0] = lines[50][0];
    Bench::new().refused(&csv(HEADER, &lines), &["line 102", "time", "rise"]);
}

#[test]
fn regress_degrees_for_radians_name_joint_and_factor() {
    let mut lines = good();
    for l in &mut lines {
        l[2] = l[2].to_degrees();
    }
    Bench::new().refused(&csv(HEADER, &lines), &["57.", "degrees", "_deg"]);
}

#[test]
fn regress_a_missing_column_says_what_was_found() {
    let header = HEADER.replace("tau2", "temperature");
    Bench::new().refused(&csv(&header, &good()), &["tau", "joint 2", "temperature"]);
}

#[test]
fn regress_an_ambiguous_column_names_both() {
    let header = HEADER.replace("qdd2", "q1_rad");
    Bench::new().refused(&csv(&header, &good()), &["q1", "q1_rad"]);
}

#[test]
fn regress_a_log_of_another_robot_is_refused() {
    let header = HEADER.replace("qdd2", "q3");
    Bench::new().refused(&csv(&header, &good()), &["q3", "2 joints"]);
}

#[test]
fn regress_too_few_samples_say_how_many_are_needed() {
    Bench::new().refused(&csv(HEADER, &good()[..20]), &["20 samples", "at least 50"]);
}

#[test]
fn regress_milliseconds_without_a_unit_are_inferred_where_velocities_confirm_them() {
    let mut lines = good();
    for l in &mut lines {
        l[0] *= 1000.0;
    }
    let text = Bench::new()
        .identify(&csv(HEADER, &lines), &["--as-recorded"])
        .unwrap();
    assert!(text.contains("time unit inferred: ms"), "{text}");
    let unknown = HEADER.replace("qd", "speed");
    Bench::new().refused(&csv(&unknown, &lines), &["t_ms"]);
}

#[test]
fn regress_a_joint_that_stands_still_is_warned_about_and_the_rest_identified() {
    let mut lines = good();
    for l in &mut lines {
        (l[2], l[4], l[6], l[8]) = (0.3, 0.0, 0.0, 0.0);
    }
    let text = Bench::new()
        .identify(&csv(HEADER, &lines), &["--as-recorded"])
        .unwrap();
    assert!(text.contains("stood still"), "{text}");
    assert!(text.contains("excites only"), "{text}");
}

#[test]
fn regress_training_data_do_not_validate() {
    let bench = Bench::new();
    let log = bench.path("log.csv").display().to_string();
    let message = bench
        .identify(&csv(HEADER, &good()), &["--validate", &log])
        .unwrap_err();
    assert!(message.contains("not seen"), "{message}");
}

#[test]
fn regress_robots_that_cannot_be_are_refused_with_place_and_rule() {
    let bench = Bench::new();
    let arm = idim_fixtures::PLANAR2R;
    let cases = [
        (arm.replacen("name:", "nome:", 1), "did you mean name"),
        (arm[..arm.len() / 2].to_owned(), "line"),
        ("<robot><joint></robot>".to_owned(), "line"),
    ];
    for (text, word) in cases {
        let robot = bench.write("bad.ron", &text);
        let message = run(&["reduce", "--robot", &robot]).unwrap_err();
        assert!(
            message.contains("bad.ron") && message.contains(word),
            "{message}"
        );
    }
    let missing = bench.path("nowhere.ron").display().to_string();
    let message = run(&["reduce", "--robot", &missing]).unwrap_err();
    assert!(
        message.contains("nowhere.ron") && message.contains("check the path"),
        "{message}"
    );
    let other = bench.write("arm.txt", arm);
    assert!(
        run(&["reduce", "--robot", &other])
            .unwrap_err()
            .contains(".urdf")
    );
}

#[test]
fn regress_a_joint_to_hold_that_is_not_there_names_those_that_are() {
    let bench = Bench::new();
    let robot = bench.path("arm.ron").display().to_string();
    let message = run(&["reduce", "--robot", &robot, "--lock", "elbo"]).unwrap_err();
    assert!(
        message.contains("elbo") && message.contains("allowed"),
        "{message}"
    );
}

#[test]
fn regress_gravity_of_two_numbers_is_explained() {
    let bench = Bench::new();
    let robot = bench.path("arm.ron").display().to_string();
    let message = run(&["reduce", "--robot", &robot, "--gravity", "0,1"]).unwrap_err();
    assert!(message.contains("three numbers"), "{message}");
}
