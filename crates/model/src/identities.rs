//! Identities the equations must satisfy on any tree of joints.

use crate::energy::link_energies;
use crate::newton_euler::torque_of;
use crate::testing::{Dual, dual, relative_difference, robot_and_state};
use crate::*;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// Relative rounding of a recursion over at most eight links.
const ROUNDING: f64 = 1e-12;

fn parameters(robot: &Robot) -> Vec<f64> {
    robot
        .standard_parameters()
        .expect("every link has its parameters")
}

/// `M(q)` column by column, without gravity and velocity.
fn mass_matrix(model: &Model, parameters: &[f64], q: &[f64]) -> DMatrix<f64> {
    let n = model.n_joints();
    let y = |k: usize| {
        let unit: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == k))).collect();
        let columns = Columns::inertial(n);
        momentum_regressor(model, &columns, q, &unit) * DVector::from_column_slice(parameters)
    };
    DMatrix::from_columns(&(0..n).map(y).collect::<Vec<_>>())
}

fn energy_of(model: &Model, parameters: &[f64], q: &[Dual], qd: &[Dual]) -> Dual {
    let mut links = vec![[dual(0.0, 0.0); 10]; model.n_joints()];
    link_energies(model, q, qd, &mut links);
    let zero = dual(0.0, 0.0);
    links
        .iter()
        .flatten()
        .zip(parameters)
        .fold(zero, |sum, (h, &p)| sum + *h * dual(p, 0.0))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn identity_regressor_times_parameters_is_inverse_dynamics((robot, state) in robot_and_state()) {
        let model = Model::new(&robot);
        let pi = parameters(&robot);
        let y = torque_regressor(&model, &Columns::inertial(robot.n_joints()), &state);
        let product = y * DVector::from_vec(pi.clone());
        let torque = inverse_dynamics(&model, &pi, &state);
        prop_assert!(relative_difference(product.as_slice(), &torque) < ROUNDING);
    }

    #[test]
    fn identity_mass_matrix_is_symmetric_positive_definite((robot, state) in robot_and_state()) {
        let m = mass_matrix(&Model::new(&robot), &parameters(&robot), &state.q);
        prop_assert!(relative_difference(m.transpose().as_slice(), m.as_slice()) < ROUNDING);
        prop_assert!(m.cholesky().is_some());
    }

    #[test]
    fn identity_torque_is_mass_times_acceleration_plus_christoffel_terms_plus_gravity((robot, state) in robot_and_state()) {
        // C from the derivatives of M makes dM/dt - 2C skew by construction; that it also gives the torque is the test.
        let model = Model::new(&robot);
        let pi = parameters(&robot);
        let n = robot.n_joints();
        let zero = vec![0.0; n];
        let dm: Vec<DMatrix<f64>> = (0..n).map(|k| mass_matrix_derivative(&model, &pi, &state.q, k)).collect();
        let v = &state.qd;
        let mut c_v = vec![0.0; n];
        for i in 0..n {
            for j in 0..n {
                for k in 0..n {
                    c_v[i] += 0.5 * (dm[k][(i, j)] + dm[j][(i, k)] - dm[i][(j, k)]) * v[j] * v[k];
                }
            }
        }
        let with = JointState { q: state.q.clone(), qd: v.clone(), qdd: zero.clone() };
        let without = JointState { qd: zero, ..with.clone() };
        let bias = inverse_dynamics(&model, &pi, &with);
        let gravity = inverse_dynamics(&model, &pi, &without);
        let difference: Vec<f64> = bias.iter().zip(&gravity).map(|(a, b)| a - b).collect();
        let scale = bias.iter().chain(&c_v).fold(1.0_f64, |m, x| m.max(x.abs()));
        for i in 0..n {
            prop_assert!((difference[i] - c_v[i]).abs() < ROUNDING * 100.0 * scale);
        }
    }

    #[test]
    fn identity_gravity_torque_is_the_gradient_of_the_potential_energy((robot, state) in robot_and_state()) {
        let model = Model::new(&robot);
        let pi = parameters(&robot);
        let n = robot.n_joints();
        let rest = JointState { q: state.q.clone(), qd: vec![0.0; n], qdd: vec![0.0; n] };
        let torque = inverse_dynamics(&model, &pi, &rest);
        let gradient: Vec<f64> = (0..n).map(|k| {
            let q: Vec<Dual> = (0..n).map(|i| dual(state.q[i], f64::from(u8::from(i == k)))).collect();
            energy_of(&model, &pi, &q, &vec![dual(0.0, 0.0); n]).du
        }).collect();
        prop_assert!(relative_difference(&gradient, &torque) < ROUNDING);
    }

    #[test]
    fn identity_power_of_the_torques_is_the_rate_of_energy_column_by_column((robot, state) in robot_and_state()) {
        let model = Model::new(&robot);
        let n = robot.n_joints();
        let pair = |a: &[f64], b: &[f64]| -> Vec<Dual> { a.iter().zip(b).map(|(&a, &b)| dual(a, b)).collect() };
        let mut links = vec![[dual(0.0, 0.0); 10]; n];
        link_energies(&model, &pair(&state.q, &state.qd), &pair(&state.qd, &state.qdd), &mut links);
        let rate: Vec<f64> = links.iter().flatten().map(|h| h.du).collect();
        let power = power_regressor(&model, &Columns::inertial(n), &state);
        prop_assert!(relative_difference(&power, &rate) < ROUNDING);
    }

    #[test]
    fn identity_rate_of_momentum_is_torque_plus_gradient_of_the_lagrangian((robot, state) in robot_and_state()) {
        let model = Model::new(&robot);
        let pi = parameters(&robot);
        let n = robot.n_joints();
        let torque = inverse_dynamics(&model, &pi, &state);
        let (m, dm) = (mass_matrix(&model, &pi, &state.q), |k| mass_matrix_derivative(&model, &pi, &state.q, k));
        let v = DVector::from_column_slice(&state.qd);
        let mut rate = &m * DVector::from_column_slice(&state.qdd);
        let rest = JointState { q: state.q.clone(), qd: vec![0.0; n], qdd: vec![0.0; n] };
        let gravity = inverse_dynamics(&model, &pi, &rest);
        let mut expected = vec![0.0; n];
        for k in 0..n {
            let dmk = dm(k) * &v;
            rate += &dmk * state.qd[k];
            expected[k] = torque[k] + 0.5 * v.dot(&dmk) - gravity[k];
        }
        let scale = expected.iter().fold(1.0_f64, |a, x| a.max(x.abs()));
        for k in 0..n {
            prop_assert!((rate[k] - expected[k]).abs() < 100.0 * ROUNDING * scale);
        }
    }

    #[test]
    fn identity_torque_does_not_depend_on_the_choice_of_link_frames((robot, state) in robot_and_state(), x in prop::array::uniform6(-1.0..1.0_f64)) {
        // Move every link frame by the same pose: the file changes, the arm does not.
        let shift = Pose::from_xyz_rpy([x[0], x[1], x[2]], [x[3], x[4], x[5]]);
        let mut joints = robot.joints().to_vec();
        let mut links = robot.links().to_vec();
        for (j, l) in joints.iter_mut().zip(&mut links) {
            j.joint_from_link = j.joint_from_link * shift;
            if j.parent.is_some() {
                j.parent_from_joint = shift.inverse() * j.parent_from_joint;
            }
            l.inertial = l.inertial.map(|p| p.expressed_in(&shift.inverse()));
        }
        let moved = Robot::new("moved", robot.gravity(), joints, links).expect("valid");
        let a = inverse_dynamics(&Model::new(&moved), &parameters(&moved), &state);
        let b = inverse_dynamics(&Model::new(&robot), &parameters(&robot), &state);
        prop_assert!(relative_difference(&a, &b) < ROUNDING);
    }

    #[test]
    fn identity_a_locked_joint_is_a_joint_that_does_not_move((robot, mut state) in robot_and_state(), pick in 0..8_usize) {
        prop_assume!(robot.n_joints() > 1);
        let held = pick % robot.n_joints();
        let locked = robot.lock(held, state.q[held]);
        (state.qd[held], state.qdd[held]) = (0.0, 0.0);
        let mut all = inverse_dynamics(&Model::new(&robot), &parameters(&robot), &state);
        all.remove(held);
        for x in [&mut state.q, &mut state.qd, &mut state.qdd] {
            x.remove(held);
        }
        // A link locked to the base no longer has a body of its own; the torques of the others stay.
        let rest = inverse_dynamics(&Model::new(&locked), &parameters(&locked), &state);
        prop_assert!(relative_difference(&rest, &all) < ROUNDING);
    }

    #[test]
    fn identity_a_mirrored_arm_needs_mirrored_torques((robot, state) in robot_and_state()) {
        // Mirror in the plane x = 0: positions flip in x, rotation axes flip in y and z.
        let s = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(-1.0, 1.0, 1.0));
        let mirror = |p: &Pose| Pose { rotation: s * p.rotation * s, translation: s * p.translation };
        let mut joints = robot.joints().to_vec();
        let mut links = robot.links().to_vec();
        for (j, l) in joints.iter_mut().zip(&mut links) {
            j.parent_from_joint = mirror(&j.parent_from_joint);
            j.joint_from_link = mirror(&j.joint_from_link);
            j.axis = match j.kind {
                JointKind::Revolute => -(s * j.axis),
                JointKind::Prismatic => s * j.axis,
            };
            l.inertial = l.inertial.map(|p| InertialParameters::from_parts(p.mass(), s * p.first_moment(), &(s * p.inertia() * s)));
        }
        let mirrored = Robot::new("mirrored", s * robot.gravity(), joints, links).expect("valid");
        let a = inverse_dynamics(&Model::new(&mirrored), &parameters(&mirrored), &state);
        let b = inverse_dynamics(&Model::new(&robot), &parameters(&robot), &state);
        prop_assert!(relative_difference(&a, &b) < ROUNDING);
    }

    #[test]
    fn identity_eight_lanes_are_bit_for_bit_one_sample_at_a_time((robot, state) in robot_and_state(), count in 1..20_usize) {
        let model = Model::new(&robot);
        let n = robot.n_joints();
        let columns = Columns::standard(n, DriveColumns::ALL);
        let mut states = vec![state];
        states.extend((1..count).map(|k| random_states(&robot, 1, k as u64).state(0)));
        let w = observation_matrix(&model, &columns, &JointStates::from_states(&states));
        let pi = parameters(&robot);
        let batch = inverse_dynamics_batch(&model, &pi, &JointStates::from_states(&states));
        for (k, s) in states.iter().enumerate() {
            let y = torque_regressor(&model, &columns, s);
            let tau = inverse_dynamics(&model, &pi, s);
            for i in 0..n {
                prop_assert_eq!(batch[i * count + k].to_bits(), tau[i].to_bits());
                for c in 0..columns.len() {
                    prop_assert_eq!(w[(k * n + i, c)].to_bits(), y[(i, c)].to_bits());
                }
            }
        }
    }
}

