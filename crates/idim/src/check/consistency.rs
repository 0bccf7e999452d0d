//! Do the torques agree about one rigid body? Every other way to read the columns is tried, and the one that makes them
//! agree names the fault.
//!
//! The joints share parameters: a load on the forearm is felt by elbow and shoulder. A column with a wrong sign, unit
//! or place makes them contradict each other, and the reading that ends the contradiction is the explanation. No prior
//! masses are needed; a common factor of all torques cannot be seen this way.

use super::faults::Fault;
use super::moments::{Consistency, Moments};
use super::readings::{Candidate, Reading, candidates, finer, plain_factors};
use super::rows::{LONGEST, Motors, RowMaker, Samples, mixed};
use idim_measurement::Place;
use idim_measurement::doctor::{Finding, Severity};
use idim_model::{JointStates, Robot};

/// Fall of the joints' summed logarithmic errors from which another reading is believed, where the right one leaves no
/// error; and what is asked for besides, per square of the mean error it leaves: on ill-fitting logs (elastic joints,
/// small motions) readings differ by chance, by up to 0.75 at a mean error of 0.3.
const BELIEVED: [f64; 2] = [0.12, 10.0];
/// A simpler reading is preferred to one better by less than this.
const SIMPLER: f64 = 0.08;
/// Faults looked for one after another.
const ROUNDS: usize = 4;
/// Fall from which a delay is believed.
const BELIEVED_DELAY: f64 = 0.25;
/// Delay worth a warning, s; a drive's own filter takes a few milliseconds.
const DELAY: f64 = 0.008;

/// What was tried, and what came of it.
#[derive(Debug, Clone)]
pub(crate) struct Examination {
    /// Faults accepted, each with the fall of the misfit.
    pub(crate) faults: Vec<(Fault, f64)>,
    /// Of the last reading.
    pub(crate) fit: Consistency,
    /// Held-out relative errors of a description that knows angles but no robot.
    pub(crate) plain: Vec<f64>,
    /// Delay of the torques behind the positions, s, and the fall of the misfit.
    pub(crate) delay: Option<(f64, f64)>,
}

/// Tries all readings of a log's columns.
pub(crate) fn examine(samples: &[Samples], robot: &Robot) -> Examination {
    let motors = Motors::new(robot);
    let maker = RowMaker::new(robot);
    let mut now = Reading::as_recorded(robot);
    let look = Look {
        samples,
        maker: &maker,
        motors: &motors,
    };
    let mut moments = look.moments(&now, 0.0);
    let mut fit = look.fit(&moments, &now);
    let mut faults = Vec::new();
    for _ in 0..ROUNDS {
        let mut tried: Vec<(Candidate, Consistency)> = Vec::new();
        let mut shared: Option<(Reading, Moments)> = None;
        let mut all = candidates(robot, &now);
        all.extend(plain_factors(robot.n_joints(), &now));
        for (fault, reading) in all {
            let tried_fit = if reading.same_rows(&now) {
                look.fit(&moments, &reading)
            } else {
                if shared.as_ref().is_none_or(|(r, _)| !r.same_rows(&reading)) {
                    shared = Some((reading.clone(), look.moments(&reading, 0.0)));
                }
                let Some((_, other)) = &shared else { continue };
                look.fit(other, &reading)
            };
            tried.push(((fault, reading), tried_fit));
        }
        let Some(((fault, reading), chosen)) = simplest(tried) else {
            break;
        };
        if fit.misfit - chosen.misfit < needed(&chosen) {
            break;
        }
        let (fault, reading, misfit) = refined(&look, &moments, fault, reading, chosen.misfit);
        faults.push((fault, fit.misfit - misfit));
        now = reading;
        moments = look.moments(&now, 0.0);
        fit = look.fit(&moments, &now);
    }
    let delay = look.delay(&now, fit.misfit);
    Examination {
        faults,
        plain: look.plain_errors(&now),
        fit,
        delay,
    }
}

/// Fall of the misfit from which a reading that leaves these errors is believed.
fn needed(fit: &Consistency) -> f64 {
    let mean = fit.relative.iter().sum::<f64>() / fit.relative.len() as f64;
    BELIEVED[0] + BELIEVED[1] * mean * mean
}

