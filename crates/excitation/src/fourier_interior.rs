//! Interior-point descent over the coefficients of a Fourier series, with a quasi-Newton model of the criterion.

use crate::dense::{cholesky, dot};
use crate::fourier_limits::BoundedSeries;
use crate::fourier_objective::FourierObjective;

/// Share of the way to a limit that a step may go.
const TO_BOUNDARY: f64 = 0.99;
/// Part of the slope a step must gain.
const ARMIJO: f64 = 1e-4;

pub(crate) struct Interior<'p, 'm> {
    pub(crate) bounds: BoundedSeries,
    pub(crate) objective: &'p mut FourierObjective<'m>,
    pub(crate) x: Vec<f64>,
    used: Vec<f64>,
    up: Vec<f64>,
    low: Vec<f64>,
    /// Model of the criterion's curvature, full, row by row.
    b: Vec<f64>,
    fresh: bool,
    pub(crate) f: f64,
    g: Vec<f64>,
    pub(crate) n_steps: usize,
}

impl<'p, 'm> Interior<'p, 'm> {
    pub(crate) fn new(
        bounds: BoundedSeries,
        objective: &'p mut FourierObjective<'m>,
        x: Vec<f64>,
        mu: f64,
    ) -> Self {
        let n = x.len();
        let mut b = vec![0.0; n * n];
        for i in 0..n {
            b[i * n + i] = 1.0;
        }
        let mut new = Self {
            bounds,
            objective,
            x,
            used: Vec::new(),
            up: Vec::new(),
            low: Vec::new(),
            b,
            fresh: true,
            f: 0.0,
            g: Vec::new(),
            n_steps: 0,
        };
        new.restart_multipliers(mu);
        new.evaluate();
        new
    }

    pub(crate) fn restart_multipliers(&mut self, mu: f64) {
        self.used = self.bounds.used(&self.x);
        self.up = self.used.iter().map(|u| mu / (1.0 - u)).collect();
        self.low = self.used.iter().map(|u| mu / (1.0 + u)).collect();
    }

    /// Adds the limits at the extrema of where the search stands, and draws it inside them.
    pub(crate) fn sharpen(&mut self, mu: f64) {
        let before: Vec<usize> = self.bounds.joints.iter().map(|j| j.offset.len()).collect();
        self.bounds.add_extrema(&self.x, 0.9);
        self.bounds.draw_in(&mut self.x, 1.0 - 1e-5);
        let old_up = std::mem::take(&mut self.up);
        let old_low = std::mem::take(&mut self.low);
        self.restart_multipliers(mu);
        let (mut from, mut to) = (0, 0);
        for (j, count) in before.iter().enumerate() {
            self.up[to..to + count].copy_from_slice(&old_up[from..from + count]);
            self.low[to..to + count].copy_from_slice(&old_low[from..from + count]);
            from += count;
            to += self.bounds.joints[j].offset.len();
        }
        self.evaluate();
    }

    /// After a change of the objective.
    pub(crate) fn evaluate(&mut self) {
        self.f = self.objective.value(&self.bounds.coefficients(&self.x));
        self.g = self.gradient();
    }

    fn gradient(&self) -> Vec<f64> {
        let mut g = self.objective.gradient();
        for (g, s) in g.iter_mut().zip(&self.bounds.size) {
            *g *= s;
        }
        g
    }

    fn barrier(used: &[f64]) -> f64 {
        // Products of slacks, to take one logarithm for many of them.
        let mut sum = 0.0;
        for chunk in used.chunks(16) {
            let product: f64 = chunk.iter().map(|u| (1.0 - u) * (1.0 + u)).product();
            sum -= product.ln();
        }
        sum
    }

