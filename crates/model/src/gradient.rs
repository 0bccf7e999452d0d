//! Exact gradients with respect to the states of scalars linear in the torque regressor, in reverse mode.
//!
//! Every criterion of an excitation is a function of `Σ Yᵀ D Y`; its derivative contracts each sample's `dY` with known
//! weights. A twist made of the weights goes out along the chain, wrenches and derivatives come back: about three inverse
//! dynamics for all derivatives of a sample, and no derivative of Y is ever formed.

use crate::adjoint::{JointBar, beyond_bar, frame_bar, wrench_bar};
use crate::axes::Kinematics;
use crate::frame::LinkPose;
use crate::kinematics::{LinkMotion, Screw, Travel, zero_motion, zero_screw};
use crate::lane::{Kernel, Lane, read, zero};
use crate::lane_states::{LaneStates, eight};
use crate::model::Model;
use crate::newton_euler::{link_wrench, splat_ten};
use crate::packing::Rows;
use crate::parameter::{Columns, ParameterKind};
use crate::plan::Plan;
use crate::projection::BLOCKS;
use crate::regressor::{Fill, RegressorBlock};
use crate::states::JointStates;
use crate::wide::{F64x8, over_eight};
use crate::wrench_map::WrenchMap;

/// Gradient of `Σ_t u_t · Y(q_t, q̇_t, q̈_t) v` with respect to every `q`, `q̇`, `q̈`, in the shape of the states.
///
/// `u`: one weight a joint and sample, joint by joint as the states; `v`: one number a column. The Coulomb and offset
/// columns have no derivative.
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub fn torque_contraction_gradient(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    u: &[f64],
    v: &[f64],
) -> JointStates {
    let (n, n_samples) = (model.n_joints(), states.n_samples());
    assert_eq!(u.len(), n * n_samples, "u is not joints × samples");
    let terms = [Term::new(model, columns, v)];
    let mut weights = vec![F64x8::ZERO; n];
    over_lanes(model, states, |first, lanes, work| {
        for j in 0..n {
            weights[j] = eight(&u[j * n_samples..][..n_samples], first);
        }
        over_eight(&mut TorqueContraction {
            model,
            terms: &terms,
            state: lanes.state(),
            work,
            weight: Weight::Given(&weights),
        });
    })
}

/// Gradient of `½ Σ_t Σ_k c_k Σ_j d_j (Y_t v_k)_j²`: of the quadratic form `½ Σ_k c_k v_kᵀ (Σ_t Y_tᵀ D Y_t) v_k`.
///
/// `terms`: pairs `(c_k, v_k)` of a factor and one number a column; `joint_weights`: the diagonal `d` of `D`, one a joint.
/// The derivative of an eigenvalue of the information matrix is twice this with its unit eigenvector.
///
/// # Panics
/// If a shape does not fit the model.
#[track_caller]
pub fn squared_torque_gradient(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    joint_weights: &[f64],
    terms: &[(f64, &[f64])],
) -> JointStates {
    let n = model.n_joints();
    assert_eq!(joint_weights.len(), n, "one weight a joint");
    let factors: Vec<f64> = terms
        .iter()
        .flat_map(|(c, _)| joint_weights.iter().map(move |d| c * d))
        .collect();
    let terms: Vec<Term> = terms
        .iter()
        .map(|(_, v)| Term::new(model, columns, v))
        .collect();
    over_lanes(model, states, |_, lanes, work| {
        over_eight(&mut TorqueContraction {
            model,
            terms: &terms,
            state: lanes.state(),
            work,
            weight: Weight::TimesTorque(&factors),
        });
    })
}

