//! Instruction counts of the kernels against committed numbers.
//!
//! A count is the difference between a run of a kernel three times and once, so that what comes before cancels; callgrind
//! counts every instruction of the process. It does not know AVX-512: the kernels then take their AVX2 arm, on every machine
//! that has one, and the counts do not depend on the machine. They do depend on the compiler.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// Committed numbers.
pub const FILE: &str = "benches/instructions.ron";
/// Share by which a count may differ: allocation and hashing move it by less, a spoilt kernel by more.
pub const TOLERANCE: f64 = 0.02;

/// Instructions of one run of every kernel, and what they depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// `rustc --version`.
    pub compiler: String,
    /// Instruction set the kernels take under valgrind.
    pub instructions_of: String,
    /// Kernel by kernel.
    pub counts: BTreeMap<String, u64>,
}

/// What is wrong, in one line each; nothing when all counts are within the tolerance.
pub fn compare(committed: &Counts, measured: &Counts) -> Vec<String> {
    let mut findings = Vec::new();
    for (name, &now) in &measured.counts {
        let Some(&before) = committed.counts.get(name) else {
            findings.push(format!(
                "{name}: not in {FILE}; add it with `cargo xtask gate --bless`"
            ));
            continue;
        };
        let change = now as f64 / before as f64 - 1.0;
        if change.abs() <= TOLERANCE {
            continue;
        }
        let verdict = if change > 0.0 {
            "slower: find out why; if it is meant, commit the new number with its reason"
        } else {
            "faster: commit the new number, so that it stays so"
        };
        findings.push(format!(
            "{name}: {now} instructions, {:+.1} % against the committed {before}: {verdict} (`cargo xtask gate --bless`)",
            100.0 * change
        ));
    }
    for name in committed.counts.keys() {
        if !measured.counts.contains_key(name) {
            findings.push(format!("{name}: in {FILE}, but no such kernel is run"));
        }
    }
    findings
}

/// Counts of every kernel; `instructions(name, times)` counts a whole process that runs it so often.
///
/// # Errors
/// As `instructions`.
pub fn measure(
    names: &[String],
    mut instructions: impl FnMut(&str, u64) -> Result<u64, String>,
) -> Result<BTreeMap<String, u64>, String> {
    let mut counts = BTreeMap::new();
    for name in names {
        let (once, thrice) = (instructions(name, 1)?, instructions(name, 3)?);
        counts.insert(name.clone(), thrice.saturating_sub(once) / 2);
    }
    Ok(counts)
}

/// Runs the gate; `bless` writes the new numbers instead.
///
/// # Errors
/// What is wrong, ready to print.
pub fn run(root: &Path, bless: bool) -> Result<String, String> {
    let compiler = output(Command::new("rustc").arg("--version"))?;
    output(Command::new("cargo").current_dir(root).args([
        "build",
        "--quiet",
        "--release",
        "--package",
        "idim-benches",
        "--bin",
        "kernels",
    ]))?;
    let kernels = target(root)?.join("release/kernels");
    let names: Vec<String> = output(Command::new(&kernels).arg("--list"))?
        .lines()
        .map(str::to_owned)
        .collect();
    let counts = measure(&names, |name, times| {
        callgrind(&kernels, &[name, &times.to_string()])
    })?;
    let measured = Counts {
        compiler,
        instructions_of: arm().to_owned(),
        counts,
    };
    let file = root.join(FILE);
    if bless {
        let text = ron::ser::to_string_pretty(&measured, ron::ser::PrettyConfig::default())
            .map_err(|e| e.to_string())?;
        std::fs::write(&file, text + "\n").map_err(|e| format!("{FILE}: {e}"))?;
        return Ok(table(&measured, &measured));
    }
    let text = std::fs::read_to_string(&file).map_err(|e| format!("{FILE}: {e}"))?;
    let committed: Counts = ron::from_str(&text).map_err(|e| format!("{FILE}: {e}"))?;
    judge(&committed, &measured)
}

/// The table where all is well or nothing can be compared, the findings where not.
///
/// # Errors
/// The findings.
pub fn judge(committed: &Counts, measured: &Counts) -> Result<String, String> {
    for (what, a, b) in [
        ("compiler", &committed.compiler, &measured.compiler),
        (
            "instruction set",
            &committed.instructions_of,
            &measured.instructions_of,
        ),
    ] {
        if a != b {
            return Ok(format!(
                "{}\nnot compared: counted with {what} {a}, this is {b}; look at the numbers, then `cargo xtask gate --bless`",
                table(committed, measured)
            ));
        }
    }
    let findings = compare(committed, measured);
    if findings.is_empty() {
        return Ok(table(committed, measured));
    }
    Err(findings.join("\n"))
}

