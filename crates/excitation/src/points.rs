//! The energy model as a design problem: chained points `(q, q̇)`, rows `Δh`, limits (Gautier & Khalil 1991).

use crate::energy::EnergyModel;
use crate::{Conditioning, Error};
use faer::Mat;
use idim_model::{Columns, JointStates, Robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

/// Limits of the points (rad, rad/s), apart from those of the path through them: a path overshoots its points.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLimits {
    /// `[q_I, q_F]` of every joint.
    pub position: Vec<[f64; 2]>,
    /// Largest speed `q̇_M` of every joint.
    pub velocity: Vec<f64>,
}

/// Everything that a choice of points is judged by: the model, its base columns, the limits.
#[derive(Debug, Clone)]
pub struct EnergyDesign {
    model: EnergyModel,
    limits: PointLimits,
    /// Joints whose position the rows depend on.
    positions: Vec<usize>,
}

/// Change of a row, relative to the largest entry met, below which it does not depend on a coordinate.
///
/// Rounding leaves 1e-16 a joint; a real dependence is of the order of the entries.
const NO_DEPENDENCE: f64 = 1e-12;
/// Random points the dependence is judged on.
const DEPENDENCE_TRIALS: usize = 16;

impl EnergyDesign {
    /// For a robot, the base columns of its energy-difference model, and the limits of the points.
    ///
    /// Positions that no row depends on (a first axis along gravity) are found by trial and are not design
    /// variables.
    ///
    /// # Errors
    /// A drive column, limits of another robot, a range without width, a speed that is not positive.
    pub fn new(robot: &Robot, columns: &Columns, limits: PointLimits) -> Result<Self, Error> {
        let n = robot.n_joints();
        if limits.position.len() != n || limits.velocity.len() != n {
            return Err(Error::input(
                "point limits",
                format!(
                    "{} position and {} velocity limits",
                    limits.position.len(),
                    limits.velocity.len()
                ),
                format!("the robot has {n} joints; give one of each a joint"),
            ));
        }
        for j in 0..n {
            let ([low, high], speed) = (limits.position[j], limits.velocity[j]);
            if !(low < high && (high - low).is_finite() && speed > 0.0 && speed.is_finite()) {
                return Err(Error::input(
                    format!("point limits of joint {}", j + 1),
                    format!("position {low} to {high}, speed {speed}"),
                    "the range needs a width and the speed must be above zero",
                ));
            }
        }
        let model = EnergyModel::new(robot, columns)?;
        let positions = dependent_positions(&model, &limits);
        Ok(Self {
            model,
            limits,
            positions,
        })
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.model.n_joints()
    }

    /// Number of base columns.
    pub fn n_columns(&self) -> usize {
        self.model.n_columns()
    }

    /// Limits of the points.
    pub fn limits(&self) -> &PointLimits {
        &self.limits
    }

    /// Joints whose position the rows depend on, from 0.
    pub fn position_variables(&self) -> &[usize] {
        &self.positions
    }

    /// Design variables a point: the positions that matter, then every velocity (their eq. 23).
    pub fn n_variables(&self) -> usize {
        self.positions.len() + self.n_joints()
    }

