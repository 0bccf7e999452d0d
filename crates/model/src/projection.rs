//! The regressor's rows by projection of the joint axes.
//!
//! Entry (joint i, link j) is the axis of joint i, seen from link j (six numbers), times the 6 × 10 map of that link's
//! parameters to its wrench. Only axes travel along the chain. Parallel axes share their direction, and with it the six
//! entries of the inertia tensor; the link's own axis is z, and the one before it most often has no part along z.
//! Decisions are taken once for all registers of a cell.

use crate::axes::{Kinematics, LinkAxes};
use crate::frame::LinkPose;
use crate::kinematics::LinkMotion;
use crate::lane::{Lane, V3, read, zero};
use crate::model::{KernelJoint, Model};
use crate::packing::{ROOM, Target};
use crate::parameter::ParameterKind;
use crate::plan::{ALL, ASK, BASE_XX, BASE_YY, LinkPlan};
use crate::robot::JointKind;
use crate::wrench_map::{ABOUT_Z, ACROSS, ANY, SLIDE, WrenchMap};

/// Rows of tiles: packed, without the columns' signs.
pub(crate) const TILES: u8 = 0;
/// Rows of blocks: packed, with signs.
pub(crate) const BLOCKS: u8 = 1;
/// Rows of all columns, with signs.
pub(crate) const DENSE: u8 = 2;

/// Writes the entries that can be other than zero.
#[inline(always)]
pub(crate) fn fill<T: Lane, const ROWS: u8>(
    at: T::At,
    model: &Model,
    target: Target<'_>,
    [q, qd, qdd]: [&[T::Cell]; 3],
    kinematics: &mut Kinematics<T::Cell>,
    cells: &mut [T::Cell],
) {
    let n = model.n_joints();
    if let Some(q) = q.first() {
        kinematics.turn_joint::<T>(at, model, 0, q);
    }
    // Side by side, not by index: where they end is all there is to check.
    let plans = target.plan.links.iter().zip(&target.plan.drives);
    let speeds = qd.iter().zip(qdd);
    for (j, ((joint, (link, drives)), (qd, qdd))) in
        model.joints.iter().zip(plans).zip(speeds).enumerate()
    {
        kinematics.go_out::<T>(at, model, j, [qd, qdd]);
        // One joint ahead: long chains of products, while there is other work.
        if let Some(q) = q.get(j + 1) {
            kinematics.turn_joint::<T>(at, model, j + 1, q);
        }
        if !link.is_empty() {
            let of = OfLink {
                joint,
                link,
                rows: &target.links[j * n..][..joint.path.len()],
                n_columns: target.plan.n_columns,
            };
            let (axes, posed) = (&kinematics.links[j], &mut kinematics.posed);
            of.project::<T, ROWS>(at, axes, posed, cells);
        }
        for (d, &(kind, column)) in drives.iter().enumerate() {
            let place = if ROWS == DENSE { column } else { d };
            let cell = &mut cells[target.drives[j] + place];
            for part in 0..T::PARTS {
                let at = T::part(at, part);
                let entry = match kind {
                    ParameterKind::Ia => T::read(at, qdd),
                    ParameterKind::Fv => T::read(at, qd),
                    ParameterKind::Fc => T::read(at, qd).sign(),
                    _ => T::splat(at, 1.0),
                };
                entry.write(at, cell);
            }
        }
    }
}

/// The entries of a link.
struct OfLink<'a> {
    joint: &'a KernelJoint,
    link: &'a LinkPlan,
    /// Its first cell in the row of every joint on its path.
    rows: &'a [usize],
    n_columns: usize,
}

