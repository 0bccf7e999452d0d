//! The best Fourier motion for the torque model (Radkhah, Kulić & Croft, sections II.D and III.B).

use crate::fourier_objective::FourierObjective;
use crate::fourier_search::{Found, Search, search};
use crate::spectrum::SmoothCriterion;
use crate::{Conditioning, Criterion, Error};
use idim_model::{Columns, Model};
use idim_trajectory::{Certificate, FourierSeries, Limits};
use rayon::prelude::*;

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
    /// Random starts. Typical 4.
    pub n_starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// Evaluations a start may take. Typical 300.
    pub max_evaluations: usize,
    /// Instants of a period at which limits are imposed at first; extrema between them are added as they come near.
    /// More than twice the harmonics; typical 64.
    pub n_constraint_samples: usize,
}

/// A motion inside all limits at every instant, and how good it is.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierDesign {
    /// The motion.
    pub series: FourierSeries,
    /// Every criterion over the samples of one period.
    pub conditioning: Conditioning,
    /// Largest use of each limit; always certified.
    pub certificate: Certificate,
    /// Value of the criterion after every start, in order; infinite where a start led nowhere.
    pub values: Vec<f64>,
    /// Evaluations of the criterion over all starts.
    pub n_evaluations: usize,
}

/// Lowers a criterion over the coefficients of a Fourier series from random starts; the best certified motion wins.
///
/// Interior-point descent with exact gradients; kinks of a criterion are approached through ever sharper smooth
/// functions. Same motion for the same seed, whatever the number of threads.
/// Source: Swevers et al. 1997; Radkhah, Kulić & Croft.
///
/// # Errors
/// A criterion that is not smooth, limits of another robot, options that leave nothing to optimise; no motion that
/// could be certified.
pub fn optimise_fourier(
    model: &Model,
    columns: &Columns,
    limits: &Limits,
    options: &FourierOptions,
) -> Result<FourierDesign, Error> {
    let criterion = check(model, columns, limits, options)?;
    let runs: Vec<Search> = (0..options.n_starts)
        .into_par_iter()
        .map(|start| {
            let mut objective = FourierObjective::new(model, columns, criterion, options);
            search(&mut objective, limits, options, start as u64)
        })
        .collect();
    let mut best: Option<&Found> = None;
    for found in runs.iter().filter_map(|run| run.found.as_ref()) {
        if best.is_none_or(|b| found.value < b.value) {
            best = Some(found);
        }
    }
    let Some(best) = best else {
        return Err(Error::NoFeasibleMotion {
            starts: options.n_starts,
            rule: "give more starts, or wider limits".into(),
        });
    };
    let mut objective = FourierObjective::new(model, columns, criterion, options);
    let values = runs
        .iter()
        .map(|run| run.found.as_ref().map_or(f64::INFINITY, |f| f.value));
    Ok(FourierDesign {
        conditioning: objective.conditioning(&best.series.coefficients()),
        series: best.series.clone(),
        certificate: best.certificate.clone(),
        values: values
            .map(|v| options.criterion.value_of_logarithm(v))
            .collect(),
        n_evaluations: runs.iter().map(|r| r.n_evaluations).sum(),
    })
}

/// Every criterion of a series over `n_samples` equal steps of its period, for these columns.
///
/// # Panics
/// If series and model differ in their number of joints, or there are too few samples for the columns.
#[track_caller]
pub fn series_conditioning(
    model: &Model,
    columns: &Columns,
    series: &FourierSeries,
    n_samples: usize,
) -> Conditioning {
    let states = series.equispaced_states(n_samples);
    let w = idim_model::observation_matrix(model, columns, &states);
    let w = faer::MatRef::from_column_major_slice(w.as_slice(), w.nrows(), w.ncols());
    Conditioning::of_rows(w, n_samples)
}

fn check(
    model: &Model,
    columns: &Columns,
    limits: &Limits,
    options: &FourierOptions,
) -> Result<SmoothCriterion, Error> {
    let Some(criterion) = SmoothCriterion::new(options.criterion) else {
        return Err(Error::input(
            "criterion",
            format!("{:?}", options.criterion),
            "it has no gradient; choose the 2-norm, Frobenius, log det, trace or worst direction",
        ));
    };
    if limits.n_joints() != model.n_joints() {
        return Err(Error::input(
            "limits",
            format!("{} joints", limits.n_joints()),
            format!("the model has {}; give limits for each", model.n_joints()),
        ));
    }
    let rows = options.n_samples * model.n_joints();
    let rules = [
        (
            options.period > 0.0 && options.period.is_finite(),
            "period",
            options.period,
            "it must be above zero",
        ),
        (
            options.n_harmonics > 0,
            "harmonics",
            options.n_harmonics as f64,
            "give at least one",
        ),
        (
            options.n_starts > 0,
            "starts",
            options.n_starts as f64,
            "give at least one",
        ),
        (
            rows >= columns.len(),
            "samples",
            options.n_samples as f64,
            "they give fewer rows than columns; take more",
        ),
        (
            options.n_constraint_samples > 2 * options.n_harmonics,
            "constraint samples",
            options.n_constraint_samples as f64,
            "take more than twice the harmonics",
        ),
    ];
    for (holds, place, met, rule) in rules {
        if !holds {
            return Err(Error::input(place, format!("{met}"), rule));
        }
    }
    Ok(criterion)
}
