//! Seven joints, capsules and torque limits: nothing is exceeded, looked at a hundred times finer than by the search.
#![allow(clippy::unwrap_used)]

use idim::Progress;
use idim::excite::{ExciteOptions, excite};
use idim_excitation::{Clearance, Criterion, Scaling, TorquePrior};
use idim_model::{DriveColumns, Model, inverse_dynamics_batch, robot_from_ron};
use idim_trajectory::Limits;

#[test]
fn regress_seven_joints_keep_every_limit_at_a_hundred_times_finer_sampling() {
    let robot = robot_from_ron(idim_fixtures::ARM7).unwrap();
    let limits = Limits::from_robot(&robot).unwrap();
    let options = ExciteOptions {
        criteria: vec![(1.0, Criterion::TwoNorm(Scaling::Raw))],
        period: 10.0,
        n_harmonics: 4,
        n_starts: 2,
        n_rounds: Some(0),
        seed: 1,
        at_rest: false,
        columns: DriveColumns::NONE,
        torque_noise: Vec::new(),
        torque: Some(TorquePrior::new(&robot, 0.8).unwrap()),
        clearance: Clearance::new(&robot, 0.02).unwrap(),
        time_budget: None,
    };
    let found = excite(&robot, &limits, &[], &options, &Progress::none()).unwrap();
    assert_eq!(found.structure.reduction.rank(), 43);
    let states = found.design.series.equispaced_states(10_000);
    for j in 0..7 {
        let [low, high] = limits.position[j];
        assert!(states.q(j).iter().all(|q| (low..=high).contains(q)));
        let within = |x: &[f64], limit: f64| x.iter().all(|x| x.abs() <= limit);
        assert!(within(states.qd(j), limits.velocity[j]));
        assert!(within(states.qdd(j), limits.acceleration[j]));
    }
    let inertial = robot.standard_parameters().unwrap();
    let torque = inverse_dynamics_batch(&Model::new(&robot), &inertial, &states);
    for (j, joint) in robot.joints().iter().enumerate() {
        let [viscous, coulomb] = [
            joint.actuator.viscous_friction,
            joint.actuator.coulomb_friction,
        ]
        .map(Option::unwrap);
        let limit = 0.8 * joint.limits.torque.unwrap();
        for (tau, qd) in torque[10_000 * j..].iter().zip(states.qd(j)) {
            let most = (tau + viscous * qd).abs() + coulomb;
            assert!(most <= limit, "joint {}: {most} of {limit} N·m", j + 1);
        }
    }
    let clearance = options.clearance.unwrap();
    let least = clearance.nearest(&states).into_iter().map(|n| n.1);
    let least = least.fold(f64::INFINITY, f64::min);
    let certificate = found.design.clearance.as_ref().unwrap();
    assert!(
        least >= certificate.bound && certificate.bound >= 0.02,
        "{least} m"
    );
    // Better than what chance finds under the same conditions.
    if let Some(random) = &found.random {
        let best = |d: &idim_excitation::FourierDesign| d.conditioning.raw.two_norm;
        assert!(best(&found.design) < best(random));
    }
}
