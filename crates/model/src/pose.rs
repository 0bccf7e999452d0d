//! Poses and the two Denavit-Hartenberg conventions.

use nalgebra::{Matrix3, Vector3};

/// A rigid transform `a_from_b`: `x_a = rotation · x_b + translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Rotation matrix, axes of `b` in `a`.
    pub rotation: Matrix3<f64>,
    /// Origin of `b` in `a`, m.
    pub translation: Vector3<f64>,
}

/// Angles closer than this (rad) to a multiple of π/12 count as that multiple.
///
/// A fixed decimal of π in a robot file (`1.5708`) tilts axes by 1e-6 rad and makes ghost parameters identifiable
/// on paper; importers snap and report.
pub const SNAP_ANGLE: f64 = 1e-5;

/// Angle moved to the nearest multiple of π/12 if it is within [`SNAP_ANGLE`], and whether it moved.
pub fn snap_angle(angle: f64) -> (f64, bool) {
    let step = std::f64::consts::PI / 12.0;
    let near = (angle / step).round() * step;
    let moved = near != angle && (near - angle).abs() < SNAP_ANGLE;
    (if moved { near } else { angle }, moved)
}

/// Sine and cosine, exact at the multiples of π/2: `cos(π/2)` is 0, not 6e-17.
pub fn exact_sin_cos(angle: f64) -> (f64, f64) {
    let quarter = angle / std::f64::consts::FRAC_PI_2;
    if (quarter - quarter.round()).abs() > 1e-15 * quarter.abs().max(1.0) {
        return angle.sin_cos();
    }
    match (quarter.round() as i64).rem_euclid(4) {
        0 => (0.0, 1.0),
        1 => (1.0, 0.0),
        2 => (0.0, -1.0),
        _ => (-1.0, 0.0),
    }
}

impl Pose {
    /// No motion.
    pub fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: Vector3::zeros(),
        }
    }

    /// Pure translation, m.
    pub fn from_translation(x: f64, y: f64, z: f64) -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: Vector3::new(x, y, z),
        }
    }

    /// Rotation about x, rad.
    pub fn from_rotation_x(angle: f64) -> Self {
        let (s, c) = exact_sin_cos(angle);
        Self {
            rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
            translation: Vector3::zeros(),
        }
    }

    /// Rotation about y, rad.
    pub fn from_rotation_y(angle: f64) -> Self {
        let (s, c) = exact_sin_cos(angle);
        Self {
            rotation: Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
            translation: Vector3::zeros(),
        }
    }

    /// Rotation about z, rad.
    pub fn from_rotation_z(angle: f64) -> Self {
        let (s, c) = exact_sin_cos(angle);
        Self {
            rotation: Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
            translation: Vector3::zeros(),
        }
    }

    /// Fixed-axis roll, pitch, yaw (rad) and translation (m), the convention of URDF: `Rz(yaw) Ry(pitch) Rx(roll)`.
    pub fn from_xyz_rpy(xyz: [f64; 3], rpy: [f64; 3]) -> Self {
        Self::from_translation(xyz[0], xyz[1], xyz[2])
            * Self::from_rotation_z(rpy[2])
            * Self::from_rotation_y(rpy[1])
            * Self::from_rotation_x(rpy[0])
    }

    /// Rotation about a unit axis (Rodrigues), rad.
    pub fn from_axis_angle(axis: &Vector3<f64>, angle: f64) -> Self {
        let (s, c) = exact_sin_cos(angle);
        let k = axis.cross_matrix();
        Self {
            rotation: Matrix3::identity() + k * s + k * k * (1.0 - c),
            translation: Vector3::zeros(),
        }
    }

    /// `b_from_a`.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation: -(rotation * self.translation),
        }
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;

    /// `a_from_c = a_from_b * b_from_c`.
    fn mul(self, other: Self) -> Self {
        Self {
            rotation: self.rotation * other.rotation,
            translation: self.rotation * other.translation + self.translation,
        }
    }
}
