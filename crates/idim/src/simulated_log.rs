//! `idim simulate`: the log a robot with known inertia would leave behind, to try things out before there is a real one.

use crate::cli::{RobotChanges, load, say};
use crate::error::Error;
use crate::load::read_text;
use crate::output::{refuse_overwriting, write_atomically};
use clap::Args;
use idim_model::{Joint, JointKind, JointStates, LogSide, Model, Robot, inverse_dynamics_batch};
use idim_trajectory::{Limits, Motion, TrajectoryFile, random_series};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write as _;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `simulate`.
#[derive(Debug, Clone, Args)]
pub struct SimulateArgs {
    /// Robot file, .ron or .urdf, with inertial values for every link.
    #[arg(long, value_name = "FILE")]
    pub robot: PathBuf,
    /// Motion as a trajectory file (default: a random one inside the robot's limits).
    #[arg(long, value_name = "FILE")]
    pub motion: Option<PathBuf>,
    /// Log to write, CSV.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Samples a second.
    #[arg(long, value_name = "HZ", default_value_t = 200.0)]
    pub rate: f64,
    /// Length of the log, s; a motion starts again when it is over.
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    pub duration: f64,
    /// Standard deviation of the torque's noise, as a share of each joint's largest torque.
    #[arg(long, value_name = "SHARE", default_value_t = 0.01)]
    pub noise: f64,
    /// Record the motors' currents instead of torques.
    #[arg(long)]
    pub currents: bool,
    /// Seed of motion and noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Changes to the robot.
    #[command(flatten)]
    pub changes: RobotChanges,
}

/// Period and harmonics of a random motion: those of the CRS A460's experiments.
const PERIOD: f64 = 10.0;
const HARMONICS: usize = 5;
/// A motion keeps this share of the room the limits leave, as a careful user would.
const ROOM: f64 = 0.9;
/// Limits where the robot file states none: rad, rad/s, rad/s² (m for prismatic).
const POSITION: f64 = 1.5;
const VELOCITY: f64 = 1.5;
const ACCELERATION: f64 = 6.0;
/// Samples at most: half a gigabyte of text.
const MOST_SAMPLES: f64 = 5e6;

/// Writes the log and says what is in it.
pub(crate) fn run_simulate(args: &SimulateArgs, out: &mut dyn Write) -> Result<(), Error> {
    let mut inputs = vec![args.robot.as_path()];
    inputs.extend(args.motion.as_deref());
    refuse_overwriting(&args.out, &[""], &inputs)?;
    let robot = load(&args.robot, &args.changes)?.robot;
    let samples = args.rate * args.duration;
    if !(args.rate > 0.0 && args.duration > 0.0 && (1.0..=MOST_SAMPLES).contains(&samples)) {
        let met = format!("--rate {} and --duration {}", args.rate, args.duration);
        let rule = format!("both above zero, at most {MOST_SAMPLES} samples together");
        return Err(Error::input("simulate", met, rule));
    }
    if !(args.noise >= 0.0 && args.noise.is_finite()) {
        let met = format!("--noise {}", args.noise);
        return Err(Error::input(
            "simulate",
            met,
            "a share of zero or more, 0.01 for one percent",
        ));
    }
    let motion = motion(args, &robot)?;
    let n = samples.round() as usize;
    let times: Vec<f64> = (0..n).map(|k| k as f64 / args.rate).collect();
    let states = states_over(&motion, &times);
    let log = SimulatedLog::new(&robot, &states, args)?;
    write_atomically(&args.out, log.csv(&times).as_bytes())?;
    let text = format!(
        "wrote {}: {n} samples of {} joints over {} s, {}\n",
        args.out.display(),
        robot.n_joints(),
        args.duration,
        log.contents,
    );
    say(out, &text)
}

