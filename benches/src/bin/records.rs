//! How good the motions are that the searches find, and what they cost: the table of `benches/README.md`.
//!
//! `cargo run --release -p idim-benches --bin records [slsqp|a460|arm7|points] [more]`; `more` multiplies the effort.
#![allow(clippy::print_stdout)]

use idim::{KeepOrder, Structure};
use idim_excitation::{
    Clearance, Criterion, EnergyDesign, FourierDesign, FourierOptions, PointLimits,
    PointSearchOptions, Scaling, TorquePrior, optimise_fourier, search_points,
};
use idim_model::{Columns, DriveColumns, Model, Notation, robot_from_ron, robot_from_urdf};
use idim_trajectory::{FourierSeries, Limits};
use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;
use std::time::Instant;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let more = words.iter().find_map(|w| w.parse().ok()).unwrap_or(1);
    let asked = |name: &str| {
        let named = words.iter().any(|w| w == name);
        named || words.iter().all(|w| w.parse::<usize>().is_ok())
    };
    println!(
        "{:<52} {:>9} {:>9} {:>8} {:>8} {:>9}",
        "search", "found", "record", "cpu / s", "wall / s", "evals"
    );
    if asked("slsqp") {
        slsqp(more);
    }
    if asked("a460") {
        a460(more);
    }
    if asked("arm7") {
        arm7();
    }
    if asked("points") {
        points(more);
    }
}

/// Value, seconds of all threads, seconds on the clock.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64, f64) {
    let (cpu, wall) = (process_seconds(), Instant::now());
    let found = work();
    (found, process_seconds() - cpu, wall.elapsed().as_secs_f64())
}

fn process_seconds() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

fn line(what: &str, found: f64, record: f64, (cpu, wall): (f64, f64), evaluations: usize) {
    println!("{what:<52} {found:>9.3} {record:>9.3} {cpu:>8.3} {wall:>8.3} {evaluations:>9}");
}

/// Twin: `bench_exciting.py --starts 5`; its final condition numbers are the records.
fn slsqp(more: usize) {
    let text = include_str!("../../../fixtures/oracles/fourier_motions.json");
    let oracle: serde_json::Value = serde_json::from_str(text).expect("a fixture");
    let oracle = &oracle["ur5"];
    let names: Vec<String> = serde_json::from_value(oracle["base"].clone()).expect("names");
    let all = Columns::inertial(6);
    let known = all.names(Notation::Tensor);
    let place = |name: &String| known.iter().position(|k| k == name).expect("a column");
    let columns = all.select(&names.iter().map(place).collect::<Vec<_>>());
    let speed = serde_json::from_value(oracle["velocity_limit"].clone()).expect("speeds");
    let limits = Limits::new(vec![[-3.0, 3.0]; 6], speed, vec![10.0; 6]).expect("limits");
    let model = Model::new(&robot_from_urdf(idim_fixtures::UR5_URDF).expect("a fixture"));
    for start in oracle["starts"].as_array().expect("starts") {
        let c: Vec<f64> = serde_json::from_value(start["coefficients"].clone()).expect("numbers");
        let options = FourierOptions {
            starts: vec![FourierSeries::from_coefficients(TAU / 10.0, 6, 5, &c).expect("finite")],
            n_starts: 1,
            n_rounds: 0,
            ..FourierOptions::default()
        };
        let (found, cpu, wall) = timed(|| optimise_fourier(&model, &columns, &limits, &options));
        let found = found.expect("a motion");
        line(
            &format!("UR5, start {} of SLSQP", start["seed"]),
            found.conditioning.raw.two_norm,
            start["slsqp_cond"].as_f64().unwrap_or(f64::NAN),
            (cpu, wall),
            found.n_evaluations,
        );
    }
    for (n_starts, n_rounds) in [(8, 0), (8, 2), (16 * more, 4), (32 * more, 8)] {
        let options = FourierOptions {
            n_starts,
            n_rounds,
            seed: 1,
            ..FourierOptions::default()
        };
        let (found, cpu, wall) = timed(|| optimise_fourier(&model, &columns, &limits, &options));
        let found = found.expect("a motion");
        line(
            &format!("UR5, {n_starts} starts, {n_rounds} rounds"),
            found.conditioning.raw.two_norm,
            4.6,
            (cpu, wall),
            found.n_evaluations,
        );
    }
}

/// The number of a design that a record is about.
type Pick = fn(&FourierDesign) -> f64;

