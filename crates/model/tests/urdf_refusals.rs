//! URDF files that are refused: line, value, rule and next step of each.

#![allow(clippy::unwrap_used)]

use idim_model::{Error, robot_from_ron, robot_from_urdf};
use proptest::prelude::{ProptestConfig, proptest};

/// Line 1 opens the robot, 2 and 3 are links, 4 is the joint `a`, its attributes and inside replaced.
fn arm(kind: &str, inside: &str) -> String {
    format!(
        "<robot name=\"test\">\n<link name=\"root\"/>\n<link name=\"la\"/>\n<joint name=\"a\" type=\"{kind}\"><parent \
         link=\"root\"/><child link=\"la\"/>{inside}</joint>\n</robot>\n"
    )
}

fn revolute(inside: &str) -> String {
    arm("revolute", inside)
}

/// The arm with more elements behind its joint, from line 5 on.
fn with(more: &str) -> String {
    revolute("").replace("</robot>", &format!("{more}</robot>"))
}

fn body(inside: &str) -> String {
    revolute("").replace(
        "<link name=\"la\"/>",
        &format!("<link name=\"la\"><inertial>{inside}</inertial></link>"),
    )
}

#[track_caller]
fn assert_refused(text: &str, parts: &[&str]) {
    let error = robot_from_urdf(text).unwrap_err();
    assert!(matches!(error, Error::Syntax { .. } | Error::Robot { .. }));
    let message = error.to_string();
    let shown = &text[..text.len().min(2000)];
    for part in parts {
        assert!(
            message.contains(part),
            "{part:?} is not in {message:?}, the answer to\n{shown}"
        );
    }
}

const TENSOR: &str = "<inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>";

#[test]
fn regress_what_is_no_urdf_is_refused() {
    assert_refused("", &["line 1", "not well-formed XML", "export it again"]);
    assert_refused(
        "<robot name=\"x\">\n<link name=\"a\">\n</robot>",
        &["line 3", "expected 'link' tag, not 'robot'"],
    );
    assert_refused(
        "\n<sdf/>",
        &[
            "line 2, column 1",
            "<sdf> as the outermost element",
            "export it as URDF",
        ],
    );
    assert_refused(
        "<robot name=\"x\"/>",
        &["no link", "needs links and joints"],
    );
    assert_refused(
        "<robot name=\"x\"><link name=\"a\"/></robot>",
        &["no moving joint"],
    );
}

#[test]
fn regress_a_doctype_is_refused_with_its_line() {
    let laughs = "<?xml version=\"1.0\"?>\n<!-- <!DOCTYPE in a comment is fine -->\n<!DOCTYPE robot [<!ENTITY a \"ha\">]>\n";
    assert_refused(
        &format!("{laughs}{}", revolute("")),
        &[
            "line 3, column 1",
            "DOCTYPE",
            "expand without bound",
            "remove it",
        ],
    );
    let comment = format!("<!-- <!DOCTYPE -->\n{}", revolute(""));
    assert_eq!(robot_from_urdf(&comment).unwrap().n_joints(), 1);
}

#[test]
fn regress_unexpanded_xacro_is_refused_with_the_command() {
    let next = "expand it first: xacro robot.xacro > robot.urdf";
    assert_refused(
        &with("<xacro:arm prefix=\"\"/>"),
        &["line 5, column 1", "xacro", next],
    );
    assert_refused(
        &revolute("<origin xyz=\"0 0 ${length}\"/>"),
        &["line 4", next],
    );
    // The name space alone, as expanded files have it, is no offence.
    let expanded = revolute("").replace(
        "<robot ",
        "<robot xmlns:xacro=\"http://wiki.ros.org/xacro\" ",
    );
    assert_eq!(robot_from_urdf(&expanded).unwrap().n_joints(), 1);
}

#[test]
fn regress_hostile_sizes_are_refused() {
    assert_refused(
        &" ".repeat((64 << 20) + 1),
        &["67108865 bytes", "at most 67108864"],
    );
    let deep = format!("<robot>{}{}</robot>", "<a>".repeat(300), "</a>".repeat(300));
    assert_refused(&deep, &["line 1, column 773", "nested deeper than 256"]);
    let flood: Vec<String> = (0..2000).map(|k| format!(" a{k}=\">\"")).collect();
    let flood = flood.concat();
    assert_refused(
        &format!("<robot>\n<link{flood}/></robot>"),
        &["line 2, column 1", "more than 1000 attributes"],
    );
    let many: Vec<String> = (0..1100)
        .map(|k| format!("<link name=\"l{k}\"/>"))
        .collect();
    let many = many.concat();
    assert_refused(
        &format!("<robot>{many}</robot>"),
        &["more than 1000 joints or links"],
    );
}

#[test]
fn regress_joint_types_that_are_not_one_drive_are_refused() {
    for kind in ["floating", "planar"] {
        let parts = [
            "line 4, column 1",
            "joint a",
            kind,
            "several directions at once",
            "make it fixed",
        ];
        assert_refused(&arm(kind, ""), &parts);
    }
    assert_refused(
        &arm("revolut", ""),
        &[
            "line 4",
            "unknown type \"revolut\"",
            "did you mean revolute?",
            "continuous, prismatic, fixed",
        ],
    );
    assert_refused(
        &revolute("").replace(" type=\"revolute\"", ""),
        &["line 4", "<joint> without type", "add it"],
    );
}

