//! Samples left out of a log, and torques brought to the instant of the positions. Nothing is joined across a hole.

use crate::clock::{GAP, interpolate, read_clock};
use crate::error::{Error, Place};
use crate::log::{Drive, Log};
use crate::plausibility::median_interval;

/// Bad rows of a recording: where they stood among the kept ones, and the first of them.
#[derive(Debug, Default)]
pub(crate) struct BadRows {
    /// Number of the kept row that follows, row by row.
    pub(crate) before: Vec<usize>,
    first: Option<Error>,
}

/// Rules whose breach is of one row: `drop_bad` leaves it out.
const OF_ONE_ROW: [&str; 4] = ["not-finite", "not-a-number", "not-plausible", "field-count"];

impl BadRows {
    /// Takes note of a row that breaks a rule of its own.
    ///
    /// # Errors
    /// The error itself where it is of the whole file.
    pub(crate) fn note(&mut self, kept: usize, error: Error) -> Result<(), Error> {
        if !OF_ONE_ROW.contains(&error.code()) {
            return Err(error);
        }
        self.before.push(kept);
        self.first.get_or_insert(error);
        Ok(())
    }

    /// The rows in a sentence; refused where they are the rule rather than the exception.
    pub(crate) fn stated(&self, n_kept: usize) -> Result<Option<String>, Error> {
        let Some(first) = &self.first else {
            return Ok(None);
        };
        let bad = self.before.len();
        if bad > n_kept {
            return Err(first.clone());
        }
        Ok(Some(format!(
            "{bad} bad rows of {} left out, the log is split there; the first: {first}",
            bad + n_kept
        )))
    }
}

impl Log {
    /// The samples that are kept. Where some are left out in between, neighbours go too until the clock has a gap there:
    /// the log is split, and no filter runs across.
    ///
    /// # Panics
    /// If `keep` is not of every sample.
    #[must_use]
    #[track_caller]
    pub fn keeping(&self, keep: &[bool]) -> Self {
        assert_eq!(keep.len(), self.n_samples(), "marks and samples");
        let starts = |k: &usize| !keep[*k] && (*k == 0 || keep[*k - 1]);
        let holes: Vec<usize> = (0..keep.len()).filter(starts).collect();
        self.picked(&self.parted(keep.to_vec(), &holes))
    }

    /// The log with a gap before each of these samples.
    pub(crate) fn with_gaps_before(self, samples: &[usize]) -> Self {
        if samples.is_empty() {
            return self;
        }
        let keep = vec![true; self.n_samples()];
        self.picked(&self.parted(keep, samples))
    }

    /// Marks with the neighbours of holes taken off: the last sample kept before a hole and the first after it are further
    /// apart than samples without a gap.
    fn parted(&self, mut keep: Vec<bool>, holes: &[usize]) -> Vec<bool> {
        let apart = GAP * (1.0 + 1e-9) * median_interval(&self.time);
        for &hole in holes {
            let last = (0..hole.min(keep.len())).rev().find(|&k| keep[k]);
            let Some(last) = last else { continue };
            for k in hole..keep.len() {
                if self.time[k] - self.time[last] > apart {
                    break;
                }
                keep[k] = false;
            }
        }
        keep
    }

    fn picked(&self, keep: &[bool]) -> Self {
        let pick = |x: &[f64]| -> Vec<f64> {
            let kept = x.iter().zip(keep).filter(|(_, k)| **k);
            kept.map(|(v, _)| *v).collect()
        };
        let all = |x: &Vec<Vec<f64>>| x.iter().map(|c| pick(c)).collect::<Vec<_>>();
        let lines = self.lines.iter().zip(keep).filter(|(_, k)| **k);
        Self {
            file: self.file.clone(),
            joints: self.joints.clone(),
            time_unit_declared: self.time_unit_declared,
            time: pick(&self.time),
            q: all(&self.q),
            qd: self.qd.as_ref().map(all),
            qdd: self.qdd.as_ref().map(all),
            drive: match &self.drive {
                Drive::Torque(x) => Drive::Torque(all(x)),
                Drive::Current(x) => Drive::Current(all(x)),
            },
            notes: self.notes.clone(),
            lines: lines.map(|(l, _)| *l).collect(),
        }
    }

    /// The log with each joint's torque (or current) taken from `delays[joint]` (s) later: what was recorded late belongs to
    /// the positions before. Between samples by the cubic through the four nearest, never across a gap; samples whose
    /// torque was not recorded any more are left out, and a note says how many.
    ///
    /// # Errors
    /// A delay that is not finite or longer than a second; no sample left.
    ///
    /// # Panics
    /// If there is not one delay a joint.
    #[track_caller]
    pub fn with_torque_delays(&self, delays: &[f64]) -> Result<Self, Error> {
        assert_eq!(delays.len(), self.n_joints(), "delays and joints");
        if let Some(&wrong) = delays
            .iter()
            .find(|d| d.is_nan() || d.abs() > LONGEST_DELAY)
        {
            let rule = "channels of one recording are within a second of each other; is it in ms?";
            return Err(Error::setting("delay (s)", wrong, rule));
        }
        let n = self.n_samples();
        let [early, late] = delays
            .iter()
            .fold([0.0_f64; 2], |[a, b], &d| [a.min(d), b.max(d)]);
        let mut keep = vec![false; n];
        let mut shifted = self.clone();
        let (Drive::Torque(drive) | Drive::Current(drive)) = &mut shifted.drive;
        let clock = read_clock(&self.time);
        // A stamp that misses an end by rounding alone is within it.
        let rounding = 1e-6 * clock.interval;
        for range in clock.segments(n).into_iter().filter(|r| r.len() >= 4) {
            let time = &self.time[range.clone()];
            let (first, last) = (time[0] - rounding, time[time.len() - 1] + rounding);
            let whole = |t: f64| t + early >= first && t + late <= last;
            let kept: Vec<usize> = range.clone().filter(|&k| whole(self.time[k])).collect();
            for (joint, &delay) in delays.iter().enumerate() {
                let at: Vec<f64> = kept.iter().map(|&k| self.time[k] + delay).collect();
                let values = interpolate(time, &drive[joint][range.clone()], &at);
                for (&k, value) in kept.iter().zip(values) {
                    drive[joint][k] = value;
                }
            }
            for &k in &kept {
                keep[k] = true;
            }
        }
        let left = keep.iter().filter(|k| **k).count();
        if left < 2 {
            return Err(Error::log(
                "too-few-samples",
                Place::file(&self.file),
                "no sample whose torque was recorded as late as stated",
                "correct the delay, or record a longer motion",
            ));
        }
        let mut out = shifted.picked(&keep);
        let ms: Vec<String> = delays.iter().map(|d| format!("{}", 1e3 * d)).collect();
        let ms = if delays.iter().all(|d| *d == delays[0]) {
            ms[0].clone()
        } else {
            ms.join(", ")
        };
        out.notes.push(format!(
            "delay of the torques behind the positions taken out: {ms} ms, as stated; {} samples at the ends left out",
            n - left
        ));
        Ok(out)
    }
}

/// Longest delay between channels, s.
const LONGEST_DELAY: f64 = 1.0;
