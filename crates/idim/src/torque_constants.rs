//! Torque constants of motors from back-EMF: a motor turned from outside, its terminals open.

use crate::error::Error;
use idim_estimation::{PartialOptions, PartialRows, Weighting, partial_least_squares};

/// The constant of one motor: `V = K ω + V₀`, and K in V·s/rad is the torque constant in N·m/A.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueConstant {
    /// K, N·m/A.
    pub value: f64,
    /// Its standard deviation, also for residuals that follow each other.
    pub standard_deviation: f64,
    /// V₀, the amplifier's offset, V.
    pub offset: f64,
    /// RMS of what is left, V.
    pub rms: f64,
    /// Lowest and highest speed, rad/s.
    pub speeds: [f64; 2],
}

/// The torque constant from speeds (rad/s, of the motor) and open-terminal voltages (V) of a motor with a commutator, or of
/// one phase pair of a motor whose current is stated for the same pair.
///
/// What the motor generates per speed it gives per ampere, as power is the same on both sides.
/// Source: Corke 1996, in situ measurement of robot motor electrical constants.
///
/// # Errors
/// Lists of different length, fewer than 10 samples, a number that is not finite, a motor that did not turn.
pub fn torque_constant(speed: &[f64], voltage: &[f64]) -> Result<TorqueConstant, Error> {
    let refuse = |met: String, rule: &str| Err(Error::input("back-EMF", met, rule));
    if speed.len() != voltage.len() || speed.len() < FEWEST {
        return refuse(
            format!("{} speeds and {} voltages", speed.len(), voltage.len()),
            "give at least 10 pairs",
        );
    }
    if let Some(v) = speed.iter().chain(voltage).find(|v| !v.is_finite()) {
        return refuse(format!("a value {v}"), "give finite numbers");
    }
    let speeds = speed
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &v| {
            [a.min(v), b.max(v)]
        });
    if speeds[1] - speeds[0] < STILL {
        return refuse(
            format!("speeds from {} to {} rad/s", speeds[0], speeds[1]),
            "turn the motor at several speeds, in both directions",
        );
    }
    let w: Vec<f64> = speed.iter().flat_map(|&v| [v, 1.0]).collect();
    let rows = PartialRows {
        w: &w,
        y: voltage,
        used: &vec![true; voltage.len()],
        n_joints: 1,
    };
    let options = PartialOptions {
        weighting: Weighting::Diagonal,
        ..PartialOptions::default()
    };
    let Ok(fit) = partial_least_squares(&rows, &options)? else {
        return refuse(
            "one speed only".into(),
            "turn the motor at several speeds, in both directions",
        );
    };
    Ok(TorqueConstant {
        value: fit.estimate.values[0],
        standard_deviation: fit.standard_deviation[0],
        offset: fit.estimate.values[1],
        rms: fit.noise.standard_deviation()[0],
        speeds,
    })
}

/// Fewest samples of a fit of two numbers with an uncertainty.
const FEWEST: usize = 10;
/// Span of speeds that is standstill, rad/s.
const STILL: f64 = 1e-3;
