//! Angles, lengths and axes that a file rounds are moved onto the exact value, and the move is reported.
//!
//! `rpy="1.5708"` tilts an axis by 4e-6 rad; the regressor then has columns of that size that no motor can feel, and
//! the rank of the model is decided by the rounding of a file.

use super::assembly::listed;
use crate::pose::{SNAP_ANGLE, snap_angle};
use nalgebra::Vector3;

/// Lengths below this (m) count as zero: a nanometre is an artefact of an export, not a link.
const SNAP_LENGTH: f64 = 1e-9;
/// Moves below this are rounding of the number itself and not worth a word.
const SILENT: f64 = 1e-15;
/// Lengths of a given axis this close to 1 are not reported as normalised.
const UNIT: f64 = 1e-6;

/// Collects the moves while a file is read.
#[derive(Default)]
pub(crate) struct Snapping {
    angles: Moves,
    lengths: Moves,
    axes: Moves,
    normalised: Moves,
}

#[derive(Default)]
struct Moves {
    places: Vec<String>,
    largest: f64,
}

impl Moves {
    fn add(&mut self, place: &str, amount: f64) {
        if amount.abs() <= SILENT {
            return;
        }
        self.largest = self.largest.max(amount.abs());
        if self.places.last().is_none_or(|last| last != place) {
            self.places.push(place.to_owned());
        }
    }

    fn note(&self, what: &str, unit: &str) -> Option<String> {
        let places = listed(what, &self.places)?;
        Some(format!("{places} (largest {:.1e}{unit})", self.largest))
    }
}

impl Snapping {
    /// The angle, or the multiple of π/12 it rounds (rad).
    pub(crate) fn angle(&mut self, place: &str, angle: f64) -> f64 {
        let (exact, _) = snap_angle(angle);
        self.angles.add(place, exact - angle);
        exact
    }

    /// The length, or zero (m).
    pub(crate) fn length(&mut self, place: &str, length: f64) -> f64 {
        let exact = if length.abs() < SNAP_LENGTH {
            0.0
        } else {
            length
        };
        self.lengths.add(place, exact - length);
        exact
    }

    /// The unit axis, entries that tilt it by less than [`SNAP_ANGLE`] set to zero; unchanged when it has no direction.
    pub(crate) fn axis(&mut self, place: &str, axis: Vector3<f64>) -> Vector3<f64> {
        let length = axis.norm();
        if !(length.is_finite() && length > 1e-9) {
            return axis;
        }
        if (length - 1.0).abs() > UNIT {
            self.normalised.add(place, length - 1.0);
        }
        let unit = axis / length;
        let exact = unit.map(|v| if v.abs() < SNAP_ANGLE { 0.0 } else { v });
        self.axes.add(place, (exact - unit).amax());
        exact.normalize()
    }

    /// One sentence a kind of move, none where nothing moved.
    pub(crate) fn into_notes(self) -> Vec<String> {
        let notes = [
            self.angles.note(
                "angles within 1e-5 rad of a multiple of pi/12 moved onto it",
                " rad",
            ),
            self.lengths.note("lengths below 1e-9 m set to zero", " m"),
            self.axes.note(
                "axes within 1e-5 rad of a coordinate direction moved onto it",
                "",
            ),
            self.normalised.note("axes brought to length 1", ""),
        ];
        notes.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Snapping;
    use nalgebra::Vector3;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    // The rounded values are the subject.
    #[allow(clippy::approx_constant)]
    fn regress_rounded_right_angles_become_exact_and_are_reported() {
        let mut snapping = Snapping::default();
        for rounded in [1.57079632679, 1.570796325, 1.5708] {
            assert_eq!(snapping.angle("joint a", rounded), FRAC_PI_2);
        }
        assert_eq!(snapping.angle("joint b", 1.571), 1.571);
        assert_eq!(snapping.angle("joint b", FRAC_PI_2), FRAC_PI_2);
        let notes = snapping.into_notes();
        assert_eq!(
            notes,
            [
                "angles within 1e-5 rad of a multiple of pi/12 moved onto it: joint a (largest 3.7e-6 rad)"
            ]
        );
    }

    #[test]
    fn regress_noise_in_lengths_and_axes_is_removed_and_reported() {
        let mut snapping = Snapping::default();
        assert_eq!(snapping.length("joint a", 1e-17), 0.0);
        assert_eq!(snapping.length("joint a", -2e-10), 0.0);
        assert_eq!(snapping.length("joint a", 1e-6), 1e-6);
        let axis = snapping.axis("joint b", Vector3::new(5e-12, 0.0, -2.0));
        assert_eq!(axis, Vector3::new(0.0, 0.0, -1.0));
        let notes = snapping.into_notes();
        assert_eq!(notes.len(), 3);
        assert!(
            notes[0].contains("joint a (largest 2.0e-10 m)"),
            "{}",
            notes[0]
        );
        assert!(
            notes[1].contains("joint b (largest 2.5e-12)"),
            "{}",
            notes[1]
        );
        assert!(notes[2].contains("length 1: joint b"), "{}", notes[2]);
    }
}
