//! The regressor's rows by projection of the joint axes.
//!
//! Entry (joint i, link j) is the axis of joint i, seen from link j (six numbers), times the 6 × 10 map of that link's
//! parameters to its wrench. Only axes travel along the chain. Parallel axes share their direction, and with it the six
//! entries of the inertia tensor; the link's own axis is z, and the one before it most often has no part along z.
//!
//! Decisions are taken once for all registers of a cell, by link and by direction; what is between two decisions goes from
//! memory to memory.

use crate::frame::{LinkPose, Rotation, shift_where};
use crate::kinematics::{LinkMotion, Screw, Travel, zero_motion};
use crate::lane::{Lane, V3, minus, read, splat, times, write, zero};
use crate::model::{Direction, KernelJoint, Model};
use crate::packing::{ROOM, Target};
use crate::parameter::ParameterKind;
use crate::plan::{ALL, ASK, BASE_XX, BASE_YY, LinkPlan};
use crate::robot::JointKind;
use crate::wrench_map::{ABOUT_Z, ACROSS, ANY, SLIDE, WrenchMap};

/// Motions and axes of one sample or eight.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics<C> {
    n: usize,
    /// Sine and cosine, or travel, of every joint.
    travel: Vec<[C; 2]>,
    /// Motion of every link; its acceleration only where the link's frame stands apart from its joint's.
    motion: Vec<LinkMotion<C>>,
    /// Acceleration of every joint's origin, in the axes of the link below.
    origin: Vec<V3<C>>,
    /// The map of the link whose turn it is.
    map: WrenchMap<C>,
    /// At `link * n + d`: direction `d` of the link's path; the last one is z and stays.
    direction: Vec<V3<C>>,
    /// At `link * n + k`: speed of the link's origin per unit speed of the `k`-th joint on its path, if it turns; zero for
    /// the link's own.
    linear: Vec<V3<C>>,
}

impl<C: Copy> Kinematics<C> {
    /// `zero` and `one` in every sample.
    pub(crate) fn new(model: &Model, [zero, one]: [C; 2]) -> Self {
        let n = model.n_joints();
        Self {
            n,
            travel: vec![[zero; 2]; n],
            motion: vec![zero_motion(zero); n],
            origin: vec![[zero; 3]; n],
            map: WrenchMap::cells(zero),
            direction: vec![[zero, zero, one]; n * n],
            linear: vec![[zero; 3]; n * n],
        }
    }

    /// Axis of the `k`-th joint on the path of link `j`, of direction `d`, at the frame of the link.
    #[inline(always)]
    pub(crate) fn axis<T: Lane<Cell = C>>(
        &self,
        at: T::At,
        j: usize,
        d: &Direction,
        k: usize,
    ) -> Screw<T> {
        let direction = read(at, &self.direction[j * self.n + d.index]);
        match d.kind {
            JointKind::Revolute => Screw {
                angular: direction,
                linear: read(at, &self.linear[j * self.n + k]),
            },
            JointKind::Prismatic => Screw {
                angular: zero(at),
                linear: direction,
            },
        }
    }

    /// Sines and cosines of all joints: side by side, for they wait for nothing but themselves.
    #[inline(always)]
    fn turn_joints<T: Lane<Cell = C>>(&mut self, at: T::At, model: &Model, q: &[C]) {
        for ((joint, q), travel) in model.joints.iter().zip(q).zip(&mut self.travel) {
            for part in 0..T::PARTS {
                let at = T::part(at, part);
                Travel::new(joint, T::read(at, q)).write(at, travel);
            }
        }
    }

