//! Simulated experiments with a periodic motion: what a log of a real arm would hold, and what comes back out of it.
//!
//! As Radkhah, Kulić & Croft identify: many periods averaged, positions through a Fourier series or differences, the
//! noise of the joints from the scatter between periods.

use crate::error::Error;
use crate::identify::Prediction;
use crate::samples::visit_rows;
use crate::structure::{KeepOrder, Structure};
use faer::Mat;
use idim_estimation::{
    Estimate, InformationFactor, NoiseCovariance, Solution, solve, solve_with_known_noise,
};
use idim_measurement::{
    average_periods, butterworth, filter_zero_phase, first_difference, fit_harmonics,
};
use idim_model::{
    Columns, DriveColumns, JointStates, Model, ParameterKind, Robot, inverse_dynamics_batch,
    visit_torque_regressor,
};
use idim_trajectory::FourierSeries;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What disturbs the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disturbances {
    /// Positions rounded to the encoder's counts, each joint with a zero of its own.
    pub encoders: bool,
    /// Standard deviation of the torque noise, share of each joint's largest torque over the period.
    pub torque_noise: f64,
    /// Standard deviation of each joint's torque constant, share of its value; one draw an experiment.
    pub torque_constant: f64,
    /// Whether the arm has the friction its robot file states.
    pub friction: bool,
    /// Periods recorded.
    pub n_periods: usize,
}

impl Disturbances {
    /// Encoder rounding, 2 % torque noise, friction, 18 periods.
    pub const STANDARD: Self = Self {
        encoders: true,
        torque_noise: 0.02,
        torque_constant: 0.0,
        friction: true,
        n_periods: 18,
    };
}

/// How velocity and acceleration come from the averaged positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Differentiation {
    /// Fourier series of the motion's own harmonics, differentiated exactly.
    Fourier,
    /// Central differences after a zero-phase low-pass, Hz.
    LowPass(f64),
    /// Central differences of what the encoders say.
    None,
}

/// How the recording is turned into parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Processing {
    /// Whether friction has columns.
    pub friction: bool,
    /// Velocities and accelerations.
    pub differentiation: Differentiation,
}

/// An experiment: the arm with its true parameters, and the motion it repeats.
#[derive(Debug)]
pub struct Experiment<'a> {
    robot: &'a Robot,
    motion: &'a FourierSeries,
    times: Vec<f64>,
    states: JointStates,
    rigid_torque: Vec<f64>,
    friction_torque: Vec<f64>,
    standard: Vec<f64>,
}

/// What came back.
#[derive(Debug, Clone)]
pub struct Recovered {
    /// Rows weighted by the noise of the joints, uncertainty from that noise.
    pub weighted: Estimate,
    /// Ordinary least squares.
    pub ordinary: Estimate,
    /// The true values of the same columns.
    pub truth: Vec<f64>,
    /// Positions of the rigid-body base parameters among them.
    pub rigid: Vec<usize>,
    /// Noise of one sample between the joints, from the scatter between periods; `None` for a single period.
    pub noise: Option<Vec<Vec<f64>>>,
    /// The base columns the estimates belong to.
    pub columns: Columns,
    /// States of one period, as processed.
    pub states: JointStates,
    /// Averaged torques of that period, joint by joint, N·m.
    pub torque: Vec<Vec<f64>>,
}

impl Recovered {
    /// `‖x̂ - x‖ / ‖x‖` over the rigid-body base parameters.
    pub fn relative_norm_error(&self, estimate: &Estimate) -> f64 {
        let (mut error, mut size) = (0.0, 0.0);
        for &k in &self.rigid {
            error += (estimate.values[k] - self.truth[k]).powi(2);
            size += self.truth[k].powi(2);
        }
        (error / size).sqrt()
    }

