//! Commands beside `identify`: loads, drive gains, torque constants.

use crate::check::doubts_a_torque;
use crate::cli::{RobotChanges, load, say};
use crate::drive_gains::drive_gains;
use crate::error::Error;
use crate::fit::EstimationOptions;
use crate::identify::{Identification, IdentifyOptions, identify};
use crate::load::LoadedRobot;
use crate::log_options::{FittingArgs, ReadingArgs, SamplingArgs};
use crate::log_spec::LogSpec;
use crate::logs::{Logs, read_logs_despite};
use crate::payload::identify_payload;
use crate::report::warnings_text;
use crate::same_samples::{LOADED_ALREADY, refuse_same_files, refuse_shared};
use crate::table::{number, optional, table};
use crate::torque_constants::torque_constant;
use clap::Args;
use idim_measurement::{BackEmf, read_back_emf};
use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;

/// A robot, its runs without load and those with one.
#[derive(Debug, Clone, Args)]
pub struct LoadedRuns {
    /// Robot file, .ron or .urdf.
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// Log of the arm without load; may be repeated.
    #[arg(long, value_name = "LOG", num_args = 1.., required = true, value_parser = LogSpec::parse)]
    pub log: Vec<LogSpec>,
    /// Log of the arm with the load; may be repeated.
    #[arg(long, value_name = "LOG", num_args = 1.., required = true, value_parser = LogSpec::parse)]
    pub loaded: Vec<LogSpec>,
    /// Link that carries the load (default: the last).
    #[arg(long, value_name = "LINK")]
    pub on: Option<String>,
    /// How logs are read.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// How a log becomes samples.
    #[command(flatten)]
    pub sampling: SamplingArgs,
    /// What is fitted to them.
    #[command(flatten)]
    pub fitting: FittingArgs,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
    /// Print the answer as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `drive-gains`.
#[derive(Debug, Clone, Args)]
pub struct DriveGainsArgs {
    /// The runs.
    #[command(flatten)]
    pub runs: LoadedRuns,
    /// Weighed mass of the load, kg: the scale of everything.
    #[arg(long, value_name = "KG")]
    pub mass: f64,
}

/// Arguments of `torque-constants`.
#[derive(Debug, Clone, Args)]
pub struct TorqueConstantsArgs {
    /// CSV with a header: `speed` (of the motor, rad/s or as speed_rpm), `voltage` (terminals open, V or as voltage_mV), and
    /// `motor` where there are several.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Print the answer as JSON.
    #[arg(long)]
    pub json: bool,
}

/// The arm from its runs without load, and both sets of logs.
struct Runs {
    loaded: LoadedRobot,
    arm: Identification,
    without: Logs,
    with: Logs,
    link: usize,
    estimation: EstimationOptions,
}

impl Runs {
    /// What the doctor doubts of the logs.
    fn doubts(&self) -> impl Iterator<Item = String> {
        let findings = self.without.findings.iter().chain(&self.with.findings);
        let doubts = findings.filter(|f| f.is_doubt());
        doubts.map(|f| f.finding.to_string())
    }

