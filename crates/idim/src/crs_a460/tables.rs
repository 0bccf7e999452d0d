//! What the run says: tables for a person, numbers for `result.json`.

use super::{COVERAGE_RUNS, Coverage, PLAIN, ReviewedMotion, SCENARIOS};
use crate::report::reduction_text;
use crate::result::{
    ConditionResult, EstimateResult, IdentificationResult, PaperNumber, ParameterResult, SCHEMA,
};
use crate::simulate::{Experiment, NORMAL_95, Recovered};
use crate::structure::Structure;
use crate::table::{number, table};
use idim_model::Robot;
use idim_trajectory::Certificate;
use std::fmt::Write as _;

pub(super) fn text(
    structure: &Structure,
    motions: &[ReviewedMotion],
    experiments: &[Vec<Recovered>],
    coverage: &Coverage,
) -> String {
    let mut out = String::from(
        "Radkhah, Kulić & Croft 2007: dynamic parameter identification for the CRS A460\n\n",
    );
    out += &reduction_text(
        "CRS A460 (standard DH, distal frames)",
        &structure.to_result(),
    );
    let r = &structure.reduction;
    let _ = writeln!(
        out,
        "\nCategories (section II.B): {} unidentifiable, {} identifiable alone, {} in linear combinations, {} in the base set (printed: 9, -, 15, 36)",
        r.unidentifiable.len(),
        r.identifiable_alone.len(),
        r.combined.len(),
        r.base.len(),
    );
    let names = structure.names();
    for &k in &r.combined {
        let _ = writeln!(out, "  column {}", r.column_relation(k, &names));
    }
    out += "\nMotions (Cond by singular values; F = W'W / samples; use: largest share of a limit, certified for every instant)\n";
    out += &table(
        [
            "motion",
            "Cond raw",
            "Cond equilibrated",
            "log det F",
            "q use",
            "qd use",
            "qdd use",
            "certified",
        ],
        motions.iter().map(|m| {
            let c = &m.conditioning;
            let [q, v, a] = largest_uses(&m.certificate);
            [
                m.title.clone(),
                format!("{:.4}", c.raw.two_norm),
                format!("{:.4}", c.equilibrated.two_norm),
                format!("{:.4}", c.log_det),
                format!("{:.1} %", 100.0 * q),
                format!("{:.1} %", 100.0 * v),
                format!("{:.1} %", 100.0 * a),
                if m.certificate.certified {
                    "yes".into()
                } else {
                    "no".into()
                },
            ]
        }),
    );
    out += "reference for table I: raw 210.15, equilibrated 56.13, log det 80.264\n";
    for (motion, runs) in motions.iter().zip(experiments) {
        let _ = writeln!(
            out,
            "\nSimulated experiments, {} (1 kHz; relative norm error of the 36 rigid-body base parameters)",
            motion.title
        );
        out += &table(
            ["disturbances", "ordinary LS", "weighted LS"],
            SCENARIOS.iter().zip(runs).map(|(s, r)| {
                [
                    s.title.into(),
                    number(r.relative_norm_error(&r.ordinary)),
                    number(r.relative_norm_error(&r.weighted)),
                ]
            }),
        );
    }
    let _ = writeln!(
        out,
        "\n95 % intervals (±{NORMAL_95:.2} std) over {COVERAGE_RUNS} seeded experiments on table I: the truth is inside {:.1} % of the time (worst parameter {:.1} %, best {:.1} %); median relative norm error {}",
        100.0 * coverage.overall,
        100.0 * coverage.worst,
        100.0 * coverage.best,
        number(coverage.median_error),
    );
    out
}

/// Largest use of position, velocity and acceleration limits over the joints.
fn largest_uses(c: &Certificate) -> [f64; 3] {
    let most =
        |f: fn(&idim_trajectory::JointUse) -> f64| c.joints.iter().map(f).fold(0.0, f64::max);
    [
        most(|j| j.position.fraction),
        most(|j| j.velocity.fraction),
        most(|j| j.acceleration.fraction),
    ]
}

