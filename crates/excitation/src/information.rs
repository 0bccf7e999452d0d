//! The information matrix `Σ_t Y_tᵀ D Y_t`, folded from blocks of the regressor that stay in cache.
//!
//! A row of the regressor touches only the columns of the links beyond its joint, so half of the products of a dense
//! `WᵀW` are never formed, and W is never stored.

use faer::Mat;
use idim_model::{Columns, F64x8, JointStates, Model, RegressorTiles};

/// Blocks of eight samples folded together. More of them add their sums less often, but leave the first-level cache; the best
/// of 16 to 64 where it was measured.
const TOGETHER: usize = 24;
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
    let mut fold = Fold::new(&tiles, observed.is_some(), joint_weights);
    let mut first = 0;
    while first < states.n_samples() {
        first += tiles.fill(model, states, observed, first);
        arch.dispatch(Take {
            fold: &mut fold,
            tiles: &tiles,
        });
    }
    // The observation has the last key and is the last column.
    let mut columns = tiles.columns().to_vec();
    columns.extend(observed.map(|_| (tiles.n_keys() - 1, 1.0)));
    Mat::from_fn(columns.len(), columns.len(), |a, b| {
        let ((a, sign), (b, other)) = (columns[a], columns[b]);
        sign * other * fold.total(a.min(b), a.max(b))
    })
}

/// Products of the columns, summed.
struct Fold<'a> {
    joint_weights: &'a [f64],
    /// Each joint's tiles, as far as there is something to fold.
    tiles: Vec<Vec<Tile>>,
    /// The sum for the keys `a <= b` stands at `rows[a] + b`.
    rows: Vec<usize>,
    /// The lanes stay apart to the end.
    sum: Vec<F64x8>,
}

/// Where the products of a tile's entries go.
struct Tile {
    /// `rows` of the entries' keys.
    rows: [usize; TILE],
    /// The entries' keys; what only fills the tile up has one of its own, that of no entry.
    keys: [usize; TILE],
    consecutive: bool,
    /// How many entries there are to fold.
    len: usize,
}

impl<'a> Fold<'a> {
    fn new(tiles: &RegressorTiles, observed: bool, joint_weights: &'a [f64]) -> Self {
        let none = tiles.n_keys();
        // A triangle: each row lacks what those before have of it.
        let rows: Vec<usize> = (0..=none)
            .map(|key| key * none - key * (key + 1) / 2 + key)
            .collect();
        let of_joint = |joint: usize| {
            let keys = tiles.keys(joint);
            // The observation is the last entry of a row: without it the last tile may be empty.
            let entries = keys.len() - usize::from(!observed);
            let of_tile = |tile: usize| {
                let keys: [usize; TILE] =
                    std::array::from_fn(|k| *keys.get(tile * TILE + k).unwrap_or(&none));
                Tile {
                    rows: keys.map(|key| rows[key]),
                    len: TILE.min(entries - tile * TILE),
                    consecutive: keys.is_sorted_by(|a, b| a + 1 == *b),
                    keys,
                }
            };
            (0..entries.div_ceil(TILE)).map(of_tile).collect()
        };
        Self {
            joint_weights,
            tiles: (0..joint_weights.len()).map(of_joint).collect(),
            sum: vec![F64x8([0.0; LANES]); rows[none] + none + 1],
            rows,
        }
    }

    /// The lanes of a product in one order, whatever the registers.
    fn total(&self, a: usize, b: usize) -> f64 {
        let [a0, a1, a2, a3, a4, a5, a6, a7] = self.sum[self.rows[a] + b].0;
        ((a0 + a4) + (a2 + a6)) + ((a1 + a5) + (a3 + a7))
    }
}

/// Takes in the products of all rows of the samples at hand.
struct Take<'f, 'a> {
    fold: &'f mut Fold<'a>,
    tiles: &'f RegressorTiles,
}

impl pulp::WithSimd for Take<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Fold {
            joint_weights,
            tiles,
            sum,
            ..
        } = self.fold;
        for (joint, (tiles, &weight)) in tiles.iter().zip(*joint_weights).enumerate() {
            let (rows, stride) = (self.tiles.rows(joint), self.tiles.stride(joint));
            for (a, left) in tiles.iter().enumerate() {
                for (b, right) in tiles.iter().enumerate().skip(a) {
                    let mut pair = Pair {
                        rows,
                        stride,
                        places: [a, b],
                        tiles: [left, right],
                        weight,
                        sum,
                    };
                    for part in 0..LANES / S::F64_LANES {
                        pair.fold(simd, part);
                    }
                }
            }
        }
    }
}