/// Gradient of `Σ_t ⟨G_t, Y_t⟩` with weights `G_t` (`n × p`) that `weigh(Y_t, G_t)` writes from the regressor, eight
/// samples at a time and in order.
///
/// The block of weights keeps what the call before left in it; entries of the links outside a joint's path are not read.
///
/// # Panics
/// If the states or a column do not fit the model.
#[track_caller]
pub fn regressor_contraction_gradient(
    model: &Model,
    columns: &Columns,
    states: &JointStates,
    mut weigh: impl FnMut(&RegressorBlock, &mut RegressorBlock),
) -> JointStates {
    let n = model.n_joints();
    let rows = Rows::new(model, columns);
    let mut y = RegressorBlock::packed(&rows);
    let mut g = RegressorBlock::dense(n, columns.len());
    let mut kinematics = Kinematics::new(model, [F64x8::ZERO, F64x8::ONE]);
    over_lanes(model, states, |first, lanes, work| {
        y.move_to(first, states.n_samples());
        g.move_to(first, states.n_samples());
        Fill::<_, BLOCKS> {
            model,
            rows: rows.all(),
            state: lanes.state(),
            kinematics: &mut kinematics,
            cells: y.entries_mut(),
        }
        .over_eight();
        weigh(&y, &mut g);
        RegressorContraction {
            model,
            plan: &rows.plan,
            state: lanes.state(),
            kinematics: &kinematics,
            weights: g.entries(),
            work,
        }
        .over_eight();
    })
}

/// Runs over the samples eight at a time and collects what `work.out` holds after each.
#[track_caller]
fn over_lanes(
    model: &Model,
    states: &JointStates,
    mut contract: impl FnMut(usize, &LaneStates, &mut Workspace<F64x8>),
) -> JointStates {
    let (n, n_samples) = (model.n_joints(), states.n_samples());
    assert_eq!(
        states.n_joints(),
        n,
        "the states have another number of joints than the model"
    );
    let mut gradient = JointStates::zeros(n, n_samples);
    let mut work = Workspace::new(model, F64x8::ZERO);
    let mut lanes = LaneStates::new(n);
    for first in (0..n_samples).step_by(8) {
        lanes.load(states, first);
        contract(first, &lanes, &mut work);
        let here = first..n_samples.min(first + 8);
        for (j, bar) in work.out.iter().enumerate() {
            gradient.q_mut(j)[here.clone()].copy_from_slice(&bar.q.0[..here.len()]);
            gradient.qd_mut(j)[here.clone()].copy_from_slice(&bar.qd.0[..here.len()]);
            gradient.qdd_mut(j)[here.clone()].copy_from_slice(&bar.qdd.0[..here.len()]);
        }
    }
    gradient
}

/// One number a column, sorted to where the recursion wants it.
struct Term {
    /// Ten a link, in the joint frames.
    inertial: Vec<f64>,
    /// For each joint: rotor inertia, viscous and Coulomb friction, offset.
    drive: Vec<[f64; 4]>,
}

impl Term {
    #[track_caller]
    fn new(model: &Model, columns: &Columns, v: &[f64]) -> Self {
        let n = model.n_joints();
        assert_eq!(v.len(), columns.len(), "v has one number a column");
        let mut term = Self {
            inertial: vec![0.0; 10 * n],
            drive: vec![[0.0; 4]; n],
        };
        for (p, x) in columns.0.iter().zip(v) {
            assert!(
                p.index < n,
                "column {p} names a link the model does not have"
            );
            match p.kind.inertial_index() {
                Some(k) => term.inertial[10 * p.index + k] += x,
                None => term.drive[p.index][drive_position(p.kind)] += x,
            }
        }
        term.inertial = model.kernel_parameters(&term.inertial);
        term
    }

    #[inline(always)]
    fn drive_torque<T: Lane>(&self, joint: usize, qd: T, qdd: T) -> T {
        let [rotor, viscous, coulomb, offset] = self.drive[joint].map(|x| qd.like(x));
        let friction = viscous.mul_add(qd, coulomb.mul_add(qd.sign(), offset));
        rotor.mul_add(qdd, friction)
    }
}

