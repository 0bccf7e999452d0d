//! The model as files for others: parameters with their relations, a completed robot, predictors.
//!
//! The data fix base parameters only. Where the robot file states inertial values, they serve as a prior, and the most
//! plausible robot of real bodies that agrees with the data is written too; every value says where it comes from.

mod completion;
mod parameters;
mod robot_files;

pub use completion::{Completion, Source, complete};

use crate::identify::Identification;
use crate::predictor::{PredictedModel, predictor_c, predictor_rust};
use idim_model::Robot;
use parameters::parameters_yaml;
use robot_files::{completed_ron, completed_urdf};

/// Names (below the folder of the result) and texts of the files.
///
/// `model/parameters.yaml`, `model/predictor.rs` and `model/predictor.c`; with a prior also `model/robot.ron` and
/// `model/robot.urdf`.
pub fn exports(found: &Identification, robot: &Robot) -> Vec<(String, String)> {
    let completed = complete(found, robot).and_then(|completion| {
        let ron = completed_ron(robot, &completion).map_err(|e| e.to_string())?;
        Ok((completion, ron))
    });
    let load = found.load.as_ref();
    let load = load.map_or_else(Vec::new, |l| l.bodies(robot.n_joints()));
    let model = PredictedModel {
        robot,
        columns: &found.columns,
        values: &found.values,
        reversal: &found.reversal,
        load: &load,
    };
    let mut files = vec![
        (
            "parameters.yaml",
            parameters_yaml(found, robot, completed.as_ref().map(|c| &c.0)),
        ),
        ("predictor.rs", predictor_rust(&model)),
        ("predictor.c", predictor_c(&model)),
    ];
    if let Ok((completion, ron)) = completed {
        files.push(("robot.ron", ron));
        files.push(("robot.urdf", completed_urdf(robot, &completion)));
    }
    let named = files.into_iter();
    named
        .map(|(name, text)| (format!("model/{name}"), text))
        .collect()
}
