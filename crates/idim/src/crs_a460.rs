//! Radkhah, Kulić & Croft 2007 in full: categories, exciting motion, simulated experiments on the CRS A460.

use crate::cli::NamedText;
use crate::error::Error;
use crate::plots;
use crate::progress::Progress;
use crate::report::reduction_text;
use crate::result::{
    ConditionResult, EstimateResult, IdentificationResult, PaperNumber, ParameterResult, SCHEMA,
};
use crate::simulate::{
    Differentiation, Disturbances, Experiment, NORMAL_95, Processing, Recovered,
};
use crate::structure::{KeepOrder, Structure};
use crate::table::{number, table};
use faer::MatRef;
use idim_excitation::Conditioning;
use idim_model::{Columns, DriveColumns, Model, Robot, observation_matrix, robot_from_ron};
use idim_trajectory::{Certificate, FourierSeries, Limits, Motion, TrajectoryFile};
use rayon::prelude::*;
use std::fmt::Write as _;

/// Samples a period the criteria are evaluated on; any number from 100 gives the same digits.
const SAMPLES: usize = 1000;
/// Seeded runs of the coverage study.
const COVERAGE_RUNS: u64 = 200;

/// What the run found.
#[derive(Debug, Clone)]
pub struct CrsRun {
    /// For `result.json`.
    pub result: IdentificationResult,
    /// For a person.
    pub text: String,
    robot: Robot,
    limits: Limits,
    motions: Vec<ReviewedMotion>,
}

impl CrsRun {
    /// The motions between their limits.
    pub fn plots(&self) -> Vec<NamedText> {
        self.motions
            .iter()
            .map(|m| plots::of_series(&self.robot, &m.series, &self.limits, m.file))
            .collect()
    }
}

/// A motion and everything that is said of it.
#[derive(Debug, Clone)]
struct ReviewedMotion {
    title: String,
    file: &'static str,
    series: FourierSeries,
    conditioning: Conditioning,
    certificate: Certificate,
}

/// A line of the table of experiments.
struct Scenario {
    title: &'static str,
    disturbances: Disturbances,
    processing: Processing,
}

const PLAIN: Processing = Processing {
    friction: true,
    differentiation: Differentiation::Fourier,
};

/// The standard disturbances, then one thing changed at a time.
const SCENARIOS: [Scenario; 7] = [
    Scenario {
        title: "18 periods, encoders, 2 % torque noise, friction modelled",
        disturbances: Disturbances::STANDARD,
        processing: PLAIN,
    },
    Scenario {
        title: "one period only",
        disturbances: Disturbances {
            n_periods: 1,
            ..Disturbances::STANDARD
        },
        processing: PLAIN,
    },
    Scenario {
        title: "differences after a 10 Hz low-pass",
        disturbances: Disturbances::STANDARD,
        processing: Processing {
            differentiation: Differentiation::LowPass(10.0),
            ..PLAIN
        },
    },
    Scenario {
        title: "differences without a filter",
        disturbances: Disturbances::STANDARD,
        processing: Processing {
            differentiation: Differentiation::None,
            ..PLAIN
        },
    },
    Scenario {
        title: "torque constants 5 % off",
        disturbances: Disturbances {
            torque_constant: 0.05,
            ..Disturbances::STANDARD
        },
        processing: PLAIN,
    },
    Scenario {
        title: "friction not modelled",
        disturbances: Disturbances::STANDARD,
        processing: Processing {
            friction: false,
            ..PLAIN
        },
    },
    Scenario {
        title: "an arm without friction, none modelled",
        disturbances: Disturbances {
            friction: false,
            ..Disturbances::STANDARD
        },
        processing: Processing {
            friction: false,
            ..PLAIN
        },
    },
];

/// How often the truth lies inside the stated intervals.
struct Coverage {
    /// Share over all runs and parameters.
    overall: f64,
    /// Worst and best parameter.
    worst: f64,
    best: f64,
    /// Relative norm error of the 36 over the runs: median.
    median_error: f64,
}

