//! The repository keeps the rules of the house, and each rule can fail.

use std::path::Path;
use xtask::tidy::{self, Check, Tree};

fn repository() -> Tree {
    Tree::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
}

#[track_caller]
fn assert_clean(check: Check) {
    let findings = check(&repository());
    assert!(findings.is_empty(), "\n{}\n", findings.join("\n"));
}

/// The check finds exactly these words in a tree of these files.
#[track_caller]
fn assert_finds(check: Check, files: &[(&str, &str)], wanted: &[&str]) {
    let files = files
        .iter()
        .map(|&(p, t)| (p.to_owned(), t.to_owned()))
        .collect();
    let findings = check(&Tree { files });
    assert_eq!(findings.len(), wanted.len(), "{findings:#?}");
    for (finding, wanted) in findings.iter().zip(wanted) {
        assert!(
            finding.contains(wanted),
            "{finding:?} does not say {wanted:?}"
        );
    }
}

#[test]
fn the_tree_is_read() {
    let tree = repository();
    assert!(
        tree.text("Cargo.toml")
            .is_some_and(|t| t.contains("[workspace]"))
    );
    assert!(tree.ending(".rs").count() > 20 && tree.has("crates/model/src"));
    assert!(!tree.files.iter().any(|(p, _)| p.starts_with("target/")));
}

#[test]
fn crates_depend_as_the_architecture_says() {
    assert_clean(tidy::arrows);
}

#[test]
fn every_crate_has_the_lints() {
    assert_clean(tidy::lints);
}

#[test]
fn every_version_stands_in_the_root() {
    assert_clean(tidy::shared_versions);
}

#[test]
fn no_file_is_too_long() {
    assert_clean(tidy::lengths);
}

#[test]
fn no_path_of_one_machine() {
    assert_clean(tidy::machine_paths);
}

#[test]
fn nothing_is_left_open() {
    assert_clean(tidy::leftovers);
}

#[test]
fn links_lead_somewhere() {
    assert_clean(tidy::links);
}

#[test]
fn map_and_commands_are_complete() {
    assert_clean(tidy::map);
}

#[test]
fn oracles_have_an_origin() {
    assert_clean(tidy::provenance);
}

#[test]
fn sources_are_listed() {
    assert_clean(tidy::citations);
}

#[test]
fn public_nouns_are_explained() {
    assert_clean(tidy::nouns);
}

#[test]
fn equations_have_their_owners() {
    assert_clean(tidy::owners);
}

#[test]
fn the_result_file_is_explained() {
    assert_clean(tidy::schema);
}

#[test]
fn regress_an_arrow_that_runs_back_up_is_found() {
    let manifest = |name: &str, rest: &str| format!("[package]\nname = \"{name}\"\n{rest}");
    let model = manifest(
        "idim-model",
        "[dependencies]\nserde.workspace = true\nidim-trajectory.workspace = true\n",
    );
    let trajectory = manifest(
        "idim-trajectory",
        "[dependencies.idim-model]\nworkspace = true\n[dev-dependencies]\nidim-fixtures.workspace = true\n",
    );
    let fixtures = manifest("idim-fixtures", "");
    let stranger = manifest("idim-cloud", "");
    assert_finds(
        tidy::arrows,
        &[
            ("crates/model/Cargo.toml", &model),
            ("crates/trajectory/Cargo.toml", &trajectory),
            ("fixtures/Cargo.toml", &fixtures),
            ("crates/cloud/Cargo.toml", &stranger),
            (
                "crates/estimation/src/consistency/mod.rs",
                "use idim_model::InertialParameters;\n",
            ),
            (
                "crates/estimation/src/solve.rs",
                "\nuse idim_model::Robot;\n",
            ),
        ],
        &[
            "crates/model/Cargo.toml:5: idim-model -> idim-trajectory",
            "idim-cloud is not on the map",
            "solve.rs:2: only the physical-consistency module",
        ],
    );
}

#[test]
fn regress_fixtures_are_for_test_code_only() {
    let manifest =
        "[package]\nname = \"idim-estimation\"\n[dependencies]\nidim-fixtures.workspace = true\n";
    let fixtures = "[package]\nname = \"idim-fixtures\"\n";
    assert_finds(
        tidy::arrows,
        &[
            ("crates/estimation/Cargo.toml", manifest),
            ("fixtures/Cargo.toml", fixtures),
        ],
        &["idim-estimation -> idim-fixtures"],
    );
}

#[test]
fn regress_missing_lints_and_own_versions_are_found() {
    let good = "[package]\nname = \"a\"\n[lints]\nworkspace = true\n[dependencies]\nron = { workspace = true, features = [] }\n";
    let bad = "[package]\nname = \"b\"\n[lints.rust]\nunsafe_code = \"allow\"\n[dependencies]\n\
               csv = \"1.4\"\nron.workspace = true\n[dev-dependencies.rand]\nversion = \"0.9\"\n";
    let files = [("crates/a/Cargo.toml", good), ("crates/b/Cargo.toml", bad)];
    assert_finds(tidy::lints, &files, &["crates/b/Cargo.toml: no `[lints]`"]);
    assert_finds(
        tidy::shared_versions,
        &files,
        &["b/Cargo.toml:6: csv", "b/Cargo.toml:8: rand"],
    );
}

