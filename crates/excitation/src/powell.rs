//! Powell's method of conjugate directions without derivatives (Powell 1964; VA04AD of the Harwell library).

/// How Powell's method runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowellOptions {
    /// First step along every coordinate, in the units of `x`. Typical 0.1 for angles of a substitution.
    pub first_step: f64,
    /// Longest step of one trial along a direction, as a multiple of `first_step`. Typical 10.
    pub longest_step: f64,
    /// Stops when an iteration moves no coordinate by more than this. Typical 1e-4.
    pub accuracy: f64,
    /// Stops after this many evaluations. Typical 300 a variable.
    pub max_evaluations: usize,
}

impl Default for PowellOptions {
    fn default() -> Self {
        Self {
            first_step: 0.1,
            longest_step: 10.0,
            accuracy: 1e-4,
            max_evaluations: 50_000,
        }
    }
}

/// Where Powell's method stopped.
#[derive(Debug, Clone, PartialEq)]
pub struct PowellOutcome {
    /// Best point found.
    pub x: Vec<f64>,
    /// Objective there.
    pub value: f64,
    /// Evaluations used.
    pub n_evaluations: usize,
    /// Iterations, one line search a direction each.
    pub n_iterations: usize,
    /// Whether the accuracy was reached; `false` when the evaluations ran out.
    pub converged: bool,
}

/// Lowers `objective` from `start` along directions that become conjugate.
///
/// Exact on a quadratic form of `n` variables after `n` iterations. A value that is not finite counts as worse than
/// any other; the objective at `start` must be finite.
///
/// # Panics
/// If `start` is empty or the objective is not finite there.
#[track_caller]
pub fn powell(
    objective: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    options: &PowellOptions,
) -> PowellOutcome {
    let n = start.len();
    assert!(n > 0, "no variable to move");
    let mut search = Search {
        objective,
        trial: start.to_vec(),
        n_evaluations: 0,
        options: *options,
    };
    let mut x = start.to_vec();
    let mut value = search.at(&x, &[], 0.0);
    assert!(value.is_finite(), "the objective at the start is {value}");
    let mut directions: Vec<Direction> = (0..n)
        .map(|k| {
            let mut step = vec![0.0; n];
            step[k] = options.first_step;
            Direction {
                step,
                curvature: None,
            }
        })
        .collect();
    let (mut n_iterations, mut converged) = (0, false);
    while !converged && search.n_evaluations < options.max_evaluations {
        n_iterations += 1;
        let (before, value_before) = (x.clone(), value);
        let (mut steepest, mut largest_drop) = (0, 0.0);
        for (k, direction) in directions.iter_mut().enumerate() {
            let last = value;
            value = search.along(&mut x, value, direction);
            if last - value > largest_drop {
                (steepest, largest_drop) = (k, last - value);
            }
        }
        let travel: Vec<f64> = x.iter().zip(&before).map(|(a, b)| a - b).collect();
        converged = largest(&travel) <= options.accuracy;
        if !converged {
            let beyond = search.at(&x, &travel, 1.0);
            if worth_replacing(value_before, value, beyond, largest_drop) {
                let mut new = Direction {
                    step: travel,
                    curvature: None,
                };
                value = search.along(&mut x, value, &mut new);
                directions.remove(steepest);
                directions.push(new);
            }
        }
    }
    PowellOutcome {
        x,
        value,
        n_evaluations: search.n_evaluations,
        n_iterations,
        converged,
    }
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a, v| a.max(v.abs()))
}

/// Powell's test (his step 3): `f₁` before, `f₂` after, `f₃` as far again, `Δ` the largest drop of one direction.
fn worth_replacing(f1: f64, f2: f64, f3: f64, drop: f64) -> bool {
    if !f3.is_finite() || f3 >= f1 {
        return false;
    }
    (f1 - 2.0 * f2 + f3) * (f1 - f2 - drop).powi(2) < 0.5 * drop * (f1 - f3).powi(2)
}

/// A direction with its step (length one along it) and the second derivative met last time.
struct Direction {
    step: Vec<f64>,
    curvature: Option<f64>,
}

struct Search<F> {
    objective: F,
    trial: Vec<f64>,
    n_evaluations: usize,
    options: PowellOptions,
}

