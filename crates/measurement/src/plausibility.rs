//! Does the log mean what it says: clock in seconds, angles in radians, joints on the joint side.

use crate::clock::GAP;
use crate::error::{Error, Place};
use crate::log::Log;
use idim_model::{Joint, JointKind, Robot};

/// Checks the clock's unit, recorded velocity against `dq/dt`, and positions against the limits, in this order.
///
/// Returns warnings, one sentence each, where going on is safe.
///
/// # Errors
/// As [`check_clock_unit`], [`check_velocity`] and [`check_positions`].
pub fn check_log(log: &Log, robot: &Robot) -> Result<Vec<String>, Error> {
    check_clock_unit(log)?;
    let mut warnings = check_velocity(log, robot)?;
    warnings.extend(check_positions(log, robot)?);
    Ok(warnings)
}

/// Sampling intervals (s) a recorded motion can have: 50 kHz to 10 Hz.
const PLAUSIBLE_INTERVAL: [f64; 2] = [2e-5, 0.1];

/// Refuses a clock whose unit is not declared and whose interval cannot be seconds.
///
/// # Errors
/// A median interval outside 20 µs to 0.1 s, with the unit that would fit.
pub fn check_clock_unit(log: &Log) -> Result<(), Error> {
    let dt = median_interval(&log.time);
    let [low, high] = PLAUSIBLE_INTERVAL;
    if log.time_unit_declared || (low..=high).contains(&dt) {
        return Ok(());
    }
    let units = [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
    let fits = units
        .iter()
        .find(|(_, s)| (low..=high).contains(&(dt * s)))
        .map(|(unit, s)| {
            format!(
                "did you mean {unit} (dt = {} s)? then name the column `t_{unit}`",
                dt * s
            )
        });
    let mut rule = fits.unwrap_or_else(|| "name the column with its unit, `t_s`".into());
    if dt == 1.0 {
        rule += "; if it is a sample count, leave it out and give the sample rate";
    }
    Err(Error::log(
        "time-unit",
        Place::file(&log.file),
        format!("dt = {dt} s from a clock without a unit"),
        rule,
    ))
}

/// Deviation of a velocity's factor from a power of ten that is one unit of time for another.
const UNIT_TOLERANCE: f64 = 0.1;

/// Settles a clock without a unit that cannot be seconds where recorded velocities say what it is: `∫q̇ dt` is then
/// a power of ten off the change of `q` in every joint that moves. The note says what was inferred and why.
///
/// Anything else stays as it is, for [`check_clock_unit`] to refuse.
pub fn infer_time_unit(log: &mut Log) {
    let dt = median_interval(&log.time);
    let [low, high] = PLAUSIBLE_INTERVAL;
    if log.time_unit_declared || (low..=high).contains(&dt) {
        return;
    }
    let Some(qd) = &log.qd else { return };
    for (unit, seconds) in [("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)] {
        if !(low..=high).contains(&(dt * seconds)) {
            continue;
        }
        let time: Vec<f64> = log.time.iter().map(|t| t * seconds).collect();
        let fits = log.q.iter().zip(qd);
        let fits: Vec<VelocityFit> = fits
            .filter_map(|(q, v)| velocity_fit(&time, q, v))
            .collect();
        let agree = |f: &VelocityFit| {
            f.correlation > SAME_MOTION && (f.factor - 1.0).abs() < UNIT_TOLERANCE
        };
        if !fits.is_empty() && fits.iter().all(agree) {
            log.time = time;
            log.time_unit_declared = true;
            log.notes.push(format!(
                "time unit inferred: {unit}, because dq/dt then agrees with the recorded qd in all {} moving joints (dt = {} s)",
                fits.len(),
                dt * seconds
            ));
            return;
        }
    }
}

/// Median of the intervals between samples, s.
pub(crate) fn median_interval(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return f64::NAN;
    }
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// How a recorded velocity fits the motion of its joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityFit {
    /// Change of position per integral of the recorded velocity: 1 where they agree.
    pub factor: f64,
    /// Correlation of the two.
    pub correlation: f64,
}

/// Span over which positions and integrated velocities are compared, s: long against noise and delay.
const COMPARED_SPAN: f64 = 0.1;
/// Root mean square displacement (rad, m) over a span below which a joint says nothing.
const STILL: f64 = 1e-4;

/// Compares changes of position with the integral of the recorded velocity over spans of 0.1 s.
///
/// `None` for a joint that hardly moves. Integrals stand noise that derivatives do not; spans across a gap say nothing.
pub fn velocity_fit(time: &[f64], q: &[f64], qd: &[f64]) -> Option<VelocityFit> {
    let dt = median_interval(time);
    let span = ((COMPARED_SPAN / dt).round() as usize).clamp(2, (q.len() / 4).max(2));
    let mut integral = vec![0.0; q.len()];
    for k in 1..q.len() {
        integral[k] = integral[k - 1] + 0.5 * (qd[k] + qd[k - 1]) * (time[k] - time[k - 1]);
    }
    let (mut xx, mut xy, mut yy, mut n) = (0.0, 0.0, 0.0, 0.0);
    let mut whole_from = 0;
    for k in 1..q.len() {
        if time[k] - time[k - 1] > GAP * dt {
            whole_from = k;
        }
        if k < whole_from + span {
            continue;
        }
        let x = integral[k] - integral[k - span];
        let y = q[k] - q[k - span];
        xx += x * x;
        xy += x * y;
        yy += y * y;
        n += 1.0;
    }
    if xx == 0.0 || yy == 0.0 || (yy / n).sqrt() < STILL {
        return None;
    }
    let correlation = xy / (xx * yy).sqrt();
    // The geometric mean slope treats noise in both alike.
    Some(VelocityFit {
        factor: (yy / xx).sqrt().copysign(correlation),
        correlation,
    })
}

/// Correlation above which a factor is meant: two records of one motion.
pub(crate) const SAME_MOTION: f64 = 0.9;
/// Deviation of a factor from a suspected one, relative.
const FACTOR_TOLERANCE: f64 = 0.05;

/// Recorded velocity against `dq/dt`: degrees for radians, wrong sign, gear side.
///
/// # Errors
/// A joint whose positions change by another factor than its velocities say, with the factor and what it means.
pub fn check_velocity(log: &Log, robot: &Robot) -> Result<Vec<String>, Error> {
    let mut warnings = Vec::new();
    let Some(qd) = &log.qd else {
        return Ok(warnings);
    };
    for (j, joint) in robot.joints().iter().enumerate() {
        let Some(fit) = velocity_fit(&log.time, &log.q[j], &qd[j]) else {
            continue;
        };
        if fit.correlation.abs() < SAME_MOTION {
            warnings.push(format!(
                "{}, joint {}: recorded qd follows dq/dt with correlation {:.2} only; differentiate q instead",
                log.file, joint.name, fit.correlation
            ));
        } else if (fit.factor - 1.0).abs() > 2.0 * FACTOR_TOLERANCE {
            let (code, meaning) = meaning_of_factor(fit.factor, joint);
            return Err(Error::log(
                code,
                Place::file(&log.file).joint(&joint.name),
                format!(
                    "q changes {:.4} times as fast as the recorded qd says",
                    fit.factor
                ),
                meaning,
            ));
        } else if (fit.factor - 1.0).abs() > FACTOR_TOLERANCE {
            warnings.push(format!(
                "{}, joint {}: q changes {:.3} times as fast as the recorded qd says; differentiate q instead",
                log.file, joint.name, fit.factor
            ));
        }
    }
    Ok(warnings)
}

/// Code and explanation of a factor between `dq/dt` and the recorded velocity.
pub(crate) fn meaning_of_factor(factor: f64, joint: &Joint) -> (&'static str, String) {
    let near = |x: f64| (factor.abs() / x - 1.0).abs() < FACTOR_TOLERANCE;
    let degree = 180.0 / std::f64::consts::PI;
    let flipped = if factor < 0.0 {
        ", and one of them has the wrong sign"
    } else {
        ""
    };
    let revolute = joint.kind == JointKind::Revolute;
    let gear = joint.actuator.gear_ratio.map_or(f64::NAN, f64::abs);
    if revolute && near(degree) {
        let text = "that is 180/π: q is in degrees; give its header the suffix `_deg`";
        return ("degrees", format!("{text}{flipped}"));
    }
    if revolute && near(1.0 / degree) {
        let text = "that is π/180: qd is in degrees a second; name it `qd1_deg_s`";
        return ("degrees", format!("{text}{flipped}"));
    }
    if near(1.0) {
        return (
            "velocity-sign",
            "q and qd have opposite signs; correct the sign of one of them".into(),
        );
    }
    if revolute && near(std::f64::consts::PI / 30.0) {
        let text = "that is π/30: qd is in turns a minute; name it `qd1_rpm`";
        return ("velocity-unit", format!("{text}{flipped}"));
    }
    if near(gear) {
        let text = format!(
            "that is the gear ratio {gear}: q is on the motor side; divide it by the ratio"
        );
        return ("gear-side", text + flipped);
    }
    if near(1.0 / gear) {
        let text = format!(
            "that is 1 / gear ratio {gear}: qd is on the motor side; divide it by the ratio"
        );
        return ("gear-side", text + flipped);
    }
    if near(1e3) || near(1e-3) {
        let text = "a factor of 1000: a unit of time or length (ms, mm) is not declared";
        return ("velocity-unit", format!("{text}{flipped}"));
    }
    (
        "velocity-factor",
        format!(
            "they should agree; is one of them on the motor side of a gear or in another unit?{flipped}"
        ),
    )
}

/// Positions this many times as far as a limit, or a range this many times as wide, cannot be the joint's.
const BEYOND_LIMITS: f64 = 4.0;
/// Positions this many times as far as a limit are doubtful.
const DOUBTFUL: f64 = 2.0;
/// Range of a revolute joint without limits, in turns, that is doubtful.
const DOUBTFUL_TURNS: f64 = 1.2;

/// A joint whose positions can hardly be what they claim.
pub(crate) struct PositionDoubt {
    pub(crate) joint: String,
    /// Widest reach over what is allowed.
    pub(crate) times: f64,
    pub(crate) met: String,
    pub(crate) rule: String,
    /// It cannot be.
    pub(crate) impossible: bool,
}

pub(crate) fn position_doubts(log: &Log, robot: &Robot) -> Vec<PositionDoubt> {
    let mut doubts = Vec::new();
    for (j, joint) in robot.joints().iter().enumerate() {
        let (low, high) = range(&log.q[j]);
        let met = format!("q from {low:.4} to {high:.4}");
        let (unit, revolute) = match joint.kind {
            JointKind::Revolute => ("degrees (then give its header the suffix `_deg`)", true),
            JointKind::Prismatic => ("mm (then name it `q1_mm`)", false),
        };
        let (times, rule) = if let Some(limits) = joint.limits.position {
            let reach = low.abs().max(high.abs());
            let largest = limits[0].abs().max(limits[1].abs());
            let times = (reach / largest).min((high - low).max(reach) / (limits[1] - limits[0]));
            let [a, b] = limits;
            (
                times,
                format!(
                    "the robot's limits are {a} to {b}; is it in {unit} or on the motor side of a gear?"
                ),
            )
        } else if revolute {
            // Scaled so that 1.2 turns are as doubtful as twice the limits; never impossible.
            let turns = (high - low) / std::f64::consts::TAU;
            let times = (turns * DOUBTFUL / DOUBTFUL_TURNS).min(BEYOND_LIMITS);
            (times, format!("that is {turns:.1} turns; is it in {unit}?"))
        } else {
            continue;
        };
        if times > DOUBTFUL {
            doubts.push(PositionDoubt {
                joint: joint.name.clone(),
                times,
                met,
                rule,
                impossible: times > BEYOND_LIMITS,
            });
        }
    }
    doubts
}

/// Positions against the robot's limits, or against a turn where it states none.
///
/// # Errors
/// A joint with limits that reaches four times as far: degrees, or the motor side of a gear.
pub fn check_positions(log: &Log, robot: &Robot) -> Result<Vec<String>, Error> {
    let mut warnings = Vec::new();
    for doubt in position_doubts(log, robot) {
        let place = Place::file(&log.file).joint(&doubt.joint);
        if doubt.impossible {
            return Err(Error::log("position-range", place, doubt.met, doubt.rule));
        }
        warnings.push(format!("{place}: {}; {}", doubt.met, doubt.rule));
    }
    Ok(warnings)
}

pub(crate) fn range(x: &[f64]) -> (f64, f64) {
    x.iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        })
}
