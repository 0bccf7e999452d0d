//! Columns that the torque regressor does not have: motors that turn with several joints, torques known by their shape.
//!
//! Rows are then `[Y | X]`, and so is everything made of them: `A = [Y | X]ᵀ D [Y | X]` and, with `S = ∂f/∂A`, the weights
//! `2 D [Y | X] S` of `dY` and of `dX`.

use crate::Error;
use crate::information::information_matrix;
use faer::{Mat, MatRef};
use idim_model::{
    Columns, JointStates, KnownTorque, Model, ParameterKind, RegressorBlock, visit_torque_regressor,
};

/// A column beside those of the torque regressor, on the rows of the joints it acts on.
#[derive(Debug, Clone, PartialEq)]
pub enum AddedColumn {
    /// A motor that turns with several joints: its rotor inertia (`Ia`), viscous (`Fv`) or Coulomb friction (`Fc`).
    Motor {
        /// Which of the three.
        kind: ParameterKind,
        /// Turns of the motor per turn of each joint.
        turns: Vec<f64>,
    },
    /// Scale of a torque known by its shape.
    Known(KnownTorque),
}

impl AddedColumn {
    /// The joints it acts on.
    fn joints(&self) -> Vec<usize> {
        match self {
            Self::Motor { turns, .. } => (0..turns.len()).filter(|&j| turns[j] != 0.0).collect(),
            Self::Known(torque) => vec![torque.joint()],
        }
    }

    /// Entries on the row of one of these joints, sample by sample.
    fn entries(&self, joint: usize, states: &JointStates) -> Vec<f64> {
        match self {
            Self::Motor { kind, turns } => {
                let motion = motor_motion(*kind, turns, states).into_iter();
                let value = |x: f64| match kind {
                    ParameterKind::Fc if x == 0.0 => 0.0,
                    ParameterKind::Fc => turns[joint] * x.signum(),
                    _ => turns[joint] * x,
                };
                motion.map(value).collect()
            }
            Self::Known(torque) => states.q(joint).iter().map(|&q| torque.at(q)).collect(),
        }
    }

    /// Adds the gradient by the states of `Σ weight · entry` over one joint's row.
    fn add_gradient(
        &self,
        joint: usize,
        weights: &[f64],
        states: &JointStates,
        out: &mut JointStates,
    ) {
        match self {
            Self::Motor { kind, turns } => {
                for (j, turn) in turns.iter().enumerate().filter(|(_, t)| **t != 0.0) {
                    let by_rate = match kind {
                        ParameterKind::Ia => out.qdd_mut(j),
                        ParameterKind::Fv => out.qd_mut(j),
                        // A sign does not change with the motion.
                        _ => return,
                    };
                    for (g, w) in by_rate.iter_mut().zip(weights) {
                        *g += turns[joint] * turn * w;
                    }
                }
            }
            Self::Known(torque) => {
                let slopes = states.q(joint).iter().map(|&q| torque.slope(q));
                for ((g, w), slope) in out.q_mut(joint).iter_mut().zip(weights).zip(slopes) {
                    *g += w * slope;
                }
            }
        }
    }

    /// # Errors
    /// A joint that the model does not have, a kind that no motor has.
    pub(crate) fn check(&self, n_joints: usize) -> Result<(), Error> {
        let refuse = |met: String, rule: &str| Err(Error::input("added column", met, rule));
        match self {
            Self::Motor { turns, .. } if turns.len() != n_joints => refuse(
                format!("a motor with {} ratios for {n_joints} joints", turns.len()),
                "give the turns of the motor per turn of each joint",
            ),
            Self::Motor { kind, .. }
                if !matches!(
                    kind,
                    ParameterKind::Ia | ParameterKind::Fv | ParameterKind::Fc
                ) =>
            {
                refuse(format!("{kind:?} of a motor"), "a motor has Ia, Fv and Fc")
            }
            Self::Known(torque) if torque.joint() >= n_joints => refuse(
                format!("a torque on joint {} of {n_joints}", torque.joint() + 1),
                "it acts on a joint of the model",
            ),
            _ => Ok(()),
        }
    }
}

/// Acceleration of a motor, or its speed where friction is asked for.
fn motor_motion(kind: ParameterKind, turns: &[f64], states: &JointStates) -> Vec<f64> {
    let mut motion = vec![0.0; states.n_samples()];
    for (j, turn) in turns.iter().enumerate().filter(|(_, t)| **t != 0.0) {
        let rate = match kind {
            ParameterKind::Ia => states.qdd(j),
            _ => states.qd(j),
        };
        for (m, rate) in motion.iter_mut().zip(rate) {
            *m += turn * rate;
        }
    }
    motion
}

/// The entries `X` of added columns along a motion, where they can be other than zero.
#[derive(Debug, Clone, Default)]
pub(crate) struct AddedRows {
    /// (column, joint, entries sample by sample), in the order of columns, then joints.
    parts: Vec<(usize, usize, Vec<f64>)>,
    n_columns: usize,
}

