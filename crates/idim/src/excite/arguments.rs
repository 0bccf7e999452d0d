//! `idim excite`: the command line of a design, and the files it leaves.

use super::certificate_file::certificate_json;
use super::conditions::conditions;
use super::interrupt::Watch;
use super::limits::{GivenLimits, for_joints, motion_limits};
use super::text::excitation_text;
use super::{Excitation, ExciteOptions, excite_watched};
use crate::check::Waiver;
use crate::cli::{Column, RobotChanges, drive_columns, file_name, load, say};
use crate::error::Error;
use crate::log_spec::LogSpec;
use crate::logs::{read_logs, read_mapping};
use crate::output::write_atomically;
use crate::plots;
use crate::progress::Progress;
use crate::report::warnings_text;
use clap::Args;
use idim_excitation::{Criterion, Scaling};
use idim_model::{JointStates, Robot};
use idim_trajectory::{FourierSeries, Motion, TrajectoryFile};
use std::fmt::Write as _;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `excite`.
#[derive(Debug, Clone, Args)]
pub struct ExciteArgs {
    /// Robot file, .ron or .urdf.
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// What to lower: cond, cond-equilibrated, frobenius, frobenius-equilibrated, d, a, e; several with weights as
    /// cond,d=0.1 (weights of the logarithms).
    #[arg(long, value_name = "NAME[=WEIGHT]", value_delimiter = ',', value_parser = parse_term, default_value = "cond")]
    pub criterion: Vec<CriterionTerm>,
    /// Take this long from the start of the command, s; the result then depends on the machine.
    #[arg(long, value_name = "S")]
    pub time_budget: Option<f64>,
    /// Period of the motion, s.
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    pub period: f64,
    /// Harmonics of every joint.
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub harmonics: usize,
    /// Searches of a round.
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub starts: usize,
    /// Rounds of searches from beside the best, after the first (default: 2, with a time budget as many as it allows).
    #[arg(long, value_name = "N")]
    pub rounds: Option<usize>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Rate of the written samples, Hz.
    #[arg(long, value_name = "HZ", default_value_t = 100.0)]
    pub rate: f64,
    /// Begin and end at rest.
    #[arg(long)]
    pub rest: bool,
    /// Columns beside the inertial ones (default: all four).
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "COLUMN")]
    pub columns: Option<Vec<Column>>,
    /// Standard deviation of the torque, N·m: one for all joints or one each.
    #[arg(long, value_delimiter = ',', value_name = "STD")]
    pub noise: Vec<f64>,
    /// Position at most this far from zero, rad: one for all joints or one each; never widens the robot file's.
    #[arg(long, value_delimiter = ',', value_name = "RAD")]
    pub position: Vec<f64>,
    /// Speed at most, rad/s, likewise.
    #[arg(long, value_delimiter = ',', value_name = "RAD/S")]
    pub velocity: Vec<f64>,
    /// Acceleration at most, rad/s², likewise.
    #[arg(long, value_delimiter = ',', value_name = "RAD/S2")]
    pub acceleration: Vec<f64>,
    /// Share of each torque limit the motion may use by the robot file's inertial values; 0 leaves torques out
    /// (default: 0.8 where the file has what it takes).
    #[arg(long, value_name = "SHARE")]
    pub torque_share: Option<f64>,
    /// Distance to keep between the robot's capsules, the obstacles and the ground, m (default: 0.02 where the file has
    /// any).
    #[arg(long, value_name = "M")]
    pub clearance: Option<f64>,
    /// Two links, or base or ground, that may come as near as they like; may be repeated.
    #[arg(long, value_name = "LINK,LINK", value_parser = parse_pair)]
    pub may_touch: Vec<(String, String)>,
    /// Earlier log whose information counts: the motion becomes its best complement; may be repeated.
    #[arg(long, value_name = "LOG", num_args = 1.., value_parser = LogSpec::parse)]
    pub log: Vec<LogSpec>,
    /// Which column of the logs holds what, where the header does not say so (docs/logs.md).
    #[arg(long, alias = "map", value_name = "FILE", requires = "log")]
    pub mapping: Option<PathBuf>,
    /// Accept a finding of the log doctor by name, of all joints or of one; may be repeated.
    #[arg(long, value_name = "CODE[:JOINT]", requires = "log")]
    pub waive: Vec<Waiver>,
    /// Folder for results: DIR/ROBOT/motion.ron and others.
    #[arg(long, value_name = "DIR", default_value = "idim-out")]
    pub out: PathBuf,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
}

