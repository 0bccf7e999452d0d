//! Finite Fourier series with one fundamental for all joints.

use crate::error::Error;
use crate::trigonometric::TrigonometricPolynomial;
use idim_model::JointStates;
use std::f64::consts::TAU;

/// A periodic motion, exact in q, qd and qdd.
///
/// ```text
/// q   = q0 + Σ a_l/(ω l) sin(ω l t) − b_l/(ω l) cos(ω l t)
/// qd  =      Σ a_l cos(ω l t) + b_l sin(ω l t)
/// qdd =      Σ −a_l ω l sin(ω l t) + b_l ω l cos(ω l t)          l = 1 … N
/// ```
///
/// `ω` rad/s; `q0` rad, `a`, `b` rad/s (m, m/s for prismatic). Source: Swevers et al. 1997; Radkhah, Kulić & Croft
/// 2007, section II.C.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierSeries {
    omega: f64,
    q0: Vec<f64>,
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
}

impl FourierSeries {
    /// Checks and keeps a series: `q0[joint]`, `a[joint][l - 1]`, `b[joint][l - 1]`.
    ///
    /// # Errors
    /// No joint, no harmonic, joints with different numbers of harmonics, a fundamental that is not above zero, a
    /// number that is not finite.
    pub fn new(
        omega: f64,
        q0: Vec<f64>,
        a: Vec<Vec<f64>>,
        b: Vec<Vec<f64>>,
    ) -> Result<Self, Error> {
        if !(omega > 0.0 && omega.is_finite()) {
            return Err(Error::motion(
                "fundamental",
                format!("{omega} rad/s"),
                "it must be finite and above zero: 2π over the period",
            ));
        }
        if q0.is_empty() || a.len() != q0.len() || b.len() != q0.len() {
            return Err(Error::motion(
                "series",
                format!("{} q0, {} a, {} b", q0.len(), a.len(), b.len()),
                "give one of each for every joint",
            ));
        }
        let n_harmonics = a[0].len();
        for j in 0..q0.len() {
            if n_harmonics == 0 || a[j].len() != n_harmonics || b[j].len() != n_harmonics {
                return Err(Error::motion(
                    format!("joint {}", j + 1),
                    format!("{} sine and {} cosine coefficients", a[j].len(), b[j].len()),
                    "all joints have the same number of harmonics, at least one; fill up with zeros",
                ));
            }
            let all = std::iter::once(&q0[j]).chain(&a[j]).chain(&b[j]);
            if let Some(bad) = all.into_iter().find(|v| !v.is_finite()) {
                return Err(Error::motion(
                    format!("joint {}", j + 1),
                    format!("coefficient {bad}"),
                    "coefficients must be finite",
                ));
            }
        }
        Ok(Self { omega, q0, a, b })
    }

    /// From one vector, per joint `q0, a_1 … a_N, b_1 … b_N`: the inverse of [`coefficients`](Self::coefficients).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    ///
    /// # Panics
    /// If there are not `n_joints * (2 * n_harmonics + 1)` coefficients.
    #[track_caller]
    pub fn from_coefficients(
        omega: f64,
        n_joints: usize,
        n_harmonics: usize,
        coefficients: &[f64],
    ) -> Result<Self, Error> {
        let width = 2 * n_harmonics + 1;
        assert_eq!(
            coefficients.len(),
            n_joints * width,
            "{n_joints} joints × {width} coefficients"
        );
        let joints = || coefficients.chunks_exact(width);
        Self::new(
            omega,
            joints().map(|c| c[0]).collect(),
            joints().map(|c| c[1..=n_harmonics].to_vec()).collect(),
            joints().map(|c| c[n_harmonics + 1..].to_vec()).collect(),
        )
    }

