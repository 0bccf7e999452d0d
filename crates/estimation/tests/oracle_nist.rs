//! NIST Statistical Reference Datasets, answers certified in exact rational arithmetic (fixtures/oracles/generate_nist.py).
#![allow(clippy::unwrap_used)]

mod common;

use idim_estimation::{Estimate, solve};

struct Certified {
    fit: Estimate,
    values: Vec<f64>,
    standard_deviation: Vec<f64>,
}

fn run(text: &str) -> Certified {
    let json: serde_json::Value = serde_json::from_str(text).unwrap();
    let list = |key: &str| -> Vec<f64> {
        json[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect()
    };
    let n = usize::try_from(json["n_columns"].as_u64().unwrap()).unwrap();
    let fit = solve(&common::factor(&list("w"), &list("y"), n))
        .unwrap()
        .determined()
        .unwrap();
    Certified {
        fit,
        values: list("values"),
        standard_deviation: list("standard_deviation"),
    }
}

/// Log relative error, the number of correct digits: `min(15, -log10 |c - t|/|t|)`, worst entry.
fn digits(computed: &[f64], truth: &[f64]) -> f64 {
    let worst = common::worst(computed, truth);
    if worst == 0.0 {
        15.0
    } else {
        (-worst.log10()).min(15.0)
    }
}

#[track_caller]
fn gate(name: &str, text: &str, values: f64) -> Certified {
    let certified = run(text);
    let found = digits(&certified.fit.values, &certified.values);
    eprintln!(
        "{name}: values {found:.2} digits, {:?}",
        certified.fit.condition_number
    );
    assert!(
        found >= values,
        "{name}: {found:.2} digits of the values, {values} required"
    );
    if certified.standard_deviation[0] > 0.0 {
        let found = digits(
            &certified.fit.standard_deviation,
            &certified.standard_deviation,
        );
        eprintln!("{name}: standard deviations {found:.2} digits");
        assert!(
            found >= values - 1.0,
            "{name}: {found:.2} digits of the standard deviations"
        );
    } else {
        // Exact data: the stated deviation is rounding.
        assert!(certified.fit.relative_error() < 1e-14);
    }
    certified
}

#[test]
fn oracle_norris() {
    let certified = gate(
        "Norris",
        include_str!("../../../fixtures/oracles/nist_norris.json"),
        12.0,
    );
    assert!(!certified.fit.near_singular);
}

#[test]
fn oracle_longley() {
    let certified = gate(
        "Longley",
        include_str!("../../../fixtures/oracles/nist_longley.json"),
        9.0,
    );
    assert!(!certified.fit.near_singular);
}

#[test]
fn oracle_wampler1() {
    gate(
        "Wampler1",
        include_str!("../../../fixtures/oracles/nist_wampler1.json"),
        9.0,
    );
}

#[test]
fn oracle_wampler2() {
    gate(
        "Wampler2",
        include_str!("../../../fixtures/oracles/nist_wampler2.json"),
        12.5,
    );
}

#[test]
fn oracle_filip_is_solved_and_said_to_be_near_singular() {
    let certified = gate(
        "Filip",
        include_str!("../../../fixtures/oracles/nist_filip.json"),
        7.0,
    );
    assert_eq!(certified.fit.rank, 11, "never truncated");
    assert!(certified.fit.near_singular);
}
