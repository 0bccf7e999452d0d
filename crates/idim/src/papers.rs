//! The printed tables of both papers, read from the embedded fixtures.

use crate::error::Error;
use serde::Deserialize;
use serde::de::DeserializeOwned;

/// Tables of Gautier & Khalil 1991 that a run compares itself with.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct GautierKhalil {
    /// Condition numbers of random and optimum sequences.
    pub(crate) table2: Vec<Table2Row>,
    /// Noise on Y.
    pub(crate) table3: NoiseTable,
    /// Noise on W.
    pub(crate) table4: NoiseTable,
    /// Estimates on the optimum sequence.
    pub(crate) table5: EstimateTable,
    /// Estimates on a random sequence.
    pub(crate) table6: EstimateTable,
    /// Limits that fit the print; not the paper's own.
    pub(crate) inferred_limits: InferredLimits,
    /// Limits of the path through the points; not the paper's own.
    pub(crate) inferred_path_limits: InferredPathLimits,
    /// Condition numbers of random sequences under those limits, by an independent program.
    pub(crate) inferred_limits_random: Vec<InferredRow>,
}

/// A row of table 2.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Table2Row {
    /// Smallest of 1000.
    pub(crate) minimum: f64,
    /// Mean of 1000.
    pub(crate) mean: f64,
    /// Largest of 1000, where printed.
    pub(crate) maximum: Option<f64>,
}

impl GautierKhalil {
    /// `Cond(W)` of the random sequence of tables 3 and 4.
    pub(crate) fn table3_condition(&self) -> f64 {
        self.table3.condition_random
    }
}

/// Table 3 or 4.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct NoiseTable {
    /// `Cond(W)` of the random sequence.
    pub(crate) condition_random: f64,
    /// One row a noise level.
    pub(crate) rows: Vec<NoiseTableRow>,
}

/// One noise level.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct NoiseTableRow {
    /// On the optimised points.
    pub(crate) optimum: NoiseCell,
    /// On random points.
    pub(crate) random: NoiseCell,
}

/// What one noise level does.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(crate) struct NoiseCell {
    /// `‖δY‖/‖Y‖` (table 3) or `‖δW‖/‖W‖` (table 4).
    pub(crate) noise: f64,
    /// `‖δX‖/‖X‖`.
    pub(crate) error: f64,
    /// `K_R` (table 3) or `Cond(W + δW)` (table 4).
    pub(crate) ratio: f64,
}

/// Table 5 or 6.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct EstimateTable {
    /// One row a base parameter.
    pub(crate) rows: Vec<EstimateRow>,
}

/// One base parameter.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct EstimateRow {
    /// Its name.
    pub(crate) name: String,
    /// `X`.
    pub(crate) value: f64,
    /// `σ_X`.
    pub(crate) std: f64,
}

/// Limits of the points.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct InferredLimits {
    /// Degrees.
    pub(crate) position_deg: Vec<(f64, f64)>,
    /// rad/s.
    pub(crate) velocity: Vec<f64>,
}

/// Limits of the path.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct InferredPathLimits {
    /// Degrees.
    pub(crate) position_deg: Vec<(f64, f64)>,
    /// rad/s.
    pub(crate) velocity: Vec<f64>,
    /// rad/s².
    pub(crate) acceleration: Vec<f64>,
}

/// Random sequences under the inferred limits.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct InferredRow {
    /// Median of 1000.
    pub(crate) median: f64,
}

/// The tables of Gautier & Khalil.
///
/// # Errors
/// An embedded file that does not parse, a defect of this program.
pub(crate) fn gautier_khalil() -> Result<GautierKhalil, Error> {
    read("gk_tables.ron", idim_fixtures::GK_TABLES)
}

fn read<T: DeserializeOwned>(name: &str, text: &str) -> Result<T, Error> {
    ron::from_str(text).map_err(|e| {
        Error::input(
            name,
            e.to_string(),
            "the embedded table must parse: a defect of this program",
        )
    })
}
