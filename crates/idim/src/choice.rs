//! Which columns a run is to have: the structure, its friction, and the fit of both.

use crate::columns::{ExtraColumn, ModelColumns, reversal_of};
use crate::error::Error;
use crate::fit::{Fit, fit};
use crate::friction::{self, Chosen, FrictionChoice, JointFriction, friction_of};
use crate::identify::{IdentifyOptions, joint_names};
use crate::plan::SamplingPlan;
use crate::predictor::bodies;
use crate::samples::{Stretch, rigid_torque};
use crate::structure::Structure;
use idim_model::{Columns, DriveColumns, ParameterKind, Robot};

/// A structure, its fit, and how its friction was chosen.
pub(crate) struct Found {
    pub(crate) structure: Structure,
    pub(crate) plan: SamplingPlan,
    pub(crate) fit: Fit,
    pub(crate) chosen: Vec<Chosen>,
    pub(crate) load: Option<LoadModel>,
}

/// The columns the options ask for, or that held-out blocks choose, and their fit.
pub(crate) fn find(
    robot: &Robot,
    train: &mut [Stretch],
    plan: SamplingPlan,
    options: &IdentifyOptions,
) -> Result<Found, Error> {
    let wanted = match &options.friction {
        FrictionChoice::Plain => return find_plain(robot, train, plan, options),
        FrictionChoice::Auto => vec![JointFriction::classic(); robot.n_joints()],
        FrictionChoice::Fixed(fixed) => friction_of(robot, fixed).map_err(|joint| {
            Error::input(
                format!("--friction {joint}="),
                "no such joint",
                format!("the joints are {}", joint_names(robot).join(", ")),
            )
        })?,
    };
    let auto = options.friction == FrictionChoice::Auto;
    // Loads are those of a first fit with classic friction.
    let classic = vec![JointFriction::classic(); robot.n_joints()];
    let (all, names) = with_friction(robot, options.columns.rotor, &classic)?;
    let first_plan = plan.with_reversal(first_reversals(robot), "to begin with");
    let first = fit(robot, &all, &names, train, &first_plan, &options.estimation)?;
    let load = LoadModel {
        columns: first.columns,
        values: first.values,
    };
    for stretch in train.iter_mut() {
        load.know(robot, stretch);
    }
    let shared = without_friction(&all);
    let chosen = friction::search(robot, &shared, train, &first_plan, &wanted, auto)?;
    let frictions: Vec<JointFriction> = chosen.iter().map(|c| c.friction.clone()).collect();
    let reversal = frictions
        .iter()
        .map(|f| f.reversal.unwrap_or(0.0))
        .collect();
    let plan = plan.with_reversal(reversal, "of each joint, by held-out blocks or as stated");
    let (columns, names) = with_friction(robot, options.columns.rotor, &frictions)?;
    let found = fit(robot, &columns, &names, train, &plan, &options.estimation)?;
    Ok(Found {
        structure: structure(robot, options.columns.rotor, &frictions)?,
        plan,
        fit: found,
        load: has_load(&columns).then_some(load),
        chosen: if auto || chosen.iter().any(|c| c.tried.len() > 1) {
            chosen
        } else {
            Vec::new()
        },
    })
}

/// Speeds (rad/s) over which the Coulomb torque may change sign: from hardly smoothed to that of a noisy velocity.
const REVERSAL_SPEEDS: [f64; 3] = [0.001, 0.005, 0.02];

/// Speed of reversal of a first fit, rad/s.
const FIRST_REVERSAL: f64 = 0.005;

/// Speed of reversal of each joint, rad/s (m/s), of a first fit.
pub(crate) fn first_reversals(robot: &Robot) -> Vec<f64> {
    let joints = 0..robot.n_joints();
    joints
        .map(|j| reversal_of(robot, j, FIRST_REVERSAL))
        .collect()
}

