//! The motion that reveals most.
//!
//! A motion gives rows `W` of `y = W X`; how far noise in `y` or `W` reaches the parameters is bounded by the
//! condition number of `W` (Gautier & Khalil 1991, eqs. 12, 13), its volume by `det WᵀW`. This crate measures that
//! ([`Conditioning`], [`Criterion`]) and finds motions that make it small:
//! - [`optimise_points_powell`]: chained points `(q, q̇)` of the energy model, as Gautier & Khalil do.

mod criterion;
mod dense;
mod energy;
mod error;
mod points;
mod points_powell;
mod powell;
mod random_condition;

pub use criterion::{ConditionNumbers, Conditioning, Criterion, Equilibrium, Scaling};
pub use error::Error;
pub use points::{EnergyDesign, PointLimits};
pub use points_powell::{PointDesign, PowellPointOptions, optimise_points_powell};
pub use powell::{PowellOptions, PowellOutcome, powell};
pub use random_condition::{ConditionStatistics, random_condition_statistics};
