//! The chapters about torques, data, robot and the way to run it again.

use super::blocks::{Block, Cell, figures as digits, word};
use super::charts::{cutoff_chart, spectrum_chart};
use super::data::{LogSummary, ReportData, drive_words, position_unit};
use crate::table::{number, optional};
use idim_model::{Joint, JointKind};

pub(super) fn paper(data: &ReportData) -> Vec<Block> {
    let numbers = &data.result.paper;
    if numbers.is_empty() {
        return Vec::new();
    }
    let header = vec![
        word("number"),
        digits("printed"),
        digits("ours"),
        word("note"),
    ];
    let rows = numbers.iter().map(|n| {
        vec![
            word(&n.what),
            digits(optional(n.printed)),
            digits(number(n.ours)),
            word(&n.note),
        ]
    });
    vec![Block::table(
        "Our numbers beside the printed ones",
        header,
        rows.collect(),
    )]
}

pub(super) fn condition(data: &ReportData) -> Vec<Block> {
    let Some(estimate) = &data.result.estimate else {
        return Vec::new();
    };
    let c = &estimate.condition_number;
    let row = |name, value, meaning| vec![word(name), digits(optional(value)), word(meaning)];
    let rows = vec![
        row("raw", c.raw, "of W in SI units; depends on the units"),
        row(
            "equilibrated",
            c.equilibrated,
            "of W with unit columns; up to about 100 is well excited",
        ),
        row(
            "weighted",
            c.weighted,
            "of W with its rows whitened by the noise of the joints",
        ),
    ];
    let header = vec![word("condition number"), digits("value"), word("meaning")];
    let mut blocks = vec![Block::table(
        "2-norm condition numbers of the rows the estimate was made from",
        header,
        rows,
    )];
    if let Some(chart) = data.spectrum.and_then(spectrum_chart) {
        let about = "Singular values of the rows on a logarithmic axis, falling; a steep end is a combination the motion hardly shows.";
        let keys = &[("b", "of W in SI units"), ("c", "with unit columns")];
        blocks.push(Block::figure(
            "spectrum",
            "Singular values",
            about,
            keys,
            &chart,
        ));
    }
    blocks
}

pub(super) fn data(data: &ReportData) -> Vec<Block> {
    let mut blocks = Vec::new();
    if !data.logs.is_empty() {
        blocks.extend(logs_tables(data));
    }
    if !data.result.inferred.is_empty() {
        blocks.push(Block::Heading("How the files were read".into()));
        blocks.push(Block::List(data.result.inferred.clone()));
    }
    if !data.result.conditioning.is_empty() {
        blocks.push(Block::Heading("How the log became samples".into()));
        blocks.push(Block::List(data.result.conditioning.clone()));
    }
    if let Some(curve) = data.cutoff {
        let about = format!(
            "Error on held-out blocks over the cutoff; taken: {} Hz.",
            number(curve.chosen)
        );
        blocks.push(Block::figure(
            "cutoff",
            "Choice of the low-pass",
            about,
            &[("c", "held-out error")],
            &cutoff_chart(curve),
        ));
    }
    blocks
}

fn logs_tables(data: &ReportData) -> [Block; 2] {
    let header = vec![
        word("file"),
        word("use"),
        digits("samples"),
        digits("duration / s"),
        digits("rate / Hz"),
        word("velocities"),
    ];
    let row = |l: &LogSummary| {
        vec![
            word(&l.file),
            word(if l.training { "training" } else { "held out" }),
            digits(l.n_samples.to_string()),
            digits(format!("{:.2}", l.duration)),
            digits(number(l.rate)),
            word(if l.has_velocity {
                "recorded"
            } else {
                "from positions"
            }),
        ]
    };
    let logs = Block::table("Logs", header, data.logs.iter().map(row).collect());
    let header = vec![
        word("joint"),
        digits("lowest"),
        digits("highest"),
        digits("largest torque or force"),
    ];
    let rows = data
        .robot
        .joints()
        .iter()
        .enumerate()
        .map(|(j, joint)| moved(data, j, joint));
    [
        logs,
        Block::table("How far the joints moved", header, rows.collect()),
    ]
}

