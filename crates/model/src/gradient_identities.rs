//! Gradients against derivatives of the regressor by dual numbers.

use crate::axes::Kinematics;
use crate::packing::Rows;
use crate::projection::{BLOCKS, fill};
use crate::testing::{Dual, dual, robot_and_state};
use crate::*;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Relative rounding of the two recursions, against the sum of the magnitudes that enter.
const ROUNDING: f64 = 1e-11;

fn numbers(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| rng.random_range(-1.0..1.0)).collect()
}

/// `∂Y/∂x` for each of the `3 n` numbers of a state, by dual numbers; `n × p` row by row.
fn regressor_derivatives(model: &Model, columns: &Columns, s: &JointState) -> Vec<Vec<Dual>> {
    let n = model.n_joints();
    let rows = Rows::new(model, columns);
    (0..3 * n)
        .map(|x| {
            let seeded = |part: usize, v: &[f64]| -> Vec<Dual> {
                (0..n)
                    .map(|j| dual(v[j], f64::from(u8::from(x == part * n + j))))
                    .collect()
            };
            let (q, qd, qdd) = (seeded(0, &s.q), seeded(1, &s.qd), seeded(2, &s.qdd));
            let mut cells = vec![dual(0.0, 0.0); rows.n_cells];
            let mut kinematics = Kinematics::new(model, [dual(0.0, 0.0), dual(1.0, 0.0)]);
            let state = [&q[..], &qd, &qdd];
            fill::<Dual, BLOCKS>((), model, rows.all(), state, &mut kinematics, &mut cells);
            rows.places.iter().map(|&place| cells[place]).collect()
        })
        .collect()
}

/// Columns with gaps, out of order: what a base selection looks like.
fn some_columns(n: usize) -> Columns {
    let all = Columns::standard(n, DriveColumns::ALL);
    let pick: Vec<usize> = (0..all.len()).rev().filter(|k| k % 3 != 0).collect();
    all.select(&pick)
}

fn agrees(
    robot: &Robot,
    state: &JointState,
    gradient: &JointState,
    weights: impl Fn(&[f64]) -> Vec<f64>,
) -> Result<(), TestCaseError> {
    let n = robot.n_joints();
    let columns = some_columns(n);
    let by_dual = regressor_derivatives(&Model::new(robot), &columns, state);
    let flat = [&gradient.q[..], &gradient.qd, &gradient.qdd].concat();
    for (d, found) in by_dual.iter().zip(flat) {
        let y: Vec<f64> = d.iter().map(|e| e.re).collect();
        let products: Vec<f64> = weights(&y).iter().zip(d).map(|(g, e)| g * e.du).collect();
        let expected: f64 = products.iter().sum();
        let scale = products.iter().fold(1.0, |s, x| s + x.abs());
        prop_assert!(
            (found - expected).abs() < ROUNDING * scale,
            "{found} {expected}"
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn identity_torque_contraction_gradient_is_that_of_dual_numbers((robot, state) in robot_and_state(), seed in 0..1000_u64) {
        let n = robot.n_joints();
        let columns = some_columns(n);
        let (u, v) = (numbers(n, seed), numbers(columns.len(), seed + 1));
        let states = JointStates::from_states(std::slice::from_ref(&state));
        let gradient = torque_contraction_gradient(&Model::new(&robot), &columns, &states, &u, &v);
        agrees(&robot, &state, &gradient.state(0), |_| {
            u.iter().flat_map(|u| v.iter().map(move |v| u * v)).collect()
        })?;
    }

    #[test]
    fn identity_squared_torque_gradient_is_that_of_dual_numbers((robot, state) in robot_and_state(), seed in 0..1000_u64) {
        let n = robot.n_joints();
        let columns = some_columns(n);
        let p = columns.len();
        let (d, v1, v2) = (numbers(n, seed), numbers(p, seed + 1), numbers(p, seed + 2));
        let states = JointStates::from_states(std::slice::from_ref(&state));
        let gradient = squared_torque_gradient(&Model::new(&robot), &columns, &states, &d, &[(0.7, &v1), (-0.4, &v2)]);
        agrees(&robot, &state, &gradient.state(0), |y| {
            let mut g = vec![0.0; n * p];
            for (c, v) in [(0.7, &v1), (-0.4, &v2)] {
                for i in 0..n {
                    let torque: f64 = y[i * p..][..p].iter().zip(v).map(|(y, v)| y * v).sum();
                    for k in 0..p {
                        g[i * p + k] += c * d[i] * torque * v[k];
                    }
                }
            }
            g
        })?;
    }

    #[test]
    fn identity_regressor_contraction_gradient_is_that_of_dual_numbers((robot, state) in robot_and_state(), seed in 0..1000_u64) {
        let n = robot.n_joints();
        let columns = some_columns(n);
        let p = columns.len();
        let weights = numbers(n * p, seed);
        let states = JointStates::from_states(std::slice::from_ref(&state));
        let gradient = regressor_contraction_gradient(&Model::new(&robot), &columns, &states, |y, g| {
            for i in 0..n {
                for c in 0..p {
                    *g.lanes_mut(i, c) = y.lanes(i, c).map(|y| y * weights[i * p + c] + weights[c]);
                }
            }
        });
        agrees(&robot, &state, &gradient.state(0), |y| {
            (0..n * p).map(|e| y[e] * weights[e] + weights[e % p]).collect()
        })?;
    }

    #[test]
    fn identity_gradients_of_a_sample_do_not_depend_on_its_neighbours((robot, state) in robot_and_state(), count in 1..20_usize) {
        let model = Model::new(&robot);
        let n = robot.n_joints();
        let columns = some_columns(n);
        let mut all = vec![state];
        all.extend((1..count).map(|k| random_states(&robot, 1, k as u64).state(0)));
        let v = numbers(columns.len(), 5);
        let u = numbers(n, 6);
        let many: Vec<f64> = u.iter().flat_map(|&x| vec![x; count]).collect();
        let fill_in = |y: &RegressorBlock, g: &mut RegressorBlock| {
            for i in 0..n {
                for c in 0..columns.len() {
                    *g.lanes_mut(i, c) = *y.lanes(i, c);
                }
            }
        };
        let of = |s: &JointStates, u: &[f64]| [
            torque_contraction_gradient(&model, &columns, s, u, &v),
            squared_torque_gradient(&model, &columns, s, &vec![1.0; n], &[(1.0, &v)]),
            regressor_contraction_gradient(&model, &columns, s, fill_in),
        ];
        let together = of(&JointStates::from_states(&all), &many);
        for (k, s) in all.iter().enumerate() {
            let alone = of(&JointStates::from_states(std::slice::from_ref(s)), &u);
            for (a, b) in alone.iter().zip(&together) {
                prop_assert_eq!(a.state(0), b.state(k));
            }
        }
    }
}
