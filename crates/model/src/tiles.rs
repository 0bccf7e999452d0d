//! The torque regressor of many samples, laid out for products of its columns.

use crate::axes::Kinematics;
use crate::model::Model;
use crate::packing::{Packing, ROOM, Target};
use crate::parameter::Columns;
use crate::plan::Plan;
use crate::projection::TILES;
use crate::regressor::Fill;
use crate::states::{JointStates, LaneStates, ask_for, scatter};
use crate::wide::F64x8;
use std::ops::Range;

/// Samples side by side in a block.
const LANES: usize = 8;

/// The torque regressor of some hundred samples, without what is always zero, in tiles of four entries.
///
/// A joint's row holds the columns its torque depends on and, last, what was observed of it; eight samples are a block, and
/// a block has the rows of all joints. Columns that are each other's negative, or stand twice, share an entry: products of
/// entries become products of columns by [`Self::columns`].
#[derive(Debug, Clone)]
pub struct RegressorTiles {
    plan: Plan,
    packing: Packing,
    lanes: LaneStates,
    kinematics: Kinematics<F64x8>,
    /// First tile of each joint's row in a block, and one past the last row's.
    first: Vec<usize>,
    /// Where the links' and drives' cells begin in a block, as [`Target`] wants them.
    rows: Vec<usize>,
    drives: Vec<usize>,
    /// Where the observation of each joint stands in a block: it is the last entry of a row.
    observations: Vec<usize>,
    /// Tiles of a block.
    stride: usize,
    /// Blocks of eight samples there is room for, and those filled last.
    capacity: usize,
    n_blocks: usize,
    cells: Vec<F64x8>,
}

impl RegressorTiles {
    /// Entries of a tile.
    pub const TILE: usize = 4;

    /// Room for `8 capacity` samples of these columns and an observation of each joint.
    ///
    /// # Panics
    /// If a column does not fit the model.
    #[track_caller]
    pub fn new(model: &Model, columns: &Columns, capacity: usize) -> Self {
        let n = model.n_joints();
        let plan = Plan::new(model, columns);
        let packing = Packing::new(model, columns, &plan);
        let mut first = vec![0];
        let mut n_tiles = 0;
        for keys in &packing.keys {
            n_tiles += keys.len().div_ceil(Self::TILE);
            first.push(n_tiles);
        }
        let cell = |joint: usize, entry: usize| first[joint] * Self::TILE + entry;
        let rows = packing.start.iter();
        let rows = rows.map(|&(joint, start)| cell(joint, start)).collect();
        let observations = packing.keys.iter().enumerate();
        let observations = observations.map(|(i, keys)| cell(i, keys.len() - 1));
        let observations = observations.collect();
        let drives = packing.drives.iter().enumerate();
        let drives = drives.map(|(i, &start)| cell(i, start)).collect();
        // An odd number of tiles: the same tile of many blocks is spread over all sets of the cache.
        let stride = n_tiles | 1;
        Self {
            plan,
            packing,
            lanes: LaneStates::new(n),
            kinematics: Kinematics::new(model, [F64x8::ZERO, F64x8::ONE]),
            first,
            rows,
            drives,
            observations,
            stride,
            capacity,
            n_blocks: 0,
            cells: vec![F64x8::ZERO; stride * Self::TILE * capacity + ROOM],
        }
    }

    /// Fills in the samples from `first` on, as many as there is room for, and says how many.
    ///
    /// `observed`: one number a joint and sample, joint by joint as the states; without it the observations are zero.
    /// Beyond the last sample stand zeros.
    ///
    /// # Panics
    /// If the states or observations do not fit the model or have no sample `first`.
    #[track_caller]
    pub fn fill(
        &mut self,
        model: &Model,
        states: &JointStates,
        observed: Option<&[f64]>,
        first: usize,
    ) -> usize {
        let (n, n_all) = (model.n_joints(), states.n_samples());
        assert_eq!(
            (states.n_joints(), self.drives.len()),
            (n, n),
            "the states or the tiles have another number of joints than the model"
        );
        if let Some(y) = observed {
            assert_eq!(y.len(), n * n_all, "observations are not joints × samples");
        }
        let arch = pulp::Arch::new();
        let n_samples = (n_all - first).min(self.capacity * LANES);
        self.n_blocks = n_samples.div_ceil(LANES);
        for block in 0..self.n_blocks {
            let cells = &mut self.cells[block * self.stride * Self::TILE..];
            // The same block of the samples after these will be needed next.
            let (here, next) = (
                first + block * LANES,
                first + (self.capacity + block) * LANES,
            );
            self.lanes.load_ahead(states, here, next);
            let fill = Fill::<_, TILES> {
                model,
                rows: Target {
                    plan: &self.plan,
                    links: &self.rows,
                    drives: &self.drives,
                },
                state: self.lanes.state(),
                kinematics: &mut self.kinematics,
                cells,
            };
            fill.over_eight();
            if let Some(y) = observed {
                scatter(arch, cells, &self.observations, (y, n_all), here);
                ask_for(arch, y, n_all, next);
                continue;
            }
            for &cell in &self.observations {
                cells[cell] = F64x8::ZERO;
            }
        }
        let rest = n_samples % LANES;
        if rest > 0 {
            let block = self.stride * Self::TILE;
            for cell in &mut self.cells[(self.n_blocks - 1) * block..][..block] {
                cell.0[rest..].fill(0.0);
            }
        }
        n_samples
    }

