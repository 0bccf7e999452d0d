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

/// Each text with what its refusal must say; the position is checked with it.
#[test]
fn regress_bad_files_are_refused_with_place_value_rule_and_next_step() {
    let joint = |inside: &str| {
        file(&format!(
            "ModifiedDh([\n        (name: \"a\", {inside}),\n    ])"
        ))
    };
    let two = |second: &str| {
        file(&format!(
            "ModifiedDh([\n        (name: \"a\", frame: ()),\n        ({second}),\n    ])"
        ))
    };
    let mass = |m: &str| {
        joint(&format!(
            "frame: (), inertial: CentreOfMass(mass: {m}, centre: (0, 0, 0), inertia: (xx: 1, yy: 1, zz: 1))"
        ))
    };
    let cases: [(String, &[&str]); 24] = [
        ("hello".into(), &["line 1", "Robot"]),
        (String::new(), &["line 1, column 1", "expected opening `(`"]),
        (
            file("ModifiedDh([(name: \"a\", frame: ())"),
            &["line 6, column 1", "expected opening `(`"],
        ),
        (
            joint("frame: (alpha: 90, lenght: 1)"),
            &[
                "line 6, column 40",
                "no field lenght in ModifiedDh",
                "allowed: gamma, b, alpha, d, theta, r",
            ],
        ),
        (
            joint("frame: (a: 1)"),
            &["line 6, column 29", "d is the distance along x (Craig's a)"],
        ),
        (
            joint("frame: (), limits: (velocty: 3)"),
            &[
                "did you mean velocity?",
                "allowed: position, velocity, acceleration, torque",
            ],
        ),
        (
            joint("frame: (), kind: Spherical"),
            &[
                "line 6",
                "Spherical is not a choice",
                "allowed: Revolute, Prismatic, Fixed",
            ],
        ),
        (
            file("Urdf([])"),
            &[
                "line 5",
                "Urdf is not a choice",
                "ModifiedDh, StandardDh, Poses",
            ],
        ),
        (
            file("ModifiedDh([])").replace("    gravity: (0, 0, -9.81),\n", ""),
            &["the field gravity is missing", "gravity: (0, 0, -9.81)"],
        ),
        (
            file("ModifiedDh([])").replace("    angles: Degrees,\n", ""),
            &[
                "the field angles is missing",
                "angles: Degrees or angles: Radians",
            ],
        ),
        (
            file("ModifiedDh([])").replace("-9.81", "NaN"),
            &["line 4, column 21", "NaN where a finite number is needed"],
        ),
        (
            joint("frame: (alpha: inf)"),
            &["line 6, column 36", "inf where a finite number is needed"],
        ),
        (
            joint("frame: (alpha: \"90\")"),
            &["line 6", "expected float"],
        ),
        (
            joint("link: \"l\""),
            &["line 6", "the field frame is missing in Joint"],
        ),
        (
            mass("-1"),
            &[
                "line 6, column 16",
                "link link1: mass -1 kg",
                "cannot be below zero",
                "leave the inertial out",
            ],
        ),
        (
            joint("frame: (), limits: (position: (90, -90))"),
            &[
                "line 6",
                "joint a: position limits 1.57",
                "lower limit must be below",
            ],
        ),
        (
            joint("frame: (), limits: (velocity: 0)"),
            &["line 6", "velocity limit 0", "above zero; leave it out"],
        ),
        (
            joint("frame: (), limits: (acceleration: -3)"),
            &["acceleration limit -", "above zero"],
        ),
        (
            joint("frame: (), actuator: (gear_ratio: 0)"),
            &["gear ratio 0", "other than zero"],
        ),
        (
            joint("frame: (), kind: Fixed, limits: (velocity: 1)"),
            &["joint a: a fixed joint with limits", "leave them out"],
        ),
        (
            two("name: \"a\", frame: ()"),
            &[
                "line 7, column 16",
                "joint a: name used twice, first on line 6",
                "rename",
            ],
        ),
        (
            two("name: \"b\", link: \"link1\", frame: ()"),
            &["line 7", "link link1: name used twice, first on line 6"],
        ),
        (
            two("name: \"b\", parent: \"c\", frame: ()"),
            &[
                "line 7",
                "joint b: unknown parent c",
                "further up in the file",
                "allowed: a, link1, base",
            ],
        ),
        (
            joint("frame: (), kind: Fixed"),
            &[
                "test: no moving joint",
                "at least one revolute or prismatic",
            ],
        ),
    ];
    for (text, parts) in cases {
        let error = robot_from_ron(&text).unwrap_err();
        let message = error.to_string();
        for part in parts {
            assert!(
                message.contains(part),
                "{part:?} is not in {message:?}, the answer to\n{text}"
            );
        }
    }
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