#[test]
fn regress_what_is_no_tree_is_refused_with_both_lines() {
    let b = |parent: &str, child: &str| {
        format!(
            "<joint name=\"b\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>"
        )
    };
    assert_refused(
        &with("<link name=\"la\"/>"),
        &[
            "line 5, column 1",
            "link la: name used twice, first on line 3",
            "rename",
        ],
    );
    assert_refused(
        &with(&format!(
            "<link name=\"lb\"/>{}",
            b("la", "lb").replace("\"b\"", "\"a\"")
        )),
        &["line 5", "joint a: name used twice, first on line 4"],
    );
    assert_refused(
        &with("<link name=\"lb\"/>"),
        &[
            "line 5",
            "link lb",
            "not connected: link root on line 2",
            "connect it",
        ],
    );
    assert_refused(
        &with(&b("la", "root")),
        &["line 4", "a loop, without a root", "cut the loop"],
    );
    assert_refused(
        &with(&b("root", "la")),
        &[
            "line 5",
            "link la is the child of two joints",
            "joint a on line 4",
        ],
    );
    let ring = format!(
        "<link name=\"x\"/><link name=\"y\"/>{}{}",
        b("x", "y"),
        b("y", "x").replace("\"b\"", "\"c\"")
    );
    assert_refused(
        &with(&ring),
        &[
            "line 5",
            "a loop of joints that the root does not reach: b (line 5), c (line 5)",
        ],
    );
    assert_refused(
        &with(&b("la", "lx")),
        &[
            "line 5",
            "child link \"lx\" is not in the file",
            "did you mean la?",
        ],
    );
    assert_refused(
        &with("<joint name=\"b\" type=\"fixed\"/>"),
        &["line 5", "<joint> without <parent>"],
    );
}

#[test]
fn regress_bad_numbers_are_refused_with_their_place() {
    let origin = |xyz: &str| revolute(&format!("\n<origin xyz=\"{xyz}\"/>"));
    for bad in [
        "0 0",
        "0 0 0 0",
        "0 0 nan",
        "0 0 1e400",
        "0 0 0x1",
        "0,5 0 0",
        "0 0 \u{2212}1",
        "a b c",
    ] {
        let given = format!("xyz={bad:?}");
        let parts = [
            "line 5, column 9",
            "joint a",
            &given,
            "3 finite numbers separated by blanks, with a decimal point",
        ];
        assert_refused(&origin(bad), &parts);
    }
    let parts = [
        "line 4",
        "velocity=\"fast\"",
        "1 finite number, with a decimal point",
    ];
    assert_refused(&revolute("<limit velocity=\"fast\"/>"), &parts);
}

#[test]
fn regress_joints_that_cannot_be_are_refused() {
    assert_refused(
        &revolute("<axis xyz=\"0 0 0\"/>"),
        &[
            "line 4, column 1",
            "joint a: axis [0.0, 0.0, 0.0]",
            "needs a direction",
        ],
    );
    assert_refused(
        &revolute("<limit lower=\"2\" upper=\"1\"/>"),
        &[
            "line 4",
            "position limits 2 to 1",
            "lower limit must be below",
        ],
    );
    assert_refused(
        &revolute("<limit velocity=\"-1\"/>"),
        &["line 4", "velocity limit -1", "above zero; leave it out"],
    );
    assert_refused(
        &revolute("<dynamics damping=\"-1\"/>"),
        &["line 4", "viscous friction -1", "cannot be below zero"],
    );
}

#[test]
fn regress_inertial_values_that_cannot_be_are_refused() {
    let mass = |value: &str| body(&format!("\n<mass value=\"{value}\"/>{TENSOR}"));
    assert_refused(
        &mass("-1"),
        &[
            "line 4, column 1",
            "link la: mass -1 kg",
            "cannot be below zero",
            "leave the inertial out",
        ],
    );
    assert_refused(
        &mass("inf"),
        &["line 4", "value=\"inf\"", "1 finite number"],
    );
    assert_refused(&mass(""), &["line 4", "<mass> without value"]);
    assert_refused(
        &body(TENSOR),
        &[
            "line 3",
            "<inertial> without <mass>",
            "leave the whole inertial out",
        ],
    );
    assert_refused(
        &body("<mass value=\"1\"/>"),
        &["<inertial> without <inertia>"],
    );
    let partial = body(&format!("<mass value=\"1\"/>{TENSOR}")).replace(" ixy=\"0\"", "");
    assert_refused(&partial, &["line 3", "<inertia> without ixy", "add it"]);
}

/// A piece cut out, another put in its place: the way of truncation, merge conflicts and careless editors.
fn damaged(text: &str, from: usize, length: usize, piece: &str) -> String {
    let characters: Vec<char> = text.chars().collect();
    let from = from % characters.len();
    let to = (from + length).min(characters.len());
    let (before, after) = (&characters[..from], &characters[to..]);
    before
        .iter()
        .chain(&piece.chars().collect::<Vec<_>>())
        .chain(after)
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Any answer will do but a panic.
    #[test]
    fn identity_damaged_files_are_answered(
        from in 0..100_000_usize, length in 0..40_usize, piece in "[<>/=\"'() \\-.0-9a-zé\n!\\[{$]{0,12}",
    ) {
        for text in [idim_fixtures::UR5_URDF, idim_fixtures::PANDA_URDF] {
            let _ = robot_from_urdf(&damaged(text, from, length, &piece));
        }
        for text in [idim_fixtures::CRS_A460, idim_fixtures::PUMA560] {
            let _ = robot_from_ron(&damaged(text, from, length, &piece));
        }
    }
}
