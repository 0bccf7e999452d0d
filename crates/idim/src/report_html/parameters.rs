//! The parameters, how sure they are, and what they are combinations of.

use super::blocks::{Block, Cell, bar, figures, word};
use super::data::ReportData;
use crate::meaning::{legend, parameter_unit};
use crate::result::{DownWeightedResult, DroppedResult, ParameterResult};
use crate::table::{number, optional};

pub(super) fn parameters(data: &ReportData) -> Vec<Block> {
    let Some(estimate) = &data.result.estimate else {
        return Vec::new();
    };
    let bars = estimate.parameters.iter().any(|p| p.std.is_some());
    let mut about = format!("Made by {}.", estimate.method);
    let mut header = vec![
        word("parameter"),
        figures("value"),
        figures("std"),
        figures("std %"),
        word("unit"),
    ];
    if bars {
        about += " A bar is the 95 % interval beside the size of the value: the dot is the value, the dashed line at the left end is zero. A red bar reaches zero, so the sign is not certain.";
        header.push(word("95 % interval beside the value"));
    }
    let rows = estimate
        .parameters
        .iter()
        .map(|p| row(p, data, bars))
        .collect();
    let names = estimate.parameters.iter().map(|p| p.name.as_str());
    let mut blocks = vec![
        Block::Text(about),
        Block::table("Base parameters, SI", header, rows),
        Block::Soft(format!("{}.", legend(names, data.robot).join("; "))),
    ];
    blocks.extend(dropped(&estimate.dropped, data));
    blocks.extend(down_weighted(&estimate.down_weighted, data));
    blocks
}

/// What an essential fit left out.
fn dropped(dropped: &[DroppedResult], data: &ReportData) -> Option<Block> {
    let header = vec![
        word("parameter"),
        figures("value in the full fit"),
        figures("95 % interval"),
        word("unit"),
    ];
    let rows = dropped.iter().map(|d| {
        vec![
            word(&d.name),
            figures(number(d.value)),
            figures(format!("{} to {}", number(d.low), number(d.high))),
            word(parameter_unit(&d.name, data.robot)),
        ]
    });
    let caption = "Left out because the residual does not miss them: small beside their uncertainty, not zero";
    (!dropped.is_empty()).then(|| Block::table(caption, header, rows.collect()))
}

/// Spans of time that a robust fit took the say from.
fn down_weighted(spans: &[DownWeightedResult], data: &ReportData) -> Option<Block> {
    let header = vec![
        word("log"),
        figures("from / s"),
        figures("to / s"),
        word("joints"),
        figures("lowest weight"),
    ];
    let rows = spans.iter().map(|s| {
        let joints = data.robot.joints();
        let name = |j: &usize| joints.get(j - 1).map_or("", |j| j.name.as_str());
        let names: Vec<&str> = s.joints.iter().map(name).collect();
        vec![
            word(&s.log),
            figures(format!("{:.3}", s.from)),
            figures(format!("{:.3}", s.to)),
            word(names.join(", ")),
            figures(format!("{:.2}", s.lowest_weight)),
        ]
    });
    let caption = "Spans that lost their say, because their residuals are far from the others'";
    (!spans.is_empty()).then(|| Block::table(caption, header, rows.collect()))
}

fn row(p: &ParameterResult, data: &ReportData, bars: bool) -> Vec<Cell> {
    let percent = p
        .relative_std
        .map_or_else(|| "-".into(), |s| format!("{:.1}", 100.0 * s));
    let mut cells = vec![
        word(&p.name),
        figures(optional(p.value)),
        figures(optional(p.std)),
        figures(percent),
        word(parameter_unit(&p.name, data.robot)),
    ];
    if bars {
        cells.push(p.relative_std.map_or_else(Cell::default, bar));
    }
    cells
}

pub(super) fn identifiable(data: &ReportData) -> Vec<Block> {
    let r = &data.result.reduction;
    let mut blocks = vec![
        Block::Text(format!(
            "Of {} standard parameters no torque depends on {}, and {} are felt in combinations only. What is left are {} base parameters, {} of which stand for themselves. The rank is clear by a factor of {}.",
            r.standard.len(), r.unidentifiable.len(), r.combined.len(), r.base.len(), r.identifiable_alone.len(), number(r.rank_gap),
        )),
        Block::Soft("An R before the number marks a combination: the estimate of ZZR1 is the sum on the right of its relation, not ZZ1 itself.".into()),
        // What nothing is regrouped into stands in the list of those for themselves.
        Block::Relations(
            r.base
                .iter()
                .filter(|b| b.relation != b.name)
                .map(|b| b.relation.clone())
                .collect(),
        ),
    ];
    let lists = [
        ("No torque depends on", &r.unidentifiable),
        ("In combinations only", &r.combined),
        ("For themselves", &r.identifiable_alone),
    ];
    for (what, names) in lists.into_iter().filter(|(_, names)| !names.is_empty()) {
        blocks.push(Block::Soft(format!("{what}: {}.", names.join(", "))));
    }
    blocks
}
