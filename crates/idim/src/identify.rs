//! The way of the data: logs to rows, rows to an estimate, the estimate to errors on motions it has not seen.

use crate::error::Error;
use crate::load::LoadedRobot;
use crate::report_html::{LogSummary, Spectrum, summaries};
use crate::result::{
    ConditionResult, ErrorResult, EstimateResult, IdentificationResult, JointError,
    ParameterResult, SCHEMA,
};
use crate::samples::{Rows, SamplingPlan, Stretch, predict, push_rows, reversal_speeds, stretches};
use crate::structure::{KeepOrder, Structure};
use faer::{Mat, MatRef};
use idim_base_params::{ReductionOptions, TriangularFactor, reduce};
use idim_estimation::{
    Estimate, ResidualStatistics, Solution, WeightedSolution, Weighting, WeightingOptions,
    factor_of, solve, weighted_least_squares_dense,
};
use idim_measurement::Measurements;
use idim_model::{Columns, DriveColumns, ParameterKind, Robot};

/// What one run is asked for.
#[derive(Debug, Clone)]
pub struct IdentifyOptions {
    /// Drive columns beside the inertial ones.
    pub columns: DriveColumns,
    /// Take q, q̇, q̈ and torque as they are.
    pub as_recorded: bool,
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

/// The friction of a predicted torque over the velocity, joint by joint.
#[derive(Debug, Clone)]
pub struct FrictionPart {
    /// Velocity of the joint, rad/s (m/s).
    pub velocity: Vec<Vec<f64>>,
    /// Torque of everything that is neither inertia nor weight, N·m (N).
    pub torque: Vec<Vec<f64>>,
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
    pub columns: Columns,
    /// Their values, SI.
    pub values: Vec<f64>,
    /// Covariance of the values.
    pub covariance: Mat<f64>,
    /// Speed over which each joint's Coulomb torque changes sign, rad/s (m/s); 0 is the sign itself.
    pub reversal: Vec<f64>,
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
    let structure = Structure::of_torque(robot, options.columns, KeepOrder::Links).decided()?;
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
    let plan = if options.as_recorded {
        SamplingPlan::as_recorded()
    } else {
        SamplingPlan::from_motion(&training)
    };
    let train = all_stretches(&training, &plan)?;
    let held_out = all_stretches(&validation, &plan)?;
    let smoothed = !options.as_recorded && options.columns.coulomb;
    let (plan, fit) = if smoothed {
        best_reversal(robot, &structure, &train, &plan)?
    } else {
        let fit = fit(robot, &structure, &train, &plan)?;
        (plan, fit)
    };
    warnings.extend(fit.warnings.iter().cloned());
    let predictions: Vec<Prediction> = [(true, &train), (false, &held_out)]
        .into_iter()
        .flat_map(|(is_training, all)| all.iter().map(move |s| (is_training, s)))
        .map(|(training, s)| Prediction {
            training,
            time: s.time.clone(),
            measured: s.torque.clone(),
            predicted: predict(robot, &fit.columns, &fit.values, s, &plan),
            friction: Some(friction_part(robot, &fit, s, &plan)),
        })
        .collect();
    let joints = joint_names(robot);
    let result = IdentificationResult {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        robot: robot.name().to_owned(),
        seed: options.seed,
        reduction: structure.to_result(),
        estimate: Some(fit.result),
        train: errors(&joints, &predictions, true),
        validation: errors(&joints, &predictions, false),
        excitation: None,
        paper: Vec::new(),
        inferred: Vec::new(),
        findings: Vec::new(),
        conditioning: plan.choices.clone(),
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
        reversal: reversal_speeds(robot, plan.coulomb_speed),
    })
}

