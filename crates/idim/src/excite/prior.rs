//! What earlier logs already tell.

use super::ExciteOptions;
use crate::error::Error;
use crate::plan::{SamplingOptions, SamplingPlan};
use crate::samples::stretches;
use faer::Mat;
use idim_excitation::{AddedColumn, information_with_added};
use idim_measurement::Measurements;
use idim_model::{Columns, Model, Robot};

/// `1/T ∫ Yᵀ D Y dt` over the logs: their information over that of one sample, if a period `T` of the motion to come is
/// recorded at their rate.
pub(super) fn information(
    robot: &Robot,
    columns: (&Columns, &[AddedColumn]),
    logs: &[Measurements],
    options: &ExciteOptions,
) -> Result<Mat<f64>, Error> {
    let weights: Vec<f64> = if options.torque_noise.is_empty() {
        vec![1.0; robot.n_joints()]
    } else {
        options.torque_noise.iter().map(|s| 1.0 / (s * s)).collect()
    };
    let model = Model::new(robot);
    let plan = SamplingPlan::new(logs, &SamplingOptions::default());
    let n_columns = columns.0.len() + columns.1.len();
    let mut sum = Mat::zeros(n_columns, n_columns);
    for log in logs {
        for stretch in stretches(log, &plan)? {
            let (first, last) = (stretch.time.first(), stretch.time.last());
            let (Some(first), Some(last)) = (first, last) else {
                continue;
            };
            let n = stretch.states.n_samples();
            if n < 2 {
                continue;
            }
            let interval = (last - first) / (n - 1) as f64;
            let a = information_with_added(&model, columns, &stretch.states, &weights);
            if !a.is_all_finite() {
                return Err(Error::input(
                    log.file.clone(),
                    "a known torque without a value somewhere in it",
                    "its formula must have a value wherever the joint moves",
                ));
            }
            sum += faer::Scale(interval / options.period) * a;
        }
    }
    Ok(sum)
}
