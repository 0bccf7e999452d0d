//! Criteria of the torque regressor along a Fourier motion, and their exact gradient by the coefficients.
//!
//! With `A = A₀ + Σ Yᵀ D Y` and `S = ∂f/∂A`: `df = 2 Σ_t ⟨D Y_t S, dY_t⟩`, which the model's reverse mode takes to the
//! states and the transpose of the basis to the coefficients.

use crate::added_columns::{AddedRows, information_with_added};
use crate::fourier_contraction::Contraction;
use crate::path_penalty::PathPenalty;
use crate::spectrum::{SmoothCriterion, SpectralPoint};
use crate::{AddedColumn, FourierOptions};
use faer::Mat;
use idim_model::{Columns, JointStates, Model, regressor_contraction_gradient};
use idim_trajectory::FourierBasis;

/// The function an optimiser lowers: coefficients (joint after joint) to a weighted sum of criteria's logarithms.
pub(crate) struct FourierObjective<'a> {
    model: &'a Model,
    columns: &'a Columns,
    added: &'a [AddedColumn],
    exact: Vec<(f64, SmoothCriterion)>,
    criteria: Vec<(f64, SmoothCriterion)>,
    basis: FourierBasis,
    contraction: Contraction,
    /// The diagonal of `D`: inverse squared noise of each joint's torque.
    joint_weights: Vec<f64>,
    /// What earlier logs tell, in units of this motion's samples.
    prior: Option<Mat<f64>>,
    states: JointStates,
    points: Vec<SpectralPoint>,
    /// Conditions on the path; counted in smoothed values only.
    pub(crate) path: Option<PathPenalty<'a>>,
    smoothed: bool,
    n_evaluations: usize,
}

impl<'a> FourierObjective<'a> {
    pub(crate) fn new(
        model: &'a Model,
        columns: &'a Columns,
        criteria: &[(f64, SmoothCriterion)],
        options: &'a FourierOptions,
    ) -> Self {
        let joint_weights = if options.torque_noise.is_empty() {
            vec![1.0; model.n_joints()]
        } else {
            options.torque_noise.iter().map(|s| 1.0 / (s * s)).collect()
        };
        let prior = options.prior_information.as_ref();
        Self {
            model,
            columns,
            added: &options.added,
            exact: criteria.to_vec(),
            criteria: criteria.to_vec(),
            basis: FourierBasis::equispaced(options.period, options.n_harmonics, options.n_samples),
            contraction: Contraction::new(model, columns),
            joint_weights,
            prior: prior.map(|a| faer::Scale(options.n_samples as f64) * a),
            states: JointStates::zeros(model.n_joints(), options.n_samples),
            points: Vec::new(),
            path: PathPenalty::new(model, options),
            smoothed: false,
            n_evaluations: 0,
        }
    }

    pub(crate) fn n_evaluations(&self) -> usize {
        self.n_evaluations
    }

    /// Puts norms of this power in the place of extreme eigenvalues, and adds the penalty of the path; `None`: the
    /// criteria themselves.
    pub(crate) fn smooth(&mut self, power: Option<f64>) {
        self.criteria.clone_from(&self.exact);
        self.smoothed = power.is_some();
        if let Some(power) = power {
            for (_, criterion) in &mut self.criteria {
                *criterion = criterion.smoothed(power);
            }
        }
    }

    /// Weighted sum of the logarithms; infinite where columns are dependent.
    pub(crate) fn value(&mut self, coefficients: &[f64]) -> f64 {
        self.n_evaluations += 1;
        self.basis.states_into(coefficients, &mut self.states);
        let weights = &self.joint_weights;
        let columns = (self.columns, self.added);
        let mut information = information_with_added(self.model, columns, &self.states, weights);
        if let Some(prior) = &self.prior {
            information += prior;
        }
        let (a, n) = (information.as_ref(), self.basis.n_samples());
        self.points = self.criteria.iter().map(|(_, c)| c.at(a, n)).collect();
        let terms = self.criteria.iter().zip(&self.points);
        let value: f64 = terms.map(|((weight, _), point)| weight * point.value).sum();
        value + self.active_path().map_or(0.0, |p| p.value(coefficients))
    }

