//! The command line, shared by the binary and the workspace's driver.

use crate::check::{CheckArgs, Waiver, run_check};
use crate::commands::{self, DriveGainsArgs, LoadedRuns, TorqueConstantsArgs};
use crate::error::Error;
use crate::excite::{ExciteArgs, INTERRUPTED_CODE, run_excite};
use crate::export::exports;
use crate::fit::EstimationOptions;
use crate::friction::parse_friction;
use crate::identify::{IdentifyOptions, identify};
use crate::load::{Changes, LoadedRobot, load_robot};
use crate::log_spec::LogSpec;
use crate::logs::{read_logs, read_mapping};
use crate::output::{remove_earlier, write_atomically};
use crate::plan::SamplingOptions;
use crate::progress::Progress;
use crate::report::{identification_text, paper_text, reduction_text, warnings_text};
use crate::report_html::{file_settings, page_of_logs, shell_line};
use crate::result::IdentificationResult;
use crate::simulated_log::{SimulateArgs, run_simulate};
use crate::structure::{KeepOrder, Structure};
use crate::{crs_a460, plots, puma};
use clap::{Args, Subcommand, ValueEnum};
use idim_estimation::{HUBER_K, RobustLoss, TUKEY_C, Weighting};
use idim_model::DriveColumns;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// What idim can be asked.
#[derive(Debug, Clone, Subcommand)]
pub enum Command {
    /// Identify a robot from its logs, or reproduce the papers.
    Identify(IdentifyArgs),
    /// Examine logs before anything is computed from them: what is wrong, where, and what to do.
    Check(CheckArgs),
    /// Show which parameters of a robot the motors can feel at all.
    Reduce(ReduceArgs),
    /// Write the log that a robot with known inertia would leave behind.
    Simulate(SimulateArgs),
    /// Design the motion that reveals most, inside all limits.
    Excite(ExciteArgs),
    /// Find the load on an arm from runs without and with it.
    Payload(LoadedRuns),
    /// Find what each drive's signal is worth, from runs without and with a load of known mass.
    DriveGains(DriveGainsArgs),
    /// Find motors' torque constants from back-EMF: speed and open-terminal voltage.
    TorqueConstants(TorqueConstantsArgs),
}

/// A paper idim reproduces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Paper {
    /// Gautier & Khalil 1991.
    Puma,
    /// Radkhah, Kulić & Croft 2007.
    CrsA460,
}

/// A column beside the inertial ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Column {
    /// Viscous friction.
    Viscous,
    /// Coulomb friction.
    Coulomb,
    /// Constant torque.
    Offset,
    /// Rotor inertia.
    Rotor,
}

/// How a robot is mounted and held.
#[derive(Debug, Clone, Args)]
pub struct RobotChanges {
    /// Gravity in the base frame, m/s², as X,Y,Z (default: as in the file, 0,0,-9.81 for URDF).
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_gravity, allow_hyphen_values = true)]
    pub gravity: Option<[f64; 3]>,
    /// Hold a joint at a position (rad or m, default 0); may be repeated.
    #[arg(long, value_name = "JOINT[=VALUE]", value_parser = parse_lock)]
    pub lock: Vec<(String, f64)>,
}

