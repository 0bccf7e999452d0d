//! Gautier & Khalil 1991 in full: base parameters of the energy model, exciting points, the path, the noise study.

mod exact;
mod tables;

use crate::cli::NamedText;
use crate::error::Error;
use crate::excite::point_path::path_through;
use crate::identify::{Prediction, errors, joint_names};
use crate::noise_study::noise_study;
use crate::papers::gautier_khalil;
use crate::plots;
use crate::progress::Progress;
use crate::report_html::page_of_paper;
use crate::result::IdentificationResult;
use crate::samples::visit_rows;
use crate::structure::{KeepOrder, Structure};
use idim_excitation::{
    ConditionStatistics, Criterion, EnergyDesign, PointDesign, PointLimits, PowellOptions,
    PowellPointOptions, Scaling, optimise_points_powell, random_condition_statistics,
};
use idim_model::{JointStates, Robot, robot_from_ron};
use idim_trajectory::{Certificate, Limits, QuinticPath};

/// Numbers of equations of table 2 (inferred).
const TABLE2_ROWS: [usize; 8] = [15, 20, 30, 50, 100, 250, 500, 1000];
/// Draws of each, as in the paper.
const TABLE2_DRAWS: usize = 1000;
/// Rows of the optimised sequence, the paper's compromise.
const ROWS: usize = 30;
/// Random starts of Powell's method.
const STARTS: usize = 6;
/// Evaluations of each start.
const EVALUATIONS: usize = 60_000;
/// Points are searched again under limits this much smaller where the path leaves its own (the paper's remedy).
const SHRINK: f64 = 0.85;
/// Searches at most.
const ATTEMPTS: usize = 5;

/// What the run found.
#[derive(Debug, Clone)]
pub struct PumaRun {
    /// For `result.json`.
    pub result: IdentificationResult,
    /// For a person.
    pub text: String,
    /// Path through the optimised points.
    pub path: QuinticPath,
    /// Its limits.
    pub path_limits: Limits,
    robot: Robot,
    torques: Prediction,
}

impl PumaRun {
    /// Torques along the path, and the path between its limits.
    pub fn plots(&self) -> Vec<NamedText> {
        let mut plots = plots::of_predictions(std::slice::from_ref(&self.torques), &self.robot);
        plots.extend(plots::of_path(&self.robot, &self.path, &self.path_limits));
        plots
    }

    /// `report.html`.
    pub(crate) fn report(&self, command: &str) -> String {
        let figures = plots::of_path(&self.robot, &self.path, &self.path_limits);
        let figures: Vec<NamedText> = figures
            .into_iter()
            .map(|(_, svg)| {
                (
                    "Path through the exciting points, within its limits".into(),
                    svg,
                )
            })
            .collect();
        page_of_paper(
            "Gautier & Khalil 1991",
            &self.result,
            &self.robot,
            std::slice::from_ref(&self.torques),
            &figures,
            command,
        )
    }
}

/// Points, and a path through them inside its limits.
struct Motion {
    points: PointDesign,
    path: QuinticPath,
    certificate: Certificate,
    attempts: usize,
}

/// Reproduces the paper.
///
/// # Errors
/// None but defects of the embedded tables: every numerical outcome is in the result.
pub fn run(seed: u64, progress: &Progress) -> Result<PumaRun, Error> {
    let paper = gautier_khalil()?;
    let robot = robot_from_ron(idim_fixtures::PUMA3R)?;
    progress.stage("puma: base parameters of the energy model");
    let structure = Structure::of_energy(&robot, KeepOrder::Links).decided()?;
    let limits = PointLimits {
        position: paper
            .inferred_limits
            .position_deg
            .iter()
            .map(radians)
            .collect(),
        velocity: paper.inferred_limits.velocity.clone(),
    };
    let design = EnergyDesign::new(&robot, &structure.base_columns(), limits)?;
    let table2: Vec<ConditionStatistics> = TABLE2_ROWS
        .iter()
        .map(|&r| {
            progress.stage(format!("puma: {TABLE2_DRAWS} random sequences of {r} rows"));
            random_condition_statistics(&design, r, TABLE2_DRAWS, seed)
        })
        .collect();
    let path_limits = Limits::new(
        paper
            .inferred_path_limits
            .position_deg
            .iter()
            .map(radians)
            .collect(),
        paper.inferred_path_limits.velocity.clone(),
        paper.inferred_path_limits.acceleration.clone(),
    )?;
    progress.stage(format!(
        "puma: Powell's method, {ROWS} rows, {STARTS} random starts"
    ));
    let motion = exciting_motion(&robot, &structure, design.limits(), &path_limits, seed)?;
    progress.stage(format!("puma: exact gradients, {ROWS} rows, many starts"));
    let exact = exact::exact_searches(&design, ROWS, seed)?;
    progress.stage("puma: what noise does to the estimate");
    let x: Vec<f64> = paper.table5.rows.iter().map(|r| r.value).collect();
    let random = random_of_condition(&design, paper.table3_condition(), seed);
    let good = noise_study(&design, &motion.points.points, &x, seed)?;
    let bad = noise_study(&design, &random, &x, seed)?;
    let found = tables::Found {
        paper: &paper,
        structure: &structure,
        table2: &table2,
        motion: &motion,
        exact: &exact,
        good: &good,
        bad: &bad,
    };
    let text = tables::text(&found);
    let mut result = tables::result(&found, seed);
    let energy = energy_prediction(&design, &motion.points.points, &x, &good.estimate.values);
    let torques = torque_prediction(&robot, &structure, &motion.path, &x, &good.estimate.values);
    result.train = errors(&["energy difference".to_owned()], &[energy], true);
    result.validation = errors(&joint_names(&robot), std::slice::from_ref(&torques), false);
    Ok(PumaRun {
        result,
        text,
        path: motion.path,
        path_limits,
        robot,
        torques,
    })
}

