//! The arms of both papers, against an independent program (fixtures/oracles/generate_base_params.py).
#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use idim_base_params::{Reduction, ReductionOptions, TriangularFactor, reduce};
use serde_json::Value;

/// Regrouping against closed forms, absolute; the coefficients are of the order of 1.
const CLOSED_FORM: f64 = 1e-12;
/// The oracle's relations are rounded to 1e-10.
const ORACLE_ROUNDED: f64 = 2e-10;

fn gautier_khalil() -> Value {
    serde_json::from_str(include_str!(
        "../../../fixtures/oracles/base_params_gk.json"
    ))
    .unwrap()
}

fn crs_a460() -> Value {
    serde_json::from_str(include_str!(
        "../../../fixtures/oracles/base_params_crs.json"
    ))
    .unwrap()
}

fn strings(value: &Value) -> Vec<String> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|name| name.as_str().unwrap().to_owned())
        .collect()
}

fn factor(rows: &Value) -> TriangularFactor {
    let rows = rows.as_array().unwrap();
    let mut factor = TriangularFactor::new(rows[0].as_array().unwrap().len());
    for row in rows {
        let row: Vec<f64> = row
            .as_array()
            .unwrap()
            .iter()
            .map(|value| value.as_f64().unwrap())
            .collect();
        factor.push_rows(&row);
    }
    factor
}

fn index(names: &[String], name: &str) -> usize {
    names.iter().position(|known| known == name).unwrap()
}

fn names_of(columns: &[usize], names: &[String]) -> Vec<String> {
    columns
        .iter()
        .map(|column| names[*column].clone())
        .collect()
}

/// Every entry of `K` against `expected`, whose missing entries are zero.
fn assert_regrouping(
    reduction: &Reduction,
    names: &[String],
    expected: &BTreeMap<(String, String), f64>,
    within: f64,
) {
    for (b, &base) in reduction.base.iter().enumerate() {
        for (column, name) in names.iter().enumerate() {
            let expected = expected
                .get(&(names[base].clone(), name.clone()))
                .copied()
                .unwrap_or(0.0);
            let found = reduction.regrouping[(b, column)];
            let size = expected.abs().max(1.0);
            assert!(
                (found - expected).abs() <= within * size,
                "{} of {name}: {found}, not {expected}",
                names[base]
            );
        }
    }
}

#[test]
fn oracle_gautier_khalil_names_and_closed_forms() {
    let oracle = gautier_khalil();
    let names = strings(&oracle["names"]);
    let order: Vec<usize> = (0..30).collect();
    let reduction = reduce(
        &factor(&oracle["rows"]),
        &order,
        &ReductionOptions::default(),
    );

    assert!(reduction.ambiguity.is_none() && reduction.ghosts.is_empty());
    assert!(reduction.rank_gap > 1e10);
    assert_eq!(reduction.rank(), 15);
    let vanishing = [
        "XX1", "XY1", "XZ1", "YY1", "YZ1", "MX1", "MY1", "MZ1", "M1", "MZ2", "M2",
    ];
    assert_eq!(names_of(&reduction.unidentifiable, &names), vanishing);
    assert_eq!(names_of(&reduction.base, &names), strings(&oracle["base"]));
    assert_eq!(
        names_of(&reduction.combined, &names),
        ["YY2", "YY3", "MZ3", "M3"]
    );
    assert_eq!(reduction.base_names(&names), strings(&oracle["base_names"]));

    let (d, r) = (
        oracle["d3"].as_f64().unwrap(),
        oracle["r3"].as_f64().unwrap(),
    );
    let mut expected: BTreeMap<(String, String), f64> = strings(&oracle["base"])
        .into_iter()
        .map(|base| ((base.clone(), base), 1.0))
        .collect();
    for (base, name, value) in [
        ("ZZ1", "YY2", 1.0),
        ("ZZ1", "YY3", 1.0),
        ("ZZ1", "MZ3", 2.0 * r),
        ("ZZ1", "M3", d * d + r * r),
        ("XX2", "YY2", -1.0),
        ("XX2", "M3", -d * d),
        ("XZ2", "MZ3", -d),
        ("XZ2", "M3", -d * r),
        ("ZZ2", "M3", d * d),
        ("MX2", "M3", d),
        ("XX3", "YY3", -1.0),
    ] {
        expected.insert((base.to_owned(), name.to_owned()), value);
    }
    assert_regrouping(&reduction, &names, &expected, CLOSED_FORM);
}

