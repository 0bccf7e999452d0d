//! The way of the data: logs to rows, rows to an estimate, the estimate to errors on motions it has not seen.

use crate::baselines::baselines;
use crate::choice::{Found, LoadModel, find};
use crate::columns::ModelColumns;
use crate::error::Error;
use crate::fit::EstimationOptions;
use crate::friction::{self, FrictionChoice, FrictionPart};
use crate::load::LoadedRobot;
use crate::plan::{SamplingOptions, SamplingPlan};
use crate::report_html::{LogSummary, Spectrum, summaries};
use crate::result::{ErrorResult, IdentificationResult, JointError, SCHEMA};
use crate::samples::{Stretch, all_stretches, decimator, predict, stated_stretches};
use crate::sampling_choice::{Sampling, choose_sampling};
use crate::standstill::standstill_warnings;
use crate::structure::Structure;
use faer::Mat;
use idim_estimation::ResidualStatistics;
use idim_measurement::Measurements;
use idim_model::{DriveColumns, Robot};

/// What one run is asked for.
#[derive(Debug, Clone, Default)]
pub struct IdentifyOptions {
    /// Drive columns beside the inertial ones; `friction` decides over all but the rotor unless it is plain.
    pub columns: DriveColumns,
    /// How a log becomes samples.
    pub sampling: SamplingOptions,
    /// Friction terms of the joints.
    pub friction: FrictionChoice,
    /// How rows are weighted and what is kept.
    pub estimation: EstimationOptions,
    /// Kept in the result; nothing in an identification from logs is random but the structure's draw, which is fixed.
    pub seed: u64,
}

/// Share of each log that trains when no validation log is given; typical for one recording.
pub const TRAINING_SHARE: f64 = 0.7;

/// Measured and predicted torque of a stretch.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// Whether the estimate was made from it.
    pub training: bool,
    /// Time on the log's clock, s.
    pub time: Vec<f64>,
    /// As recorded, joint by joint, N·m.
    pub measured: Vec<Vec<f64>>,
    /// As predicted, joint by joint, N·m.
    pub predicted: Vec<Vec<f64>>,
    /// What of it is friction, where the model has some.
    pub friction: Option<FrictionPart>,
}

/// Everything an identification from logs found.
#[derive(Debug, Clone)]
pub struct Identification {
    /// For `result.json`.
    pub result: IdentificationResult,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Torques over time, training stretches first.
    pub predictions: Vec<Prediction>,
    /// The logs as read.
    pub logs: Vec<LogSummary>,
    /// Singular values of the rows the estimate was made from.
    pub spectrum: Spectrum,
    /// What the motors can feel.
    pub structure: Structure,
    /// The columns that have a value.
    pub columns: ModelColumns,
    /// Their values, SI.
    pub values: Vec<f64>,
    /// Covariance of the values.
    pub covariance: Mat<f64>,
    /// Speed over which each joint's Coulomb torque changes sign, rad/s (m/s); 0 is the sign itself.
    pub reversal: Vec<f64>,
    /// How the logs became samples.
    pub(crate) plan: SamplingPlan,
    /// What loads the gears, where friction depends on it.
    pub(crate) load: Option<LoadModel>,
}

/// Identifies a robot from its logs.
///
/// Without `validation` logs the first 70 % of each log train and the rest validates. Errors are those of the torque
/// predicted from the conditioned states against the recorded torque, at the log's own rate.
///
/// # Errors
/// An ambiguous structure, logs that cannot be conditioned, too few rows.
pub fn identify(
    loaded: &LoadedRobot,
    training: Vec<Measurements>,
    validation: Vec<Measurements>,
    options: &IdentifyOptions,
) -> Result<Identification, Error> {
    let robot = &loaded.robot;
    let mut warnings: Vec<String> = robot.notes().to_vec();
    for m in &training {
        warnings.extend(idim_measurement::check_motion(m, robot)?);
    }
    let logs = summaries(&training, &validation);
    let (training, validation) = if validation.is_empty() {
        training.iter().map(split).unzip()
    } else {
        (training, validation)
    };
    let Sampling { plan, cutoff } = sampling(robot, &training, options)?;
    let (mut train, clocks) = stated_stretches(&training, &plan)?;
    let (mut held_out, held_out_clocks) = stated_stretches(&validation, &plan)?;
    let mut conditioning = clocks;
    // Two parts of one log are said to be so once.
    conditioning.extend(held_out_clocks);
    conditioning.dedup();
    for part in [&train, &held_out] {
        warnings.extend(standstill_warnings(robot, part, options));
    }
    let Found {
        structure,
        plan,
        fit,
        chosen,
        load,
    } = find(robot, &mut train, plan, options)?;
    warnings.extend(fit.warnings.iter().cloned());
    if let Some(load) = &load {
        for stretch in &mut held_out {
            load.know(robot, stretch);
        }
    }
    let predictions: Vec<Prediction> = [(true, &train), (false, &held_out)]
        .into_iter()
        .flat_map(|(is_training, all)| all.iter().map(move |s| (is_training, s)))
        .map(|(training, s)| Prediction {
            training,
            time: s.time.clone(),
            measured: s.torque.clone(),
            predicted: predict(robot, &fit.columns, &fit.values, s, &plan.reversal),
            friction: Some(FrictionPart::of(robot, &fit, s, &plan)),
        })
        .collect();
    let joints = joint_names(robot);
    let result = IdentificationResult {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        robot: robot.name().to_owned(),
        seed: options.seed,
        reduction: structure.to_result(),
        train: errors(&joints, &predictions, true),
        validation: errors(&joints, &predictions, false),
        validation_in_band: errors(&joints, &in_band(&predictions, &held_out, &plan)?, false),
        baselines: baselines(robot, &joints, &fit, &train, &held_out, &plan)?,
        friction: friction::to_result(&joints, &chosen),
        estimate: Some(fit.result),
        excitation: None,
        paper: Vec::new(),
        inferred: Vec::new(),
        findings: Vec::new(),
        conditioning: plan.choices.iter().cloned().chain(conditioning).collect(),
        cutoff,
        warnings,
    };
    Ok(Identification {
        result,
        joints,
        predictions,
        logs,
        spectrum: fit.spectrum,
        structure,
        columns: fit.columns,
        values: fit.values,
        covariance: fit.covariance,
        reversal: plan.reversal.clone(),
        plan,
        load,
    })
}

