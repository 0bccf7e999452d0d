//! A load on an arm that is known: its ten parameters, with the arm's own uncertainty carried over.

use crate::columns::ModelColumns;
use crate::error::Error;
use crate::fit::EstimationOptions;
use crate::identify::Identification;
use crate::load::LoadedRobot;
use crate::samples::{Rows, push_rows, stretches};
use crate::structure::MASS_FIRST;
use faer::Mat;
use idim_base_params::{ReductionOptions, TriangularFactor, reduce};
use idim_estimation::{PartialOptions, PartialRows, partial_least_squares, whitened_factor};
use idim_measurement::Measurements;
use idim_model::{Columns, Notation, Parameter, Robot};

/// What a load is, in the frame of the link that carries it.
#[derive(Debug, Clone)]
pub struct Payload {
    /// Names of the parameters, with an R where others are regrouped into them.
    pub names: Vec<String>,
    /// Relations of the regrouped ones, as people write them.
    pub relations: Vec<String>,
    /// Their values, SI.
    pub values: Vec<f64>,
    /// Standard deviations: the noise of the loaded runs and the uncertainty of the arm.
    pub standard_deviation: Vec<f64>,
    /// The part of them that the arm's uncertainty makes.
    pub from_arm: Vec<f64>,
    /// Whole covariance.
    pub covariance: Mat<f64>,
    /// Standard deviation of each joint's residual, N·m.
    pub noise: Vec<f64>,
}

/// The load on `link` that explains what the arm as identified leaves of the torques of these logs.
///
/// With `x = G (y - W β̂)` the covariance is that of the noise plus `G W C_β Wᵀ Gᵀ`: the arm is frozen, but not believed
/// blindly. Conditioned as the arm's logs were, weighted as `estimation` says.
///
/// # Errors
/// Logs that cannot be conditioned, or that do not excite any parameter of the load.
pub fn identify_payload(
    loaded: &LoadedRobot,
    arm: &Identification,
    logs: &[Measurements],
    link: usize,
    estimation: &EstimationOptions,
) -> Result<Payload, Error> {
    let robot = &loaded.robot;
    let n = robot.n_joints();
    let load = load_columns(link);
    let (of_arm, of_load) = both(robot, arm, &load, logs)?;
    let (p, l) = (arm.values.len(), load.len());
    let left: Vec<f64> = of_arm
        .y
        .iter()
        .zip(of_arm.w.chunks_exact(p))
        .map(|(y, w)| y - w.iter().zip(&arm.values).map(|(w, x)| w * x).sum::<f64>())
        .collect();
    let mut factor = TriangularFactor::new(l);
    for (row, &used) in of_load.w.chunks_exact(l).zip(&of_load.used) {
        if used {
            factor.push_rows(row);
        }
    }
    let order: Vec<usize> = (0..l).collect();
    let reduction = reduce(&factor, &order, &ReductionOptions::default());
    let kept = &reduction.base;
    let names = load.names(Notation::Gautier);
    let w: Vec<f64> = of_load
        .w
        .chunks_exact(l)
        .flat_map(|row| kept.iter().map(|&k| row[k]))
        .collect();
    let rows = PartialRows {
        w: &w,
        y: &left,
        used: &of_load.used,
        n_joints: n,
    };
    let options = PartialOptions {
        weighting: estimation.weighting,
        loss: estimation.robust,
        ..PartialOptions::default()
    };
    let Ok(fit) = partial_least_squares(&rows, &options)? else {
        return Err(Error::input(
            "payload",
            "the loaded logs determine no parameter of it",
            "record a motion that tilts and turns the loaded link",
        ));
    };
    // Whitened [load | arm]: R = [R1 S; 0 R2] and G W = R1⁻¹ S.
    let k = kept.len();
    let together: Vec<f64> = w
        .chunks_exact(k)
        .zip(of_arm.w.chunks_exact(p))
        .flat_map(|(a, b)| a.iter().chain(b).copied())
        .collect();
    let both = PartialRows {
        w: &together,
        ..rows
    };
    let parts = whitened_factor(&both, &fit.noise, &fit.weights)?.parts();
    let mut gain = Mat::<f64>::zeros(k, p);
    for column in 0..p {
        for i in (0..k).rev() {
            let inner: f64 = (i + 1..k)
                .map(|m| parts.r[(i, m)] * gain[(m, column)])
                .sum();
            gain[(i, column)] = (parts.r[(i, k + column)] - inner) / parts.r[(i, i)];
        }
    }
    let carried = &gain * &arm.covariance * gain.transpose();
    let covariance = &fit.covariance + &carried;
    Ok(Payload {
        names: reduction.base_names(&names),
        relations: (0..k).map(|i| reduction.relation(i, &names)).collect(),
        values: fit.estimate.values.clone(),
        standard_deviation: (0..k).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect(),
        from_arm: (0..k).map(|i| carried[(i, i)].max(0.0).sqrt()).collect(),
        covariance,
        noise: fit.noise.standard_deviation(),
    })
}

/// The ten columns of a load on a link, mass first.
pub(crate) fn load_columns(link: usize) -> ModelColumns {
    ModelColumns {
        standard: Columns(
            MASS_FIRST
                .map(|kind| Parameter { kind, index: link })
                .to_vec(),
        ),
        extra: Vec::new(),
    }
}

/// Rows of the arm's columns and of the load's over the same samples.
pub(crate) fn both(
    robot: &Robot,
    arm: &Identification,
    load: &ModelColumns,
    logs: &[Measurements],
) -> Result<(Rows, Rows), Error> {
    let (mut of_arm, mut of_load) = (Rows::default(), Rows::default());
    for log in logs {
        for mut stretch in stretches(log, &arm.plan)? {
            if let Some(load) = &arm.load {
                load.know(robot, &mut stretch);
            }
            push_rows(&mut of_arm, robot, &arm.columns, &stretch, &arm.plan)?;
            push_rows(&mut of_load, robot, load, &stretch, &arm.plan)?;
        }
    }
    Ok((of_arm, of_load))
}