#[test]
fn oracle_gautier_khalil_relations_as_printed() {
    let oracle = gautier_khalil();
    let names = strings(&oracle["names"]);
    let order: Vec<usize> = (0..30).collect();
    let reduction = reduce(
        &factor(&oracle["rows"]),
        &order,
        &ReductionOptions::default(),
    );
    let relations: Vec<String> = (0..15).map(|b| reduction.relation(b, &names)).collect();
    assert_eq!(
        relations,
        [
            "ZZR1 = ZZ1 + YY2 + YY3 + 0.4 MZ3 + 0.29 M3",
            "XXR2 = XX2 - YY2 - 0.25 M3",
            "XY2",
            "XZR2 = XZ2 - 0.5 MZ3 - 0.1 M3",
            "YZ2",
            "ZZR2 = ZZ2 + 0.25 M3",
            "MXR2 = MX2 + 0.5 M3",
            "MY2",
            "XXR3 = XX3 - YY3",
            "XY3",
            "XZ3",
            "YZ3",
            "ZZ3",
            "MX3",
            "MY3",
        ]
    );
}

#[test]
fn oracle_crs_a460_categories_in_six_orders() {
    let oracle = crs_a460();
    let names = strings(&oracle["names"]);
    let factor = factor(&oracle["standard_dh"]);
    let cases = oracle["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 6);
    for case in cases {
        let order: Vec<usize> = strings(&case["order"])
            .iter()
            .map(|name| index(&names, name))
            .collect();
        let reduction = reduce(&factor, &order, &ReductionOptions::default());
        assert!(reduction.ambiguity.is_none() && reduction.ghosts.is_empty());
        let lists = [
            ("unidentifiable", &reduction.unidentifiable, 9),
            ("identifiable_alone", &reduction.identifiable_alone, 21),
            ("combined", &reduction.combined, 15),
            ("base", &reduction.base, 36),
        ];
        for (key, found, count) in lists {
            assert_eq!(names_of(found, &names), strings(&case[key]), "{key}");
            assert_eq!(found.len(), count, "{key}");
        }
        let mut expected: BTreeMap<(String, String), f64> = strings(&case["base"])
            .into_iter()
            .map(|base| ((base.clone(), base), 1.0))
            .collect();
        for (column, relation) in case["column_relations"].as_object().unwrap() {
            for (base, alpha) in relation.as_object().unwrap() {
                expected.insert((base.clone(), column.clone()), alpha.as_f64().unwrap());
            }
        }
        assert_regrouping(&reduction, &names, &expected, ORACLE_ROUNDED);
    }
}

#[test]
fn oracle_crs_a460_regrouping_and_printed_relations() {
    let oracle = crs_a460();
    let names = strings(&oracle["names"]);
    let order: Vec<usize> = (0..60).collect();
    let reduction = reduce(
        &factor(&oracle["standard_dh"]),
        &order,
        &ReductionOptions::default(),
    );
    let expected = oracle["regrouping"]
        .as_array()
        .unwrap()
        .iter()
        .map(|entry| {
            let name = |at: usize| entry[at].as_str().unwrap().to_owned();
            ((name(0), name(1)), entry[2].as_f64().unwrap())
        });
    assert_regrouping(&reduction, &names, &expected.collect(), CLOSED_FORM);

    let relation = |name: &str| reduction.column_relation(index(&names, name), &names);
    assert_eq!(relation("Iyy2"), "Iyy2 = Iyy1 - Ixx2");
    assert_eq!(
        relation("Izz2"),
        "Izz2 = -Iyy1 - 10.76391 m2 + 3.2808399 mx2 + Ixx2"
    );
    assert_eq!(
        relation("m5"),
        "m5 = m2 + 0.3302 mz3 + 0.10903204 Ixx3 + 0.10903204 Iyy3"
    );
    assert_eq!(relation("mz6"), "mz6 = mz5 + 0.1524 Ixx5 + 0.1524 Iyy5");
    assert_eq!(reduction.relation(34, &names), "Ixz6");
}

#[test]
fn oracle_crs_a460_counts_depend_on_the_frames() {
    // The same arm with frames on the joint side: 11 vanish, 13 combined; columns of cos(pi/2) are among those that vanish.
    let oracle = crs_a460();
    let order: Vec<usize> = (0..60).collect();
    let reduction = reduce(
        &factor(&oracle["modified_dh"]),
        &order,
        &ReductionOptions::default(),
    );
    assert!(reduction.ambiguity.is_none() && reduction.ghosts.is_empty());
    let counts = [
        &reduction.unidentifiable,
        &reduction.combined,
        &reduction.base,
    ]
    .map(Vec::len);
    assert_eq!(counts, [11, 13, 36]);
}
