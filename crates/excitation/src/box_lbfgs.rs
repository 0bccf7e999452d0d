//! Limited-memory quasi-Newton minimisation in a box.
//!
//! Variables held at a bound by the gradient stand still; the others move along a two-loop L-BFGS direction built from
//! what is free, and the path is bent back into the box (projected Armijo search).

use crate::dense::dot;

/// How a minimisation runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BoxOptions {
    /// Pairs of steps and gradient changes remembered. Typical 20.
    pub(crate) memory: usize,
    /// Iterations at most.
    pub(crate) max_iterations: usize,
    /// Stops when [`PATIENCE`] iterations together lower the objective by less than this.
    pub(crate) tolerance: f64,
}

/// Iterations whose common progress decides on stopping.
const PATIENCE: usize = 20;
/// Share of the decrease promised by the gradient that a step must bring (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// Shortenings of a step before the direction is given up.
const MAX_BACKTRACKS: usize = 25;
/// First step, as a share of the box, of the variable that moves most.
const FIRST_STEP: f64 = 0.1;
/// Smallest cosine between step and change of gradient that counts as curvature.
const LEAST_CURVATURE: f64 = 1e-10;

/// Lowers `objective(x, gradient) -> value` from `x` within `[-1, 1]` of each variable; returns the value reached.
///
/// A value that is not finite is worse than any other; at the start it must be finite.
pub(crate) fn minimise_in_box(
    mut objective: impl FnMut(&[f64], &mut [f64]) -> f64,
    x: &mut [f64],
    options: &BoxOptions,
) -> f64 {
    let n = x.len();
    let mut gradient = vec![0.0; n];
    let mut value = objective(x, &mut gradient);
    let mut memory = Memory::new(n, options.memory);
    let (mut trial, mut trial_gradient) = (vec![0.0; n], vec![0.0; n]);
    let (mut direction, mut free) = (vec![0.0; n], vec![0.0; n]);
    let mut recent = [f64::INFINITY; PATIENCE];
    for iteration in 0..options.max_iterations {
        let oldest = std::mem::replace(&mut recent[iteration % PATIENCE], value);
        if oldest - value < options.tolerance {
            break;
        }
        for i in 0..n {
            let held = (x[i] <= -1.0 && gradient[i] > 0.0) || (x[i] >= 1.0 && gradient[i] < 0.0);
            free[i] = if held { 0.0 } else { 1.0 };
        }
        memory.direction(&gradient, &free, &mut direction);
        if dot(&direction, &gradient) >= 0.0 {
            memory.clear();
            memory.direction(&gradient, &free, &mut direction);
        }
        let mut t = 1.0;
        let mut accepted = false;
        for _ in 0..MAX_BACKTRACKS {
            let mut promised = 0.0;
            for i in 0..n {
                trial[i] = (x[i] + t * direction[i]).clamp(-1.0, 1.0);
                promised += gradient[i] * (trial[i] - x[i]);
            }
            let trial_value = objective(&trial, &mut trial_gradient);
            accepted = trial_value <= value + SUFFICIENT * promised;
            if accepted {
                memory.push(x, &trial, &gradient, &trial_gradient);
                value = trial_value;
                break;
            }
            let quadratic = -0.5 * promised / (trial_value - value - promised);
            t *= if quadratic.is_finite() {
                quadratic.clamp(0.1, 0.5)
            } else {
                0.2
            };
        }
        if accepted {
            x.copy_from_slice(&trial);
            std::mem::swap(&mut gradient, &mut trial_gradient);
        } else if memory.is_empty() {
            break;
        } else {
            memory.clear();
            recent.fill(f64::INFINITY);
        }
    }
    value
}

/// The last steps and changes of the gradient, oldest first.
struct Memory {
    capacity: usize,
    steps: Vec<Vec<f64>>,
    changes: Vec<Vec<f64>>,
    /// Scratch: curvature over the free variables and coefficient of each pair.
    curvature: Vec<f64>,
    alpha: Vec<f64>,
    n: usize,
}

impl Memory {
    fn new(n: usize, capacity: usize) -> Self {
        Self {
            capacity,
            steps: Vec::with_capacity(capacity),
            changes: Vec::with_capacity(capacity),
            curvature: vec![0.0; capacity],
            alpha: vec![0.0; capacity],
            n,
        }
    }

    fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    fn clear(&mut self) {
        self.steps.clear();
        self.changes.clear();
    }

    fn push(&mut self, x: &[f64], to: &[f64], gradient: &[f64], to_gradient: &[f64]) {
        let (mut step, mut change) = if self.steps.len() == self.capacity {
            (self.steps.remove(0), self.changes.remove(0))
        } else {
            (vec![0.0; self.n], vec![0.0; self.n])
        };
        for i in 0..self.n {
            step[i] = to[i] - x[i];
            change[i] = to_gradient[i] - gradient[i];
        }
        self.steps.push(step);
        self.changes.push(change);
    }

