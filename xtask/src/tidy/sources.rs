//! Where numbers, equations and words come from.

use super::Tree;
use std::path::Path;

const ORACLES: &str = "fixtures/oracles/";

/// Every oracle says what computed it and by which script here, or, for what was searched for, which test recomputes it.
pub fn provenance(tree: &Tree) -> Vec<String> {
    let mut findings = Vec::new();
    for (path, text) in tree
        .files
        .iter()
        .filter(|(p, _)| p.starts_with(ORACLES) && Path::new(p).extension() != Some("py".as_ref()))
    {
        let origin = ["tool", "source", "provenance"]
            .into_iter()
            .any(|key| value(text, key).is_some());
        if !origin {
            findings.push(format!(
                "{path}: no \"tool\" (with its version) or \"source\"; say what computed it"
            ));
        }
        let script = value(text, "generator").map(|v| format!("{ORACLES}{}", file_name(v)));
        let test = value(text, "checked_by").map(str::to_owned);
        match script.or(test) {
            None => findings.push(format!(
                "{path}: no \"generator\" that names a script beside it (or \"checked_by\" a test); an oracle without origin is a rumour"
            )),
            Some(file) if tree.text(&file).is_none() => {
                findings.push(format!("{path}: {file} is not in the repository; add it"));
            }
            Some(_) => {}
        }
    }
    findings
}

/// What follows `"key":` in a JSON text.
fn value<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    let rest = text.split_once(&format!("\"{key}\":"))?.1.trim_start();
    Some(
        rest.trim_start_matches(['"', '{'])
            .split('"')
            .next()
            .unwrap_or_default(),
    )
}

/// `make.py` of `fixtures/oracles/make.py, exact arithmetic`.
fn file_name(words: &str) -> &str {
    let first = words.split([' ', ',']).next().unwrap_or_default();
    first.rsplit('/').next().unwrap_or_default()
}

/// Every author with a year in the documentation of the code is an entry of `docs/sources.bib`.
pub fn citations(tree: &Tree) -> Vec<String> {
    let entries = bibliography(tree.text("docs/sources.bib").unwrap_or_default());
    let mut findings = Vec::new();
    for (path, text) in tree.ending(".rs") {
        for (line, paragraph) in doc_paragraphs(text) {
            for (author, year) in author_years(&paragraph) {
                let known =
                    |(authors, y): &(String, String)| *y == year && authors.contains(&author);
                if !entries.iter().any(known) {
                    findings.push(format!(
                        "{path}:{line}: {author} {year} is not in docs/sources.bib; add the source"
                    ));
                }
            }
        }
    }
    findings
}

/// Authors and year of each entry.
fn bibliography(bib: &str) -> Vec<(String, String)> {
    let field = |entry: &str, name: &str| {
        let line = entry.lines().find(|l| l.trim_start().starts_with(name))?;
        Some(
            line.split_once('=')?
                .1
                .trim()
                .trim_matches([',', '{', '}', '"'])
                .to_owned(),
        )
    };
    let entries = bib
        .split("\n@")
        .filter_map(|e| Some((field(e, "author")?, field(e, "year")?)));
    entries.collect()
}

/// Documentation comments joined to paragraphs, with the line each starts on.
fn doc_paragraphs(text: &str) -> Vec<(usize, String)> {
    let mut paragraphs: Vec<(usize, String)> = Vec::new();
    let mut open = false;
    for (k, line) in text.lines().enumerate() {
        let line = line.trim_start();
        let doc = line
            .strip_prefix("///")
            .or_else(|| line.strip_prefix("//!"))
            .map_or("", str::trim);
        match (doc.is_empty(), open, paragraphs.last_mut()) {
            (false, true, Some((_, last))) => {
                last.push(' ');
                last.push_str(doc);
            }
            (false, ..) => paragraphs.push((k + 1, doc.to_owned())),
            (true, ..) => {}
        }
        open = !doc.is_empty();
    }
    paragraphs
}