/// A criterion and its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriterionTerm {
    /// The criterion.
    pub criterion: Criterion,
    /// Weight of its logarithm.
    pub weight: f64,
}

/// Criteria by the names of the command line.
pub(super) const CRITERIA: [(&str, Criterion); 7] = [
    ("cond", Criterion::TwoNorm(Scaling::Raw)),
    (
        "cond-equilibrated",
        Criterion::TwoNorm(Scaling::Equilibrated),
    ),
    ("frobenius", Criterion::Frobenius(Scaling::Raw)),
    (
        "frobenius-equilibrated",
        Criterion::Frobenius(Scaling::Equilibrated),
    ),
    ("d", Criterion::LogDet),
    ("a", Criterion::TraceInverse),
    ("e", Criterion::WorstDirection),
];

fn parse_term(text: &str) -> Result<CriterionTerm, String> {
    let (name, weight) = text.split_once('=').unwrap_or((text, "1"));
    let Some((_, criterion)) = CRITERIA.iter().find(|(known, _)| *known == name) else {
        let names: Vec<&str> = CRITERIA.iter().map(|c| c.0).collect();
        return Err(format!(
            "no criterion `{name}`; there are {}",
            names.join(", ")
        ));
    };
    let weight: f64 = weight.parse().unwrap_or(f64::NAN);
    if !(weight > 0.0 && weight.is_finite()) {
        return Err(format!("`{text}`: a weight is a number above zero"));
    }
    Ok(CriterionTerm {
        criterion: *criterion,
        weight,
    })
}

fn parse_pair(text: &str) -> Result<(String, String), String> {
    let (a, b) = text
        .split_once(',')
        .ok_or("two names of links, for example link1,link3")?;
    Ok((a.trim().to_owned(), b.trim().to_owned()))
}

/// Designs a motion and writes it.
pub(crate) fn run_excite(args: &ExciteArgs, out: &mut dyn Write) -> Result<(), Error> {
    check(args)?;
    let watch = Watch::begin(args.time_budget);
    let progress = Progress::new();
    progress.stage("reading");
    let loaded = load(&args.robot, &args.changes)?;
    let robot = &loaded.robot;
    let given = GivenLimits {
        position: &args.position,
        velocity: &args.velocity,
        acceleration: &args.acceleration,
    };
    let limits = motion_limits(robot, &given)?;
    let noise = for_joints("--noise", &args.noise, robot.n_joints())?;
    let mapping = read_mapping(args.mapping.as_ref())?;
    let logs = read_logs(&args.log, &loaded, &mapping, &args.waive)?;
    let conditions = conditions(robot, args.torque_share, args.clearance, &args.may_touch)?;
    let options = ExciteOptions {
        criteria: args
            .criterion
            .iter()
            .map(|t| (t.weight, t.criterion))
            .collect(),
        period: args.period,
        n_harmonics: args.harmonics,
        n_starts: args.starts,
        n_rounds: args.rounds,
        seed: args.seed,
        at_rest: args.rest,
        columns: drive_columns(args.columns.as_deref()),
        torque_noise: noise.into_iter().flatten().collect(),
        torque: conditions.torque,
        clearance: conditions.clearance,
        time_budget: args.time_budget,
    };
    watch.check()?;
    let logs_read = &logs.measurements;
    let found = excite_watched(robot, &limits, logs_read, &options, &progress, &watch)?;
    progress.stage("drawing");
    let files = files(robot, &found, args.rate);
    progress.finish();
    let mut notes = robot.notes().to_vec();
    notes.extend(logs.inferred);
    notes.extend(conditions.notes);
    say(
        out,
        &(excitation_text(robot, &found) + &warnings_text(&notes)),
    )?;
    write(&args.out, robot, &files, out)
}

