//! Triangles of every friction column a joint might have, joint by joint and block by block: any choice is fitted from them.

use super::{JointFriction, reversals};
use crate::columns::{FrictionTerm, ModelColumns};
use crate::error::Error;
use crate::plan::SamplingPlan;
use crate::samples::{Stretch, decimator, joint_columns};
use idim_estimation::{InformationFactor, Parts, Solution, solve_with_known_noise};
use idim_model::Robot;
use rayon::prelude::{IntoParallelIterator, ParallelIterator};

/// One column a joint might have.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Own {
    Viscous,
    Offset,
    /// Coulomb's, smoothed over a speed.
    Coulomb(f64),
    /// Another term, its sign smoothed over a speed.
    Term(FrictionTerm, f64),
}

/// Fewest blocks. Fewer logs than that are cut: what is left without one of two logs does not determine an arm.
const BLOCKS: usize = 5;

/// The triangles `[W_shared W_own | y]` of each joint over each block.
pub(super) struct Dictionary {
    n_shared: usize,
    own: Vec<Vec<Own>>,
    /// `blocks[block][joint]`.
    blocks: Vec<Vec<InformationFactor>>,
    /// The other blocks together, for each block.
    others: Vec<Vec<InformationFactor>>,
    /// Standard deviation each joint's rows are divided by.
    pub(super) sigma: Vec<f64>,
}

/// Held-out errors of a choice: mean square of each joint; `None` where the columns are dependent or a friction would drive.
pub(super) type HeldOut = Option<Vec<f64>>;

impl Dictionary {
    /// Over the stretches; every log is a block where there are enough, and cut into equal ones where there are not.
    ///
    /// `shared`: every column but the joints' own friction. Loads must be known to the stretches.
    pub(super) fn new(
        robot: &Robot,
        shared: &ModelColumns,
        stretches: &[Stretch],
        plan: &SamplingPlan,
        wanted: &[JointFriction],
        all_terms: bool,
    ) -> Result<Self, Error> {
        let own: Vec<Vec<Own>> = (0..robot.n_joints())
            .map(|j| own_columns(robot, j, stretches, plan, &wanted[j], all_terms))
            .collect();
        let mut logs: Vec<&str> = stretches.iter().map(|s| s.file.as_str()).collect();
        logs.dedup();
        let per_log = if logs.len() >= BLOCKS {
            1
        } else {
            (BLOCKS + 1).div_ceil(logs.len().max(1))
        };
        let n_blocks = per_log * logs.len();
        let joints: Vec<Result<Vec<InformationFactor>, Error>> = (0..robot.n_joints())
            .into_par_iter()
            .map(|joint| {
                let mut blocks =
                    vec![InformationFactor::new(shared.len() + own[joint].len()); n_blocks];
                for stretch in stretches {
                    let log = logs.iter().position(|l| *l == stretch.file).unwrap_or(0);
                    let own_blocks = &mut blocks[per_log * log..][..per_log];
                    fold(robot, shared, &own[joint], stretch, plan, joint, own_blocks)?;
                }
                Ok(blocks)
            })
            .collect();
        let joints: Vec<Vec<InformationFactor>> = joints.into_iter().collect::<Result<_, _>>()?;
        let blocks: Vec<Vec<InformationFactor>> = (0..n_blocks)
            .map(|b| joints.iter().map(|j| j[b].clone()).collect())
            .collect();
        let others = (0..n_blocks)
            .map(|b| {
                joints
                    .iter()
                    .map(|j| {
                        let mut rest = (0..n_blocks).filter(|&k| k != b);
                        let mut sum = j[rest.next().unwrap_or(b)].clone();
                        rest.for_each(|k| sum.merge(&j[k]));
                        sum
                    })
                    .collect()
            })
            .collect();
        Ok(Self {
            n_shared: shared.len(),
            sigma: vec![1.0; robot.n_joints()],
            own,
            blocks,
            others,
        })
    }