    /// One step; the squared Newton decrement before it, and whether it could be made.
    pub(crate) fn step(&mut self, mu: f64) -> (f64, bool) {
        let n = self.x.len();
        self.n_steps += 1;
        let m = self.used.len();
        let mut h = self.b.clone();
        let mut weights = vec![0.0; m];
        let mut pull = vec![0.0; m];
        for i in 0..m {
            let (a, b) = (1.0 / (1.0 - self.used[i]), 1.0 / (1.0 + self.used[i]));
            weights[i] = self.up[i] * a + self.low[i] * b;
            pull[i] = mu * (a - b);
        }
        self.bounds.add_curvature(&weights, &mut h);
        let mut slope = self.g.clone();
        self.bounds.add_transpose(&pull, &mut slope);
        if !cholesky(&mut h, n) {
            return (f64::INFINITY, false);
        }
        let mut d: Vec<f64> = slope.iter().map(|s| -s).collect();
        solve(&h, n, &mut d);
        let descent = dot(&slope, &d);
        let du = self.bounds.change(&d);
        let (mut alpha, mut alpha_dual) = (1.0_f64, 1.0_f64);
        let mut dz = vec![(0.0, 0.0); m];
        for i in 0..m {
            let (u, du) = (self.used[i], du[i]);
            if du > 0.0 {
                alpha = alpha.min(TO_BOUNDARY * (1.0 - u) / du);
            } else if du < 0.0 {
                alpha = alpha.min(TO_BOUNDARY * (1.0 + u) / -du);
            }
            let up = mu / (1.0 - u) - self.up[i] + self.up[i] / (1.0 - u) * du;
            let low = mu / (1.0 + u) - self.low[i] - self.low[i] / (1.0 + u) * du;
            for (z, d) in [(self.up[i], up), (self.low[i], low)] {
                if d < 0.0 {
                    alpha_dual = alpha_dual.min(-TO_BOUNDARY * z / d);
                }
            }
            dz[i] = (up, low);
        }
        let start = self.f + mu * Self::barrier(&self.used);
        let mut accepted = None;
        for _ in 0..25 {
            let x: Vec<f64> = self.x.iter().zip(&d).map(|(x, d)| x + alpha * d).collect();
            let used: Vec<f64> = self
                .used
                .iter()
                .zip(&du)
                .map(|(u, d)| u + alpha * d)
                .collect();
            let f = self.objective.value(&self.bounds.coefficients(&x));
            if f + mu * Self::barrier(&used) <= start + ARMIJO * alpha * descent {
                accepted = Some((x, used, f));
                break;
            }
            alpha *= 0.5;
        }
        let Some((x, used, f)) = accepted else {
            // The objective's memory is of a rejected point.
            self.evaluate();
            return (-descent, false);
        };
        self.f = f;
        let old_g = std::mem::take(&mut self.g);
        self.g = self.gradient();
        let s: Vec<f64> = x.iter().zip(&self.x).map(|(a, b)| a - b).collect();
        let y: Vec<f64> = self.g.iter().zip(&old_g).map(|(a, b)| a - b).collect();
        self.update(&s, &y);
        self.x = x;
        self.used = used;
        for i in 0..m {
            let (a, b) = (mu / (1.0 - self.used[i]), mu / (1.0 + self.used[i]));
            self.up[i] = (self.up[i] + alpha_dual * dz[i].0).clamp(a * 1e-3, a * 1e3);
            self.low[i] = (self.low[i] + alpha_dual * dz[i].1).clamp(b * 1e-3, b * 1e3);
        }
        (-descent, true)
    }

    /// Damped BFGS (Powell 1978).
    fn update(&mut self, s: &[f64], y: &[f64]) {
        let n = s.len();
        let sy = dot(s, y);
        if self.fresh && sy > 0.0 {
            let gamma = dot(y, y) / sy;
            for i in 0..n {
                self.b[i * n + i] = gamma;
            }
            self.fresh = false;
        }
        let bs: Vec<f64> = self.b.chunks_exact(n).map(|r| dot(r, s)).collect();
        let sbs = dot(s, &bs);
        if sbs <= 0.0 {
            return;
        }
        let theta = if sy >= 0.2 * sbs {
            1.0
        } else {
            0.8 * sbs / (sbs - sy)
        };
        let r: Vec<f64> = y
            .iter()
            .zip(&bs)
            .map(|(y, b)| theta * y + (1.0 - theta) * b)
            .collect();
        let sr = dot(s, &r);
        for i in 0..n {
            let (p, q) = (r[i] / sr, bs[i] / sbs);
            let row = &mut self.b[i * n..(i + 1) * n];
            for j in 0..n {
                row[j] += p * r[j] - q * bs[j];
            }
        }
    }
}

/// `L Lᵀ x = b` in place.
fn solve(l: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        b[i] = (b[i] - dot(&l[i * n..i * n + i], &b[..i])) / l[i * n + i];
    }
    for i in (0..n).rev() {
        b[i] /= l[i * n + i];
        let v = b[i];
        for (x, l) in b[..i].iter_mut().zip(&l[i * n..i * n + i]) {
            *x -= v * l;
        }
    }
}
