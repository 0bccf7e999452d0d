//! What the run says: tables for a person, numbers for `result.json`.

use super::exact::{ExactSearches, PRINTED_S};
use super::{Motion, ROWS, STARTS};
use crate::noise_study::{NoiseRow, NoiseStudy};
use crate::papers::{GautierKhalil, NoiseCell, NoiseTableRow};
use crate::report::reduction_text;
use crate::result::{
    ConditionResult, EstimateResult, IdentificationResult, PaperNumber, ParameterResult, SCHEMA,
};
use crate::structure::Structure;
use crate::table::{number, optional, table};
use idim_estimation::Estimate;
use idim_excitation::{ConditionNumbers, ConditionStatistics, Conditioning};

/// Everything the run found, beside what the paper prints.
pub(super) struct Found<'a> {
    pub(super) paper: &'a GautierKhalil,
    pub(super) structure: &'a Structure,
    pub(super) table2: &'a [ConditionStatistics],
    pub(super) motion: &'a Motion,
    pub(super) exact: &'a ExactSearches,
    pub(super) good: &'a NoiseStudy,
    pub(super) bad: &'a NoiseStudy,
}

pub(super) fn text(found: &Found) -> String {
    let mut out = String::from(
        "Gautier & Khalil 1991: exciting trajectories for base inertial parameters\n\n",
    );
    out += &reduction_text(
        "Energy-difference model of the 3R arm",
        &found.structure.to_result(),
    );
    out += &table2_text(found);
    out += &motion_text(found.motion);
    out += &exact_text(found.exact);
    out += &noise_text(
        "Table 3. Noise on Y (medians of 1000 draws)",
        ["||dY||/||Y||", "K_R"],
        &found.good.on_observations,
        &found.bad.on_observations,
        &found.paper.table3.rows,
    );
    out += &noise_text(
        "Table 4. Noise on W (medians of 1000 draws)",
        ["||dW||/||W||", "K_p"],
        &found.good.on_points,
        &found.bad.on_points,
        &found.paper.table4.rows,
    );
    out + &estimates_text(found)
}

fn table2_text(found: &Found) -> String {
    let paper = found.paper;
    let rows = found
        .table2
        .iter()
        .zip(&paper.table2)
        .zip(&paper.inferred_limits_random);
    let rows = rows.map(|((s, p), i)| {
        [
            s.n_rows.to_string(),
            number(s.min),
            number(s.median),
            number(s.mean),
            number(s.max),
            number(p.minimum),
            number(p.mean),
            optional(p.maximum),
            number(i.median),
        ]
    });
    let header = [
        "r",
        "min",
        "median",
        "mean",
        "max",
        "printed min",
        "printed mean",
        "printed max",
        "reference median",
    ];
    format!(
        "\nTable 2. Cond(W), 2-norm, raw, over 1000 random sequences; limits inferred (q2 ±60°, q3 ±70°, 0.69 0.61 0.64 rad/s), rows inferred\n{}",
        table(header, rows)
    )
}

fn motion_text(motion: &Motion) -> String {
    let c = &motion.points.conditioning;
    let row = |what: &str, pick: fn(&ConditionNumbers) -> f64| {
        [
            what.to_owned(),
            number(pick(&c.raw)),
            number(pick(&c.equilibrated)),
        ]
    };
    let rows = [
        row("2-norm by SVD", |c| c.two_norm),
        row("estimate by pivoted QR", |c| c.pivoted_qr),
        row("Frobenius, of W'W", |c| c.frobenius),
    ];
    let (joint, kind, most) = motion.certificate.largest();
    format!(
        "\nOptimised sequence, r = {ROWS}: Powell 1964 on the Frobenius condition of W'W, {STARTS} random starts, {} evaluations, searches (smaller point limits after an overshoot): {}\n\
         {}{}   log det(W'W/r) = {}   printed: Cond 11.16, S 175\n\
         Quintic path: {:.1} s (printed about 50 s); inside all limits at every instant: {}; largest use {:.1} % ({kind:?} of joint {}, at {:.2} s)\n",
        motion.points.n_evaluations,
        motion.attempts,
        table(["Cond(W)", "raw", "equilibrated"], rows),
        equilibrium(c),
        number(c.log_det),
        motion.path.duration(),
        if motion.certificate.certified {
            "yes"
        } else {
            "NO"
        },
        100.0 * most.fraction,
        joint + 1,
        most.time,
    )
}

