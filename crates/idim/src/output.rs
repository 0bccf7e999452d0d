//! Files appear whole or not at all.

use crate::cli::file_name;
use crate::error::Error;
use crate::log_spec::same_file;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Writes a file under a temporary name in its folder and renames it, making the folder first.
///
/// # Errors
/// [`Error::Write`] with the path; an existing file is then as it was.
pub fn write_atomically(path: &Path, contents: &[u8]) -> Result<(), Error> {
    let failed = |source| Error::Write {
        path: path.to_path_buf(),
        source,
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(failed)?;
    let mut file = readable().tempfile_in(folder).map_err(failed)?;
    file.write_all(contents).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

/// Names of files that an identification writes to its folder of results and may be handed as an input.
pub(crate) const RESULT_FILES: [&str; 7] = [
    "result.json",
    "report.html",
    "model/parameters.yaml",
    "model/predictor.rs",
    "model/predictor.c",
    "model/robot.ron",
    "model/robot.urdf",
];

/// The folder of a robot's results.
pub(crate) fn results_folder(dir: &Path, robot: &str) -> PathBuf {
    dir.join(file_name(robot))
}

/// Refuses to write `names` to `folder` where one of them is a file that is read: results never replace what they were made
/// from. A folder and an empty name stand for a single file.
///
/// # Errors
/// The input, and what to do.
pub(crate) fn refuse_overwriting(
    folder: &Path,
    names: &[&str],
    inputs: &[&Path],
) -> Result<(), Error> {
    for name in names {
        let written = if name.is_empty() {
            folder.to_path_buf()
        } else {
            folder.join(name)
        };
        if let Some(input) = inputs.iter().find(|input| same_file(input, &written)) {
            return Err(Error::input(
                format!("--out {}", folder.display()),
                format!("{} is read, and would be overwritten", input.display()),
                "choose another --out, or copy the input elsewhere",
            ));
        }
    }
    Ok(())
}

/// Removes what an earlier identification left in a folder of results and this one has not `written`: a predictor or a robot
/// of other values beside a new `result.json` would be taken for its own. Files of other names stay.
///
/// # Errors
/// [`Error::Write`] where an old file cannot be removed.
pub(crate) fn remove_earlier(folder: &Path, written: &[&str]) -> Result<(), Error> {
    let pictures = std::fs::read_dir(folder).into_iter().flatten();
    let pictures = pictures
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| is_torque_picture(name));
    let model = RESULT_FILES
        .iter()
        .filter(|name| name.starts_with("model/"));
    let model = model.map(|name| (*name).to_owned());
    for name in pictures.chain(model) {
        if written.contains(&name.as_str()) {
            continue;
        }
        let path = folder.join(name);
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                return Err(Error::Write { path, source });
            }
            _ => {}
        }
    }
    Ok(())
}

/// `torque-3-elbow.svg`.
fn is_torque_picture(name: &str) -> bool {
    let parts = name
        .strip_prefix("torque-")
        .and_then(|n| n.strip_suffix(".svg"));
    let joint = parts.and_then(|n| n.split_once('-'));
    joint.is_some_and(|(number, _)| number.parse::<usize>().is_ok())
}

/// Temporary files are private by default; a result is for everybody the folder is for.
fn readable() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(std::fs::Permissions::from_mode(0o644));
    }
    builder
}