fn drive_position(kind: ParameterKind) -> usize {
    match kind {
        ParameterKind::Ia => 0,
        ParameterKind::Fv => 1,
        ParameterKind::Fc => 2,
        _ => 3,
    }
}

struct Workspace<C> {
    travel: Vec<[C; 2]>,
    /// Motion at each joint, the joint held still; and of each link.
    carried: Vec<LinkMotion<C>>,
    motion: Vec<LinkMotion<C>>,
    /// Derivative with respect to `motion`.
    bar: Vec<LinkMotion<C>>,
    wrench: Vec<Screw<C>>,
    twist: Vec<Screw<C>>,
    out: Vec<JointBar<C>>,
}

impl<C: Copy> Workspace<C> {
    fn new(model: &Model, zero: C) -> Self {
        let n = model.n_joints();
        let out = JointBar {
            q: zero,
            qd: zero,
            qdd: zero,
        };
        Self {
            travel: vec![[zero; 2]; n],
            carried: vec![zero_motion(zero); n],
            motion: vec![zero_motion(zero); n],
            bar: vec![zero_motion(zero); n],
            wrench: vec![zero_screw(zero); n],
            twist: vec![zero_screw(zero); n],
            out: vec![out; n],
        }
    }
}

impl<C> Workspace<C> {
    /// Motions of all links; derivatives start from zero.
    #[inline(always)]
    fn outward<T: Lane<Cell = C>>(&mut self, at: T::At, model: &Model, [q, qd, qdd]: [&[C]; 3]) {
        let base = LinkMotion::<T>::base(at, model);
        // Side by side: sines and cosines wait for nothing but themselves.
        for ((joint, q), travel) in model.joints.iter().zip(q).zip(&mut self.travel) {
            Travel::new(joint, T::read(at, q)).write(at, travel);
        }
        for (j, joint) in model.joints.iter().enumerate() {
            let travel = Travel::read(at, joint.kind, &self.travel[j]);
            let below = match joint.parent {
                Some(p) => LinkMotion::read(at, &self.motion[p]),
                None => base,
            };
            let carried = below.carried(joint, travel);
            let (qd, qdd) = (T::read(at, &qd[j]), T::read(at, &qdd[j]));
            carried.write(at, &mut self.carried[j]);
            carried
                .moved(travel, qd, qdd)
                .write(at, &mut self.motion[j]);
            LinkMotion::<T>::zero(at).write(at, &mut self.bar[j]);
            JointBar::<T>::zero(at).write(at, &mut self.out[j]);
        }
    }

    /// Hands the derivatives of the motions back to the joints.
    #[inline(always)]
    fn inward<T: Lane<Cell = C>>(&mut self, at: T::At, model: &Model, qd: &[C]) {
        for (j, joint) in model.joints.iter().enumerate().rev() {
            let below_w = match joint.parent {
                Some(p) => read(at, &self.motion[p].w),
                None => zero(at),
            };
            let carried = LinkMotion::read(at, &self.carried[j]);
            let at_joint = (T::read(at, &qd[j]), &carried, below_w);
            let travel = Travel::read(at, joint.kind, &self.travel[j]);
            let bar = LinkMotion::read(at, &self.bar[j]);
            let mut out = JointBar::read(at, &self.out[j]);
            let bar = beyond_bar(joint, travel, at_joint, bar, &mut out);
            out.write(at, &mut self.out[j]);
            if let Some(p) = joint.parent {
                self.add_bar(at, p, &bar);
            }
        }
    }

    #[inline(always)]
    fn add_bar<T: Lane<Cell = C>>(&mut self, at: T::At, link: usize, bar: &LinkMotion<T>) {
        let sum = LinkMotion::read(at, &self.bar[link]).plus(bar);
        sum.write(at, &mut self.bar[link]);
    }
}