fn exact_text(exact: &ExactSearches) -> String {
    let rows = [("S free", &exact.free), ("S at most 175", &exact.limited)].map(|(what, d)| {
        [
            what.to_owned(),
            number(d.conditioning.raw.two_norm),
            number(d.conditioning.equilibrated.two_norm),
            number(d.conditioning.equilibrium.map_or(f64::NAN, |s| s.ratio)),
            number(d.conditioning.log_det),
            d.n_evaluations.to_string(),
        ]
    });
    let header = [
        "",
        "Cond(W), raw",
        "equilibrated",
        "S",
        "log det(W'W/r)",
        "evaluations",
    ];
    format!(
        "\nThe same limits and r = {ROWS}, by exact gradients and many starts (not the paper's method)\n{}",
        table(header, rows)
    )
}

fn estimates_text(found: &Found) -> String {
    let (good, bad, paper) = (found.good, found.bad, found.paper);
    let rows = paper.table5.rows.iter().zip(&paper.table6.rows).enumerate();
    let rows = rows.map(|(k, (p5, p6))| {
        [
            p5.name.clone(),
            number(p5.value),
            number(good.estimate.values[k]),
            number(good.estimate.standard_deviation[k]),
            number(p5.std),
            number(bad.estimate.values[k]),
            number(bad.estimate.standard_deviation[k]),
            number(p6.std),
        ]
    });
    let header = [
        "X",
        "value",
        "optimised",
        "sigma",
        "printed sigma",
        "random",
        "sigma",
        "printed sigma",
    ];
    format!(
        "\nTables 5 and 6. One estimate at k = 0.01: Cond(W) {} (printed 11.16) and {} (printed 1020)\n{}",
        number(good.condition_number),
        number(bad.condition_number),
        table(header, rows)
    )
}

fn equilibrium(c: &Conditioning) -> String {
    c.equilibrium.as_ref().map_or_else(String::new, |s| {
        format!(
            "S = max|W|/min|W| = {}, {} without the {} zero entries",
            number(s.ratio),
            number(s.nonzero_ratio),
            s.n_zero
        )
    })
}

fn noise_text(
    title: &str,
    columns: [&str; 2],
    good: &[NoiseRow],
    bad: &[NoiseRow],
    printed: &[NoiseTableRow],
) -> String {
    let rows = good.iter().zip(bad).zip(printed).flat_map(|((g, b), p)| {
        let row = |label: &str, ours: &NoiseRow, p: &NoiseCell| {
            [
                format!("{} {label}", ours.k),
                number(ours.noise),
                number(p.noise),
                number(ours.error),
                number(p.error),
                number(ours.ratio),
                number(p.ratio),
                format!("{:.1} %", 100.0 * ours.within_bound),
            ]
        };
        [row("optimised", g, &p.optimum), row("random", b, &p.random)]
    });
    let [noise, ratio] = columns;
    format!(
        "\n{title}\n{}",
        table(
            [
                "k",
                noise,
                "printed",
                "||dX||/||X||",
                "printed",
                ratio,
                "printed",
                "inside bound"
            ],
            rows
        )
    )
}

pub(super) fn result(found: &Found, seed: u64) -> IdentificationResult {
    let (structure, good) = (found.structure, found.good);
    IdentificationResult {
        schema: SCHEMA,
        version: env!("CARGO_PKG_VERSION"),
        robot: "puma".into(),
        seed,
        reduction: structure.to_result(),
        estimate: Some(estimate_result(
            &good.estimate,
            &structure.base_names(),
            good.condition_number,
        )),
        excitation: Some(excitation_json(found.motion)),
        paper: paper_numbers(found),
        warnings: vec![
            "The paper gives no limits; those used here are inferred from its table 2.".into(),
            "The X of tables 5 and 6 is not physically realisable: used for linear algebra only."
                .into(),
        ],
        ..IdentificationResult::default()
    }
}

