//! Points for the energy model by exact gradients: many starts, then a pool that is disturbed and descends again.

use crate::box_lbfgs::{BoxOptions, minimise_in_box};
use crate::point_moves::{disturb, random_start};
use crate::point_objective::PointObjective;
use crate::point_schedule::{FREE, LIMITED, Schedule, Schedules};
use crate::{Criterion, EnergyDesign, Error, PointDesign, Scaling};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// How points are searched for with exact gradients.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSearchOptions {
    /// Rows `r`: one fewer than points, at least the number of base columns.
    pub n_rows: usize,
    /// What is lowered: one of the smooth criteria (2-norm, Frobenius, log det, trace, worst direction).
    pub criterion: Criterion,
    /// `S = max|W| / min|W|` at most this; `None` leaves it free. The paper's optimum has 175.
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
    /// Best value of the criterion so far.
    pub best: f64,
}

/// Descents of one round: independent of the machine, so that the result is.
const ROUND: usize = 16;
/// Points kept and disturbed. Fewer forget good valleys, more spread the rounds thin.
const POOL: usize = 10;
/// The best of them that are taken to the bottom: the order may still change by a percent there.
const POLISHED: usize = 4;

/// Share of the limit of `S` that is aimed at: the last update of the multipliers leaves some excess.
const AIM: f64 = 0.997;
/// What exceeding the limit of `S` by all of it costs during the search, in multiples of the criterion.
const COST_OF_EXCESS: f64 = 5.0;
/// Pairs that a descent remembers; more cost as much as the function itself.
const MEMORY: usize = 20;

/// Lowers a smooth criterion over chained points from many starts with exact gradients and limits as a box.
///
/// Same points for the same seed and rounds, whatever the number of threads. `progress` is asked after every round
/// whether to go on; after `Break` the best so far is returned.
///
/// # Errors
/// A criterion without a gradient, no start, fewer rows than base columns, a limit of `S` that is not above one.
pub fn search_points(
    design: &EnergyDesign,
    options: &PointSearchOptions,
    progress: &mut dyn FnMut(SearchProgress) -> ControlFlow<()>,
) -> Result<PointDesign, Error> {
    let objective = check(design, options)?;
    let starts: Vec<(Candidate, f64)> = (0..options.n_starts)
        .into_par_iter()
        .map(|start| fresh(design, objective.clone(), options, start as u64))
        .collect();
    let initial_conditions = starts.iter().map(|s| s.1).collect();
    let mut n_evaluations: usize = starts.iter().map(|s| s.0.n_evaluations).sum();
    let mut pool: Vec<Candidate> = starts.into_iter().map(|s| s.0).collect();
    sort(&mut pool);
    pool.truncate(POOL);
    for round in 0..=options.n_rounds {
        let told = progress(SearchProgress {
            n_done: round,
            n_rounds: options.n_rounds,
            best: pool[0].merit,
        });
        if told.is_break() || round == options.n_rounds {
            break;
        }
        let children: Vec<(usize, Candidate)> = (0..ROUND)
            .into_par_iter()
            .map(|k| {
                let stream = (options.n_starts + round * ROUND + k) as u64;
                child(design, objective.clone(), options, &pool, stream)
            })
            .collect();
        for (parent, child) in children {
            n_evaluations += child.n_evaluations;
            if child.merit < pool[parent].merit {
                pool[parent] = child;
            }
        }
        sort(&mut pool);
    }
    pool.truncate(POLISHED);
    let polished: Vec<Candidate> = pool
        .into_par_iter()
        .map(|c| {
            let polished = Candidate::descend(
                objective.clone(),
                options,
                c.x.clone(),
                &schedules(options).polish,
            );
            if polished.merit < c.merit {
                polished
            } else {
                c
            }
        })
        .collect();
    n_evaluations += polished.iter().map(|c| c.n_evaluations).sum::<usize>();
    Ok(finish(
        design,
        objective,
        options,
        polished,
        initial_conditions,
        n_evaluations,
    ))
}

fn check<'a>(
    design: &'a EnergyDesign,
    options: &PointSearchOptions,
) -> Result<PointObjective<'a>, Error> {
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
    let limit = options.limit_of_equilibrium;
    PointObjective::new(design, rows, options.criterion, limit.map(|l| AIM * l)).ok_or_else(|| {
        Error::input(
            "criterion",
            format!("{:?}", options.criterion),
            "it has no gradient; choose the 2-norm, Frobenius, log det, trace or worst direction",
        )
    })
}

