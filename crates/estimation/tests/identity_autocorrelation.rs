//! Noise that remembers.
#![allow(clippy::unwrap_used)]

mod common;

use common::{factor, normals, rng, times};
use idim_estimation::{
    BlockScores, autocorrelation, effective_sample_size, ljung_box, sandwich_covariance, solve,
};

/// First-order autoregressive noise of unit variance.
fn remembering(seed: u64, n: usize, memory: f64) -> Vec<f64> {
    let e = normals(&mut rng(seed), n);
    let mut out = vec![e[0]; n];
    for k in 1..n {
        out[k] = memory * out[k - 1] + (1.0 - memory * memory).sqrt() * e[k];
    }
    out
}

#[test]
fn identity_autocorrelation_of_a_first_order_process_is_geometric() {
    let rho = autocorrelation(&remembering(1, 200_000, 0.8), 5);
    for (k, r) in rho.iter().enumerate() {
        assert!((r - 0.8_f64.powi(k as i32 + 1)).abs() < 0.01, "{rho:?}");
    }
    // By hand: 1 2 3 6 about 3: products 4+1+0+9 = 14, 2+0+0 = 2, 0-3 = -3.
    let by_hand = autocorrelation(&[1.0, 2.0, 3.0, 6.0], 2);
    assert!((by_hand[0] - 2.0 / 14.0).abs() < 1e-15 && (by_hand[1] + 3.0 / 14.0).abs() < 1e-15);
}

#[test]
fn identity_effective_size_of_a_first_order_process() {
    // N (1 - ρ)/(1 + ρ).
    for memory in [0.0, 0.5, 0.9] {
        let n = 100_000.0;
        let size = effective_sample_size(&remembering(2, 100_000, memory));
        let expected = n * (1.0 - memory) / (1.0 + memory);
        assert!(
            (size / expected - 1.0).abs() < 0.1,
            "{memory}: {size} {expected}"
        );
    }
    // Alternating noise is worth no more than its number.
    let alternating: Vec<f64> = (0..1000)
        .map(|k| if k % 2 == 0 { 1.0 } else { -1.0 })
        .collect();
    assert!(effective_sample_size(&alternating) <= 1000.0);
}

#[test]
fn identity_ljung_box_keeps_its_level() {
    // 1000 white series at 95 %: 50 ± 6.9 rejections, four of them.
    let rejected = (0..1000)
        .filter(|seed| !ljung_box(&remembering(100 + seed, 400, 0.0), 10, 0.95).white)
        .count();
    assert!((23..=77).contains(&rejected), "{rejected}");
    assert!((0..100).all(|seed| !ljung_box(&remembering(seed, 400, 0.3), 10, 0.95).white));
}

#[test]
fn identity_block_sandwich_covers_where_plain_deviations_are_too_sure() {
    // Slow columns, noise with a memory of 20 samples. 500 runs at 95 %: 475 ± 4.9; a finite number of blocks costs some percent.
    let (n, runs) = (4000, 500_u64);
    let truth = [2.0, -1.0];
    let w: Vec<f64> = (0..n)
        .flat_map(|k| [1.0, (0.01 * f64::from(k)).sin()])
        .collect();
    let clean = times(&w, &truth);
    let (mut plain, mut sandwich) = ([0; 2], [0; 2]);
    for seed in 0..runs {
        let y: Vec<f64> = clean
            .iter()
            .zip(remembering(seed, n as usize, 0.95))
            .map(|(y, e)| y + e)
            .collect();
        let bread = factor(&w, &y, 2);
        let fit = solve(&bread).unwrap().determined().unwrap();
        let mut scores = BlockScores::new(2, 100);
        // In two pieces that do not end with a block.
        scores
            .push_rows(&w[..2 * 1730], &y[..1730], &fit.values)
            .unwrap();
        scores
            .push_rows(&w[2 * 1730..], &y[1730..], &fit.values)
            .unwrap();
        let covariance = sandwich_covariance(&bread, &scores.meat().unwrap())
            .unwrap()
            .unwrap();
        for i in 0..2 {
            let error = (fit.values[i] - truth[i]).abs();
            plain[i] += u64::from(error < 1.96 * fit.standard_deviation[i]);
            sandwich[i] += u64::from(error < 1.96 * covariance[(i, i)].sqrt());
        }
    }
    assert!(plain.iter().all(|h| *h < 250), "{plain:?} of {runs}");
    assert!(
        sandwich.iter().all(|h| (430..=495).contains(h)),
        "{sandwich:?} of {runs}"
    );
}
