//! A Fourier series seen as linear in its coefficients: basis, limits and conditions at the start as rows.

use crate::limits::Limits;
use crate::trigonometric::sampling_factor;
use idim_model::JointStates;
use std::f64::consts::TAU;

/// Values of the basis functions of one joint at given samples: the same for every joint.
///
/// `q(t_k) = Σ_c q_column(c)[k] · coefficient_c`, likewise qd and qdd; coefficients in the order `q0, a_1 … a_N,
/// b_1 … b_N`. Gradients go back through the transpose: [`pull_back`](Self::pull_back).
#[derive(Debug, Clone, PartialEq)]
pub struct FourierBasis {
    n_samples: usize,
    n_columns: usize,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

impl FourierBasis {
    /// At these times, s, of a series of fundamental `omega`, rad/s.
    pub fn at(omega: f64, n_harmonics: usize, times: &[f64]) -> Self {
        Self::from_phases(omega, n_harmonics, times.len(), |k, l| {
            (omega * l as f64 * times[k]).sin_cos()
        })
    }

    /// At `n_samples` equal steps over one period (s), the first at `t = 0`.
    pub fn equispaced(period: f64, n_harmonics: usize, n_samples: usize) -> Self {
        // One table serves all harmonics: phase l k / M wraps around exactly.
        let table: Vec<_> = (0..n_samples)
            .map(|k| (TAU * k as f64 / n_samples as f64).sin_cos())
            .collect();
        Self::from_phases(TAU / period, n_harmonics, n_samples, |k, l| {
            table[k * l % n_samples]
        })
    }

    fn from_phases(
        omega: f64,
        n_harmonics: usize,
        n_samples: usize,
        sin_cos: impl Fn(usize, usize) -> (f64, f64),
    ) -> Self {
        let n_columns = 2 * n_harmonics + 1;
        let zeros = vec![0.0; n_columns * n_samples];
        let [mut q, mut qd, mut qdd] = [zeros.clone(), zeros.clone(), zeros];
        q[..n_samples].fill(1.0);
        for l in 1..=n_harmonics {
            let w = omega * l as f64;
            let a = l * n_samples;
            let b = (n_harmonics + l) * n_samples;
            for k in 0..n_samples {
                let (s, c) = sin_cos(k, l);
                (q[a + k], qd[a + k], qdd[a + k]) = (s / w, c, -w * s);
                (q[b + k], qd[b + k], qdd[b + k]) = (-c / w, s, w * c);
            }
        }
        Self {
            n_samples,
            n_columns,
            q,
            qd,
            qdd,
        }
    }

    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// Number of coefficients of a joint, 2 N + 1.
    pub fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// Change of every sample's position with one coefficient.
    pub fn q_column(&self, column: usize) -> &[f64] {
        &self.q[column * self.n_samples..][..self.n_samples]
    }

    /// Change of every sample's velocity with one coefficient.
    pub fn qd_column(&self, column: usize) -> &[f64] {
        &self.qd[column * self.n_samples..][..self.n_samples]
    }

    /// Change of every sample's acceleration with one coefficient.
    pub fn qdd_column(&self, column: usize) -> &[f64] {
        &self.qdd[column * self.n_samples..][..self.n_samples]
    }

    /// States of all joints: the basis times `coefficients`, joint after joint.
    ///
    /// # Panics
    /// If the coefficients are not a multiple of [`n_columns`](Self::n_columns).
    #[track_caller]
    pub fn states(&self, coefficients: &[f64]) -> JointStates {
        let mut states = JointStates::zeros(coefficients.len() / self.n_columns, self.n_samples);
        self.states_into(coefficients, &mut states);
        states
    }

    /// As [`states`](Self::states), into states of the same shape.
    ///
    /// # Panics
    /// If the shapes differ.
    #[track_caller]
    pub fn states_into(&self, coefficients: &[f64], states: &mut JointStates) {
        let shape = (coefficients.len(), self.n_samples);
        let expected = (states.n_joints() * self.n_columns, states.n_samples());
        assert_eq!(shape, expected, "coefficients × samples");
        for (j, c) in coefficients.chunks_exact(self.n_columns).enumerate() {
            combine(&self.q, c, states.q_mut(j));
            combine(&self.qd, c, states.qd_mut(j));
            combine(&self.qdd, c, states.qdd_mut(j));
        }
    }