fn radians(&(low, high): &(f64, f64)) -> [f64; 2] {
    [low.to_radians(), high.to_radians()]
}

/// Points by Powell's method, a path through them, and again under smaller limits while the path leaves its own.
fn exciting_motion(
    robot: &Robot,
    structure: &Structure,
    point_limits: &PointLimits,
    path_limits: &Limits,
    seed: u64,
) -> Result<Motion, Error> {
    let mut limits = point_limits.clone();
    let mut attempts = 0;
    loop {
        attempts += 1;
        let design = EnergyDesign::new(robot, &structure.base_columns(), limits.clone())?;
        let options = PowellPointOptions {
            n_rows: ROWS,
            criterion: Criterion::Frobenius(Scaling::Raw),
            n_starts: STARTS,
            seed,
            powell: PowellOptions {
                max_evaluations: EVALUATIONS,
                ..PowellOptions::default()
            },
        };
        let points = optimise_points_powell(&design, &options);
        let home = vec![0.0; robot.n_joints()];
        let path = path_through(&points.points, &home, path_limits)?;
        let certificate = path.certificate(path_limits);
        if certificate.certified || attempts == ATTEMPTS {
            return Ok(Motion {
                points,
                path,
                certificate,
                attempts,
            });
        }
        let overshoot = path.largest_overshoot(path_limits);
        for (range, over) in limits.position.iter_mut().zip(overshoot) {
            if over > 0.0 {
                let (centre, half) = (
                    f64::midpoint(range[0], range[1]),
                    0.5 * (range[1] - range[0]),
                );
                *range = [centre - SHRINK * half, centre + SHRINK * half];
            }
        }
    }
}

/// The random sequence, of the first thousand, whose condition number is nearest to the paper's random example.
fn random_of_condition(design: &EnergyDesign, condition: f64, seed: u64) -> JointStates {
    let of = |draw| {
        let points = design.random_points(ROWS, seed, draw);
        let w = design.observation_matrix(&points);
        let c = Criterion::TwoNorm(Scaling::Raw).evaluate(w.as_ref(), ROWS);
        ((c / condition).ln().abs(), draw)
    };
    let best = (0..TABLE2_DRAWS as u64)
        .map(of)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    design.random_points(ROWS, seed, best.map_or(0, |b| b.1))
}

/// Energy differences between the points: true parameters against the estimate that noise left (table 5).
fn energy_prediction(
    design: &EnergyDesign,
    points: &JointStates,
    x: &[f64],
    estimate: &[f64],
) -> Prediction {
    let w = design.observation_matrix(points);
    let product = |x: &[f64]| -> Vec<f64> {
        let row = |i| (0..w.ncols()).map(|j| w[(i, j)] * x[j]).sum();
        (0..w.nrows()).map(row).collect()
    };
    Prediction {
        training: true,
        time: (0..w.nrows()).map(|i| i as f64).collect(),
        measured: vec![product(x)],
        predicted: vec![product(estimate)],
        friction: None,
    }
}

/// Samples along the path.
const PATH_SAMPLES: usize = 1000;

/// Torques along the path, which no energy difference of the estimate has seen.
///
/// The base columns of the energy model serve the torque model too: both lose the same parameters.
fn torque_prediction(
    robot: &Robot,
    structure: &Structure,
    path: &QuinticPath,
    x: &[f64],
    estimate: &[f64],
) -> Prediction {
    let times: Vec<f64> = (0..PATH_SAMPLES)
        .map(|k| path.duration() * k as f64 / PATH_SAMPLES as f64)
        .collect();
    let states = path.states(&times);
    let mut measured = vec![vec![0.0; PATH_SAMPLES]; robot.n_joints()];
    let mut predicted = measured.clone();
    let columns = structure.base_columns();
    visit_rows(robot, &columns, &states, 0.0, |sample, joint, row| {
        let product = |x: &[f64]| row.iter().zip(x).map(|(w, x)| w * x).sum();
        measured[joint][sample] = product(x);
        predicted[joint][sample] = product(estimate);
    });
    Prediction {
        training: false,
        time: times,
        measured,
        predicted,
        friction: None,
    }
}
