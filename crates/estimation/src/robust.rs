//! Weights that contacts, emergency stops and dropped packets lose by.

/// Huber's constant: 95 % efficient on normal noise (Huber 1981).
pub const HUBER_K: f64 = 1.345;
/// Tukey's constant: 95 % efficient on normal noise (Beaton & Tukey 1974).
pub const TUKEY_C: f64 = 4.685;
/// Makes the median absolute deviation a standard deviation on normal noise, `1/Φ⁻¹(3/4)`.
pub const MAD_TO_SIGMA: f64 = 1.4826022185056018;

/// How a residual loses its say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RobustLoss {
    /// Weight `min(1, k/|u|)`: convex, one solution; a gross outlier keeps the pull of `k` sigma.
    Huber {
        /// In sigmas; [`HUBER_K`].
        k: f64,
    },
    /// Weight `(1 - (u/c)²)²`, zero beyond `c`: gross outliers vanish; started from Huber's fit, as it has many solutions.
    Tukey {
        /// In sigmas; [`TUKEY_C`].
        c: f64,
    },
}

impl RobustLoss {
    /// Weight of a residual of `u` sigmas, in [0, 1].
    pub fn weight(self, u: f64) -> f64 {
        match self {
            Self::Huber { k } => {
                if u.abs() <= k {
                    1.0
                } else {
                    k / u.abs()
                }
            }
            Self::Tukey { c } => {
                let inside = 1.0 - (u / c).powi(2);
                if inside > 0.0 { inside * inside } else { 0.0 }
            }
        }
    }

    /// Derivative of the influence `ψ(u) = u · weight(u)`.
    pub(crate) fn influence_slope(self, u: f64) -> f64 {
        match self {
            Self::Huber { k } => f64::from(u8::from(u.abs() <= k)),
            Self::Tukey { c } => {
                let square = (u / c).powi(2);
                if square < 1.0 {
                    (1.0 - square) * (1.0 - 5.0 * square)
                } else {
                    0.0
                }
            }
        }
    }
}

/// Weights of rows, and what a sigma of each joint was taken to be.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustWeights {
    /// One weight in [0, 1] a row; rows of `W` and `y` are multiplied by its square root over the joint's `scale`.
    pub weights: Vec<f64>,
    /// Standard deviation of each joint's residual by the median absolute deviation; 0 for a joint whose half fits exactly.
    pub scale: Vec<f64>,
}

/// Weights of residuals, `row = sample · n_joints + joint`, each against the scale of its joint.
///
/// # Panics
/// If the residuals are not whole samples.
#[track_caller]
pub fn robust_weights(residuals: &[f64], n_joints: usize, loss: RobustLoss) -> RobustWeights {
    let scale = mad_scale(residuals, n_joints);
    let weights = residuals
        .iter()
        .enumerate()
        .map(|(row, r)| {
            let s = scale[row % n_joints];
            // Where half of the residuals are exactly zero every other one is an outlier of infinite size.
            if *r == 0.0 { 1.0 } else { loss.weight(r / s) }
        })
        .collect();
    RobustWeights { weights, scale }
}

/// Standard deviation of each joint's residual from the median of its sizes: half of the rows may be wild.
///
/// # Panics
/// If the residuals are not whole samples.
#[track_caller]
pub fn mad_scale(residuals: &[f64], n_joints: usize) -> Vec<f64> {
    assert_eq!(
        residuals.len() % n_joints,
        0,
        "{} rows are not whole samples of {n_joints} joints",
        residuals.len()
    );
    (0..n_joints)
        .map(|joint| {
            let mut sizes: Vec<f64> = residuals[joint..]
                .iter()
                .step_by(n_joints)
                .map(|r| r.abs())
                .collect();
            MAD_TO_SIGMA * median(&mut sizes)
        })
        .collect()
}

fn median(values: &mut [f64]) -> f64 {
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    let (below, &mut middle, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        middle
    } else {
        0.5 * (middle + below.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    }
}
