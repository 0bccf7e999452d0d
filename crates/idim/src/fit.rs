//! Rows to an estimate: weighted, robust where asked for, and honest about what the rows do not determine.

use crate::columns::ModelColumns;
use crate::error::Error;
use crate::plan::SamplingPlan;
use crate::report_html::Spectrum;
use crate::result::{
    ConditionResult, DownWeightedResult, DroppedResult, EstimateResult, ParameterResult,
};
use crate::samples::{Rows, Stretch, push_rows};
use faer::Mat;
use idim_base_params::{ReductionOptions, TriangularFactor, reduce};
use idim_estimation::{
    EssentialOptions, Estimate, InformationFactor, PartialEstimate, PartialOptions, PartialRows,
    RobustLoss, Solution, SpanOptions, Weighting, down_weighted_spans, essential_parameters,
    partial_least_squares, solve,
};
use idim_model::Robot;
use std::fmt::Write as _;

/// How rows are weighted and what is kept.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EstimationOptions {
    /// Which part of the residual covariance weights the rows.
    pub weighting: Weighting,
    /// How outliers lose their say; `None`: they keep it.
    pub robust: Option<RobustLoss>,
    /// Keep only what the residual would miss.
    pub essential: bool,
}

/// An estimate in its columns.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) columns: ModelColumns,
    pub(crate) values: Vec<f64>,
    pub(crate) covariance: Mat<f64>,
    pub(crate) result: EstimateResult,
    pub(crate) warnings: Vec<String>,
    pub(crate) spectrum: Spectrum,
    /// Sum over the joints of the logarithm of the residual's standard deviation: smaller fits better.
    pub(crate) misfit: f64,
}

/// Half the width of a 95 % interval of the normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;

/// A fit of these columns to the stretches; of the combinations they excite where they do not excite all.
pub(crate) fn fit(
    robot: &Robot,
    columns: &ModelColumns,
    names: &[String],
    train: &[Stretch],
    plan: &SamplingPlan,
    options: &EstimationOptions,
) -> Result<Fit, Error> {
    let mut rows = Rows::default();
    for stretch in train {
        push_rows(&mut rows, robot, columns, stretch, plan)?;
    }
    let n = robot.n_joints();
    enough(&rows, columns.len(), n, train, plan)?;
    match solved(&rows, n, options)? {
        Some(solved) if options.essential => essential(&solved, columns, names, &rows, n, options),
        Some(solved) => Ok(solved.fit(columns.clone(), names, &rows, n)),
        None => excited(columns, names, &rows, n, options),
    }
}

/// Refuses rows that are fewer than the parameters, with what became of the samples.
fn enough(
    rows: &Rows,
    n_columns: usize,
    n_joints: usize,
    train: &[Stretch],
    plan: &SamplingPlan,
) -> Result<(), Error> {
    let used = rows.used.iter().filter(|u| **u).count();
    if used >= n_columns {
        return Ok(());
    }
    let samples: usize = train.iter().map(|s| s.states.n_samples()).sum();
    let kept = rows.y.len() / n_joints;
    let mut logs: Vec<&str> = train.iter().map(|s| s.file.as_str()).collect();
    logs.dedup();
    let rate = match plan.parallel {
        Some(_) => "a higher --rate or --cutoff keeps more of them, ",
        None => "",
    };
    let slow = if used < rows.y.len() {
        "a smaller --dead-band keeps slower ones, "
    } else {
        ""
    };
    Err(Error::input(
        logs.join(" + "),
        format!(
            "{used} rows for {n_columns} parameters: {samples} samples in {} stretches, {kept} of them after the parallel decimation ({n_joints} rows each), {} rows left out as too slow or saturated",
            train.len(),
            rows.y.len() - used
        ),
        format!("a fit needs more rows than parameters; {rate}{slow}or record a longer motion"),
    ))
}

/// A fit of all columns, and how it was made.
struct Solved {
    weighted: Option<PartialEstimate>,
    estimate: Estimate,
    deviation: Vec<f64>,
    covariance: Mat<f64>,
    condition: ConditionResult,
    spectrum: Spectrum,
    method: String,
    misfit: f64,
}

