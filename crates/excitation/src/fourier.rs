//! The best Fourier motion for the torque model (Radkhah, Kulić & Croft, sections II.D and III.B).

use crate::fourier_chart::Chart;
use crate::fourier_options::check;
use crate::fourier_rounds::run_rounds;
use crate::fourier_search::Task;
use crate::{Conditioning, Error, FourierOptions};
use idim_model::{Columns, Model};
use idim_trajectory::{Certificate, FourierSeries, Limits};
use std::sync::atomic::AtomicBool;

/// A motion inside all limits at every instant, and how good it is.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierDesign {
    /// The motion.
    pub series: FourierSeries,
    /// Every criterion of its regressor as it is, over the samples of one period: no noise, nothing known before.
    pub conditioning: Conditioning,
    /// Largest use of each limit; always certified.
    pub certificate: Certificate,
    /// Value of the criterion after every search, round by round; infinite where a search led nowhere. With further
    /// criteria: the weighted sum.
    pub values: Vec<f64>,
    /// Rounds that were completed, the first included.
    pub n_rounds: usize,
    /// Evaluations of the criterion over all searches.
    pub n_evaluations: usize,
}

/// Where a running search stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FourierProgress {
    /// Round, 0 the first.
    pub round: usize,
    /// Value of the criterion after the search that has just ended.
    pub value: f64,
    /// The best so far.
    pub best: f64,
}

/// Eye and hand of whoever waits for a search.
#[derive(Clone, Copy)]
pub struct FourierWatch<'a> {
    /// Set it from anywhere to stop; the best motion so far is returned, after some milliseconds.
    pub stop: &'a AtomicBool,
    /// Called after every search, from the thread that ran it.
    pub progress: &'a (dyn Fn(&FourierProgress) + Sync),
}

/// Lowers a criterion over the coefficients of a Fourier series from many starts; the best certified motion wins.
///
/// Interior-point descent with exact gradients; kinks of a criterion are approached through ever sharper smooth
/// functions. Same motion for the same seed, whatever the number of threads.
/// Source: the motion is that of Swevers et al. 1997 and of Radkhah, Kulić & Croft.
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
    let stop = AtomicBool::new(false);
    let watch = FourierWatch {
        stop: &stop,
        progress: &|_| {},
    };
    optimise_fourier_watched(model, columns, limits, options, &watch)
}

/// [`optimise_fourier`] that can be watched and stopped; what is returned after a stop depends on when it came.
///
/// # Errors
/// As [`optimise_fourier`].
pub fn optimise_fourier_watched(
    model: &Model,
    columns: &Columns,
    limits: &Limits,
    options: &FourierOptions,
    watch: &FourierWatch<'_>,
) -> Result<FourierDesign, Error> {
    let criteria = check(model, columns, limits, options)?;
    let task = Task {
        model,
        columns,
        criteria,
        limits,
        options,
        chart: Chart::new(limits, options.n_harmonics, options.period, &options.ends),
        stop: watch.stop,
    };
    let outcome = run_rounds(&task, watch.progress);
    let Some(best) = outcome.best.into_iter().next() else {
        return Err(Error::NoFeasibleMotion {
            starts: options.n_starts,
            rule: "give more starts, or wider limits".into(),
        });
    };
    Ok(FourierDesign {
        conditioning: series_conditioning(model, columns, &best.series, options.n_samples),
        series: best.series,
        certificate: best.certificate,
        values: outcome
            .values
            .iter()
            .map(|&v| options.value_of_logarithm(v))
            .collect(),
        n_rounds: outcome.n_rounds,
        n_evaluations: outcome.n_evaluations,
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
