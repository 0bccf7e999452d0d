//! Parallel decimation: the same low-pass and the same samples kept, of every column of the regressor and of the torque.

use crate::error::Error;
use crate::filter::{Section, butterworth, chebyshev, padding, settling, zero_phase_lanes};

/// A linear map of columns: zero-phase low-pass, edges trimmed, every `factor`-th sample kept.
///
/// Because it is the same linear map for each column, `τ = W β` before gives `τ' = W' β` after.
/// Source: Gautier 1997, parallel filtering and decimation.
#[derive(Debug, Clone, PartialEq)]
pub struct Decimator {
    factor: usize,
    trim: usize,
    sections: Vec<Section>,
}

/// Ripple of the Chebyshev low-pass, dB, as in MATLAB's `decimate`.
const RIPPLE: f64 = 0.05;
/// Order of the Chebyshev low-pass, as in MATLAB's `decimate`.
const ORDER: usize = 8;
/// Edge of its pass band as a share of the new half rate, as in MATLAB's `decimate`.
const PASS_BAND: f64 = 0.8;
/// Columns filtered side by side.
const LANES: usize = 8;

impl Decimator {
    /// Chebyshev low-pass of order 8, 0.05 dB, to 0.8 of the new half rate. A factor of 1 leaves everything as it is.
    ///
    /// # Errors
    /// A factor of zero.
    pub fn chebyshev(factor: usize) -> Result<Self, Error> {
        check_factor(factor)?;
        if factor == 1 {
            return Ok(Self {
                factor,
                trim: 0,
                sections: Vec::new(),
            });
        }
        let sections = chebyshev(ORDER, RIPPLE, PASS_BAND, 2.0 * factor as f64);
        Ok(Self {
            factor,
            trim: settling(&sections),
            sections,
        })
    }

    /// Butterworth low-pass; `cutoff` and `sample_rate` in Hz.
    ///
    /// # Errors
    /// A factor of zero, a cutoff that is not below half the new rate.
    pub fn butterworth(
        factor: usize,
        order: usize,
        cutoff: f64,
        sample_rate: f64,
    ) -> Result<Self, Error> {
        check_factor(factor)?;
        let half_rate = 0.5 * sample_rate / factor as f64;
        // Written so that NaN is refused.
        if !(cutoff > 0.0 && cutoff < half_rate) {
            return Err(Error::setting(
                "decimation cutoff (Hz)",
                cutoff,
                format!("it must lie between 0 and half the new sample rate, {half_rate} Hz"),
            ));
        }
        let sections = butterworth(order, cutoff, sample_rate);
        Ok(Self {
            factor,
            trim: settling(&sections),
            sections,
        })
    }

    /// The same decimator with another number of samples left out at each end, before decimation.
    #[must_use]
    pub fn with_trim(mut self, samples: usize) -> Self {
        self.trim = samples;
        self
    }

    /// Samples per sample kept.
    pub fn factor(&self) -> usize {
        self.factor
    }

    /// Samples left out at each end, before decimation.
    pub fn trim(&self) -> usize {
        self.trim
    }

    /// Fewest samples a column can have.
    pub fn fewest_samples(&self) -> usize {
        if self.sections.is_empty() {
            return 2 * self.trim + 1;
        }
        (padding(&self.sections) + 1).max(2 * self.trim + 1)
    }

    /// Which of `n_samples` are kept.
    pub fn kept(&self, n_samples: usize) -> Vec<usize> {
        let end = n_samples.saturating_sub(self.trim);
        (self.trim..end).step_by(self.factor).collect()
    }

    /// One column decimated.
    ///
    /// # Panics
    /// If it has fewer samples than [`Decimator::fewest_samples`].
    #[track_caller]
    pub fn decimate(&self, column: &[f64]) -> Vec<f64> {
        self.decimate_columns(&[column]).remove(0)
    }

    /// Columns decimated alike, eight at a time: the same bits as one by one.
    ///
    /// # Panics
    /// If their lengths differ, or as [`Decimator::decimate`].
    #[track_caller]
    pub fn decimate_columns(&self, columns: &[&[f64]]) -> Vec<Vec<f64>> {
        let n_samples = columns.first().map_or(0, |c| c.len());
        let kept = self.kept(n_samples);
        let mut out = Vec::with_capacity(columns.len());
        for group in columns.chunks(LANES) {
            for (l, column) in group.iter().enumerate() {
                let n = column.len();
                assert_eq!(n, n_samples, "length of column {}", out.len() + l);
            }
            let mut lanes = vec![[0.0; LANES]; n_samples];
            for (l, column) in group.iter().enumerate() {
                for (lane, v) in lanes.iter_mut().zip(*column) {
                    lane[l] = *v;
                }
            }
            if !self.sections.is_empty() {
                lanes = zero_phase_lanes(&self.sections, &lanes);
            }
            for l in 0..group.len() {
                out.push(kept.iter().map(|&k| lanes[k][l]).collect());
            }
        }
        out
    }
}

fn check_factor(factor: usize) -> Result<(), Error> {
    if factor == 0 {
        let rule = "1 keeps every sample, 10 every tenth";
        return Err(Error::setting("decimation factor", 0.0, rule));
    }
    Ok(())
}
