//! The regressor's rows by projection of the joint axes.
//!
//! Entry (joint i, link j) is the axis of joint i, seen from link j (six numbers), times the 6 × 10 map of that link's
//! parameters to its wrench. Only axes travel along the chain. Parallel axes share their direction, and with it the six
//! entries of the inertia tensor; the link's own axis is z, and the one before it most often has no part along z.

use crate::frame::{LinkPose, Rotation, shift};
use crate::kinematics::{LinkMotion, Screw, Travel, zero_motion};
use crate::lane::{Lane, V3, minus, read, splat, times, write, zero};
use crate::model::{Direction, KernelJoint, Model};
use crate::parameter::ParameterKind;
use crate::plan::{ALL, ASK, BASE_XX, BASE_YY, Full, Layout, LinkPlan, Plan};
use crate::robot::JointKind;
use crate::wrench_map::{ABOUT_Z, ACROSS, ANY, WrenchMap};
use std::ops::Range;

/// Motions and axes of one sample or eight.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics<C> {
    n: usize,
    /// Sine and cosine, or travel, of every joint.
    travel: Vec<[C; 2]>,
    /// Motion of every link; before its turn has come, of the link below at this joint's origin.
    motion: Vec<LinkMotion<C>>,
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
            Travel::new(joint, T::read(at, q)).write(at, travel);
        }
    }

    /// Takes link `j` from the link below: its motion and the axes on its path.
    #[inline(always)]
    fn go_out<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        [qd, qdd]: [T; 2],
    ) -> WrenchMap<T> {
        // The same lines for every step, compiled once for each simple one.
        let joint = &model.joints[j];
        let travel = Travel::read(at, joint.kind, &self.travel[j]);
        match (joint.step.rotation, travel) {
            (Rotation::Quarter, Travel::Turn { s, c }) => {
                let step = (Rotation::Quarter, Travel::Turn { s, c });
                self.carry_axes(at, model, j, step);
                self.move_link(at, model, j, step, [qd, qdd])
            }
            (Rotation::None, Travel::Turn { s, c }) => {
                let step = (Rotation::None, Travel::Turn { s, c });
                self.carry_axes(at, model, j, step);
                self.move_link(at, model, j, step, [qd, qdd])
            }
            step => {
                self.carry_axes(at, model, j, step);
                self.move_link(at, model, j, step, [qd, qdd])
            }
        }
    }

    /// Motion of link `j` about its joint's frame, and what it does at the joints the link carries.
    #[inline(always)]
    fn move_link<T: Lane<Cell = C>>(
        &mut self,
        at: T::At,
        model: &Model,
        j: usize,
        step: (Rotation, Travel<T>),
        [qd, qdd]: [T; 2],
    ) -> WrenchMap<T> {
        let joint = &model.joints[j];
        let below = LinkMotion::<T>::read(at, &self.motion[j]);
        let carried = match joint.parent {
            None => {
                let up = joint.step.rotation.inward(minus(model.gravity));
                let vertical = up[0] == 0.0 && up[1] == 0.0;
                let a = splat(at, up);
                LinkMotion {
                    w: zero(at),
                    wd: zero(at),
                    a: if vertical { a } else { step.1.inward(a) },
                }
            }
            Some(p) if model.joints[p].planar => {
                let z = z_beyond(at, step);
                LinkMotion {
                    w: times(below.w[2], z),
                    wd: times(below.wd[2], z),
                    a: into_joint(step, below.a),
                }
            }
            Some(_) => LinkMotion {
                w: into_joint(step, below.w),
                wd: into_joint(step, below.wd),
                a: into_joint(step, below.a),
            },
        };
        let motion = carried.moved(step.1, qd, qdd);
        let map = if joint.planar {
            WrenchMap::planar(&motion)
        } else {
            WrenchMap::new(&motion)
        };
        for &c in &joint.children {
            let at_child = LinkMotion {
                a: map.acceleration_at(model.joints[c].step.translation),
                ..motion
            };
            at_child.write(at, &mut self.motion[c]);
        }
        map
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
        let n = self.n;
        let p_from = joint.step.translation;
        let below = &model.joints[p].directions;
        let (inner, outer) = self.direction.split_at_mut(j * n);
        let (inner_linear, outer_linear) = self.linear.split_at_mut(j * n);
        let (directions, linears) = (&inner[p * n..][..n], &inner_linear[p * n..][..n]);
        let (out, out_linear) = (&mut outer[..n], &mut outer_linear[..n]);
        for d in below {
            let own_of_below = d.index + 1 == below.len();
            let stays = d.index + 1 == joint.directions.len();
            let outside = read(at, &directions[d.index]);
            let direction = match (stays, own_of_below) {
                (true, _) => z_axis(at),
                (false, true) => z_beyond(at, step),
                (false, false) => into_joint(step, outside),
            };
            if !stays {
                write(at, direction, &mut out[d.index]);
            }
            if d.kind == JointKind::Prismatic {
                continue;
            }
            for k in d.range.clone() {
                let inside = read(at, &linears[k]);
                let shifted = if own_of_below {
                    shift_about_z(p_from, inside)
                } else {
                    shift(p_from, inside, outside)
                };
                let mut linear = into_joint(step, shifted);
                if let Travel::Slide { d } = step.1 {
                    linear[0] = direction[1].mul_add(d, linear[0]);
                    linear[1] = (-direction[0]).mul_add(d, linear[1]);
                }
                write(at, linear, &mut out_linear[k]);
            }
        }
    }
}

