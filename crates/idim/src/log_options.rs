//! Options that the commands over logs share: how a log is read, becomes samples, and what is fitted to them.
//!
//! An option that another one leaves nothing to do is refused by name, never dropped.

use crate::check::Waiver;
use crate::cli::{Column, drive_columns};
use crate::error::Error;
use crate::friction::{FrictionChoice, parse_friction};
use crate::log_spec::{Exclusion, LogSpec};
use crate::logs::read_mapping;
use crate::plan::SamplingOptions;
use clap::{Args, ValueEnum};
use idim_estimation::{HUBER_K, RobustLoss, TUKEY_C, Weighting};
use idim_measurement::{ColumnMapping, TorqueDelay};
use idim_model::{DriveColumns, Robot};
use std::path::PathBuf;

/// How logs are read.
#[derive(Debug, Clone, Default, Args)]
pub struct ReadingArgs {
    /// Which column holds what, where the header does not say so (docs/logs.md).
    #[arg(long, alias = "map", value_name = "FILE")]
    pub mapping: Option<PathBuf>,
    /// Accept a finding of the log doctor by name, of all joints or of one; may be repeated.
    #[arg(long, value_name = "CODE[:JOINT]")]
    pub waive: Vec<Waiver>,
    /// Leave out a part of a log: samples A to B (without B, from 0), or 12.5s..14s on its clock; may be repeated.
    #[arg(long, value_name = "[LOG:]A..B", value_parser = Exclusion::parse)]
    pub exclude: Vec<Exclusion>,
    /// Leave out rows with a cell that is no finite number, and split the log there.
    #[arg(long)]
    pub drop_bad: bool,
    /// How late the torques were recorded behind the positions, ms, of all joints or of one; may be repeated.
    #[arg(long, value_name = "[JOINT=]MS", value_parser = parse_delay, allow_hyphen_values = true)]
    pub delay: Vec<TorqueDelay>,
    /// Topic of a bag that has several of JointState.
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
}

