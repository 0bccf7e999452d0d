//! Stated uncertainty against the truth: simulated recordings, the whole way from encoder counts to intervals.
// The truth is a table, and the coverage is what a person reads of this test.
#![allow(clippy::match_same_arms, clippy::print_stdout)]
#![allow(clippy::unwrap_used)]

use idim::{IdentifyOptions, LoadedRobot, Structure, identify};
use idim_measurement::Measurements;
use idim_model::{
    Columns, DriveColumns, JointStates, Model, ParameterKind, Robot, robot_from_ron,
    visit_torque_regressor,
};
use idim_trajectory::FourierSeries;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::{IntoParallelIterator, ParallelIterator};

const RUNS: u64 = 200;
/// Samples a second, Hz.
const RATE: f64 = 250.0;
/// Two periods of the motion.
const N_SAMPLES: usize = 5000;
/// An encoder of 17 bits at the joint, rad.
const STEP: f64 = std::f64::consts::TAU / 131_072.0;
/// Standard deviation of the torques' noise, N·m.
const NOISE: [f64; 2] = [1.0, 0.4];
/// Half the width of a 95 % interval in standard deviations.
const NORMAL_95: f64 = 1.96;

const DRIVE: DriveColumns = DriveColumns {
    rotor: false,
    viscous: true,
    coulomb: true,
    offset: true,
};

/// Base values of an arm of some 8 kg; the friction of gears.
fn truth(name: &str) -> f64 {
    match name {
        "ZZR1" => 1.2,
        "MXR1" => 2.0,
        "MY1" => 0.1,
        "ZZ2" => 0.3,
        "MX2" => 0.8,
        "MY2" => 0.05,
        "Fv1" => 1.5,
        "Fv2" => 0.6,
        "Fc1" => 2.0,
        "Fc2" => 0.8,
        "off1" => 0.3,
        "off2" => -0.2,
        other => panic!("no base parameter {other}"),
    }
}

struct Arm {
    robot: Robot,
    names: Vec<String>,
    truth: Vec<f64>,
    states: JointStates,
    torque: Vec<Vec<f64>>,
}

impl Arm {
    fn new() -> Self {
        let robot = robot_from_ron(idim_fixtures::PLANAR2R).unwrap();
        let structure = Structure::of_drives(&robot, Columns::standard(2, DRIVE));
        let (columns, names) = (structure.base_columns(), structure.base_names());
        let truth: Vec<f64> = names.iter().map(|n| truth(n)).collect();
        let a = vec![
            vec![0.9, -0.5, 0.7, 0.3, -0.4],
            vec![-0.6, 1.1, 0.5, -0.8, 0.6],
        ];
        let b = vec![
            vec![0.4, 0.8, -0.6, 0.5, 0.3],
            vec![0.7, -0.3, 0.9, 0.4, -0.7],
        ];
        let omega = std::f64::consts::TAU / 10.0;
        let motion = FourierSeries::new(omega, vec![0.3, -0.5], a, b).unwrap();
        let time: Vec<f64> = (0..N_SAMPLES).map(|k| k as f64 / RATE).collect();
        let states = motion.states(&time);
        let mut torque = vec![vec![0.0; N_SAMPLES]; 2];
        let mut row = vec![0.0; columns.len()];
        visit_torque_regressor(&Model::new(&robot), &columns, &states, |block| {
            for lane in 0..block.n_samples() {
                let sample = block.first_sample() + lane;
                for (joint, torque) in torque.iter_mut().enumerate() {
                    block.copy_row(joint, lane, &mut row);
                    let entries = columns.0.iter().zip(&mut row);
                    for (_, x) in entries.filter(|(p, _)| p.kind == ParameterKind::Fc) {
                        *x = x.abs() * (states.qd(joint)[sample] / 0.005).tanh();
                    }
                    torque[sample] = row.iter().zip(&truth).map(|(w, x)| w * x).sum();
                }
            }
        });
        Self {
            robot,
            names,
            truth,
            states,
            torque,
        }
    }

    /// What an encoder and a torque sensor record; the sensor's noise remembers this share of the sample before.
    fn recording(&self, seed: u64, memory: f64) -> Measurements {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let noisy = |torque: &Vec<f64>, sigma: f64, normal: &mut dyn FnMut() -> f64| {
            let mut noise = normal();
            let mut of = |t: &f64| {
                noise = memory * noise + (1.0 - memory * memory).sqrt() * normal();
                t + sigma * noise
            };
            torque.iter().map(&mut of).collect::<Vec<f64>>()
        };
        let torque = (0..2)
            .map(|j| noisy(&self.torque[j], NOISE[j], &mut normal))
            .collect();
        let counted = |q: &[f64]| q.iter().map(|q| (q / STEP).round() * STEP).collect();
        Measurements {
            file: "simulated".into(),
            joints: vec!["shoulder".into(), "elbow".into()],
            time: (0..N_SAMPLES).map(|k| k as f64 / RATE).collect(),
            q: (0..2).map(|j| counted(self.states.q(j))).collect(),
            qd: None,
            qdd: None,
            torque,
        }
    }

    /// Of each parameter: how often the 95 % interval covers it, and the mean error in stated standard deviations.
    fn coverage(&self, memory: f64) -> Vec<(f64, f64)> {
        let loaded = LoadedRobot {
            described: self.robot.clone(),
            robot: self.robot.clone(),
        };
        let options = IdentifyOptions {
            columns: DRIVE,
            ..IdentifyOptions::default()
        };
        let runs: Vec<Vec<f64>> = (0..RUNS)
            .into_par_iter()
            .map(|seed| {
                let log = self.recording(seed, memory);
                let proof = log.slice(0..1000);
                let found = identify(&loaded, vec![log], vec![proof], &options).unwrap();
                let estimate = found.result.estimate.unwrap();
                let all = estimate.parameters.iter().zip(&self.names).zip(&self.truth);
                all.map(|((found, name), truth)| {
                    assert_eq!(found.name, *name);
                    (found.value.unwrap() - truth) / found.std.unwrap()
                })
                .collect()
            })
            .collect();
        (0..self.names.len())
            .map(|k| {
                let covered = runs.iter().filter(|r| r[k].abs() < NORMAL_95).count();
                let mean = runs.iter().map(|r| r[k]).sum::<f64>() / RUNS as f64;
                (covered as f64 / RUNS as f64, mean)
            })
            .collect()
    }
}

/// Mean coverage, which must keep what 95 % promises; each parameter within what 200 runs can tell and bias costs.
fn assert_honest(arm: &Arm, memory: f64) {
    let all = arm.coverage(memory);
    for (name, (covered, bias)) in arm.names.iter().zip(&all) {
        println!(
            "{name}: {:.1} % covered, mean error {bias:+.2} std",
            100.0 * covered
        );
    }
    let mean = all.iter().map(|c| c.0).sum::<f64>() / all.len() as f64;
    println!("mean {:.2} %", 100.0 * mean);
    assert!((0.93..=0.97).contains(&mean), "{mean}");
    assert!(all.iter().all(|c| c.0 >= 0.90), "{all:?}");
}

#[test]
fn identity_intervals_cover_the_truth_where_noise_is_white() {
    assert_honest(&Arm::new(), 0.0);
}

#[test]
fn identity_intervals_cover_the_truth_where_noise_remembers() {
    // Half of it after 55 ms.
    assert_honest(&Arm::new(), 0.95);
}
