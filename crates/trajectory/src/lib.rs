//! Families of motion with exact derivatives, limits, and extrema that are certified rather than sampled.
//!
//! - [`FourierSeries`]: periodic, `q = q0 + Σ a_l/(ω l) sin(ω l t) − b_l/(ω l) cos(ω l t)` (Swevers et al. 1997;
//!   Radkhah, Kulić & Croft 2007). Linear in its coefficients: [`FourierBasis`], [`constraint_rows`], [`rest_rows`].
//! - [`QuinticPath`]: through points (q, qd) with zero acceleration there, as short as [`Limits`] of velocity and
//!   acceleration allow (Gautier & Khalil 1991).
//! - [`Certificate`]: the largest use of each limit and when, guaranteed for every instant of either.
//! - [`TrajectoryFile`]: either as RON or JSON.
//!
//! Searches start from [`initial_guess`] or [`random_series`]. Rad and s throughout (m for prismatic joints).
//!
//! ```
//! use idim_trajectory::{Limits, PathPoint, QuinticPath, random_series};
//!
//! let limits = Limits::new(vec![[-1.0, 1.0]; 2], vec![0.8; 2], vec![3.0; 2])?;
//!
//! // Five harmonics over ten seconds; every joint reaches one of its limits and exceeds none.
//! let series = random_series(&limits, 5, 10.0, 7);
//! let certificate = series.certificate(&limits);
//! assert!(certificate.certified);
//! let (joint, kind, used) = certificate.largest();
//! assert!((used.fraction - 1.0).abs() < 1e-9, "joint {joint}, {kind:?}");
//! let states = series.equispaced_states(1000);
//! assert_eq!(states.qdd(1).len(), 1000);
//!
//! // A path through one point on the fly, from rest to rest.
//! let home = PathPoint::at_rest(&[0.0, 0.0]);
//! let point = PathPoint { q: vec![0.5, -0.3], qd: vec![0.4, 0.0] };
//! let path = QuinticPath::shortest(&[home.clone(), point, home], &limits)?;
//! assert!(path.overshoot(&limits).is_empty());
//! assert!((path.certificate(&limits).largest().2.fraction - 1.0).abs() < 1e-9);
//! # Ok::<(), idim_trajectory::Error>(())
//! ```
//!
//! Not here: what a motion reveals about the robot (`idim-excitation`), torque limits, collisions.

mod basis;
mod certificate;
mod error;
mod file;
mod fourier;
mod initial;
mod limits;
mod quintic;
mod segment;
mod shortest;
mod trigonometric;

pub use basis::{FourierBasis, LinearRows, constraint_rows, rest_rows};
pub use certificate::{
    Certificate, Extremum, JointExtrema, JointUse, LimitKind, LimitUse, USE_TOLERANCE,
};
pub use error::Error;
pub use file::{
    Motion, MotionCoefficients, SegmentCoefficients, TRAJECTORY_SCHEMA, TrajectoryFile,
};
pub use fourier::FourierSeries;
pub use initial::{fit_velocities, initial_guess, random_series};
pub use limits::Limits;
pub use quintic::{Overshoot, PathPoint, QuinticPath};
pub use trigonometric::sampling_factor;
