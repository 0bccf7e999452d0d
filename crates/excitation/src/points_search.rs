//! Points for the energy model by exact gradients: many starts, then a pool that is disturbed and descends again.

use crate::point_descent::{Candidate, sort};
use crate::point_moves::{disturb, random_start};
use crate::point_objective::PointObjective;
use crate::point_schedule::{FREE, LIMITED, Schedule, Schedules};
use crate::{Criterion, EnergyDesign, Error, PointDesign, Scaling};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::{ControlFlow, Range};

/// How points are searched for with exact gradients.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSearchOptions {
    /// Rows `r`: one fewer than points, at least the number of base columns.
    pub n_rows: usize,
    /// What is lowered: one of the smooth criteria (2-norm, Frobenius, log det, trace, worst direction), or a weighted
    /// sum of the condition number and `S`.
    pub criterion: Criterion,
    /// `S = max|W| / min|W|` at most this; `None` leaves it free. The paper's optimum has 175. Not beside a weighted sum.
    pub limit_of_equilibrium: Option<f64>,
    /// Random starts. Typical 100.
    pub n_starts: usize,
    /// Rounds of sixteen disturbed descents after the starts. Typical 100; more rounds find better points.
    pub n_rounds: usize,
    /// Seed of starts and disturbances.
    pub seed: u64,
}

/// How far a search is; handed out between rounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchProgress {
    /// Rounds done, the starts counting as the first.
    pub n_done: usize,
    /// Rounds of the whole search.
    pub n_rounds: usize,
    /// Best value of the criterion so far; made worse by what exceeds a limit of `S`, which comes in after a quarter of
    /// the rounds. Of a weighted sum the condition number alone until then.
    pub best: f64,
}

/// Descents of one round: independent of the machine, so that the result is.
const ROUND: usize = 16;
/// Points kept and disturbed. Fewer forget good valleys, more spread the rounds thin.
const POOL: usize = 10;
/// The best of them that are taken to the bottom: the order may still change by a percent there.
const POLISHED: usize = 4;
/// With `S` limited or weighed, one round in this many comes first without the limit: good chains that it is then imposed on
/// are far better than what it leaves of random ones.
const FREE_ROUNDS: usize = 4;
/// With `S` limited or weighed, one descent in this many starts again from a chain found without the limit.
const IMPOSED: usize = 4;

/// Lowers a smooth criterion over chained points from many starts with exact gradients and limits as a box.
///
/// Same points for the same seed and rounds, whatever the number of threads. `progress` is asked after every round
/// whether to go on; after `Break` the best so far is returned. Whether `S` is within its limit is to be read from
/// the result: points that hold it are preferred to all others.
///
/// # Errors
/// A criterion without a gradient, no start, fewer rows than base columns, a limit of `S` that is not above one or beside
/// a weight, a weight that is not above zero.
pub fn search_points(
    design: &EnergyDesign,
    options: &PointSearchOptions,
    progress: &mut dyn FnMut(SearchProgress) -> ControlFlow<()>,
) -> Result<PointDesign, Error> {
    check(design, options)?;
    let (target, mut n_free) = (objective(design, options)?, options.n_rounds);
    let mut free = target.clone();
    if restrained(options) {
        n_free /= FREE_ROUNDS;
        free = objective(design, &without_restraint(options))?;
    }
    let (mut search, initial_conditions) = Search::start(design, options, &free);
    let mut go_on = search.rounds(0..n_free, &free, &FREE, progress);
    if restrained(options) {
        search.impose(&target);
        if go_on.is_continue() {
            go_on = search.rounds(n_free..options.n_rounds, &target, &LIMITED, progress);
        }
    }
    if go_on.is_continue() {
        // The last round is told of too; there is nothing left to stop.
        let _ = progress(search.progress(options.n_rounds));
    }
    search.polish(&target);
    Ok(search.finish(target, initial_conditions))
}

