//! What a person reads of a design.

use super::arguments::CRITERIA;
use super::interrupt::Stopped;
use super::{Excitation, samples_of_search};
use crate::table::{number, table};
use idim_excitation::{
    ClearanceCertificate, Conditioning, Criterion, FourierDesign, REPORT_REFINEMENT, Scaling,
    TorqueCertificate,
};
use idim_model::Robot;
use idim_trajectory::{Certificate, JointUse, LimitUse};
use std::fmt::Write as _;

pub(super) fn excitation_text(robot: &Robot, found: &Excitation) -> String {
    let o = &found.options;
    let mut out = format!(
        "{}: a motion for {} base parameters; {} harmonics over {} s{}\n",
        robot.name(),
        found.structure.reduction.rank(),
        o.n_harmonics,
        o.period,
        if o.at_rest { ", from rest to rest" } else { "" },
    );
    if found.n_logs > 0 {
        let _ = writeln!(
            out,
            "beside what {} earlier logs tell: information of their time over that of one period",
            found.n_logs
        );
        for choice in &found.log_choices {
            let _ = writeln!(out, "  {choice}");
        }
    }
    out += &search_text(found);
    let _ = writeln!(
        out,
        "lowered: {}; reached {}, best of {} random motions {}",
        criterion_name(found),
        number(found.value()),
        found.n_random,
        found.random.as_ref().map_or_else(
            || "none inside the limits".into(),
            |r| number(super::lowest(r))
        ),
    );
    let d = &found.design;
    let limits = limits_text(
        robot,
        &d.certificate,
        d.torque.as_ref(),
        d.clearance.as_ref(),
    );
    out + &criteria_text(found) + &limits
}

/// The criterion in the words of the command line.
pub(super) fn criterion_name(found: &Excitation) -> String {
    let terms = &found.options.criteria;
    if let [(_, criterion)] = terms[..] {
        return term_name(criterion);
    }
    let parts = terms
        .iter()
        .map(|(w, c)| format!("{w} log {}", term_name(*c)));
    parts.collect::<Vec<_>>().join(" + ")
}

/// One criterion in those words.
pub(super) fn term_name(criterion: Criterion) -> String {
    if let Criterion::WeightedSum {
        condition,
        equilibrium,
    } = criterion
    {
        return format!("{condition} cond + {equilibrium} S");
    }
    let known = CRITERIA.iter().find(|c| c.1 == criterion);
    known.map_or("?", |c| c.0).into()
}

fn search_text(found: &Excitation) -> String {
    let d = &found.design;
    let (n_starts, n_searches) = (found.options.n_starts, d.values.len());
    let effort = format!(
        "{n_searches} searches ({} complete rounds of {n_starts}), {} evaluations, seed {}",
        d.n_rounds, d.n_evaluations, found.options.seed
    );
    match found.stopped {
        Stopped::No => format!("{effort}\n"),
        Stopped::OutOfTime => format!(
            "{effort}, as many as the time budget allowed: another machine may find another motion\n"
        ),
        Stopped::Interrupted => format!("{effort}, interrupted: the best so far\n"),
    }
}

fn criteria_text(found: &Excitation) -> String {
    let plain = |d: &FourierDesign| d.conditioning;
    let random = found.random.as_ref().map(plain);
    let mut rows = rows_of("raw", &found.design.conditioning, random.as_ref(), true);
    if let Some((weighted, random)) = &found.weighted {
        rows.extend(rows_of("weighted", weighted, random.as_ref(), false));
    }
    format!(
        "\nCriteria of this motion alone\n{}{}\n",
        table(HEADER, rows),
        route_text(found)
    )
}

const HEADER: [&str; 4] = [
    "criterion",
    "this motion",
    "best random",
    "ratio (log: gain)",
];

/// The criteria of rows, beside those of others.
pub(super) fn criteria_table(found: &Conditioning, random: Option<&Conditioning>) -> String {
    table(HEADER, rows_of("raw", found, random, true))
}

/// Relative error of a condition number from the eigenvalues of the information matrix: `p u cond² / 2`, `u` half an epsilon.
pub(super) fn rounding_of_search(found: &Excitation) -> f64 {
    let p = found.structure.reduction.rank() as f64;
    let unit = |&(_, criterion): &(f64, Criterion)| {
        let scaling = Scaling::Equilibrated;
        [Criterion::TwoNorm(scaling), Criterion::Frobenius(scaling)].contains(&criterion)
    };
    let conditioning = &found.design.conditioning;
    let numbers = if found.options.criteria.iter().all(unit) {
        conditioning.equilibrated
    } else {
        conditioning.raw
    };
    0.25 * p * f64::EPSILON * numbers.two_norm.powi(2)
}

