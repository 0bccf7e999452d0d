//! Designing a motion for a robot: what to ask for, and everything that was found.

mod arguments;
mod certificate_file;
mod conditions;
mod files;
mod interrupt;
mod limits;
pub(crate) mod point_path;
mod points;
mod points_text;
mod prior;
mod text;

pub(crate) use arguments::run_excite;
pub use arguments::{CriterionTerm, ExciteArgs, Family};
pub(crate) use interrupt::INTERRUPTED_CODE;

use crate::columns::ExtraColumn;
use crate::error::Error;
use crate::progress::Progress;
use crate::structure::Structure;
use idim_excitation::{
    Clearance, Conditioning, Criterion, FourierDesign, FourierEnds, FourierOptions, FourierWatch,
    TorquePrior, best_random_fourier, optimise_fourier_watched, weighted_conditioning,
};
use idim_measurement::Measurements;
use idim_model::{Columns, DriveColumns, Model, Robot};
use idim_trajectory::{FourierSeries, Limits};
use interrupt::{Stopped, Watch};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Random motions a found one is shown beside.
pub const N_RANDOM: usize = 1000;
/// Samples of a period the criterion looks at, a harmonic: products of three harmonics stay resolved.
const SAMPLES_PER_HARMONIC: usize = 20;
/// Share of what is left of a time budget that random motions may use; what is not tried by then stays untried.
const RANDOM_SHARE: f64 = 0.25;
/// Rounds of searches where nothing is said.
const ROUNDS: usize = 2;

/// What a motion is asked to be.
#[derive(Debug, Clone)]
pub struct ExciteOptions {
    /// Criteria with their weights; the first one's is above zero.
    pub criteria: Vec<(f64, Criterion)>,
    /// Period, s.
    pub period: f64,
    /// Harmonics of every joint.
    pub n_harmonics: usize,
    /// Searches of a round.
    pub n_starts: usize,
    /// Rounds after the first; `None`: two, or as many as the time budget allows.
    pub n_rounds: Option<usize>,
    /// Seed of everything random.
    pub seed: u64,
    /// Begin and end at rest.
    pub at_rest: bool,
    /// Drive columns beside the inertial ones.
    pub columns: DriveColumns,
    /// Standard deviation of each joint's torque, N·m; empty: all alike.
    pub torque_noise: Vec<f64>,
    /// Torque limits to keep, and what they are predicted from.
    pub torque: Option<TorquePrior>,
    /// Distances to keep.
    pub clearance: Option<Clearance>,
    /// Time a design may take from the start of the command, s.
    pub time_budget: Option<f64>,
}

/// A motion with everything that is said of it.
#[derive(Debug, Clone)]
pub struct Excitation {
    /// What was asked for.
    pub options: ExciteOptions,
    /// The columns it is to tell apart.
    pub structure: Structure,
    /// Inside these.
    pub limits: Limits,
    /// The motion.
    pub design: FourierDesign,
    /// Best of [`N_RANDOM`] random motions, or of those the time budget allowed, by the same criterion; `None` where none
    /// could be certified.
    pub random: Option<FourierDesign>,
    /// Random motions that were tried.
    pub n_random: usize,
    /// Criteria of the rows divided by the noise, of the motion and of the random one, where noise was given.
    pub weighted: Option<(Conditioning, Option<Conditioning>)>,
    /// Logs whose information counted.
    pub n_logs: usize,
    /// How they became samples.
    pub log_choices: Vec<String>,
    pub(crate) stopped: Stopped,
}

impl Excitation {
    /// Best value of the criterion asked for, earlier logs included; of a weighted sum: of the logarithms.
    pub fn value(&self) -> f64 {
        lowest(&self.design)
    }
}

