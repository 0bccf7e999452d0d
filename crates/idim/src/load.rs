//! Robots from files, as the command line asks for them.

use crate::error::Error;
use idim_model::{Robot, robot_from_ron, robot_from_urdf, robot_from_urdf_with};
use nalgebra::Vector3;
use std::path::Path;

/// What the command line changes on a described robot.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// Gravity in the base frame, m/s².
    pub gravity: Option<[f64; 3]>,
    /// Joints held at a position (rad, m), by name.
    pub lock: Vec<(String, f64)>,
}

/// A robot as described by its file and as it is to be identified.
#[derive(Debug, Clone)]
pub struct LoadedRobot {
    /// Every joint of the file: the columns of a log are numbered by these.
    pub described: Robot,
    /// With held joints folded away.
    pub robot: Robot,
}

/// Reads a robot file by its extension, `.ron` or `.urdf`, and applies the changes.
///
/// # Errors
/// A file that cannot be read or is wrong, an unknown extension, a joint to hold that the robot does not have.
pub fn load_robot(path: &Path, changes: &Changes) -> Result<LoadedRobot, Error> {
    let text = read_text(path)?;
    let extension = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase();
    let located = |source| Error::Robot {
        path: path.to_path_buf(),
        source,
    };
    let (described, robot) = match extension.as_str() {
        "ron" => {
            let described = robot_from_ron(&text).map_err(located)?;
            let robot = described.hold_joints(&changes.lock).map_err(located)?;
            (described, robot)
        }
        "urdf" | "xml" => {
            let robot = robot_from_urdf_with(&text, &changes.lock).map_err(located)?;
            // A robot that needs its mimic joints held cannot be described without.
            let described = robot_from_urdf(&text).unwrap_or_else(|_| robot.clone());
            (described, robot)
        }
        _ => {
            return Err(Error::input(
                path.display().to_string(),
                format!("extension `{extension}`"),
                "a robot file ends in .ron (DH table or poses) or .urdf",
            ));
        }
    };
    let robot = match changes.gravity {
        Some([x, y, z]) => robot.with_gravity(Vector3::new(x, y, z))?,
        None => robot,
    };
    Ok(LoadedRobot { described, robot })
}

/// The text of a file.
///
/// # Errors
/// A file that cannot be read or is not UTF-8.
pub(crate) fn read_text(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|source| Error::Read {
        path: path.to_path_buf(),
        source,
    })
}