impl ReadingArgs {
    /// Names of the options that were given.
    pub(crate) fn given(&self) -> Vec<&'static str> {
        named(&[
            ("--mapping", self.mapping.is_some()),
            ("--waive", !self.waive.is_empty()),
            ("--exclude", !self.exclude.is_empty()),
            ("--drop-bad", self.drop_bad),
            ("--delay", !self.delay.is_empty()),
            ("--topic", self.topic.is_some()),
        ])
    }

    /// The mapping of the columns, with what the options say of it; `logs` are all that it is for.
    ///
    /// # Errors
    /// A file that cannot be read or is no mapping; what stands in it and in an option; a topic where there is no bag.
    pub(crate) fn mapping(&self, logs: &[&[LogSpec]]) -> Result<ColumnMapping, Error> {
        let mut mapping = read_mapping(self.mapping.as_ref())?;
        for (option, both) in [
            ("topic", mapping.topic.is_some() && self.topic.is_some()),
            (
                "delay",
                !mapping.delays.is_empty() && !self.delay.is_empty(),
            ),
        ] {
            if both {
                return Err(Error::input(
                    format!("--{option} and --mapping"),
                    format!("the mapping file states the {option} too"),
                    "state it in one of them",
                ));
            }
        }
        mapping.topic = mapping.topic.or_else(|| self.topic.clone());
        mapping.delays.extend(self.delay.iter().cloned());
        mapping.drop_bad |= self.drop_bad;
        if let Some(topic) = &mapping.topic
            && !logs.iter().copied().flatten().any(LogSpec::is_bag)
        {
            return Err(Error::input(
                format!("topic {topic}"),
                "none of the logs is a bag",
                "topics are of .db3 and .mcap files; leave it out",
            ));
        }
        for (k, delay) in mapping.delays.iter().enumerate() {
            if mapping.delays[..k].iter().any(|d| d.joint == delay.joint) {
                let whose = delay.joint.as_deref().unwrap_or("all joints");
                let rule = "one for all joints, and one for each that differs";
                return Err(Error::input(
                    "--delay",
                    format!("two delays of {whose}"),
                    rule,
                ));
            }
        }
        Ok(mapping)
    }

    /// The logs with the parts that are left out of each.
    ///
    /// # Errors
    /// A part of no log, or of one that is not named where there are several.
    pub(crate) fn cut<const N: usize>(
        &self,
        logs: [&[LogSpec]; N],
    ) -> Result<[Vec<LogSpec>; N], Error> {
        let mut cut = logs.map(<[LogSpec]>::to_vec);
        for exclusion in &self.exclude {
            let mut files: Vec<Vec<PathBuf>> = Vec::new();
            for spec in cut.iter_mut().flatten().filter(|s| exclusion.names(s)) {
                spec.left_out.push(exclusion.span.clone());
                if !files.contains(&spec.files) {
                    files.push(spec.files.clone());
                }
            }
            if files.len() != 1 {
                let named = exclusion.log.as_deref().unwrap_or("a log without a name");
                let names: Vec<String> = logs.concat().iter().map(LogSpec::name).collect();
                return Err(Error::input(
                    format!("--exclude {named}"),
                    format!("{} logs are meant", files.len()),
                    format!(
                        "name one as --log does, LOG:A..B; there are {}",
                        names.join(", ")
                    ),
                ));
            }
        }
        Ok(cut)
    }

    /// What is accepted of the log doctor's findings.
    ///
    /// # Errors
    /// A joint that the robot does not have.
    pub(crate) fn waivers(&self, robot: &Robot) -> Result<&[Waiver], Error> {
        let joint = |w: &Waiver| w.joint.clone().filter(|j| robot.joint_index(j).is_none());
        if let Some((waiver, joint)) = self.waive.iter().find_map(|w| Some((w, joint(w)?))) {
            let names: Vec<&str> = robot.joints().iter().map(|j| j.name.as_str()).collect();
            return Err(Error::input(
                format!("--waive {}:{joint}", waiver.code),
                "no such joint",
                format!("the joints are {}", names.join(", ")),
            ));
        }
        Ok(&self.waive)
    }
}

/// How a log becomes samples.
#[derive(Debug, Clone, Default, Args)]
pub struct SamplingArgs {
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
}

impl SamplingArgs {
    /// Names of the options that were given.
    pub(crate) fn given(&self) -> Vec<&'static str> {
        let all = [
            ("--as-recorded", self.as_recorded),
            ("--cutoff", self.cutoff.is_some()),
            ("--rate", self.rate.is_some()),
            ("--derive-velocity", self.derive_velocity),
            ("--dead-band", !self.dead_band.is_empty()),
        ];
        named(&all)
    }

    /// Checked against each other and against the robot.
    ///
    /// # Errors
    /// A filter beside data taken as recorded, a dead band for another number of joints.
    pub(crate) fn options(&self, robot: &Robot) -> Result<SamplingOptions, Error> {
        let filters = ["--cutoff", "--rate", "--derive-velocity"];
        let given = self.given();
        if self.as_recorded
            && let Some(filter) = given.iter().find(|o| filters.contains(o))
        {
            return Err(Error::input(
                format!("--as-recorded and {filter}"),
                "one takes the samples as they are, the other changes them",
                format!(
                    "leave out --as-recorded to have {filter}, or {filter} to have the samples as recorded"
                ),
            ));
        }
        let (n, m) = (robot.n_joints(), self.dead_band.len());
        if m > 1 && m != n {
            return Err(Error::input(
                "--dead-band",
                format!("{m} speeds for {n} joints"),
                "give one speed for all joints, or one a joint in the order of the robot file",
            ));
        }
        Ok(SamplingOptions {
            as_recorded: self.as_recorded,
            cutoff: self.cutoff,
            rate: self.rate,
            derive_velocity: self.derive_velocity,
            dead_band: self.dead_band.clone(),
        })
    }
}

