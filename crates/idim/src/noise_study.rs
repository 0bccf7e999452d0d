//! What noise does to the estimate on good and on bad points: tables 3 to 6 of Gautier & Khalil 1991.

use crate::error::Error;
use faer::{Mat, MatRef};
use idim_estimation::{Estimate, Solution, factor_of, solve, solve_with_known_noise};
use idim_excitation::{Criterion, EnergyDesign, Scaling};
use idim_model::JointStates;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Medians over the draws of one noise level.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NoiseRow {
    /// Noise level `k`: a standard deviation of `k/4` of the largest value.
    pub(crate) k: f64,
    /// `‖δY‖/‖Y‖` or `‖δW‖/‖W‖` (2-norm).
    pub(crate) noise: f64,
    /// `‖δX‖/‖X‖`.
    pub(crate) error: f64,
    /// `K_R = Cond(W) ‖δY‖ ‖X‖ / (‖Y‖ ‖δX‖)`, or `Cond(W + δW)`.
    pub(crate) ratio: f64,
    /// Share of draws inside the bound (12) or (13); for `r = b` they are bounds, for `r > b` a guide.
    pub(crate) within_bound: f64,
}

/// The study of one set of points.
#[derive(Debug, Clone)]
pub(crate) struct NoiseStudy {
    /// `Cond₂(W)`, raw.
    pub(crate) condition_number: f64,
    /// Table 3: noise on `Y`.
    pub(crate) on_observations: Vec<NoiseRow>,
    /// Table 4: noise on `W`, through positions and velocities.
    pub(crate) on_points: Vec<NoiseRow>,
    /// Tables 5 and 6: one estimate at `k = 0.01`.
    pub(crate) estimate: Estimate,
}

/// Noise levels of tables 3 and 4.
pub(crate) const LEVELS: [f64; 3] = [0.001, 0.01, 0.1];
/// Noise level of tables 5 and 6.
const ESTIMATE_LEVEL: f64 = 0.01;
/// Draws the medians are over.
const DRAWS: u64 = 1000;

/// Runs the study for the parameters `x` (base columns of `design`) on these points.
///
/// # Errors
/// Points that do not determine the parameters.
pub(crate) fn noise_study(
    design: &EnergyDesign,
    points: &JointStates,
    x: &[f64],
    seed: u64,
) -> Result<NoiseStudy, Error> {
    let w = design.observation_matrix(points);
    let y = product(w.as_ref(), x);
    let condition_number = Criterion::TwoNorm(Scaling::Raw).evaluate(w.as_ref(), w.nrows());
    let on_observations =
        LEVELS.map(|k| observation_noise(w.as_ref(), &y, x, condition_number, k, seed));
    let on_points = LEVELS.map(|k| point_noise(design, points, &y, x, condition_number, k, seed));
    let sigma = ESTIMATE_LEVEL / 4.0 * largest(&y);
    let mut rng = generator(seed, u64::MAX, ESTIMATE_LEVEL);
    let noisy: Vec<f64> = y.iter().map(|y| y + sigma * normal(&mut rng)).collect();
    let Solution::Determined(estimate) =
        solve_with_known_noise(&factor_of(w.as_ref(), &noisy)?, sigma)?
    else {
        return Err(Error::input(
            "noise study",
            "points that do not determine the parameters",
            "take another seed",
        ));
    };
    Ok(NoiseStudy {
        condition_number,
        on_observations: on_observations.into_iter().collect::<Result<_, _>>()?,
        on_points: on_points.into_iter().collect::<Result<_, _>>()?,
        estimate,
    })
}

/// One draw: relative noise, relative error, the third column, and whether the bound holds.
type Draw = [f64; 4];

