//! A criterion of chained points as a smooth function on a box, with its exact gradient.

use crate::criterion::{Criterion, Scaling};
use crate::point_rows::PointRows;
use crate::schatten::SchattenCondition;
use crate::spectrum::SmoothCriterion;
use crate::{EnergyDesign, padded};
use faer::MatRef;

/// The function an optimiser lowers: `x` in `[-1, 1]` of every design variable to the logarithm of the criterion,
/// plus what the entries of `W` may not be.
#[derive(Debug, Clone)]
pub(crate) struct PointObjective<'a> {
    rows: PointRows<'a>,
    smooth: Smooth,
    n_rows: usize,
    n_columns: usize,
    /// Range of each variable.
    low: Vec<f64>,
    high: Vec<f64>,
    values: Vec<f64>,
    by_rows: Vec<f64>,
    entries: Option<EntryBound>,
    n_evaluations: usize,
}

/// How the criterion is evaluated.
#[derive(Debug, Clone)]
enum Smooth {
    /// The raw 2-norm condition number: much the fastest.
    Condition(SchattenCondition),
    Spectral(SmoothCriterion, Vec<f64>),
}

/// `S = max|W| / min|W| <= limit` as an augmented Lagrangian: `1 - limit |w| / max|W| <= 0` of every entry.
#[derive(Debug, Clone)]
struct EntryBound {
    limit: f64,
    /// Share of the limit that is aimed at.
    aim: f64,
    weight: f64,
    /// One an entry of the padded `W`.
    multipliers: Vec<f64>,
}

impl<'a> PointObjective<'a> {
    /// `None` when the criterion is not smooth.
    pub(crate) fn new(
        design: &'a EnergyDesign,
        n_rows: usize,
        criterion: Criterion,
        limit_of_equilibrium: Option<f64>,
    ) -> Option<Self> {
        let b = design.n_columns();
        let n_entries = n_rows * padded::stride(b);
        let smooth = match criterion {
            Criterion::TwoNorm(Scaling::Raw) => Smooth::Condition(SchattenCondition::new(b)),
            other => {
                let information = vec![0.0; b * padded::stride(b)];
                Smooth::Spectral(SmoothCriterion::new(other)?, information)
            }
        };
        let ranges: Vec<[f64; 2]> = design.ranges().collect();
        let each = |pick: fn(&[f64; 2]) -> f64| {
            let point: Vec<f64> = ranges.iter().map(pick).collect();
            point.repeat(n_rows + 1)
        };
        Some(Self {
            rows: PointRows::new(design, n_rows),
            smooth,
            n_rows,
            n_columns: b,
            low: each(|range| range[0]),
            high: each(|range| range[1]),
            values: vec![0.0; (n_rows + 1) * ranges.len()],
            by_rows: vec![0.0; n_entries],
            entries: limit_of_equilibrium.map(|limit| EntryBound {
                limit,
                aim: 1.0,
                weight: 0.0,
                multipliers: vec![0.0; n_entries],
            }),
            n_evaluations: 0,
        })
    }

    pub(crate) fn n_evaluations(&self) -> usize {
        self.n_evaluations
    }

    /// Design variables `(q, q̇)` of every point at `x`.
    pub(crate) fn values(&mut self, x: &[f64]) -> &[f64] {
        for (i, value) in self.values.iter_mut().enumerate() {
            let (low, high) = (self.low[i], self.high[i]);
            // Never beyond a limit by rounding.
            *value = (f64::midpoint(low, high) + 0.5 * (high - low) * x[i]).clamp(low, high);
        }
        &self.values
    }

    /// Smoothed value and gradient; norms of power `2^k` stand for the extreme eigenvalues where there are any.
    pub(crate) fn value_and_gradient(&mut self, x: &[f64], k: u32, gradient: &mut [f64]) -> f64 {
        self.n_evaluations += 1;
        self.values(x);
        self.rows.update(&self.values);
        let mut value = self.smooth_value(k);
        if !value.is_finite() {
            gradient.fill(0.0);
            return f64::INFINITY;
        }
        if let Some(entries) = &self.entries {
            value += entries.penalty(self.rows.w(), self.n_columns, &mut self.by_rows);
        }
        self.rows.pull_back(&self.by_rows, gradient);
        for (i, g) in gradient.iter_mut().enumerate() {
            *g *= 0.5 * (self.high[i] - self.low[i]);
        }
        value
    }