/// The weights u of a torque: given, or a factor times the torque itself.
enum Weight<'a, C> {
    /// One a joint.
    Given(&'a [C]),
    /// At `term * n + joint`.
    TimesTorque(&'a [f64]),
}

struct TorqueContraction<'a, C> {
    model: &'a Model,
    terms: &'a [Term],
    state: [&'a [C]; 3],
    work: &'a mut Workspace<C>,
    weight: Weight<'a, C>,
}

impl<C> Kernel<C> for TorqueContraction<'_, C> {
    #[inline(always)]
    fn run<T: Lane<Cell = C>>(&mut self, at: T::At) {
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            self.work.outward::<T>(at, self.model, self.state);
            for (t, term) in self.terms.iter().enumerate() {
                self.wrenches::<T>(at, term);
                self.twists::<T>(at, t, term);
            }
            self.work.inward::<T>(at, self.model, self.state[1]);
        }
    }
}

impl<C> TorqueContraction<'_, C> {
    /// Wrench of everything a joint carries, by the parameters v.
    #[inline(always)]
    fn wrenches<T: Lane<Cell = C>>(&mut self, at: T::At, term: &Term) {
        let (work, joints) = (&mut *self.work, &self.model.joints);
        for j in 0..joints.len() {
            let motion = LinkMotion::<T>::read(at, &work.motion[j]);
            let ten = splat_ten(at, &term.inertial[10 * j..]);
            link_wrench(&motion, &ten).write(at, &mut work.wrench[j]);
        }
        for (j, joint) in joints.iter().enumerate().rev() {
            if let Some(p) = joint.parent {
                let travel = Travel::read(at, joint.kind, &work.travel[j]);
                let passed = Screw::<T>::read(at, &work.wrench[j]).wrench_below(joint, travel);
                let sum = Screw::read(at, &work.wrench[p]).plus(&passed);
                sum.write(at, &mut work.wrench[p]);
            }
        }
    }

    /// Twist of every link if the joints had the speeds u, and what the derivatives have of it.
    #[inline(always)]
    fn twists<T: Lane<Cell = C>>(&mut self, at: T::At, t: usize, term: &Term) {
        let (work, joints) = (&mut *self.work, &self.model.joints);
        let [_, qd, qdd] = self.state;
        for (j, joint) in joints.iter().enumerate() {
            let wrench = Screw::<T>::read(at, &work.wrench[j]);
            let u = match self.weight {
                Weight::Given(u) => T::read(at, &u[j]),
                Weight::TimesTorque(factor) => {
                    let (qd, qdd) = (T::read(at, &qd[j]), T::read(at, &qdd[j]));
                    let torque = wrench.along_axis(joint.kind) + term.drive_torque(j, qd, qdd);
                    torque * T::splat(at, factor[t * joints.len() + j])
                }
            };
            let below = match joint.parent {
                Some(p) => {
                    let travel = Travel::read(at, joint.kind, &work.travel[j]);
                    Screw::read(at, &work.twist[p]).beyond(joint, travel)
                }
                None => Screw::zero(at),
            };
            let twist = below.plus_axis(joint.kind, u);
            let mut out = JointBar::<T>::read(at, &work.out[j]);
            out.q = out.q - twist.cross_wrench(&wrench).along_axis(joint.kind);
            out.qd = u.like(term.drive[j][1]).mul_add(u, out.qd);
            out.qdd = u.like(term.drive[j][0]).mul_add(u, out.qdd);
            out.write(at, &mut work.out[j]);
            let ten = splat_ten(at, &term.inertial[10 * j..]);
            let motion = LinkMotion::read(at, &work.motion[j]);
            work.add_bar(at, j, &wrench_bar(&motion, &twist, &ten));
            twist.write(at, &mut work.twist[j]);
        }
    }
}

/// `kinematics` as `fill` left it; `weights`: rows of all columns.
struct RegressorContraction<'a, C> {
    model: &'a Model,
    plan: &'a Plan,
    state: [&'a [C]; 3],
    kinematics: &'a Kinematics<C>,
    weights: &'a [C],
    work: &'a mut Workspace<C>,
}

