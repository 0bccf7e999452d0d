//! Limits of a Fourier motion as bounds on linear functions of its coefficients, joint by joint.

use idim_trajectory::{FourierBasis, Limits};
use std::f64::consts::TAU;

/// Grid on which extrema are looked for: the parabola through three neighbours is then off by 1e-4 of the top.
const SAMPLES_PER_HARMONIC: usize = 32;

/// Bounds `-1 < offset + row · x < 1` of one joint: fractions of its limits at instants of the period.
#[derive(Debug, Clone, Default)]
pub(crate) struct JointBounds {
    /// Row after row, one entry a variable of the joint.
    pub(crate) rows: Vec<f64>,
    pub(crate) offset: Vec<f64>,
}

/// Coefficients of a joint as `size · x`, and its limits on `x`.
#[derive(Debug, Clone)]
pub(crate) struct BoundedSeries {
    pub(crate) period: f64,
    pub(crate) n_harmonics: usize,
    pub(crate) limits: Limits,
    /// Typical size of every coefficient: half the range for the offset, the largest speed for the others.
    pub(crate) size: Vec<f64>,
    pub(crate) joints: Vec<JointBounds>,
}

impl BoundedSeries {
    /// With the limits at `n_samples` equal steps of the period.
    pub(crate) fn new(limits: &Limits, n_harmonics: usize, period: f64, n_samples: usize) -> Self {
        let mut size = Vec::new();
        for j in 0..limits.n_joints() {
            size.push(limits.half_range(j));
            size.resize(size.len() + 2 * n_harmonics, limits.velocity[j]);
        }
        let mut new = Self {
            period,
            n_harmonics,
            limits: limits.clone(),
            size,
            joints: vec![JointBounds::default(); limits.n_joints()],
        };
        let basis = FourierBasis::equispaced(period, n_harmonics, n_samples);
        for j in 0..limits.n_joints() {
            for kind in 0..3 {
                new.push(j, kind, &basis);
            }
        }
        new
    }

    /// Variables of a joint.
    pub(crate) fn width(&self) -> usize {
        2 * self.n_harmonics + 1
    }

    /// Adds the limits of one kind (position, velocity, acceleration) at more instants, s.
    pub(crate) fn add(&mut self, joint: usize, kind: usize, times: &[f64]) {
        let basis = FourierBasis::at(TAU / self.period, self.n_harmonics, times);
        self.push(joint, kind, &basis);
    }

    fn push(&mut self, joint: usize, kind: usize, basis: &FourierBasis) {
        let limits = &self.limits;
        let (bound, offset) = match kind {
            0 => {
                let half = limits.half_range(joint);
                (half, -limits.centre(joint) / half)
            }
            1 => (limits.velocity[joint], 0.0),
            _ => (limits.acceleration[joint], 0.0),
        };
        let width = basis.n_columns();
        let bounds = &mut self.joints[joint];
        for k in 0..basis.n_samples() {
            for c in 0..width {
                let column = match kind {
                    0 => basis.q_column(c),
                    1 => basis.qd_column(c),
                    _ => basis.qdd_column(c),
                };
                bounds
                    .rows
                    .push(column[k] * self.size[joint * width + c] / bound);
            }
            bounds.offset.push(offset);
        }
    }

    /// Adds the limits at every extremum of the motion that comes near one (above this fraction of the limit).
    pub(crate) fn add_extrema(&mut self, x: &[f64], near: f64) {
        let n_samples = SAMPLES_PER_HARMONIC * self.n_harmonics;
        let mut fine = Self::new(&self.limits, self.n_harmonics, self.period, n_samples).used(x);
        for (k, u) in fine.chunks_exact_mut(n_samples).enumerate() {
            let mut times = Vec::new();
            for i in 0..n_samples {
                let before = u[(i + n_samples - 1) % n_samples];
                let (here, after) = (u[i], u[(i + 1) % n_samples]);
                let top = here.abs() >= before.abs() && here.abs() > after.abs();
                if top && here.abs() > near {
                    // The top of the parabola through three samples.
                    let bend = before - 2.0 * here + after;
                    let shift = if bend == 0.0 {
                        0.0
                    } else {
                        0.5 * (before - after) / bend
                    };
                    times.push(self.period * (i as f64 + shift) / n_samples as f64);
                }
            }
            self.add(k / 3, k % 3, &times);
        }
    }

    /// The motion drawn towards the middle of the limits, joint by joint, until no row uses more than `largest`.
    pub(crate) fn draw_in(&self, x: &mut [f64], largest: f64) {
        let used = self.used(x);
        let mut used = used.iter();
        let w = self.width();
        for (j, (bounds, x)) in self.joints.iter().zip(x.chunks_exact_mut(w)).enumerate() {
            let most = used
                .by_ref()
                .take(bounds.offset.len())
                .fold(0.0_f64, |a, u| a.max(u.abs()));
            if most > largest {
                let factor = largest / most;
                let centre = self.limits.centre(j) / self.size[j * w];
                x[0] = centre + factor * (x[0] - centre);
                for x in &mut x[1..] {
                    *x *= factor;
                }
            }
        }
    }

    pub(crate) fn coefficients(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.size).map(|(x, s)| x * s).collect()
    }

    pub(crate) fn variables(&self, coefficients: &[f64]) -> Vec<f64> {
        coefficients
            .iter()
            .zip(&self.size)
            .map(|(c, s)| c / s)
            .collect()
    }

    /// Fraction of the limit used by every row, joint after joint.
    pub(crate) fn used(&self, x: &[f64]) -> Vec<f64> {
        let mut used = self.change(x);
        let offsets = self.joints.iter().flat_map(|j| &j.offset);
        for (u, o) in used.iter_mut().zip(offsets) {
            *u += o;
        }
        used
    }

    /// `row · x` of every row.
    pub(crate) fn change(&self, x: &[f64]) -> Vec<f64> {
        let w = self.width();
        let mut out = Vec::new();
        for (joint, x) in self.joints.iter().zip(x.chunks_exact(w)) {
            out.extend(
                joint
                    .rows
                    .chunks_exact(w)
                    .map(|row| row.iter().zip(x).map(|(r, x)| r * x).sum::<f64>()),
            );
        }
        out
    }

    /// Adds `Σ weight · row` to `out`.
    pub(crate) fn add_transpose(&self, weights: &[f64], out: &mut [f64]) {
        let w = self.width();
        let mut weights = weights.iter();
        for (joint, out) in self.joints.iter().zip(out.chunks_exact_mut(w)) {
            for (row, weight) in joint.rows.chunks_exact(w).zip(weights.by_ref()) {
                for (o, r) in out.iter_mut().zip(row) {
                    *o += weight * r;
                }
            }
        }
    }

    /// Adds `Σ weight · row rowᵀ` to the lower triangle of `out`, row by row, one block a joint.
    pub(crate) fn add_curvature(&self, weights: &[f64], out: &mut [f64]) {
        let w = self.width();
        let n = w * self.joints.len();
        let mut weights = weights.iter();
        for (j, joint) in self.joints.iter().enumerate() {
            let mut block = vec![0.0; w * w];
            for (row, weight) in joint.rows.chunks_exact(w).zip(weights.by_ref()) {
                for a in 0..w {
                    let factor = weight * row[a];
                    for (o, r) in block[a * w..=a * w + a].iter_mut().zip(row) {
                        *o += factor * r;
                    }
                }
            }
            for a in 0..w {
                let start = (j * w + a) * n + j * w;
                for b in 0..=a {
                    out[start + b] += block[a * w + b];
                }
            }
        }
    }
}
