//! The regressor's rows by projection of the joint axes.
//!
//! Entry (joint i, link j) is the axis of joint i, seen from link j (six numbers), times the 6 × 10 map of that link's
//! parameters to its wrench. Only axes travel along the chain. Parallel axes share their direction, and with it the six
//! entries of the inertia tensor; the link's own axis is z, and the one before it most often has no part along z.

use crate::frame::{LinkPose, Rotation, shift};
use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{Lane, V3, minus, splat, times, zero};
use crate::model::{Direction, KernelJoint, Model};
use crate::parameter::{Columns, ParameterKind};
use crate::robot::JointKind;
use crate::wrench_map::{ABOUT_Z, ACROSS, ANY, WrenchMap};

/// Which entry of which link goes to which column, found once.
#[derive(Debug, Clone)]
pub(crate) struct Plan {
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
    first: usize,
}

/// Columns of a link, by the place of the entry among the ten.
#[derive(Debug, Clone, Default)]
pub(crate) struct LinkPlan {
    /// Bit k: entry k is asked for.
    wanted: u16,
    /// Bit k: its column is the entry's negative.
    negated: u16,
    column: [usize; 10],
}

/// All ten entries of a link.
const ALL: u16 = 0b11_1111_1111;
/// What the base columns of a link in the middle of an arm most often are: no mass, no moment along the axis, and of
/// the tensor's entries across the axis only one.
const BASE_XX: u16 = 0b00_1111_0111;
/// The same with the other entry.
const BASE_YY: u16 = 0b00_1111_1110;
/// Any set: look it up.
const ASK: u16 = 0;

impl LinkPlan {
    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.wanted == 0
    }

    /// Whether entry `k` is asked for; `WANTED` answers at compile time unless it is [`ASK`].
    #[inline(always)]
    fn wants<const WANTED: u16>(&self, k: usize) -> bool {
        let wanted = if WANTED == ASK { self.wanted } else { WANTED };
        wanted >> k & 1 == 1
    }

    /// Writes entry `k`, which is asked for, to its column of a row.
    #[inline(always)]
    fn put<T: Lane>(&self, k: usize, row: &mut [T], value: T) {
        row[self.column[k]] = if self.negated >> k & 1 == 1 {
            -value
        } else {
            value
        };
    }

    /// Entry `k` from its column of a row, zero where it was not asked for.
    #[inline(always)]
    pub(crate) fn get<T: Lane>(&self, k: usize, row: &[T]) -> T {
        match (self.wants::<ASK>(k), self.negated >> k & 1 == 1) {
            (false, _) => T::splat(0.0),
            (true, false) => row[self.column[k]],
            (true, true) => -row[self.column[k]],
        }
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
            link.negated |= u16::from(sign < 0.0) << entry;
            link.column[entry] = column;
        }
        plan
    }
}

/// Motions and axes of one sample or eight.
#[derive(Debug, Clone)]
pub(crate) struct Kinematics<T> {
    n: usize,
    /// Motion of every link; before its turn has come, of the link below at this joint's origin.
    motion: Vec<LinkMotion<T>>,
    /// At `link * n + d`: direction `d` of the link's path; the last one is z and stays.
    direction: Vec<V3<T>>,
    /// At `link * n + joint`: speed of the link's origin per unit speed of a revolute joint; zero for the link's own.
    linear: Vec<V3<T>>,
}

impl<T: Lane> Kinematics<T> {
    pub(crate) fn new(model: &Model) -> Self {
        let n = model.n_joints();
        Self {
            n,
            motion: vec![LinkMotion::zero(); n],
            direction: vec![z_axis(); n * n],
            linear: vec![zero(); n * n],
        }
    }

    /// Axis of joint `i`, of direction `d`, at the frame of link `j`.
    #[inline(always)]
    pub(crate) fn axis(&self, j: usize, d: &Direction, i: usize) -> Screw<T> {
        let direction = self.direction[j * self.n + d.index];
        match d.kind {
            JointKind::Revolute => Screw {
                angular: direction,
                linear: self.linear[j * self.n + i],
            },
            JointKind::Prismatic => Screw {
                angular: zero(),
                linear: direction,
            },
        }
    }

