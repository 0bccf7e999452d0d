//! Points of the energy model by exact gradients: better than any published, inside the limits, reproducible.

#![allow(clippy::unwrap_used)]

mod common;

use common::{gk_design, gk_limits};
use idim_excitation::{Criterion, Error, PointDesign, PointSearchOptions, Scaling, search_points};
use std::ops::ControlFlow;

fn options(n_rows: usize) -> PointSearchOptions {
    PointSearchOptions {
        n_rows,
        criterion: Criterion::TwoNorm(Scaling::Raw),
        limit_of_equilibrium: None,
        n_starts: 8,
        n_rounds: 2,
        seed: 1,
    }
}

fn search(options: &PointSearchOptions) -> PointDesign {
    search_points(&gk_design(), options, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn assert_inside_limits(found: &PointDesign) {
    let limits = gk_limits();
    for j in 0..3 {
        let [low, high] = limits.position[j];
        assert!(found.points.q(j).iter().all(|q| (low..=high).contains(q)));
        let speeds = found.points.qd(j);
        assert!(speeds.iter().all(|v| v.abs() <= limits.velocity[j]));
    }
}

#[test]
fn oracle_condition_below_the_published_order_with_few_starts() {
    // Best known at these limits before: 12.82 for r = 30, 8.68 for r = 50 (fixtures/oracles/gk_points.json). A handful
    // of starts comes near; the command line gives more.
    for (n_rows, near) in [(30, 14.5), (50, 9.0)] {
        let found = search(&options(n_rows));
        let condition = found.conditioning.raw.two_norm;
        assert!(condition < near, "r = {n_rows}: {condition}");
        assert_eq!(found.points.n_samples(), n_rows + 1);
        assert_inside_limits(&found);
        assert!((found.values[0] / condition - 1.0).abs() < 1e-9);
        assert!(found.values.is_sorted());
    }
}

#[test]
fn identity_same_points_for_any_number_of_threads() {
    let run = |n| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap();
        pool.install(|| search(&options(20)))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn identity_a_limit_of_equilibrium_is_held() {
    let held = search(&PointSearchOptions {
        limit_of_equilibrium: Some(1000.0),
        n_rounds: 1,
        ..options(20)
    });
    let s = held.conditioning.equilibrium.unwrap();
    assert!(s.ratio <= 1000.0 && s.n_zero == 0, "{s:?}");
    // Without it entries vanish, and the condition is better.
    let free = search(&options(20));
    assert!(free.conditioning.equilibrium.unwrap().ratio > 1000.0);
    assert!(free.conditioning.raw.two_norm < held.conditioning.raw.two_norm);
    assert_inside_limits(&held);
}

#[test]
fn oracle_a_weighted_sum_below_that_of_the_published_points() {
    // The paper's points have Cond 11.16 and S 175, inside limits it does not state; it prints no weights.
    let [condition, equilibrium] = [1.0, 1.0];
    let found = search(&PointSearchOptions {
        criterion: Criterion::WeightedSum {
            condition,
            equilibrium,
        },
        n_starts: 4,
        n_rounds: 1,
        ..options(30)
    });
    let s = found.conditioning.equilibrium.unwrap().ratio;
    let sum = condition * found.conditioning.raw.two_norm + equilibrium * s;
    assert!(sum < 11.16 + 175.0, "{sum}");
    // What is told is the sum itself, no surrogate.
    assert!((found.values[0] / sum - 1.0).abs() < 1e-9);
    assert_inside_limits(&found);
}

#[test]
fn identity_each_criterion_is_best_at_its_own_optimum() {
    let criteria = [
        Criterion::TwoNorm(Scaling::Raw),
        Criterion::TwoNorm(Scaling::Equilibrated),
        Criterion::LogDet,
        Criterion::WorstDirection,
        Criterion::TraceInverse,
    ];
    let design = gk_design();
    let found: Vec<PointDesign> = criteria
        .iter()
        .map(|&criterion| {
            search(&PointSearchOptions {
                criterion,
                n_starts: 4,
                n_rounds: 1,
                ..options(20)
            })
        })
        .collect();
    for (own, &criterion) in criteria.iter().enumerate() {
        let value =
            |f: &PointDesign| criterion.evaluate(design.observation_matrix(&f.points).as_ref(), 20);
        for (other, points) in found.iter().enumerate() {
            assert!(
                value(&found[own]) <= value(points),
                "{criterion:?} is better at the optimum of {:?}",
                criteria[other]
            );
        }
    }
}

#[test]
fn identity_a_search_can_be_stopped_and_keeps_its_best() {
    let mut told = Vec::new();
    let found = search_points(
        &gk_design(),
        &PointSearchOptions {
            n_rounds: 1000,
            ..options(20)
        },
        &mut |progress| {
            told.push(progress);
            if progress.n_done == 2 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        },
    )
    .unwrap();
    let done: Vec<usize> = told.iter().map(|p| p.n_done).collect();
    assert_eq!(done, [0, 1, 2]);
    assert!(told.windows(2).all(|w| w[1].best <= w[0].best));
    assert!(found.conditioning.raw.two_norm <= told[2].best * (1.0 + 1e-12));
    // Two rounds asked for and two rounds reached are the same search.
    assert_eq!(found, search(&options(20)));
}

#[test]
fn regress_searches_that_cannot_work_are_refused() {
    let weighed = |equilibrium| PointSearchOptions {
        criterion: Criterion::WeightedSum {
            condition: 1.0,
            equilibrium,
        },
        ..options(20)
    };
    let wrong = [
        PointSearchOptions {
            criterion: Criterion::Equilibrium,
            ..options(20)
        },
        PointSearchOptions {
            n_starts: 0,
            ..options(20)
        },
        PointSearchOptions {
            limit_of_equilibrium: Some(0.5),
            ..options(20)
        },
        PointSearchOptions {
            limit_of_equilibrium: Some(100.0),
            ..weighed(1.0)
        },
        weighed(0.0),
        weighed(f64::INFINITY),
        options(14),
    ];
    for options in wrong {
        let refused = search_points(&gk_design(), &options, &mut |_| ControlFlow::Continue(()));
        assert!(matches!(refused, Err(Error::Input { .. })), "{options:?}");
    }
}
