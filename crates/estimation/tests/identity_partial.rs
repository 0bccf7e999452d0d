//! Fits of rows some of which are left out, with noise that correlates between joints, remembers, or is wild.
#![allow(clippy::unwrap_used)]

mod common;

use common::{distance, factor, normals, rng, times};
use faer::Mat;
use idim_estimation::{
    HUBER_K, NoiseCovariance, PartialEstimate, PartialOptions, PartialRows, RobustLoss, TUKEY_C,
    Weighting, partial_least_squares, solve, whitened_factor,
};

const JOINTS: usize = 3;
const TRUTH: [f64; 5] = [2.0, -0.7, 0.05, 11.0, 0.3];

fn problem(seed: u64, n_samples: usize) -> (Vec<f64>, Vec<f64>, Vec<bool>) {
    let mut rng = rng(seed);
    let w = normals(&mut rng, JOINTS * n_samples * TRUTH.len());
    let mut y = times(&w, &TRUTH);
    let e = normals(&mut rng, y.len());
    for (t, y) in y.chunks_exact_mut(JOINTS).enumerate() {
        let e = &e[t * JOINTS..];
        y[0] += 2.0 * e[0];
        y[1] += 0.4 * e[0] + 0.3 * e[1];
        y[2] += 0.05 * e[2];
    }
    let used = (0..y.len())
        .map(|row| row % JOINTS != 1 || row % 7 != 0)
        .collect();
    (w, y, used)
}

fn fit(w: &[f64], y: &[f64], used: &[bool], options: &PartialOptions) -> PartialEstimate {
    let rows = PartialRows {
        w,
        y,
        used,
        n_joints: JOINTS,
    };
    partial_least_squares(&rows, options).unwrap().unwrap()
}

#[test]
fn identity_left_out_rows_are_as_if_they_had_never_been() {
    let (w, y, used) = problem(1, 400);
    let options = PartialOptions {
        weighting: Weighting::Diagonal,
        ..PartialOptions::default()
    };
    let found = fit(&w, &y, &used, &options);
    let sigma = found.noise.standard_deviation();
    let (mut kept_w, mut kept_y) = (Vec::new(), Vec::new());
    for row in (0..y.len()).filter(|&r| used[r]) {
        let s = sigma[row % JOINTS];
        kept_w.extend(w[row * 5..][..5].iter().map(|v| v / s));
        kept_y.push(y[row] / s);
    }
    let by_hand = solve(&factor(&kept_w, &kept_y, 5))
        .unwrap()
        .determined()
        .unwrap();
    assert!(distance(&found.estimate.values, &by_hand.values) < 1e-12);
    // Wild values where nothing is used change nothing.
    let mut wild = y.clone();
    (0..y.len())
        .filter(|&r| !used[r])
        .for_each(|r| wild[r] = 1e9);
    assert_eq!(
        fit(&w, &wild, &used, &options).estimate.values,
        found.estimate.values
    );
}

#[test]
fn identity_a_sample_with_a_row_left_out_is_whitened_by_what_is_left() {
    let (w, y, used) = problem(2, 3);
    let l = Mat::from_fn(3, 3, |i, j| {
        if i >= j {
            1.0 + i as f64 - 0.5 * j as f64
        } else {
            0.0
        }
    });
    let omega = &l * l.transpose();
    let noise = NoiseCovariance::new(omega.as_ref()).unwrap();
    let weights: Vec<f64> = used.iter().map(|&u| f64::from(u8::from(u))).collect();
    let rows = PartialRows {
        w: &w,
        y: &y,
        used: &used,
        n_joints: JOINTS,
    };
    let parts = whitened_factor(&rows, &noise, &weights).unwrap().parts();
    let information = parts.r.transpose() * &parts.r;
    // Σ W_tᵀ Ω_t⁻¹ W_t with Ω_t the rows and columns used.
    let mut by_hand = Mat::<f64>::zeros(5, 5);
    for t in 0..3 {
        let joints: Vec<usize> = (0..3).filter(|j| used[3 * t + j]).collect();
        let part = Mat::from_fn(joints.len(), joints.len(), |i, j| {
            omega[(joints[i], joints[j])]
        });
        let w_t = Mat::from_fn(joints.len(), 5, |i, k| w[(3 * t + joints[i]) * 5 + k]);
        let inverse = faer::linalg::solvers::DenseSolveCore::inverse(&part.partial_piv_lu());
        by_hand += w_t.transpose() * inverse * &w_t;
    }
    assert!((&information - &by_hand).norm_l2() < 1e-12 * by_hand.norm_l2());
}

