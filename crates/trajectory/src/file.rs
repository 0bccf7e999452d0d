//! The trajectory file: what a design writes and a robot, a report or a later run reads.

use crate::error::Error;
use crate::fourier::FourierSeries;
use crate::quintic::QuinticPath;
use serde::{Deserialize, Serialize};

/// Schema of the files written here; another one is refused.
pub const TRAJECTORY_SCHEMA: &str = "idim-trajectory/1";

/// A motion with the names of its joints. Numbers survive writing and reading to the last bit, in RON and in JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrajectoryFile {
    /// [`TRAJECTORY_SCHEMA`].
    pub schema: String,
    /// Where the motion comes from: a publication, or the design that found it.
    #[serde(default)]
    pub source: String,
    /// Names of the joints, in the order of the coefficients.
    pub joints: Vec<String>,
    /// The motion itself.
    pub motion: MotionCoefficients,
}

/// The coefficients of a motion: rad, s (m for prismatic).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum MotionCoefficients {
    /// A [`FourierSeries`].
    Fourier {
        /// Fundamental, rad/s.
        omega: f64,
        /// Offsets, one a joint.
        q0: Vec<f64>,
        /// `a[joint][l - 1]`.
        a: Vec<Vec<f64>>,
        /// `b[joint][l - 1]`.
        b: Vec<Vec<f64>>,
    },
    /// A [`QuinticPath`].
    Quintic {
        /// Segments in order.
        segments: Vec<SegmentCoefficients>,
    },
}

/// One segment of a path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentCoefficients {
    /// Duration, s.
    pub duration: f64,
    /// `a0 … a5` of every joint: `q = Σ a_i u^i`, `u` from the start of the segment.
    pub joints: Vec<[f64; 6]>,
}

/// A motion of either family.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// Periodic.
    Fourier(FourierSeries),
    /// Through points.
    Quintic(QuinticPath),
}

impl TrajectoryFile {
    /// A motion with the names of its joints, and where it comes from.
    ///
    /// # Panics
    /// If there is not one name a joint.
    #[track_caller]
    pub fn new(joints: Vec<String>, motion: &Motion, source: impl Into<String>) -> Self {
        let (n_joints, motion) = match motion {
            Motion::Fourier(s) => (s.n_joints(), fourier_coefficients(s)),
            Motion::Quintic(p) => (p.n_joints(), quintic_coefficients(p)),
        };
        assert_eq!(joints.len(), n_joints, "one name per joint");
        Self {
            schema: TRAJECTORY_SCHEMA.into(),
            source: source.into(),
            joints,
            motion,
        }
    }

    /// Reads a file in RON.
    ///
    /// # Errors
    /// Text that is no trajectory file, with line and column; another schema; coefficients that make no motion.
    pub fn from_ron(text: &str) -> Result<Self, Error> {
        let file: Self = ron::from_str(text).map_err(|e| Error::Syntax {
            line: e.span.start.line,
            column: e.span.start.col,
            message: e.code.to_string(),
        })?;
        file.checked()
    }

    /// Reads a file in JSON.
    ///
    /// # Errors
    /// As [`from_ron`](Self::from_ron).
    pub fn from_json(text: &str) -> Result<Self, Error> {
        let file: Self = serde_json::from_str(text).map_err(|e| Error::Syntax {
            line: e.line(),
            column: e.column(),
            message: e.to_string(),
        })?;
        file.checked()
    }

    /// The file as RON.
    pub fn to_ron(&self) -> String {
        let style = ron::ser::PrettyConfig::new().compact_arrays(true);
        ron::ser::to_string_pretty(self, style).expect("numbers, strings and lists have a text")
    }

    /// The file as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers, strings and lists have a text")
    }

    /// The motion.
    ///
    /// # Errors
    /// Coefficients that make no motion, or not for the joints named.
    pub fn motion(&self) -> Result<Motion, Error> {
        let (n_joints, motion) = match &self.motion {
            MotionCoefficients::Fourier { omega, q0, a, b } => {
                let series = FourierSeries::new(*omega, q0.clone(), a.clone(), b.clone())?;
                (series.n_joints(), Motion::Fourier(series))
            }
            MotionCoefficients::Quintic { segments } => {
                let segments: Vec<_> = segments
                    .iter()
                    .map(|s| (s.duration, s.joints.clone()))
                    .collect();
                let path = QuinticPath::from_coefficients(&segments)?;
                (path.n_joints(), Motion::Quintic(path))
            }
        };
        if n_joints != self.joints.len() {
            return Err(Error::motion(
                "joints",
                format!("{} names, {n_joints} joints move", self.joints.len()),
                "name every joint of the motion, in its order",
            ));
        }
        Ok(motion)
    }

    fn checked(self) -> Result<Self, Error> {
        if self.schema != TRAJECTORY_SCHEMA {
            return Err(Error::motion(
                "schema",
                self.schema,
                "only idim-trajectory/1 is read here; use the version of idim that wrote the file",
            ));
        }
        self.motion()?;
        Ok(self)
    }
}

fn fourier_coefficients(series: &FourierSeries) -> MotionCoefficients {
    let joints = 0..series.n_joints();
    MotionCoefficients::Fourier {
        omega: series.omega(),
        q0: series.mean_position().to_vec(),
        a: joints.clone().map(|j| series.a(j).to_vec()).collect(),
        b: joints.map(|j| series.b(j).to_vec()).collect(),
    }
}

fn quintic_coefficients(path: &QuinticPath) -> MotionCoefficients {
    let segment = |(duration, joints)| SegmentCoefficients { duration, joints };
    MotionCoefficients::Quintic {
        segments: path.coefficients().into_iter().map(segment).collect(),
    }
}
