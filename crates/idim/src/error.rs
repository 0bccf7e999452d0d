//! What stops a run.

use crate::excite::INTERRUPTED_CODE;
use std::path::PathBuf;
use std::process::ExitCode;

/// A run that cannot go on, with what to do next.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file cannot be written; nothing is left half-written.
    #[error("{}: cannot be written: {source}; choose another --out", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The robot file.
    #[error("{}: {source}", path.display())]
    Robot {
        /// The file.
        path: PathBuf,
        /// Why.
        source: idim_model::Error,
    },
    /// A robot described in the program's own terms.
    #[error(transparent)]
    Model(#[from] idim_model::Error),
    /// A log.
    #[error(transparent)]
    Measurement(#[from] idim_measurement::Error),
    /// The estimate.
    #[error(transparent)]
    Estimation(#[from] idim_estimation::Error),
    /// The trajectory.
    #[error(transparent)]
    Trajectory(#[from] idim_trajectory::Error),
    /// The excitation.
    #[error(transparent)]
    Excitation(#[from] idim_excitation::Error),
    /// A rank without a clear gap.
    #[error(
        "{message}; if an angle of the robot file was rounded, write it exactly, else hold the joint in doubt with --lock"
    )]
    AmbiguousRank {
        /// Which ranks, and which combination is in doubt.
        message: String,
    },
    /// The doctor found what would spoil the result.
    #[error(
        "{text}{count} finding{} would spoil the result; correct the log, or waive by name what you know to be right: --waive CODE[:JOINT]",
        if *count == 1 { "" } else { "s" }
    )]
    Findings {
        /// How many.
        count: usize,
        /// One line each; empty where they have been shown already.
        text: String,
    },
    /// Ctrl-C came before there was anything to return.
    #[error("interrupted before any motion was certified; nothing is written")]
    Interrupted,
    /// Everything was written, and `--strict` asked for more than the verdict gives.
    #[error("{verdict}; the results are written, --strict makes this an error")]
    Distrusted {
        /// The verdict of the report.
        verdict: String,
    },
    /// A rule of the command line or of a file that only this crate knows.
    #[error("{place}: {met}; {rule}")]
    Input {
        /// Where.
        place: String,
        /// What was met.
        met: String,
        /// The rule and the next step.
        rule: String,
    },
}

/// Exit code where the verdict is not what `--strict` asks for; 2 is that of a command line that cannot be read.
const DISTRUSTED: u8 = 3;

impl Error {
    /// What a process says of it: 1, and 3 for a result that `--strict` does not trust.
    pub(crate) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Distrusted { .. } => ExitCode::from(DISTRUSTED),
            Self::Interrupted => ExitCode::from(INTERRUPTED_CODE),
            _ => ExitCode::FAILURE,
        }
    }

    pub(crate) fn input(
        place: impl Into<String>,
        met: impl Into<String>,
        rule: impl Into<String>,
    ) -> Self {
        Self::Input {
            place: place.into(),
            met: met.into(),
            rule: rule.into(),
        }
    }
}
