//! What a terminal, a pipe and a script see of a run.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the binary in a folder.
fn idim(folder: &Path, arguments: &[&str], stdout: Stdio) -> Output {
    Command::new(env!("CARGO_BIN_EXE_idim"))
        .current_dir(folder)
        .args(arguments)
        .stdout(stdout)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
        .wait_with_output()
        .unwrap()
}

/// A planar arm whose first joint's name would colour a terminal, and a log of nothing but rotor inertia and friction.
fn bench() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let robot = idim_model::robot_from_ron(idim_fixtures::PLANAR2R).unwrap();
    let first = robot.joints()[0].name.clone();
    let hostile = idim_fixtures::PLANAR2R.replace(&format!("\"{first}\""), "\"a\\u{1b}[31mb\"");
    std::fs::write(dir.path().join("arm.ron"), hostile).unwrap();
    let mut text = String::from("t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2\n");
    for k in 0..1000 {
        let t = 0.01 * f64::from(k);
        let joint = |w: f64| {
            let (q, qd, qdd) = ((w * t).sin(), w * (w * t).cos(), -w * w * (w * t).sin());
            (q, qd, qdd, 2.0 * qdd + 3.0 * qd)
        };
        let (a, b) = (joint(2.0), joint(3.1));
        let cells = [t, a.0, b.0, a.1, b.1, a.2, b.2, a.3, b.3].map(|v| v.to_string());
        let _ = writeln!(text, "{}", cells.join(","));
    }
    std::fs::write(dir.path().join("log.csv"), text).unwrap();
    dir
}

const IDENTIFY: [&str; 6] = [
    "identify",
    "--robot",
    "arm.ron",
    "--log",
    "log.csv",
    "--as-recorded",
];

#[test]
fn regress_names_from_files_move_no_cursor() {
    let bench = bench();
    let check = ["check", "--robot", "arm.ron", "--log", "log.csv"];
    let reduce = ["reduce", "--robot", "arm.ron"];
    let refused = [
        "identify", "--robot", "arm.ron", "--log", "log.csv", "--waive", "gaps:c",
    ];
    for arguments in [&IDENTIFY[..], &check, &reduce, &refused] {
        let done = idim(bench.path(), arguments, Stdio::piped());
        let bytes = [done.stdout, done.stderr].concat();
        assert!(
            !bytes.contains(&0x1b),
            "{}",
            String::from_utf8_lossy(&bytes)
        );
        assert!(!bytes.is_empty());
    }
}

#[test]
fn regress_a_reader_that_has_gone_is_no_failure() {
    let bench = bench();
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let done = idim(bench.path(), &IDENTIFY, writer.into());
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && said.is_empty(), "{said}");
    let results = std::fs::read_dir(bench.path().join("idim-out")).unwrap();
    let folder = results.last().unwrap().unwrap().path();
    assert!(folder.join("result.json").exists());
}

#[test]
fn regress_the_terminal_ends_with_the_verdict_and_strict_with_its_code() {
    let bench = bench();
    let out = |more: &[&str]| {
        idim(
            bench.path(),
            &[&IDENTIFY[..], more].concat(),
            Stdio::piped(),
        )
    };
    let good = out(&["--strict"]);
    let text = String::from_utf8(good.stdout).unwrap();
    assert!(text.contains("Verdict: Good."), "{text}");
    assert_eq!(good.status.code(), Some(0));
    // A rigid body alone has no word for friction.
    let poor = out(&["--columns"]);
    let text = String::from_utf8(poor.stdout).unwrap();
    assert!(text.contains("Verdict: Not to be trusted."), "{text}");
    assert_eq!(poor.status.code(), Some(0), "said, but no failure");
    std::fs::remove_dir_all(bench.path().join("idim-out")).unwrap();
    let strict = out(&["--strict", "--columns"]);
    assert_eq!(strict.status.code(), Some(3));
    let said = String::from_utf8(strict.stderr).unwrap();
    assert!(
        said.contains("Not to be trusted") && said.contains("--strict"),
        "{said}"
    );
    assert!(
        bench.path().join("idim-out").exists(),
        "written all the same"
    );
}

#[test]
fn regress_too_few_rows_are_told_by_what_became_of_the_samples() {
    let bench = bench();
    let few = [
        "--log",
        "log.csv",
        "--validate",
        "log.csv@500..",
        "--dead-band",
        "1e4",
    ];
    let few = [&["identify", "--robot", "arm.ron"], &few[..]].concat();
    let few: Vec<&str> = few
        .iter()
        .map(|a| if *a == "log.csv" { "log.csv@..500" } else { a })
        .collect();
    let done = idim(bench.path(), &few, Stdio::piped());
    let said = String::from_utf8(done.stderr).unwrap();
    for word in [
        "log.csv",
        "0 rows for",
        "--dead-band",
        "samples in 1 stretches",
    ] {
        assert!(said.contains(word), "`{word}` is not in: {said}");
    }
}

#[test]
fn regress_friction_says_each_term_once() {
    let bench = bench();
    for (friction, word) in [
        (&["viscous,coulomb,viscous"][..], "`viscous` stands twice"),
        (&["stribeck:0.1,stribeck:0.2"], "`stribeck` stands twice"),
        (&["none,viscous"], "`none` beside others"),
        (&["viscous", "coulomb"], "given twice"),
        (&["auto", "viscous"], "`auto`"),
    ] {
        let mut arguments = IDENTIFY[..5].to_vec();
        for f in friction {
            arguments.extend(["--friction", f]);
        }
        let done = idim(bench.path(), &arguments, Stdio::piped());
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(said.contains(word), "`{word}` is not in: {said}");
        assert_eq!(done.status.code(), Some(1));
    }
}