fn check(design: &EnergyDesign, options: &PointSearchOptions) -> Result<(), Error> {
    let (rows, columns) = (options.n_rows, design.n_columns());
    if rows < columns {
        return Err(Error::input(
            "rows",
            format!("{rows}"),
            format!("there are {columns} base columns; take at least as many rows"),
        ));
    }
    if options.n_starts == 0 {
        return Err(Error::input("starts", "0", "give at least one"));
    }
    if let Some(limit) = options.limit_of_equilibrium
        && !(limit > 1.0 && limit.is_finite())
    {
        return Err(Error::input(
            "limit of S",
            format!("{limit}"),
            "max|W| / min|W| is above one; give a larger limit or none",
        ));
    }
    let Criterion::WeightedSum {
        condition,
        equilibrium,
    } = options.criterion
    else {
        return Ok(());
    };
    if ![condition, equilibrium]
        .iter()
        .all(|l| *l > 0.0 && l.is_finite())
    {
        return Err(Error::input(
            "weights of the condition number and of S",
            format!("{condition}, {equilibrium}"),
            "both must be above zero; for the condition number alone lower that",
        ));
    }
    if let Some(limit) = options.limit_of_equilibrium {
        return Err(Error::input(
            "limit of S",
            format!("{limit}, and a weight of S"),
            "S is either limited or weighed; leave one of them out",
        ));
    }
    Ok(())
}

/// What a search lowers.
fn objective<'a>(
    design: &'a EnergyDesign,
    options: &PointSearchOptions,
) -> Result<PointObjective<'a>, Error> {
    let PointSearchOptions {
        n_rows,
        criterion,
        limit_of_equilibrium,
        ..
    } = *options;
    PointObjective::new(design, n_rows, criterion, limit_of_equilibrium).ok_or_else(|| {
        Error::input(
            "criterion",
            format!("{criterion:?}"),
            "it has no gradient; choose the 2-norm, Frobenius, log det, trace or worst direction",
        )
    })
}

/// Whether `S` has a limit or a weight.
fn restrained(options: &PointSearchOptions) -> bool {
    options.limit_of_equilibrium.is_some()
        || matches!(options.criterion, Criterion::WeightedSum { .. })
}

/// The same search with `S` as it comes.
fn without_restraint(options: &PointSearchOptions) -> PointSearchOptions {
    PointSearchOptions {
        criterion: match options.criterion {
            Criterion::WeightedSum { .. } => Criterion::TwoNorm(Scaling::Raw),
            other => other,
        },
        limit_of_equilibrium: None,
        ..options.clone()
    }
}

/// What a search has so far.
struct Search<'a> {
    design: &'a EnergyDesign,
    options: &'a PointSearchOptions,
    /// Best first.
    pool: Vec<Candidate>,
    /// Where `S` is limited or weighed: what was found before it was.
    without_limit: Vec<Candidate>,
    n_evaluations: usize,
}

impl<'a> Search<'a> {
    /// Random starts taken down, and the raw 2-norm condition each began with.
    fn start(
        design: &'a EnergyDesign,
        options: &'a PointSearchOptions,
        objective: &PointObjective<'_>,
    ) -> (Self, Vec<f64>) {
        let starts: Vec<(Candidate, f64)> = (0..options.n_starts)
            .into_par_iter()
            .map(|start| {
                let x = random_start(design, options.n_rows, &mut stream(options.seed, start));
                let mut objective = objective.clone();
                let initial = objective.criterion(&x, Criterion::TwoNorm(Scaling::Raw));
                let found = Candidate::descend(objective, x, None, &FREE.coarse);
                (found, initial)
            })
            .collect();
        let (mut pool, initial_conditions): (Vec<Candidate>, Vec<f64>) = starts.into_iter().unzip();
        let n_evaluations = pool.iter().map(|c| c.n_evaluations).sum();
        sort(&mut pool);
        pool.truncate(POOL);
        let search = Self {
            design,
            options,
            pool,
            without_limit: Vec::new(),
            n_evaluations,
        };
        (search, initial_conditions)
    }

    fn progress(&self, n_done: usize) -> SearchProgress {
        SearchProgress {
            n_done,
            n_rounds: self.options.n_rounds,
            best: self.pool[0].merit,
        }
    }