    fn smooth_value(&mut self, k: u32) -> f64 {
        let (w, n) = (self.rows.w(), self.n_columns);
        match &mut self.smooth {
            Smooth::Condition(schatten) => schatten.evaluate(w, k, &mut self.by_rows),
            Smooth::Spectral(criterion, information) => {
                padded::gram(w, n, information);
                let criterion = criterion.smoothed(2_f64.powi(k as i32));
                let stride = padded::stride(n);
                let a = MatRef::from_row_major_slice_with_stride(information, n, n, stride);
                let point = criterion.at(a, self.n_rows);
                let s = criterion.by_information(&point);
                for i in 0..n {
                    for j in 0..n {
                        information[i * stride + j] = 2.0 * s[(i, j)];
                    }
                }
                padded::product(w, information, n, &mut self.by_rows);
                point.value
            }
        }
    }

    /// The criterion itself at `x`.
    pub(crate) fn criterion(&mut self, x: &[f64], criterion: Criterion) -> f64 {
        self.values(x);
        self.rows.update(&self.values);
        criterion.evaluate(self.rows.matrix().as_ref(), self.n_rows)
    }

    /// By how much of its limit `S` of the rows last computed exceeds it; zero where it is held and without one.
    pub(crate) fn excess_of_equilibrium(&self) -> f64 {
        let Some(entries) = &self.entries else {
            return 0.0;
        };
        let w = self.rows.w();
        let stride = padded::stride(self.n_columns);
        let smallest = w
            .chunks_exact(stride)
            .flat_map(|row| &row[..self.n_columns])
            .fold(f64::INFINITY, |a, w| a.min(w.abs()));
        (largest_entry(w).1 / smallest / entries.limit - 1.0).max(0.0)
    }

    /// Share of the limit of `S` that is aimed at from now on.
    pub(crate) fn set_aim(&mut self, aim: f64) {
        if let Some(entries) = &mut self.entries {
            entries.aim = aim;
        }
    }

    /// Starts over with the weight of the bound on the entries of `W`.
    pub(crate) fn set_weight(&mut self, weight: f64) {
        if let Some(entries) = &mut self.entries {
            entries.weight = weight;
            entries.multipliers.fill(0.0);
        }
    }

    /// Moves the multipliers of the bound on the entries to the rows last computed.
    pub(crate) fn update_multipliers(&mut self) {
        if let Some(entries) = &mut self.entries {
            let w = self.rows.w();
            let smallest = largest_entry(w).1 / (entries.aim * entries.limit);
            for (multiplier, w) in entries.multipliers.iter_mut().zip(w) {
                let violation = 1.0 - w.abs() / smallest;
                *multiplier = (*multiplier + entries.weight * violation).max(0.0);
            }
        }
    }
}

impl EntryBound {
    /// `Σ (max(0, μ + ρ c)² - μ²) / 2ρ` with `c = 1 - |w| limit / max|W|`; adds its derivative to `by_rows`.
    fn penalty(&self, w: &[f64], n_columns: usize, by_rows: &mut [f64]) -> f64 {
        if self.weight == 0.0 {
            return 0.0;
        }
        let stride = padded::stride(n_columns);
        let (at, largest) = largest_entry(w);
        let limit = self.aim * self.limit;
        let smallest = largest / limit;
        let (mut value, mut by_smallest) = (0.0, 0.0);
        for i in (0..w.len()).filter(|i| i % stride < n_columns) {
            let multiplier = self.multipliers[i];
            let active = (multiplier + self.weight * (1.0 - w[i].abs() / smallest)).max(0.0);
            value += (active * active - multiplier * multiplier) / (2.0 * self.weight);
            by_rows[i] -= active * w[i].signum() / smallest;
            by_smallest += active * w[i].abs() / (smallest * smallest);
        }
        by_rows[at] += by_smallest * w[at].signum() / limit;
        value
    }
}

