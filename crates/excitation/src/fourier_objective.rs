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
    use crate::Criterion;
    use crate::dual::{
        AGREEMENT, Dual, Extremes, SMOOTH, SPRING, dual, gram, logarithm, torque_rows,
    };
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
        let spring = KnownTorque::from_formula("spring", 1, &[], SPRING);
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

    /// States of a series whose coefficients move in a direction: joint by joint `q₀, a₁ .. a₃, b₁ .. b₃` as `coefficients` has them.
    fn dual_states(c: &[Dual], omega: f64, t: f64) -> [Vec<Dual>; 3] {
        let mut states = [vec![], vec![], vec![]];
        for c in c.chunks_exact(7) {
            let (mut q, mut qd, mut qdd) = (c[0], Dual::ZERO, Dual::ZERO);
            for l in 1..=3 {
                let (a, b) = (c[l], c[3 + l]);
                let w = omega * l as f64;
                let (s, k) = (w * t).sin_cos();
                q = q + a * (s / w) - b * (k / w);
                qd = qd + a * k + b * s;
                qdd = qdd + b * (w * k) - a * (w * s);
            }
            for (to, value) in states.iter_mut().zip([q, qd, qdd]) {
                to.push(value);
            }
        }
        states
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        #[test]
        fn identity_the_gradient_is_the_slope_in_any_direction(
            seed in 0..1000_u64,
            direction in prop::collection::vec(-1.0..1.0_f64, 21),
            plain in proptest::bool::ANY,
        ) {
            let robot = robot_from_ron(idim_fixtures::PUMA3R).unwrap();
            let (model, columns) = (Model::new(&robot), columns());
            let limits = Limits {
                position: vec![[-2.0, 1.0]; 3],
                velocity: vec![2.0; 3],
                acceleration: vec![6.0; 3],
            };
            let noise = if plain { vec![1.0; 3] } else { vec![0.5, 2.0, 1.0] };
            let added = if plain { vec![] } else { added() };
            let p = 17 + added.len();
            // Not a whole number of blocks.
            let n_samples = 45;
            let options = FourierOptions {
                period: 7.0,
                n_harmonics: 3,
                n_samples,
                torque_noise: noise.clone(),
                added: added.clone(),
                prior_information: (!plain).then(|| Mat::<f64>::identity(p, p)),
                ..FourierOptions::default()
            };
            let series = random_series(&limits, 3, 7.0, seed);
            let c = series.coefficients();
            let moved: Vec<Dual> = c.iter().zip(&direction).map(|(c, d)| dual(*c, *d)).collect();
            let mut rows = Vec::new();
            for k in 0..n_samples {
                let t = 7.0 * k as f64 / n_samples as f64;
                let [q, qd, qdd] = dual_states(&moved, series.omega(), t);
                let here = torque_rows(&robot, (&columns, &added), [&q, &qd, &qdd]);
                rows.extend(here.into_iter().enumerate().map(|(j, row)| (noise[j].powi(-2), row)));
            }
            let mut a = gram(&rows);
            for (i, row) in a.iter_mut().enumerate().filter(|_| !plain) {
                row[i] = row[i] + dual(n_samples as f64, 0.0);
            }
            for criterion in SMOOTH {
                for (power, extremes) in [(None, Extremes::Sharp), (Some(3.0), Extremes::Norm(3.0))] {
                    let weighted = [(0.7, criterion), (0.1, Criterion::LogDet)];
                    let expected = weighted.map(|(w, c)| logarithm(c, extremes, a.clone(), n_samples) * w);
                    let expected = expected[0] + expected[1];
                    let smooth = weighted.map(|(w, c)| (w, SmoothCriterion::new(c).unwrap()));
                    let mut objective = FourierObjective::new(&model, &columns, &smooth, &options);
                    objective.smooth(power);
                    let value = objective.value(&c);
                    let slope = crate::dense::dot(&objective.gradient(), &direction);
                    prop_assert!(
                        (value - expected.re).abs() < AGREEMENT && (slope - expected.du).abs() < AGREEMENT * slope.abs().max(1.0),
                        "{criterion:?}, {extremes:?}: {value}, {slope} against {expected:?}"
                    );
                }
            }
        }
    }
}