/// The prediction with every inertial parameter set to zero.
fn friction_part(robot: &Robot, fit: &Fit, stretch: &Stretch, plan: &SamplingPlan) -> FrictionPart {
    let inertial = |k: ParameterKind| k.inertial_index().is_some() || k == ParameterKind::Ia;
    let columns = fit.columns.0.iter().zip(&fit.values);
    let friction: Vec<f64> = columns
        .map(|(c, &v)| if inertial(c.kind) { 0.0 } else { v })
        .collect();
    FrictionPart {
        velocity: (0..robot.n_joints())
            .map(|j| stretch.states.qd(j).to_vec())
            .collect(),
        torque: predict(robot, &fit.columns, &friction, stretch, plan),
    }
}

/// The first part trains, the rest validates; cut before anything is filtered, so that nothing leaks.
fn split(m: &Measurements) -> (Measurements, Measurements) {
    let n = m.n_samples();
    let cut = (TRAINING_SHARE * n as f64).round() as usize;
    (m.slice(0..cut), m.slice(cut..n))
}

fn all_stretches(logs: &[Measurements], plan: &SamplingPlan) -> Result<Vec<Stretch>, Error> {
    let parts: Result<Vec<_>, _> = logs.iter().map(|m| stretches(m, plan)).collect();
    Ok(parts?.into_iter().flatten().collect())
}

struct Fit {
    columns: Columns,
    values: Vec<f64>,
    covariance: Mat<f64>,
    result: EstimateResult,
    warnings: Vec<String>,
    spectrum: Spectrum,
    /// Sum over the joints of the logarithm of the residual's standard deviation: smaller fits better.
    misfit: f64,
}

impl Fit {
    fn new(columns: Columns, solved: &Solved, names: &[String], warnings: Vec<String>) -> Self {
        Self {
            columns,
            values: solved.estimate.values.clone(),
            covariance: solved.estimate.covariance.clone(),
            result: estimate_result(solved, names),
            warnings,
            spectrum: solved.spectrum.clone(),
            misfit: solved.misfit,
        }
    }
}

/// Speeds (rad/s) over which the Coulomb torque may change sign: from hardly smoothed to that of a noisy velocity.
const REVERSAL_SPEEDS: [f64; 3] = [0.001, 0.005, 0.02];

/// The smoothing of the Coulomb torque that fits the training data best, and its fit.
fn best_reversal(
    robot: &Robot,
    structure: &Structure,
    train: &[Stretch],
    plan: &SamplingPlan,
) -> Result<(SamplingPlan, Fit), Error> {
    let mut best: Option<(SamplingPlan, Fit)> = None;
    for speed in REVERSAL_SPEEDS {
        let plan = plan.with_coulomb_speed(speed);
        let fit = fit(robot, structure, train, &plan)?;
        if best.as_ref().is_none_or(|(_, b)| fit.misfit < b.misfit) {
            best = Some((plan, fit));
        }
    }
    best.ok_or_else(|| Error::input("estimate", "no fit", "a defect of this program"))
}

fn fit(
    robot: &Robot,
    structure: &Structure,
    train: &[Stretch],
    plan: &SamplingPlan,
) -> Result<Fit, Error> {
    let columns = structure.base_columns();
    let mut rows = Rows::default();
    for stretch in train {
        push_rows(&mut rows, robot, &columns, stretch, plan)?;
    }
    let names = structure.base_names();
    match solved(&rows, columns.len(), robot.n_joints())? {
        Some(solved) => Ok(Fit::new(columns, &solved, &names, Vec::new())),
        None => excited_fit(robot, &columns, &names, &rows),
    }
}

/// A fit of all columns, and how it was made.
struct Solved {
    estimate: Estimate,
    condition: ConditionResult,
    method: &'static str,
    spectrum: Spectrum,
    misfit: f64,
}

