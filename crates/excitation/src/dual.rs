//! What gradients are tested against: numbers that carry a derivative along, through equations written once more.
//!
//! Nothing here is the product's: bodies in world axes, rows by Newton and Euler or by the energy, eigenvalues by Jacobi's
//! rotations, all on `re + ε du` with `ε² = 0`. Derivatives are then exact to rounding, without a step to choose.

#![allow(clippy::unwrap_used)]

use crate::{AddedColumn, Criterion, Scaling};
use idim_model::{Columns, JointKind, ParameterKind, Robot};
use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// `re + ε du`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Dual {
    pub(crate) re: f64,
    pub(crate) du: f64,
}

pub(crate) fn dual(re: f64, du: f64) -> Dual {
    Dual { re, du }
}

/// Relative difference of two ways to the same derivative, of ten at most that are near one.
pub(crate) const AGREEMENT: f64 = 1e-9;

impl Dual {
    pub(crate) const ZERO: Self = Self { re: 0.0, du: 0.0 };

    pub(crate) fn sin(self) -> Self {
        dual(self.re.sin(), self.re.cos() * self.du)
    }
    pub(crate) fn cos(self) -> Self {
        dual(self.re.cos(), -self.re.sin() * self.du)
    }
    pub(crate) fn sqrt(self) -> Self {
        dual(self.re.sqrt(), 0.5 * self.du / self.re.sqrt())
    }
    pub(crate) fn ln(self) -> Self {
        dual(self.re.ln(), self.du / self.re)
    }
    fn powf(self, p: f64) -> Self {
        dual(self.re.powf(p), p * self.re.powf(p - 1.0) * self.du)
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        dual(self.re + b.re, self.du + b.du)
    }
}
impl Sub for Dual {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        dual(self.re - b.re, self.du - b.du)
    }
}
impl Mul for Dual {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        dual(self.re * b.re, self.re * b.du + self.du * b.re)
    }
}
impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        dual(self.re * b, self.du * b)
    }
}
impl Div for Dual {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let quotient = self.re / b.re;
        dual(quotient, (self.du - quotient * b.du) / b.re)
    }
}
impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        dual(-self.re, -self.du)
    }
}

type Vec3 = [Dual; 3];
type Mat3 = [Vec3; 3];

fn vector(v: &Vector3<f64>) -> Vec3 {
    [0, 1, 2].map(|i| dual(v[i], 0.0))
}
fn matrix(m: &Matrix3<f64>) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| dual(m[(i, j)], 0.0)))
}
fn plus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| a[i] + b[i])
}
fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| a[i] - b[i])
}
fn times(a: Vec3, s: Dual) -> Vec3 {
    a.map(|x| x * s)
}
fn dot(a: Vec3, b: Vec3) -> Dual {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
fn apply(m: &Mat3, v: Vec3) -> Vec3 {
    m.map(|row| dot(row, v))
}
fn transposed(m: &Mat3) -> Mat3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i]))
}
fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    let columns = transposed(b);
    a.map(|row| columns.map(|column| dot(row, column)))
}

/// Rodrigues' formula.
fn turn(axis: Vec3, angle: Dual) -> Mat3 {
    let (s, c) = (angle.sin(), angle.cos());
    let unit = |i: usize| [0, 1, 2].map(|k| dual(f64::from(u8::from(k == i)), 0.0));
    let turned = |v: Vec3| {
        let along = times(axis, dot(axis, v) * (dual(1.0, 0.0) - c));
        plus(plus(times(v, c), times(cross(axis, v), s)), along)
    };
    transposed(&[0, 1, 2].map(|i| turned(unit(i))))
}

/// A link, and the joint it hangs on, in world axes.
#[derive(Clone, Copy)]
struct Body {
    rotation: Mat3,
    position: Vec3,
    angular: Vec3,
    linear: Vec3,
    angular_rate: Vec3,
    linear_rate: Vec3,
    axis: Vec3,
    joint: Vec3,
}

