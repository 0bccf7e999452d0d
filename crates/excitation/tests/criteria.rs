//! What the criteria must do whatever the rows.

#![allow(clippy::unwrap_used)]

use faer::Mat;
use idim_excitation::{Conditioning, Criterion, Scaling};
use proptest::prelude::*;

/// Relative; singular values of well-conditioned matrices of this size are good to 1e-13.
const TOLERANCE: f64 = 1e-9;

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs()).max(1.0)
}

fn matrix(entries: &[f64]) -> Mat<f64> {
    // A diagonal keeps the random matrix away from rank deficiency.
    Mat::from_fn(9, 4, |i, j| {
        entries[4 * i + j] + if i == j { 3.0 } else { 0.0 }
    })
}

proptest! {
    #[test]
    fn identity_scale_rotation_and_order_of_rows(
        entries in prop::collection::vec(-1.0..1.0_f64, 36),
        scale in 0.01..100.0_f64,
        angle in -3.0..3.0_f64,
    ) {
        let w = matrix(&entries);
        let c = Conditioning::of_rows(w.as_ref(), 9);
        // Condition numbers do not see a common factor; log det shifts by 2 b log of it.
        let scaled = Mat::from_fn(9, 4, |i, j| scale * w[(i, j)]);
        let s = Conditioning::of_rows(scaled.as_ref(), 9);
        prop_assert!(close(s.raw.two_norm, c.raw.two_norm));
        prop_assert!(close(s.raw.frobenius, c.raw.frobenius));
        prop_assert!(close(s.equilibrium.unwrap().ratio, c.equilibrium.unwrap().ratio));
        prop_assert!(close(s.log_det, c.log_det + 8.0 * scale.ln()));
        // A rotation of two rows leaves the information alone.
        let (sin, cos) = angle.sin_cos();
        let turned = Mat::from_fn(9, 4, |i, j| match i {
            0 => cos * w[(0, j)] - sin * w[(5, j)],
            5 => sin * w[(0, j)] + cos * w[(5, j)],
            _ => w[(i, j)],
        });
        let t = Conditioning::of_rows(turned.as_ref(), 9);
        prop_assert!(close(t.raw.two_norm, c.raw.two_norm));
        prop_assert!(close(t.raw.pivoted_qr, c.raw.pivoted_qr));
        prop_assert!(close(t.equilibrated.two_norm, c.equilibrated.two_norm));
        prop_assert!(close(t.trace_inverse, c.trace_inverse));
    }

    #[test]
    fn identity_units_of_a_parameter(
        entries in prop::collection::vec(-1.0..1.0_f64, 36),
        unit in 0.001..1000.0_f64,
    ) {
        // Another unit for one parameter: the equilibrated numbers stay, log det shifts by a constant, which is why
        // its optimum does not depend on units.
        let w = matrix(&entries);
        let c = Conditioning::of_rows(w.as_ref(), 9);
        let other = Mat::from_fn(9, 4, |i, j| if j == 2 { unit * w[(i, j)] } else { w[(i, j)] });
        let o = Conditioning::of_rows(other.as_ref(), 9);
        prop_assert!(close(o.equilibrated.two_norm, c.equilibrated.two_norm));
        prop_assert!(close(o.equilibrated.frobenius, c.equilibrated.frobenius));
        prop_assert!(close(o.log_det, c.log_det + 2.0 * unit.ln()));
    }

    #[test]
    fn identity_factor_and_rows_agree(entries in prop::collection::vec(-1.0..1.0_f64, 36)) {
        let w = matrix(&entries);
        let qr = w.qr();
        let f = Conditioning::of_factor(qr.thin_R(), 9);
        let c = Conditioning::of_rows(w.as_ref(), 9);
        prop_assert!(f.equilibrium.is_none());
        for (a, b) in [
            (f.raw.two_norm, c.raw.two_norm),
            (f.raw.pivoted_qr, c.raw.pivoted_qr),
            (f.raw.frobenius, c.raw.frobenius),
            (f.equilibrated.two_norm, c.equilibrated.two_norm),
            (f.log_det, c.log_det),
            (f.smallest_singular_value, c.smallest_singular_value),
        ] {
            prop_assert!(close(a, b), "{a} {b}");
        }
    }

    #[test]
    fn identity_order_of_the_condition_numbers(entries in prop::collection::vec(-1.0..1.0_f64, 36)) {
        let w = matrix(&entries);
        let c = Conditioning::of_rows(w.as_ref(), 9).raw;
        prop_assert!(c.two_norm >= 1.0);
        // The QR estimate is from below; ‖·‖₂ <= ‖·‖_F <= √b ‖·‖₂ bounds the Frobenius condition of WᵀW.
        prop_assert!(c.pivoted_qr <= c.two_norm * (1.0 + TOLERANCE));
        let squared = c.two_norm * c.two_norm;
        prop_assert!(c.frobenius >= squared * (1.0 - TOLERANCE));
        prop_assert!(c.frobenius <= 4.0 * squared * (1.0 + TOLERANCE));
    }
}