fn motion(args: &SimulateArgs, robot: &Robot) -> Result<Motion, Error> {
    let Some(path) = &args.motion else {
        let limits = limits(robot)?;
        return Ok(Motion::Fourier(random_series(
            &limits, HARMONICS, PERIOD, args.seed,
        )));
    };
    let text = read_text(path)?;
    let motion = if text.trim_start().starts_with('{') {
        let file: TrajectoryFile = serde_json::from_str(&text).map_err(|e| {
            Error::input(
                path.display().to_string(),
                e.to_string(),
                "give a file that idim wrote",
            )
        })?;
        file.motion()?
    } else {
        TrajectoryFile::from_ron(&text)?.motion()?
    };
    let joints = match &motion {
        Motion::Fourier(s) => s.n_joints(),
        Motion::Quintic(p) => p.n_joints(),
    };
    if joints == robot.n_joints() {
        return Ok(motion);
    }
    Err(Error::input(
        path.display().to_string(),
        format!(
            "a motion of {joints} joints for a robot of {}",
            robot.n_joints()
        ),
        "give the motion of this robot, or hold the other joints with --lock",
    ))
}

/// The robot's limits with some room left, usual ones where it states none.
fn limits(robot: &Robot) -> Result<Limits, Error> {
    let joints = robot.joints();
    let position = |j: &Joint| {
        let [low, high] = j.limits.position.unwrap_or([-POSITION, POSITION]);
        // A range of several turns is no use in a motion of a few seconds.
        let centre = f64::midpoint(low, high);
        let half = (0.5 * ROOM * (high - low)).min(2.0 * POSITION);
        [centre - half, centre + half]
    };
    let velocity = |j: &Joint| ROOM * j.limits.velocity.unwrap_or(VELOCITY);
    let acceleration = |j: &Joint| ROOM * j.limits.acceleration.unwrap_or(ACCELERATION);
    Ok(Limits::new(
        joints.iter().map(position).collect(),
        joints.iter().map(velocity).collect(),
        joints.iter().map(acceleration).collect(),
    )?)
}

fn states_over(motion: &Motion, times: &[f64]) -> JointStates {
    match motion {
        Motion::Fourier(series) => series.states(times),
        Motion::Quintic(path) => {
            let wrapped: Vec<f64> = times.iter().map(|t| t % path.duration()).collect();
            path.states(&wrapped)
        }
    }
}

/// Columns of the log and their names.
struct SimulatedLog {
    header: Vec<String>,
    columns: Vec<Vec<f64>>,
    contents: String,
}

impl SimulatedLog {
    fn new(robot: &Robot, states: &JointStates, args: &SimulateArgs) -> Result<Self, Error> {
        let n = robot.n_joints();
        let mut torque = joint_torques(robot, states)?;
        let mut rng = ChaCha8Rng::seed_from_u64(args.seed);
        // A stream of its own: the motion drew from the first.
        rng.set_stream(1);
        let mut position: Vec<Vec<f64>> = (0..n).map(|j| states.q(j).to_vec()).collect();
        let drives = robot.drives();
        let coupled = !drives.couplings.is_empty();
        let motors = args.currents || drives.torques == LogSide::Motor;
        if motors {
            let transmission = robot.transmission()?;
            torque = mixed(&inverse(&transmission)?.transpose(), &torque);
        }
        if drives.positions == LogSide::Motor {
            for (q, zero) in position.iter_mut().zip(robot.motor_zeros()) {
                for v in q.iter_mut() {
                    *v -= zero;
                }
            }
            position = mixed(&robot.transmission()?, &position);
        }
        for (j, joint) in robot.joints().iter().enumerate() {
            let largest = torque[j].iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            for v in &mut torque[j] {
                let draw: f64 = StandardNormal.sample(&mut rng);
                *v += args.noise * largest * draw;
            }
            if args.currents {
                let constant = joint.actuator.torque_constant.ok_or_else(|| {
                    let rule = "currents need one: N·m/A before the gear, in the joint's actuator";
                    Error::input(format!("joint {}", joint.name), "no torque_constant", rule)
                })?;
                torque[j].iter_mut().for_each(|v| *v /= constant);
            }
        }
        let mut header = vec!["t_s".to_owned()];
        let sliding =
            |j: usize, motors: bool| !motors && robot.joints()[j].kind == JointKind::Prismatic;
        header.extend((0..n).map(|j| {
            let unit = if sliding(j, drives.positions == LogSide::Motor) {
                "m"
            } else {
                "rad"
            };
            format!("q{}_{unit}", j + 1)
        }));
        header.extend((0..n).map(|j| match (args.currents, sliding(j, motors)) {
            (true, _) => format!("current{}_A", j + 1),
            (false, true) => format!("tau{}_N", j + 1),
            (false, false) => format!("tau{}_Nm", j + 1),
        }));
        let side = |motors: bool| if motors { "motors" } else { "joints" };
        Ok(Self {
            header,
            columns: position.into_iter().chain(torque).collect(),
            contents: format!(
                "positions of the {}, {} of the {}{}",
                side(drives.positions == LogSide::Motor),
                if args.currents { "currents" } else { "torques" },
                side(motors),
                if coupled {
                    ", whose gears are coupled"
                } else {
                    ""
                },
            ),
        })
    }