impl Body {
    /// Position, velocity and acceleration of a point of the body, `arm` away from its origin.
    fn point(&self, arm: Vec3) -> [Vec3; 3] {
        let turning = cross(self.angular, arm);
        let bend = plus(cross(self.angular_rate, arm), cross(self.angular, turning));
        [
            plus(self.position, arm),
            plus(self.linear, turning),
            plus(self.linear_rate, bend),
        ]
    }
}

fn bodies(robot: &Robot, q: &[Dual], qd: &[Dual], qdd: &[Dual]) -> Vec<Body> {
    let zero = [Dual::ZERO; 3];
    let base = Body {
        rotation: matrix(&Matrix3::identity()),
        position: zero,
        angular: zero,
        linear: zero,
        angular_rate: zero,
        linear_rate: zero,
        axis: zero,
        joint: zero,
    };
    let mut all: Vec<Body> = Vec::new();
    for (j, joint) in robot.joints().iter().enumerate() {
        assert_eq!(joint.kind, JointKind::Revolute, "no slides here");
        let parent = joint.parent.map_or(base, |p| all[p]);
        let pose = &joint.parent_from_joint;
        let arm = apply(&parent.rotation, vector(&pose.translation));
        let [at, linear, linear_rate] = parent.point(arm);
        let frame = product(&parent.rotation, &matrix(&pose.rotation));
        let axis = apply(&frame, vector(&joint.axis));
        let angle = q[j] + dual(joint.offset, 0.0);
        let frame = product(&frame, &turn(vector(&joint.axis), angle));
        let own = Body {
            rotation: frame,
            position: at,
            angular: plus(parent.angular, times(axis, qd[j])),
            linear,
            angular_rate: plus(
                plus(parent.angular_rate, times(axis, qdd[j])),
                times(cross(parent.angular, axis), qd[j]),
            ),
            linear_rate,
            axis,
            joint: at,
        };
        let link = &joint.joint_from_link;
        let [position, linear, linear_rate] = own.point(apply(&frame, vector(&link.translation)));
        all.push(Body {
            rotation: product(&frame, &matrix(&link.rotation)),
            position,
            linear,
            linear_rate,
            ..own
        });
    }
    all
}

/// A body of one unit parameter: inertia, first moment, mass.
fn unit_body(kind: ParameterKind) -> (Mat3, Vec3, Dual) {
    let (one, zero) = (dual(1.0, 0.0), Dual::ZERO);
    let (mut inertia, mut moment, mut mass) = ([[zero; 3]; 3], [zero; 3], zero);
    let entries = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    match kind.inertial_index().unwrap() {
        k @ 0..6 => {
            let (a, b) = entries[k];
            (inertia[a][b], inertia[b][a]) = (one, one);
        }
        k @ 6..9 => moment[k - 6] = one,
        _ => mass = one,
    }
    (inertia, moment, mass)
}

