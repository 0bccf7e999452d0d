//! Who may depend on whom, and with what.

use super::Tree;

/// Every arrow between the crates, as in ARCHITECTURE.md; `*` is any. Test code may use the fixtures besides.
const ARROWS: [(&str, &[&str]); 10] = [
    ("idim-model", &[]),
    ("idim-base-params", &[]),
    ("idim-trajectory", &["idim-model"]),
    ("idim-measurement", &["idim-model"]),
    (
        "idim-excitation",
        &["idim-model", "idim-base-params", "idim-trajectory"],
    ),
    ("idim-estimation", &["idim-model"]),
    ("idim", &["*"]),
    ("idim-fixtures", &["*"]),
    ("idim-benches", &["*"]),
    ("xtask", &["idim"]),
];

/// The one place of `estimation` that may know the model: the type of a link's ten parameters.
const PHYSICAL: &str = "crates/estimation/src/consistency";

/// Crates depend on each other as the architecture says.
pub fn arrows(tree: &Tree) -> Vec<String> {
    let members: Vec<Manifest> = members(tree);
    let ours = |name: &str| members.iter().any(|m| m.name == name);
    let mut findings = Vec::new();
    for m in &members {
        let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| *name == m.name) else {
            findings.push(format!(
                "{}: crate {} is not on the map; a new room goes into ARCHITECTURE.md and xtask/src/tidy/manifests.rs",
                m.path, m.name
            ));
            continue;
        };
        for d in m.dependencies.iter().filter(|d| ours(&d.name)) {
            let in_tests = d.section == "dev-dependencies" && d.name == "idim-fixtures";
            if !in_tests && !allowed.contains(&"*") && !allowed.contains(&d.name.as_str()) {
                findings.push(format!(
                    "{}:{}: {} -> {} is no arrow of the architecture; remove it, or change the map with its reason",
                    m.path, d.line, m.name, d.name
                ));
            }
        }
    }
    for (path, text) in tree.ending(".rs") {
        let outside = path.starts_with("crates/estimation/src/") && !path.starts_with(PHYSICAL);
        if let (true, Some(line)) = (outside, text.lines().position(|l| l.contains("idim_model"))) {
            findings.push(format!(
                "{path}:{}: only the physical-consistency module ({PHYSICAL}*) may know idim-model",
                line + 1
            ));
        }
    }
    findings
}

/// Every crate has the workspace's lints.
pub fn lints(tree: &Tree) -> Vec<String> {
    let inherits = |text: &str| {
        let mut after = text.lines().skip_while(|l| l.trim() != "[lints]");
        after.nth(1).map(str::trim) == Some("workspace = true")
    };
    members(tree)
        .iter()
        .filter(|m| !inherits(m.text))
        .map(|m| format!("{}: no `[lints]` with `workspace = true`; add it", m.path))
        .collect()
}

/// Every dependency takes its version from the root's table.
pub fn shared_versions(tree: &Tree) -> Vec<String> {
    let mut findings = Vec::new();
    for m in &members(tree) {
        for d in m.dependencies.iter().filter(|d| !d.from_workspace) {
            findings.push(format!(
                "{}:{}: {} does not come from [workspace.dependencies]; write `{}.workspace = true`",
                m.path, d.line, d.name, d.name
            ));
        }
    }
    findings
}

struct Manifest<'a> {
    path: &'a str,
    text: &'a str,
    name: String,
    dependencies: Vec<Dependency>,
}

struct Dependency {
    name: String,
    section: String,
    line: usize,
    from_workspace: bool,
}

/// Manifests of the members: every Cargo.toml but the root's.
fn members(tree: &Tree) -> Vec<Manifest<'_>> {
    tree.ending("/Cargo.toml")
        .map(|(path, text)| parse(path, text))
        .collect()
}

/// Reads the little of TOML that the manifests use: `key = value`, `key.workspace = true`, `[section.name]`.
fn parse<'a>(path: &'a str, text: &'a str) -> Manifest<'a> {
    let mut name = String::new();
    let mut dependencies: Vec<Dependency> = Vec::new();
    let mut section = String::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if let Some(header) = line.strip_prefix('[') {
            header.trim_end_matches(']').clone_into(&mut section);
            if let Some((table, of)) = section.rsplit_once('.')
                && table.ends_with("dependencies")
            {
                let (of, table) = (of.to_owned(), table.to_owned());
                dependencies.push(dependency(&of, &table, number, ""));
            }
            continue;
        }
        let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else {
            continue;
        };
        let (key, value) = (key.trim(), value.trim());
        if section == "package" && key == "name" {
            value.trim_matches('"').clone_into(&mut name);
        } else if section.ends_with("dependencies") {
            dependencies.push(dependency(key, &section, number, value));
        } else if let Some(last) = dependencies.last_mut()
            && section.ends_with(&format!("dependencies.{}", last.name))
            && key == "workspace"
        {
            last.from_workspace = value == "true";
        }
    }
    Manifest {
        path,
        text,
        name,
        dependencies,
    }
}

fn dependency(key: &str, section: &str, number: usize, value: &str) -> Dependency {
    let (name, dotted) = key.split_once('.').unwrap_or((key, ""));
    Dependency {
        name: name.trim_matches('"').to_owned(),
        section: section.rsplit('.').next().unwrap_or_default().to_owned(),
        line: number + 1,
        from_workspace: dotted == "workspace" || value.contains("workspace = true"),
    }
}
