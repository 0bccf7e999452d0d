//! From measurements to smooth states with velocities and accelerations.

use crate::clock::{interpolate, read_clock, uniform_grid, uniform_interval};
use crate::differentiate::{first_difference, second_difference};
use crate::error::{Error, Place};
use crate::filter::{Section, butterworth, filter_zero_phase, padding, settling};
use crate::measurements::Measurements;
use idim_model::JointStates;
use std::fmt;

/// A zero-phase Butterworth low-pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    /// Order of one pass; typically 4.
    pub order: usize,
    /// Frequency, Hz, at which the two passes together leave one half; typically 5 times the fastest motion.
    pub cutoff: f64,
}

/// Where velocity and acceleration come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Derivatives {
    /// Both by central differences of the positions.
    #[default]
    OfPositions,
    /// Recorded velocity, and its central difference.
    OfVelocities,
}

/// How to condition a log; [`Default`] filters nothing and differentiates positions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ConditioningOptions {
    /// Samples a second of the uniform grid, Hz; the log's own median rate where `None`.
    pub sample_rate: Option<f64>,
    /// Low-pass of positions and recorded velocities; none where `None`.
    pub low_pass: Option<LowPass>,
    /// Low-pass of the torques; `None` leaves them to the parallel decimation.
    pub torque_low_pass: Option<LowPass>,
    /// Where velocity and acceleration come from.
    pub derivatives: Derivatives,
    /// Time left out at both ends of a segment, s; where `None`, until the slowest filter has settled.
    pub trim: Option<f64>,
}

/// One choice that conditioning made, with its number.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// What was chosen.
    pub what: &'static str,
    /// Its number.
    pub value: f64,
    /// Unit of the number, may be empty.
    pub unit: &'static str,
    /// Why, or from what.
    pub why: String,
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let space = if self.unit.is_empty() { "" } else { " " };
        let Self {
            what,
            value,
            unit,
            why,
        } = self;
        write!(f, "{what}: {value}{space}{unit} ({why})")
    }
}

/// A stretch of samples on a uniform grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Time on the log's clock, s.
    pub time: Vec<f64>,
    /// Interval, s.
    pub interval: f64,
    /// Positions, velocities, accelerations.
    pub states: JointStates,
    /// Torques, joint by joint, N·m (N).
    pub torque: Vec<Vec<f64>>,
}

/// Conditioned segments and the record of every choice made.
#[derive(Debug, Clone, PartialEq)]
pub struct Conditioned {
    /// Segments in order of time; never one across a gap.
    pub segments: Vec<Segment>,
    /// What was done.
    pub choices: Vec<Choice>,
}

/// Share of intervals that may be gaps.
const GAP_SHARE: f64 = 0.05;

/// Splits at gaps, puts each segment onto a uniform grid, filters without phase, differentiates, trims the edges.
///
/// # Errors
/// A cutoff beyond half the sample rate, a missing recorded velocity, a clock full of gaps, no segment long enough.
pub fn condition(
    measured: &Measurements,
    options: &ConditioningOptions,
) -> Result<Conditioned, Error> {
    let plan = Plan::new(measured, options)?;
    let clock = read_clock(&measured.time);
    let n = measured.n_samples();
    let mut choices = plan.choices();
    if clock.gaps.len() as f64 > GAP_SHARE * n as f64 {
        return Err(Error::log(
            "gaps",
            Place::file(&measured.file).time(clock.gaps[0].time),
            format!("{} gaps in {n} samples", clock.gaps.len()),
            "more than 5 % of the intervals are longer than three median intervals; record again without dropped packets",
        ));
    }
    if let Some(longest) = clock
        .gaps
        .iter()
        .max_by(|a, b| a.length.total_cmp(&b.length))
    {
        choices.push(Choice {
            what: "gaps",
            value: clock.gaps.len() as f64,
            unit: "",
            why: format!(
                "split there, nothing interpolated across; the longest, {:.4} s, after t = {:.4} s",
                longest.length, longest.time
            ),
        });
    }
    let mut segments = Vec::new();
    let mut dropped = Vec::new();
    let mut resampled = false;
    for range in clock.segments(n) {
        let length = range.len();
        let part = measured.slice(range);
        match plan.segment(&part, &mut resampled) {
            Some(segment) => segments.push(segment),
            None => dropped.push(length),
        }
    }
    if segments.is_empty() {
        return Err(Error::log(
            "too-few-samples",
            Place::file(&measured.file),
            format!("{n} samples in {} segments", clock.gaps.len() + 1),
            format!(
                "filtering and trimming need {} samples without a gap; record a longer motion or raise the cutoff",
                plan.fewest()
            ),
        ));
    }
    if resampled {
        choices.push(Choice {
            what: "resampled, clock jitter",
            value: 100.0 * clock.jitter,
            unit: "%",
            why: "cubic through the four nearest stamps".into(),
        });
    }
    if let Some(longest) = dropped.iter().max() {
        choices.push(Choice {
            what: "samples in segments too short to filter",
            value: dropped.iter().sum::<usize>() as f64,
            unit: "",
            why: format!(
                "left out: {} segments of at most {longest} samples ({:.3} s), where filter and edges take {}",
                dropped.len(),
                *longest as f64 * plan.interval,
                plan.fewest()
            ),
        });
    }
    Ok(Conditioned { segments, choices })
}

struct Plan {
    options: ConditioningOptions,
    interval: f64,
    motion: Vec<Section>,
    torque: Vec<Section>,
    trim: usize,
}

