//! The best Fourier motion for the torque model (Radkhah, Kulić & Croft, sections II.D and III.B).

use crate::added_columns::AddedRows;
use crate::fourier_rounds::{Outcome, run_rounds, try_at_random};
use crate::fourier_search::Task;
use crate::{
    AddedColumn, ClearanceCertificate, Conditioning, Error, FourierOptions, TorqueCertificate,
};
use idim_model::{Columns, JointStates, Model};
use idim_trajectory::{Certificate, FourierSeries, Limits};
use std::sync::atomic::AtomicBool;

/// A report looks at this many times the samples of a search: between them nothing is hidden from it.
pub const REPORT_REFINEMENT: usize = 10;

/// A motion inside all limits at every instant, and how good it is.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierDesign {
    /// The motion.
    pub series: FourierSeries,
    /// Every criterion of its regressor as it is, no noise and nothing known before, over ten times the samples of the
    /// search.
    pub conditioning: Conditioning,
    /// Largest use of each limit; always certified.
    pub certificate: Certificate,
    /// Largest use of the torque limits, where they were asked for; always certified.
    pub torque: Option<TorqueCertificate>,
    /// Smallest distance, where it was asked for; always certified.
    pub clearance: Option<ClearanceCertificate>,
    /// Value of the criterion after every search, round by round, of the motions given as starts, and after the last
    /// descent; infinite where a search led nowhere. With further criteria: the weighted sum.
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
    let task = Task::new(model, columns, limits, options, watch.stop)?;
    design(&task, run_rounds(&task, watch.progress))
}

/// The best of `n_motions` random motions under the same limits: what a search has to beat.
///
/// `enough` is asked before each of them; once it says so, no more are tried: `values` has one number a motion that was.
///
/// # Errors
/// As [`optimise_fourier`].
pub fn best_random_fourier(
    model: &Model,
    columns: &Columns,
    limits: &Limits,
    options: &FourierOptions,
    n_motions: usize,
    enough: &(dyn Fn() -> bool + Sync),
) -> Result<FourierDesign, Error> {
    let stop = AtomicBool::new(false);
    let task = Task::new(model, columns, limits, options, &stop)?;
    design(&task, try_at_random(&task, n_motions, enough))
}

fn design(task: &Task<'_>, outcome: Outcome) -> Result<FourierDesign, Error> {
    let options = task.options;
    let Some(best) = outcome.best.into_iter().next() else {
        return Err(Error::NoFeasibleMotion {
            starts: outcome.values.len(),
            rule: match (&options.torque, &options.clearance) {
                (None, None) => "give more starts, or wider limits".into(),
                _ => "give more starts, a larger share of the torque limits, less clearance, or leave out bodies that \
                      cannot but touch"
                    .into(),
            },
        });
    };
    let n_samples = REPORT_REFINEMENT * options.n_samples;
    let values = outcome.values.iter();
    Ok(FourierDesign {
        conditioning: weighted_conditioning(
            task.model,
            (task.columns, &options.added),
            &best.series,
            n_samples,
            &vec![1.0; task.model.n_joints()],
        ),
        series: best.series,
        certificate: best.certificate,
        torque: best.path.torque,
        clearance: best.path.clearance,
        values: values.map(|&v| options.value_of_logarithm(v)).collect(),
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
    weighted_conditioning(
        model,
        (columns, &[]),
        series,
        n_samples,
        &vec![1.0; model.n_joints()],
    )
}

/// As [`series_conditioning`], with columns beside those of the regressor, of the rows divided by the standard deviation of
/// their joint's torque, N·m.
///
/// # Panics
/// As [`series_conditioning`], or if there is not one standard deviation a joint.
#[track_caller]
pub fn weighted_conditioning(
    model: &Model,
    (columns, added): (&Columns, &[AddedColumn]),
    series: &FourierSeries,
    n_samples: usize,
    torque_noise: &[f64],
) -> Conditioning {
    states_conditioning(
        model,
        (columns, added),
        &series.equispaced_states(n_samples),
        torque_noise,
    )
}

/// Every criterion of the torque rows at these states, the columns beside the regressor's last, divided by the standard
/// deviation of their joint's torque, N·m.
///
/// # Panics
/// As [`weighted_conditioning`].
#[track_caller]
pub fn states_conditioning(
    model: &Model,
    (columns, added): (&Columns, &[AddedColumn]),
    states: &JointStates,
    torque_noise: &[f64],
) -> Conditioning {
    let n = model.n_joints();
    assert_eq!(torque_noise.len(), n, "one standard deviation per joint");
    let y = idim_model::observation_matrix(model, columns, states);
    let (x, p) = (AddedRows::new(added, states), columns.len());
    let w = faer::Mat::from_fn(y.nrows(), p + added.len(), |row, column| {
        let (sample, joint) = (row / n, row % n);
        let entry = if column < p {
            y[(row, column)]
        } else {
            x.entry(column - p, joint, sample)
        };
        entry / torque_noise[joint]
    });
    Conditioning::of_rows(w.as_ref(), states.n_samples())
}
