//! Points for the energy model as the paper finds them: substitutions, Powell's method, random starts.

use crate::criterion::Criterion;
use crate::point_rows::PointRows;
use crate::powell::{PowellOptions, powell};
use crate::{Conditioning, EnergyDesign, Scaling, dense, padded};
use idim_model::JointStates;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// How points are searched for with Powell's method.
#[derive(Debug, Clone, PartialEq)]
pub struct PowellPointOptions {
    /// Rows `r`: one fewer than points. At least the number of base columns; the paper takes twice as many.
    pub n_rows: usize,
    /// What is lowered. The paper found that the Frobenius condition of `WᵀW` converges best.
    pub criterion: Criterion,
    /// Random starts, `x ~ N(0, 1)`. Typical 8.
    pub n_starts: usize,
    /// Seed of the starts.
    pub seed: u64,
    /// One run of the method.
    pub powell: PowellOptions,
}

/// Points found and how good they are.
#[derive(Debug, Clone, PartialEq)]
pub struct PointDesign {
    /// `r + 1` points; accelerations are zero and mean nothing.
    pub points: JointStates,
    /// Every criterion of the chain.
    pub conditioning: Conditioning,
    /// Value of the criterion after every start of Powell's method, in their order; of the best few of a search, best
    /// first.
    pub values: Vec<f64>,
    /// 2-norm condition number (raw) before every start.
    pub initial_conditions: Vec<f64>,
    /// Evaluations over all starts.
    pub n_evaluations: usize,
}

/// Lowers a criterion over chained points from random starts; the best start wins.
///
/// Same points for the same seed, whatever the number of threads.
/// Source: Gautier & Khalil 1991, section 4; Powell 1964.
///
/// # Panics
/// If there are no starts or fewer rows than base columns.
#[track_caller]
pub fn optimise_points_powell(design: &EnergyDesign, options: &PowellPointOptions) -> PointDesign {
    assert!(options.n_starts > 0, "no start to search from");
    assert!(
        options.n_rows >= design.n_columns(),
        "{} rows cannot determine {} columns",
        options.n_rows,
        design.n_columns()
    );
    let runs: Vec<Run> = (0..options.n_starts)
        .into_par_iter()
        .map(|start| Run::new(design, options, start as u64))
        .collect();
    // The first of the best: ties do not depend on the order of the threads.
    let mut best = &runs[0];
    for run in &runs[1..] {
        if run.value < best.value {
            best = run;
        }
    }
    let mut values = vec![0.0; best.x.len()];
    design.substitute(&best.x, &mut values);
    let points = design.points_of(&values, &mut ChaCha8Rng::seed_from_u64(options.seed));
    PointDesign {
        conditioning: design.conditioning(&points),
        points,
        values: runs.iter().map(|r| r.value).collect(),
        initial_conditions: runs.iter().map(|r| r.initial_condition).collect(),
        n_evaluations: runs.iter().map(|r| r.n_evaluations).sum(),
    }
}

/// One start.
struct Run {
    x: Vec<f64>,
    value: f64,
    initial_condition: f64,
    n_evaluations: usize,
}

impl Run {
    fn new(design: &EnergyDesign, options: &PowellPointOptions, start: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        rng.set_stream(start);
        let mut objective = PowellObjective::new(design, options.n_rows, options.criterion);
        let n = (options.n_rows + 1) * design.n_variables();
        // A start whose W is rank deficient to rounding is drawn again.
        let x = loop {
            let x: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
            if objective.log_value(&x).is_finite() {
                break x;
            }
        };
        let initial_condition = Criterion::TwoNorm(Scaling::Raw)
            .evaluate(objective.rows.matrix().as_ref(), options.n_rows);
        let outcome = powell(|x| objective.log_value(x), &x, &options.powell);
        Self {
            value: options.criterion.value_of_logarithm(outcome.value),
            x: outcome.x,
            initial_condition,
            n_evaluations: outcome.n_evaluations,
        }
    }
}

/// A criterion as a function of the free variables `x`, without allocation for the Frobenius condition.
struct PowellObjective<'a> {
    design: &'a EnergyDesign,
    criterion: Criterion,
    n_rows: usize,
    values: Vec<f64>,
    rows: PointRows<'a>,
    gram: Vec<f64>,
    work: [Vec<f64>; 2],
}

impl<'a> PowellObjective<'a> {
    fn new(design: &'a EnergyDesign, n_rows: usize, criterion: Criterion) -> Self {
        let (n, b) = (design.n_variables() * (n_rows + 1), design.n_columns());
        Self {
            design,
            criterion,
            n_rows,
            values: vec![0.0; n],
            rows: PointRows::new(design, n_rows),
            gram: vec![0.0; b * padded::stride(b)],
            work: [
                vec![0.0; b * padded::stride(b)],
                vec![0.0; b * padded::stride(b)],
            ],
        }
    }

    /// Logarithm of the criterion as [`Criterion::logarithm`] has it.
    fn log_value(&mut self, x: &[f64]) -> f64 {
        self.design.substitute(x, &mut self.values);
        self.rows.update(&self.values);
        match self.criterion {
            Criterion::Frobenius(Scaling::Raw) => self.log_frobenius(),
            criterion => {
                let w = self.rows.matrix();
                criterion.logarithm(criterion.evaluate(w.as_ref(), self.n_rows))
            }
        }
    }

    /// `log (‖A‖_F ‖A⁻¹‖_F)`; infinite when `A` is not positive definite to rounding.
    fn log_frobenius(&mut self) -> f64 {
        let b = self.design.n_columns();
        padded::gram(self.rows.w(), b, &mut self.gram);
        let direct = dense::norm_squared(&self.gram);
        if !padded::cholesky(&mut self.gram, b) {
            return f64::INFINITY;
        }
        let [inverse_factor, inverse] = &mut self.work;
        padded::inverse_of_factor(&self.gram, b, inverse_factor, inverse);
        0.5 * (direct.ln() + dense::norm_squared(inverse).ln())
    }
}
