//! A smooth criterion of the torque regressor along a Fourier motion, and its gradient by the coefficients.

use crate::Conditioning;
use crate::FourierOptions;
use crate::spectrum::SmoothCriterion;
use faer::Mat;
use idim_model::{Columns, JointStates, Model, RegressorBlock, visit_torque_regressor};
use idim_trajectory::FourierBasis;

/// Step of the central differences by position and velocity (rad, rad/s): their error is about 1e-10 relative.
const STEP: f64 = 1e-5;

/// The function an optimiser lowers: coefficients (joint after joint) to the logarithm of the criterion.
pub(crate) struct FourierObjective<'a> {
    model: &'a Model,
    columns: &'a Columns,
    criterion: SmoothCriterion,
    basis: FourierBasis,
    states: JointStates,
    /// Stacked rows, joint after joint: row `joint · n_samples + sample`, so that lanes lie side by side.
    w: Mat<f64>,
    /// Derivative of the criterion by the entries of `w`.
    by_rows: Mat<f64>,
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
            by_rows: Mat::zeros(n_rows, columns.len()),
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

    pub(crate) fn value(&mut self, coefficients: &[f64]) -> f64 {
        self.update(coefficients);
        let n = self.basis.n_samples();
        finite(self.criterion.evaluate(self.w.as_ref(), n, None))
    }

    pub(crate) fn value_and_gradient(&mut self, coefficients: &[f64], out: &mut [f64]) -> f64 {
        self.update(coefficients);
        let n = self.basis.n_samples();
        let by_rows = Some(self.by_rows.as_mut());
        let value = self.criterion.evaluate(self.w.as_ref(), n, by_rows);
        let by_states = self.by_states();
        out.copy_from_slice(&self.basis.pull_back(&by_states));
        finite(value)
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

    /// Derivative of `⟨G_t, Y(q, q̇, q̈)⟩` at every sample by its state: central differences of the regressor.
    ///
    /// Along the acceleration the regressor is linear, so the difference is exact.
    fn by_states(&self) -> JointStates {
        let n = self.states.n_samples();
        let mut out = JointStates::zeros(self.states.n_joints(), n);
        let mut moved = self.states.clone();
        for joint in 0..self.states.n_joints() {
            for kind in 0..3 {
                let step = if kind == 2 { 1.0 } else { STEP };
                let base = pick(&self.states, kind, joint).to_vec();
                let mut slopes = vec![0.0; n];
                for sign in [1.0, -1.0] {
                    let row = pick_mut(&mut moved, kind, joint);
                    for (x, b) in row.iter_mut().zip(&base) {
                        *x = b + sign * step;
                    }
                    self.contract(&moved, sign / (2.0 * step), &mut slopes);
                }
                pick_mut(&mut moved, kind, joint).copy_from_slice(&base);
                pick_mut(&mut out, kind, joint).copy_from_slice(&slopes);
            }
        }
        out
    }

    /// Adds `factor ⟨G_t, Y_t⟩` of every sample.
    fn contract(&self, states: &JointStates, factor: f64, out: &mut [f64]) {
        let n = states.n_samples();
        visit_torque_regressor(self.model, self.columns, states, |block| {
            let (first, count) = (block.first_sample(), block.n_samples());
            let mut sum = [0.0; RegressorBlock::LANES];
            for column in 0..block.n_columns() {
                let g = self.by_rows.col(column);
                for joint in 0..block.n_joints() {
                    let lanes = block.lanes(joint, column);
                    for k in 0..count {
                        sum[k] += lanes[k] * g[joint * n + first + k];
                    }
                }
            }
            for k in 0..count {
                out[first + k] += factor * sum[k];
            }
        });
    }
}

fn pick(states: &JointStates, kind: usize, joint: usize) -> &[f64] {
    match kind {
        0 => states.q(joint),
        1 => states.qd(joint),
        _ => states.qdd(joint),
    }
}

fn pick_mut(states: &mut JointStates, kind: usize, joint: usize) -> &mut [f64] {
    match kind {
        0 => states.q_mut(joint),
        1 => states.qd_mut(joint),
        _ => states.qdd_mut(joint),
    }
}

/// A large number in place of infinity, which the line search of the optimiser cannot step back from.
fn finite(value: f64) -> f64 {
    const WORSE_THAN_ANY: f64 = 1e6;
    if value.is_finite() {
        value
    } else {
        WORSE_THAN_ANY
    }
}
