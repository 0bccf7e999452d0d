//! Newton-Euler inverse dynamics.

use crate::kinematics::{LinkMotion, Screw, Travel};
use crate::lane::{F64x8, Lane, V3, add, cross, dispatch, dot, times};
use crate::model::Model;
use crate::states::{JointState, JointStates, LaneStates};

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
    dispatch(Recursion {
        model,
        parameters: &model.kernel_parameters(parameters),
        state: [&state.q, &state.qd, &state.qdd],
        work: &mut Workspace::new(model),
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
    let mut work = Workspace::new(model);
    let mut lanes = LaneStates::new(n);
    let mut out = vec![F64x8::splat(0.0); n];
    for first in (0..n_samples).step_by(8) {
        lanes.load(states, first);
        dispatch(Recursion {
            model,
            parameters: &parameters,
            state: lanes.state(),
            work: &mut work,
            torque: &mut out,
        });
        let count = (n_samples - first).min(8);
        for j in 0..n {
            torque[j * n_samples + first..][..count].copy_from_slice(&out[j].as_array()[..count]);
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

struct Workspace<T> {
    motion: Vec<LinkMotion<T>>,
    travel: Vec<Travel<T>>,
    wrench: Vec<Screw<T>>,
}

impl<T: Lane> Workspace<T> {
    fn new(model: &Model) -> Self {
        let n = model.n_joints();
        Self {
            motion: vec![LinkMotion::zero(); n],
            travel: vec![Travel::Slide { d: T::splat(0.0) }; n],
            wrench: vec![Screw::zero(); n],
        }
    }
}

/// Outward for motions, inward for wrenches; `parameters` in the joint frames.
struct Recursion<'a, T> {
    model: &'a Model,
    parameters: &'a [f64],
    state: [&'a [T]; 3],
    work: &'a mut Workspace<T>,
    torque: &'a mut [T],
}

impl<T: Lane> pulp::WithSimd for Recursion<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let ([q, qd, qdd], work) = (self.state, self.work);
        let base = LinkMotion::base(self.model);
        for (j, joint) in self.model.joints.iter().enumerate() {
            let travel = Travel::new(joint, q[j]);
            let below = match joint.parent {
                Some(p) => work.motion[p],
                None => base,
            };
            let motion = below.beyond(joint, travel, qd[j], qdd[j]);
            work.wrench[j] = link_wrench(&motion, &splat_ten(&self.parameters[10 * j..]));
            work.motion[j] = motion;
            work.travel[j] = travel;
        }
        for (j, joint) in self.model.joints.iter().enumerate().rev() {
            let wrench = work.wrench[j];
            self.torque[j] = wrench.along_axis(joint.kind);
            if let Some(p) = joint.parent {
                let passed = wrench.wrench_below(joint, work.travel[j]);
                work.wrench[p] = work.wrench[p].plus(&passed);
            }
        }
    }
}

/// The ten parameters of a link in every lane.
#[inline(always)]
pub(crate) fn splat_ten<T: Lane>(parameters: &[f64]) -> [T; 10] {
    let mut ten = [T::splat(0.0); 10];
    for k in 0..10 {
        ten[k] = T::splat(parameters[k]);
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
pub(crate) fn torque_of<T: Lane>(
    model: &Model,
    parameters: &[f64],
    q: &[T],
    qd: &[T],
    qdd: &[T],
) -> Vec<T> {
    let mut torque = vec![T::splat(0.0); model.n_joints()];
    dispatch(Recursion {
        model,
        parameters: &model.kernel_parameters(parameters),
        state: [q, qd, qdd],
        work: &mut Workspace::new(model),
        torque: &mut torque,
    });
    torque
}
