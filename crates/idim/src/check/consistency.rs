//! Do the torques agree about one rigid body? Every other way to read the columns is tried, and the one that makes them
//! agree names the fault.
//!
//! The joints share parameters: a load on the forearm is felt by elbow and shoulder. A column with a wrong sign, unit
//! or place makes them contradict each other, and the reading that ends the contradiction is the explanation. No prior
//! masses are needed; a common factor of all torques cannot be seen this way.

use super::faults::Fault;
use super::moments::{Consistency, Moments};
use super::prior;
use super::proportions::Proportions;
use super::readings::{Candidate, Reading, candidates, finer, plain_factors};
use super::rows::{LONGEST, Motors, RowMaker, Samples, mixed};
use super::suspicions::Suspicion;
use idim_model::{JointStates, Robot};

/// Fall of the joints' summed logarithmic errors from which another reading is believed, where the right one leaves no
/// error and the log is long; and what is asked for besides, per square of the mean error it leaves: on ill-fitting logs
/// (elastic joints, small motions) readings differ by chance, by up to 0.75 at a mean error of 0.3.
const BELIEVED: [f64; 2] = [0.12, 10.0];
/// Share of that which is enough where a finding of another kind suspects the same.
const BACKED: f64 = 0.25;
/// Share of that which is asked for besides, per step of a fault's complexity.
const SIMPLER: f64 = 0.4;
/// Faults looked for one after another.
const ROUNDS: usize = 4;
/// Independent samples of all joints a column needs before the rigid body alone is enough to refuse a log.
pub(crate) const ENOUGH: f64 = 10.0;

/// A fault, and why it is believed.
#[derive(Debug, Clone)]
pub(crate) struct Believed {
    pub(crate) fault: Fault,
    /// Fall of the misfit.
    pub(crate) gain: f64,
    /// Another finding suspected it.
    pub(crate) backed: bool,
}

/// What was tried, and what came of it.
#[derive(Debug, Clone)]
pub(crate) struct Examination {
    /// Faults accepted, in the order they were found.
    pub(crate) faults: Vec<Believed>,
    /// The columns without them.
    pub(crate) reading: Reading,
    /// Of that reading.
    pub(crate) fit: Consistency,
    /// Held-out relative errors of a description that knows angles but no robot.
    pub(crate) plain: Vec<f64>,
    /// Delay of the torques behind the positions, s, and the fall of the misfit.
    pub(crate) delay: Option<(f64, f64)>,
    /// How well torques follow those of the robot file's masses, if it states some.
    pub(crate) follows: Option<f64>,
    /// The arm moves too shortly to be sure of what its torques contradict.
    pub(crate) short: bool,
    /// Independent samples of all joints, and columns they are to tell apart.
    pub(crate) independent: (f64, usize),
    /// Change of each torque column over the log that nothing in the motion explains, N·m, and the fall of the misfit; of a
    /// single log.
    pub(crate) drift: Vec<(f64, f64)>,
    /// Fall of the misfit from which something is believed of this log.
    pub(crate) believed: f64,
}

/// Tries all readings of a log's columns one fault away from `start`, then from what was found.
pub(crate) fn examine(
    samples: &[Samples],
    robot: &Robot,
    start: &Reading,
    suspicions: &[Suspicion],
) -> Examination {
    let motors = Motors::new(robot);
    let maker = RowMaker::new(robot);
    let mut now = start.clone();
    let look = Look {
        samples,
        maker: &maker,
        motors: &motors,
        proportions: Proportions::new(samples, robot),
        independent: samples.iter().map(|s| s.independent).sum(),
    };
    let mut moments = look.moments(&now, 0.0);
    let mut fit = look.fit(&moments, &now);
    let mut faults: Vec<Believed> = Vec::new();
    while faults.len() < ROUNDS {
        let tried = look.one_fault_away(robot, &now, &moments);
        let open = suspicions
            .iter()
            .filter(|s| !faults.iter().any(|b| s.covers(&b.fault)));
        let open: Vec<&Suspicion> = open.collect();
        let suspected = |t: &Tried| open.iter().any(|s| s.covers(&t.0.0));
        let asked = |t: &Tried| {
            let share = if suspected(t) { BACKED } else { 1.0 };
            (share + SIMPLER * t.0.0.complexity()) * look.needed(&t.1)
        };
        let price = |t: &Tried| t.1.misfit + asked(t);
        let best = tried
            .iter()
            .min_by(|a, b| price(a).total_cmp(&price(b)))
            .filter(|t| price(t) < fit.misfit);
        let Some(chosen) = best else {
            break;
        };
        let backed = suspected(chosen);
        let ((fault, reading), chosen) = chosen.clone();
        let (fault, reading, misfit) = refined(&look, &moments, fault, reading, chosen.misfit);
        faults.push(Believed {
            fault,
            gain: fit.misfit - misfit,
            backed,
        });
        now = reading;
        moments = look.moments(&now, 0.0);
        fit = look.fit(&moments, &now);
    }
    let delay = look.delay(&now, fit.misfit);
    let independent = robot.n_joints() as f64 * look.independent;
    Examination {
        short: independent < ENOUGH * maker.p as f64,
        independent: (independent, maker.p),
        drift: look.drift(&now, &fit),
        believed: look.needed(&fit),
        follows: prior::follows(samples, robot, &now),
        faults,
        plain: look.plain_errors(&now),
        reading: now,
        fit,
        delay,
    }
}

