//! Fourier motions of the CRS A460 and of a UR5: the printed one, the best known ones, and better ones.

#![allow(clippy::unwrap_used)]

use idim_excitation::{
    Conditioning, Criterion, Error, FourierEnds, FourierOptions, Scaling, optimise_fourier,
    series_conditioning,
};
use idim_model::{Columns, Model, Notation, Robot, robot_from_ron, robot_from_urdf};
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

fn select<'a>(names: impl Iterator<Item = &'a str>) -> Columns {
    let all = Columns::inertial(6);
    let known = all.names(Notation::Tensor);
    let base: Vec<usize> = names
        .map(|name| known.iter().position(|n| n == name).unwrap())
        .collect();
    all.select(&base)
}

fn crs() -> (Robot, Columns) {
    let robot = robot_from_ron(idim_fixtures::CRS_A460).unwrap();
    (robot, select(BASE.split_whitespace()))
}

fn oracle() -> serde_json::Value {
    let text = include_str!("../../../fixtures/oracles/fourier_motions.json");
    serde_json::from_str(text).unwrap()
}

fn series(coefficients: &serde_json::Value) -> FourierSeries {
    let c: Vec<f64> = serde_json::from_value(coefficients.clone()).unwrap();
    FourierSeries::from_coefficients(TAU / 10.0, 6, 5, &c).unwrap()
}

/// One search, as short as shows something.
fn short() -> FourierOptions {
    FourierOptions {
        n_starts: 1,
        n_rounds: 0,
        max_evaluations: 300,
        seed: 1,
        ..FourierOptions::default()
    }
}

fn assert_inside(series: &FourierSeries, limits: &Limits) {
    // A hundred times finer than the criterion's samples.
    let states = series.equispaced_states(10_000);
    for j in 0..series.n_joints() {
        let [low, high] = limits.position[j];
        assert!(states.q(j).iter().all(|q| (low..=high).contains(q)));
        let within = |x: &[f64], limit: f64| x.iter().all(|x| x.abs() <= limit);
        assert!(within(states.qd(j), limits.velocity[j]));
        assert!(within(states.qdd(j), limits.acceleration[j]));
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
fn oracle_best_motions_known_before() {
    let (robot, columns) = crs();
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    for name in ["cond", "conds", "logdet"] {
        let known = &oracle()["crs"][name];
        let series = series(&known["coefficients"]);
        assert!(series.certificate(&limits).certified, "{name}");
        let c = series_conditioning(&model, &columns, &series, 1000);
        let expected = [
            (c.raw.two_norm, &known["cond"]),
            (c.equilibrated.two_norm, &known["cond_unit_columns"]),
            (c.log_det, &known["log_det"]),
        ];
        for (found, expected) in expected {
            let expected = expected.as_f64().unwrap();
            assert!(
                (found / expected - 1.0).abs() < KNOWN_TOLERANCE,
                "{name}: {found} against {expected}"
            );
        }
    }
}

/// Both programs sum the same integral over different samples.
const KNOWN_TOLERANCE: f64 = 1e-7;

#[test]
fn oracle_one_search_comes_near_the_best_motions_known_before() {
    let (robot, columns) = crs();
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    // 43.88, 16.29 and 188.84 took hours of basin hopping; one search may stop a few percent above.
    for (criterion, enough) in [
        (Criterion::TwoNorm(Scaling::Raw), 46.0),
        (Criterion::TwoNorm(Scaling::Equilibrated), 17.5),
        (Criterion::LogDet, -185.0),
    ] {
        let options = FourierOptions {
            criterion,
            ..short()
        };
        let found = optimise_fourier(&model, &columns, &limits, &options).unwrap();
        assert!(found.certificate.certified);
        assert_inside(&found.series, &limits);
        let best = found.values.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(best < enough, "{criterion:?}: {best}");
        // The value is the criterion of the motion returned; the Gram matrix costs half of the digits.
        let of = |c: Conditioning| match criterion {
            Criterion::TwoNorm(Scaling::Raw) => c.raw.two_norm,
            Criterion::LogDet => -c.log_det,
            _ => c.equilibrated.two_norm,
        };
        let again = of(series_conditioning(&model, &columns, &found.series, 100));
        assert!((best / again - 1.0).abs() < 1e-8);
        // A hundred samples of a period hide nothing.
        assert!((best / of(found.conditioning) - 1.0).abs() < 1e-5);
    }
}

#[test]
fn oracle_ur5_from_the_starts_of_slsqp() {
    let oracle = &oracle()["ur5"];
    let robot = robot_from_urdf(idim_fixtures::UR5_URDF).unwrap();
    let names = oracle["base"].as_array().unwrap();
    let columns = select(names.iter().map(|n| n.as_str().unwrap()));
    let speed: Vec<f64> = serde_json::from_value(oracle["velocity_limit"].clone()).unwrap();
    let limits = Limits::new(vec![[-3.0, 3.0]; 6], speed, vec![10.0; 6]).unwrap();
    let model = Model::new(&robot);
    for start in oracle["starts"].as_array().unwrap() {
        let series = series(&start["coefficients"]);
        let before = series_conditioning(&model, &columns, &series, 100);
        let pinocchio = start["cond"].as_f64().unwrap();
        assert!((before.raw.two_norm / pinocchio - 1.0).abs() < 1e-9);
        let options = FourierOptions {
            starts: vec![series],
            n_rounds: 1,
            ..short()
        };
        let found = optimise_fourier(&model, &columns, &limits, &options).unwrap();
        let slsqp = start["slsqp_cond"].as_f64().unwrap();
        let reached = found.conditioning.raw.two_norm;
        assert!(reached <= slsqp, "{reached} against {slsqp}");
    }
}

#[test]
fn regress_questions_that_make_no_sense_are_refused() {
    let (robot, columns) = crs();
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let other = FourierSeries::from_coefficients(1.0, 6, 1, &[0.1; 18]).unwrap();
    let rest = FourierEnds::AtRest;
    let wrong = [
        FourierOptions {
            criterion: Criterion::Equilibrium,
            ..short()
        },
        FourierOptions {
            further: vec![(1.0, Criterion::PivotedQr(Scaling::Raw))],
            ..short()
        },
        FourierOptions {
            n_samples: 3,
            ..short()
        },
        FourierOptions {
            n_constraint_samples: 10,
            ..short()
        },
        FourierOptions {
            n_starts: 0,
            ..short()
        },
        FourierOptions {
            period: f64::NAN,
            ..short()
        },
        FourierOptions {
            torque_noise: vec![1.0; 5],
            ..short()
        },
        FourierOptions {
            torque_noise: vec![0.0; 6],
            ..short()
        },
        FourierOptions {
            starts: vec![other],
            ..short()
        },
        FourierOptions {
            ends: FourierEnds::AtRestAt(vec![10.0; 6]),
            ..short()
        },
        FourierOptions {
            ends: rest,
            n_harmonics: 1,
            ..short()
        },
        FourierOptions {
            prior_information: Some(faer::Mat::zeros(3, 3)),
            ..short()
        },
    ];
    for options in wrong {
        let refused = optimise_fourier(&model, &columns, &limits, &options);
        assert!(matches!(refused, Err(Error::Input { .. })), "{options:?}");
    }
}
