//! From a log to rows of the base regressor and torques: conditioned, filtered and decimated alike.

use crate::columns::{ModelColumns, reversal_of, smooth_sign};
use crate::error::Error;
use crate::plan::{PASS_BAND, Parallel, SamplingPlan};
use idim_measurement::doctor::clipped_at;
use idim_measurement::{Choice, ConditioningOptions, Decimator, LowPass, Measurements, condition};
use idim_model::{
    Columns, JointStates, Model, Notation, Parameter, ParameterKind, Robot, visit_torque_regressor,
};
use rayon::prelude::{IntoParallelIterator, ParallelIterator};

/// Order of the Butterworth low-passes.
pub(crate) const ORDER: usize = 4;

/// A stretch of samples with everything the equations need.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    /// Name of the log.
    pub(crate) file: String,
    /// Time on the log's clock, s.
    pub(crate) time: Vec<f64>,
    /// Conditioned states.
    pub(crate) states: JointStates,
    /// Recorded torque, joint by joint.
    pub(crate) torque: Vec<Vec<f64>>,
    /// Whether each sample's torque was clipped, joint by joint; empty for a joint without.
    pub(crate) clipped: Vec<Vec<bool>>,
    /// Torque of the rigid body, joint by joint, where a fit before knows it.
    pub(crate) load: Option<Vec<Vec<f64>>>,
}

impl Stretch {
    /// States alone, without a record.
    pub(crate) fn of_states(states: JointStates) -> Self {
        Self {
            file: String::new(),
            time: Vec::new(),
            states,
            torque: Vec::new(),
            clipped: Vec::new(),
            load: None,
        }
    }

    /// Which samples' rows of a joint are used: it moves as fast as the dead band, and no torque within `reach` samples was
    /// clipped, as far as a filter smears it.
    pub(crate) fn usable(&self, joint: usize, plan: &SamplingPlan, reach: usize) -> Vec<bool> {
        let dead = plan.dead_band.get(joint).copied().unwrap_or(0.0);
        let speeds = self.states.qd(joint).iter();
        let mut usable: Vec<bool> = speeds.map(|v| v.abs() >= dead).collect();
        let clipped = self.clipped.get(joint).map_or(&[][..], Vec::as_slice);
        let mut done = 0;
        for (k, _) in clipped.iter().enumerate().filter(|(_, c)| **c) {
            let end = (k + reach + 1).min(usable.len());
            let start = k.saturating_sub(reach).max(done);
            usable[start.min(end)..end].fill(false);
            done = end;
        }
        usable
    }
}

/// The stretches of a log under a plan; never one across a gap.
///
/// # Errors
/// A log the plan does not fit: too short, full of gaps, or a recorded quantity missing.
pub(crate) fn stretches(
    measured: &Measurements,
    plan: &SamplingPlan,
) -> Result<Vec<Stretch>, Error> {
    Ok(conditioned(measured, plan)?.0)
}

/// The stretches of a log, and the choices that were made for it.
fn conditioned(
    measured: &Measurements,
    plan: &SamplingPlan,
) -> Result<(Vec<Stretch>, Vec<Choice>), Error> {
    let clipped = clipped(measured);
    let Some(cutoff) = plan.cutoff else {
        let whole = Stretch {
            clipped: clipped.clone(),
            file: measured.file.clone(),
            time: measured.time.clone(),
            states: measured.states_as_recorded()?,
            torque: measured.torque.clone(),
            load: None,
        };
        return Ok((vec![whole], Vec::new()));
    };
    let options = ConditioningOptions {
        low_pass: Some(LowPass {
            order: ORDER,
            cutoff,
        }),
        derivatives: plan.derivatives,
        trim: plan.trim,
        ..ConditioningOptions::default()
    };
    let conditioned = condition(measured, &options)?;
    let stretches = conditioned.segments.into_iter().map(|s| Stretch {
        clipped: clipped
            .iter()
            .map(|c| at_times(&measured.time, c, &s.time))
            .collect(),
        file: measured.file.clone(),
        time: s.time,
        states: s.states,
        torque: s.torque,
        load: None,
    });
    Ok((stretches.collect(), conditioned.choices))
}

/// Whether each sample's torque is one at which its joint is clipped; empty for a joint that is not.
fn clipped(measured: &Measurements) -> Vec<Vec<bool>> {
    let of = |torque: &Vec<f64>| match clipped_at(torque) {
        levels if levels.is_empty() => Vec::new(),
        levels => torque.iter().map(|t| levels.contains(t)).collect(),
    };
    measured.torque.iter().map(of).collect()
}

