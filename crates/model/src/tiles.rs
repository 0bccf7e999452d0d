//! The torque regressor of many samples, laid out for products of its columns.

use crate::axes::Kinematics;
use crate::lane_states::{LaneStates, NextBlock};
use crate::model::Model;
use crate::packing::{Packing, ROOM, Target};
use crate::parameter::Columns;
use crate::plan::Plan;
use crate::projection::TILES;
use crate::regressor::Fill;
use crate::states::JointStates;
use crate::wide::F64x8;

/// Samples side by side in a block.
const LANES: usize = 8;
/// Blocks that memory is asked ahead for: longer than it takes to answer, and still in the first-level cache when needed.
const AHEAD: usize = 2;

/// The torque regressor of some hundred samples, without what is always zero, in tiles of four entries.
///
/// A joint's row holds the columns its torque depends on and, last, what was observed of it; the rows of eight samples
/// follow those of the eight before. Columns that are each other's negative, or stand twice, share an entry: products of
/// entries become products of columns by [`Self::columns`].
#[derive(Debug, Clone)]
pub struct RegressorTiles {
    plan: Plan,
    packing: Packing,
    lanes: LaneStates,
    kinematics: Kinematics<F64x8>,
    /// Where what is written to begins, in cells: links × joints on their paths, then each joint's drives, then its
    /// observation. Of the first block, of the one being filled, and how far it is to the next.
    origin: Vec<usize>,
    here: Vec<usize>,
    step: Vec<usize>,
    /// First cell of each joint's rows, and one past the last.
    first: Vec<usize>,
    /// Tiles from one row of a joint to its next.
    stride: Vec<usize>,
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
        let mut stride = Vec::with_capacity(n);
        for (i, keys) in packing.keys.iter().enumerate() {
            // An odd number: the same tile of many rows is spread over all sets of the cache.
            let tiles = keys.len().div_ceil(Self::TILE) | 1;
            stride.push(tiles);
            first.push(first[i] + tiles * Self::TILE * capacity);
        }
        let links = packing.start.iter().copied();
        let drives = packing.drives.iter().copied().enumerate();
        let observations = packing.keys.iter().map(|keys| keys.len() - 1).enumerate();
        let places: Vec<(usize, usize)> = links.chain(drives).chain(observations).collect();
        let origin: Vec<usize> = places.iter().map(|&(i, entry)| first[i] + entry).collect();
        Self {
            step: places
                .iter()
                .map(|&(i, _)| stride[i] * Self::TILE)
                .collect(),
            here: origin.clone(),
            origin,
            plan,
            packing,
            lanes: LaneStates::new(n),
            kinematics: Kinematics::new(model, [F64x8::ZERO, F64x8::ONE]),
            stride,
            capacity,
            n_blocks: 0,
            cells: vec![F64x8::ZERO; first[n] + ROOM],
            first,
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
            (states.n_joints(), self.stride.len()),
            (n, n),
            "the states or the tiles have another number of joints than the model"
        );
        if let Some(y) = observed {
            assert_eq!(y.len(), n * n_all, "observations are not joints × samples");
        }
        let n_samples = (n_all - first).min(self.capacity * LANES);
        self.n_blocks = n_samples.div_ceil(LANES);
        self.here.copy_from_slice(&self.origin);
        for block in 0..self.n_blocks {
            let (links, others) = self.here.split_at(n * n);
            let (drives, observations) = others.split_at(n);
            let sample = first + block * LANES;
            NextBlock {
                lanes: &mut self.lanes,
                states,
                observed,
                places: observations,
                cells: &mut self.cells,
                first: sample,
                soon: sample + AHEAD * LANES,
            }
            .load();
            let fill = Fill::<_, TILES> {
                model,
                rows: Target {
                    plan: &self.plan,
                    links,
                    drives,
                },
                state: self.lanes.state(),
                kinematics: &mut self.kinematics,
                cells: &mut self.cells,
            };
            fill.over_eight();
            for (here, step) in self.here.iter_mut().zip(&self.step) {
                *here += step;
            }
        }
        let rest = n_samples % LANES;
        if rest > 0 {
            for (first, stride) in self.first.iter().zip(&self.stride) {
                let row = stride * Self::TILE;
                for cell in &mut self.cells[first + row * (self.n_blocks - 1)..][..row] {
                    cell.0[rest..].fill(0.0);
                }
            }
        }
        n_samples
    }

    /// A joint's rows of the samples filled last: [`Self::stride`] tiles of the first eight samples, of the next eight, and
    /// so on.
    pub fn rows(&self, joint: usize) -> &[[F64x8; Self::TILE]] {
        let cells = self.stride[joint] * Self::TILE * self.n_blocks;
        self.cells[self.first[joint]..][..cells].as_chunks().0
    }

    /// Tiles from one row of a joint to its next.
    pub fn stride(&self, joint: usize) -> usize {
        self.stride[joint]
    }

    /// Keys of the entries of a joint's row, rising: each entry of the regressor that can be other than zero has one, the
    /// same in every row. The observation has the last key. Beyond them the row holds zeros.
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
                    for row in tiles.rows(joint).chunks_exact(tiles.stride(joint)) {
                        let row = row.as_flattened();
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
