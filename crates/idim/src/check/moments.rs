//! Normal equations of a log kept joint by joint, torque by torque and fold by fold, so that many readings of its
//! columns can be tried for the price of a small solve each.

/// Parts of the log that take turns to be held out.
pub(crate) const FOLDS: usize = 4;
/// Shares of each column's own square added to it, tried in turn: a log that hardly moves determines few directions, and
/// what it does not determine must not blur what it does. The doctor compares readings; it estimates nothing.
const RIDGES: [f64; 2] = [1e-6, 1e-3];
/// Rounds of weighting the joints by their residuals: two settle them.
const ROUNDS: usize = 2;
/// Pivot of the equilibrated normal matrix below which a column depends on the others: what the log does not excite.
const DEPENDENT: f64 = 1e-9;
/// Smallest relative error a joint is believed to have: what is below is noise-free data.
const LEAST: f64 = 1e-3;
/// Largest that counts: a prediction worse than none is no better for being much worse.
const MOST: f64 = 1.2;

/// Sums over the rows of one fold.
#[derive(Debug, Clone)]
struct Fold {
    /// `Σ w wᵀ` of each joint's rows.
    normal: Vec<Vec<f64>>,
    /// `Σ w τ` of each joint's rows with each torque channel: `[joint · n + channel]`.
    mixed: Vec<Vec<f64>>,
    /// `Σ τ_c τ_d` of the channels: `[c · n + d]`.
    square: Vec<f64>,
    /// `Σ τ` of each channel.
    sum: Vec<f64>,
    /// Samples.
    count: f64,
}

/// The sums of a log for one reading of its positions.
#[derive(Debug, Clone)]
pub(crate) struct Moments {
    n: usize,
    p: usize,
    folds: Vec<Fold>,
    /// Sums over all folds.
    all: Fold,
    /// Columns whose value cannot be negative: friction opposes motion.
    positive: Vec<usize>,
}

/// How well a rigid body explains the torques as they are read.
#[derive(Debug, Clone)]
pub(crate) struct Consistency {
    /// Sum over the joints of the logarithm of the held-out relative error: smaller fits better.
    pub(crate) misfit: f64,
    /// Held-out error of each joint over the spread of its torque.
    pub(crate) relative: Vec<f64>,
}

impl Consistency {
    /// Mean of the joints' relative errors.
    pub(crate) fn mean_error(&self) -> f64 {
        self.relative.iter().sum::<f64>() / self.relative.len() as f64
    }
}

impl Moments {
    /// `rows`: `p` entries of joint `j` at sample `k` from `(k · n + j) · p`; `torque[channel][sample]`.
    pub(crate) fn new(rows: &[f64], p: usize, torque: &[Vec<f64>], fold: &[usize]) -> Self {
        let n = torque.len();
        let empty = Fold {
            normal: vec![vec![0.0; p * p]; n],
            mixed: vec![vec![0.0; p]; n * n],
            square: vec![0.0; n * n],
            sum: vec![0.0; n],
            count: 0.0,
        };
        let mut folds = vec![empty; FOLDS];
        let mut entries: Vec<(usize, f64)> = Vec::with_capacity(p);
        for (k, &f) in fold.iter().enumerate() {
            let sums = &mut folds[f];
            sums.count += 1.0;
            for c in 0..n {
                sums.sum[c] += torque[c][k];
                for d in 0..n {
                    sums.square[c * n + d] += torque[c][k] * torque[d][k];
                }
            }
            for j in 0..n {
                let row = &rows[(k * n + j) * p..][..p];
                entries.clear();
                entries.extend((0..p).filter(|&c| row[c] != 0.0).map(|c| (c, row[c])));
                let normal = &mut sums.normal[j];
                for (at, &(a, x)) in entries.iter().enumerate() {
                    let line = &mut normal[a * p..(a + 1) * p];
                    for &(b, y) in &entries[at..] {
                        line[b] += x * y;
                    }
                }
                for c in 0..n {
                    let mixed = &mut sums.mixed[j * n + c];
                    for &(a, x) in &entries {
                        mixed[a] += x * torque[c][k];
                    }
                }
            }
        }
        for sums in &mut folds {
            for normal in &mut sums.normal {
                for a in 0..p {
                    for b in 0..a {
                        normal[a * p + b] = normal[b * p + a];
                    }
                }
            }
        }
        Self {
            n,
            p,
            all: total(&folds),
            folds,
            positive: Vec::new(),
        }
    }

    /// The same sums, fitted with values of these columns that are not negative.
    pub(crate) fn with_positive(mut self, columns: &[usize]) -> Self {
        self.positive = columns.to_vec();
        self
    }

    /// The sums of two logs of one robot.
    pub(crate) fn merged(mut self, other: &Self) -> Self {
        for (a, b) in self.folds.iter_mut().zip(&other.folds) {
            a.add(b, 1.0);
        }
        self.all = total(&self.folds);
        self
    }