    fn active_path(&mut self) -> Option<&mut PathPenalty<'a>> {
        let smoothed = self.smoothed;
        self.path.as_mut().filter(|_| smoothed)
    }

    /// Gradient where the value was asked for last; zero where that was infinite.
    pub(crate) fn gradient(&mut self) -> Vec<f64> {
        let n = self.columns.len() + self.added.len();
        let mut s = Mat::<f64>::zeros(n, n);
        for ((weight, criterion), point) in self.criteria.iter().zip(&self.points) {
            s += faer::Scale(2.0 * weight) * criterion.by_information(point);
        }
        let s = s.as_ref();
        self.contraction.set_matrix(s);
        let (contraction, weights) = (&self.contraction, &self.joint_weights);
        let rows = AddedRows::new(self.added, &self.states);
        let mut own = rows.zeros();
        let mut by_states =
            regressor_contraction_gradient(self.model, self.columns, &self.states, |y, g| {
                contraction.contract(y, weights, g);
                rows.add_to_weights(s, weights, contraction.reached(), g);
                rows.own_weights(s, weights, contraction.reached(), y, &mut own);
            });
        rows.pull_back(self.added, &own, &self.states, &mut by_states);
        let mut gradient = self.basis.pull_back(&by_states);
        if let Some(path) = self.active_path() {
            for (g, p) in gradient.iter_mut().zip(path.gradient()) {
                *g += p;
            }
        }
        gradient
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::{Criterion, Scaling};
    use idim_model::{KnownTorque, ParameterKind, robot_from_ron};
    use idim_trajectory::{Limits, random_series};
    use proptest::prelude::*;

    /// Base columns of the first three joints of a PUMA 560, some friction and a rotor.
    fn columns() -> Columns {
        use idim_model::Parameter;
        use idim_model::ParameterKind::{Fv, Ia, MX, MY, XX, XY, XZ, YZ, ZZ};
        let named = [
            (ZZ, 0),
            (XX, 1),
            (XY, 1),
            (XZ, 1),
            (YZ, 1),
            (ZZ, 1),
            (MX, 1),
            (MY, 1),
            (XX, 2),
            (XY, 2),
            (XZ, 2),
            (YZ, 2),
            (ZZ, 2),
            (MX, 2),
            (MY, 2),
            (Fv, 0),
            (Ia, 2),
        ];
        Columns(
            named
                .map(|(kind, index)| Parameter { kind, index })
                .to_vec(),
        )
    }

    /// A motor that turns with the last two joints, and a spring.
    fn added() -> Vec<AddedColumn> {
        let motor = |kind| AddedColumn::Motor {
            kind,
            turns: vec![0.0, 0.7, 1.0],
        };
        let spring = KnownTorque::from_formula("spring", 1, &[], "sin(q) * sqrt(1.5 - cos(q))");
        vec![
            motor(ParameterKind::Ia),
            motor(ParameterKind::Fv),
            AddedColumn::Known(spring.unwrap()),
        ]
    }

    #[test]
    fn identity_added_columns_are_columns_of_the_information() {
        let model = Model::new(&robot_from_ron(idim_fixtures::PUMA3R).unwrap());
        let (columns, mut added) = (columns(), added());
        added.push(AddedColumn::Motor {
            kind: ParameterKind::Fc,
            turns: vec![-0.3, 0.0, 1.0],
        });
        let states =
            idim_model::random_states(&robot_from_ron(idim_fixtures::PUMA3R).unwrap(), 21, 3);
        let weights = [0.5_f64, 2.0, 3.0];
        let y = idim_model::observation_matrix(&model, &columns, &states);
        // Each entry once more, from the words of the equations: with m = Σ turns q, τ_j = turns_j (Ia m̈ + Fv ṁ + Fc sign ṁ).
        let x = |column: usize, sample: usize, joint: usize| {
            let s = states.state(sample);
            match column {
                0 => [0.0, 0.7, 1.0][joint] * (0.7 * s.qdd[1] + s.qdd[2]),
                1 => [0.0, 0.7, 1.0][joint] * (0.7 * s.qd[1] + s.qd[2]),
                2 if joint == 1 => s.q[1].sin() * (1.5 - s.q[1].cos()).sqrt(),
                3 => [-0.3, 0.0, 1.0][joint] * (s.qd[2] - 0.3 * s.qd[0]).signum(),
                _ => 0.0,
            }
        };
        let w = Mat::from_fn(3 * 21, 17 + 4, |row, c| {
            let (sample, joint) = (row / 3, row % 3);
            let entry = if c < 17 {
                y[(row, c)]
            } else {
                x(c - 17, sample, joint)
            };
            weights[joint].sqrt() * entry
        });
        let expected = w.transpose() * &w;
        let found = information_with_added(&model, (&columns, &added), &states, &weights);
        let scale = expected.norm_max();
        // Sums of 63 terms in another order.
        assert!((found - expected).norm_max() < 1e-13 * scale);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn identity_the_gradient_is_the_slope_in_any_direction(
            seed in 0..1000_u64,
            direction in prop::collection::vec(-1.0..1.0_f64, 21),
            plain in proptest::bool::ANY,
        ) {
            let model = Model::new(&robot_from_ron(idim_fixtures::PUMA3R).unwrap());
            let columns = columns();
            let limits = Limits {
                position: vec![[-2.0, 1.0]; 3],
                velocity: vec![2.0; 3],
                acceleration: vec![6.0; 3],
            };
            let noise = if plain { vec![] } else { vec![0.5, 2.0, 1.0] };
            let added = if plain { vec![] } else { added() };
            let prior = Mat::<f64>::identity(17 + added.len(), 17 + added.len());
            let options = FourierOptions {
                period: 7.0,
                n_harmonics: 3,
                // Not a whole number of blocks.
                n_samples: 45,
                torque_noise: noise,
                added,
                prior_information: (!plain).then_some(prior),
                ..FourierOptions::default()
            };
            let c = random_series(&limits, 3, 7.0, seed).coefficients();
            let moved = |t: f64| -> Vec<f64> {
                c.iter().zip(&direction).map(|(c, d)| c + t * d).collect()
            };
            for criterion in [
                Criterion::TwoNorm(Scaling::Raw),
                Criterion::TwoNorm(Scaling::Equilibrated),
                Criterion::LogDet,
                Criterion::TraceInverse,
                Criterion::WorstDirection,
            ] {
                let smooth = SmoothCriterion::new(criterion).unwrap();
                let criteria = [(0.7, smooth), (0.1, SmoothCriterion::new(Criterion::LogDet).unwrap())];
                let mut objective = FourierObjective::new(&model, &columns, &criteria, &options);
                // Without crossings of extreme eigenvalues.
                objective.smooth(Some(3.0));
                let mut f = |t: f64| objective.value(&moved(t));
                // Five-point difference: truncation h⁴ times some thousand, rounding 1e-16 cond(A) / h.
                let h = 5e-4;
                let numeric = (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
                f(0.0);
                let exact = crate::dense::dot(&objective.gradient(), &direction);
                prop_assert!(
                    (exact - numeric).abs() < 1e-8 * exact.abs().max(1.0),
                    "{:?}: {} against {}", criterion, exact, numeric
                );
            }
        }
    }
}
