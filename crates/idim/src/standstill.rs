//! Samples in which the whole arm stands still: friction can point either way there, and a fit that believes them is wrong.

use crate::friction::FrictionChoice;
use crate::identify::IdentifyOptions;
use crate::samples::{Stretch, median_interval};
use idim_model::{JointKind, Robot};

/// Speed below which a revolute joint counts as still, rad/s.
const STILL: f64 = 0.01;
/// The same for a prismatic joint, m/s.
const STILL_LENGTH: f64 = 0.001;
/// Shortest standstill that is one, s: longer than any reversal.
const SHORTEST: f64 = 0.2;
/// Share of the samples above which it biases Coulomb friction by more than its standard deviation.
const SHARE: f64 = 0.02;

/// One sentence a log where all joints stand still for long, unless a dead band is stated or no Coulomb friction is asked for.
pub(crate) fn standstill_warnings(
    robot: &Robot,
    stretches: &[Stretch],
    options: &IdentifyOptions,
) -> Vec<String> {
    let coulomb = options.columns.coulomb || options.friction != FrictionChoice::Plain;
    if !coulomb || !options.sampling.dead_band.is_empty() {
        return Vec::new();
    }
    stretches.iter().filter_map(|s| warning(robot, s)).collect()
}

fn warning(robot: &Robot, stretch: &Stretch) -> Option<String> {
    let n = stretch.states.n_samples();
    let still = |k: usize| {
        robot.joints().iter().enumerate().all(|(j, joint)| {
            let limit = match joint.kind {
                JointKind::Revolute => STILL,
                JointKind::Prismatic => STILL_LENGTH,
            };
            stretch.states.qd(j)[k].abs() < limit
        })
    };
    let shortest = (SHORTEST / median_interval(&stretch.time)).ceil() as usize;
    let (mut total, mut run, mut first) = (0, 0, None);
    for k in 0..=n {
        if k < n && still(k) {
            run += 1;
            continue;
        }
        if run >= shortest {
            total += run;
            first = first.or(Some(k - run));
        }
        run = 0;
    }
    let share = total as f64 / n as f64;
    let first = first.filter(|_| share > SHARE)?;
    Some(format!(
        "standstill: {}: all joints stand still in {:.0} % of the samples from {:.2} to {:.2} s, first at t = {:.3} s; friction holds either way there, and a fit that believes these rows biases Coulomb friction and offsets; leave slow rows out with --dead-band 0.1, or cut the log",
        stretch.file,
        100.0 * share,
        stretch.time[0],
        stretch.time[n - 1],
        stretch.time[first],
    ))
}
