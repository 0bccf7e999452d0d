//! `S = max|W| / min|W|` of the rows of a chain, held below a limit or weighed against their condition number.

use crate::padded;

/// `S <= limit` as an augmented Lagrangian: `1 - limit |w| / max|W| <= 0` of every entry.
///
/// A weighted sum `λ₁ Cond + λ₂ S` is lowered as `λ₁ Cond + λ₂ limit` with the limit as one more variable: `S` itself
/// has a kink wherever another entry becomes the smallest, and a pole wherever one changes its sign.
#[derive(Debug, Clone)]
pub(crate) struct EntryBound {
    limit: f64,
    /// Share of the limit that is aimed at.
    pub(crate) aim: f64,
    weight: f64,
    /// One an entry of the padded `W`.
    multipliers: Vec<f64>,
    /// `λ₁`, `λ₂` where the limit is a variable.
    sum: Option<[f64; 2]>,
}

/// Half the range of the logarithm of a limit that is a variable, which begins at zero: up to where an entry counts as
/// zero.
const HALF_RANGE: f64 = 15.0;
/// Weight from which on a variable limit moves: below, it would fall while the entries do not follow.
const FIRM: f64 = 0.3;
/// Share of `λ₂ S` in `λ₁ Cond` that a descent begins with where `S` was free before.
const FIRST_SHARE: f64 = 0.3;

impl EntryBound {
    pub(crate) fn limited(limit: f64, n_entries: usize) -> Self {
        Self {
            limit,
            aim: 1.0,
            weight: 0.0,
            multipliers: vec![0.0; n_entries],
            sum: None,
        }
    }

    pub(crate) fn weighed(sum: [f64; 2], n_entries: usize) -> Self {
        Self {
            sum: Some(sum),
            ..Self::limited(1.0, n_entries)
        }
    }

    /// The limit as a variable in `[-1, 1]`: that of an earlier descent, or one that suits a condition number. `None`
    /// where it is none.
    pub(crate) fn variable(&self, earlier: Option<f64>, condition: f64) -> Option<f64> {
        let [of_condition, of_s] = self.sum?;
        let limit = earlier.unwrap_or(FIRST_SHARE * of_condition * condition / of_s);
        Some((limit.ln() / HALF_RANGE - 1.0).clamp(-1.0, 1.0))
    }

    pub(crate) fn set_variable(&mut self, x: f64) {
        self.limit = (HALF_RANGE * (1.0 + x)).exp();
    }

    /// The limit where it is a variable.
    pub(crate) fn variable_limit(&self) -> Option<f64> {
        self.sum.map(|_| self.limit)
    }

    /// Starts over with this weight.
    pub(crate) fn set_weight(&mut self, weight: f64) {
        self.weight = weight;
        self.multipliers.fill(0.0);
    }

    /// Moves the multipliers to these rows.
    pub(crate) fn update_multipliers(&mut self, w: &[f64]) {
        let smallest = largest_entry(w).1 / (self.aim * self.limit);
        for (multiplier, w) in self.multipliers.iter_mut().zip(w) {
            let violation = 1.0 - w.abs() / smallest;
            *multiplier = (*multiplier + self.weight * violation).max(0.0);
        }
    }

    /// By how much of the limit `S` of these rows exceeds it; zero where it is held, or a variable.
    pub(crate) fn excess(&self, w: &[f64], n_columns: usize) -> f64 {
        if self.sum.is_some() {
            return 0.0;
        }
        let smallest = w
            .chunks_exact(padded::stride(n_columns))
            .flat_map(|row| &row[..n_columns])
            .fold(f64::INFINITY, |a, w| a.min(w.abs()));
        (largest_entry(w).1 / smallest / self.limit - 1.0).max(0.0)
    }

    /// From the logarithm of a criterion, and its derivative `by_rows`, to what is lowered; returns that and its
    /// derivative by the variable limit.
    pub(crate) fn add_to(
        &self,
        criterion: f64,
        w: &[f64],
        n_columns: usize,
        by_rows: &mut [f64],
    ) -> (f64, f64) {
        let Some([of_condition, of_s]) = self.sum else {
            let (penalty, _) = self.penalty(w, n_columns, by_rows);
            return (criterion + penalty, 0.0);
        };
        let (condition, s) = (of_condition * criterion.exp(), of_s * self.limit);
        let sum = condition + s;
        for g in by_rows.iter_mut() {
            *g *= condition / sum;
        }
        let (penalty, by_logarithm) = self.penalty(w, n_columns, by_rows);
        let by_limit = if self.weight < FIRM {
            0.0
        } else {
            HALF_RANGE * (s / sum + by_logarithm)
        };
        (sum.ln() + penalty, by_limit)
    }

    /// `Σ (max(0, μ + ρ c)² - μ²) / 2ρ` with `c = 1 - |w| limit / max|W|`, and its derivative by the logarithm of the
    /// limit; adds that by the rows to `by_rows`.
    fn penalty(&self, w: &[f64], n_columns: usize, by_rows: &mut [f64]) -> (f64, f64) {
        if self.weight == 0.0 {
            return (0.0, 0.0);
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
        (value, -by_smallest * smallest)
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
