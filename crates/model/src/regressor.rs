//! The torque regressor: joint torque per unit of each parameter, for one sample and in blocks of eight.

use crate::axes::Kinematics;
use crate::lane::{Kernel, Lane};
use crate::lane_states::LaneStates;
use crate::model::Model;
use crate::packing::{DenseRows, Rows, Target};
use crate::parameter::Columns;
use crate::projection::{BLOCKS, DENSE, fill};
use crate::states::{JointState, JointStates};
use crate::wide::{F64x8, over_eight, over_one};
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
    let mut rows = vec![0.0; n * columns.len()];
    RegressorWorkspace::new(model, columns).fill_rows(model, state, &mut rows);
    DMatrix::from_row_slice(n, columns.len(), &rows)
}

/// Room for [`torque_regressor_into`], and the plan of the columns: made once, used for many samples.
#[derive(Debug, Clone)]
pub struct RegressorWorkspace {
    rows: DenseRows,
    kinematics: Kinematics<f64>,
}

impl RegressorWorkspace {
    /// For a model and the columns wanted.
    ///
    /// # Panics
    /// If a column does not fit the model.
    #[track_caller]
    pub fn new(model: &Model, columns: &Columns) -> Self {
        Self {
            rows: DenseRows::new(model, columns),
            kinematics: Kinematics::new(model, [0.0, 1.0]),
        }
    }

    fn fill_rows(&mut self, model: &Model, state: &JointState, out: &mut [f64]) {
        out.fill(0.0);
        over_one(&mut Fill::<_, DENSE> {
            model,
            rows: self.rows.all(),
            state: [&state.q, &state.qd, &state.qdd],
            kinematics: &mut self.kinematics,
            cells: out,
        });
        self.rows.repeat(model, out);
    }
}

/// [`torque_regressor`] of one sample into `out`, `n × p` row by row, without allocating.
///
/// # Panics
/// If `out`, the state or the workspace do not fit the model.
#[track_caller]
pub fn torque_regressor_into(
    model: &Model,
    workspace: &mut RegressorWorkspace,
    state: &JointState,
    out: &mut [f64],
) {
    let n = model.n_joints();
    assert_eq!(
        (state.q.len(), workspace.rows.plan.links.len()),
        (n, n),
        "the state or the workspace has another number of joints than the model"
    );
    assert_eq!(
        out.len(),
        n * workspace.rows.plan.n_columns,
        "out is not joints × columns"
    );
    workspace.fill_rows(model, state, out);
}

/// Up to eight consecutive samples of the torque regressor.
#[derive(Debug, Clone)]
pub struct RegressorBlock {
    first_sample: usize,
    n_samples: usize,
    n_joints: usize,
    n_columns: usize,
    /// At `joint * n_columns + column`: where the entry is.
    places: Vec<usize>,
    /// The place of all entries that are always zero.
    nothing: usize,
    entries: Vec<F64x8>,
}

impl RegressorBlock {
    /// Samples side by side in a full block.
    pub const LANES: usize = 8;

    /// Only what can be other than zero has a place of its own.
    pub(crate) fn packed(rows: &Rows) -> Self {
        Self {
            first_sample: 0,
            n_samples: 0,
            n_joints: rows.plan.links.len(),
            n_columns: rows.plan.n_columns,
            places: rows.places.clone(),
            nothing: rows.nothing,
            entries: vec![F64x8::ZERO; rows.n_cells],
        }
    }