/// A factor without a name, to a tenth.
fn refined(
    look: &Look<'_>,
    moments: &Moments,
    fault: Fault,
    reading: Reading,
    misfit: f64,
) -> (Fault, Reading, f64) {
    let near = finer(&fault, &reading).into_iter();
    near.map(|(f, r)| {
        let m = look.fit(moments, &r).misfit;
        (f, r, m)
    })
    .fold((fault, reading, misfit), |best, new| {
        if new.2 < best.2 { new } else { best }
    })
}

/// A reading, and how it fits.
type Tried = (Candidate, Consistency);

/// The samples of all logs, and what is needed to read them.
struct Look<'a> {
    samples: &'a [Samples],
    maker: &'a RowMaker,
    motors: &'a Motors,
    proportions: Proportions,
    /// Independent samples of a joint.
    independent: f64,
}

impl Look<'_> {
    /// Fall of the misfit from which a reading that leaves these errors is believed. `p` columns fitted to few samples miss
    /// held-out ones by more, which a reading that silences them avoids: `p / 2` over the independent samples in all.
    fn needed(&self, fit: &Consistency) -> f64 {
        let mean = fit.mean_error();
        let chance = 0.5 * self.maker.p as f64 / self.independent;
        BELIEVED[0] + chance + BELIEVED[1] * mean * mean
    }

    /// Every reading one fault away from `now`, whose sums are `moments`, and how it fits.
    fn one_fault_away(&self, robot: &Robot, now: &Reading, moments: &Moments) -> Vec<Tried> {
        let mut other: Option<(Reading, Moments)> = None;
        let mut all = candidates(robot, now);
        all.extend(plain_factors(robot.n_joints(), now));
        let fitted = |(fault, reading): Candidate| {
            let fit = if reading.same_rows(now) {
                self.fit(moments, &reading)
            } else {
                let kept = other.take().filter(|(r, _)| r.same_rows(&reading));
                let kept = kept.unwrap_or_else(|| (reading.clone(), self.moments(&reading, 0.0)));
                let fit = self.fit(&kept.1, &reading);
                other = Some(kept);
                fit
            };
            ((fault, reading), fit)
        };
        all.into_iter().map(fitted).collect()
    }

    /// Sums of all logs with their positions read in a way and their torques taken `lag` seconds later.
    fn moments(&self, reading: &Reading, lag: f64) -> Moments {
        let turned = self.maker.with_gravity(reading.gravity);
        let maker = turned.as_ref().unwrap_or(self.maker);
        let of = |samples: &Samples| {
            let (states, fastest) =
                samples.read_as(self.motors, &reading.position, &reading.position_scale);
            let rows = maker.rows(&states, &fastest);
            let late = (lag != 0.0).then(|| samples.late_torque(lag));
            let torque = late.unwrap_or_else(|| samples.torque.clone());
            let torque = self.motors.columns(torque);
            let rows = self.motors.rows_of_columns(rows, maker.p);
            Moments::new(&rows, maker.p, &torque, &samples.fold).with_positive(&maker.positive())
        };
        let first = of(&self.samples[0]);
        let others = self.samples[1..].iter();
        others.fold(first, |all, samples| all.merged(&of(samples)))
    }

    /// The misfit counts sizes out of proportion as it counts errors: by their logarithm.
    fn fit(&self, moments: &Moments, reading: &Reading) -> Consistency {
        let motors = self.motors;
        let share = motors.change_of_torques(&reading.torque, &reading.torque_scale);
        let mut fit = moments.fit(&share);
        fit.misfit += self.proportions.of_torques(&moments.deviations(&share));
        let change = motors.change_of_positions(&reading.position, &reading.position_scale);
        fit.misfit += self.proportions.of_positions(&change);
        fit
    }

    /// The shift in time that makes torques and positions agree best, s, and the fall of the misfit.
    fn delay(&self, now: &Reading, misfit: f64) -> Option<(f64, f64)> {
        let intervals = self.samples.iter().map(Samples::interval);
        let step = intervals.fold(0.008, f64::max);
        let half = (LONGEST / step).floor() as i32;
        let curve: Vec<f64> = (-half..=half)
            .map(|k| {
                let moments = self.moments(now, f64::from(k) * step);
                self.fit(&moments, now).misfit
            })
            .collect();
        let at = (0..curve.len()).min_by(|&a, &b| curve[a].total_cmp(&curve[b]))?;
        if at == 0 || at + 1 == curve.len() {
            return None;
        }
        let (a, b, c) = (curve[at - 1], curve[at], curve[at + 1]);
        let bend = a - 2.0 * b + c;
        let off = if bend > 0.0 {
            0.5 * (a - c) / bend
        } else {
            0.0
        };
        Some(((at as f64 - f64::from(half) + off) * step, misfit - b))
    }

    /// How much better each joint's torque is predicted with a line over the log beside the rigid body: the size that the line
    /// must have, and the fall of the logarithm of the error.
    fn drift(&self, now: &Reading, fit: &Consistency) -> Vec<(f64, f64)> {
        let [samples] = self.samples else {
            return Vec::new();
        };
        let turned = self.maker.with_gravity(now.gravity);
        let maker = turned.as_ref().unwrap_or(self.maker);
        let (n, p) = (now.torque.len(), maker.p);
        let (states, fastest) = samples.read_as(self.motors, &now.position, &now.position_scale);
        let rows = self
            .motors
            .rows_of_columns(maker.rows(&states, &fastest), p);
        let time = samples.moments_in_time();
        let mut wider = Vec::with_capacity(rows.len() / p * (p + n));
        for (at, row) in rows.chunks_exact(p).enumerate() {
            wider.extend_from_slice(row);
            wider.extend((0..n).map(|j| if j == at % n { time[at / n] } else { 0.0 }));
        }
        let torque = self.motors.columns(samples.torque.clone());
        let moments = Moments::new(&wider, p + n, &torque, &samples.fold);
        let moments = moments.with_positive(&maker.positive());
        let share = self
            .motors
            .change_of_torques(&now.torque, &now.torque_scale);
        let with = moments.fit(&share);
        let spread = moments.deviations(&share);
        (0..n)
            .map(|j| {
                let (before, after) = (fit.relative[j], with.relative[j]);
                // A line from -a/2 to a/2 has the mean square a²/12.
                let explained = (before.powi(2) - after.powi(2)).max(0.0);
                ((12.0 * explained).sqrt() * spread[j], (before / after).ln())
            })
            .collect()
    }

    /// Held-out relative error of each joint's torque explained by sines, cosines, speeds and accelerations of all joints:
    /// what can be said without knowing the robot. The better of a short description and a long one.
    fn plain_errors(&self, now: &Reading) -> Vec<f64> {
        let share = self
            .motors
            .change_of_torques(&now.torque, &now.torque_scale);
        let read: Vec<(JointStates, Vec<f64>, Vec<Vec<f64>>)> = self
            .samples
            .iter()
            .map(|s| {
                let (states, fastest) = s.read_as(self.motors, &now.position, &now.position_scale);
                let torque = self.motors.columns(s.torque.clone());
                (states, fastest, mixed(&share, &torque))
            })
            .collect();
        let n = now.torque.len();
        let error = |j: usize, long: bool| {
            let of = |at: usize| {
                let (states, fastest, torque) = &read[at];
                let count = states.n_samples();
                let rows: Vec<f64> = (0..count)
                    .flat_map(|k| plain_row(states, fastest, j, k, long))
                    .collect();
                let p = rows.len() / count.max(1);
                Moments::new(&rows, p, &torque[j..=j], &self.samples[at].fold)
            };
            let all = (1..read.len()).fold(of(0), |all, at| all.merged(&of(at)));
            all.fit(&[1.0]).relative[0]
        };
        (0..n)
            .map(|j| error(j, false).min(error(j, true)))
            .collect()
    }
}

/// What describes the torque of joint `j` at sample `k` without a robot; at length also by its neighbours: planes of
/// parallel axes, coupled motors.
fn plain_row(states: &JointStates, fastest: &[f64], j: usize, k: usize, long: bool) -> Vec<f64> {
    let n = states.n_joints();
    let friction = |i: usize| {
        let v = states.qd(i)[k];
        [v, (v / (0.02 * fastest[i])).tanh()]
    };
    let mut row = vec![1.0];
    for i in 0..n {
        let q = states.q(i)[k];
        row.extend([q.sin(), q.cos(), states.qdd(i)[k]]);
    }
    if !long {
        row.extend(friction(j));
        return row;
    }
    row.extend((0..n).flat_map(friction));
    row.extend((1..n).flat_map(|i| {
        let sum = states.q(i - 1)[k] + states.q(i)[k];
        [sum.sin(), sum.cos()]
    }));
    row
}
