//! What a run leaves in its folder of results, and what it must not touch.
#![allow(clippy::unwrap_used)]

mod command;

use command::run;
use std::path::{Path, PathBuf};

/// A folder with a PUMA's first three joints and a log of it.
struct Bench {
    dir: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("arm.ron"), idim_fixtures::PUMA560).unwrap();
        let bench = Self { dir };
        let [robot, log] = ["arm.ron", "log.csv"].map(|n| bench.path(n));
        run(&[
            "simulate", "--robot", &robot, "--out", &log, "--rate", "100",
        ])
        .unwrap();
        bench
    }

    fn path(&self, name: &str) -> String {
        self.dir.path().join(name).display().to_string()
    }

    fn identify(&self, more: &[&str]) -> Result<String, String> {
        let [robot, log, out] = ["arm.ron", "log.csv", "out"].map(|n| self.path(n));
        let mut all = vec!["identify", "--robot", &robot, "--log", &log, "--out", &out];
        all.extend(more);
        run(&all)
    }

    fn results(&self) -> PathBuf {
        let mut folders = std::fs::read_dir(self.path("out")).unwrap();
        folders.next().unwrap().unwrap().path()
    }
}

/// Every file below a folder.
fn files(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            names.extend(files(&path).into_iter().map(|n| format!("{name}/{n}")));
        } else {
            names.push(name);
        }
    }
    names.sort();
    names
}

#[test]
fn regress_files_of_an_earlier_run_do_not_stay_beside_a_new_result() {
    let bench = Bench::new();
    bench.identify(&[]).unwrap();
    let folder = bench.results();
    // As a run with other joints and a prior would have left them, and files that are not idim's.
    let stale = [
        "torque-7-gripper.svg",
        "torque-1-other.svg",
        "model/robot.urdf",
    ];
    let others = [
        "notes.txt",
        "torque-curve.svg",
        "model/mine.c",
        "motion.svg",
    ];
    for name in stale.iter().chain(&others) {
        std::fs::write(folder.join(name), "old").unwrap();
    }
    let written = files(&folder);
    assert!(written.contains(&"model/predictor.c".into()), "{written:?}");
    bench.identify(&[]).unwrap();
    let now = files(&folder);
    assert!(now.contains(&"result.json".into()) && now.contains(&"report.html".into()));
    for name in &stale {
        // A run may have written one of its own; what lay there before is gone.
        let text = std::fs::read_to_string(folder.join(name)).unwrap_or_default();
        assert_ne!(text, "old", "{name}: {now:?}");
    }
    for kept in others {
        assert!(now.contains(&kept.into()), "{kept}: {now:?}");
    }
}