/// Accepts a predicted minimum this close (in steps) to a point already evaluated.
const CLOSE: f64 = 0.03;
/// A step shrinks to this share of itself at most, and grows by its inverse, from one search to the next.
const SHRINK: f64 = 0.5;
/// Interpolations a line search may take; more precision is lost on the next direction.
const MAX_INTERPOLATIONS: usize = 4;

impl<F: FnMut(&[f64]) -> f64> Search<F> {
    fn at(&mut self, x: &[f64], step: &[f64], t: f64) -> f64 {
        self.trial.copy_from_slice(x);
        for (a, s) in self.trial.iter_mut().zip(step) {
            *a += t * s;
        }
        self.n_evaluations += 1;
        let value = (self.objective)(&self.trial);
        if value.is_nan() { f64::INFINITY } else { value }
    }

    /// Minimum along a direction by quadratic interpolation; moves `x` and returns the value there.
    fn along(&mut self, x: &mut [f64], value: f64, direction: &mut Direction) -> f64 {
        let longest = self.options.longest_step;
        let step = &direction.step;
        // Three points (t, f) kept sorted by f: the best first.
        let mut points = vec![(0.0, value), (1.0, self.at(x, step, 1.0))];
        let known = direction.curvature.filter(|_| points[1].1.is_finite());
        let third = if let Some(c) = known {
            // f = value + s t + ½ c t² through both points, minimum at -s / c.
            let slope = points[1].1 - value - 0.5 * c;
            (-slope / c).clamp(-longest, longest)
        } else if points[1].1 < value {
            2.0
        } else {
            -1.0
        };
        // The prediction itself is taken to the full accuracy: a search that does not move must be at its minimum.
        let tight = CLOSE.min(self.options.accuracy / largest(step));
        if third.abs() > tight && (third - 1.0).abs() > tight {
            points.push((third, self.at(x, step, third)));
            for _ in 0..MAX_INTERPOLATIONS {
                points.sort_by(|a, b| a.1.total_cmp(&b.1));
                points.truncate(3);
                let Some(t) = next_trial(&points, longest, &mut direction.curvature) else {
                    break;
                };
                points.push((t, self.at(x, &direction.step, t)));
            }
        }
        let best = points
            .iter()
            .fold((0.0, value), |a, &b| if b.1 < a.1 { b } else { a });
        for (a, s) in x.iter_mut().zip(&direction.step) {
            *a += best.0 * s;
        }
        direction.rescale(
            best.0.abs().clamp(SHRINK, 1.0 / SHRINK),
            self.options.accuracy,
        );
        best.1
    }
}

impl Direction {
    /// Makes the next first trial as long as the last move, within a factor, and no shorter than the accuracy.
    fn rescale(&mut self, factor: f64, accuracy: f64) {
        let factor = factor.max(accuracy / largest(&self.step));
        self.step.iter_mut().for_each(|s| *s *= factor);
        self.curvature = self.curvature.map(|c| c * factor * factor);
    }
}

/// Where to look next given three points, best first; `None` when the best is close enough to the minimum.
fn next_trial(points: &[(f64, f64)], longest: f64, curvature: &mut Option<f64>) -> Option<f64> {
    let [(a, fa), (b, fb), (c, fc)] = [points[0], points[1], points[2]];
    if !fc.is_finite() {
        // A point off the domain of the objective: come back towards the best.
        let outside = if fb.is_finite() { c } else { b };
        return Some(a + 0.25 * (outside - a));
    }
    let second = 2.0 * ((fb - fa) / (b - a) - (fc - fa) / (c - a)) / (b - c);
    if second > 0.0 && second.is_finite() {
        *curvature = Some(second);
        let slope = (fb - fa) / (b - a) - 0.5 * second * (b - a);
        let t = (a - slope / second).clamp(a - longest, a + longest);
        let seen = points.iter().any(|p| (p.0 - t).abs() <= CLOSE);
        return (!seen).then_some(t);
    }
    // A maximum: on past the best, away from the others.
    let others = 0.5 * (b + c);
    let away = if a >= others { 1.0 } else { -1.0 };
    let stride = 2.0 * (a - b).abs().max((a - c).abs());
    (stride < longest).then_some(a + away * stride)
}
