//! `parameters.yaml`: base parameters with relations and uncertainty, drives, and completed links.

use super::completion::{Completion, DRIVE_KINDS, Source};
use crate::identify::Identification;
use crate::meaning::parameter_unit;
use idim_model::{Notation, ParameterKind, Robot};
use serde::Serialize;

/// Name of the schema.
const SCHEMA: &str = "idim-parameters/1";

#[derive(Serialize)]
struct File<'a> {
    schema: &'a str,
    version: &'a str,
    robot: &'a str,
    gravity: [f64; 3],
    base_parameters: Vec<Base<'a>>,
    joints: Vec<Drive<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    extra_parameters: Vec<Extra>,
    completed: Completed<'a>,
}

#[derive(Serialize)]
struct Base<'a> {
    name: &'a str,
    relation: &'a str,
    value: Option<f64>,
    std: Option<f64>,
    unit: &'a str,
}

/// A joint's drive, at the joint; absent where the model has no such parameter or regroups it.
#[derive(Serialize)]
struct Drive<'a> {
    joint: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    rotor_inertia: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    viscous_friction: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    coulomb_friction: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    offset: Option<f64>,
    /// The Coulomb torque is `tanh(q̇ / reversal_speed)`; 0 is the sign itself.
    reversal_speed: f64,
}

/// A parameter beside those of bodies and joints: of coupled motors, known torques, further friction.
#[derive(Serialize)]
struct Extra {
    name: String,
    value: f64,
    std: f64,
    unit: &'static str,
    meaning: String,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Completed<'a> {
    Links {
        uncertainty_widened: f64,
        links: Vec<Link<'a>>,
        drives: Vec<Sourced>,
        #[serde(skip_serializing_if = "Vec::is_empty")]
        extra: Vec<Sourced>,
    },
    Not {
        none_because: &'a str,
    },
}

#[derive(Serialize)]
struct Link<'a> {
    link: &'a str,
    parameters: Vec<Sourced>,
}

#[derive(Serialize)]
struct Sourced {
    name: String,
    value: f64,
    source: &'static str,
}

pub(super) fn parameters_yaml(
    found: &Identification,
    robot: &Robot,
    completion: Result<&Completion, &String>,
) -> String {
    let r = &found.result;
    let estimated = r.estimate.as_ref().map_or(&[][..], |e| &e.parameters);
    let relation = |name: &str| {
        let base = r.reduction.base.iter().find(|b| b.name == name);
        base.map_or("", |b| b.relation.as_str())
    };
    let base = estimated.iter().map(|p| Base {
        name: &p.name,
        relation: relation(&p.name),
        value: p.value,
        std: p.std,
        unit: parameter_unit(&p.name, robot),
    });
    let completed = match completion {
        Ok(c) => Completed::Links {
            uncertainty_widened: c.widened,
            links: (0..robot.n_joints()).map(|j| link(robot, c, j)).collect(),
            drives: completed_drives(c),
            extra: c
                .extra
                .iter()
                .map(|(column, value, source)| sourced(column.name(), *value, *source))
                .collect(),
        },
        Err(why) => Completed::Not { none_because: why },
    };
    let file = File {
        schema: SCHEMA,
        version: r.version,
        robot: &r.robot,
        gravity: robot.gravity().into(),
        base_parameters: base.collect(),
        joints: (0..robot.n_joints())
            .map(|j| drive(found, robot, j))
            .collect(),
        extra_parameters: extra_parameters(found, robot),
        completed,
    };
    serde_saphyr::to_string(&file).expect("plain structs of numbers and strings have a YAML form")
}

fn drive<'a>(found: &Identification, robot: &'a Robot, joint: usize) -> Drive<'a> {
    let all = found.columns.standard.0.iter().zip(&found.values);
    let value = |kind| {
        let mut own = all
            .clone()
            .filter(|(p, _)| p.kind == kind && p.index == joint);
        own.next().map(|(_, v)| *v)
    };
    Drive {
        joint: &robot.joints()[joint].name,
        rotor_inertia: value(ParameterKind::Ia),
        viscous_friction: value(ParameterKind::Fv),
        coulomb_friction: value(ParameterKind::Fc),
        offset: value(ParameterKind::Offset),
        reversal_speed: found.reversal.get(joint).copied().unwrap_or(0.0),
    }
}

fn extra_parameters(found: &Identification, robot: &Robot) -> Vec<Extra> {
    let first = found.columns.standard.len();
    let all = found.columns.extra.iter().enumerate();
    all.map(|(k, column)| {
        let (name, k) = (column.name(), first + k);
        Extra {
            value: found.values[k],
            std: found.covariance[(k, k)].sqrt(),
            unit: parameter_unit(&name, robot),
            meaning: column.meaning(robot),
            name,
        }
    })
    .collect()
}

fn completed_drives(c: &Completion) -> Vec<Sourced> {
    let joints = c.drives.iter().enumerate();
    let all = joints.flat_map(|(index, drives)| {
        DRIVE_KINDS
            .iter()
            .zip(drives)
            .filter_map(move |(&kind, value)| {
                let name = idim_model::Parameter { kind, index }.name(Notation::Gautier);
                value.map(|(value, source)| sourced(name, value, source))
            })
    });
    all.collect()
}

fn sourced(name: String, value: f64, source: Source) -> Sourced {
    Sourced {
        name,
        value,
        source: source.word(),
    }
}

fn link<'a>(robot: &'a Robot, c: &Completion, j: usize) -> Link<'a> {
    let ten = ParameterKind::INERTIAL.iter().enumerate();
    Link {
        link: &robot.links()[j].name,
        parameters: ten
            .map(|(k, kind)| sourced(format!("{kind:?}"), c.links[j].0[k], c.sources[j][k]))
            .collect(),
    }
}
