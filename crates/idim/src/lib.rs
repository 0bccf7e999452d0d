//! From a robot and its logs to a dynamic model with proof of how good it is.
//!
//! The pipeline (`identify`), the reproductions of two papers (`puma`, `crs_a460`), the command line and the report.

mod baselines;
pub mod check;
mod choice;
pub mod cli;
mod columns;
mod commands;
pub mod crs_a460;
mod design;
mod drive_gains;
mod error;
pub mod excite;
pub mod export;
mod fit;
mod friction;
mod identify;
mod load;
mod log_spec;
mod logs;
mod meaning;
mod noise_study;
mod output;
mod papers;
mod payload;
mod plan;
pub mod plot;
mod plots;
pub mod predictor;
mod progress;
pub mod puma;
pub mod report;
pub mod report_html;
mod result;
mod samples;
pub mod simulate;
mod simulated_log;
mod standstill;
mod structure;
mod table;
mod torque_constants;
mod transmission;

pub use columns::{ExtraColumn, FrictionTerm, ModelColumns};
pub use commands::{DriveGainsArgs, LoadedRuns, TorqueConstantsArgs};
pub use drive_gains::{DriveGains, drive_gains};
pub use error::Error;
pub use fit::EstimationOptions;
pub use friction::{FrictionChoice, JointFriction, parse_friction};
pub use identify::{
    FrictionPart, Identification, IdentifyOptions, Prediction, TRAINING_SHARE, identify,
};
pub use load::{Changes, LoadedRobot, load_robot};
pub use log_spec::LogSpec;
pub use output::write_atomically;
pub use payload::{Payload, identify_payload};
pub use plan::SamplingOptions;
pub use progress::Progress;
pub use result::*;
pub use structure::{KeepOrder, Structure};
pub use torque_constants::{TorqueConstant, torque_constant};