impl Plan {
    fn new(measured: &Measurements, options: &ConditioningOptions) -> Result<Self, Error> {
        if options.derivatives == Derivatives::OfVelocities && measured.qd.is_none() {
            return Err(Error::log(
                "missing-column",
                Place::file(&measured.file),
                "no recorded qd",
                "recorded velocities are asked for; record `qd1`, `qd2`, …, or differentiate positions",
            ));
        }
        let rate = match options.sample_rate {
            Some(rate) if !(rate > 0.0 && rate.is_finite()) => {
                let rule = "samples a second must be a number above zero";
                return Err(Error::setting("sample rate (Hz)", rate, rule));
            }
            Some(rate) => rate,
            None => 1.0 / own_interval(&measured.time),
        };
        let design = |low_pass: Option<LowPass>| match low_pass {
            None => Ok(Vec::new()),
            Some(LowPass { order: 0, .. }) => Err(Error::setting(
                "filter order",
                0.0,
                "a low-pass has at least order 1; leave the filter out to have none",
            )),
            Some(LowPass { cutoff, .. }) if !(cutoff > 0.0 && cutoff < 0.5 * rate) => {
                Err(Error::setting(
                    "cutoff (Hz)",
                    cutoff,
                    format!(
                        "it must lie between 0 and half the sample rate, {} Hz",
                        0.5 * rate
                    ),
                ))
            }
            Some(LowPass { order, cutoff }) => Ok(butterworth(order, cutoff, rate)),
        };
        let motion = design(options.low_pass)?;
        let torque = design(options.torque_low_pass)?;
        let settled = |s: &Vec<Section>| if s.is_empty() { 0 } else { settling(s) };
        let trim = match options.trim {
            Some(seconds) if !(seconds >= 0.0 && seconds.is_finite()) => {
                let rule = "time left out at both ends cannot be below zero";
                return Err(Error::setting("trim (s)", seconds, rule));
            }
            Some(seconds) => (seconds * rate).ceil() as usize,
            None => settled(&motion).max(settled(&torque)),
        };
        Ok(Self {
            options: *options,
            interval: 1.0 / rate,
            motion,
            torque,
            trim,
        })
    }

    /// Fewest samples of a segment: it must outlast the reflection and keep three samples.
    fn fewest(&self) -> usize {
        let pad = |s: &Vec<Section>| if s.is_empty() { 0 } else { padding(s) + 1 };
        let edges = 2 * self.trim + 3;
        pad(&self.motion).max(pad(&self.torque)).max(edges).max(4)
    }

    fn segment(&self, part: &Measurements, resampled: &mut bool) -> Option<Segment> {
        let own = uniform_interval(&part.time);
        let keep = own.is_some_and(|dt| (dt / self.interval - 1.0).abs() < 1e-6);
        let time = if keep {
            part.time.clone()
        } else {
            uniform_grid(&part.time, self.interval)
        };
        if part.time.len() < 4 || time.len() < self.fewest() {
            return None;
        }
        *resampled |= !keep;
        let prepare = |x: &Vec<f64>, sections: &[Section]| {
            let x = if keep {
                x.clone()
            } else {
                interpolate(&part.time, x, &time)
            };
            if sections.is_empty() {
                x
            } else {
                filter_zero_phase(sections, &x)
            }
        };
        let h = self.interval;
        let kept = self.trim..time.len() - self.trim;
        let mut states = JointStates::zeros(part.n_joints(), kept.len());
        let mut torque = Vec::new();
        for j in 0..part.n_joints() {
            let q = prepare(&part.q[j], &self.motion);
            let recorded = part.qd.as_ref().map(|qd| &qd[j]);
            let (qd, qdd) = match (self.options.derivatives, recorded) {
                (Derivatives::OfVelocities, Some(qd)) => {
                    let qd = prepare(qd, &self.motion);
                    let qdd = first_difference(&qd, h);
                    (qd, qdd)
                }
                _ => (first_difference(&q, h), second_difference(&q, h)),
            };
            states.q_mut(j).copy_from_slice(&q[kept.clone()]);
            states.qd_mut(j).copy_from_slice(&qd[kept.clone()]);
            states.qdd_mut(j).copy_from_slice(&qdd[kept.clone()]);
            let filtered = prepare(&part.torque[j], &self.torque);
            torque.push(filtered[kept.clone()].to_vec());
        }
        Some(Segment {
            time: time[kept].to_vec(),
            interval: h,
            states,
            torque,
        })
    }

    fn choices(&self) -> Vec<Choice> {
        let mut choices = vec![Choice {
            what: "sample rate",
            value: 1.0 / self.interval,
            unit: "Hz",
            why: stated(self.options.sample_rate.is_some(), "the log's own"),
        }];
        let filters = [
            (
                "low-pass of positions and velocities",
                self.options.low_pass,
            ),
            ("low-pass of torques", self.options.torque_low_pass),
        ];
        for (what, filter) in filters {
            choices.extend(filter.map(|f| Choice {
                what,
                value: f.cutoff,
                unit: "Hz",
                why: format!("zero-phase Butterworth of order {}, both ways", f.order),
            }));
        }
        choices.push(Choice {
            what: "left out at both ends",
            value: self.trim as f64 * self.interval,
            unit: "s",
            why: stated(
                self.options.trim.is_some(),
                "until the filters have settled to 1e-3",
            ),
        });
        let why = match self.options.derivatives {
            Derivatives::OfPositions => "velocity and acceleration from positions",
            Derivatives::OfVelocities => "recorded velocity, acceleration from it",
        };
        choices.push(Choice {
            what: "central differences over",
            value: self.interval,
            unit: "s",
            why: why.into(),
        });
        choices
    }
}

fn stated(by_option: bool, otherwise: &str) -> String {
    if by_option { "as stated" } else { otherwise }.into()
}

/// Interval of the uniform grid if the stamps lie on one, else their median interval.
fn own_interval(time: &[f64]) -> f64 {
    uniform_interval(time).unwrap_or_else(|| read_clock(time).interval)
}
