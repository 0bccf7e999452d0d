//! From a triangular factor to base columns.

use faer::{Mat, MatRef};

use crate::independent::{KeptColumns, dot};
use crate::rank::{Rank, condition, rank, right_singular_vector, scaled_columns, singular_values};
use crate::{Ambiguity, Ghost, Reduction, TriangularFactor};

/// A column below this share of the largest vanishes.
///
/// cos(π/2) = 6e-17 leaves columns of 1e-16, a chain of such axes perhaps 1e-13; angles written with nine digits leave 1e-9.
/// Decided on the raw columns: scaled to unit norm, a column of rounding looks as good as any.
pub(crate) const VANISHED: f64 = 1e-10;
/// Coefficients of unit columns below this are rounding (see [`Reduction::regrouping`]).
const ZERO_COEFFICIENT: f64 = 1e-12;
/// Relative error of a least-squares solution per unit of condition number, generously.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// What it takes for a column and for a rank to be accepted.
#[derive(Clone, Debug, PartialEq)]
pub struct ReductionOptions {
    /// The rank is clear if singular values fall by this factor across it, and nowhere else; 1e4 (robots described exactly
    /// give 1e10 and more, angles rounded to nine digits leave two gaps of 1e6).
    pub min_gap: f64,
    /// A column smaller than this beside the largest cannot represent a parameter; 1e-5. If it depends on larger columns it is
    /// regrouped with them, else it is reported as a [`Ghost`].
    pub significance: f64,
}

impl Default for ReductionOptions {
    fn default() -> Self {
        Self {
            min_gap: 1e4,
            significance: 1e-5,
        }
    }
}

/// Base columns, categories and regrouping of the rows in `factor`.
///
/// `W x = W_b K x` for every `x`, to rounding, apart from columns called vanished (1e-10 of the largest) or ghosts.
/// `order`: every column once; a column is kept if it is independent of those kept before it. Keeping the links from base to
/// tip gives the names of the literature.
///
/// A column vanishes against the largest column norm before any scaling. The rank is read from the pivots and singular
/// values of the unit columns and confirmed by the raw ones; where it is in doubt the answer is that of the lower rank and
/// [`Reduction::ambiguity`] says so. The categories follow from the null space, which is equivalent to the rank tests of the
/// source: leaving out a column lowers the rank exactly if no linear relation involves it, and every relation has one
/// dependent column and base columns kept before it.
///
/// Source: Gautier 1991 (numeric regrouping); Radkhah, Kulić and Croft, section II.B (categories).
///
/// # Panics
///
/// If `order` does not name every column of the factor exactly once.
///
/// # Examples
///
/// See the [crate's](crate) example.
#[track_caller]
pub fn reduce(factor: &TriangularFactor, order: &[usize], options: &ReductionOptions) -> Reduction {
    let n = factor.n_columns();
    let mut sorted = order.to_vec();
    sorted.sort_unstable();
    assert!(
        sorted.iter().copied().eq(0..n),
        "reduce: the order must name each of {n} columns once, it has {} entries: {order:?}",
        order.len()
    );

    let columns = Columns::sort(factor.r(), order, options.significance);
    let unit = scaled_columns(factor.r(), &columns.significant, |j| columns.norms[j]);
    let raw = scaled_columns(factor.r(), &columns.significant, |_| columns.largest);
    let mut rank = rank(unit.as_ref(), raw.as_ref(), options.min_gap);
    if rank.lower == factor.n_rows() {
        // As many rows as independent columns: more rows might raise the rank.
        rank.upper = columns.significant.len();
    }

    let vectors: Vec<Vec<f64>> = (0..unit.ncols())
        .map(|j| unit.col(j).iter().copied().collect())
        .collect();
    let kept = KeptColumns::of(&vectors, rank.tolerance, rank.lower);
    rank.upper = rank.upper.max(kept.kept.len() + usize::from(kept.exceeded));
    rank.lower = kept.kept.len();
    let base_condition = condition(kept.triangle().as_ref());

    let mut relations: Vec<(usize, Vec<f64>)> = kept
        .dependent
        .iter()
        .map(|(position, relation)| (columns.significant[*position], relation.clone()))
        .collect();
    let small = scaled_columns(factor.r(), &columns.small, |_| columns.largest);
    let ghosts = small_columns(&columns, &kept, small.as_ref(), &mut relations);

    let base: Vec<usize> = kept
        .kept
        .iter()
        .map(|position| columns.significant[*position])
        .collect();
    let zero = ZERO_COEFFICIENT.max(ROUNDING * base_condition);
    let regrouping = regrouping(n, &base, &relations, &columns.norms, zero);
    let is_combined = |j: &usize| relations.iter().any(|relation| relation.0 == *j);
    let is_alone = |b: &usize| (0..n).filter(|j| regrouping[(*b, *j)] != 0.0).count() == 1;
    Reduction {
        n_columns: n,
        unidentifiable: order
            .iter()
            .copied()
            .filter(|j| !is_combined(j) && !base.contains(j))
            .collect(),
        identifiable_alone: (0..base.len()).filter(is_alone).map(|b| base[b]).collect(),
        combined: order.iter().copied().filter(is_combined).collect(),
        rank_gap: rank.gap,
        ambiguity: ambiguity(&rank, &columns, unit.as_ref(), &ghosts, factor.r()),
        ghosts,
        base_condition,
        pivoted_condition: rank.pivoted_condition,
        base,
        regrouping,
    }
}

