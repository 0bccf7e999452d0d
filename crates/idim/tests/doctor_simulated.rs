//! Faults drawn at random and planted in simulated logs of robots that the doctor's thresholds were not set on.
#![allow(clippy::unwrap_used)]
// A table of faults reads best with one expression each.
#![allow(clippy::semicolon_if_nothing_returned, clippy::assigning_clones)]
#![allow(clippy::too_many_lines)]

mod planted;

use idim_model::{JointStates, Link};
use idim_model::{Model, Robot, inverse_dynamics_batch, robot_from_ron, robot_to_ron};
use planted::{Case, Fault, fault, findings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Samples a second, and seconds, of a simulated log.
const RATE: f64 = 100.0;
const DURATION: f64 = 20.0;

/// A log of a random smooth motion, its slowest wave `slowest` Hz: torques of the robot file's masses, rotors and friction,
/// with noise.
fn simulated(robot: &Robot, seed: u64, slowest: f64) -> Case {
    let n = robot.n_joints();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = (RATE * DURATION) as usize;
    let mut states = JointStates::zeros(n, count);
    for (j, joint) in robot.joints().iter().enumerate() {
        let [low, high] = joint.limits.position.unwrap_or([-2.5, 2.5]);
        let (middle, reach) = (0.5 * (low + high), 0.5 * (high - low).min(4.0));
        let waves: Vec<[f64; 3]> = (1..=5)
            .map(|l| {
                let l = f64::from(l);
                let w = 2.0 * std::f64::consts::PI * l * (slowest + 0.01 * j as f64);
                [
                    reach * rng.random_range(0.1..0.5) / l,
                    w,
                    rng.random_range(0.0..6.3),
                ]
            })
            .collect();
        for k in 0..count {
            let t = k as f64 / RATE;
            let sum = |f: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
                waves.iter().map(|&[a, w, p]| f(a, w, w * t + p)).sum()
            };
            states.q_mut(j)[k] = middle + sum(&|a, _, x| a * x.sin());
            states.qd_mut(j)[k] = sum(&|a, w, x| a * w * x.cos());
            states.qdd_mut(j)[k] = sum(&|a, w, x| -a * w * w * x.sin());
        }
    }
    let masses = robot.standard_parameters().unwrap();
    let torque = inverse_dynamics_batch(&Model::new(robot), &masses, &states);
    let mut noise = |scale: f64| -> f64 {
        let e: f64 = StandardNormal.sample(&mut rng);
        scale * e
    };
    let mut columns = vec![(0..count).map(|k| k as f64 / RATE).collect::<Vec<f64>>()];
    for j in 0..n {
        columns.push(states.q(j).iter().map(|q| q + noise(2e-5)).collect());
    }
    for (j, joint) in robot.joints().iter().enumerate() {
        let a = &joint.actuator;
        let gear = a.gear_ratio.unwrap_or(1.0);
        let rotor = a.rotor_inertia.unwrap_or(0.0) * gear * gear;
        let whole: Vec<f64> = (0..count)
            .map(|k| {
                let (v, acc) = (states.qd(j)[k], states.qdd(j)[k]);
                torque[j * count + k]
                    + rotor * acc
                    + a.viscous_friction.unwrap_or(0.0) * v
                    + a.coulomb_friction.unwrap_or(0.0) * (v / 1e-3).tanh()
            })
            .collect();
        let largest = whole.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        columns.push(whole.iter().map(|x| x + noise(0.02 * largest)).collect());
    }
    let mut header = vec!["t".to_owned()];
    header.extend((1..=n).map(|j| format!("q{j}")));
    header.extend((1..=n).map(|j| format!("tau{j}")));
    Case {
        header,
        rows: (0..count)
            .map(|k| columns.iter().map(|c| c[k]).collect())
            .collect(),
        robot: robot_to_ron(&without_masses(robot)),
        odd: None,
    }
}

/// The robot as most files describe it: no masses.
fn without_masses(robot: &Robot) -> Robot {
    let links = robot.links().iter().map(|l| Link {
        inertial: None,
        ..l.clone()
    });
    Robot::new(
        robot.name(),
        robot.gravity(),
        robot.joints().to_vec(),
        links.collect(),
    )
    .unwrap()
}

const DEGREE: f64 = 180.0 / std::f64::consts::PI;