/// Arguments of `identify`.
#[derive(Debug, Clone, Args)]
pub struct IdentifyArgs {
    /// The paper to reproduce; both in turn when neither a paper nor a robot is given.
    #[arg(conflicts_with_all = ["robot", "log"])]
    pub paper: Option<Paper>,
    /// Robot file, .ron or .urdf.
    #[arg(long, value_name = "FILE", requires = "log")]
    pub robot: Option<PathBuf>,
    /// Log to learn from (CSV, Parquet, npz, rosbag2): FILE, FILE+FILE (columns side by side), either with @A..B (samples); may be repeated.
    #[arg(long, value_name = "LOG", num_args = 1.., requires = "robot", value_parser = LogSpec::parse)]
    pub log: Vec<LogSpec>,
    /// Log to validate on, named as --log (default: the last 30 % of each log).
    #[arg(long, value_name = "LOG", num_args = 1.., requires = "log", value_parser = LogSpec::parse)]
    pub validate: Vec<LogSpec>,
    /// Which column holds what, where the header does not say so (docs/logs.md).
    #[arg(long, alias = "map", value_name = "FILE", requires = "log")]
    pub mapping: Option<PathBuf>,
    /// Accept a finding of the log doctor by name, of all joints or of one; may be repeated.
    #[arg(long, value_name = "CODE[:JOINT]")]
    pub waive: Vec<Waiver>,
    /// Folder for results: DIR/ROBOT/result.json and plots.
    #[arg(long, value_name = "DIR", default_value = "idim-out")]
    pub out: PathBuf,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
    /// Columns beside the inertial ones (default: all four).
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "COLUMN")]
    pub columns: Option<Vec<Column>>,
    /// Take q, qd, qdd and torque as they are: no filter, no differentiation, no decimation.
    #[arg(long)]
    pub as_recorded: bool,
    /// Low-pass of positions and velocities, Hz (default: by the error on blocks held out).
    #[arg(long, value_name = "HZ", value_parser = parse_positive)]
    pub cutoff: Option<f64>,
    /// Rows a second after the parallel decimation, Hz (default: from the cutoff).
    #[arg(long, value_name = "HZ", value_parser = parse_positive)]
    pub rate: Option<f64>,
    /// Differentiate positions though velocities are recorded.
    #[arg(long)]
    pub derive_velocity: bool,
    /// Leave out the rows of a joint slower than this, rad/s (m/s): one number, or one a joint; 0 for none (default: a
    /// fiftieth of its largest speed).
    #[arg(long, value_name = "SPEED", value_delimiter = ',', value_parser = parse_speed)]
    pub dead_band: Vec<f64>,
    /// Friction terms, of all joints or of one.
    #[arg(
        long,
        value_name = "TERMS",
        help = "Friction terms: auto, or [JOINT=]viscous,coulomb,offset,asymmetric,cubic,root,stribeck[:SPEED],load,tanh:SPEED; may be repeated"
    )]
    pub friction: Vec<String>,
    /// Weights: the joints' full residual covariance, or one variance a joint.
    #[arg(long, value_enum, default_value_t = WeightingChoice::Full)]
    pub weighting: WeightingChoice,
    /// Take the say from outliers: contacts, stops, dropped packets.
    #[arg(long, value_enum)]
    pub robust: Option<RobustChoice>,
    /// Keep only the parameters that the residual would miss; the others are listed with their interval.
    #[arg(long)]
    pub essential: bool,
}

/// Which part of the residual covariance weights the rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum WeightingChoice {
    /// Variances and correlations between the joints.
    Full,
    /// One variance a joint.
    Diagonal,
}

/// A loss that outliers lose their say by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RobustChoice {
    /// Convex: an outlier keeps a limited pull.
    Huber,
    /// An outlier vanishes.
    Tukey,
}

/// Arguments of `reduce`.
#[derive(Debug, Clone, Args)]
pub struct ReduceArgs {
    /// Robot file, .ron or .urdf.
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// Print the `reduction` object of idim-result/1.
    #[arg(long)]
    pub json: bool,
    /// Keep columns in the order m mx my mz Ixx.. (names of the CRS A460 paper) instead of XX .. MX .. M.
    #[arg(long)]
    pub mass_first: bool,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
}

/// Does what was asked; what a person reads goes to `out`.
///
/// # Errors
/// Bad input, with place, value, rule and next step; then nothing is written.
pub fn run(command: &Command, out: &mut dyn Write) -> Result<(), Error> {
    match command {
        Command::Identify(args) => run_identify(args, out),
        Command::Check(args) => run_check(args, out),
        Command::Reduce(args) => run_reduce(args, out),
        Command::Simulate(args) => run_simulate(args, out),
        Command::Excite(args) => run_excite(args, out),
        Command::Payload(args) => commands::payload(args, out),
        Command::DriveGains(args) => commands::run_drive_gains(args, out),
        Command::TorqueConstants(args) => commands::torque_constants(args, out),
    }
}