#[test]
fn identity_full_covariance_is_found_and_used() {
    let (w, y, used) = problem(3, 4000);
    let full = fit(&w, &y, &used, &PartialOptions::default());
    let correlation = full.noise.correlation(0, 1);
    // 0.4·2 / (2·0.5).
    assert!((correlation - 0.8).abs() < 0.02, "{correlation}");
    let diagonal = PartialOptions {
        weighting: Weighting::Diagonal,
        ..PartialOptions::default()
    };
    let alone = fit(&w, &y, &used, &diagonal);
    let spread = |f: &PartialEstimate| f.estimate.standard_deviation.iter().sum::<f64>();
    assert!(spread(&full) < 0.999 * spread(&alone));
    assert!(full.converged && distance(&full.estimate.values, &TRUTH) < 1e-3);
}

#[test]
fn identity_wild_rows_lose_their_say() {
    let (w, mut y, used) = problem(4, 2000);
    let clean = fit(&w, &y, &used, &PartialOptions::default());
    let wild = 900..1000;
    for row in wild.clone() {
        y[row] += 50.0;
    }
    let away = |f: &PartialEstimate| distance(&f.estimate.values, &clean.estimate.values);
    let plain = away(&fit(&w, &y, &used, &PartialOptions::default()));
    for loss in [
        RobustLoss::Huber { k: HUBER_K },
        RobustLoss::Tukey { c: TUKEY_C },
    ] {
        let options = PartialOptions {
            loss: Some(loss),
            ..PartialOptions::default()
        };
        let robust = fit(&w, &y, &used, &options);
        let moved = away(&robust);
        assert!(moved < 0.5 * plain, "{loss:?}: {moved}, plain {plain}");
        let heard = |r: &usize| used[*r] && robust.weights[*r] > 0.2;
        assert_eq!(wild.clone().filter(heard).count(), 0);
    }
}

#[test]
fn identity_intervals_cover_the_truth_though_noise_remembers() {
    // A slow regressor and noise with a memory of nine samples: 95 % intervals, 300 draws, three values each.
    let memory = 0.8_f64;
    let (n_samples, mut covered, mut white) = (800, 0, 0);
    for seed in 0..300 {
        let mut rng = rng(1000 + seed);
        let e = normals(&mut rng, n_samples);
        let (mut w, mut y, mut noise) = (Vec::new(), Vec::new(), e[0]);
        for (t, e) in e.iter().enumerate() {
            noise = memory * noise + (1.0 - memory * memory).sqrt() * e;
            let phase = t as f64 * 0.031;
            let row = [phase.sin(), (2.3 * phase).cos(), 1.0];
            y.push(row[0] - 2.0 * row[1] + 0.5 * row[2] + noise);
            w.extend(row);
        }
        let rows = PartialRows {
            w: &w,
            y: &y,
            used: &vec![true; n_samples],
            n_joints: 1,
        };
        let found = partial_least_squares(&rows, &PartialOptions::default())
            .unwrap()
            .unwrap();
        for (k, truth) in [1.0, -2.0, 0.5].into_iter().enumerate() {
            let error = (found.estimate.values[k] - truth).abs();
            covered += usize::from(error < 1.96 * found.standard_deviation[k]);
            white += usize::from(error < 1.96 * found.estimate.standard_deviation[k]);
        }
    }
    // Few blocks and a finite memory cost a little; white noise would be believed far too much.
    let (covered, white) = (covered as f64 / 900.0, white as f64 / 900.0);
    assert!((0.90..=0.97).contains(&covered), "{covered} {white}");
    assert!(white < 0.6, "{white}");
}