fn check(args: &ExciteArgs) -> Result<(), Error> {
    let positive = [
        ("--period", Some(args.period), "s"),
        ("--rate", Some(args.rate), "Hz"),
        ("--time-budget", args.time_budget, "s"),
    ];
    for (option, value, unit) in positive {
        if let Some(v) = value
            && !(v > 0.0 && v <= LARGEST)
        {
            return Err(Error::input(
                option,
                format!("{v} {unit}"),
                format!("it must be above zero and at most {LARGEST:e}"),
            ));
        }
    }
    if args.period * args.rate > LARGEST {
        return Err(Error::input(
            "--rate",
            format!("{} samples a period", args.period * args.rate),
            "take a lower rate",
        ));
    }
    if !(1..=MOST_HARMONICS).contains(&args.harmonics) {
        return Err(Error::input(
            "--harmonics",
            args.harmonics.to_string(),
            format!("give 1 to {MOST_HARMONICS}"),
        ));
    }
    Ok(())
}

/// Seconds, hertz or samples beyond this are a slip of the keyboard.
const LARGEST: f64 = 1e7;
/// More harmonics than a drive follows, and more variables than a search handles.
const MOST_HARMONICS: usize = 50;

/// Everything a design leaves behind: name and text.
fn files(robot: &Robot, found: &Excitation, rate: f64) -> Vec<(String, String)> {
    let names = robot.joints().iter().map(|j| j.name.clone()).collect();
    let source = format!("idim excite, seed {}", found.options.seed);
    let motion = Motion::Fourier(found.design.series.clone());
    let file = TrajectoryFile::new(names, &motion, source);
    let certificate = certificate_json(robot, found);
    vec![
        ("motion.ron".into(), file.to_ron()),
        ("motion.json".into(), file.to_json()),
        (
            "samples.csv".into(),
            samples_csv(&found.design.series, rate),
        ),
        ("certificate.json".into(), format!("{certificate:#}\n")),
        plots::of_series(robot, &found.design.series, &found.limits, "motion"),
    ]
}

/// One period, the first and the last instant included: `t, q1 .., qd1 .., qdd1 ..`, SI.
fn samples_csv(series: &FourierSeries, rate: f64) -> String {
    let n = series.n_joints();
    // A period that is a whole number of samples but for rounding ends with one.
    let last = (series.period() * rate * (1.0 + 1e-12)).floor() as usize;
    let times: Vec<f64> = (0..=last).map(|k| k as f64 / rate).collect();
    let states = series.states(&times);
    let mut text = String::from("t");
    for symbol in ["q", "qd", "qdd"] {
        for j in 1..=n {
            let _ = write!(text, ",{symbol}{j}");
        }
    }
    text.push('\n');
    for (k, t) in times.iter().enumerate() {
        let _ = write!(text, "{t}");
        for values in [JointStates::q, JointStates::qd, JointStates::qdd] {
            for j in 0..n {
                let _ = write!(text, ",{}", values(&states, j)[k]);
            }
        }
        text.push('\n');
    }
    text
}

fn write(
    dir: &Path,
    robot: &Robot,
    files: &[(String, String)],
    out: &mut dyn Write,
) -> Result<(), Error> {
    let folder = dir.join(file_name(robot.name()));
    for (name, text) in files {
        write_atomically(&folder.join(name), text.as_bytes())?;
    }
    let names: Vec<&str> = files.iter().map(|f| f.0.as_str()).collect();
    say(
        out,
        &format!("\nwrote {} to {}\n", names.join(", "), folder.display()),
    )
}