    /// Takes link `j` from the link below: its motion, its map and the axes on its path.
    #[inline(always)]
    fn go_out<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        [qd, qdd]: [&C; 2],
    ) {
        // The same lines for every step, compiled once for each simple one.
        let joint = &model.joints[j];
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let speeds = [T::read(at, qd), T::read(at, qdd)];
            let travel = Travel::read(at, joint.kind, &self.travel[j]);
            match (joint.step.rotation, travel) {
                (Rotation::Quarter, Travel::Turn { s, c }) => {
                    let step = (Rotation::Quarter, Travel::Turn { s, c });
                    self.carry_axes(at, model, j, step);
                    self.move_link(at, model, j, step, speeds);
                }
                (Rotation::None, Travel::Turn { s, c }) => {
                    let step = (Rotation::None, Travel::Turn { s, c });
                    self.carry_axes(at, model, j, step);
                    self.move_link(at, model, j, step, speeds);
                }
                step => {
                    self.carry_axes(at, model, j, step);
                    self.move_link(at, model, j, step, speeds);
                }
            }
        }
    }

    /// Motion of link `j` about its joint's frame, from that of the link below.
    #[inline(always)]
    fn move_link<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        step: (Rotation, Travel<T>),
        speeds: [T; 2],
    ) {
        let joint = &model.joints[j];
        let below = joint.parent.map(|p| (p, &model.joints[p]));
        // Each arm goes through to the end: where they met, all of a motion would have to be put down.
        match below {
            None => {
                let up = joint.step.rotation.inward(minus(model.gravity));
                let a = splat(at, up);
                let vertical = up[0] == 0.0 && up[1] == 0.0;
                let carried = LinkMotion {
                    w: zero(at),
                    wd: zero(at),
                    a: if vertical { a } else { step.1.inward(a) },
                };
                let motion = carried.moved(step.1, speeds[0], speeds[1]);
                self.put_map(at, model, j, &motion, WrenchMap::planar(&motion));
            }
            Some((p, KernelJoint { planar: true, .. })) => {
                let z = z_beyond(at, step);
                let below = &self.motion[p];
                let carried = LinkMotion {
                    w: times(T::read(at, &below.w[2]), z),
                    wd: times(T::read(at, &below.wd[2]), z),
                    a: into_joint(step, read(at, &self.origin[j])),
                };
                let motion = carried.moved(step.1, speeds[0], speeds[1]);
                if joint.planar {
                    self.put_map(at, model, j, &motion, WrenchMap::planar(&motion));
                } else {
                    self.put_map(at, model, j, &motion, WrenchMap::new(&motion));
                }
            }
            Some((p, _)) => {
                let below = &self.motion[p];
                let carried = LinkMotion {
                    w: into_joint(step, read(at, &below.w)),
                    wd: into_joint(step, read(at, &below.wd)),
                    a: into_joint(step, read(at, &self.origin[j])),
                };
                let motion = carried.moved(step.1, speeds[0], speeds[1]);
                self.put_map(at, model, j, &motion, WrenchMap::new(&motion));
            }
        }
    }

    /// Puts down what is known of link `j`, and what it does at the joints it carries.
    #[inline(always)]
    fn put_map<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        motion: &LinkMotion<T>,
        map: WrenchMap<T>,
    ) {
        map.write(at, &mut self.map);
        let known = &mut self.motion[j];
        write(at, motion.w, &mut known.w);
        write(at, motion.wd, &mut known.wd);
        if let LinkPose::Posed { .. } = model.joints[j].link {
            write(at, motion.a, &mut known.a);
        }
        for &c in &model.joints[j].children {
            let step = &model.joints[c].step;
            let a = map.acceleration_at(step.translation);
            write(at, a, &mut self.origin[c]);
        }
    }

    /// Carries the axes of the link below out to link `j`.
    #[inline(always)]
    fn carry_axes<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        step: (Rotation, Travel<T>),
    ) {
        let joint = &model.joints[j];
        let Some(p) = joint.parent else { return };
        let Some((own, others)) = model.joints[p].directions.split_last() else {
            return;
        };
        let (from, to) = (p * self.n, j * self.n);
        let (reaches, reach) = (joint.step.reaches, joint.step.translation);
        for d in others {
            let outside = read(at, &self.direction[from + d.index]);
            let direction = into_joint(step, outside);
            write(at, direction, &mut self.direction[to + d.index]);
            if d.kind == JointKind::Prismatic {
                continue;
            }
            for k in d.range.start..d.range.end {
                let inside = read(at, &self.linear[from + k]);
                let shifted = shift_where(reaches, reach, inside, outside);
                let linear = carried_speed(step, direction, shifted);
                write(at, linear, &mut self.linear[to + k]);
            }
        }
        // The axis of the joint below itself is z there, and stays z where the two are parallel.
        let stays = joint.directions.len() == others.len() + 1;
        let direction = if stays {
            z_axis(at)
        } else {
            z_beyond(at, step)
        };
        if !stays {
            write(at, direction, &mut self.direction[to + own.index]);
        }
        if own.kind == JointKind::Prismatic {
            return;
        }
        for k in own.range.start..own.range.end {
            let shifted = shift_about_z(reach, read(at, &self.linear[from + k]));
            let linear = carried_speed(step, direction, shifted);
            write(at, linear, &mut self.linear[to + k]);
        }
    }
}