/// How the logs become samples: everything that the options leave open is chosen from the data.
pub(crate) fn sampling(
    robot: &Robot,
    training: &[Measurements],
    options: &IdentifyOptions,
) -> Result<Sampling, Error> {
    let plan = SamplingPlan::new(training, &options.sampling);
    let at_first = all_stretches(training, &plan)?;
    let plan = with_own_dead_band(robot, plan, &at_first, options);
    drop(at_first);
    choose_sampling(robot, training, plan, options)
}

/// The first part trains, the rest validates; cut before anything is filtered, so that nothing leaks.
fn split(m: &Measurements) -> (Measurements, Measurements) {
    let n = m.n_samples();
    let cut = (TRAINING_SHARE * n as f64).round() as usize;
    (m.slice(0..cut), m.slice(cut..n))
}

/// Share of a joint's largest speed below which friction may point either way: static friction takes any value up to Coulomb's.
const AT_REST: f64 = 0.02;

/// A dead band where Coulomb friction is asked for and the options leave it open.
fn with_own_dead_band(
    robot: &Robot,
    plan: SamplingPlan,
    train: &[Stretch],
    options: &IdentifyOptions,
) -> SamplingPlan {
    let coulomb = options.columns.coulomb || options.friction != FrictionChoice::Plain;
    if !coulomb || options.sampling.as_recorded || !options.sampling.dead_band.is_empty() {
        return plan;
    }
    let own = |joint: usize| {
        let speeds = train.iter().flat_map(|s| s.states.qd(joint));
        AT_REST * speeds.fold(0.0, |m: f64, v| m.max(v.abs()))
    };
    let why = "a fiftieth of its largest speed: at rest friction may point either way";
    plan.with_dead_band((0..robot.n_joints()).map(own).collect(), why)
}

/// Held-out torques as the fit sees them: filtered and decimated alike, the same rows left out.
fn in_band(
    predictions: &[Prediction],
    held_out: &[Stretch],
    plan: &SamplingPlan,
) -> Result<Vec<Prediction>, Error> {
    let validation = predictions.iter().filter(|p| !p.training);
    let mut out = Vec::new();
    for (prediction, stretch) in validation.zip(held_out) {
        let decimator = decimator(stretch, plan)?;
        let n_samples = stretch.states.n_samples();
        if n_samples < decimator.fewest_samples() {
            continue;
        }
        let kept = decimator.kept(n_samples);
        let moving = |series: &Vec<f64>, joint: usize| -> Vec<f64> {
            let usable = stretch.usable(joint, plan, decimator.trim());
            let decimated = decimator.decimate(series).into_iter().zip(&kept);
            decimated
                .filter(|(_, k)| usable[**k])
                .map(|(v, _)| v)
                .collect()
        };
        let each = |all: &[Vec<f64>]| all.iter().enumerate().map(|(j, s)| moving(s, j)).collect();
        out.push(Prediction {
            training: false,
            time: Vec::new(),
            measured: each(&prediction.measured),
            predicted: each(&prediction.predicted),
            friction: None,
        });
    }
    Ok(out)
}

/// Errors over the predictions of one part; `None` where there are none.
pub(crate) fn errors(
    joints: &[String],
    predictions: &[Prediction],
    training: bool,
) -> Option<ErrorResult> {
    let mut statistics = ResidualStatistics::new(joints.len());
    let mut any = false;
    for p in predictions.iter().filter(|p| p.training == training) {
        any = true;
        for j in 0..joints.len() {
            for (measured, predicted) in p.measured[j].iter().zip(&p.predicted[j]) {
                statistics.push(j, *measured, *predicted);
            }
        }
    }
    let all = joints.iter().zip(statistics.all());
    any.then(|| ErrorResult {
        relative_error: statistics.relative_error(),
        joints: all
            .map(|(name, s)| JointError {
                name: name.clone(),
                rms: s.rms,
                relative_error: s.relative_error,
                r2: s.r2,
                largest: s.max_abs,
            })
            .collect(),
    })
}

/// Names of a robot's joints.
pub(crate) fn joint_names(robot: &Robot) -> Vec<String> {
    robot.joints().iter().map(|j| j.name.clone()).collect()
}
