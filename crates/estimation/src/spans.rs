//! When the rows lost their say.

/// A run of samples that lost their say.
#[derive(Debug, Clone, PartialEq)]
pub struct DownWeightedSpan {
    /// First sample.
    pub first: usize,
    /// Last sample, included.
    pub last: usize,
    /// Joints concerned, ascending.
    pub joints: Vec<usize>,
    /// Lowest weight within.
    pub lowest_weight: f64,
}

/// Options of [`down_weighted_spans`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpanOptions {
    /// A row below this weight counts; 0.3 typical (4.5 sigmas under Huber, 3.15 under Tukey: one clean row in 600).
    pub weight: f64,
    /// Spans closer than this many samples are one; 5 typical.
    pub bridge: usize,
    /// Spans with fewer samples below the weight are chance and left out; 3 typical.
    pub least: usize,
}

impl Default for SpanOptions {
    /// 0.3, 5 samples, 3 samples.
    fn default() -> Self {
        Self {
            weight: 0.3,
            bridge: 5,
            least: 3,
        }
    }
}

/// The runs of samples with low weights: contacts, stops, dropped packets.
///
/// # Panics
/// If the weights are not whole samples.
#[track_caller]
pub fn down_weighted_spans(
    weights: &[f64],
    n_joints: usize,
    options: &SpanOptions,
) -> Vec<DownWeightedSpan> {
    assert_eq!(
        weights.len() % n_joints,
        0,
        "{} rows are not whole samples of {n_joints} joints",
        weights.len()
    );
    let mut spans: Vec<(DownWeightedSpan, usize)> = Vec::new();
    for (sample, weights) in weights.chunks_exact(n_joints).enumerate() {
        let low: Vec<usize> = (0..n_joints)
            .filter(|&j| weights[j] < options.weight)
            .collect();
        if low.is_empty() {
            continue;
        }
        let lowest = low.iter().map(|&j| weights[j]).fold(1.0, f64::min);
        match spans.last_mut() {
            Some((span, count)) if sample - span.last <= options.bridge => {
                span.last = sample;
                span.joints.extend(low);
                span.lowest_weight = span.lowest_weight.min(lowest);
                *count += 1;
            }
            _ => spans.push((
                DownWeightedSpan {
                    first: sample,
                    last: sample,
                    joints: low,
                    lowest_weight: lowest,
                },
                1,
            )),
        }
    }
    spans.retain(|(_, count)| *count >= options.least);
    spans
        .into_iter()
        .map(|(mut span, _)| {
            span.joints.sort_unstable();
            span.joints.dedup();
            span
        })
        .collect()
}
