//! From all that can be said against logs to one finding a fault.
//!
//! Channels, friction and limits are looked at one by one; the rigid body then judges what they suspect, in all logs
//! together, and what it explains is not said twice.

use super::consistency::{Believed, Examination, examine};
use super::faults::Fault;
use super::prior;
use super::readings::Reading;
use super::rows::Samples;
use super::suspicions::{Suspicion, joint_of};
use super::verdict;
use idim_measurement::doctor::{Finding, Severity, examine_channels, examine_friction};
use idim_measurement::{Log, Measurements, Place};
use idim_model::Robot;

/// A clock or positions so broken that a motion cannot be made of them.
const NO_MOTION: [&str; 3] = ["time-unit", "position-jump", "gaps"];
/// What is said of a torque factor that another finding names better.
const UNNAMED: &str = "torque-scale";
/// Names of torque factors.
const NAMED: [&str; 3] = ["gear-side", "torque-unit", "torque-is-current"];

/// Everything that can be said against logs of one robot: log by log, and, where there are several, of them together.
///
/// The last element belongs to all logs; it is empty for a single one. Each is sorted, most serious first. What all logs
/// have in common is said once, of all of them.
///
/// # Panics
/// If a log was read for another number of joints.
#[track_caller]
pub fn diagnose(logs: &[Log], robot: &Robot) -> Vec<Vec<Finding>> {
    let mut single: Vec<OneLog> = logs.iter().map(|log| OneLog::new(log, robot)).collect();
    let start = Reading::as_recorded(robot);
    let usable: Vec<&OneLog> = single.iter().filter(|l| l.samples.is_some()).collect();
    let mut of_all = Vec::new();
    let mut together = None;
    if usable.len() > 1 {
        let samples: Vec<Samples> = usable.iter().filter_map(|l| l.samples.clone()).collect();
        let names: Vec<&str> = usable.iter().map(|l| l.log.file.as_str()).collect();
        let suspicions = shared(&usable, robot);
        let e = examine(&samples, robot, &start, &suspicions);
        of_all = verdict::findings(&e, robot, &names.join(" + "));
        of_all.extend(verdict::few_samples(&e, &names.join(" + ")));
        together = Some(e);
    }
    let mut all: Vec<Vec<Finding>> = single
        .iter_mut()
        .map(|log| log.findings(robot, &start, together.as_ref(), &of_all))
        .collect();
    all.push(tidied(of_all));
    all
}

/// What most logs suspect.
fn shared(logs: &[&OneLog], robot: &Robot) -> Vec<Suspicion> {
    let of_each: Vec<Vec<Suspicion>> = logs.iter().map(|l| l.suspicions(robot)).collect();
    let mut common: Vec<Suspicion> = Vec::new();
    for suspicion in of_each.iter().flatten() {
        let suspects = |of_log: &&Vec<Suspicion>| of_log.iter().any(|s| s.is_like(suspicion));
        let most = 2 * of_each.iter().filter(suspects).count() > logs.len();
        if most && !common.iter().any(|s| s.is_like(suspicion)) {
            common.push(*suspicion);
        }
    }
    common
}

/// What one log says by itself.
struct OneLog<'a> {
    log: &'a Log,
    channels: Vec<Finding>,
    friction: Vec<Finding>,
    sizes: Vec<Finding>,
    measured: Option<Measurements>,
    /// None where there is no motion to look at.
    samples: Option<Samples>,
}

impl<'a> OneLog<'a> {
    fn new(log: &'a Log, robot: &Robot) -> Self {
        let mut one = Self {
            log,
            channels: examine_channels(log, robot),
            friction: examine_friction(log),
            sizes: Vec::new(),
            measured: None,
            samples: None,
        };
        one.channels.extend(inferred_unit(log));
        let broken = |f: &Finding| f.severity == Severity::Error && NO_MOTION.contains(&f.code);
        if one.channels.iter().any(broken) {
            return one;
        }
        match Measurements::from_log(log, robot) {
            Ok(mut measured) => {
                measured.qd = None;
                one.samples = Samples::new(&measured);
                one.sizes = prior::torque_limits(&measured, robot, &Reading::as_recorded(robot));
                one.measured = Some(measured);
            }
            Err(error) => one.channels.push(Finding::from(&error)),
        }
        one
    }

    fn suspicions(&self, robot: &Robot) -> Vec<Suspicion> {
        let columns = self.channels.iter().chain(&self.friction);
        let columns = columns.filter_map(|f| Suspicion::of(f, robot));
        let sizes = self.sizes.iter();
        columns
            .chain(sizes.filter_map(|f| Suspicion::of_size(f, robot)))
            .collect()
    }