/// Best value among the searches of a design.
fn lowest(design: &FourierDesign) -> f64 {
    design.values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Designs the most revealing motion of a robot inside its limits, beside what `logs` already tell.
///
/// Same motion for the same seed and options, whatever the number of threads, unless there is a time budget or somebody
/// interrupts it: then the best so far is returned.
///
/// # Errors
/// An ambiguous structure, options that make no sense, limits that leave no room; an interruption before there was anything.
pub fn excite(
    robot: &Robot,
    limits: &Limits,
    logs: &[Measurements],
    options: &ExciteOptions,
    progress: &Progress,
) -> Result<Excitation, Error> {
    let watch = Watch::begin(options.time_budget);
    excite_watched(robot, limits, logs, options, progress, &watch)
}

fn excite_watched(
    robot: &Robot,
    limits: &Limits,
    logs: &[Measurements],
    options: &ExciteOptions,
    progress: &Progress,
    watch: &Watch,
) -> Result<Excitation, Error> {
    let all = Columns::standard(robot.n_joints(), options.columns);
    let structure = Structure::of_drives(robot, all).decided()?;
    let base = structure.base_model_columns();
    let columns = &base.standard;
    let model = Model::new(robot);
    let mut fourier = FourierOptions {
        added: base.extra.iter().filter_map(ExtraColumn::added).collect(),
        ..fourier_options(options)
    };
    let mut log_choices = Vec::new();
    if !logs.is_empty() {
        progress.stage("what the logs already tell");
        let earlier = prior::earlier(robot, &base, logs, options)?;
        fourier.prior_information = Some(earlier.information);
        log_choices = earlier.choices;
    }
    watch.check()?;
    progress.stage(format!("{N_RANDOM} random motions to compare with"));
    let (enough, n_tried) = (watch.enough(RANDOM_SHARE), AtomicUsize::new(0));
    let enough = || {
        let enough = enough();
        n_tried.fetch_add(usize::from(!enough), Ordering::Relaxed);
        enough
    };
    let random = best_random_fourier(&model, columns, limits, &fourier, N_RANDOM, &enough).ok();
    let n_random = n_tried.load(Ordering::Relaxed);
    fourier
        .starts
        .extend(random.iter().map(|r| r.series.clone()));
    let (design, stopped) = search(&model, columns, limits, &fourier, progress, watch)?;
    let weigh = |series: &FourierSeries| {
        let n_samples = 10 * fourier.n_samples;
        let columns = (columns, &fourier.added[..]);
        weighted_conditioning(&model, columns, series, n_samples, &options.torque_noise)
    };
    let weighted = (!options.torque_noise.is_empty()).then(|| {
        let random = random.as_ref().map(|r| weigh(&r.series));
        (weigh(&design.series), random)
    });
    Ok(Excitation {
        options: options.clone(),
        structure,
        limits: limits.clone(),
        design,
        random,
        n_random,
        weighted,
        n_logs: logs.len(),
        log_choices,
        stopped: match stopped {
            Stopped::No if n_random < N_RANDOM => Stopped::OutOfTime,
            other => other,
        },
    })
}

/// The search, and why it ended.
fn search(
    model: &Model,
    columns: &Columns,
    limits: &Limits,
    fourier: &FourierOptions,
    progress: &Progress,
    watch: &Watch,
) -> Result<(FourierDesign, Stopped), Error> {
    let n_searches = fourier.n_starts;
    let report = |p: &idim_excitation::FourierProgress| {
        progress.stage(format!(
            "searching, round {} of {n_searches} starts: best {:.5}; Ctrl-C takes it",
            p.round + 1,
            p.best
        ));
    };
    progress.stage(format!("searching from {n_searches} starts"));
    let (found, stopped) = watch.run(|stop| {
        let watch = FourierWatch {
            stop,
            progress: &report,
        };
        optimise_fourier_watched(model, columns, limits, fourier, &watch)
    });
    match (found, stopped) {
        (Ok(design), stopped) => Ok((design, stopped)),
        (Err(idim_excitation::Error::NoFeasibleMotion { .. }), Stopped::Interrupted) => {
            Err(Error::Interrupted)
        }
        (Err(idim_excitation::Error::NoFeasibleMotion { .. }), Stopped::OutOfTime) => {
            Err(Error::input(
                "--time-budget",
                "used up before any motion was certified",
                "nothing is written; give more time, or leave it out",
            ))
        }
        (Err(error), _) => Err(error.into()),
    }
}

/// Samples of a period that the criterion is lowered over.
fn samples_of_search(options: &ExciteOptions) -> usize {
    let typical = FourierOptions::default().n_samples;
    typical.max(SAMPLES_PER_HARMONIC * options.n_harmonics)
}

fn fourier_options(options: &ExciteOptions) -> FourierOptions {
    let (first, criterion) = options.criteria[0];
    let further = options.criteria[1..].iter();
    FourierOptions {
        period: options.period,
        n_harmonics: options.n_harmonics,
        n_samples: samples_of_search(options),
        criterion,
        further: further.map(|&(w, c)| (w / first, c)).collect(),
        ends: if options.at_rest {
            FourierEnds::AtRest
        } else {
            FourierEnds::Free
        },
        torque_noise: options.torque_noise.clone(),
        torque: options.torque.clone(),
        clearance: options.clearance.clone(),
        n_starts: options.n_starts,
        n_rounds: options.n_rounds.unwrap_or(match options.time_budget {
            Some(_) => usize::MAX - 1,
            None => ROUNDS,
        }),
        seed: options.seed,
        n_constraint_samples: FourierOptions::default()
            .n_constraint_samples
            .max(6 * options.n_harmonics),
        ..FourierOptions::default()
    }
}