    /// Standard deviation of each joint's torque about its mean.
    pub(crate) fn deviations(&self, share: &[f64]) -> Vec<f64> {
        let spread = (0..self.n).map(|j| self.spread(&self.all, share, j));
        let count = self.all.count.max(1.0);
        spread.map(|s| (s / count).sqrt()).collect()
    }

    /// Fits all joints together; the torque of joint `j` is `Σ_c share[j · n + c]` times channel `c`.
    pub(crate) fn fit(&self, share: &[f64]) -> Consistency {
        let fits = RIDGES.map(|ridge| self.fit_with(share, ridge));
        let best = fits
            .into_iter()
            .reduce(|a, b| if b.misfit < a.misfit { b } else { a });
        best.unwrap_or_else(|| unreachable!("there are ridges"))
    }

    fn fit_with(&self, share: &[f64], ridge: f64) -> Consistency {
        let all = &self.all;
        let spread: Vec<f64> = (0..self.n).map(|j| self.spread(all, share, j)).collect();
        let mut weight: Vec<f64> = spread
            .iter()
            .map(|s| 1.0 / s.max(f64::MIN_POSITIVE))
            .collect();
        for _ in 0..ROUNDS {
            let values = self.solve(all, &weight, share, ridge);
            for j in 0..self.n {
                let error = self.error(all, &values, share, j);
                let least = LEAST * LEAST * spread[j];
                weight[j] = 1.0 / error.max(least).max(f64::MIN_POSITIVE);
            }
        }
        let mut errors = vec![0.0; self.n];
        for fold in &self.folds {
            let others = all.without(fold);
            let values = self.solve(&others, &weight, share, ridge);
            for j in 0..self.n {
                errors[j] += self.error(fold, &values, share, j);
            }
        }
        let relative: Vec<f64> = errors
            .iter()
            .zip(&spread)
            .map(|(e, s)| (e.max(0.0) / s.max(f64::MIN_POSITIVE)).sqrt())
            .collect();
        Consistency {
            misfit: relative.iter().map(|r| r.clamp(LEAST, MOST).ln()).sum(),
            relative,
        }
    }

    fn solve(&self, sums: &Fold, weight: &[f64], share: &[f64], ridge: f64) -> Vec<f64> {
        let (n, p) = (self.n, self.p);
        let (mut a, mut b) = (vec![0.0; p * p], vec![0.0; p]);
        for j in 0..n {
            for (a, x) in a.iter_mut().zip(&sums.normal[j]) {
                *a += weight[j] * x;
            }
            for (b, x) in b.iter_mut().zip(self.mixed(sums, share, j)) {
                *b += weight[j] * x;
            }
        }
        for k in 0..p {
            a[k * p + k] *= 1.0 + ridge;
        }
        let mut used = vec![true; p];
        loop {
            let values = solve(&a, &b, &used);
            // Each in the size of what it predicts.
            let size = |&c: &usize| values[c] * a[c * p + c].sqrt();
            let wrong = self.positive.iter().filter(|c| values[**c] < 0.0);
            let Some(&worst) = wrong.min_by(|x, y| size(x).total_cmp(&size(y))) else {
                return values;
            };
            used[worst] = false;
        }
    }

    /// `Σ w τ` of joint `j` with its torque made of the channels.
    fn mixed(&self, sums: &Fold, share: &[f64], j: usize) -> Vec<f64> {
        let n = self.n;
        let mut out = vec![0.0; self.p];
        for c in 0..n {
            let by = share[j * n + c];
            if by != 0.0 {
                for (o, x) in out.iter_mut().zip(&sums.mixed[j * n + c]) {
                    *o += by * x;
                }
            }
        }
        out
    }

    /// `Σ τ²` of joint `j`.
    fn square(&self, sums: &Fold, share: &[f64], j: usize) -> f64 {
        let n = self.n;
        let own = &share[j * n..(j + 1) * n];
        let rows = own.iter().zip(sums.square.chunks_exact(n));
        rows.map(|(by, row)| by * own.iter().zip(row).map(|(s, x)| s * x).sum::<f64>())
            .sum()
    }

    /// Sum of squares of the torque of joint `j` about its mean.
    fn spread(&self, sums: &Fold, share: &[f64], j: usize) -> f64 {
        let own = &share[j * self.n..(j + 1) * self.n];
        let sum: f64 = own.iter().zip(&sums.sum).map(|(s, x)| s * x).sum();
        (self.square(sums, share, j) - sum * sum / sums.count.max(1.0)).max(0.0)
    }

    /// Sum of the squared residuals of joint `j`.
    fn error(&self, sums: &Fold, values: &[f64], share: &[f64], j: usize) -> f64 {
        let p = self.p;
        let normal = &sums.normal[j];
        let mixed = self.mixed(sums, share, j);
        let mut error = self.square(sums, share, j);
        for a in 0..p {
            if values[a] == 0.0 {
                continue;
            }
            let line = &normal[a * p..(a + 1) * p];
            let predicted: f64 = line.iter().zip(values).map(|(x, v)| x * v).sum();
            error += values[a] * (predicted - 2.0 * mixed[a]);
        }
        error.max(0.0)
    }
}