/// A fault of a random kind on a random joint.
fn drawn(rng: &mut ChaCha8Rng, robot: &Robot) -> Fault {
    let n = robot.n_joints();
    let j = rng.random_range(0..n);
    let other = (j + rng.random_range(1..n)) % n;
    let gear = robot.joints()[j].actuator.gear_ratio.unwrap_or(1.0);
    let name = move |s: &str, j: usize| format!("{s}{}", j + 1);
    match rng.random_range(0..8) {
        0 => fault(
            "torque sign",
            "torque-sign",
            Some(j),
            Some(-1.0),
            move |c| c.times(&[&name("tau", j)], -1.0),
        ),
        1 => fault(
            "position sign",
            "position-sign",
            Some(j),
            Some(-1.0),
            move |c| c.times(&[&name("q", j)], -1.0),
        ),
        2 => fault(
            "torques exchanged",
            "joint-order",
            Some(j),
            Some(other as f64 + 1.0),
            move |c| {
                c.exchange(&name("tau", j), &name("tau", other));
            },
        ),
        3 => fault(
            "positions exchanged",
            "joint-order",
            Some(j),
            Some(other as f64 + 1.0),
            move |c| {
                c.exchange(&name("q", j), &name("q", other));
            },
        ),
        4 => fault(
            "motor side",
            "gear-side",
            Some(j),
            Some(1.0 / gear),
            move |c| {
                c.times(&[&name("tau", j)], 1.0 / gear);
            },
        ),
        5 => fault("N mm", "torque-unit", Some(j), Some(1e3), move |c| {
            c.times(&[&name("tau", j)], 1e3)
        }),
        6 => fault("degrees", "degrees", Some(j), Some(DEGREE), move |c| {
            c.times(&[&name("q", j)], DEGREE)
        }),
        _ => fault("30 ms late", "torque-delay", None, Some(0.03), |c| {
            c.late("tau", 3)
        }),
    }
}

/// What was planted and missed, and what was said of good logs and of others than the fault.
#[derive(Default)]
struct Count {
    planted: usize,
    missed: Vec<String>,
    /// Of good logs.
    alarms: Vec<String>,
    /// Errors beside the fault.
    besides: usize,
}

impl Count {
    /// Plants faults drawn from `draw` in three logs of a robot.
    fn plant(&mut self, robot: &Robot, draw: u64, seeds: std::ops::Range<u64>, slowest: f64) {
        let joints: Vec<&str> = robot.joints().iter().map(|j| j.name.as_str()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(draw);
        for seed in seeds {
            let good = simulated(robot, seed, slowest);
            let found = findings(std::slice::from_ref(&good));
            let serious = found.iter().filter(|f| f["severity"] != "note");
            let named = serious.map(|f| format!("{} {seed}: {f}", robot.name()));
            self.alarms.extend(named);
            for _ in 0..5 {
                let fault = drawn(&mut rng, robot);
                let mut case = good.clone();
                (fault.plant)(&mut case);
                let found = findings(&[case]);
                let errors = found.iter().filter(|f| f["severity"] == "error");
                self.besides += errors.filter(|f| f["code"] != fault.code).count();
                self.planted += 1;
                if fault.named(&found, &joints) {
                    continue;
                }
                let said: Vec<String> = found
                    .iter()
                    .filter(|f| f["severity"] != "note")
                    .map(|f| format!("{} {} {}", f["code"], f["place"]["joint"], f["value"]))
                    .collect();
                let joint = fault.joint.map_or("-", |j| joints[j]);
                self.missed.push(format!(
                    "{} {seed}, {} of {joint}: said {}",
                    robot.name(),
                    fault.what,
                    said.join("; ")
                ));
            }
        }
    }

    fn named(&self) -> usize {
        let named = self.planted - self.missed.len();
        eprintln!(
            "{named} of {} random faults named, {} other errors beside them, {} alarms\n{}",
            self.planted,
            self.besides,
            self.alarms.len(),
            self.missed.join("\n")
        );
        named
    }
}

/// Of thirty. Degrees and a ratio of 72 are near each other: both leave a light wrist at rest.
const NAMED: usize = 29;

#[test]
fn identity_random_faults_of_simulated_logs_are_named() {
    let mut count = Count::default();
    for (at, text) in [idim_fixtures::CRS_A460, idim_fixtures::PUMA560]
        .into_iter()
        .enumerate()
    {
        count.plant(&robot_from_ron(text).unwrap(), 7 + at as u64, 0..3, 0.1);
    }
    assert!(count.alarms.is_empty(), "{:#?}", count.alarms);
    assert!(count.named() >= NAMED, "{:#?}", count.missed);
}

/// Of thirty, on motions and draws that nothing was set on.
const NAMED_FRESH: usize = 29;

#[test]
fn identity_random_faults_of_fresh_motions_are_named() {
    let mut count = Count::default();
    for (at, text) in [idim_fixtures::CRS_A460, idim_fixtures::PUMA560]
        .into_iter()
        .enumerate()
    {
        let robot = robot_from_ron(text).unwrap();
        count.plant(&robot, 2028 + at as u64, 50..53, 0.06);
    }
    assert!(count.alarms.is_empty(), "{:#?}", count.alarms);
    assert!(count.named() >= NAMED_FRESH, "{:#?}", count.missed);
}
