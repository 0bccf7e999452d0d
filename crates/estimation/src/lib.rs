//! Least squares and its relatives: parameters of `y = W x + ρ`, their uncertainty, and what the rows do not determine.
//!
//! One equation: the running QR `[W | y] -> [R z; 0 e]`, with `‖y - W x‖² = ‖z - R x‖² + e²` for every `x` (Bierman 1977). `W` is
//! never stored; a log of any length becomes a triangle of a few kilobytes, and triangles merge.
//!
//! - [`InformationFactor`] folds rows in, or takes their products where those are accurate enough; [`solve`] and [`solve_with_known_noise`] read the answer.
//! - [`weighted_least_squares`] weights the joints by the covariance of their residuals; [`NoiseCovariance`] whitens rows by hand.
//! - [`partial_least_squares`] does both of a dense `W` some of whose rows are left out, with uncertainty for noise that remembers.
//! - [`robust_least_squares`] loses outliers, [`essential_parameters`] what the data do not need, [`total_least_squares`] finds drive gains.
//! - [`physically_consistent`] asks whether real bodies could have the parameters, and which are most plausible.
//! - [`ResidualStatistics`] says how well a model predicts, joint by joint; [`ljung_box`] whether its residual is white.
//!
//! ```
//! use idim_estimation::{InformationFactor, Solution, solve};
//!
//! // y = 3 a - b, with a third column that never moves.
//! let mut factor = InformationFactor::new(3);
//! for k in 0..100 {
//!     let (a, b) = (f64::from(k).sin(), f64::from(k).cos());
//!     factor.push_rows(&[a, b, 0.0], &[3.0 * a - b])?;
//! }
//! let Solution::RankDeficient(outcome) = solve(&factor)? else { panic!("column 2 is never excited") };
//! assert_eq!((outcome.rank, &outcome.undetermined[..]), (2, &[2][..]));
//! assert_eq!(outcome.values[2], None);
//!
//! let Solution::Determined(fit) = solve(&factor.select(&[0, 1]))? else { panic!("the others are") };
//! assert!((fit.values[0] - 3.0).abs() < 1e-12 && (fit.values[1] + 1.0).abs() < 1e-12);
//! # Ok::<(), idim_estimation::Error>(())
//! ```
//!
//! It knows no robots but the ten parameters of a body: rows come from the caller, `row = sample · n_joints + joint`. It regularises nothing and inverts no singular
//! matrix in silence.

mod autocorrelation;
mod conditioning;
mod consistency;
mod error;
mod essential;
mod householder;
mod information;
mod jackknife;
mod noise;
mod partial;
mod products;
mod quantile;
mod rank;
mod residuals;
mod reweighted;
mod robust;
mod sandwich;
mod solve;
mod spans;
mod total;
mod triangular;
mod weighted;

pub use autocorrelation::{
    BlockScores, LjungBox, autocorrelation, effective_sample_size, ljung_box,
};
pub use conditioning::{
    ConditionNumber, NEAR_SINGULAR_CONDITION, condition_number, matrix_error_bound,
    observation_error_bound,
};
pub use consistency::{
    ConsistencyOptions, LinkPrior, PhysicalEstimate, PhysicalParameters, PhysicalProblem,
    PositivePrior, Price, Verdict, physically_consistent,
};
pub use error::{Error, Place};
pub use essential::{
    DroppedParameter, EssentialOptions, EssentialParameters, essential_parameters,
};
pub use information::{InformationFactor, Parts, factor_of};
pub use noise::{NoiseCovariance, ResidualCovariance};
pub use partial::{
    PartialEstimate, PartialOptions, PartialRows, partial_least_squares, whitened_factor,
};
pub use products::PRODUCTS_LIMIT;
pub use quantile::{chi_square_quantile, f_quantile, student_t_quantile};
pub use rank::{RANK_TOLERANCE, VANISHING_COLUMN};
pub use residuals::{JointResidual, ResidualStatistics};
pub use reweighted::{RobustEstimate, RobustOptions, RobustSolution, robust_least_squares};
pub use robust::{
    HUBER_K, MAD_TO_SIGMA, RobustLoss, RobustWeights, TUKEY_C, mad_scale, robust_weights,
};
pub use sandwich::sandwich_covariance;
pub use solve::{Estimate, NoiseSource, RankDeficiency, Solution, solve, solve_with_known_noise};
pub use spans::{DownWeightedSpan, SpanOptions, down_weighted_spans};
pub use total::{DriveGainSample, TotalLeastSquares, TotalSolution, total_least_squares};
pub use weighted::{
    WeightedEstimate, WeightedSolution, Weighting, WeightingOptions, weighted_least_squares,
    weighted_least_squares_dense,
};
