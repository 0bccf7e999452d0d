//! One search for a Fourier motion: through ever sharper criteria and barriers to a certificate.

use crate::fourier_chart::Chart;
use crate::fourier_interior::Interior;
use crate::fourier_limits::Bounds;
use crate::fourier_objective::FourierObjective;
use crate::fourier_options::check;
use crate::path_penalty::PathCertificates;
use crate::spectrum::SmoothCriterion;
use crate::{Error, FourierOptions};
use idim_model::{Columns, Model};
use idim_trajectory::{Certificate, FourierSeries, Limits};
use std::sync::atomic::{AtomicBool, Ordering};

/// How sharp a search begins, and for how many stages it goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Schedule {
    /// Power of the norms that stand for extreme eigenvalues.
    power: f64,
    /// Weight of the logarithmic barrier of the limits.
    barrier: f64,
    n_stages: usize,
    /// From this stage on limits are imposed at the extrema as well.
    sharp_stage: usize,
}

/// From anywhere. At the last stage the norms are within 2 % of the eigenvalues and the barrier costs below 0.1 %.
pub(crate) const EXPLORE: Schedule = Schedule {
    power: 4.0,
    barrier: 3e-3,
    n_stages: 10,
    sharp_stage: 4,
};
/// From beside a good motion: sharper from the start, so that not all of it is lost on the way.
pub(crate) const REVISIT: Schedule = Schedule {
    power: 6.0,
    barrier: 1e-3,
    n_stages: 8,
    sharp_stage: 3,
};
/// From a good motion: the last tenths of a percent.
const FINISH: Schedule = Schedule {
    power: 100.0,
    barrier: 1e-5,
    n_stages: 6,
    sharp_stage: 0,
};
/// Growth of the power and decay of the barrier from stage to stage.
const SHARPENING: [f64; 2] = [1.4, 0.5];
/// Steps of a stage: what is left over, the next one does as well.
const MAX_STEPS: usize = 15;
/// A stage ends when a step promises less than this share of what the smoothing still hides.
const STAGE_TOLERANCE: f64 = 0.1;
/// With conditions on the path: stages more, at most, until they can be proved.
const REPAIRS: usize = 8;
/// A random motion that breaks such a condition is drawn in by this factor, so many times at most.
const DRAW: (f64, usize) = (0.75, 6);
/// A start comes this near to the limits at most: the barrier is infinite on them.
const LARGEST_USE: f64 = 0.98;

/// What all searches share.
pub(crate) struct Task<'a> {
    pub(crate) model: &'a Model,
    pub(crate) columns: &'a Columns,
    pub(crate) criteria: Vec<(f64, SmoothCriterion)>,
    pub(crate) limits: &'a Limits,
    pub(crate) options: &'a FourierOptions,
    pub(crate) chart: Chart,
    pub(crate) stop: &'a AtomicBool,
}

/// A certified motion.
#[derive(Debug, Clone)]
pub(crate) struct Found {
    pub(crate) series: FourierSeries,
    pub(crate) certificate: Certificate,
    /// Proofs that torque limits and distances hold.
    pub(crate) path: PathCertificates,
    /// Logarithm of the criterion.
    pub(crate) value: f64,
}

/// What a search came to.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    /// `None` when nothing could be certified.
    pub(crate) found: Option<Found>,
    pub(crate) n_evaluations: usize,
}

impl<'a> Task<'a> {
    pub(crate) fn new(
        model: &'a Model,
        columns: &'a Columns,
        limits: &'a Limits,
        options: &'a FourierOptions,
        stop: &'a AtomicBool,
    ) -> Result<Self, Error> {
        Ok(Self {
            criteria: check(model, columns, limits, options)?,
            chart: Chart::new(limits, options.n_harmonics, options.period, &options.ends),
            model,
            columns,
            limits,
            options,
            stop,
        })
    }

    pub(crate) fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn bounds(&self) -> Bounds {
        Bounds::new(
            self.limits,
            self.chart.clone(),
            self.options.n_harmonics,
            self.options.period,
            self.options.n_constraint_samples,
        )
    }

    /// These coefficients as they are, but for what exceeds the limits; conditions on the path hold at samples.
    pub(crate) fn evaluate(&self, c: &[f64]) -> Search {
        let mut objective = self.objective();
        let bounds = self.bounds();
        let mut x = self.chart.variables(c);
        let mut found = bounds.certified(&x);
        if let Some(mut path) = objective.path.take() {
            for _ in 0..DRAW.1 {
                let held = found.filter(|(s, _)| path.held_at_samples(&s.coefficients()));
                found = held;
                if found.is_some() {
                    break;
                }
                for x in &mut x {
                    *x *= DRAW.0;
                }
                found = bounds.certified(&x);
            }
            found = found.filter(|(s, _)| path.held_at_samples(&s.coefficients()));
        }
        let found =
            found.and_then(|found| valued(&mut objective, found, PathCertificates::default()));
        Search {
            found,
            n_evaluations: objective.n_evaluations(),
        }
    }

