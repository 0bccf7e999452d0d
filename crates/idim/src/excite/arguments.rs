//! `idim excite`: the command line of a design, and the files it leaves.

use super::certificate_file::certificate_json;
use super::conditions::conditions;
use super::files::{FILES, files, write};
use super::interrupt::Watch;
use super::limits::{GivenLimits, for_joints, motion_limits};
use super::points::{PointOptions, excite_points};
use super::points_text::{points_json, points_text};
use super::text::excitation_text;
use super::{ExciteOptions, excite_watched};
use crate::cli::{Column, RobotChanges, drive_columns, load, say};
use crate::error::Error;
use crate::load::LoadedRobot;
use crate::log_options::ReadingArgs;
use crate::log_spec::LogSpec;
use crate::logs::read_logs;
use crate::output::{refuse_overwriting, results_folder};
use crate::plots;
use crate::progress::Progress;
use crate::report::warnings_text;
use clap::{Args, ValueEnum};
use idim_excitation::{Criterion, Scaling};
use idim_model::Robot;
use idim_trajectory::{Limits, Motion};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `excite`.
#[derive(Debug, Clone, Args)]
pub struct ExciteArgs {
    /// Robot file, .ron or .urdf.
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// A periodic motion, or points of the energy model with a path through them (Gautier & Khalil 1991).
    #[arg(long, value_enum, default_value_t = Family::Fourier)]
    pub family: Family,
    /// What to lower: cond, cond-equilibrated, frobenius, frobenius-equilibrated, d, a, e; several with weights as
    /// cond,d=0.1 (weights of the logarithms).
    #[arg(long, value_name = "NAME[=WEIGHT]", value_delimiter = ',', value_parser = parse_term, default_value = "cond")]
    pub criterion: Vec<CriterionTerm>,
    /// Take this long from the start of the command, s; the result then depends on the machine.
    #[arg(long, value_name = "S")]
    pub time_budget: Option<f64>,
    /// Period of the motion, s (default: 10).
    #[arg(long, value_name = "S")]
    pub period: Option<f64>,
    /// Harmonics of every joint (default: 5).
    #[arg(long, value_name = "N")]
    pub harmonics: Option<usize>,
    /// Energy differences between points (default: twice the base parameters).
    #[arg(long, value_name = "N")]
    pub rows: Option<usize>,
    /// Largest S = max |W| / min |W| of points (default: any; 175 in the paper).
    #[arg(long, value_name = "S")]
    pub largest_s: Option<f64>,
    /// Lower L1 Cond + L2 S of points, the criterion of Gautier & Khalil (example: 1,0.1).
    #[arg(long, value_name = "L1,L2", value_parser = parse_lambda)]
    pub lambda: Option<Lambda>,
    /// Searches of a round (default: 8); random starts of points (default: 32, with a time budget 10).
    #[arg(long, value_name = "N")]
    pub starts: Option<usize>,
    /// Rounds of searches from beside the best, after the first (default: 2, with a time budget as many as it allows; of
    /// points 12, with a time budget as many as it allows, with --largest-s or --lambda at most 48).
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
    /// How those logs are read.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Folder for results: DIR/ROBOT/motion.ron and others.
    #[arg(long, value_name = "DIR", default_value = "idim-out")]
    pub out: PathBuf,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
}

/// Families of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Family {
    /// A finite Fourier series for the torque model.
    Fourier,
    /// Points (q, qd) for the energy model, and a path of fifth-order polynomials through them.
    Points,
}

/// A criterion and its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriterionTerm {
    /// The criterion.
    pub criterion: Criterion,
    /// Weight of its logarithm.
    pub weight: f64,
}

/// `λ₁` and `λ₂` of a condition number and `S`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lambda(pub f64, pub f64);

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