fn observation_noise(
    w: MatRef<'_, f64>,
    y: &[f64],
    x: &[f64],
    condition: f64,
    k: f64,
    seed: u64,
) -> Result<NoiseRow, Error> {
    let sigma = k / 4.0 * largest(y);
    medians(k, |draw| {
        let mut rng = generator(seed, draw, k);
        let delta: Vec<f64> = y.iter().map(|_| sigma * normal(&mut rng)).collect();
        let noisy: Vec<f64> = y.iter().zip(&delta).map(|(y, d)| y + d).collect();
        let found = values(w, &noisy)?;
        let noise = norm(&delta) / norm(y);
        let error = norm(&difference(&found, x)) / norm(x);
        let bound = idim_estimation::observation_error_bound(condition, norm(&delta), norm(y));
        Ok([
            noise,
            error,
            condition * noise / error,
            f64::from(u8::from(error <= bound)),
        ])
    })
}

fn point_noise(
    design: &EnergyDesign,
    points: &JointStates,
    y: &[f64],
    x: &[f64],
    condition: f64,
    k: f64,
    seed: u64,
) -> Result<NoiseRow, Error> {
    let w = design.observation_matrix(points);
    let size = two_norm(w.as_ref());
    medians(k, |draw| {
        let mut rng = generator(seed, DRAWS + draw, k);
        let limits = design.limits();
        let mut moved = points.clone();
        for j in 0..points.n_joints() {
            let [low, high] = limits.position[j];
            let (dq, dv) = (k / 4.0 * (high - low), k / 4.0 * limits.velocity[j]);
            moved
                .q_mut(j)
                .iter_mut()
                .for_each(|q| *q += dq * normal(&mut rng));
            moved
                .qd_mut(j)
                .iter_mut()
                .for_each(|v| *v += dv * normal(&mut rng));
        }
        let perturbed = design.observation_matrix(&moved);
        let found = values(perturbed.as_ref(), y)?;
        let delta = two_norm((&perturbed - &w).as_ref());
        let error = norm(&difference(&found, x)) / norm(x);
        // (13) is relative to the perturbed solution.
        let bound =
            idim_estimation::matrix_error_bound(condition, delta, size) * norm(&found) / norm(x);
        let kp = Criterion::TwoNorm(Scaling::Raw).evaluate(perturbed.as_ref(), w.nrows());
        Ok([delta / size, error, kp, f64::from(u8::from(error <= bound))])
    })
}

fn medians(
    k: f64,
    draw: impl Fn(u64) -> Result<Draw, Error> + Sync + Send,
) -> Result<NoiseRow, Error> {
    let draws: Vec<Draw> = (0..DRAWS)
        .into_par_iter()
        .map(draw)
        .collect::<Result<_, _>>()?;
    let median = |which: usize| {
        let mut all: Vec<f64> = draws.iter().map(|d| d[which]).collect();
        all.sort_by(f64::total_cmp);
        f64::midpoint(all[(all.len() - 1) / 2], all[all.len() / 2])
    };
    Ok(NoiseRow {
        k,
        noise: median(0),
        error: median(1),
        ratio: median(2),
        within_bound: draws.iter().map(|d| d[3]).sum::<f64>() / DRAWS as f64,
    })
}

fn values(w: MatRef<'_, f64>, y: &[f64]) -> Result<Vec<f64>, Error> {
    match solve(&factor_of(w, y)?)? {
        Solution::Determined(e) => Ok(e.values),
        Solution::RankDeficient(d) => Err(Error::input(
            "noise study",
            format!("points of rank {} for {} parameters", d.rank, d.n_columns),
            "take another seed",
        )),
    }
}

/// A stream of its own for every draw and level, so that the order of the threads does not matter.
fn generator(seed: u64, draw: u64, k: f64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ k.to_bits());
    rng.set_stream(draw);
    rng
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

fn product(w: MatRef<'_, f64>, x: &[f64]) -> Vec<f64> {
    (0..w.nrows())
        .map(|i| (0..w.ncols()).map(|j| w[(i, j)] * x[j]).sum())
        .collect()
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
}

/// Largest singular value; zero where the decomposition fails, which only values that are not finite make it do.
fn two_norm(w: MatRef<'_, f64>) -> f64 {
    let copy: Mat<f64> = w.to_owned();
    copy.singular_values().map_or(f64::NAN, |s| s[0])
}
