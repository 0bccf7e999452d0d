//! Pictures of a result, as SVG text.
//!
//! Functions of the numbers alone: same input, same bytes; nothing is written to disk here. Names that come from a
//! robot file stay text, whatever they contain.

mod canvas;
mod motion;
mod series;

pub(crate) use series::side_by_side;

pub use motion::motion_plot;

use canvas::{
    Area, DrawResult, GRAPHITE, LegendEntry, MEASURED, PREDICTED, Panel, RESIDUAL, SHADE, footer,
    header, render, significant,
};
use idim_model::JointKind;
use plotters::element::{EmptyElement, Rectangle, Text};
use plotters::series::LineSeries;
use plotters::style::Color;
use series::{decimate, padded_range, rms};

/// What a run of samples was used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The parameters were estimated from it.
    Training,
    /// Held out; it only tests the prediction.
    Validation,
}

/// Measured and predicted torque of one joint over an uninterrupted run of samples.
#[derive(Debug, Clone, Copy)]
pub struct TorqueRun<'a> {
    /// What the run was used for.
    pub part: Part,
    /// Time of each sample, s, ascending.
    pub time: &'a [f64],
    /// Measured torque of each sample, N·m (N for a prismatic joint).
    pub measured: &'a [f64],
    /// Torque the model predicts, same unit.
    pub predicted: &'a [f64],
}

/// Measured against predicted torque of one joint over time, and the residual below on its own scale.
///
/// Held-out runs are shaded. Runs whose clocks overlap are drawn one after another. At most 2000 points a curve: the
/// extremes of every short stretch, so that no peak is lost. Values that are not finite are left out.
///
/// # Panics
/// If the three slices of a run differ in length.
#[track_caller]
pub fn torque_plot(joint: &str, kind: JointKind, runs: &[TorqueRun]) -> String {
    for run in runs {
        let lengths = [run.time.len(), run.measured.len(), run.predicted.len()];
        assert!(
            lengths == [lengths[0]; 3],
            "time, measured and predicted of joint {joint} have lengths {lengths:?}"
        );
    }
    render(900, 560, |root| draw_torque(root, joint, kind, runs))
}

fn draw_torque(root: &Area, joint: &str, kind: JointKind, runs: &[TorqueRun]) -> DrawResult {
    let (quantity, unit) = match kind {
        JointKind::Revolute => ("torque", "N·m"),
        JointKind::Prismatic => ("force", "N"),
    };
    let (top, rest) = root.split_vertically(100);
    let (panels, bottom) = rest.split_vertically(rest.dim_in_pixel().1 - 60);
    let (upper, lower) = panels.split_vertically(640);
    header(
        &top,
        joint,
        &[
            LegendEntry("measured", MEASURED),
            LegendEntry("predicted", PREDICTED),
            LegendEntry("residual = measured − predicted", RESIDUAL),
        ],
    )?;

    let (times, shifted) = side_by_side(runs);
    let residuals: Vec<Vec<f64>> = runs
        .iter()
        .map(|r| {
            r.measured
                .iter()
                .zip(r.predicted)
                .map(|(m, p)| m - p)
                .collect()
        })
        .collect();
    let x = padded_range(times.iter().flatten().copied(), 0.0);
    let n_samples: usize = runs.iter().map(|r| r.time.len()).sum();
    let curve = |k: usize, y: &[f64]| decimate(&times[k], y, MAX_POINTS * y.len() / n_samples);

    let mut chart = Panel {
        x,
        y: padded_range(
            runs.iter()
                .flat_map(|r| r.measured.iter().chain(r.predicted).copied()),
            0.08,
        ),
        y_label: &format!("{quantity} / {unit}"),
    }
    .draw(&upper, |chart, y| shade_held_out(chart, runs, &times, y))?;
    for (k, run) in runs.iter().enumerate() {
        chart.draw_series(LineSeries::new(
            curve(k, run.measured),
            MEASURED.stroke_width(3),
        ))?;
        chart.draw_series(LineSeries::new(
            curve(k, run.predicted),
            PREDICTED.stroke_width(3),
        ))?;
    }

    let mut chart = Panel {
        x,
        y: padded_range(residuals.iter().flatten().copied(), 0.15),
        y_label: &format!("residual / {unit}"),
    }
    .draw(&lower, |chart, y| shade_held_out(chart, runs, &times, y))?;
    for (k, residual) in residuals.iter().enumerate() {
        chart.draw_series(LineSeries::new(
            curve(k, residual),
            RESIDUAL.stroke_width(2),
        ))?;
    }
    let x_label = if shifted {
        "time / s (runs one after another)"
    } else {
        "time / s"
    };
    let rms = rms_of_parts(runs, &residuals);
    footer(&bottom, x_label, 1, &format!("RMS {rms} {unit}"))
}

/// Root mean square of the residuals, training and held-out runs apart.
fn rms_of_parts(runs: &[TorqueRun], residuals: &[Vec<f64>]) -> String {
    let mut captions = Vec::new();
    for (part, word) in [
        (Part::Training, "training"),
        (Part::Validation, "validation"),
    ] {
        let of_part = runs.iter().zip(residuals).filter(|(r, _)| r.part == part);
        if let Some(value) = rms(of_part.flat_map(|(_, e)| e.iter().copied())) {
            captions.push(format!("{} ({word})", significant(value)));
        }
    }
    captions.join(", ")
}

/// Points a curve keeps: more than the pixels of the picture, few enough for a small file.
const MAX_POINTS: usize = 2000;

fn shade_held_out(
    chart: &mut canvas::Chart,
    runs: &[TorqueRun],
    times: &[Vec<f64>],
    [low, high]: [f64; 2],
) -> DrawResult {
    for (run, time) in runs.iter().zip(times) {
        if let (Part::Validation, Some(&first), Some(&last)) = (run.part, time.first(), time.last())
        {
            chart.draw_series([Rectangle::new([(first, low), (last, high)], SHADE.filled())])?;
            let inset = EmptyElement::at((first, high));
            let label = Text::new("held out", (10, 8), canvas::text_style(11, GRAPHITE));
            chart.draw_series([inset + label])?;
        }
    }
    Ok(())
}