/// The best reading of the simplest kind that is not much worse than the best of all.
fn simplest(tried: Vec<(Candidate, Consistency)>) -> Option<(Candidate, Consistency)> {
    let lowest = tried
        .iter()
        .map(|t| t.1.misfit)
        .fold(f64::INFINITY, f64::min);
    let near = tried.into_iter().filter(|t| t.1.misfit <= lowest + SIMPLER);
    near.min_by(|a, b| {
        let by_kind = a.0.0.complexity().cmp(&b.0.0.complexity());
        by_kind.then(a.1.misfit.total_cmp(&b.1.misfit))
    })
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

/// The samples of all logs, and what is needed to read them.
struct Look<'a> {
    samples: &'a [Samples],
    maker: &'a RowMaker,
    motors: &'a Motors,
}

impl Look<'_> {
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
            Moments::new(&rows, maker.p, &torque, &samples.fold)
        };
        let first = of(&self.samples[0]);
        let others = self.samples[1..].iter();
        others.fold(first, |all, samples| all.merged(&of(samples)))
    }

    fn fit(&self, moments: &Moments, reading: &Reading) -> Consistency {
        moments.fit(
            &self
                .motors
                .change_of_torques(&reading.torque, &reading.torque_scale),
        )
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

/// Error of one joint, in errors of the description without a robot, from which the robot is doubted. The right robot's
/// last joint may reach 1.8: its torque is mostly friction.
const WORSE: f64 = 2.1;
/// Misfit by which a robot may be worse than that description where the description is good.
const NO_BETTER: f64 = 0.3;
/// Mean error below which the description without a robot is good enough to judge one.
const GOOD: f64 = 0.2;
/// Held-out relative error from which a joint is not explained.
const UNEXPLAINED: f64 = 0.9;

/// The joint whose torque the robot explains worst, and how many times worse than curves do, if that is too much.
fn doubted(e: &Examination) -> Option<(usize, f64)> {
    let times: Vec<f64> = e
        .fit
        .relative
        .iter()
        .zip(&e.plain)
        .map(|(own, plain)| own / plain.max(1e-3))
        .collect();
    let worst = (0..times.len()).max_by(|&a, &b| times[a].total_cmp(&times[b]))?;
    let mean = e.plain.iter().sum::<f64>() / e.plain.len() as f64;
    let misfit: f64 = times.iter().map(|t| t.ln()).sum();
    let wrong = times[worst] > WORSE || mean < GOOD && misfit > NO_BETTER;
    wrong.then_some((worst, times[worst]))
}

/// The examination in findings.
pub(crate) fn findings(e: &Examination, robot: &Robot, file: &str) -> Vec<Finding> {
    let mut out = Vec::new();
    if let Some(worst) = doubted(e) {
        let (joint, times) = worst;
        out.push(Finding {
            code: "wrong-robot",
            severity: Severity::Error,
            place: Place::file(file),
            value: Some(times),
            met: format!(
                "the robot explains the torque of {} {times:.1} times worse than curves that know no robot",
                robot.joints()[joint].name
            ),
            rule: "the right robot's few parameters predict held-out samples better than any generic curve".into(),
            next_step: "use the robot file of this log: its geometry, mounting, couplings and order of the joints".into(),
        });
    } else {
        let faults = e.faults.iter();
        out.extend(faults.flat_map(|(fault, gain)| fault.findings(robot, file, *gain)));
        for (j, joint) in robot.joints().iter().enumerate() {
            if e.fit.relative[j] > UNEXPLAINED {
                out.push(Finding {
                    code: "unexplained-torque",
                    severity: Severity::Warning,
                    place: Place::file(file).joint(&joint.name),
                    value: Some(e.fit.relative[j]),
                    met: format!(
                        "a rigid body with friction leaves {:.0} % of this joint's torque unexplained on held-out samples",
                        100.0 * e.fit.relative[j]
                    ),
                    rule: "most of a torque comes from gravity, inertia and friction".into(),
                    next_step: "is it the torque of this joint, in this unit, of this motion?".into(),
                });
            }
        }
    }
    if let Some((lag, gain)) = e.delay
        && lag.abs() > DELAY
        && gain > BELIEVED_DELAY
    {
        out.push(Finding {
            code: "torque-delay",
            severity: Severity::Warning,
            place: Place::file(file),
            value: Some(lag),
            met: format!("torques lag positions by {:.1} ms", 1e3 * lag),
            rule: "channels must be of one instant".into(),
            next_step: "shift the torque columns by this time, or log both at one clock".into(),
        });
    }
    out
}
