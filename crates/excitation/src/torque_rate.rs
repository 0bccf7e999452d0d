//! How fast torques can change: a bound that holds for every instant of a stretch of motion.
//!
//! The recursion of Newton and Euler with norms in the place of vectors. A vector that is fixed in a link turns with it,
//! so each product of the recursion has a rate; triangle inequalities do the rest.

use crate::TorquePrior;
use idim_model::{JointKind, Pose};

/// What the bound needs of a joint and its link.
#[derive(Debug, Clone)]
struct Body {
    parent: Option<usize>,
    kind: JointKind,
    /// Largest distance from the joint below, m; of a slide, without its travel.
    reach: f64,
    mass: f64,
    /// Norm of the first moment about the joint, kg·m.
    first_moment: f64,
    /// Spectral norm of the inertia about the joint, kg·m².
    inertia: f64,
    /// Magnitudes of what it feels of the rotors per acceleration of every joint, kg·m².
    rotor: Vec<f64>,
    viscous: f64,
    offset: f64,
}

/// Bounds on the rates of all torques of a robot.
#[derive(Debug, Clone)]
pub(crate) struct TorqueRate {
    bodies: Vec<Body>,
    gravity: f64,
}

/// Largest magnitudes of a joint over a stretch: position, velocity, acceleration, jerk.
pub(crate) type Magnitudes = [f64; 4];

/// Norms of a link's motion and of the wrench it passes on, and of their rates.
#[derive(Debug, Clone, Copy, Default)]
struct Norms {
    w: f64,
    wd: f64,
    wdd: f64,
    a: f64,
    jerk: f64,
    force: f64,
    force_rate: f64,
    moment: f64,
    moment_rate: f64,
}

impl TorqueRate {
    pub(crate) fn new(prior: &TorquePrior) -> Self {
        let robot = prior.robot();
        let body = |(j, joint): (usize, &idim_model::Joint)| {
            let below = joint
                .parent
                .map_or_else(Pose::identity, |p| robot.joints()[p].joint_from_link);
            let ten = robot.links()[j].inertial;
            // A prior has them all.
            let ten = ten.map(|p| p.expressed_in(&joint.joint_from_link));
            Body {
                parent: joint.parent,
                kind: joint.kind,
                reach: (below * joint.parent_from_joint).translation.norm(),
                mass: ten.map_or(0.0, |p| p.mass().abs()),
                first_moment: ten.map_or(0.0, |p| p.first_moment().norm()),
                inertia: ten.map_or(0.0, |p| {
                    let eigenvalues = p.inertia().symmetric_eigenvalues();
                    eigenvalues.iter().fold(0.0, |m: f64, e| m.max(e.abs()))
                }),
                rotor: prior.rotor_row(j).iter().map(|v| v.abs()).collect(),
                viscous: prior.viscous(j),
                offset: joint.offset.abs(),
            }
        };
        Self {
            bodies: robot.joints().iter().enumerate().map(body).collect(),
            gravity: robot.gravity().norm(),
        }
    }

    /// Largest rate of each joint's torque but for known torques, N·m/s, over a stretch with these magnitudes.
    pub(crate) fn bound(&self, magnitudes: &[Magnitudes]) -> Vec<f64> {
        let n = self.bodies.len();
        let base = Norms {
            a: self.gravity,
            ..Norms::default()
        };
        let mut norms = vec![base; n];
        let mut arms = vec![[0.0; 2]; n];
        for (k, body) in self.bodies.iter().enumerate() {
            let below = body.parent.map_or(base, |p| norms[p]);
            let [q, qd, qdd, qddd] = magnitudes[k];
            let (mut arm, mut arm_rate) = (body.reach, 0.0);
            let mut m = Norms { ..below };
            if body.kind == JointKind::Prismatic {
                arm += q + body.offset;
                arm_rate = qd;
                m.a += 2.0 * below.w * qd + qdd;
                m.jerk += 3.0 * qd * (below.wd + below.w * below.w) + 3.0 * qdd * below.w + qddd;
            } else {
                m.w += qd;
                m.wd += qdd + below.w * qd;
                m.wdd += qddd + 2.0 * below.w * qdd + (below.wd + below.w * below.w) * qd;
            }
            let (turn, turn_rate) = turning(&below);
            m.a += arm * turn;
            m.jerk += arm * turn_rate;
            arm_rate += below.w * arm;
            arms[k] = [arm, arm_rate];
            let (turn, turn_rate) = turning(&m);
            m.force = body.mass * m.a + body.first_moment * turn;
            m.force_rate = body.mass * m.jerk + body.first_moment * turn_rate;
            m.moment = body.inertia * turn + body.first_moment * m.a;
            m.moment_rate = body.inertia * (m.wdd + 4.0 * m.w * m.wd + m.w.powi(3))
                + body.first_moment * (m.w * m.a + m.jerk);
            norms[k] = m;
        }
        let mut rates = vec![0.0; n];
        for (k, body) in self.bodies.iter().enumerate().rev() {
            let m = norms[k];
            let [arm, arm_rate] = arms[k];
            let w_below = body.parent.map_or(0.0, |p| norms[p].w);
            let qdd = magnitudes[k][2];
            let rigid = match body.kind {
                JointKind::Revolute => w_below * m.moment + m.moment_rate,
                JointKind::Prismatic => w_below * m.force + m.force_rate,
            };
            let jerks = magnitudes.iter().map(|m| m[3]);
            let rotors: f64 = body.rotor.iter().zip(jerks).map(|(i, j)| i * j).sum();
            rates[k] = rigid + rotors + body.viscous * qdd;
            if let Some(p) = body.parent {
                let below = &mut norms[p];
                below.force += m.force;
                below.force_rate += m.force_rate;
                below.moment += m.moment + arm * m.force;
                below.moment_rate += m.moment_rate + arm_rate * m.force + arm * m.force_rate;
            }
        }
        rates
    }
}

/// Bounds of `ω̇ × p + ω × (ω × p)` and of its rate, per length of a `p` that turns with the link.
fn turning(m: &Norms) -> (f64, f64) {
    (m.wd + m.w * m.w, m.wdd + 3.0 * m.w * m.wd + m.w.powi(3))
}