impl RegressorContraction<'_, F64x8> {
    /// Compiled here once, as [`Fill::over_eight`] is.
    #[inline(never)]
    fn over_eight(mut self) {
        over_eight(&mut self);
    }
}

impl<C: Copy> Kernel<C> for RegressorContraction<'_, C> {
    #[inline(always)]
    fn run<T: Lane<Cell = C>>(&mut self, at: T::At) {
        for part in 0..T::PARTS {
            let at = T::part(at, part);
            self.work.outward::<T>(at, self.model, self.state);
            for j in 0..self.model.n_joints() {
                self.link::<T>(at, j);
                self.drives::<T>(at, j);
            }
            self.work.inward::<T>(at, self.model, self.state[1]);
        }
    }
}

impl<C: Copy> RegressorContraction<'_, C> {
    /// Derivatives by way of the wrench of link `j`, in the frame its parameters are given in.
    #[inline(always)]
    fn link<T: Lane<Cell = C>>(&mut self, at: T::At, j: usize) {
        let (joint, plan) = (&self.model.joints[j], &self.plan.links[j]);
        if plan.is_empty() {
            return;
        }
        let own_motion = LinkMotion::<T>::read(at, &self.work.motion[j]);
        let motion = match &joint.link {
            LinkPose::Along(_) => own_motion,
            LinkPose::Posed {
                rotation,
                translation,
                ..
            } => WrenchMap::new(&own_motion).motion_at(&own_motion, rotation, *translation),
        };
        let mut bar = LinkMotion::zero(at);
        let mut below = Screw::zero(at);
        for d in &joint.directions {
            for k in d.range.clone() {
                let i = joint.path[k];
                let ten = self.weights_of(at, j, i);
                let axis = self.kinematics.links[j].axis::<T>(at, d, k);
                let axis = match &joint.link {
                    LinkPose::Along(_) => axis,
                    LinkPose::Posed {
                        rotation,
                        translation,
                        ..
                    } => axis.at(rotation, *translation),
                };
                // A turn of joint i moves the axes below it as this link sees them.
                let out = &mut self.work.out[i].q;
                let q = T::read(at, out) - axis.power(&below);
                q.write(at, out);
                below = below.plus(&axis.cross_wrench(&link_wrench(&motion, &ten)));
                bar = bar.plus(&wrench_bar(&motion, &axis, &ten));
            }
        }
        if let LinkPose::Posed {
            rotation,
            translation,
            ..
        } = &joint.link
        {
            bar = frame_bar(&own_motion, bar, rotation, *translation);
        }
        self.work.add_bar(at, j, &bar);
    }

    #[inline(always)]
    fn drives<T: Lane<Cell = C>>(&mut self, at: T::At, j: usize) {
        for &(kind, column) in &self.plan.drives[j] {
            let weight = T::read(at, &self.weights[j * self.plan.n_columns + column]);
            let sum = match kind {
                ParameterKind::Ia => &mut self.work.out[j].qdd,
                ParameterKind::Fv => &mut self.work.out[j].qd,
                _ => continue,
            };
            (T::read(at, sum) + weight).write(at, sum);
        }
    }

    /// The weights of row `i` in the columns of link `j`, as ten parameters.
    #[inline(always)]
    fn weights_of<T: Lane<Cell = C>>(&self, at: T::At, j: usize, i: usize) -> [T; 10] {
        let row = &self.weights[i * self.plan.n_columns..][..self.plan.n_columns];
        let mut ten = [T::splat(at, 0.0); 10];
        let plan = &self.plan.links[j];
        for k in 0..10 {
            ten[k] = plan.get(at, k, row);
            for twin in &self.plan.twins {
                if (twin.link, twin.entry) == (j, k) {
                    let more = T::read(at, &row[twin.column]);
                    ten[k] = ten[k] + if twin.negated { -more } else { more };
                }
            }
        }
        ten
    }
}
