//! The cutoff of the low-pass by what it predicts: held-out error over the cutoff, on the same samples.

use crate::choice::first_reversals;
use crate::columns::ModelColumns;
use crate::error::Error;
use crate::friction::FrictionChoice;
use crate::held_out::{BlockErrors, Reference, first_within_one_error};
use crate::identify::IdentifyOptions;
use crate::plan::{Motion, SamplingPlan};
use crate::result::HeldOutChoice;
use crate::samples::{ORDER, Rows, all_stretches, push_rows};
use crate::structure::Structure;
use idim_measurement::{Measurements, butterworth, settling};
use idim_model::{Columns, DriveColumns, Robot};

/// How the logs become samples, and the curve it was chosen from.
pub(crate) struct Sampling {
    pub(crate) plan: SamplingPlan,
    pub(crate) cutoff: Option<HeldOutChoice>,
}

/// Cutoffs tried, as powers of √2 of one far above the motion: from 5 to 80 bandwidths.
const HALF_OCTAVES: std::ops::RangeInclusive<i32> = -4..=4;
/// Share of the shortest log that the slowest low-pass may leave out at its ends.
const EDGE_SHARE: f64 = 0.2;
/// Words of the rule.
const RULE: &str = "whose error on held-out blocks is within one standard error of the least";

/// Chooses what the options leave open.
///
/// All candidates predict the same samples of the torque, seen through the same low-pass: that of the plan. The lowest is taken
/// whose error is within one standard error of the least.
pub(crate) fn choose_sampling(
    robot: &Robot,
    training: &[Measurements],
    plan: SamplingPlan,
    options: &IdentifyOptions,
) -> Result<Sampling, Error> {
    let mut sampling = Sampling { plan, cutoff: None };
    let Some(motion) = sampling.plan.motion else {
        return Ok(sampling);
    };
    let columns = columns(robot, options)?;
    if options.sampling.cutoff.is_none() {
        sampling.choose_cutoff(robot, &columns, training, motion, options)?;
    }
    Ok(sampling)
}

/// The base columns with the friction that a fit begins with.
fn columns(robot: &Robot, options: &IdentifyOptions) -> Result<ModelColumns, Error> {
    let drive = match options.friction {
        FrictionChoice::Plain => options.columns,
        FrictionChoice::Auto | FrictionChoice::Fixed(_) => DriveColumns {
            rotor: options.columns.rotor,
            ..DriveColumns::ALL
        },
    };
    let standard = Columns::standard(robot.n_joints(), drive);
    Ok(Structure::of_drives(robot, standard)
        .decided()?
        .base_model_columns())
}

impl Sampling {
    fn choose_cutoff(
        &mut self,
        robot: &Robot,
        columns: &ModelColumns,
        training: &[Measurements],
        motion: Motion,
        options: &IdentifyOptions,
    ) -> Result<(), Error> {
        let far = motion.far_cutoff();
        let settled =
            |cutoff: f64| settling(&butterworth(ORDER, cutoff, motion.rate)) as f64 / motion.rate;
        let tried: Vec<f64> = HALF_OCTAVES
            .map(|k| far * std::f64::consts::SQRT_2.powi(k))
            .filter(|&c| c <= motion.highest_cutoff() * (1.0 + 1e-9))
            .filter(|&c| 2.0 * settled(c) <= EDGE_SHARE * motion.shortest)
            .collect();
        if tried.len() < 2 {
            return Ok(());
        }
        let rows_at = |cutoff: f64| {
            let plan = SamplingPlan {
                cutoff: Some(cutoff),
                trim: Some(settled(tried[0])),
                reversal: first_reversals(robot),
                ..self.plan.clone()
            };
            let mut rows = Rows::default();
            for stretch in &all_stretches(training, &plan)? {
                push_rows(&mut rows, robot, columns, stretch, &plan)?;
            }
            Ok::<Rows, Error>(rows)
        };
        let judge = rows_at(far)?;
        let Some(reference) = Reference::new(&judge, robot.n_joints())? else {
            return Ok(());
        };
        let mut errors: Vec<Option<BlockErrors>> = Vec::new();
        for &cutoff in &tried {
            errors.push(reference.errors(&rows_at(cutoff)?)?);
        }
        let Some((first, least)) = first_within_one_error(&errors) else {
            return Ok(());
        };
        let choice = chosen(&reference, &tried, &errors, first);
        let why = format!(
            "the lowest of {} from {:.2} to {:.2} Hz {RULE} (at {:.2} Hz)",
            tried.len(),
            tried[0],
            tried[tried.len() - 1],
            tried[least],
        );
        self.plan = self.plan.with_cutoff(tried[first], &why, &options.sampling);
        self.cutoff = Some(choice);
        Ok(())
    }
}

fn chosen(
    reference: &Reference,
    tried: &[f64],
    errors: &[Option<BlockErrors>],
    first: usize,
) -> HeldOutChoice {
    let relative = |e: &Option<BlockErrors>| e.as_ref().map(|e| reference.relative(e));
    HeldOutChoice {
        tried: tried.to_vec(),
        held_out_error: errors.iter().map(relative).collect(),
        chosen: tried[first],
    }
}
