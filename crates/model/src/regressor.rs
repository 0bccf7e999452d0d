//! The torque regressor: joint torque per unit of each parameter, by projection of the joint axes.
//!
//! Entry (joint i, link j) is the axis of joint i, carried out to the frame of link j (six numbers), times the 6 × 10
//! map of that link's parameters to its wrench. Only axes travel along the chain.

use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{F64x8, Lane, V3, dot};
use crate::model::Model;
use crate::newton_euler::LaneStates;
use crate::parameter::{Columns, ParameterKind};
use crate::states::{JointState, JointStates};
use nalgebra::DMatrix;

/// Joint torque per unit of each parameter, `n × p`.
///
/// `torque_regressor(model, columns, s) · π = inverse_dynamics(model, π, s)` for the inertial columns and every `π`.
/// `s`: rad, rad/s, rad/s² (m, m/s, m/s² for prismatic); result in N·m (N) per SI unit of the parameter.
/// Drive columns: `q̈` (rotor), `q̇` (viscous), `sign q̇` (Coulomb), 1 (offset).
/// Source: linear in the parameters of Gautier & Khalil 1990, in the link frames of the robot file.
///
/// # Panics
/// If the state or a column does not fit the model.
#[track_caller]
pub fn torque_regressor(model: &Model, columns: &Columns, state: &JointState) -> DMatrix<f64> {
    let n = model.n_joints();
    assert_eq!(
        state.q.len(),
        n,
        "the state has another number of joints than the model"
    );
    let plan = Plan::new(model, columns);
    let mut axes = vec![no_axis(); n * n];
    let mut motions = vec![LinkMotion::base(model); n];
    let mut rows = vec![0.0; n * columns.len()];
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            fill(
                model,
                &plan,
                [&state.q, &state.qd, &state.qdd],
                &mut motions,
                &mut axes,
                &mut rows,
            );
        },
    );
    DMatrix::from_row_slice(n, columns.len(), &rows)
}

/// Up to eight consecutive samples of the torque regressor.
#[derive(Debug, Clone)]
pub struct RegressorBlock {
    first_sample: usize,
    n_samples: usize,
    n_joints: usize,
    n_columns: usize,
    entries: Vec<F64x8>,
}

impl RegressorBlock {
    /// Samples side by side in a full block.
    pub const LANES: usize = 8;

    pub(crate) fn new(n_joints: usize, n_columns: usize) -> Self {
        Self {
            first_sample: 0,
            n_samples: 0,
            n_joints,
            n_columns,
            entries: vec![F64x8::ZERO; n_joints * n_columns],
        }
    }

    /// Takes the block to the samples from `first` on, of `n_samples` in all.
    pub(crate) fn move_to(&mut self, first: usize, n_samples: usize) {
        self.first_sample = first;
        self.n_samples = (n_samples - first).min(Self::LANES);
    }

    pub(crate) fn entries(&self) -> &[F64x8] {
        &self.entries
    }

    pub(crate) fn entries_mut(&mut self) -> &mut [F64x8] {
        &mut self.entries
    }

    /// Number of the block's first sample.
    pub fn first_sample(&self) -> usize {
        self.first_sample
    }

    /// Samples in this block, 8 but in the last one.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// Rows of a sample.
    pub fn n_joints(&self) -> usize {
        self.n_joints
    }

    /// Columns.
    pub fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// One entry of the regressor for the eight samples; beyond `n_samples` the last sample is repeated.
    pub fn lanes(&self, joint: usize, column: usize) -> &[f64; 8] {
        &self.entries[joint * self.n_columns + column].0
    }

    /// One entry for the eight samples, to fill in: of a block of weights.
    pub fn lanes_mut(&mut self, joint: usize, column: usize) -> &mut [f64; 8] {
        &mut self.entries[joint * self.n_columns + column].0
    }

    /// One row of one sample.
    ///
    /// # Panics
    /// If `out` is not `n_columns` long.
    #[track_caller]
    pub fn copy_row(&self, joint: usize, lane: usize, out: &mut [f64]) {
        assert_eq!(out.len(), self.n_columns, "a row has one entry a column");
        let row = &self.entries[joint * self.n_columns..][..self.n_columns];
        for (x, e) in out.iter_mut().zip(row) {
            *x = e.0[lane];
        }
    }
}

/// Hands out the torque regressor of many samples, eight at a time and in order; W is never stored.
///
/// # Panics
/// If the states or a column do not fit the model.
#[track_caller]
pub fn visit_torque_regressor(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    mut visit: impl FnMut(&RegressorBlock),
) {
    let n = model.n_joints();
    assert_eq!(
        states.n_joints(),
        n,
        "the states have another number of joints than the model"
    );
    let plan = Plan::new(model, columns);
    let mut lanes = LaneStates::new(n);
    let mut axes = vec![no_axis(); n * n];
    let mut motions = vec![LinkMotion::base(model); n];
    let mut block = RegressorBlock::new(n, columns.len());
    for first in (0..states.n_samples()).step_by(RegressorBlock::LANES) {
        block.move_to(first, states.n_samples());
        lanes.load(states, first);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let state = [&lanes.q[..], &lanes.qd, &lanes.qdd];
                fill(
                    model,
                    &plan,
                    state,
                    &mut motions,
                    &mut axes,
                    &mut block.entries,
                );
            },
        );
        visit(&block);
    }
}

