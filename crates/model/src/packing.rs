//! Rows without what is always zero: where each entry stands in them.

use crate::lane::Lane;
use crate::model::Model;
use crate::parameter::{Columns, ParameterKind};
use crate::plan::{ASK, Layout, LinkPlan, Plan};

/// Cells of what can be other than zero, side by side and without signs, as a [`Packing`] has them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Packed<'a> {
    /// At `link * n + k`: first cell of the link in the row of the `k`-th joint on its path.
    pub(crate) rows: &'a [usize],
    /// First drive cell of each joint.
    pub(crate) drives: &'a [usize],
}

impl<C> Layout<C> for Packed<'_> {
    #[inline(always)]
    fn row(self, link: usize, k: usize, _: usize) -> usize {
        self.rows[link * self.drives.len() + k]
    }

    #[inline(always)]
    fn length<const WANTED: u16>(self, link: &LinkPlan) -> usize {
        let wanted = if WANTED == ASK { link.wanted } else { WANTED };
        wanted.count_ones() as usize
    }

    #[inline(always)]
    fn put<T: Lane<Cell = C>, const WANTED: u16>(
        self,
        at: T::At,
        link: &LinkPlan,
        k: usize,
        cells: &mut [C],
        value: T,
    ) {
        value.write(at, &mut cells[link.rank::<WANTED>(k)]);
    }

    #[inline(always)]
    fn drive(self, joint: usize, d: usize, _: usize) -> usize {
        self.drives[joint] + d
    }
}

/// What stands in the rows of a model's columns: what can be other than zero, each entry once.
///
/// A row has the entries of the links its joint carries, the last link first, then the joint's own drive, then what is
/// observed of it. An entry's key is its place among all entries in that same order.
#[derive(Debug, Clone)]
pub(crate) struct Packing {
    /// At `link * n + k`: the `k`-th joint on the link's path, and the link's first cell in that joint's row.
    pub(crate) start: Vec<(usize, usize)>,
    /// First drive cell of each joint's row.
    pub(crate) drives: Vec<usize>,
    /// Keys of the cells of each joint's row, rising.
    pub(crate) keys: Vec<Vec<usize>>,
    /// Number of keys, that of the observation included.
    pub(crate) n_keys: usize,
    /// Key and sign of every column.
    pub(crate) columns: Vec<(usize, f64)>,
}

impl Packing {
    /// Of the columns of a plan that are drawn from `columns`.
    pub(crate) fn new(model: &Model, columns: &Columns, plan: &Plan) -> Self {
        let n = model.n_joints();
        let mut first_key = vec![0; n];
        let mut drive_key = vec![0; n];
        let mut n_keys = 0;
        for (j, link) in plan.links.iter().enumerate().rev() {
            first_key[j] = n_keys;
            n_keys += link.n_wanted();
        }
        for (j, drives) in plan.drives.iter().enumerate() {
            drive_key[j] = n_keys;
            n_keys += drives.len();
        }
        let observation = n_keys;
        let mut packing = Self {
            start: vec![(0, 0); n * n],
            drives: vec![0; n],
            keys: vec![Vec::new(); n],
            n_keys: n_keys + 1,
            columns: Vec::with_capacity(columns.len()),
        };
        for (i, keys) in packing.keys.iter_mut().enumerate() {
            for (j, link) in plan.links.iter().enumerate().rev() {
                if let Some(k) = model.path(j).iter().position(|&joint| joint == i) {
                    packing.start[j * n + k] = (i, keys.len());
                    keys.extend(first_key[j]..first_key[j] + link.n_wanted());
                }
            }
            packing.drives[i] = keys.len();
            keys.extend(drive_key[i]..drive_key[i] + plan.drives[i].len());
            keys.push(observation);
        }
        for (column, p) in columns.0.iter().enumerate() {
            let j = p.index;
            let place = if let Some(k) = p.kind.inertial_index() {
                let (entry, sign) = model.joints[j].link.entry(k);
                (first_key[j] + plan.links[j].rank::<ASK>(entry), sign)
            } else {
                let same = |&(kind, _): &(ParameterKind, usize)| kind == p.kind;
                let d = plan.drives[j].iter().position(same);
                debug_assert!(d.is_some(), "column {column} has no drive");
                (drive_key[j] + d.unwrap_or(0), 1.0)
            };
            packing.columns.push(place);
        }
        packing
    }
}
