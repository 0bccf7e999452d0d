//! The best Fourier motion for the torque model (Radkhah, Kulić & Croft, sections II.D and III.B).

use crate::fourier_objective::FourierObjective;
use crate::spectrum::SmoothCriterion;
use crate::{Conditioning, Criterion, Error};
use idim_model::{Columns, Model};
use idim_trajectory::{
    Certificate, FourierSeries, Limits, LinearRows, constraint_rows, random_series,
};
use rayon::prelude::*;
use slsqp::{Func, StopTols};
use std::cell::RefCell;
use std::f64::consts::TAU;

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
    /// Instants of a period at which limits are imposed, tightened so that they hold between them: `cos(π N / M)` of
    /// each limit can be used. More than twice the harmonics; typical 48.
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
/// Sequential quadratic programming with the limits as linear inequalities that hold at every instant. Same motion
/// for the same seed, whatever the number of threads.
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
    let rows = ScaledRows::new(limits, options);
    let runs: Vec<Run> = (0..options.n_starts)
        .into_par_iter()
        .map(|start| {
            let objective = FourierObjective::new(model, columns, criterion, options);
            run(objective, &rows, limits, options, start as u64)
        })
        .collect();
    let mut best: Option<(&Run, &Certified)> = None;
    for run in &runs {
        if let Some(found) = &run.found
            && best.is_none_or(|(b, _)| run.value < b.value)
        {
            best = Some((run, found));
        }
    }
    let Some((_, (series, certificate))) = best else {
        return Err(Error::NoFeasibleMotion {
            starts: options.n_starts,
            rule: "give more starts, or wider limits".into(),
        });
    };
    let mut objective = FourierObjective::new(model, columns, criterion, options);
    Ok(FourierDesign {
        conditioning: objective.conditioning(&series.coefficients()),
        series: series.clone(),
        certificate: certificate.clone(),
        values: runs
            .iter()
            .map(|r| options.criterion.value_of_logarithm(r.value))
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

type Certified = (FourierSeries, Certificate);

struct Run {
    found: Option<Certified>,
    /// Logarithm of the criterion; infinite when nothing was certified.
    value: f64,
    n_evaluations: usize,
}

/// Limits as rows over coefficients divided by a typical size, each row divided by its right side or largest entry.
struct ScaledRows {
    rows: LinearRows,
    /// Typical size of each coefficient: half the range for the offset, the largest speed for the others.
    size: Vec<f64>,
}

impl ScaledRows {
    fn new(limits: &Limits, options: &FourierOptions) -> Self {
        let width = 2 * options.n_harmonics + 1;
        let size: Vec<f64> = (0..limits.n_joints())
            .flat_map(|j| {
                let speed = limits.velocity[j];
                (0..width).map(move |c| if c == 0 { 0.0 } else { speed })
            })
            .enumerate()
            .map(|(k, s)| {
                if k % width == 0 {
                    limits.half_range(k / width)
                } else {
                    s
                }
            })
            .collect();
        let mut rows = constraint_rows(
            limits,
            options.n_harmonics,
            options.period,
            options.n_constraint_samples,
        );
        for (row, right) in rows
            .coefficients
            .chunks_exact_mut(rows.n_columns)
            .zip(&mut rows.right_side)
        {
            for (r, s) in row.iter_mut().zip(&size) {
                *r *= s;
            }
            let largest = row.iter().fold(0.0_f64, |a, r| a.max(r.abs()));
            for r in row.iter_mut() {
                *r /= largest;
            }
            *right /= largest;
        }
        Self { rows, size }
    }

    fn unscale(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.size).map(|(x, s)| x * s).collect()
    }
}

fn run(
    objective: FourierObjective<'_>,
    scaled: &ScaledRows,
    limits: &Limits,
    options: &FourierOptions,
    start: u64,
) -> Run {
    let seed = options.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ start;
    let series = random_series(limits, options.n_harmonics, options.period, seed);
    let x0: Vec<f64> = series
        .coefficients()
        .iter()
        .zip(&scaled.size)
        .map(|(c, s)| c / s)
        .collect();
    let objective = RefCell::new(objective);
    let f = |x: &[f64], gradient: Option<&mut [f64]>, (): &mut ()| {
        let mut objective = objective.borrow_mut();
        let c = scaled.unscale(x);
        let Some(gradient) = gradient else {
            return objective.value(&c);
        };
        let value = objective.value_and_gradient(&c, gradient);
        for (g, s) in gradient.iter_mut().zip(&scaled.size) {
            *g *= s;
        }
        value
    };
    let constraints: Vec<_> = (0..scaled.rows.n_rows())
        .map(|i| {
            let (row, right) = (scaled.rows.row(i), scaled.rows.right_side[i]);
            move |x: &[f64], gradient: Option<&mut [f64]>, (): &mut ()| {
                if let Some(g) = gradient {
                    g.copy_from_slice(row);
                }
                crate::dense::dot(row, x) - right
            }
        })
        .collect();
    let constraints: Vec<&dyn Func<()>> = constraints.iter().map(|c| c as &dyn Func<()>).collect();
    let bounds = vec![(f64::NEG_INFINITY, f64::INFINITY); x0.len()];
    let tolerance = StopTols {
        ftol_rel: 1e-6,
        ..StopTols::default()
    };
    let outcome = slsqp::minimize(
        f,
        &x0,
        &bounds,
        &constraints,
        (),
        options.max_evaluations,
        Some(tolerance),
    );
    let x = match outcome {
        Ok((_, x, _)) | Err((_, x, _)) => x,
    };
    let mut objective = objective.into_inner();
    let found = certify(&scaled.unscale(&x), limits, options);
    let value = found.as_ref().map_or(f64::INFINITY, |(series, _)| {
        objective.value(&series.coefficients())
    });
    Run {
        found,
        value,
        n_evaluations: objective.n_evaluations(),
    }
}

/// The series with its certificate; moved towards the middle of the limits by what an inexact solution exceeds them.
fn certify(c: &[f64], limits: &Limits, options: &FourierOptions) -> Option<Certified> {
    let (n, width) = (limits.n_joints(), 2 * options.n_harmonics + 1);
    let omega = TAU / options.period;
    let mut c = c.to_vec();
    let series = FourierSeries::from_coefficients(omega, n, options.n_harmonics, &c).ok()?;
    let certificate = series.certificate(limits);
    if certificate.certified {
        return Some((series, certificate));
    }
    for j in 0..n {
        let used = &certificate.joints[j];
        let bounds = [used.position, used.velocity, used.acceleration].map(|u| u.bound);
        let shrink = 1.0 / bounds.iter().fold(1.0_f64, |a, &b| a.max(b));
        let centre = limits.centre(j);
        let c = &mut c[j * width..(j + 1) * width];
        c[0] = centre + shrink * (c[0] - centre);
        for v in &mut c[1..] {
            *v *= shrink;
        }
    }
    let series = FourierSeries::from_coefficients(omega, n, options.n_harmonics, &c).ok()?;
    let certificate = series.certificate(limits);
    certificate.certified.then_some((series, certificate))
}