/// Best known motions: papers/README.md of the project.
fn a460(more: usize) {
    let robot = robot_from_ron(idim_fixtures::CRS_A460).expect("a fixture");
    let structure = Structure::of_torque(&robot, DriveColumns::NONE, KeepOrder::MassFirst);
    let limits = Limits::from_robot(&robot).expect("a fixture");
    let model = Model::new(&robot);
    let records: [(&str, Criterion, f64, Pick); 3] = [
        ("raw", Criterion::TwoNorm(Scaling::Raw), 43.88, |d| {
            d.conditioning.raw.two_norm
        }),
        (
            "equilibrated",
            Criterion::TwoNorm(Scaling::Equilibrated),
            16.29,
            |d| d.conditioning.equilibrated.two_norm,
        ),
        ("log det", Criterion::LogDet, 188.84, |d| {
            d.conditioning.log_det
        }),
    ];
    for (n_starts, n_rounds) in [(4, 1), (8, 2), (16 * more, 4)] {
        for (name, criterion, record, pick) in records {
            let options = FourierOptions {
                criterion,
                n_starts,
                n_rounds,
                seed: 1,
                ..FourierOptions::default()
            };
            let columns = structure.base_columns();
            let (found, cpu, wall) =
                timed(|| optimise_fourier(&model, &columns, &limits, &options));
            let found = found.expect("a motion");
            assert!(found.certificate.certified, "only certified motions return");
            line(
                &format!("A460, {name}, {n_starts} starts, {n_rounds} rounds"),
                pick(&found),
                record,
                (cpu, wall),
                found.n_evaluations,
            );
        }
    }
}

/// Seven joints, with torque limits by the prior and clearance of capsules; twice with and without.
fn arm7() {
    let robot = robot_from_ron(idim_fixtures::ARM7).expect("a fixture");
    let structure = Structure::of_torque(&robot, DriveColumns::NONE, KeepOrder::Links);
    let (columns, model) = (structure.base_columns(), Model::new(&robot));
    let limits = Limits::from_robot(&robot).expect("a fixture");
    for conditions in [false, true] {
        let torque = TorquePrior::new(&robot, 0.8).expect("a fixture");
        let options = FourierOptions {
            torque: conditions.then_some(torque),
            clearance: Clearance::new(&robot, 0.02)
                .expect("a fixture")
                .filter(|_| conditions),
            n_starts: 8,
            n_rounds: 1,
            seed: 1,
            ..FourierOptions::default()
        };
        let (found, cpu, wall) = timed(|| optimise_fourier(&model, &columns, &limits, &options));
        let found = found.expect("a motion");
        let n_failed = found.values.iter().filter(|v| v.is_infinite()).count();
        let what = if conditions {
            format!("arm7, torques and clearance, {n_failed} searches failed")
        } else {
            "arm7, free".into()
        };
        line(
            &what,
            found.conditioning.raw.two_norm,
            f64::NAN,
            (cpu, wall),
            found.n_evaluations,
        );
        if let (Some(t), Some(c)) = (&found.torque, &found.clearance) {
            let most = t
                .joints
                .iter()
                .flatten()
                .map(|u| u.bound)
                .fold(0.0, f64::max);
            println!(
                "  torques at most {:.2} % of the limits (80 allowed), distance at least {:.4} m (0.02 asked)",
                100.0 * most,
                c.bound
            );
        }
    }
}

/// Gautier & Khalil's points at the inferred limits.
fn points(more: usize) {
    let robot = robot_from_ron(idim_fixtures::PUMA3R).expect("a fixture");
    let structure = Structure::of_energy(&robot, KeepOrder::Links);
    let (q2, q3) = (60_f64.to_radians(), 70_f64.to_radians());
    let limits = PointLimits {
        position: vec![[-PI, PI], [-q2, q2], [-q3, q3]],
        velocity: vec![0.69, 0.61, 0.64],
    };
    let design = EnergyDesign::new(&robot, &structure.base_columns(), limits).expect("limits");
    for (n_rows, limit, record, n_rounds) in [
        (30, None, 12.82, 60),
        (50, None, 8.68, 40),
        (100, None, 4.74, 20),
        (30, Some(175.0), 16.59, 60),
    ] {
        let options = PointSearchOptions {
            n_rows,
            criterion: Criterion::TwoNorm(Scaling::Raw),
            limit_of_equilibrium: limit,
            n_starts: 100,
            n_rounds: n_rounds * more,
            seed: 1,
        };
        let mut go_on = |_| ControlFlow::Continue(());
        let (found, cpu, wall) = timed(|| search_points(&design, &options, &mut go_on));
        let found = found.expect("points");
        let s = found.conditioning.equilibrium.map_or(f64::NAN, |s| s.ratio);
        line(
            &format!(
                "points, r = {n_rows}, {} rounds, S = {s:.1}",
                options.n_rounds
            ),
            found.conditioning.raw.two_norm,
            record,
            (cpu, wall),
            found.n_evaluations,
        );
    }
}
