//! From a robot and its logs to a dynamic model with proof of how good it is.
//!
//! The pipeline (`identify`), the reproductions of two papers (`puma`, `crs_a460`), the command line and the report.

pub mod check;
pub mod cli;
pub mod crs_a460;
mod design;
mod error;
pub mod excite;
pub mod export;
mod identify;
mod load;
mod log_spec;
mod logs;
mod noise_study;
mod output;
mod papers;
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
mod structure;
mod table;
mod transmission;

pub use error::Error;
pub use identify::{
    FrictionPart, Identification, IdentifyOptions, Prediction, TRAINING_SHARE, identify,
};
pub use load::{Changes, LoadedRobot, load_robot};
pub use log_spec::LogSpec;
pub use output::write_atomically;
pub use progress::Progress;
pub use result::*;
pub use structure::{KeepOrder, Structure};
