//! Limits of a Fourier motion as bounds on linear functions of its variables, joint by joint.

use crate::fourier_chart::Chart;
use idim_trajectory::{Certificate, FourierBasis, FourierSeries, LimitKind, Limits};
use std::f64::consts::TAU;

/// Samples a harmonic on which extrema are looked for: the parabola through three neighbours then misses the top by
/// 1e-4 of it.
const SAMPLES_PER_HARMONIC: usize = 32;
/// Left to a limit by what is to be certified: less than the certificate forgives, far more than rounding.
const ROUNDING_ROOM: f64 = 1e-10;
/// Rounds of finding extrema and drawing in; each squares what the one before exceeded the limits by.
const MAX_DRAWS: usize = 6;

/// Bounds `-1 < offset + Σ_k x_k column_k < 1` of one joint: fractions of its limits at instants of the period.
///
/// Filled up to whole blocks of eight with bounds that nothing reaches.
#[derive(Debug, Clone)]
pub(crate) struct JointBounds {
    /// One column a variable, one entry a bound.
    pub(crate) columns: Vec<Vec<f64>>,
    pub(crate) offset: Vec<f64>,
}

impl JointBounds {
    pub(crate) const BLOCK: usize = 8;

    fn none(width: usize) -> Self {
        Self {
            columns: vec![Vec::new(); width],
            offset: Vec::new(),
        }
    }

    fn fill_up(&mut self) {
        let len = self.offset.len().next_multiple_of(Self::BLOCK);
        self.offset.resize(len, 0.0);
        for column in &mut self.columns {
            column.resize(len, 0.0);
        }
    }
}

/// Limits of all joints as bounds on the variables of a chart.
#[derive(Debug, Clone)]
pub(crate) struct Bounds {
    period: f64,
    n_harmonics: usize,
    limits: Limits,
    pub(crate) chart: Chart,
    pub(crate) joints: Vec<JointBounds>,
}

impl Bounds {
    /// With the limits at `n_samples` equal steps of the period.
    pub(crate) fn new(
        limits: &Limits,
        chart: Chart,
        n_harmonics: usize,
        period: f64,
        n_samples: usize,
    ) -> Self {
        let none = JointBounds::none(chart.width());
        let mut new = Self {
            period,
            n_harmonics,
            limits: limits.clone(),
            joints: vec![none; limits.n_joints()],
            chart,
        };
        let basis = FourierBasis::equispaced(period, n_harmonics, n_samples);
        for j in 0..limits.n_joints() {
            for kind in [
                LimitKind::Position,
                LimitKind::Velocity,
                LimitKind::Acceleration,
            ] {
                new.push(j, kind, &basis);
            }
        }
        new
    }

    /// Number of bounds.
    pub(crate) fn len(&self) -> usize {
        self.joints.iter().map(|j| j.offset.len()).sum()
    }

    fn push(&mut self, joint: usize, kind: LimitKind, basis: &FourierBasis) {
        let limits = &self.limits;
        let half = limits.half_range(joint);
        let (bound, offset) = match kind {
            LimitKind::Position => (
                half,
                (self.chart.still(joint) - limits.centre(joint)) / half,
            ),
            LimitKind::Velocity => (limits.velocity[joint], 0.0),
            LimitKind::Acceleration => (limits.acceleration[joint], 0.0),
        };
        let z = self.chart.z(joint);
        let bounds = &mut self.joints[joint];
        for (k, column) in bounds.columns.iter_mut().enumerate() {
            let start = column.len();
            column.resize(start + basis.n_samples(), 0.0);
            for c in 0..basis.n_columns() {
                let values = match kind {
                    LimitKind::Position => basis.q_column(c),
                    LimitKind::Velocity => basis.qd_column(c),
                    LimitKind::Acceleration => basis.qdd_column(c),
                };
                let factor = z[(c, k)] / bound;
                for (x, v) in column[start..].iter_mut().zip(values) {
                    *x += factor * v;
                }
            }
        }
        bounds
            .offset
            .resize(bounds.offset.len() + basis.n_samples(), offset);
        bounds.fill_up();
    }

    /// Adds the limits at more instants, s.
    fn add(&mut self, joint: usize, kind: LimitKind, times: &[f64]) {
        let basis = FourierBasis::at(TAU / self.period, self.n_harmonics, times);
        self.push(joint, kind, &basis);
    }