    /// Every entry has a place of its own.
    pub(crate) fn dense(n_joints: usize, n_columns: usize) -> Self {
        Self {
            first_sample: 0,
            n_samples: 0,
            n_joints,
            n_columns,
            places: (0..n_joints * n_columns).collect(),
            nothing: usize::MAX,
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
    #[inline]
    pub fn lanes(&self, joint: usize, column: usize) -> &[f64; 8] {
        &self.entries[self.places[joint * self.n_columns + column]].0
    }

    /// One entry for the eight samples, to fill in: of a block of weights.
    #[inline]
    pub fn lanes_mut(&mut self, joint: usize, column: usize) -> &mut [f64; 8] {
        &mut self.entries[self.places[joint * self.n_columns + column]].0
    }

    /// All rows of all samples of the block, `n_samples × n_joints × n_columns`: for each sample joint by joint.
    ///
    /// # Panics
    /// If `out` does not have that length.
    #[track_caller]
    pub fn copy_rows(&self, out: &mut [f64]) {
        let of_sample = self.n_joints * self.n_columns;
        assert_eq!(
            out.len(),
            self.n_samples * of_sample,
            "out is not samples × joints × columns"
        );
        out.fill(0.0);
        for (entry, &place) in self.places.iter().enumerate() {
            if place == self.nothing {
                continue;
            }
            let lanes = &self.entries[place].0;
            for (rows, x) in out.chunks_exact_mut(of_sample.max(1)).zip(lanes) {
                rows[entry] = *x;
            }
        }
    }

    /// One row of one sample.
    ///
    /// # Panics
    /// If `out` is not `n_columns` long.
    #[track_caller]
    pub fn copy_row(&self, joint: usize, lane: usize, out: &mut [f64]) {
        assert_eq!(out.len(), self.n_columns, "a row has one entry a column");
        let row = &self.places[joint * self.n_columns..][..self.n_columns];
        for (x, &place) in out.iter_mut().zip(row) {
            *x = self.entries[place].0[lane];
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
    let mut filler = BlockFiller::new(model, columns);
    let mut block = filler.block();
    for first in (0..states.n_samples()).step_by(RegressorBlock::LANES) {
        filler.fill(model, states, first, &mut block);
        visit(&block);
    }
}

/// Fills blocks of the regressor one by one, for a reader that keeps several of them.
#[derive(Debug, Clone)]
pub struct BlockFiller {
    rows: Rows,
    lanes: LaneStates,
    kinematics: Kinematics<F64x8>,
}

impl BlockFiller {
    /// For a model and the columns wanted.
    ///
    /// # Panics
    /// If a column does not fit the model.
    #[track_caller]
    pub fn new(model: &Model, columns: &Columns) -> Self {
        Self {
            rows: Rows::new(model, columns),
            lanes: LaneStates::new(model.n_joints()),
            kinematics: Kinematics::new(model, [F64x8::ZERO, F64x8::ONE]),
        }
    }

    /// A block of the right shape, all zero. Only [`Self::fill`] of this filler's columns may write to it.
    pub fn block(&self) -> RegressorBlock {
        RegressorBlock::packed(&self.rows)
    }

    /// Writes the regressor of the samples from `first` on.
    ///
    /// # Panics
    /// If the states do not fit the model or have no sample `first`.
    pub fn fill(
        &mut self,
        model: &Model,
        states: &JointStates,
        first: usize,
        block: &mut RegressorBlock,
    ) {
        block.move_to(first, states.n_samples());
        self.lanes.load(states, first);
        let fill = Fill::<_, BLOCKS> {
            model,
            rows: self.rows.all(),
            state: self.lanes.state(),
            kinematics: &mut self.kinematics,
            cells: &mut block.entries,
        };
        fill.over_eight();
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

/// [`fill`] as one operation to be compiled for an instruction set.
pub(crate) struct Fill<'a, C, const ROWS: u8> {
    pub(crate) model: &'a Model,
    pub(crate) rows: Target<'a>,
    pub(crate) state: [&'a [C]; 3],
    pub(crate) kinematics: &'a mut Kinematics<C>,
    pub(crate) cells: &'a mut [C],
}

impl<const ROWS: u8> Fill<'_, F64x8, ROWS> {
    /// Compiled here once: a generic caller would otherwise be compiled with all of it in every crate.
    #[inline(never)]
    pub(crate) fn over_eight(mut self) {
        over_eight(&mut self);
    }
}

impl<C: Copy, const ROWS: u8> Kernel<C> for Fill<'_, C, ROWS> {
    #[inline(always)]
    fn run<T: Lane<Cell = C>>(&mut self, at: T::At) {
        fill::<T, ROWS>(
            at,
            self.model,
            self.rows,
            self.state,
            self.kinematics,
            self.cells,
        );
    }
}
