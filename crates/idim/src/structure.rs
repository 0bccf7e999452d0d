//! Which parameters of a robot the motors can feel at all, and the names people give them.

use crate::columns::{ExtraColumn, ModelColumns, described_extras};
use crate::error::Error;
use crate::result::{BaseParameter, ReductionResult};
use crate::samples::{Stretch, visit_model_rows};
use idim_base_params::{Reduction, ReductionOptions, TriangularFactor, reduce};
use idim_model::{
    Columns, DriveColumns, Model, Notation, ParameterKind, Robot, energy_regressor, random_states,
    visit_torque_regressor,
};

/// The order in which columns are kept; what comes later is expressed by what came before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KeepOrder {
    /// Links from the base out, `XX XY XZ YY YZ ZZ MX MY MZ M`, then the drive: the names of Gautier & Khalil.
    #[default]
    Links,
    /// Links from the base out, `m mx my mz Ixx Iyy Izz Ixy Ixz Iyz`: the names of Radkhah, Kulić & Croft.
    MassFirst,
}

/// Random states per column the rank is read from: the structure shows in far fewer.
const ROWS_PER_COLUMN: usize = 12;
/// The structure does not depend on the draw; one seed makes it the same on every run and machine.
const STRUCTURE_SEED: u64 = 1991;

/// The columns of a regressor and what can be told of them.
#[derive(Debug, Clone)]
pub struct Structure {
    /// All columns of the torque regressor, in the standard order.
    pub columns: Columns,
    /// Columns that coupled motors and known torques add, after the others.
    pub extra: Vec<ExtraColumn>,
    /// Categories, base columns, regrouping.
    pub reduction: Reduction,
    /// The words the parameters are printed in.
    pub notation: Notation,
}

impl Structure {
    /// Of the torque model with these drive columns, from random states within the robot's limits.
    pub fn of_torque(robot: &Robot, drive: DriveColumns, order: KeepOrder) -> Self {
        let model = Model::new(robot);
        let columns = Columns::standard(robot.n_joints(), drive);
        let n_samples = ROWS_PER_COLUMN * columns.len() / robot.n_joints();
        let states = random_states(robot, n_samples, STRUCTURE_SEED);
        let mut factor = TriangularFactor::new(columns.len());
        let mut row = vec![0.0; columns.len()];
        visit_torque_regressor(&model, &columns, &states, |block| {
            for lane in 0..block.n_samples() {
                for joint in 0..block.n_joints() {
                    block.copy_row(joint, lane, &mut row);
                    factor.push_rows(&row);
                }
            }
        });
        Self::from_factor(columns, Vec::new(), &factor, order)
    }

    /// Of the torque model with these columns, and with those that the robot file adds: motors that turn with several
    /// joints, known torques.
    pub fn of_drives(robot: &Robot, standard: Columns) -> Self {
        let columns = ModelColumns {
            standard,
            extra: described_extras(robot),
        };
        let n_samples = ROWS_PER_COLUMN * columns.len() / robot.n_joints();
        let stretch = Stretch::of_states(random_states(robot, n_samples, STRUCTURE_SEED));
        let mut factor = TriangularFactor::new(columns.len());
        visit_model_rows(robot, &columns, &stretch, &[], |_, _, row| {
            // A formula without a value at some position says nothing there.
            if row.iter().all(|v| v.is_finite()) {
                factor.push_rows(row);
            }
        });
        let ModelColumns { standard, extra } = columns;
        Self::from_factor(standard, extra, &factor, KeepOrder::Links)
    }

    /// Of the energy-difference model of Gautier & Khalil, from random pairs of points.
    pub fn of_energy(robot: &Robot, order: KeepOrder) -> Self {
        let model = Model::new(robot);
        let columns = Columns::inertial(robot.n_joints());
        let n_samples = ROWS_PER_COLUMN * columns.len();
        let states = random_states(robot, n_samples, STRUCTURE_SEED);
        let mut factor = TriangularFactor::new(columns.len());
        let mut last: Option<Vec<f64>> = None;
        for k in 0..n_samples {
            let s = states.state(k);
            let h = energy_regressor(&model, &columns, &s.q, &s.qd);
            if let Some(last) = &last {
                let row: Vec<f64> = h.iter().zip(last).map(|(b, a)| b - a).collect();
                factor.push_rows(&row);
            }
            last = Some(h);
        }
        Self::from_factor(columns, Vec::new(), &factor, order)
    }

