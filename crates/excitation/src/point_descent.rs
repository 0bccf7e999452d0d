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
    /// Where `S` has a weight: what it was allowed to be.
    pub(crate) bound: Option<f64>,
    /// Evaluations of the descent that led here.
    pub(crate) n_evaluations: usize,
}

impl Candidate {
    /// From `x` down; a bound of `S` that is a variable begins with what `from` has, whose variables `x` is near.
    pub(crate) fn descend(
        mut objective: PointObjective<'_>,
        mut x: Vec<f64>,
        from: Option<&Self>,
        schedule: &Schedule,
    ) -> Self {
        let criterion = objective.asked();
        let n = x.len();
        x.extend(from.and_then(|c| objective.variable_of_bound(c.bound, c.merit)));
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
        x.truncate(n);
        Self {
            bound: objective.variable_bound(),
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::point_rows::PointRows;
    use crate::point_schedule::{FREE, LIMITED};
    use crate::{EnergyDesign, PointLimits, PowellOptions, Scaling, powell};
    use idim_model::ParameterKind::{MX, MY, XX, XY, XZ, YZ, ZZ};
    use idim_model::{Columns, Parameter, robot_from_ron};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::PI;

    /// The arm of the paper inside the limits inferred for it.
    fn design() -> EnergyDesign {
        let links: [&[_]; 3] = [
            &[ZZ],
            &[XX, XY, XZ, YZ, ZZ, MX, MY],
            &[XX, XY, XZ, YZ, ZZ, MX, MY],
        ];
        let columns = links.iter().enumerate().flat_map(|(index, kinds)| {
            let column = move |&kind| Parameter { kind, index };
            kinds.iter().map(column)
        });
        let (q2, q3) = (60_f64.to_radians(), 70_f64.to_radians());
        let limits = PointLimits {
            position: vec![[-PI, PI], [-q2, q2], [-q3, q3]],
            velocity: vec![0.69, 0.61, 0.64],
        };
        let robot = robot_from_ron(idim_fixtures::PUMA3R).unwrap();
        EnergyDesign::new(&robot, &Columns(columns.collect()), limits).unwrap()
    }

    #[test]
    fn identity_the_weighted_sum_falls_below_what_powell_reaches_from_the_same_start() {
        let design = design();
        let (n_rows, n_evaluations) = (30, 10_000);
        let n = design.n_variables() * (n_rows + 1);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let start: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
        let mut values = vec![0.0; n];
        design.substitute(&start, &mut values);
        let ranges: Vec<[f64; 2]> = design.ranges().collect();
        let ranges = ranges.iter().cycle().zip(&values);
        let x: Vec<f64> = ranges
            .map(|([low, high], v)| (2.0 * v - low - high) / (high - low))
            .collect();
        let cond = Criterion::TwoNorm(Scaling::Raw);
        let sum = Criterion::WeightedSum {
            condition: 1.0,
            equilibrium: 0.1,
        };
        let [free, weighed] = [cond, sum].map(|c| PointObjective::new(&design, n_rows, c, None));
        let (free, weighed) = (free.unwrap(), weighed.unwrap());
        let mut found = Candidate::descend(free, x, None, &FREE.coarse);
        for schedule in [&LIMITED.coarse, &LIMITED.polish] {
            found = Candidate::descend(weighed.clone(), found.x.clone(), Some(&found), schedule);
        }
        let mut rows = PointRows::new(&design, n_rows);
        let log_sum = |x: &[f64]| {
            design.substitute(x, &mut values);
            rows.update(&values);
            sum.evaluate(rows.matrix().as_ref(), n_rows).ln()
        };
        let options = PowellOptions {
            max_evaluations: n_evaluations,
            ..PowellOptions::default()
        };
        let reached = powell(log_sum, &start, &options).value.exp();
        // Powell's method stays at a corner of S; the sum that is told is the sum itself, no surrogate.
        assert!(found.merit < 0.2 * reached, "{} {reached}", found.merit);
        let told = found.merit / weighed.clone().criterion(&found.x, sum);
        assert!((told - 1.0).abs() < 1e-12, "{told}");
        assert_eq!(found.x.len(), n);
    }
}
