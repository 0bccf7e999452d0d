//! CPU time of the kernels beside the anchors' figures: run both in the same minute, on the same core.
#![allow(clippy::print_stdout)]

use idim_benches::{Case, cpu_time};
use idim_model::{torque_regressor, visit_torque_regressor};
use std::hint::black_box;

fn main() {
    for case in [Case::ur5(), Case::panda()] {
        println!("{}: {} base columns", case.name, case.base.len());
        regressor(&case);
    }
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
    let states = case.states(4096);
    for (name, columns) in [("base", &case.base), ("standard", &case.standard)] {
        let time = cpu_time(41, || {
            visit_torque_regressor(&case.model, columns, &states, |block| {
                black_box(block);
            });
        });
        line(&format!("regressor, {name}, batch"), time, 4096, "ns", 1e9);
    }
    let state = states.state(0);
    let time = cpu_time(41, || {
        for _ in 0..1000 {
            black_box(torque_regressor(&case.model, &case.base, &state));
        }
    });
    line("regressor, base, one sample", time, 1000, "ns", 1e9);
}