/// A vector of the joint below's frame in a joint's.
#[inline(always)]
fn into_joint<T: Lane>((rotation, travel): (Rotation, Travel<T>), v: V3<T>) -> V3<T> {
    travel.inward(rotation.inward(v))
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

/// Writes the entries that can be other than zero; `rows` is `n × p`, joint by joint, zero where nothing was written yet.
#[inline(always)]
pub(crate) fn fill<T: Lane>(
    at: T::At,
    model: &Model,
    plan: &Plan,
    state: [&[T::Cell]; 3],
    kinematics: &mut Kinematics<T::Cell>,
    rows: &mut [T::Cell],
) {
    let p = plan.n_columns;
    fill_as::<T, _>(
        at,
        model,
        (plan, Full { n_columns: p }),
        state,
        kinematics,
        rows,
    );
    for twin in &plan.twins {
        for &i in &model.joints[twin.link].path {
            let entry = T::read(at, &rows[i * p + twin.first]);
            entry.write(at, &mut rows[i * p + twin.column]);
        }
    }
}

/// The same in a layout, without columns that are asked for more than once.
#[inline(always)]
pub(crate) fn fill_as<T: Lane, L: Layout<T::Cell>>(
    at: T::At,
    model: &Model,
    (plan, layout): (&Plan, L),
    [q, qd, qdd]: [&[T::Cell]; 3],
    kinematics: &mut Kinematics<T::Cell>,
    cells: &mut [T::Cell],
) {
    kinematics.turn_joints::<T>(at, model, q);
    for (j, joint) in model.joints.iter().enumerate() {
        let (qd, qdd) = (T::read(at, &qd[j]), T::read(at, &qdd[j]));
        let map = kinematics.go_out(at, model, j, [qd, qdd]);
        let link = &plan.links[j];
        if !link.is_empty() {
            let to = Target {
                at,
                j,
                link,
                layout,
            };
            to.project(joint, &map, kinematics, cells);
        }
        for (d, &(kind, column)) in plan.drives[j].iter().enumerate() {
            let entry = match kind {
                ParameterKind::Ia => qdd,
                ParameterKind::Fv => qd,
                ParameterKind::Fc => qd.sign(),
                _ => T::splat(at, 1.0),
            };
            entry.write(at, &mut cells[layout.drive(j, d, column)]);
        }
    }
}

/// The cells of a link's entries.
struct Target<'a, T: Lane, L> {
    at: T::At,
    j: usize,
    link: &'a LinkPlan,
    layout: L,
}