    /// All coefficients, per joint `q0, a_1 … a_N, b_1 … b_N`; everything the motion does is linear in them.
    pub fn coefficients(&self) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.n_joints() * (2 * self.n_harmonics() + 1));
        for j in 0..self.n_joints() {
            all.push(self.q0[j]);
            all.extend_from_slice(&self.a[j]);
            all.extend_from_slice(&self.b[j]);
        }
        all
    }

    /// Fundamental, rad/s.
    pub fn omega(&self) -> f64 {
        self.omega
    }

    /// Period, s.
    pub fn period(&self) -> f64 {
        TAU / self.omega
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.q0.len()
    }

    /// Number of harmonics, N.
    pub fn n_harmonics(&self) -> usize {
        self.a[0].len()
    }

    /// Position of every joint averaged over a period, rad: the offset q0.
    pub fn mean_position(&self) -> &[f64] {
        &self.q0
    }

    /// Coefficients `a_1 … a_N` of a joint, rad/s.
    pub fn a(&self, joint: usize) -> &[f64] {
        &self.a[joint]
    }

    /// Coefficients `b_1 … b_N` of a joint, rad/s.
    pub fn b(&self, joint: usize) -> &[f64] {
        &self.b[joint]
    }

    /// States at these times, s.
    pub fn states(&self, times: &[f64]) -> JointStates {
        let phases: Vec<_> = times.iter().map(|t| (self.omega * t).sin_cos()).collect();
        let mut states = JointStates::zeros(self.n_joints(), times.len());
        for j in 0..self.n_joints() {
            for (k, &(sin, cos)) in phases.iter().enumerate() {
                let [q, qd, qdd] = self.joint_state(j, sin, cos);
                states.q_mut(j)[k] = q;
                states.qd_mut(j)[k] = qd;
                states.qdd_mut(j)[k] = qdd;
            }
        }
        states
    }

    /// States at `n_samples` equal steps of one period, the first at `t = 0`.
    ///
    /// For many motions over the same samples keep a [`FourierBasis`](crate::FourierBasis) instead.
    pub fn equispaced_states(&self, n_samples: usize) -> JointStates {
        let step = self.period() / n_samples as f64;
        let times: Vec<_> = (0..n_samples).map(|k| k as f64 * step).collect();
        self.states(&times)
    }

    /// q, qd, qdd of a joint where sine and cosine of the fundamental's phase are these.
    fn joint_state(&self, joint: usize, sin: f64, cos: f64) -> [f64; 3] {
        let [mut q, mut qd, mut qdd] = [self.q0[joint], 0.0, 0.0];
        // Angle addition: its rounding error grows like l, invisible for the harmonics of a robot's motion.
        let (mut s, mut c) = (sin, cos);
        for (i, (a, b)) in self.a[joint].iter().zip(&self.b[joint]).enumerate() {
            let w = self.omega * (i + 1) as f64;
            q += (a * s - b * c) / w;
            qd += a * c + b * s;
            qdd += (b * c - a * s) * w;
            (s, c) = (s * cos + c * sin, c * cos - s * sin);
        }
        [q, qd, qdd]
    }

    /// Position, velocity and acceleration of a joint as polynomials in cosines and sines of ω t.
    pub(crate) fn polynomials(&self, joint: usize) -> [TrigonometricPolynomial; 3] {
        let harmonics = || self.a[joint].iter().zip(&self.b[joint]).enumerate();
        let w = |i: usize| self.omega * (i + 1) as f64;
        [
            TrigonometricPolynomial {
                mean: self.q0[joint],
                cos: harmonics().map(|(i, (_, b))| -b / w(i)).collect(),
                sin: harmonics().map(|(i, (a, _))| a / w(i)).collect(),
            },
            TrigonometricPolynomial {
                mean: 0.0,
                cos: self.a[joint].clone(),
                sin: self.b[joint].clone(),
            },
            TrigonometricPolynomial {
                mean: 0.0,
                cos: harmonics().map(|(i, (_, b))| b * w(i)).collect(),
                sin: harmonics().map(|(i, (a, _))| -a * w(i)).collect(),
            },
        ]
    }

    /// The same motion with the harmonics of each joint times `scale[joint]` and new offsets.
    pub(crate) fn rescaled(&self, scale: &[f64], q0: Vec<f64>) -> Self {
        let times = |x: &[Vec<f64>]| {
            x.iter()
                .zip(scale)
                .map(|(row, k)| row.iter().map(|v| k * v).collect())
                .collect()
        };
        Self {
            omega: self.omega,
            q0,
            a: times(&self.a),
            b: times(&self.b),
        }
    }
}