fn moved(data: &ReportData, j: usize, joint: &Joint) -> Vec<Cell> {
    let [low, high] = data
        .logs
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], l| {
            [a.min(l.position[j][0]), b.max(l.position[j][1])]
        });
    let torque = data.logs.iter().fold(0.0_f64, |a, l| a.max(l.torque[j]));
    let unit = position_unit(joint.kind);
    vec![
        word(&joint.name),
        digits(format!("{} {unit}", number(low))),
        digits(format!("{} {unit}", number(high))),
        digits(format!("{} {}", number(torque), drive_words(joint.kind).1)),
    ]
}

pub(super) fn doctor(data: &ReportData) -> Vec<Block> {
    let Some(findings) = data.findings else {
        return Vec::new();
    };
    if findings.is_empty() {
        return vec![Block::Text("Nothing wrong was found.".into())];
    }
    let header = ["code", "severity", "where", "met", "rule and next step"]
        .map(word)
        .into();
    let rows = findings.iter().map(|f| {
        [f.code.as_str(), f.severity, &f.place, &f.met, &f.rule]
            .map(word)
            .into()
    });
    vec![Block::table(
        "What was found before anything was computed",
        header,
        rows.collect(),
    )]
}

pub(super) fn figures(data: &ReportData) -> Vec<Block> {
    let pictures = data.figures.iter();
    pictures
        .map(|(title, svg)| Block::Picture(title.clone(), svg.clone()))
        .collect()
}

pub(super) fn robot(data: &ReportData) -> Vec<Block> {
    let g = data.robot.gravity();
    let range = |j: &Joint| {
        j.limits.position.map_or_else(
            || "-".into(),
            |[a, b]| format!("{} to {} {}", number(a), number(b), position_unit(j.kind)),
        )
    };
    let header = vec![
        word("joint"),
        word("moves"),
        word("link"),
        word("range"),
        digits("gear ratio"),
        word("inertia in the file"),
    ];
    let rows = data
        .robot
        .joints()
        .iter()
        .zip(data.robot.links())
        .map(|(joint, link)| {
            vec![
                word(&joint.name),
                word(match joint.kind {
                    JointKind::Revolute => "turns",
                    JointKind::Prismatic => "slides",
                }),
                word(&link.name),
                word(range(joint)),
                digits(optional(joint.actuator.gear_ratio)),
                word(if link.inertial.is_some() {
                    "stated"
                } else {
                    "not known"
                }),
            ]
        });
    let mut blocks = vec![
        Block::Text(format!(
            "Gravity in the base frame: ({}, {}, {}) m/s².",
            g.x, g.y, g.z
        )),
        Block::table("Joints and links", header, rows.collect()),
    ];
    // What the result warns of is said at the top.
    let said = &data.result.warnings;
    let notes = data.robot.notes().iter().filter(|n| !said.contains(n));
    let notes: Vec<String> = notes.cloned().collect();
    if !notes.is_empty() {
        blocks.push(Block::List(notes));
    }
    blocks
}

pub(super) fn again(data: &ReportData) -> Vec<Block> {
    let r = data.result;
    let mut rows = vec![
        vec![word("idim"), word(format!("{} ({})", r.version, r.schema))],
        vec![word("seed"), word(r.seed.to_string())],
    ];
    rows.extend(
        data.settings
            .iter()
            .map(|(name, value)| vec![word(name), word(value)]),
    );
    vec![
        Block::Code(data.command.to_owned()),
        Block::table(
            "Settings and versions",
            vec![word("setting"), word("value")],
            rows,
        ),
        Block::Soft(
            "Same files, options and version give the same bits, whatever the number of threads."
                .into(),
        ),
    ]
}
