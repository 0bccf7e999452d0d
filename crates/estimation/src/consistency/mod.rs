//! Parameters that a real rigid body can have.
//!
//! The data fix base parameters `β = K π` only up to their covariance; of all robots `π` with positive definite pseudo-inertias (Wensing, Kim &
//! Slotine 2018) and positive friction two are asked for: how near the data allow (the price of physicality, in χ²), and which one
//! inside the confidence region is most like the prior, by the entropic divergence `tr Q - log det Q - 4` of Lee, Wensing & Park 2020.

mod cone;
mod path;

use crate::error::Error;
use crate::information::InformationFactor;
use crate::quantile::chi_square_quantile;
use faer::MatRef;
use idim_model::InertialParameters;
use path::{Path, Point};

/// Where the ten parameters of a link stand among the standard parameters, and what they were believed to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkPrior {
    /// Columns of `XX XY XZ YY YZ ZZ MX MY MZ M`.
    pub columns: [usize; 10],
    /// A body that can exist: from CAD, or guessed from the geometry.
    pub prior: InertialParameters,
}

/// A standard parameter that cannot be negative (friction, rotor inertia).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositivePrior {
    /// Its column.
    pub column: usize,
    /// What it was believed to be, positive.
    pub prior: f64,
}

/// The question of [`physically_consistent`]. Standard parameters in neither list are free.
#[derive(Debug, Clone, Copy)]
pub struct PhysicalProblem<'a> {
    /// Triangle of the base regressor `W_b`, whitened rows for preference.
    pub factor: &'a InformationFactor,
    /// Standard deviation of a row: the `sigma` of the fit, 1 for whitened rows.
    pub sigma: f64,
    /// `K`, base × standard: `base_parameters = K · standard_parameters`.
    pub regrouping: MatRef<'a, f64>,
    /// Links of which a body is asked for.
    pub links: &'a [LinkPrior],
    /// Scalars that must be positive.
    pub positive: &'a [PositivePrior],
}

/// Options of [`physically_consistent`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConsistencyOptions {
    /// The most plausible robot is sought on the border of this confidence region of the data; 0.5 to 0.95.
    pub region: f64,
    /// Level at which the price contradicts any rigid body; 0.95 typical.
    pub level: f64,
    /// The lower bound of the price holds for robots whose whitened traces are this many times those of the prior on average; 10 typical.
    pub heaviest: f64,
}

impl Default for ConsistencyOptions {
    /// 0.5, 0.95, 10.
    fn default() -> Self {
        Self {
            region: 0.5,
            level: 0.95,
            heaviest: 10.0,
        }
    }
}

/// What the data say of rigid bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Some robot with real bodies lies within the confidence region of the level.
    Possible,
    /// None does: the model or the data are wrong (units, sign, gravity, friction left out).
    Contradicted,
    /// The bounds of the price lie on both sides of the limit.
    Undecided,
}

/// The least `Δχ² = ‖R (K π - β_LS)‖²/σ²` that real bodies cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// Reached by `closest`: an upper bound of the least.
    pub delta_chi_square: f64,
    /// A lower bound of the least, by duality, for robots not heavier than [`ConsistencyOptions::heaviest`] allows.
    pub lower_bound: f64,
    /// The quantile of χ² with as many degrees of freedom as base parameters.
    pub limit: f64,
    /// Their comparison.
    pub verdict: Verdict,
}

/// One robot with real bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalParameters {
    /// Standard parameters.
    pub standard: Vec<f64>,
    /// Base parameters `K π`.
    pub base: Vec<f64>,
    /// The links, in the order of the problem.
    pub links: Vec<InertialParameters>,
    /// Distance from the best fit in χ².
    pub delta_chi_square: f64,
    /// Divergence of each link from its prior.
    pub divergence: Vec<f64>,
    /// Smallest eigenvalue of each link's pseudo-inertia, of the whitened matrix: 1 is the prior, 0 a body that cannot be.
    pub smallest_eigenvalue: Vec<f64>,
}

/// Outcome of [`physically_consistent`].
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub struct PhysicalEstimate {
    /// What real bodies cost.
    pub price: Price,
    /// The robot that (nearly) pays the least; at the border of what can be, so not one to use.
    pub closest: PhysicalParameters,
    /// The robot most like the prior among those inside the confidence region; `None` if the region holds no real robot.
    pub most_plausible: Option<PhysicalParameters>,
    /// Newton steps taken.
    pub n_steps: usize,
}

/// The price of physicality and the most plausible robot.
///
/// Minimises `‖R K π - z‖²/(2 μ σ²) + Σ D(P_j ‖ P⁰_j)` over falling `μ`: each minimiser is the robot nearest the prior among those with its
/// `Δχ²`, so the path crosses the confidence region at the most plausible one and ends at the closest. No weight is left to choose.
///
/// # Errors
/// [`Error::UnphysicalPrior`], [`Error::OutOfRange`], [`Error::Overflow`]; [`Error::UndeterminedStandard`] for a free parameter that no row determines.
///
/// # Panics
/// If the sizes of `factor` and `regrouping` differ, or a column is out of range or named twice.
#[track_caller]
pub fn physically_consistent(
    problem: &PhysicalProblem<'_>,
    options: &ConsistencyOptions,
) -> Result<PhysicalEstimate, Error> {
    for (name, value) in [
        ("the confidence region", options.region),
        ("the level of the test", options.level),
    ] {
        if !(value > 0.0 && value < 1.0) {
            return Err(Error::OutOfRange {
                name,
                value,
                rule: "inside (0, 1)",
            });
        }
    }
    let mut path = Path::new(problem)?;
    let freedom = problem.regrouping.nrows() as f64;
    let target = chi_square_quantile(options.region, freedom);
    let limit = chi_square_quantile(options.level, freedom);
    let (most_plausible, closest) = path.follow(target, limit, options.heaviest)?;
    let lower_bound = path.lower_bound(&closest, options.heaviest);
    let delta_chi_square = closest.delta_chi_square;
    let verdict = if delta_chi_square <= limit {
        Verdict::Possible
    } else if lower_bound > limit {
        Verdict::Contradicted
    } else {
        Verdict::Undecided
    };
    let report = |point: &Point| path.report(problem, point);
    Ok(PhysicalEstimate {
        price: Price {
            delta_chi_square,
            lower_bound,
            limit,
            verdict,
        },
        closest: report(&closest),
        most_plausible: most_plausible.as_ref().map(report),
        n_steps: path.n_steps,
    })
}
