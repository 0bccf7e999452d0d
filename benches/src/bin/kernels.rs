//! One kernel, some times over, for the instruction-count gate: `kernels NAME COUNT`; `kernels --list` names them.
#![allow(clippy::print_stdout)]

use idim_benches::{Case, jobs, reduction};
use idim_model::{Columns, JointStates, RegressorWorkspace, torque_regressor_into};
use std::hint::black_box;
use std::process::ExitCode;

/// Samples of a batch: full blocks, and a last one of four.
const SAMPLES: usize = 100;

const NAMES: [&str; 9] = [
    "regressor_base",
    "regressor_standard",
    "regressor_one_sample",
    "information_matrix",
    "condition_number",
    "condition_gradient",
    "reduction",
    "information_observed",
    "running_qr",
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let strings: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match strings[..] {
        ["--list"] => {
            println!("{}", NAMES.join("\n"));
            ExitCode::SUCCESS
        }
        [name, count] if NAMES.contains(&name) => {
            run(name, count.parse().unwrap_or(1));
            ExitCode::SUCCESS
        }
        _ => {
            println!("usage: kernels --list | kernels NAME COUNT");
            ExitCode::FAILURE
        }
    }
}

fn run(name: &str, count: usize) {
    let case = Case::ur5();
    let friction = case.with_friction();
    let states = case.states(SAMPLES);
    let torques = jobs::torques(&case, &friction, &states);
    for _ in 0..count {
        once(name, &case, &friction, (&states, &torques));
    }
}

fn once(name: &str, case: &Case, friction: &Columns, (states, torques): (&JointStates, &[f64])) {
    match name {
        "regressor_base" => jobs::regressor_batch(case, &case.base, states),
        "regressor_standard" => jobs::regressor_batch(case, &case.standard, states),
        "regressor_one_sample" => {
            let mut workspace = RegressorWorkspace::new(&case.model, &case.base);
            let mut out = vec![0.0; case.model.n_joints() * case.base.len()];
            for k in 0..SAMPLES {
                let state = states.state(k);
                torque_regressor_into(&case.model, &mut workspace, &state, &mut out);
                black_box(&out);
            }
        }
        "information_matrix" => jobs::information(case, states),
        "condition_number" => {
            black_box(jobs::condition(case, states));
        }
        "condition_gradient" => jobs::gradient(case, states),
        "reduction" => {
            let order: Vec<usize> = (0..case.standard.len()).collect();
            black_box(reduction(&case.robot, &case.model, &case.standard, &order));
        }
        "information_observed" => jobs::information_observed(case, friction, states, torques),
        _ => {
            let weights = vec![1.0; case.model.n_joints()];
            let factor = idim::running_qr(&case.model, friction, states, torques, &weights);
            black_box(factor.expect("finite rows"));
        }
    }
}
