//! The jobs that are timed beside the anchors and counted by the gate: one function each.

use crate::Case;
use idim::{information_factor, running_qr};
use idim_estimation::{InformationFactor, solve};
use idim_excitation::{
    ConditionRoute, Criterion, FourierDesign, FourierOptions, Scaling, condition_number,
    information_matrix, information_with_observations, log_condition_gradient, optimise_fourier,
};
use idim_model::{Columns, JointStates, visit_torque_regressor};
use idim_trajectory::Limits;
use std::hint::black_box;

/// Torque regressor of many samples, eight at a time.
pub fn regressor_batch(case: &Case, columns: &Columns, states: &JointStates) {
    visit_torque_regressor(&case.model, columns, states, |block| {
        black_box(block);
    });
}

/// Information matrix of the base columns.
pub fn information(case: &Case, states: &JointStates) {
    let weights = vec![1.0; case.model.n_joints()];
    black_box(information_matrix(
        &case.model,
        &case.base,
        states,
        &weights,
    ));
}

/// Products of columns and torques for the normal equations.
pub fn information_observed(case: &Case, columns: &Columns, states: &JointStates, torques: &[f64]) {
    let weights = vec![1.0; case.model.n_joints()];
    black_box(information_with_observations(
        &case.model,
        columns,
        states,
        torques,
        &weights,
    ));
}

/// Condition number of the base columns, from states to number.
pub fn condition(case: &Case, states: &JointStates) -> f64 {
    let weights = vec![1.0; case.model.n_joints()];
    condition_number(&case.model, &case.base, states, &weights).value
}

/// Logarithm of the condition number and its gradient by the states.
pub fn gradient(case: &Case, states: &JointStates) {
    let weights = vec![1.0; case.model.n_joints()];
    black_box(log_condition_gradient(
        &case.model,
        &case.base,
        states,
        &weights,
    ));
}

/// Torques of base columns with friction for least squares: those of parameters 1 for every column, and an error that
/// depends on the sample alone.
///
/// # Panics
/// Never: the shapes are the case's own.
pub fn torques(case: &Case, columns: &Columns, states: &JointStates) -> Vec<f64> {
    let (n, n_samples) = (case.model.n_joints(), states.n_samples());
    let mut y = vec![0.0; n * n_samples];
    visit_torque_regressor(&case.model, columns, states, |block| {
        for joint in 0..n {
            for lane in 0..block.n_samples() {
                let at = joint * n_samples + block.first_sample() + lane;
                y[at] = (0..columns.len())
                    .map(|c| block.lanes(joint, c)[lane])
                    .sum::<f64>()
                    + 0.1 * (at as f64).sin();
            }
        }
    });
    y
}

/// Least squares over base columns with friction, from states and torques to the estimate: by products of the rows.
///
/// # Panics
/// If the products do not serve: the states are made so that they do.
pub fn least_squares(
    case: &Case,
    columns: &Columns,
    states: &JointStates,
    torques: &[f64],
) -> Vec<f64> {
    let weights = vec![1.0; case.model.n_joints()];
    let (factor, route) =
        information_factor(&case.model, columns, states, torques, &weights).expect("finite rows");
    assert_eq!(route, ConditionRoute::Gram);
    values(&factor)
}

/// The same by the running QR of the rows.
///
/// # Panics
/// Never: all numbers are finite.
pub fn least_squares_qr(
    case: &Case,
    columns: &Columns,
    states: &JointStates,
    torques: &[f64],
) -> Vec<f64> {
    let weights = vec![1.0; case.model.n_joints()];
    let factor = running_qr(&case.model, columns, states, torques, &weights).expect("finite rows");
    values(&factor)
}

fn values(factor: &InformationFactor) -> Vec<f64> {
    let solution = solve(factor).expect("enough rows");
    let estimate = solution.determined().expect("random states excite all");
    estimate.values
}

/// One start of the problem of `bench_exciting.py`: 66 variables, 100 samples.
///
/// # Panics
/// If the search fails.
pub fn excitation_start(case: &Case, seed: u64) -> FourierDesign {
    let n = case.model.n_joints();
    let speed = |j: usize| case.robot.joints()[j].limits.velocity.unwrap_or(3.15);
    let limits = Limits::new(
        vec![[-3.0, 3.0]; n],
        (0..n).map(speed).collect(),
        vec![10.0; n],
    )
    .expect("sound limits");
    let options = FourierOptions {
        period: 10.0,
        n_harmonics: 5,
        n_samples: 100,
        criterion: Criterion::TwoNorm(Scaling::Raw),
        n_starts: 1,
        n_rounds: 1,
        seed,
        ..FourierOptions::default()
    };
    optimise_fourier(&case.model, &case.base, &limits, &options).expect("a motion")
}