/// `∂M/∂q_k` by dual numbers.
fn mass_matrix_derivative(model: &Model, pi: &[f64], q: &[f64], k: usize) -> DMatrix<f64> {
    let n = model.n_joints();
    let zero = dual(0.0, 0.0);
    let q: Vec<Dual> = (0..n)
        .map(|i| dual(q[i], f64::from(u8::from(i == k))))
        .collect();
    let weightless = model.weightless();
    let columns: Vec<DVector<f64>> = (0..n)
        .map(|j| {
            let unit: Vec<Dual> = (0..n)
                .map(|i| dual(f64::from(u8::from(i == j)), 0.0))
                .collect();
            let torque = torque_of(&weightless, pi, &q, &vec![zero; n], &unit);
            DVector::from_iterator(n, torque.iter().map(|t| t.du))
        })
        .collect();
    DMatrix::from_columns(&columns)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn identity_every_instruction_set_gives_the_same_regressor((robot, state) in robot_and_state()) {
        let model = Model::new(&robot);
        let n = robot.n_joints();
        let columns = Columns::standard(n, DriveColumns::ALL);
        let mut states = crate::lane_states::LaneStates::new(n);
        states.load(&JointStates::from_states(std::slice::from_ref(&state)), 0);
        let target = crate::packing::Rows::new(&model, &columns);
        let one = torque_regressor(&model, &columns, &state);
        for arch in crate::testing::architectures() {
            let mut rows = vec![crate::wide::F64x8::ZERO; target.n_cells];
            let ends = [crate::wide::F64x8::ZERO, crate::wide::F64x8::ONE];
            let mut fill = crate::regressor::Fill::<_, { crate::projection::BLOCKS }> {
                model: &model,
                rows: target.all(),
                state: states.state(),
                kinematics: &mut crate::axes::Kinematics::new(&model, ends),
                cells: &mut rows,
            };
            crate::wide::over_eight_on(arch, &mut fill);
            for (k, &place) in target.places.iter().enumerate() {
                for x in rows[place].0 {
                    prop_assert_eq!(x, one[(k / columns.len(), k % columns.len())]);
                }
            }
        }
    }
}
