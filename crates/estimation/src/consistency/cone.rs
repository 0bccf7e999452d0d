//! Coordinates in which every prior is the identity.
//!
//! A link's pseudo-inertia `P` becomes `Q = L⁻¹ P L⁻ᵀ` with `P⁰ = L Lᵀ`, its ten coordinates the entries of `Q` with the off-diagonal ones
//! times √2, so that lengths are Frobenius norms. A positive scalar becomes its ratio to the prior. Without this the barrier stalls: entries of
//! `P` differ by 1e6.

use crate::error::Error;
use idim_model::InertialParameters;
use nalgebra::{Cholesky, Matrix4, SMatrix, SVector};

pub(super) type Vector10 = SVector<f64, 10>;
pub(super) type Matrix10 = SMatrix<f64, 10, 10>;

/// The entries of a symmetric 4 × 4 matrix, in the order of the coordinates.
const ENTRIES: [(usize, usize); 10] = [
    (0, 0),
    (1, 1),
    (2, 2),
    (3, 3),
    (0, 1),
    (0, 2),
    (0, 3),
    (1, 2),
    (1, 3),
    (2, 3),
];

/// Coordinates of a symmetric matrix.
pub(super) fn coordinates(q: &Matrix4<f64>) -> Vector10 {
    Vector10::from_fn(|a, _| {
        let (i, j) = ENTRIES[a];
        if i == j {
            q[(i, i)]
        } else {
            std::f64::consts::SQRT_2 * q[(i, j)]
        }
    })
}

/// The symmetric matrix of ten coordinates.
pub(super) fn symmetric(s: &[f64]) -> Matrix4<f64> {
    let mut q = Matrix4::zeros();
    for (a, &(i, j)) in ENTRIES.iter().enumerate() {
        let value = if i == j {
            s[a]
        } else {
            s[a] / std::f64::consts::SQRT_2
        };
        q[(i, j)] = value;
        q[(j, i)] = value;
    }
    q
}

/// The ten parameters of a pseudo-inertia.
pub(super) fn parameters(p: &Matrix4<f64>) -> InertialParameters {
    let sigma = p.fixed_view::<3, 3>(0, 0).into_owned();
    let inertia = nalgebra::Matrix3::identity() * sigma.trace() - sigma;
    InertialParameters::from_parts(p[(3, 3)], p.fixed_view::<3, 1>(0, 3).into_owned(), &inertia)
}

/// The linear map from whitened coordinates to the ten parameters, for one prior.
///
/// # Errors
/// [`Error::UnphysicalPrior`].
pub(super) fn unwhitening(link: usize, prior: &InertialParameters) -> Result<Matrix10, Error> {
    let p0 = prior.pseudo_inertia();
    let Some(cholesky) = Cholesky::new(p0).filter(|_| p0.iter().all(|v| v.is_finite())) else {
        let eigenvalue = if p0.iter().all(|v| v.is_finite()) {
            p0.symmetric_eigenvalues().min()
        } else {
            f64::NAN
        };
        return Err(Error::UnphysicalPrior { link, eigenvalue });
    };
    let l = cholesky.l();
    let mut map = Matrix10::zeros();
    for a in 0..10 {
        let mut unit = [0.0; 10];
        unit[a] = 1.0;
        let theta = parameters(&(l * symmetric(&unit) * l.transpose()));
        map.column_mut(a).copy_from_slice(&theta.0);
    }
    Ok(map)
}

/// `tr Q - log det Q - 4`; infinite outside the cone.
pub(super) fn divergence(q: &Matrix4<f64>) -> f64 {
    Cholesky::new(*q).map_or(f64::INFINITY, |c| {
        let log_det: f64 = (0..4).map(|i| c.l_dirty()[(i, i)].ln()).sum::<f64>() * 2.0;
        q.trace() - log_det - 4.0
    })
}

/// Square root `M` of the Hessian of the divergence at `Q = C Cᵀ` and `M⁻ᵀ` times its gradient; `None` outside the cone.
///
/// `H_ab = tr(Q⁻¹ E_a Q⁻¹ E_b) = ⟨S_a, S_b⟩` with `S_a = C⁻¹ E_a C⁻ᵀ`: forming `Q⁻¹` would lose definiteness near the border.
pub(super) fn newton_rows(q: &Matrix4<f64>) -> Option<(Matrix10, Vector10)> {
    let c = Cholesky::new(*q)?.l();
    let mut root = Matrix10::zeros();
    for a in 0..10 {
        let mut unit = [0.0; 10];
        unit[a] = 1.0;
        let left = c.solve_lower_triangular(&symmetric(&unit))?;
        let both = c.solve_lower_triangular(&left.transpose())?;
        root.set_column(a, &coordinates(&both));
    }
    Some((
        root,
        coordinates(&(c.transpose() * c - Matrix4::identity())),
    ))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    fn body() -> InertialParameters {
        let inertia = Matrix3::new(0.3, 0.02, -0.01, 0.02, 0.25, 0.03, -0.01, 0.03, 0.2);
        InertialParameters::from_centre_of_mass(4.0, Vector3::new(0.1, -0.05, 0.2), &inertia)
    }

    #[test]
    fn identity_coordinates_are_an_isometry() {
        let p = body().pseudo_inertia();
        let s = coordinates(&p);
        assert!((s.norm() - p.norm()).abs() < 1e-14);
        assert!((symmetric(s.as_slice()) - p).norm() < 1e-15);
        let back = parameters(&p);
        assert!(
            back.0
                .iter()
                .zip(body().0)
                .all(|(a, b)| (a - b).abs() < 1e-15)
        );
    }

    #[test]
    fn identity_the_prior_is_the_identity() {
        let map = unwhitening(0, &body()).unwrap();
        let theta = map * coordinates(&Matrix4::identity());
        assert!(
            theta
                .iter()
                .zip(body().0)
                .all(|(a, b)| (a - b).abs() < 1e-14)
        );
        assert!(divergence(&Matrix4::identity()).abs() < 1e-15);
    }

    #[test]
    fn identity_gradient_and_hessian_by_differences() {
        let q = Matrix4::new(
            1.5, 0.2, 0.1, -0.3, 0.2, 0.8, 0.0, 0.1, 0.1, 0.0, 2.0, 0.4, -0.3, 0.1, 0.4, 1.0,
        );
        let (root, scaled) = newton_rows(&q).unwrap();
        let gradient = root.transpose() * scaled;
        let at = |a: usize, b: usize, h: f64, k: f64| {
            let mut s = coordinates(&q);
            s[a] += h;
            s[b] += k;
            divergence(&symmetric(s.as_slice()))
        };
        let h = 1e-4;
        for a in 0..10 {
            let slope = (at(a, a, h, 0.0) - at(a, a, -h, 0.0)) / (2.0 * h);
            assert!(
                (slope - gradient[a]).abs() < 1e-6,
                "{a}: {slope} {}",
                gradient[a]
            );
            for b in 0..10 {
                let curvature = (at(a, b, h, h) - at(a, b, h, -h) - at(a, b, -h, h)
                    + at(a, b, -h, -h))
                    / (4.0 * h * h);
                let hessian = root.column(a).dot(&root.column(b));
                assert!(
                    (curvature - hessian).abs() < 1e-5,
                    "{a} {b}: {curvature} {hessian}"
                );
            }
        }
    }
}