impl OfLink<'_> {
    /// The rows' entries for the link's columns, compiled once for each set of them that is frequent.
    #[inline(always)]
    fn project<T: Lane, const ROWS: u8>(
        &self,
        at: T::At,
        axes: &LinkAxes<T::Cell>,
        posed: &mut WrenchMap<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        if let LinkPose::Posed {
            rotation,
            translation,
            ..
        } = &self.joint.link
        {
            let pose = (rotation, *translation);
            return self.project_posed::<T, ROWS>(at, pose, axes, posed, cells);
        }
        match self.link.wanted {
            BASE_XX => self.project_along::<T, BASE_XX, ROWS>(at, axes, cells),
            BASE_YY => self.project_along::<T, BASE_YY, ROWS>(at, axes, cells),
            ALL => self.project_along::<T, ALL, ROWS>(at, axes, cells),
            _ => self.project_along::<T, ASK, ROWS>(at, axes, cells),
        }
    }

    /// Rows of a link whose axes are along those of its joint's frame.
    #[inline(always)]
    fn project_along<T: Lane, const WANTED: u16, const ROWS: u8>(
        &self,
        at: T::At,
        axes: &LinkAxes<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        let map = &axes.map;
        let (Some((own, others)), Some((&last, rows))) =
            (self.joint.directions.split_last(), self.rows.split_last())
        else {
            return;
        };
        let (mut axes, mut rows) = (axes.axes.as_slice(), rows);
        for d in others {
            let n = d.range.end - d.range.start;
            let (Some([v, linear @ ..]), Some(of_direction)) =
                (axes.split_off(..=n), rows.split_off(..n))
            else {
                return;
            };
            let path = (of_direction, linear);
            match (d.kind, d.across) {
                (JointKind::Prismatic, _) => {
                    for &row in of_direction {
                        self.project_slide::<T, WANTED, ROWS>(at, row, v, map, cells);
                    }
                }
                (_, true) => {
                    self.project_direction::<T, ACROSS, WANTED, ROWS>(at, path, v, map, cells);
                }
                _ => self.project_direction::<T, ANY, WANTED, ROWS>(at, path, v, map, cells),
            }
        }
        let [v, linear @ ..] = axes else { return };
        if own.kind == JointKind::Prismatic {
            return self.project_slide::<T, WANTED, ROWS>(at, last, v, map, cells);
        }
        if !rows.is_empty() {
            let path = (rows, linear);
            self.project_direction::<T, ABOUT_Z, WANTED, ROWS>(at, path, v, map, cells);
        }
        let row = self.row::<_, ROWS>(last, cells);
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let tensor = self.tensor::<T, ABOUT_Z, WANTED>(at, read(at, v), map);
            self.put_tensor::<T, WANTED, ROWS>(at, row, &tensor);
            let [x, y] = [T::read(at, &map.a[0]), T::read(at, &map.a[1])];
            self.put::<T, WANTED, ROWS>(at, 6, row, y);
            self.put::<T, WANTED, ROWS>(at, 7, row, -x);
        }
    }

    /// Rows of revolute joints, parallel to each other: what the tensor's columns say is the same in all of them.
    #[inline(always)]
    fn project_direction<T: Lane, const FORM: u8, const WANTED: u16, const ROWS: u8>(
        &self,
        at: T::At,
        (rows, linear): (&[usize], &[V3<T::Cell>]),
        v: &V3<T::Cell>,
        map: &WrenchMap<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let v = read(at, v);
            let tensor = self.tensor::<T, FORM, WANTED>(at, v, map);
            for (&row, f) in rows.iter().zip(linear) {
                let row = self.row::<_, ROWS>(row, cells);
                let f = read(at, f);
                self.put_tensor::<T, WANTED, ROWS>(at, row, &tensor);
                self.put_moments::<T, FORM, WANTED, ROWS>(at, row, (v, f), map);
            }
        }
    }

    // One line an entry, not loops over them: only so is it certain that the compiler knows which entry it has.

    /// What the columns of the tensor hold, where they are wanted, for an axis along `v`.
    #[inline(always)]
    fn tensor<T: Lane, const FORM: u8, const WANTED: u16>(
        &self,
        at: T::At,
        v: V3<T>,
        map: &WrenchMap<T::Cell>,
    ) -> [T; 6] {
        [
            self.tensor_entry::<T, FORM, WANTED>(at, 0, v, map),
            self.tensor_entry::<T, FORM, WANTED>(at, 1, v, map),
            self.tensor_entry::<T, FORM, WANTED>(at, 2, v, map),
            self.tensor_entry::<T, FORM, WANTED>(at, 3, v, map),
            self.tensor_entry::<T, FORM, WANTED>(at, 4, v, map),
            self.tensor_entry::<T, FORM, WANTED>(at, 5, v, map),
        ]
    }

    #[inline(always)]
    fn tensor_entry<T: Lane, const FORM: u8, const WANTED: u16>(
        &self,
        at: T::At,
        k: usize,
        v: V3<T>,
        map: &WrenchMap<T::Cell>,
    ) -> T {
        if self.link.wants::<WANTED>(k) {
            map.tensor_entry::<T, FORM>(at, k, v)
        } else {
            v[0]
        }
    }

    #[inline(always)]
    fn put_tensor<T: Lane, const WANTED: u16, const ROWS: u8>(
        &self,
        at: T::At,
        row: &mut [T::Cell],
        tensor: &[T; 6],
    ) {
        self.put::<T, WANTED, ROWS>(at, 0, row, tensor[0]);
        self.put::<T, WANTED, ROWS>(at, 1, row, tensor[1]);
        self.put::<T, WANTED, ROWS>(at, 2, row, tensor[2]);
        self.put::<T, WANTED, ROWS>(at, 3, row, tensor[3]);
        self.put::<T, WANTED, ROWS>(at, 4, row, tensor[4]);
        self.put::<T, WANTED, ROWS>(at, 5, row, tensor[5]);
    }

    #[inline(always)]
    fn put_moments<T: Lane, const FORM: u8, const WANTED: u16, const ROWS: u8>(
        &self,
        at: T::At,
        row: &mut [T::Cell],
        axis: (V3<T>, V3<T>),
        map: &WrenchMap<T::Cell>,
    ) {
        self.put_moment::<T, FORM, WANTED, ROWS>(at, 6, row, axis, map);
        self.put_moment::<T, FORM, WANTED, ROWS>(at, 7, row, axis, map);
        self.put_moment::<T, FORM, WANTED, ROWS>(at, 8, row, axis, map);
        self.put_moment::<T, FORM, WANTED, ROWS>(at, 9, row, axis, map);
    }

    #[inline(always)]
    fn put_moment<T: Lane, const FORM: u8, const WANTED: u16, const ROWS: u8>(
        &self,
        at: T::At,
        k: usize,
        row: &mut [T::Cell],
        (v, f): (V3<T>, V3<T>),
        map: &WrenchMap<T::Cell>,
    ) {
        if self.link.wants::<WANTED>(k) {
            let entry = map.moment_entry::<T, FORM>(at, k, v, f);
            self.put::<T, WANTED, ROWS>(at, k, row, entry);
        }
    }

    /// Row of a slide along `v`: it feels no turning.
    #[inline(always)]
    fn project_slide<T: Lane, const WANTED: u16, const ROWS: u8>(
        &self,
        at: T::At,
        row: usize,
        v: &V3<T::Cell>,
        map: &WrenchMap<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        let row = self.row::<_, ROWS>(row, cells);
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            // As if the axis had no angular part.
            let axis = (zero(at), read(at, v));
            self.put_moments::<T, SLIDE, WANTED, ROWS>(at, row, axis, map);
        }
    }

    /// Rows of a link whose frame stands apart from its joint's.
    #[inline(always)]
    fn project_posed<T: Lane, const ROWS: u8>(
        &self,
        at: T::At,
        (rotation, translation): (&[[f64; 3]; 3], [f64; 3]),
        axes: &LinkAxes<T::Cell>,
        map: &mut WrenchMap<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let own = LinkMotion::<T> {
                w: read(at, &axes.w),
                wd: read(at, &axes.map.wd),
                a: read(at, &axes.map.a),
            };
            let motion = WrenchMap::new(&own).motion_at(&own, rotation, translation);
            WrenchMap::new(&motion).write(at, map);
            for d in &self.joint.directions {
                for k in d.range.clone() {
                    let axis = axes.axis::<T>(at, d, k);
                    let axis = axis.at(rotation, translation);
                    let row = self.row::<_, ROWS>(self.rows[k], cells);
                    let tensor = self.tensor::<T, ANY, ASK>(at, axis.angular, map);
                    self.put_tensor::<T, ASK, ROWS>(at, row, &tensor);
                    let axis = (axis.angular, axis.linear);
                    self.put_moments::<T, ANY, ASK, ROWS>(at, row, axis, map);
                }
            }
        }
    }

    /// Writes an entry to its place, if it is wanted.
    #[inline(always)]
    fn put<T: Lane, const WANTED: u16, const ROWS: u8>(
        &self,
        at: T::At,
        k: usize,
        row: &mut [T::Cell],
        value: T,
    ) {
        if !self.link.wants::<WANTED>(k) {
            return;
        }
        let value = if ROWS == TILES {
            value
        } else {
            value.flipped(self.link.sign[k])
        };
        let place = if ROWS == DENSE {
            self.link.column[k]
        } else {
            self.link.rank::<WANTED>(k)
        };
        value.write(at, &mut row[place]);
    }

    /// The cells a link's entries lie in, in a row where the first of them is this one.
    #[inline(always)]
    fn row<'c, C, const ROWS: u8>(&self, first: usize, cells: &'c mut [C]) -> &'c mut [C] {
        let cells = &mut cells[first..];
        if ROWS == DENSE {
            return &mut cells[..self.n_columns];
        }
        // Of a length that is known: checked here, once.
        let Some(window) = cells.first_chunk_mut::<ROOM>() else {
            panic!("no room for the entries of a link");
        };
        window
    }
}
