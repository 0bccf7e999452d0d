//! Many searches: from given and random motions first, then round by round from beside the best ones.

use crate::fourier::FourierProgress;
use crate::fourier_search::{EXPLORE, Found, REVISIT, Search, Task};
use idim_trajectory::{FourierSeries, random_series};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::Mutex;

/// The first random motions use this much of the limits: well inside them, where the barrier is still flat.
const START_USE: f64 = 0.7;
/// Later searches start beside this many of the best motions in turn.
const N_PARENTS: usize = 3;
/// And this far from them: standard deviation of every coefficient over its typical size.
const DISTANCE: f64 = 0.15;

/// What the searches came to.
pub(crate) struct Outcome {
    /// Best first; at most [`N_PARENTS`].
    pub(crate) best: Vec<Found>,
    /// Logarithm of the criterion after every search, round by round.
    pub(crate) values: Vec<f64>,
    pub(crate) n_rounds: usize,
    pub(crate) n_evaluations: usize,
}

impl Outcome {
    fn empty() -> Self {
        Self {
            best: Vec::new(),
            values: Vec::new(),
            n_rounds: 0,
            n_evaluations: 0,
        }
    }

    fn add(&mut self, searches: Vec<Search>) {
        for search in searches {
            self.n_evaluations += search.n_evaluations;
            let value = search.found.as_ref().map_or(f64::INFINITY, |f| f.value);
            self.values.push(value);
            if let Some(found) = search.found {
                let place = self.best.partition_point(|b| b.value <= value);
                self.best.insert(place, found);
                self.best.truncate(N_PARENTS);
            }
        }
    }
}

/// Value of many random motions, each drawn in to meet the limits, and the best of them; none more once `enough` says so.
pub(crate) fn try_at_random(
    task: &Task<'_>,
    n_motions: usize,
    enough: &(dyn Fn() -> bool + Sync),
) -> Outcome {
    let searches: Vec<Option<Search>> = (0..n_motions)
        .into_par_iter()
        .map(|place| {
            if enough() {
                return None;
            }
            let seed = rng(task.options.seed, usize::MAX, place).random();
            let (n_harmonics, period) = (task.options.n_harmonics, task.options.period);
            let series = random_series(task.limits, n_harmonics, period, seed);
            Some(task.evaluate(&series.coefficients()))
        })
        .collect();
    let searches: Vec<Search> = searches.into_iter().flatten().collect();
    let mut outcome = Outcome::empty();
    // Proofs are long: from the best down, the first that has one.
    let mut order: Vec<&Found> = searches.iter().filter_map(|s| s.found.as_ref()).collect();
    order.sort_by(|a, b| a.value.total_cmp(&b.value));
    outcome.best = order
        .into_iter()
        .find_map(|f| task.proved(f))
        .into_iter()
        .collect();
    for search in &searches {
        outcome.n_evaluations += search.n_evaluations;
        let value = search.found.as_ref().map_or(f64::INFINITY, |f| f.value);
        outcome.values.push(value);
    }
    // A value below the one returned belongs to a motion without a proof.
    if let Some(best) = outcome.best.first() {
        for value in outcome.values.iter_mut().filter(|v| **v < best.value) {
            *value = f64::INFINITY;
        }
    }
    outcome
}

/// Runs all rounds, or those a stop leaves time for.
pub(crate) fn run_rounds(task: &Task<'_>, progress: &(dyn Fn(&FourierProgress) + Sync)) -> Outcome {
    let mut outcome = Outcome::empty();
    let lowest = Mutex::new(f64::INFINITY);
    for round in 0..=task.options.n_rounds {
        if round > 0 && (task.stopped() || outcome.best.is_empty()) {
            break;
        }
        let searches: Vec<Search> = (0..task.options.n_starts)
            .into_par_iter()
            .map(|place| {
                // Told to stop, the first search alone still looks for something to return.
                if task.stopped() && (round > 0 || place > 0) {
                    return Search {
                        found: None,
                        n_evaluations: 0,
                    };
                }
                let search = if round == 0 {
                    task.search(&first_start(task, place), EXPLORE)
                } else {
                    let start = beside(task, &outcome.best, round, place);
                    task.search(&start, REVISIT)
                };
                report(task, &lowest, round, &search, progress);
                search
            })
            .collect();
        outcome.add(searches);
        outcome.n_rounds = round + usize::from(!task.stopped());
    }
    // A motion that was given as a start may be better than all that was found from it: kinks stop a descent.
    let given = task.options.starts.iter().map(|series| {
        let mut search = task.evaluate(&series.coefficients());
        search.found = search.found.and_then(|f| task.proved(&f));
        search
    });
    outcome.add(given.collect());
    if let Some(best) = outcome.best.first() {
        let last = task.finish(&best.series.coefficients());
        outcome.add(vec![last]);
    }
    outcome
}

fn report(
    task: &Task<'_>,
    lowest: &Mutex<f64>,
    round: usize,
    search: &Search,
    progress: &(dyn Fn(&FourierProgress) + Sync),
) {
    let value = search.found.as_ref().map_or(f64::INFINITY, |f| f.value);
    if let Ok(mut best) = lowest.lock() {
        *best = best.min(value);
        progress(&FourierProgress {
            round,
            value: task.options.value_of_logarithm(value),
            best: task.options.value_of_logarithm(*best),
        });
    }
}

fn first_start(task: &Task<'_>, place: usize) -> Vec<f64> {
    let options = task.options;
    options.starts.get(place).map_or_else(
        || {
            let inside = task.limits.scaled(START_USE, START_USE, START_USE);
            let seed = rng(options.seed, 0, place).random();
            random_series(&inside, options.n_harmonics, options.period, seed).coefficients()
        },
        FourierSeries::coefficients,
    )
}

/// A random motion beside one of the best.
fn beside(task: &Task<'_>, best: &[Found], round: usize, place: usize) -> Vec<f64> {
    let mut rng = rng(task.options.seed, round, place);
    let parent = &best[place % best.len()];
    let mut x = task.chart.variables(&parent.series.coefficients());
    for x in &mut x {
        // A sum of uniform numbers is normal enough, and the same on every machine.
        let sum: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
        *x += DISTANCE * sum;
    }
    task.chart.coefficients(&x)
}

/// Numbers of their own for every search.
fn rng(seed: u64, round: usize, place: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(((round as u64) << 32) + place as u64);
    rng
}