    /// Rounds of disturbed descents; each child stands against its parent.
    fn rounds(
        &mut self,
        rounds: Range<usize>,
        objective: &PointObjective<'_>,
        schedules: &Schedules,
        progress: &mut dyn FnMut(SearchProgress) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        for round in rounds {
            progress(self.progress(round))?;
            let children: Vec<(usize, Candidate)> = (0..ROUND)
                .into_par_iter()
                .map(|k| {
                    let number = self.options.n_starts + round * ROUND + k;
                    self.child(number, objective, schedules)
                })
                .collect();
            for (parent, child) in children {
                self.n_evaluations += child.n_evaluations;
                if child.merit < self.pool[parent].merit {
                    self.pool[parent] = child;
                }
            }
            sort(&mut self.pool);
        }
        ControlFlow::Continue(())
    }

    /// A disturbed member of the pool taken down, and which member.
    fn child(
        &self,
        number: usize,
        objective: &PointObjective<'_>,
        schedules: &Schedules,
    ) -> (usize, Candidate) {
        let rng = &mut stream(self.options.seed, number);
        let again = !self.without_limit.is_empty() && rng.random_range(0..IMPOSED) == 0;
        let (family, schedule) = if again {
            (&self.without_limit, &schedules.coarse)
        } else {
            (&self.pool, &schedules.fine)
        };
        let n = family.len();
        // The better of two: the family is sorted.
        let parent = rng.random_range(0..n).min(rng.random_range(0..n));
        let other = rng.random_range(0..n);
        let mut x = family[parent].x.clone();
        let n_positions = self.design.position_variables().len();
        let n_variables = self.design.n_variables();
        disturb(&mut x, &family[other].x, n_positions, n_variables, rng);
        let from = Some(&family[parent]);
        let child = Candidate::descend(objective.clone(), x, from, schedule);
        // One from outside the pool stands against the worst of it.
        let against = if again { self.pool.len() - 1 } else { parent };
        (against, child)
    }

    /// Takes the pool down again under the limit of `S`, or with its weight.
    fn impose(&mut self, objective: &PointObjective<'_>) {
        self.without_limit = std::mem::take(&mut self.pool);
        self.pool = descend_all(&self.without_limit, objective, &LIMITED.coarse);
        self.count_and_sort();
    }

    /// Takes the best of the pool to the bottom.
    fn polish(&mut self, objective: &PointObjective<'_>) {
        let schedules = if restrained(self.options) {
            &LIMITED
        } else {
            &FREE
        };
        self.pool.truncate(POLISHED);
        let before = std::mem::take(&mut self.pool);
        self.pool = descend_all(&before, objective, &schedules.polish);
        self.count_and_sort();
        // Kept where polishing made nothing better; points that hold the limit come before all that do not.
        self.pool.extend(before);
        self.pool
            .sort_by(|a, b| (!a.held).cmp(&!b.held).then(a.merit.total_cmp(&b.merit)));
        self.pool.truncate(POLISHED);
    }

    fn count_and_sort(&mut self) {
        self.n_evaluations += self.pool.iter().map(|c| c.n_evaluations).sum::<usize>();
        sort(&mut self.pool);
    }

    fn finish(
        self,
        mut objective: PointObjective<'_>,
        initial_conditions: Vec<f64>,
    ) -> PointDesign {
        let rng = &mut ChaCha8Rng::seed_from_u64(self.options.seed);
        let points = self
            .design
            .points_of(objective.values(&self.pool[0].x), rng);
        PointDesign {
            conditioning: self.design.conditioning(&points),
            points,
            values: self.pool.iter().map(|c| c.merit).collect(),
            initial_conditions,
            n_evaluations: self.n_evaluations,
        }
    }
}

/// Every one of them taken down.
fn descend_all(
    from: &[Candidate],
    objective: &PointObjective<'_>,
    schedule: &Schedule,
) -> Vec<Candidate> {
    from.par_iter()
        .map(|c| Candidate::descend(objective.clone(), c.x.clone(), Some(c), schedule))
        .collect()
}

/// Random numbers of one descent: the same whichever thread takes it.
fn stream(seed: u64, number: usize) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(number as u64);
    rng
}
