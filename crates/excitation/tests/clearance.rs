//! Distances between the bodies of a robot: their gradient, their proof, and what is refused.
#![allow(clippy::unwrap_used)]

use idim_excitation::{
    Clearance, ClearanceCertificate, Error, FourierOptions, TorqueCertificate, TorquePrior,
    optimise_fourier,
};
use idim_model::{
    Columns, JointState, JointStates, Model, Robot, inverse_dynamics, random_states, robot_from_ron,
};
use idim_trajectory::{Limits, PathPoint, QuinticPath};

/// An upright arm of two links between two posts.
fn planar(posts: &str) -> Robot {
    let text = format!(
        "(
            name: \"planar\", angles: Radians, gravity: (0, -9.81, 0), {posts}
            joints: StandardDh([
                (name: \"a\", frame: (a: 0.5),
                 limits: (position: (-1.5, 1.5), velocity: 2, acceleration: 8, torque: 30),
                 actuator: (viscous_friction: 0.2, coulomb_friction: 0.5),
                 inertial: CentreOfMass(mass: 2, centre: (-0.25, 0, 0), inertia: (xx: 0.01, yy: 0.05, zz: 0.05)),
                 capsules: [(from: (-0.5, 0, 0), to: (0, 0, 0), radius: 0.05)]),
                (name: \"b\", frame: (a: 0.4),
                 limits: (position: (-2.5, 2.5), velocity: 3, acceleration: 10, torque: 10),
                 inertial: CentreOfMass(mass: 1, centre: (-0.2, 0, 0), inertia: (xx: 0.005, yy: 0.02, zz: 0.02)),
                 capsules: [(from: (-0.4, 0, 0), to: (0, 0, 0), radius: 0.04)]),
            ]),
        )"
    );
    robot_from_ron(&text).unwrap()
}

const POST: &str = "obstacles: [(from: (0.3, 0.75, -1), to: (0.3, 0.75, 1), radius: 0.05)],";

fn options(robot: &Robot) -> FourierOptions {
    FourierOptions {
        period: 6.0,
        n_harmonics: 3,
        n_samples: 60,
        n_starts: 4,
        n_rounds: 0,
        torque: Some(TorquePrior::new(robot, 0.8).unwrap()),
        clearance: Clearance::new(robot, 0.02).unwrap(),
        ..FourierOptions::default()
    }
}

/// Share of each joint's torque limit that `tau` of the links uses with friction, which may be against it.
fn torque_use(robot: &Robot, tau: &[f64], s: &JointState) -> Vec<f64> {
    let of_joint = |(j, joint): (usize, &idim_model::Joint)| {
        let friction = joint.actuator.viscous_friction.unwrap_or(0.0) * s.qd[j];
        let coulomb = joint.actuator.coulomb_friction.unwrap_or(0.0);
        ((tau[j] + friction).abs() + coulomb) / joint.limits.torque.unwrap()
    };
    robot.joints().iter().enumerate().map(of_joint).collect()
}

/// The base parameters of a planar arm, and viscous friction.
fn columns() -> Columns {
    use idim_model::ParameterKind::{Fv, MX, MY, ZZ};
    let named = [
        (ZZ, 0),
        (MX, 0),
        (MY, 0),
        (ZZ, 1),
        (MX, 1),
        (MY, 1),
        (Fv, 0),
        (Fv, 1),
    ];
    Columns(
        named
            .map(|(kind, index)| idim_model::Parameter { kind, index })
            .to_vec(),
    )
}

#[test]
fn identity_a_path_through_points_is_proved_where_it_keeps_clear_and_within_torques() {
    let robot = planar(POST);
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let inertial = robot.standard_parameters().unwrap();
    let clearance = Clearance::new(&robot, 0.02).unwrap().unwrap();
    let through = |points: &[[[f64; 2]; 2]], acceleration: f64| {
        let point = |&[q, qd]: &[[f64; 2]; 2]| PathPoint {
            q: q.to_vec(),
            qd: qd.to_vec(),
        };
        let mut all = vec![PathPoint::at_rest(&[0.0, 0.0])];
        all.extend(points.iter().map(point));
        all.push(PathPoint::at_rest(&[0.0, 0.0]));
        QuinticPath::shortest(&all, &limits.scaled(1.0, 1.0, acceleration)).unwrap()
    };
    // Samples of the path, a thousand a segment: what it uses of the torque limits, and its least distance.
    let looked_at = |path: &QuinticPath| {
        let n = 1000 * path.n_segments();
        let times: Vec<f64> = (0..=n)
            .map(|k| path.duration() * k as f64 / n as f64)
            .collect();
        let states = path.states(&times);
        let mut used = [0.0_f64; 2];
        for k in 0..=n {
            let s = states.state(k);
            let tau = inverse_dynamics(&model, &inertial, &s);
            for (used, here) in used.iter_mut().zip(torque_use(&robot, &tau, &s)) {
                *used = used.max(here);
            }
        }
        let nearest = clearance.nearest(&states);
        (
            used,
            nearest.iter().map(|n| n.1).fold(f64::INFINITY, f64::min),
        )
    };
    let calm = through(
        &[[[-0.4, 0.6], [0.3, -0.5]], [[-0.9, -0.8], [-0.2, 0.4]]],
        0.3,
    );
    let (used, least) = looked_at(&calm);
    let share = 1.05 * used[0].max(used[1]);
    let prior = TorquePrior::new(&robot, share).unwrap();
    let torque = TorqueCertificate::of_path(&model, &prior, &calm).unwrap();
    for (joint, used) in torque.joints.iter().zip(used) {
        let bound = joint.unwrap().bound;
        assert!(used <= bound && bound <= share, "{used} {bound} {share}");
    }
    let kept = ClearanceCertificate::of_path(&clearance, &calm).unwrap();
    assert!(kept.bound >= 0.02 && least >= kept.bound && kept.distance <= least + 1e-3);
    // A little less than it uses is refused, by as much as is missing.
    let prior = TorquePrior::new(&robot, 0.9 * used[0].max(used[1])).unwrap();
    let excess = TorqueCertificate::of_path(&model, &prior, &calm).unwrap_err();
    assert!(excess.iter().any(|e| *e > 0.0));
    // Straight through the post.
    let blind = through(&[[[1.2, 0.3], [0.0, 0.0]]], 0.3);
    let (_, least) = looked_at(&blind);
    assert!(least < 0.0);
    let missing = ClearanceCertificate::of_path(&clearance, &blind).unwrap_err();
    assert!(missing > 0.0);
}

