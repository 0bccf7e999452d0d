//! The numbers behind the curves: ranges, decimation, clocks.

use super::TorqueRun;

/// At most `max_points` points that keep the extremes: of every stretch of samples its lowest and its highest.
///
/// Points that are not finite are left out; order in `x` is kept.
pub(super) fn decimate(x: &[f64], y: &[f64], max_points: usize) -> Vec<(f64, f64)> {
    let finite: Vec<(f64, f64)> = x
        .iter()
        .copied()
        .zip(y.iter().copied())
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    if finite.len() <= max_points {
        return finite;
    }
    let n_stretches = (max_points / 2).max(1);
    let mut kept = Vec::with_capacity(2 * n_stretches);
    for stretch in finite.chunks(finite.len().div_ceil(n_stretches)) {
        let extreme = |better: fn(f64, f64) -> bool| {
            let mut best = 0;
            for k in 1..stretch.len() {
                if better(stretch[k].1, stretch[best].1) {
                    best = k;
                }
            }
            best
        };
        let (low, high) = (extreme(|a, b| a < b), extreme(|a, b| a > b));
        kept.push(stretch[low.min(high)]);
        if low != high {
            kept.push(stretch[low.max(high)]);
        }
    }
    kept
}

/// Range of the finite values, widened by `margin` of its width on both sides; never empty.
pub(super) fn padded_range(values: impl Iterator<Item = f64>, margin: f64) -> [f64; 2] {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
    if low > high {
        return [-1.0, 1.0];
    }
    let width = high - low;
    // A constant has no width of its own, and a range of a few roundings has no ticks.
    let least = 1e-9 * low.abs().max(high.abs());
    if width <= least {
        let half = if least == 0.0 { 1.0 } else { 0.1 * high.abs() };
        return [low - half, high + half];
    }
    [low - margin * width, high + margin * width]
}

/// Root mean square of the finite values, `None` where there are none.
pub(super) fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values
        .filter(|v| v.is_finite())
        .fold((0.0, 0.0), |(sum, n), v| (sum + v * v, n + 1.0));
    (n > 0.0).then(|| f64::sqrt(sum / n))
}

/// Times of the runs, each moved behind the one before where their clocks overlap, and whether any was moved.
pub(crate) fn side_by_side(runs: &[TorqueRun]) -> (Vec<Vec<f64>>, bool) {
    let mut times: Vec<Vec<f64>> = Vec::with_capacity(runs.len());
    let mut end = f64::NEG_INFINITY;
    let mut shifted = false;
    for run in runs {
        let start = run.time.first().copied().unwrap_or(end);
        let shift = if start < end { end - start } else { 0.0 };
        shifted |= shift > 0.0;
        times.push(run.time.iter().map(|t| t + shift).collect());
        end = run.time.last().map_or(end, |t| t + shift);
    }
    (times, shifted)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::plot::Part;

    #[test]
    fn identity_decimation_keeps_extremes_and_stays_small() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y: Vec<f64> = x.iter().map(|t| (t * 0.37).sin()).collect();
        y[43_210] = 7.0;
        y[77_777] = -9.0;
        let kept = decimate(&x, &y, 2000);
        assert!(kept.len() <= 2000, "{} points", kept.len());
        assert!(kept.contains(&(43_210.0, 7.0)) && kept.contains(&(77_777.0, -9.0)));
        assert!(
            kept.windows(2).all(|w| w[0].0 < w[1].0),
            "order of time is lost"
        );
        assert_eq!(decimate(&x[..100], &y[..100], 2000).len(), 100);
    }

    #[test]
    fn regress_values_that_are_not_finite_are_left_out() {
        let y = [1.0, f64::NAN, f64::INFINITY, 3.0];
        assert_eq!(
            decimate(&[0.0, 1.0, 2.0, 3.0], &y, 10),
            [(0.0, 1.0), (3.0, 3.0)]
        );
        assert_eq!(padded_range(y.into_iter(), 0.0), [1.0, 3.0]);
        assert_eq!(rms(y.into_iter()).unwrap(), f64::sqrt(5.0));
        assert_eq!(rms([f64::NAN].into_iter()), None);
    }

    #[test]
    fn regress_a_constant_still_has_a_range() {
        assert_eq!(padded_range([0.0; 3].into_iter(), 0.1), [-1.0, 1.0]);
        assert_eq!(padded_range(std::iter::empty(), 0.1), [-1.0, 1.0]);
        let [low, high] = padded_range([5.0; 3].into_iter(), 0.1);
        assert!(low < 5.0 && 5.0 < high);
    }

    #[test]
    fn identity_runs_do_not_overlap() {
        let run = |time| TorqueRun {
            part: Part::Training,
            time,
            measured: time,
            predicted: time,
        };
        let (times, shifted) = side_by_side(&[run(&[0.0, 1.0]), run(&[0.5, 2.0]), run(&[9.0])]);
        assert_eq!(times, [vec![0.0, 1.0], vec![1.0, 2.5], vec![9.0]]);
        assert!(shifted);
        assert!(!side_by_side(&[run(&[0.0, 1.0]), run(&[1.0, 2.0])]).1);
    }
}
