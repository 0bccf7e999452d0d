//! The columns of an identification: those of the rigid body and its drives, and those that gears, springs and friction add.

use crate::samples::Stretch;
use idim_excitation::AddedColumn;
use idim_model::{Columns, JointKind, KnownTorque, Notation, ParameterKind, Robot};

/// Columns in their order: the model's own first, then the others.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelColumns {
    /// Columns of the torque regressor.
    pub standard: Columns,
    /// Columns beside them.
    pub extra: Vec<ExtraColumn>,
}

/// A column that the torque regressor does not have.
#[derive(Debug, Clone, PartialEq)]
pub enum ExtraColumn {
    /// Rotor inertia (`Ia`), viscous (`Fv`) or Coulomb friction (`Fc`) of a motor that turns with several joints.
    Motor {
        /// The motor, by the joint it drives.
        motor: usize,
        /// Which of the three.
        kind: ParameterKind,
        /// Turns of the motor per turn of each joint, over those per turn of its own: the entry of the joint's row.
        turns: Vec<f64>,
    },
    /// Scale of a torque known by its shape.
    Known(KnownTorque),
    /// A term of a joint's friction beside `Fv`, `Fc` and offset.
    Friction {
        /// The joint.
        joint: usize,
        /// Its course over speed and load.
        term: FrictionTerm,
    },
}

/// Friction of one joint beside viscous, Coulomb and offset; `s` is the smoothed sign of the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionTerm {
    /// `|q̇|`: viscous friction that differs between the directions (Coulomb's asymmetry is the offset).
    Asymmetric,
    /// `q̇³`.
    Cubic,
    /// `s √|q̇|`.
    Root,
    /// `s exp(-(q̇/v)²)`: what static friction has above Coulomb's; `v` in rad/s (m/s).
    Stribeck(f64),
    /// `|τ_load| s`, with the torque of the rigid body from the fit before (Hamon et al. 2010).
    Load,
}

/// Speed of a motor below which its Coulomb torque is smoothed, rad/s at its own joint: no speed is searched for motors.
const MOTOR_REVERSAL: f64 = 0.01;
/// A prismatic joint's smoothing speed, m/s, per rad/s of a revolute one.
pub(crate) const PRISMATIC_SPEED: f64 = 0.1;

/// Speed over which a motor's Coulomb torque changes sign, where its joint's does over `reversal`.
pub(crate) fn motor_reversal(reversal: f64) -> f64 {
    if reversal > 0.0 { MOTOR_REVERSAL } else { 0.0 }
}

/// Sign of a speed, smoothed over `reversal`; the sign itself for 0.
pub(crate) fn smooth_sign(speed: f64, reversal: f64) -> f64 {
    if reversal > 0.0 {
        (speed / reversal).tanh()
    } else if speed == 0.0 {
        0.0
    } else {
        speed.signum()
    }
}

impl ModelColumns {
    /// The columns at these positions, in this order; those of the regressor must stand before the others.
    #[must_use]
    pub fn select(&self, positions: &[usize]) -> Self {
        let n = self.standard.len();
        let split = positions.partition_point(|&k| k < n);
        assert!(
            positions[split..].iter().all(|&k| k >= n),
            "columns of the regressor stand first"
        );
        Self {
            standard: self.standard.select(&positions[..split]),
            extra: positions[split..]
                .iter()
                .map(|&k| self.extra[k - n].clone())
                .collect(),
        }
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.standard.len() + self.extra.len()
    }

    /// Whether there is no column.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Names in order.
    pub fn names(&self, notation: Notation) -> Vec<String> {
        let mut names = self.standard.names(notation);
        names.extend(self.extra.iter().map(ExtraColumn::name));
        names
    }
}

impl ExtraColumn {
    /// Name, `IaM6` for the rotor of motor 6.
    pub fn name(&self) -> String {
        match self {
            Self::Motor { motor, kind, .. } => {
                let word = match kind {
                    ParameterKind::Ia => "IaM",
                    ParameterKind::Fv => "FvM",
                    _ => "FcM",
                };
                format!("{word}{}", motor + 1)
            }
            Self::Known(torque) => torque.name().to_owned(),
            Self::Friction { joint, term } => format!("{}{}", term.word(), joint + 1),
        }
    }

