//! `idim identify`: a robot from its logs, or the papers reproduced.

use crate::cli::{NamedText, Paper, RobotChanges, load, say};
use crate::error::Error;
use crate::export::exports;
use crate::fit::EstimationOptions;
use crate::identify::{IdentifyOptions, identify};
use crate::log_options::{FittingArgs, ReadingArgs, SamplingArgs, named};
use crate::log_spec::LogSpec;
use crate::logs::read_logs;
use crate::output::{
    RESULT_FILES, refuse_overwriting, remove_earlier, results_folder, write_atomically,
};
use crate::progress::Progress;
use crate::report::{identification_text, paper_text, warnings_text};
use crate::report_html::{file_settings, page_of_logs, shell_line, verdict_line};
use crate::result::IdentificationResult;
use crate::same_samples::{PROVED_ON_ITSELF, refuse_same_files, refuse_shared};
use crate::{crs_a460, plots, puma};
use clap::{Args, ValueEnum};
use std::io::Write;
use std::path::{Path, PathBuf};

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
    /// How logs are read.
    #[command(flatten)]
    pub reading: ReadingArgs,
    /// Folder for results: DIR/ROBOT/result.json and plots.
    #[arg(long, value_name = "DIR", default_value = "idim-out")]
    pub out: PathBuf,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
    /// How a log becomes samples.
    #[command(flatten)]
    pub sampling: SamplingArgs,
    /// What is fitted to them.
    #[command(flatten)]
    pub fitting: FittingArgs,
    /// Keep only the parameters that the residual would miss; the others are listed with their interval.
    #[arg(long)]
    pub essential: bool,
    /// End with exit code 3 where the verdict is "Not to be trusted" or "Not proved"; results are written all the same.
    #[arg(long)]
    pub strict: bool,
}

/// Does what was asked; results go to `--out`.
pub(crate) fn run_identify(args: &IdentifyArgs, out: &mut dyn Write) -> Result<(), Error> {
    if let Some(robot) = &args.robot {
        return run_logs(args, robot, out);
    }
    refuse_beside_a_paper(args)?;
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

/// Files that are read.
fn inputs<'a>(args: &'a IdentifyArgs, robot: &'a Path) -> Vec<&'a Path> {
    let logs = args.log.iter().chain(&args.validate);
    let files = logs.flat_map(|l| l.files.iter().map(PathBuf::as_path));
    files
        .chain([robot])
        .chain(args.reading.mapping.as_deref())
        .collect()
}

/// Papers bring their own robot, data and options.
fn refuse_beside_a_paper(args: &IdentifyArgs) -> Result<(), Error> {
    let mut given = args.reading.given();
    given.extend(args.sampling.given());
    given.extend(args.fitting.given());
    given.extend(named(&[
        ("--essential", args.essential),
        ("--strict", args.strict),
        ("--gravity", args.changes.gravity.is_some()),
        ("--lock", !args.changes.lock.is_empty()),
    ]));
    let Some(first) = given.first() else {
        return Ok(());
    };
    let paper = args.paper.and_then(|p| p.to_possible_value());
    let paper = paper.map_or_else(
        || "no --log, so the papers".to_owned(),
        |p| format!("the paper `{}`", p.get_name()),
    );
    Err(Error::input(
        format!("{first} and {paper}"),
        "an option of logs, where a paper brings its own data",
        format!(
            "leave out {}, or give a robot and its logs with --robot and --log",
            given.join(", ")
        ),
    ))
}

fn run_logs(args: &IdentifyArgs, robot: &Path, out: &mut dyn Write) -> Result<(), Error> {
    let progress = Progress::new();
    progress.stage("reading");
    let loaded = load(robot, &args.changes)?;
    refuse_same_files(
        &args.validate,
        &args.log,
        "--log and as --validate",
        PROVED_ON_ITSELF,
    )?;
    refuse_overwriting(
        &results_folder(&args.out, loaded.robot.name()),
        &RESULT_FILES,
        &inputs(args, robot),
    )?;
    let (columns, friction) = args.fitting.model()?;
    let options = IdentifyOptions {
        columns,
        sampling: args.sampling.options(&loaded.robot)?,
        friction,
        estimation: EstimationOptions {
            weighting: args.fitting.weighting(),
            robust: args.fitting.loss(),
            essential: args.essential,
        },
        seed: args.seed,
    };
    let mapping = args.reading.mapping(&[&args.log, &args.validate])?;
    let [logs, validate] = args.reading.cut([&args.log, &args.validate])?;
    let waivers = args.reading.waivers(&loaded.robot)?;
    let training = read_logs(&logs, &loaded, &mapping, waivers)?;
    let mut validation = read_logs(&validate, &loaded, &mapping, waivers)?;
    // Nothing is estimated from these.
    let findings = &mut validation.findings;
    findings.retain(|f| f.finding.code != "few-samples");
    let seen = training.prints();
    refuse_shared(&validation.prints(), &seen, "--log", PROVED_ON_ITSELF)?;
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
    write_results(&args.out, &identification.result, &files, &page, out)?;
    match verdict_line(&identification.result) {
        (verdict, false) if args.strict => Err(Error::Distrusted { verdict }),
        _ => Ok(()),
    }
}

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
    let folder = results_folder(dir, &result.robot);
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