#[test]
fn identity_a_motion_keeps_clear_and_within_torques_at_every_instant() {
    let robot = planar(POST);
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let options = options(&robot);
    let found = optimise_fourier(&model, &columns(), &limits, &options).unwrap();
    let clearance = found.clearance.unwrap();
    assert!(clearance.bound >= 0.02 && clearance.distance >= clearance.bound);
    // A hundred times finer than the criterion's samples.
    let states = found.series.equispaced_states(6000);
    let nearest = options.clearance.as_ref().unwrap().nearest(&states);
    let least = nearest.iter().map(|n| n.1).fold(f64::INFINITY, f64::min);
    assert!(
        least >= clearance.bound,
        "{least} below {}",
        clearance.bound
    );
    // What was found by samples is nowhere far from the least there is.
    assert!(clearance.distance <= least + 1e-3);
    let torque = found.torque.unwrap();
    let inertial = robot.standard_parameters().unwrap();
    for k in 0..6000 {
        let s = states.state(k);
        let tau = inverse_dynamics(&model, &inertial, &s);
        for (j, used) in torque_use(&robot, &tau, &s).into_iter().enumerate() {
            let bound = torque.joints[j].unwrap().bound;
            assert!(used <= bound && bound <= 0.8, "{used}, {bound}");
        }
    }
    // Without the conditions both are broken: they are what holds the motion.
    let free = FourierOptions {
        torque: None,
        clearance: None,
        ..options.clone()
    };
    let free = optimise_fourier(&model, &columns(), &limits, &free).unwrap();
    let nearest = options
        .clearance
        .unwrap()
        .nearest(&free.series.equispaced_states(600));
    assert!(nearest.iter().any(|n| n.1 < 0.02));
    assert!(free.torque.is_none() && free.clearance.is_none());
}

#[test]
fn regress_a_collision_that_cannot_be_avoided_is_refused() {
    // A post through the first link at rest, wherever it turns: it stands on its axis.
    let robot = planar(
        "obstacles: [(from: (0, 0, -1), to: (0, 0, 1), radius: 0.1)], may_touch: [(\"base\", \"link1\")],",
    );
    // The second link reaches the axis only when folded: that can be avoided, and is.
    let clearance = Clearance::new(&robot, 0.02).unwrap().unwrap();
    assert_eq!(clearance.n_pairs(), 1);
    let (model, limits) = (Model::new(&robot), Limits::from_robot(&robot).unwrap());
    let found = optimise_fourier(&model, &columns(), &limits, &options(&robot)).unwrap();
    assert!(found.clearance.unwrap().bound >= 0.02);
    // The ground above all of the arm: it cannot.
    let buried = planar("ground: 2,");
    let refused = optimise_fourier(&model, &columns(), &limits, &options(&buried));
    assert!(
        matches!(refused, Err(Error::NoFeasibleMotion { .. })),
        "{refused:?}"
    );
}

#[test]
fn identity_rates_bound_every_change_of_distance() {
    let robot = robot_from_ron(idim_fixtures::ARM7).unwrap();
    let clearance = Clearance::new(&robot, 0.0).unwrap().unwrap();
    assert!(clearance.n_pairs() > 10);
    for k in 0..50 {
        let states = random_states(&robot, 2, k);
        let at = |q: &[f64]| {
            let state = JointState {
                q: q.to_vec(),
                qd: vec![0.0; 7],
                qdd: vec![0.0; 7],
            };
            clearance.nearest(&JointStates::from_states(&[state]))[0].1
        };
        let (from, to) = (states.state(0).q, states.state(1).q);
        // No point of the arm is further than 1.2 m from any axis before it.
        let way: f64 = from.iter().zip(&to).map(|(a, b)| (a - b).abs()).sum();
        assert!((at(&from) - at(&to)).abs() <= 2.0 * 1.2 * way);
    }
}

#[test]
fn regress_questions_without_an_answer_are_refused() {
    let robot = planar(POST);
    let refused = |e: Result<TorquePrior, Error>| assert!(matches!(e, Err(Error::Input { .. })));
    refused(TorquePrior::new(&robot, 0.0));
    refused(TorquePrior::new(&robot, 1.5));
    // Coulomb friction as large as what is allowed.
    refused(TorquePrior::new(&robot, 0.01));
    refused(TorquePrior::new(
        &robot_from_ron(idim_fixtures::PUMA3R).unwrap(),
        0.8,
    ));
    assert!(Clearance::new(&robot, -1.0).is_err());
    let bare = robot_from_ron(idim_fixtures::PUMA3R).unwrap();
    assert_eq!(Clearance::new(&bare, 0.02).unwrap(), None);
}