    /// Mean square of each joint on every block in turn, predicted from the other blocks.
    ///
    /// Of the joint that is `judged` every fit must be a friction that brakes, at speeds not seen too.
    pub(super) fn held_out(&self, frictions: &[JointFriction], judged: Option<usize>) -> HeldOut {
        let n = frictions.len();
        let chosen: Option<Vec<Vec<usize>>> =
            (0..n).map(|j| self.columns(j, &frictions[j])).collect();
        let chosen = chosen?;
        let mut squares = vec![0.0; n];
        let mut counts = vec![0.0; n];
        for (others, block) in self.others.iter().zip(&self.blocks) {
            let values = self.fit(others, &chosen)?;
            let mut first = self.n_shared;
            for j in 0..n {
                let own = &values[first..][..chosen[j].len() - self.n_shared];
                if Some(j) == judged && !brakes(&frictions[j], own) {
                    return None;
                }
                let part = block[j].select(&chosen[j]);
                let n_own = chosen[j].len() - self.n_shared;
                let mut own: Vec<f64> = values[..self.n_shared].to_vec();
                own.extend_from_slice(&values[first..first + n_own]);
                first += n_own;
                squares[j] += residual_square(&part.parts(), &own);
                counts[j] += part.n_rows() as f64;
            }
        }
        Some(
            squares
                .iter()
                .zip(counts)
                .map(|(s, c)| s / c.max(1.0))
                .collect(),
        )
    }

    /// Where a friction's columns stand in its joint's triangle, the shared ones first.
    fn columns(&self, joint: usize, friction: &JointFriction) -> Option<Vec<usize>> {
        let mut wanted = Vec::new();
        let reversal = friction.reversal.unwrap_or(0.0);
        if friction.viscous {
            wanted.push(Own::Viscous);
        }
        if friction.coulomb {
            wanted.push(Own::Coulomb(reversal));
        }
        if friction.offset {
            wanted.push(Own::Offset);
        }
        wanted.extend(
            friction
                .terms
                .iter()
                .map(|&t| Own::Term(t, smoothing(t, reversal))),
        );
        let own = wanted.iter().map(|w| {
            let at = self.own[joint].iter().position(|o| o == w)?;
            Some(self.n_shared + at)
        });
        (0..self.n_shared).map(Some).chain(own).collect()
    }

    /// Weighted least squares of all joints together: shared values, then each joint's own.
    fn fit(&self, factors: &[InformationFactor], chosen: &[Vec<usize>]) -> Option<Vec<f64>> {
        let s = self.n_shared;
        let total = s + chosen.iter().map(|c| c.len() - s).sum::<usize>();
        let mut all = InformationFactor::new(total);
        let mut first = s;
        for (j, columns) in chosen.iter().enumerate() {
            let parts = factors[j].select(columns).parts();
            let n_own = columns.len() - s;
            let weight = 1.0 / self.sigma[j];
            let mut rows = vec![0.0; total * columns.len()];
            for (i, row) in rows.chunks_exact_mut(total).enumerate() {
                for k in i..columns.len() {
                    let at = if k < s { k } else { first + k - s };
                    row[at] = weight * parts.r[(i, k)];
                }
            }
            let z: Vec<f64> = parts.z.iter().map(|z| weight * z).collect();
            all.push_rows(&rows, &z).ok()?;
            first += n_own;
        }
        match solve_with_known_noise(&all, 1.0).ok()? {
            Solution::Determined(estimate) => Some(estimate.values),
            Solution::RankDeficient(_) => None,
        }
    }
}

/// Static friction above Coulomb's, in Coulomb's: what is more is a fit to a handful of samples.
const BREAKAWAY: f64 = 2.0;

/// Whether these values brake at every speed: none of the terms that grow with speed drives, and what static friction adds
/// stays within reach of Coulomb's. Values in the order of [`Dictionary::columns`].
fn brakes(friction: &JointFriction, values: &[f64]) -> bool {
    let mut rest = values.iter().copied();
    let mut take = |there: bool| {
        if there {
            rest.next().unwrap_or(0.0)
        } else {
            0.0
        }
    };
    let viscous = take(friction.viscous);
    let coulomb = take(friction.coulomb);
    take(friction.offset);
    let sound = viscous >= 0.0 && coulomb >= 0.0;
    sound
        && friction
            .terms
            .iter()
            .zip(rest)
            .all(|(term, value)| match term {
                FrictionTerm::Asymmetric => value.abs() <= viscous,
                FrictionTerm::Stribeck(_) => (-coulomb..=BREAKAWAY * coulomb).contains(&value),
                FrictionTerm::Cubic | FrictionTerm::Root | FrictionTerm::Load => value >= 0.0,
            })
}

/// `‖y - W x‖²` from the triangle.
fn residual_square(parts: &Parts, values: &[f64]) -> f64 {
    let mut sum = parts.e * parts.e;
    for (i, z) in parts.z.iter().enumerate() {
        let product: f64 = (i..values.len()).map(|k| parts.r[(i, k)] * values[k]).sum();
        sum += (z - product).powi(2);
    }
    sum
}

