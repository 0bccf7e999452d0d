//! A synthetic log, and faults to plant in any log.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used)]
// A table of faults reads best with one expression a line.
#![allow(clippy::needless_for_each, clippy::semicolon_if_nothing_returned)]

use crate::common::robot;
use idim_measurement::doctor::{Finding, Severity, examine_log};
use idim_measurement::{Drive, Log};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Three joints under gravity, with inertia and friction, at 200 Hz for 20 s, noise included.
pub fn synthetic() -> Log {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut noise = move |scale: f64| -> f64 {
        let e: f64 = StandardNormal.sample(&mut rng);
        scale * e
    };
    let n = 4000;
    let time: Vec<f64> = (0..n).map(|k| 0.005 * f64::from(k)).collect();
    let (mut q, mut qd, mut torque) = (vec![], vec![], vec![]);
    for j in 0..3 {
        let j = f64::from(j);
        let (mut a, mut b, mut c) = (vec![], vec![], vec![]);
        for &t in &time {
            let (mut x, mut v, mut w) = (0.2 * j, 0.0, 0.0);
            for l in 1..=4 {
                let l = f64::from(l);
                let (s, k) = ((0.9 + 0.13 * j) * l, (l * l + 1.7 * j).cos() * 0.5 / l);
                let phase = s * t + j + l;
                x += k * phase.sin();
                v += k * s * phase.cos();
                w -= k * s * s * phase.sin();
            }
            a.push(x + noise(1e-5));
            b.push(v + noise(1e-3));
            let friction = 3.0 * v + 4.0 * (v / 0.01).tanh();
            c.push(20.0 / (1.0 + j) * x.cos() + 2.0 * w + friction + noise(0.2));
        }
        q.push(a);
        qd.push(b);
        torque.push(c);
    }
    Log {
        file: "run.csv".into(),
        joints: vec!["j1".into(), "j2".into(), "j3".into()],
        time_unit_declared: false,
        time,
        q,
        qd: Some(qd),
        qdd: None,
        drive: Drive::Torque(torque),
        notes: vec![],
        lines: (2..4002).collect(),
    }
}

pub type Plant = fn(&mut Log);

pub fn drive(log: &mut Log) -> &mut Vec<Vec<f64>> {
    match &mut log.drive {
        Drive::Torque(x) | Drive::Current(x) => x,
    }
}

fn qd(log: &mut Log) -> &mut Vec<Vec<f64>> {
    log.qd.as_mut().unwrap()
}

pub fn scale(x: &mut [f64], by: f64) {
    x.iter_mut().for_each(|v| *v *= by);
}

pub fn late(x: &mut [f64], seconds: f64, time: &[f64]) {
    let shift = (seconds / (time[1] - time[0])).round() as usize;
    x.copy_within(..x.len() - shift, shift);
}

fn drop_samples(log: &mut Log, samples: std::ops::Range<usize>) {
    log.time.drain(samples.clone());
    if !log.lines.is_empty() {
        log.lines.drain(samples.clone());
    }
    let Log {
        q,
        qd,
        drive: Drive::Torque(torque),
        ..
    } = log
    else {
        return;
    };
    for c in q.iter_mut().chain(torque).chain(qd.iter_mut().flatten()) {
        c.drain(samples.clone());
    }
}