/// `Bierman 1977`, `Swevers et al. 1997`, `Gautier & Khalil (1991)`: the last author named before each year.
fn author_years(paragraph: &str) -> Vec<(String, String)> {
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    let mut found = Vec::new();
    for (k, word) in words.iter().enumerate() {
        let year: String = word
            .trim_start_matches('(')
            .chars()
            .take_while(char::is_ascii_digit)
            .collect();
        if year.len() != 4 || !(year.starts_with("19") || year.starts_with("20")) {
            continue;
        }
        let before = &words[..k];
        let before = before
            .strip_suffix(&["et", "al."])
            .or(before.strip_suffix(&["et", "al.,"]))
            .unwrap_or(before);
        let Some(author) = before
            .last()
            .map(|w| w.trim_matches(['(', ',', ';', '[', '`']))
        else {
            continue;
        };
        let surname = author.chars().next().is_some_and(char::is_uppercase)
            && author.chars().skip(1).all(|c| c.is_lowercase() || c == '-');
        if surname && author.chars().count() > 2 {
            found.push((author.to_owned(), year));
        }
    }
    found
}

/// Crates whose public nouns are explained in one place.
const LIBRARIES: [&str; 6] = [
    "model",
    "base-params",
    "trajectory",
    "measurement",
    "estimation",
    "excitation",
];

/// Every public type of the libraries has its line in `docs/notation.md`; option structs explain themselves.
pub fn nouns(tree: &Tree) -> Vec<String> {
    let page = tree.text("docs/notation.md").unwrap_or_default();
    let mut findings = Vec::new();
    for library in LIBRARIES {
        let folder = format!("crates/{library}/src/");
        let root = tree.text(&format!("{folder}lib.rs")).unwrap_or_default();
        let exports: String = root
            .split("pub use ")
            .skip(1)
            .filter_map(|e| e.split(';').next())
            .collect();
        let exported = |name: &str| {
            exports
                .split(|c: char| !c.is_alphanumeric())
                .any(|n| n == name)
        };
        for (path, text) in tree.files.iter().filter(|(p, _)| p.starts_with(&folder)) {
            for name in text.lines().filter_map(declared_type) {
                let explained = page.contains(&format!("`{name}`"));
                if exported(name) && !explained && name != "Error" && !name.ends_with("Options") {
                    findings.push(format!(
                        "{path}: the public noun {name} has no line in docs/notation.md; add one, or keep it private"
                    ));
                }
            }
        }
    }
    findings
}

fn declared_type(line: &str) -> Option<&str> {
    let rest = line
        .strip_prefix("pub struct ")
        .or_else(|| line.strip_prefix("pub enum "))?;
    rest.split(|c: char| !c.is_alphanumeric()).next()
}

/// Functions and types that `docs/theory.md` names exist.
pub fn owners(tree: &Tree) -> Vec<String> {
    const PAGE: &str = "docs/theory.md";
    let mut findings = Vec::new();
    for (k, line) in tree.text(PAGE).unwrap_or_default().lines().enumerate() {
        for name in line
            .split('`')
            .skip(1)
            .step_by(2)
            .flat_map(|code| code.split("::"))
        {
            let path = name.starts_with("idim_")
                || name.contains(|c: char| !(c.is_alphanumeric() || c == '_'));
            let owned = |keyword: &str| {
                let declaration = format!("{keyword} {name}");
                tree.ending(".rs")
                    .any(|(p, text)| p.starts_with("crates/") && text.contains(&declaration))
            };
            if !path && !["fn", "struct", "enum"].into_iter().any(owned) {
                findings.push(format!(
                    "{PAGE}:{}: nothing is called {name}; name the function that owns the equation",
                    k + 1
                ));
            }
        }
    }
    findings
}

/// Every field of `result.json` is documented.
pub fn schema(tree: &Tree) -> Vec<String> {
    let page = tree.text("docs/result.md").unwrap_or_default();
    let source = tree.text("crates/idim/src/result.rs").unwrap_or_default();
    let field = |line: &'_ str| {
        Some(
            line.trim_start()
                .strip_prefix("pub ")?
                .split_once(':')?
                .0
                .to_owned(),
        )
    };
    let fields = source
        .lines()
        .filter_map(field)
        .filter(|f| f.chars().all(|c| c.is_alphanumeric() || c == '_'));
    fields
        .filter(|f| !page.contains(&format!("`{f}`")))
        .map(|f| format!("docs/result.md: the field `{f}` of result.json is not explained; add it"))
        .collect()
}