/// Speed of smoothing of a term: none where the term has no sign.
fn smoothing(term: FrictionTerm, reversal: f64) -> f64 {
    match term {
        FrictionTerm::Asymmetric | FrictionTerm::Cubic => 0.0,
        _ => reversal,
    }
}

/// Dead bands that a Stribeck speed must be apart from zero to show.
const SEEN: f64 = 2.0;
/// Stribeck speeds as shares of a joint's largest speed.
const STRIBECK_SHARES: [f64; 5] = [0.01, 0.03, 0.08, 0.2, 0.4];

/// Stribeck speeds searched for a joint; none that a dead band hides.
pub(super) fn stribeck_speeds(
    joint: usize,
    stretches: &[Stretch],
    plan: &SamplingPlan,
) -> [f64; 5] {
    let speeds = stretches.iter().flat_map(|s| s.states.qd(joint));
    let fastest = speeds.fold(0.0, |m: f64, v| m.max(v.abs()));
    let dead = plan.dead_band.get(joint).copied().unwrap_or(0.0);
    STRIBECK_SHARES.map(|s| (s * fastest.max(1e-6)).max(SEEN * dead))
}

fn own_columns(
    robot: &Robot,
    joint: usize,
    stretches: &[Stretch],
    plan: &SamplingPlan,
    wanted: &JointFriction,
    all_terms: bool,
) -> Vec<Own> {
    let mut own = vec![Own::Viscous, Own::Offset];
    let speeds = match wanted.reversal {
        Some(speed) => vec![speed],
        None => reversals(robot, joint).to_vec(),
    };
    let stribeck = stribeck_speeds(joint, stretches, plan).map(FrictionTerm::Stribeck);
    let terms: Vec<FrictionTerm> = if all_terms {
        use FrictionTerm::{Asymmetric, Cubic, Load, Root};
        let fixed = [Asymmetric, Cubic, Root, Load];
        fixed.into_iter().chain(stribeck).collect()
    } else {
        let open = |t: &FrictionTerm| matches!(t, FrictionTerm::Stribeck(v) if v.is_nan());
        let stated = wanted.terms.iter().copied().filter(|t| !open(t));
        let searched = wanted.terms.iter().any(open).then_some(stribeck);
        stated.chain(searched.into_iter().flatten()).collect()
    };
    for speed in speeds {
        own.push(Own::Coulomb(speed));
        for &term in &terms {
            let column = Own::Term(term, smoothing(term, speed));
            if !own.contains(&column) {
                own.push(column);
            }
        }
    }
    own
}

/// Folds the decimated rows of one joint over one stretch into its blocks.
fn fold(
    robot: &Robot,
    shared: &ModelColumns,
    own: &[Own],
    stretch: &Stretch,
    plan: &SamplingPlan,
    joint: usize,
    blocks: &mut [InformationFactor],
) -> Result<(), Error> {
    let decimator = decimator(stretch, plan)?;
    let n_samples = stretch.states.n_samples();
    if n_samples < decimator.fewest_samples() {
        return Ok(());
    }
    let mut columns = joint_columns(robot, shared, stretch, &plan.reversal, joint);
    let speed = stretch.states.qd(joint);
    let load = stretch.load.as_ref().map(|l| l[joint].as_slice());
    columns.extend(own.iter().map(|own| {
        match own {
            Own::Viscous => speed.to_vec(),
            Own::Offset => vec![1.0; n_samples],
            Own::Coulomb(reversal) => speed
                .iter()
                .map(|&v| crate::columns::smooth_sign(v, *reversal))
                .collect(),
            Own::Term(term, reversal) => term.series(speed, load, *reversal),
        }
    }));
    let mut series: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    series.push(&stretch.torque[joint]);
    let decimated = decimator.decimate_columns(&series);
    let kept = decimator.kept(n_samples);
    let usable = stretch.usable(joint, plan, decimator.trim());
    let p = columns.len();
    let n_blocks = blocks.len();
    for (k, &sample) in kept.iter().enumerate() {
        if !usable[sample] {
            continue;
        }
        let block = k * n_blocks / kept.len();
        let row: Vec<f64> = decimated[..p].iter().map(|c| c[k]).collect();
        blocks[block].push_rows(&row, &[decimated[p][k]])?;
    }
    Ok(())
}
