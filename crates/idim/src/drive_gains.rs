//! Drive gains: what a unit of each drive's signal is worth, from runs with and without a load of known mass.

use crate::error::Error;
use crate::identify::Identification;
use crate::load::LoadedRobot;
use crate::payload::{both, load_columns};
use crate::samples::Rows;
use idim_base_params::{ReductionOptions, TriangularFactor, reduce};
use idim_estimation::{DriveGainSample, InformationFactor, TotalSolution, total_least_squares};
use idim_measurement::Measurements;

/// Gains of the drives, each the true torque per unit of the recorded one.
#[derive(Debug, Clone)]
pub struct DriveGains {
    /// Gains, joint by joint; 1 where the recorded torque is right. `None` where the runs do not tell.
    pub gains: Vec<Option<f64>>,
    /// Their standard deviations.
    pub standard_deviation: Vec<Option<f64>>,
    /// Smallest singular value over the next: below 0.1 one clear relation, near 1 none.
    pub validity: Option<f64>,
    /// What to know, one sentence each.
    pub warnings: Vec<String>,
}

/// A gain less sure than this share of itself is not told from any other.
const SEPARABLE: f64 = 0.3;
/// Singular values closer than this ratio cannot be told apart.
const VALID: f64 = 0.1;

/// Gains from runs without and with a load of known mass on a link.
///
/// `arm` comes from the runs without load, its rows weighted by the noise it found. Everything rests on `mass` (kg): a
/// mass ten percent wrong makes every gain ten percent wrong. Source: Gautier & Briot 2014.
///
/// # Errors
/// Logs that cannot be conditioned.
pub fn drive_gains(
    loaded: &LoadedRobot,
    arm: &Identification,
    unloaded_logs: &[Measurements],
    loaded_logs: &[Measurements],
    link: usize,
    mass: f64,
) -> Result<DriveGains, Error> {
    let robot = &loaded.robot;
    let n = robot.n_joints();
    let columns = load_columns(link);
    let (p, l) = (arm.values.len(), columns.len());
    let (a, _) = both(robot, arm, &columns, unloaded_logs)?;
    let (b, load) = both(robot, arm, &columns, loaded_logs)?;
    let mut independent = TriangularFactor::new(l);
    independent.push_rows(&load.w);
    let order: Vec<usize> = (0..l).collect();
    // The first column is the mass, which is known.
    let unknown: Vec<usize> = reduce(&independent, &order, &ReductionOptions::default())
        .base
        .into_iter()
        .filter(|&k| k != 0)
        .collect();
    let u = unknown.len();
    let weights = weights(arm, &a, n);
    // A row that is left out weighs nothing.
    let of_sample = |rows: &Rows, t: usize| -> Vec<f64> {
        let used = rows.used[t * n..][..n].iter();
        let weigh = |(u, w): (&bool, &f64)| if *u { *w } else { 0.0 };
        used.zip(&weights).map(weigh).collect()
    };
    let mut factor = InformationFactor::new(n + p + u);
    let no_load = (vec![0.0; n * u], vec![0.0; n]);
    for (t, signal) in a.y.chunks_exact(n).enumerate() {
        let sample = DriveGainSample {
            signal,
            arm: &a.w[t * n * p..][..n * p],
            load: &no_load.0,
            known_torque: &no_load.1,
        };
        sample.push(&of_sample(&a, t), &mut factor)?;
    }
    for (t, signal) in b.y.chunks_exact(n).enumerate() {
        let rows = &load.w[t * n * l..][..n * l];
        let of_unknown: Vec<f64> = rows
            .chunks_exact(l)
            .flat_map(|row| unknown.iter().map(|&k| row[k]))
            .collect();
        let known: Vec<f64> = rows.chunks_exact(l).map(|row| mass * row[0]).collect();
        let sample = DriveGainSample {
            signal,
            arm: &b.w[t * n * p..][..n * p],
            load: &of_unknown,
            known_torque: &known,
        };
        sample.push(&of_sample(&b, t), &mut factor)?;
    }
    Ok(answer(total_least_squares(&factor)?, &arm.joints, mass))
}

/// One over the standard deviation of each joint's residual without load.
fn weights(arm: &Identification, rows: &Rows, n: usize) -> Vec<f64> {
    let p = arm.values.len();
    let (mut squares, mut counts) = (vec![0.0; n], vec![0.0_f64; n]);
    for (row, (w, y)) in rows.w.chunks_exact(p).zip(&rows.y).enumerate() {
        if !rows.used[row] {
            continue;
        }
        let predicted: f64 = w.iter().zip(&arm.values).map(|(w, x)| w * x).sum();
        squares[row % n] += (y - predicted).powi(2);
        counts[row % n] += 1.0;
    }
    // A joint that is fitted exactly is weighted as if its noise were rounding.
    let each = squares.iter().zip(counts);
    each.map(|(s, count)| 1.0 / (s / count.max(1.0)).sqrt().max(1e-9))
        .collect()
}

fn answer(solution: TotalSolution, joints: &[String], mass: f64) -> DriveGains {
    let n = joints.len();
    let mut out = DriveGains {
        gains: vec![None; n],
        standard_deviation: vec![None; n],
        validity: None,
        warnings: Vec::new(),
    };
    match solution {
        TotalSolution::Unrelated => out.warnings.push(
            "the known mass is not felt in the loaded runs, so the gains have no scale; load the last link and move joints against gravity".into(),
        ),
        TotalSolution::RankDeficient(deficiency) => {
            let lost: Vec<&str> = deficiency
                .undetermined
                .iter()
                .filter(|&&k| k < n)
                .map(|&k| joints[k].as_str())
                .collect();
            out.warnings.push(if lost.is_empty() {
                "the runs do not tell the arm's or the load's parameters apart; excite every joint with and without the load".into()
            } else {
                format!(
                    "gains not separable from the arm's parameters: {}; the load must be felt by these joints",
                    lost.join(", ")
                )
            });
            for k in 0..n {
                out.gains[k] = deficiency.values[k];
                out.standard_deviation[k] = deficiency.standard_deviation[k];
            }
        }
        TotalSolution::Determined(total) => {
            out.validity = Some(total.validity);
            for k in 0..n {
                let (gain, std) = (total.values[k], total.standard_deviation[k]);
                if std < SEPARABLE * gain.abs() {
                    out.gains[k] = Some(gain);
                    out.standard_deviation[k] = Some(std);
                } else {
                    out.warnings.push(format!(
                        "the gain of {} is not separable: {gain:.3} with standard deviation {std:.3}; the load must be felt by this joint",
                        joints[k]
                    ));
                }
            }
            if total.validity > VALID {
                out.warnings.push(format!(
                    "validity {:.2}: the two smallest singular values are too close for one clear relation; a heavier load or longer runs tell more",
                    total.validity
                ));
            }
        }
    }
    out.warnings.push(format!(
        "the scale of all gains rests on the weighed mass, {mass} kg: a share by which it is wrong, they are wrong"
    ));
    out
}