    /// Lowest and highest value of each design variable of a point.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = [f64; 2]> {
        let positions = self.positions.iter().map(|&j| self.limits.position[j]);
        positions.chain(self.limits.velocity.iter().map(|&v| [-v, v]))
    }

    pub(crate) fn model(&self) -> &EnergyModel {
        &self.model
    }

    /// Rows `Δh(i) = h(point i+1) - h(point i)`, one fewer than points.
    ///
    /// # Panics
    /// If the points are of another number of joints.
    #[track_caller]
    pub fn observation_matrix(&self, points: &JointStates) -> Mat<f64> {
        assert_eq!(
            points.n_joints(),
            self.n_joints(),
            "points and robot differ in their number of joints"
        );
        let n_rows = points.n_samples().saturating_sub(1);
        let mut scratch = self.model.scratch();
        let mut last = vec![0.0; self.n_columns()];
        let mut next = last.clone();
        let mut w = Mat::zeros(n_rows, self.n_columns());
        for k in 0..points.n_samples() {
            let state = points.state(k);
            self.model.row(&state.q, &state.qd, &mut scratch, &mut next);
            if k > 0 {
                for j in 0..self.n_columns() {
                    w[(k - 1, j)] = next[j] - last[j];
                }
            }
            std::mem::swap(&mut last, &mut next);
        }
        w
    }

    /// Every criterion of the chain through these points; the information is divided by the number of rows.
    pub fn conditioning(&self, points: &JointStates) -> Conditioning {
        let w = self.observation_matrix(points);
        Conditioning::of_rows(w.as_ref(), w.nrows())
    }

    /// `n_rows + 1` random points as in table 2 of the paper: `q = q_I + (q_F - q_I) sin² x`, `q̇ = q̇_M sin x`,
    /// `x ~ N(0, 1)`; positions that do not matter are uniform within their limits, as the paper takes `q₁`.
    pub fn random_points(&self, n_rows: usize, seed: u64, draw: u64) -> JointStates {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(draw);
        let x: Vec<f64> = (0..(n_rows + 1) * self.n_variables())
            .map(|_| StandardNormal.sample(&mut rng))
            .collect();
        let mut values = vec![0.0; x.len()];
        self.substitute(&x, &mut values);
        self.points_of(&values, &mut rng)
    }

    /// The substitutions that make the limits vanish (section 4): free `x` to bounded `(q, q̇)`, point by point.
    pub(crate) fn substitute(&self, x: &[f64], values: &mut [f64]) {
        let (n, m) = (self.n_variables(), self.positions.len());
        for (x, out) in x.chunks_exact(n).zip(values.chunks_exact_mut(n)) {
            for k in 0..n {
                out[k] = if k < m {
                    let [low, high] = self.limits.position[self.positions[k]];
                    low + (high - low) * x[k].sin().powi(2)
                } else {
                    self.limits.velocity[k - m] * x[k].sin()
                };
            }
        }
    }

    /// Points from design variables; positions that do not matter are drawn within their limits.
    pub(crate) fn points_of(&self, values: &[f64], rng: &mut ChaCha8Rng) -> JointStates {
        let (n, m) = (self.n_variables(), self.positions.len());
        let n_points = values.len() / n;
        let mut points = JointStates::zeros(self.n_joints(), n_points);
        for j in 0..self.n_joints() {
            if !self.positions.contains(&j) {
                let [low, high] = self.limits.position[j];
                for q in points.q_mut(j) {
                    *q = rng.random_range(low..high);
                }
            }
        }
        for (point, values) in values.chunks_exact(n).enumerate() {
            for (k, &j) in self.positions.iter().enumerate() {
                points.q_mut(j)[point] = values[k];
            }
            for j in 0..self.n_joints() {
                points.qd_mut(j)[point] = values[m + j];
            }
        }
        points
    }
}

/// Joints whose position moves a row by more than rounding, on random states.
///
/// Revolute joints are turned through the whole circle: limits do not hide a dependence.
fn dependent_positions(model: &EnergyModel, limits: &PointLimits) -> Vec<usize> {
    let n = model.n_joints();
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut scratch = model.scratch();
    let mut row = vec![0.0; model.n_columns()];
    let mut moved = row.clone();
    let mut largest = 0.0_f64;
    let mut change = vec![0.0_f64; n];
    for _ in 0..DEPENDENCE_TRIALS {
        let mut q: Vec<f64> = (0..n).map(|_| rng.random_range(-PI..PI)).collect();
        let qd: Vec<f64> = (0..n)
            .map(|j| limits.velocity[j] * rng.random_range(-1.0..1.0))
            .collect();
        model.row(&q, &qd, &mut scratch, &mut row);
        largest = row.iter().fold(largest, |a, h| a.max(h.abs()));
        for j in 0..n {
            let kept = std::mem::replace(&mut q[j], rng.random_range(-PI..PI));
            model.row(&q, &qd, &mut scratch, &mut moved);
            q[j] = kept;
            for (a, b) in row.iter().zip(&moved) {
                change[j] = change[j].max((a - b).abs());
            }
        }
    }
    (0..n)
        .filter(|&j| change[j] > NO_DEPENDENCE * largest)
        .collect()
}
