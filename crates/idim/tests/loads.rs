//! Loads, drive gains and torque constants, from simulated recordings whose truth is known.
#![allow(clippy::unwrap_used)]

mod command;

use command::run;
use idim_model::{InertialParameters, Joint, Link, Robot, robot_from_ron, robot_to_ron};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&run(arguments).unwrap()).unwrap()
}

const MASS: f64 = 3.0;
const CENTRE: [f64; 3] = [0.03, -0.02, 0.12];

/// A load like a gripper with a part, in the frame of the last link.
fn load() -> InertialParameters {
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.02, 0.03, 0.01));
    InertialParameters::from_centre_of_mass(MASS, CENTRE.into(), &inertia)
}

/// A folder with a PUMA 560, logs of it without and with the load.
struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let arm = robot_from_ron(idim_fixtures::PUMA560).unwrap();
        let mut links: Vec<Link> = arm.links().to_vec();
        let last = links.last_mut().unwrap();
        last.inertial = last.inertial.map(|own| own.plus(&load()));
        let joints: Vec<Joint> = arm.joints().to_vec();
        let loaded = Robot::new("loaded", arm.gravity(), joints, links).unwrap();
        std::fs::write(dir.path().join("arm.ron"), robot_to_ron(&arm)).unwrap();
        std::fs::write(dir.path().join("loaded.ron"), robot_to_ron(&loaded)).unwrap();
        let bench = Self { dir };
        let runs = [
            ("arm", "without", "1"),
            ("loaded", "with", "2"),
            ("arm", "again", "3"),
        ];
        for (robot, log, seed) in runs {
            let (robot, log) = (
                bench.path(&format!("{robot}.ron")),
                bench.path(&format!("{log}.csv")),
            );
            let of = [
                "--noise",
                "0.01",
                "--rate",
                "100",
                "--duration",
                "30",
                "--seed",
                seed,
            ];
            let mut all = vec!["simulate", "--robot", &robot, "--out", &log];
            all.extend(of);
            run(&all).unwrap();
        }
        bench
    }

    fn path(&self, name: &str) -> String {
        self.dir.path().join(name).display().to_string()
    }

    /// The log with each joint's torque divided by its gain, as a drive with a wrong constant records it.
    fn miscounted(&self, log: &str, gains: &[f64]) -> String {
        let text = std::fs::read_to_string(self.path(log)).unwrap();
        let mut lines = text.lines();
        let header = lines.next().unwrap();
        let torque: Vec<Option<f64>> = header
            .split(',')
            .map(|name| {
                let number = name.strip_prefix("tau")?;
                let digits: String = number.chars().take_while(char::is_ascii_digit).collect();
                Some(gains[digits.parse::<usize>().ok()? - 1])
            })
            .collect();
        assert_eq!(torque.iter().flatten().count(), gains.len(), "{header}");
        let mut out = format!("{header}\n");
        for line in lines {
            let cells: Vec<String> = line
                .split(',')
                .zip(&torque)
                .map(|(cell, gain)| match gain {
                    Some(gain) => (cell.parse::<f64>().unwrap() / gain).to_string(),
                    None => cell.to_owned(),
                })
                .collect();
            let _ = writeln!(out, "{}", cells.join(","));
        }
        let name = format!("miscounted-{log}");
        std::fs::write(self.path(&name), out).unwrap();
        self.path(&name)
    }
}