/// Rows of the torque regressor at one state, joint by joint, added columns last.
pub(crate) fn torque_rows(
    robot: &Robot,
    (columns, added): (&Columns, &[AddedColumn]),
    [q, qd, qdd]: [&[Dual]; 3],
) -> Vec<Vec<Dual>> {
    let all = bodies(robot, q, qd, qdd);
    let n = robot.n_joints();
    let mut rows = vec![vec![Dual::ZERO; columns.len() + added.len()]; n];
    for (c, parameter) in columns.0.iter().enumerate() {
        let own = parameter.index;
        match parameter.kind {
            ParameterKind::Ia => rows[own][c] = qdd[own],
            ParameterKind::Fv => rows[own][c] = qd[own],
            kind => {
                let (inertia, h, m) = unit_body(kind);
                let body = &all[own];
                let inward = transposed(&body.rotation);
                let lifted = minus(body.linear_rate, vector(&robot.gravity()));
                let [w, alpha, a] =
                    [body.angular, body.angular_rate, lifted].map(|v| apply(&inward, v));
                let spin = cross(w, cross(w, h));
                let force = plus(plus(times(a, m), cross(alpha, h)), spin);
                let gyro = cross(w, apply(&inertia, w));
                let moment = plus(plus(apply(&inertia, alpha), gyro), cross(h, a));
                let force = apply(&body.rotation, force);
                let moment = apply(&body.rotation, moment);
                let mut joint = Some(own);
                while let Some(j) = joint {
                    let arm = minus(body.position, all[j].joint);
                    rows[j][c] = dot(all[j].axis, plus(moment, cross(arm, force)));
                    joint = robot.joints()[j].parent;
                }
            }
        }
    }
    for (k, column) in added.iter().enumerate() {
        let c = columns.len() + k;
        match column {
            AddedColumn::Motor { kind, turns } => {
                let rate = if *kind == ParameterKind::Ia { qdd } else { qd };
                let motor = turns.iter().zip(rate).map(|(t, r)| *r * *t);
                let motor = motor.fold(Dual::ZERO, Add::add);
                for (row, turn) in rows.iter_mut().zip(turns) {
                    row[c] = motor * *turn;
                }
            }
            AddedColumn::Known(torque) => {
                // The one formula that is tested here.
                assert_eq!(torque.formula().unwrap().1, SPRING);
                let q = q[torque.joint()];
                rows[torque.joint()][c] = q.sin() * (dual(1.5, 0.0) - q.cos()).sqrt();
            }
        }
    }
    rows
}

/// A torque over q that is smooth everywhere.
pub(crate) const SPRING: &str = "sin(q) * sqrt(1.5 - cos(q))";

/// Energy per unit of each column.
pub(crate) fn energy_row(robot: &Robot, columns: &Columns, q: &[Dual], qd: &[Dual]) -> Vec<Dual> {
    let all = bodies(robot, q, qd, &vec![Dual::ZERO; q.len()]);
    let gravity = vector(&robot.gravity());
    let energy = |p: &idim_model::Parameter| {
        let (inertia, h, m) = unit_body(p.kind);
        let body = &all[p.index];
        let inward = transposed(&body.rotation);
        let (w, v) = (apply(&inward, body.angular), apply(&inward, body.linear));
        let turning = dot(w, apply(&inertia, w)) * 0.5;
        let moving = dot(v, v) * m * 0.5 + dot(v, cross(w, h));
        let place = plus(times(body.position, m), apply(&body.rotation, h));
        turning + moving - dot(gravity, place)
    };
    columns.0.iter().map(energy).collect()
}

/// `Σ weight · row rowᵀ`.
pub(crate) fn gram(rows: &[(f64, Vec<Dual>)]) -> Vec<Vec<Dual>> {
    let n = rows[0].1.len();
    let mut a = vec![vec![Dual::ZERO; n]; n];
    for (weight, row) in rows {
        for i in 0..n {
            for j in 0..n {
                a[i][j] = a[i][j] + row[i] * row[j] * *weight;
            }
        }
    }
    a
}

/// Rotations over all pairs, so many times: each time squares what is left beside the diagonal.
const SWEEPS: usize = 14;

/// Eigenvalues of a symmetric matrix, smallest first, by Jacobi's rotations.
fn eigenvalues(mut a: Vec<Vec<Dual>>) -> Vec<Dual> {
    let n = a.len();
    for _ in 0..SWEEPS {
        for p in 0..n {
            for q in p + 1..n {
                let (off, gap) = (a[p][q], a[q][q] - a[p][p]);
                if off == Dual::ZERO {
                    continue;
                }
                let root = (gap * gap + off * off * 4.0).sqrt();
                let root = if gap.re < 0.0 { -root } else { root };
                let t = off * 2.0 / (gap + root);
                let c = dual(1.0, 0.0) / (t * t + dual(1.0, 0.0)).sqrt();
                let s = c * t;
                for k in 0..n {
                    let (x, y) = (a[k][p], a[k][q]);
                    (a[k][p], a[k][q]) = (c * x - s * y, s * x + c * y);
                }
                for k in 0..n {
                    let (x, y) = (a[p][k], a[q][k]);
                    (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
                }
            }
        }
    }
    let mut lambda: Vec<Dual> = (0..n).map(|i| a[i][i]).collect();
    lambda.sort_by(|a, b| a.re.total_cmp(&b.re));
    lambda
}

/// How extreme eigenvalues are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Extremes {
    /// As they are.
    Sharp,
    /// By norms of this power.
    Norm(f64),
    /// By norms of this power and one more and less, as traces of `A^(p ± 1)` give them.
    Traces(f64),
}

