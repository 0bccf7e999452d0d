//! The kernels beside the anchors: `cargo bench -p idim-benches`; README.md here says how to run both in the same minute.
//!
//! Every group names its twin of ../shared/anchors.
#![allow(missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use idim_benches::{Case, jobs, reduction};
use idim_model::{JointStates, RegressorWorkspace, torque_regressor, torque_regressor_into};
use std::hint::black_box;

/// Samples of a batch; not a power of two, or the joints' arrays would share the sets of the first-level cache.
const SAMPLES: usize = 1000;

/// Twin: `pin_native` regressor_call and `gb_ur5_base_8`, `gb_ur5_full_8` with_sincos (`gb_panda_*` for seven joints),
/// both per sample.
fn regressor(c: &mut Criterion) {
    for case in [Case::ur5(), Case::panda()] {
        let states = case.states(SAMPLES);
        let mut group = c.benchmark_group(format!("regressor/{}", case.name));
        for (name, columns) in [("base", &case.base), ("standard", &case.standard)] {
            group.bench_function(format!("{name}/batch of {SAMPLES}"), |b| {
                b.iter(|| jobs::regressor_batch(&case, columns, &states));
            });
            let state = states.state(0);
            let mut workspace = RegressorWorkspace::new(&case.model, columns);
            let mut out = vec![0.0; case.model.n_joints() * columns.len()];
            group.bench_function(format!("{name}/one sample, room kept"), |b| {
                b.iter(|| {
                    torque_regressor_into(&case.model, &mut workspace, &state, &mut out);
                    black_box(&out);
                });
            });
            group.bench_function(format!("{name}/one sample"), |b| {
                b.iter(|| black_box(torque_regressor(&case.model, columns, &state)));
            });
        }
    }
}

/// Twin: `pin_native` regressor_call times the samples, plus `cond_eigen` Gram + SelfAdjointEigenSolver (bench_cond.py).
fn condition(c: &mut Criterion) {
    let case = Case::ur5();
    let mut group = c.benchmark_group("condition");
    for n in [100, 1000, 10_000] {
        let states = case.states(n);
        group.bench_function(format!("information matrix/{n}"), |b| {
            b.iter(|| jobs::information(&case, &states));
        });
        group.bench_function(format!("states to number/{n}"), |b| {
            b.iter(|| black_box(jobs::condition(&case, &states)));
        });
        group.bench_function(format!("gradient of the logarithm/{n}"), |b| {
            b.iter(|| jobs::gradient(&case, &states));
        });
    }
}

/// Twin: bench_base_figaroh.py.
fn reduce(c: &mut Criterion) {
    for case in [Case::ur5(), Case::panda()] {
        let order: Vec<usize> = (0..case.standard.len()).collect();
        c.bench_function(&format!("reduction/{}", case.name), |b| {
            b.iter(|| black_box(reduction(&case.robot, &case.model, &case.standard, &order)));
        });
    }
}

/// Twin: one start of bench_exciting.py (SLSQP, 100 iterations).
fn excitation(c: &mut Criterion) {
    let case = Case::ur5();
    let mut group = c.benchmark_group("excitation");
    group.sample_size(10);
    group.bench_function("one start", |b| {
        b.iter(|| black_box(jobs::excitation_start(&case, 0)));
    });
}

/// Twin: bench_ls.py, chunked normal equations, one million samples of 48 columns.
fn least_squares(c: &mut Criterion) {
    let case = Case::ur5();
    let columns = case.with_friction();
    let states: JointStates = case.states(1_000_000);
    let torques = jobs::torques(&case, &columns, &states);
    let mut group = c.benchmark_group("least squares");
    group.sample_size(10);
    group.bench_function("a million samples, 48 columns", |b| {
        b.iter(|| black_box(jobs::least_squares(&case, &columns, &states, &torques)));
    });
    group.bench_function("the same by running QR", |b| {
        b.iter(|| black_box(jobs::least_squares_qr(&case, &columns, &states, &torques)));
    });
}

criterion_group!(
    benches,
    regressor,
    condition,
    reduce,
    excitation,
    least_squares
);
criterion_main!(benches);
