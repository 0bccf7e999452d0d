//! Rows without what is always zero: where each entry stands in them.

use crate::model::Model;
use crate::parameter::{Columns, ParameterKind};
use crate::plan::{ASK, Plan};

/// Where the entries that can be other than zero are written to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target<'a> {
    pub(crate) plan: &'a Plan,
    /// At `link * n + k`: first cell of the link in the row of the `k`-th joint on its path.
    pub(crate) links: &'a [usize],
    /// First drive cell of each joint.
    pub(crate) drives: &'a [usize],
}

/// Rows of all columns, one after another.
#[derive(Debug, Clone)]
pub(crate) struct DenseRows {
    pub(crate) plan: Plan,
    links: Vec<usize>,
    drives: Vec<usize>,
}

impl DenseRows {
    #[track_caller]
    pub(crate) fn new(model: &Model, columns: &Columns) -> Self {
        let (n, p) = (model.n_joints(), columns.len());
        let mut links = vec![0; n * n];
        for j in 0..n {
            for (first, &joint) in links[j * n..].iter_mut().zip(model.path(j)) {
                *first = joint * p;
            }
        }
        Self {
            plan: Plan::new(model, columns),
            links,
            drives: (0..n).map(|joint| joint * p).collect(),
        }
    }

    #[inline]
    pub(crate) fn all(&self) -> Target<'_> {
        Target {
            plan: &self.plan,
            links: &self.links,
            drives: &self.drives,
        }
    }

    /// Fills in the columns that stand elsewhere already.
    pub(crate) fn repeat(&self, model: &Model, rows: &mut [f64]) {
        for twin in &self.plan.twins {
            for &joint in model.path(twin.link) {
                let row = &mut rows[joint * self.plan.n_columns..];
                row[twin.column] = row[twin.first];
            }
        }
    }
}

/// Cells beyond the last entry: a link's ten must fit wherever it begins. They stay zero.
pub(crate) const ROOM: usize = 10;

/// Rows of a sample, one after another, each with only what can be other than zero.
#[derive(Debug, Clone)]
pub(crate) struct Rows {
    pub(crate) plan: Plan,
    links: Vec<usize>,
    drives: Vec<usize>,
    /// At `joint * n_columns + column`: the cell of that entry.
    pub(crate) places: Vec<usize>,
    /// The cell of all entries that are always zero.
    pub(crate) nothing: usize,
    pub(crate) n_cells: usize,
}

impl Rows {
    #[track_caller]
    pub(crate) fn new(model: &Model, columns: &Columns) -> Self {
        let n = model.n_joints();
        let plan = Plan::new(model, columns);
        // What stands in a row, in the order of a `Packing` without the observation.
        let mut length = vec![0; n];
        let mut links = vec![0; n * n];
        for (j, link) in plan.links.iter().enumerate().rev() {
            for (k, &joint) in model.path(j).iter().enumerate() {
                links[j * n + k] = length[joint];
                length[joint] += link.n_wanted();
            }
        }
        let mut drives = vec![0; n];
        let mut end = 0;
        for (i, length) in length.iter_mut().enumerate() {
            drives[i] = end + *length;
            let first = end;
            end = drives[i] + plan.drives[i].len();
            *length = first;
        }
        let first = length;
        for j in 0..n {
            for (k, &joint) in model.path(j).iter().enumerate() {
                links[j * n + k] += first[joint];
            }
        }
        let mut places = vec![end; n * columns.len()];
        for (column, p) in columns.0.iter().enumerate() {
            let j = p.index;
            if let Some(k) = p.kind.inertial_index() {
                let rank = plan.links[j].rank::<ASK>(model.joints[j].link.entry(k).0);
                for (k, &joint) in model.path(j).iter().enumerate() {
                    places[joint * columns.len() + column] = links[j * n + k] + rank;
                }
            } else {
                let d = plan.drives[j].iter().position(|&(kind, _)| kind == p.kind);
                debug_assert!(d.is_some(), "column {column} has no drive");
                places[j * columns.len() + column] = drives[j] + d.unwrap_or(0);
            }
        }
        Self {
            links,
            drives,
            plan,
            places,
            nothing: end,
            n_cells: end + ROOM,
        }
    }

    /// All of them.
    #[inline]
    pub(crate) fn all(&self) -> Target<'_> {
        Target {
            plan: &self.plan,
            links: &self.links,
            drives: &self.drives,
        }
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