impl Fold {
    fn add(&mut self, other: &Self, sign: f64) {
        let into = |a: &mut [f64], b: &[f64]| {
            for (a, b) in a.iter_mut().zip(b) {
                *a += sign * b;
            }
        };
        for (a, b) in self.normal.iter_mut().zip(&other.normal) {
            into(a, b);
        }
        for (a, b) in self.mixed.iter_mut().zip(&other.mixed) {
            into(a, b);
        }
        into(&mut self.square, &other.square);
        into(&mut self.sum, &other.sum);
        self.count += sign * other.count;
    }

    fn without(&self, other: &Self) -> Self {
        let mut rest = self.clone();
        rest.add(other, -1.0);
        rest
    }
}

fn total(folds: &[Fold]) -> Fold {
    let mut all = folds[0].clone();
    for fold in &folds[1..] {
        all.add(fold, 1.0);
    }
    all
}

/// Least squares from normal equations: equilibrated, pivoted Cholesky; columns that are not used or depend on others get
/// zero.
pub(crate) fn solve(a: &[f64], b: &[f64], used: &[bool]) -> Vec<f64> {
    let p = b.len();
    let d: Vec<f64> = (0..p)
        .map(|i| {
            let x = a[i * p + i];
            if x > 0.0 && used[i] {
                1.0 / x.sqrt()
            } else {
                0.0
            }
        })
        .collect();
    let mut left: Vec<f64> = d.iter().map(|d| if *d > 0.0 { 1.0 } else { 0.0 }).collect();
    let mut order: Vec<usize> = (0..p).collect();
    let mut l = vec![0.0; p * p];
    let mut rank = 0;
    for k in 0..p {
        let largest = (k..p).max_by(|&x, &y| left[order[x]].total_cmp(&left[order[y]]));
        order.swap(k, largest.unwrap_or(k));
        let i = order[k];
        if left[i] < DEPENDENT {
            break;
        }
        let pivot = left[i].sqrt();
        l[i * p + k] = pivot;
        for &m in &order[k + 1..] {
            let done: f64 = (0..k).map(|c| l[i * p + c] * l[m * p + c]).sum();
            let entry = (a[i * p + m] * d[i] * d[m] - done) / pivot;
            l[m * p + k] = entry;
            left[m] -= entry * entry;
        }
        rank = k + 1;
    }
    let mut y = vec![0.0; rank];
    for k in 0..rank {
        let i = order[k];
        let done: f64 = (0..k).map(|c| l[i * p + c] * y[c]).sum();
        y[k] = (b[i] * d[i] - done) / l[i * p + k];
    }
    for k in (0..rank).rev() {
        let done: f64 = (k + 1..rank).map(|m| l[order[m] * p + k] * y[m]).sum();
        y[k] = (y[k] - done) / l[order[k] * p + k];
    }
    let mut x = vec![0.0; p];
    for (k, y) in y.into_iter().enumerate() {
        x[order[k]] = y * d[order[k]];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::{FOLDS, Moments, solve};

    #[test]
    fn identity_a_dependent_column_changes_no_prediction() {
        let columns = |t: f64| [t, 1.0, 2.0 * t - 1.0];
        let (mut a, mut b) = (vec![0.0; 9], vec![0.0; 3]);
        for k in 0..20 {
            let t = f64::from(k) / 7.0;
            let (w, y) = (columns(t), 3.0 * t - 2.0);
            for i in 0..3 {
                b[i] += w[i] * y;
                for j in 0..3 {
                    a[3 * i + j] += w[i] * w[j];
                }
            }
        }
        let x = solve(&a, &b, &[true; 3]);
        for t in [0.0, 1.7] {
            let y: f64 = columns(t).iter().zip(&x).map(|(w, x)| w * x).sum();
            assert!((y - (3.0 * t - 2.0)).abs() < 1e-7, "{y}");
        }
        assert_eq!(x.iter().filter(|x| **x == 0.0).count(), 1);
    }

    #[test]
    fn identity_a_shared_parameter_betrays_a_scaled_channel() {
        // Two joints feel one parameter, so their torques must agree about it.
        let (mut rows, mut torque, mut fold) = (vec![], vec![vec![], vec![]], vec![]);
        for k in 0..200 {
            let t = 0.1 * f64::from(k);
            let (a, b) = (t.sin(), (1.7 * t).cos());
            rows.extend([a, 0.0, b, 1.0]);
            torque[0].push(2.0 * a + 0.01 * (9.0 * t).sin());
            torque[1].push(-50.0 * (2.0 * b + 0.5));
            fold.push((k as usize / 20) % FOLDS);
        }
        let moments = Moments::new(&rows, 2, &torque, &fold);
        let as_is = moments.fit(&[1.0, 0.0, 0.0, 1.0]);
        let right = moments.fit(&[1.0, 0.0, 0.0, -0.02]);
        assert!(right.misfit < as_is.misfit - 3.0, "{as_is:?} {right:?}");
    }
}
