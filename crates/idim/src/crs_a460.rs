//! Radkhah, Kulić & Croft 2007 in full: categories, exciting motion, simulated experiments on the CRS A460.

mod tables;

use crate::cli::NamedText;
use crate::error::Error;
use crate::identify::{Prediction, errors, joint_names};
use crate::plots;
use crate::progress::Progress;
use crate::report_html::page_of_paper;
use crate::result::IdentificationResult;
use crate::simulate::{Differentiation, Disturbances, Experiment, Processing, Recovered};
use crate::structure::{KeepOrder, Structure};
use faer::MatRef;
use idim_excitation::Conditioning;
use idim_model::{Columns, DriveColumns, Model, Robot, observation_matrix, robot_from_ron};
use idim_trajectory::{Certificate, FourierSeries, Limits, Motion, TrajectoryFile};
use rayon::prelude::*;

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
    predictions: Vec<Prediction>,
}

impl CrsRun {
    /// Torques of the simulated experiments, and the motions between their limits.
    pub fn plots(&self) -> Vec<NamedText> {
        let mut plots = plots::of_predictions(&self.predictions, &self.robot);
        plots.extend(self.motion_plots());
        plots
    }

    /// `report.html`.
    pub(crate) fn report(&self, command: &str) -> String {
        let titles = self.motions.iter().map(|m| format!("Motion: {}", m.title));
        let plots = self.motion_plots().into_iter().map(|(_, svg)| svg);
        let figures: Vec<NamedText> = titles.zip(plots).collect();
        page_of_paper(
            "Radkhah, Kulić & Croft 2007",
            &self.result,
            &self.robot,
            &self.predictions,
            &figures,
            command,
        )
    }

    fn motion_plots(&self) -> Vec<NamedText> {
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
    let mut times = Vec::new();
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
        times = experiment.times().to_vec();
    }
    progress.stage(format!(
        "crs-a460: {COVERAGE_RUNS} experiments for the coverage of the intervals"
    ));
    let coverage = coverage(&robot, &motions[0].series, seed)?;
    let text = tables::text(&structure, &motions, &experiments, &coverage);
    // Learnt on table I, proved on the other motion.
    let values = &experiments[0][0].weighted.values;
    let predictions: Vec<Prediction> = [true, false]
        .into_iter()
        .zip(&experiments)
        .map(|(training, runs)| runs[0].prediction(&robot, values, &times, training))
        .collect();
    let mut result = tables::result(&robot, &structure, &motions, &experiments, &coverage, seed);
    let joints = joint_names(&robot);
    result.train = errors(&joints, &predictions, true);
    result.validation = errors(&joints, &predictions, false);
    Ok(CrsRun {
        result,
        text,
        robot,
        limits,
        motions,
        predictions,
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