    fn from_factor(
        columns: Columns,
        extra: Vec<ExtraColumn>,
        factor: &TriangularFactor,
        order: KeepOrder,
    ) -> Self {
        let mut positions = keep_positions(&columns, order);
        positions.extend(columns.len()..columns.len() + extra.len());
        let reduction = reduce(factor, &positions, &ReductionOptions::default());
        let notation = match order {
            KeepOrder::Links => Notation::Gautier,
            KeepOrder::MassFirst => Notation::Tensor,
        };
        Self {
            columns,
            extra,
            reduction,
            notation,
        }
    }

    /// Refuses a rank that is not clear.
    ///
    /// # Errors
    /// [`Error::AmbiguousRank`] with the combination in doubt.
    pub fn decided(self) -> Result<Self, Error> {
        match self.doubt() {
            Some(message) => Err(Error::AmbiguousRank { message }),
            None => Ok(self),
        }
    }

    /// What is in doubt about the rank, in words; `None` where the gap is clear.
    pub fn doubt(&self) -> Option<String> {
        let a = self.reduction.ambiguity.as_ref()?;
        let names = self.names();
        let mut terms: Vec<(f64, &String)> = a
            .combination
            .iter()
            .copied()
            .zip(&names)
            .filter(|(c, _)| c.abs() > 1e-3)
            .collect();
        terms.sort_by(|x, y| y.0.abs().total_cmp(&x.0.abs()));
        let shown: Vec<String> = terms
            .iter()
            .take(8)
            .map(|(c, n)| format!("{c:.3} {n}"))
            .collect();
        Some(format!(
            "the rank is {} or {}: the gap between them is only {:.1e}; in doubt: {}",
            a.lower_rank,
            a.upper_rank,
            a.gap,
            shown.join(" + ").replace("+ -", "- "),
        ))
    }

    /// Names of all columns.
    pub fn names(&self) -> Vec<String> {
        let mut names = self.columns.names(self.notation);
        names.extend(self.extra.iter().map(ExtraColumn::name));
        names
    }

    /// The kept columns of the torque regressor.
    pub fn base_columns(&self) -> Columns {
        self.base_model_columns().standard
    }

    /// The kept columns, with those beside the torque regressor.
    pub fn base_model_columns(&self) -> ModelColumns {
        let all = ModelColumns {
            standard: self.columns.clone(),
            extra: self.extra.clone(),
        };
        all.select(&self.reduction.base)
    }

    /// Names of the base parameters, with an R where something is regrouped.
    pub fn base_names(&self) -> Vec<String> {
        self.reduction.base_names(&self.names())
    }

    /// For `result.json`.
    pub fn to_result(&self) -> ReductionResult {
        let names = self.names();
        let pick = |list: &[usize]| list.iter().map(|&k| names[k].clone()).collect();
        let base_names = self.base_names();
        ReductionResult {
            standard: names.clone(),
            unidentifiable: pick(&self.reduction.unidentifiable),
            identifiable_alone: pick(&self.reduction.identifiable_alone),
            combined: pick(&self.reduction.combined),
            base: base_names
                .into_iter()
                .enumerate()
                .map(|(k, name)| BaseParameter {
                    name,
                    relation: self.reduction.relation(k, &names),
                })
                .collect(),
            rank_gap: self.reduction.rank_gap,
        }
    }
}

/// Mass first: what is not felt of a link keeps its mass and first moments.
pub(crate) const MASS_FIRST: [ParameterKind; 10] = {
    use ParameterKind as K;
    [
        K::M,
        K::MX,
        K::MY,
        K::MZ,
        K::XX,
        K::YY,
        K::ZZ,
        K::XY,
        K::XZ,
        K::YZ,
    ]
};

fn keep_positions(columns: &Columns, order: KeepOrder) -> Vec<usize> {
    let mut positions: Vec<usize> = (0..columns.len()).collect();
    if order == KeepOrder::MassFirst {
        let rank = |kind| MASS_FIRST.iter().position(|&k| k == kind);
        // Drive columns, which have no place among the ten, come last.
        let rank = |kind| rank(kind).unwrap_or(MASS_FIRST.len());
        positions.sort_by_key(|&k| (columns.0[k].index, rank(columns.0[k].kind), k));
    }
    positions
}