fn run_identify(args: &IdentifyArgs, out: &mut dyn Write) -> Result<(), Error> {
    if let Some(robot) = &args.robot {
        return run_logs(args, robot, out);
    }
    let papers = args
        .paper
        .map_or_else(|| vec![Paper::Puma, Paper::CrsA460], |p| vec![p]);
    for paper in papers {
        let progress = Progress::new();
        let command = command_line();
        let (text, result, plots, page) = match paper {
            Paper::Puma => {
                let run = puma::run(args.seed, &progress)?;
                let (plots, page) = (run.plots(), run.report(&command));
                (run.text, run.result, plots, page)
            }
            Paper::CrsA460 => {
                let run = crs_a460::run(args.seed, &progress)?;
                let (plots, page) = (run.plots(), run.report(&command));
                (run.text, run.result, plots, page)
            }
        };
        progress.finish();
        let numbers = format!("\nBeside the paper\n{}", paper_text(&result.paper));
        say(out, &(text + &numbers + &warnings_text(&result.warnings)))?;
        write_results(&args.out, &result, &plots, &page, out)?;
    }
    Ok(())
}

fn run_logs(args: &IdentifyArgs, robot: &Path, out: &mut dyn Write) -> Result<(), Error> {
    let progress = Progress::new();
    progress.stage("reading");
    let loaded = load(robot, &args.changes)?;
    let seen = |l: &&LogSpec| args.validate.iter().any(|v| v.overlaps(l));
    if let Some(twice) = args.log.iter().find(seen) {
        return Err(Error::input(
            twice.name(),
            "given both as --log and as --validate",
            "a model is proved on motions it has not seen; give another file, or another range of samples",
        ));
    }
    let mapping = read_mapping(args.mapping.as_ref())?;
    let training = read_logs(&args.log, &loaded, &mapping, &args.waive)?;
    let validation = read_logs(&args.validate, &loaded, &mapping, &args.waive)?;
    let options = IdentifyOptions {
        columns: drive_columns(args.columns.as_deref()),
        sampling: SamplingOptions {
            as_recorded: args.as_recorded,
            cutoff: args.cutoff,
            rate: args.rate,
            derive_velocity: args.derive_velocity,
            dead_band: args.dead_band.clone(),
        },
        friction: parse_friction(&args.friction).map_err(|met| {
            let rule = "write --friction auto, or --friction [JOINT=]TERM,TERM,..";
            Error::input("--friction", met, rule)
        })?,
        estimation: estimation_options(args),
        seed: args.seed,
    };
    progress.stage("identifying");
    let mut identification = identify(
        &loaded,
        training.measurements,
        validation.measurements,
        &options,
    )?;
    for (inferred, findings) in [
        (training.inferred, training.findings),
        (validation.inferred, validation.findings),
    ] {
        let result = &mut identification.result;
        let doubts = findings.iter().filter(|f| f.is_doubt());
        result
            .warnings
            .extend(doubts.map(|f| f.finding.to_string()));
        result.inferred.extend(inferred);
        result.findings.extend(findings);
    }
    progress.stage("drawing");
    let plots = plots::of_predictions(&identification.predictions, &loaded.robot);
    let settings = file_settings(robot, &args.log, &args.validate);
    let page = page_of_logs(&identification, &loaded.robot, &command_line(), &settings);
    progress.stage("writing the model for others");
    let mut files = plots;
    files.extend(exports(&identification, &loaded.robot));
    progress.finish();
    say(out, &identification_text(&identification))?;
    write_results(&args.out, &identification.result, &files, &page, out)
}

fn run_reduce(args: &ReduceArgs, out: &mut dyn Write) -> Result<(), Error> {
    let loaded = load(&args.robot, &args.changes)?;
    let order = if args.mass_first {
        KeepOrder::MassFirst
    } else {
        KeepOrder::Links
    };
    let structure = Structure::of_torque(&loaded.robot, DriveColumns::NONE, order);
    let reduction = structure.to_result();
    if args.json {
        let json = serde_json::to_string_pretty(&reduction)
            .map_err(|e| Error::input("reduction", e.to_string(), "a defect of this program"))?;
        say(out, &(json + "\n"))?;
    } else {
        let text = reduction_text(loaded.robot.name(), &reduction);
        say(out, &(text + &warnings_text(loaded.robot.notes())))?;
    }
    structure.decided().map(|_| ())
}

pub(crate) fn load(robot: &Path, changes: &RobotChanges) -> Result<LoadedRobot, Error> {
    load_robot(
        robot,
        &Changes {
            gravity: changes.gravity,
            lock: changes.lock.clone(),
        },
    )
}

/// One file, name and contents.
pub type NamedText = (String, String);

/// What was typed, under the program's own name.
fn command_line() -> String {
    let typed = std::env::args_os().skip(1);
    let typed = typed.map(|a| a.to_string_lossy().into_owned());
    shell_line(std::iter::once("idim".to_owned()).chain(typed))
}