/// Weighted by the noise of the joints; by each joint's own where the joints' residuals are not independent witnesses;
/// ordinary where a joint is fitted exactly. `None` where the columns are dependent.
fn solved(rows: &Rows, n: usize, options: &EstimationOptions) -> Result<Option<Solved>, Error> {
    let partial = PartialRows {
        w: &rows.w,
        y: &rows.y,
        used: &rows.used,
        n_joints: n,
    };
    let factor = factor_of_used(rows, n)?;
    let spectrum = Spectrum::of_factor(&factor);
    for weighting in [options.weighting, Weighting::Diagonal] {
        let with = PartialOptions {
            weighting,
            loss: options.robust,
            ..PartialOptions::default()
        };
        match partial_least_squares(&partial, &with) {
            Ok(Ok(fit)) => return Ok(Some(Solved::weighted(fit, weighting, options, spectrum))),
            Ok(Err(_)) | Err(idim_estimation::Error::NotPositiveDefinite { .. }) => {}
            Err(error) => return Err(error.into()),
        }
    }
    let Solution::Determined(estimate) = solve(&factor)? else {
        return Ok(None);
    };
    Ok(Some(Solved {
        condition: ConditionResult {
            raw: Some(estimate.condition_number.raw),
            equilibrated: Some(estimate.condition_number.equilibrated),
            weighted: None,
        },
        misfit: n as f64 * estimate.sigma.ln(),
        deviation: estimate.standard_deviation.clone(),
        covariance: estimate.covariance.clone(),
        estimate,
        method: "ordinary least squares: a joint without residual has no weight".into(),
        weighted: None,
        spectrum,
    }))
}

pub(crate) fn factor_of_used(rows: &Rows, n: usize) -> Result<InformationFactor, Error> {
    let p = rows.w.len().checked_div(rows.y.len()).unwrap_or(0);
    debug_assert_eq!(rows.y.len() % n, 0);
    let mut factor = InformationFactor::new(p);
    for (row, &used) in rows.used.iter().enumerate() {
        if used {
            factor.push_rows(&rows.w[row * p..][..p], &[rows.y[row]])?;
        }
    }
    Ok(factor)
}

impl Solved {
    fn weighted(
        fit: PartialEstimate,
        weighting: Weighting,
        options: &EstimationOptions,
        spectrum: Spectrum,
    ) -> Self {
        let noise = fit.noise.standard_deviation();
        let what = match weighting {
            Weighting::Full => "the joints' residual covariance",
            Weighting::Diagonal => "one variance a joint",
        };
        let robust = match options.robust {
            None => "",
            Some(RobustLoss::Huber { .. }) => ", Huber weights",
            Some(RobustLoss::Tukey { .. }) => ", Tukey weights",
        };
        let end = if fit.converged { "" } else { ", not converged" };
        Self {
            condition: ConditionResult {
                raw: Some(fit.ordinary.condition_number.raw),
                equilibrated: Some(fit.ordinary.condition_number.equilibrated),
                weighted: Some(fit.estimate.condition_number.raw),
            },
            estimate: fit.estimate.clone(),
            deviation: fit.standard_deviation.clone(),
            covariance: fit.covariance.clone(),
            method: format!(
                "weighted least squares, {what}{robust}, iterated{end}; std from blocks of {} samples where larger",
                fit.block_samples
            ),
            misfit: noise.iter().map(|s| s.ln()).sum(),
            spectrum,
            weighted: Some(fit),
        }
    }

    fn fit(&self, columns: ModelColumns, names: &[String], rows: &Rows, n: usize) -> Fit {
        let finite = |x: f64| x.is_finite().then_some(x);
        let values = &self.estimate.values;
        let parameter = |(k, name): (usize, &String)| ParameterResult {
            name: name.clone(),
            value: Some(values[k]),
            std: finite(self.deviation[k]),
            relative_std: finite(self.deviation[k] / values[k].abs()),
        };
        Fit {
            columns,
            values: values.clone(),
            covariance: self.covariance.clone(),
            result: EstimateResult {
                method: self.method.clone(),
                parameters: names.iter().enumerate().map(parameter).collect(),
                condition_number: self.condition,
                dropped: Vec::new(),
                down_weighted: self.down_weighted(rows, n),
            },
            warnings: Vec::new(),
            spectrum: self.spectrum.clone(),
            misfit: self.misfit,
        }
    }

