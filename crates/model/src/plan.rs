//! Which entry of the regressor goes to which column, found once.

use crate::lane::Lane;
use crate::model::Model;
use crate::parameter::{Columns, ParameterKind};

/// Which entry of which link goes to which column, found once.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
    /// Number of columns.
    pub(crate) n_columns: usize,
    pub(crate) links: Vec<LinkPlan>,
    /// For each joint: (drive kind, column).
    pub(crate) drives: Vec<Vec<(ParameterKind, usize)>>,
    /// Columns asked for more than once, at their further places.
    pub(crate) twins: Vec<Twin>,
}

/// A further place of a column that stands elsewhere already.
#[derive(Debug, Clone)]
pub(crate) struct Twin {
    pub(crate) link: usize,
    pub(crate) entry: usize,
    pub(crate) negated: bool,
    pub(crate) column: usize,
    pub(crate) first: usize,
}

/// Columns of a link, by the place of the entry among the ten.
#[derive(Debug, Clone, Default)]
pub(crate) struct LinkPlan {
    /// Bit k: entry k is asked for.
    pub(crate) wanted: u16,
    pub(crate) column: [usize; 10],
    /// -0 where the column is the entry's negative, else 0: to flip its sign by.
    pub(crate) sign: [f64; 10],
}

/// All ten entries of a link.
pub(crate) const ALL: u16 = 0b11_1111_1111;
/// What the base columns of a link in the middle of an arm most often are: no mass, no moment along the axis, and of
/// the tensor's entries across the axis only one.
pub(crate) const BASE_XX: u16 = 0b00_1111_0111;
/// The same with the other entry.
pub(crate) const BASE_YY: u16 = 0b00_1111_1110;
/// Any set: look it up.
pub(crate) const ASK: u16 = 0;

impl LinkPlan {
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.wanted == 0
    }

    /// Whether entry `k` is asked for; `WANTED` answers at compile time unless it is [`ASK`].
    #[inline(always)]
    pub(crate) fn wants<const WANTED: u16>(&self, k: usize) -> bool {
        let wanted = if WANTED == ASK { self.wanted } else { WANTED };
        wanted >> k & 1 == 1
    }

    /// How many entries are asked for.
    #[inline(always)]
    pub(crate) fn n_wanted(&self) -> usize {
        self.wanted.count_ones() as usize
    }

    /// Place of entry `k`, one of the ten, among those asked for.
    #[inline(always)]
    pub(crate) fn rank<const WANTED: u16>(&self, k: usize) -> usize {
        let wanted = if WANTED == ASK { self.wanted } else { WANTED };
        (wanted & ((1 << k) - 1)).count_ones() as usize
    }

    /// Entry `k` from its column of a row, zero where it was not asked for.
    #[inline(always)]
    pub(crate) fn get<T: Lane>(&self, at: T::At, k: usize, row: &[T::Cell]) -> T {
        if !self.wants::<ASK>(k) {
            return T::splat(at, 0.0);
        }
        T::read(at, &row[self.column[k]]).flipped(self.sign[k])
    }
}

impl Plan {
    #[track_caller]
    pub(crate) fn new(model: &Model, columns: &Columns) -> Self {
        let n = model.n_joints();
        let mut plan = Self {
            n_columns: columns.len(),
            links: vec![LinkPlan::default(); n],
            drives: vec![Vec::new(); n],
            twins: Vec::new(),
        };
        for (column, p) in columns.0.iter().enumerate() {
            assert!(
                p.index < n,
                "column {p} names a link the model does not have"
            );
            let Some(k) = p.kind.inertial_index() else {
                plan.drives[p.index].push((p.kind, column));
                continue;
            };
            let (entry, sign) = model.joints[p.index].link.entry(k);
            let link = &mut plan.links[p.index];
            if link.wanted >> entry & 1 == 1 {
                plan.twins.push(Twin {
                    link: p.index,
                    entry,
                    negated: sign < 0.0,
                    column,
                    first: link.column[entry],
                });
                continue;
            }
            link.wanted |= 1 << entry;
            link.sign[entry] = 0.0_f64.copysign(sign);
            link.column[entry] = column;
        }
        plan
    }
}
