//! Findings from single channels: clock, gaps, stale and saturated samples, jumps, spikes, steps, standstill.

use crate::clock::read_clock;
use crate::doctor::finding::{Finding, Severity};
use crate::error::Place;
use crate::log::{Drive, Log};
use crate::plausibility::{check_clock_unit, range};
use idim_model::Robot;

/// Jitter, as a share of the interval, worth a warning.
const JITTER: f64 = 0.2;
/// Share of intervals that are gaps beyond which a log is broken.
const GAP_SHARE: f64 = 0.05;
/// Slowest sample rate for arms, Hz.
const SLOWEST: f64 = 50.0;

pub(crate) fn clock(log: &Log, out: &mut Vec<Finding>) {
    if let Err(error) = check_clock_unit(log) {
        out.push(Finding::from(&error));
        return;
    }
    let clock = read_clock(&log.time);
    let file = || Place::file(&log.file);
    let rate = 1.0 / clock.interval;
    let duration = log.time[log.n_samples() - 1] - log.time[0];
    out.push(Finding::new(
        "sample-rate",
        if rate < SLOWEST {
            Severity::Warning
        } else {
            Severity::Note
        },
        file(),
        rate,
        format!(
            "{} samples a second over {} s",
            rounded(rate),
            rounded(duration)
        ),
        if rate < SLOWEST {
            "accelerations of an arm need at least 50"
        } else {
            ""
        },
        if rate < SLOWEST { "record faster" } else { "" },
    ));
    if clock.jitter > JITTER {
        out.push(Finding::new(
            "jitter",
            Severity::Warning,
            file(),
            clock.jitter,
            format!(
                "intervals differ from {} s by up to {:.0} %",
                rounded(clock.interval),
                100.0 * clock.jitter
            ),
            "differences need a uniform grid",
            "it is resampled on the true stamps; log the controller's own clock if it can be had",
        ));
    }
    let Some(longest) = clock
        .gaps
        .iter()
        .max_by(|a, b| a.length.total_cmp(&b.length))
    else {
        return;
    };
    let broken = clock.gaps.len() as f64 > GAP_SHARE * log.n_samples() as f64;
    out.push(Finding::new(
        "gaps",
        if broken {
            Severity::Error
        } else {
            Severity::Warning
        },
        log.place(longest.sample).time(longest.time),
        longest.length,
        format!(
            "{} gaps, the longest {:.4} s",
            clock.gaps.len(),
            longest.length
        ),
        "an interval beyond three median intervals is a gap; nothing is interpolated across",
        "the log is split there; record again if packets were dropped throughout",
    ));
}