    /// Averaged torques of this experiment against what `values` of the same columns predict.
    pub fn prediction(
        &self,
        robot: &Robot,
        values: &[f64],
        times: &[f64],
        training: bool,
    ) -> Prediction {
        let mut predicted = vec![vec![0.0; times.len()]; robot.n_joints()];
        visit_rows(
            robot,
            &self.columns,
            &self.states,
            0.0,
            |sample, joint, row| {
                predicted[joint][sample] = row.iter().zip(values).map(|(w, x)| w * x).sum();
            },
        );
        Prediction {
            training,
            time: times.to_vec(),
            measured: self.torque.clone(),
            predicted,
            friction: None,
        }
    }

    /// For each parameter whether the truth lies inside the stated 95 % interval of the weighted estimate.
    pub fn covered(&self) -> Vec<bool> {
        let e = &self.weighted;
        (0..self.truth.len())
            .map(|k| (e.values[k] - self.truth[k]).abs() <= NORMAL_95 * e.standard_deviation[k])
            .collect()
    }
}

/// Torques averaged over the periods, and the covariance of one sample's noise between the joints.
struct AveragedTorque {
    mean: Vec<Vec<f64>>,
    noise: Option<Vec<Vec<f64>>>,
}

/// Half width of the 95 % interval of a normal variable, in standard deviations.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;
/// Samples a second.
pub const SAMPLE_RATE: f64 = 1000.0;

impl<'a> Experiment<'a> {
    /// The arm's true torques over one period at 1 kHz.
    ///
    /// # Errors
    /// A robot without inertial values: there is no truth to simulate.
    pub fn new(robot: &'a Robot, motion: &'a FourierSeries) -> Result<Self, Error> {
        let standard = robot.standard_parameters().ok_or_else(|| {
            Error::input(
                robot.name(),
                "no inertial values",
                "a simulated experiment needs them: add `inertial` to every link",
            )
        })?;
        let n_samples = (motion.period() * SAMPLE_RATE).round() as usize;
        let times: Vec<f64> = (0..n_samples).map(|k| k as f64 / SAMPLE_RATE).collect();
        let states = motion.states(&times);
        let rigid_torque = inverse_dynamics_batch(&Model::new(robot), &standard, &states);
        let mut friction_torque = Vec::with_capacity(rigid_torque.len());
        for (j, joint) in robot.joints().iter().enumerate() {
            let viscous = joint.actuator.viscous_friction.unwrap_or(0.0);
            let coulomb = joint.actuator.coulomb_friction.unwrap_or(0.0);
            friction_torque.extend(
                states
                    .qd(j)
                    .iter()
                    .map(|v| viscous * v + coulomb * sign(*v)),
            );
        }
        Ok(Self {
            robot,
            motion,
            times,
            states,
            rigid_torque,
            friction_torque,
            standard,
        })
    }

