//! Newton-Euler inverse dynamics.

use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{F64x8, Lane, V3, add, cross, dot, zero};
use crate::model::Model;
use crate::states::{JointState, JointStates};

/// Joint torques of a motion, N·m (N for a prismatic joint).
///
/// `parameters`: the `10 n` standard parameters, link by link (`XX XY XZ YY YZ ZZ MX MY MZ M`), physical or not: the
/// torque is linear in them. Motor side effects (friction, rotor) are columns of the regressor, not of this function.
/// Source: Luh, Walker & Paul 1980, about the link frames' origins.
///
/// # Panics
/// If `parameters` or the state do not fit the model.
#[track_caller]
pub fn inverse_dynamics(model: &Model, parameters: &[f64], state: &JointState) -> Vec<f64> {
    assert_parameters(model, parameters);
    assert_eq!(
        state.q.len(),
        model.n_joints(),
        "the state has another number of joints than the model"
    );
    let mut work = Workspace::new(model);
    let mut torque = vec![0.0; model.n_joints()];
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            recursion(
                model,
                parameters,
                &state.q,
                &state.qd,
                &state.qdd,
                &mut work,
                &mut torque,
            );
        },
    );
    torque
}

/// [`inverse_dynamics`] of many states: torque of joint `j` at sample `k` stands at `j * n_samples + k`.
///
/// # Panics
/// If `parameters` or the states do not fit the model.
#[track_caller]
pub fn inverse_dynamics_batch(model: &Model, parameters: &[f64], states: &JointStates) -> Vec<f64> {
    assert_parameters(model, parameters);
    let (n, n_samples) = (model.n_joints(), states.n_samples());
    assert_eq!(
        states.n_joints(),
        n,
        "the states have another number of joints than the model"
    );
    let mut torque = vec![0.0; n * n_samples];
    let mut work = Workspace::new(model);
    let mut lanes = LaneStates::new(n);
    let mut out = vec![F64x8::ZERO; n];
    for first in (0..n_samples).step_by(8) {
        lanes.load(states, first);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                recursion(
                    model, parameters, &lanes.q, &lanes.qd, &lanes.qdd, &mut work, &mut out,
                );
            },
        );
        let count = (n_samples - first).min(8);
        for j in 0..n {
            torque[j * n_samples + first..][..count].copy_from_slice(&out[j].0[..count]);
        }
    }
    torque
}

#[track_caller]
fn assert_parameters(model: &Model, parameters: &[f64]) {
    assert_eq!(
        parameters.len(),
        10 * model.n_joints(),
        "standard parameters are ten for each link"
    );
}

/// Eight samples of every joint, the last sample repeated where there are fewer.
pub(crate) struct LaneStates {
    pub(crate) q: Vec<F64x8>,
    pub(crate) qd: Vec<F64x8>,
    pub(crate) qdd: Vec<F64x8>,
}

impl LaneStates {
    pub(crate) fn new(n_joints: usize) -> Self {
        let zeros = vec![F64x8::ZERO; n_joints];
        Self {
            q: zeros.clone(),
            qd: zeros.clone(),
            qdd: zeros,
        }
    }

    pub(crate) fn load(&mut self, states: &JointStates, first: usize) {
        for j in 0..states.n_joints() {
            self.q[j] = eight(states.q(j), first);
            self.qd[j] = eight(states.qd(j), first);
            self.qdd[j] = eight(states.qdd(j), first);
        }
    }
}

pub(crate) fn eight(x: &[f64], first: usize) -> F64x8 {
    if let Some(full) = x[first..].first_chunk::<8>() {
        return F64x8(*full);
    }
    F64x8(std::array::from_fn(|k| x[(first + k).min(x.len() - 1)]))
}

struct Workspace<T> {
    motion: Vec<LinkMotion<T>>,
    travel: Vec<Travel<T>>,
    wrench: Vec<Screw<T>>,
}

impl<T: Lane> Workspace<T> {
    fn new(model: &Model) -> Self {
        let n = model.n_joints();
        let rest = Screw {
            angular: zero(),
            linear: zero(),
        };
        Self {
            motion: vec![LinkMotion::base(model); n],
            travel: vec![Travel::Slide { d: T::splat(0.0) }; n],
            wrench: vec![rest; n],
        }
    }
}

#[inline(always)]
fn recursion<T: Lane>(
    model: &Model,
    parameters: &[f64],
    q: &[T],
    qd: &[T],
    qdd: &[T],
    work: &mut Workspace<T>,
    torque: &mut [T],
) {
    let n = model.n_joints();
    let base = LinkMotion::base(model);
    for (j, joint) in model.joints.iter().enumerate() {
        let travel = Travel::new(joint.kind, q[j]);
        let below = joint.parent.map_or(base, |p| work.motion[p]);
        let motion = below.beyond(joint, travel, qd[j], qdd[j]);
        work.wrench[j] = link_wrench(&motion, &splat_ten(&parameters[10 * j..]));
        work.motion[j] = motion;
        work.travel[j] = travel;
    }
    for j in (0..n).rev() {
        let joint = &model.joints[j];
        let axis = Screw::axis(joint);
        let wrench = work.wrench[j];
        torque[j] = dot(axis.angular, wrench.angular) + dot(axis.linear, wrench.linear);
        if let Some(p) = joint.parent {
            let passed = wrench.wrench_below(joint, work.travel[j]);
            let sum = &mut work.wrench[p];
            sum.angular = add(sum.angular, passed.angular);
            sum.linear = add(sum.linear, passed.linear);
        }
    }
}

/// The ten parameters of a link in every lane.
#[inline(always)]
pub(crate) fn splat_ten<T: Lane>(parameters: &[f64]) -> [T; 10] {
    std::array::from_fn(|k| T::splat(parameters[k]))
}

/// Newton and Euler about the frame's origin: `n = I ω̇ + ω × I ω + h × a`, `f = m a + ω̇ × h + ω × (ω × h)`.
#[inline(always)]
pub(crate) fn link_wrench<T: Lane>(m: &LinkMotion<T>, p: &[T; 10]) -> Screw<T> {
    let tensor = |v: V3<T>| -> V3<T> {
        [
            dot([p[0], p[1], p[2]], v),
            dot([p[1], p[3], p[4]], v),
            dot([p[2], p[4], p[5]], v),
        ]
    };
    let h = [p[6], p[7], p[8]];
    let moment = add(tensor(m.wd), add(cross(m.w, tensor(m.w)), cross(h, m.a)));
    let turning = add(cross(m.wd, h), cross(m.w, cross(m.w, h)));
    let force = std::array::from_fn(|k| p[9].mul_add(m.a[k], turning[k]));
    Screw {
        angular: moment,
        linear: force,
    }
}

/// The recursion for any lane: dual numbers of the tests.
#[cfg(test)]
pub(crate) fn torque_of<T: Lane>(
    model: &Model,
    parameters: &[f64],
    q: &[T],
    qd: &[T],
    qdd: &[T],
) -> Vec<T> {
    let mut torque = vec![T::splat(0.0); model.n_joints()];
    recursion(
        model,
        parameters,
        q,
        qd,
        qdd,
        &mut Workspace::new(model),
        &mut torque,
    );
    torque
}