/// Five digits, without zeros at the end.
fn rounded(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

/// Share of samples that repeat the one before, joint by joint, beyond which a channel is stale.
const STALE: f64 = 0.05;

/// Samples that repeat the one before in every channel while the arm moves on.
pub(crate) fn stale(log: &Log, out: &mut Vec<Finding>) {
    let drive = drive(log);
    let same = |x: &[Vec<f64>], k: usize| x.iter().all(|c| c[k] == c[k - 1]);
    let steps = 1..log.n_samples();
    let (mut count, mut first, mut moving) = (0usize, None, 0usize);
    for k in steps {
        let moves = k + 1 < log.n_samples() && !same(&log.q, k + 1) || !same(&log.q, k);
        moving += usize::from(moves);
        if moves && same(&log.q, k) && same(drive, k) {
            count += 1;
            first = first.or(Some(k));
        }
    }
    let share = count as f64 / moving.max(1) as f64;
    if let Some(first) = first
        && share > STALE
    {
        out.push(Finding::new(
            "stale-samples",
            Severity::Warning,
            log.place(first),
            share,
            format!(
                "{count} samples ({:.1} %) repeat the one before while the arm moves",
                100.0 * share
            ),
            "every sample should be a new measurement",
            "log at the controller's rate, or remove the repeated lines",
        ));
    }
}

/// Share of samples at the very extreme of a torque channel that means clipping.
const SATURATED: f64 = 0.005;
/// How much more often than the next level the extreme must occur: a sine on a lattice reaches 2.4.
const PILE_UP: f64 = 5.0;

/// Values at which a torque channel is clipped, lowest first: an extreme met much more often than the next value to it.
pub fn clipped_at(x: &[f64]) -> Vec<f64> {
    let mut sorted = x.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let up: Vec<f64> = sorted.iter().rev().copied().collect();
    let mut found = Vec::new();
    for levels in [&sorted, &up] {
        let Some(&extreme) = levels.first() else {
            continue;
        };
        let count = levels.iter().take_while(|v| **v == extreme).count();
        let next = levels[count..]
            .iter()
            .take_while(|v| **v == levels[count])
            .count();
        let share = count as f64 / x.len() as f64;
        if next > 0 && share >= SATURATED && count as f64 > PILE_UP * next as f64 {
            found.push(extreme);
        }
    }
    found
}

pub(crate) fn saturation(log: &Log, out: &mut Vec<Finding>) {
    for (j, x) in drive(log).iter().enumerate() {
        for level in clipped_at(x) {
            let count = x.iter().filter(|v| **v == level).count();
            let share = count as f64 / x.len() as f64;
            let first = x.iter().position(|v| *v == level).unwrap_or(0);
            out.push(Finding::new(
                "saturation",
                Severity::Warning,
                log.place(first).joint(&log.joints[j]),
                share,
                format!("{:.1} % of the torque samples are exactly {level}", 100.0 * share),
                "a value met so often at the extreme is a limit, not a torque",
                "this joint's rows around them are left out of a fit; record a gentler motion to keep them",
            ));
        }
    }
}

/// Step of a position, rad or m, worth a warning.
const COARSE_POSITION: f64 = 1e-3;
/// Step of a torque, as a share of its standard deviation, worth a warning.
const COARSE_TORQUE: f64 = 0.1;
/// Share of distinct values below which a channel is on a lattice.
const FEW_LEVELS: f64 = 0.2;

pub(crate) fn quantisation(log: &Log, out: &mut Vec<Finding>) {
    for (j, joint) in log.joints.iter().enumerate() {
        let place = || Place::file(&log.file).joint(joint);
        if let Some(step) = lattice_step(&log.q[j]).filter(|s| *s > COARSE_POSITION) {
            out.push(Finding::new(
                "quantised-position",
                Severity::Warning,
                place(),
                step,
                format!("positions come in steps of {step:.3e}"),
                format!("steps above {COARSE_POSITION} spoil accelerations"),
                "log the encoder's full resolution, or more decimals",
            ));
        }
        let torque = &drive(log)[j];
        let spread = deviation(torque);
        if let Some(step) = lattice_step(torque).filter(|s| *s > COARSE_TORQUE * spread) {
            out.push(Finding::new(
                "quantised-torque",
                Severity::Warning,
                place(),
                step,
                format!(
                    "torques come in steps of {step:.3e}, {:.0} % of their standard deviation",
                    100.0 * step / spread
                ),
                "a step adds noise of step / √12",
                "log more digits, or give this joint a smaller weight",
            ));
        }
    }
}

/// Step of the lattice a channel lies on, `None` if most of its values differ.
pub(crate) fn lattice_step(x: &[f64]) -> Option<f64> {
    let (low, high) = range(x);
    let mut levels = x.to_vec();
    levels.sort_unstable_by(f64::total_cmp);
    levels.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * (high - low));
    if levels.len() < 2 || levels.len() as f64 > FEW_LEVELS * x.len() as f64 {
        return None;
    }
    let mut steps: Vec<f64> = levels.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_unstable_by(f64::total_cmp);
    Some(steps[steps.len() / 2])
}

/// Jump of a position within one sample, as a multiple of the step all others stay below.
const JUMP: f64 = 20.0;
/// Smallest jump, rad or m.
const SMALLEST_JUMP: f64 = 0.05;
/// Deviation of a torque from the mean of its neighbours, as a multiple of what 99 % of the samples show.
const SPIKE: f64 = 30.0;