pub(super) fn result(
    robot: &Robot,
    structure: &Structure,
    motions: &[ReviewedMotion],
    experiments: &[Vec<Recovered>],
    coverage: &Coverage,
    seed: u64,
) -> IdentificationResult {
    let r = &structure.reduction;
    let c = &motions[0].conditioning;
    let base = &experiments[0][0];
    let reference = "reference of the project, not printed in the paper";
    let paper = vec![
        PaperNumber::new(
            "unidentifiable parameters",
            Some(9.0),
            r.unidentifiable.len() as f64,
            "",
        ),
        PaperNumber::new(
            "identifiable alone (step 5's S taken literally)",
            Some(21.0),
            r.identifiable_alone.len() as f64,
            reference,
        ),
        PaperNumber::new(
            "in linear combinations",
            Some(15.0),
            r.combined.len() as f64,
            "",
        ),
        PaperNumber::new("base set", Some(36.0), r.base.len() as f64, ""),
        PaperNumber::new(
            "table I: Cond, raw",
            Some(210.147_050_45),
            c.raw.two_norm,
            reference,
        ),
        PaperNumber::new(
            "table I: Cond, equilibrated",
            Some(56.132_208_93),
            c.equilibrated.two_norm,
            reference,
        ),
        PaperNumber::new(
            "table I: log det F",
            Some(80.264_243_82),
            c.log_det,
            reference,
        ),
        PaperNumber::new(
            "best known Cond, raw",
            Some(43.88),
            motions[1].conditioning.raw.two_norm,
            reference,
        ),
        PaperNumber::new(
            "table I: relative norm error of the 36, ordinary LS",
            Some(8e-3),
            base.relative_norm_error(&base.ordinary),
            reference,
        ),
        PaperNumber::new(
            "95 % intervals that hold the truth",
            Some(0.95),
            coverage.overall,
            "200 seeded experiments on table I",
        ),
    ];
    let recovered_names = Experiment::structure(robot, &PLAIN).base_names();
    let e = &base.weighted;
    IdentificationResult {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        robot: "crs-a460".into(),
        seed,
        reduction: structure.to_result(),
        estimate: Some(EstimateResult {
            method: "weighted least squares, simulated experiment on table I (18 periods, encoders, 2 % torque noise, friction modelled)".into(),
            parameters: recovered_names
                .into_iter()
                .enumerate()
                .map(|(k, name)| ParameterResult {
                    name,
                    value: Some(e.values[k]),
                    std: Some(e.standard_deviation[k]),
                    relative_std: Some(e.relative_std[k]),
                })
                .collect(),
            condition_number: ConditionResult {
                raw: Some(base.ordinary.condition_number.raw),
                equilibrated: Some(base.ordinary.condition_number.equilibrated),
                weighted: Some(e.condition_number.raw),
            },
            ..EstimateResult::default()
        }),
        excitation: Some(motions.iter().map(motion_json).collect()),
        paper,
        warnings: vec![
            "The inertial and friction values of the simulated arm are invented; table II of the paper is not realisable and serves as print only.".into(),
            "The paper's 36 identifiable parameters are its base set; 21 of them can be told apart from all others.".into(),
        ],
        ..IdentificationResult::default()
    }
}

fn motion_json(m: &ReviewedMotion) -> serde_json::Value {
    let c = &m.conditioning;
    let [q, v, a] = largest_uses(&m.certificate);
    serde_json::json!({
        "motion": m.title,
        "condition_number": { "raw": c.raw.two_norm, "equilibrated": c.equilibrated.two_norm },
        "s": c.equilibrium.map(|s| s.ratio),
        "log_det": c.log_det,
        "certified": m.certificate.certified,
        "largest_use": { "position": q, "velocity": v, "acceleration": a },
        "coefficients": {
            "omega": m.series.omega(),
            "q0": m.series.mean_position(),
            "a": (0..m.series.n_joints()).map(|j| m.series.a(j).to_vec()).collect::<Vec<_>>(),
            "b": (0..m.series.n_joints()).map(|j| m.series.b(j).to_vec()).collect::<Vec<_>>(),
        },
    })
}
