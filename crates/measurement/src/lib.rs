//! Recorded logs in, conditioned samples out.
//!
//! A [`Log`] is what the file says, in SI units; [`Measurements`] are joint positions and torques; [`condition`] turns
//! them into smooth states with velocity and acceleration, and a [`Decimator`] maps the regressor's columns and the
//! torque alike, so that `τ = W β` stays true.
//!
//! ```
//! use idim_measurement::{ColumnMapping, ConditioningOptions, JointLabel, LowPass, Measurements};
//! use idim_measurement::{Drive, condition, read_csv};
//!
//! let joints = [JointLabel { name: "shoulder".into(), number: 1, kind: idim_model::JointKind::Revolute, held: false }];
//! let mut csv = String::from("t_ms,q_shoulder_deg,tau1_Nm\n");
//! for k in 0..200 {
//!     let t = 0.01 * f64::from(k);
//!     csv += &format!("{},{},{}\n", 10 * k, 30.0 * t.sin(), t.cos());
//! }
//! let log = read_csv(csv.as_bytes(), "run.csv", &joints, &ColumnMapping::default())?;
//! let Drive::Torque(torque) = log.drive else { unreachable!() };
//! let measured = Measurements {
//!     file: log.file, joints: log.joints, time: log.time, q: log.q, qd: log.qd, qdd: log.qdd, torque,
//! };
//! let options = ConditioningOptions {
//!     low_pass: Some(LowPass { order: 4, cutoff: 10.0 }),
//!     ..ConditioningOptions::default()
//! };
//! let segment = &condition(&measured, &options)?.segments[0];
//! let (t, qd) = (segment.time[50], segment.states.qd(0)[50]);
//! assert!((qd - 30f64.to_radians() * t.cos()).abs() < 1e-4);
//! # Ok::<(), idim_measurement::Error>(())
//! ```
//!
//! [`formats::read_log`] reads any format by the file's ending; [`doctor::examine_log`] says what is wrong with a
//! recording before anything is computed from it. Neither decides how a log is filtered: the caller does, and every
//! choice is recorded ([`Choice`]).

mod back_emf;
mod clock;
mod columns;
mod conditioning;
mod csv_log;
mod decimate;
mod dialect;
mod differentiate;
pub mod doctor;
mod error;
mod filter;
mod finder;
pub mod formats;
mod harmonics;
mod header;
mod join;
mod layout;
mod left_out;
mod log;
mod mapping;
mod measurements;
mod motion;
mod period;
mod plausibility;
mod quantity;
mod sheet;

pub use back_emf::{BackEmf, read_back_emf};
pub use clock::{Clock, GAP, Gap, interpolate, read_clock, uniform_grid, uniform_interval};
pub use columns::{NamedColumn, log_from_columns};
pub use conditioning::{
    Choice, Conditioned, ConditioningOptions, Derivatives, LowPass, Segment, condition,
};
pub use csv_log::read_csv;
pub use decimate::Decimator;
pub use differentiate::{first_difference, second_difference};
pub use error::{Error, Place};
pub use filter::{Section, butterworth, chebyshev, filter_zero_phase, padding, settling};
pub use harmonics::{Harmonics, fit_harmonics};
pub use header::{JointLabel, joint_labels};
pub use join::read_csv_files;
pub use log::{Drive, Log};
pub use mapping::{ColumnMapping, MappedColumn, TorqueDelay};
pub use measurements::Measurements;
pub use motion::{JointMotion, check_motion, joint_motion};
pub use period::{Period, PeriodAverage, REPEATS, average_periods, find_period};
pub use plausibility::{
    VelocityFit, check_clock_unit, check_log, check_positions, check_velocity, infer_time_unit,
    velocity_fit,
};
pub use quantity::Quantity;
