//! The condition number of a motion, from its states to the number.

use crate::criterion::singular_values;
use crate::eigenvalues::symmetric_eigenvalues;
use crate::information::information_matrix;
use faer::Side;
use idim_base_params::TriangularFactor;
use idim_model::{Columns, JointStates, Model, squared_torque_gradient, visit_torque_regressor};

/// Largest condition number taken from the information matrix.
///
/// Its eigenvalues carry errors of up to `p u λ₁` (`p` columns, `u = 1.1e-16`), so the relative error of the number is
/// `p u cond² / 2`: 2e-7 for forty columns here, and it would be of the order of one at 1e7.
const GRAM_LIMIT: f64 = 1.0e4;

/// How a condition number was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ConditionRoute {
    /// By the eigenvalues of the information matrix: fast, and accurate for condition numbers up to 1e4.
    Gram,
    /// By the singular values of a triangular factor of the rows: accurate to rounding times the number itself.
    Qr,
}

/// A condition number and how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConditionNumber {
    /// `σ₁ / σ_b`; infinite where the columns are dependent.
    pub value: f64,
    /// Which of the two ways gave it.
    pub route: ConditionRoute,
}

/// 2-norm condition number of the weighted rows `√D Y` of all samples; `joint_weights`: the diagonal of `D`, one a joint.
///
/// By the information matrix, and once more by orthogonal reflections of the rows where that says more than 1e4.
///
/// # Panics
/// If a shape does not fit the model, or there are fewer rows than columns.
#[track_caller]
pub fn condition_number(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    joint_weights: &[f64],
) -> ConditionNumber {
    let information = information_matrix(model, columns, states, joint_weights);
    let eigenvalues = symmetric_eigenvalues(information.as_ref()).unwrap_or_default();
    if let (Some(&least), Some(&largest)) = (eigenvalues.first(), eigenvalues.last())
        && least * GRAM_LIMIT * GRAM_LIMIT >= largest
    {
        return ConditionNumber {
            value: (largest / least).sqrt(),
            route: ConditionRoute::Gram,
        };
    }
    ConditionNumber {
        value: by_reflections(model, columns, states, joint_weights),
        route: ConditionRoute::Qr,
    }
}

/// `log (σ₁ / σ_b)` of the weighted rows and its gradient by every `q`, `q̇`, `q̈`, in the shape of the states.
///
/// By the information matrix `A`: `dλ = vᵀ dA v`, whatever the other eigenvectors. `None` where the columns are dependent
/// to rounding of `A`; an extreme eigenvalue that is double has no derivative, and any of its vectors is taken.
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub fn log_condition_gradient(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    joint_weights: &[f64],
) -> Option<(f64, JointStates)> {
    let information = information_matrix(model, columns, states, joint_weights);
    let eigen = information.self_adjoint_eigen(Side::Lower).ok()?;
    let (values, vectors) = (eigen.S().column_vector(), eigen.U());
    let last = columns.len().checked_sub(1)?;
    let (least, largest) = (values[0], values[last]);
    if least <= largest * f64::EPSILON {
        return None;
    }
    let vector = |k: usize| -> Vec<f64> { vectors.col(k).iter().copied().collect() };
    let (v_least, v_largest) = (vector(0), vector(last));
    let terms = [
        (1.0 / largest, &v_largest[..]),
        (-1.0 / least, &v_least[..]),
    ];
    let gradient = squared_torque_gradient(model, columns, states, joint_weights, &terms);
    Some((0.5 * (largest / least).ln(), gradient))
}

