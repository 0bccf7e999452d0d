//! Fourier motions of the CRS A460: the printed one, and a better one.

#![allow(clippy::unwrap_used)]

use idim_excitation::{
    Criterion, Error, FourierOptions, Scaling, optimise_fourier, series_conditioning,
};
use idim_model::{Columns, Model, Notation, Robot, robot_from_ron};
use idim_trajectory::{FourierSeries, Limits};
use std::f64::consts::TAU;

/// The base set of Radkhah, Kulić & Croft's categorisation.
const BASE: &str = "Iyy1 m2 mx2 my2 mz2 Ixx2 Ixy2 Iyz2 mx3 mz3 Ixx3 Iyy3 Ixy3 Ixz3 Iyz3 mx4 mz4 Ixx4 Iyy4 \
    Ixy4 Ixz4 Iyz4 mx5 mz5 Ixx5 Iyy5 Ixy5 Ixz5 Iyz5 mx6 my6 Ixx6 Izz6 Ixy6 Ixz6 Iyz6";

/// Table I as printed: a_1 to a_5, b_1 to b_5, one column a joint; q0.
const TABLE_I: [[f64; 6]; 11] = [
    [0.156, 0.064, 0.634, -0.197, 0.499, 0.435],
    [-0.478, -0.335, -0.421, -0.282, -0.135, 0.111],
    [0.078, 0.451, 0.216, 0.173, -0.112, -0.245],
    [-0.388, 0.292, -0.310, 0.154, -0.263, -0.162],
    [-0.070, 1.046, -0.357, -0.095, -0.086, -0.442],
    [0.088, -0.125, -0.359, 0.408, 0.552, -0.017],
    [0.253, 0.292, 0.112, -0.714, 0.085, -0.178],
    [-0.207, -0.369, -0.128, 0.267, -0.184, 0.340],
    [0.549, 0.557, -0.069, 0.291, -0.065, -0.552],
    [0.150, 0.964, 0.183, 0.751, 0.116, -0.089],
    [0.0, 1.813, -1.184, 0.087, -0.415, 0.124],
];

fn crs() -> (Robot, Columns) {
    let robot = robot_from_ron(idim_fixtures::CRS_A460).unwrap();
    let all = Columns::inertial(6);
    let names = all.names(Notation::Tensor);
    let base: Vec<usize> = BASE
        .split_whitespace()
        .map(|name| names.iter().position(|n| n == name).unwrap())
        .collect();
    let columns = all.select(&base);
    (robot, columns)
}

fn options() -> FourierOptions {
    FourierOptions {
        period: 10.0,
        n_harmonics: 5,
        n_samples: 100,
        criterion: Criterion::TwoNorm(Scaling::Raw),
        n_starts: 1,
        seed: 1,
        max_evaluations: 300,
        n_constraint_samples: 64,
    }
}

#[test]
fn oracle_condition_of_table_1() {
    let (robot, columns) = crs();
    let of = |rows: std::ops::Range<usize>| -> Vec<Vec<f64>> {
        (0..6)
            .map(|j| rows.clone().map(|r| TABLE_I[r][j]).collect())
            .collect()
    };
    let series = FourierSeries::new(TAU / 10.0, TABLE_I[10].to_vec(), of(0..5), of(5..10)).unwrap();
    let model = Model::new(&robot);
    for n_samples in [100, 1000] {
        let c = series_conditioning(&model, &columns, &series, n_samples);
        // papers/README.md of the project: any number of samples from 100 on gives the same.
        let expected = [
            (c.raw.two_norm, 210.14705045),
            (c.equilibrated.two_norm, 56.13220893),
            (c.log_det, 80.26424382),
        ];
        for (found, expected) in expected {
            assert!(
                (found - expected).abs() < 6e-9,
                "{found} against {expected}"
            );
        }
    }
}

#[test]
fn oracle_a_motion_better_than_table_1_inside_all_limits() {
    let (robot, columns) = crs();
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let found = optimise_fourier(&model, &columns, &limits, &options()).unwrap();
    assert!(found.certificate.certified);
    assert!(
        found.conditioning.raw.two_norm < 130.0,
        "{}",
        found.conditioning.raw.two_norm
    );
    // The certificate against a thousand times finer sampling.
    let states = found.series.equispaced_states(20_000);
    for j in 0..6 {
        let [low, high] = limits.position[j];
        assert!(states.q(j).iter().all(|q| (low..=high).contains(q)));
        assert!(states.qd(j).iter().all(|v| v.abs() <= limits.velocity[j]));
        assert!(
            states
                .qdd(j)
                .iter()
                .all(|a| a.abs() <= limits.acceleration[j])
        );
    }
    // The value of the winning start is the criterion of the motion returned.
    let value = found.values[0];
    assert!((value / found.conditioning.raw.two_norm - 1.0).abs() < 1e-8);
    let again = series_conditioning(&model, &columns, &found.series, 100);
    assert!((again.raw.two_norm / found.conditioning.raw.two_norm - 1.0).abs() < 1e-8);
}

#[test]
fn identity_the_motion_does_not_depend_on_the_number_of_threads() {
    let (robot, columns) = crs();
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let options = FourierOptions {
        n_starts: 2,
        max_evaluations: 20,
        criterion: Criterion::LogDet,
        ..options()
    };
    let run = |n| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n)
            .build()
            .unwrap();
        pool.install(|| optimise_fourier(&model, &columns, &limits, &options).unwrap())
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn regress_criteria_without_a_gradient_and_empty_options_are_refused() {
    let (robot, columns) = crs();
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let wrong = [
        FourierOptions {
            criterion: Criterion::Equilibrium,
            ..options()
        },
        FourierOptions {
            n_samples: 3,
            ..options()
        },
        FourierOptions {
            n_constraint_samples: 10,
            ..options()
        },
        FourierOptions {
            n_starts: 0,
            ..options()
        },
    ];
    for options in wrong {
        let refused = optimise_fourier(&model, &columns, &limits, &options);
        assert!(matches!(refused, Err(Error::Input { .. })), "{options:?}");
    }
}
