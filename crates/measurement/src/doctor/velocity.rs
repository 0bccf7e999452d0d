//! Findings from recorded velocities against positions: unit, sign, gear side, order, delay.

use crate::clock::read_clock;
use crate::doctor::finding::{Finding, Severity};
use crate::doctor::regression::{centred, correlation, lowest};
use crate::error::Place;
use crate::log::Log;
use crate::plausibility::{SAME_MOTION, meaning_of_factor, velocity_fit};
use idim_model::Robot;

/// Deviation of the factor worth a warning.
const DOUBTFUL: f64 = 0.05;
/// Deviation of the factor that spoils a result.
const WRONG: f64 = 0.1;

pub(crate) fn velocity(log: &Log, robot: &Robot, out: &mut Vec<Finding>) {
    let Some(qd) = &log.qd else {
        return;
    };
    for (j, joint) in robot.joints().iter().enumerate() {
        let Some(fit) = velocity_fit(&log.time, &log.q[j], &qd[j]) else {
            continue;
        };
        let place = Place::file(&log.file).joint(&joint.name);
        if fit.correlation.abs() < SAME_MOTION {
            out.push(unrelated(log, qd, j, place, fit.correlation));
        } else if (fit.factor - 1.0).abs() > WRONG {
            let (code, meaning) = meaning_of_factor(fit.factor, joint);
            out.push(Finding::new(
                code,
                Severity::Error,
                place,
                fit.factor,
                format!(
                    "q changes {:.4} times as fast as the recorded qd says",
                    fit.factor
                ),
                "dq/dt and qd must agree",
                meaning,
            ));
        } else if (fit.factor - 1.0).abs() > DOUBTFUL {
            out.push(Finding::new(
                "velocity-factor",
                Severity::Warning,
                place,
                fit.factor,
                format!(
                    "q changes {:.3} times as fast as the recorded qd says",
                    fit.factor
                ),
                "dq/dt and qd must agree",
                "differentiate q instead",
            ));
        }
    }
    delay(log, qd, out);
}

/// A velocity that does not follow its joint, and the joint it follows instead, if any.
fn unrelated(log: &Log, qd: &[Vec<f64>], joint: usize, place: Place, correlation: f64) -> Finding {
    let others = (0..log.n_joints()).filter(|&i| i != joint);
    let followed = others.filter_map(|i| {
        let fit = velocity_fit(&log.time, &log.q[i], &qd[joint])?;
        Some((i, fit.correlation))
    });
    let other = followed
        .filter(|(_, correlation)| *correlation > SAME_MOTION)
        .max_by(|a, b| a.1.total_cmp(&b.1));
    match other {
        Some((other, _)) => Finding::new(
            "joint-order",
            Severity::Error,
            place,
            other as f64 + 1.0,
            format!(
                "the recorded qd follows the motion of joint {}",
                log.joints[other]
            ),
            "q and qd must list the joints in one order",
            format!(
                "exchange the columns of {} and {}",
                log.joints[joint], log.joints[other]
            ),
        ),
        None => Finding::new(
            "velocity-unrelated",
            Severity::Warning,
            place,
            correlation,
            format!("recorded qd follows dq/dt with correlation {correlation:.2} only"),
            "dq/dt and qd must agree",
            "differentiate q instead",
        ),
    }
}

/// Longest delay looked for, s.
const LONGEST: f64 = 0.1;
/// Delay worth a warning, s; a drive's own filter takes a few milliseconds.
const DELAY: f64 = 0.008;
/// Span over which displacements are compared, s.
const SPAN: f64 = 0.05;

/// Delay of the recorded velocity behind the positions, one finding for the log.
fn delay(log: &Log, qd: &[Vec<f64>], out: &mut Vec<Finding>) {
    let n = log.n_samples();
    let interval = read_clock(&log.time).interval;
    let span = ((SPAN / interval).round() as usize).max(2);
    let reach = (LONGEST / interval).ceil() as usize;
    if n < 4 * (span + reach) {
        return;
    }
    let stride = n.div_ceil(8000);
    let mut lags: Vec<f64> = (0..log.n_joints())
        .filter_map(|j| {
            let mut integral = vec![0.0; n];
            for k in 1..n {
                integral[k] = integral[k - 1]
                    + 0.5 * (qd[j][k] + qd[j][k - 1]) * (log.time[k] - log.time[k - 1]);
            }
            let rows: Vec<usize> = (reach + span..n - reach).step_by(stride).collect();
            let moved = rows
                .iter()
                .map(|&k| log.q[j][k] - log.q[j][k - span])
                .collect::<Vec<_>>();
            let moved = centred(&moved);
            let curve: Vec<f64> = (0..=2 * reach)
                .map(|lag| {
                    let shifted = |k: usize| k + lag - reach;
                    let said: Vec<f64> = rows
                        .iter()
                        .map(|&k| integral[shifted(k)] - integral[shifted(k) - span])
                        .collect();
                    1.0 - correlation(&moved, &centred(&said)).abs()
                })
                .collect();
            let at = lowest(&curve);
            let clear = curve[at.round() as usize] < 1.0 - SAME_MOTION;
            clear.then_some((at - reach as f64) * interval)
        })
        .collect();
    if lags.is_empty() {
        return;
    }
    lags.sort_unstable_by(f64::total_cmp);
    let lag = lags[lags.len() / 2];
    if lag.abs() > DELAY.max(1.5 * interval) {
        out.push(Finding::new(
            "velocity-delay",
            Severity::Warning,
            Place::file(&log.file),
            lag,
            format!("recorded qd lags dq/dt by {:.1} ms", 1e3 * lag),
            "channels must be of one instant",
            "differentiate q instead",
        ));
    }
}
