//! The coefficients of a Fourier series as free variables: scaled, and without those that conditions at the ends fix.

use crate::FourierEnds;
use faer::Mat;
use idim_trajectory::{Limits, rest_rows};

/// Coefficients `c = still + Z x`, joint by joint; `x = 0` stands still inside all limits, and every `x` meets the
/// conditions at the ends.
#[derive(Debug, Clone)]
pub(crate) struct Chart {
    n_harmonics: usize,
    /// Position of each joint standing still, rad.
    still: Vec<f64>,
    /// One `(2 N + 1) × width` matrix a joint.
    z: Vec<Mat<f64>>,
    /// Its left inverse, `width × (2 N + 1)`.
    inverse: Vec<Mat<f64>>,
}

impl Chart {
    pub(crate) fn new(
        limits: &Limits,
        n_harmonics: usize,
        period: f64,
        ends: &FourierEnds,
    ) -> Self {
        let n_coefficients = 2 * n_harmonics + 1;
        let mut chart = Self {
            n_harmonics,
            still: Vec::new(),
            z: Vec::new(),
            inverse: Vec::new(),
        };
        let home = match ends {
            FourierEnds::AtRestAt(home) => Some(&home[..]),
            FourierEnds::Free | FourierEnds::AtRest => None,
        };
        // The same for every joint but for home, which is the still motion and so asks zero of the rest.
        let rest = rest_rows(1, n_harmonics, period, home.map(|_| &[0.0][..]));
        for j in 0..limits.n_joints() {
            chart
                .still
                .push(home.map_or_else(|| limits.centre(j), |h| h[j]));
            // Typical size: half the range for the offset, the largest speed for the others.
            let size = |c: usize| {
                if c == 0 {
                    limits.half_range(j)
                } else {
                    limits.velocity[j]
                }
            };
            let null = if *ends == FourierEnds::Free {
                Mat::identity(n_coefficients, n_coefficients)
            } else {
                let rows = Mat::from_fn(n_coefficients, rest.n_rows(), |c, r| {
                    rest.row(r)[c] * size(c)
                });
                let q = rows.qr().compute_Q();
                q.subcols(rest.n_rows(), n_coefficients - rest.n_rows())
                    .to_owned()
            };
            let width = null.ncols();
            chart.z.push(Mat::from_fn(n_coefficients, width, |c, k| {
                size(c) * null[(c, k)]
            }));
            // The columns of `null` are orthonormal.
            chart
                .inverse
                .push(Mat::from_fn(width, n_coefficients, |k, c| {
                    null[(c, k)] / size(c)
                }));
        }
        chart
    }

    pub(crate) fn n_joints(&self) -> usize {
        self.still.len()
    }

    /// Variables of a joint.
    pub(crate) fn width(&self) -> usize {
        self.z[0].ncols()
    }

    /// Position of a joint standing still, rad.
    pub(crate) fn still(&self, joint: usize) -> f64 {
        self.still[joint]
    }

    /// Change of the coefficients of a joint with its variables.
    pub(crate) fn z(&self, joint: usize) -> &Mat<f64> {
        &self.z[joint]
    }

    pub(crate) fn coefficients(&self, x: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        for (j, x) in x.chunks_exact(self.width()).enumerate() {
            for c in 0..=2 * self.n_harmonics {
                let moved: f64 = x
                    .iter()
                    .enumerate()
                    .map(|(k, x)| self.z[j][(c, k)] * x)
                    .sum();
                out.push(moved + if c == 0 { self.still[j] } else { 0.0 });
            }
        }
        out
    }

    /// The nearest variables, in the scaled sense, to these coefficients.
    pub(crate) fn variables(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        for (j, c) in coefficients
            .chunks_exact(2 * self.n_harmonics + 1)
            .enumerate()
        {
            for k in 0..self.width() {
                let mut sum = -self.inverse[j][(k, 0)] * self.still[j];
                for (i, c) in c.iter().enumerate() {
                    sum += self.inverse[j][(k, i)] * c;
                }
                out.push(sum);
            }
        }
        out
    }

    /// Gradient by the variables from the gradient by the coefficients.
    pub(crate) fn pull_back(&self, gradient: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        for (j, g) in gradient.chunks_exact(2 * self.n_harmonics + 1).enumerate() {
            for k in 0..self.width() {
                out.push(
                    g.iter()
                        .enumerate()
                        .map(|(c, g)| self.z[j][(c, k)] * g)
                        .sum(),
                );
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use idim_trajectory::FourierSeries;
    use std::f64::consts::TAU;

    fn limits() -> Limits {
        Limits {
            position: vec![[-1.0, 2.0], [0.5, 1.5]],
            velocity: vec![1.0, 3.0],
            acceleration: vec![4.0, 5.0],
        }
    }

    #[test]
    fn identity_every_variable_keeps_the_conditions_at_the_ends() {
        for (ends, width) in [
            (FourierEnds::Free, 7),
            (FourierEnds::AtRest, 5),
            (FourierEnds::AtRestAt(vec![0.3, 0.7]), 4),
        ] {
            let chart = Chart::new(&limits(), 3, 4.0, &ends);
            assert_eq!(chart.width(), width);
            let x: Vec<f64> = (0..2 * chart.width())
                .map(|k| (0.7 * k as f64).sin())
                .collect();
            let c = chart.coefficients(&x);
            for (there, back) in x.iter().zip(chart.variables(&c)) {
                assert!((there - back).abs() < 1e-14);
            }
            let series = FourierSeries::from_coefficients(TAU / 4.0, 2, 3, &c);
            let states = series.map(|s| s.states(&[0.0, 4.0]));
            assert!(states.is_ok());
            let Ok(states) = states else { return };
            for j in 0..2 {
                for k in 0..2 {
                    if ends != FourierEnds::Free {
                        // Rounding of sums of a few terms of size one, times the harmonics.
                        assert!(states.qd(j)[k].abs() < 1e-13);
                        assert!(states.qdd(j)[k].abs() < 1e-12);
                    }
                    if let FourierEnds::AtRestAt(home) = &ends {
                        assert!((states.q(j)[k] - home[j]).abs() < 1e-13);
                    }
                }
            }
        }
    }

    #[test]
    fn identity_the_gradient_goes_back_through_the_transpose() {
        let chart = Chart::new(&limits(), 2, 4.0, &FourierEnds::AtRest);
        let n = 2 * chart.width();
        let g: Vec<f64> = (0..10).map(|k| (1.3 * f64::from(k)).cos()).collect();
        let x: Vec<f64> = (0..n).map(|k| (0.9 * k as f64).sin()).collect();
        let at = chart.coefficients(&x);
        let zero = chart.coefficients(&vec![0.0; n]);
        let there: f64 = g
            .iter()
            .zip(at.iter().zip(&zero))
            .map(|(g, (a, z))| g * (a - z))
            .sum();
        let back: f64 = chart.pull_back(&g).iter().zip(&x).map(|(g, x)| g * x).sum();
        assert!((there - back).abs() < 1e-13);
    }
}
