//! Exciting points of the energy model and the path through them, as Gautier & Khalil 1991 have it, for any robot.

use super::interrupt::{Stopped, Watch};
use super::point_path::{Guard, Outcome, Proved, home, slower};
use super::{N_RANDOM, RANDOM_SHARE};
use crate::columns::ExtraColumn;
use crate::error::Error;
use crate::progress::Progress;
use crate::structure::{KeepOrder, Structure};
use idim_excitation::{
    Clearance, Conditioning, Criterion, EnergyDesign, PointDesign, PointLimits, PointSearchOptions,
    TorquePrior, search_points, states_conditioning,
};
use idim_model::{Columns, DriveColumns, JointStates, Model, Robot};
use idim_trajectory::{Limits, QuinticPath};
use rayon::prelude::{IntoParallelIterator, ParallelIterator};
use std::ops::ControlFlow;

/// Share of the velocity limits that points may use: the path is faster between them.
const POINT_SPEED: f64 = 0.9;
/// Where the path leaves its limits, points are searched again under smaller ones (the paper's remedy): as much smaller as it
/// left them, and by this.
const SPARE: f64 = 0.97;
/// Where something comes too near, or a motor cannot hold a weight, points are searched again so much nearer to the middle of
/// their ranges.
const NEARER_HOME: f64 = 0.9;
/// Searches at most: two or three are needed, more where something may meet.
const ATTEMPTS: usize = 20;
/// A point whose path leaves its limits is slowed down by this; so many times at most, after which it stands still.
const SLOWER: f64 = 0.85;
const SLOWINGS: usize = 200;
/// Share of the time left that one search may take: another may be needed, more where something may meet, and the end of each
/// takes its time.
const SEARCH_SHARE: f64 = 0.3;
const SEARCH_SHARE_CLEAR: f64 = 0.12;
/// Samples the torque rows of a path are looked at by, a segment.
const SAMPLES: usize = 20;

/// What points are asked to be.
#[derive(Debug, Clone)]
pub(super) struct PointOptions {
    pub(super) criterion: Criterion,
    /// Energy differences; twice the base parameters where not said, as the paper.
    pub(super) n_rows: Option<usize>,
    pub(super) largest_s: Option<f64>,
    pub(super) n_starts: usize,
    pub(super) n_rounds: usize,
    pub(super) seed: u64,
    /// Torque limits and distances that the path keeps.
    pub(super) torque: Option<TorquePrior>,
    pub(super) clearance: Option<Clearance>,
}

/// Points with everything that is said of them.
pub(super) struct PointExcitation {
    pub(super) options: PointOptions,
    /// Of the energy model.
    pub(super) structure: Structure,
    pub(super) points: PointDesign,
    /// From rest through the points to rest, inside all limits.
    pub(super) proved: Proved,
    /// Searches that were made, each under smaller limits than the one before.
    pub(super) attempts: usize,
    /// Whether points were slowed down or drawn in until the path kept its limits, since there was no time for another search.
    pub(super) slowed_down: bool,
    /// Best of the random chains, and how many there were.
    pub(super) random: Option<(f64, Conditioning)>,
    pub(super) n_random: usize,
    /// Of the torque rows along the path, for the columns that `identify` uses.
    pub(super) along: Conditioning,
    pub(super) stopped: Stopped,
}

impl PointExcitation {
    pub(super) fn value(&self) -> f64 {
        of(self.options.criterion, &self.points.conditioning)
    }
}

/// A criterion among all of them.
fn of(criterion: Criterion, c: &Conditioning) -> f64 {
    use idim_excitation::Scaling;
    let numbers = |scaling| match scaling {
        Scaling::Raw => c.raw,
        Scaling::Equilibrated => c.equilibrated,
    };
    match criterion {
        Criterion::TwoNorm(s) => numbers(s).two_norm,
        Criterion::PivotedQr(s) => numbers(s).pivoted_qr,
        Criterion::Frobenius(s) => numbers(s).frobenius,
        Criterion::LogDet => -c.log_det,
        Criterion::TraceInverse => c.trace_inverse,
        Criterion::WorstDirection => 1.0 / c.smallest_singular_value,
        Criterion::Equilibrium => s_of(c),
        Criterion::WeightedSum {
            condition,
            equilibrium,
        } => condition * c.raw.two_norm + equilibrium * s_of(c),
    }
}

/// `S`, which is always looked at where there are rows.
fn s_of(c: &Conditioning) -> f64 {
    c.equilibrium.map_or(f64::NAN, |s| s.ratio)
}

