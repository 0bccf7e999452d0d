//! What earlier logs already tell.

use super::ExciteOptions;
use crate::error::Error;
use crate::plan::{SamplingOptions, SamplingPlan};
use crate::samples::stretches;
use faer::Mat;
use idim_excitation::information_matrix;
use idim_measurement::Measurements;
use idim_model::{Columns, Model, Robot};

/// `1/T ∫ Yᵀ D Y dt` over the logs: their information over that of one sample, if a period `T` of the motion to come is
/// recorded at their rate.
pub(super) fn information(
    robot: &Robot,
    columns: &Columns,
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
    let mut sum = Mat::zeros(columns.len(), columns.len());
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
            let a = information_matrix(&model, columns, &stretch.states, &weights);
            sum += faer::Scale(interval / options.period) * a;
        }
    }
    Ok(sum)
}
