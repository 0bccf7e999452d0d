//! The robot and its equations.
//!
//! A [`Robot`] is a checked description; a [`Model`] holds the constants its equations need. The crate owns
//!
//! ```text
//! τ = Y(q, q̇, q̈) π        torque, linear in the ten standard parameters of each link
//! H = h(q, q̇) π           energy
//! ```
//!
//! with `π` in the one order `XX XY XZ YY YZ ZZ MX MY MZ M` (inertia about the link frame's origin).
//! Entry points: [`Model::new`], [`inverse_dynamics`], [`torque_regressor`] and, for many samples,
//! [`visit_torque_regressor`].
//!
//! ```
//! use idim_model::{Columns, JointState, Model, inverse_dynamics, robot_from_ron, torque_regressor};
//! let robot = robot_from_ron(idim_fixtures::PUMA3R)?;
//! let model = Model::new(&robot);
//! let state = JointState { q: vec![0.1, 0.2, 0.3], qd: vec![1.0, -1.0, 0.5], qdd: vec![0.0, 2.0, 1.0] };
//! let parameters: Vec<f64> = (0..30).map(f64::from).collect();
//! let y = torque_regressor(&model, &Columns::inertial(3), &state);
//! let torque = inverse_dynamics(&model, &parameters, &state);
//! let product = y * nalgebra::DVector::from_vec(parameters);
//! assert!((product[1] - torque[1]).abs() < 1e-12 * torque[1].abs());
//! # Ok::<(), idim_model::Error>(())
//! ```
//!
//! What it does not do: rank decisions (`idim-base-params`), trajectories, estimation, file access.

mod adjoint;
mod axes;
mod energy;
mod error;
mod frame;
mod gradient;
#[cfg(test)]
mod gradient_identities;
#[cfg(test)]
mod identities;
mod kinematics;
mod lane;
mod lane_states;
mod model;
mod newton_euler;
mod packing;
mod parameter;
mod plan;
mod pose;
mod projection;
mod regressor;
mod robot;
mod robot_file;
mod states;
mod suggestion;
#[cfg(test)]
mod testing;
mod tiles;
mod urdf;
mod wide;
mod wrench_map;

pub use energy::{energy_difference, energy_regressor, momentum_regressor, power_regressor};
pub use error::Error;
pub use gradient::{
    regressor_contraction_gradient, squared_torque_gradient, torque_contraction_gradient,
};
pub use model::Model;
pub use newton_euler::{inverse_dynamics, inverse_dynamics_batch};
pub use parameter::{
    Columns, DriveColumns, InertialParameters, Notation, Parameter, ParameterKind,
};
pub use pose::{Pose, SNAP_ANGLE, exact_sin_cos, snap_angle};
pub use regressor::{
    BlockFiller, RegressorBlock, RegressorWorkspace, observation_matrix, torque_regressor,
    torque_regressor_into, visit_torque_regressor,
};
pub use robot::{
    Actuator, Capsule, Coupling, Drives, Formula, Function, Joint, JointKind, JointLimits,
    KnownTorque, Link, LinkCapsule, LogSide, Operation, Robot, Shapes,
};
pub use robot_file::{robot_from_ron, robot_to_ron};
pub use states::{JointState, JointStates, random_states};
pub use tiles::RegressorTiles;
pub use urdf::{robot_from_urdf, robot_from_urdf_with};
pub use wide::F64x8;
