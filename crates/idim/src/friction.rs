//! Friction of each joint: which terms, and the choice among them on motions the fit has not seen.

use crate::columns::{FrictionTerm, reversal_of};
use crate::result::{FrictionResult, FrictionTrial};
use idim_model::Robot;

mod dictionary;
mod part;
mod search;

pub use part::{FrictionPart, MotorFriction};
pub(crate) use search::{Chosen, search};

/// How the friction of the joints is modelled.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum FrictionChoice {
    /// Viscous, Coulomb and offset as the drive columns say; one speed of reversal for all joints, by the training misfit.
    #[default]
    Plain,
    /// These terms, the last entry without a joint for all others; speeds left open are searched on held-out blocks.
    Fixed(Vec<(Option<String>, JointFriction)>),
    /// Terms of each joint by what they bring on held-out motions.
    Auto,
}

/// Friction terms of one joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointFriction {
    /// `Fv q̇`.
    pub viscous: bool,
    /// `Fc s(q̇)`.
    pub coulomb: bool,
    /// A constant.
    pub offset: bool,
    /// Terms beside them; a Stribeck speed of NaN is searched.
    pub terms: Vec<FrictionTerm>,
    /// Speed over which the sign of the speed is smoothed, rad/s (m/s); searched where `None`.
    pub reversal: Option<f64>,
}

/// Words a friction list may hold.
const WORDS: &str = "viscous, coulomb, offset, asymmetric, cubic, root, stribeck[:SPEED], load, tanh:SPEED (rad/s or m/s), none";

/// Reads `auto`, or `[JOINT=]TERM,TERM,..`.
///
/// # Errors
/// A word that is no term, a speed that is no positive number.
pub fn parse_friction(texts: &[String]) -> Result<FrictionChoice, String> {
    if texts.is_empty() {
        return Ok(FrictionChoice::Plain);
    }
    if texts == ["auto"] {
        return Ok(FrictionChoice::Auto);
    }
    let fixed: Result<Vec<_>, String> = texts
        .iter()
        .map(|text| match text.split_once('=') {
            Some((joint, list)) => Ok((Some(joint.to_owned()), parse_terms(list)?)),
            None => Ok((None, parse_terms(text)?)),
        })
        .collect();
    let fixed = fixed?;
    for (k, (joint, _)) in fixed.iter().enumerate() {
        if fixed[..k].iter().any(|(before, _)| before == joint) {
            let whose = joint.as_deref().unwrap_or("all other joints");
            return Err(format!(
                "the friction of {whose} is given twice; write its terms in one list"
            ));
        }
    }
    Ok(FrictionChoice::Fixed(fixed))
}

fn parse_terms(list: &str) -> Result<JointFriction, String> {
    let mut friction = JointFriction::default();
    let names: Vec<&str> = list
        .split(',')
        .map(|w| w.split(':').next().unwrap_or(w).trim())
        .collect();
    for (k, name) in names.iter().enumerate() {
        if names[..k].contains(name) {
            return Err(format!(
                "`{name}` stands twice in `{list}`; write each term once"
            ));
        }
        if *name == "none" && names.len() > 1 {
            return Err(format!(
                "`none` beside others in `{list}`; leave it out, or write it alone"
            ));
        }
        if *name == "auto" {
            return Err(format!(
                "`auto` in `{list}` is of all joints; write --friction auto, alone"
            ));
        }
    }
    for word in list.split(',').map(str::trim) {
        let (word, speed) = match word.split_once(':') {
            Some((word, speed)) => {
                let number: f64 = speed.parse().unwrap_or(f64::NAN);
                if !(number > 0.0 && number.is_finite()) {
                    return Err(format!("`{speed}` is no speed; a number above zero, rad/s"));
                }
                (word, Some(number))
            }
            None => (word, None),
        };
        match (word, speed) {
            ("viscous", None) => friction.viscous = true,
            ("coulomb", None) => friction.coulomb = true,
            ("offset", None) => friction.offset = true,
            ("asymmetric", None) => friction.terms.push(FrictionTerm::Asymmetric),
            ("cubic", None) => friction.terms.push(FrictionTerm::Cubic),
            ("root", None) => friction.terms.push(FrictionTerm::Root),
            ("load", None) => friction.terms.push(FrictionTerm::Load),
            ("stribeck", speed) => {
                let speed = speed.unwrap_or(f64::NAN);
                friction.terms.push(FrictionTerm::Stribeck(speed));
            }
            ("tanh", Some(speed)) => friction.reversal = Some(speed),
            ("none", None) => {}
            _ => {
                return Err(format!(
                    "`{word}` is no friction term; allowed: auto, or {WORDS}"
                ));
            }
        }
    }
    Ok(friction)
}