/// A vector of the joint below's frame in a joint's.
#[inline(always)]
fn into_joint<T: Lane>((rotation, travel): (Rotation, Travel<T>), v: V3<T>) -> V3<T> {
    travel.inward(rotation.inward(v))
}

/// A speed at the joint's frame, still in the axes of the link below, at the link's own frame in its axes.
#[inline(always)]
fn carried_speed<T: Lane>(step: (Rotation, Travel<T>), direction: V3<T>, v: V3<T>) -> V3<T> {
    let mut linear = into_joint(step, v);
    if let Travel::Slide { d } = step.1 {
        linear[0] = direction[1].mul_add(d, linear[0]);
        linear[1] = (-direction[0]).mul_add(d, linear[1]);
    }
    linear
}

#[inline(always)]
fn z_axis<T: Lane>(at: T::At) -> V3<T> {
    splat(at, [0.0, 0.0, 1.0])
}

/// The axis of the joint below in the frame of a joint.
#[inline(always)]
fn z_beyond<T: Lane>(at: T::At, step: (Rotation, Travel<T>)) -> V3<T> {
    match step {
        (Rotation::Quarter, Travel::Turn { s, c }) => [s, c, s.like(0.0)],
        _ => into_joint(step, z_axis(at)),
    }
}

/// `z × p + v`.
#[inline(always)]
fn shift_about_z<T: Lane>(p: [f64; 3], v: V3<T>) -> V3<T> {
    [v[0] - v[0].like(p[1]), v[1] + v[1].like(p[0]), v[2]]
}

/// Writes the entries that can be other than zero, with their columns' signs or without.
#[inline(always)]
pub(crate) fn fill<T: Lane, const SIGNED: bool>(
    at: T::At,
    model: &Model,
    target: Target<'_>,
    [q, qd, qdd]: [&[T::Cell]; 3],
    kinematics: &mut Kinematics<T::Cell>,
    cells: &mut [T::Cell],
) {
    let n = kinematics.n;
    kinematics.turn_joints::<T>(at, model, q);
    for (j, joint) in model.joints.iter().enumerate() {
        kinematics.go_out::<T>(at, model, j, [&qd[j], &qdd[j]]);
        let link = &target.plan.links[j];
        if !link.is_empty() {
            let rows = &target.links[j * n..][..joint.path.len()];
            let of = OfLink {
                j,
                joint,
                link,
                rows,
            };
            of.project::<T, SIGNED>(at, kinematics, cells);
        }
        for (d, &(kind, _)) in target.plan.drives[j].iter().enumerate() {
            let cell = &mut cells[target.drives[j] + d];
            for part in 0..T::PARTS {
                let at = T::part(at, part);
                let entry = match kind {
                    ParameterKind::Ia => T::read(at, &qdd[j]),
                    ParameterKind::Fv => T::read(at, &qd[j]),
                    ParameterKind::Fc => T::read(at, &qd[j]).sign(),
                    _ => T::splat(at, 1.0),
                };
                entry.write(at, cell);
            }
        }
    }
}

/// The entries of a link.
struct OfLink<'a> {
    j: usize,
    joint: &'a KernelJoint,
    link: &'a LinkPlan,
    /// Its first cell in the row of every joint on its path.
    rows: &'a [usize],
}

