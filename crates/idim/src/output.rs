//! Files appear whole or not at all.

use crate::error::Error;
use std::io::Write as _;
use std::path::Path;

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

/// Names of files in `model/` that an identification may write.
const MODEL_FILES: [&str; 5] = [
    "parameters.yaml",
    "predictor.rs",
    "predictor.c",
    "robot.ron",
    "robot.urdf",
];

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
    let model = MODEL_FILES.iter().map(|name| format!("model/{name}"));
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