    /// Takes link `j` from the link below: its motion and the axes on its path.
    #[inline(always)]
    fn go_out(&mut self, model: &Model, j: usize, [q, qd, qdd]: [T; 3]) -> WrenchMap<T> {
        // The same lines for every step, compiled once for each simple one.
        match (
            model.joints[j].step.rotation,
            Travel::new(&model.joints[j], q),
        ) {
            (Rotation::Quarter, Travel::Turn { s, c }) => {
                let step = (Rotation::Quarter, Travel::Turn { s, c });
                self.carry_axes(model, j, step);
                self.move_link(model, j, step, qd, qdd)
            }
            (Rotation::None, Travel::Turn { s, c }) => {
                let step = (Rotation::None, Travel::Turn { s, c });
                self.carry_axes(model, j, step);
                self.move_link(model, j, step, qd, qdd)
            }
            step => {
                self.carry_axes(model, j, step);
                self.move_link(model, j, step, qd, qdd)
            }
        }
    }

    /// Motion of link `j` about its joint's frame, and what it does at the joints the link carries.
    #[inline(always)]
    fn move_link(
        &mut self,
        model: &Model,
        j: usize,
        step: (Rotation, Travel<T>),
        qd: T,
        qdd: T,
    ) -> WrenchMap<T> {
        let joint = &model.joints[j];
        let below = &self.motion[j];
        let carried = match joint.parent {
            None => {
                let up = joint.step.rotation.inward(minus(model.gravity));
                let vertical = up[0] == 0.0 && up[1] == 0.0;
                let a = splat(up);
                LinkMotion {
                    w: zero(),
                    wd: zero(),
                    a: if vertical { a } else { step.1.inward(a) },
                }
            }
            Some(p) if model.joints[p].planar => {
                let z = z_beyond(step);
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
            self.motion[c] = LinkMotion {
                a: map.acceleration_at(model.joints[c].step.translation),
                ..motion
            };
        }
        map
    }

    /// Carries the axes of the link below out to link `j`.
    #[inline(always)]
    fn carry_axes(&mut self, model: &Model, j: usize, step: (Rotation, Travel<T>)) {
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
            let outside = directions[d.index];
            let direction = match (stays, own_of_below) {
                (true, _) => z_axis(),
                (false, true) => z_beyond(step),
                (false, false) => into_joint(step, outside),
            };
            if !stays {
                out[d.index] = direction;
            }
            if d.kind == JointKind::Prismatic {
                continue;
            }
            for &i in &joint.path[d.range.clone()] {
                let shifted = if own_of_below {
                    shift_about_z(p_from, linears[i])
                } else {
                    shift(p_from, linears[i], outside)
                };
                let mut linear = into_joint(step, shifted);
                if let Travel::Slide { d } = step.1 {
                    linear[0] = direction[1].mul_add(d, linear[0]);
                    linear[1] = (-direction[0]).mul_add(d, linear[1]);
                }
                out_linear[i] = linear;
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
fn z_axis<T: Lane>() -> V3<T> {
    [T::splat(0.0), T::splat(0.0), T::splat(1.0)]
}

/// The axis of the joint below in the frame of a joint.
#[inline(always)]
fn z_beyond<T: Lane>(step: (Rotation, Travel<T>)) -> V3<T> {
    match step {
        (Rotation::Quarter, Travel::Turn { s, c }) => [s, c, T::splat(0.0)],
        _ => into_joint(step, z_axis()),
    }
}

/// `z × p + v`.
#[inline(always)]
fn shift_about_z<T: Lane>(p: [f64; 3], v: V3<T>) -> V3<T> {
    [v[0] - T::splat(p[1]), v[1] + T::splat(p[0]), v[2]]
}

/// Writes the entries that can be other than zero; `rows` is `n × p`, joint by joint, zero where nothing was written yet.
#[inline(always)]
pub(crate) fn fill<T: Lane>(
    model: &Model,
    plan: &Plan,
    [q, qd, qdd]: [&[T]; 3],
    kinematics: &mut Kinematics<T>,
    rows: &mut [T],
) {
    let p = plan.n_columns;
    for (j, joint) in model.joints.iter().enumerate() {
        let map = kinematics.go_out(model, j, [q[j], qd[j], qdd[j]]);
        let link = &plan.links[j];
        if !link.is_empty() {
            project(joint, j, &map, kinematics, link, p, rows);
        }
        for &(kind, column) in &plan.drives[j] {
            rows[j * p + column] = match kind {
                ParameterKind::Ia => qdd[j],
                ParameterKind::Fv => qd[j],
                ParameterKind::Fc => qd[j].sign(),
                _ => T::splat(1.0),
            };
        }
    }
    for twin in &plan.twins {
        for &i in &model.joints[twin.link].path {
            rows[i * p + twin.column] = rows[i * p + twin.first];
        }
    }
}

/// The rows' entries for the columns of a link.
#[inline(always)]
fn project<T: Lane>(
    joint: &KernelJoint,
    j: usize,
    map: &WrenchMap<T>,
    kinematics: &Kinematics<T>,
    link: &LinkPlan,
    p: usize,
    rows: &mut [T],
) {
    let at = (j, link, p);
    match (&joint.link, link.wanted) {
        (
            LinkPose::Posed {
                rotation,
                translation,
                ..
            },
            _,
        ) => {
            project_posed(joint, at, map, (rotation, *translation), kinematics, rows);
        }
        (_, BASE_XX) => project_along::<T, BASE_XX>(joint, at, map, kinematics, rows),
        (_, BASE_YY) => project_along::<T, BASE_YY>(joint, at, map, kinematics, rows),
        (_, ALL) => project_along::<T, ALL>(joint, at, map, kinematics, rows),
        _ => project_along::<T, ASK>(joint, at, map, kinematics, rows),
    }
}

/// Rows of a link whose axes are along those of its joint's frame.
#[inline(always)]
fn project_along<T: Lane, const WANTED: u16>(
    joint: &KernelJoint,
    (j, link, p): (usize, &LinkPlan, usize),
    map: &WrenchMap<T>,
    kinematics: &Kinematics<T>,
    rows: &mut [T],
) {
    let n = kinematics.n;
    let linear = &kinematics.linear[j * n..][..n];
    let direction = &kinematics.direction[j * n..][..n];
    for d in &joint.directions {
        let v = direction[d.index];
        let joints = &joint.path[d.range.clone()];
        let own = d.index + 1 == joint.directions.len();
        match (d.kind, own, d.across) {
            (JointKind::Prismatic, _, _) => {
                let row = &mut rows[joints[0] * p..][..p];
                for k in 6..10 {
                    if link.wants::<WANTED>(k) {
                        link.put(k, row, map.force_entry(k, v));
                    }
                }
            }
            (_, true, _) => {
                let below = &joints[..joints.len() - 1];
                project_direction::<T, ABOUT_Z, WANTED>(below, v, linear, map, (link, p), rows);
                let row = &mut rows[j * p..][..p];
                for k in 0..8 {
                    if link.wants::<WANTED>(k) {
                        let entry = if k < 6 {
                            map.tensor_entry::<ABOUT_Z>(k, v)
                        } else {
                            map.own_moment_entry(k)
                        };
                        link.put(k, row, entry);
                    }
                }
            }
            (_, _, true) => {
                project_direction::<T, ACROSS, WANTED>(joints, v, linear, map, (link, p), rows);
            }
            _ => project_direction::<T, ANY, WANTED>(joints, v, linear, map, (link, p), rows),
        }
    }
}

/// Rows of parallel revolute joints: what the tensor's columns say is the same in all of them.
#[inline(always)]
fn project_direction<T: Lane, const FORM: u8, const WANTED: u16>(
    joints: &[usize],
    v: V3<T>,
    linear: &[V3<T>],
    map: &WrenchMap<T>,
    (link, p): (&LinkPlan, usize),
    rows: &mut [T],
) {
    let mut tensor = [T::splat(0.0); 6];
    for k in 0..6 {
        if link.wants::<WANTED>(k) {
            tensor[k] = map.tensor_entry::<FORM>(k, v);
        }
    }
    for &i in joints {
        let row = &mut rows[i * p..][..p];
        let f = linear[i];
        for k in 0..10 {
            if link.wants::<WANTED>(k) {
                let entry = if k < 6 {
                    tensor[k]
                } else {
                    map.moment_entry::<FORM>(k, v, f)
                };
                link.put(k, row, entry);
            }
        }
    }
}

/// Rows of a link whose frame stands apart from its joint's.
#[inline(always)]
fn project_posed<T: Lane>(
    joint: &KernelJoint,
    (j, link, p): (usize, &LinkPlan, usize),
    map: &WrenchMap<T>,
    (rotation, translation): (&[[f64; 3]; 3], [f64; 3]),
    kinematics: &Kinematics<T>,
    rows: &mut [T],
) {
    let map = WrenchMap::new(&map.motion_at(rotation, translation));
    for d in &joint.directions {
        for &i in &joint.path[d.range.clone()] {
            let axis = kinematics.axis(j, d, i).at(rotation, translation);
            let row = &mut rows[i * p..][..p];
            for k in 0..10 {
                if link.wants::<ASK>(k) {
                    let entry = if k < 6 {
                        map.tensor_entry::<ANY>(k, axis.angular)
                    } else {
                        map.moment_entry::<ANY>(k, axis.angular, axis.linear)
                    };
                    link.put(k, row, entry);
                }
            }
        }
    }
}