/// Reproduces the paper.
///
/// # Errors
/// None but defects of the embedded files: every numerical outcome is in the result.
pub fn run(seed: u64, progress: &Progress) -> Result<CrsRun, Error> {
    let robot = robot_from_ron(idim_fixtures::CRS_A460)?;
    let limits = Limits::from_robot(&robot)?;
    progress.stage("crs-a460: categories");
    let structure =
        Structure::of_torque(&robot, DriveColumns::NONE, KeepOrder::MassFirst).decided()?;
    let model = Model::new(&robot);
    let columns = structure.base_columns();
    let printed = table1()?;
    let mut motions = vec![review(
        "Table I (printed)",
        "motion-table-1",
        printed,
        &model,
        &columns,
        &limits,
    )];
    progress.stage("crs-a460: optimising a motion");
    let design = crate::design::motion_for(&robot, &columns, &limits, seed)?;
    motions.push(review(
        "optimised for the raw condition number",
        "motion-optimised",
        design,
        &model,
        &columns,
        &limits,
    ));
    let mut experiments = Vec::new();
    for motion in &motions {
        progress.stage(format!("crs-a460: simulated experiments, {}", motion.title));
        let experiment = Experiment::new(&robot, &motion.series)?;
        let runs: Result<Vec<Recovered>, Error> = SCENARIOS
            .par_iter()
            .map(|s| {
                experiment.run(
                    &Experiment::structure(&robot, &s.processing),
                    &s.disturbances,
                    &s.processing,
                    seed,
                    0,
                )
            })
            .collect();
        experiments.push(runs?);
    }
    progress.stage(format!(
        "crs-a460: {COVERAGE_RUNS} experiments for the coverage of the intervals"
    ));
    let coverage = coverage(&robot, &motions[0].series, seed)?;
    let text = text(&structure, &motions, &experiments, &coverage);
    let result = result(&robot, &structure, &motions, &experiments, &coverage, seed);
    Ok(CrsRun {
        result,
        text,
        robot,
        limits,
        motions,
    })
}

/// The printed motion.
///
/// # Errors
/// A defect of the embedded file.
pub fn table1() -> Result<FourierSeries, Error> {
    match TrajectoryFile::from_ron(idim_fixtures::RKC_TABLE1)?.motion()? {
        Motion::Fourier(series) => Ok(series),
        Motion::Quintic(_) => Err(Error::input(
            "rkc_table1.ron",
            "a quintic path",
            "table I is a Fourier series",
        )),
    }
}

fn review(
    title: &str,
    file: &'static str,
    series: FourierSeries,
    model: &Model,
    columns: &Columns,
    limits: &Limits,
) -> ReviewedMotion {
    let w = observation_matrix(model, columns, &series.equispaced_states(SAMPLES));
    let w = MatRef::from_column_major_slice(w.as_slice(), w.nrows(), w.ncols());
    ReviewedMotion {
        title: title.into(),
        file,
        conditioning: Conditioning::of_rows(w, SAMPLES),
        certificate: series.certificate(limits),
        series,
    }
}

fn coverage(robot: &Robot, motion: &FourierSeries, seed: u64) -> Result<Coverage, Error> {
    let experiment = Experiment::new(robot, motion)?;
    let structure = Experiment::structure(robot, &PLAIN);
    let runs: Vec<(Vec<bool>, f64)> = (0..COVERAGE_RUNS)
        .into_par_iter()
        .map(|draw| {
            let r = experiment.run(&structure, &Disturbances::STANDARD, &PLAIN, seed, draw)?;
            Ok((r.covered(), r.relative_norm_error(&r.weighted)))
        })
        .collect::<Result<_, Error>>()?;
    let n = runs.len() as f64;
    let share: Vec<f64> = (0..structure.reduction.rank())
        .map(|k| runs.iter().filter(|(covered, _)| covered[k]).count() as f64 / n)
        .collect();
    let mut errors: Vec<f64> = runs.iter().map(|r| r.1).collect();
    errors.sort_by(f64::total_cmp);
    Ok(Coverage {
        overall: share.iter().sum::<f64>() / share.len() as f64,
        worst: share.iter().copied().fold(1.0, f64::min),
        best: share.iter().copied().fold(0.0, f64::max),
        median_error: errors[errors.len() / 2],
    })
}

fn text(
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

fn result(
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
        }),
        train: None,
        validation: None,
        excitation: Some(motions.iter().map(motion_json).collect()),
        paper,
        conditioning: Vec::new(),
        warnings: vec![
            "The inertial and friction values of the simulated arm are invented; table II of the paper is not realisable and serves as print only.".into(),
            "The paper's 36 identifiable parameters are its base set; 21 of them can be told apart from all others.".into(),
        ],
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
