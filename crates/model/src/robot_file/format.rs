//! What a robot file may say, as serde reads it; `docs/robot-file.md` is its description for people.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A finite number: `NaN` and `inf` are refused where they stand.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(try_from = "f64", into = "f64")]
pub(super) struct Number(pub(super) f64);

impl TryFrom<f64> for Number {
    type Error = String;

    fn try_from(value: f64) -> Result<Self, String> {
        if value.is_finite() {
            Ok(Self(value))
        } else {
            Err(format!(
                "{value} where a finite number is needed; leave the field out if not known"
            ))
        }
    }
}

impl From<Number> for f64 {
    fn from(number: Number) -> Self {
        number.0
    }
}

impl Number {
    // By reference, as serde calls it.
    #[allow(clippy::trivially_copy_pass_by_ref)]
    fn is_zero(&self) -> bool {
        self.0 == 0.0
    }
}

impl Default for Number {
    fn default() -> Self {
        Self(0.0)
    }
}

/// The whole file.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename = "Robot")]
pub(super) struct File {
    pub(super) name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) about: Option<String>,
    pub(super) angles: AngleUnit,
    pub(super) gravity: [Number; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) base: Option<Base>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) log: Option<LogSides>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) known_torques: Vec<Known>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) ground: Option<Number>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) obstacles: Vec<Capsule>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) may_touch: Vec<(String, String)>,
    pub(super) joints: Joints,
}

/// The side of the gears the robot's logs stand on.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, rename = "Log")]
pub(super) struct LogSides {
    pub(super) positions: Side,
    pub(super) torques: Side,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum Side {
    #[default]
    Joint,
    Motor,
}

/// A torque known up to its scale: a table `(q, torque)`, or a formula of `q` with its named quantities.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename = "KnownTorque")]
pub(super) struct Known {
    pub(super) name: String,
    pub(super) joint: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) table: Option<Vec<[Number; 2]>>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) with: Vec<(String, String)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) formula: Option<String>,
}

/// All points within a radius of a segment.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename = "Capsule")]
pub(super) struct Capsule {
    pub(super) from: [Number; 3],
    pub(super) to: [Number; 3],
    pub(super) radius: Number,
}

/// Unit of every angle, angular speed and angular acceleration of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum AngleUnit {
    Degrees,
    Radians,
}

/// Pose in the base frame of the frame the first joints are described in.
#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Base {
    pub(super) xyz: [Number; 3],
    pub(super) rpy: [Number; 3],
}

/// The joints, in the convention of the whole file.
#[derive(Debug, Deserialize, Serialize)]
#[serde(rename = "Joints")]
pub(super) enum Joints {
    ModifiedDh(Vec<Entry<ModifiedDh>>),
    StandardDh(Vec<Entry<StandardDh>>),
    Poses(Vec<Entry<PoseFrame>>),
}

/// One joint and its link; `frame` says where it stands, in the file's convention.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename = "Joint")]
pub(super) struct Entry<F> {
    pub(super) name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) link: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) parent: Option<String>,
    #[serde(default)]
    pub(super) kind: Kind,
    pub(super) frame: F,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) limits: Option<Limits>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) actuator: Option<Drive>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) inertial: Option<Inertial>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) capsules: Vec<Capsule>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename = "Kind")]
pub(super) enum Kind {
    #[default]
    Revolute,
    Prismatic,
    Fixed,
}

/// Khalil & Kleinfinger 1986: `Rz(gamma) Tz(b) Rx(alpha) Tx(d) Rz(theta) Tz(r)`, the axis is z of the frame itself.
#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, rename = "ModifiedDh")]
pub(super) struct ModifiedDh {
    pub(super) gamma: Number,
    pub(super) b: Number,
    pub(super) alpha: Number,
    pub(super) d: Number,
    pub(super) theta: Number,
    pub(super) r: Number,
}

/// Denavit & Hartenberg, distal frames: `Rz(theta) Tz(d) Tx(a) Rx(alpha)`, the axis is z of the frame before.
#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, rename = "StandardDh")]
pub(super) struct StandardDh {
    pub(super) theta: Number,
    pub(super) d: Number,
    pub(super) a: Number,
    pub(super) alpha: Number,
}

/// Any pose and any axis, as in a URDF; `link_xyz` and `link_rpy` move the link's frame away from the joint's.
#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, rename = "Pose")]
pub(super) struct PoseFrame {
    pub(super) xyz: [Number; 3],
    pub(super) rpy: [Number; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) axis: Option<[Number; 3]>,
    #[serde(skip_serializing_if = "Number::is_zero")]
    pub(super) offset: Number,
    #[serde(skip_serializing_if = "are_zero")]
    pub(super) link_xyz: [Number; 3],
    #[serde(skip_serializing_if = "are_zero")]
    pub(super) link_rpy: [Number; 3],
}

#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, rename = "Limits")]
pub(super) struct Limits {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) position: Option<[Number; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) velocity: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) acceleration: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) torque: Option<Number>,
}

#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default, rename = "Actuator")]
pub(super) struct Drive {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) gear_ratio: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) torque_constant: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rotor_inertia: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) encoder_counts: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) zero: Option<Number>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) coupled: BTreeMap<String, Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) viscous_friction: Option<Number>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) coulomb_friction: Option<Number>,
}

/// The ten parameters of a link in either of two forms, in the axes of the link's frame.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename = "Inertial")]
pub(super) enum Inertial {
    /// Mass, centre of mass, inertia tensor about the centre of mass.
    CentreOfMass {
        mass: Number,
        centre: [Number; 3],
        inertia: Tensor,
    },
    /// The standard parameters, about the origin of the link's frame.
    #[serde(rename_all = "UPPERCASE")]
    Standard {
        xx: Number,
        xy: Number,
        xz: Number,
        yy: Number,
        yz: Number,
        zz: Number,
        mx: Number,
        my: Number,
        mz: Number,
        m: Number,
    },
}

#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename = "Inertia")]
pub(super) struct Tensor {
    pub(super) xx: Number,
    pub(super) yy: Number,
    pub(super) zz: Number,
    #[serde(default)]
    pub(super) xy: Number,
    #[serde(default)]
    pub(super) xz: Number,
    #[serde(default)]
    pub(super) yz: Number,
}

fn are_zero(numbers: &[Number; 3]) -> bool {
    numbers.iter().all(Number::is_zero)
}
