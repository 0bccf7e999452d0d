//! Recorded logs in, conditioned samples out.
//!
//! A [`Log`] is what the file says, in SI units; [`Measurements`] are joint positions and torques.

mod clock;
mod dialect;
mod error;
mod header;
mod layout;
mod log;
mod measurements;
mod motion;
mod plausibility;
mod quantity;

pub use clock::{Clock, GAP, Gap, interpolate, read_clock, uniform_grid, uniform_interval};
pub use error::{Error, Place};
pub use header::{ColumnMapping, JointLabel, MappedColumn, joint_labels};
pub use log::{Drive, Log, read_csv};
pub use measurements::Measurements;
pub use motion::{JointMotion, check_motion, joint_motion};
pub use plausibility::{
    VelocityFit, check_clock_unit, check_log, check_positions, check_velocity, velocity_fit,
};
pub use quantity::Quantity;