/// The regressor of many samples stacked, `n_samples n × p`: row `sample * n + joint`.
///
/// For tests and small problems; what has a row per sample should fold the blocks of [`visit_torque_regressor`].
///
/// # Panics
/// If the states or a column do not fit the model.
#[track_caller]
pub fn observation_matrix(model: &Model, columns: &Columns, states: &JointStates) -> DMatrix<f64> {
    let n = model.n_joints();
    let mut w = DMatrix::zeros(n * states.n_samples(), columns.len());
    visit_torque_regressor(model, columns, states, |block| {
        for lane in 0..block.n_samples() {
            for joint in 0..n {
                for column in 0..columns.len() {
                    w[((block.first_sample() + lane) * n + joint, column)] =
                        block.lanes(joint, column)[lane];
                }
            }
        }
    });
    w
}

/// Which entry of which link goes to which column, found once.
pub(crate) struct Plan {
    pub(crate) n_columns: usize,
    /// For each link: (position among the ten, column).
    pub(crate) links: Vec<Vec<(usize, usize)>>,
    /// For each joint: (drive kind, column).
    pub(crate) drives: Vec<Vec<(ParameterKind, usize)>>,
}

impl Plan {
    #[track_caller]
    pub(crate) fn new(model: &Model, columns: &Columns) -> Self {
        let n = model.n_joints();
        let mut plan = Self {
            n_columns: columns.len(),
            links: vec![Vec::new(); n],
            drives: vec![Vec::new(); n],
        };
        for (column, p) in columns.0.iter().enumerate() {
            assert!(
                p.index < n,
                "column {p} names a link the model does not have"
            );
            match p.kind.inertial_index() {
                Some(k) => plan.links[p.index].push((k, column)),
                None => plan.drives[p.index].push((p.kind, column)),
            }
        }
        plan
    }
}

pub(crate) fn no_axis<T: Lane>() -> Screw<T> {
    Screw {
        angular: [T::splat(0.0); 3],
        linear: [T::splat(0.0); 3],
    }
}

/// Writes the entries that can be other than zero; `rows` is `n × p`, joint by joint.
#[inline(always)]
pub(crate) fn fill<T: Lane>(
    model: &Model,
    plan: &Plan,
    [q, qd, qdd]: [&[T]; 3],
    motions: &mut [LinkMotion<T>],
    axes: &mut [Screw<T>],
    rows: &mut [T],
) {
    let n = model.n_joints();
    let p = plan.n_columns;
    let base = LinkMotion::base(model);
    for (j, joint) in model.joints.iter().enumerate() {
        let travel = Travel::new(joint.kind, q[j]);
        let below = joint.parent.map_or(base, |k| motions[k]);
        motions[j] = below.beyond(joint, travel, qd[j], qdd[j]);
        if let Some(k) = joint.parent {
            for &i in &model.joints[k].path {
                axes[j * n + i] = axes[k * n + i].beyond(joint, travel);
            }
        }
        axes[j * n + j] = Screw::axis(joint);
        if !plan.links[j].is_empty() {
            let map = WrenchMap::new(&motions[j]);
            for &i in &joint.path {
                let entries = map.project(&axes[j * n + i]);
                for &(k, column) in &plan.links[j] {
                    rows[i * p + column] = entries[k];
                }
            }
        }
        for &(kind, column) in &plan.drives[j] {
            rows[j * p + column] = match kind {
                ParameterKind::Ia => qdd[j],
                ParameterKind::Fv => qd[j],
                ParameterKind::Fc => qd[j].sign(),
                _ => T::splat(1.0),
            };
        }
    }
}

/// The map of a link's ten parameters to its wrench, with what its entries share computed once.
pub(crate) struct WrenchMap<T> {
    m: LinkMotion<T>,
    /// `[ω̇]× + [ω]×[ω]×`: force per first moment.
    b: [V3<T>; 3],
    /// `ωx ωy`, `ωx ωz`, `ωy ωz`.
    xy: T,
    xz: T,
    yz: T,
    /// `ωx² - ωy²`, `ωz² - ωx²`, `ωy² - ωz²`.
    x_y: T,
    z_x: T,
    y_z: T,
}

impl<T: Lane> WrenchMap<T> {
    #[inline(always)]
    pub(crate) fn new(m: &LinkMotion<T>) -> Self {
        let [x, y, z] = m.w;
        let [dx, dy, dz] = m.wd;
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let (xy, xz, yz) = (x * y, x * z, y * z);
        Self {
            m: *m,
            b: [
                [-(yy + zz), xy - dz, xz + dy],
                [xy + dz, -(xx + zz), yz - dx],
                [xz - dy, yz + dx, -(xx + yy)],
            ],
            xy,
            xz,
            yz,
            x_y: xx - yy,
            z_x: zz - xx,
            y_z: yy - zz,
        }
    }

    /// Axis times map: the ten entries of one row for this link.
    #[inline(always)]
    pub(crate) fn project(&self, axis: &Screw<T>) -> [T; 10] {
        let [x, y, z] = axis.angular;
        let f = axis.linear;
        let [dx, dy, dz] = self.m.wd;
        let [ax, ay, az] = self.m.a;
        let b = &self.b;
        let force = |k: usize| f[0].mul_add(b[0][k], f[1].mul_add(b[1][k], f[2] * b[2][k]));
        [
            x.mul_add(dx, y.mul_add(self.xz, -(z * self.xy))),
            z.mul_add(self.x_y, y.mul_add(b[2][1], -(x * b[2][0]))),
            y.mul_add(self.z_x, x.mul_add(b[1][0], -(z * b[1][2]))),
            y.mul_add(dy, z.mul_add(self.xy, -(x * self.yz))),
            x.mul_add(self.y_z, z.mul_add(b[0][2], -(y * b[0][1]))),
            z.mul_add(dz, x.mul_add(self.yz, -(y * self.xz))),
            z.mul_add(ay, (-y).mul_add(az, force(0))),
            x.mul_add(az, (-z).mul_add(ax, force(1))),
            y.mul_add(ax, (-x).mul_add(ay, force(2))),
            dot(f, self.m.a),
        ]
    }
}
