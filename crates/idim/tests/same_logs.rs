//! A recording under another name is the same recording, and nothing is written over what was read.
#![allow(clippy::unwrap_used)]

mod command;

use command::run;
use std::fmt::Write as _;
use std::path::Path;

/// A motion and the torques of an arm that is nothing but rotor inertia and friction; `t0` s into it.
fn csv(t0: f64, separator: char) -> String {
    let mut text = "t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2\n".replace(',', &separator.to_string());
    for k in 0..1000 {
        let t = t0 + 0.01 * f64::from(k);
        let joint = |w: f64| {
            let (q, qd, qdd) = ((w * t).sin(), w * (w * t).cos(), -w * w * (w * t).sin());
            (q, qd, qdd, 2.0 * qdd + 3.0 * qd)
        };
        let (a, b) = (joint(2.0), joint(3.1));
        let cells = [t, a.0, b.0, a.1, b.1, a.2, b.2, a.3, b.3].map(|v| match separator {
            ',' => v.to_string(),
            // As many digits as other programs write.
            _ => format!("{v:.8e}"),
        });
        let _ = writeln!(text, "{}", cells.join(&separator.to_string()));
    }
    text
}

struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let bench = Self {
            dir: tempfile::tempdir().unwrap(),
        };
        bench.write("arm.ron", idim_fixtures::PLANAR2R);
        bench.write("a.csv", &csv(0.0, ','));
        bench.write("b.csv", &csv(20.0, ','));
        bench
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.dir.path().join(name), text).unwrap();
    }

    fn path(&self, name: &str) -> String {
        self.dir.path().join(name).display().to_string()
    }

    fn identify(&self, more: &[&str]) -> Result<String, String> {
        let [robot, out] = ["arm.ron", "out"].map(|n| self.path(n));
        let fixed = [
            "identify",
            "--robot",
            &robot,
            "--out",
            &out,
            "--as-recorded",
        ];
        run(&[&fixed[..], more].concat())
    }

    #[track_caller]
    fn refused(&self, more: &[&str], words: &[&str]) {
        let message = self.identify(more).unwrap_err();
        for word in words {
            assert!(message.contains(word), "`{word}` is not in: {message}");
        }
        assert!(
            !Path::new(&self.path("out")).exists(),
            "something was written"
        );
    }
}

#[test]
fn regress_a_log_by_another_path_is_the_same() {
    let bench = Bench::new();
    let a = bench.path("a.csv");
    let around =
        bench.path("../") + &format!("{}/a.csv", bench.dir.path().file_name().unwrap().display());
    bench.refused(
        &["--log", &a, "--validate", &around],
        &["given both as --log and as --validate"],
    );
    #[cfg(unix)]
    {
        let link = bench.path("link.csv");
        std::os::unix::fs::symlink(&a, &link).unwrap();
        bench.refused(
            &["--log", &a, "--validate", &link],
            &["link.csv", "given both"],
        );
    }
    let (first, rest) = (format!("{a}@..600"), format!("{around}@600.."));
    bench
        .identify(&["--log", &first, "--validate", &rest])
        .unwrap();
}

#[test]
fn regress_a_copy_of_a_log_is_the_same_in_any_dialect() {
    let bench = Bench::new();
    let [a, b, copy] = ["a.csv", "b.csv", "copy.csv"].map(|n| bench.path(n));
    bench.write("copy.csv", &csv(0.0, ';'));
    bench.refused(
        &["--log", &a, "--validate", &copy],
        &["copy.csv", "samples that --log", "it has not seen"],
    );
    bench.refused(
        &["--log", &a, &copy, "--validate", &b],
        &["copy.csv", "counted twice"],
    );
    bench.refused(
        &["--log", &b, "--validate", &a, &copy],
        &["copy.csv", "counted twice"],
    );
    let range = format!("{copy}@600..");
    let first = format!("{a}@..600");
    bench
        .identify(&["--log", &first, "--validate", &range])
        .unwrap();
    bench.identify(&["--log", &a, "--validate", &b]).unwrap();
    let robot = bench.path("arm.ron");
    let refused = run(&["check", "--robot", &robot, "--log", &a, &copy]).unwrap_err();
    assert!(refused.contains("counted twice"), "{refused}");
}

#[test]
fn regress_nothing_is_written_over_what_was_read() {
    let bench = Bench::new();
    let [robot, a, b] = ["arm.ron", "a.csv", "b.csv"].map(|n| bench.path(n));
    let before = std::fs::read_to_string(&robot).unwrap();
    let refused = run(&["simulate", "--robot", &robot, "--out", &robot]).unwrap_err();
    assert!(
        refused.contains("is read") && refused.contains("--out"),
        "{refused}"
    );
    assert_eq!(std::fs::read_to_string(&robot).unwrap(), before);
    // A robot file among the results of an earlier run.
    bench.identify(&["--log", &a, "--validate", &b]).unwrap();
    let folder = std::fs::read_dir(bench.path("out"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let own = folder.join("model").join("robot.ron");
    std::fs::create_dir_all(own.parent().unwrap()).unwrap();
    std::fs::copy(&robot, &own).unwrap();
    let out = bench.path("out");
    let again = [
        "identify",
        "--robot",
        own.to_str().unwrap(),
        "--log",
        &a,
        "--out",
        &out,
    ];
    let refused = run(&again).unwrap_err();
    assert!(refused.contains("robot.ron is read"), "{refused}");
    assert_eq!(std::fs::read_to_string(&own).unwrap(), before);
    // A motion among the files of the design to come.
    let samples = folder.join("samples.csv");
    std::fs::copy(&a, &samples).unwrap();
    let design = [
        "excite",
        "--robot",
        &robot,
        "--log",
        samples.to_str().unwrap(),
        "--out",
        &out,
    ];
    let refused = run(&design).unwrap_err();
    assert!(refused.contains("samples.csv is read"), "{refused}");
}
