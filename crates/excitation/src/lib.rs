//! The motion that reveals most.
//!
//! A motion gives rows `W` of `y = W X`. How far noise reaches the parameters is bounded by the condition number,
//!
//! ```text
//! ‖δX‖ / ‖X‖ ≤ Cond(W) ‖δY‖ / ‖Y‖        Gautier & Khalil 1991, eq. 12
//! ```
//!
//! and the volume of their uncertainty by `det (WᵀW)⁻¹`. This crate measures both ([`Conditioning`], [`Criterion`])
//! and finds motions that make them small:
//! - [`optimise_points_powell`]: chained points `(q, q̇)` of the energy model, as Gautier & Khalil do;
//! - [`search_points`]: the same by exact gradients and many starts, far below what Powell's method reaches;
//! - [`optimise_fourier`]: a periodic motion of the torque model inside certified limits, as Radkhah, Kulić & Croft do.
//!
//! ```
//! use idim_excitation::{EnergyDesign, PointLimits, random_condition_statistics};
//! use idim_model::{Columns, Parameter, ParameterKind::{MX, MY, ZZ}, robot_from_ron};
//!
//! // A pendulum of two links: its six base parameters, and what thirty random energy differences tell of them.
//! let robot = robot_from_ron(idim_fixtures::PLANAR2R)?;
//! let column = |(kind, index)| Parameter { kind, index };
//! let base = [(ZZ, 0), (MX, 0), (MY, 0), (ZZ, 1), (MX, 1), (MY, 1)].map(column);
//! let limits = PointLimits { position: vec![[-1.0, 1.0]; 2], velocity: vec![2.0; 2] };
//! let design = EnergyDesign::new(&robot, &Columns(base.to_vec()), limits)?;
//! let chance = random_condition_statistics(&design, 30, 100, 1);
//! assert!(chance.min < chance.median && chance.median < 1e4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not here: which columns are independent (`idim-base-params`), families of motion and their limits
//! (`idim-trajectory`), estimation.

mod added_columns;
mod box_lbfgs;
mod clearance;
mod condition;
mod criterion;
mod dense;
#[cfg(test)]
mod dual;
mod eigenvalues;
mod energy;
mod energy_gradient;
mod entry_bound;
mod error;
mod fourier;
mod fourier_chart;
mod fourier_contraction;
mod fourier_curvature;
mod fourier_interior;
mod fourier_limits;
mod fourier_objective;
mod fourier_options;
mod fourier_rounds;
mod fourier_search;
mod information;
mod padded;
mod path_certificate;
mod path_penalty;
mod point_descent;
mod point_moves;
mod point_objective;
mod point_rows;
mod point_schedule;
mod points;
mod points_powell;
mod points_search;
mod powell;
mod random_condition;
mod schatten;
mod segments;
mod spectrum;
mod torque_prior;
mod torque_rate;

pub use added_columns::AddedColumn;
pub use clearance::Clearance;
pub use condition::{ConditionNumber, ConditionRoute, condition_number, log_condition_gradient};
pub use criterion::{ConditionNumbers, Conditioning, Criterion, Equilibrium, Scaling};
pub use error::Error;
pub use fourier::{
    FourierDesign, FourierProgress, FourierWatch, REPORT_REFINEMENT, best_random_fourier,
    optimise_fourier, optimise_fourier_watched, series_conditioning, states_conditioning,
    weighted_conditioning,
};
pub use fourier_options::{FourierEnds, FourierOptions};
pub use information::{information_matrix, information_with_observations};
pub use path_certificate::{ClearanceCertificate, TorqueCertificate};
pub use points::{EnergyDesign, PointLimits};
pub use points_powell::{PointDesign, PowellPointOptions, optimise_points_powell};
pub use points_search::{PointSearchOptions, SearchProgress, search_points};
pub use powell::{PowellOptions, PowellOutcome, powell};
pub use random_condition::{ConditionStatistics, random_condition_statistics};
pub use torque_prior::TorquePrior;
