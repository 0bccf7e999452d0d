//! `certificate.json`: what a motion uses of its limits, and every criterion; `docs/excite.md` explains it.

use super::interrupt::Stopped;
use super::text::{criterion_name, rounding_of_search, samples_of_report};
use super::{Excitation, samples_of_search};
use idim_excitation::{ClearanceCertificate, Conditioning, FourierDesign, TorqueCertificate};
use idim_model::Robot;
use idim_trajectory::{Certificate, LimitUse, Limits};
use serde_json::{Value, json};

/// Schema of the file written here.
pub(super) const SCHEMA: &str = "idim-certificate/1";

pub(super) fn certificate_json(robot: &Robot, found: &Excitation) -> Value {
    let (o, d) = (&found.options, &found.design);
    json!({
        "schema": SCHEMA,
        "version": env!("CARGO_PKG_VERSION"),
        "robot": robot.name(),
        "family": "fourier",
        "period": o.period,
        "harmonics": o.n_harmonics,
        "at_rest": o.at_rest,
        "base_parameters": found.structure.base_names(),
        "certified": d.certificate.certified,
        "largest_use": largest_json(robot, &d.certificate),
        "joints": joints_json(robot, &found.limits, &d.certificate, d.torque.as_ref()),
        "torque_share": d.torque.as_ref().map(|t| t.share),
        "clearance": clearance_json(d.clearance.as_ref()),
        "search": {
            "criterion": criterion_name(found),
            "value": found.value(),
            "random_motions": found.n_random,
            "best_random": found.random.as_ref().map(super::lowest),
            "seed": o.seed,
            "starts": o.n_starts,
            "complete_rounds": d.n_rounds,
            "searches": d.values.len(),
            "evaluations": d.n_evaluations,
            "earlier_logs": found.n_logs,
            "log_choices": found.log_choices,
            "samples": samples_of_search(o),
            "condition_by": "information matrix",
            "condition_rounding": rounding_of_search(found),
            "time_budget": o.time_budget,
            "reproducible": found.stopped == Stopped::No,
        },
        "criteria_samples": samples_of_report(found),
        "criteria": criteria(&d.conditioning),
        "criteria_weighted": found.weighted.as_ref().map(|w| criteria(&w.0)),
        "criteria_random": found.random.as_ref().map(|r: &FourierDesign| criteria(&r.conditioning)),
    })
}

/// The smallest distance.
pub(super) fn clearance_json(clearance: Option<&ClearanceCertificate>) -> Option<Value> {
    clearance.map(|c| {
        json!({
            "distance": c.distance,
            "bound": c.bound,
            "time": c.time,
            "links": c.links,
            "pairs": c.n_pairs,
        })
    })
}

/// What each joint uses of its limits.
pub(super) fn joints_json(
    robot: &Robot,
    limits: &Limits,
    certificate: &Certificate,
    torque: Option<&TorqueCertificate>,
) -> Vec<Value> {
    let used = |u: &LimitUse, limit: Value| json!({ "limit": limit, "use": u.fraction, "bound": u.bound, "time": u.time });
    let joints = robot.joints().iter().zip(&certificate.joints).enumerate();
    joints
        .map(|(j, (joint, u))| {
            json!({
                "joint": joint.name,
                "position": used(&u.position, json!(limits.position[j])),
                "velocity": used(&u.velocity, json!(limits.velocity[j])),
                "acceleration": used(&u.acceleration, json!(limits.acceleration[j])),
                "torque": torque.and_then(|t| t.joints[j].as_ref())
                    .map(|u| used(u, json!(joint.limits.torque))),
            })
        })
        .collect()
}

/// The limit used most.
pub(super) fn largest_json(robot: &Robot, certificate: &Certificate) -> Value {
    let (joint, kind, most) = certificate.largest();
    json!({
        "joint": robot.joints()[joint].name,
        "limit": format!("{kind:?}").to_lowercase(),
        "use": most.fraction,
        "bound": most.bound,
        "time": most.time,
    })
}

pub(super) fn criteria(c: &Conditioning) -> Value {
    json!({
        "condition_by": "rows",
        "condition_number": { "raw": c.raw.two_norm, "equilibrated": c.equilibrated.two_norm },
        "frobenius_of_information": { "raw": c.raw.frobenius, "equilibrated": c.equilibrated.frobenius },
        "log_det": c.log_det,
        "trace_inverse": c.trace_inverse,
        "smallest_singular_value": c.smallest_singular_value,
        "equilibrium": c.equilibrium.map(|s| json!({ "ratio": s.nonzero_ratio, "zeros": s.n_zero })),
    })
}