/// The drive columns asked for, and the smoothing of the Coulomb torque that fits the training data best.
fn find_plain(
    robot: &Robot,
    train: &[Stretch],
    plan: SamplingPlan,
    options: &IdentifyOptions,
) -> Result<Found, Error> {
    let standard = Columns::standard(robot.n_joints(), options.columns);
    let structure = Structure::of_drives(robot, standard).decided()?;
    let (columns, names) = (structure.base_model_columns(), structure.base_names());
    let fitted =
        |plan: &SamplingPlan| fit(robot, &columns, &names, train, plan, &options.estimation);
    let (plan, fit) = if options.sampling.as_recorded || !options.columns.coulomb {
        let fit = fitted(&plan)?;
        (plan, fit)
    } else {
        let mut best: Option<(SamplingPlan, Fit)> = None;
        for speed in REVERSAL_SPEEDS {
            let speeds = (0..robot.n_joints()).map(|j| reversal_of(robot, j, speed));
            let why = "the smoothing that fits the training data best";
            let plan = plan.with_reversal(speeds.collect(), why);
            let fit = fitted(&plan)?;
            if best.as_ref().is_none_or(|(_, b)| fit.misfit < b.misfit) {
                best = Some((plan, fit));
            }
        }
        best.ok_or_else(|| Error::input("estimate", "no fit", "a defect of this program"))?
    };
    Ok(Found {
        structure,
        plan,
        fit,
        chosen: Vec::new(),
        load: None,
    })
}

/// The structure with these joints' viscous, Coulomb and offset columns.
fn structure(robot: &Robot, rotor: bool, frictions: &[JointFriction]) -> Result<Structure, Error> {
    let all = Columns::standard(
        robot.n_joints(),
        DriveColumns {
            rotor,
            ..DriveColumns::ALL
        },
    );
    let wanted = all.0.into_iter().filter(|p| match p.kind {
        ParameterKind::Fv => frictions[p.index].viscous,
        ParameterKind::Fc => frictions[p.index].coulomb,
        ParameterKind::Offset => frictions[p.index].offset,
        _ => true,
    });
    Structure::of_drives(robot, Columns(wanted.collect())).decided()
}

/// The base columns and names with the joints' friction; terms beside the classic ones stand last, each on its own.
fn with_friction(
    robot: &Robot,
    rotor: bool,
    frictions: &[JointFriction],
) -> Result<(ModelColumns, Vec<String>), Error> {
    let structure = structure(robot, rotor, frictions)?;
    let (mut columns, mut names) = (structure.base_model_columns(), structure.base_names());
    for (joint, friction) in frictions.iter().enumerate() {
        for &term in &friction.terms {
            let column = ExtraColumn::Friction { joint, term };
            names.push(column.name());
            columns.extra.push(column);
        }
    }
    Ok((columns, names))
}

/// The columns that are nobody's friction but a motor's.
fn without_friction(columns: &ModelColumns) -> ModelColumns {
    use ParameterKind::{Fc, Fv, Offset};
    let standard = columns.standard.0.iter().copied();
    ModelColumns {
        standard: Columns(
            standard
                .filter(|p| ![Fv, Fc, Offset].contains(&p.kind))
                .collect(),
        ),
        extra: columns
            .extra
            .iter()
            .filter(|e| !matches!(e, ExtraColumn::Friction { .. }))
            .cloned()
            .collect(),
    }
}

fn has_load(columns: &ModelColumns) -> bool {
    let load = |e: &ExtraColumn| {
        let term = crate::columns::FrictionTerm::Load;
        matches!(e, ExtraColumn::Friction { term: t, .. } if *t == term)
    };
    columns.extra.iter().any(load)
}

/// The fit with classic friction whose rigid body loads the gears: kept as it is, so that the model stays linear.
#[derive(Debug, Clone)]
pub(crate) struct LoadModel {
    columns: ModelColumns,
    values: Vec<f64>,
}

impl LoadModel {
    /// The rigid body's torque on a stretch.
    pub(crate) fn know(&self, robot: &Robot, stretch: &mut Stretch) {
        stretch.load = Some(rigid_torque(robot, &self.columns, &self.values, stretch));
    }

    /// The ten of each link of that rigid body, for a predictor.
    pub(crate) fn bodies(&self, n_links: usize) -> Vec<[f64; 10]> {
        bodies(n_links, &self.columns.standard, &self.values)
    }
}