impl OfLink<'_> {
    /// The rows' entries for the link's columns, compiled once for each set of them that is frequent.
    #[inline(always)]
    fn project<T: Lane, const SIGNED: bool>(
        &self,
        at: T::At,
        kinematics: &mut Kinematics<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        if let LinkPose::Posed {
            rotation,
            translation,
            ..
        } = &self.joint.link
        {
            return self.project_posed::<T>(at, (rotation, *translation), kinematics, cells);
        }
        match self.link.wanted {
            BASE_XX => self.project_along::<T, BASE_XX, SIGNED>(at, kinematics, cells),
            BASE_YY => self.project_along::<T, BASE_YY, SIGNED>(at, kinematics, cells),
            ALL => self.project_along::<T, ALL, SIGNED>(at, kinematics, cells),
            _ => self.project_along::<T, ASK, SIGNED>(at, kinematics, cells),
        }
    }

    /// Rows of a link whose axes are along those of its joint's frame.
    #[inline(always)]
    fn project_along<T: Lane, const WANTED: u16, const SIGNED: bool>(
        &self,
        at: T::At,
        kinematics: &Kinematics<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        let first = self.j * kinematics.n;
        let linear = &kinematics.linear[first..][..self.rows.len()];
        let direction = &kinematics.direction[first..][..kinematics.n];
        let map = &kinematics.map;
        let Some((own, others)) = self.joint.directions.split_last() else {
            return;
        };
        for (d, v) in others.iter().zip(direction) {
            let (rows, f) = (&self.rows[d.range.clone()], &linear[d.range.clone()]);
            match (d.kind, d.across) {
                (JointKind::Prismatic, _) => {
                    self.project_slide::<T, WANTED, SIGNED>(at, rows, v, map, cells);
                }
                (_, true) => {
                    self.project_direction::<T, ACROSS, WANTED, SIGNED>(
                        at,
                        rows,
                        (v, f),
                        map,
                        cells,
                    );
                }
                _ => self.project_direction::<T, ANY, WANTED, SIGNED>(at, rows, (v, f), map, cells),
            }
        }
        let (rows, f) = (&self.rows[own.range.clone()], &linear[own.range.clone()]);
        let v = &direction[own.index];
        if own.kind == JointKind::Prismatic {
            return self.project_slide::<T, WANTED, SIGNED>(at, rows, v, map, cells);
        }
        let (Some((last, rows)), Some((_, f))) = (rows.split_last(), f.split_last()) else {
            return;
        };
        self.project_direction::<T, ABOUT_Z, WANTED, SIGNED>(at, rows, (v, f), map, cells);
        let row = window(cells, *last);
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let tensor = self.tensor::<T, ABOUT_Z, WANTED>(at, read(at, v), map);
            self.put_tensor::<T, WANTED, SIGNED>(at, row, &tensor);
            let [x, y] = [T::read(at, &map.a[0]), T::read(at, &map.a[1])];
            self.put::<T, WANTED, SIGNED>(at, 6, row, y);
            self.put::<T, WANTED, SIGNED>(at, 7, row, -x);
        }
    }

    /// Rows of parallel revolute joints: what the tensor's columns say is the same in all of them.
    #[inline(always)]
    fn project_direction<T: Lane, const FORM: u8, const WANTED: u16, const SIGNED: bool>(
        &self,
        at: T::At,
        rows: &[usize],
        (v, linear): (&V3<T::Cell>, &[V3<T::Cell>]),
        map: &WrenchMap<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let v = read(at, v);
            let tensor = self.tensor::<T, FORM, WANTED>(at, v, map);
            for (&row, f) in rows.iter().zip(linear) {
                let (row, f) = (window(cells, row), read(at, f));
                self.put_tensor::<T, WANTED, SIGNED>(at, row, &tensor);
                self.put_moments::<T, FORM, WANTED, SIGNED>(at, row, (v, f), map);
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
    fn put_tensor<T: Lane, const WANTED: u16, const SIGNED: bool>(
        &self,
        at: T::At,
        row: &mut [T::Cell; ROOM],
        tensor: &[T; 6],
    ) {
        self.put::<T, WANTED, SIGNED>(at, 0, row, tensor[0]);
        self.put::<T, WANTED, SIGNED>(at, 1, row, tensor[1]);
        self.put::<T, WANTED, SIGNED>(at, 2, row, tensor[2]);
        self.put::<T, WANTED, SIGNED>(at, 3, row, tensor[3]);
        self.put::<T, WANTED, SIGNED>(at, 4, row, tensor[4]);
        self.put::<T, WANTED, SIGNED>(at, 5, row, tensor[5]);
    }

    #[inline(always)]
    fn put_moments<T: Lane, const FORM: u8, const WANTED: u16, const SIGNED: bool>(
        &self,
        at: T::At,
        row: &mut [T::Cell; ROOM],
        axis: (V3<T>, V3<T>),
        map: &WrenchMap<T::Cell>,
    ) {
        self.put_moment::<T, FORM, WANTED, SIGNED>(at, 6, row, axis, map);
        self.put_moment::<T, FORM, WANTED, SIGNED>(at, 7, row, axis, map);
        self.put_moment::<T, FORM, WANTED, SIGNED>(at, 8, row, axis, map);
        self.put_moment::<T, FORM, WANTED, SIGNED>(at, 9, row, axis, map);
    }

    #[inline(always)]
    fn put_moment<T: Lane, const FORM: u8, const WANTED: u16, const SIGNED: bool>(
        &self,
        at: T::At,
        k: usize,
        row: &mut [T::Cell; ROOM],
        (v, f): (V3<T>, V3<T>),
        map: &WrenchMap<T::Cell>,
    ) {
        if self.link.wants::<WANTED>(k) {
            let entry = map.moment_entry::<T, FORM>(at, k, v, f);
            self.put::<T, WANTED, SIGNED>(at, k, row, entry);
        }
    }

    /// Row of a slide along `v`: it feels no turning.
    #[inline(always)]
    fn project_slide<T: Lane, const WANTED: u16, const SIGNED: bool>(
        &self,
        at: T::At,
        rows: &[usize],
        v: &V3<T::Cell>,
        map: &WrenchMap<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        for &row in rows {
            let row = window(cells, row);
            for part in 0..T::PARTS {
                let at = T::part(at, part);
                // As if the axis had no angular part.
                let axis = (zero(at), read(at, v));
                self.put_moments::<T, SLIDE, WANTED, SIGNED>(at, row, axis, map);
            }
        }
    }

    /// Rows of a link whose frame stands apart from its joint's.
    #[inline(always)]
    fn project_posed<T: Lane>(
        &self,
        at: T::At,
        (rotation, translation): (&[[f64; 3]; 3], [f64; 3]),
        kinematics: &mut Kinematics<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            let own = LinkMotion::<T>::read(at, &kinematics.motion[self.j]);
            let motion = WrenchMap::new(&own).motion_at(&own, rotation, translation);
            WrenchMap::new(&motion).write(at, &mut kinematics.map);
            for d in &self.joint.directions {
                for k in d.range.clone() {
                    let axis = kinematics.axis::<T>(at, self.j, d, k);
                    let axis = axis.at(rotation, translation);
                    let (map, row) = (&kinematics.map, window(cells, self.rows[k]));
                    let tensor = self.tensor::<T, ANY, ASK>(at, axis.angular, map);
                    self.put_tensor::<T, ASK, false>(at, row, &tensor);
                    let axis = (axis.angular, axis.linear);
                    self.put_moments::<T, ANY, ASK, false>(at, row, axis, map);
                }
            }
        }
    }

    /// Writes an entry to its place, if it is wanted.
    #[inline(always)]
    fn put<T: Lane, const WANTED: u16, const SIGNED: bool>(
        &self,
        at: T::At,
        k: usize,
        row: &mut [T::Cell; ROOM],
        value: T,
    ) {
        if !self.link.wants::<WANTED>(k) {
            return;
        }
        let value = if SIGNED {
            value.flipped(self.link.sign[k])
        } else {
            value
        };
        value.write(at, &mut row[self.link.rank::<WANTED>(k)]);
    }
}

/// The cells a link's entries lie in: the index is checked here, once.
#[inline(always)]
fn window<C>(cells: &mut [C], first: usize) -> &mut [C; ROOM] {
    let Some(window) = cells[first..].first_chunk_mut() else {
        panic!("no room for the entries of a link");
    };
    window
}