#[test]
fn oracle_a_diagonal_matrix() {
    let sigma = [4.0, 2.0, 0.5];
    let w = Mat::from_fn(3, 3, |i, j| if i == j { sigma[i] } else { 0.0 });
    let c = Conditioning::of_rows(w.as_ref(), 2);
    assert!(close(c.raw.two_norm, 8.0));
    assert!(close(c.raw.pivoted_qr, 8.0));
    // ‖A‖_F ‖A⁻¹‖_F with A = diag(16, 4, 1/4).
    let frobenius = f64::sqrt(256.0 + 16.0 + 0.0625) * f64::sqrt(1.0 / 256.0 + 0.0625 + 16.0);
    assert!(close(c.raw.frobenius, frobenius));
    assert!(close(c.equilibrated.two_norm, 1.0));
    assert!(close(c.equilibrated.frobenius, 3.0));
    assert!(close(c.log_det, f64::ln(16.0 * 4.0 * 0.25 / 8.0)));
    assert!(close(c.trace_inverse, 2.0 * (1.0 / 16.0 + 0.25 + 4.0)));
    assert!(close(c.smallest_singular_value, 0.5 / 2_f64.sqrt()));
    let s = c.equilibrium.unwrap();
    assert_eq!(
        (s.ratio, s.n_zero, s.nonzero_ratio),
        (f64::INFINITY, 6, 8.0)
    );
    let sum = Criterion::WeightedSum {
        condition: 1.0,
        equilibrium: 0.0,
    };
    assert!(sum.evaluate(w.as_ref(), 2).is_nan() || sum.evaluate(w.as_ref(), 2).is_infinite());
}

#[test]
fn identity_rank_deficiency_is_infinite_not_an_error() {
    let w = Mat::from_fn(5, 3, |i, j| if j == 2 { 0.0 } else { (i + j) as f64 + 1.0 });
    let c = Conditioning::of_rows(w.as_ref(), 5);
    assert_eq!(c.raw.two_norm, f64::INFINITY);
    assert_eq!(c.raw.frobenius, f64::INFINITY);
    assert_eq!(c.log_det, f64::NEG_INFINITY);
    let worst = Criterion::LogDet.evaluate(w.as_ref(), 5);
    assert_eq!(worst, f64::INFINITY);
    let worst = Criterion::TwoNorm(Scaling::Equilibrated).evaluate(w.as_ref(), 5);
    assert_eq!(worst, f64::INFINITY);
}

#[test]
#[should_panic(expected = "2 rows cannot determine 3 columns")]
fn regress_too_few_rows_are_a_bug_of_the_caller() {
    let w = Mat::from_fn(2, 3, |i, j| (i * 3 + j) as f64);
    let _ = Conditioning::of_rows(w.as_ref(), 2);
}
