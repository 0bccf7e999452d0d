//! The information matrix `Σ_t Y_tᵀ D Y_t`, folded from blocks of the regressor that stay in cache.
//!
//! A row of the regressor touches only the columns of the links beyond its joint, so half of the products of a dense
//! `WᵀW` are never formed, and W is never stored.

use faer::Mat;
use idim_model::{BlockFiller, Columns, JointStates, Model, RegressorBlock};

/// Blocks folded together: their lanes are summed once, and they stay in the second-level cache.
const TOGETHER: usize = 32;
/// Side of a tile of products kept in registers.
const TILE: usize = 4;
const LANES: usize = RegressorBlock::LANES;

/// `Σ_t Y_tᵀ D Y_t` of all samples, `p × p`; `joint_weights`: the diagonal of `D`, one a joint.
///
/// The same bits on every machine: lanes and blocks are summed in one order.
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub fn information_matrix(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    joint_weights: &[f64],
) -> Mat<f64> {
    let (n, p) = (model.n_joints(), columns.len());
    assert_eq!(
        states.n_joints(),
        n,
        "the states have another number of joints than the model"
    );
    assert_eq!(joint_weights.len(), n, "one weight a joint");
    let reached = reached_columns(model, columns);
    let mut filler = BlockFiller::new(model, columns);
    let mut blocks = vec![filler.block(); TOGETHER.min(states.n_samples().div_ceil(LANES))];
    let mut sum = vec![0.0; p * p];
    let firsts: Vec<usize> = (0..states.n_samples()).step_by(LANES).collect();
    for firsts in firsts.chunks(TOGETHER) {
        for (&first, block) in firsts.iter().zip(&mut blocks) {
            filler.fill(model, states, first, block);
            forget_repeated_samples(block, &reached);
        }
        for (joint, reached) in reached.iter().enumerate() {
            pulp::Arch::new().dispatch(Fold {
                blocks: &blocks[..firsts.len()],
                joint,
                weight: joint_weights[joint],
                reached,
                sum: &mut sum,
            });
        }
    }
    Mat::from_fn(p, p, |a, b| sum[a.min(b) * p + a.max(b)])
}

/// For each joint, the columns its torque depends on, in increasing order.
fn reached_columns(model: &Model, columns: &Columns) -> Vec<Vec<usize>> {
    let mut reached = vec![Vec::new(); model.n_joints()];
    for (column, p) in columns.0.iter().enumerate() {
        if p.kind.inertial_index().is_some() {
            for &joint in model.path(p.index) {
                reached[joint].push(column);
            }
        } else {
            reached[p.index].push(column);
        }
    }
    reached
}

/// The last block repeats its last sample; here each sample counts once.
fn forget_repeated_samples(block: &mut RegressorBlock, reached: &[Vec<usize>]) {
    let n_samples = block.n_samples();
    if n_samples < LANES {
        for (joint, reached) in reached.iter().enumerate() {
            for &column in reached {
                block.lanes_mut(joint, column)[n_samples..].fill(0.0);
            }
        }
    }
}

/// The products of one row of the blocks.
struct Fold<'a> {
    blocks: &'a [RegressorBlock],
    joint: usize,
    weight: f64,
    reached: &'a [usize],
    /// Upper triangle, row by row.
    sum: &'a mut [f64],
}

impl pulp::WithSimd for Fold<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, simd: S) {
        let reached = self.reached;
        let (whole, rest) = reached.as_chunks::<TILE>();
        for (k, a) in whole.iter().enumerate() {
            for b in &whole[k..] {
                self.tile(simd, *a, *b);
            }
            self.edge(simd, *a, rest);
        }
        match *rest {
            [a] => self.tile(simd, [a], [a]),
            [a, b] => self.tile(simd, [a, b], [a, b]),
            [a, b, c] => self.tile(simd, [a, b, c], [a, b, c]),
            _ => {}
        }
    }
}

impl Fold<'_> {
    #[inline(always)]
    fn edge<S: pulp::Simd>(&mut self, simd: S, a: [usize; TILE], rest: &[usize]) {
        match *rest {
            [b] => self.tile(simd, a, [b]),
            [b, c] => self.tile(simd, a, [b, c]),
            [b, c, d] => self.tile(simd, a, [b, c, d]),
            _ => {}
        }
    }

    /// Products of the columns `a` with the columns `b`, every block's lanes side by side.
    #[inline(always)]
    fn tile<S: pulp::Simd, const A: usize, const B: usize>(
        &mut self,
        simd: S,
        a: [usize; A],
        b: [usize; B],
    ) {
        let mut lanes = [[[0.0; LANES]; B]; A];
        for part in 0..LANES / S::F64_LANES {
            let mut products = [[simd.splat_f64s(0.0); B]; A];
            for block in self.blocks {
                let mut y = [simd.splat_f64s(0.0); B];
                for t in 0..B {
                    y[t] = S::as_simd_f64s(block.lanes(self.joint, b[t])).0[part];
                }
                for s in 0..A {
                    let x = S::as_simd_f64s(block.lanes(self.joint, a[s])).0[part];
                    for t in 0..B {
                        products[s][t] = simd.mul_add_f64s(x, y[t], products[s][t]);
                    }
                }
            }
            for s in 0..A {
                for t in 0..B {
                    S::as_mut_simd_f64s(&mut lanes[s][t]).0[part] = products[s][t];
                }
            }
        }
        let p = self.sum.len().isqrt();
        for s in 0..A {
            for t in 0..B {
                if a[s] <= b[t] {
                    let [a0, a1, a2, a3, a4, a5, a6, a7] = lanes[s][t];
                    let total = ((a0 + a4) + (a2 + a6)) + ((a1 + a5) + (a3 + a7));
                    let entry = &mut self.sum[a[s] * p + b[t]];
                    *entry = self.weight.mul_add(total, *entry);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use idim_model::{DriveColumns, observation_matrix, random_states, robot_from_ron};

    /// Rounding of sums over 300 samples.
    const ROUNDING: f64 = 1e-13;

    #[test]
    fn identity_information_matrix_is_the_gram_matrix_of_the_weighted_rows() {
        let robot = robot_from_ron(idim_fixtures::PUMA3R).expect("a robot of the fixtures");
        let model = Model::new(&robot);
        let n = robot.n_joints();
        let columns = Columns::standard(n, DriveColumns::ALL);
        let weights = [0.5, 2.0, 3.0];
        for n_samples in [1, 8, 13, 300] {
            let states = random_states(&robot, n_samples, 4);
            let w = observation_matrix(&model, &columns, &states);
            let mut weighted = w.clone();
            for (k, mut row) in weighted.row_iter_mut().enumerate() {
                row *= weights[k % n];
            }
            let expected = w.transpose() * weighted;
            let found = information_matrix(&model, &columns, &states, &weights);
            let scale = expected.amax();
            for a in 0..columns.len() {
                for b in 0..columns.len() {
                    assert!((found[(a, b)] - expected[(a, b)]).abs() <= ROUNDING * scale);
                }
            }
        }
    }
}