    /// The spans that a robust loss took the say from.
    fn down_weighted(&self, rows: &Rows, n: usize) -> Vec<DownWeightedResult> {
        let Some(weighted) = &self.weighted else {
            return Vec::new();
        };
        // Rows left out by a dead band did not lose their say: they never had one.
        let weights: Vec<f64> = weighted
            .weights
            .iter()
            .zip(&rows.used)
            .map(|(&w, &used)| if used { w } else { 1.0 })
            .collect();
        down_weighted_spans(&weights, n, &SpanOptions::default())
            .into_iter()
            .map(|s| DownWeightedResult {
                log: rows.at[s.first].0.clone(),
                from: rows.at[s.first].1,
                to: rows.at[s.last].1,
                joints: s.joints.iter().map(|j| j + 1).collect(),
                lowest_weight: s.lowest_weight,
            })
            .collect()
    }
}

/// Only the parameters that the residual would miss; the others are listed with their interval.
fn essential(
    full: &Solved,
    columns: &ModelColumns,
    names: &[String],
    rows: &Rows,
    n: usize,
    options: &EstimationOptions,
) -> Result<Fit, Error> {
    let all = |reason: &str| {
        let mut fit = full.fit(columns.clone(), names, rows, n);
        fit.warnings.push(format!("all parameters kept: {reason}"));
        fit
    };
    let Some(weighted) = &full.weighted else {
        return Ok(all(
            "without weights there is no test of what the residual misses",
        ));
    };
    let Ok(kept) = essential_parameters(&weighted.factor, &EssentialOptions::default())? else {
        return Ok(all("the rows determine no fewer"));
    };
    let reduced = only(rows, names.len(), &kept.kept);
    let Some(solved) = solved(&reduced, n, options)? else {
        return Ok(all("the rest is not determined"));
    };
    let kept_names: Vec<String> = kept.kept.iter().map(|&k| names[k].clone()).collect();
    let mut fit = solved.fit(columns.select(&kept.kept), &kept_names, &reduced, n);
    fit.result.dropped = kept
        .dropped
        .iter()
        .map(|d| {
            let (value, width) = (d.value, NORMAL_95 * full.deviation[d.column]);
            DroppedResult {
                name: names[d.column].clone(),
                value,
                low: value - width,
                high: value + width,
                relative_std: Some(d.relative_std).filter(|r| r.is_finite()),
            }
        })
        .collect();
    let _ = write!(
        fit.result.method,
        "; {} essential parameters of {}, F = {:.2} below {:.2}",
        kept.kept.len(),
        names.len(),
        kept.f_statistic,
        kept.f_limit,
    );
    Ok(fit)
}

/// The rows with these columns alone.
pub(crate) fn only(rows: &Rows, p: usize, kept: &[usize]) -> Rows {
    let mut w = Vec::with_capacity(rows.y.len() * kept.len());
    for row in rows.w.chunks_exact(p) {
        w.extend(kept.iter().map(|&k| row[k]));
    }
    Rows {
        w,
        y: rows.y.clone(),
        used: rows.used.clone(),
        at: rows.at.clone(),
    }
}

/// The log does not excite every base parameter: estimate what it does, and say what it does not.
fn excited(
    columns: &ModelColumns,
    names: &[String],
    rows: &Rows,
    n: usize,
    options: &EstimationOptions,
) -> Result<Fit, Error> {
    let p = columns.len();
    let mut factor = TriangularFactor::new(p);
    for (row, &used) in rows.w.chunks_exact(p).zip(&rows.used) {
        if used {
            factor.push_rows(row);
        }
    }
    let order: Vec<usize> = (0..p).collect();
    let reduction = reduce(&factor, &order, &ReductionOptions::default());
    let kept = &reduction.base;
    let excited_names = reduction.base_names(names);
    let warning = format!(
        "this log excites only {} of {} base parameters; not determined on their own: {}. Move every joint, faster and in more directions, or hold still joints with --lock",
        kept.len(),
        p,
        (0..p)
            .filter(|k| !reduction.identifiable_alone.contains(k))
            .map(|k| names[k].as_str())
            .collect::<Vec<_>>()
            .join(", "),
    );
    let reduced = only(rows, p, kept);
    let Some(solved) = solved(&reduced, n, options)? else {
        return Err(Error::input(
            "estimate",
            format!(
                "rank below {} after reduction to what the log excites",
                kept.len()
            ),
            "record a motion that moves every joint",
        ));
    };
    let mut fit = solved.fit(columns.select(kept), &excited_names, &reduced, n);
    fit.warnings.push(warning);
    Ok(fit)
}
