//! One search for a Fourier motion: from a random start through ever sharper criteria and barriers to a certificate.

use crate::FourierOptions;
use crate::fourier_interior::Interior;
use crate::fourier_limits::BoundedSeries;
use crate::fourier_objective::FourierObjective;
use idim_trajectory::{Certificate, FourierSeries, Limits, random_series};
use std::f64::consts::TAU;

/// The first start uses this much of the limits: a step inside them, where the barrier is still flat.
const START_USE: f64 = 0.7;
/// Power of the norms that stand for extreme eigenvalues, and its growth from stage to stage.
const POWER: [f64; 2] = [4.0, 1.5];
/// Weight of the logarithmic barrier of the limits, and its decay from stage to stage.
const BARRIER: [f64; 2] = [3e-3, 0.5];
/// At the last one the norms are within 1 % of the eigenvalues and the barrier costs less than 0.1 %.
const N_STAGES: usize = 10;
/// Steps of a stage: what is left over, the next one does as well.
const MAX_STEPS: usize = 30;
/// From this stage on limits are imposed at the extrema as well.
const SHARP_STAGE: usize = 4;

/// A certified motion.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    pub(crate) series: FourierSeries,
    pub(crate) certificate: Certificate,
    /// Logarithm of the criterion.
    pub(crate) value: f64,
}

pub(crate) struct Search {
    /// `None` when nothing could be certified.
    pub(crate) found: Option<Found>,
    pub(crate) n_evaluations: usize,
}

/// Searches from the random motion of number `start`.
pub(crate) fn search(
    objective: &mut FourierObjective<'_>,
    limits: &Limits,
    options: &FourierOptions,
    start: u64,
) -> Search {
    let seed = options.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ start;
    let inside = limits.scaled(START_USE, START_USE, START_USE);
    let series = random_series(&inside, options.n_harmonics, options.period, seed);
    let bounds = BoundedSeries::new(
        limits,
        options.n_harmonics,
        options.period,
        options.n_constraint_samples,
    );
    let criterion = objective.criterion;
    let (mut power, mut barrier) = (POWER[0], BARRIER[0]);
    objective.criterion = criterion.smoothed(power);
    let x = bounds.variables(&series.coefficients());
    let mut descent = Interior::new(bounds, objective, x, barrier);
    let mut best: Option<Found> = None;
    for stage in 0..N_STAGES {
        descent.objective.criterion = criterion.smoothed(power);
        if stage < SHARP_STAGE {
            descent.evaluate();
        } else {
            descent.sharpen(barrier);
        }
        // Close enough for the next stage: a tenth of what the smoothing still hides.
        let enough = (0.1 / power).powi(2);
        for _ in 0..MAX_STEPS {
            if descent.objective.n_evaluations() >= options.max_evaluations {
                break;
            }
            let (decrement, moved) = descent.step(barrier);
            if !moved || decrement < enough {
                break;
            }
        }
        let c = descent.bounds.coefficients(&descent.x);
        descent.objective.criterion = criterion;
        if let Some(found) = certified(descent.objective, &c, limits, options)
            && best.as_ref().is_none_or(|b| found.value < b.value)
        {
            best = Some(found);
        }
        power *= POWER[1];
        barrier *= BARRIER[1];
    }
    Search {
        found: best,
        n_evaluations: descent.objective.n_evaluations(),
    }
}

/// The motion with its certificate, shrunk by what it exceeds the limits between the instants they were imposed at.
fn certified(
    objective: &mut FourierObjective<'_>,
    c: &[f64],
    limits: &Limits,
    options: &FourierOptions,
) -> Option<Found> {
    let omega = TAU / options.period;
    let series =
        FourierSeries::from_coefficients(omega, limits.n_joints(), options.n_harmonics, c).ok()?;
    let series = series.shrunk_into(limits);
    let certificate = series.certificate(limits);
    let value = objective.value(&series.coefficients());
    (certificate.certified && value.is_finite()).then_some(Found {
        series,
        certificate,
        value,
    })
}