/// Searches for points, and again under smaller limits while the path through them leaves its own.
pub(super) fn excite_points(
    robot: &Robot,
    limits: &Limits,
    options: PointOptions,
    progress: &Progress,
    watch: &Watch,
) -> Result<PointExcitation, Error> {
    let structure = Structure::of_energy(robot, KeepOrder::Links).decided()?;
    let columns = structure.base_columns();
    let n_rows = options.n_rows.unwrap_or(2 * columns.len());
    let mut inside = point_limits(limits);
    let first = EnergyDesign::new(robot, &columns, inside.clone())?;
    // Before anything is drawn: that the options make sense.
    let search = PointSearchOptions {
        n_rows,
        criterion: options.criterion,
        limit_of_equilibrium: options.largest_s,
        n_starts: options.n_starts,
        n_rounds: options.n_rounds,
        seed: options.seed,
    };
    if n_rows >= columns.len() {
        progress.stage(format!("{N_RANDOM} random chains of {n_rows} rows"));
    }
    let (random, n_random) = best_random(&first, n_rows, &options, watch);
    let mut guard = Guard::new(robot, limits, &options)?;
    let share = match options.clearance {
        None => SEARCH_SHARE,
        Some(_) => SEARCH_SHARE_CLEAR,
    };
    let (mut attempts, mut slowed_down, mut cut_short) = (0, false, false);
    let (points, proved) = loop {
        attempts += 1;
        let design = EnergyDesign::new(robot, &columns, inside.clone())?;
        let (enough, before) = (watch.enough(share), watch.left());
        let points = search_points(&design, &search, &mut |p| {
            progress.stage(format!(
                "search {attempts}: round {} of {}, best {:.5}; Ctrl-C takes it",
                p.n_done, p.n_rounds, p.best
            ));
            if enough() {
                cut_short = true;
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        })?;
        progress.stage("proving the path");
        let outcome = guard.prove(&points.points)?;
        if let Outcome::Proved(proved) = outcome {
            break (points, proved);
        }
        // Another search takes as long as this one.
        let no_time = before.zip(watch.left()).is_some_and(|(b, a)| a <= b - a);
        if attempts == ATTEMPTS || no_time || watch.check().is_err() {
            slowed_down = true;
            break slowed(&design, points, &mut guard)?;
        }
        narrow(&mut inside, outcome, &mut guard);
    };
    let along = along(robot, &proved.path)?;
    let stopped = match watch.check() {
        Err(_) => Stopped::Interrupted,
        Ok(()) if cut_short || n_random < N_RANDOM => Stopped::OutOfTime,
        Ok(()) => Stopped::No,
    };
    Ok(PointExcitation {
        options: PointOptions {
            n_rows: Some(n_rows),
            ..options
        },
        structure,
        points,
        proved,
        attempts,
        slowed_down,
        random,
        n_random,
        along,
        stopped,
    })
}

/// Smaller limits of points for the next search, by what became of the path through these.
fn narrow(inside: &mut PointLimits, outcome: Outcome, guard: &mut Guard<'_>) {
    match outcome {
        Outcome::Proved(_) => {}
        Outcome::Leaves(path) => {
            let shares = shares(&path.largest_overshoot(guard.limits), guard.limits);
            for (position, share) in inside.position.iter_mut().zip(shares) {
                *position = shrunk(*position, share);
            }
        }
        Outcome::TooFast(clock) => {
            guard.clock *= clock;
            inside.velocity.iter_mut().for_each(|v| *v *= clock);
        }
        Outcome::TooWide(_) => {
            for position in &mut inside.position {
                *position = shrunk(*position, NEARER_HOME);
            }
        }
    }
}

/// Limits of points: room enough to stop from most of their speed, if that leaves half of the range.
fn point_limits(limits: &Limits) -> PointLimits {
    let velocity: Vec<f64> = limits.velocity.iter().map(|v| POINT_SPEED * v).collect();
    let position = (0..limits.n_joints()).map(|j| {
        let (centre, half) = (limits.centre(j), limits.half_range(j));
        let way = velocity[j].powi(2) / (2.0 * limits.acceleration[j]);
        let inner = (half - way).max(0.5 * half);
        [centre - inner, centre + inner]
    });
    PointLimits {
        position: position.collect(),
        velocity,
    }
}

/// The best of many random chains, and how many there was time for.
fn best_random(
    design: &EnergyDesign,
    n_rows: usize,
    options: &PointOptions,
    watch: &Watch,
) -> (Option<(f64, Conditioning)>, usize) {
    if n_rows < design.n_columns() {
        return (None, 0);
    }
    let enough = watch.enough(RANDOM_SHARE);
    let draws: Vec<Option<(f64, u64)>> = (0..N_RANDOM as u64)
        .into_par_iter()
        .map(|draw| {
            if enough() {
                return None;
            }
            let points = design.random_points(n_rows, options.seed, draw);
            let w = design.observation_matrix(&points);
            Some((options.criterion.evaluate(w.as_ref(), n_rows), draw))
        })
        .collect();
    let tried: Vec<(f64, u64)> = draws.into_iter().flatten().collect();
    let best = tried.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let best = best.map(|&(value, draw)| {
        let points = design.random_points(n_rows, options.seed, draw);
        (value, design.conditioning(&points))
    });
    (best, tried.len())
}

/// By how much less of its position limits each joint's points may use: as if a path grew with its points, and a little more.
fn shares(overshoot: &[f64], limits: &Limits) -> Vec<f64> {
    let share = |(j, over): (usize, &f64)| {
        let half = limits.half_range(j);
        if *over > 0.0 {
            SPARE * half / (half + over)
        } else {
            1.0
        }
    };
    overshoot.iter().enumerate().map(share).collect()
}

/// A range about its middle, times a share.
fn shrunk([low, high]: [f64; 2], share: f64) -> [f64; 2] {
    let (centre, half) = (f64::midpoint(low, high), 0.5 * share * (high - low));
    [centre - half, centre + half]
}

/// The points nearer to where the path begins, and as much slower: the path grows with them.
fn draw_in(points: &mut JointStates, limits: &Limits) {
    for (j, home) in home(limits).into_iter().enumerate() {
        for q in points.q_mut(j) {
            *q = home + NEARER_HOME * (*q - home);
        }
        for qd in points.qd_mut(j) {
            *qd *= NEARER_HOME;
        }
    }
}

/// The points slowed down where the path beside them leaves its limits, until it does not, and drawn in while something is too
/// near: between points at rest inside the limits a path stays inside, and where it begins nothing is near.
fn slowed(
    design: &EnergyDesign,
    mut found: PointDesign,
    guard: &mut Guard<'_>,
) -> Result<(PointDesign, Proved), Error> {
    let n_points = found.points.n_samples();
    let mut why = "stays inside the limits";
    for _ in 0..SLOWINGS {
        let path = match guard.prove(&found.points)? {
            Outcome::Proved(proved) => {
                found.conditioning = design.conditioning(&found.points);
                return Ok((found, proved));
            }
            Outcome::Leaves(path) => path,
            Outcome::TooFast(clock) => {
                guard.clock *= clock;
                found.points = slower(&found.points, clock);
                continue;
            }
            Outcome::TooWide(kept) => {
                why = kept;
                draw_in(&mut found.points, guard.limits);
                continue;
            }
        };
        let mut beside_it = vec![vec![false; n_points]; guard.limits.n_joints()];
        for o in path.overshoot(guard.limits) {
            // The path begins at home, before the first point.
            let beside = [o.segment.checked_sub(1), Some(o.segment)];
            for k in beside.into_iter().flatten().filter(|k| *k < n_points) {
                beside_it[o.joint][k] = true;
            }
        }
        for (j, beside_it) in beside_it.iter().enumerate() {
            let speeds = found.points.qd_mut(j).iter_mut().zip(beside_it);
            for (qd, _) in speeds.filter(|(_, beside_it)| **beside_it) {
                *qd *= SLOWER;
            }
        }
    }
    Err(Error::input(
        "--family points",
        format!("no path through exciting points was found that {why}"),
        "nothing is written; give other position limits, more time, or take the Fourier motion",
    ))
}

/// Every criterion of the torque rows along a path, for the columns that `identify` uses.
fn along(robot: &Robot, path: &QuinticPath) -> Result<Conditioning, Error> {
    let all = Columns::standard(robot.n_joints(), DriveColumns::ALL);
    let base = Structure::of_drives(robot, all)
        .decided()?
        .base_model_columns();
    let added: Vec<_> = base.extra.iter().filter_map(ExtraColumn::added).collect();
    let n = SAMPLES * path.n_segments();
    let times: Vec<f64> = (0..n)
        .map(|k| path.duration() * k as f64 / n as f64)
        .collect();
    let noise = vec![1.0; robot.n_joints()];
    Ok(states_conditioning(
        &Model::new(robot),
        (&base.standard, &added),
        &path.states(&times),
        &noise,
    ))
}
