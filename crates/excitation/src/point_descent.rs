//! One set of points taken down, by a schedule, to where its criterion is smallest.

use crate::Criterion;
use crate::box_lbfgs::{BoxOptions, minimise_in_box};
use crate::point_objective::PointObjective;
use crate::point_schedule::Schedule;

/// Share of the limit of `S` that is aimed at, and again where the last aim left an excess.
const AIM: f64 = 0.997;
/// What exceeding the limit of `S` by all of it costs during a search, in multiples of the criterion.
const COST_OF_EXCESS: f64 = 5.0;
/// Pairs that a descent remembers; more cost as much as the function itself.
const MEMORY: usize = 20;

/// Variables of one set of points, in the box, and what they are worth.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) x: Vec<f64>,
    /// The criterion, worse by what exceeds the limit of `S`.
    pub(crate) merit: f64,
    /// Whether that limit is held; true without one.
    pub(crate) held: bool,
    /// Evaluations of the descent that led here.
    pub(crate) n_evaluations: usize,
}

impl Candidate {
    /// From `x` down.
    pub(crate) fn descend(
        mut objective: PointObjective<'_>,
        criterion: Criterion,
        mut x: Vec<f64>,
        schedule: &Schedule,
    ) -> Self {
        let settings = BoxOptions {
            memory: MEMORY,
            max_iterations: schedule.max_iterations,
            tolerance: schedule.tolerance,
        };
        let mut lower = |objective: &mut PointObjective<'_>, k: u32| -> f64 {
            minimise_in_box(
                |x, g| objective.value_and_gradient(x, k, g),
                &mut x,
                &settings,
            );
            objective.criterion(&x, criterion)
        };
        let (mut power, mut value, mut aim) = (0, f64::INFINITY, AIM);
        objective.set_aim(aim);
        for &(k, weight) in schedule.phases {
            objective.set_weight(weight);
            value = lower(&mut objective, k);
            power = k;
        }
        for attempt in 0..schedule.n_attempts {
            if attempt > 0 {
                if objective.excess_of_equilibrium() == 0.0 {
                    break;
                }
                aim *= AIM;
                objective.set_aim(aim);
            }
            for _ in 0..schedule.n_updates {
                objective.update_multipliers();
                value = lower(&mut objective, power);
            }
        }
        let excess = objective.excess_of_equilibrium();
        Self {
            merit: penalised(criterion, value, excess),
            held: excess == 0.0,
            n_evaluations: objective.n_evaluations(),
            x,
        }
    }
}

/// A criterion made worse: `log det` by adding, the others, all positive, by a factor.
fn penalised(criterion: Criterion, value: f64, excess: f64) -> f64 {
    // Entries that vanish make the excess infinite; the order among such points does not matter.
    let factor = 1.0 + (COST_OF_EXCESS * excess).min(1e6);
    criterion.value_of_logarithm(criterion.logarithm(value) + factor.ln())
}

/// Best first.
pub(crate) fn sort(pool: &mut [Candidate]) {
    pool.sort_by(|a, b| a.merit.total_cmp(&b.merit));
}