/// Which of the ways to a condition number was taken where.
fn route_text(found: &Excitation) -> String {
    let error = rounding_of_search(found);
    let rough = if error < TOO_ROUGH {
        ""
    } else {
        ", too rough to search by: choose an equilibrated criterion, or wider limits"
    };
    format!(
        "The table is over {} samples of the period, Cond by the singular values of the rows; the search over {}, by the \
         eigenvalues of the information matrix, to {error:.0e} of its value{rough}",
        samples_of_report(found),
        samples_of_search(&found.options)
    )
}

/// Samples of a period that the criteria of a report are over.
pub(super) fn samples_of_report(found: &Excitation) -> usize {
    REPORT_REFINEMENT * samples_of_search(&found.options)
}

/// A search that cannot tell a percent of its criterion from rounding.
const TOO_ROUGH: f64 = 1e-2;

type Pick = fn(&Conditioning) -> f64;

fn rows_of(
    word: &str,
    found: &Conditioning,
    random: Option<&Conditioning>,
    equilibrated: bool,
) -> Vec<[String; 4]> {
    let mut picks: Vec<(String, Pick, bool)> = vec![
        (format!("Cond, {word}"), |c| c.raw.two_norm, false),
        (format!("Frobenius, {word}"), |c| c.raw.frobenius, false),
    ];
    if equilibrated {
        picks.push((
            "Cond, equilibrated".into(),
            |c| c.equilibrated.two_norm,
            false,
        ));
        picks.push((
            "Frobenius, equilibrated".into(),
            |c| c.equilibrated.frobenius,
            false,
        ));
    }
    picks.push((format!("D: log det F, {word}"), |c| c.log_det, true));
    picks.push((
        format!("A: trace of F^-1, {word}"),
        |c| c.trace_inverse,
        false,
    ));
    picks.push((
        format!("E: 1 / smallest singular value, {word}"),
        |c| 1.0 / c.smallest_singular_value,
        false,
    ));
    picks.push((
        format!("S: max |W| / min |W|, zeros left out, {word}"),
        |c| c.equilibrium.map_or(f64::NAN, |s| s.nonzero_ratio),
        false,
    ));
    let cells = |(name, pick, logarithm): (String, Pick, bool)| {
        let here = pick(found);
        let there = random.map(pick);
        let ratio = there.map(|t| {
            if logarithm {
                format!("{:+.2}", here - t)
            } else {
                format!("{:.3}", here / t)
            }
        });
        [
            name,
            number(here),
            there.map_or_else(|| "-".into(), number),
            ratio.unwrap_or_else(|| "-".into()),
        ]
    };
    picks.into_iter().map(cells).collect()
}

pub(super) fn limits_text(
    robot: &Robot,
    certificate: &Certificate,
    torques: Option<&TorqueCertificate>,
    clearance: Option<&ClearanceCertificate>,
) -> String {
    let cell = |u: &LimitUse| format!("{:.2} % at {:.2}", 100.0 * u.bound, u.time);
    let torque = |j: usize| {
        let of_joint = torques?.joints[j];
        of_joint.as_ref().map(cell)
    };
    let joints = robot.joints().iter().zip(&certificate.joints).enumerate();
    let rows = joints.map(|(j, (joint, used)): (usize, (_, &JointUse))| {
        [
            joint.name.clone(),
            cell(&used.position),
            cell(&used.velocity),
            cell(&used.acceleration),
            torque(j).unwrap_or_else(|| "-".into()),
        ]
    });
    let (joint, kind, most) = certificate.largest();
    let header = ["joint", "position", "velocity", "acceleration", "torque"];
    let mut out = format!(
        "\nLargest use of each limit, and when (s): certified for every instant\n{}most used: {kind:?} of joint {}, {:.3} % at {:.3} s\n",
        table(header, rows),
        robot.joints()[joint].name,
        100.0 * most.bound,
        most.time,
    );
    if let Some(torque) = torques {
        let _ = writeln!(
            out,
            "torques: by the inertial values of the robot file, at most {} % of each limit",
            100.0 * torque.share
        );
    }
    if let Some(c) = clearance {
        let _ = writeln!(
            out,
            "clearance: {:.4} m between {} and {} at {:.2} s, never below {:.4} m ({} pairs)",
            c.distance, c.links[0], c.links[1], c.time, c.bound, c.n_pairs
        );
    }
    out
}
