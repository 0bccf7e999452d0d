//! What a design leaves behind: the motion in three forms, its certificate, its picture.

use crate::cli::{NamedText, say};
use crate::error::Error;
use crate::output::{results_folder, write_atomically};
use idim_model::{JointStates, Robot};
use idim_trajectory::{Motion, TrajectoryFile};
use serde_json::Value;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

/// Files that a design writes and may be handed as an input.
pub(super) const FILES: [&str; 4] = [
    "motion.ron",
    "motion.json",
    "samples.csv",
    "certificate.json",
];

/// The files of a motion of some duration, s: names and texts.
pub(super) fn files(
    robot: &Robot,
    motion: &Motion,
    duration: f64,
    (rate, seed): (f64, u64),
    certificate: &Value,
    picture: NamedText,
) -> Vec<NamedText> {
    let names = robot.joints().iter().map(|j| j.name.clone()).collect();
    let file = TrajectoryFile::new(names, motion, format!("idim excite, seed {seed}"));
    vec![
        ("motion.ron".into(), file.to_ron()),
        ("motion.json".into(), file.to_json()),
        ("samples.csv".into(), samples_csv(motion, duration, rate)),
        ("certificate.json".into(), format!("{certificate:#}\n")),
        picture,
    ]
}

/// The whole motion, the first and the last instant included: `t, q1 .., qd1 .., qdd1 ..`, SI.
fn samples_csv(motion: &Motion, duration: f64, rate: f64) -> String {
    // A duration that is a whole number of samples but for rounding ends with one.
    let last = (duration * rate * (1.0 + 1e-12)).floor() as usize;
    let times: Vec<f64> = (0..=last).map(|k| k as f64 / rate).collect();
    let states = match motion {
        Motion::Fourier(series) => series.states(&times),
        Motion::Quintic(path) => path.states(&times),
    };
    let n = states.n_joints();
    let mut text = String::from("t");
    for symbol in ["q", "qd", "qdd"] {
        for j in 1..=n {
            let _ = write!(text, ",{symbol}{j}");
        }
    }
    text.push('\n');
    for (k, t) in times.iter().enumerate() {
        let _ = write!(text, "{t}");
        for values in [JointStates::q, JointStates::qd, JointStates::qdd] {
            for j in 0..n {
                let _ = write!(text, ",{}", values(&states, j)[k]);
            }
        }
        text.push('\n');
    }
    text
}

/// Writes them to a folder of the robot's name, and says so.
pub(super) fn write(
    dir: &Path,
    robot: &Robot,
    files: &[NamedText],
    out: &mut dyn Write,
) -> Result<(), Error> {
    let folder = results_folder(dir, robot.name());
    for (name, text) in files {
        write_atomically(&folder.join(name), text.as_bytes())?;
    }
    let names: Vec<&str> = files.iter().map(|f| f.0.as_str()).collect();
    say(
        out,
        &format!("\nwrote {} to {}\n", names.join(", "), folder.display()),
    )
}