/// Logarithm of a criterion of `A`.
pub(crate) fn logarithm(
    criterion: Criterion,
    extremes: Extremes,
    mut a: Vec<Vec<Dual>>,
    n_samples: usize,
) -> Dual {
    let unit = Scaling::Equilibrated;
    if [Criterion::TwoNorm(unit), Criterion::Frobenius(unit)].contains(&criterion) {
        let scale: Vec<Dual> = (0..a.len()).map(|i| a[i][i].sqrt()).collect();
        for (row, r) in a.iter_mut().zip(&scale) {
            for (x, c) in row.iter_mut().zip(&scale) {
                *x = *x / (*r * *c);
            }
        }
    }
    let lambda = eigenvalues(a);
    let norm = |p: f64| {
        let powers = lambda.iter().map(|l| l.powf(p));
        powers.fold(Dual::ZERO, Add::add).ln()
    };
    let (least, largest) = (lambda[0], lambda[lambda.len() - 1]);
    let log_n = dual((n_samples as f64).ln(), 0.0);
    match (criterion, extremes) {
        (Criterion::TwoNorm(_), Extremes::Sharp) => (largest.ln() - least.ln()) * 0.5,
        (Criterion::TwoNorm(_), Extremes::Norm(p)) => (norm(p) + norm(-p)) * (0.5 / p),
        (Criterion::TwoNorm(_), Extremes::Traces(p)) => {
            norm(p + 1.0) * (0.5 / (p + 1.0)) + norm(1.0 - p) * (0.5 / (p - 1.0))
        }
        (Criterion::Frobenius(_), _) => (norm(2.0) + norm(-2.0)) * 0.5,
        (Criterion::LogDet, _) => {
            let logs = lambda.iter().map(|l| log_n - l.ln());
            logs.fold(Dual::ZERO, Add::add)
        }
        (Criterion::TraceInverse, _) => log_n + norm(-1.0),
        (Criterion::WorstDirection, Extremes::Sharp) => (log_n - least.ln()) * 0.5,
        (Criterion::WorstDirection, Extremes::Norm(p) | Extremes::Traces(p)) => {
            (log_n + norm(-p) * (1.0 / p)) * 0.5
        }
        (other, _) => panic!("{other:?} is not smooth"),
    }
}

/// The smooth criteria.
pub(crate) const SMOOTH: [Criterion; 7] = [
    Criterion::TwoNorm(Scaling::Raw),
    Criterion::TwoNorm(Scaling::Equilibrated),
    Criterion::Frobenius(Scaling::Raw),
    Criterion::Frobenius(Scaling::Equilibrated),
    Criterion::LogDet,
    Criterion::TraceInverse,
    Criterion::WorstDirection,
];

#[test]
fn oracle_eigenvalues_of_a_turned_diagonal() {
    // R diag(1 + ε, 3) Rᵀ with an angle that changes as well: eigenvalues do not see it.
    let (s, c) = (dual(0.4, 0.7).sin(), dual(0.4, 0.7).cos());
    let (x, y) = (dual(1.0, 1.0), dual(3.0, 0.0));
    let off = s * c * (x - y);
    let a = vec![
        vec![c * c * x + s * s * y, off],
        vec![off, s * s * x + c * c * y],
    ];
    let found = eigenvalues(a);
    for (found, expected) in found.iter().zip([x, y]) {
        assert!((found.re - expected.re).abs() < 1e-14, "{found:?}");
        assert!((found.du - expected.du).abs() < 1e-14, "{found:?}");
    }
}
