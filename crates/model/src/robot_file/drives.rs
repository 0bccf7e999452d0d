//! Couplings, known torques and the side of the logs between the file and the robot, both ways.

use super::format::{AngleUnit, Entry, Joints, Known, LogSides, Number, Side};
use super::frames::radians;
use crate::error::Error;
use crate::robot::{Coupling, Drives, JointKind, KnownTorque, LogSide, Robot};
use crate::suggestion::did_you_mean;
use std::collections::BTreeMap;

/// What the file says beside the joints themselves.
pub(super) fn drives(
    joints: &Joints,
    log: Option<LogSides>,
    known: &[Known],
    unit: AngleUnit,
    robot: &Robot,
) -> Result<Drives, Error> {
    let couplings = match joints {
        Joints::ModifiedDh(entries) => couplings(entries, robot),
        Joints::StandardDh(entries) => couplings(entries, robot),
        Joints::Poses(entries) => couplings(entries, robot),
    }?;
    let log = log.unwrap_or_default();
    let known_torques: Result<_, _> = known.iter().map(|k| known_torque(k, unit, robot)).collect();
    Ok(Drives {
        couplings,
        known_torques: known_torques?,
        positions: side(log.positions),
        torques: side(log.torques),
    })
}

fn side(side: Side) -> LogSide {
    match side {
        Side::Joint => LogSide::Joint,
        Side::Motor => LogSide::Motor,
    }
}

fn couplings<F>(entries: &[Entry<F>], robot: &Robot) -> Result<Vec<Coupling>, Error> {
    let mut couplings = Vec::new();
    for entry in entries {
        let coupled = entry.actuator.iter().flat_map(|a| &a.coupled);
        for (name, ratio) in coupled {
            couplings.push(Coupling {
                motor: moving(&entry.name, &format!("joint {}", entry.name), robot)?,
                joint: moving(name, &format!("joint {}, coupled", entry.name), robot)?,
                ratio: ratio.0,
            });
        }
    }
    Ok(couplings)
}

fn moving(name: &str, place: &str, robot: &Robot) -> Result<usize, Error> {
    robot.joint_index(name).ok_or_else(|| {
        let rule = did_you_mean(name, robot.joints().iter().map(|j| j.name.as_str()));
        Error::robot(place, format!("no moving joint {name}"), rule)
    })
}

fn known_torque(known: &Known, unit: AngleUnit, robot: &Robot) -> Result<KnownTorque, Error> {
    let place = format!("known torque {}", known.name);
    let joint = moving(&known.joint, &place, robot)?;
    let turns = robot.joints()[joint].kind == JointKind::Revolute;
    match (&known.table, &known.formula) {
        (Some(table), None) if known.with.is_empty() => {
            let coordinate = |v: Number| if turns { radians(unit, v.0) } else { v.0 };
            let points = table.iter().map(|&[q, t]| [coordinate(q), t.0]);
            KnownTorque::from_table(&known.name, joint, points.collect())
        }
        (None, Some(formula)) => {
            KnownTorque::from_formula(&known.name, joint, &known.with, formula)
        }
        _ => Err(Error::robot(
            place,
            "neither a table nor a formula alone",
            "give table: [(q, torque), ..], or formula: \"..\" and the quantities it needs in with: [(\"name\", \"..\"), ..]",
        )),
    }
}

/// The couplings of one motor, by the names of the joints it turns with.
pub(super) fn coupled_to_file(robot: &Robot, motor: usize) -> BTreeMap<String, Number> {
    let own = robot.drives().couplings.iter().filter(|c| c.motor == motor);
    own.map(|c| (robot.joints()[c.joint].name.clone(), Number(c.ratio)))
        .collect()
}

/// The sides of the logs; `None` where both are the joints'.
pub(super) fn log_to_file(drives: &Drives) -> Option<LogSides> {
    let side = |s| match s {
        LogSide::Joint => Side::Joint,
        LogSide::Motor => Side::Motor,
    };
    let sides = [drives.positions, drives.torques].map(side);
    sides.contains(&Side::Motor).then_some(LogSides {
        positions: sides[0],
        torques: sides[1],
    })
}

/// Known torques, tables in radians.
pub(super) fn known_to_file(robot: &Robot) -> Vec<Known> {
    let all = robot.drives().known_torques.iter();
    all.map(|k| {
        let formula = k.formula();
        let owned = |(a, b): &(&str, &str)| ((*a).to_owned(), (*b).to_owned());
        Known {
            name: k.name().to_owned(),
            joint: robot.joints()[k.joint()].name.clone(),
            table: k.table().map(|t| t.iter().map(|p| p.map(Number)).collect()),
            with: formula
                .as_ref()
                .map_or_else(Vec::new, |(with, _)| with.iter().map(owned).collect()),
            formula: formula.map(|(_, torque)| torque.to_owned()),
        }
    })
    .collect()
}
