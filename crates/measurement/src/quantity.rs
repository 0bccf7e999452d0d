//! The quantities of a log and the units they may be declared in.

use idim_model::JointKind;
use serde::Deserialize;

/// What a column of a log holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Deserialize)]
pub enum Quantity {
    /// Time, s.
    #[serde(rename = "t")]
    Time,
    /// Joint position, rad or m.
    #[serde(rename = "q")]
    Position,
    /// Joint velocity, rad/s or m/s.
    #[serde(rename = "qd")]
    Velocity,
    /// Joint acceleration, rad/s² or m/s².
    #[serde(rename = "qdd")]
    Acceleration,
    /// Joint torque, N·m or N.
    #[serde(rename = "tau")]
    Torque,
    /// Motor current, A.
    #[serde(rename = "current")]
    Current,
}

type Units = &'static [(&'static str, f64)];

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const TURN: f64 = 2.0 * std::f64::consts::PI;

const TIME: Units = &[
    ("s", 1.0),
    ("sec", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("msec", 1e-3),
    ("us", 1e-6),
    ("usec", 1e-6),
    ("µs", 1e-6),
    ("ns", 1e-9),
    ("nsec", 1e-9),
];
const ANGLE: Units = &[
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("deg", DEGREE),
    ("°", DEGREE),
    ("rev", TURN),
];
const ANGULAR_VELOCITY: Units = &[
    ("rads", 1.0),
    ("radps", 1.0),
    ("mrads", 1e-3),
    ("degs", DEGREE),
    ("degps", DEGREE),
    ("°s", DEGREE),
    ("revs", TURN),
    ("rpm", TURN / 60.0),
];
const ANGULAR_ACCELERATION: Units = &[
    ("rads2", 1.0),
    ("radps2", 1.0),
    ("mrads2", 1e-3),
    ("degs2", DEGREE),
    ("degps2", DEGREE),
    ("°s2", DEGREE),
];
const LENGTH: Units = &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2)];
const SPEED: Units = &[("ms", 1.0), ("mps", 1.0), ("mms", 1e-3), ("cms", 1e-2)];
const ACCELERATION: Units = &[("ms2", 1.0), ("mps2", 1.0), ("mms2", 1e-3), ("cms2", 1e-2)];
const TORQUE: Units = &[("nm", 1.0), ("mnm", 1e-3), ("nmm", 1e-3), ("knm", 1e3)];
const FORCE: Units = &[("n", 1.0), ("mn", 1e-3), ("kn", 1e3)];
const CURRENT: Units = &[("a", 1.0), ("ma", 1e-3)];

impl Quantity {
    /// Longest symbol first: `qdd1` must not be read as `q` with a name.
    pub(crate) const OF_A_JOINT: [Self; 5] = [
        Self::Current,
        Self::Torque,
        Self::Acceleration,
        Self::Velocity,
        Self::Position,
    ];

    /// Symbol that begins a column's header.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Time => "t",
            Self::Position => "q",
            Self::Velocity => "qd",
            Self::Acceleration => "qdd",
            Self::Torque => "tau",
            Self::Current => "current",
        }
    }

    /// Words that labs begin such a column with: a suggestion is made from them, never a guess.
    pub(crate) fn words(self) -> &'static [&'static str] {
        match self {
            Self::Time => &["t", "time", "timestamp", "stamp"],
            Self::Position => &["q", "pos", "position", "angle", "joint"],
            Self::Velocity => &["qd", "dq", "vel", "velocity", "speed"],
            Self::Acceleration => &["qdd", "ddq", "acc", "acceleration"],
            Self::Torque => &["tau", "torque", "trq", "effort", "force"],
            Self::Current => &["current", "i", "cur"],
        }
    }

    /// Unit inside.
    pub(crate) fn si(self, kind: JointKind) -> &'static str {
        match (self, kind) {
            (Self::Time, _) => "s",
            (Self::Position, JointKind::Revolute) => "rad",
            (Self::Velocity, JointKind::Revolute) => "rad/s",
            (Self::Acceleration, JointKind::Revolute) => "rad/s²",
            (Self::Torque, JointKind::Revolute) => "N·m",
            (Self::Position, JointKind::Prismatic) => "m",
            (Self::Velocity, JointKind::Prismatic) => "m/s",
            (Self::Acceleration, JointKind::Prismatic) => "m/s²",
            (Self::Torque, JointKind::Prismatic) => "N",
            (Self::Current, _) => "A",
        }
    }

    fn units(self, kind: JointKind) -> Units {
        match (self, kind) {
            (Self::Time, _) => TIME,
            (Self::Position, JointKind::Revolute) => ANGLE,
            (Self::Velocity, JointKind::Revolute) => ANGULAR_VELOCITY,
            (Self::Acceleration, JointKind::Revolute) => ANGULAR_ACCELERATION,
            (Self::Torque, JointKind::Revolute) => TORQUE,
            (Self::Position, JointKind::Prismatic) => LENGTH,
            (Self::Velocity, JointKind::Prismatic) => SPEED,
            (Self::Acceleration, JointKind::Prismatic) => ACCELERATION,
            (Self::Torque, JointKind::Prismatic) => FORCE,
            (Self::Current, _) => CURRENT,
        }
    }

    /// SI units per declared unit; `None` if the unit is not one of this quantity.
    pub(crate) fn factor(self, kind: JointKind, unit: &str) -> Option<f64> {
        let unit = squeeze(unit);
        let units = self.units(kind);
        units.iter().find(|(name, _)| *name == unit).map(|u| u.1)
    }

    /// Names of the units it may be declared in, as they stand in a header.
    pub(crate) fn unit_names(self, kind: JointKind) -> &'static str {
        match (self, kind) {
            (Self::Time, _) => "s, ms, us, ns",
            (Self::Position, JointKind::Revolute) => "rad, mrad, deg, rev",
            (Self::Velocity, JointKind::Revolute) => "rad_s, mrad_s, deg_s, rev_s, rpm",
            (Self::Acceleration, JointKind::Revolute) => "rad_s2, mrad_s2, deg_s2",
            (Self::Torque, JointKind::Revolute) => "Nm, mNm, Nmm, kNm",
            (Self::Position, JointKind::Prismatic) => "m, cm, mm",
            (Self::Velocity, JointKind::Prismatic) => "m_s, cm_s, mm_s",
            (Self::Acceleration, JointKind::Prismatic) => "m_s2, cm_s2, mm_s2",
            (Self::Torque, JointKind::Prismatic) => "N, mN, kN",
            (Self::Current, _) => "A, mA",
        }
    }
}

/// `rad/s²`, `rad_s^2` and `rad_s2` are one unit.
fn squeeze(unit: &str) -> String {
    unit.to_lowercase()
        .replace('²', "2")
        .chars()
        .filter(|c| !matches!(c, '_' | '/' | '^' | '*' | '·' | '.' | ' ' | '-'))
        .collect()
}
