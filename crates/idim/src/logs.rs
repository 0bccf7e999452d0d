//! Logs from files, checked before anything is computed.

use crate::error::Error;
use crate::load::LoadedRobot;
use idim_measurement::{ColumnMapping, Measurements, check_log, joint_labels, read_csv};
use std::path::PathBuf;

/// Logs read and what was noted about them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Logs {
    pub(crate) measurements: Vec<Measurements>,
    pub(crate) notes: Vec<String>,
}

/// Fewer samples of every joint than this cannot tell a dozen parameters a joint from noise.
const FEWEST_SAMPLES: usize = 50;

/// Reads and checks logs of one robot.
pub(crate) fn read_logs(files: &[PathBuf], loaded: &LoadedRobot) -> Result<Logs, Error> {
    let labels = joint_labels(&loaded.robot, &loaded.described);
    let mut logs = Logs::default();
    for path in files {
        let bytes = std::fs::read(path).map_err(|source| Error::Read {
            path: path.clone(),
            source,
        })?;
        let log = read_csv(
            &bytes[..],
            &path.display().to_string(),
            &labels,
            &ColumnMapping::default(),
        )?;
        if log.n_samples() < FEWEST_SAMPLES {
            return Err(Error::input(
                path.display().to_string(),
                format!("{} samples", log.n_samples()),
                format!("identification needs at least {FEWEST_SAMPLES}; record a longer motion"),
            ));
        }
        let warnings = check_log(&log, &loaded.robot)?;
        let said = log.notes.iter().chain(&warnings);
        logs.notes
            .extend(said.map(|n| format!("{}: {n}", path.display())));
        logs.measurements
            .push(Measurements::from_log(&log, &loaded.robot)?);
    }
    Ok(logs)
}