impl JointFriction {
    /// Viscous, Coulomb and offset.
    pub(crate) fn classic() -> Self {
        Self {
            viscous: true,
            coulomb: true,
            offset: true,
            ..Self::default()
        }
    }

    /// Number of parameters.
    pub(crate) fn size(&self) -> usize {
        let flags = [self.viscous, self.coulomb, self.offset];
        flags.iter().filter(|f| **f).count() + self.terms.len()
    }

    /// The terms in words, `viscous, coulomb, stribeck (0.05)`.
    pub(crate) fn text(&self) -> String {
        let mut words = Vec::new();
        let flags = [
            (self.viscous, "viscous"),
            (self.coulomb, "coulomb"),
            (self.offset, "offset"),
        ];
        words.extend(flags.iter().filter(|f| f.0).map(|f| f.1.to_owned()));
        words.extend(self.terms.iter().map(|t| match t {
            FrictionTerm::Asymmetric => "asymmetric".to_owned(),
            FrictionTerm::Cubic => "cubic".into(),
            FrictionTerm::Root => "root".into(),
            FrictionTerm::Stribeck(v) => format!("stribeck:{v:.3}"),
            FrictionTerm::Load => "load".into(),
        }));
        if words.is_empty() {
            words.push("none".into());
        }
        if let Some(speed) = self.reversal.filter(|v| *v > 0.0) {
            words.push(format!("tanh:{speed}"));
        }
        words.join(", ")
    }
}

/// The friction of each joint of a robot; `Err` names a joint that the robot does not have.
pub(crate) fn friction_of(
    robot: &Robot,
    fixed: &[(Option<String>, JointFriction)],
) -> Result<Vec<JointFriction>, String> {
    for (joint, _) in fixed {
        if let Some(name) = joint
            && robot.joint_index(name).is_none()
        {
            return Err(name.clone());
        }
    }
    let of = |name: &str| {
        let own = fixed.iter().rfind(|(j, _)| j.as_deref() == Some(name));
        let other = || fixed.iter().rfind(|(j, _)| j.is_none());
        own.or_else(other)
            .map_or_else(JointFriction::classic, |(_, f)| f.clone())
    };
    Ok(robot.joints().iter().map(|j| of(&j.name)).collect())
}

/// Speeds (rad/s) over which the Coulomb torque may change sign: from hardly smoothed to that of a noisy velocity.
pub(crate) const REVERSALS: [f64; 4] = [0.001, 0.005, 0.02, 0.1];

/// The same for a joint of any kind.
pub(crate) fn reversals(robot: &Robot, joint: usize) -> [f64; 4] {
    REVERSALS.map(|v| reversal_of(robot, joint, v))
}

/// What was tried on a joint, for `result.json` and the terminal.
pub(crate) fn to_result(names: &[String], chosen: &[Chosen]) -> Vec<FrictionResult> {
    let joint = |(name, c): (&String, &Chosen)| FrictionResult {
        joint: name.clone(),
        chosen: c.friction.text(),
        tried: c
            .tried
            .iter()
            .map(|(friction, rms)| FrictionTrial {
                terms: friction.text(),
                size: friction.size(),
                held_out_rms: Some(*rms).filter(|r| r.is_finite()),
            })
            .collect(),
    };
    names.iter().zip(chosen).map(joint).collect()
}
