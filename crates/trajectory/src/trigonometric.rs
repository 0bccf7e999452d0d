//! Extrema of trigonometric polynomials, found with a guarantee.

use std::f64::consts::{PI, TAU};

/// `p(θ) = mean + Σ cos_l cos(l θ) + sin_l sin(l θ)`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrigonometricPolynomial {
    pub(crate) mean: f64,
    pub(crate) cos: Vec<f64>,
    pub(crate) sin: Vec<f64>,
}

/// A largest value, where it is, and a bound that no value exceeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Maximum {
    pub(crate) value: f64,
    pub(crate) theta: f64,
    pub(crate) bound: f64,
}

/// Samples per harmonic the search starts from; more only makes the first pass longer.
const SAMPLES_PER_HARMONIC: usize = 16;
/// The bound is this close to the value, relative to the amplitude: some hundred times the rounding of a sum of
/// harmonics, far below what any drive resolves.
const BOUND_TOLERANCE: f64 = 1e-13;
/// Halvings of the first intervals; 2^-30 of them is below what the tolerance asks of any curvature.
const MAX_DEPTH: usize = 30;

impl TrigonometricPolynomial {
    /// Largest value over the circle, with a bound on what may have been missed.
    ///
    /// Branch and bound: between two points h apart p exceeds the larger end by at most `h²/8 · max(−p'')`, and p''
    /// itself is bounded the same way by its ends and the sum of its fourth-derivative coefficients.
    pub(crate) fn maximum(&self) -> Maximum {
        let n = self.cos.len();
        let amplitude: f64 = self.sum_of_magnitudes(0);
        let fourth = self.sum_of_magnitudes(4);
        let tolerance = BOUND_TOLERANCE * (amplitude + self.mean.abs());
        let n_intervals = SAMPLES_PER_HARMONIC * n;
        let point = |theta: f64| {
            let [p, _, p2] = self.derivatives(theta);
            Point { theta, p, p2 }
        };
        let mut h = TAU / n_intervals as f64;
        let points: Vec<_> = (0..=n_intervals).map(|k| point(k as f64 * h)).collect();
        let mut best = points[0];
        for p in &points {
            best = if p.p > best.p { *p } else { best };
        }
        best = self.polish(best);
        let mut open: Vec<_> = points.windows(2).map(|w| (w[0], w[1])).collect();
        let mut bound = best.p;
        for depth in 0..=MAX_DEPTH {
            let excess = |(a, b): &(Point, Point)| {
                let curvature = (-a.p2.min(b.p2) + fourth * h * h / 8.0).max(0.0);
                a.p.max(b.p) + curvature * h * h / 8.0
            };
            open.retain(|i| excess(i) > best.p + tolerance);
            if open.is_empty() {
                break;
            }
            if depth == MAX_DEPTH {
                bound = open.iter().map(excess).fold(bound, f64::max);
                break;
            }
            h *= 0.5;
            let mut halves = Vec::with_capacity(2 * open.len());
            for (a, b) in open {
                let middle = point(f64::midpoint(a.theta, b.theta));
                best = if middle.p > best.p { middle } else { best };
                halves.push((a, middle));
                halves.push((middle, b));
            }
            open = halves;
        }
        best = self.polish(best);
        Maximum {
            value: best.p,
            theta: best.theta.rem_euclid(TAU),
            bound: bound.max(best.p) + tolerance,
        }
    }

    /// Value, first and second derivative.
    pub(crate) fn derivatives(&self, theta: f64) -> [f64; 3] {
        let (sin, cos) = theta.sin_cos();
        let [mut p, mut p1, mut p2] = [self.mean, 0.0, 0.0];
        let (mut s, mut c) = (sin, cos);
        for (i, (x, y)) in self.cos.iter().zip(&self.sin).enumerate() {
            let l = (i + 1) as f64;
            let value = x * c + y * s;
            p += value;
            p1 += l * (y * c - x * s);
            p2 -= l * l * value;
            (s, c) = (s * cos + c * sin, c * cos - s * sin);
        }
        [p, p1, p2]
    }

    /// `−p`.
    pub(crate) fn negated(&self) -> Self {
        Self {
            mean: -self.mean,
            cos: self.cos.iter().map(|v| -v).collect(),
            sin: self.sin.iter().map(|v| -v).collect(),
        }
    }

    /// `p` at `n` equal steps of the circle, the largest magnitude of `p − centre`.
    pub(crate) fn largest_sample(&self, centre: f64, n: usize) -> f64 {
        let step = TAU / n as f64;
        (0..n)
            .map(|k| (self.derivatives(k as f64 * step)[0] - centre).abs())
            .fold(0.0, f64::max)
    }

    /// Newton steps towards the top beside `start`; keeps the start where they lead down.
    fn polish(&self, start: Point) -> Point {
        let mut best = start;
        for _ in 0..4 {
            let [_, p1, p2] = self.derivatives(best.theta);
            if p2 >= 0.0 {
                break;
            }
            let theta = best.theta - p1 / p2;
            let [p, _, p2] = self.derivatives(theta);
            if p >= best.p {
                best = Point { theta, p, p2 };
            } else {
                break;
            }
        }
        best
    }

    /// `Σ l^order √(cos_l² + sin_l²)`: no value of that derivative is larger (the mean left out).
    fn sum_of_magnitudes(&self, order: i32) -> f64 {
        let terms = self.cos.iter().zip(&self.sin).enumerate();
        terms
            .map(|(i, (x, y))| ((i + 1) as f64).powi(order) * x.hypot(*y))
            .sum()
    }
}

#[derive(Clone, Copy)]
struct Point {
    theta: f64,
    p: f64,
    p2: f64,
}

/// `cos(π N / M)`: for a trigonometric polynomial of degree N and M > 2 N equal steps over the period,
/// `max |p| ≤ max_k |p(t_k)| / cos(π N / M)`.
///
/// Source: Ehlich & Zeller 1964.
///
/// # Panics
/// Unless `n_samples > 2 * n_harmonics`: fewer samples bound nothing.
#[track_caller]
pub fn sampling_factor(n_harmonics: usize, n_samples: usize) -> f64 {
    assert!(
        n_samples > 2 * n_harmonics,
        "{n_samples} samples bound no polynomial of degree {n_harmonics}: more than twice the degree are needed"
    );
    (PI * n_harmonics as f64 / n_samples as f64).cos()
}
