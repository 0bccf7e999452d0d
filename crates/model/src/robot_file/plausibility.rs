//! Whether a rigid body could have the inertial values a file states.

use crate::parameter::InertialParameters;

/// Share of the largest principal moment by which rounded printed values may miss the triangle inequality.
const ROUNDING: f64 = 1e-6;
/// Rounding of the parallel-axis theorem, share of the inertia about the origin.
const TRANSPORT: f64 = 1e-12;

/// Why no rigid body has these parameters; `None` when one can.
///
/// The principal moments about the centre of mass must not be negative and each at most the sum of the other two,
/// which is the pseudo-inertia being positive semi-definite (Wensing, Kim & Slotine 2018).
pub(crate) fn impossibility(p: &InertialParameters) -> Option<String> {
    if p.0.iter().all(|&v| v == 0.0) {
        return None;
    }
    if p.mass() == 0.0 {
        return Some("it has inertia or a first moment, and mass 0".to_owned());
    }
    let mut moments = p.inertia_about_centre_of_mass().symmetric_eigenvalues();
    moments.as_mut_slice().sort_by(f64::total_cmp);
    let [a, b, c] = [moments[0], moments[1], moments[2]];
    let slack = ROUNDING * c.abs() + TRANSPORT * p.inertia().trace().abs();
    if a < -slack {
        return Some(format!(
            "its principal moment {a:.3e} kg·m² about the centre of mass is negative"
        ));
    }
    let excess = c - (a + b);
    (excess > slack).then(|| {
        let percent = 100.0 * excess / c;
        format!(
            "its principal moments {a:.3e} + {b:.3e} are less than {c:.3e} kg·m², by {percent:.2} %"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::impossibility;
    use crate::parameter::InertialParameters;
    use nalgebra::{Matrix3, Vector3};

    fn body(mass: f64, moments: [f64; 3]) -> InertialParameters {
        let inertia = Matrix3::from_diagonal(&Vector3::from(moments));
        InertialParameters::from_centre_of_mass(mass, Vector3::new(0.3, -0.2, 0.5), &inertia)
    }

    #[test]
    fn identity_bodies_that_can_be_are_possible() {
        for p in [
            body(2.0, [1.0, 2.0, 2.5]),
            body(2.0, [0.0; 3]),
            body(1.0, [0.0, 1.0, 1.0]),
        ] {
            assert_eq!(impossibility(&p), None);
        }
        assert_eq!(impossibility(&InertialParameters::ZERO), None);
    }

    #[test]
    fn identity_bodies_that_cannot_be_are_named_with_the_reason() {
        let triangle = impossibility(&body(2.0, [1.0, 1.0, 2.5])).unwrap_or_default();
        assert!(triangle.contains("by 20.00 %"), "{triangle}");
        let negative = impossibility(&body(2.0, [-1.0, 1.0, 1.0])).unwrap_or_default();
        assert!(negative.contains("negative"), "{negative}");
        let massless = impossibility(&body(0.0, [1.0, 1.0, 1.0])).unwrap_or_default();
        assert!(massless.contains("mass 0"), "{massless}");
    }
}