    fn csv(&self, times: &[f64]) -> String {
        let mut text = self.header.join(",") + "\n";
        for (k, t) in times.iter().enumerate() {
            let _ = write!(text, "{t:.6}");
            for column in &self.columns {
                let _ = write!(text, ",{:.9}", column[k]);
            }
            text.push('\n');
        }
        text
    }
}

/// Rigid body, rotors seen through the transmission, and the friction of the robot file.
fn joint_torques(robot: &Robot, states: &JointStates) -> Result<Vec<Vec<f64>>, Error> {
    let Some(standard) = robot.standard_parameters() else {
        let rule = "a simulation needs them: add `inertial` to every link";
        return Err(Error::input(robot.name(), "no inertial values", rule));
    };
    let (n, m) = (robot.n_joints(), states.n_samples());
    let rigid = inverse_dynamics_batch(&Model::new(robot), &standard, states);
    let mut torque: Vec<Vec<f64>> = rigid.chunks_exact(m).map(<[f64]>::to_vec).collect();
    if robot
        .joints()
        .iter()
        .any(|j| j.actuator.rotor_inertia.is_some())
    {
        // Tᵀ J T q̈: what the rotors ask of the joints.
        let transmission = robot.transmission()?;
        let inertia = |i: usize| robot.joints()[i].actuator.rotor_inertia.unwrap_or(0.0);
        let rotors = DMatrix::from_fn(n, n, |i, j| if i == j { inertia(i) } else { 0.0 });
        let seen = transmission.transpose() * rotors * transmission;
        let acceleration: Vec<Vec<f64>> = (0..n).map(|j| states.qdd(j).to_vec()).collect();
        for (sum, part) in torque.iter_mut().zip(mixed(&seen, &acceleration)) {
            sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
        }
    }
    for (j, joint) in robot.joints().iter().enumerate() {
        let viscous = joint.actuator.viscous_friction.unwrap_or(0.0);
        let coulomb = joint.actuator.coulomb_friction.unwrap_or(0.0);
        for (t, v) in torque[j].iter_mut().zip(states.qd(j)) {
            *t += viscous * v + coulomb * if *v == 0.0 { 0.0 } else { v.signum() };
        }
    }
    for known in &robot.drives().known_torques {
        for (t, q) in torque[known.joint()]
            .iter_mut()
            .zip(states.q(known.joint()))
        {
            *t += known.at(*q);
        }
    }
    Ok(torque)
}

fn inverse(matrix: &DMatrix<f64>) -> Result<DMatrix<f64>, Error> {
    matrix.clone().try_inverse().ok_or_else(|| {
        let rule = "correct the gear ratios or couplings of the robot file";
        Error::input("transmission", "a singular matrix", rule)
    })
}

/// A matrix times the column of series.
fn mixed(matrix: &DMatrix<f64>, series: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let m = series.first().map_or(0, Vec::len);
    (0..matrix.nrows())
        .map(|i| {
            let mut sum = vec![0.0; m];
            for (j, s) in series.iter().enumerate() {
                let entry = matrix[(i, j)];
                sum.iter_mut().zip(s).for_each(|(a, x)| *a += entry * x);
            }
            sum
        })
        .collect()
}
