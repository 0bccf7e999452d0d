//! The robot and its equations.

mod error;
mod parameter;
mod pose;
mod robot;
mod states;

pub use error::Error;
pub use parameter::{
    Columns, DriveColumns, InertialParameters, Notation, Parameter, ParameterKind,
};
pub use pose::{Pose, SNAP_ANGLE, exact_sin_cos, snap_angle};
pub use robot::{Actuator, Joint, JointKind, JointLimits, Link, Robot};
pub use states::{JointState, JointStates, random_states};