    /// How the logs were read.
    fn inferred(&self) -> impl Iterator<Item = String> {
        let all = self.without.inferred.iter().chain(&self.with.inferred);
        all.cloned()
    }
}

fn runs(args: &LoadedRuns) -> Result<Runs, Error> {
    let loaded = load(&args.robot, &args.changes)?;
    let (columns, friction) = args.fitting.model()?;
    let options = IdentifyOptions {
        columns,
        sampling: args.sampling.options(&loaded.robot)?,
        friction,
        estimation: EstimationOptions {
            weighting: args.fitting.weighting(),
            robust: args.fitting.loss(),
            essential: false,
        },
        ..IdentifyOptions::default()
    };
    refuse_same_files(
        &args.loaded,
        &args.log,
        "--log and as --loaded",
        LOADED_ALREADY,
    )?;
    let mapping = args.reading.mapping(&[&args.log, &args.loaded])?;
    let [logs, loaded_logs] = args.reading.cut([&args.log, &args.loaded])?;
    let waivers = args.reading.waivers(&loaded.robot)?;
    let without = read_logs_despite(&logs, &loaded, &mapping, waivers, doubts_a_torque)?;
    let with = read_logs_despite(&loaded_logs, &loaded, &mapping, waivers, doubts_a_torque)?;
    refuse_shared(&with.prints(), &without.prints(), "--log", LOADED_ALREADY)?;
    let links = loaded.robot.links();
    let link = match &args.on {
        None => links.len() - 1,
        Some(name) => links.iter().position(|l| l.name == *name).ok_or_else(|| {
            let names: Vec<&str> = links.iter().map(|l| l.name.as_str()).collect();
            let rule = format!("the links are {}", names.join(", "));
            Error::input(format!("--on {name}"), "no such link", rule)
        })?,
    };
    // All of the runs without load train: what proves the arm is `identify`.
    let arm = identify(
        &loaded,
        without.measurements.clone(),
        without.measurements.clone(),
        &options,
    )?;
    Ok(Runs {
        loaded,
        arm,
        without,
        with,
        link,
        estimation: options.estimation,
    })
}

/// The load on a link of an arm that its own runs identify.
///
/// # Errors
/// Bad input.
pub(crate) fn payload(args: &LoadedRuns, out: &mut dyn Write) -> Result<(), Error> {
    let runs = runs(args)?;
    let found = identify_payload(
        &runs.loaded,
        &runs.arm,
        &runs.with.measurements,
        runs.link,
        &runs.estimation,
    )?;
    let mut notes = runs.arm.result.warnings.clone();
    notes.extend(runs.doubts());
    if args.json {
        let parameters: Vec<_> = (0..found.names.len())
            .map(|k| {
                serde_json::json!({
                    "name": found.names[k],
                    "value": found.values[k],
                    "std": found.standard_deviation[k],
                    "std_from_arm": found.from_arm[k],
                })
            })
            .collect();
        let json = serde_json::json!({
            "schema": "idim-payload/1",
            "link": runs.loaded.robot.links()[runs.link].name,
            "parameters": parameters,
            "noise": found.noise,
            "warnings": notes,
        });
        return say(out, &format!("{json:#}\n"));
    }
    let rows = (0..found.names.len()).map(|k| {
        [
            found.relations[k].clone(),
            number(found.values[k]),
            number(found.standard_deviation[k]),
            number(found.from_arm[k]),
        ]
    });
    let mut text = format!(
        "Load on {} (SI, in its frame)\n{}",
        runs.loaded.robot.links()[runs.link].name,
        table(["parameter", "value", "std", "of it from the arm"], rows),
    );
    let at = |name: &str| {
        found
            .names
            .iter()
            .position(|n| n.trim_end_matches(char::is_numeric) == name)
    };
    if let (Some(m), Some(x), Some(y), Some(z)) = (at("M"), at("MX"), at("MY"), at("MZ")) {
        let mass = found.values[m];
        let _ = writeln!(
            text,
            "mass {} kg, centre of mass ({}, {}, {}) m",
            number(mass),
            number(found.values[x] / mass),
            number(found.values[y] / mass),
            number(found.values[z] / mass),
        );
    }
    notes.extend(runs.inferred());
    say(out, &(text + &warnings_text(&notes)))
}

/// Gains of the drives from runs with and without a known load.
///
/// # Errors
/// Bad input.
pub(crate) fn run_drive_gains(args: &DriveGainsArgs, out: &mut dyn Write) -> Result<(), Error> {
    if !(args.mass > 0.0 && args.mass.is_finite()) {
        let rule = "give the weighed mass in kg, above zero";
        return Err(Error::input("--mass", args.mass.to_string(), rule));
    }
    let fitting = args.runs.fitting.given();
    let unused = ["--weighting", "--robust"];
    if let Some(option) = fitting.iter().find(|o| unused.contains(o)) {
        return Err(Error::input(
            format!("drive-gains and {option}"),
            "total least squares weights each joint by its own noise, with no loss beside it",
            format!("leave out {option}"),
        ));
    }
    let runs = runs(&args.runs)?;
    let found = drive_gains(
        &runs.loaded,
        &runs.arm,
        &runs.without.measurements,
        &runs.with.measurements,
        runs.link,
        args.mass,
    )?;
    let mut notes = found.warnings;
    notes.extend(runs.doubts());
    if args.runs.json {
        let json = serde_json::json!({
            "schema": "idim-drive-gains/1",
            "joints": runs.arm.joints,
            "gains": found.gains,
            "std": found.standard_deviation,
            "validity": found.validity,
            "warnings": notes,
        });
        return say(out, &format!("{json:#}\n"));
    }
    let rows = runs.arm.joints.iter().enumerate().map(|(k, name)| {
        [
            name.clone(),
            found.gains[k].map_or_else(|| "not separable".into(), number),
            optional(found.standard_deviation[k]),
        ]
    });
    let text = format!(
        "Drive gains: true torque per unit of the recorded one\n{}validity {}\n",
        table(["joint", "gain", "std"], rows),
        optional(found.validity),
    );
    notes.extend(runs.inferred());
    say(out, &(text + &warnings_text(&notes)))
}

/// Torque constants from speeds and voltages.
///
/// # Errors
/// Bad input.
pub(crate) fn torque_constants(
    args: &TorqueConstantsArgs,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let bytes = std::fs::read(&args.file).map_err(|source| Error::Read {
        path: args.file.clone(),
        source,
    })?;
    let (motors, inferred) = read_back_emf(&bytes, &args.file.display().to_string())?;
    let mut rows = Vec::new();
    let mut json = Vec::new();
    let mut notes = inferred.clone();
    for BackEmf {
        motor,
        speed,
        voltage,
    } in &motors
    {
        let k = torque_constant(speed, voltage)?;
        if k.speeds[0] * k.speeds[1] >= 0.0 {
            notes.push(format!(
                "{motor}: turned in one direction only, so an offset that changes with direction is part of the constant; turn it both ways"
            ));
        }
        json.push(serde_json::json!({
            "motor": motor, "torque_constant": k.value, "std": k.standard_deviation,
            "offset": k.offset, "rms": k.rms, "n_samples": speed.len(),
        }));
        rows.push([
            motor.clone(),
            number(k.value),
            number(k.standard_deviation),
            number(k.offset),
            number(k.rms),
            speed.len().to_string(),
        ]);
    }
    if args.json {
        let json = serde_json::json!({
            "schema": "idim-torque-constants/1", "motors": json, "inferred": inferred,
        });
        return say(out, &format!("{json:#}\n"));
    }
    let header = [
        "motor",
        "constant N·m/A",
        "std",
        "offset V",
        "rms V",
        "samples",
    ];
    let text = format!("Torque constants from back-EMF\n{}", table(header, rows));
    say(out, &(text + &warnings_text(&notes)))
}
