//! Findings from torques against a prediction: gravity, or a whole prior model.

use crate::conditioning::Segment;
use crate::doctor::finding::{Finding, Severity};
use crate::doctor::regression::{Basis, correlation, dot, norm};
use crate::error::Place;
use idim_model::{Joint, Robot};

/// How a measured torque follows a prediction once friction, own inertia and a constant are taken off both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueFit {
    /// Measured torque per predicted torque.
    pub slope: f64,
    /// Correlation of the two.
    pub correlation: f64,
    /// Share of the measured torque's length that the prediction would have if it were right.
    pub weight: f64,
}

/// Fits of every measured torque (row) of a segment to every prediction (column), as if it were that joint's torque:
/// the friction and the inertia of the predicted joint are taken off.
///
/// `predicted[joint][sample]`, N·m (N), of the segment's samples.
///
/// # Panics
/// If the shapes differ.
#[track_caller]
pub fn torque_fits(segment: &Segment, predicted: &[Vec<f64>]) -> Vec<Vec<TorqueFit>> {
    let states = &segment.states;
    assert_eq!(
        predicted.len(),
        states.n_joints(),
        "joints of the prediction and of the segment"
    );
    for column in predicted {
        assert_eq!(
            column.len(),
            states.n_samples(),
            "samples of the prediction and of the segment"
        );
    }
    let n = states.n_joints();
    let mut fits = vec![Vec::with_capacity(n); n];
    for (i, p) in predicted.iter().enumerate() {
        let qd = states.qd(i);
        let largest = qd.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let width = (0.02 * largest).max(f64::MIN_POSITIVE);
        let basis = Basis::new([
            vec![1.0; qd.len()],
            qd.iter().map(|v| (v / width).tanh()).collect(),
            qd.to_vec(),
            states.qdd(i).to_vec(),
        ]);
        let p = basis.residual(p.clone());
        let square = dot(&p, &p);
        for (fits, torque) in fits.iter_mut().zip(&segment.torque) {
            let measured = basis.residual(torque.clone());
            fits.push(TorqueFit {
                slope: if square > 0.0 {
                    dot(&p, &measured) / square
                } else {
                    0.0
                },
                correlation: correlation(&p, &measured),
                weight: norm(&p) / norm(&measured).max(f64::MIN_POSITIVE),
            });
        }
    }
    fits
}

/// Correlation above which a torque follows its prediction; what friction leaves weighs on light joints.
const FOLLOWS: f64 = 0.5;
/// Correlation above which a torque is believed to be another joint's.
const OWNED: f64 = 0.7;
/// Correlation below which it does not.
const UNRELATED: f64 = 0.3;
/// How much better another joint's prediction must correlate before the order is doubted.
const BETTER: f64 = 0.15;
/// Factor by which a prior model's masses may be wrong.
const PRIOR: f64 = 3.0;
/// Factor by which a slope may miss the one it is explained by: units and gears lie farther apart.
const NAMED: f64 = 2.0;

/// Measured torques against predicted ones: sign, unit, gear side, order, gravity compensated already, another robot.
///
/// `predicted[joint][sample]` in N·m (N) of the segment's samples, from gravity alone or from a prior model; friction,
/// the joint's own inertia and a constant are taken off both. Joints that the prediction loads with less than a tenth
/// of the largest say nothing. `file` names the log.
///
/// # Panics
/// If the shapes differ.
#[track_caller]
pub fn examine_torque(
    segment: &Segment,
    predicted: &[Vec<f64>],
    robot: &Robot,
    file: &str,
) -> Vec<Finding> {
    assert_eq!(
        robot.n_joints(),
        segment.states.n_joints(),
        "joints of the robot and of the segment"
    );
    let fits = torque_fits(segment, predicted);
    let loaded = loaded_joints(predicted);
    let owners: Vec<usize> = (0..fits.len())
        .map(|j| owner(&fits[j], j, &loaded))
        .collect();
    let mut out = Vec::new();
    for &j in &loaded {
        let fit = fits[j][j];
        let joint = &robot.joints()[j];
        let place = Place::file(file).joint(&joint.name);
        let i = owners[j];
        // Whose torque is here must not have one that follows its own prediction.
        if i != j && fits[i][i].correlation.abs() < FOLLOWS {
            let other = &robot.joints()[i].name;
            out.push(Finding::new(
                "joint-order",
                Severity::Error,
                place,
                i as f64 + 1.0,
                format!("the torque follows the prediction of joint {other}"),
                "torques and positions must list the joints in one order",
                format!("this column belongs to {other}"),
            ));
        } else if fit.correlation < -FOLLOWS {
            out.push(Finding::new(
                "torque-sign",
                Severity::Error,
                place,
                fit.slope,
                format!(
                    "torque sign opposite to the robot file's axis (correlation {:.2})",
                    fit.correlation
                ),
                "torque and prediction must have one sign",
                "change the sign of this joint's torque, or its axis in the robot file",
            ));
        } else if fit.correlation > FOLLOWS {
            out.extend(scale(fit.slope, joint, place));
        }
    }
    out.extend(unrelated(&fits, &loaded, file));
    out
}