#[test]
fn regress_long_files_and_leftovers_are_found() {
    let long = "\n".repeat(501);
    let open = ["// TO", "DO later\nlet x = 1;\ntodo", "!()\n"].concat();
    let files = [
        ("crates/a/src/long.rs", long.as_str()),
        ("crates/a/src/open.rs", &open),
    ];
    assert_finds(tidy::lengths, &files, &["long.rs: 501 lines"]);
    assert_finds(tidy::leftovers, &files, &["open.rs:1", "open.rs:3"]);
}

#[test]
fn regress_paths_of_one_machine_are_found() {
    let text = [
        "see https://example.org/ho",
        "me/x and ../wo",
        "rk/y\nread \"/ho",
        "me/me/log.csv\"\n",
    ]
    .concat();
    assert_finds(tidy::machine_paths, &[("notes.md", &text)], &["notes.md:2"]);
}

#[test]
fn regress_dead_links_are_found() {
    let page = "[a](../README.md#top) [b](gone.md) `[c](code.md)` <img src=\"img/no.svg\">\n\
                [d](https://example.org) [e](#here) [f](../../above.md)\n```\n[g](fenced.md)\n```\n";
    assert_finds(
        tidy::links,
        &[("README.md", ""), ("docs/page.md", page)],
        &[
            "page.md:1: the link to gone.md",
            "img/no.svg",
            "page.md:2: the link to ../../above.md",
        ],
    );
}

#[test]
fn regress_a_room_that_is_not_on_the_map_is_found() {
    let files = [
        (".ci/run", "cargo test --workspace\ncargo xtask identify\n"),
        ("ARCHITECTURE.md", "model"),
        ("README.md", "cargo test --workspace"),
        ("crates/model/Cargo.toml", ""),
        ("crates/attic/Cargo.toml", ""),
    ];
    assert_finds(
        tidy::map,
        &files,
        &[
            "crates/attic is not on it",
            "README.md: `cargo xtask identify`",
        ],
    );
}

#[test]
fn regress_oracles_without_origin_are_found() {
    let good =
        r#"{"provenance": {"tool": "Pinocchio 4.1.0", "generator": "fixtures/oracles/make.py"}}"#;
    let short = r#"{"source": "NIST", "generator": "make.py, exact arithmetic"}"#;
    let found = r#"{"provenance": "a long search", "checked_by": "crates/a/tests/oracle.rs"}"#;
    let gone = r#"{"tool": "scipy 1.17.1", "generator": "gone.py"}"#;
    assert_finds(
        tidy::provenance,
        &[
            ("crates/a/tests/oracle.rs", ""),
            ("fixtures/oracles/make.py", ""),
            ("fixtures/oracles/a.json", good),
            ("fixtures/oracles/b.json", short),
            ("fixtures/oracles/c.json", found),
            ("fixtures/oracles/d.json", gone),
            ("fixtures/oracles/e.json", "{\"x\": 1}"),
        ],
        &[
            "d.json: fixtures/oracles/gone.py is not",
            "e.json: no \"tool\"",
            "e.json: no \"generator\"",
        ],
    );
}

#[test]
fn regress_sources_that_are_not_listed_are_found() {
    let bib = "\n@book{bierman1977,\n  author = {Bierman, Gerald J.},\n  year = {1977},\n}\n\
               @article{swevers1997,\n  author = {Swevers, Jan and Ganseman, Chris},\n  year = 1997,\n}\n";
    let code = [
        "/// Source: Bierman 1977, chapter V; Swevers et al. (1997).",
        "/// In 2006 samples of Joint 3.",
        "/// Also White",
        "/// 1980, and Bierman 1976.",
        "fn f() {}",
        "// Plain 1999 is no documentation.",
    ]
    .join("\n");
    assert_finds(
        tidy::citations,
        &[("crates/a/src/lib.rs", &code), ("docs/sources.bib", bib)],
        &["lib.rs:1: White 1980", "lib.rs:1: Bierman 1976"],
    );
}

#[test]
fn regress_nouns_without_a_line_are_found() {
    let lib = "mod a;\npub use a::{Robot, Pose, FitOptions, Error};\n";
    let code = "pub struct Robot {}\npub struct Pose;\npub enum Error {}\npub struct FitOptions {}\npub struct Hidden;\n";
    assert_finds(
        tidy::nouns,
        &[
            ("crates/model/src/a.rs", code),
            ("crates/model/src/lib.rs", lib),
            ("docs/notation.md", "| `Robot` | as described |"),
        ],
        &["noun Pose"],
    );
}

#[test]
fn regress_an_equation_without_an_owner_is_found() {
    let page =
        "- rank: `idim_base_params::reduce`, `Reduction::rank`\n- gone: `idim_model::newton`\n";
    let code = "pub struct Reduction;\npub fn reduce() {}\nimpl Reduction { pub fn rank() {} }\n";
    let files = [
        ("crates/base-params/src/lib.rs", code),
        ("docs/theory.md", page),
    ];
    assert_finds(
        tidy::owners,
        &files,
        &["theory.md:2: nothing is called newton"],
    );
}

#[test]
fn regress_a_field_without_explanation_is_found() {
    let code = "pub struct Result {\n    pub robot: String,\n    pub mood: f64,\n}\npub const SCHEMA: &str = \"\";\n";
    assert_finds(
        tidy::schema,
        &[
            ("crates/idim/src/result.rs", code),
            ("docs/result.md", "`robot`"),
        ],
        &["the field `mood`"],
    );
}

#[test]
fn every_check_has_a_test() {
    assert_eq!(tidy::CHECKS.len(), 13, "a new check gets two tests above");
}