/// Variables of one set of points, in the box, and what they are worth.
#[derive(Debug, Clone)]
struct Candidate {
    x: Vec<f64>,
    /// The criterion, worse by what exceeds the limit of `S`.
    merit: f64,
    /// Whether that limit is held.
    held: bool,
    n_evaluations: usize,
}

impl Candidate {
    fn descend(
        mut objective: PointObjective<'_>,
        options: &PointSearchOptions,
        mut x: Vec<f64>,
        schedule: &Schedule,
    ) -> Self {
        let settings = BoxOptions {
            memory: MEMORY,
            max_iterations: schedule.max_iterations,
            tolerance: schedule.tolerance,
        };
        let mut power = 0;
        let mut lower = |objective: &mut PointObjective<'_>, k: u32| {
            minimise_in_box(
                |x, g| objective.value_and_gradient(x, k, g),
                &mut x,
                &settings,
            );
        };
        for &(k, weight) in schedule.phases {
            objective.set_weight(weight);
            lower(&mut objective, k);
            power = k;
        }
        for _ in 0..schedule.n_updates {
            objective.update_multipliers();
            lower(&mut objective, power);
        }
        let criterion = objective.criterion(&x, options.criterion);
        let excess = (AIM * objective.excess_of_equilibrium() - 1.0).max(0.0);
        Self {
            x,
            merit: penalised(options.criterion, criterion, excess),
            held: excess == 0.0,
            n_evaluations: objective.n_evaluations(),
        }
    }
}

/// A random start taken down, and the raw 2-norm condition it began with.
fn fresh(
    design: &EnergyDesign,
    mut objective: PointObjective<'_>,
    options: &PointSearchOptions,
    start: u64,
) -> (Candidate, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(start);
    let x = random_start(design, options.n_rows, &mut rng);
    let initial = objective.criterion(&x, Criterion::TwoNorm(Scaling::Raw));
    (
        Candidate::descend(objective, options, x, &schedules(options).coarse),
        initial,
    )
}

/// A disturbed member of the pool taken down, and which member.
fn child(
    design: &EnergyDesign,
    objective: PointObjective<'_>,
    options: &PointSearchOptions,
    pool: &[Candidate],
    stream: u64,
) -> (usize, Candidate) {
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(stream);
    // The better of two: the pool is sorted.
    let parent = rng
        .random_range(0..pool.len())
        .min(rng.random_range(0..pool.len()));
    let other = rng.random_range(0..pool.len());
    let mut x = pool[parent].x.clone();
    disturb(
        &mut x,
        &pool[other].x,
        design.position_variables().len(),
        design.n_variables(),
        &mut rng,
    );
    (
        parent,
        Candidate::descend(objective, options, x, &schedules(options).fine),
    )
}

fn schedules(options: &PointSearchOptions) -> &'static Schedules {
    if options.limit_of_equilibrium.is_some() {
        &LIMITED
    } else {
        &FREE
    }
}

/// A criterion made worse: `log det` by adding, the others, all positive, by a factor.
fn penalised(criterion: Criterion, value: f64, excess: f64) -> f64 {
    // Entries that vanish make the excess infinite; the order among such points does not matter.
    let factor = 1.0 + (COST_OF_EXCESS * excess).min(1e6);
    criterion.value_of_logarithm(criterion.logarithm(value) + factor.ln())
}

fn sort(pool: &mut [Candidate]) {
    pool.sort_by(|a, b| a.merit.total_cmp(&b.merit));
}

fn finish(
    design: &EnergyDesign,
    mut objective: PointObjective<'_>,
    options: &PointSearchOptions,
    mut pool: Vec<Candidate>,
    initial_conditions: Vec<f64>,
    n_evaluations: usize,
) -> PointDesign {
    sort(&mut pool);
    // Points that hold the limit of S come before all that do not.
    pool.sort_by_key(|c| !c.held);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let points = design.points_of(objective.values(&pool[0].x), &mut rng);
    PointDesign {
        conditioning: design.conditioning(&points),
        points,
        values: pool.iter().map(|c| c.merit).collect(),
        initial_conditions,
        n_evaluations,
    }
}
