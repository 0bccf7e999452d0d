//! The rules of the house that a machine can check.
//!
//! Each check takes the [`Tree`] and returns one line a finding: place, what was met, what to do. `tests/tidy.rs` runs
//! them all, so that a green `cargo test` is a green CI.

mod manifests;
mod sources;
mod text;

pub use manifests::{arrows, lints, shared_versions};
pub use sources::{citations, nouns, owners, provenance, schema};
pub use text::{leftovers, lengths, links, machine_paths, map};

use std::path::Path;
use std::process::Command;

/// A check: findings, one line each; empty where all is well.
pub type Check = fn(&Tree) -> Vec<String>;

/// Every check with its name.
pub const CHECKS: [(&str, Check); 13] = [
    ("arrows", arrows),
    ("lints", lints),
    ("shared versions", shared_versions),
    ("lengths", lengths),
    ("machine paths", machine_paths),
    ("leftovers", leftovers),
    ("links", links),
    ("map", map),
    ("provenance", provenance),
    ("citations", citations),
    ("nouns", nouns),
    ("owners", owners),
    ("schema", schema),
];

/// The text files of the repository.
#[derive(Debug, Clone, Default)]
pub struct Tree {
    /// Path from the root, `/` between its parts, and content; sorted by path.
    pub files: Vec<(String, String)>,
}

impl Tree {
    /// Files git tracks under `root`, or all of them where there is no git; those that are not UTF-8 are left out.
    pub fn read(root: &Path) -> Self {
        let paths = tracked(root).unwrap_or_else(|| walk(root, ""));
        let read = |path: String| {
            let text = std::fs::read_to_string(root.join(&path)).ok()?;
            Some((path, text))
        };
        let mut files: Vec<_> = paths.into_iter().filter_map(read).collect();
        files.sort();
        Self { files }
    }

    /// Content of one file.
    pub fn text(&self, path: &str) -> Option<&str> {
        let found = self.files.iter().find(|(p, _)| p == path)?;
        Some(&found.1)
    }

    /// Whether there is a file or folder of this path.
    pub fn has(&self, path: &str) -> bool {
        let folder = format!("{path}/");
        let here = |(p, _): &(String, String)| p == path || p.starts_with(&folder);
        path.is_empty() || self.files.iter().any(here)
    }

    /// Files whose name ends so.
    pub fn ending<'a>(&'a self, end: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
        let wanted = self.files.iter().filter(move |(p, _)| p.ends_with(end));
        wanted.map(|(p, t)| (p.as_str(), t.as_str()))
    }
}

fn tracked(root: &Path) -> Option<Vec<String>> {
    let listed = Command::new("git")
        .args(["ls-files", "-z"])
        .current_dir(root)
        .output()
        .ok()?;
    let names = String::from_utf8(listed.stdout).ok()?;
    let names: Vec<String> = names.split_terminator('\0').map(String::from).collect();
    (listed.status.success() && names.iter().any(|n| n == "Cargo.toml")).then_some(names)
}

/// Without git: everything but what is built.
fn walk(root: &Path, folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(root.join(folder))
        .into_iter()
        .flatten()
        .flatten()
    {
        let Ok(name) = entry.file_name().into_string() else {
            continue;
        };
        if name == ".git" || (folder.is_empty() && (name == "target" || name == "idim-out")) {
            continue;
        }
        let path = if folder.is_empty() {
            name
        } else {
            format!("{folder}/{name}")
        };
        if entry.path().is_dir() {
            found.extend(walk(root, &path));
        } else {
            found.push(path);
        }
    }
    found
}
