//! Torque limits and distances: kept where the robot file says enough, refused where they were asked for and it does not.

use crate::error::Error;
use idim_excitation::{Clearance, TorquePrior};
use idim_model::{Robot, Shapes};

/// Share of the torque limits where nothing is said: inertial values of a file are off by as much as the rest.
const SHARE: f64 = 0.8;
/// Distance to keep where nothing is said, m.
const DISTANCE: f64 = 0.02;

/// What is kept, and what a person should know of it.
pub(super) struct Conditions {
    pub(super) torque: Option<TorquePrior>,
    pub(super) clearance: Option<Clearance>,
    pub(super) notes: Vec<String>,
}

/// `share` and `distance` as given, `None` where nothing was; a share of zero leaves torques out.
pub(super) fn conditions(
    robot: &Robot,
    share: Option<f64>,
    distance: Option<f64>,
    may_touch: &[(String, String)],
) -> Result<Conditions, Error> {
    let mut notes = Vec::new();
    let torque = match share {
        Some(0.0) => None,
        Some(share) => Some(TorquePrior::new(robot, share)?),
        None => match TorquePrior::new(robot, SHARE) {
            Ok(prior) => Some(prior),
            Err(why) => {
                notes.push(format!("torques are not looked at: {why}"));
                None
            }
        },
    };
    let robot = touching(robot, may_touch)?;
    let clearance = Clearance::new(&robot, distance.unwrap_or(DISTANCE))?;
    match &clearance {
        Some(clearance) => notes.extend(clearance.always_near().iter().map(|[a, b]| {
            format!("capsules of {a} and {b} are near in every position: that pair is not looked at")
        })),
        None if distance.is_some() => {
            return Err(Error::input(
                "--clearance",
                "no bodies that could meet",
                "give the links `capsules`, or the file a `ground` (docs/robot-file.md)",
            ));
        }
        None => notes.push(
            "collisions are not looked at: the robot file has no capsules or ground that could meet"
                .into(),
        ),
    }
    Ok(Conditions {
        torque,
        clearance,
        notes,
    })
}

/// The robot with more pairs that may touch.
fn touching(robot: &Robot, pairs: &[(String, String)]) -> Result<Robot, Error> {
    let known = |name: &String| {
        ["base", "ground"].contains(&name.as_str()) || robot.links().iter().any(|l| l.name == *name)
    };
    for name in pairs.iter().flat_map(|(a, b)| [a, b]) {
        if !known(name) {
            let links: Vec<&str> = robot.links().iter().map(|l| l.name.as_str()).collect();
            return Err(Error::input(
                "--may-touch",
                format!("no link {name}"),
                format!("there are base, ground, {}", links.join(", ")),
            ));
        }
    }
    let mut shapes: Shapes = robot.shapes().clone();
    let pairs = pairs.iter().cloned().map(<[String; 2]>::from);
    shapes.may_touch.extend(pairs);
    Ok(robot.clone().with_shapes(shapes)?)
}