impl AddedRows {
    pub(crate) fn new(added: &[AddedColumn], states: &JointStates) -> Self {
        let mut parts = Vec::new();
        for (column, of) in added.iter().enumerate() {
            for joint in of.joints() {
                parts.push((column, joint, of.entries(joint, states)));
            }
        }
        Self {
            parts,
            n_columns: added.len(),
        }
    }

    /// Entry of a column on a joint's row at a sample.
    pub(crate) fn entry(&self, column: usize, joint: usize, sample: usize) -> f64 {
        let mut parts = self.parts.iter();
        let part = parts.find(|p| p.0 == column && p.1 == joint);
        part.map_or(0.0, |p| p.2[sample])
    }

    /// `XᵀDX`.
    fn products(&self, joint_weights: &[f64]) -> Mat<f64> {
        let mut products = Mat::zeros(self.n_columns, self.n_columns);
        for (a, joint, x) in &self.parts {
            for (b, other, y) in &self.parts {
                if joint == other {
                    products[(*a, *b)] += joint_weights[*joint] * crate::dense::dot(x, y);
                }
            }
        }
        products
    }

    /// Adds `YᵀDX` of a block, columns of `Y` down.
    fn add_cross(&self, y: &RegressorBlock, joint_weights: &[f64], cross: &mut Mat<f64>) {
        let here = y.first_sample()..y.first_sample() + y.n_samples();
        for (column, joint, x) in &self.parts {
            for a in 0..y.n_columns() {
                let lanes = y.lanes(*joint, a).iter().zip(&x[here.clone()]);
                let sum: f64 = lanes.map(|(y, x)| y * x).sum();
                cross[(a, *column)] += joint_weights[*joint] * sum;
            }
        }
    }

    /// Adds the part `D X S` of the weights of `dY` to those of a block; `s`: all rows and columns, of `Y` first;
    /// `reached`: for each joint, the columns of `Y` that can be other than zero.
    pub(crate) fn add_to_weights(
        &self,
        s: MatRef<'_, f64>,
        joint_weights: &[f64],
        reached: &[Vec<usize>],
        g: &mut RegressorBlock,
    ) {
        let (first, n, p) = (g.first_sample(), g.n_samples(), g.n_columns());
        for (column, joint, x) in &self.parts {
            for &a in &reached[*joint] {
                let s = joint_weights[*joint] * s[(p + column, a)];
                for (g, x) in g.lanes_mut(*joint, a).iter_mut().zip(&x[first..first + n]) {
                    *g += s * x;
                }
            }
        }
    }

    /// The weights `D [Y | X] S` of `dX` over the samples of a block, written into `out`, part by part of `X`.
    pub(crate) fn own_weights(
        &self,
        s: MatRef<'_, f64>,
        joint_weights: &[f64],
        reached: &[Vec<usize>],
        y: &RegressorBlock,
        out: &mut [Vec<f64>],
    ) {
        let (first, p) = (y.first_sample(), y.n_columns());
        for ((column, joint, _), out) in self.parts.iter().zip(out) {
            let weight = joint_weights[*joint];
            for lane in 0..y.n_samples() {
                let of_y = reached[*joint].iter();
                let mut sum: f64 = of_y
                    .map(|&a| y.lanes(*joint, a)[lane] * s[(a, p + column)])
                    .sum();
                for (other, _, x) in self.parts.iter().filter(|part| part.1 == *joint) {
                    sum += x[first + lane] * s[(p + other, p + column)];
                }
                out[first + lane] = weight * sum;
            }
        }
    }

    /// Room for [`Self::own_weights`].
    pub(crate) fn zeros(&self) -> Vec<Vec<f64>> {
        self.parts
            .iter()
            .map(|part| vec![0.0; part.2.len()])
            .collect()
    }

    /// Takes the weights of `dX` on to the states.
    pub(crate) fn pull_back(
        &self,
        added: &[AddedColumn],
        weights: &[Vec<f64>],
        states: &JointStates,
        out: &mut JointStates,
    ) {
        for ((column, joint, _), weights) in self.parts.iter().zip(weights) {
            added[*column].add_gradient(*joint, weights, states, out);
        }
    }
}

/// `Σ_t [Y_t | X_t]ᵀ D [Y_t | X_t]` of all samples: [`information_matrix`] with columns beside those of the regressor.
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub(crate) fn information_with_added(
    model: &Model,
    (columns, added): (&Columns, &[AddedColumn]),
    states: &JointStates,
    joint_weights: &[f64],
) -> Mat<f64> {
    let information = information_matrix(model, columns, states, joint_weights);
    if added.is_empty() {
        return information;
    }
    let rows = AddedRows::new(added, states);
    let p = columns.len();
    let mut cross = Mat::zeros(p, added.len());
    visit_torque_regressor(model, columns, states, |y| {
        rows.add_cross(y, joint_weights, &mut cross);
    });
    let products = rows.products(joint_weights);
    Mat::from_fn(p + added.len(), p + added.len(), |a, b| {
        match (a < p, b < p) {
            (true, true) => information[(a, b)],
            (true, false) => cross[(a, b - p)],
            (false, true) => cross[(b, a - p)],
            (false, false) => products[(a - p, b - p)],
        }
    })
}