/// Marks at other times: those of the samples before and after.
fn at_times(time: &[f64], marks: &[bool], at: &[f64]) -> Vec<bool> {
    if marks.is_empty() {
        return Vec::new();
    }
    let mark = |t: &f64| {
        let after = time.partition_point(|s| s < t).min(marks.len() - 1);
        marks[after] || marks[after.saturating_sub(1)]
    };
    at.iter().map(mark).collect()
}

/// What is clipped in a log, in a sentence a joint.
fn said_of_clipped(measured: &Measurements) -> Vec<String> {
    let joints = measured.joints.iter().zip(clipped(measured));
    joints
        .filter(|(_, clipped)| !clipped.is_empty())
        .map(|(joint, clipped)| {
            let count = clipped.iter().filter(|c| **c).count();
            format!(
                "torque of {joint} at its limit in {count} samples ({:.1} %: saturated; its rows as far as the filter spreads them are left out of the fit)",
                100.0 * count as f64 / clipped.len() as f64
            )
        })
        .collect()
}

/// The stretches of several logs.
///
/// # Errors
/// As [`stretches`].
pub(crate) fn all_stretches(
    logs: &[Measurements],
    plan: &SamplingPlan,
) -> Result<Vec<Stretch>, Error> {
    Ok(stated_stretches(logs, plan)?.0)
}

/// The stretches of several logs, and a sentence a log on what its own clock made of it: gaps, grid, edges.
///
/// # Errors
/// As [`stretches`].
pub(crate) fn stated_stretches(
    logs: &[Measurements],
    plan: &SamplingPlan,
) -> Result<(Vec<Stretch>, Vec<String>), Error> {
    let (mut all, mut said) = (Vec::new(), Vec::new());
    for log in logs {
        let (stretches, choices) = conditioned(log, plan)?;
        let short = too_short(&stretches, plan)?;
        all.extend(stretches);
        let mut own: Vec<String> = choices
            .iter()
            .filter(|c| OF_THE_CLOCK.contains(&c.what))
            .map(|c| {
                let value = (c.value * 1e4).round() / 1e4;
                let space = if c.unit.is_empty() { "" } else { " " };
                format!("{} {value}{space}{} ({})", c.what, c.unit, c.why)
            })
            .collect();
        own.extend(short);
        own.extend(said_of_clipped(log));
        if !own.is_empty() {
            said.push(format!("{}: {}", log.file, own.join("; ")));
        }
    }
    Ok((all, said))
}

/// The stretches that the parallel decimation leaves nothing of, in a sentence.
fn too_short(stretches: &[Stretch], plan: &SamplingPlan) -> Result<Option<String>, Error> {
    let mut longest = 0.0_f64;
    let (mut count, mut needed) = (0, 0.0);
    for stretch in stretches {
        let (n, fewest) = (
            stretch.states.n_samples(),
            decimator(stretch, plan)?.fewest_samples(),
        );
        if n < fewest {
            let interval = median_interval(&stretch.time);
            count += 1;
            longest = longest.max(n as f64 * interval);
            needed = fewest as f64 * interval;
        }
    }
    Ok((count > 0).then(|| {
        format!(
            "stretches too short for the parallel decimation {count} of {} (left out of the fit: at most {longest:.3} s long, where {needed:.3} s are needed)",
            stretches.len()
        )
    }))
}

/// Choices that differ from log to log; the plan states the others.
const OF_THE_CLOCK: [&str; 4] = [
    "gaps",
    "resampled, clock jitter",
    "samples in segments too short to filter",
    "left out at both ends",
];

/// Rows of W and y, sample by sample: row `sample · n_joints + joint`, row-major.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    /// Entries of W.
    pub(crate) w: Vec<f64>,
    /// Torques.
    pub(crate) y: Vec<f64>,
    /// Whether a row is used: see [`Stretch::usable`].
    pub(crate) used: Vec<bool>,
    /// Log and time of each sample, s.
    pub(crate) at: Vec<(String, f64)>,
}