#[track_caller]
fn by_reflections(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    joint_weights: &[f64],
) -> f64 {
    let (n, p) = (model.n_joints(), columns.len());
    let mut factor = TriangularFactor::new(p);
    let mut rows = vec![0.0; 8 * n * p];
    visit_torque_regressor(model, columns, states, |block| {
        let rows = &mut rows[..block.n_samples() * n * p];
        for (k, row) in rows.chunks_exact_mut(p).enumerate() {
            let root = joint_weights[k % n].sqrt();
            block.copy_row(k % n, k / n, row);
            for x in row {
                *x *= root;
            }
        }
        factor.push_rows(rows);
    });
    let sigma = singular_values(factor.r());
    match (sigma.first(), sigma.last()) {
        (Some(a), Some(&b)) if b > 0.0 => a / b,
        (Some(_), _) => f64::INFINITY,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::{AGREEMENT, Dual, Extremes, dual, gram, logarithm, torque_rows};
    use crate::{Criterion, Scaling};
    use idim_model::ParameterKind::{Fv, MX, MY, XX, ZZ};
    use idim_model::{DriveColumns, Parameter, observation_matrix, random_states};

    /// Relative error of the routes against singular values of the stacked rows: `p u cond² / 2` at cond 1e3.
    const TOLERANCE: f64 = 1e-8;

    #[test]
    fn identity_both_routes_give_the_condition_number_of_the_stacked_rows() {
        let robot = idim_model::robot_from_ron(idim_fixtures::PLANAR2R).expect("a fixture");
        let model = Model::new(&robot);
        let column = |(kind, index)| Parameter { kind, index };
        let base = [
            (ZZ, 0),
            (MX, 0),
            (MY, 0),
            (ZZ, 1),
            (MX, 1),
            (MY, 1),
            (Fv, 1),
        ]
        .map(column);
        let columns = Columns(base.to_vec());
        let states = random_states(&robot, 50, 3);
        let w = observation_matrix(&model, &columns, &states);
        let w = faer::MatRef::from_column_major_slice(w.as_slice(), w.nrows(), w.ncols());
        let expected = Criterion::TwoNorm(Scaling::Raw).evaluate(w, 50);
        let ones = [1.0; 2];
        let found = condition_number(&model, &columns, &states, &ones);
        assert_eq!(found.route, ConditionRoute::Gram);
        let by_rows = by_reflections(&model, &columns, &states, &ones);
        for value in [found.value, by_rows] {
            assert!(
                (value - expected).abs() < TOLERANCE * expected,
                "{value} {expected}"
            );
        }
        // A slow motion: accelerations hardly show, and squares lose what singular values keep.
        let mut slow = states.clone();
        for joint in 0..2 {
            for x in slow.qd_mut(joint) {
                *x *= 1e-4;
            }
            for x in slow.qdd_mut(joint) {
                *x *= 1e-4;
            }
        }
        let w = observation_matrix(&model, &columns, &slow);
        let w = faer::MatRef::from_column_major_slice(w.as_slice(), w.nrows(), w.ncols());
        let expected = Criterion::TwoNorm(Scaling::Raw).evaluate(w, 50);
        let found = condition_number(&model, &columns, &slow, &ones);
        assert_eq!(found.route, ConditionRoute::Qr);
        assert!((found.value - expected).abs() < TOLERANCE * expected);
    }

    #[test]
    fn identity_gradient_of_log_condition_by_dual_numbers() {
        let robot = idim_model::robot_from_ron(idim_fixtures::PUMA3R).expect("a fixture");
        let model = Model::new(&robot);
        let column = |(kind, index)| Parameter { kind, index };
        let named = [
            (ZZ, 0),
            (Fv, 0),
            (XX, 1),
            (ZZ, 1),
            (MX, 1),
            (MY, 1),
            (ZZ, 2),
            (MX, 2),
        ];
        let columns = Columns(named.map(column).to_vec());
        let states = random_states(&robot, 21, 5);
        let weights = [1.0, 0.5, 2.0];
        let (value, gradient) =
            log_condition_gradient(&model, &columns, &states, &weights).expect("independent");
        let exact = condition_number(&model, &columns, &states, &weights)
            .value
            .ln();
        assert!((value - exact).abs() < 1e-12);
        let direction = random_states(&robot, 21, 6);
        let mut slope = 0.0;
        for j in 0..3 {
            for k in 0..21 {
                slope += gradient.q(j)[k] * direction.q(j)[k]
                    + gradient.qd(j)[k] * direction.qd(j)[k]
                    + gradient.qdd(j)[k] * direction.qdd(j)[k];
            }
        }
        let mut rows = Vec::new();
        for k in 0..21 {
            let (at, by) = (states.state(k), direction.state(k));
            let both = |at: &[f64], by: &[f64]| -> Vec<Dual> {
                at.iter().zip(by).map(|(x, d)| dual(*x, *d)).collect()
            };
            let [q, qd, qdd] =
                [(&at.q, &by.q), (&at.qd, &by.qd), (&at.qdd, &by.qdd)].map(|(at, by)| both(at, by));
            let here = torque_rows(&robot, (&columns, &[]), [&q, &qd, &qdd]);
            rows.extend(weights.into_iter().zip(here));
        }
        let criterion = Criterion::TwoNorm(Scaling::Raw);
        let expected = logarithm(criterion, Extremes::Sharp, gram(&rows), 21);
        assert!(
            (slope - expected.du).abs() < AGREEMENT * slope.abs().max(1.0),
            "{slope} {expected:?}"
        );
    }

    #[test]
    fn identity_dependent_columns_are_told_by_reflections() {
        let robot = idim_model::robot_from_ron(idim_fixtures::PLANAR2R).expect("a fixture");
        let model = Model::new(&robot);
        let columns = Columns::standard(2, DriveColumns::NONE);
        let found = condition_number(&model, &columns, &random_states(&robot, 50, 3), &[1.0; 2]);
        assert_eq!(found.route, ConditionRoute::Qr);
        assert!(found.value > 1e12);
    }
}
