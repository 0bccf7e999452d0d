//! Torque limits and clearance inside a search: an augmented Lagrangian over the samples of a period.
//!
//! Each sample of each condition `g ≤ 0` adds `½ w max(0, g + s)²` with a shift `s` of its own, which grows while the
//! condition is broken and vanishes where it is slack: the minimum then holds the conditions with finite weights
//! (Rockafellar 1974). What samples hide is left to `room`, and settled by the certificate.

use crate::path_certificate::{
    ClearanceCertificate, TorqueCertificate, certify_clearance, certify_torque,
};
use crate::{Clearance, FourierOptions, TorquePrior};
use idim_model::{JointStates, Model};
use idim_trajectory::{FourierBasis, FourierSeries};

/// Samples of a period, a harmonic.
const SAMPLES_PER_HARMONIC: usize = 32;
/// `w`: a condition broken by a tenth then costs as much as a tenth of log cond.
const WEIGHT: f64 = 20.0;
/// Distance that counts like the whole of a torque limit, m.
const LENGTH: f64 = 0.1;
/// First room, a fraction of the limit or of [`LENGTH`].
const ROOM: f64 = 3e-3;
/// A failed proof widens the room by this much of what was missing, and by [`ROOM`].
const WIDENING: f64 = 1.5;

/// Proofs that the conditions on a path hold; `None` for those not asked for.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PathCertificates {
    pub(crate) torque: Option<TorqueCertificate>,
    pub(crate) clearance: Option<ClearanceCertificate>,
}

/// Conditions on the path between its samples, as a penalty.
pub(crate) struct PathPenalty<'a> {
    model: &'a Model,
    torque: Option<&'a TorquePrior>,
    clearance: Option<&'a Clearance>,
    basis: FourierBasis,
    states: JointStates,
    /// Torques, joint by joint, then distances, pair by pair.
    conditions: Vec<f64>,
    shifts: Vec<f64>,
    /// One a joint, one a pair.
    room: Vec<f64>,
}

impl<'a> PathPenalty<'a> {
    /// `None` where nothing is asked for.
    pub(crate) fn new(model: &'a Model, options: &'a FourierOptions) -> Option<Self> {
        let (torque, clearance) = (options.torque.as_ref(), options.clearance.as_ref());
        let n_joints = torque.map_or(0, |_| model.n_joints());
        let n_conditions = n_joints + clearance.map_or(0, Clearance::n_pairs);
        if n_conditions == 0 {
            return None;
        }
        let n_samples = SAMPLES_PER_HARMONIC * options.n_harmonics;
        Some(Self {
            model,
            torque,
            clearance,
            basis: FourierBasis::equispaced(options.period, options.n_harmonics, n_samples),
            states: JointStates::zeros(model.n_joints(), n_samples),
            conditions: vec![0.0; n_conditions * n_samples],
            shifts: vec![0.0; n_conditions * n_samples],
            room: vec![ROOM; n_conditions],
        })
    }

    fn n_torques(&self) -> usize {
        self.torque.map_or(0, |_| self.model.n_joints())
    }

    /// Penalty of these coefficients.
    pub(crate) fn value(&mut self, coefficients: &[f64]) -> f64 {
        self.basis.states_into(coefficients, &mut self.states);
        let n_samples = self.basis.n_samples();
        if let Some(prior) = self.torque {
            let torque = prior.smooth_torque(self.model, &self.states);
            for (i, t) in torque.iter().enumerate() {
                let j = i / n_samples;
                self.conditions[i] = prior.used(j, *t) / prior.share() - 1.0 + self.room[j];
            }
        }
        if let Some(clearance) = self.clearance {
            let first = self.n_torques();
            for k in 0..n_samples {
                let placed = clearance.place(&self.states.state(k).q);
                for pair in 0..clearance.n_pairs() {
                    let missing = clearance.smallest() - clearance.distance(&placed, pair);
                    let room = self.room[first + pair];
                    self.conditions[(first + pair) * n_samples + k] = missing / LENGTH + room;
                }
            }
        }
        let conditions = self.conditions.iter().zip(&self.shifts);
        conditions
            .map(|(g, s)| 0.5 * WEIGHT * (g + s).max(0.0).powi(2))
            .sum()
    }

