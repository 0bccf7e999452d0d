//! The chapter that proves the model: measured torques against predicted ones, and against those of simpler models.

use super::blocks::{Block, Cell, figures as digits, word};
use super::charts::torque_chart;
use super::data::{ReportData, drive_words};
use super::verdict::{low_r2, quoted};
use crate::result::{ErrorResult, JointError};
use crate::table::number;

const TORQUES: &[(&str, &str)] = &[("a", "measured"), ("b", "predicted"), ("c", "residual")];

pub(super) fn torque(data: &ReportData) -> Vec<Block> {
    if data.predictions.is_empty() {
        return Vec::new();
    }
    let (train, held_out) = (&data.result.train, &data.result.validation);
    let mut blocks = Vec::new();
    blocks.extend(
        held_out
            .as_ref()
            .map(|e| errors_table("Held-out motion, not seen by the estimate", &e.joints, data)),
    );
    blocks.extend(
        train
            .as_ref()
            .map(|e| errors_table("Training motion", &e.joints, data)),
    );
    blocks.extend(baselines(data));
    blocks.push(Block::Hint(
        "Drag over a picture to zoom, double-click to see all; with the keyboard + − ← → and 0. All joints move together. Shaded spans were held out.",
    ));
    for (j, joint) in data.robot.joints().iter().enumerate() {
        let (quantity, unit) = drive_words(joint.kind);
        let about = format!(
            "Measured and predicted {quantity} ({unit}) over time, and the residual below. {}",
            quoted(data, j, unit)
        );
        blocks.push(Block::figure(
            format!("torque-{}", j + 1),
            &joint.name,
            about,
            TORQUES,
            &torque_chart(data, j),
        ));
    }
    blocks
}

fn errors_table(caption: &str, joints: &[JointError], data: &ReportData) -> Block {
    // An energy model has one error for all joints.
    let per_joint = joints.len() == data.robot.n_joints();
    let mut header = vec![
        word("joint"),
        digits("rms of the residual"),
        digits("relative error %"),
        digits("R2"),
    ];
    if per_joint {
        header.push(digits("largest residual"));
    }
    let row = |(j, e): (usize, &JointError)| {
        let unit = if per_joint {
            drive_words(data.robot.joints()[j].kind).1
        } else {
            "J"
        };
        let mut cells = vec![
            word(&e.name),
            digits(format!("{} {unit}", number(e.rms))),
            digits(format!("{:.2}", 100.0 * e.relative_error)),
            Cell {
                low: low_r2(e.r2),
                ..digits(format!("{:.4}", e.r2))
            },
        ];
        if per_joint {
            cells.push(digits(format!("{} {unit}", number(e.largest))));
        }
        cells
    };
    Block::table(
        caption,
        header,
        joints.iter().enumerate().map(row).collect(),
    )
}

/// Held-out R2 of the model and of simpler ones, joint by joint.
fn baselines(data: &ReportData) -> Option<Block> {
    let r = data.result;
    let held_out = r.validation.as_ref().filter(|_| !r.baselines.is_empty())?;
    let in_band = r.validation_in_band.as_ref();
    let mut models = vec![("as identified", held_out)];
    models.extend(in_band.map(|e| ("as identified, torques filtered as for the fit", e)));
    models.extend(r.baselines.iter().map(|b| (b.name.as_str(), &b.errors)));
    let mut header = vec![word("joint")];
    header.extend(models.iter().map(|(name, _)| digits(*name)));
    let joint = |(j, own): (usize, &JointError)| {
        let r2 = |e: &ErrorResult| {
            e.joints.get(j).map_or_else(Cell::default, |e| Cell {
                low: low_r2(e.r2),
                ..digits(format!("{:.3}", e.r2))
            })
        };
        let cells = models.iter().map(|(_, e)| r2(e));
        std::iter::once(word(&own.name)).chain(cells).collect()
    };
    let mut rows: Vec<Vec<Cell>> = held_out.joints.iter().enumerate().map(joint).collect();
    let overall = |e: &ErrorResult| digits(format!("{:.2}", 100.0 * e.relative_error));
    let cells = models.iter().map(|(_, e)| overall(e));
    rows.push(
        std::iter::once(word("relative error %, all joints"))
            .chain(cells)
            .collect(),
    );
    Some(Block::table(
        "R2 on held-out motion beside simpler models: 1 is perfect, 0 no better than the mean torque, below 0 worse",
        header,
        rows,
    ))
}
