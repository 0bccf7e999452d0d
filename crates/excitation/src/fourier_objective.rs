//! A smooth criterion of the torque regressor along a Fourier motion, and its exact gradient by the coefficients.
//!
//! With `A = Σ YᵀY` and `S = ∂f/∂A`: `df = 2 Σ_t ⟨Y_t S, dY_t⟩`, which the model's reverse mode takes to the states and
//! the transpose of the basis to the coefficients.

use crate::Conditioning;
use crate::FourierOptions;
use crate::spectrum::{SmoothCriterion, SpectralPoint};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, Mat, Par};
use idim_model::{
    Columns, JointStates, Model, regressor_contraction_gradient, visit_torque_regressor,
};
use idim_trajectory::FourierBasis;

/// The function an optimiser lowers: coefficients (joint after joint) to the logarithm of the criterion.
pub(crate) struct FourierObjective<'a> {
    model: &'a Model,
    columns: &'a Columns,
    pub(crate) criterion: SmoothCriterion,
    basis: FourierBasis,
    states: JointStates,
    /// Stacked rows, joint after joint: row `joint · n_samples + sample`, so that lanes lie side by side.
    w: Mat<f64>,
    information: Mat<f64>,
    point: Option<SpectralPoint>,
    n_evaluations: usize,
}

impl<'a> FourierObjective<'a> {
    pub(crate) fn new(
        model: &'a Model,
        columns: &'a Columns,
        criterion: SmoothCriterion,
        options: &FourierOptions,
    ) -> Self {
        let n_rows = model.n_joints() * options.n_samples;
        Self {
            model,
            columns,
            criterion,
            basis: FourierBasis::equispaced(options.period, options.n_harmonics, options.n_samples),
            states: JointStates::zeros(model.n_joints(), options.n_samples),
            w: Mat::zeros(n_rows, columns.len()),
            information: Mat::zeros(columns.len(), columns.len()),
            point: None,
            n_evaluations: 0,
        }
    }

    pub(crate) fn n_evaluations(&self) -> usize {
        self.n_evaluations
    }

    pub(crate) fn conditioning(&mut self, coefficients: &[f64]) -> Conditioning {
        self.update(coefficients);
        Conditioning::of_rows(self.w.as_ref(), self.basis.n_samples())
    }

    /// Logarithm of the criterion; infinite where columns are dependent.
    pub(crate) fn value(&mut self, coefficients: &[f64]) -> f64 {
        self.update(coefficients);
        let (a, w) = (self.information.as_mut(), self.w.as_ref());
        let (full, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
        let wt = w.transpose();
        matmul(a, lower, Accum::Replace, wt, full, w, full, 1.0, Par::Seq);
        let point = self
            .criterion
            .at(self.information.as_ref(), self.basis.n_samples());
        let value = point.value;
        self.point = Some(point);
        value
    }

    /// Gradient where the value was asked for last.
    ///
    /// # Panics
    /// If no value was asked for.
    pub(crate) fn gradient(&self) -> Vec<f64> {
        let point = self.point.as_ref().expect("a value comes first");
        let s = self.criterion.by_information(point);
        let n = self.w.ncols();
        let by_states =
            regressor_contraction_gradient(self.model, self.columns, &self.states, |y, g| {
                for joint in 0..y.n_joints() {
                    for b in 0..n {
                        let mut sum = [0.0; 8];
                        for a in 0..n {
                            let (lanes, s) = (y.lanes(joint, a), 2.0 * s[(a, b)]);
                            for k in 0..8 {
                                sum[k] += lanes[k] * s;
                            }
                        }
                        *g.lanes_mut(joint, b) = sum;
                    }
                }
            });
        self.basis.pull_back(&by_states)
    }

    fn update(&mut self, coefficients: &[f64]) {
        self.n_evaluations += 1;
        self.basis.states_into(coefficients, &mut self.states);
        let n = self.states.n_samples();
        let w = &mut self.w;
        visit_torque_regressor(self.model, self.columns, &self.states, |block| {
            let (first, count) = (block.first_sample(), block.n_samples());
            for joint in 0..block.n_joints() {
                for column in 0..block.n_columns() {
                    let lanes = block.lanes(joint, column);
                    for (k, value) in lanes[..count].iter().enumerate() {
                        w[(joint * n + first + k, column)] = *value;
                    }
                }
            }
        });
    }
}
