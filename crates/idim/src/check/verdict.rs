//! What the rigid body's judgement of a log means, in findings.

use super::consistency::{ENOUGH, Examination};
use super::faults::OF_THE_ROBOT;
use idim_measurement::Place;
use idim_measurement::doctor::{Finding, Severity};
use idim_model::Robot;

/// Fall of the misfit from which a delay is believed.
const BELIEVED_DELAY: f64 = 0.25;
/// Delay worth a warning, s; a drive's own filter takes a few milliseconds.
const DELAY: f64 = 0.008;
/// Error of one joint, in errors of the description without a robot, from which the robot is doubted. The right robot's
/// last joint may reach 1.8: its torque is mostly friction.
const WORSE: f64 = 2.1;
/// Misfit by which a robot may be worse than that description where the description is good.
const NO_BETTER: f64 = 0.3;
/// Mean error below which the description without a robot is good enough to judge one.
const GOOD: f64 = 0.2;
/// Held-out relative error from which a joint is not explained.
const UNEXPLAINED: f64 = 0.9;

/// Errors of the joints, in errors of curves that know no robot.
fn times_worse(e: &Examination) -> Vec<f64> {
    let both = e.fit.relative.iter().zip(&e.plain);
    both.map(|(own, plain)| own / plain.max(1e-3)).collect()
}

/// The joint whose torque the robot explains worst, and how many times worse than curves do, if that is too much.
fn doubted(e: &Examination) -> Option<(usize, f64)> {
    let times = times_worse(e);
    let worst = (0..times.len()).max_by(|&a, &b| times[a].total_cmp(&times[b]))?;
    let mean = e.plain.iter().sum::<f64>() / e.plain.len() as f64;
    let misfit: f64 = times.iter().map(|t| t.ln()).sum();
    let wrong = mean < GOOD && (times[worst] > WORSE || misfit > NO_BETTER);
    wrong.then_some((worst, times[worst]))
}

/// Correlation with the torques of the robot file's masses below which they are another robot's.
const FOLLOWS: f64 = 0.7;

/// Faults that are less likely together than a robot file of another robot: several, where one is of the robot's
/// description or the torques are still explained badly without them; one of the description where the masses are
/// not this robot's either.
fn contrived(e: &Examination) -> bool {
    let mut faults = e.faults.iter();
    let of_the_robot = faults.any(|b| b.fault.complexity() >= OF_THE_ROBOT);
    let several = e.faults.len() > 1;
    let strange = e.follows.is_some_and(|correlation| correlation < FOLLOWS);
    of_the_robot && (several || strange) || several && e.fit.mean_error() > GOOD
}

/// Whether the log is more likely of another robot.
pub(crate) fn is_of_another_robot(e: &Examination) -> bool {
    contrived(e) || doubted(e).is_some()
}

/// The examination in findings.
pub(crate) fn findings(e: &Examination, robot: &Robot, file: &str) -> Vec<Finding> {
    let mut out = Vec::new();
    if is_of_another_robot(e) {
        out.push(another_robot(e, robot, file));
    } else {
        let faults = e.faults.iter();
        out.extend(
            faults.flat_map(|b| b.fault.findings(robot, file, b.gain, b.backed || !e.short)),
        );
        for (j, joint) in robot.joints().iter().enumerate() {
            if e.fit.relative[j] > UNEXPLAINED {
                out.push(Finding {
                    code: "unexplained-torque",
                    severity: Severity::Warning,
                    place: Place::file(file).joint(&joint.name),
                    value: Some(e.fit.relative[j]),
                    met: format!(
                        "a rigid body with friction leaves {:.0} % of this joint's torque unexplained on held-out samples",
                        100.0 * e.fit.relative[j]
                    ),
                    rule: "most of a torque comes from gravity, inertia and friction".into(),
                    next_step: "is it the torque of this joint, in this unit, of this motion?".into(),
                });
            }
        }
    }
    out
}

/// Delay of the torques of one log; each recording has its own.
pub(crate) fn delay(e: &Examination, file: &str) -> Option<Finding> {
    let (lag, gain) = e.delay?;
    (lag.abs() > DELAY && gain > BELIEVED_DELAY).then(|| Finding {
        code: "torque-delay",
        severity: Severity::Warning,
        place: Place::file(file),
        value: Some(lag),
        met: format!("torques lag positions by {:.1} ms", 1e3 * lag),
        rule: "channels must be of one instant".into(),
        next_step: format!(
            "take it out with --delay {:.1} (ms), or log both at one clock",
            1e3 * lag
        ),
    })
}

/// Torques that drift over one log: a line beside the rigid body predicts held-out samples as much better as a fault would.
/// Nothing is said of a log of another robot.
pub(crate) fn drift(e: &Examination, robot: &Robot, file: &str) -> Vec<Finding> {
    if is_of_another_robot(e) {
        return Vec::new();
    }
    let joints = robot.joints().iter().zip(&e.drift);
    joints
        .filter(|(_, (_, gain))| *gain > e.believed)
        .map(|(joint, &(size, _))| Finding {
            code: "torque-drift",
            severity: Severity::Warning,
            place: Place::file(file).joint(&joint.name),
            value: Some(size),
            met: format!("the torque drifts by about {size:.3} over the log, whatever the arm does"),
            rule: "the same motion takes the same torque at the beginning and at the end".into(),
            next_step: "zero the sensor and warm the drive up before a run, or learn from a part of the log (FILE@A..B)".into(),
        })
        .collect()
}

/// Fewer independent samples than parameters need.
pub(crate) fn few_samples(e: &Examination, file: &str) -> Option<Finding> {
    let (samples, columns) = e.independent;
    e.short.then(|| Finding {
        code: "few-samples",
        severity: Severity::Warning,
        place: Place::file(file),
        value: Some(samples / columns as f64),
        met: format!(
            "the arm moves for {samples:.0} independent samples of all joints, {:.1} a parameter of {columns}",
            samples / columns as f64
        ),
        rule: format!("noise that remembers makes neighbours one sample; below {ENOUGH} a parameter intervals are wide and faults are hidden"),
        next_step: "record a longer motion, or more of them".into(),
    })
}

fn another_robot(e: &Examination, robot: &Robot, file: &str) -> Finding {
    let (met, value) = if let Some((joint, times)) = doubted(e) {
        let name = &robot.joints()[joint].name;
        let met = format!(
            "the robot explains the torque of {name} {times:.1} times worse than curves that know no robot"
        );
        (met, times)
    } else {
        let faults = e.faults.iter().map(|b| b.fault.summary(robot));
        let all = faults.collect::<Vec<_>>().join("; ");
        let worst = times_worse(e).into_iter().fold(0.0, f64::max);
        (format!("the torques fit this robot only with {all}"), worst)
    };
    Finding {
        code: "wrong-robot",
        severity: if e.short {
            Severity::Warning
        } else {
            Severity::Error
        },
        place: Place::file(file),
        value: Some(value),
        met,
        rule: "the right robot's few parameters predict held-out samples better than any generic curve, without several faults of the log at once".into(),
        next_step: "use the robot file of this log: its geometry, mounting, couplings and order of the joints".into(),
    }
}
