//! Logs from files, checked before anything is computed.

use crate::check::{CheckedFinding, Waiver, diagnose, gate, marked};
use crate::error::Error;
use crate::load::{LoadedRobot, read_text};
use crate::log_spec::{LogSpec, Span};
use crate::same_samples::{Prints, refuse_repeated};
use crate::transmission::joint_side;
use idim_measurement::doctor::Finding;
use idim_measurement::formats::read_log;
use idim_measurement::{
    ColumnMapping, JointLabel, Log, Measurements, infer_time_unit, joint_labels, read_csv_files,
};
use idim_model::Robot;
use std::path::{Path, PathBuf};

/// Logs read and what was noted about them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Logs {
    /// As named on the command line.
    pub(crate) names: Vec<String>,
    pub(crate) measurements: Vec<Measurements>,
    /// How the files were read and what was inferred, for the result's `inferred`.
    pub(crate) inferred: Vec<String>,
    /// What the doctor found; nothing that would spoil a result and is not waived.
    pub(crate) findings: Vec<CheckedFinding>,
}

/// Fewer samples of every joint than this cannot tell a dozen parameters a joint from noise.
const FEWEST_SAMPLES: usize = 50;

/// Reads and checks logs of one robot; positions and torques of motors are brought to the joints.
pub(crate) fn read_logs(
    specs: &[LogSpec],
    loaded: &LoadedRobot,
    mapping: &ColumnMapping,
    waivers: &[Waiver],
) -> Result<Logs, Error> {
    read_logs_despite(specs, loaded, mapping, waivers, |_| false)
}

/// As [`read_logs`], where some findings do not stop the run: they are what it is to find out.
pub(crate) fn read_logs_despite(
    specs: &[LogSpec],
    loaded: &LoadedRobot,
    mapping: &ColumnMapping,
    waivers: &[Waiver],
    asked_for: fn(&Finding) -> bool,
) -> Result<Logs, Error> {
    let mut logs = Logs::default();
    let mut read = Vec::new();
    for spec in specs {
        let log = read_log_spec(spec, loaded, mapping)?;
        let notes = log.notes.iter();
        logs.inferred
            .extend(notes.map(|n| format!("{}: {n}", spec.name())));
        logs.names.push(spec.name());
        read.push(log);
    }
    let findings = diagnose(&read, &loaded.robot).into_iter().flatten();
    logs.findings = marked(findings.collect(), waivers);
    for f in &mut logs.findings {
        f.blocks &= !asked_for(&f.finding);
    }
    gate(&logs.findings)?;
    for log in &read {
        logs.measurements
            .push(Measurements::from_log(log, &loaded.robot)?);
    }
    refuse_repeated(&logs.prints())?;
    Ok(logs)
}

impl Logs {
    /// What tells the samples of each log from others'.
    pub(crate) fn prints(&self) -> Vec<Prints<'_>> {
        let named = self.names.iter().zip(&self.measurements);
        named
            .map(|(name, m)| Prints::of_measurements(name, m))
            .collect()
    }
}

/// One log as the command line names it: on the joint side, its clock settled, cut to the samples wanted.
///
/// # Errors
/// What cannot be read, with place, value, rule and next step.
pub(crate) fn read_log_spec(
    spec: &LogSpec,
    loaded: &LoadedRobot,
    mapping: &ColumnMapping,
) -> Result<Log, Error> {
    let labels = joint_labels(&loaded.robot, &loaded.described);
    let log = read(spec, &labels, mapping)?;
    let mut log = joint_side(log, &loaded.robot)?;
    let name = spec.name();
    if log.n_samples() < FEWEST_SAMPLES {
        return Err(Error::input(
            name,
            format!("{} samples", log.n_samples()),
            format!("identification needs at least {FEWEST_SAMPLES}; record a longer motion"),
        ));
    }
    infer_time_unit(&mut log);
    let log = cut(log, spec, &name)?;
    match delays(mapping, &loaded.robot)? {
        Some(delays) => Ok(log.with_torque_delays(&delays)?),
        None => Ok(log),
    }
}

