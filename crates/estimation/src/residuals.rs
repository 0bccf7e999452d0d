//! How well a model predicts, joint by joint.

/// Running statistics of `measured - predicted`, one set a joint; the same for training and for held-out data.
#[derive(Debug, Clone, PartialEq)]
pub struct ResidualStatistics {
    joints: Vec<Sums>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    n: usize,
    residual: f64,
    residual_square: f64,
    measured_square: f64,
    /// Welford's running mean and sum of squared deviations of the measured values: no cancellation under a large offset.
    measured_mean: f64,
    measured_deviation: f64,
    max_abs: f64,
}

/// What became of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointResidual {
    /// Samples.
    pub n: usize,
    /// Root mean square of the residual, N·m (N).
    pub rms: f64,
    /// `‖residual‖ / ‖measured‖`; not a number when both are zero.
    pub relative_error: f64,
    /// `1 - SSE/SST`, SST about the mean of the measured values; not finite when these are constant.
    pub r2: f64,
    /// Largest size of the residual, N·m (N).
    pub max_abs: f64,
    /// Mean of the residual, N·m (N).
    pub mean: f64,
}

impl ResidualStatistics {
    /// No sample yet.
    pub fn new(n_joints: usize) -> Self {
        Self {
            joints: vec![Sums::default(); n_joints],
        }
    }

    /// Adds one sample of one joint. A value that is not finite shows in every figure of that joint.
    ///
    /// # Panics
    /// If there is no such joint.
    #[track_caller]
    pub fn push(&mut self, joint: usize, measured: f64, predicted: f64) {
        assert!(
            joint < self.joints.len(),
            "joint {joint} of {}",
            self.joints.len()
        );
        let s = &mut self.joints[joint];
        let residual = measured - predicted;
        s.n += 1;
        s.residual += residual;
        s.residual_square += residual * residual;
        s.measured_square += measured * measured;
        let deviation = measured - s.measured_mean;
        s.measured_mean += deviation / s.n as f64;
        s.measured_deviation += deviation * (measured - s.measured_mean);
        // f64::max would forget a NaN.
        if residual.is_nan() || residual.abs() > s.max_abs {
            s.max_abs = residual.abs();
        }
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.joints.len()
    }

    /// Figures of one joint; not a number without samples.
    ///
    /// # Panics
    /// If there is no such joint.
    #[track_caller]
    pub fn joint(&self, joint: usize) -> JointResidual {
        assert!(
            joint < self.joints.len(),
            "joint {joint} of {}",
            self.joints.len()
        );
        let s = &self.joints[joint];
        let n = s.n as f64;
        JointResidual {
            n: s.n,
            rms: (s.residual_square / n).sqrt(),
            relative_error: (s.residual_square / s.measured_square).sqrt(),
            r2: 1.0 - s.residual_square / s.measured_deviation,
            max_abs: if s.n == 0 { f64::NAN } else { s.max_abs },
            mean: s.residual / n,
        }
    }

    /// Figures of all joints.
    pub fn all(&self) -> Vec<JointResidual> {
        (0..self.n_joints())
            .map(|joint| self.joint(joint))
            .collect()
    }

    /// `‖residual‖ / ‖measured‖` over all joints together.
    pub fn relative_error(&self) -> f64 {
        let sum = |of: fn(&Sums) -> f64| self.joints.iter().map(of).sum::<f64>();
        (sum(|s| s.residual_square) / sum(|s| s.measured_square)).sqrt()
    }

    /// Root mean square of the residual over all joints together.
    pub fn rms(&self) -> f64 {
        let n: usize = self.joints.iter().map(|s| s.n).sum();
        (self.joints.iter().map(|s| s.residual_square).sum::<f64>() / n as f64).sqrt()
    }
}