    /// Times of the samples of one period, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Records and identifies once; `draw` numbers the experiment under one seed.
    ///
    /// # Errors
    /// A motion that does not determine the parameters.
    pub fn run(
        &self,
        structure: &Structure,
        disturbances: &Disturbances,
        processing: &Processing,
        seed: u64,
        draw: u64,
    ) -> Result<Recovered, Error> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(draw);
        let positions = self.positions(disturbances, &mut rng);
        let AveragedTorque {
            mean: torque,
            noise,
        } = self.torques(disturbances, &mut rng)?;
        let states = self.states_from(&positions, processing)?;
        let columns = structure.base_columns();
        let n_periods = disturbances.n_periods as f64;
        let covariance = noise
            .as_ref()
            .map(|c| Mat::from_fn(c.len(), c.len(), |i, j| c[i][j] / n_periods));
        let weights = match &covariance {
            Some(c) if disturbances.torque_noise > 0.0 => NoiseCovariance::new(c.as_ref())?,
            _ => NoiseCovariance::diagonal(&self.assumed_noise(disturbances))?,
        };
        let ordinary = determined(solve(&self.factor(&columns, &states, &torque, None)?)?)?;
        let weighted = determined(solve_with_known_noise(
            &self.factor(&columns, &states, &torque, Some(&weights))?,
            1.0,
        )?)?;
        let truth = structure
            .reduction
            .base_parameters(&self.truth(structure, disturbances));
        let rigid = (0..columns.len())
            .filter(|&k| columns.0[k].kind.inertial_index().is_some())
            .collect();
        Ok(Recovered {
            weighted,
            ordinary,
            truth,
            rigid,
            noise,
            columns,
            states,
            torque,
        })
    }

    /// The structure the processing works with.
    pub fn structure(robot: &Robot, processing: &Processing) -> Structure {
        let drive = DriveColumns {
            viscous: processing.friction,
            coulomb: processing.friction,
            ..DriveColumns::NONE
        };
        Structure::of_torque(robot, drive, KeepOrder::MassFirst)
    }

    fn truth(&self, structure: &Structure, disturbances: &Disturbances) -> Vec<f64> {
        let on = if disturbances.friction { 1.0 } else { 0.0 };
        let value = |p: &idim_model::Parameter| {
            let actuator = &self.robot.joints()[p.index].actuator;
            match (p.kind.inertial_index(), p.kind) {
                (Some(k), _) => self.standard[10 * p.index + k],
                (None, ParameterKind::Fv) => on * actuator.viscous_friction.unwrap_or(0.0),
                (None, ParameterKind::Fc) => on * actuator.coulomb_friction.unwrap_or(0.0),
                _ => 0.0,
            }
        };
        structure.columns.0.iter().map(value).collect()
    }

    /// Averaged positions: every period gives the same counts, so the average is one of them.
    fn positions(&self, disturbances: &Disturbances, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let joints = self.robot.joints().iter().enumerate();
        joints
            .map(|(j, joint)| {
                let zero: f64 = rng.random_range(0.0..1.0);
                let counts = joint.actuator.encoder_counts.zip(joint.actuator.gear_ratio);
                let q = self.states.q(j).iter();
                match counts {
                    Some((counts, gear)) if disturbances.encoders => {
                        let step = std::f64::consts::TAU / (counts * gear.abs());
                        q.map(|q| ((q / step + zero).round() - zero) * step)
                            .collect()
                    }
                    _ => q.copied().collect(),
                }
            })
            .collect()
    }

    fn noise_levels(&self, disturbances: &Disturbances) -> Vec<f64> {
        let n = self.times.len();
        (0..self.robot.n_joints())
            .map(|j| {
                let torques = (0..n).map(|k| self.true_torque(j * n + k, disturbances).abs());
                disturbances.torque_noise * torques.fold(0.0, f64::max)
            })
            .collect()
    }

    /// Where no scatter tells the noise (one period, no noise), rows weigh as if it were the stated share, or 1 %.
    fn assumed_noise(&self, disturbances: &Disturbances) -> Vec<f64> {
        let share = if disturbances.torque_noise > 0.0 {
            disturbances.torque_noise
        } else {
            0.01
        };
        self.noise_levels(&Disturbances {
            torque_noise: share,
            ..*disturbances
        })
    }

    fn true_torque(&self, k: usize, disturbances: &Disturbances) -> f64 {
        self.rigid_torque[k]
            + if disturbances.friction {
                self.friction_torque[k]
            } else {
                0.0
            }
    }

    /// Averaged torques and the covariance of one sample's noise.
    fn torques(
        &self,
        disturbances: &Disturbances,
        rng: &mut ChaCha8Rng,
    ) -> Result<AveragedTorque, Error> {
        let (n, joints) = (self.times.len(), self.robot.n_joints());
        let levels = self.noise_levels(disturbances);
        let mut recorded = Vec::with_capacity(joints);
        for (j, level) in levels.iter().enumerate() {
            let gain = 1.0 + disturbances.torque_constant * normal(rng);
            let mut torque = Vec::with_capacity(n * disturbances.n_periods);
            for _ in 0..disturbances.n_periods {
                for k in 0..n {
                    torque.push(
                        gain * self.true_torque(j * n + k, disturbances) + level * normal(rng),
                    );
                }
            }
            recorded.push(torque);
        }
        if disturbances.n_periods < 2 {
            return Ok(AveragedTorque {
                mean: recorded,
                noise: None,
            });
        }
        let columns: Vec<&[f64]> = recorded.iter().map(Vec::as_slice).collect();
        let average = average_periods(&columns, n, 0)?;
        Ok(AveragedTorque {
            mean: average.mean,
            noise: Some(average.noise_covariance),
        })
    }

    fn states_from(
        &self,
        positions: &[Vec<f64>],
        processing: &Processing,
    ) -> Result<JointStates, Error> {
        let step = 1.0 / SAMPLE_RATE;
        let low_pass = match processing.differentiation {
            Differentiation::Fourier => {
                let fit =
                    fit_harmonics(positions, self.motion.period(), self.motion.n_harmonics())?;
                return Ok(fit.states(&self.times));
            }
            Differentiation::LowPass(cutoff) => {
                Some(butterworth(FILTER_ORDER, cutoff, SAMPLE_RATE))
            }
            Differentiation::None => None,
        };
        // The period is repeated on both sides, so that the filter and the differences see no edge.
        let n = self.times.len();
        let mut states = JointStates::zeros(positions.len(), n);
        for (j, q) in positions.iter().enumerate() {
            let three = [q.as_slice(), q, q].concat();
            let smooth = low_pass
                .as_ref()
                .map_or_else(|| three.clone(), |s| filter_zero_phase(s, &three));
            let velocity = first_difference(&smooth, step);
            let acceleration = first_difference(&velocity, step);
            states.q_mut(j).copy_from_slice(&smooth[n..2 * n]);
            states.qd_mut(j).copy_from_slice(&velocity[n..2 * n]);
            states.qdd_mut(j).copy_from_slice(&acceleration[n..2 * n]);
        }
        Ok(states)
    }

    fn factor(
        &self,
        columns: &Columns,
        states: &JointStates,
        torque: &[Vec<f64>],
        weights: Option<&NoiseCovariance>,
    ) -> Result<InformationFactor, Error> {
        let n = self.robot.n_joints();
        let p = columns.len();
        let mut factor = InformationFactor::new(p);
        let (mut w, mut y) = (Vec::new(), Vec::new());
        let mut outcome = Ok(());
        let n_samples = states.n_samples();
        visit_torque_regressor(&Model::new(self.robot), columns, states, |block| {
            for lane in 0..block.n_samples() {
                let start = y.len();
                w.resize((start + n) * p, 0.0);
                for joint in 0..n {
                    block.copy_row(joint, lane, &mut w[(start + joint) * p..][..p]);
                    y.push(torque[joint][block.first_sample() + lane]);
                }
                if let Some(weights) = weights {
                    weights.whiten(&mut w[start * p..], &mut y[start..]);
                }
            }
            let last = block.first_sample() + block.n_samples() == n_samples;
            if outcome.is_ok() && (last || y.len() >= BLOCK_ROWS) {
                outcome = factor.push_rows(&w, &y);
                w.clear();
                y.clear();
            }
        });
        outcome?;
        Ok(factor)
    }
}

/// Rows handed to the running factorisation at a time: enough to be fast, few enough to stay in cache.
const BLOCK_ROWS: usize = 480;
/// Order of the low-pass before differences.
const FILTER_ORDER: usize = 4;

fn determined(solution: Solution) -> Result<Estimate, Error> {
    solution.determined().map_err(|d| {
        Error::input(
            "simulated experiment",
            format!("rank {} for {} parameters", d.rank, d.n_columns),
            "the motion does not excite every parameter; take another",
        )
    })
}

fn sign(x: f64) -> f64 {
    f64::from(i8::from(x > 0.0) - i8::from(x < 0.0))
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}