    /// A motion of [`evaluate`](Self::evaluate) with the proofs it lacks; `None` where there is none.
    pub(crate) fn proved(&self, found: &Found) -> Option<Found> {
        let Some(mut path) = self.objective().path.take() else {
            return Some(found.clone());
        };
        let path = path.certify(&found.series)?;
        Some(Found {
            path,
            ..found.clone()
        })
    }

    fn objective(&self) -> FourierObjective<'_> {
        FourierObjective::new(self.model, self.columns, &self.criteria, self.options)
    }

    /// The last tenths of a percent from a good motion; short enough to be taken even by who was told to stop.
    pub(crate) fn finish(&self, start: &[f64]) -> Search {
        let never = AtomicBool::new(false);
        let task = Task {
            model: self.model,
            columns: self.columns,
            criteria: self.criteria.clone(),
            limits: self.limits,
            options: self.options,
            chart: self.chart.clone(),
            stop: &never,
        };
        task.search(start, FINISH)
    }

    /// Searches from these coefficients; told to stop, it returns what it has.
    pub(crate) fn search(&self, start: &[f64], schedule: Schedule) -> Search {
        let mut objective = self.objective();
        let (mut power, mut barrier) = (schedule.power, schedule.barrier);
        objective.smooth(Some(power));
        let x = self.chart.variables(start);
        let bounds = self.bounds();
        let mut descent = Interior::new(bounds, &mut objective, x, LARGEST_USE, barrier);
        let mut best: Option<Found> = None;
        let repairs = descent.objective.path.as_ref().map_or(0, |_| REPAIRS);
        for stage in 0..schedule.n_stages + repairs {
            descent.objective.smooth(Some(power));
            if stage >= schedule.sharp_stage {
                descent.sharpen(barrier);
            } else {
                descent.evaluate();
            }
            self.descend(&mut descent, power, barrier);
            let last = stage + 1 >= schedule.n_stages;
            let enough = last && (repairs == 0 || best.is_some());
            let done = self.stopped() || self.used_up(&descent) || enough;
            // The last stages differ by less than the limits between their instants: the best of them counts.
            if done || stage + 3 >= schedule.n_stages {
                keep_better(&mut descent, &mut best);
            }
            if done || (last && best.is_some()) {
                break;
            }
            if let Some(path) = &mut descent.objective.path {
                path.move_shifts();
            }
            if !last {
                power *= SHARPENING[0];
                barrier *= SHARPENING[1];
            }
        }
        Search {
            found: best,
            n_evaluations: objective.n_evaluations(),
        }
    }

    fn used_up(&self, descent: &Interior<'_, '_>) -> bool {
        // Conditions on the path are approached from outside, which takes as long again.
        let times = 1 + usize::from(descent.objective.path.is_some());
        descent.objective.n_evaluations() >= times * self.options.max_evaluations
    }

    fn descend(&self, descent: &mut Interior<'_, '_>, power: f64, barrier: f64) {
        let enough = (STAGE_TOLERANCE / power).powi(2);
        for _ in 0..MAX_STEPS {
            if self.stopped() || self.used_up(descent) {
                break;
            }
            let step = descent.step(barrier);
            if !step.moved || step.decrement < enough {
                break;
            }
        }
    }
}

/// Keeps where the search stands if it can be certified and is better than what was kept before.
fn keep_better(descent: &mut Interior<'_, '_>, best: &mut Option<Found>) {
    let found = descent.bounds.certified(&descent.x);
    descent.objective.smooth(None);
    let Some(found) = found else { return };
    let Some(mut found) = valued(descent.objective, found, PathCertificates::default()) else {
        return;
    };
    if best.as_ref().is_some_and(|b| b.value <= found.value) {
        return;
    }
    if let Some(path) = &mut descent.objective.path {
        let Some(proofs) = path.certify(&found.series) else {
            return;
        };
        found.path = proofs;
    }
    *best = Some(found);
}

/// The motion with its value, unless columns are dependent.
fn valued(
    objective: &mut FourierObjective<'_>,
    (series, certificate): (FourierSeries, Certificate),
    path: PathCertificates,
) -> Option<Found> {
    let value = objective.value(&series.coefficients());
    value.is_finite().then_some(Found {
        series,
        certificate,
        path,
        value,
    })
}
