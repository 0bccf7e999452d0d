//! From states and torques to the triangle `[R z; 0 e]` that least squares needs, without ever storing a row.

use crate::error::Error;
use idim_estimation::InformationFactor;
use idim_excitation::{ConditionRoute, information_with_observations};
use idim_model::{Columns, JointStates, Model, visit_torque_regressor};

/// The factor of the rows `√D [Y_t | y_t]` of all samples, and how it was found.
///
/// By the products of the rows where their condition allows (unit columns, at most
/// [`PRODUCTS_LIMIT`](idim_estimation::PRODUCTS_LIMIT)), else by a running QR of the rows. Memory does not grow with the
/// samples; a log too long to be held is given chunk by chunk and the factors merged.
///
/// `observed`: torques, N·m (N), joint by joint as the states; `joint_weights`: the diagonal of `D`, one a joint: the inverse
/// variances of the joints' noise, or ones.
///
/// # Errors
/// A state or a torque that is not a finite number.
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub fn information_factor(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    observed: &[f64],
    joint_weights: &[f64],
) -> Result<(InformationFactor, ConditionRoute), Error> {
    let products = information_with_observations(model, columns, states, observed, joint_weights);
    let n_rows = states.n_samples() * model.n_joints();
    if let Some(factor) = InformationFactor::from_products(products.as_ref(), n_rows) {
        return Ok((factor, ConditionRoute::Gram));
    }
    let factor = running_qr(model, columns, states, observed, joint_weights)?;
    Ok((factor, ConditionRoute::Qr))
}

/// The same by reflections of the rows, whatever their condition: all digits, some six times the work.
///
/// # Errors
/// As [`information_factor`].
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub fn running_qr(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    observed: &[f64],
    joint_weights: &[f64],
) -> Result<InformationFactor, Error> {
    let (n, p, n_samples) = (model.n_joints(), columns.len(), states.n_samples());
    assert_eq!(
        observed.len(),
        n * n_samples,
        "observations are not joints × samples"
    );
    assert_eq!(joint_weights.len(), n, "one weight a joint");
    let roots: Vec<f64> = joint_weights.iter().map(|d| d.sqrt()).collect();
    let mut factor = InformationFactor::new(p);
    let mut outcome = Ok(());
    let mut rows = vec![0.0; 8 * n * p];
    let mut y = vec![0.0; 8 * n];
    visit_torque_regressor(model, columns, states, |block| {
        if outcome.is_err() {
            return;
        }
        let count = block.n_samples() * n;
        block.copy_rows(&mut rows[..count * p]);
        for (k, row) in rows.chunks_exact_mut(p).take(count).enumerate() {
            let (joint, sample) = (k % n, k / n);
            for x in &mut *row {
                *x *= roots[joint];
            }
            y[k] = roots[joint] * observed[joint * n_samples + block.first_sample() + sample];
        }
        outcome = factor.push_rows(&rows[..count * p], &y[..count]);
    });
    outcome?;
    Ok(factor)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::{KeepOrder, Structure};
    use idim_estimation::{Solution, solve};
    use idim_model::{DriveColumns, random_states, robot_from_ron};

    /// Values by products against values by reflections: `n u cond²` at a condition of 10.
    const HALF_THE_DIGITS: f64 = 1e-11;

    struct Problem {
        model: Model,
        columns: Columns,
        states: JointStates,
        truth: Vec<f64>,
        observed: Vec<f64>,
    }

    /// Torques of known parameters with a deterministic error.
    fn problem(error: f64) -> Problem {
        let robot = robot_from_ron(idim_fixtures::PUMA3R).unwrap();
        let columns =
            Structure::of_torque(&robot, DriveColumns::NONE, KeepOrder::Links).base_columns();
        let model = Model::new(&robot);
        let states = random_states(&robot, 501, 4);
        let truth: Vec<f64> = (0..columns.len()).map(|k| 1.0 + (k as f64).sin()).collect();
        let n_samples = states.n_samples();
        let mut observed = vec![0.0; robot.n_joints() * n_samples];
        visit_torque_regressor(&model, &columns, &states, |block| {
            for joint in 0..robot.n_joints() {
                for lane in 0..block.n_samples() {
                    let t: f64 = (0..columns.len())
                        .map(|c| block.lanes(joint, c)[lane] * truth[c])
                        .sum();
                    let at = joint * n_samples + block.first_sample() + lane;
                    observed[at] = t + error * (7.0 * at as f64).sin();
                }
            }
        });
        Problem {
            model,
            columns,
            states,
            truth,
            observed,
        }
    }

    fn values(factor: &InformationFactor) -> (Vec<f64>, f64) {
        let Solution::Determined(estimate) = solve(factor).unwrap() else {
            panic!("the states determine all")
        };
        (estimate.values, estimate.sigma)
    }

    #[test]
    fn identity_products_and_reflections_give_one_answer() {
        let p = problem(0.1);
        let weights = [1.0, 4.0, 0.25];
        let (fast, route) =
            information_factor(&p.model, &p.columns, &p.states, &p.observed, &weights).unwrap();
        assert_eq!(route, ConditionRoute::Gram);
        let accurate = running_qr(&p.model, &p.columns, &p.states, &p.observed, &weights).unwrap();
        assert_eq!(fast.n_rows(), accurate.n_rows());
        let ((fast, sigma), (accurate, expected)) = (values(&fast), values(&accurate));
        for (a, b) in fast.iter().zip(&accurate) {
            assert!(
                (a - b).abs() <= HALF_THE_DIGITS * b.abs().max(1.0),
                "{a} {b}"
            );
        }
        // What the products lose of the residual: `n u / 2` over its share in the observations, squared (see
        // `InformationFactor::from_products`).
        let n_samples = p.states.n_samples();
        let observed: f64 = p
            .observed
            .chunks_exact(n_samples)
            .zip(weights)
            .map(|(y, w)| w * y.iter().map(|y| y * y).sum::<f64>())
            .sum();
        let rest = 3 * n_samples - p.columns.len();
        let share = expected.powi(2) * rest as f64 / observed;
        let lost = p.columns.len() as f64 * f64::EPSILON / 4.0 / share;
        assert!(lost < 1e-9, "the test would show little: {lost:e}");
        let found = (sigma / expected - 1.0).abs();
        assert!(found <= lost, "{found:e} beyond {lost:e}");
    }

    #[test]
    fn identity_dependent_columns_and_exact_torques_are_left_to_reflections() {
        // Without noise the residual is rounding, which products cannot tell from nothing.
        let p = problem(0.0);
        let (factor, route) =
            information_factor(&p.model, &p.columns, &p.states, &p.observed, &[1.0; 3]).unwrap();
        assert_eq!(route, ConditionRoute::Qr);
        for (found, truth) in values(&factor).0.iter().zip(&p.truth) {
            assert!((found - truth).abs() <= HALF_THE_DIGITS * truth.abs().max(1.0));
        }
        // All ten parameters of each link: no torque tells them apart.
        let p = problem(0.1);
        let all = Columns::inertial(3);
        let (factor, route) =
            information_factor(&p.model, &all, &p.states, &p.observed, &[1.0; 3]).unwrap();
        assert_eq!(route, ConditionRoute::Qr);
        assert!(matches!(
            solve(&factor).unwrap(),
            Solution::RankDeficient(_)
        ));
    }

    #[test]
    fn identity_a_number_that_is_none_is_an_error() {
        let mut p = problem(0.1);
        p.observed[17] = f64::NAN;
        let found = information_factor(&p.model, &p.columns, &p.states, &p.observed, &[1.0; 3]);
        assert!(found.is_err());
    }
}
