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
/// `model/parameters.yaml`; `model/predictor.rs` and `model/predictor.c` where every column is the regressor's; with a prior also `model/robot.ron` and
/// `model/robot.urdf`.
pub fn exports(found: &Identification, robot: &Robot) -> Vec<(String, String)> {
    let completion = complete(found, robot);
    let mut files = vec![(
        "parameters.yaml",
        parameters_yaml(found, robot, &completion),
    )];
    // The predictors know the regressor's columns; a model with others (coupled motors, known torques, chosen friction) has none.
    if found.columns.extra.is_empty() {
        let model = PredictedModel {
            robot,
            columns: &found.columns.standard,
            values: &found.values,
            reversal: &found.reversal,
        };
        files.push(("predictor.rs", predictor_rust(&model)));
        files.push(("predictor.c", predictor_c(&model)));
    }
    if let Ok(completion) = &completion {
        files.push(("robot.ron", completed_ron(robot, completion)));
        files.push(("robot.urdf", completed_urdf(robot, completion)));
    }
    let named = files.into_iter();
    named
        .map(|(name, text)| (format!("model/{name}"), text))
        .collect()
}
