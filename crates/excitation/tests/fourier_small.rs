//! Fourier motions of the three-joint arm of Gautier & Khalil: what every search must keep to.

#![allow(clippy::unwrap_used)]

mod common;

use common::{gk_columns, gk_robot};
use faer::Mat;
use idim_excitation::{
    Criterion, FourierDesign, FourierEnds, FourierOptions, FourierWatch, Scaling,
    best_random_fourier, optimise_fourier, optimise_fourier_watched, series_conditioning,
};
use idim_model::{Model, observation_matrix};
use idim_trajectory::{FourierSeries, Limits};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

fn limits() -> Limits {
    Limits::new(
        vec![[-2.0, 1.0], [-1.0, 1.2], [-1.5, 1.3]],
        vec![1.5, 1.0, 2.0],
        vec![4.0, 3.0, 8.0],
    )
    .unwrap()
}

/// Small enough for a fraction of a second.
fn small() -> FourierOptions {
    FourierOptions {
        period: 8.0,
        n_harmonics: 3,
        n_samples: 40,
        n_starts: 3,
        n_rounds: 1,
        max_evaluations: 80,
        n_constraint_samples: 30,
        ..FourierOptions::default()
    }
}

fn find(options: &FourierOptions) -> FourierDesign {
    let model = Model::new(&gk_robot());
    optimise_fourier(&model, &gk_columns(), &limits(), options).unwrap()
}