impl<T: Lane, L: Layout<T::Cell>> Target<'_, T, L> {
    /// The rows' entries for the link's columns.
    #[inline(always)]
    fn project(
        &self,
        joint: &KernelJoint,
        map: &WrenchMap<T>,
        kinematics: &Kinematics<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        match (&joint.link, self.link.wanted) {
            (
                LinkPose::Posed {
                    rotation,
                    translation,
                    ..
                },
                _,
            ) => self.project_posed(joint, map, (rotation, *translation), kinematics, cells),
            (_, BASE_XX) => self.project_along::<BASE_XX>(joint, map, kinematics, cells),
            (_, BASE_YY) => self.project_along::<BASE_YY>(joint, map, kinematics, cells),
            (_, ALL) => self.project_along::<ALL>(joint, map, kinematics, cells),
            _ => self.project_along::<ASK>(joint, map, kinematics, cells),
        }
    }

    /// Rows of a link whose axes are along those of its joint's frame.
    #[inline(always)]
    fn project_along<const WANTED: u16>(
        &self,
        joint: &KernelJoint,
        map: &WrenchMap<T>,
        kinematics: &Kinematics<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        let (at, n) = (self.at, kinematics.n);
        let linear = &kinematics.linear[self.j * n..][..joint.path.len()];
        let direction = &kinematics.direction[self.j * n..][..n];
        for d in &joint.directions {
            let v = read(at, &direction[d.index]);
            let Range { start, end } = d.range;
            let own = d.index + 1 == joint.directions.len();
            match (d.kind, own, d.across) {
                (JointKind::Prismatic, _, _) => {
                    let row = self.row::<WANTED>(joint, start, cells);
                    for k in 6..10 {
                        if self.link.wants::<WANTED>(k) {
                            self.put::<WANTED>(k, row, map.force_entry(k, v));
                        }
                    }
                }
                (_, true, _) => {
                    let below = start..end - 1;
                    self.project_direction::<ABOUT_Z, WANTED>(
                        joint,
                        below,
                        (v, linear),
                        map,
                        cells,
                    );
                    let row = self.row::<WANTED>(joint, end - 1, cells);
                    for k in 0..8 {
                        if self.link.wants::<WANTED>(k) {
                            let entry = if k < 6 {
                                map.tensor_entry::<ABOUT_Z>(k, v)
                            } else {
                                map.own_moment_entry(k)
                            };
                            self.put::<WANTED>(k, row, entry);
                        }
                    }
                }
                (_, _, true) => {
                    self.project_direction::<ACROSS, WANTED>(
                        joint,
                        start..end,
                        (v, linear),
                        map,
                        cells,
                    );
                }
                _ => self.project_direction::<ANY, WANTED>(
                    joint,
                    start..end,
                    (v, linear),
                    map,
                    cells,
                ),
            }
        }
    }

    /// Rows of parallel revolute joints: what the tensor's columns say is the same in all of them.
    #[inline(always)]
    fn project_direction<const FORM: u8, const WANTED: u16>(
        &self,
        joint: &KernelJoint,
        range: Range<usize>,
        (v, linear): (V3<T>, &[V3<T::Cell>]),
        map: &WrenchMap<T>,
        cells: &mut [T::Cell],
    ) {
        let mut tensor = [v[0]; 6];
        for k in 0..6 {
            if self.link.wants::<WANTED>(k) {
                tensor[k] = map.tensor_entry::<FORM>(k, v);
            }
        }
        for k in range {
            let row = self.row::<WANTED>(joint, k, cells);
            let f = read(self.at, &linear[k]);
            for k in 0..10 {
                if self.link.wants::<WANTED>(k) {
                    let entry = if k < 6 {
                        tensor[k]
                    } else {
                        map.moment_entry::<FORM>(k, v, f)
                    };
                    self.put::<WANTED>(k, row, entry);
                }
            }
        }
    }

    /// Rows of a link whose frame stands apart from its joint's.
    #[inline(always)]
    fn project_posed(
        &self,
        joint: &KernelJoint,
        map: &WrenchMap<T>,
        (rotation, translation): (&[[f64; 3]; 3], [f64; 3]),
        kinematics: &Kinematics<T::Cell>,
        cells: &mut [T::Cell],
    ) {
        let map = WrenchMap::new(&map.motion_at(rotation, translation));
        for d in &joint.directions {
            for k in d.range.clone() {
                let axis = kinematics.axis::<T>(self.at, self.j, d, k);
                let axis = axis.at(rotation, translation);
                let row = self.row::<ASK>(joint, k, cells);
                for k in 0..10 {
                    if self.link.wants::<ASK>(k) {
                        let entry = if k < 6 {
                            map.tensor_entry::<ANY>(k, axis.angular)
                        } else {
                            map.moment_entry::<ANY>(k, axis.angular, axis.linear)
                        };
                        self.put::<ASK>(k, row, entry);
                    }
                }
            }
        }
    }

    /// The link's cells in the row of the `k`-th joint on its path.
    #[inline(always)]
    fn row<'r, const WANTED: u16>(
        &self,
        joint: &KernelJoint,
        k: usize,
        cells: &'r mut [T::Cell],
    ) -> &'r mut [T::Cell] {
        let first = self.layout.row(self.j, k, joint.path[k]);
        &mut cells[first..][..self.layout.length::<WANTED>(self.link)]
    }

    #[inline(always)]
    fn put<const WANTED: u16>(&self, k: usize, row: &mut [T::Cell], value: T) {
        self.layout
            .put::<T, WANTED>(self.at, self.link, k, row, value);
    }
}
