//! Rows of a chain of points as a function of its design variables, and the way back.

use crate::energy::EnergyScratch;
use crate::{EnergyDesign, padded};
use faer::Mat;

/// Rows `W` of the points last given, padded; a point that did not move keeps its row of `h`.
#[derive(Debug, Clone)]
pub(crate) struct PointRows<'a> {
    design: &'a EnergyDesign,
    n_rows: usize,
    last: Vec<f64>,
    scratch: Vec<EnergyScratch>,
    h: Vec<f64>,
    w: Vec<f64>,
    q: Vec<f64>,
}

impl<'a> PointRows<'a> {
    pub(crate) fn new(design: &'a EnergyDesign, n_rows: usize) -> Self {
        let stride = padded::stride(design.n_columns());
        Self {
            design,
            n_rows,
            last: vec![f64::NAN; (n_rows + 1) * design.n_variables()],
            scratch: vec![design.model().scratch(); n_rows + 1],
            h: vec![0.0; (n_rows + 1) * stride],
            w: vec![0.0; n_rows * stride],
            // Positions that do not matter stay at zero.
            q: vec![0.0; design.n_joints()],
        }
    }

    /// For the design variables `(q, q̇)` of every point, point after point.
    pub(crate) fn update(&mut self, values: &[f64]) {
        let n = self.design.n_variables();
        let stride = padded::stride(self.design.n_columns());
        let positions = self.design.position_variables();
        for (point, here) in values.chunks_exact(n).enumerate() {
            let last = &mut self.last[point * n..(point + 1) * n];
            if *last == *here {
                continue;
            }
            last.copy_from_slice(here);
            for (&value, &j) in here.iter().zip(positions) {
                self.q[j] = value;
            }
            let h = &mut self.h[point * stride..(point + 1) * stride];
            let scratch = &mut self.scratch[point];
            self.design
                .model()
                .row(&self.q, &here[positions.len()..], scratch, h);
        }
        for (w, (h, next)) in self.w.iter_mut().zip(self.h.iter().zip(&self.h[stride..])) {
            *w = next - h;
        }
    }

    /// The padded rows last computed.
    pub(crate) fn w(&self) -> &[f64] {
        &self.w
    }

    /// The rows last computed as a matrix.
    pub(crate) fn matrix(&self) -> Mat<f64> {
        let b = self.design.n_columns();
        let stride = padded::stride(b);
        Mat::from_fn(self.n_rows, b, |i, j| self.w[i * stride + j])
    }

    /// Gradient by the design variables from that by the (padded) entries of `W`, at the points last given.
    pub(crate) fn pull_back(&mut self, by_rows: &[f64], out: &mut [f64]) {
        let (n, b) = (self.design.n_variables(), self.design.n_columns());
        let stride = padded::stride(b);
        let positions = self.design.position_variables();
        let mut weights = vec![0.0; b];
        let mut by_q = vec![0.0; self.design.n_joints()];
        for point in 0..=self.n_rows {
            // A point ends the row before it and starts the next.
            weights.fill(0.0);
            if point > 0 {
                weights.copy_from_slice(&by_rows[(point - 1) * stride..][..b]);
            }
            if point < self.n_rows {
                for (w, g) in weights.iter_mut().zip(&by_rows[point * stride..]) {
                    *w -= g;
                }
            }
            let here = &self.last[point * n..(point + 1) * n];
            for (&value, &j) in here.iter().zip(positions) {
                self.q[j] = value;
            }
            let out = &mut out[point * n..(point + 1) * n];
            let (by_positions, by_velocities) = out.split_at_mut(positions.len());
            let scratch = &mut self.scratch[point];
            self.design
                .model()
                .row_gradient(&self.q, &weights, scratch, &mut by_q, by_velocities);
            for (slope, &j) in by_positions.iter_mut().zip(positions) {
                *slope = by_q[j];
            }
        }
    }
}
