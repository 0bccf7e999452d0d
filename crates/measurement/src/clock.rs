//! The log's clock: its rate, jitter and gaps; samples put onto a uniform grid.

use crate::plausibility::median_interval;
use std::ops::Range;

/// What a clock does.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// Median interval, s.
    pub interval: f64,
    /// Largest deviation of an interval from the median, as a share of it, outside gaps.
    pub jitter: f64,
    /// Gaps: sample before which the clock was silent for more than three median intervals.
    pub gaps: Vec<Gap>,
}

/// A hole in a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// First sample after it.
    pub sample: usize,
    /// Time of the last sample before it, s.
    pub time: f64,
    /// How long, s.
    pub length: f64,
}

/// An interval this many times the median is a gap.
pub const GAP: f64 = 3.0;

/// Reads a clock. `time` in s, rising, at least two samples.
pub fn read_clock(time: &[f64]) -> Clock {
    let interval = median_interval(time);
    let mut clock = Clock {
        interval,
        jitter: 0.0,
        gaps: Vec::new(),
    };
    for (k, w) in time.windows(2).enumerate() {
        let length = w[1] - w[0];
        if length > GAP * interval {
            clock.gaps.push(Gap {
                sample: k + 1,
                time: w[0],
                length,
            });
        } else {
            clock.jitter = clock.jitter.max((length / interval - 1.0).abs());
        }
    }
    clock
}

impl Clock {
    /// The stretches between gaps, as ranges of samples.
    pub fn segments(&self, n_samples: usize) -> Vec<Range<usize>> {
        let starts = std::iter::once(0).chain(self.gaps.iter().map(|g| g.sample));
        let ends = self.gaps.iter().map(|g| g.sample);
        starts
            .zip(ends.chain([n_samples]))
            .map(|(a, b)| a..b)
            .collect()
    }
}

/// Deviation of stamps from a uniform grid, in intervals, that is rounding and no jitter.
///
/// At 1 rad/s and 1 kHz it displaces a position by 1e-6 rad, below an encoder's step.
const ROUNDING: f64 = 1e-3;

/// Interval of the uniform grid the stamps lie on already; `None` where they do not.
pub fn uniform_interval(time: &[f64]) -> Option<f64> {
    let n = time.len();
    if n < 2 {
        return None;
    }
    let interval = (time[n - 1] - time[0]) / (n - 1) as f64;
    time.iter()
        .enumerate()
        .all(|(k, t)| (t - time[0] - k as f64 * interval).abs() <= ROUNDING * interval)
        .then_some(interval)
}

/// Uniform grid of `interval` (s) from the first to the last stamp.
pub fn uniform_grid(time: &[f64], interval: f64) -> Vec<f64> {
    let (Some(&start), Some(&end)) = (time.first(), time.last()) else {
        return Vec::new();
    };
    // A grid point that misses the last stamp by rounding alone still counts.
    let n = ((end - start) / interval + 1e-9).floor() as usize;
    (0..=n).map(|k| start + k as f64 * interval).collect()
}

/// Values at other times by the cubic through the four nearest stamps; exact for cubics.
///
/// `time` rising, `at` rising and within it. The error falls as the fourth power of the interval.
///
/// # Panics
/// If there are fewer than four samples or the lengths differ.
#[track_caller]
pub fn interpolate(time: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let n = time.len();
    assert_eq!(n, values.len(), "stamps and values");
    assert!(n >= 4, "{n} samples, where a cubic needs four");
    let mut right = 1;
    at.iter()
        .map(|&t| {
            while right < n - 1 && time[right] < t {
                right += 1;
            }
            let first = right.saturating_sub(2).min(n - 4);
            let (x, y) = (&time[first..first + 4], &values[first..first + 4]);
            (0..4)
                .map(|i| {
                    let others = (0..4).filter(|&k| k != i);
                    y[i] * others.map(|k| (t - x[k]) / (x[i] - x[k])).product::<f64>()
                })
                .sum()
        })
        .collect()
}
