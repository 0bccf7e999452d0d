//! What a path through points must keep, and the proofs of it.

use super::points::PointOptions;
use crate::error::Error;
use idim_excitation::{Clearance, ClearanceCertificate, TorqueCertificate, TorquePrior};
use idim_model::{JointStates, Model, Robot};
use idim_trajectory::{Certificate, Limits, PathPoint, QuinticPath};

/// Where torques are too large the clock of the path is slowed by this until they are not, so many times at most: to a tenth.
/// Points are then searched again under speeds that are as much smaller.
const SLOWER_CLOCK: f64 = 0.93;
const CLOCKS: usize = 32;

/// A path inside all limits, and the proofs.
pub(super) struct Proved {
    pub(super) path: QuinticPath,
    pub(super) certificate: Certificate,
    pub(super) torque: Option<TorqueCertificate>,
    pub(super) clearance: Option<ClearanceCertificate>,
}

/// What a path through points came to.
pub(super) enum Outcome {
    Proved(Proved),
    /// It leaves its position limits.
    Leaves(QuinticPath),
    /// It asks too much of a motor, but not under so much slower a clock.
    TooFast(f64),
    /// Something comes too near, or a weight is too much for a motor: what a path nearer to its beginning would do.
    TooWide(&'static str),
}

/// What a path must keep.
pub(super) struct Guard<'a> {
    model: Model,
    pub(super) limits: &'a Limits,
    /// Time of the path against that of its limits: below one speeds are so much smaller, accelerations by its square.
    pub(super) clock: f64,
    torque: Option<TorquePrior>,
    clearance: Option<Clearance>,
}

impl<'a> Guard<'a> {
    /// # Errors
    /// Something is too near, or a motor too weak, where the path is to begin.
    pub(super) fn new(
        robot: &Robot,
        limits: &'a Limits,
        options: &PointOptions,
    ) -> Result<Self, Error> {
        let model = Model::new(robot);
        let mut at_home = JointStates::zeros(robot.n_joints(), 1);
        for (j, q) in home(limits).into_iter().enumerate() {
            at_home.q_mut(j)[0] = q;
        }
        if let Some(clearance) = &options.clearance
            && let Some(&(pair, distance)) = clearance.nearest(&at_home).first()
            && distance < clearance.smallest()
        {
            let [a, b] = clearance.names(pair);
            return Err(Error::input(
                "--family points",
                format!(
                    "{a} and {b} are {distance:.4} m apart amid the position limits, where the path begins"
                ),
                "give other position limits, less --clearance, or leave the pair out by --may-touch",
            ));
        }
        if let Some(prior) = &options.torque {
            let torque = prior.smooth_torque(&model, &at_home);
            let used = |j: &usize| prior.used(*j, torque[*j]);
            if let Some(j) = (0..robot.n_joints()).find(|j| used(j) > prior.share()) {
                return Err(Error::input(
                    "--family points",
                    format!(
                        "joint {} holds its weight with {:.0} % of its torque limit amid the position limits, where the path begins",
                        robot.joints()[j].name,
                        100.0 * used(&j)
                    ),
                    "give other position limits, or a larger --torque-share",
                ));
            }
        }
        Ok(Self {
            model,
            limits,
            clock: 1.0,
            torque: options.torque.clone(),
            clearance: options.clearance.clone(),
        })
    }

    /// The path through the points by this clock; by a slower one the same way, if the points are as much slower.
    fn path(&self, points: &JointStates, clock: f64) -> Result<QuinticPath, Error> {
        let limits = self.limits.scaled(1.0, clock, clock * clock);
        path_through(points, &home(self.limits), &limits)
    }

    /// What the path through the points keeps.
    pub(super) fn prove(&self, points: &JointStates) -> Result<Outcome, Error> {
        let path = self.path(points, self.clock)?;
        let certificate = path.certificate(self.limits);
        if !certificate.certified {
            return Ok(Outcome::Leaves(path));
        }
        let clearance = match &self.clearance {
            None => None,
            Some(clearance) => match ClearanceCertificate::of_path(clearance, &path) {
                Ok(proof) => Some(proof),
                Err(_) => return Ok(Outcome::TooWide("keeps the robot clear")),
            },
        };
        let torque = match &self.torque {
            None => None,
            Some(prior) => match TorqueCertificate::of_path(&self.model, prior, &path) {
                Ok(proof) => Some(proof),
                Err(_) => return self.slower_clock(points, prior),
            },
        };
        Ok(Outcome::Proved(Proved {
            path,
            certificate,
            torque,
            clearance,
        }))
    }

    /// How much slower the same way must be gone.
    fn slower_clock(&self, points: &JointStates, prior: &TorquePrior) -> Result<Outcome, Error> {
        let mut clock = 1.0;
        for _ in 0..CLOCKS {
            clock *= SLOWER_CLOCK;
            let path = self.path(&slower(points, clock), self.clock * clock)?;
            if TorqueCertificate::of_path(&self.model, prior, &path).is_ok() {
                return Ok(Outcome::TooFast(clock));
            }
        }
        Ok(Outcome::TooWide("keeps the torque limits"))
    }
}

/// The same points, passed at so much of their speed.
pub(super) fn slower(points: &JointStates, clock: f64) -> JointStates {
    let mut slower = points.clone();
    for j in 0..points.n_joints() {
        slower.qd_mut(j).iter_mut().for_each(|qd| *qd *= clock);
    }
    slower
}

/// Where a path begins and ends: amid the position limits.
pub(super) fn home(limits: &Limits) -> Vec<f64> {
    (0..limits.n_joints()).map(|j| limits.centre(j)).collect()
}

/// The shortest path from rest at home through the points and back to rest there.
pub(crate) fn path_through(
    points: &JointStates,
    home: &[f64],
    limits: &Limits,
) -> Result<QuinticPath, Error> {
    let mut all = vec![PathPoint::at_rest(home)];
    all.extend((0..points.n_samples()).map(|k| {
        let s = points.state(k);
        PathPoint { q: s.q, qd: s.qd }
    }));
    all.push(PathPoint::at_rest(home));
    Ok(QuinticPath::shortest(&all, limits)?)
}
