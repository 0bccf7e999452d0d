//! The tutorials: every command in them is run, in order, by the program they talk about.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::Command;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// The shell blocks of a page, one after another.
fn commands(page: &str) -> String {
    let text = std::fs::read_to_string(root().join("docs/tutorials").join(page)).unwrap();
    let blocks = text.split("```sh\n").skip(1);
    let blocks: Vec<&str> = blocks.map(|b| b.split("```").next().unwrap()).collect();
    assert!(!blocks.is_empty(), "{page} has no command");
    blocks.join("\n")
}

/// Runs a page in a folder that looks like the repository's, and hands out what it printed; `None` where there is no shell.
fn follow(page: &str, folder: &Path) -> Option<String> {
    for shown in ["docs", "fixtures"] {
        #[cfg(unix)]
        std::os::unix::fs::symlink(
            root().join(shown).canonicalize().unwrap(),
            folder.join(shown),
        )
        .unwrap();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_idim")).parent().unwrap();
    let mut paths = vec![program.to_path_buf()];
    paths.extend(std::env::split_paths(
        &std::env::var_os("PATH").unwrap_or_default(),
    ));
    let run = Command::new("bash")
        .args(["-e", "-u", "-o", "pipefail", "-c", &commands(page)])
        .env("PATH", std::env::join_paths(paths).unwrap())
        .current_dir(folder)
        .output();
    let Ok(output) = run else {
        eprintln!("skipped: no bash here, so nobody follows {page}");
        return None;
    };
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{page}: {errors}\n{text}");
    Some(text)
}

/// R2 of the joints on the held-out motion, as `result.json` has them.
fn held_out(folder: &Path, result: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(folder.join(result)).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let joints = json["validation"]["joints"].as_array().unwrap();
    joints.iter().map(|j| j["r2"].as_f64().unwrap()).collect()
}

#[test]
fn regress_the_paper_robots() {
    let folder = tempfile::tempdir().unwrap();
    if let Some(text) = follow("paper-robots.md", folder.path()) {
        for words in [
            "15 base parameters",
            "36 base parameters",
            "6 base parameters",
            "4 base parameters",
        ] {
            assert!(text.contains(words), "`{words}` is not in {text}");
        }
        assert!(folder.path().join("idim-out/puma/report.html").is_file());
    }
}

#[test]
fn regress_your_own_robot() {
    let folder = tempfile::tempdir().unwrap();
    if follow("your-own-robot.md", folder.path()).is_some() {
        let r2 = held_out(folder.path(), "idim-out/bench-arm/result.json");
        assert!(r2.iter().all(|r| *r > 0.95), "{r2:?}");
    }
}

#[test]
fn regress_currents_and_a_coupled_wrist() {
    let folder = tempfile::tempdir().unwrap();
    if follow("currents-and-coupled-wrist.md", folder.path()).is_some() {
        let good = held_out(folder.path(), "idim-out/wrist-bench/result.json");
        assert!(good.iter().all(|r| *r > 0.95), "{good:?}");
        let bad = held_out(folder.path(), "uncoupled/wrist-bench/result.json");
        assert!(bad.iter().any(|r| *r < 0.8), "{bad:?}");
    }
}
