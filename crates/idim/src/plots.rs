//! Which pictures a run leaves behind.

use crate::cli::{NamedText, file_name};
use crate::identify::Prediction;
use crate::plot::{Part, TorqueRun, motion_plot, torque_plot};
use idim_model::Robot;
use idim_trajectory::{FourierSeries, Limits, QuinticPath};

/// Samples of a drawn motion.
const MOTION_SAMPLES: usize = 1000;

/// Measured against predicted torque, a file a joint.
pub(crate) fn of_predictions(predictions: &[Prediction], robot: &Robot) -> Vec<NamedText> {
    let joints = robot.joints().iter().enumerate();
    joints
        .map(|(j, joint)| {
            let runs = torque_runs(predictions, j);
            let name = format!("torque-{}-{}.svg", j + 1, file_name(&joint.name));
            (name, torque_plot(&joint.name, joint.kind, &runs))
        })
        .collect()
}

/// Torque of one joint in each stretch of the logs.
pub(crate) fn torque_runs(predictions: &[Prediction], joint: usize) -> Vec<TorqueRun<'_>> {
    predictions
        .iter()
        .map(|p| TorqueRun {
            part: if p.training {
                Part::Training
            } else {
                Part::Validation
            },
            time: &p.time,
            measured: &p.measured[joint],
            predicted: &p.predicted[joint],
        })
        .collect()
}

/// A quintic path within its limits.
pub(crate) fn of_path(robot: &Robot, path: &QuinticPath, limits: &Limits) -> Vec<NamedText> {
    let times = equispaced(path.duration());
    vec![(
        "motion.svg".into(),
        motion_plot(robot, limits, &times, &path.states(&times)),
    )]
}

/// A period of a Fourier motion within its limits.
pub(crate) fn of_series(
    robot: &Robot,
    series: &FourierSeries,
    limits: &Limits,
    name: &str,
) -> NamedText {
    let times = equispaced(series.period());
    (
        format!("{name}.svg"),
        motion_plot(robot, limits, &times, &series.states(&times)),
    )
}

fn equispaced(duration: f64) -> Vec<f64> {
    (0..=MOTION_SAMPLES)
        .map(|k| duration * k as f64 / MOTION_SAMPLES as f64)
        .collect()
}
