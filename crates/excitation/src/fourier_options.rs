//! What a search for a Fourier motion is asked for, and whether it makes sense.

use crate::spectrum::SmoothCriterion;
use crate::{AddedColumn, Clearance, Criterion, Error, Scaling, TorquePrior};
use faer::Mat;
use idim_model::{Columns, Model};
use idim_trajectory::{FourierSeries, Limits};

/// Relative difference of two periods that are meant to be the same.
const SAME_PERIOD: f64 = 1e-9;

/// How a periodic motion begins and ends.
#[derive(Debug, Clone, PartialEq)]
pub enum FourierEnds {
    /// Anywhere, on the move: the robot needs a ramp to get into it.
    Free,
    /// With zero velocity and acceleration, anywhere.
    AtRest,
    /// With zero velocity and acceleration, at these positions, rad.
    AtRestAt(Vec<f64>),
}

/// How a Fourier motion is searched for.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierOptions {
    /// Period, s. Typical 10.
    pub period: f64,
    /// Harmonics of every joint. Typical 5.
    pub n_harmonics: usize,
    /// Samples of a period the criterion is evaluated on. Typical 100.
    pub n_samples: usize,
    /// What is lowered: one of the smooth criteria (2-norm, Frobenius, log det, trace, worst direction).
    pub criterion: Criterion,
    /// Further criteria with their weights, lowered with it: `log criterion + Σ weight · log further` (log det as it is).
    pub further: Vec<(f64, Criterion)>,
    /// Columns beside those of the regressor that the motion is to reveal as well; they come last.
    pub added: Vec<AddedColumn>,
    /// Begin and end of the motion.
    pub ends: FourierEnds,
    /// Standard deviation of each joint's torque, N·m, by which its rows are divided; empty: all alike.
    pub torque_noise: Vec<f64>,
    /// `Σ Yᵀ D Y` of earlier logs (columns × columns, `D` the inverse squared noise), over the number of samples this
    /// motion will add: the motion is then the best complement of those logs.
    pub prior_information: Option<Mat<f64>>,
    /// Torque limits to keep by a prediction of the same robot's torques, at every instant.
    pub torque: Option<TorquePrior>,
    /// Distances the same robot has to keep, at every instant.
    pub clearance: Option<Clearance>,
    /// Searches of a round. Typical 8.
    pub n_starts: usize,
    /// Motions the first searches start from; the others start from random ones. Period and harmonics as above. What is
    /// returned is never worse than one of them inside the limits.
    pub starts: Vec<FourierSeries>,
    /// Rounds of searches from beside the best motions, after the first. Typical 2.
    pub n_rounds: usize,
    /// Seed of the random starts.
    pub seed: u64,
    /// Evaluations a search may take. Typical 300.
    pub max_evaluations: usize,
    /// Instants of a period at which limits are imposed at first; extrema between them are added as they come near.
    /// More than twice the harmonics; typical 64.
    pub n_constraint_samples: usize,
}

impl Default for FourierOptions {
    /// The typical values, the raw 2-norm condition number, free ends, equal noise, nothing known before.
    fn default() -> Self {
        Self {
            period: 10.0,
            n_harmonics: 5,
            n_samples: 100,
            criterion: Criterion::TwoNorm(Scaling::Raw),
            further: Vec::new(),
            added: Vec::new(),
            ends: FourierEnds::Free,
            torque_noise: Vec::new(),
            prior_information: None,
            torque: None,
            clearance: None,
            n_starts: 8,
            starts: Vec::new(),
            n_rounds: 2,
            seed: 0,
            max_evaluations: 300,
            n_constraint_samples: 64,
        }
    }
}

impl FourierOptions {
    /// What is reported for a weighted sum of logarithms: the criterion itself where it is alone.
    pub(crate) fn value_of_logarithm(&self, logarithm: f64) -> f64 {
        if self.further.is_empty() {
            self.criterion.value_of_logarithm(logarithm)
        } else {
            logarithm
        }
    }
}

