//! A whole arm whose right angles were written with nine digits, as exporters do.
//!
//! The regressor here is a plain Newton-Euler recursion of its own, one unit parameter at a time.

use std::f64::consts::FRAC_PI_2;

use idim_base_params::{Reduction, ReductionOptions, TriangularFactor, reduce};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type V = [f64; 3];

/// Modified DH of the PUMA 560 (Craig, table 3.1, in metres): quarter turns of alpha, a, d.
const JOINTS: [(f64, f64, f64); 6] = [
    (0.0, 0.0, 0.0),
    (-1.0, 0.0, 0.2435),
    (0.0, 0.4318, -0.0934),
    (-1.0, 0.0203, 0.4331),
    (1.0, 0.0, 0.0),
    (-1.0, 0.0, 0.0),
];

fn cross(a: V, b: V) -> V {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn apply(m: [V; 3], v: V) -> V {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn transposed(m: [V; 3]) -> [V; 3] {
    [0, 1, 2].map(|j| [0, 1, 2].map(|i| m[i][j]))
}

/// Force and moment of one link, of unit parameter `p` (XX XY XZ YY YZ ZZ MX MY MZ M), about its frame's origin.
fn unit_wrench(p: usize, w: V, dw: V, acceleration: V) -> (V, V) {
    if p < 6 {
        let (i, j) = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)][p];
        let mut inertia = [[0.0; 3]; 3];
        inertia[i][j] = 1.0;
        inertia[j][i] = 1.0;
        return (
            [0.0; 3],
            add(apply(inertia, dw), cross(w, apply(inertia, w))),
        );
    }
    if p == 9 {
        return (acceleration, [0.0; 3]);
    }
    let mut moment = [0.0; 3];
    moment[p - 6] = 1.0;
    (
        add(cross(dw, moment), cross(w, cross(w, moment))),
        cross(moment, acceleration),
    )
}

/// The six rows of the torque regressor, row-major, 60 columns.
///
/// The base is tilted by what a quarter turn and an exact one back leave; a vertical first axis hides two parameters.
fn regressor(quarter_turn: f64, state: &[[f64; 3]; 6]) -> Vec<f64> {
    let mut rows = vec![0.0; 360];
    let mut frames = Vec::new();
    let tilt = quarter_turn - FRAC_PI_2;
    let up = [0.0, 9.81 * tilt.sin(), 9.81 * tilt.cos()];
    let (mut w, mut dw, mut acceleration) = ([0.0; 3], [0.0; 3], up);
    for (link, (&(turns, a, d), &[q, qd, qdd])) in JOINTS.iter().zip(state).enumerate() {
        let ((sa, ca), (s, c)) = ((turns * quarter_turn).sin_cos(), q.sin_cos());
        let rotation = [[c, -s, 0.0], [s * ca, c * ca, -sa], [s * sa, c * sa, ca]];
        let place = [a, -d * sa, d * ca];
        let inverse = transposed(rotation);
        let swing = add(cross(dw, place), cross(w, cross(w, place)));
        acceleration = apply(inverse, add(acceleration, swing));
        let carried = apply(inverse, w);
        dw = add(
            add(apply(inverse, dw), cross(carried, [0.0, 0.0, qd])),
            [0.0, 0.0, qdd],
        );
        w = add(carried, [0.0, 0.0, qd]);
        frames.push((rotation, place));
        for p in 0..10 {
            let (mut force, mut moment) = unit_wrench(p, w, dw, acceleration);
            for joint in (0..=link).rev() {
                rows[joint * 60 + link * 10 + p] = moment[2];
                let (rotation, place) = frames[joint];
                force = apply(rotation, force);
                moment = add(apply(rotation, moment), cross(place, force));
            }
        }
    }
    rows
}

fn puma(quarter_turn: f64) -> Reduction {
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    let mut factor = TriangularFactor::new(60);
    for _ in 0..200 {
        let state = [[0.0; 3]; 6]
            .map(|_| [3.0, 2.0, 5.0].map(|limit: f64| rng.random_range(-limit..limit)));
        factor.push_rows(&regressor(quarter_turn, &state));
    }
    reduce(
        &factor,
        &(0..60).collect::<Vec<_>>(),
        &ReductionOptions::default(),
    )
}

#[test]
fn puma_with_exact_right_angles_has_36_base_parameters() {
    let reduction = puma(FRAC_PI_2);
    assert_eq!(reduction.rank(), 36);
    assert!(reduction.ambiguity.is_none() && reduction.ghosts.is_empty());
    assert!(reduction.rank_gap > 1e10);
}

#[test]
fn regress_puma_with_nine_digits_is_reported_as_ambiguous() {
    let (rounded, exact) = (puma(1.570796325), puma(FRAC_PI_2));
    let ambiguity = rounded
        .ambiguity
        .as_ref()
        .expect("two singular values at 1e-9");
    assert_eq!((ambiguity.lower_rank, ambiguity.upper_rank), (36, 38));
    // The base is that of the arm as it was meant.
    assert_eq!(rounded.base, exact.base);
    assert_eq!(rounded.combined, exact.combined);
    assert_eq!(rounded.identifiable_alone, exact.identifiable_alone);
    // MX1 and MY1, felt through the tilt of 1.8e-9 rad.
    assert_eq!(
        rounded
            .ghosts
            .iter()
            .map(|ghost| ghost.column)
            .collect::<Vec<_>>(),
        [6, 7]
    );
    let named: Vec<usize> = (0..60)
        .filter(|j| ambiguity.combination[*j] != 0.0)
        .collect();
    assert!(named == [6] || named == [7], "{named:?}");
}
