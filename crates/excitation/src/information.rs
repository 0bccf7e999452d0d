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
    let arch = pulp::Arch::new();
    products_on(arch, model, columns, (states, None), joint_weights)
}

/// `Σ_t [Y_t | y_t]ᵀ D [Y_t | y_t]` of all samples, `(p + 1) × (p + 1)`: all that the normal equations need.
///
/// `observed`: one number a joint and sample, joint by joint as the states; otherwise as [`information_matrix`]. Memory does
/// not grow with the samples.
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub fn information_with_observations(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    observed: &[f64],
    joint_weights: &[f64],
) -> Mat<f64> {
    let arch = pulp::Arch::new();
    products_on(
        arch,
        model,
        columns,
        (states, Some(observed)),
        joint_weights,
    )
}

/// Products of all columns and, where there is one, the observation, folded with these instructions.
#[track_caller]
fn products_on(
    arch: pulp::Arch,
    model: &Model,
    columns: &Columns,
    (states, observed): (&JointStates, Option<&[f64]>),
    joint_weights: &[f64],
) -> Mat<f64> {
    let n = model.n_joints();
    assert_eq!(
        states.n_joints(),
        n,
        "the states have another number of joints than the model"
    );
    assert_eq!(joint_weights.len(), n, "one weight a joint");
    let blocks = TOGETHER.min(states.n_samples().div_ceil(LANES));
    let mut tiles = RegressorTiles::new(model, columns, blocks);
    let mut sum = vec![0.0; tiles.n_keys().pow(2)];
    let mut first = 0;
    while first < states.n_samples() {
        first += tiles.fill(model, states, observed, first);
        arch.dispatch(Fold {
            tiles: &tiles,
            observed: observed.is_some(),
            joint_weights,
            sum: &mut sum,
        });
    }
    // The observation has the last key and is the last column.
    let mut columns = tiles.columns().to_vec();
    columns.extend(observed.map(|_| (tiles.n_keys() - 1, 1.0)));
    Mat::from_fn(columns.len(), columns.len(), |a, b| {
        let ((a, sign), (b, other)) = (columns[a], columns[b]);
        sign * other * sum[a.min(b) * tiles.n_keys() + a.max(b)]
    })
}

/// The products of all rows of the samples at hand.
struct Fold<'a> {
    tiles: &'a RegressorTiles,
    observed: bool,
    joint_weights: &'a [f64],
    /// At `a * n_keys + b`, keys `a <= b`.
    sum: &'a mut [f64],
}

impl pulp::WithSimd for Fold<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, simd: S) {
        for (joint, &weight) in self.joint_weights.iter().enumerate() {
            let (row, width) = (self.tiles.row(joint), self.tiles.width(joint));
            // The observation is the last entry of a row: without it the last tile may be empty.
            let entries = self.tiles.keys(joint).len() - usize::from(!self.observed);
            for a in 0..entries.div_ceil(TILE) {
                for b in a..entries.div_ceil(TILE) {
                    let mut lanes = [[[0.0; LANES]; TILE]; TILE];
                    for part in 0..LANES / S::F64_LANES {
                        // Sixteen sums, and what enters them, fit 32 registers, not 16. Of a tile with itself only half is
                        // needed.
                        if S::REGISTER_COUNT >= 32 {
                            products::<S, TILE, TILE>(
                                simd,
                                row,
                                (width, a, b),
                                (part, 0),
                                &mut lanes,
                            );
                        } else {
                            if a == b {
                                products::<S, 2, 2>(
                                    simd,
                                    row,
                                    (width, a, b),
                                    (part, 0),
                                    &mut lanes,
                                );
                            } else {
                                products::<S, TILE, 2>(
                                    simd,
                                    row,
                                    (width, a, b),
                                    (part, 0),
                                    &mut lanes,
                                );
                            }
                            products::<S, TILE, 2>(simd, row, (width, a, b), (part, 2), &mut lanes);
                        }
                    }
                    self.add((joint, weight), (a, b), &lanes);
                }
            }
        }
    }
}

/// Products of the first `A` entries of a tile with `B` of another one's, from entry `from` on, summed over the blocks.
#[inline(always)]
fn products<S: pulp::Simd, const A: usize, const B: usize>(
    simd: S,
    row: &[[F64x8; TILE]],
    (width, left, right): (usize, usize, usize),
    (part, from): (usize, usize),
    lanes: &mut [[[f64; LANES]; TILE]; TILE],
) {
    // Told once, it need not be checked for every block.
    assert!(left < width && right < width, "no such tile");
    let mut sums = [[simd.splat_f64s(0.0); B]; A];
    for tiles in row.chunks_exact(width) {
        let (a, b) = (&tiles[left], &tiles[right]);
        let mut y = [simd.splat_f64s(0.0); B];
        for t in 0..B {
            y[t] = S::as_simd_f64s(&b[from + t].0).0[part];
        }
        for s in 0..A {
            let x = S::as_simd_f64s(&a[s].0).0[part];
            for t in 0..B {
                sums[s][t] = simd.mul_add_f64s(x, y[t], sums[s][t]);
            }
        }
    }
    for s in 0..A {
        for t in 0..B {
            S::as_mut_simd_f64s(&mut lanes[s][from + t]).0[part] = sums[s][t];
        }
    }
}

impl Fold<'_> {
    /// Adds the lanes of a tile's products in one order, whatever the registers.
    #[inline(always)]
    fn add(
        &mut self,
        (joint, weight): (usize, f64),
        (a, b): (usize, usize),
        lanes: &[[[f64; LANES]; TILE]; TILE],
    ) {
        let (keys, n) = (self.tiles.keys(joint), self.tiles.n_keys());
        let of_tile = |tile: usize| &keys[tile * TILE..keys.len().min((tile + 1) * TILE)];
        for (&key, lanes) in of_tile(a).iter().zip(lanes) {
            let sums = &mut self.sum[key * n..][..n];
            for (&other, lanes) in of_tile(b).iter().zip(lanes) {
                let [a0, a1, a2, a3, a4, a5, a6, a7] = *lanes;
                let total = ((a0 + a4) + (a2 + a6)) + ((a1 + a5) + (a3 + a7));
                sums[other] = weight.mul_add(total, sums[other]);
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
            let found = products_on(arch, &model, &columns, (&states, None), &weights);
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
