//! A motion against its limits.

use super::canvas::{
    Area, DrawResult, LIMIT, LegendEntry, MEASURED, Panel, footer, header, render,
};
use super::series::{decimate, padded_range};
use idim_model::{JointKind, JointStates, Robot};
use idim_trajectory::Limits;
use plotters::series::LineSeries;
use plotters::style::Color;

/// Position, velocity and acceleration of every joint over time, each between its limits.
///
/// A row a joint, a column each for q, q̇, q̈. `time` in s, one entry a sample of `states`.
///
/// # Panics
/// If `time`, `states`, `limits` and `robot` differ in their number of samples or joints.
#[track_caller]
pub fn motion_plot(robot: &Robot, limits: &Limits, time: &[f64], states: &JointStates) -> String {
    let joints = [robot.n_joints(), limits.velocity.len()];
    assert!(
        joints == [states.n_joints(); 2],
        "robot and limits have {joints:?} joints, the motion {}",
        states.n_joints()
    );
    assert_eq!(time.len(), states.n_samples(), "times and samples");
    let height = HEADER + ROW * robot.n_joints() as u32 + FOOTER;
    render(1200, height, |root| {
        draw_motion(root, robot, limits, time, states)
    })
}

const HEADER: u32 = 50;
const ROW: u32 = 140;
const FOOTER: u32 = 30;
/// Points a curve keeps: as many as its panel has pixels.
const MAX_POINTS: usize = 800;

fn draw_motion(
    root: &Area,
    robot: &Robot,
    limits: &Limits,
    time: &[f64],
    states: &JointStates,
) -> DrawResult {
    let (top, rest) = root.split_vertically(2 * HEADER);
    header(
        &top,
        robot.name(),
        &[LegendEntry("motion", MEASURED), LegendEntry("limit", LIMIT)],
    )?;
    let (panels, bottom) = rest.split_vertically(rest.dim_in_pixel().1 - 2 * FOOTER);
    footer(&bottom, "time / s", 3, "")?;
    let cells = panels.split_evenly((robot.n_joints(), 3));
    let x = padded_range(time.iter().copied(), 0.0);
    for (j, joint) in robot.joints().iter().enumerate() {
        let unit = match joint.kind {
            JointKind::Revolute => "rad",
            JointKind::Prismatic => "m",
        };
        let (v, a) = (limits.velocity[j], limits.acceleration[j]);
        let columns = [
            (states.q(j), limits.position[j], "q", ""),
            (states.qd(j), [-v, v], "q̇", "/s"),
            (states.qdd(j), [-a, a], "q̈", "/s²"),
        ];
        for (column, (values, bounds, symbol, per)) in columns.into_iter().enumerate() {
            let mut chart = Panel {
                x,
                y: padded_range(values.iter().copied().chain(bounds), 0.08),
                y_label: &format!("{symbol}{} / {unit}{per}", j + 1),
            }
            .draw(&cells[3 * j + column], |_, _| Ok(()))?;
            let points = decimate(time, values, MAX_POINTS);
            chart.draw_series(LineSeries::new(points, MEASURED.stroke_width(3)))?;
            for bound in bounds {
                let line = [(x[0], bound), (x[1], bound)];
                chart.draw_series(LineSeries::new(line, LIMIT.stroke_width(2)))?;
            }
        }
    }
    Ok(())
}
