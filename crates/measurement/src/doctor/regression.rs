//! Small regressions for the doctor: what a set of columns explains of a signal.

/// An orthonormal basis of columns, by modified Gram-Schmidt done twice.
pub(crate) struct Basis(Vec<Vec<f64>>);

/// Share of a column's length that must be new, else it depends on the ones before.
const NEW: f64 = 1e-6;

impl Basis {
    pub(crate) fn new(columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        let mut basis = Self(Vec::new());
        for column in columns {
            basis.push(column);
        }
        basis
    }

    pub(crate) fn push(&mut self, column: Vec<f64>) {
        let before = norm(&column);
        let rest = self.residual(self.residual(column));
        let after = norm(&rest);
        if after > NEW * before {
            self.0.push(rest.into_iter().map(|v| v / after).collect());
        }
    }

    /// What the basis does not explain.
    pub(crate) fn residual(&self, mut x: Vec<f64>) -> Vec<f64> {
        for b in &self.0 {
            let share = dot(b, &x);
            for (x, b) in x.iter_mut().zip(b) {
                *x -= share * b;
            }
        }
        x
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(x: &[f64]) -> f64 {
    dot(x, x).sqrt()
}

/// Cosine of the angle between two signals; 0 if one vanishes.
pub(crate) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let length = norm(a) * norm(b);
    if length > 0.0 {
        dot(a, b) / length
    } else {
        0.0
    }
}

pub(crate) fn centred(x: &[f64]) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    x.iter().map(|v| v - mean).collect()
}

/// Place of the lowest value, refined by a parabola through its neighbours.
pub(crate) fn lowest(curve: &[f64]) -> f64 {
    let best = (0..curve.len())
        .min_by(|&a, &b| curve[a].total_cmp(&curve[b]))
        .unwrap_or(0);
    if best == 0 || best + 1 >= curve.len() {
        return best as f64;
    }
    let (a, b, c) = (curve[best - 1], curve[best], curve[best + 1]);
    let curvature = a - 2.0 * b + c;
    if curvature > 0.0 {
        best as f64 + 0.5 * (a - c) / curvature
    } else {
        best as f64
    }
}
