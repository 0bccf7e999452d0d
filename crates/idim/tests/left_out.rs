//! Parts of logs left out, torques that saturate, drift or come late, as a user meets them.
#![allow(clippy::unwrap_used)]

mod command;

use command::run;
use serde_json::Value;
use std::fmt::Write as _;

/// Viscous friction of both joints, N·m·s/rad.
const VISCOUS: f64 = 3.0;

/// A log of 20 s at 100 Hz of an arm that is nothing but rotor inertia and friction, its torques changed by `change`: joint,
/// time, torque as a function of time.
fn csv(change: impl Fn(usize, f64, &dyn Fn(f64) -> f64) -> f64) -> String {
    let mut text = String::from("t,q1,q2,qd1,qd2,tau1,tau2\n");
    let speeds = [[2.0, 5.3], [3.1, 6.7]];
    for k in 0..2000 {
        let t = 0.01 * f64::from(k);
        let sum =
            |j: usize, f: &dyn Fn(f64) -> f64| -> f64 { speeds[j].iter().map(|&w| f(w)).sum() };
        let q = |j: usize| sum(j, &|w| 0.5 * (w * t).sin());
        let qd = |j: usize| sum(j, &|w| 0.5 * w * (w * t).cos());
        let torque = |j: usize| {
            let of = |t: f64| {
                sum(j, &|w| {
                    0.5 * (VISCOUS * w * (w * t).cos() - 2.0 * w * w * (w * t).sin())
                })
            };
            change(j, t, &of)
        };
        let cells = [t, q(0), q(1), qd(0), qd(1), torque(0), torque(1)].map(|v| v.to_string());
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new(log: &str) -> Self {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("arm.ron"), idim_fixtures::PLANAR2R).unwrap();
        std::fs::write(dir.path().join("log.csv"), log).unwrap();
        Self { dir }
    }

    fn path(&self, name: &str) -> String {
        self.dir.path().join(name).display().to_string()
    }

    fn run(&self, command: &str, more: &[&str]) -> Result<String, String> {
        let [robot, log, out] = ["arm.ron", "log.csv", "out"].map(|n| self.path(n));
        let mut all = vec![command, "--robot", &robot, "--log", &log];
        if command == "identify" {
            all.extend(["--out", &out]);
        }
        run(&[&all[..], more].concat())
    }

    /// Viscous friction of a joint, and the output.
    #[track_caller]
    fn viscous(&self, joint: usize, more: &[&str]) -> (f64, String) {
        let text = self.run("identify", more).unwrap_or_else(|e| panic!("{e}"));
        let folder = std::fs::read_dir(self.path("out")).unwrap().next().unwrap();
        let json = std::fs::read_to_string(folder.unwrap().path().join("result.json")).unwrap();
        let result: Value = serde_json::from_str(&json).unwrap();
        let parameters = result["estimate"]["parameters"].as_array().unwrap().clone();
        let name = format!("Fv{joint}");
        let own = parameters.iter().find(|p| p["name"] == *name);
        (
            own.unwrap_or_else(|| panic!("{result:#}"))["value"]
                .as_f64()
                .unwrap(),
            text,
        )
    }
}

#[test]
fn identity_an_excluded_part_says_nothing() {
    // From 5 to 7 s the arm leans on something.
    let bench = Bench::new(&csv(|_, t, torque| {
        torque(t)
            + if (5.0..7.0).contains(&t) {
                -8.0 * (2.0 * t).cos()
            } else {
                0.0
            }
    }));
    let (with, _) = bench.viscous(1, &[]);
    assert!((with - VISCOUS).abs() > 0.05, "{with}");
    for part in ["4.9s..7.1s", "log.csv:490..711"] {
        let (without, text) = bench.viscous(1, &["--exclude", part]);
        assert!((without - VISCOUS).abs() < 1e-3, "{part}: {without}");
        assert!(
            text.contains("left out as stated") && text.contains("gaps 1"),
            "{text}"
        );
    }
    let refused = bench
        .run("identify", &["--exclude", "30s..40s"])
        .unwrap_err();
    assert!(
        refused.contains("hold no sample") && refused.contains("19.99"),
        "{refused}"
    );
    let refused = bench
        .run("check", &["--exclude", "other.csv:1..2"])
        .unwrap_err();
    assert!(
        refused.contains("--exclude other.csv") && refused.contains("log.csv"),
        "{refused}"
    );
}

#[test]
fn identity_bad_rows_split_the_log_where_asked() {
    let good = csv(|_, t, torque| torque(t));
    let lines: Vec<&str> = good.lines().collect();
    let mut bad: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
    bad[700] = bad[700].rsplit_once(',').unwrap().0.to_owned() + ",nan";
    let bench = Bench::new(&(bad.join("\n") + "\n"));
    let refused = bench.run("identify", &[]).unwrap_err();
    assert!(
        refused.contains("line 701") && refused.contains("--drop-bad"),
        "{refused}"
    );
    let (value, text) = bench.viscous(2, &["--drop-bad"]);
    assert!((value - VISCOUS).abs() < 1e-3, "{value}");
    assert!(text.contains("1 bad rows of 2000 left out"), "{text}");
}

