//! Logs in other formats than CSV, each behind the cargo feature of its name.

#[cfg(any(feature = "rosbag2", feature = "mcap"))]
mod joint_state;
#[cfg(feature = "mcap")]
mod mcap_file;
#[cfg(feature = "npz")]
mod npz_file;
#[cfg(feature = "parquet")]
mod parquet_file;
#[cfg(feature = "rosbag2")]
mod rosbag2;

#[cfg(any(feature = "rosbag2", feature = "mcap"))]
pub use joint_state::{JointState, decode_joint_state};
#[cfg(feature = "mcap")]
pub use mcap_file::read_mcap;
#[cfg(feature = "npz")]
pub use npz_file::read_npz;
#[cfg(feature = "parquet")]
pub use parquet_file::read_parquet;
#[cfg(feature = "rosbag2")]
pub use rosbag2::read_rosbag2;

use crate::csv_log::read_csv;
use crate::error::{Error, Place, printable};
use crate::header::JointLabel;
use crate::log::Log;
use crate::mapping::ColumnMapping;
use std::path::{Path, PathBuf};

/// Reads a log of any format, told by the file's ending: `csv`, `tsv`, `txt`, `dat`, and with their features `parquet`,
/// `npz`, `db3` and `mcap`; a folder written by `ros2 bag record` stands for the one file in it.
///
/// # Errors
/// A file that cannot be read, an ending not known or left out of this build, and those of [`read_csv`].
pub fn read_log(path: &Path, joints: &[JointLabel], mapping: &ColumnMapping) -> Result<Log, Error> {
    let path = &bag_in_folder(path)?;
    let file = file_name(path);
    let ending = path
        .extension()
        .map_or(String::new(), |e| e.to_string_lossy().to_lowercase());
    match ending.as_str() {
        csv if CSV.contains(&csv) => read_csv(&bytes(path)?, &file, joints, mapping),
        #[cfg(feature = "rosbag2")]
        "db3" => read_rosbag2(path, joints, mapping),
        #[cfg(feature = "mcap")]
        "mcap" => read_mcap(&bytes(path)?, &file, joints, mapping),
        #[cfg(feature = "parquet")]
        "parquet" => read_parquet(bytes(path)?, &file, joints, mapping),
        #[cfg(feature = "npz")]
        "npz" => read_npz(&bytes(path)?, &file, joints, mapping),
        #[cfg(not(feature = "rosbag2"))]
        "db3" => Err(left_out(&file, "rosbag2")),
        #[cfg(not(feature = "mcap"))]
        "mcap" => Err(left_out(&file, "mcap")),
        #[cfg(not(feature = "parquet"))]
        "parquet" => Err(left_out(&file, "parquet")),
        #[cfg(not(feature = "npz"))]
        "npz" => Err(left_out(&file, "npz")),
        _ => Err(Error::log(
            "format",
            Place::file(file),
            format!("ending `{}`", printable(&ending)),
            "logs are .csv, .parquet, .npz, .db3 or .mcap files; name the file by its format",
        )),
    }
}

/// Endings of text with columns.
const CSV: [&str; 4] = ["csv", "tsv", "txt", "dat"];

#[cfg(not(all(
    feature = "rosbag2",
    feature = "mcap",
    feature = "parquet",
    feature = "npz"
)))]
fn left_out(file: &str, feature: &str) -> Error {
    Error::log(
        "format",
        Place::file(file),
        "a format that this build leaves out",
        format!("build with the cargo feature `{feature}`, or convert the log to CSV"),
    )
}

fn bytes(path: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(path).map_err(|e| unreadable(path, &e))
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    Error::log(
        "unreadable",
        Place::file(path.to_string_lossy()),
        error.to_string(),
        "give the path of a log that can be read",
    )
}

pub(crate) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// The one .db3 or .mcap file of a bag's folder; the path itself if it is a file.
fn bag_in_folder(path: &Path) -> Result<PathBuf, Error> {
    if !path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let entries = std::fs::read_dir(path).map_err(|e| unreadable(path, &e))?;
    let mut bags: Vec<PathBuf> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "db3" || e == "mcap"))
        .collect();
    bags.sort();
    match bags.as_slice() {
        [one] => Ok(one.clone()),
        _ => Err(Error::log(
            "format",
            Place::file(path.to_string_lossy()),
            format!("a folder with {} bag files", bags.len()),
            "give the one .db3 or .mcap file to read",
        )),
    }
}
