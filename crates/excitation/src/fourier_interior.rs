//! Interior-point descent over the variables of a Fourier series: exact gradients, a learned model of the criterion's
//! curvature, logarithmic barriers of the limits with multipliers of their own.

use crate::dense::{cholesky, dot};
use crate::fourier_curvature::{LearnedCurvature, add_bound_curvature};
use crate::fourier_limits::Bounds;
use crate::fourier_objective::FourierObjective;

/// Share of the way to a limit that a step may go.
const TO_BOUNDARY: f64 = 0.99;
/// Part of the slope a step must gain.
const ARMIJO: f64 = 1e-4;
/// Halvings of a step before it counts as impossible: 2^-25 of it moves nothing any more.
const MAX_HALVINGS: usize = 25;
/// How far a multiplier may stray from `barrier / slack`, as a factor.
const MULTIPLIER_RANGE: f64 = 1e3;
/// After limits were added the motion stands this fraction inside them.
const ROOM: f64 = 1e-5;
/// Extrema using more of a limit than this are imposed.
const NEAR: f64 = 0.9;

/// What a step did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// Squared length of the Newton step in its own metric: twice what it was expected to gain.
    pub(crate) decrement: f64,
    /// Whether a lower point was found.
    pub(crate) moved: bool,
}

pub(crate) struct Interior<'p, 'm> {
    pub(crate) bounds: Bounds,
    fine: Bounds,
    pub(crate) objective: &'p mut FourierObjective<'m>,
    pub(crate) x: Vec<f64>,
    /// Fraction of the limit used by every bound.
    used: Vec<f64>,
    /// Multipliers of `used < 1` and of `-1 < used`.
    up: Vec<f64>,
    low: Vec<f64>,
    curvature: LearnedCurvature,
    value: f64,
    gradient: Vec<f64>,
}

impl<'p, 'm> Interior<'p, 'm> {
    /// Starts from `x`, drawn in to use at most `largest_use` of the limits.
    pub(crate) fn new(
        bounds: Bounds,
        objective: &'p mut FourierObjective<'m>,
        x: Vec<f64>,
        largest_use: f64,
        barrier: f64,
    ) -> Self {
        let fine = bounds.fine();
        let mut new = Self {
            curvature: LearnedCurvature::new(x.len()),
            bounds,
            fine,
            objective,
            x,
            used: Vec::new(),
            up: Vec::new(),
            low: Vec::new(),
            value: f64::INFINITY,
            gradient: Vec::new(),
        };
        new.fine.draw_in(&mut new.x, largest_use);
        new.bounds.draw_in(&mut new.x, largest_use);
        new.restart_multipliers(barrier);
        new.evaluate();
        new
    }

    fn restart_multipliers(&mut self, barrier: f64) {
        self.used = self.bounds.used(&self.x);
        self.up = self.used.iter().map(|u| barrier / (1.0 - u)).collect();
        self.low = self.used.iter().map(|u| barrier / (1.0 + u)).collect();
    }

    /// Imposes the limits at the extrema of where the search stands, and draws it inside them.
    pub(crate) fn sharpen(&mut self, barrier: f64) {
        let before: Vec<usize> = self.bounds.joints.iter().map(|j| j.offset.len()).collect();
        self.bounds.add_extrema(&self.fine, &self.x, NEAR);
        self.bounds.draw_in(&mut self.x, 1.0 - ROOM);
        let old_up = std::mem::take(&mut self.up);
        let old_low = std::mem::take(&mut self.low);
        self.restart_multipliers(barrier);
        let (mut from, mut to) = (0, 0);
        for (j, count) in before.iter().enumerate() {
            self.up[to..to + count].copy_from_slice(&old_up[from..from + count]);
            self.low[to..to + count].copy_from_slice(&old_low[from..from + count]);
            from += count;
            to += self.bounds.joints[j].offset.len();
        }
        self.evaluate();
    }

    /// After a change of the objective or of the place.
    pub(crate) fn evaluate(&mut self) {
        self.value = self
            .objective
            .value(&self.bounds.chart.coefficients(&self.x));
        self.gradient = self.gradient_here();
    }

    fn gradient_here(&mut self) -> Vec<f64> {
        self.bounds.chart.pull_back(&self.objective.gradient())
    }

    /// One step for this weight of the barrier.
    pub(crate) fn step(&mut self, barrier: f64) -> Step {
        let Some((direction, descent)) = self.direction(barrier) else {
            return Step {
                decrement: f64::INFINITY,
                moved: false,
            };
        };
        let change = self.bounds.change(&direction);
        let (largest, largest_dual, multiplier_steps) = self.largest_steps(&change, barrier);
        let start = self.value + barrier * log_barrier(&self.used);
        let mut length = largest;
        for _ in 0..MAX_HALVINGS {
            let x = moved(&self.x, length, &direction);
            let used = moved(&self.used, length, &change);
            let value = self.objective.value(&self.bounds.chart.coefficients(&x));
            if value + barrier * log_barrier(&used) <= start + ARMIJO * length * descent {
                let old = std::mem::take(&mut self.gradient);
                (self.value, self.used) = (value, used);
                self.gradient = self.gradient_here();
                self.curvature
                    .learn(&difference(&x, &self.x), &difference(&self.gradient, &old));
                self.x = x;
                self.move_multipliers(largest_dual, &multiplier_steps, barrier);
                return Step {
                    decrement: -descent,
                    moved: true,
                };
            }
            length *= 0.5;
        }
        // The objective remembers a rejected place.
        self.evaluate();
        Step {
            decrement: -descent,
            moved: false,
        }
    }