    /// The tiles of the samples filled last, block after block of [`Self::stride`] tiles each.
    pub fn blocks(&self) -> &[[F64x8; Self::TILE]] {
        let cells = self.stride * Self::TILE * self.n_blocks;
        self.cells[..cells].as_chunks().0
    }

    /// Tiles of a block.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Where the tiles of a joint's row are in a block.
    pub fn row(&self, joint: usize) -> Range<usize> {
        self.first[joint]..self.first[joint + 1]
    }

    /// Keys of the entries of a joint's row, rising: each entry of the regressor that can be other than zero has one, the
    /// same in every row. The observation has the last key. Beyond them the row's last tile holds zeros.
    pub fn keys(&self, joint: usize) -> &[usize] {
        &self.packing.keys[joint]
    }

    /// Number of keys.
    pub fn n_keys(&self) -> usize {
        self.packing.n_keys
    }

    /// Key and sign of every column: the column is the entry, or its negative.
    pub fn columns(&self) -> &[(usize, f64)] {
        &self.packing.columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::robot_and_state;
    use crate::{DriveColumns, Parameter, observation_matrix, random_states};
    use proptest::prelude::*;

    /// Rounding of sums over some dozen samples.
    const ROUNDING: f64 = 1e-13;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        #[test]
        fn identity_products_of_tiles_are_those_of_the_rows((robot, _) in robot_and_state(), n_samples in 1..60_usize) {
            let model = Model::new(&robot);
            let n = robot.n_joints();
            let mut columns = Columns::standard(n, DriveColumns::ALL);
            // A column that stands twice.
            let twice: Parameter = columns.0[3];
            columns.0.push(twice);
            let states = random_states(&robot, n_samples, 2);
            let observed: Vec<f64> = (0..n * n_samples).map(|k| (k as f64).sin()).collect();
            let mut tiles = RegressorTiles::new(&model, &columns, 3);
            let mut products = vec![0.0; tiles.n_keys().pow(2)];
            let mut first = 0;
            while first < n_samples {
                let taken = tiles.fill(&model, &states, Some(&observed), first);
                for joint in 0..n {
                    let keys = tiles.keys(joint);
                    for block in tiles.blocks().chunks_exact(tiles.stride()) {
                        let row = block[tiles.row(joint)].as_flattened();
                        prop_assert!(row[keys.len()..].iter().all(|c| *c == F64x8::ZERO));
                        for (a, x) in keys.iter().zip(row) {
                            for (b, y) in keys.iter().zip(row) {
                                products[a * tiles.n_keys() + b] +=
                                    x.0.iter().zip(&y.0).map(|(x, y)| x * y).sum::<f64>();
                            }
                        }
                    }
                }
                first += taken;
            }
            let mut keys = tiles.columns().to_vec();
            keys.push((tiles.n_keys() - 1, 1.0));
            let found = nalgebra::DMatrix::from_fn(keys.len(), keys.len(), |a, b| {
                keys[a].1 * keys[b].1 * products[keys[a].0 * tiles.n_keys() + keys[b].0]
            });
            let w = observation_matrix(&model, &columns, &states);
            let p = columns.len();
            let y = nalgebra::DVector::from_fn(n * n_samples, |row, _| observed[row % n * n_samples + row / n]);
            let whole = w.insert_column(p, 0.0);
            let mut whole = whole;
            whole.set_column(p, &y);
            let expected = whole.transpose() * &whole;
            prop_assert!((found - &expected).amax() <= ROUNDING * expected.amax());
        }
    }
}
