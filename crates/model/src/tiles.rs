//! The torque regressor of many samples, laid out for products of its columns.

use crate::axes::Kinematics;
use crate::model::Model;
use crate::packing::{Packing, ROOM, Target};
use crate::parameter::Columns;
use crate::plan::Plan;
use crate::projection::TILES;
use crate::regressor::Fill;
use crate::states::{JointStates, LaneStates, eight};
use crate::wide::F64x8;

/// Samples side by side in a block.
const LANES: usize = 8;

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
    /// First cell of each joint's row: of the first block, and of the one being filled.
    first: Vec<usize>,
    here: Vec<usize>,
    /// Where the links' and drives' cells of the block being filled begin, as [`Target`] wants them.
    rows: Vec<usize>,
    drives: Vec<usize>,
    /// Tiles of each joint's row.
    width: Vec<usize>,
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
        let width: Vec<usize> = packing
            .keys
            .iter()
            .map(|keys| keys.len().div_ceil(Self::TILE))
            .collect();
        let mut first = Vec::with_capacity(n);
        let mut n_cells = 0;
        for &tiles in &width {
            first.push(n_cells);
            n_cells += tiles * Self::TILE * capacity;
        }
        Self {
            rows: vec![0; n * n],
            drives: vec![0; n],
            plan,
            packing,
            lanes: LaneStates::new(n),
            kinematics: Kinematics::new(model, [F64x8::ZERO, F64x8::ONE]),
            here: first.clone(),
            first,
            width,
            capacity,
            n_blocks: 0,
            cells: vec![F64x8::ZERO; n_cells + ROOM],
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
            (states.n_joints(), self.width.len()),
            (n, n),
            "the states or the tiles have another number of joints than the model"
        );
        if let Some(y) = observed {
            assert_eq!(y.len(), n * n_all, "observations are not joints × samples");
        }
        let n_samples = (n_all - first).min(self.capacity * LANES);
        self.n_blocks = n_samples.div_ceil(LANES);
        for block in 0..self.n_blocks {
            self.go_to(block);
            self.lanes.load(states, first + block * LANES);
            let fill = Fill::<_, TILES> {
                model,
                rows: Target {
                    plan: &self.plan,
                    links: &self.rows,
                    drives: &self.drives,
                },
                state: self.lanes.state(),
                kinematics: &mut self.kinematics,
                cells: &mut self.cells,
            };
            fill.over_eight();
            for (i, here) in self.here.iter().enumerate() {
                let cell = &mut self.cells[here + self.packing.keys[i].len() - 1];
                *cell = observed.map_or(F64x8::ZERO, |y| {
                    eight(&y[i * n_all..][..n_all], first + block * LANES)
                });
            }
        }
        let rest = n_samples % LANES;
        if rest > 0 {
            for (here, width) in self.here.iter().zip(&self.width) {
                for cell in &mut self.cells[*here..][..width * Self::TILE] {
                    cell.0[rest..].fill(0.0);
                }
            }
        }
        n_samples
    }

    /// Says where the cells of a block are.
    fn go_to(&mut self, block: usize) {
        for (i, here) in self.here.iter_mut().enumerate() {
            *here = self.first[i] + block * self.width[i] * Self::TILE;
            self.drives[i] = *here + self.packing.drives[i];
        }
        for (row, &(joint, start)) in self.rows.iter_mut().zip(&self.packing.start) {
            *row = self.here[joint] + start;
        }
    }

    /// Tiles of a joint's row.
    pub fn width(&self, joint: usize) -> usize {
        self.width[joint]
    }

    /// A joint's row of the samples filled last: [`Self::width`] tiles of the first eight samples, of the next eight, and
    /// so on.
    pub fn row(&self, joint: usize) -> &[[F64x8; Self::TILE]] {
        let cells = self.width[joint] * Self::TILE * self.n_blocks;
        self.cells[self.first[joint]..][..cells].as_chunks().0
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
                    let rows = tiles.row(joint).as_flattened();
                    for row in rows.chunks_exact(4 * tiles.width(joint)) {
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