    /// `-H g` over the free variables (mask of ones), zero elsewhere; a first step of sensible length without pairs.
    fn direction(&mut self, gradient: &[f64], free: &[f64], d: &mut [f64]) {
        for i in 0..self.n {
            d[i] = free[i] * gradient[i];
        }
        if self.is_empty() {
            let largest = d.iter().fold(f64::MIN_POSITIVE, |a, d| a.max(d.abs()));
            let scale = -(FIRST_STEP / largest).min(1.0);
            for d in d.iter_mut() {
                *d *= scale;
            }
            return;
        }
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || self.two_loops(free, d),
        );
    }

    /// Pairs whose curvature over the free variables is not positive are left out.
    #[inline(always)]
    fn two_loops(&mut self, free: &[f64], d: &mut [f64]) {
        let mut scale = None;
        for k in (0..self.steps.len()).rev() {
            let (s, y) = (&self.steps[k], &self.changes[k]);
            let [sy, ss, yy] = masked_products(s, y, free);
            self.curvature[k] = 0.0;
            if sy > LEAST_CURVATURE * (ss * yy).sqrt() {
                self.curvature[k] = sy;
                scale.get_or_insert(sy / yy);
                self.alpha[k] = dot(s, d) / sy;
                add_masked(d, -self.alpha[k], y, free);
            }
        }
        let scale = scale.unwrap_or(1.0);
        for d in d.iter_mut() {
            *d *= scale;
        }
        for k in 0..self.steps.len() {
            if self.curvature[k] > 0.0 {
                let beta = dot(&self.changes[k], d) / self.curvature[k];
                add_masked(d, self.alpha[k] - beta, &self.steps[k], free);
            }
        }
        for d in d.iter_mut() {
            *d = -*d;
        }
    }
}

/// `s·y`, `s·s`, `y·y` over the free variables, in fixed lanes.
#[inline(always)]
fn masked_products(s: &[f64], y: &[f64], free: &[f64]) -> [f64; 3] {
    let mut lanes = [[0.0; 8]; 3];
    let n = s.len();
    for block in 0..n / 8 {
        for k in 0..8 {
            let i = 8 * block + k;
            let (a, b) = (free[i] * s[i], free[i] * y[i]);
            lanes[0][k] += a * b;
            lanes[1][k] += a * a;
            lanes[2][k] += b * b;
        }
    }
    for i in n - n % 8..n {
        let (a, b) = (free[i] * s[i], free[i] * y[i]);
        lanes[0][0] += a * b;
        lanes[1][0] += a * a;
        lanes[2][0] += b * b;
    }
    lanes.map(|l| l.iter().sum())
}

#[inline(always)]
fn add_masked(x: &mut [f64], factor: f64, y: &[f64], free: &[f64]) {
    for ((x, y), f) in x.iter_mut().zip(y).zip(free) {
        *x += factor * f * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const OPTIONS: BoxOptions = BoxOptions {
        memory: 10,
        max_iterations: 2000,
        tolerance: 1e-13,
    };

    proptest! {
        /// A separable quadratic: each variable goes to its own minimum or to the bound before it.
        #[test]
        fn identity_box_constrained_quadratic(
            minimum in prop::collection::vec(-2.0..2.0_f64, 3..20),
            curvature in prop::collection::vec(0.1..10.0_f64, 20),
        ) {
            let n = minimum.len();
            let mut x = vec![0.0; n];
            minimise_in_box(
                |x, g| {
                    for i in 0..n {
                        g[i] = curvature[i] * (x[i] - minimum[i]);
                    }
                    (0..n).map(|i| 0.5 * curvature[i] * (x[i] - minimum[i]).powi(2)).sum()
                },
                &mut x,
                &OPTIONS,
            );
            for i in 0..n {
                // The value is stationary to 1e-13, the variable to its root.
                prop_assert!((x[i] - minimum[i].clamp(-1.0, 1.0)).abs() < 1e-5, "{x:?} {minimum:?}");
            }
        }
    }

    #[test]
    fn oracle_rosenbrock_in_and_on_the_box() {
        let mut rosenbrock = |x: &[f64], g: &mut [f64]| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            g[0] = -2.0 * a - 400.0 * x[0] * b;
            g[1] = 200.0 * b;
            a * a + 100.0 * b * b
        };
        let mut x = [-0.9, 0.9];
        let value = minimise_in_box(&mut rosenbrock, &mut x, &OPTIONS);
        assert!(value < 1e-9 && (x[0] - 1.0).abs() < 1e-4, "{x:?} {value}");
    }

    #[test]
    fn regress_values_that_are_not_finite_are_stepped_back_from() {
        // -log(0.5 - x): infinite beyond 0.5, where the first steps lead.
        let mut x = [-1.0];
        let value = minimise_in_box(
            |x, g| {
                g[0] = if x[0] < 0.5 {
                    1.0 / (0.5 - x[0]) - 4.0
                } else {
                    0.0
                };
                if x[0] < 0.5 {
                    -(0.5 - x[0]).ln() - 4.0 * x[0]
                } else {
                    f64::INFINITY
                }
            },
            &mut x,
            &OPTIONS,
        );
        assert!(
            (x[0] - 0.25).abs() < 1e-5 && value.is_finite(),
            "{x:?} {value}"
        );
    }
}
