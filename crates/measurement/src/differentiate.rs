//! Central differences.

/// First derivative by central differences, `(x[k+1] - x[k-1]) / 2h`; exact for quadratics, ends included.
///
/// `interval` in s.
///
/// # Panics
/// If there are fewer than three samples.
#[track_caller]
pub fn first_difference(x: &[f64], interval: f64) -> Vec<f64> {
    let n = x.len();
    assert!(
        n >= 3,
        "{n} samples, where a central difference needs three"
    );
    let scale = 0.5 / interval;
    let mut out = Vec::with_capacity(n);
    // Ends: derivative of the parabola through the three last points.
    out.push((4.0 * x[1] - 3.0 * x[0] - x[2]) * scale);
    out.extend(x.windows(3).map(|w| (w[2] - w[0]) * scale));
    out.push((3.0 * x[n - 1] - 4.0 * x[n - 2] + x[n - 3]) * scale);
    out
}

/// Second derivative by central differences, `(x[k+1] - 2 x[k] + x[k-1]) / h²`; exact for quadratics, ends included.
///
/// # Panics
/// If there are fewer than three samples.
#[track_caller]
pub fn second_difference(x: &[f64], interval: f64) -> Vec<f64> {
    let n = x.len();
    assert!(
        n >= 3,
        "{n} samples, where a central difference needs three"
    );
    let scale = 1.0 / (interval * interval);
    let inner: Vec<f64> = x
        .windows(3)
        .map(|w| ((w[2] - w[1]) - (w[1] - w[0])) * scale)
        .collect();
    let mut out = Vec::with_capacity(n);
    out.push(inner[0]);
    out.extend_from_slice(&inner);
    out.push(inner[n - 3]);
    out
}