fn best(design: &FourierDesign) -> f64 {
    design.values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// A hundred times finer than the criterion's samples, every limit holds.
fn assert_inside(series: &FourierSeries) {
    let (states, limits) = (series.equispaced_states(4000), limits());
    for j in 0..3 {
        let [low, high] = limits.position[j];
        assert!(states.q(j).iter().all(|q| (low..=high).contains(q)));
        let within = |x: &[f64], limit: f64| x.iter().all(|x| x.abs() <= limit);
        assert!(within(states.qd(j), limits.velocity[j]));
        assert!(within(states.qdd(j), limits.acceleration[j]));
    }
}

#[test]
fn identity_every_criterion_is_lowered_inside_certified_limits() {
    let model = Model::new(&gk_robot());
    for criterion in [
        Criterion::TwoNorm(Scaling::Raw),
        Criterion::TwoNorm(Scaling::Equilibrated),
        Criterion::Frobenius(Scaling::Raw),
        Criterion::LogDet,
        Criterion::TraceInverse,
        Criterion::WorstDirection,
    ] {
        let options = FourierOptions {
            criterion,
            ..small()
        };
        let found = find(&options);
        assert!(found.certificate.certified, "{criterion:?}");
        assert_inside(&found.series);
        // Far below anything at random under the same limits.
        let at_random =
            best_random_fourier(&model, &gk_columns(), &limits(), &options, 100, &|| false)
                .unwrap();
        assert!(at_random.certificate.certified && at_random.values.len() == 100);
        let at_random = best(&at_random);
        let found = best(&found);
        let lower = if criterion == Criterion::LogDet {
            at_random - 5.0
        } else {
            at_random / 1.5
        };
        assert!(found < lower, "{criterion:?}: {found} against {at_random}");
    }
}

#[test]
fn identity_the_motion_does_not_depend_on_the_number_of_threads() {
    let run = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        pool.unwrap().install(|| find(&small()))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn identity_motions_that_begin_at_rest() {
    let home = vec![0.5, 0.3, -1.2];
    for ends in [FourierEnds::AtRest, FourierEnds::AtRestAt(home.clone())] {
        let at_home = matches!(ends, FourierEnds::AtRestAt(_));
        let found = find(&FourierOptions {
            ends,
            n_harmonics: 4,
            ..small()
        });
        assert!(found.certificate.certified);
        assert_inside(&found.series);
        let ends = found.series.states(&[0.0, 8.0]);
        for (j, home) in home.iter().enumerate() {
            for k in 0..2 {
                // Rounding of sums of a few terms of size one, times the fundamental and harmonics.
                assert!(ends.qd(j)[k].abs() < 1e-12);
                assert!(ends.qdd(j)[k].abs() < 1e-11);
                assert!(!at_home || (ends.q(j)[k] - home).abs() < 1e-12);
            }
        }
        // The limits are used, not only respected.
        assert!(found.certificate.largest().2.fraction > 0.99);
    }
}

#[test]
fn identity_noise_scales_rows_and_prior_adds_information() {
    let model = Model::new(&gk_robot());
    let columns = gk_columns();
    let noise = [2.0, 0.5, 0.1];
    // Earlier logs that know one column well and the rest hardly.
    let prior = Mat::from_fn(15, 15, |i, j| {
        if i == j {
            if i == 4 { 100.0 } else { 1e-3 }
        } else {
            0.0
        }
    });
    let options = FourierOptions {
        criterion: Criterion::LogDet,
        torque_noise: noise.to_vec(),
        prior_information: Some(prior.clone()),
        ..small()
    };
    let found = find(&options);
    let mut w = observation_matrix(&model, &columns, &found.series.equispaced_states(40));
    for (i, mut row) in w.row_iter_mut().enumerate() {
        row /= noise[i % 3];
    }
    let information = w.transpose() * w / 40.0;
    let total = information + nalgebra::DMatrix::from_fn(15, 15, |i, j| prior[(i, j)]);
    let log_det = total.cholesky().unwrap().l().diagonal().map(f64::ln).sum() * 2.0;
    assert!((best(&found) + log_det).abs() < 1e-9 * log_det.abs());
    // What is reported beside it is the regressor alone, on a finer grid.
    let plain = series_conditioning(&model, &columns, &found.series, 400);
    assert_eq!(found.conditioning, plain);
}

#[test]
fn identity_criteria_can_be_mixed() {
    let options = FourierOptions {
        further: vec![
            (0.5, Criterion::TwoNorm(Scaling::Equilibrated)),
            (0.1, Criterion::LogDet),
        ],
        ..small()
    };
    let found = find(&options);
    let model = Model::new(&gk_robot());
    let c = series_conditioning(&model, &gk_columns(), &found.series, 40);
    let expected = c.raw.two_norm.ln() + 0.5 * c.equilibrated.two_norm.ln() - 0.1 * c.log_det;
    assert!((best(&found) - expected).abs() < 1e-9 * expected.abs());
}

#[test]
fn identity_later_rounds_only_improve() {
    let first = find(&FourierOptions {
        n_rounds: 0,
        ..small()
    });
    let later = find(&FourierOptions {
        n_rounds: 2,
        ..small()
    });
    assert_eq!(first.values[..3], later.values[..3]);
    assert!(
        best(&later)
            <= first.values[..3]
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min)
    );
    assert_eq!((first.n_rounds, later.n_rounds), (1, 3));
}

#[test]
fn identity_told_to_stop_it_returns_the_best_so_far() {
    let model = Model::new(&gk_robot());
    let run = |stop: &AtomicBool, after: usize| {
        let seen = Mutex::new(Vec::new());
        let watch = FourierWatch {
            stop,
            progress: &|progress| {
                let mut seen = seen.lock().unwrap();
                seen.push(*progress);
                if seen.len() == after {
                    stop.store(true, Ordering::Relaxed);
                }
            },
        };
        let found =
            optimise_fourier_watched(&model, &gk_columns(), &limits(), &small(), &watch).unwrap();
        (found, seen.into_inner().unwrap())
    };
    // Before it begins: a motion all the same.
    let (found, _) = run(&AtomicBool::new(true), usize::MAX);
    assert!(found.certificate.certified && found.n_rounds == 0);
    // On the way: the best of what was reported.
    let (found, seen) = run(&AtomicBool::new(false), 2);
    assert!(found.certificate.certified && found.n_rounds < 2);
    let lowest = seen.iter().map(|p| p.value).fold(f64::INFINITY, f64::min);
    assert!(best(&found) <= lowest);
    // Undisturbed: a report after every search, and the last stands for all.
    let (found, seen) = run(&AtomicBool::new(false), usize::MAX);
    assert_eq!(seen.len(), 6);
    assert!(seen.iter().all(|p| p.best >= best(&found)));
}
