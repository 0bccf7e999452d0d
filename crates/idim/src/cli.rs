//! The command line, shared by the binary and the workspace's driver.

use crate::check::{CheckArgs, run_check};
use crate::commands::{self, DriveGainsArgs, LoadedRuns, TorqueConstantsArgs};
use crate::error::Error;
use crate::excite::{ExciteArgs, run_excite};
use crate::identify_command::{IdentifyArgs, run_identify};
use crate::load::{Changes, LoadedRobot, load_robot};
use crate::report::{reduction_text, warnings_text};
use crate::simulated_log::{SimulateArgs, run_simulate};
use crate::structure::{KeepOrder, Structure};
use clap::{Args, Subcommand, ValueEnum};
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
    Excite(Box<ExciteArgs>),
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

/// Writes text for a person; whatever a file brought in, it moves no cursor and changes no colour.
pub(crate) fn say(out: &mut dyn Write, text: &str) -> Result<(), Error> {
    out.write_all(printable(text).as_bytes())
        .map_err(|source| Error::Write {
            path: "standard output".into(),
            source,
        })
}

/// Text with control characters other than line ends replaced: names come from files.
pub(crate) fn printable(text: &str) -> String {
    let shown = |c: char| {
        if c.is_control() && c != '\n' {
            '\u{fffd}'
        } else {
            c
        }
    };
    text.chars().map(shown).collect()
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
///
/// A reader that has gone, as `head` does, is no failure: results are written all the same.
pub fn main(command: &Command) -> ExitCode {
    match run(command, &mut UntilClosed(std::io::stdout().lock())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", printable(&error.to_string()));
            error.exit_code()
        }
    }
}

/// Writes as long as somebody reads, and lets go of the rest.
struct UntilClosed<W>(W);

impl<W: Write> Write for UntilClosed<W> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match self.0.write(bytes) {
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(bytes.len()),
            other => other,
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        match self.0.flush() {
            Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
            other => other,
        }
    }
}