/// Appends the decimated rows of a stretch; nothing when it is too short for the filter.
pub(crate) fn push_rows(
    rows: &mut Rows,
    robot: &Robot,
    columns: &ModelColumns,
    stretch: &Stretch,
    plan: &SamplingPlan,
) -> Result<(), Error> {
    let decimator = decimator(stretch, plan)?;
    let n_samples = stretch.states.n_samples();
    if n_samples < decimator.fewest_samples() {
        return Ok(());
    }
    let (n, p) = (robot.n_joints(), columns.len());
    let samples = decimator.kept(n_samples);
    let start = rows.y.len();
    rows.w.resize((start + samples.len() * n) * p, 0.0);
    rows.y.resize(start + samples.len() * n, 0.0);
    rows.used.resize(start + samples.len() * n, true);
    rows.at.extend(
        samples
            .iter()
            .map(|&k| (stretch.file.clone(), stretch.time[k])),
    );
    // One joint at a time: its columns over all samples are the largest thing in memory.
    let joints: Vec<Vec<Vec<f64>>> = (0..n)
        .into_par_iter()
        .map(|joint| {
            let entries = joint_columns(robot, columns, stretch, &plan.reversal, joint);
            let mut series: Vec<&[f64]> = entries.iter().map(Vec::as_slice).collect();
            series.push(&stretch.torque[joint]);
            decimator.decimate_columns(&series)
        })
        .collect();
    for (joint, decimated) in joints.iter().enumerate() {
        let usable = stretch.usable(joint, plan, decimator.trim());
        for (k, &sample) in samples.iter().enumerate() {
            let row = start + k * n + joint;
            for c in 0..p {
                rows.w[row * p + c] = decimated[c][k];
            }
            rows.y[row] = decimated[p][k];
            rows.used[row] = usable[sample];
            if let Some(c) = (0..p).find(|&c| !decimated[c][k].is_finite()) {
                return Err(Error::input(
                    format!("{} at t = {} s", stretch.file, stretch.time[sample]),
                    format!(
                        "{} of {} has no value at q = {}",
                        columns.names(Notation::Gautier)[c],
                        robot.joints()[joint].name,
                        stretch.states.q(joint)[sample]
                    ),
                    "a known torque's formula must have a value wherever the joint moves",
                ));
            }
        }
    }
    Ok(())
}

pub(crate) fn decimator(stretch: &Stretch, plan: &SamplingPlan) -> Result<Decimator, Error> {
    let rate = 1.0 / median_interval(&stretch.time);
    Ok(match plan.parallel {
        Some(Parallel::Butterworth { cutoff, factor }) => {
            Decimator::butterworth(factor, ORDER, cutoff, rate)?
        }
        Some(Parallel::ToRate(wanted)) => {
            let factor = ((rate / wanted).round() as usize).max(1);
            let cutoff = PASS_BAND * 0.5 * rate / factor as f64;
            Decimator::butterworth(factor, ORDER, cutoff, rate)?
        }
        None => Decimator::chebyshev(1)?,
    })
}

/// Every column of one joint's rows, sample by sample.
pub(crate) fn joint_columns(
    robot: &Robot,
    columns: &ModelColumns,
    stretch: &Stretch,
    reversal: &[f64],
    joint: usize,
) -> Vec<Vec<f64>> {
    let n_samples = stretch.states.n_samples();
    let standard = &columns.standard;
    let mut entries = vec![vec![0.0; n_samples]; standard.len()];
    if !standard.is_empty() {
        let mut row = vec![0.0; standard.len()];
        visit_torque_regressor(&Model::new(robot), standard, &stretch.states, |block| {
            for lane in 0..block.n_samples() {
                block.copy_row(joint, lane, &mut row);
                for (column, &x) in entries.iter_mut().zip(&row) {
                    column[block.first_sample() + lane] = x;
                }
            }
        });
    }
    let coulomb = standard
        .0
        .iter()
        .position(|p| p.kind == ParameterKind::Fc && p.index == joint);
    if let (Some(c), Some(&reversal)) = (coulomb, reversal.get(joint)) {
        for (x, &v) in entries[c].iter_mut().zip(stretch.states.qd(joint)) {
            *x = smooth_sign(v, reversal);
        }
    }
    let reversal = if reversal.is_empty() {
        vec![0.0; robot.n_joints()]
    } else {
        reversal.to_vec()
    };
    let zeros = || vec![0.0; n_samples];
    entries.extend(
        columns
            .extra
            .iter()
            .map(|e| e.series(joint, stretch, &reversal).unwrap_or_else(zeros)),
    );
    entries
}