    /// All findings of this log but those that `together`, the examination of all logs, says.
    fn findings(
        &mut self,
        robot: &Robot,
        start: &Reading,
        together: Option<&Examination>,
        of_all: &[Finding],
    ) -> Vec<Finding> {
        let suspicions = self.suspicions(robot);
        let mut out = std::mem::take(&mut self.channels);
        let mut friction = std::mem::take(&mut self.friction);
        let Some(samples) = &self.samples else {
            out.append(&mut friction);
            out.append(&mut self.sizes);
            return tidied(out);
        };
        let file = &self.log.file;
        let known = together.is_some_and(verdict::is_of_another_robot);
        let mut faults: Vec<Believed> = together.map_or_else(Vec::new, |e| e.faults.clone());
        let mut reading = together.map_or(start, |e| &e.reading).clone();
        let mut of_another = known;
        let mut judged = Vec::new();
        if !known {
            let mut suspicions = suspicions;
            suspicions.retain(|s| !faults.iter().any(|b| s.covers(&b.fault)));
            let own = examine(std::slice::from_ref(samples), robot, &reading, &suspicions);
            of_another = verdict::is_of_another_robot(&own);
            judged = verdict::findings(&own, robot, file);
            judged.extend(verdict::delay(&own, file));
            judged.extend(verdict::drift(&own, robot, file));
            if together.is_none() {
                judged.extend(verdict::few_samples(&own, file));
            }
            reading = own.reading;
            faults.extend(own.faults);
        }
        out.retain(|f| !explained(f, &faults, robot));
        out.append(&mut judged);
        let said = |f: &Finding| {
            let same = |o: &Finding| (o.code, &o.place.joint) == (f.code, &f.place.joint);
            of_all.iter().any(same)
        };
        out.retain(|f| !said(f));
        if !of_another {
            friction.retain(|f| !explained(f, &faults, robot));
            // The rigid body has looked at this and does not agree.
            for f in &mut friction {
                f.severity = f.severity.min(Severity::Warning);
            }
            out.append(&mut friction);
            out.extend(prior::prior_masses(samples, robot, &reading, file));
        }
        if let Some(measured) = &self.measured {
            out.extend(prior::torque_limits(measured, robot, &reading));
        }
        tidied(out)
    }
}

/// A clock whose unit was inferred.
fn inferred_unit(log: &Log) -> Option<Finding> {
    let inferred = |n: &&String| n.starts_with("time unit inferred");
    let note = log.notes.iter().find(inferred)?;
    Some(Finding {
        code: "time-unit",
        severity: Severity::Warning,
        place: Place::file(&log.file),
        value: None,
        met: note.clone(),
        rule: "a clock says its unit".into(),
        next_step: "name the column with its unit, for example `t_ms`".into(),
    })
}

/// Whether a finding of a single channel follows from a fault that is told anyway.
fn explained(finding: &Finding, faults: &[Believed], robot: &Robot) -> bool {
    let Some(joint) = joint_of(finding, robot) else {
        return false;
    };
    faults.iter().map(|b| &b.fault).any(|fault| {
        let here = fault.concerns(joint);
        match finding.code {
            "position-range" => here && matches!(fault, Fault::PositionFactor { .. }),
            "velocity-sign" => here && matches!(fault, Fault::PositionSign(_) | Fault::Axis(_)),
            // What friction says.
            "torque-sign" | "joint-order" => here && !matches!(fault, Fault::PositionFactor { .. }),
            _ => false,
        }
    })
}

/// Most serious first, nothing twice.
fn tidied(findings: Vec<Finding>) -> Vec<Finding> {
    let named: Vec<Option<String>> = findings
        .iter()
        .filter(|f| NAMED.contains(&f.code))
        .map(|f| f.place.joint.clone())
        .collect();
    let mut out: Vec<Finding> = Vec::new();
    for finding in findings {
        let same = |f: &Finding| (f.code, &f.place.joint) == (finding.code, &finding.place.joint);
        // Two channels that saturate, or gaps at two places, are two findings of one kind.
        let once = !["saturation", "sample-rate"].contains(&finding.code);
        let better = finding.code == UNNAMED && named.contains(&finding.place.joint);
        if better || once && out.iter().any(same) {
            continue;
        }
        out.push(finding);
    }
    out.sort_by_key(|f| std::cmp::Reverse(f.severity));
    out
}
