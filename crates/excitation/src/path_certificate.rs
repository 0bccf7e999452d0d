//! Proof that torques and distances hold at every instant, not only at samples.
//!
//! Branch and bound over time: on a stretch the value at its middle, and a bound on how fast it can change there, say how
//! far it goes at most. Stretches that may go too far are halved.

use crate::torque_rate::{Magnitudes, TorqueRate};
use crate::{Clearance, TorquePrior};
use idim_model::{JointStates, Model};
use idim_trajectory::{FourierSeries, LimitUse};

/// Stretches a period is cut into at first, a harmonic.
const STRETCHES: usize = 64;
/// Middles looked at before a proof is given up: some seconds of work.
const MOST_MIDDLES: usize = 1 << 21;
/// Middles of one round, to keep what is held in memory small.
const TOGETHER: usize = 1 << 12;

/// Largest use of the torque limits, by the prior.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueCertificate {
    /// One a joint, as a fraction of its limit; `None` for a joint without.
    pub joints: Vec<Option<LimitUse>>,
    /// The fraction allowed; no instant uses more.
    pub share: f64,
}

/// Smallest distance between bodies that must keep clear.
#[derive(Debug, Clone, PartialEq)]
pub struct ClearanceCertificate {
    /// Smallest distance found, m.
    pub distance: f64,
    /// When, s.
    pub time: f64,
    /// Names of the two links (or `base`, `ground`).
    pub links: [String; 2],
    /// No instant is nearer than this, m.
    pub bound: f64,
    /// Pairs looked at.
    pub n_pairs: usize,
}

/// How fast the joints of a series move at most, at any time.
struct Extremes {
    position: Vec<f64>,
    acceleration: Vec<f64>,
    jerk: Vec<f64>,
}

impl Extremes {
    fn of(series: &FourierSeries) -> Self {
        let sum = |j: usize, order: i32| -> f64 {
            let terms = series.a(j).iter().zip(series.b(j)).enumerate();
            terms
                .map(|(l, (a, b))| (series.omega() * (l + 1) as f64).powi(order) * a.hypot(*b))
                .sum()
        };
        let n = 0..series.n_joints();
        Self {
            position: n
                .clone()
                .map(|j| series.mean_position()[j].abs() + sum(j, -1))
                .collect(),
            acceleration: n.clone().map(|j| sum(j, 1)).collect(),
            jerk: n.map(|j| sum(j, 2)).collect(),
        }
    }
}

/// Middles of stretches still to be proved, all of one length.
fn middles(series: &FourierSeries) -> (Vec<f64>, f64) {
    let n = STRETCHES * series.n_harmonics();
    let half = 0.5 * series.period() / n as f64;
    ((0..n).map(|k| (2 * k + 1) as f64 * half).collect(), half)
}

/// Halves what `excess` (by the states at the middles, their number and half a length) does not prove, until nothing is
/// left: true; or until it says that something is wrong, or too much work.
fn prove(
    series: &FourierSeries,
    mut open: impl FnMut(&JointStates, &[f64], f64) -> Option<Vec<bool>>,
) -> bool {
    let (mut times, mut half) = middles(series);
    let mut n_middles = 0;
    while !times.is_empty() {
        n_middles += times.len();
        if n_middles > MOST_MIDDLES {
            return false;
        }
        let mut next = Vec::new();
        half *= 0.5;
        for times in times.chunks(TOGETHER) {
            let states = series.states(times);
            let Some(open) = open(&states, times, 2.0 * half) else {
                return false;
            };
            for (t, _) in times.iter().zip(open).filter(|(_, open)| *open) {
                next.extend([t - half, t + half]);
            }
        }
        times = next;
    }
    true
}

/// The certificate of a motion's torques; `Err` where it uses too much, with the largest excess found of each joint.
pub(crate) fn certify_torque(
    model: &Model,
    prior: &TorquePrior,
    series: &FourierSeries,
) -> Result<TorqueCertificate, Vec<f64>> {
    let n = series.n_joints();
    let (extremes, rate) = (Extremes::of(series), TorqueRate::new(prior));
    let share = prior.share();
    let mut most = vec![(0.0_f64, 0.0); n];
    let mut bounds = vec![0.0_f64; n];
    let mut magnitudes: Vec<Magnitudes> = vec![[0.0; 4]; n];
    let proved = prove(series, |states, times, half| {
        let torque = prior.smooth_torque(model, states);
        let n_samples = times.len();
        let mut open = vec![false; n_samples];
        for k in 0..n_samples {
            for j in 0..n {
                magnitudes[j] = [
                    extremes.position[j],
                    states.qd(j)[k].abs() + half * extremes.acceleration[j],
                    states.qdd(j)[k].abs() + half * extremes.jerk[j],
                    extremes.jerk[j],
                ];
            }
            let rates = rate.bound(&magnitudes);
            let mut bound = vec![0.0; n];
            for j in 0..n {
                let value = torque[j * n_samples + k];
                let used = prior.used(j, value);
                if used > most[j].0 {
                    most[j] = (used, times[k]);
                }
                let known = prior.known_change(j, states.q(j)[k], half * magnitudes[j][1]);
                bound[j] = prior.used(j, value.abs() + half * rates[j] + known);
                open[k] |= bound[j] > share;
            }
            if !open[k] {
                for (largest, b) in bounds.iter_mut().zip(bound) {
                    *largest = largest.max(b);
                }
            }
        }
        most.iter().all(|m| m.0 <= share).then_some(open)
    });
    if !proved {
        return Err(most.iter().map(|m| (m.0 - share).max(0.0)).collect());
    }
    let joint = |j: usize| {
        prior.limit(j).is_finite().then(|| LimitUse {
            fraction: most[j].0,
            time: most[j].1,
            bound: bounds[j],
        })
    };
    Ok(TorqueCertificate {
        joints: (0..n).map(joint).collect(),
        share,
    })
}

/// The certificate of a motion's distances; `Err` where something is too near, with the missing distance, m.
pub(crate) fn certify_clearance(
    clearance: &Clearance,
    series: &FourierSeries,
) -> Result<ClearanceCertificate, f64> {
    let extremes = Extremes::of(series);
    let rates = clearance.rates(&extremes.position);
    let needed = clearance.smallest();
    let mut least = (0, f64::INFINITY, 0.0);
    let mut bound = f64::INFINITY;
    let proved = prove(series, |states, times, half| {
        let mut open = vec![false; times.len()];
        for (k, open) in open.iter_mut().enumerate() {
            let placed = clearance.place(&states.state(k).q);
            let mut here = f64::INFINITY;
            for (pair, rates) in rates.iter().enumerate() {
                let distance = clearance.distance(&placed, pair);
                if distance < least.1 {
                    least = (pair, distance, times[k]);
                }
                let speed = |&(j, reach): &(usize, f64)| {
                    reach * (states.qd(j)[k].abs() + half * extremes.acceleration[j])
                };
                let change: f64 = rates.iter().map(speed).sum();
                here = here.min(distance - half * change);
            }
            *open = here < needed;
            if !*open {
                bound = bound.min(here);
            }
        }
        (least.1 >= needed).then_some(open)
    });
    if !proved {
        return Err((needed - least.1).max(0.0));
    }
    Ok(ClearanceCertificate {
        distance: least.1,
        time: least.2,
        links: clearance.names(least.0),
        bound,
        n_pairs: clearance.n_pairs(),
    })
}