    /// Adds the limits at every extremum of the motion that uses more than the fraction `near` of one.
    pub(crate) fn add_extrema(&mut self, fine: &Self, x: &[f64], near: f64) {
        let used = fine.used(x);
        let n_samples = SAMPLES_PER_HARMONIC * self.n_harmonics;
        let kinds = [
            LimitKind::Position,
            LimitKind::Velocity,
            LimitKind::Acceleration,
        ];
        for (k, u) in used.chunks_exact(n_samples).enumerate() {
            let mut times = Vec::new();
            for i in 0..n_samples {
                let before = u[(i + n_samples - 1) % n_samples];
                let (here, after) = (u[i], u[(i + 1) % n_samples]);
                let top = here.abs() >= before.abs() && here.abs() > after.abs();
                if top && here.abs() > near {
                    let bend = before - 2.0 * here + after;
                    let shift = 0.5 * (before - after) / bend;
                    times.push(self.period * (i as f64 + shift) / n_samples as f64);
                }
            }
            self.add(k / 3, kinds[k % 3], &times);
        }
    }

    /// The same limits on a grid fine enough to find extrema on.
    pub(crate) fn fine(&self) -> Self {
        Self::new(
            &self.limits,
            self.chart.clone(),
            self.n_harmonics,
            self.period,
            SAMPLES_PER_HARMONIC * self.n_harmonics,
        )
    }

    /// Draws each joint towards standing still until no bound uses more than `largest`.
    pub(crate) fn draw_in(&self, x: &mut [f64], largest: f64) {
        let change = self.change(x);
        let mut change = change.iter();
        for (bounds, x) in self
            .joints
            .iter()
            .zip(x.chunks_exact_mut(self.chart.width()))
        {
            let mut factor = 1.0_f64;
            for (offset, change) in bounds.offset.iter().zip(change.by_ref()) {
                if (offset + change).abs() > largest {
                    factor = factor.min((largest - offset * change.signum()) / change.abs());
                }
            }
            if factor < 1.0 {
                for x in x {
                    *x *= factor.max(0.0);
                }
            }
        }
    }

    /// The motion with its certificate, drawn in by what it exceeds the limits between the instants of the bounds.
    pub(crate) fn certified(&self, x: &[f64]) -> Option<(FourierSeries, Certificate)> {
        let mut x = x.to_vec();
        let mut exceeded = Self {
            period: self.period,
            n_harmonics: self.n_harmonics,
            limits: self.limits.clone(),
            chart: self.chart.clone(),
            joints: vec![JointBounds::none(self.chart.width()); self.joints.len()],
        };
        for _ in 0..MAX_DRAWS {
            let c = self.chart.coefficients(&x);
            let n_joints = self.chart.n_joints();
            let omega = TAU / self.period;
            let series =
                FourierSeries::from_coefficients(omega, n_joints, self.n_harmonics, &c).ok()?;
            let certificate = series.certificate(&self.limits);
            if certificate.certified {
                return Some((series, certificate));
            }
            for (j, used) in certificate.joints.iter().enumerate() {
                for (kind, limit) in [
                    (LimitKind::Position, used.position),
                    (LimitKind::Velocity, used.velocity),
                    (LimitKind::Acceleration, used.acceleration),
                ] {
                    if limit.bound > 1.0 {
                        exceeded.add(j, kind, &[limit.time]);
                    }
                }
            }
            exceeded.draw_in(&mut x, 1.0 - ROUNDING_ROOM);
        }
        None
    }

    /// Fraction of the limit used by every bound, joint after joint.
    pub(crate) fn used(&self, x: &[f64]) -> Vec<f64> {
        let mut used = self.change(x);
        let offsets = self.joints.iter().flat_map(|j| &j.offset);
        for (u, o) in used.iter_mut().zip(offsets) {
            *u += o;
        }
        used
    }

    /// Change of every bound's value with `x`.
    pub(crate) fn change(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.len()];
        let mut from = 0;
        for (joint, x) in self.joints.iter().zip(x.chunks_exact(self.chart.width())) {
            let out = &mut out[from..from + joint.offset.len()];
            for (column, x) in joint.columns.iter().zip(x) {
                for (o, c) in out.iter_mut().zip(column) {
                    *o += x * c;
                }
            }
            from += joint.offset.len();
        }
        out
    }
}
