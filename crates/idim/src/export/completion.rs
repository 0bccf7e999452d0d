//! A robot of real bodies from base parameters and a prior.

use crate::columns::ExtraColumn;
use crate::identify::Identification;
use idim_estimation::{
    ConsistencyOptions, InformationFactor, LinkPrior, PhysicalEstimate, PhysicalParameters,
    PhysicalProblem, PositivePrior, physically_consistent,
};
use idim_model::{InertialParameters, KnownTorque, Parameter, ParameterKind, Robot};
use nalgebra::DMatrix;

mod columns;

use columns::Described;

/// Where a value comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The data know it for itself.
    Data,
    /// The data know a combination it stands in; its share is the prior's.
    Combination,
    /// No torque depends on it.
    Prior,
}

impl Source {
    /// As files say it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Combination => "combination",
            Self::Prior => "prior",
        }
    }
}

/// A robot with every value, and where each is from.
#[derive(Debug, Clone, PartialEq)]
pub struct Completion {
    /// The ten of each link.
    pub links: Vec<InertialParameters>,
    /// Sources of the ten, link by link.
    pub sources: Vec<[Source; 10]>,
    /// `Ia`, `Fv`, `Fc` and offset of each joint where the model has them, SI, at the joint.
    pub drives: Vec<[Option<(f64, Source)>; 4]>,
    /// What coupled motors, known torques and further friction add, SI.
    pub extra: Vec<(ExtraColumn, f64, Source)>,
    /// The known torques of the robot file with their scales in them: a scale of 1 is that of this robot.
    pub known_torques: Vec<KnownTorque>,
    /// The stated uncertainty had to be widened by this factor to admit real bodies; 1 where it admits them as it is.
    pub widened: f64,
}

/// Kinds of [`Completion::drives`], in their order.
pub(crate) const DRIVE_KINDS: [ParameterKind; 4] = [
    ParameterKind::Ia,
    ParameterKind::Fv,
    ParameterKind::Fc,
    ParameterKind::Offset,
];

/// Belief in a positive drive parameter that neither file nor data state, SI: small beside any arm's.
const SMALL: f64 = 1e-3;
/// A confidence region this much beyond the nearest real robot, in χ², has room for a plausible one.
const ROOM: f64 = 2.0;

/// The most plausible robot that agrees with the data.
///
/// # Errors
/// Why there is none, in a sentence: no prior, a prior that no rigid body has, data that do not excite every parameter.
pub fn complete(found: &Identification, robot: &Robot) -> Result<Completion, String> {
    let described = Described::of(found)?;
    let priors = robot.links().iter().map(|l| l.inertial.ok_or(&l.name));
    let priors: Vec<InertialParameters> = priors
        .collect::<Result<_, _>>()
        .map_err(|link| format!("no prior: the robot file states no inertial values for {link}"))?;
    let factor = factor_of_estimate(found).ok_or("the covariance of the estimate is singular")?;
    let place = |kind, index| described.place(&Parameter { kind, index });
    let links: Vec<LinkPrior> = (0..robot.n_joints())
        .map(|j| LinkPrior {
            columns: ParameterKind::INERTIAL.map(|kind| place(kind, j).unwrap_or_default()),
            prior: priors[j],
        })
        .collect();
    let positive = positive_priors(&described, found, robot);
    let (plausible, widened) = plausible(&described, &factor, &links, &positive)?;
    let value = |c: usize| (plausible.standard[c], described.source(c));
    let extra: Vec<(ExtraColumn, f64, Source)> = described
        .extra()
        .map(|(c, column)| (column.clone(), value(c).0, value(c).1))
        .collect();
    Ok(Completion {
        sources: (0..robot.n_joints())
            .map(|j| {
                let source = |kind| place(kind, j).map_or(Source::Prior, |c| described.source(c));
                ParameterKind::INERTIAL.map(source)
            })
            .collect(),
        drives: (0..robot.n_joints())
            .map(|j| DRIVE_KINDS.map(|kind| place(kind, j).map(value)))
            .collect(),
        known_torques: known_torques(robot, &extra)?,
        extra,
        links: plausible.links,
        widened,
    })
}

