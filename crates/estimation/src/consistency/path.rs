//! The path from the prior to the data.

use super::cone::{divergence, newton_rows, symmetric, unwhitening};
use super::{PhysicalParameters, PhysicalProblem};
use crate::error::Error;
use crate::information::InformationFactor;
use crate::rank::rank_factor;
use crate::triangular::solve_upper;
use faer::Mat;

/// The weight of the prior falls by this factor from one point of the path to the next: some five Newton steps each.
const FALL: f64 = 5.0;
/// A point is found when the Newton decrement is below this; the objective is then right to half its square.
const DECREMENT: f64 = 1e-7;
/// A point whose decrement stops here by rounding is still one: the objective is right to 1e-6.
const ENOUGH: f64 = 1e-3;
/// Above this decrement the step of a self-concordant function is damped by `1/(1 + decrement)` and stays in the cone (Nesterov &
/// Nemirovskii 1994).
const DAMPED: f64 = 0.25;
/// Steps a point at most. Damped steps gain 0.02 each of an objective that starts below some hundreds.
const STEPS: usize = 500;
/// The path ends when its duality gap is below this share of the price or of its limit.
const GAP: f64 = 0.01;
/// The confidence region is met to this share of its χ².
const MET: f64 = 1e-3;

/// A point of the path, in whitened coordinates.
#[derive(Debug, Clone)]
pub(super) struct Point {
    mu: f64,
    coordinates: Vec<f64>,
    pub(super) delta_chi_square: f64,
    converged: bool,
}

pub(super) struct Path {
    /// `R K T / σ` and `z / σ`.
    a: Mat<f64>,
    z: Vec<f64>,
    /// Per link the first coordinate of its ten; then positive scalars, then free ones.
    n_links: usize,
    n_positive: usize,
    /// `T`: standard parameters from coordinates.
    unwhiten: Mat<f64>,
    pub(super) n_steps: usize,
}

impl Path {
    #[track_caller]
    pub(super) fn new(problem: &PhysicalProblem<'_>) -> Result<Self, Error> {
        let k = problem.regrouping;
        let (b, p) = (k.nrows(), k.ncols());
        assert_eq!(
            b,
            problem.factor.n_columns(),
            "K has {b} rows, the factor {} columns",
            problem.factor.n_columns()
        );
        if !(problem.sigma > 0.0 && problem.sigma.is_finite()) {
            return Err(Error::OutOfRange {
                name: "the standard deviation of a row",
                value: problem.sigma,
                rule: "positive and finite",
            });
        }
        let unwhiten = unwhiten(problem, p)?;
        let parts = problem.factor.parts();
        let a = &parts.r * k * &unwhiten * faer::Scale(1.0 / problem.sigma);
        if !a.norm_max().is_finite() || !parts.observation_norm().is_finite() {
            return Err(Error::Overflow {
                n_rows: problem.factor.n_rows(),
            });
        }
        let path = Self {
            a,
            z: parts.z.iter().map(|z| z / problem.sigma).collect(),
            n_links: problem.links.len(),
            n_positive: problem.positive.len(),
            unwhiten,
            n_steps: 0,
        };
        path.refuse_undetermined(problem)?;
        Ok(path)
    }

    /// The point where the path enters `Δχ² = target`, if it does, and the last point.
    ///
    /// It ends when the duality gap no longer matters beside `limit`, or where rounding stops Newton's method.
    pub(super) fn follow(
        &mut self,
        target: f64,
        limit: f64,
        heaviest: f64,
    ) -> Result<(Option<Point>, Point), Error> {
        let prior = self.prior();
        let mut entry = (prior.delta_chi_square <= target).then(|| prior.clone());
        let mut point = self.start(&prior, target)?;
        loop {
            if self.gap(&point, heaviest) <= GAP * point.delta_chi_square.max(limit) {
                return Ok((entry, point));
            }
            let next = self.descend(&point, point.mu / FALL)?;
            if !next.converged {
                return Ok((entry, point));
            }
            if entry.is_none() && next.delta_chi_square <= target {
                entry = Some(self.enter(&point, &next, target)?);
            }
            point = next;
        }
    }

    /// `Δχ²` minus the duality gap.
    ///
    /// With `Z_j = μ Q_j⁻¹ ⪰ 0` the gradient of `Δχ²/2` at the point is `Σ (Z_j - μ 1)`, so for every other robot
    /// `Δχ²'/2 ≥ Δχ²/2 - μ (ν - Σ tr Q_j + Σ tr Q_j')`, `ν` the sum of the sizes of the cones.
    pub(super) fn lower_bound(&self, point: &Point, heaviest: f64) -> f64 {
        (point.delta_chi_square - self.gap(point, heaviest)).max(0.0)
    }