/// Writes `DIR/ROBOT/result.json`, the report and what else there is, and says where.
fn write_results(
    dir: &Path,
    result: &IdentificationResult,
    files: &[NamedText],
    page: &str,
    out: &mut dyn Write,
) -> Result<(), Error> {
    let folder = dir.join(file_name(&result.robot));
    let json = serde_json::to_string_pretty(result)
        .map_err(|e| Error::input("result", e.to_string(), "a defect of this program"))?;
    for (name, text) in files {
        write_atomically(&folder.join(name), text.as_bytes())?;
    }
    let written: Vec<&str> = files.iter().map(|f| f.0.as_str()).collect();
    remove_earlier(&folder, &written)?;
    write_atomically(&folder.join("report.html"), page.as_bytes())?;
    write_atomically(&folder.join("result.json"), json.as_bytes())?;
    say(
        out,
        &format!(
            "\nopen {}; result.json and {} other files lie beside it\n\n",
            folder.join("report.html").display(),
            files.len()
        ),
    )
}

/// A robot's or joint's name as a name for a file: nothing in it can leave the folder.
pub(crate) fn file_name(name: &str) -> String {
    let plain: String = name
        .chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() || "-_".contains(c) {
                c.to_ascii_lowercase()
            } else {
                '-'
            }
        })
        .collect();
    let plain = plain.trim_matches('-');
    if plain.is_empty() {
        "robot".into()
    } else {
        plain.into()
    }
}

pub(crate) fn say(out: &mut dyn Write, text: &str) -> Result<(), Error> {
    out.write_all(text.as_bytes())
        .map_err(|source| Error::Write {
            path: "standard output".into(),
            source,
        })
}

pub(crate) fn drive_columns(chosen: Option<&[Column]>) -> DriveColumns {
    let Some(chosen) = chosen else {
        return DriveColumns::ALL;
    };
    DriveColumns {
        rotor: chosen.contains(&Column::Rotor),
        viscous: chosen.contains(&Column::Viscous),
        coulomb: chosen.contains(&Column::Coulomb),
        offset: chosen.contains(&Column::Offset),
    }
}

fn estimation_options(args: &IdentifyArgs) -> EstimationOptions {
    EstimationOptions {
        weighting: match args.weighting {
            WeightingChoice::Full => Weighting::Full,
            WeightingChoice::Diagonal => Weighting::Diagonal,
        },
        robust: args.robust.map(|r| match r {
            RobustChoice::Huber => RobustLoss::Huber { k: HUBER_K },
            RobustChoice::Tukey => RobustLoss::Tukey { c: TUKEY_C },
        }),
        essential: args.essential,
    }
}

fn parse_positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().unwrap_or(f64::NAN);
    if number > 0.0 && number.is_finite() {
        Ok(number)
    } else {
        Err(format!("`{text}` is not a number above zero"))
    }
}

fn parse_speed(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().unwrap_or(f64::NAN);
    if number >= 0.0 && number.is_finite() {
        Ok(number)
    } else {
        Err(format!("`{text}` is not a speed of zero or above"))
    }
}

fn parse_gravity(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|t| t.trim().parse::<f64>()).collect();
    let [x, y, z] = numbers
        .ok()
        .and_then(|n| <[f64; 3]>::try_from(n).ok())
        .ok_or("three numbers in m/s², for example 0,0,-9.81")?;
    Ok([x, y, z])
}

fn parse_lock(text: &str) -> Result<(String, f64), String> {
    let Some((name, value)) = text.split_once('=') else {
        return Ok((text.to_owned(), 0.0));
    };
    let value: f64 = value
        .parse()
        .map_err(|_| format!("`{value}` is not a number; write JOINT=VALUE in rad or m"))?;
    if !value.is_finite() {
        return Err(format!("`{value}` is not finite"));
    }
    Ok((name.to_owned(), value))
}

/// Runs a command for a process: text to standard output, an error to standard error, an exit code.
pub fn main(command: &Command) -> ExitCode {
    match run(command, &mut std::io::stdout().lock()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            match error {
                Error::Interrupted => ExitCode::from(INTERRUPTED_CODE),
                _ => ExitCode::FAILURE,
            }
        }
    }
}
