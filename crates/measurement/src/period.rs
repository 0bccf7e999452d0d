//! Periodic motions: finding the period, averaging over periods, noise from the scatter between them.

use crate::error::Error;

/// A period found in a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    /// Length in samples; not a whole number where the clock is not in step with the motion.
    pub samples: f64,
    /// Mean squared difference between samples a period apart, over twice the variance: 0 repeats, 1 does not.
    pub mismatch: f64,
}

/// Mismatch below which a motion repeats.
pub const REPEATS: f64 = 0.01;
/// Mismatch of the coarse search, whose lags miss the period by up to half a stride.
const COARSE: f64 = 0.2;
/// Samples of the coarse search.
const COARSE_SAMPLES: usize = 8000;

/// Shortest period of a motion sampled uniformly, joint by joint; `None` unless at least two periods were recorded.
///
/// Smallest lag whose [`Period::mismatch`] over all joints is a minimum below 0.01, refined by a parabola.
pub fn find_period(columns: &[Vec<f64>]) -> Option<Period> {
    let n = columns.first().map_or(0, Vec::len);
    let stride = n.div_ceil(COARSE_SAMPLES).max(1);
    let coarse: Vec<Vec<f64>> = columns
        .iter()
        .map(|c| c.iter().step_by(stride).copied().collect())
        .collect();
    let longest = n.div_ceil(stride) / 2;
    let curve: Vec<f64> = (0..=longest).map(|lag| mismatch(&coarse, lag)).collect();
    // The lobe about lag zero is no period.
    let clear = curve.iter().position(|&m| m > COARSE)?;
    for lag in clear..=longest {
        let low = curve[lag] < COARSE
            && curve[lag] <= curve[lag - 1]
            && curve.get(lag + 1).is_none_or(|&m| curve[lag] <= m);
        if !low {
            continue;
        }
        let centre = lag * stride;
        let lags: Vec<usize> =
            (centre.saturating_sub(stride).max(1)..=(centre + stride).min(n - 2)).collect();
        let fine: Vec<f64> = lags.iter().map(|&l| mismatch(columns, l)).collect();
        let best = (0..fine.len()).min_by(|&a, &b| fine[a].total_cmp(&fine[b]))?;
        if fine[best] > REPEATS {
            continue;
        }
        let at = |k: usize| mismatch(columns, k);
        let l = lags[best];
        let (a, b, c) = (at(l - 1), fine[best], at(l + 1));
        let curvature = a - 2.0 * b + c;
        let shift = if curvature > 0.0 {
            (0.5 * (a - c) / curvature).clamp(-0.5, 0.5)
        } else {
            0.0
        };
        return Some(Period {
            samples: l as f64 + shift,
            mismatch: b,
        });
    }
    None
}

fn mismatch(columns: &[Vec<f64>], lag: usize) -> f64 {
    let (mut difference, mut spread) = (0.0, 0.0);
    for x in columns {
        let n = x.len();
        let mean = x.iter().sum::<f64>() / n as f64;
        let variance = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
        let pairs = x.iter().zip(&x[lag..]);
        difference += pairs.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / (n - lag) as f64;
        spread += 2.0 * variance;
    }
    if spread > 0.0 {
        difference / spread
    } else {
        1.0
    }
}

/// One period averaged over many, and the noise that the average removed.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodAverage {
    /// Mean over the periods, column by column, one period long.
    pub mean: Vec<Vec<f64>>,
    /// Covariance between the columns of one sample's noise; of the mean, divide by [`PeriodAverage::n_periods`].
    pub noise_covariance: Vec<Vec<f64>>,
    /// Periods averaged.
    pub n_periods: usize,
}

/// Averages whole periods of columns (positions, torques, or columns of both) and estimates their noise.
///
/// `samples_per_period` whole; `leave_out` periods at the start, where the transient still rings. The covariance is the
/// unbiased one of the scatter about the mean, `Σ e eᵀ / ((periods - 1) samples)`. Source: Swevers et al. 1997.
///
/// # Errors
/// Fewer than two whole periods.
///
/// # Panics
/// If the columns differ in length.
#[track_caller]
pub fn average_periods(
    columns: &[&[f64]],
    samples_per_period: usize,
    leave_out: usize,
) -> Result<PeriodAverage, Error> {
    let n_samples = columns.first().map_or(0, |c| c.len());
    for column in columns {
        assert_eq!(column.len(), n_samples, "length of a column");
    }
    let whole = n_samples.checked_div(samples_per_period).unwrap_or(0);
    let n_periods = whole.saturating_sub(leave_out);
    if n_periods < 2 {
        return Err(Error::setting(
            "samples per period",
            samples_per_period as f64,
            format!(
                "{n_samples} samples hold {n_periods} whole periods after leaving out {leave_out}; averaging needs two"
            ),
        ));
    }
    let sample = |column: usize, period: usize, k: usize| {
        columns[column][(leave_out + period) * samples_per_period + k]
    };
    let mut mean = vec![vec![0.0; samples_per_period]; columns.len()];
    for (c, mean) in mean.iter_mut().enumerate() {
        for (k, mean) in mean.iter_mut().enumerate() {
            let sum: f64 = (0..n_periods).map(|p| sample(c, p, k)).sum();
            *mean = sum / n_periods as f64;
        }
    }
    let freedom = ((n_periods - 1) * samples_per_period) as f64;
    let mut covariance = vec![vec![0.0; columns.len()]; columns.len()];
    for a in 0..columns.len() {
        for b in 0..=a {
            let mut sum = 0.0;
            for p in 0..n_periods {
                for k in 0..samples_per_period {
                    sum += (sample(a, p, k) - mean[a][k]) * (sample(b, p, k) - mean[b][k]);
                }
            }
            covariance[a][b] = sum / freedom;
            covariance[b][a] = covariance[a][b];
        }
    }
    Ok(PeriodAverage {
        mean,
        noise_covariance: covariance,
        n_periods,
    })
}