/// Two tiles of a joint's row, and where their products go.
struct Pair<'a> {
    rows: &'a [[F64x8; TILE]],
    stride: usize,
    places: [usize; 2],
    tiles: [&'a Tile; 2],
    weight: f64,
    sum: &'a mut [F64x8],
}

impl Pair<'_> {
    /// All products of the two tiles; of a tile with itself half of them is all.
    #[inline(always)]
    fn fold<S: pulp::Simd>(&mut self, simd: S, part: usize) {
        let diagonal = self.places[0] == self.places[1];
        // Sixteen sums, and what enters them, fit 32 registers, not 16.
        if S::REGISTER_COUNT >= 32 {
            match (diagonal, self.tiles[1].len) {
                (false, 1) => self.products::<S, TILE, 1, false>(simd, part, 0),
                (false, 2) => self.products::<S, TILE, 2, false>(simd, part, 0),
                (false, 3) => self.products::<S, TILE, 3, false>(simd, part, 0),
                (false, _) => self.products::<S, TILE, TILE, false>(simd, part, 0),
                (true, 1) => self.products::<S, 1, 1, true>(simd, part, 0),
                (true, 2) => self.products::<S, 2, 2, true>(simd, part, 0),
                (true, 3) => self.products::<S, 3, 3, true>(simd, part, 0),
                (true, _) => self.products::<S, TILE, TILE, true>(simd, part, 0),
            }
            return;
        }
        if diagonal {
            self.products::<S, 2, 2, true>(simd, part, 0);
        } else {
            self.products::<S, TILE, 2, false>(simd, part, 0);
        }
        if self.tiles[1].len > 2 {
            self.products::<S, TILE, 2, false>(simd, part, 2);
        }
    }

    /// Products of the first `A` entries of the one with `B` of the other, from entry `from` on; of the diagonal only with
    /// those from the entry itself on.
    #[inline(always)]
    fn products<S: pulp::Simd, const A: usize, const B: usize, const DIAGONAL: bool>(
        &mut self,
        simd: S,
        part: usize,
        from: usize,
    ) {
        let [left, right] = self.places;
        // Told once, it need not be checked for every block.
        assert!(
            left < self.stride && right < self.stride,
            "no such tile in a row"
        );
        let mut sums = [[simd.splat_f64s(0.0); B]; A];
        for tiles in self.rows.chunks_exact(self.stride) {
            let (a, b) = (&tiles[left], &tiles[right]);
            let mut y = [simd.splat_f64s(0.0); B];
            for t in 0..B {
                y[t] = S::as_simd_f64s(&b[from + t].0).0[part];
            }
            for s in 0..A {
                let x = S::as_simd_f64s(&a[s].0).0[part];
                for t in 0..B {
                    if !DIAGONAL || t >= s {
                        sums[s][t] = simd.mul_add_f64s(x, y[t], sums[s][t]);
                    }
                }
            }
        }
        let weight = simd.splat_f64s(self.weight);
        let [left, right] = self.tiles;
        let diagonal = self.places[0] == self.places[1];
        for s in 0..A {
            // Most tiles have consecutive keys: then one check does for all of them.
            if right.consecutive && !diagonal {
                let run = &mut self.sum[left.rows[s] + right.keys[0]..][..TILE];
                for t in 0..B {
                    let cell = &mut S::as_mut_simd_f64s(&mut run[from + t].0).0[part];
                    *cell = simd.mul_add_f64s(weight, sums[s][t], *cell);
                }
                continue;
            }
            for t in 0..B {
                // Of a tile with itself the products below the diagonal are there already.
                if diagonal && from + t < s {
                    continue;
                }
                let cell = &mut self.sum[left.rows[s] + right.keys[from + t]];
                let cell = &mut S::as_mut_simd_f64s(&mut cell.0).0[part];
                *cell = simd.mul_add_f64s(weight, sums[s][t], *cell);
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