fn table(committed: &Counts, measured: &Counts) -> String {
    let mut lines = vec![format!(
        "{:<24}{:>14}{:>14}{:>9}",
        "instructions", "committed", "now", "change"
    )];
    for (name, now) in &measured.counts {
        let before = committed.counts.get(name).copied().unwrap_or(0);
        let change = 100.0 * (*now as f64 / before.max(1) as f64 - 1.0);
        lines.push(format!("{name:<24}{before:>14}{now:>14}{change:>+8.2}%"));
    }
    lines.join("\n")
}

/// What the dispatch of the kernels finds under valgrind.
fn arm() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        return "x86-64 AVX2";
    }
    "baseline"
}

fn callgrind(program: &Path, arguments: &[&str]) -> Result<u64, String> {
    let run = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(arguments)
        .output()
        .map_err(|e| format!("valgrind: {e}; install it"))?;
    let text = String::from_utf8_lossy(&run.stderr);
    collected(&text).ok_or_else(|| format!("valgrind said no count:\n{text}"))
}

/// The number after `Collected :`.
fn collected(text: &str) -> Option<u64> {
    let line = text.lines().find(|l| l.contains("Collected :"))?;
    line.split_once("Collected :")?.1.trim().parse().ok()
}

/// Where cargo builds to.
fn target(root: &Path) -> Result<std::path::PathBuf, String> {
    let text = output(Command::new("cargo").current_dir(root).args([
        "metadata",
        "--format-version",
        "1",
        "--no-deps",
    ]))?;
    let key = "\"target_directory\":\"";
    let rest = text.split_once(key).ok_or("cargo metadata: no target")?.1;
    Ok(rest.split('"').next().unwrap_or_default().into())
}

fn output(command: &mut Command) -> Result<String, String> {
    let run = command.output().map_err(|e| format!("{command:?}: {e}"))?;
    if run.status.success() {
        return Ok(String::from_utf8_lossy(&run.stdout).trim().to_owned());
    }
    let errors = String::from_utf8_lossy(&run.stderr);
    Err(format!("{command:?} failed:\n{errors}"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn counts(of: &[(&str, u64)]) -> Counts {
        Counts {
            compiler: "rustc 1".into(),
            instructions_of: "x86-64 AVX2".into(),
            counts: of.iter().map(|&(name, n)| (name.to_owned(), n)).collect(),
        }
    }

    /// A process that prepares itself, then runs a kernel of so many steps.
    fn process(steps: u64) -> impl FnMut(&str, u64) -> Result<u64, String> {
        move |_, times| Ok(12_345 + times * steps)
    }

    #[test]
    fn identity_a_slower_kernel_is_reported_and_an_equal_one_is_not() {
        let names = ["gram".to_owned()];
        let committed = counts(&[("gram", 1000)]);
        let with = |steps| Counts {
            counts: measure(&names, process(steps)).unwrap(),
            ..committed.clone()
        };
        assert_eq!(
            judge(&committed, &with(1000)),
            Ok(table(&committed, &committed))
        );
        assert!(judge(&committed, &with(1019)).is_ok());
        let slow = judge(&committed, &with(1021)).unwrap_err();
        assert!(
            slow.contains("gram: 1021") && slow.contains("slower"),
            "{slow}"
        );
        let fast = judge(&committed, &with(970)).unwrap_err();
        assert!(fast.contains("faster"), "{fast}");
    }

    #[test]
    fn identity_kernels_that_come_and_go_are_reported() {
        let (a, b) = (counts(&[("gram", 1000)]), counts(&[("qr", 1000)]));
        let findings = compare(&a, &b);
        assert!(findings[0].starts_with("qr: not in"));
        assert!(findings[1].starts_with("gram: in"));
    }

    #[test]
    fn identity_another_compiler_is_told_and_not_judged() {
        let committed = counts(&[("gram", 1000)]);
        let mut other = counts(&[("gram", 2000)]);
        other.compiler = "rustc 2".into();
        assert!(judge(&committed, &other).unwrap().contains("not compared"));
    }

    #[test]
    fn oracle_the_line_of_callgrind() {
        let text = "==1== Events    : Ir\n==1== Collected : 1234567\n==1==\n";
        assert_eq!(collected(text), Some(1_234_567));
    }
}