fn parse_lambda(text: &str) -> Result<Lambda, String> {
    let weights: Vec<f64> = text
        .split(',')
        .map(|w| w.trim().parse().unwrap_or(f64::NAN))
        .collect();
    match weights[..] {
        [a, b] if [a, b].iter().all(|w| *w > 0.0 && w.is_finite()) => Ok(Lambda(a, b)),
        _ => Err(format!(
            "`{text}`: give two weights above zero, of the condition number and of S, for example 1,0.1"
        )),
    }
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
    let logs = args.log.iter().flat_map(|l| &l.files);
    let inputs: Vec<&Path> = logs.chain([&args.robot]).map(PathBuf::as_path).collect();
    refuse_overwriting(&results_folder(&args.out, robot.name()), &FILES, &inputs)?;
    let given = GivenLimits {
        position: &args.position,
        velocity: &args.velocity,
        acceleration: &args.acceleration,
    };
    let limits = motion_limits(robot, &given)?;
    match args.family {
        Family::Fourier => run_fourier(args, &loaded, &limits, (&progress, &watch), out),
        Family::Points => run_points(args, robot, &limits, (&progress, &watch), out),
    }
}

fn run_fourier(
    args: &ExciteArgs,
    loaded: &LoadedRobot,
    limits: &Limits,
    (progress, watch): (&Progress, &Watch),
    out: &mut dyn Write,
) -> Result<(), Error> {
    let robot = &loaded.robot;
    let noise = for_joints("--noise", &args.noise, robot.n_joints())?;
    let mapping = args.reading.mapping(&[&args.log])?;
    let [logs] = args.reading.cut([&args.log])?;
    let waivers = args.reading.waivers(robot)?;
    let logs = read_logs(&logs, loaded, &mapping, waivers)?;
    let conditions = conditions(robot, args.torque_share, args.clearance, &args.may_touch)?;
    let options = ExciteOptions {
        criteria: args
            .criterion
            .iter()
            .map(|t| (t.weight, t.criterion))
            .collect(),
        period: args.period.unwrap_or(PERIOD),
        n_harmonics: args.harmonics.unwrap_or(HARMONICS),
        n_starts: args.starts.unwrap_or(STARTS),
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
    let found = excite_watched(robot, limits, logs_read, &options, progress, watch)?;
    progress.stage("drawing");
    let files = files(
        robot,
        &Motion::Fourier(found.design.series.clone()),
        found.design.series.period(),
        (args.rate, args.seed),
        &certificate_json(robot, &found),
        plots::of_series(robot, &found.design.series, &found.limits, "motion"),
    );
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

fn run_points(
    args: &ExciteArgs,
    robot: &Robot,
    limits: &Limits,
    (progress, watch): (&Progress, &Watch),
    out: &mut dyn Write,
) -> Result<(), Error> {
    let conditions = conditions(robot, args.torque_share, args.clearance, &args.may_touch)?;
    let restrained = args.largest_s.is_some() || args.lambda.is_some();
    let rounds = match (args.time_budget, restrained) {
        (None, _) => POINT_ROUNDS[0],
        (Some(_), true) => POINT_ROUNDS[1],
        (Some(_), false) => POINT_ROUNDS[2],
    };
    let options = PointOptions {
        criterion: match args.lambda {
            None => args.criterion[0].criterion,
            Some(Lambda(condition, equilibrium)) => Criterion::WeightedSum {
                condition,
                equilibrium,
            },
        },
        n_rows: args.rows,
        largest_s: args.largest_s,
        n_starts: args.starts.unwrap_or(match args.time_budget {
            None => POINT_STARTS[0],
            Some(_) => POINT_STARTS[1],
        }),
        n_rounds: args.rounds.unwrap_or(rounds),
        seed: args.seed,
        torque: conditions.torque,
        clearance: conditions.clearance,
    };
    let found = excite_points(robot, limits, options, progress, watch)?;
    let files = files(
        robot,
        &Motion::Quintic(found.proved.path.clone()),
        found.proved.path.duration(),
        (args.rate, args.seed),
        &points_json(robot, limits, &found),
        plots::of_path(robot, &found.proved.path, limits).remove(0),
    );
    progress.finish();
    let mut notes = robot.notes().to_vec();
    notes.extend(conditions.notes);
    say(out, &(points_text(robot, &found) + &warnings_text(&notes)))?;
    write(&args.out, robot, &files, out)
}

/// Refuses what the family does not know: nothing that was asked for is dropped in silence.
fn check_family(args: &ExciteArgs) -> Result<(), Error> {
    let of_fourier = [
        ("--period", args.period.is_some()),
        ("--harmonics", args.harmonics.is_some()),
        ("--rest", args.rest),
        ("--columns", args.columns.is_some()),
        ("--noise", !args.noise.is_empty()),
        ("--log", !args.log.is_empty()),
    ];
    let of_points = [
        ("--rows", args.rows.is_some()),
        ("--largest-s", args.largest_s.is_some()),
    ];
    let (strange, family): (&[(&str, bool)], _) = match args.family {
        Family::Fourier => (&of_points, "fourier"),
        Family::Points => (&of_fourier, "points"),
    };
    if let Some((option, _)) = strange.iter().find(|(_, given)| *given) {
        return Err(Error::input(
            *option,
            format!("--family {family}"),
            "it belongs to the other family; leave one of them out (docs/commands.md)",
        ));
    }
    if args.log.is_empty()
        && let Some(option) = args.reading.given().first()
    {
        return Err(Error::input(
            *option,
            "no --log",
            "it says how earlier logs are read; name them by --log, or leave it out",
        ));
    }
    if args.family == Family::Points && args.criterion.len() > 1 {
        return Err(Error::input(
            "--criterion",
            format!("{} criteria", args.criterion.len()),
            "points are searched for by one; --largest-s limits S beside it, --lambda weighs S against cond",
        ));
    }
    Ok(())
}

/// `S` with a weight: of points, and beside their condition number only.
fn check_lambda(args: &ExciteArgs) -> Result<(), Error> {
    let Some(Lambda(condition, equilibrium)) = args.lambda else {
        return Ok(());
    };
    let refused = |value: &str, rule| {
        let option = format!("--lambda {condition},{equilibrium}");
        Err(Error::input(option, value, rule))
    };
    if args.family == Family::Fourier {
        return refused(
            "--family fourier",
            "S of a periodic motion is set by when it is sampled (a row near zero more, and S is another); \
             take --family points, or leave it out",
        );
    }
    if args.criterion[0].criterion != Criterion::TwoNorm(Scaling::Raw) {
        return refused(
            "another --criterion",
            "it weighs S against cond and no other; leave one of them out",
        );
    }
    if args.largest_s.is_some() {
        return refused(
            "--largest-s",
            "S is either weighed or limited; leave one of them out",
        );
    }
    Ok(())
}

fn check(args: &ExciteArgs) -> Result<(), Error> {
    check_family(args)?;
    check_lambda(args)?;
    let (period, harmonics) = (
        args.period.unwrap_or(PERIOD),
        args.harmonics.unwrap_or(HARMONICS),
    );
    let positive = [
        ("--period", Some(period), "s"),
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
    if period * args.rate > LARGEST {
        return Err(Error::input(
            "--rate",
            format!("{} samples a period", period * args.rate),
            "take a lower rate",
        ));
    }
    if !(1..=MOST_HARMONICS).contains(&harmonics) {
        return Err(Error::input(
            "--harmonics",
            harmonics.to_string(),
            format!("give 1 to {MOST_HARMONICS}"),
        ));
    }
    Ok(())
}

/// Seconds, hertz or samples beyond this are a slip of the keyboard.
const LARGEST: f64 = 1e7;
/// More harmonics than a drive follows, and more variables than a search handles.
const MOST_HARMONICS: usize = 50;
/// Period where nothing is said, s, and harmonics: those of Radkhah, Kulić & Croft.
const PERIOD: f64 = 10.0;
const HARMONICS: usize = 5;
/// Searches of a round of a Fourier motion.
const STARTS: usize = 8;
/// Random starts of points without a time budget, and with one, whose rounds make up for it.
const POINT_STARTS: [usize; 2] = [32, 10];
/// Rounds of points: without a time budget; with one and a limit or weight of S, that a quarter of them comes before; with one alone.
const POINT_ROUNDS: [usize; 3] = [12, 48, 1 << 20];