/// Hands out every row of the regressor with the Coulomb entries smoothed, sample by sample: (sample, joint, row).
pub(crate) fn visit_rows(
    robot: &Robot,
    columns: &Columns,
    states: &JointStates,
    coulomb_speed: f64,
    mut visit: impl FnMut(usize, usize, &[f64]),
) {
    let coulomb: Vec<Option<usize>> = (0..robot.n_joints())
        .map(|j| {
            let own = |p: &Parameter| p.kind == ParameterKind::Fc && p.index == j;
            columns.0.iter().position(own)
        })
        .collect();
    let mut row = vec![0.0; columns.len()];
    visit_torque_regressor(&Model::new(robot), columns, states, |block| {
        for lane in 0..block.n_samples() {
            let sample = block.first_sample() + lane;
            for joint in 0..block.n_joints() {
                block.copy_row(joint, lane, &mut row);
                if let (Some(c), true) = (coulomb[joint], coulomb_speed > 0.0) {
                    let reversal = reversal_of(robot, joint, coulomb_speed);
                    row[c] = smooth_sign(states.qd(joint)[sample], reversal);
                }
                visit(sample, joint, &row);
            }
        }
    });
}

/// Hands out every row of these columns, joint by joint: (sample, joint, row).
pub(crate) fn visit_model_rows(
    robot: &Robot,
    columns: &ModelColumns,
    stretch: &Stretch,
    reversal: &[f64],
    mut visit: impl FnMut(usize, usize, &[f64]),
) {
    let mut row = vec![0.0; columns.len()];
    for joint in 0..robot.n_joints() {
        let entries = joint_columns(robot, columns, stretch, reversal, joint);
        for sample in 0..stretch.states.n_samples() {
            for (x, column) in row.iter_mut().zip(&entries) {
                *x = column[sample];
            }
            visit(sample, joint, &row);
        }
    }
}

/// Predicted torque of every sample, joint by joint; needs `stretch.load` where friction depends on it.
pub(crate) fn predict(
    robot: &Robot,
    columns: &ModelColumns,
    values: &[f64],
    stretch: &Stretch,
    reversal: &[f64],
) -> Vec<Vec<f64>> {
    let n_samples = stretch.states.n_samples();
    let kinds: Vec<(ParameterKind, usize)> = columns
        .standard
        .0
        .iter()
        .map(|p| (p.kind, p.index))
        .collect();
    let (standard, extra) = values.split_at(kinds.len());
    let mut torque = vec![vec![0.0; n_samples]; robot.n_joints()];
    if !kinds.is_empty() {
        let mut row = vec![0.0; kinds.len()];
        visit_torque_regressor(
            &Model::new(robot),
            &columns.standard,
            &stretch.states,
            |block| {
                for lane in 0..block.n_samples() {
                    let sample = block.first_sample() + lane;
                    for (joint, torque) in torque.iter_mut().enumerate() {
                        block.copy_row(joint, lane, &mut row);
                        if let Some(&reversal) = reversal.get(joint)
                            && let Some(c) =
                                kinds.iter().position(|k| *k == (ParameterKind::Fc, joint))
                        {
                            row[c] = smooth_sign(stretch.states.qd(joint)[sample], reversal);
                        }
                        torque[sample] = row.iter().zip(standard).map(|(w, x)| w * x).sum();
                    }
                }
            },
        );
    }
    let zeros = vec![0.0; robot.n_joints()];
    let reversal = if reversal.is_empty() {
        &zeros
    } else {
        reversal
    };
    for (column, &value) in columns.extra.iter().zip(extra) {
        for (joint, torque) in torque.iter_mut().enumerate() {
            if let Some(series) = column.series(joint, stretch, reversal) {
                for (t, x) in torque.iter_mut().zip(series) {
                    *t += value * x;
                }
            }
        }
    }
    torque
}

/// Torque of the rigid body alone, joint by joint: what loads the gears.
pub(crate) fn rigid_torque(
    robot: &Robot,
    columns: &ModelColumns,
    values: &[f64],
    stretch: &Stretch,
) -> Vec<Vec<f64>> {
    let kept: Vec<usize> = (0..columns.standard.len())
        .filter(|&k| columns.standard.0[k].kind.inertial_index().is_some())
        .collect();
    let rigid: Vec<f64> = kept.iter().map(|&k| values[k]).collect();
    predict(robot, &columns.select(&kept), &rigid, stretch, &[])
}

pub(crate) fn median_interval(time: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps[steps.len() / 2]
}
