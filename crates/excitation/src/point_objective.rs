//! A criterion of chained points as a smooth function on a box, with its exact gradient.

use crate::criterion::{Criterion, Scaling};
use crate::entry_bound::EntryBound;
use crate::point_rows::PointRows;
use crate::schatten::SchattenCondition;
use crate::spectrum::SmoothCriterion;
use crate::{EnergyDesign, padded};
use faer::MatRef;

/// The function an optimiser lowers: `x` in `[-1, 1]` of every design variable to the logarithm of the criterion,
/// plus what the entries of `W` may not be. Where `S` has a weight, `x` has one more variable: its bound.
#[derive(Debug, Clone)]
pub(crate) struct PointObjective<'a> {
    rows: PointRows<'a>,
    asked: Criterion,
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

impl<'a> PointObjective<'a> {
    /// `None` when the criterion is not smooth. A weighted sum takes no limit: its `S` is bounded by a variable.
    pub(crate) fn new(
        design: &'a EnergyDesign,
        n_rows: usize,
        criterion: Criterion,
        limit_of_equilibrium: Option<f64>,
    ) -> Option<Self> {
        let b = design.n_columns();
        let n_entries = n_rows * padded::stride(b);
        let entries = match criterion {
            Criterion::WeightedSum {
                condition,
                equilibrium,
            } => Some(EntryBound::weighed([condition, equilibrium], n_entries)),
            _ => limit_of_equilibrium.map(|limit| EntryBound::limited(limit, n_entries)),
        };
        let smooth = match criterion {
            Criterion::TwoNorm(Scaling::Raw) | Criterion::WeightedSum { .. } => {
                Smooth::Condition(SchattenCondition::new(b))
            }
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
            asked: criterion,
            smooth,
            n_rows,
            n_columns: b,
            low: each(|range| range[0]),
            high: each(|range| range[1]),
            values: vec![0.0; (n_rows + 1) * ranges.len()],
            by_rows: vec![0.0; n_entries],
            entries,
            n_evaluations: 0,
        })
    }

    /// The criterion that is lowered.
    pub(crate) fn asked(&self) -> Criterion {
        self.asked
    }

    pub(crate) fn n_evaluations(&self) -> usize {
        self.n_evaluations
    }

    /// Design variables `(q, q̇)` of every point at `x`; a further variable is the bound of `S`.
    pub(crate) fn values(&mut self, x: &[f64]) -> &[f64] {
        for (i, value) in self.values.iter_mut().enumerate() {
            let (low, high) = (self.low[i], self.high[i]);
            // Never beyond a limit by rounding.
            *value = (f64::midpoint(low, high) + 0.5 * (high - low) * x[i]).clamp(low, high);
        }
        if let (Some(entries), Some(&x)) = (&mut self.entries, x.get(self.values.len())) {
            entries.set_variable(x);
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
        let mut by_bound = 0.0;
        if let Some(entries) = &self.entries {
            (value, by_bound) =
                entries.add_to(value, self.rows.w(), self.n_columns, &mut self.by_rows);
        }
        let (by_points, further) = gradient.split_at_mut(self.values.len());
        self.rows.pull_back(&self.by_rows, by_points);
        for (i, g) in by_points.iter_mut().enumerate() {
            *g *= 0.5 * (self.high[i] - self.low[i]);
        }
        further.fill(by_bound);
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
        let (w, n) = (self.rows.w(), self.n_columns);
        self.entries.as_ref().map_or(0.0, |e| e.excess(w, n))
    }

    /// The variable that bounds `S` where it has a weight: from an earlier bound, or to suit a condition number.
    pub(crate) fn variable_of_bound(&self, earlier: Option<f64>, condition: f64) -> Option<f64> {
        self.entries.as_ref()?.variable(earlier, condition)
    }

    /// What that variable last was, as a bound.
    pub(crate) fn variable_bound(&self) -> Option<f64> {
        self.entries.as_ref()?.variable_limit()
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
            entries.set_weight(weight);
        }
    }

    /// Moves the multipliers of the bound on the entries to the rows last computed.
    pub(crate) fn update_multipliers(&mut self) {
        if let Some(entries) = &mut self.entries {
            entries.update_multipliers(self.rows.w());
        }
    }
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

    const ROWS: usize = 9;

    /// Variables of a chain and a direction to move them in.
    fn chain_and_direction() -> (Vec<f64>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let n = design().n_variables() * (ROWS + 1);
        let x = (0..n).map(|_| rng.random_range(-0.9..0.9)).collect();
        let direction = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        (x, direction)
    }

    /// The energy differences of such a chain.
    fn dual_rows(x: &[f64], direction: &[f64]) -> Vec<Vec<Dual>> {
        let robot = robot_from_ron(idim_fixtures::PLANAR2R).unwrap();
        let (design, columns) = (design(), columns());
        let n = design.n_variables();
        let positions = design.position_variables();
        let ranges: Vec<[f64; 2]> = design.ranges().collect();
        let energies: Vec<Vec<Dual>> = (0..=ROWS)
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
        let difference = |e: &[Vec<Dual>]| e[1].iter().zip(&e[0]).map(|(b, a)| *b - *a).collect();
        energies.windows(2).map(difference).collect()
    }

    /// The logarithm of a criterion of those rows, at the power `2^3`.
    fn dual_logarithm(criterion: Criterion, rows: &[Vec<Dual>]) -> Dual {
        let extremes = match criterion {
            Criterion::TwoNorm(Scaling::Raw) => Extremes::Traces(8.0),
            _ => Extremes::Norm(8.0),
        };
        let rows: Vec<_> = rows.iter().map(|row| (1.0, row.clone())).collect();
        logarithm(criterion, extremes, gram(&rows), ROWS)
    }

    fn assert_value_and_slope(objective: &mut PointObjective<'_>, at: [&[f64]; 2], expected: Dual) {
        let [x, direction] = at;
        let mut gradient = vec![0.0; x.len()];
        let value = objective.value_and_gradient(x, 3, &mut gradient);
        let slope = crate::dense::dot(&gradient, direction);
        let criterion = objective.asked();
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

    #[test]
    fn identity_gradient_of_every_criterion_by_dual_numbers() {
        let design = design();
        let (x, direction) = chain_and_direction();
        let rows = dual_rows(&x, &direction);
        for criterion in SMOOTH {
            let expected = dual_logarithm(criterion, &rows);
            let mut objective = PointObjective::new(&design, ROWS, criterion, None).unwrap();
            assert_value_and_slope(&mut objective, [&x, &direction], expected);
        }
    }

    #[test]
    fn identity_gradient_of_the_weighted_sum_by_dual_numbers() {
        let design = design();
        let (mut x, mut direction) = chain_and_direction();
        let rows = dual_rows(&x, &direction);
        let cond = dual_logarithm(Criterion::TwoNorm(Scaling::Raw), &rows);
        let sum = Criterion::WeightedSum {
            condition: 2.0,
            equilibrium: 0.3,
        };
        let mut objective = PointObjective::new(&design, ROWS, sum, None).unwrap();
        let (weight, bound) = (0.4, 20.0_f64);
        objective.set_weight(weight);
        x.push(objective.variable_of_bound(Some(bound), 1.0).unwrap());
        direction.push(0.2);
        // One more unit of the variable is fifteen of the logarithm of the bound.
        let s = dual(bound, 15.0 * 0.2 * bound);
        let exp = |a: Dual| dual(a.re.exp(), a.re.exp() * a.du);
        let magnitudes: Vec<Dual> = rows.iter().flatten().map(|w| *w * w.re.signum()).collect();
        let largest = *magnitudes
            .iter()
            .max_by(|a, b| a.re.total_cmp(&b.re))
            .unwrap();
        let violations = magnitudes.iter().map(|w| dual(1.0, 0.0) - *w * s / largest);
        let violations: Vec<Dual> = violations.filter(|c| c.re > 0.0).collect();
        assert!(!violations.is_empty() && violations.len() < magnitudes.len());
        let logarithm = (exp(cond) * 2.0 + s * 0.3).ln();
        // Without multipliers ρ c² / 2, and with μ = ρ c of this very place: ((μ + ρ c)² - μ²) / 2ρ.
        let plain = violations.iter().map(|c| *c * *c * (0.5 * weight));
        let expected = plain.fold(logarithm, std::ops::Add::add);
        assert_value_and_slope(&mut objective, [&x, &direction], expected);
        objective.update_multipliers();
        let augmented = violations.iter().map(|c| {
            let (multiplier, active) = (c.re * weight, *c * weight + dual(c.re * weight, 0.0));
            (active * active - dual(multiplier * multiplier, 0.0)) * (0.5 / weight)
        });
        let expected = augmented.fold(logarithm, std::ops::Add::add);
        assert_value_and_slope(&mut objective, [&x, &direction], expected);
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