/// The joint whose prediction a torque follows: another than its own only if that is clearly better.
fn owner(fits: &[TorqueFit], j: usize, loaded: &[usize]) -> usize {
    let strength = |i: usize| fits[i].correlation.abs();
    let best = loaded
        .iter()
        .copied()
        .max_by(|&a, &b| strength(a).total_cmp(&strength(b)));
    best.filter(|&i| strength(i) > OWNED && strength(i) > strength(j) + BETTER)
        .unwrap_or(j)
}

/// No torque follows its prediction: compensated gravity, or another robot.
fn unrelated(fits: &[Vec<TorqueFit>], loaded: &[usize], file: &str) -> Option<Finding> {
    let own: Vec<TorqueFit> = loaded.iter().map(|&j| fits[j][j]).collect();
    let best = own.iter().map(|f| f.correlation.abs()).fold(0.0, f64::max);
    if own.is_empty() || best >= UNRELATED {
        return None;
    }
    let light = own
        .iter()
        .all(|f| f.slope.abs() < 1.0 / PRIOR && f.weight > 1.0);
    let (code, met, next) = if light {
        (
            "gravity-compensated",
            "torques do not carry the predicted load, though it is larger than they are",
            "log the whole motor torque, not what the controller adds to its gravity compensation",
        )
    } else {
        (
            "wrong-robot",
            "no torque follows its prediction",
            "use the robot file, gravity direction and joint order of this log",
        )
    };
    let rule = "measured torques must follow the robot's";
    Some(Finding::new(
        code,
        Severity::Error,
        Place::file(file),
        best,
        met,
        rule,
        next,
    ))
}

/// Joints that the prediction loads with at least a tenth of the largest.
fn loaded_joints(predicted: &[Vec<f64>]) -> Vec<usize> {
    let spreads: Vec<f64> = predicted
        .iter()
        .map(|p| crate::doctor::signals::deviation(p))
        .collect();
    let largest = spreads.iter().copied().fold(0.0, f64::max);
    (0..spreads.len())
        .filter(|&j| spreads[j] > 0.0 && spreads[j] >= 0.1 * largest)
        .collect()
}

/// A torque in another unit, on the other side of a gear, or a current: the explanation nearest to the slope.
fn scale(slope: f64, joint: &Joint, place: Place) -> Option<Finding> {
    if (1.0 / PRIOR..PRIOR).contains(&slope) {
        return None;
    }
    let gear = joint.actuator.gear_ratio.map_or(f64::NAN, f64::abs);
    let constant = joint.actuator.torque_constant.unwrap_or(f64::NAN);
    let unit = "torque-unit";
    let candidates = [
        (
            1e3,
            unit,
            "1000: the torque is in N·mm or mN·m; name it `tau1_Nmm`",
        ),
        (
            1e-3,
            unit,
            "1/1000: the torque is in kN·m; name it `tau1_kNm`",
        ),
        (
            1.0 / gear,
            "gear-side",
            "one over the gear ratio: the torque is on the motor side; multiply it by the ratio",
        ),
        (
            gear,
            "gear-side",
            "the gear ratio: the torque was multiplied by it twice; divide by it",
        ),
        (
            1.0 / (gear * constant),
            "torque-is-current",
            "one over gear ratio and torque constant: the column is a current; name it `current1_A`",
        ),
        (
            1.0 / constant,
            "torque-is-current",
            "one over the torque constant: the column is gear ratio times current; multiply it by the constant",
        ),
    ];
    let distance = |factor: f64| (slope / factor).ln().abs();
    // Comparisons with the NaN of what the robot file does not state are false.
    let known = candidates.iter().filter(|c| distance(c.0) < NAMED.ln());
    let nearest = known.min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
    let (code, next) = nearest.map_or(
        (
            "torque-scale",
            "no unit or gear ratio explains it; is it a current, in percent, or on the motor side?"
                .to_string(),
        ),
        |(_, code, text)| (*code, format!("it is near {text}")),
    );
    Some(Finding::new(
        code,
        Severity::Error,
        place,
        slope,
        format!("torque is {slope:.4e} times the predicted one"),
        format!("a prior's masses are not wrong by more than {PRIOR} times"),
        next,
    ))
}
