//! What earlier logs already tell.

use super::ExciteOptions;
use crate::columns::ModelColumns;
use crate::error::Error;
use crate::identify::{IdentifyOptions, sampling};
use crate::samples::{Rows, push_rows, stated_stretches};
use faer::Mat;
use idim_measurement::Measurements;
use idim_model::Robot;

/// The information of logs, and how they became samples.
pub(super) struct Earlier {
    pub(super) information: Mat<f64>,
    pub(super) choices: Vec<String>,
}

/// `1/T ∫ Yᵀ D Y dt` over the logs: their information over that of one sample, if a period `T` of the motion to come is
/// recorded at their rate.
///
/// Of the rows that `identify` would keep of them: the same low-passes, decimation and dead band.
pub(super) fn earlier(
    robot: &Robot,
    columns: &ModelColumns,
    logs: &[Measurements],
    options: &ExciteOptions,
) -> Result<Earlier, Error> {
    let n = robot.n_joints();
    let weights: Vec<f64> = if options.torque_noise.is_empty() {
        vec![1.0; n]
    } else {
        options.torque_noise.iter().map(|s| 1.0 / (s * s)).collect()
    };
    let identify = IdentifyOptions {
        columns: options.columns,
        ..IdentifyOptions::default()
    };
    let plan = sampling(robot, logs, &identify)?.plan;
    let (stretches, clocks) = stated_stretches(logs, &plan)?;
    let p = columns.len();
    let mut information = Mat::<f64>::zeros(p, p);
    for stretch in &stretches {
        let mut rows = Rows::default();
        push_rows(&mut rows, robot, columns, stretch, &plan)?;
        let (Some(first), Some(last)) = (rows.at.first(), rows.at.last()) else {
            continue;
        };
        if rows.at.len() < 2 {
            continue;
        }
        let interval = (last.1 - first.1) / (rows.at.len() - 1) as f64;
        let used = rows.w.chunks_exact(p).enumerate();
        for (k, row) in used.filter(|(k, _)| rows.used[*k]) {
            let weight = weights[k % n] * interval / options.period;
            for (b, y) in row.iter().enumerate().filter(|(_, y)| **y != 0.0) {
                for (a, x) in row.iter().enumerate() {
                    information[(a, b)] += weight * y * x;
                }
            }
        }
    }
    let choices = plan.choices.iter().cloned().chain(clocks).collect();
    Ok(Earlier {
        information,
        choices,
    })
}
