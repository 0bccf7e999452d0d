//! CPU time of the kernels beside the anchors' figures: run both in the same minute, on the same core.
#![allow(clippy::print_stdout)]

use idim_benches::{Case, cpu_seconds, cpu_time, jobs, reduction};
use idim_excitation::information_matrix;
use idim_model::{
    RegressorWorkspace, regressor_contraction_gradient, squared_torque_gradient, torque_regressor,
    torque_regressor_into, visit_torque_regressor,
};
use std::hint::black_box;

/// Not a power of two: the joints' arrays would share the sets of the first-level cache.
const SAMPLES: usize = 4000;
const LEAST_SQUARES_SAMPLES: usize = 1_000_000;

fn main() {
    for case in [Case::ur5(), Case::panda()] {
        println!("{}: {} base columns", case.name, case.base.len());
        regressor(&case);
        condition(&case);
        gradient(&case);
        let order: Vec<usize> = (0..case.standard.len()).collect();
        let time = cpu_time(41, || {
            black_box(reduction(&case.robot, &case.model, &case.standard, &order));
        });
        line("reduction", time, 1, "ms", 1e3);
    }
    let case = Case::ur5();
    let start = cpu_seconds();
    let design = jobs::excitation_start(&case, 0);
    println!(
        "  one excitation start: {:.3} s, cond {:.2}",
        cpu_seconds() - start,
        design.values[0]
    );
    least_squares(&case);
}

/// Twin: bench_ls.py, chunked normal equations. The torques are not part of the timing, there or here.
fn least_squares(case: &Case) {
    let columns = case.with_friction();
    let states = case.states(LEAST_SQUARES_SAMPLES);
    let torques = jobs::torques(case, &columns, &states);
    let what = format!("{LEAST_SQUARES_SAMPLES} samples, {} columns", columns.len());
    let time = cpu_time(3, || {
        black_box(jobs::least_squares(case, &columns, &states, &torques));
    });
    line(&format!("least squares, {what}"), time, 1, "ms", 1e3);
    let start = cpu_seconds();
    black_box(jobs::least_squares_qr(case, &columns, &states, &torques));
    println!(
        "  the same by running QR: {:.3} s; peak memory {}",
        cpu_seconds() - start,
        peak_memory()
    );
}

/// Largest resident memory of this process so far, as the system counts it.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.map_or("not known".into(), |kb| kb.trim().to_owned())
}

fn line(what: &str, (least, median): (f64, f64), per: usize, unit: &str, scale: f64) {
    let f = scale / per as f64;
    println!(
        "  {what:<44} min {:9.2}  median {:9.2} {unit}",
        least * f,
        median * f
    );
}

/// Twin: `pin_native` regressor_call, `gb_ur5_base_8` with_sincos.
fn regressor(case: &Case) {
    let states = case.states(SAMPLES);
    for (name, columns) in [("base", &case.base), ("standard", &case.standard)] {
        let time = cpu_time(41, || {
            visit_torque_regressor(&case.model, columns, &states, |block| {
                black_box(block);
            });
        });
        line(
            &format!("regressor, {name}, batch"),
            time,
            SAMPLES,
            "ns",
            1e9,
        );
    }
    let state = states.state(0);
    let time = cpu_time(41, || {
        for _ in 0..1000 {
            black_box(torque_regressor(&case.model, &case.base, &state));
        }
    });
    line("regressor, base, one sample", time, 1000, "ns", 1e9);
    let mut workspace = RegressorWorkspace::new(&case.model, &case.base);
    let mut out = vec![0.0; case.model.n_joints() * case.base.len()];
    let time = cpu_time(41, || {
        for _ in 0..1000 {
            torque_regressor_into(&case.model, &mut workspace, &state, &mut out);
            black_box(&out);
        }
    });
    line(
        "regressor, base, one sample, workspace kept",
        time,
        1000,
        "ns",
        1e9,
    );
}

/// Twin: `pin_native` regressor_call times the samples, plus `cond_eigen` Gram + SelfAdjointEigenSolver.
fn condition(case: &Case) {
    let weights = vec![1.0; case.model.n_joints()];
    for n_samples in [100, 1000, 10_000] {
        let states = case.states(n_samples);
        let information = || information_matrix(&case.model, &case.base, &states, &weights);
        let time = cpu_time(41, || {
            black_box(information());
        });
        line(
            &format!("information matrix, {n_samples} samples"),
            time,
            1,
            "ms",
            1e3,
        );
        let time = cpu_time(41, || {
            black_box(jobs::condition(case, &states));
        });
        line(
            &format!("states to cond, {n_samples} samples"),
            time,
            1,
            "ms",
            1e3,
        );
        let time = cpu_time(41, || jobs::gradient(case, &states));
        line(
            &format!("log cond and its gradient, {n_samples} samples"),
            time,
            1,
            "ms",
            1e3,
        );
    }
}

/// Gradient of two eigenvalues (log cond), and of a general contraction without its weights.
fn gradient(case: &Case) {
    let states = case.states(SAMPLES);
    let weights = vec![1.0; case.model.n_joints()];
    let v: Vec<f64> = (0..case.base.len()).map(|k| (k as f64).sin()).collect();
    let time = cpu_time(41, || {
        let terms = [(1.0, &v[..]), (-1.0, &v)];
        black_box(squared_torque_gradient(
            &case.model,
            &case.base,
            &states,
            &weights,
            &terms,
        ));
    });
    line("gradient of two eigenvalues", time, SAMPLES, "ns", 1e9);
    let time = cpu_time(41, || {
        black_box(regressor_contraction_gradient(
            &case.model,
            &case.base,
            &states,
            |y, g| {
                black_box((y, g));
            },
        ));
    });
    line(
        "gradient of a contraction, weights given",
        time,
        SAMPLES,
        "ns",
        1e9,
    );
}
