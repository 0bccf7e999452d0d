//! The torque regressor of many samples, laid out for products of its columns.

use crate::model::Model;
use crate::parameter::Columns;
use crate::plan::Plan;
use crate::projection::Kinematics;
use crate::regressor::Fill;
use crate::states::{JointStates, LaneStates};
use crate::wide::F64x8;

/// Samples side by side in a block.
const LANES: usize = 8;

/// The torque regressor of some hundred samples, in tiles of four columns.
///
/// The four columns of a tile stand side by side in one joint's row, eight samples after eight samples: a product of two
/// tiles reads both from front to back.
#[derive(Debug, Clone)]
pub struct RegressorTiles {
    plan: Plan,
    lanes: LaneStates,
    kinematics: Kinematics<F64x8>,
    n_tiles: usize,
    /// Blocks of eight samples there is room for, and those filled last.
    capacity: usize,
    n_blocks: usize,
    cells: Vec<F64x8>,
}

impl RegressorTiles {
    /// Columns of a tile.
    pub const TILE: usize = 4;

    /// Room for `8 capacity` samples of these columns; the last tile is padded with columns of zeros.
    ///
    /// # Panics
    /// If a column does not fit the model.
    #[track_caller]
    pub fn new(model: &Model, columns: &Columns, capacity: usize) -> Self {
        let n = model.n_joints();
        let n_tiles = columns.len().div_ceil(Self::TILE);
        let panel = Self::panel_cells(capacity);
        let place = |column| column / Self::TILE * panel + column % Self::TILE;
        Self {
            plan: Plan::new(model, columns).spread(n_tiles * panel, place),
            lanes: LaneStates::new(n),
            kinematics: Kinematics::new(model, [F64x8::ZERO, F64x8::ONE]),
            n_tiles,
            capacity,
            n_blocks: 0,
            // The rows of the last block start later than those of the first.
            cells: vec![F64x8::ZERO; (n * n_tiles + 1) * panel],
        }
    }

    /// Cells of a tile's panel. One tile more than the blocks: panels a power of two apart would share the sets of the
    /// first-level cache.
    fn panel_cells(capacity: usize) -> usize {
        (capacity + 1) * Self::TILE
    }

    /// Tiles of a row.
    pub fn n_tiles(&self) -> usize {
        self.n_tiles
    }

    /// Fills in the samples from `first` on, as many as there is room for, and says how many.
    ///
    /// Beyond the last sample stand zeros.
    ///
    /// # Panics
    /// If the states do not fit the model or have no sample `first`.
    #[track_caller]
    pub fn fill(&mut self, model: &Model, states: &JointStates, first: usize) -> usize {
        assert_eq!(
            states.n_joints(),
            self.plan.links.len(),
            "the states have another number of joints than the model"
        );
        let n_samples = (states.n_samples() - first).min(self.capacity * LANES);
        self.n_blocks = n_samples.div_ceil(LANES);
        let row = self.plan.n_columns;
        for block in 0..self.n_blocks {
            self.lanes.load(states, first + block * LANES);
            let fill = Fill {
                model,
                plan: &self.plan,
                state: self.lanes.state(),
                kinematics: &mut self.kinematics,
                rows: &mut self.cells[block * Self::TILE..][..model.n_joints() * row],
            };
            fill.over_eight();
        }
        let rest = n_samples % LANES;
        if rest > 0 {
            let panel = Self::panel_cells(self.capacity);
            let last = (self.n_blocks - 1) * Self::TILE;
            for cells in self.cells.chunks_exact_mut(panel) {
                for cell in &mut cells[last..][..Self::TILE] {
                    cell.0[rest..].fill(0.0);
                }
            }
        }
        n_samples
    }

    /// A tile of a joint's row: the four columns of the first eight samples, of the next eight, and so on.
    pub fn panel(&self, joint: usize, tile: usize) -> &[[F64x8; Self::TILE]] {
        let panel = Self::panel_cells(self.capacity);
        let start = joint * self.plan.n_columns + tile * panel;
        self.cells[start..][..self.n_blocks * Self::TILE]
            .as_chunks()
            .0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::robot_and_state;
    use crate::{DriveColumns, random_states, visit_torque_regressor};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn identity_tiles_hold_the_bits_of_the_blocks((robot, _) in robot_and_state(), n_samples in 1..60_usize) {
            let model = Model::new(&robot);
            let columns = Columns::standard(robot.n_joints(), DriveColumns::ALL);
            let states = random_states(&robot, n_samples, 2);
            let mut tiles = RegressorTiles::new(&model, &columns, 3);
            let mut first = 0;
            let mut found = Vec::new();
            while first < n_samples {
                let taken = tiles.fill(&model, &states, first);
                for sample in 0..taken.next_multiple_of(8) {
                    for joint in 0..model.n_joints() {
                        for column in 0..tiles.n_tiles() * 4 {
                            let cell = tiles.panel(joint, column / 4)[sample / 8][column % 4];
                            if sample < taken && column < columns.len() {
                                found.push(cell.0[sample % 8]);
                            } else {
                                prop_assert_eq!(cell.0[sample % 8], 0.0);
                            }
                        }
                    }
                }
                first += taken;
            }
            let mut expected = Vec::new();
            let mut row = vec![0.0; columns.len()];
            visit_torque_regressor(&model, &columns, &states, |block| {
                for lane in 0..block.n_samples() {
                    for joint in 0..model.n_joints() {
                        block.copy_row(joint, lane, &mut row);
                        expected.extend_from_slice(&row);
                    }
                }
            });
            prop_assert_eq!(found, expected);
        }
    }
}
