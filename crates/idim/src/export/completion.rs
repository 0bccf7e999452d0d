//! A robot of real bodies from base parameters and a prior.

use crate::identify::Identification;
use crate::structure::Structure;
use idim_estimation::{
    ConsistencyOptions, InformationFactor, LinkPrior, PhysicalEstimate, PhysicalProblem,
    PositivePrior, physically_consistent,
};
use idim_model::{InertialParameters, ParameterKind, Robot};
use nalgebra::DMatrix;

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
    /// `Ia`, `Fv` and `Fc` of each joint where the model has them, SI, at the joint.
    pub drives: Vec<[Option<f64>; 3]>,
    /// The stated uncertainty had to be widened by this factor to admit real bodies; 1 where it admits them as it is.
    pub widened: f64,
}

/// Belief in a positive drive parameter that neither file nor data state, SI: small beside any arm's.
const SMALL: f64 = 1e-3;
/// A confidence region this much beyond the nearest real robot, in χ², has room for a plausible one.
const ROOM: f64 = 2.0;

/// The most plausible robot that agrees with the data.
///
/// # Errors
/// Why there is none, in a sentence: no prior, a prior that no rigid body has, data that do not excite every parameter.
pub fn complete(found: &Identification, robot: &Robot) -> Result<Completion, String> {
    let structure = &found.structure;
    if found.columns != structure.base_model_columns() || !structure.extra.is_empty() {
        return Err("the log does not excite every base parameter".into());
    }
    let priors = robot.links().iter().map(|l| l.inertial.ok_or(&l.name));
    let priors: Vec<InertialParameters> = priors
        .collect::<Result<_, _>>()
        .map_err(|link| format!("no prior: the robot file states no inertial values for {link}"))?;
    let factor = factor_of_estimate(found).ok_or("the covariance of the estimate is singular")?;
    let links: Vec<LinkPrior> = (0..robot.n_joints())
        .map(|j| LinkPrior {
            columns: std::array::from_fn(|k| {
                column(structure, ParameterKind::INERTIAL[k], j).unwrap_or_default()
            }),
            prior: priors[j],
        })
        .collect();
    let positive = positive_priors(found, robot);
    let solve = |sigma: f64| -> Result<PhysicalEstimate, String> {
        let problem = PhysicalProblem {
            factor: &factor,
            sigma,
            regrouping: structure.reduction.regrouping.as_ref(),
            links: &links,
            positive: &positive,
        };
        physically_consistent(&problem, &ConsistencyOptions::default()).map_err(|e| e.to_string())
    };
    let mut widened = 1.0;
    let mut outcome = solve(widened)?;
    if outcome.most_plausible.is_none() {
        // The median of χ² is about its degrees of freedom.
        let freedom = found.columns.len() as f64;
        widened = (ROOM * outcome.closest.delta_chi_square / freedom)
            .sqrt()
            .max(1.0);
        outcome = solve(widened)?;
    }
    let plausible = outcome
        .most_plausible
        .ok_or("no robot of real bodies is near the data")?;
    Ok(Completion {
        sources: (0..robot.n_joints())
            .map(|j| sources(structure, j))
            .collect(),
        drives: (0..robot.n_joints())
            .map(|j| {
                [ParameterKind::Ia, ParameterKind::Fv, ParameterKind::Fc]
                    .map(|kind| Some(plausible.standard[column(structure, kind, j)?]))
            })
            .collect(),
        links: plausible.links,
        widened,
    })
}

/// Position of a parameter among all columns.
fn column(structure: &Structure, kind: ParameterKind, index: usize) -> Option<usize> {
    structure
        .columns
        .0
        .iter()
        .position(|p| p.kind == kind && p.index == index)
}

fn sources(structure: &Structure, link: usize) -> [Source; 10] {
    let r = &structure.reduction;
    std::array::from_fn(
        |k| match column(structure, ParameterKind::INERTIAL[k], link) {
            Some(c) if r.unidentifiable.contains(&c) => Source::Prior,
            Some(c) if r.identifiable_alone.contains(&c) => Source::Data,
            Some(_) => Source::Combination,
            None => Source::Prior,
        },
    )
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

/// What was believed of rotors and friction: the file's word, else the data's.
fn positive_priors(found: &Identification, robot: &Robot) -> Vec<PositivePrior> {
    let structure = &found.structure;
    let mut priors = Vec::new();
    for (c, p) in structure.columns.0.iter().enumerate() {
        let a = &robot.joints()[p.index].actuator;
        let stated = match p.kind {
            ParameterKind::Ia => a.rotor_inertia.zip(a.gear_ratio).map(|(i, g)| i * g * g),
            ParameterKind::Fv => a.viscous_friction,
            ParameterKind::Fc => a.coulomb_friction,
            _ => continue,
        };
        let base = structure.reduction.base.iter().position(|&b| b == c);
        let estimated = base.map(|b| found.values[b]);
        let prior = stated.or(estimated).filter(|v| *v > 0.0).unwrap_or(SMALL);
        priors.push(PositivePrior { column: c, prior });
    }
    priors
}