    fn gap(&self, point: &Point, heaviest: f64) -> f64 {
        let size = (4 * self.n_links + self.n_positive) as f64;
        let trace: f64 = (0..self.n_links)
            .map(|link| symmetric(&point.coordinates[10 * link..]).trace())
            .chain(
                point.coordinates[10 * self.n_links..][..self.n_positive]
                    .iter()
                    .copied(),
            )
            .sum();
        2.0 * point.mu * (size - trace + size * heaviest).max(0.0)
    }

    fn prior(&self) -> Point {
        let mut coordinates = vec![0.0; self.a.ncols()];
        for link in 0..self.n_links {
            coordinates[10 * link..][..4].fill(1.0);
        }
        coordinates[10 * self.n_links..][..self.n_positive].fill(1.0);
        Point {
            mu: f64::INFINITY,
            delta_chi_square: self.delta_chi_square(&coordinates),
            coordinates,
            converged: true,
        }
    }

    /// A first point, still outside the confidence region unless the prior is within.
    fn start(&mut self, prior: &Point, target: f64) -> Result<Point, Error> {
        // The objective of the prior is then at most 1: Newton's method is at home.
        let mut mu = (0.5 * prior.delta_chi_square).max(1.0);
        loop {
            let point = self.descend(prior, mu)?;
            if prior.delta_chi_square <= target || point.delta_chi_square > target {
                return Ok(point);
            }
            mu *= FALL;
        }
    }

