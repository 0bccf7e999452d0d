//! What a person and other programs read of exciting points.

use super::certificate_file::{SCHEMA, clearance_json, criteria, joints_json, largest_json};
use super::interrupt::Stopped;
use super::points::PointExcitation;
use super::text::{criteria_table, limits_text, term_name};
use crate::table::number;
use idim_model::Robot;
use idim_trajectory::Limits;
use serde_json::{Value, json};
use std::fmt::Write as _;

pub(super) fn points_text(robot: &Robot, found: &PointExcitation) -> String {
    let (o, p) = (&found.options, &found.points);
    let mut out = format!(
        "{}: {} exciting points for {} base parameters of the energy model, and a path through them\n\
         {} s from rest to rest amid the position limits; between points it passes all of them without a stop\n",
        robot.name(),
        p.points.n_samples(),
        found.structure.reduction.rank(),
        number(found.proved.path.duration()),
    );
    let _ = writeln!(
        out,
        "{} searches of {} starts, {} evaluations in the last, seed {}{}",
        found.attempts,
        o.n_starts,
        p.n_evaluations,
        o.seed,
        match found.stopped {
            Stopped::No => "",
            Stopped::OutOfTime =>
                ", as many as the time budget allowed: another machine may find others",
            Stopped::Interrupted => ", interrupted: the best so far",
        }
    );
    if found.attempts > 1 {
        out += "points searched again under smaller limits where the path did not keep its own\n";
    }
    if found.slowed_down {
        out += "points slowed down or drawn in where the path did not keep its limits, for want of time: a longer search finds better ones\n";
    }
    let _ = writeln!(
        out,
        "lowered: {}; reached {}, best of {} random chains {}",
        term_name(o.criterion),
        number(found.value()),
        found.n_random,
        found.random.as_ref().map_or("-".into(), |r| number(r.0)),
    );
    if let (Some(limit), Some(s)) = (o.largest_s, p.conditioning.equilibrium) {
        let held = if s.ratio <= limit {
            "held"
        } else {
            "not held: give more rounds, or a larger one"
        };
        let _ = writeln!(out, "S at most {limit}: {held}");
    }
    let random = found.random.as_ref().map(|r| &r.1);
    let _ = write!(
        out,
        "\nCriteria of the energy differences between the points\n{}",
        criteria_table(&p.conditioning, random)
    );
    let _ = write!(
        out,
        "\nCriteria of the torques along the path, for the columns of `identify`\n{}",
        criteria_table(&found.along, None)
    );
    let proved = &found.proved;
    out + &limits_text(
        robot,
        &proved.certificate,
        proved.torque.as_ref(),
        proved.clearance.as_ref(),
    )
}

pub(super) fn points_json(robot: &Robot, limits: &Limits, found: &PointExcitation) -> Value {
    let (o, p) = (&found.options, &found.points);
    json!({
        "schema": SCHEMA,
        "version": env!("CARGO_PKG_VERSION"),
        "robot": robot.name(),
        "family": "points",
        "duration": found.proved.path.duration(),
        "rows": o.n_rows,
        "base_parameters": found.structure.base_names(),
        "certified": found.proved.certificate.certified,
        "largest_use": largest_json(robot, &found.proved.certificate),
        "joints": joints_json(robot, limits, &found.proved.certificate, found.proved.torque.as_ref()),
        "torque_share": found.proved.torque.as_ref().map(|t| t.share),
        "clearance": clearance_json(found.proved.clearance.as_ref()),
        "search": {
            "criterion": term_name(o.criterion),
            "value": found.value(),
            "random_motions": found.n_random,
            "best_random": found.random.as_ref().map(|r| r.0),
            "largest_s": o.largest_s,
            "seed": o.seed,
            "starts": o.n_starts,
            "rounds": o.n_rounds,
            "searches": found.attempts,
            "slowed_down": found.slowed_down,
            "evaluations": p.n_evaluations,
            "reproducible": found.stopped == Stopped::No,
        },
        "criteria": criteria(&p.conditioning),
        "criteria_random": found.random.as_ref().map(|r| criteria(&r.1)),
        "criteria_torque": criteria(&found.along),
    })
}