/// Positions that jump (encoder reset, wrap) and torques that spike for one sample; gaps say nothing of either.
pub(crate) fn jumps(log: &Log, out: &mut Vec<Finding>) {
    let gaps = read_clock(&log.time).gaps;
    let across = |first: usize, last: usize| {
        gaps.iter()
            .any(|gap| (first + 1..=last).contains(&gap.sample))
    };
    for (j, joint) in log.joints.iter().enumerate() {
        let q = &log.q[j];
        let step = |(k, w): (usize, &[f64])| {
            let step = (w[1] - w[0]).abs();
            if across(k, k + 1) { 0.0 } else { step }
        };
        let steps: Vec<f64> = q.windows(2).enumerate().map(step).collect();
        let usual = (JUMP * quantile(&steps, 0.99)).max(SMALLEST_JUMP);
        if let Some(k) = steps.iter().position(|s| *s > usual) {
            let step = q[k + 1] - q[k];
            let turn = (step.abs() / std::f64::consts::TAU - 1.0).abs() < 0.05;
            let hint = if turn {
                "; this is one turn, so the position wraps"
            } else {
                ""
            };
            out.push(Finding::new(
                "position-jump",
                Severity::Error,
                log.place(k + 1).joint(joint),
                step,
                format!("position jumps by {step:.4} in one sample"),
                format!(
                    "a joint cannot move {JUMP} times as fast as ever else for one sample{hint}"
                ),
                "cut the log here (FILE@A..B, --exclude), or unwrap the position",
            ));
        }
        let torque = &drive(log)[j];
        let deviation_of = |(k, w): (usize, &[f64])| {
            let off = (w[1] - 0.5 * (w[0] + w[2])).abs();
            if across(k, k + 2) { 0.0 } else { off }
        };
        let off: Vec<f64> = torque.windows(3).enumerate().map(deviation_of).collect();
        let usual = SPIKE * quantile(&off, 0.99).max(1e-3 * deviation(torque));
        let spikes = off.iter().filter(|v| **v > usual).count();
        if let Some(k) = off.iter().position(|v| *v > usual) {
            out.push(Finding::new(
                "torque-spike",
                Severity::Warning,
                log.place(k + 1).joint(joint),
                torque[k + 1],
                format!("{spikes} torque samples stand out by {SPIKE} times the usual, the first is {:.4}", torque[k + 1]),
                "one sample cannot be a torque",
                "leave them out with --exclude LOG:A..B",
            ));
        }
    }
}

/// Speed, as a share of the joint's largest, below which it stands.
const STANDING: f64 = 0.01;
/// Share of the log at standstill worth a warning: an eighth biases Coulomb terms visibly.
const STANDSTILL: f64 = 0.125;
/// Span over which a speed is measured, s.
const SPAN: f64 = 0.1;

pub(crate) fn standstill(log: &Log, robot: &Robot, out: &mut Vec<Finding>) {
    let n = log.n_samples();
    let interval = read_clock(&log.time).interval;
    let span = ((SPAN / interval).round() as usize).clamp(1, n - 1);
    let speeds: Vec<Vec<f64>> = log
        .q
        .iter()
        .map(|q| {
            (span..n)
                .map(|k| ((q[k] - q[k - span]) / (log.time[k] - log.time[k - span])).abs())
                .collect()
        })
        .collect();
    let limits: Vec<f64> = speeds
        .iter()
        .map(|s| STANDING * s.iter().fold(0.0f64, |m, v| m.max(*v)))
        .collect();
    let stands = |k: usize| speeds.iter().zip(&limits).all(|(s, limit)| s[k] <= *limit);
    let standing: Vec<usize> = (0..n - span).filter(|&k| stands(k)).collect();
    let share = standing.len() as f64 / (n - span) as f64;
    if let Some(&first) = standing.first()
        && share > STANDSTILL
    {
        out.push(Finding::new(
            "standstill",
            Severity::Warning,
            log.place(first + span).time(log.time[first + span]),
            share,
            format!("the arm stands still in {:.0} % of the log", 100.0 * share),
            "at rest the sign of friction is not known, so Coulomb terms are biased",
            "leave out rows at low speed with --dead-band SPEED, or cut the log to the motion (FILE@A..B)",
        ));
    }
    for (j, joint) in robot.joints().iter().enumerate() {
        let (low, high) = range(&log.q[j]);
        if high - low < crate::motion::still(joint.kind) {
            out.push(Finding::new(
                "unexcited-joint",
                Severity::Warning,
                Place::file(&log.file).joint(&joint.name),
                high - low,
                format!("range {:.2e}", high - low),
                "a joint that stands still shows neither its friction nor its inertia",
                "record a motion of this joint; its parameters are left out",
            ));
        }
    }
}

pub(crate) fn drive(log: &Log) -> &[Vec<f64>] {
    match &log.drive {
        Drive::Torque(x) | Drive::Current(x) => x,
    }
}

pub(crate) fn deviation(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
}

fn quantile(x: &[f64], share: f64) -> f64 {
    let mut sorted = x.to_vec();
    let k = ((share * x.len() as f64) as usize).min(x.len() - 1);
    *sorted.select_nth_unstable_by(k, f64::total_cmp).1
}