/// Faults that show in the torques or positions of any log: name, plant, code, joint (from 0).
pub const FAULTS: [(&str, Plant, &str, Option<usize>); 18] = [
    (
        "torque sign",
        |l| scale(&mut drive(l)[1], -1.0),
        "torque-sign",
        Some(1),
    ),
    (
        "torque sign of the last",
        |l| scale(drive(l).last_mut().unwrap(), -1.0),
        "torque-sign",
        Some(usize::MAX),
    ),
    (
        "torque columns exchanged",
        |l| drive(l).swap(0, 1),
        "joint-order",
        Some(0),
    ),
    (
        "torque columns turned",
        |l| drive(l)[..3].rotate_left(1),
        "joint-order",
        Some(2),
    ),
    (
        "torques 30 ms late",
        |l| {
            let t = l.time.clone();
            drive(l).iter_mut().for_each(|x| late(x, 0.03, &t));
        },
        "torque-delay",
        None,
    ),
    (
        "positions 30 ms late",
        |l| {
            let t = l.time.clone();
            l.q.iter_mut()
                .chain(l.qd.iter_mut().flatten())
                .for_each(|x| late(x, 0.03, &t));
        },
        "torque-delay",
        None,
    ),
    (
        "positions in degrees",
        |l| {
            l.q.iter_mut()
                .chain(l.qd.iter_mut().flatten())
                .for_each(|x| scale(x, 57.295_78));
        },
        "position-range",
        Some(0),
    ),
    (
        "clipped torque",
        |l| {
            let top = 0.6 * drive(l)[2].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            drive(l)[2].iter_mut().for_each(|v| *v = v.clamp(-top, top));
        },
        "saturation",
        Some(2),
    ),
    ("a gap", |l| drop_samples(l, 700..900), "gaps", None),
    (
        "an encoder reset",
        |l| l.q[1][1000..].iter_mut().for_each(|v| *v -= 0.7),
        "position-jump",
        Some(1),
    ),
    (
        "a wrap",
        |l| {
            l.q[0][1300..]
                .iter_mut()
                .for_each(|v| *v += std::f64::consts::TAU)
        },
        "position-jump",
        Some(0),
    ),
    (
        "a torque spike",
        |l| drive(l)[2][901] += 5000.0,
        "torque-spike",
        Some(2),
    ),
    (
        "stale samples",
        |l| {
            for x in l.q.iter_mut().chain(l.qd.iter_mut().flatten()) {
                (2..x.len()).step_by(4).for_each(|k| x[k] = x[k - 1]);
            }
            for x in drive(l) {
                (2..x.len()).step_by(4).for_each(|k| x[k] = x[k - 1]);
            }
        },
        "stale-samples",
        None,
    ),
    (
        "coarse torque",
        |l| {
            let top = 0.2 * drive(l)[1].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            drive(l)[1]
                .iter_mut()
                .for_each(|v| *v = (*v / top).round() * top);
        },
        "quantised-torque",
        Some(1),
    ),
    (
        "coarse position",
        |l| {
            l.q[1]
                .iter_mut()
                .for_each(|v| *v = (*v * 100.0).round() / 100.0)
        },
        "quantised-position",
        Some(1),
    ),
    (
        "a joint at rest",
        |l| {
            let still = l.q[2][0];
            l.q[2].fill(still);
            if let Some(qd) = &mut l.qd {
                qd[2].fill(0.0);
            }
        },
        "unexcited-joint",
        Some(2),
    ),
    (
        "standstill",
        |l| {
            let n = l.n_samples();
            for x in &mut l.q {
                let last = x[3 * n / 4];
                x[3 * n / 4..].fill(last);
            }
            if let Some(qd) = &mut l.qd {
                qd.iter_mut().for_each(|x| x[3 * n / 4..].fill(0.0));
            }
        },
        "standstill",
        None,
    ),
    (
        "milliseconds",
        |l| {
            scale(&mut l.time, 1e3);
            l.time_unit_declared = false;
        },
        "time-unit",
        None,
    ),
];

/// Faults that show against a recorded velocity.
pub const VELOCITY_FAULTS: [(&str, Plant, &str, Option<usize>); 8] = [
    (
        "degrees",
        |l| scale(&mut l.q[1], 57.295_78),
        "degrees",
        Some(1),
    ),
    (
        "degrees a second",
        |l| scale(&mut qd(l)[0], 57.295_78),
        "degrees",
        Some(0),
    ),
    (
        "turns a minute",
        |l| scale(&mut qd(l)[0], 9.549_297),
        "velocity-unit",
        Some(0),
    ),
    (
        "velocity sign",
        |l| scale(&mut qd(l)[2], -1.0),
        "velocity-sign",
        Some(2),
    ),
    (
        "position sign",
        |l| scale(&mut l.q[2], -1.0),
        "velocity-sign",
        Some(2),
    ),
    (
        "motor side",
        |l| scale(&mut qd(l)[1], 100.0),
        "gear-side",
        Some(1),
    ),
    (
        "velocity columns exchanged",
        |l| qd(l).swap(1, 2),
        "joint-order",
        Some(1),
    ),
    (
        "velocities 30 ms late",
        |l| {
            let t = l.time.clone();
            qd(l).iter_mut().for_each(|x| late(x, 0.03, &t));
        },
        "velocity-delay",
        None,
    ),
];

pub fn names(found: &[Finding], code: &str, joint: Option<&str>) -> bool {
    found.iter().any(|f| {
        f.code == code
            && f.severity > Severity::Note
            && joint.is_none_or(|j| f.place.joint.as_deref() == Some(j))
    })
}

/// Plants every fault in a log; returns those not named.
pub fn missed(
    good: &Log,
    faults: &[(&'static str, Plant, &'static str, Option<usize>)],
) -> Vec<String> {
    let names_of_joints: Vec<&str> = good.joints.iter().map(String::as_str).collect();
    let arm = robot(&names_of_joints);
    let mut missed = Vec::new();
    for (name, plant, code, joint) in faults {
        let mut log = good.clone();
        plant(&mut log);
        let joint = joint.map(|j| names_of_joints[j.min(names_of_joints.len() - 1)]);
        let found = examine_log(&log, &arm);
        if !names(&found, code, joint) {
            let said: Vec<String> = found.iter().map(ToString::to_string).collect();
            missed.push(format!("{}: {name}, instead {said:#?}", good.file));
        }
    }
    missed
}
