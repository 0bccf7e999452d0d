//! How the motors turn with the joints, torques known by their shape, and on which side of the gears a log stands.

use super::Robot;
use crate::error::Error;
use crate::robot::known_torque::KnownTorque;
use nalgebra::DMatrix;

/// The side of the gears a recorded quantity stands on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LogSide {
    /// Joint coordinates, joint torques.
    #[default]
    Joint,
    /// Motor turns, motor torques.
    Motor,
}

/// A motor that also turns with another joint than its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// The motor, by the index of the joint it drives.
    pub motor: usize,
    /// The other joint it turns with.
    pub joint: usize,
    /// Turns of this motor per turn of that joint, signed.
    pub ratio: f64,
}

/// Everything between the motors and the joints that one gear ratio a joint does not say.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Drives {
    /// Entries of the transmission matrix off its diagonal.
    pub couplings: Vec<Coupling>,
    /// Torques known up to their scale: springs, counterbalances.
    pub known_torques: Vec<KnownTorque>,
    /// Side that logs of this robot have their positions (velocities, accelerations) on.
    pub positions: LogSide,
    /// Side that logs of this robot have their torques on.
    pub torques: LogSide,
}

impl Drives {
    /// Refuses what no robot of `n_joints` joints can have.
    pub(super) fn check(&self, robot: &Robot) -> Result<(), Error> {
        let n = robot.n_joints();
        for (k, c) in self.couplings.iter().enumerate() {
            assert!(c.motor < n && c.joint < n, "a coupling of unknown joints");
            let names = [c.motor, c.joint].map(|j| robot.joints()[j].name.as_str());
            let place = format!("joint {}, coupled", names[0]);
            let refuse = |met: String, rule: &str| Err(Error::robot(&place, met, rule));
            if c.motor == c.joint {
                let rule = "a motor's own joint is its gear_ratio; name another joint";
                return refuse(format!("coupled to its own joint {}", names[1]), rule);
            }
            if !(c.ratio != 0.0 && c.ratio.is_finite()) {
                let rule = "it must be a number other than zero; leave out what is not coupled";
                return refuse(format!("ratio {} to {}", c.ratio, names[1]), rule);
            }
            if self.couplings[..k]
                .iter()
                .any(|o| (o.motor, o.joint) == (c.motor, c.joint))
            {
                return refuse(format!("coupled to {} twice", names[1]), "leave one");
            }
        }
        let motor_side = [self.positions, self.torques].contains(&LogSide::Motor);
        if motor_side || !self.couplings.is_empty() {
            let transmission = robot.transmission()?;
            if transmission.clone().try_inverse().is_none() {
                return Err(Error::robot(
                    "transmission",
                    "the motors do not determine the joints: the matrix of gear ratios and couplings is singular",
                    "correct the gear ratios or couplings",
                ));
            }
        }
        for k in &self.known_torques {
            assert!(k.joint() < n, "a known torque on an unknown joint");
        }
        Ok(())
    }

    /// What is left when a joint is held.
    pub(super) fn without(&self, joint: usize) -> Self {
        let after = |j: usize| j - usize::from(j > joint);
        let kept = |c: &&Coupling| c.motor != joint && c.joint != joint;
        Self {
            couplings: self
                .couplings
                .iter()
                .filter(kept)
                .map(|c| Coupling {
                    motor: after(c.motor),
                    joint: after(c.joint),
                    ..*c
                })
                .collect(),
            known_torques: self
                .known_torques
                .iter()
                .filter(|k| k.joint() != joint)
                .map(|k| k.on_joint(after(k.joint())))
                .collect(),
            ..*self
        }
    }
}

impl Robot {
    /// What stands between motors and joints.
    pub fn drives(&self) -> &Drives {
        &self.drives
    }

    /// The same robot with these drives.
    ///
    /// # Errors
    /// A coupling of a motor to its own joint, of ratio zero, given twice; a joint without gear ratio where couplings or
    /// motor-side logs need it; a singular transmission.
    ///
    /// # Panics
    /// If a coupling or known torque names a joint that is not there.
    pub fn with_drives(mut self, drives: Drives) -> Result<Self, Error> {
        self.drives = drives;
        self.drives.check(&self)?;
        Ok(self)
    }

    /// The transmission matrix `T`, motor by joint: `q̇_motor = T q̇_joint`, `τ_joint = Tᵀ τ_motor`, and
    /// `q_joint = T⁻¹ q_motor + zero`. Gear ratios on the diagonal, couplings beside it.
    ///
    /// Source: Khalil & Dombre 2002, coupled axes.
    ///
    /// # Errors
    /// A joint whose gear ratio is not stated.
    pub fn transmission(&self) -> Result<DMatrix<f64>, Error> {
        let n = self.n_joints();
        let mut t = DMatrix::zeros(n, n);
        for (j, joint) in self.joints.iter().enumerate() {
            let Some(ratio) = joint.actuator.gear_ratio else {
                return Err(Error::robot(
                    format!("joint {}", joint.name),
                    "no gear_ratio, which motor-side logs and couplings need for every joint",
                    "add gear_ratio (motor turns per joint turn; 1 for a direct drive) to its actuator",
                ));
            };
            t[(j, j)] = ratio;
        }
        for c in &self.drives.couplings {
            t[(c.motor, c.joint)] = c.ratio;
        }
        Ok(t)
    }

    /// A motor that turns with a joint held at `turned` from its zero is turned by a constant: its own joint's zero moves.
    pub(super) fn turn_coupled_motors(&mut self, held: usize, turned: f64) {
        // `self.joints` no longer has the held joint.
        for c in self.drives.couplings.clone() {
            if c.joint != held || c.motor == held {
                continue;
            }
            let joint = &mut self.joints[c.motor - usize::from(c.motor > held)];
            if let Some(ratio) = joint.actuator.gear_ratio {
                let moved = c.ratio * turned / ratio;
                joint.actuator.zero = Some(joint.actuator.zero.unwrap_or(0.0) - moved);
            }
        }
    }

    /// Where joint coordinates stand when the motors read zero, rad (m); 0 where not stated.
    pub fn motor_zeros(&self) -> Vec<f64> {
        let zero = |j: &super::Joint| j.actuator.zero.unwrap_or(0.0);
        self.joints.iter().map(zero).collect()
    }
}