    /// Newton direction of the barrier problem and the slope along it; `None` where rounding left no descent.
    fn direction(&self, barrier: f64) -> Option<(Vec<f64>, f64)> {
        pulp::Arch::new().dispatch(Newton {
            gradient: &self.gradient,
            curvature: self.curvature.matrix(),
            bounds: &self.bounds,
            used: &self.used,
            multipliers: [&self.up, &self.low],
            barrier,
        })
    }

    /// Longest steps of the motion and of the multipliers that keep all slacks, and the steps of the multipliers.
    fn largest_steps(&self, change: &[f64], barrier: f64) -> (f64, f64, Vec<[f64; 2]>) {
        let (mut length, mut dual) = (1.0_f64, 1.0_f64);
        let mut steps = Vec::with_capacity(change.len());
        for (i, &du) in change.iter().enumerate() {
            let (a, b) = (1.0 / (1.0 - self.used[i]), 1.0 / (1.0 + self.used[i]));
            // The fastest approach to either limit, as the inverse of the steps it takes.
            let approach = (du * a).max(-du * b);
            if approach * length > TO_BOUNDARY {
                length = TO_BOUNDARY / approach;
            }
            let up = barrier * a - self.up[i] + self.up[i] * a * du;
            let low = barrier * b - self.low[i] - self.low[i] * b * du;
            for (z, dz) in [(self.up[i], up), (self.low[i], low)] {
                if -dz * dual > TO_BOUNDARY * z {
                    dual = TO_BOUNDARY * z / -dz;
                }
            }
            steps.push([up, low]);
        }
        (length, dual, steps)
    }

    fn move_multipliers(&mut self, length: f64, steps: &[[f64; 2]], barrier: f64) {
        for (i, [up, low]) in steps.iter().enumerate() {
            let a = barrier / (1.0 - self.used[i]);
            let b = barrier / (1.0 + self.used[i]);
            let range = |z: f64, m: f64| z.clamp(m / MULTIPLIER_RANGE, m * MULTIPLIER_RANGE);
            self.up[i] = range(self.up[i] + length * up, a);
            self.low[i] = range(self.low[i] + length * low, b);
        }
    }
}

/// The Newton direction of a barrier problem, dispatched to the widest registers of the machine.
struct Newton<'a> {
    gradient: &'a [f64],
    curvature: &'a [f64],
    bounds: &'a Bounds,
    used: &'a [f64],
    multipliers: [&'a [f64]; 2],
    barrier: f64,
}

impl pulp::WithSimd for Newton<'_> {
    type Output = Option<(Vec<f64>, f64)>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> Self::Output {
        let n = self.gradient.len();
        let mut slope = self.gradient.to_vec();
        let mut h = self.curvature.to_vec();
        self.add_barrier(simd, &mut slope, &mut h);
        let mut direction: Vec<f64> = slope.iter().map(|s| -s).collect();
        if !cholesky(&mut h, n) {
            return None;
        }
        solve(&h, n, &mut direction);
        let descent = dot(&slope, &direction);
        (descent < 0.0).then_some((direction, descent))
    }
}

impl Newton<'_> {
    /// Adds the barrier's gradient to `slope` and its primal-dual curvature to the lower triangle of `h`.
    #[inline(always)]
    fn add_barrier<S: pulp::Simd>(&self, simd: S, slope: &mut [f64], h: &mut [f64]) {
        let n = slope.len();
        let width = self.bounds.chart.width();
        let [up, low] = self.multipliers;
        let (mut weights, mut pull, mut scratch) = (Vec::new(), Vec::new(), Vec::new());
        let mut from = 0;
        for (j, bounds) in self.bounds.joints.iter().enumerate() {
            let count = bounds.offset.len();
            let here = from..from + count;
            from += count;
            weights.resize(count, 0.0);
            pull.resize(count, 0.0);
            let (used, up, low) = (&self.used[here.clone()], &up[here.clone()], &low[here]);
            for i in 0..count {
                let (a, b) = (1.0 / (1.0 - used[i]), 1.0 / (1.0 + used[i]));
                weights[i] = up[i] * a + low[i] * b;
                pull[i] = self.barrier * (a - b);
            }
            for (s, column) in slope[j * width..].iter_mut().zip(&bounds.columns) {
                *s += dot(&pull, column);
            }
            let place = (j * width, n);
            add_bound_curvature(simd, bounds, &weights, &mut scratch, place, h);
        }
    }
}

/// `-Σ log((1 - u) (1 + u))`; a product of many factors at a time, to take one logarithm for them.
fn log_barrier(used: &[f64]) -> f64 {
    let mut sum = 0.0;
    for chunk in used.chunks(16) {
        let product: f64 = chunk.iter().map(|u| (1.0 - u) * (1.0 + u)).product();
        sum -= product.ln();
    }
    sum
}

fn moved(x: &[f64], length: f64, direction: &[f64]) -> Vec<f64> {
    x.iter()
        .zip(direction)
        .map(|(x, d)| x + length * d)
        .collect()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// `L Lᵀ x = b` in place.
#[inline(always)]
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