/// The columns in the order asked for, by size; those that vanish are in neither list.
struct Columns {
    norms: Vec<f64>,
    largest: f64,
    significant: Vec<usize>,
    small: Vec<usize>,
}

impl Columns {
    fn sort(r: MatRef<'_, f64>, order: &[usize], significance: f64) -> Self {
        let norms: Vec<f64> = (0..r.ncols()).map(|j| r.col(j).norm_l2()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let present = order
            .iter()
            .copied()
            .filter(|j| norms[*j] > VANISHED * largest);
        let (significant, small) = present.partition(|j| norms[*j] > significance * largest);
        Self {
            norms,
            largest,
            significant,
            small,
        }
    }
}

/// Shares out the small columns: relations for those that depend on the base, the others are ghosts.
///
/// Judged in units of the largest column, as whether a column vanishes: what the base leaves of it either vanishes or not.
fn small_columns(
    columns: &Columns,
    kept: &KeptColumns,
    small: MatRef<'_, f64>,
    relations: &mut Vec<(usize, Vec<f64>)>,
) -> Vec<Ghost> {
    let mut ghosts = Vec::new();
    for (position, &column) in columns.small.iter().enumerate() {
        let vector: Vec<f64> = small.col(position).iter().copied().collect();
        let relative_norm = dot(&vector, &vector).sqrt();
        let (mut relation, residual) = kept.relation(&vector);
        if residual > VANISHED {
            ghosts.push(Ghost {
                column,
                relative_norm,
            });
        } else {
            for value in &mut relation {
                *value /= relative_norm;
            }
            relations.push((column, relation));
        }
    }
    ghosts
}

/// `K` from the relations of unit columns.
fn regrouping(
    n: usize,
    base: &[usize],
    relations: &[(usize, Vec<f64>)],
    norms: &[f64],
    zero: f64,
) -> Mat<f64> {
    let mut result = Mat::zeros(base.len(), n);
    for (b, &column) in base.iter().enumerate() {
        result[(b, column)] = 1.0;
    }
    for (column, relation) in relations {
        for (b, &alpha) in relation.iter().enumerate() {
            if alpha.abs() > zero {
                result[(b, *column)] = alpha * (norms[*column] / norms[base[b]]);
            }
        }
    }
    result
}

/// What is in doubt, with the combination of columns that is most so.
fn ambiguity(
    rank: &Rank,
    columns: &Columns,
    unit: MatRef<'_, f64>,
    ghosts: &[Ghost],
    r: MatRef<'_, f64>,
) -> Option<Ambiguity> {
    let mut upper_rank = rank.upper;
    if !ghosts.is_empty() {
        // Two ghosts may be one and the same direction.
        let all = [columns.significant.as_slice(), &columns.small].concat();
        let values = singular_values(scaled_columns(r, &all, |_| columns.largest).as_ref());
        let present = values.iter().filter(|value| **value > VANISHED).count();
        upper_rank = upper_rank.max(present).max(rank.lower + 1);
    }
    let mut combination = vec![0.0; columns.norms.len()];
    if rank.lower < rank.upper {
        let direction = right_singular_vector(unit, rank.lower);
        for (value, &column) in direction.iter().zip(&columns.significant) {
            combination[column] = value / columns.norms[column];
        }
        let size = combination
            .iter()
            .fold(0.0, |size: f64, value| size.max(value.abs()));
        for value in &mut combination {
            *value /= size;
        }
    } else {
        let most = ghosts
            .iter()
            .max_by(|a, b| a.relative_norm.total_cmp(&b.relative_norm))?;
        combination[most.column] = 1.0;
    }
    Some(Ambiguity {
        lower_rank: rank.lower,
        upper_rank,
        gap: rank.gap,
        combination,
    })
}