    /// Gradient with respect to the coefficients from the gradient with respect to the states: the transpose of
    /// [`states`](Self::states).
    ///
    /// `gradient.q(j)[k]` is the derivative with respect to q of joint j at sample k, and so on.
    ///
    /// # Panics
    /// If the number of samples differs.
    #[track_caller]
    pub fn pull_back(&self, gradient: &JointStates) -> Vec<f64> {
        assert_eq!(gradient.n_samples(), self.n_samples, "samples");
        let mut out = Vec::with_capacity(gradient.n_joints() * self.n_columns);
        for j in 0..gradient.n_joints() {
            for c in 0..self.n_columns {
                out.push(
                    dot(self.q_column(c), gradient.q(j))
                        + dot(self.qd_column(c), gradient.qd(j))
                        + dot(self.qdd_column(c), gradient.qdd(j)),
                );
            }
        }
        out
    }
}

/// `out = columns · coefficients`.
fn combine(columns: &[f64], coefficients: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (column, c) in columns.chunks_exact(out.len()).zip(coefficients) {
        for (o, x) in out.iter_mut().zip(column) {
            *o += c * x;
        }
    }
}

/// Sum of products in eight fixed lanes: the order, and so the last bit, does not depend on the machine.
fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (x8, x_rest) = x.as_chunks::<8>();
    let (y8, y_rest) = y.as_chunks::<8>();
    for (a, b) in x8.iter().zip(y8) {
        for i in 0..8 {
            lanes[i] += a[i] * b[i];
        }
    }
    let rest: f64 = x_rest.iter().zip(y_rest).map(|(a, b)| a * b).sum();
    lanes.iter().sum::<f64>() + rest
}

/// Linear conditions on a vector of coefficients: `row · c ≤ right_side`, or `=`, as the function that made them says.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearRows {
    /// Length of a row.
    pub n_columns: usize,
    /// Rows one after another.
    pub coefficients: Vec<f64>,
    /// Right side of each row.
    pub right_side: Vec<f64>,
}

impl LinearRows {
    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.right_side.len()
    }

    /// One row.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.coefficients[row * self.n_columns..][..self.n_columns]
    }

    /// `row · c − right_side` of every row.
    pub fn residuals(&self, c: &[f64]) -> Vec<f64> {
        (0..self.n_rows())
            .map(|i| dot(self.row(i), c) - self.right_side[i])
            .collect()
    }
}

/// Inequalities `row · c ≤ right_side` that keep a series inside its limits at every instant, not only at the samples.
///
/// `c`: coefficients of all joints, `n_joints (2 N + 1)`; `period` s; rows joint after joint, sample after sample,
/// upper and lower position, velocity, acceleration: `6 n_joints n_samples`. The right sides are tightened by
/// [`sampling_factor`], so they cost the fraction `(π N / M)² / 2` of each limit: 1.2 % for N = 5, M = 100.
///
/// # Panics
/// Unless `n_samples > 2 * n_harmonics`.
#[track_caller]
pub fn constraint_rows(
    limits: &Limits,
    n_harmonics: usize,
    period: f64,
    n_samples: usize,
) -> LinearRows {
    let factor = sampling_factor(n_harmonics, n_samples);
    let basis = FourierBasis::equispaced(period, n_harmonics, n_samples);
    let width = basis.n_columns;
    let n_columns = limits.n_joints() * width;
    let mut coefficients = Vec::with_capacity(6 * limits.n_joints() * n_samples * n_columns);
    let mut right_side = Vec::with_capacity(6 * limits.n_joints() * n_samples);
    for j in 0..limits.n_joints() {
        let (centre, half) = (limits.centre(j), limits.half_range(j));
        for k in 0..n_samples {
            for (values, centre, bound) in [
                (&basis.q, centre, half),
                (&basis.qd, 0.0, limits.velocity[j]),
                (&basis.qdd, 0.0, limits.acceleration[j]),
            ] {
                for sign in [1.0, -1.0] {
                    let start = coefficients.len() + j * width;
                    coefficients.resize(coefficients.len() + n_columns, 0.0);
                    for c in 0..width {
                        coefficients[start + c] = sign * values[c * n_samples + k];
                    }
                    right_side.push(factor * bound + sign * centre);
                }
            }
        }
    }
    LinearRows {
        n_columns,
        coefficients,
        right_side,
    }
}

/// Equations `row · c = right_side` of a motion that starts (and, being periodic, ends) at rest: for every joint
/// `Σ a_l = 0` (qd(0) = 0), `Σ l b_l = 0` (qdd(0) = 0), and, where `home` is given, `q0 − Σ b_l/(ω l) = home` (rad).
pub fn rest_rows(
    n_joints: usize,
    n_harmonics: usize,
    period: f64,
    home: Option<&[f64]>,
) -> LinearRows {
    let width = 2 * n_harmonics + 1;
    let n_columns = n_joints * width;
    let mut rows = LinearRows {
        n_columns,
        coefficients: Vec::new(),
        right_side: Vec::new(),
    };
    for j in 0..n_joints {
        let (a, b) = (j * width, j * width + n_harmonics);
        let mut push = |fill: &dyn Fn(&mut [f64]), right_side: f64| {
            let mut row = vec![0.0; n_columns];
            fill(&mut row);
            rows.coefficients.extend(row);
            rows.right_side.push(right_side);
        };
        push(&|row| row[a + 1..=a + n_harmonics].fill(1.0), 0.0);
        push(
            &|row| (1..=n_harmonics).for_each(|l| row[b + l] = l as f64),
            0.0,
        );
        if let Some(home) = home {
            push(
                &|row| {
                    row[a] = 1.0;
                    (1..=n_harmonics).for_each(|l| row[b + l] = -period / (TAU * l as f64));
                },
                home[j],
            );
        }
    }
    rows
}