fn paper_numbers(found: &Found) -> Vec<PaperNumber> {
    let (paper, motion) = (found.paper, found.motion);
    let reduction = &found.structure.reduction;
    let mut numbers = vec![
        PaperNumber::new(
            "rank of the energy-difference model",
            Some(15.0),
            reduction.rank() as f64,
            "",
        ),
        PaperNumber::new(
            "vanishing columns",
            Some(11.0),
            reduction.unidentifiable.len() as f64,
            "counted from the model by the project's reference",
        ),
    ];
    let rows = found
        .table2
        .iter()
        .zip(&paper.table2)
        .zip(&paper.inferred_limits_random);
    for ((s, p), i) in rows {
        let r = s.n_rows;
        numbers.push(PaperNumber::new(
            format!("table 2, r = {r}: mean Cond(W)"),
            Some(p.mean),
            s.mean,
            "limits and r inferred",
        ));
        numbers.push(PaperNumber::new(
            format!("table 2, r = {r}: median Cond(W), reference at the same limits"),
            Some(i.median),
            s.median,
            "reference, not printed",
        ));
    }
    let c = &motion.points.conditioning;
    numbers.push(PaperNumber::new(
        "Cond(W) of the optimised sequence, r = 30",
        Some(11.16),
        c.raw.two_norm,
        "limits inferred; Powell's method",
    ));
    numbers.extend(exact_numbers(found.exact));
    let s = c.equilibrium.map_or(f64::NAN, |s| s.ratio);
    numbers.push(PaperNumber::new(
        "S of the optimised sequence",
        Some(175.0),
        s,
        "",
    ));
    numbers.push(PaperNumber::new(
        "duration of the path, s",
        Some(50.0),
        motion.path.duration(),
        "read off the figures",
    ));
    let studies = found
        .good
        .on_observations
        .iter()
        .zip(&found.bad.on_observations);
    for ((g, b), p) in studies.zip(&paper.table3.rows) {
        numbers.push(PaperNumber::new(
            format!("table 3, k = {}: ||dX||/||X|| random over optimised", g.k),
            Some(p.random.error / p.optimum.error),
            b.error / g.error,
            "medians of 1000 draws",
        ));
    }
    numbers
}

fn exact_numbers(exact: &ExactSearches) -> [PaperNumber; 2] {
    let number = |what: String, design: &idim_excitation::PointDesign| {
        PaperNumber::new(
            format!("Cond(W), r = {ROWS}, exact gradients, {what}"),
            Some(11.16),
            design.conditioning.raw.two_norm,
            "limits inferred; not the paper's method",
        )
    };
    [
        number("S free".into(), &exact.free),
        number(format!("S at most {PRINTED_S}"), &exact.limited),
    ]
}

fn excitation_json(motion: &Motion) -> serde_json::Value {
    let c = &motion.points.conditioning;
    serde_json::json!({
        "method": "Powell 1964 on the Frobenius condition of W'W, sin and sin^2 substitutions, random starts",
        "n_rows": ROWS,
        "n_starts": STARTS,
        "n_evaluations": motion.points.n_evaluations,
        "searches": motion.attempts,
        "condition_number": {
            "raw": c.raw.two_norm,
            "equilibrated": c.equilibrated.two_norm,
            "pivoted_qr_estimate": c.raw.pivoted_qr,
            "frobenius_of_information": c.raw.frobenius,
        },
        "s": c.equilibrium.map(|s| s.ratio),
        "log_det": c.log_det,
        "path": {
            "duration_s": motion.path.duration(),
            "certified": motion.certificate.certified,
            "largest_use": motion.certificate.largest().2.fraction,
        },
    })
}

fn estimate_result(e: &Estimate, names: &[String], condition: f64) -> EstimateResult {
    EstimateResult {
        method: "least squares on the optimised points, noise k = 0.01 on Y (simulated, table 5)"
            .into(),
        parameters: names
            .iter()
            .enumerate()
            .map(|(k, name)| ParameterResult {
                name: name.clone(),
                value: Some(e.values[k]),
                std: Some(e.standard_deviation[k]),
                relative_std: Some(e.relative_std[k]),
            })
            .collect(),
        condition_number: ConditionResult {
            raw: Some(condition),
            equilibrated: Some(e.condition_number.equilibrated),
            weighted: None,
        },
        ..EstimateResult::default()
    }
}