/// The most plausible robot, and how far the uncertainty had to be widened to hold one.
fn plausible(
    described: &Described,
    factor: &InformationFactor,
    links: &[LinkPrior],
    positive: &[PositivePrior],
) -> Result<(PhysicalParameters, f64), String> {
    let regrouping = described.regrouping();
    let solve = |sigma: f64| -> Result<PhysicalEstimate, String> {
        let problem = PhysicalProblem {
            factor,
            sigma,
            regrouping: regrouping.as_ref(),
            links,
            positive,
        };
        physically_consistent(&problem, &ConsistencyOptions::default()).map_err(|e| e.to_string())
    };
    let mut widened = 1.0;
    let mut outcome = solve(widened)?;
    if outcome.most_plausible.is_none() {
        // The median of χ² is about its degrees of freedom.
        let freedom = regrouping.nrows() as f64;
        widened = (ROOM * outcome.closest.delta_chi_square / freedom)
            .sqrt()
            .max(1.0);
        outcome = solve(widened)?;
    }
    let found = outcome.most_plausible;
    Ok((
        found.ok_or("no robot of real bodies is near the data")?,
        widened,
    ))
}

/// The file's known torques with their scales in them.
fn known_torques(
    robot: &Robot,
    extra: &[(ExtraColumn, f64, Source)],
) -> Result<Vec<KnownTorque>, String> {
    let scale = |torque: &KnownTorque| {
        let own = |e: &ExtraColumn| matches!(e, ExtraColumn::Known(k) if k == torque);
        extra.iter().find(|(e, ..)| own(e)).map_or(1.0, |e| e.1)
    };
    let all = robot.drives().known_torques.iter();
    all.map(|k| k.scaled(scale(k)).map_err(|e| e.to_string()))
        .collect()
}

/// Rows that say of the base parameters what the estimate says: `A β = A β̂` with `AᵀA = C⁻¹`.
fn factor_of_estimate(found: &Identification) -> Option<InformationFactor> {
    let n = found.values.len();
    let std: Vec<f64> = (0..n).map(|k| found.covariance[(k, k)].sqrt()).collect();
    let correlation = DMatrix::from_fn(n, n, |i, j| found.covariance[(i, j)] / (std[i] * std[j]));
    let root = correlation.cholesky()?.l().try_inverse()?;
    let mut factor = InformationFactor::new(n);
    for i in 0..n {
        let row: Vec<f64> = (0..n).map(|j| root[(i, j)] / std[j]).collect();
        let y: f64 = row.iter().zip(&found.values).map(|(a, b)| a * b).sum();
        factor.push_rows(&row, &[y]).ok()?;
    }
    Some(factor)
}

/// What was believed of rotors, friction and known torques: the file's word, else the data's.
///
/// A joint with further friction terms may have a viscous or Coulomb share below zero; the rotor of a coupled motor is the
/// motor's, so that nothing is stated of what its joint has beside it.
fn positive_priors(
    described: &Described,
    found: &Identification,
    robot: &Robot,
) -> Vec<PositivePrior> {
    let rotor = |j: usize| {
        let a = &robot.joints()[j].actuator;
        a.rotor_inertia.zip(a.gear_ratio).map(|(i, g)| i * g * g)
    };
    let coupled = |j: usize| {
        let of = |e: &ExtraColumn| matches!(e, ExtraColumn::Motor { motor, .. } if *motor == j);
        found.structure.extra.iter().any(of)
    };
    let standard = described.standard().filter_map(|(c, p)| {
        let a = &robot.joints()[p.index].actuator;
        let free = described.has_further_friction(p.index);
        let stated = match p.kind {
            ParameterKind::Ia if coupled(p.index) => None,
            ParameterKind::Ia => rotor(p.index),
            ParameterKind::Fv if !free => a.viscous_friction,
            ParameterKind::Fc if !free => a.coulomb_friction,
            _ => return None,
        };
        Some((c, stated))
    });
    let extra = described.extra().filter_map(|(c, column)| match column {
        ExtraColumn::Motor { motor, kind, .. } => {
            let stated = (*kind == ParameterKind::Ia).then(|| rotor(*motor));
            Some((c, stated.flatten()))
        }
        // A torque whose scale is in a combination only is as described.
        ExtraColumn::Known(_) if described.estimated(c).is_none() => Some((c, Some(1.0))),
        _ => None,
    });
    let prior = |(column, stated): (usize, Option<f64>)| {
        let estimated = described.estimated(column).map(|k| found.values[k]);
        let prior = stated.or(estimated).filter(|v| *v > 0.0).unwrap_or(SMALL);
        PositivePrior { column, prior }
    };
    standard.chain(extra).map(prior).collect()
}
