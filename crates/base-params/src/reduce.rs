//! From a triangular factor to base columns.

use faer::{Mat, MatRef};

use crate::independent::{KeptColumns, Relation, dot};
use crate::rank::{Rank, condition, rank, scaled_columns, singular_values};
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

/// Coefficients below this multiple of the residuals are in doubt as much as the columns are.
const DOUBT_MARGIN: f64 = 10.0;

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

    let mut relations: Vec<(usize, Relation)> = kept
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
    let doubt = doubt(&relations, &ghosts).min(options.significance / base_condition);
    let zero = ZERO_COEFFICIENT.max(base_condition * doubt.max(ROUNDING));
    let regrouping = regrouping(n, &base, &relations, &columns.norms, zero);
    let ambiguity = ambiguity(
        &rank,
        &columns,
        &regrouping,
        &base,
        &relations,
        &ghosts,
        factor,
    );

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
        ambiguity,
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
    relations: &mut Vec<(usize, Relation)>,
) -> Vec<Ghost> {
    let mut ghosts = Vec::new();
    for (position, &column) in columns.small.iter().enumerate() {
        let vector: Vec<f64> = small.col(position).iter().copied().collect();
        let relative_norm = dot(&vector, &vector).sqrt();
        let mut relation = kept.relation(&vector);
        if relation.residual > VANISHED {
            ghosts.push(Ghost {
                column,
                relative_norm,
            });
            continue;
        }
        for alpha in &mut relation.coefficients {
            // Rounding of the small column is that of the large ones it was computed from.
            *alpha = if alpha.abs() < ROUNDING {
                0.0
            } else {
                *alpha / relative_norm
            };
        }
        relations.push((column, relation));
    }
    ghosts
}

/// How far the coefficients of unit columns are in doubt, per unit of condition number: a tilt that leaves a residual or a
/// ghost of this size changes the coefficients by as much.
fn doubt(relations: &[(usize, Relation)], ghosts: &[Ghost]) -> f64 {
    let residuals = relations.iter().map(|relation| relation.1.residual);
    let sizes = ghosts.iter().map(|ghost| ghost.relative_norm);
    DOUBT_MARGIN * residuals.chain(sizes).fold(0.0, f64::max)
}

/// `K` from the relations of unit columns.
fn regrouping(
    n: usize,
    base: &[usize],
    relations: &[(usize, Relation)],
    norms: &[f64],
    zero: f64,
) -> Mat<f64> {
    let mut result = Mat::zeros(base.len(), n);
    for (b, &column) in base.iter().enumerate() {
        result[(b, column)] = 1.0;
    }
    for (column, relation) in relations {
        for (b, &alpha) in relation.coefficients.iter().enumerate() {
            if alpha.abs() > zero {
                result[(b, *column)] = alpha * (norms[*column] / norms[base[b]]);
            }
        }
    }
    result
}

/// What is in doubt, with the combination of columns that is most so: the largest ghost, or the dependent column with the
/// largest residual together with the base columns it nearly is.
fn ambiguity(
    rank: &Rank,
    columns: &Columns,
    regrouping: &Mat<f64>,
    base: &[usize],
    relations: &[(usize, Relation)],
    ghosts: &[Ghost],
    factor: &TriangularFactor,
) -> Option<Ambiguity> {
    let mut combination = vec![0.0; columns.norms.len()];
    let mut upper_rank = rank.upper;
    let largest = ghosts
        .iter()
        .max_by(|a, b| a.relative_norm.total_cmp(&b.relative_norm));
    if let Some(ghost) = largest {
        combination[ghost.column] = 1.0;
        // Two ghosts may be one and the same direction.
        let all = [columns.significant.as_slice(), &columns.small].concat();
        let raw = scaled_columns(factor.r(), &all, |_| columns.largest);
        let present = singular_values(raw.as_ref())
            .iter()
            .filter(|value| **value > VANISHED)
            .count();
        upper_rank = upper_rank.max(present).max(rank.lower + 1);
    } else if rank.lower < rank.upper {
        let (column, _) = relations
            .iter()
            .max_by(|a, b| a.1.residual.total_cmp(&b.1.residual))?;
        combination[*column] = 1.0;
        for (b, &base) in base.iter().enumerate() {
            combination[base] = -regrouping[(b, *column)];
        }
        let size = combination
            .iter()
            .fold(0.0, |size: f64, value| size.max(value.abs()));
        for value in &mut combination {
            *value /= size;
        }
    } else {
        return None;
    }
    Some(Ambiguity {
        lower_rank: rank.lower,
        upper_rank,
        gap: rank.gap,
        combination,
    })
}