/// What is fitted to the samples, and how they are weighted.
#[derive(Debug, Clone, Default, Args)]
pub struct FittingArgs {
    /// Columns beside the inertial ones (default: all four).
    #[arg(long, value_delimiter = ',', num_args = 0.., value_name = "COLUMN")]
    pub columns: Option<Vec<Column>>,
    /// Friction terms, of all joints or of one.
    #[arg(
        long,
        value_name = "TERMS",
        help = "Friction terms: auto, or [JOINT=]viscous,coulomb,offset,asymmetric,cubic,root,stribeck[:SPEED],load,tanh:SPEED, or none; speeds in rad/s (m/s); once for all joints and once for each of its own"
    )]
    pub friction: Vec<String>,
    /// Weights: the joints' full residual covariance, or one variance a joint (default: full).
    #[arg(long, value_enum)]
    pub weighting: Option<WeightingChoice>,
    /// Take the say from outliers: contacts, stops, dropped packets.
    #[arg(long, value_enum)]
    pub robust: Option<RobustChoice>,
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

impl FittingArgs {
    /// Names of the options that were given.
    pub(crate) fn given(&self) -> Vec<&'static str> {
        let all = [
            ("--columns", self.columns.is_some()),
            ("--friction", !self.friction.is_empty()),
            ("--weighting", self.weighting.is_some()),
            ("--robust", self.robust.is_some()),
        ];
        named(&all)
    }

    /// Drive columns and friction, which decides over all of them but the rotor.
    ///
    /// # Errors
    /// A word that is no term; a column of friction beside `--friction`.
    pub(crate) fn model(&self) -> Result<(DriveColumns, FrictionChoice), Error> {
        let friction = parse_friction(&self.friction).map_err(|met| {
            let rule = "write --friction auto, or --friction [JOINT=]TERM,TERM,..";
            Error::input("--friction", met, rule)
        })?;
        let chosen = self.columns.iter().flatten();
        if friction != FrictionChoice::Plain
            && let Some(column) = chosen.into_iter().find(|c| **c != Column::Rotor)
        {
            let name = column.to_possible_value();
            return Err(Error::input(
                "--columns and --friction",
                format!(
                    "--columns names `{}`, over which --friction decides",
                    name.as_ref().map_or("", |n| n.get_name())
                ),
                "name the friction with --friction; beside it --columns says only whether there is a rotor: `--columns rotor`, or `--columns` alone for none",
            ));
        }
        Ok((drive_columns(self.columns.as_deref()), friction))
    }

    /// Which part of the residual covariance weights the rows.
    pub(crate) fn weighting(&self) -> Weighting {
        match self.weighting {
            None | Some(WeightingChoice::Full) => Weighting::Full,
            Some(WeightingChoice::Diagonal) => Weighting::Diagonal,
        }
    }

    /// How outliers lose their say.
    pub(crate) fn loss(&self) -> Option<RobustLoss> {
        self.robust.map(|r| match r {
            RobustChoice::Huber => RobustLoss::Huber { k: HUBER_K },
            RobustChoice::Tukey => RobustLoss::Tukey { c: TUKEY_C },
        })
    }
}

/// The names of those that are true.
pub(crate) fn named(all: &[(&'static str, bool)]) -> Vec<&'static str> {
    all.iter().filter(|o| o.1).map(|o| o.0).collect()
}

fn parse_delay(text: &str) -> Result<TorqueDelay, String> {
    let (joint, ms) = match text.rsplit_once('=') {
        Some((joint, ms)) => (Some(joint.to_owned()), ms),
        None => (None, text),
    };
    let number: f64 = ms.trim().parse().unwrap_or(f64::NAN);
    if !number.is_finite() {
        return Err(format!("`{ms}` is not a number of milliseconds"));
    }
    Ok(TorqueDelay {
        joint,
        seconds: 1e-3 * number,
    })
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
