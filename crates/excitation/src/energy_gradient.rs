//! The gradient of a weighted energy row: backwards through the recursion of `energy.rs`.
//!
//! `weights · h(q, q̇)` is the energy of links with the parameters `weights`, so its derivative by `q̇` is a momentum
//! and by `q` a generalised force: one pass backwards gives both at about the cost of two rows.

use crate::energy::{EnergyModel, EnergyScratch, Motion, Step};
use idim_model::JointKind;
use nalgebra::Vector3;

impl EnergyModel {
    /// Gradient of `weights · h(q, q̇)` by `(q, q̇)`, backwards through the state last given to [`Self::row`].
    pub(crate) fn row_gradient(
        &self,
        q: &[f64],
        weights: &[f64],
        scratch: &mut EnergyScratch,
        by_q: &mut [f64],
        by_qd: &mut [f64],
    ) {
        for (i, entries) in self.entries.iter().enumerate() {
            let mut ten = [0.0; 10];
            for &(column, k) in entries {
                ten[k] += weights[column];
            }
            scratch.adjoint[i] = scratch.links[i].adjoint(&ten);
        }
        for (i, joint) in self.joints.iter().enumerate().rev() {
            let mut bar = scratch.adjoint[i];
            let m = scratch.moved[i];
            if let Some(step) = &joint.after {
                bar = step.backward(&bar);
            }
            match joint.kind {
                JointKind::Revolute => {
                    let (s, c) = scratch.sin_cos[i];
                    by_qd[i] = bar.w.z;
                    let turned = [(&mut bar.w, m.w), (&mut bar.v, m.v), (&mut bar.g, m.g)];
                    by_q[i] = 0.0;
                    for (u, x) in turned {
                        by_q[i] += u.x * x.y - u.y * x.x;
                        (u.x, u.y) = (c * u.x - s * u.y, s * u.x + c * u.y);
                    }
                }
                JointKind::Prismatic => {
                    let amount = q[i] + joint.offset;
                    by_qd[i] = bar.v.z;
                    by_q[i] = bar.v.x * m.w.y - bar.v.y * m.w.x + bar.height * m.g.z;
                    bar.w.y += bar.v.x * amount;
                    bar.w.x -= bar.v.y * amount;
                    bar.g.z += bar.height * amount;
                }
            }
            if let Some(p) = joint.parent {
                let back = joint.before.backward(&bar);
                let parent = &mut scratch.adjoint[p];
                parent.w += back.w;
                parent.v += back.v;
                parent.g += back.g;
                parent.height += back.height;
            }
        }
    }
}

impl Step {
    /// Transpose of [`Self::forward`].
    fn backward(&self, bar: &Motion) -> Motion {
        let v = self.rotation.tr_mul(&bar.v);
        Motion {
            w: self.rotation.tr_mul(&bar.w) + self.origin.cross(&v),
            v,
            g: self.rotation.tr_mul(&bar.g) + self.origin * bar.height,
            height: bar.height,
        }
    }
}

impl Motion {
    /// Derivative of `weights · ten` by the motion.
    fn adjoint(&self, ten: &[f64; 10]) -> Self {
        let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = *ten;
        let (w, v) = (&self.w, &self.v);
        let first = Vector3::new(mx, my, mz);
        let inertia = Vector3::new(
            xx * w.x + xy * w.y + xz * w.z,
            xy * w.x + yy * w.y + yz * w.z,
            xz * w.x + yz * w.y + zz * w.z,
        );
        Self {
            w: inertia + first.cross(v),
            v: w.cross(&first) + v * m,
            g: -first,
            height: -m,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use idim_model::{
        Actuator, Columns, Joint, JointLimits, Link, Model, Pose, Robot, energy_regressor,
    };
    use proptest::prelude::*;

    /// A chain or tree with any frames: five numbers a joint choose kind, parent and poses.
    fn robot(numbers: &[f64]) -> Robot {
        let n = numbers.len() / 5;
        let joints = (0..n).map(|j| {
            let x = &numbers[5 * j..5 * j + 5];
            let pose = |k: usize| {
                let [a, b, c] = [x[k % 5], x[(k + 1) % 5], x[(k + 2) % 5]];
                Pose::from_xyz_rpy([a, b, c], [c, a, b])
            };
            let axis = [Vector3::z(), Vector3::new(x[0], x[1] - 2.0, x[2])];
            Joint {
                name: format!("j{j}"),
                kind: if x[3] > 0.4 {
                    JointKind::Prismatic
                } else {
                    JointKind::Revolute
                },
                parent: if x[4] > 0.7 { None } else { j.checked_sub(1) },
                parent_from_joint: pose(0),
                axis: axis[usize::from(x[1] > 0.0)],
                offset: x[2],
                joint_from_link: if x[0] > 0.0 {
                    Pose::identity()
                } else {
                    pose(2)
                },
                limits: JointLimits::default(),
                actuator: Actuator::default(),
            }
        });
        let links = (0..n).map(|j| Link {
            name: format!("l{j}"),
            inertial: None,
        });
        let gravity = Vector3::new(1.0, -2.0, -9.0);
        Robot::new("any", gravity, joints.collect(), links.collect()).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        #[test]
        fn identity_rows_and_their_gradient_on_random_trees(
            numbers in prop::collection::vec(-1.0..1.0_f64, 5..=25),
            state in prop::collection::vec(-2.0..2.0_f64, 10),
            weights in prop::collection::vec(-1.0..1.0_f64, 50),
        ) {
            let robot = robot(&numbers);
            let n = robot.n_joints();
            let columns = Columns::inertial(n);
            let energy = EnergyModel::new(&robot, &columns).unwrap();
            let (q, qd) = (state[..n].to_vec(), state[5..5 + n].to_vec());
            let weights = &weights[..10 * n];
            let mut scratch = energy.scratch();
            let mut row = vec![0.0; 10 * n];
            energy.row(&q, &qd, &mut scratch, &mut row);
            let model = Model::new(&robot);
            let reference = energy_regressor(&model, &columns, &q, &qd);
            let largest = row.iter().fold(1.0_f64, |a, h| a.max(h.abs()));
            for (a, b) in row.iter().zip(&reference) {
                // Some forty operations a joint, five joints.
                prop_assert!((a - b).abs() < 1e-13 * largest);
            }
            let (mut by_q, mut by_qd) = (vec![0.0; n], vec![0.0; n]);
            energy.row_gradient(&q, weights, &mut scratch, &mut by_q, &mut by_qd);
            for j in 0..n {
                for (slope, by_velocity) in [(by_q[j], false), (by_qd[j], true)] {
                    let mut f = |t: f64| {
                        let (mut q, mut qd) = (q.clone(), qd.clone());
                        *if by_velocity { &mut qd[j] } else { &mut q[j] } += t;
                        let mut out = vec![0.0; 10 * n];
                        energy.row(&q, &qd, &mut scratch, &mut out);
                        out.iter().zip(weights).map(|(h, w)| h * w).sum::<f64>()
                    };
                    // Five-point difference: truncation h⁴ and rounding / h both near 1e-12.
                    let h = 1e-3;
                    let numeric = (8.0 * (f(h) - f(-h)) - (f(2.0 * h) - f(-2.0 * h))) / (12.0 * h);
                    prop_assert!(
                        (slope - numeric).abs() < 1e-9 * largest,
                        "joint {j}: {slope} {numeric}"
                    );
                }
            }
        }
    }
}