/// Weighted by the noise of the joints; ordinary where the weights themselves make the rows dependent, as those of a
/// joint that is fitted exactly do. `None` where the columns are dependent.
fn solved(rows: &Rows, n_columns: usize, n_joints: usize) -> Result<Option<Solved>, Error> {
    let w = MatRef::from_row_major_slice(&rows.w, rows.y.len(), n_columns);
    let factor = factor_of(w, &rows.y)?;
    let spectrum = Spectrum::of_factor(&factor);
    if let WeightedSolution::Determined(fit) = weighted(rows, n_columns, n_joints)? {
        let noise = fit.noise.standard_deviation();
        return Ok(Some(Solved {
            condition: ConditionResult {
                raw: Some(fit.ordinary.condition_number.raw),
                equilibrated: Some(fit.ordinary.condition_number.equilibrated),
                weighted: Some(fit.estimate.condition_number.raw),
            },
            estimate: fit.estimate,
            method: "weighted least squares, one variance a joint, iterated",
            spectrum,
            misfit: noise.iter().map(|s| s.ln()).sum(),
        }));
    }
    let Solution::Determined(estimate) = solve(&factor)? else {
        return Ok(None);
    };
    Ok(Some(Solved {
        condition: ConditionResult {
            raw: Some(estimate.condition_number.raw),
            equilibrated: Some(estimate.condition_number.equilibrated),
            weighted: None,
        },
        misfit: n_joints as f64 * estimate.sigma.ln(),
        estimate,
        method: "ordinary least squares: a joint without residual has no weight",
        spectrum,
    }))
}

fn weighted(rows: &Rows, n_columns: usize, n_joints: usize) -> Result<WeightedSolution, Error> {
    let w = MatRef::from_row_major_slice(&rows.w, rows.y.len(), n_columns);
    let options = WeightingOptions {
        weighting: Weighting::Diagonal,
        ..WeightingOptions::default()
    };
    Ok(weighted_least_squares_dense(
        w, &rows.y, n_joints, &options,
    )?)
}

/// The log does not excite every base parameter: estimate what it does, and say what it does not.
fn excited_fit(
    robot: &Robot,
    columns: &Columns,
    names: &[String],
    rows: &Rows,
) -> Result<Fit, Error> {
    let p = columns.len();
    let mut factor = TriangularFactor::new(p);
    factor.push_rows(&rows.w);
    let order: Vec<usize> = (0..p).collect();
    let reduction = reduce(&factor, &order, &ReductionOptions::default());
    let kept = &reduction.base;
    let excited_names = reduction.base_names(names);
    let warning = format!(
        "this log excites only {} of {} base parameters; not determined on their own: {}. Move every joint, faster and in more directions, or hold still joints with --lock",
        kept.len(),
        p,
        (0..p)
            .filter(|k| !reduction.identifiable_alone.contains(k))
            .map(|k| names[k].as_str())
            .collect::<Vec<_>>()
            .join(", "),
    );
    let mut w = Vec::with_capacity(rows.y.len() * kept.len());
    for row in rows.w.chunks_exact(p) {
        w.extend(kept.iter().map(|&k| row[k]));
    }
    let reduced = Rows {
        w,
        y: rows.y.clone(),
    };
    let Some(solved) = solved(&reduced, kept.len(), robot.n_joints())? else {
        return Err(Error::input(
            "estimate",
            format!(
                "rank below {} after reduction to what the log excites",
                kept.len()
            ),
            "record a motion that moves every joint",
        ));
    };
    Ok(Fit::new(
        columns.select(kept),
        &solved,
        &excited_names,
        vec![warning],
    ))
}

fn estimate_result(solved: &Solved, names: &[String]) -> EstimateResult {
    let e = &solved.estimate;
    let finite = |x: f64| x.is_finite().then_some(x);
    let parameter = |(k, name): (usize, &String)| ParameterResult {
        name: name.clone(),
        value: Some(e.values[k]),
        std: finite(e.standard_deviation[k]),
        relative_std: finite(e.relative_std[k]),
    };
    EstimateResult {
        method: solved.method.into(),
        parameters: names.iter().enumerate().map(parameter).collect(),
        condition_number: solved.condition,
    }
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
            })
            .collect(),
    })
}

/// Names of a robot's joints.
pub(crate) fn joint_names(robot: &Robot) -> Vec<String> {
    robot.joints().iter().map(|j| j.name.clone()).collect()
}