    /// Gradient by the coefficients where the value was asked for last.
    pub(crate) fn gradient(&mut self) -> Vec<f64> {
        let n_samples = self.basis.n_samples();
        let n_joints = self.model.n_joints();
        let slope = |i: usize| WEIGHT * (self.conditions[i] + self.shifts[i]).max(0.0);
        let mut by_states = JointStates::zeros(n_joints, n_samples);
        if let Some(prior) = self.torque {
            let torque = prior.smooth_torque(self.model, &self.states);
            let slopes: Vec<f64> = torque
                .iter()
                .enumerate()
                .map(|(i, t)| {
                    let allowed = prior.share() * prior.limit(i / n_samples);
                    slope(i) * t.signum() / allowed
                })
                .collect();
            by_states = prior.gradient(self.model, &self.states, &slopes);
        }
        if let Some(clearance) = self.clearance {
            let first = self.n_torques() * n_samples;
            for k in 0..n_samples {
                let pairs = 0..clearance.n_pairs();
                let slopes = pairs.map(|pair| slope(first + pair * n_samples + k));
                let active: Vec<_> = slopes.enumerate().filter(|(_, s)| *s > 0.0).collect();
                if active.is_empty() {
                    continue;
                }
                let placed = clearance.place(&self.states.state(k).q);
                for (pair, slope) in active {
                    clearance.add_gradient(&placed, pair, -slope / LENGTH, |j, g| {
                        by_states.q_mut(j)[k] += g;
                    });
                }
            }
        }
        self.basis.pull_back(&by_states)
    }

    /// Moves the shifts by what the conditions said last.
    pub(crate) fn move_shifts(&mut self) {
        for (s, g) in self.shifts.iter_mut().zip(&self.conditions) {
            *s = (*s + g).max(0.0);
        }
    }

    /// Proves that the conditions hold at every instant; where they do not, asks for more room in time to come.
    pub(crate) fn certify(&mut self, series: &FourierSeries) -> Option<PathCertificates> {
        let mut certificates = PathCertificates::default();
        let mut held = true;
        if let Some(prior) = self.torque {
            match certify_torque(self.model, prior, &series.into()) {
                Ok(c) => certificates.torque = Some(c),
                Err(excess) => {
                    held = false;
                    // Without an excess the proof took too long: everything near its limit gets more room.
                    let unknown = excess.iter().all(|e| *e == 0.0);
                    for (room, e) in self.room.iter_mut().zip(excess) {
                        let widened = unknown || e > 0.0;
                        // Where a known torque has no value there is no excess to go by.
                        let e = if e.is_finite() { e } else { 0.0 };
                        *room += if widened { ROOM + WIDENING * e } else { 0.0 };
                    }
                }
            }
        }
        if let Some(clearance) = self.clearance {
            match certify_clearance(clearance, &series.into()) {
                Ok(c) => certificates.clearance = Some(c),
                Err(missing) => {
                    held = false;
                    let first = self.n_torques();
                    for room in &mut self.room[first..] {
                        *room += ROOM + WIDENING * (missing / LENGTH).min(ROOM);
                    }
                }
            }
        }
        held.then_some(certificates)
    }

    /// Whether the samples hold the conditions, room left out.
    pub(crate) fn held_at_samples(&mut self, coefficients: &[f64]) -> bool {
        self.value(coefficients);
        let n_samples = self.basis.n_samples();
        let conditions = self.conditions.iter().enumerate();
        conditions
            .into_iter()
            .all(|(i, g)| *g - self.room[i / n_samples] <= 0.0)
    }
}