/// The samples wanted, without the parts that are left out.
fn cut(mut log: Log, spec: &LogSpec, name: &str) -> Result<Log, Error> {
    let n = log.n_samples();
    let range = match &spec.samples {
        Some(range) => within(range, n, name)?,
        None => 0..n,
    };
    if spec.left_out.is_empty() {
        return Ok(log.slice(range));
    }
    let mut keep = vec![true; n];
    for span in &spec.left_out {
        let (text, inside): (String, Vec<usize>) = match span {
            Span::Samples(s) => (
                format!("samples {} to {}", s.start, s.end.min(n).saturating_sub(1)),
                (s.start.min(n)..s.end.min(n)).collect(),
            ),
            Span::Time([from, to]) => (
                format!("{from} to {to} s"),
                (0..n)
                    .filter(|&k| (*from..=*to).contains(&log.time[k]))
                    .collect(),
            ),
        };
        if inside.is_empty() {
            return Err(Error::input(
                format!("--exclude of {name}"),
                format!("{text} hold no sample"),
                format!(
                    "the log has samples 0 to {}, from {} to {} s on its clock",
                    n - 1,
                    log.time[0],
                    log.time[n - 1]
                ),
            ));
        }
        for &k in &inside {
            keep[k] = false;
        }
        let met = inside.iter().filter(|k| range.contains(k)).count();
        log.notes.push(format!(
            "left out as stated, {text}: {met} samples, and as many beside them as make a gap"
        ));
    }
    let log = log.slice(range.clone()).keeping(&keep[range]);
    if log.n_samples() < FEWEST_SAMPLES {
        return Err(Error::input(
            name,
            format!("{} samples left without the excluded ones", log.n_samples()),
            format!("identification needs at least {FEWEST_SAMPLES}; exclude less"),
        ));
    }
    Ok(log)
}

/// How late each joint's torque was recorded, s; `None` where nothing is said of it.
fn delays(mapping: &ColumnMapping, robot: &Robot) -> Result<Option<Vec<f64>>, Error> {
    if mapping.delays.is_empty() {
        return Ok(None);
    }
    let stranger = |joint: &&String| robot.joint_index(joint).is_none();
    let mut named = mapping.delays.iter().filter_map(|d| d.joint.as_ref());
    if let Some(joint) = named.find(stranger) {
        let names: Vec<&str> = robot.joints().iter().map(|j| j.name.as_str()).collect();
        let rule = format!("the joints are {}", names.join(", "));
        return Err(Error::input(
            format!("delay of {joint}"),
            "no such joint",
            rule,
        ));
    }
    let of = |name: Option<&str>| {
        let delays = mapping.delays.iter();
        delays
            .filter(|d| d.joint.as_deref() == name)
            .map(|d| d.seconds)
            .next()
    };
    let joints = robot.joints().iter();
    Ok(Some(
        joints
            .map(|j| of(Some(&j.name)).or_else(|| of(None)).unwrap_or(0.0))
            .collect(),
    ))
}

fn read(spec: &LogSpec, labels: &[JointLabel], mapping: &ColumnMapping) -> Result<Log, Error> {
    if let [file] = spec.files.as_slice()
        && !is_text(file)
    {
        return Ok(read_log(file, labels, mapping)?);
    }
    let contents: Result<Vec<Vec<u8>>, Error> = spec
        .files
        .iter()
        .map(|path| {
            std::fs::read(path).map_err(|source| Error::Read {
                path: path.clone(),
                source,
            })
        })
        .collect();
    let contents = contents?;
    // Alone a file is known by its path; beside others by its name, as a mapping writes it.
    let names: Vec<String> = match spec.files.as_slice() {
        [one] => vec![one.display().to_string()],
        many => many.iter().map(|f| file_name(f)).collect(),
    };
    let files: Vec<(&[u8], &str)> = contents
        .iter()
        .zip(&names)
        .map(|(bytes, name)| (bytes.as_slice(), name.as_str()))
        .collect();
    Ok(read_csv_files(&files, labels, mapping)?)
}

/// Whether a file is read as comma-separated text: unless its ending says another format.
fn is_text(file: &Path) -> bool {
    let other = ["parquet", "npz", "db3", "mcap"];
    let ending = file.extension().map(|e| e.to_string_lossy().to_lowercase());
    !file.is_dir() && ending.is_none_or(|e| !other.contains(&e.as_str()))
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

fn within(
    range: &std::ops::Range<usize>,
    n: usize,
    name: &str,
) -> Result<std::ops::Range<usize>, Error> {
    let wanted = range.start..if range.end == usize::MAX {
        n
    } else {
        range.end
    };
    if wanted.end > n || wanted.len() < FEWEST_SAMPLES {
        return Err(Error::input(
            name,
            format!("samples {} to {} of {n}", wanted.start, wanted.end),
            format!("a range lies within the log and holds at least {FEWEST_SAMPLES} samples"),
        ));
    }
    Ok(wanted)
}

/// The mapping of a file's columns, in RON: which header holds what, the sample rate where there is no clock.
pub(crate) fn read_mapping(path: Option<&PathBuf>) -> Result<ColumnMapping, Error> {
    let Some(path) = path else {
        return Ok(ColumnMapping::default());
    };
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(&read_text(path)?).map_err(|e| {
        Error::input(
            path.display().to_string(),
            e.to_string(),
            "a mapping is (sample_rate: Hz, columns: [(header: \"..\", quantity: .., joint: \"..\", unit: \"..\"), ..]), see docs/logs.md",
        )
    })
}
