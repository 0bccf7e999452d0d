//! The result of a reduction.

use faer::Mat;

/// Kept columns are a poor choice once their condition exceeds that of a pivoted choice by this factor.
const POOR_ORDER: f64 = 1e3;

/// Which columns the rows can tell apart, and what becomes of the others.
///
/// `W x = W_b (K x)` for every `x`, where `W_b` are the columns [`base`](Self::base) of `W` and `K` is
/// [`regrouping`](Self::regrouping). All lists hold column indices and follow the order handed to
/// [`reduce`](crate::reduce). `unidentifiable`, `combined` and `base` share out all columns among them.
///
/// The four lists are the sets U, S, D and D_BS of Radkhah, Kulić and Croft, section II.B.
#[derive(Clone, Debug)]
pub struct Reduction {
    /// Number of columns of `W`.
    pub n_columns: usize,
    /// U: columns that vanish, and ghosts.
    pub unidentifiable: Vec<usize>,
    /// S: base columns without which the rank is lower, that is, with which no other column is combined.
    pub identifiable_alone: Vec<usize>,
    /// D: columns that depend on base columns before them; they are felt in combinations only.
    pub combined: Vec<usize>,
    /// D_BS: the first independent columns.
    pub base: Vec<usize>,
    /// `K`, base × columns: base parameters = `K` · standard parameters.
    ///
    /// Its column for a combined column `i` holds the coefficients of `column i = Σ alpha_k · base column k`. Entries at
    /// rounding level (1e-12 of unit columns, or 64 ε times the condition number if that is more) are exactly zero; where the
    /// relations hold only approximately, so are those below ten times what they leave, times the condition number.
    pub regrouping: Mat<f64>,
    /// The rank is clear by this factor: the smallest ratio of singular values and pivots across it.
    pub rank_gap: f64,
    /// What is in doubt, if the rank is; the base is then that of the lower rank.
    pub ambiguity: Option<Ambiguity>,
    /// Columns so small beside the largest that they look like a geometry described inexactly.
    pub ghosts: Vec<Ghost>,
    /// 2-norm condition number of the base columns, scaled to unit norm.
    pub base_condition: f64,
    /// The same of the columns that a QR with column exchange would keep.
    pub pivoted_condition: f64,
}

/// A rank without a clear gap: which ranks are possible and which combination of columns is in doubt.
#[derive(Clone, Debug, PartialEq)]
pub struct Ambiguity {
    /// Number of columns that are independent beyond doubt.
    pub lower_rank: usize,
    /// Number of columns that may be independent.
    pub upper_rank: usize,
    /// Ratio of the singular values or pivots on both sides of `lower_rank`, the smallest of all witnesses.
    pub gap: f64,
    /// One number a column, the largest is 1 in size: `W · combination` is small without being rounding.
    pub combination: Vec<f64>,
}

/// A column that does not vanish, adds to the rank, and is far too small to be meant.
///
/// An axis tilted by 1e-9 rad because π/2 was written with nine digits makes two of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ghost {
    /// Index of the column.
    pub column: usize,
    /// Its norm beside the largest column norm.
    pub relative_norm: f64,
}

impl Reduction {
    /// Number of base columns.
    pub fn rank(&self) -> usize {
        self.base.len()
    }

    /// Base parameters of standard parameters, `K x`.
    ///
    /// # Panics
    ///
    /// If there is not one number a column.
    #[track_caller]
    pub fn base_parameters(&self, standard: &[f64]) -> Vec<f64> {
        assert!(
            standard.len() == self.n_columns,
            "base_parameters: {} numbers for {} columns",
            standard.len(),
            self.n_columns
        );
        (0..self.rank())
            .map(|b| {
                (0..self.n_columns)
                    .map(|j| self.regrouping[(b, j)] * standard[j])
                    .sum()
            })
            .collect()
    }

    /// The relation of a combined column to base columns: `column = Σ alpha · base column`, as (base column, alpha) without
    /// the zeros.
    ///
    /// # Panics
    ///
    /// If `column` is not a column of `W`.
    #[track_caller]
    pub fn column_coefficients(&self, column: usize) -> Vec<(usize, f64)> {
        assert!(
            column < self.n_columns,
            "column_coefficients: column {column} of {}",
            self.n_columns
        );
        let row = |b: usize| (self.base[b], self.regrouping[(b, column)]);
        (0..self.rank())
            .map(row)
            .filter(|(_, alpha)| *alpha != 0.0)
            .collect()
    }

    /// Whether the order of the columns kept a set far worse conditioned than need be (a factor of 1e3).
    pub fn is_poorly_ordered(&self) -> bool {
        self.base_condition > POOR_ORDER * self.pivoted_condition
    }
}
