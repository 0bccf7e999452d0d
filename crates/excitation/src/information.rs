//! The information matrix `Σ_t Y_tᵀ D Y_t`, folded from blocks of the regressor that stay in cache.
//!
//! A row of the regressor touches only the columns of the links beyond its joint, so half of the products of a dense
//! `WᵀW` are never formed, and W is never stored.

use faer::Mat;
use idim_model::{Columns, F64x8, JointStates, Model, RegressorTiles};

/// Blocks of eight samples folded together: their lanes are summed once, and they stay in the second-level cache.
const TOGETHER: usize = 32;
const TILE: usize = RegressorTiles::TILE;
const LANES: usize = 8;

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
    information_on(pulp::Arch::new(), model, columns, states, joint_weights)
}

/// The same, folded with these instructions.
#[track_caller]
fn information_on(
    arch: pulp::Arch,
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
    let reached = reached_tiles(model, columns);
    let blocks = TOGETHER.min(states.n_samples().div_ceil(LANES));
    let mut tiles = RegressorTiles::new(model, columns, blocks);
    let mut sum = vec![0.0; p * p];
    let mut first = 0;
    while first < states.n_samples() {
        first += tiles.fill(model, states, first);
        arch.dispatch(Fold {
            tiles: &tiles,
            reached: &reached,
            joint_weights,
            p,
            sum: &mut sum,
        });
    }
    Mat::from_fn(p, p, |a, b| sum[a.min(b) * p + a.max(b)])
}

/// For each joint, the tiles with a column its torque depends on, in increasing order.
fn reached_tiles(model: &Model, columns: &Columns) -> Vec<Vec<usize>> {
    let mut reached = vec![Vec::new(); model.n_joints()];
    for (column, p) in columns.0.iter().enumerate() {
        let own = [p.index];
        let joints = match p.kind.inertial_index() {
            Some(_) => model.path(p.index),
            None => &own,
        };
        for &joint in joints {
            reached[joint].push(column / TILE);
        }
    }
    for tiles in &mut reached {
        tiles.dedup();
    }
    reached
}

/// The products of all rows of the samples at hand.
struct Fold<'a> {
    tiles: &'a RegressorTiles,
    reached: &'a [Vec<usize>],
    joint_weights: &'a [f64],
    p: usize,
    /// Upper triangle, row by row.
    sum: &'a mut [f64],
}

impl pulp::WithSimd for Fold<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, simd: S) {
        for (joint, reached) in self.reached.iter().enumerate() {
            for (k, &a) in reached.iter().enumerate() {
                for &b in &reached[k..] {
                    let mut lanes = [[[0.0; LANES]; TILE]; TILE];
                    let (left, right) = (self.tiles.panel(joint, a), self.tiles.panel(joint, b));
                    for part in 0..LANES / S::F64_LANES {
                        // Sixteen sums, and what enters them, fit 32 registers, not 16.
                        if S::REGISTER_COUNT >= 32 {
                            products::<S, TILE>(simd, (left, right), (part, 0), &mut lanes);
                        } else {
                            products::<S, 2>(simd, (left, right), (part, 0), &mut lanes);
                            products::<S, 2>(simd, (left, right), (part, 2), &mut lanes);
                        }
                    }
                    self.add(self.joint_weights[joint], (a, b), &lanes);
                }
            }
        }
    }
}

/// Products of the four columns of a tile with `B` of another one's, from column `from` on, summed over the blocks.
#[inline(always)]
fn products<S: pulp::Simd, const B: usize>(
    simd: S,
    (left, right): (&[[F64x8; TILE]], &[[F64x8; TILE]]),
    (part, from): (usize, usize),
    lanes: &mut [[[f64; LANES]; TILE]; TILE],
) {
    let mut sums = [[simd.splat_f64s(0.0); B]; TILE];
    for (a, b) in left.iter().zip(right) {
        let mut y = [simd.splat_f64s(0.0); B];
        for t in 0..B {
            y[t] = S::as_simd_f64s(&b[from + t].0).0[part];
        }
        for s in 0..TILE {
            let x = S::as_simd_f64s(&a[s].0).0[part];
            for t in 0..B {
                sums[s][t] = simd.mul_add_f64s(x, y[t], sums[s][t]);
            }
        }
    }
    for s in 0..TILE {
        for t in 0..B {
            S::as_mut_simd_f64s(&mut lanes[s][from + t]).0[part] = sums[s][t];
        }
    }
}

impl Fold<'_> {
    /// Adds the lanes of a tile's products in one order, whatever the registers.
    #[inline(always)]
    fn add(&mut self, weight: f64, (a, b): (usize, usize), lanes: &[[[f64; LANES]; TILE]; TILE]) {
        let width = self.p.saturating_sub(b * TILE).min(TILE);
        for (s, lanes) in lanes.iter().enumerate() {
            let row = a * TILE + s;
            if row >= self.p {
                break;
            }
            let sums = &mut self.sum[row * self.p + b * TILE..][..width];
            for (sum, lanes) in sums.iter_mut().zip(lanes) {
                let [a0, a1, a2, a3, a4, a5, a6, a7] = *lanes;
                let total = ((a0 + a4) + (a2 + a6)) + ((a1 + a5) + (a3 + a7));
                *sum = weight.mul_add(total, *sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use idim_model::{DriveColumns, observation_matrix, random_states, robot_from_ron};

    /// The instruction sets of this machine.
    fn architectures() -> Vec<pulp::Arch> {
        let mut all = vec![pulp::Arch::Scalar];
        #[cfg(target_arch = "x86_64")]
        all.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
        #[cfg(target_arch = "x86_64")]
        all.extend(pulp::x86::V4::try_new().map(pulp::Arch::V4));
        all
    }

    #[test]
    fn identity_every_instruction_set_folds_to_the_same_bits() {
        let robot = robot_from_ron(idim_fixtures::PUMA3R).expect("a robot of the fixtures");
        let model = Model::new(&robot);
        let columns = Columns::standard(robot.n_joints(), DriveColumns::ALL);
        let states = random_states(&robot, 77, 4);
        let weights = [0.5, 2.0, 3.0];
        let expected = information_matrix(&model, &columns, &states, &weights);
        for arch in architectures() {
            let found = information_on(arch, &model, &columns, &states, &weights);
            assert_eq!(found, expected, "{arch:?}");
        }
    }

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
