//! Exact gradients with respect to the states of scalars linear in the torque regressor, in reverse mode.
//!
//! Every criterion of an excitation is a function of `Σ Yᵀ D Y`; its derivative contracts each sample's `dY` with known
//! weights. A twist made of the weights goes out along the chain, wrenches and derivatives come back: about three inverse
//! dynamics for all derivatives of a sample, and no derivative of Y is ever formed.

use crate::adjoint::{JointBar, beyond_bar, frame_bar, wrench_bar};
use crate::frame::LinkPose;
use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{F64x8, Lane, dispatch, zero};
use crate::model::Model;
use crate::newton_euler::{link_wrench, splat_ten};
use crate::parameter::{Columns, ParameterKind};
use crate::projection::{Kinematics, Plan};
use crate::regressor::{Fill, RegressorBlock};
use crate::states::{JointStates, LaneStates, eight};
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
    let mut weights = vec![F64x8::splat(0.0); n];
    over_lanes(model, states, |first, lanes, work| {
        for j in 0..n {
            weights[j] = eight(&u[j * n_samples..][..n_samples], first);
        }
        dispatch(TorqueContraction {
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
        dispatch(TorqueContraction {
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
    let plan = Plan::new(model, columns);
    let mut y = RegressorBlock::new(n, columns.len());
    let mut g = y.clone();
    let mut kinematics = Kinematics::new(model);
    over_lanes(model, states, |first, lanes, work| {
        y.move_to(first, states.n_samples());
        g.move_to(first, states.n_samples());
        let fill = Fill {
            model,
            plan: &plan,
            state: lanes.state(),
            kinematics: &mut kinematics,
            rows: y.entries_mut(),
        };
        fill.run();
        weigh(&y, &mut g);
        let contraction = RegressorContraction {
            model,
            plan: &plan,
            state: lanes.state(),
            kinematics: &kinematics,
            weights: g.entries(),
            work,
        };
        contraction.run();
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
    let mut work = Workspace::new(model);
    let mut lanes = LaneStates::new(n);
    for first in (0..n_samples).step_by(8) {
        lanes.load(states, first);
        contract(first, &lanes, &mut work);
        let here = first..n_samples.min(first + 8);
        let count = here.len();
        for (j, bar) in work.out.iter().enumerate() {
            gradient.q_mut(j)[here.clone()].copy_from_slice(&bar.q.as_array()[..count]);
            gradient.qd_mut(j)[here.clone()].copy_from_slice(&bar.qd.as_array()[..count]);
            gradient.qdd_mut(j)[here.clone()].copy_from_slice(&bar.qdd.as_array()[..count]);
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
        let [rotor, viscous, coulomb, offset] = self.drive[joint];
        let (rotor, viscous) = (T::splat(rotor), T::splat(viscous));
        let (coulomb, offset) = (T::splat(coulomb), T::splat(offset));
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

struct Workspace<T> {
    travel: Vec<Travel<T>>,
    /// Motion at each joint, the joint held still; and of each link.
    carried: Vec<LinkMotion<T>>,
    motion: Vec<LinkMotion<T>>,
    /// Derivative with respect to `motion`.
    bar: Vec<LinkMotion<T>>,
    wrench: Vec<Screw<T>>,
    twist: Vec<Screw<T>>,
    out: Vec<JointBar<T>>,
}

impl<T: Lane> Workspace<T> {
    fn new(model: &Model) -> Self {
        let n = model.n_joints();
        Self {
            travel: vec![Travel::Slide { d: T::splat(0.0) }; n],
            carried: vec![LinkMotion::zero(); n],
            motion: vec![LinkMotion::zero(); n],
            bar: vec![LinkMotion::zero(); n],
            wrench: vec![Screw::zero(); n],
            twist: vec![Screw::zero(); n],
            out: vec![JointBar::zero(); n],
        }
    }

    /// Motions of all links; derivatives start from zero.
    #[inline(always)]
    fn outward(&mut self, model: &Model, [q, qd, qdd]: [&[T]; 3]) {
        let base = LinkMotion::base(model);
        for (j, joint) in model.joints.iter().enumerate() {
            let travel = Travel::new(joint, q[j]);
            let below = match joint.parent {
                Some(p) => self.motion[p],
                None => base,
            };
            self.travel[j] = travel;
            self.carried[j] = below.carried(joint, travel);
            self.motion[j] = self.carried[j].moved(travel, qd[j], qdd[j]);
            self.bar[j] = LinkMotion::zero();
            self.out[j] = JointBar::zero();
        }
    }

    /// Hands the derivatives of the motions back to the joints.
    #[inline(always)]
    fn inward(&mut self, model: &Model, qd: &[T]) {
        for (j, joint) in model.joints.iter().enumerate().rev() {
            let below_w = match joint.parent {
                Some(p) => self.motion[p].w,
                None => zero(),
            };
            let at_joint = (qd[j], &self.carried[j], below_w);
            let bar = beyond_bar(
                joint,
                self.travel[j],
                at_joint,
                self.bar[j],
                &mut self.out[j],
            );
            if let Some(p) = joint.parent {
                self.bar[p] = self.bar[p].plus(&bar);
            }
        }
    }
}

/// The weights u of a torque: given, or a factor times the torque itself.
enum Weight<'a, T> {
    /// One a joint.
    Given(&'a [T]),
    /// At `term * n + joint`.
    TimesTorque(&'a [f64]),
}

struct TorqueContraction<'a, T> {
    model: &'a Model,
    terms: &'a [Term],
    state: [&'a [T]; 3],
    work: &'a mut Workspace<T>,
    weight: Weight<'a, T>,
}

impl<T: Lane> pulp::WithSimd for TorqueContraction<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (work, joints) = (self.work, &self.model.joints);
        let n = joints.len();
        let [_, qd, qdd] = self.state;
        work.outward(self.model, self.state);
        for (t, term) in self.terms.iter().enumerate() {
            // Wrench of everything a joint carries, by the parameters v.
            for j in 0..n {
                work.wrench[j] = link_wrench(&work.motion[j], &splat_ten(&term.inertial[10 * j..]));
            }
            for (j, joint) in joints.iter().enumerate().rev() {
                if let Some(p) = joint.parent {
                    let passed = work.wrench[j].wrench_below(joint, work.travel[j]);
                    work.wrench[p] = work.wrench[p].plus(&passed);
                }
            }
            // Twist of every link if the joints had the speeds u.
            for (j, joint) in joints.iter().enumerate() {
                let u = match self.weight {
                    Weight::Given(u) => u[j],
                    Weight::TimesTorque(factor) => {
                        let inertial = work.wrench[j].along_axis(joint.kind);
                        let torque = inertial + term.drive_torque(j, qd[j], qdd[j]);
                        torque * T::splat(factor[t * n + j])
                    }
                };
                let below = match joint.parent {
                    Some(p) => work.twist[p].beyond(joint, work.travel[j]),
                    None => Screw::zero(),
                };
                let twist = below.plus_axis(joint.kind, u);
                let out = &mut work.out[j];
                out.q = out.q - twist.cross_wrench(&work.wrench[j]).along_axis(joint.kind);
                out.qd = T::splat(term.drive[j][1]).mul_add(u, out.qd);
                out.qdd = T::splat(term.drive[j][0]).mul_add(u, out.qdd);
                let ten = splat_ten(&term.inertial[10 * j..]);
                let own = wrench_bar(&work.motion[j], &twist, &ten);
                work.bar[j] = work.bar[j].plus(&own);
                work.twist[j] = twist;
            }
        }
        work.inward(self.model, qd);
    }
}

/// `kinematics` as `fill` left it; `weights` as it lays out the rows.
struct RegressorContraction<'a, T> {
    model: &'a Model,
    plan: &'a Plan,
    state: [&'a [T]; 3],
    kinematics: &'a Kinematics<T>,
    weights: &'a [T],
    work: &'a mut Workspace<T>,
}

impl RegressorContraction<'_, F64x8> {
    /// Compiled here once, as [`Fill::run`] is.
    #[inline(never)]
    fn run(self) {
        dispatch(self);
    }
}

impl<T: Lane> pulp::WithSimd for RegressorContraction<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) {
        self.work.outward(self.model, self.state);
        for j in 0..self.model.n_joints() {
            self.link(j);
            for &(kind, column) in &self.plan.drives[j] {
                let weight = self.weights[j * self.plan.n_columns + column];
                let out = &mut self.work.out[j];
                match kind {
                    ParameterKind::Ia => out.qdd = out.qdd + weight,
                    ParameterKind::Fv => out.qd = out.qd + weight,
                    _ => {}
                }
            }
        }
        self.work.inward(self.model, self.state[1]);
    }
}

impl<T: Lane> RegressorContraction<'_, T> {
    /// Derivatives by way of the wrench of link `j`, in the frame its parameters are given in.
    #[inline(always)]
    fn link(&mut self, j: usize) {
        let (joint, plan) = (&self.model.joints[j], &self.plan.links[j]);
        if plan.is_empty() {
            return;
        }
        let motion = match &joint.link {
            LinkPose::Along(_) => self.work.motion[j],
            LinkPose::Posed {
                rotation,
                translation,
                ..
            } => WrenchMap::new(&self.work.motion[j]).motion_at(rotation, *translation),
        };
        let mut bar = LinkMotion::zero();
        let mut below: Screw<T> = Screw::zero();
        for d in &joint.directions {
            for &i in &joint.path[d.range.clone()] {
                let ten = self.weights_of(j, i);
                let axis = self.kinematics.axis(j, d, i);
                let axis = match &joint.link {
                    LinkPose::Along(_) => axis,
                    LinkPose::Posed {
                        rotation,
                        translation,
                        ..
                    } => axis.at(rotation, *translation),
                };
                // A turn of joint i moves the axes below it as this link sees them.
                let out = &mut self.work.out[i];
                out.q = out.q - axis.power(&below);
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
            bar = frame_bar(&self.work.motion[j], bar, rotation, *translation);
        }
        self.work.bar[j] = self.work.bar[j].plus(&bar);
    }

    /// The weights of row `i` in the columns of link `j`, as ten parameters.
    #[inline(always)]
    fn weights_of(&self, j: usize, i: usize) -> [T; 10] {
        let row = &self.weights[i * self.plan.n_columns..][..self.plan.n_columns];
        let mut ten = [T::splat(0.0); 10];
        let plan = &self.plan.links[j];
        for k in 0..10 {
            ten[k] = plan.get(k, row);
            for twin in &self.plan.twins {
                if (twin.link, twin.entry) == (j, k) {
                    let more = row[twin.column];
                    ten[k] = ten[k] + if twin.negated { -more } else { more };
                }
            }
        }
        ten
    }
}
