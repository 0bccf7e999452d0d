//! What stands in the files.

use super::Tree;

/// Lines a source file may have.
const LONGEST_FILE: usize = 500;

/// No source file is longer than a reader's patience.
pub fn lengths(tree: &Tree) -> Vec<String> {
    tree.ending(".rs")
        .map(|(path, text)| (path, text.lines().count()))
        .filter(|&(_, n)| n > LONGEST_FILE)
        .map(|(path, n)| format!("{path}: {n} lines; split it, {LONGEST_FILE} are the most"))
        .collect()
}

/// Folders that exist on one machine only.
const MACHINE_FOLDERS: [&str; 5] = ["work", "tmp", "home", "root", "farm"];

/// No path of somebody's machine in any file.
pub fn machine_paths(tree: &Tree) -> Vec<String> {
    let mut findings = Vec::new();
    for (path, number, line) in lines(tree) {
        for folder in MACHINE_FOLDERS {
            let needle = format!("/{folder}/");
            let absolute = |at: usize| {
                let before = line[..at].chars().next_back();
                before.is_none_or(|c| !(c.is_alphanumeric() || c == '.' || c == '_'))
            };
            if line.match_indices(&needle).any(|(at, _)| absolute(at)) {
                findings.push(format!(
                    "{path}:{number}: `{needle}` is a path of one machine; make it relative"
                ));
            }
        }
    }
    findings
}

/// Marks of unfinished work. In two halves, so that this file holds none.
const LEFTOVERS: [(&str, &str); 6] = [
    ("TO", "DO"),
    ("FIX", "ME"),
    ("HA", "CK:"),
    ("todo", "!("),
    ("unimplemented", "!("),
    ("#[ig", "nore"),
];

/// Nothing left open in the code or the papers around it.
pub fn leftovers(tree: &Tree) -> Vec<String> {
    let ends = [".rs", ".md", ".toml", ".py", ".ron", "run"];
    let mut findings = Vec::new();
    for (path, number, line) in lines(tree).filter(|(p, ..)| ends.iter().any(|e| p.ends_with(e))) {
        for (a, b) in LEFTOVERS {
            let mark = format!("{a}{b}");
            if line.contains(&mark) {
                findings.push(format!(
                    "{path}:{number}: `{mark}`; finish it or open an issue"
                ));
            }
        }
    }
    findings
}

/// Links between the pages lead somewhere.
pub fn links(tree: &Tree) -> Vec<String> {
    let mut findings = Vec::new();
    for (path, text) in tree.ending(".md") {
        let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
        let mut in_code = false;
        for (k, line) in text.lines().enumerate() {
            in_code ^= line.trim_start().starts_with("```");
            if in_code {
                continue;
            }
            for target in targets(line) {
                let file = target.split('#').next().unwrap_or_default();
                let outside = target.contains("://") || target.starts_with("mailto:");
                if !outside
                    && !file.is_empty()
                    && !resolve(folder, file).is_some_and(|p| tree.has(&p))
                {
                    findings.push(format!(
                        "{path}:{}: the link to {target} leads nowhere",
                        k + 1
                    ));
                }
            }
        }
    }
    findings
}

/// Every crate stands on the map, and the README's commands are the ones CI runs.
pub fn map(tree: &Tree) -> Vec<String> {
    let page = tree.text("ARCHITECTURE.md").unwrap_or_default();
    let rooms = tree
        .ending("/Cargo.toml")
        .filter_map(|(path, _)| path.strip_suffix("/Cargo.toml"));
    let mut findings: Vec<String> = rooms
        .filter(|room| !page.contains(room.trim_start_matches("crates/")))
        .map(|room| format!("ARCHITECTURE.md: {room} is not on it; add a line"))
        .collect();
    let (readme, ci) = (tree.text("README.md"), tree.text(".ci/run"));
    for command in ["cargo test --workspace", "cargo xtask identify"] {
        for (name, text) in [("README.md", readme), (".ci/run", ci)] {
            if !text.is_some_and(|t| t.contains(command)) {
                findings.push(format!(
                    "{name}: `{command}` is missing; a newcomer and CI run the same"
                ));
            }
        }
    }
    findings
}

fn lines(tree: &Tree) -> impl Iterator<Item = (&str, usize, &str)> {
    tree.files.iter().flat_map(|(path, text)| {
        text.lines()
            .enumerate()
            .map(move |(k, line)| (path.as_str(), k + 1, line))
    })
}

/// Targets of `](target)`, `src="target"` and `href="target"` in a line of Markdown, outside code spans.
fn targets(line: &str) -> Vec<&str> {
    let plain = line.split('`').step_by(2);
    let openings = [("](", ')'), ("src=\"", '"'), ("href=\"", '"')];
    let find = |part| {
        openings
            .iter()
            .flat_map(move |&(open, close): &(&str, char)| {
                str::split(part, open)
                    .skip(1)
                    .filter_map(move |rest| rest.split(close).next())
            })
    };
    plain.flat_map(find).collect()
}

/// The path of `file` seen from `folder`; `None` above the root.
fn resolve(folder: &str, file: &str) -> Option<String> {
    let mut parts: Vec<&str> = folder.split('/').filter(|p| !p.is_empty()).collect();
    for part in file.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            name => parts.push(name),
        }
    }
    Some(parts.join("/"))
}
