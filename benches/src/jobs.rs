//! The jobs that are timed beside the anchors and counted by the gate: one function each.

use crate::Case;
use idim_estimation::InformationFactor;
use idim_excitation::{
    Criterion, FourierDesign, FourierOptions, Scaling, condition_number, information_matrix,
    log_condition_gradient, optimise_fourier,
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

/// Running QR of `[W | y]` over base columns with friction; the observations are the positions, for want of torques.
///
/// # Panics
/// Never: all numbers are finite.
pub fn least_squares(case: &Case, columns: &Columns, states: &JointStates) -> InformationFactor {
    let (n, p) = (case.model.n_joints(), columns.len());
    let mut factor = InformationFactor::new(p);
    let mut rows = vec![0.0; 8 * n * p];
    let mut y = vec![0.0; 8 * n];
    visit_torque_regressor(&case.model, columns, states, |block| {
        let count = block.n_samples() * n;
        for (k, row) in rows.chunks_exact_mut(p).take(count).enumerate() {
            block.copy_row(k % n, k / n, row);
            y[k] = states.q(k % n)[block.first_sample() + k / n];
        }
        factor
            .push_rows(&rows[..count * p], &y[..count])
            .expect("finite rows");
    });
    factor
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