    /// The point of the path with `Δχ² = target`, between two of its points; bisection in `log μ`.
    fn enter(&mut self, before: &Point, after: &Point, target: f64) -> Result<Point, Error> {
        let (mut outside, mut inside) = (before.clone(), after.clone());
        while inside.delta_chi_square < (1.0 - MET) * target
            && inside.mu < outside.mu * (1.0 - 1e-12)
        {
            let middle = self.descend(&outside, (outside.mu * inside.mu).sqrt())?;
            if middle.delta_chi_square <= target {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        Ok(inside)
    }

    /// Newton's method at weight `mu`, by least squares: the rows `A/√μ` and the square roots of the cones' Hessians.
    fn descend(&mut self, from: &Point, mu: f64) -> Result<Point, Error> {
        let mut s = from.coordinates.clone();
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            self.n_steps += 1;
            let (step, decrement) = self.newton_step(&s, mu)?;
            let length = if decrement > DAMPED {
                1.0 / (1.0 + decrement)
            } else {
                1.0
            };
            let next: Vec<f64> = s.iter().zip(&step).map(|(s, d)| s + length * d).collect();
            // Rounding alone leads out of the cone, or keeps a small decrement from falling: the digits are used up.
            if !self.inside(&next) || (last < DAMPED && decrement > 0.5 * last) {
                break;
            }
            s = next;
            last = decrement;
            if decrement < DECREMENT {
                break;
            }
        }
        Ok(Point {
            mu,
            delta_chi_square: self.delta_chi_square(&s),
            coordinates: s,
            converged: last < ENOUGH,
        })
    }

    fn newton_step(&self, s: &[f64], mu: f64) -> Result<(Vec<f64>, f64), Error> {
        let p = self.a.ncols();
        let mut factor = InformationFactor::new(p);
        let root = mu.sqrt();
        let mut row = vec![0.0; p];
        for i in 0..self.a.nrows() {
            let mut residual = self.z[i];
            for j in 0..p {
                row[j] = self.a[(i, j)] / root;
                residual -= self.a[(i, j)] * s[j];
            }
            factor.push_rows(&row, &[residual / root])?;
        }
        for link in 0..self.n_links {
            let at = 10 * link;
            let Some((rows, gradient)) = newton_rows(&symmetric(&s[at..])) else {
                unreachable!("steps stay inside the cone");
            };
            for i in 0..10 {
                row.fill(0.0);
                for k in 0..10 {
                    row[at + k] = rows[(i, k)];
                }
                factor.push_rows(&row, &[-gradient[i]])?;
            }
        }
        for at in 10 * self.n_links..10 * self.n_links + self.n_positive {
            row.fill(0.0);
            row[at] = 1.0 / s[at];
            factor.push_rows(&row, &[1.0 - s[at]])?;
        }
        let parts = factor.parts();
        let decrement = parts.z.iter().map(|z| z * z).sum::<f64>().sqrt();
        Ok((solve_upper(parts.r.as_ref(), &parts.z), decrement))
    }

    fn inside(&self, s: &[f64]) -> bool {
        let links = 10 * self.n_links;
        (0..self.n_links).all(|link| divergence(&symmetric(&s[10 * link..])).is_finite())
            && s[links..][..self.n_positive].iter().all(|x| *x > 0.0)
            && s.iter().all(|x| x.is_finite())
    }

    fn delta_chi_square(&self, s: &[f64]) -> f64 {
        (0..self.a.nrows())
            .map(|i| {
                let predicted: f64 = (0..s.len()).map(|j| self.a[(i, j)] * s[j]).sum();
                (predicted - self.z[i]).powi(2)
            })
            .sum()
    }

    /// Links and scalars always have a minimiser; a free parameter has one only if rows determine it.
    fn refuse_undetermined(&self, problem: &PhysicalProblem<'_>) -> Result<(), Error> {
        let p = self.a.ncols();
        let mut prior = vec![0.0; p];
        for link in 0..self.n_links {
            prior[10 * link..][..4].fill(1.0);
        }
        let cones = 10 * self.n_links + self.n_positive;
        prior[10 * self.n_links..cones].fill(1.0);
        // Scaled to the size of A, so that the cones' rows do not make free columns look like nothing.
        let size = self.a.norm_max().max(f64::MIN_POSITIVE);
        let mut factor = InformationFactor::new(p);
        let mut row = vec![0.0; p];
        for i in 0..self.a.nrows() {
            (0..p).for_each(|j| row[j] = self.a[(i, j)]);
            factor.push_rows(&row, &[0.0])?;
        }
        for j in 0..cones {
            row.fill(0.0);
            row[j] = size;
            factor.push_rows(&row, &[0.0])?;
        }
        let parts = factor.parts();
        let rank = rank_factor(parts.r.as_ref(), &parts.z);
        if rank.rank == p {
            return Ok(());
        }
        let column = rank.order[rank.rank];
        let standard = (0..p)
            .find(|&i| self.unwhiten[(i, column)] != 0.0)
            .unwrap_or(column);
        debug_assert!(problem.links.iter().all(|l| !l.columns.contains(&standard)));
        Err(Error::UndeterminedStandard { column: standard })
    }

    pub(super) fn report(
        &self,
        problem: &PhysicalProblem<'_>,
        point: &Point,
    ) -> PhysicalParameters {
        let s = &point.coordinates;
        let p = self.unwhiten.nrows();
        let standard: Vec<f64> = (0..p)
            .map(|i| (0..p).map(|j| self.unwhiten[(i, j)] * s[j]).sum())
            .collect();
        let k = problem.regrouping;
        let base = (0..k.nrows())
            .map(|i| (0..p).map(|j| k[(i, j)] * standard[j]).sum())
            .collect();
        let whitened: Vec<_> = (0..self.n_links)
            .map(|link| symmetric(&s[10 * link..]))
            .collect();
        PhysicalParameters {
            links: problem
                .links
                .iter()
                .map(|link| idim_model::InertialParameters(link.columns.map(|c| standard[c])))
                .collect(),
            divergence: whitened.iter().map(divergence).collect(),
            smallest_eigenvalue: whitened
                .iter()
                .map(|q| q.symmetric_eigenvalues().min())
                .collect(),
            delta_chi_square: point.delta_chi_square,
            standard,
            base,
        }
    }
}

/// `T`, standard × coordinates: links in order, positive scalars, free parameters.
#[track_caller]
fn unwhiten(problem: &PhysicalProblem<'_>, p: usize) -> Result<Mat<f64>, Error> {
    let mut taken = vec![false; p];
    let mut take = |column: usize| {
        assert!(column < p, "column {column} of {p} standard parameters");
        assert!(
            !std::mem::replace(&mut taken[column], true),
            "column {column} is named twice"
        );
    };
    let mut t = Mat::zeros(p, p);
    let mut at = 0;
    for (index, link) in problem.links.iter().enumerate() {
        let map = unwhitening(index, &link.prior)?;
        for (i, &column) in link.columns.iter().enumerate() {
            take(column);
            for a in 0..10 {
                t[(column, at + a)] = map[(i, a)];
            }
        }
        at += 10;
    }
    for scalar in problem.positive {
        take(scalar.column);
        if !(scalar.prior > 0.0 && scalar.prior.is_finite()) {
            return Err(Error::OutOfRange {
                name: "the prior of a positive parameter",
                value: scalar.prior,
                rule: "positive and finite",
            });
        }
        t[(scalar.column, at)] = scalar.prior;
        at += 1;
    }
    for column in (0..p).filter(|&c| !taken[c]) {
        t[(column, at)] = 1.0;
        at += 1;
    }
    Ok(t)
}