/// Where the entry of largest magnitude is, and the magnitude.
fn largest_entry(w: &[f64]) -> (usize, f64) {
    let mut largest = (0, 0.0);
    for (i, w) in w.iter().enumerate() {
        if w.abs() > largest.1 {
            largest = (i, w.abs());
        }
    }
    largest
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::PointLimits;
    use crate::dual::{AGREEMENT, Dual, Extremes, SMOOTH, dual, energy_row, gram, logarithm};
    use idim_model::{Columns, Parameter, ParameterKind as K, robot_from_ron};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn columns() -> Columns {
        let column = |(kind, index)| Parameter { kind, index };
        let base = [
            (K::ZZ, 0),
            (K::MX, 0),
            (K::MY, 0),
            (K::ZZ, 1),
            (K::MX, 1),
            (K::MY, 1),
        ];
        Columns(base.map(column).to_vec())
    }

    fn design() -> EnergyDesign {
        let robot = robot_from_ron(idim_fixtures::PLANAR2R).unwrap();
        let limits = PointLimits {
            position: vec![[-1.0, 1.2]; 2],
            velocity: vec![2.0, 1.5],
        };
        EnergyDesign::new(&robot, &columns(), limits).unwrap()
    }

    #[test]
    fn identity_gradient_of_every_criterion_by_the_points() {
        let design = design();
        let criteria = [
            (Criterion::TwoNorm(Scaling::Raw), None),
            (Criterion::TwoNorm(Scaling::Raw), Some(5.0)),
            (Criterion::TwoNorm(Scaling::Equilibrated), None),
            (Criterion::Frobenius(Scaling::Raw), None),
            (Criterion::Frobenius(Scaling::Equilibrated), None),
            (Criterion::LogDet, None),
            (Criterion::LogDet, Some(5.0)),
            (Criterion::TraceInverse, None),
            (Criterion::WorstDirection, None),
        ];
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for (criterion, limit) in criteria {
            let mut objective = PointObjective::new(&design, 9, criterion, limit).unwrap();
            objective.set_weight(0.3);
            // Not a start of the search: equal speeds make entries that are zero, where the bound has its kink.
            let x: Vec<f64> = (0..10 * design.n_variables())
                .map(|_| rng.random_range(-0.9..0.9))
                .collect();
            let direction: Vec<f64> = x.iter().map(|_| rng.random_range(-0.1..0.1)).collect();
            let mut gradient = vec![0.0; x.len()];
            objective.value_and_gradient(&x, 3, &mut gradient);
            // Multipliers that are not zero, where the bound is active.
            objective.update_multipliers();
            objective.value_and_gradient(&x, 3, &mut gradient);
            let slope: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
            let mut scratch = gradient.clone();
            let mut f = |t: f64| {
                let moved: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + t * d).collect();
                objective.value_and_gradient(&moved, 3, &mut scratch)
            };
            // Five-point difference: truncation and rounding both below 1e-10 of slopes near one.
            let h = 1e-3;
            let numeric = (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
            assert!(
                (slope - numeric).abs() < 1e-9 * slope.abs().max(1.0),
                "{criterion:?}, S limited: {limit:?}: {slope} {numeric}"
            );
        }
    }

    #[test]
    fn identity_gradient_of_every_criterion_by_dual_numbers() {
        let robot = robot_from_ron(idim_fixtures::PLANAR2R).unwrap();
        let (design, columns) = (design(), columns());
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let (n, n_rows) = (design.n_variables(), 9);
        let positions = design.position_variables();
        let ranges: Vec<[f64; 2]> = design.ranges().collect();
        let x: Vec<f64> = (0..n * (n_rows + 1))
            .map(|_| rng.random_range(-0.9..0.9))
            .collect();
        let direction: Vec<f64> = x.iter().map(|_| rng.random_range(-1.0..1.0)).collect();
        let energies: Vec<Vec<Dual>> = (0..=n_rows)
            .map(|point| {
                let (mut q, mut qd) = (vec![Dual::ZERO; 2], vec![Dual::ZERO; 2]);
                for (k, [low, high]) in ranges.iter().enumerate() {
                    let i = point * n + k;
                    let value = dual(x[i], direction[i]) * (0.5 * (high - low));
                    let value = value + dual(0.5 * (high + low), 0.0);
                    match positions.get(k) {
                        Some(&j) => q[j] = value,
                        None => qd[k - positions.len()] = value,
                    }
                }
                energy_row(&robot, &columns, &q, &qd)
            })
            .collect();
        let rows = energies.windows(2).map(|e| {
            let difference = e[1].iter().zip(&e[0]).map(|(b, a)| *b - *a);
            (1.0, difference.collect())
        });
        let a = gram(&rows.collect::<Vec<_>>());
        for criterion in SMOOTH {
            let extremes = match criterion {
                Criterion::TwoNorm(Scaling::Raw) => Extremes::Traces(8.0),
                _ => Extremes::Norm(8.0),
            };
            let expected = logarithm(criterion, extremes, a.clone(), n_rows);
            let mut objective = PointObjective::new(&design, n_rows, criterion, None).unwrap();
            let mut gradient = vec![0.0; x.len()];
            let value = objective.value_and_gradient(&x, 3, &mut gradient);
            let slope = crate::dense::dot(&gradient, &direction);
            assert!(
                (value - expected.re).abs() < AGREEMENT,
                "{criterion:?}: {value} {expected:?}"
            );
            let error = (slope - expected.du).abs();
            assert!(
                error < AGREEMENT * slope.abs().max(1.0),
                "{criterion:?}: {slope} {expected:?}"
            );
        }
    }

    #[test]
    fn identity_the_ends_of_the_box_are_the_limits() {
        let design = design();
        let criterion = Criterion::LogDet;
        let mut objective = PointObjective::new(&design, 6, criterion, None).unwrap();
        let n = 7 * design.n_variables();
        for (x, pick) in [(-1.0, 0), (1.0, 1)] {
            let values = objective.values(&vec![x; n]).to_vec();
            let expected: Vec<f64> = design.ranges().map(|range| range[pick]).collect();
            assert_eq!(values, expected.repeat(7));
        }
    }
}
