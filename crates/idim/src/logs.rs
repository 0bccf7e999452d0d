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
        let warnings = check_log(&log, &loaded.robot)?;
        let said = log.notes.iter().chain(&warnings);
        logs.notes
            .extend(said.map(|n| format!("{}: {n}", path.display())));
        logs.measurements
            .push(Measurements::from_log(&log, &loaded.robot)?);
    }
    Ok(logs)
}
