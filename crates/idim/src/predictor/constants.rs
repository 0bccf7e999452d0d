//! The constants of a predictor: geometry, bodies.

use super::PredictedModel;
use super::language::Language;
use idim_model::{Joint, JointKind, Pose, Robot};
use std::fmt::Write as _;

/// A constant: name, meaning, how many numbers an entry has, its value.
struct Constant {
    name: &'static str,
    about: &'static str,
    entry: Entry,
    value: String,
}

#[derive(Clone, Copy, PartialEq)]
enum Entry {
    Link,
    Flag,
    Numbers(usize),
    /// Three numbers in all, not three a joint.
    Vector,
}

/// All constants as source text.
pub(super) fn constants(model: &PredictedModel, language: Language) -> String {
    let mut text = String::new();
    for Constant {
        name,
        about,
        entry,
        value,
    } in geometry(model.robot, language)
        .into_iter()
        .chain(bodies(model, language))
    {
        let length = if entry == Entry::Vector { "3" } else { "N" };
        let _ = match language {
            Language::Rust => {
                let of = match entry {
                    Entry::Link => "i32".into(),
                    Entry::Flag => "bool".into(),
                    Entry::Numbers(1) | Entry::Vector => "f64".into(),
                    Entry::Numbers(k) => format!("[f64; {k}]"),
                };
                writeln!(
                    text,
                    "// {about}\nconst {name}: [{of}; {length}] = {value};"
                )
            }
            Language::C => {
                let (of, inner) = match entry {
                    Entry::Link | Entry::Flag => ("int", String::new()),
                    Entry::Numbers(1) | Entry::Vector => ("double", String::new()),
                    Entry::Numbers(k) => ("double", format!("[{k}]")),
                };
                writeln!(
                    text,
                    "/* {about} */\nstatic const {of} {name}[{length}]{inner} = {value};"
                )
            }
        };
    }
    text
}

fn geometry(robot: &Robot, language: Language) -> Vec<Constant> {
    let joints = robot.joints();
    let list = |of: &dyn Fn(&Joint) -> String| {
        let items: Vec<String> = joints.iter().map(of).collect();
        language.list(&items)
    };
    let numbers = |name, about, k, of: &dyn Fn(&Joint) -> Vec<f64>| Constant {
        name,
        about,
        entry: Entry::Numbers(k),
        value: list(&|j| language.row(&of(j))),
    };
    let rotation = |pose: &Pose| pose.rotation.transpose().as_slice().to_vec();
    let shift = |pose: &Pose| pose.translation.as_slice().to_vec();
    let parent = |j: &Joint| j.parent.map_or_else(|| "-1".into(), |p| p.to_string());
    let slides = |j: &Joint| match (language, j.kind == JointKind::Prismatic) {
        (Language::Rust, slides) => slides.to_string(),
        (Language::C, slides) => u8::from(slides).to_string(),
    };
    let other = |name, about, entry, value| Constant {
        name,
        about,
        entry,
        value,
    };
    vec![
        other(
            "PARENT",
            "Link each joint is mounted on, -1 for the base.",
            Entry::Link,
            list(&parent),
        ),
        other(
            "SLIDES",
            "Whether the joint slides.",
            Entry::Flag,
            list(&slides),
        ),
        numbers(
            "ROTATION",
            "Parent link from joint, before motion: rotation by rows.",
            9,
            &|j| rotation(&j.parent_from_joint),
        ),
        numbers("SHIFT", "The same: translation, m.", 3, &|j| {
            shift(&j.parent_from_joint)
        }),
        numbers("LINK_ROTATION", "Joint from link, after motion.", 9, &|j| {
            rotation(&j.joint_from_link)
        }),
        numbers("LINK_SHIFT", "The same: translation, m.", 3, &|j| {
            shift(&j.joint_from_link)
        }),
        numbers("AXIS", "Axis of motion in the joint's frame.", 3, &|j| {
            j.axis.as_slice().to_vec()
        }),
        other(
            "ZERO",
            "Added to the coordinate, rad (m).",
            Entry::Numbers(1),
            list(&|j| language.number(j.offset)),
        ),
        other(
            "GRAVITY",
            "Gravity in the base frame, m/s2.",
            Entry::Vector,
            language.row(robot.gravity().as_slice()),
        ),
    ]
}

fn bodies(model: &PredictedModel, language: Language) -> Vec<Constant> {
    let constant = |name, about, bodies: &[[f64; 10]]| {
        let rows: Vec<String> = bodies.iter().map(|b| language.row(b)).collect();
        Constant {
            name,
            about,
            entry: Entry::Numbers(10),
            value: language.list(&rows),
        }
    };
    let columns = &model.columns.standard;
    let own = super::bodies(model.robot.n_joints(), columns, model.values);
    let mut all = vec![constant(
        "BODY",
        "XX XY XZ YY YZ ZZ MX MY MZ M of each link: base parameters, zero where regrouped. No real bodies, the same torques.",
        &own,
    )];
    if !model.load.is_empty() {
        all.push(constant(
            "LOADING_BODY",
            "The same of the fit whose torque loads the gears.",
            model.load,
        ));
    }
    all
}
