//! Low-pass filters applied forwards and backwards.

use std::f64::consts::PI;

/// One second-order section, `y = (b0 + b1 z⁻¹ + b2 z⁻²) / (1 + a1 z⁻¹ + a2 z⁻²) x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Numerator, `[b0, b1, b2]`.
    pub b: [f64; 3],
    /// Denominator without its leading one, `[a1, a2]`.
    pub a: [f64; 2],
}

/// Butterworth low-pass: `|H(f)|² = 1 / (1 + (f / cutoff)^(2 order))` before the bilinear warp.
///
/// `cutoff`, `sample_rate` in Hz. Applied forwards and backwards the gain at the cutoff is one half.
/// Source: Butterworth 1930; bilinear transform with prewarping.
///
/// # Panics
/// If the order is zero or the cutoff is not between zero and half the sample rate.
#[track_caller]
pub fn butterworth(order: usize, cutoff: f64, sample_rate: f64) -> Vec<Section> {
    let poles: Vec<[f64; 2]> = angles(order)
        .map(|angle| [-angle.cos(), angle.sin()])
        .collect();
    low_pass(&poles, order, 1.0, cutoff, sample_rate)
}

/// Chebyshev low-pass of the first kind: gain between 1 and `10^(-ripple / 20)` up to the edge, falling beyond.
///
/// `ripple` in dB; `edge`, `sample_rate` in Hz. Source: Parks & Burrus 1987.
///
/// # Panics
/// As [`butterworth`].
#[track_caller]
pub fn chebyshev(order: usize, ripple: f64, edge: f64, sample_rate: f64) -> Vec<Section> {
    let epsilon = (10f64.powf(0.1 * ripple) - 1.0).sqrt();
    let mu = (1.0 / epsilon).asinh() / order as f64;
    let poles: Vec<[f64; 2]> = angles(order)
        .map(|angle| [-mu.sinh() * angle.cos(), mu.cosh() * angle.sin()])
        .collect();
    let even = order.is_multiple_of(2);
    let gain = if even { 1.0 / epsilon.hypot(1.0) } else { 1.0 };
    low_pass(&poles, order, gain, edge, sample_rate)
}

/// Angles of the poles in the upper half plane from the negative real axis; the real pole of an odd order last.
fn angles(order: usize) -> impl Iterator<Item = f64> {
    assert!(order > 0, "a filter has at least order 1");
    (0..order.div_ceil(2)).map(move |k| {
        let m = order as f64 - 1.0 - 2.0 * k as f64;
        m * PI / (2.0 * order as f64)
    })
}

/// Sections from analog poles `[real, imaginary]` of cutoff 1 rad/s by the bilinear transform.
#[track_caller]
fn low_pass(
    poles: &[[f64; 2]],
    order: usize,
    gain: f64,
    cutoff: f64,
    sample_rate: f64,
) -> Vec<Section> {
    assert!(
        cutoff > 0.0 && cutoff < 0.5 * sample_rate,
        "cutoff {cutoff} Hz is not between zero and half the sample rate {sample_rate} Hz"
    );
    let warp = (PI * cutoff / sample_rate).tan();
    let mut sections: Vec<Section> = poles
        .iter()
        .enumerate()
        .map(|(k, &[re, im])| {
            let re = re * warp;
            if 2 * k + 1 == order {
                let d = 1.0 - re;
                return Section {
                    b: [-re / d, -re / d, 0.0],
                    a: [(-re - 1.0) / d, 0.0],
                };
            }
            let (s1, s0) = (-2.0 * re, re * re + im * im * warp * warp);
            let d = 1.0 + s1 + s0;
            Section {
                b: [s0 / d, 2.0 * s0 / d, s0 / d],
                a: [2.0 * (s0 - 1.0) / d, (1.0 - s1 + s0) / d],
            }
        })
        .collect();
    for b in &mut sections[0].b {
        *b *= gain;
    }
    sections
}

/// Samples reflected about each end before filtering: three times the length of the impulse response's recursion.
pub fn padding(sections: &[Section]) -> usize {
    let real = sections.iter().any(|s| s.a[1] == 0.0 && s.b[2] == 0.0);
    3 * (2 * sections.len() + 1 - usize::from(real))
}

/// Remaining share of an edge's disturbance after [`settling`].
const SETTLED: f64 = 1e-3;

/// Samples after which the slowest pole has fallen to a thousandth: what the ends of a filtered signal lose.
pub fn settling(sections: &[Section]) -> usize {
    let radius = |s: &Section| {
        let [a1, a2] = s.a;
        let discriminant = 0.25 * a1 * a1 - a2;
        if discriminant < 0.0 {
            a2.sqrt()
        } else {
            0.5 * a1.abs() + discriminant.sqrt()
        }
    };
    let slowest = sections.iter().map(radius).fold(0.0, f64::max);
    (SETTLED.ln() / slowest.ln()).ceil() as usize
}

/// Filters forwards and backwards: no phase, the square of the gain.
///
/// Ends are extended by point reflection and the filter starts in its steady state, as scipy's `sosfiltfilt`.
///
/// # Panics
/// If the signal is not longer than the [`padding`].
#[track_caller]
pub fn filter_zero_phase(sections: &[Section], x: &[f64]) -> Vec<f64> {
    let lanes: Vec<[f64; 1]> = x.iter().map(|&v| [v]).collect();
    zero_phase_lanes(sections, &lanes)
        .into_iter()
        .map(|[v]| v)
        .collect()
}

/// [`filter_zero_phase`] of several signals side by side.
#[track_caller]
pub(crate) fn zero_phase_lanes<const L: usize>(
    sections: &[Section],
    x: &[[f64; L]],
) -> Vec<[f64; L]> {
    let pad = padding(sections);
    let n = x.len();
    assert!(
        n > pad,
        "{n} samples, where this filter reflects {pad} at each end"
    );
    let reflect = |end: usize, k: usize| std::array::from_fn(|l| 2.0 * x[end][l] - x[k][l]);
    let mut y: Vec<[f64; L]> = Vec::with_capacity(n + 2 * pad);
    y.extend((1..=pad).rev().map(|k| reflect(0, k)));
    y.extend_from_slice(x);
    y.extend((1..=pad).map(|k| reflect(n - 1, n - 1 - k)));
    for _ in 0..2 {
        let first = y[0];
        let mut scale = 1.0;
        for s in sections {
            scale *= run_section(s, &mut y, first.map(|v| v * scale));
        }
        y.reverse();
    }
    y.drain(..pad);
    y.truncate(n);
    y
}

/// Runs one section in place from the steady state of the constant `input`; returns its gain at zero frequency.
fn run_section<const L: usize>(s: &Section, x: &mut [[f64; L]], input: [f64; L]) -> f64 {
    let ([b0, b1, b2], [a1, a2]) = (s.b, s.a);
    let gain = (b0 + b1 + b2) / (1.0 + a1 + a2);
    let mut z1 = input.map(|v| (b2 - a2 * gain) * v);
    let mut z0: [f64; L] = std::array::from_fn(|l| (b1 - a1 * gain) * input[l] + z1[l]);
    for x in x {
        for l in 0..L {
            let y = b0 * x[l] + z0[l];
            z0[l] = b1 * x[l] - a1 * y + z1[l];
            z1[l] = b2 * x[l] - a2 * y;
            x[l] = y;
        }
    }
    gain
}
