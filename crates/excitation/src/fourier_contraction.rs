//! The weights `D Y S` of a gradient, eight samples at a time.

use faer::MatRef;
use idim_model::{Columns, F64x8, Model, RegressorBlock};

/// Columns computed together, so that an entry of `Y` is read once for all of them.
const TOGETHER: usize = 4;

/// `G = D Y S` over the entries of `Y` that can be other than zero.
#[derive(Debug, Clone)]
pub(crate) struct Contraction {
    /// For each joint, the columns its torque depends on.
    reached: Vec<Vec<usize>>,
    /// For each joint, `S` over those columns: for every group of columns, row after row; padded with zeros.
    s: Vec<Vec<[f64; TOGETHER]>>,
}

impl Contraction {
    pub(crate) fn new(model: &Model, columns: &Columns) -> Self {
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
        Self {
            s: vec![Vec::new(); reached.len()],
            reached,
        }
    }

    /// For each joint, the columns its torque depends on.
    pub(crate) fn reached(&self) -> &[Vec<usize>] {
        &self.reached
    }

    /// `s`: rows and columns beyond those of the regressor are left out.
    pub(crate) fn set_matrix(&mut self, s: MatRef<'_, f64>) {
        for (reached, packed) in self.reached.iter().zip(&mut self.s) {
            packed.clear();
            for group in reached.chunks(TOGETHER) {
                for &a in reached {
                    let mut row = [0.0; TOGETHER];
                    for (entry, &b) in row.iter_mut().zip(group) {
                        *entry = s[(a, b)];
                    }
                    packed.push(row);
                }
            }
        }
    }

    /// Writes the weights of a block; `joint_weights`: the diagonal of `D`.
    pub(crate) fn contract(
        &self,
        y: &RegressorBlock,
        joint_weights: &[f64],
        g: &mut RegressorBlock,
    ) {
        pulp::Arch::new().dispatch(Contract {
            plan: self,
            y,
            joint_weights,
            g,
        });
    }
}

/// One block, dispatched to the widest registers of the machine.
struct Contract<'a> {
    plan: &'a Contraction,
    y: &'a RegressorBlock,
    joint_weights: &'a [f64],
    g: &'a mut RegressorBlock,
}

impl pulp::WithSimd for Contract<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let mut row = Vec::new();
        for (joint, reached) in self.plan.reached.iter().enumerate() {
            let weight = simd.splat_f64s(self.joint_weights[joint]);
            // Side by side: every group of columns goes over them again.
            row.clear();
            row.extend(reached.iter().map(|&a| F64x8(*self.y.lanes(joint, a))));
            let groups = self.plan.s[joint].chunks_exact(reached.len().max(1));
            for (s, group) in groups.zip(reached.chunks(TOGETHER)) {
                let registers = RegressorBlock::LANES / S::F64_LANES;
                if registers == 1 {
                    let [sums] = products::<S, 1>(simd, &row, s, 0);
                    put::<S>(simd, self.g, (joint, group), 0, &sums, weight);
                    continue;
                }
                for r in (0..registers).step_by(2) {
                    let [first, second] = products::<S, 2>(simd, &row, s, r);
                    put::<S>(simd, self.g, (joint, group), r, &first, weight);
                    put::<S>(simd, self.g, (joint, group), r + 1, &second, weight);
                }
            }
        }
    }
}

/// Sums over a row of its entries times those of `s`, for `R` registers of samples from the `r`-th on: an entry of `s` is
/// spread once for all of them.
#[inline(always)]
fn products<S: pulp::Simd, const R: usize>(
    simd: S,
    row: &[F64x8],
    s: &[[f64; TOGETHER]],
    r: usize,
) -> [[S::f64s; TOGETHER]; R] {
    let mut sums = [[simd.splat_f64s(0.0); TOGETHER]; R];
    for (y, s) in row.iter().zip(s) {
        let y = S::as_simd_f64s(&y.0).0;
        for (k, &s) in s.iter().enumerate() {
            let s = simd.splat_f64s(s);
            for q in 0..R {
                sums[q][k] = simd.mul_add_f64s(y[r + q], s, sums[q][k]);
            }
        }
    }
    sums
}

/// Writes weighted sums to a register of their columns.
#[inline(always)]
fn put<S: pulp::Simd>(
    simd: S,
    g: &mut RegressorBlock,
    (joint, group): (usize, &[usize]),
    r: usize,
    sums: &[S::f64s; TOGETHER],
    weight: S::f64s,
) {
    for (&sum, &b) in sums.iter().zip(group) {
        let g = S::as_mut_simd_f64s(g.lanes_mut(joint, b)).0;
        g[r] = simd.mul_f64s(weight, sum);
    }
}