#[test]
fn identity_saturated_rows_are_left_out_and_said() {
    let bench = Bench::new(&csv(|j, t, torque| {
        let limit = if j == 0 { 25.0 } else { f64::INFINITY };
        torque(t).clamp(-limit, limit)
    }));
    let (value, text) = bench.viscous(1, &[]);
    assert!((value - VISCOUS).abs() < 0.02, "{value}\n{text}");
    assert!(
        text.contains("at its limit in") && text.contains("saturated"),
        "{text}"
    );
    let check = bench.run("check", &[]).unwrap();
    assert!(check.contains("saturation"), "{check}");
}

#[test]
fn identity_a_stated_delay_is_taken_out() {
    let bench = Bench::new(&csv(|_, t, torque| torque(t - 0.04)));
    let (late, _) = bench.viscous(1, &[]);
    let (mended, text) = bench.viscous(1, &["--delay", "40"]);
    assert!((late - VISCOUS).abs() > 0.2, "{late}");
    assert!((mended - VISCOUS).abs() < 1e-2, "{mended}");
    assert!(text.contains("taken out: 40 ms"), "{text}");
    let mapping = bench.path("m.ron");
    std::fs::write(&mapping, "(delays: [(seconds: 0.04)])").unwrap();
    let (mapped, _) = bench.viscous(1, &["--mapping", &mapping]);
    assert_eq!(mapped.to_bits(), mended.to_bits());
    for (more, words) in [
        (
            &["--delay", "40", "--mapping", &mapping][..],
            &["--delay and --mapping"][..],
        ),
        (
            &["--delay", "wrist=40"],
            &["delay of wrist", "the joints are"],
        ),
        (&["--delay", "40", "--delay", "30"], &["two delays"]),
        (&["--topic", "/arm"], &["/arm", "none of the logs is a bag"]),
    ] {
        let refused = bench.run("identify", more).unwrap_err();
        for word in words {
            assert!(refused.contains(word), "`{word}` is not in: {refused}");
        }
    }
}

#[test]
fn identity_a_torque_that_drifts_is_found_and_one_that_does_not_is_left_alone() {
    let found = |drift: f64| {
        let bench = Bench::new(&csv(|j, t, torque| {
            let ripple = 0.4 * (11.0 * t).sin() + 0.3 * (17.3 * t).cos();
            torque(t) + ripple + if j == 1 { drift * t / 20.0 } else { 0.0 }
        }));
        let json = bench.run("check", &["--json"]).unwrap();
        let result: Value = serde_json::from_str(&json).unwrap();
        let findings = result["logs"][0]["findings"].as_array().unwrap().clone();
        let drifts = findings.into_iter().filter(|f| f["code"] == "torque-drift");
        drifts.collect::<Vec<_>>()
    };
    assert_eq!(found(0.0), Vec::<Value>::new());
    let drifting = found(20.0);
    assert_eq!(drifting.len(), 1, "{drifting:#?}");
    let size = drifting[0]["value"].as_f64().unwrap();
    assert!((size / 20.0 - 1.0).abs() < 0.2, "{size}");
    assert_eq!(drifting[0]["place"]["joint"], "elbow");
}

#[test]
fn identity_few_independent_samples_are_told() {
    let whole = csv(|_, t, torque| torque(t));
    let part: Vec<&str> = whole.lines().take(201).collect();
    let short = Bench::new(&(part.join("\n") + "\n"));
    let said = short.run("check", &[]).unwrap();
    assert!(said.contains("few-samples"), "{said}");
    let long = Bench::new(&whole).run("check", &[]).unwrap();
    assert!(!long.contains("few-samples"), "{long}");
    // A log to prove a model on may be short: nothing is estimated from it.
    let bench = Bench::new(&whole);
    let log = bench.dir.path().join("log.csv").display().to_string();
    let ask = |learn: &str, prove: &str| {
        let [learn, prove] = [learn, prove].map(|range| format!("{log}@{range}"));
        let [robot, out] = ["arm.ron", "out"].map(|f| bench.dir.path().join(f));
        let [robot, out] = [robot.to_str().unwrap(), out.to_str().unwrap()];
        let files = ["identify", "--robot", robot, "--out", out];
        run(&[&files[..], &["--log", &learn, "--validate", &prove]].concat()).unwrap()
    };
    assert!(ask("0..200", "200..2000").contains("few-samples"));
    assert!(!ask("200..2000", "0..200").contains("few-samples"));
}