#[test]
fn identity_a_load_is_found_within_its_uncertainty() {
    let bench = Bench::new();
    let [robot, without, with] = ["arm.ron", "without.csv", "with.csv"].map(|n| bench.path(n));
    let found = json(&[
        "payload", "--robot", &robot, "--log", &without, "--loaded", &with, "--json",
    ]);
    let truth = load().0;
    // XX XY XZ YY YZ ZZ MX MY MZ M
    let names = [
        "XX6", "XY6", "XZ6", "YY6", "YZ6", "ZZ6", "MX6", "MY6", "MZ6", "M6",
    ];
    for p in found["parameters"].as_array().unwrap() {
        let name = p["name"].as_str().unwrap();
        let truth = truth[names.iter().position(|n| *n == name).unwrap()];
        let (value, std) = (p["value"].as_f64().unwrap(), p["std"].as_f64().unwrap());
        assert!(
            (value - truth).abs() < 4.0 * std,
            "{name}: {value} ± {std}, {truth}"
        );
        assert!(p["std_from_arm"].as_f64().unwrap() < std);
        if name == "M6" {
            assert!((value / MASS - 1.0).abs() < 0.02, "{value}");
        }
    }
    let text = run(&[
        "payload", "--robot", &robot, "--log", &without, "--loaded", &with,
    ])
    .unwrap();
    assert!(text.contains("centre of mass"), "{text}");
    // The arm's friction and the weights of the rows are chosen as for `identify`.
    let robust = run(&[
        "payload",
        "--robot",
        &robot,
        "--log",
        &without,
        "--loaded",
        &with,
        "--robust",
        "tukey",
        "--weighting",
        "diagonal",
        "--friction",
        "viscous,coulomb",
        "--dead-band",
        "0.1",
        "--rate",
        "50",
    ])
    .unwrap();
    assert!(
        robust.contains("centre of mass") && robust != text,
        "{robust}"
    );
}

#[test]
fn identity_drive_gains_are_found_and_rest_on_the_weighed_mass() {
    let bench = Bench::new();
    let gains = [1.1, 0.9, 1.2, 1.05, 0.8, 1.0];
    let robot = bench.path("arm.ron");
    let (without, with) = (
        bench.miscounted("without.csv", &gains),
        bench.miscounted("with.csv", &gains),
    );
    let of_mass = |mass: f64| {
        let mass = mass.to_string();
        let runs = [
            "drive-gains",
            "--robot",
            &robot,
            "--log",
            &without,
            "--loaded",
            &with,
        ];
        let mut all = runs.to_vec();
        all.extend(["--mass", &mass, "--json"]);
        let found = json(&all);
        let gains = found["gains"].as_array().unwrap().clone();
        let gains: Vec<Option<f64>> = gains.iter().map(Value::as_f64).collect();
        (gains, found)
    };
    let (found, all) = of_mass(MASS);
    for (k, truth) in gains.into_iter().enumerate() {
        let gain = found[k].unwrap_or_else(|| panic!("joint {}: {all:#}", k + 1));
        assert!(
            (gain / truth - 1.0).abs() < 0.1,
            "joint {}: {gain}, {truth}",
            k + 1
        );
    }
    let (wrong, _) = of_mass(1.1 * MASS);
    for (a, b) in found.iter().zip(&wrong) {
        let ratio = b.unwrap() / a.unwrap();
        assert!((ratio - 1.1).abs() < 1e-6, "{ratio}");
    }
    // No load in either: none is felt, and the answer says so.
    let runs = ["drive-gains", "--robot", &robot, "--log", &without];
    let again = bench.miscounted("again.csv", &gains);
    let with = |loaded: &str| {
        let mut all = runs.to_vec();
        all.extend(["--loaded", loaded, "--mass", "3", "--json"]);
        run(&all)
    };
    let nothing: Value = serde_json::from_str(&with(&again).unwrap()).unwrap();
    let gains = nothing["gains"].as_array().unwrap();
    let told = gains.iter().filter(|g| g.as_f64().is_some()).count();
    let said = nothing["warnings"].to_string();
    assert!(
        told == 0 || said.contains("separable") || said.contains("validity"),
        "{nothing:#}"
    );
    let same = with(&without).unwrap_err();
    assert!(same.contains("--log and as --loaded"), "{same}");
}

