//! `idim check`.

use super::{CHECK_SCHEMA, CheckResult, CheckedLog, Waiver, check_text, diagnose, marked};
use crate::cli::{RobotChanges, load, say};
use crate::error::Error;
use crate::load::LoadedRobot;
use crate::log_options::ReadingArgs;
use crate::log_spec::LogSpec;
use crate::logs::read_log_spec;
use crate::progress::Progress;
use crate::same_samples::{Prints, refuse_repeated};
use clap::Args;
use idim_measurement::Log;
use idim_measurement::doctor::Finding;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `check`.
#[derive(Debug, Clone, Args)]
pub struct CheckArgs {
    /// Robot file, .ron or .urdf.
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// Log to examine, named as for `identify`; may be repeated.
    #[arg(long, value_name = "LOG", num_args = 1.., required = true, value_parser = LogSpec::parse)]
    pub log: Vec<LogSpec>,
    /// How logs are read.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Print idim-check/1 (docs/check.md) instead of tables.
    #[arg(long)]
    pub json: bool,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
}

/// Examines logs; an error where a finding would spoil a result.
pub(crate) fn run_check(args: &CheckArgs, out: &mut dyn Write) -> Result<(), Error> {
    let loaded = load(&args.robot, &args.changes)?;
    let mapping = args.reading.mapping(&[&args.log])?;
    let [logs] = args.reading.cut([&args.log])?;
    let waivers = args.reading.waivers(&loaded.robot)?;
    let progress = Progress::new();
    let mut read = Vec::new();
    for spec in &logs {
        progress.stage(format!("reading {}", spec.name()));
        read.push((spec.name(), read_log_spec(spec, &loaded, &mapping)));
    }
    let prints: Vec<Prints<'_>> = read
        .iter()
        .filter_map(|(name, log)| Some(Prints::of_log(name, log.as_ref().ok()?)))
        .collect();
    refuse_repeated(&prints)?;
    drop(prints);
    progress.stage("examining");
    let logs = examined(read, &loaded, waivers)?;
    progress.finish();
    let findings = logs.iter().flat_map(|l| &l.findings);
    let result = CheckResult {
        schema: CHECK_SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        robot: loaded.robot.name().to_owned(),
        blocking: findings.filter(|f| f.blocks).count(),
        logs,
    };
    if args.json {
        let json = serde_json::to_string_pretty(&result)
            .map_err(|e| Error::input("check", e.to_string(), "a defect of this program"))?;
        say(out, &(json + "\n"))?;
    } else {
        say(out, &check_text(&result))?;
    }
    match result.blocking {
        0 => Ok(()),
        count => Err(Error::Findings {
            count,
            text: String::new(),
        }),
    }
}

/// Every log, and all of them together where there are several. A log that cannot be read as one is a finding; a file
/// that is not there is an error.
fn examined(
    read: Vec<(String, Result<Log, Error>)>,
    loaded: &LoadedRobot,
    waivers: &[Waiver],
) -> Result<Vec<CheckedLog>, Error> {
    let (mut checked, mut logs, mut at) = (Vec::new(), Vec::new(), Vec::new());
    for (name, log) in read {
        let (n_samples, duration_s, inferred, findings) = match log {
            Ok(log) => {
                let summary = (
                    log.n_samples(),
                    log.time[log.n_samples() - 1] - log.time[0],
                    log.notes.clone(),
                    Vec::new(),
                );
                at.push(checked.len());
                logs.push(log);
                summary
            }
            Err(Error::Measurement(error)) => (0, 0.0, Vec::new(), vec![Finding::from(&error)]),
            Err(other) => return Err(other),
        };
        checked.push(CheckedLog {
            log: name,
            n_samples,
            duration_s,
            inferred,
            findings: marked(findings, waivers),
        });
    }
    let mut diagnosed = diagnose(&logs, &loaded.robot);
    let together = diagnosed.pop().unwrap_or_default();
    for (k, findings) in at.into_iter().zip(diagnosed) {
        checked[k].findings = marked(findings, waivers);
    }
    if !together.is_empty() {
        checked.push(CheckedLog {
            log: "all logs together".into(),
            n_samples: logs.iter().map(Log::n_samples).sum(),
            duration_s: checked.iter().map(|c| c.duration_s).sum(),
            inferred: Vec::new(),
            findings: marked(together, waivers),
        });
    }
    Ok(checked)
}
