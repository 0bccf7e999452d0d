//! RON robot files that are refused: place, value, rule and next step of each.

#![allow(clippy::unwrap_used)]

use idim_model::{Error, robot_from_ron};

fn file(joints: &str) -> String {
    format!(
        "(\n    name: \"test\",\n    angles: Degrees,\n    gravity: (0, 0, -9.81),\n    joints: {joints},\n)"
    )
}

#[test]
fn regress_joints_that_cannot_be_held_are_refused() {
    let robot = robot_from_ron(idim_fixtures::PLANAR2R).unwrap();
    let message = |held: &[(String, f64)]| robot.hold_joints(held).unwrap_err().to_string();
    let unknown = message(&[("elbo".into(), 0.0)]);
    assert!(
        unknown.contains("held joint elbo") && unknown.contains("did you mean elbow?"),
        "{unknown}"
    );
    assert!(message(&[("elbow".into(), f64::NAN)]).contains("finite"));
    assert!(message(&[("elbow".into(), 0.0), ("elbow".into(), 0.0)]).contains("twice"));
    assert!(message(&[("elbow".into(), 0.0), ("shoulder".into(), 0.0)]).contains("no joint left"));
}

/// The file with one joint on line 6, these fields behind its name.
fn joint(fields: &str) -> String {
    file(&format!(
        "ModifiedDh([\n        (name: \"a\", {fields}),\n    ])"
    ))
}

/// The file with joint a on line 6 and another, of these fields, on line 7.
fn two(second: &str) -> String {
    file(&format!(
        "ModifiedDh([\n        (name: \"a\", frame: ()),\n        ({second}),\n    ])"
    ))
}

#[track_caller]
fn assert_refused(text: &str, parts: &[&str]) {
    let message = robot_from_ron(text).unwrap_err().to_string();
    for part in parts {
        assert!(
            message.contains(part),
            "{part:?} is not in {message:?}, the answer to\n{text}"
        );
    }
}

#[test]
fn regress_what_is_not_ron_is_refused() {
    assert_refused(
        "hello",
        &["line 1", "expected struct `Robot` but found `hello`"],
    );
    assert_refused("", &["line 1, column 1", "expected opening `(`"]);
    assert_refused(
        &file("ModifiedDh([(name: \"a\", frame: ())"),
        &["line 6, column 1", "expected opening `(`"],
    );
    assert_refused(
        &joint("frame: (alpha: \"90\")"),
        &["line 6", "expected float"],
    );
}

#[test]
fn regress_fields_that_do_not_exist_are_refused_with_the_nearest() {
    assert_refused(
        &joint("frame: (alpha: 90, lenght: 1)"),
        &[
            "line 6, column 40",
            "no field lenght in ModifiedDh",
            "allowed: gamma, b, alpha, d, theta, r",
        ],
    );
    assert_refused(
        &joint("frame: (a: 1)"),
        &["line 6, column 29", "d is the distance along x (Craig's a)"],
    );
    assert_refused(
        &joint("frame: (), limits: (velocty: 3)"),
        &[
            "did you mean velocity?",
            "allowed: position, velocity, acceleration, torque",
        ],
    );
    assert_refused(
        &joint("frame: (), kind: Spherical"),
        &[
            "line 6",
            "Spherical is not a choice",
            "allowed: Revolute, Prismatic, Fixed",
        ],
    );
    assert_refused(
        &file("Urdf([])"),
        &[
            "line 5",
            "Urdf is not a choice",
            "ModifiedDh, StandardDh, Poses",
        ],
    );
}

#[test]
fn regress_fields_that_are_missing_are_refused_with_an_example() {
    let without = |line: &str| file("ModifiedDh([])").replace(line, "");
    assert_refused(
        &without("    gravity: (0, 0, -9.81),\n"),
        &[
            "the field gravity is missing",
            "for example gravity: (0, 0, -9.81)",
        ],
    );
    assert_refused(
        &without("    angles: Degrees,\n"),
        &[
            "the field angles is missing",
            "angles: Degrees or angles: Radians",
        ],
    );
    assert_refused(
        &joint("link: \"l\""),
        &["line 6", "the field frame is missing in Joint"],
    );
}

#[test]
fn regress_numbers_that_are_not_finite_are_refused_where_they_stand() {
    let gravity = file("ModifiedDh([])").replace("-9.81", "NaN");
    assert_refused(
        &gravity,
        &["line 4, column 21", "NaN where a finite number is needed"],
    );
    assert_refused(
        &joint("frame: (alpha: inf)"),
        &["line 6, column 36", "inf where a finite number is needed"],
    );
}

#[test]
fn regress_values_that_cannot_be_are_refused() {
    let body = "frame: (), inertial: CentreOfMass(mass: -1, centre: (0, 0, 0), inertia: (xx: 1, yy: 1, zz: 1))";
    assert_refused(
        &joint(body),
        &[
            "line 6, column 16",
            "link link1: mass -1 kg",
            "cannot be below zero",
            "leave the inertial out",
        ],
    );
    assert_refused(
        &joint("frame: (), limits: (position: (90, -90))"),
        &[
            "line 6",
            "joint a: position limits 1.57",
            "lower limit must be below",
        ],
    );
    assert_refused(
        &joint("frame: (), limits: (velocity: 0)"),
        &["line 6", "velocity limit 0", "above zero; leave it out"],
    );
    assert_refused(
        &joint("frame: (), limits: (acceleration: -3)"),
        &["acceleration limit -", "above zero"],
    );
    assert_refused(
        &joint("frame: (), actuator: (gear_ratio: 0)"),
        &["gear ratio 0", "other than zero"],
    );
    assert_refused(
        &joint("frame: (), kind: Fixed, limits: (velocity: 1)"),
        &[
            "line 6",
            "joint a: a fixed joint with limits",
            "leave them out",
        ],
    );
    assert_refused(
        &joint("frame: (), kind: Fixed"),
        &[
            "test: no moving joint",
            "at least one revolute or prismatic",
        ],
    );
}

#[test]
fn regress_names_that_do_not_fit_are_refused_with_both_lines() {
    assert_refused(
        &two("name: \"a\", frame: ()"),
        &[
            "line 7, column 16",
            "joint a: name used twice, first on line 6",
            "rename",
        ],
    );
    assert_refused(
        &two("name: \"b\", link: \"link1\", frame: ()"),
        &["line 7", "link link1: name used twice, first on line 6"],
    );
    assert_refused(
        &two("name: \"b\", parent: \"c\", frame: ()"),
        &[
            "line 7",
            "joint b: unknown parent c",
            "further up in the file",
            "allowed: a, link1, base",
        ],
    );
}

#[test]
fn regress_poses_need_an_axis_with_a_direction() {
    let message = |frame: &str| {
        let text = file(&format!("Poses([(name: \"a\", frame: ({frame}))])"));
        robot_from_ron(&text).unwrap_err().to_string()
    };
    assert!(message("").contains("no axis in its frame"));
    let zero = message("axis: (0, 0, 0)");
    assert!(
        zero.contains("line 5") && zero.contains("needs a direction"),
        "{zero}"
    );
}

#[test]
fn regress_errors_of_files_carry_line_and_column() {
    let error = robot_from_ron(&file("ModifiedDh([(nme: \"a\")])")).unwrap_err();
    assert!(
        matches!(
            error,
            Error::Syntax {
                line: 5,
                column: 26,
                ..
            }
        ),
        "{error:?}"
    );
}
