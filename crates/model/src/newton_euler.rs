//! Newton-Euler inverse dynamics.

use crate::kinematics::{LinkMotion, Screw, Travel, zero_motion, zero_screw};
use crate::lane::{Kernel, Lane, V3, add, cross, dot, times};
use crate::lane_states::LaneStates;
use crate::model::Model;
use crate::states::{JointState, JointStates};
use crate::wide::{F64x8, over_eight, over_one};

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
    let mut torque = vec![0.0; model.n_joints()];
    over_one(&mut Recursion {
        model,
        parameters: &model.kernel_parameters(parameters),
        state: [&state.q, &state.qd, &state.qdd],
        work: &mut Workspace::new(model, 0.0),
        torque: &mut torque,
    });
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
    let parameters = model.kernel_parameters(parameters);
    let mut torque = vec![0.0; n * n_samples];
    let mut work = Workspace::new(model, F64x8::ZERO);
    let mut lanes = LaneStates::new(n);
    let mut out = vec![F64x8::ZERO; n];
    for first in (0..n_samples).step_by(8) {
        lanes.load(states, first);
        over_eight(&mut Recursion {
            model,
            parameters: &parameters,
            state: lanes.state(),
            work: &mut work,
            torque: &mut out,
        });
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

struct Workspace<C> {
    motion: Vec<LinkMotion<C>>,
    travel: Vec<[C; 2]>,
    wrench: Vec<Screw<C>>,
}

impl<C: Copy> Workspace<C> {
    fn new(model: &Model, zero: C) -> Self {
        let n = model.n_joints();
        Self {
            motion: vec![zero_motion(zero); n],
            travel: vec![[zero; 2]; n],
            wrench: vec![zero_screw(zero); n],
        }
    }
}

/// Outward for motions, inward for wrenches; `parameters` in the joint frames.
struct Recursion<'a, C> {
    model: &'a Model,
    parameters: &'a [f64],
    state: [&'a [C]; 3],
    work: &'a mut Workspace<C>,
    torque: &'a mut [C],
}

impl<C> Kernel<C> for Recursion<'_, C> {
    #[inline(always)]
    fn run<T: Lane<Cell = C>>(&mut self, at: T::At) {
        for part in 0..T::PARTS {
            self.run_part::<T>(T::part(at, part));
        }
    }
}

impl<C> Recursion<'_, C> {
    #[inline(always)]
    fn run_part<T: Lane<Cell = C>>(&mut self, at: T::At) {
        let ([q, qd, qdd], work) = (self.state, &mut *self.work);
        let base = LinkMotion::<T>::base(at, self.model);
        for (j, joint) in self.model.joints.iter().enumerate() {
            let travel = Travel::new(joint, T::read(at, &q[j]));
            let below = match joint.parent {
                Some(p) => LinkMotion::read(at, &work.motion[p]),
                None => base,
            };
            let (qd, qdd) = (T::read(at, &qd[j]), T::read(at, &qdd[j]));
            let motion = below.beyond(joint, travel, qd, qdd);
            let ten = splat_ten(at, &self.parameters[10 * j..]);
            link_wrench(&motion, &ten).write(at, &mut work.wrench[j]);
            motion.write(at, &mut work.motion[j]);
            travel.write(at, &mut work.travel[j]);
        }
        for (j, joint) in self.model.joints.iter().enumerate().rev() {
            let wrench = Screw::<T>::read(at, &work.wrench[j]);
            let torque = wrench.along_axis(joint.kind);
            torque.write(at, &mut self.torque[j]);
            if let Some(p) = joint.parent {
                let travel = Travel::read(at, joint.kind, &work.travel[j]);
                let passed = wrench.wrench_below(joint, travel);
                let sum = Screw::read(at, &work.wrench[p]).plus(&passed);
                sum.write(at, &mut work.wrench[p]);
            }
        }
    }
}

/// The ten parameters of a link in every sample.
#[inline(always)]
pub(crate) fn splat_ten<T: Lane>(at: T::At, parameters: &[f64]) -> [T; 10] {
    let mut ten = [T::splat(at, 0.0); 10];
    for k in 0..10 {
        ten[k] = T::splat(at, parameters[k]);
    }
    ten
}

/// `I v` with the tensor of the first six parameters.
#[inline(always)]
pub(crate) fn tensor_times<T: Lane>(p: &[T; 10], v: V3<T>) -> V3<T> {
    [
        dot([p[0], p[1], p[2]], v),
        dot([p[1], p[3], p[4]], v),
        dot([p[2], p[4], p[5]], v),
    ]
}

/// Newton and Euler about the frame's origin: `n = I ω̇ + ω × I ω + h × a`, `f = m a + ω̇ × h + ω × (ω × h)`.
#[inline(always)]
pub(crate) fn link_wrench<T: Lane>(m: &LinkMotion<T>, p: &[T; 10]) -> Screw<T> {
    let h = [p[6], p[7], p[8]];
    let euler = add(tensor_times(p, m.wd), cross(m.w, tensor_times(p, m.w)));
    let moment = add(euler, cross(h, m.a));
    let turning = add(cross(m.wd, h), cross(m.w, cross(m.w, h)));
    Screw {
        angular: moment,
        linear: add(times(p[9], m.a), turning),
    }
}

/// The recursion for any lane: dual numbers of the tests.
#[cfg(test)]
pub(crate) fn torque_of<T: Lane<At = (), Cell = T>>(
    model: &Model,
    parameters: &[f64],
    q: &[T],
    qd: &[T],
    qdd: &[T],
) -> Vec<T> {
    let zero = T::splat((), 0.0);
    let mut torque = vec![zero; model.n_joints()];
    let mut recursion = Recursion {
        model,
        parameters: &model.kernel_parameters(parameters),
        state: [q, qd, qdd],
        work: &mut Workspace::new(model, zero),
        torque: &mut torque,
    };
    recursion.run::<T>(());
    torque
}
