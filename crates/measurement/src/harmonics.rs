//! Averaged positions as a finite Fourier series, differentiated exactly.

use crate::error::Error;
use idim_model::JointStates;

/// `q(t) = mean + Σ cosine_l cos(l ω t) + sine_l sin(l ω t)`, joint by joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics {
    /// Fundamental, rad/s.
    pub omega: f64,
    /// Mean of each joint, rad (m).
    pub mean: Vec<f64>,
    /// `cosine[joint][l - 1]`.
    pub cosine: Vec<Vec<f64>>,
    /// `sine[joint][l - 1]`.
    pub sine: Vec<Vec<f64>>,
    /// Root mean square of what the series leaves, for each joint.
    pub residual: Vec<f64>,
}

/// Least-squares fit of harmonics to one averaged period; on a whole period it is the discrete Fourier sum.
///
/// `mean_period[joint][sample]`, uniform over `period` (s), the first sample at `t = 0`. Source: Swevers et al. 1997.
///
/// # Errors
/// As many harmonics as half the samples, or more.
pub fn fit_harmonics(
    mean_period: &[Vec<f64>],
    period: f64,
    n_harmonics: usize,
) -> Result<Harmonics, Error> {
    let n = mean_period.first().map_or(0, Vec::len);
    if 2 * n_harmonics + 1 > n {
        return Err(Error::setting(
            "harmonics",
            n_harmonics as f64,
            format!(
                "{n} samples a period carry fewer than {} of them",
                n.div_ceil(2)
            ),
        ));
    }
    let mut fit = Harmonics {
        omega: std::f64::consts::TAU / period,
        mean: Vec::new(),
        cosine: Vec::new(),
        sine: Vec::new(),
        residual: Vec::new(),
    };
    // cos and sin of 2 π m / n, so that harmonics share exact angles.
    let table: Vec<(f64, f64)> = (0..n)
        .map(|m| (std::f64::consts::TAU * m as f64 / n as f64).sin_cos())
        .collect();
    for q in mean_period {
        let mean = q.iter().sum::<f64>() / n as f64;
        let mut rest: Vec<f64> = q.iter().map(|v| v - mean).collect();
        let (mut cosine, mut sine) = (Vec::new(), Vec::new());
        for l in 1..=n_harmonics {
            let (mut c, mut s) = (0.0, 0.0);
            for (k, v) in q.iter().enumerate() {
                let (sin, cos) = table[l * k % n];
                c += (v - mean) * cos;
                s += (v - mean) * sin;
            }
            let (c, s) = (2.0 * c / n as f64, 2.0 * s / n as f64);
            for (k, r) in rest.iter_mut().enumerate() {
                let (sin, cos) = table[l * k % n];
                *r -= c * cos + s * sin;
            }
            cosine.push(c);
            sine.push(s);
        }
        let square = rest.iter().map(|r| r * r).sum::<f64>() / n as f64;
        fit.mean.push(mean);
        fit.cosine.push(cosine);
        fit.sine.push(sine);
        fit.residual.push(square.sqrt());
    }
    Ok(fit)
}

impl Harmonics {
    /// Positions and their exact derivatives at times (s) after the start of the period.
    pub fn states(&self, times: &[f64]) -> JointStates {
        let mut states = JointStates::zeros(self.mean.len(), times.len());
        for j in 0..self.mean.len() {
            for (k, &t) in times.iter().enumerate() {
                let (mut q, mut qd, mut qdd) = (self.mean[j], 0.0, 0.0);
                let terms = self.cosine[j].iter().zip(&self.sine[j]);
                for (l, (c, s)) in terms.enumerate() {
                    let w = (l + 1) as f64 * self.omega;
                    let (sin, cos) = (w * t).sin_cos();
                    let x = c * cos + s * sin;
                    q += x;
                    qd += w * (s * cos - c * sin);
                    qdd -= w * w * x;
                }
                states.q_mut(j)[k] = q;
                states.qd_mut(j)[k] = qd;
                states.qdd_mut(j)[k] = qdd;
            }
        }
        states
    }
}