#[test]
fn identity_gains_are_asked_for_whatever_the_doctor_doubts_of_torques_and_of_nothing_else() {
    let bench = Bench::new();
    let robot = bench.path("arm.ron");
    // A drive that is turned: what the command is to find.
    let gains = [1.0, -1.0, 1.0, 1.0, 1.0, 1.0];
    let [without, with] = ["without.csv", "with.csv"].map(|log| bench.miscounted(log, &gains));
    let runs = |without: &str, with: &str| {
        let words = [
            "--robot", &robot, "--log", without, "--loaded", with, "--json",
        ];
        words.map(str::to_owned).to_vec()
    };
    let found = |all: &[String], command: &[&str]| {
        let words: Vec<&str> = command
            .iter()
            .copied()
            .chain(all.iter().map(String::as_str))
            .collect();
        run(&words)
    };
    let all = runs(&without, &with);
    let answer: Value =
        serde_json::from_str(&found(&all, &["drive-gains", "--mass", "3"]).unwrap()).unwrap();
    let gain = answer["gains"][1].as_f64().unwrap();
    assert!((gain + 1.0).abs() < 0.1, "{answer:#}");
    assert!(
        answer["warnings"].to_string().contains("torque-sign"),
        "{answer:#}"
    );
    // Positions in degrees still stop it.
    let text = std::fs::read_to_string(bench.path("without.csv")).unwrap();
    let degrees = bench.path("degrees.csv");
    let header = text.lines().next().unwrap();
    let at = header.split(',').position(|h| h.starts_with("q3")).unwrap();
    let mut out = header.to_owned() + "\n";
    for line in text.lines().skip(1) {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[at] = cells[at].parse::<f64>().unwrap().to_degrees().to_string();
        out += &(cells.join(",") + "\n");
    }
    std::fs::write(&degrees, out).unwrap();
    for command in [&["payload"][..], &["drive-gains", "--mass", "3"]] {
        let refused = found(&runs(&degrees, &bench.path("with.csv")), command).unwrap_err();
        assert!(
            refused.contains("degrees") || refused.contains("position"),
            "{refused}"
        );
    }
}

#[test]
fn identity_a_torque_constant_is_the_slope_of_back_emf() {
    let dir = tempfile::tempdir().unwrap();
    let file: PathBuf = dir.path().join("emf.csv");
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut text = String::from("motor,speed,voltage\n");
    let (truth, mut noise) = ([0.19, 0.26], || -> f64 { StandardNormal.sample(&mut rng) });
    for k in 0..400 {
        let speed = 150.0 * (0.05 * f64::from(k)).sin();
        for (motor, constant) in ["first", "second"].iter().zip(truth) {
            let voltage = constant * speed + 0.3 + 0.2 * noise();
            let _ = writeln!(text, "{motor},{speed},{voltage}");
        }
    }
    std::fs::write(&file, text).unwrap();
    let found = json(&["torque-constants", path(&file), "--json"]);
    for (motor, truth) in found["motors"].as_array().unwrap().iter().zip(truth) {
        let [value, std] = ["torque_constant", "std"].map(|k| motor[k].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * std && std < 2e-4, "{motor:#}");
    }
    let shown = run(&["torque-constants", path(&file)]).unwrap();
    assert!(!shown.contains("one direction"), "{shown}");
    // The same in another dialect and other units.
    let text = std::fs::read_to_string(&file).unwrap();
    let mut other = String::from("# turned by hand\nVoltage [mV];Speed [rpm];note;Motor\n");
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let [speed, voltage] = [1, 2].map(|k: usize| cells[k].parse::<f64>().unwrap());
        let rpm = speed * 30.0 / std::f64::consts::PI;
        let _ = writeln!(other, "{};{rpm};x;{}", 1e3 * voltage, cells[0]);
    }
    std::fs::write(&file, other.replace('.', ",")).unwrap();
    let same = json(&["torque-constants", path(&file), "--json"]);
    for (a, b) in found["motors"]
        .as_array()
        .unwrap()
        .iter()
        .zip(same["motors"].as_array().unwrap())
    {
        let [a, b] = [a, b].map(|m| m["torque_constant"].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    assert!(
        same["inferred"]
            .to_string()
            .contains("columns left out: note"),
        "{same:#}"
    );
    for (text, words) in [
        (
            "speed,voltage\n1,x\n",
            &["line 2", "column voltage", "`x`"][..],
        ),
        ("speed,voltage\n1,2\n3\n", &["line 3", "1 cells"]),
        ("speed_knots,voltage\n1,2\n", &["`knots`", "rpm"]),
        ("rate,voltage\n1,2\n", &["no column `speed`", "rate"]),
        ("speed,voltage\n1,nan\n", &["line 2", "finite"]),
    ] {
        std::fs::write(&file, text).unwrap();
        let refused = run(&["torque-constants", path(&file)]).unwrap_err();
        for word in words {
            assert!(refused.contains(word), "`{word}` is not in: {refused}");
        }
    }
}

fn path(file: &Path) -> &str {
    file.to_str().unwrap()
}