    /// The column as a motion is designed for it; `None` for friction beside viscous and Coulomb.
    pub(crate) fn added(&self) -> Option<AddedColumn> {
        match self {
            Self::Motor { kind, turns, .. } => Some(AddedColumn::Motor {
                kind: *kind,
                turns: turns.clone(),
            }),
            Self::Known(torque) => Some(AddedColumn::Known(torque.clone())),
            Self::Friction { .. } => None,
        }
    }

    /// What the column multiplies on a joint's row over a stretch; `None` where that is zero throughout.
    ///
    /// `reversal`: speed over which each joint's Coulomb torque changes sign.
    pub(crate) fn series(
        &self,
        joint: usize,
        stretch: &Stretch,
        reversal: &[f64],
    ) -> Option<Vec<f64>> {
        let states = &stretch.states;
        match self {
            Self::Motor { motor, kind, turns } => {
                let factor = turns[joint];
                if factor == 0.0 {
                    return None;
                }
                let mut turned = vec![0.0; states.n_samples()];
                for (j, &ratio) in turns.iter().enumerate().filter(|(_, r)| **r != 0.0) {
                    let rate = match kind {
                        ParameterKind::Ia => states.qdd(j),
                        _ => states.qd(j),
                    };
                    for (t, v) in turned.iter_mut().zip(rate) {
                        *t += ratio * v;
                    }
                }
                let reversal = motor_reversal(reversal[*motor]);
                let value = |t: f64| match kind {
                    ParameterKind::Fc => factor * smooth_sign(t, reversal),
                    _ => factor * t,
                };
                Some(turned.into_iter().map(value).collect())
            }
            Self::Known(torque) => (torque.joint() == joint)
                .then(|| states.q(joint).iter().map(|&q| torque.at(q)).collect()),
            Self::Friction { joint: own, term } => {
                let load = stretch.load.as_ref().map(|l| l[joint].as_slice());
                (*own == joint).then(|| term.series(states.qd(joint), load, reversal[joint]))
            }
        }
    }
}

impl FrictionTerm {
    /// First part of its parameter's name.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Asymmetric => "Fva",
            Self::Cubic => "Fcub",
            Self::Root => "Froot",
            Self::Stribeck(_) => "Fs",
            Self::Load => "Fl",
        }
    }

    /// The term for each speed; the load-dependent one is zero where no load is known yet.
    pub(crate) fn series(self, speed: &[f64], load: Option<&[f64]>, reversal: f64) -> Vec<f64> {
        let sign = |v: f64| smooth_sign(v, reversal);
        match self {
            Self::Asymmetric => speed.iter().map(|v| v.abs()).collect(),
            Self::Cubic => speed.iter().map(|v| v.powi(3)).collect(),
            Self::Root => speed.iter().map(|&v| sign(v) * v.abs().sqrt()).collect(),
            Self::Stribeck(scale) => speed
                .iter()
                .map(|&v| sign(v) * (-(v / scale).powi(2)).exp())
                .collect(),
            Self::Load => match load {
                Some(load) => speed
                    .iter()
                    .zip(load)
                    .map(|(&v, l)| l.abs() * sign(v))
                    .collect(),
                None => vec![0.0; speed.len()],
            },
        }
    }
}

/// The columns that the robot file adds: motors that turn with several joints, known torques.
pub(crate) fn described_extras(robot: &Robot) -> Vec<ExtraColumn> {
    let mut extra = Vec::new();
    if let Ok(transmission) = robot.transmission() {
        for motor in 0..robot.n_joints() {
            let own = transmission[(motor, motor)];
            let turns: Vec<f64> = transmission.row(motor).iter().map(|t| t / own).collect();
            if turns.iter().filter(|t| **t != 0.0).count() > 1 {
                let kinds = [ParameterKind::Ia, ParameterKind::Fv, ParameterKind::Fc];
                extra.extend(kinds.map(|kind| ExtraColumn::Motor {
                    motor,
                    kind,
                    turns: turns.clone(),
                }));
            }
        }
    }
    let known = robot.drives().known_torques.iter().cloned();
    extra.extend(known.map(ExtraColumn::Known));
    extra
}

/// A joint's speed of reversal, rad/s (m/s), from that of a revolute one.
pub(crate) fn reversal_of(robot: &Robot, joint: usize, speed: f64) -> f64 {
    match robot.joints()[joint].kind {
        JointKind::Revolute => speed,
        JointKind::Prismatic => speed * PRISMATIC_SPEED,
    }
}