/// The smooth criteria asked for with their weights, once everything else has been found to make sense.
pub(crate) fn check(
    model: &Model,
    columns: &Columns,
    limits: &Limits,
    options: &FourierOptions,
) -> Result<Vec<(f64, SmoothCriterion)>, Error> {
    let mut criteria = Vec::new();
    let first = std::iter::once((1.0, options.criterion));
    for (weight, criterion) in first.chain(options.further.iter().copied()) {
        let Some(smooth) = SmoothCriterion::new(criterion) else {
            return Err(Error::input(
                "criterion",
                format!("{criterion:?}"),
                "it has no gradient; choose the 2-norm, Frobenius, log det, trace or worst direction",
            ));
        };
        criteria.push((weight, smooth));
    }
    check_joints(model, limits, options)?;
    let n_columns = columns.len() + options.added.len();
    let positive = |x: f64| x > 0.0 && x.is_finite();
    let rows = options.n_samples * model.n_joints();
    let known = options
        .prior_information
        .as_ref()
        .map_or(n_columns, Mat::nrows);
    let (harmonics, bounds) = (options.n_harmonics, options.n_constraint_samples);
    let rules = [
        (
            positive(options.period),
            "period",
            options.period,
            "it must be above zero",
        ),
        (
            harmonics > 0,
            "harmonics",
            harmonics as f64,
            "give at least one",
        ),
        (
            options.n_starts > 0,
            "starts",
            options.n_starts as f64,
            "give at least one",
        ),
        (
            rows >= n_columns,
            "samples",
            options.n_samples as f64,
            "they give fewer rows than columns; take more",
        ),
        (
            bounds > 2 * harmonics,
            "constraint samples",
            bounds as f64,
            "take more than twice the harmonics",
        ),
        (
            known == n_columns,
            "prior information",
            known as f64,
            "it has one row and one column for each column, added ones included",
        ),
    ];
    for (holds, place, met, rule) in rules {
        if !holds {
            return Err(Error::input(place, format!("{met}"), rule));
        }
    }
    for series in &options.starts {
        let same = series.n_joints() == model.n_joints() && series.n_harmonics() == harmonics;
        if !same || (series.period() / options.period - 1.0).abs() > SAME_PERIOD {
            return Err(Error::input(
                "starts",
                format!(
                    "{} joints, {} harmonics, {} s",
                    series.n_joints(),
                    series.n_harmonics(),
                    series.period()
                ),
                "a motion to start from has the joints of the model, and the harmonics and period asked for",
            ));
        }
    }
    Ok(criteria)
}

/// What has one entry a joint.
fn check_joints(model: &Model, limits: &Limits, options: &FourierOptions) -> Result<(), Error> {
    let n = model.n_joints();
    if limits.n_joints() != n {
        return Err(Error::input(
            "limits",
            format!("{} joints", limits.n_joints()),
            format!("the model has {n}; give limits for each"),
        ));
    }
    for column in &options.added {
        column.check(n)?;
    }
    let robots = [
        options.torque.as_ref().map(TorquePrior::robot),
        options.clearance.as_ref().map(Clearance::robot),
    ];
    for robot in robots.into_iter().flatten() {
        if robot.n_joints() != n {
            return Err(Error::input(
                "torque and clearance",
                format!("a robot of {} joints", robot.n_joints()),
                format!("the model has {n}; take the same robot"),
            ));
        }
    }
    let noise = &options.torque_noise;
    if !noise.is_empty() && (noise.len() != n || noise.iter().any(|&s| !(s > 0.0 && s.is_finite())))
    {
        return Err(Error::input(
            "torque noise",
            format!("{noise:?}"),
            format!("give {n} standard deviations above zero, or none"),
        ));
    }
    if let FourierEnds::AtRestAt(home) = &options.ends {
        let inside = |(q, [low, high]): (&f64, &[f64; 2])| low < q && q < high;
        if home.len() != n || !home.iter().zip(&limits.position).all(inside) {
            return Err(Error::input(
                "ends",
                format!("at rest at {home:?}"),
                format!("give {n} positions, each between its limits"),
            ));
        }
    }
    if options.ends != FourierEnds::Free && options.n_harmonics < 2 {
        return Err(Error::input(
            "harmonics",
            format!("{}", options.n_harmonics),
            "a motion that begins at rest needs at least two",
        ));
    }
    Ok(())
}
