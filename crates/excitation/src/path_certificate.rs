//! Proof that torques and distances hold at every instant, not only at samples.
//!
//! Branch and bound over time: on a stretch the value at its middle, and a bound on how fast it can change there, say how
//! far it goes at most. Stretches that may go too far are halved.

use crate::torque_rate::{Magnitudes, TorqueRate};
use crate::{Clearance, TorquePrior};
use idim_model::{JointStates, Model};
use idim_trajectory::{FourierSeries, LimitUse, QuinticPath};

/// Stretches a period is cut into at first, a harmonic.
const STRETCHES: usize = 64;
/// Stretches of a segment of a path.
const STRETCHES_OF_SEGMENT: usize = 16;
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

/// Largest magnitudes of a joint: position, acceleration, jerk.
type Extremes = Vec<[f64; 3]>;

/// The states of a motion at given times.
type States<'a> = Box<dyn Fn(&[f64]) -> JointStates + 'a>;

/// A motion in pieces, each with the largest magnitudes its joints have there.
pub(crate) struct Course<'a> {
    states: States<'a>,
    extremes: Vec<Extremes>,
    /// What a proof begins with.
    stretches: Vec<Stretch>,
}

/// Part of a motion, within one piece of it.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    piece: usize,
    middle: f64,
    half: f64,
}

/// Equal stretches from `start` on.
fn cut(piece: usize, [start, end]: [f64; 2], n: usize) -> impl Iterator<Item = Stretch> {
    let half = 0.5 * (end - start) / n as f64;
    (0..n).map(move |k| Stretch {
        piece,
        middle: start + (2 * k + 1) as f64 * half,
        half,
    })
}

impl<'a> From<&'a FourierSeries> for Course<'a> {
    fn from(series: &'a FourierSeries) -> Self {
        let sum = |j: usize, order: i32| -> f64 {
            let terms = series.a(j).iter().zip(series.b(j)).enumerate();
            terms
                .map(|(l, (a, b))| (series.omega() * (l + 1) as f64).powi(order) * a.hypot(*b))
                .sum()
        };
        let of_joint = |j: usize| {
            let position = series.mean_position()[j].abs() + sum(j, -1);
            [position, sum(j, 1), sum(j, 2)]
        };
        let n = STRETCHES * series.n_harmonics();
        Self {
            states: Box::new(|times| series.states(times)),
            extremes: vec![(0..series.n_joints()).map(of_joint).collect()],
            stretches: cut(0, [0.0, series.period()], n).collect(),
        }
    }
}

impl<'a> From<&'a QuinticPath> for Course<'a> {
    fn from(path: &'a QuinticPath) -> Self {
        let times = path.point_times().windows(2).enumerate();
        Self {
            states: Box::new(|times| path.states(times)),
            extremes: (0..path.n_segments()).map(|i| path.magnitudes(i)).collect(),
            stretches: times
                .flat_map(|(i, t)| cut(i, [t[0], t[1]], STRETCHES_OF_SEGMENT))
                .collect(),
        }
    }
}

impl Course<'_> {
    fn n_joints(&self) -> usize {
        self.extremes[0].len()
    }

    /// Halves what `open` (by the states at the middles) does not prove, until nothing is left: true; or until it says that
    /// something is wrong, or too much work.
    fn prove(&self, mut open: impl FnMut(&JointStates, &[Stretch]) -> Option<Vec<bool>>) -> bool {
        let mut stretches = self.stretches.clone();
        let mut n_middles = 0;
        while !stretches.is_empty() {
            n_middles += stretches.len();
            if n_middles > MOST_MIDDLES {
                return false;
            }
            let mut next = Vec::new();
            for stretches in stretches.chunks(TOGETHER) {
                let times: Vec<f64> = stretches.iter().map(|s| s.middle).collect();
                let Some(open) = open(&(self.states)(&times), stretches) else {
                    return false;
                };
                for (s, _) in stretches.iter().zip(open).filter(|(_, open)| *open) {
                    let half = 0.5 * s.half;
                    let at = |middle| Stretch { middle, half, ..*s };
                    next.extend([at(s.middle - half), at(s.middle + half)]);
                }
            }
            stretches = next;
        }
        true
    }
}

impl TorqueCertificate {
    /// Of a path through points; `Err` where it uses too much: the largest excess found of each joint, as a fraction of
    /// its limit.
    ///
    /// # Errors
    /// No proof.
    pub fn of_path(
        model: &Model,
        prior: &TorquePrior,
        path: &QuinticPath,
    ) -> Result<Self, Vec<f64>> {
        certify_torque(model, prior, &path.into())
    }
}

impl ClearanceCertificate {
    /// Of a path through points; `Err` where something is too near: the distance that is missing, m.
    ///
    /// # Errors
    /// No proof.
    pub fn of_path(clearance: &Clearance, path: &QuinticPath) -> Result<Self, f64> {
        certify_clearance(clearance, &path.into())
    }
}

/// The certificate of a motion's torques; `Err` where it uses too much, with the largest excess found of each joint.
pub(crate) fn certify_torque(
    model: &Model,
    prior: &TorquePrior,
    course: &Course<'_>,
) -> Result<TorqueCertificate, Vec<f64>> {
    let n = course.n_joints();
    let rate = TorqueRate::new(prior);
    let share = prior.share();
    let mut most = vec![(0.0_f64, 0.0); n];
    let mut bounds = vec![0.0_f64; n];
    let mut magnitudes: Vec<Magnitudes> = vec![[0.0; 4]; n];
    let proved = course.prove(|states, stretches| {
        let torque = prior.smooth_torque(model, states);
        let n_samples = stretches.len();
        let mut open = vec![false; n_samples];
        for (
            k,
            &Stretch {
                piece,
                middle,
                half,
            },
        ) in stretches.iter().enumerate()
        {
            for (j, [position, acceleration, jerk]) in course.extremes[piece].iter().enumerate() {
                magnitudes[j] = [
                    *position,
                    states.qd(j)[k].abs() + half * acceleration,
                    states.qdd(j)[k].abs() + half * jerk,
                    *jerk,
                ];
            }
            let rates = rate.bound(&magnitudes);
            let mut bound = vec![0.0; n];
            for j in 0..n {
                let value = torque[j * n_samples + k];
                let used = prior.used(j, value);
                if used > most[j].0 {
                    most[j] = (used, middle);
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
    course: &Course<'_>,
) -> Result<ClearanceCertificate, f64> {
    let position = |j: usize| {
        let pieces = course.extremes.iter().map(|piece| piece[j][0]);
        pieces.fold(0.0, f64::max)
    };
    let positions: Vec<f64> = (0..course.n_joints()).map(position).collect();
    let rates = clearance.rates(&positions);
    let needed = clearance.smallest();
    let mut least = (0, f64::INFINITY, 0.0);
    let mut bound = f64::INFINITY;
    let proved = course.prove(|states, stretches| {
        let mut open = vec![false; stretches.len()];
        for (k, (open, stretch)) in open.iter_mut().zip(stretches).enumerate() {
            let &Stretch {
                piece,
                middle,
                half,
            } = stretch;
            let placed = clearance.place(&states.state(k).q);
            let mut here = f64::INFINITY;
            for (pair, rates) in rates.iter().enumerate() {
                let distance = clearance.distance(&placed, pair);
                if distance < least.1 {
                    least = (pair, distance, middle);
                }
                let speed = |&(j, reach): &(usize, f64)| {
                    reach * (states.qd(j)[k].abs() + half * course.extremes[piece][j][1])
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
