//! Every column of a completed robot: those of the structure, and friction terms chosen beside it.

use super::Source;
use crate::columns::ExtraColumn;
use crate::identify::Identification;
use crate::structure::Structure;
use faer::Mat;
use idim_model::{Parameter, ParameterKind};

/// The columns that are completed, and how the estimated ones are made of them.
pub(super) struct Described<'a> {
    structure: &'a Structure,
    /// Friction terms, each known for itself: they stand after the columns of the structure.
    friction: &'a [ExtraColumn],
    /// Positions, among structure and friction, of the columns that are completed.
    kept: Vec<usize>,
}

impl<'a> Described<'a> {
    /// The columns of an identification.
    ///
    /// An offset that is regrouped has no value of its own and is left out.
    ///
    /// # Errors
    /// An estimate without some base parameter.
    pub(super) fn of(found: &'a Identification) -> Result<Self, String> {
        let structure = &found.structure;
        let base = structure.base_model_columns();
        let n = base.extra.len();
        let all = found.columns.standard == base.standard
            && found.columns.extra.get(..n) == Some(&base.extra)
            && found.columns.extra[n..]
                .iter()
                .all(|e| matches!(e, ExtraColumn::Friction { .. }));
        if !all {
            return Err("the estimate does not have every base parameter: the log does not excite it, or it was dropped".into());
        }
        let friction = &found.columns.extra[n..];
        let n_all = structure.columns.len() + structure.extra.len() + friction.len();
        let base = &structure.reduction.base;
        let regrouped_offset = |c: &usize| {
            let offset = |p: &Parameter| p.kind == ParameterKind::Offset;
            structure.columns.0.get(*c).is_some_and(offset) && !base.contains(c)
        };
        Ok(Self {
            structure,
            friction,
            kept: (0..n_all).filter(|c| !regrouped_offset(c)).collect(),
        })
    }

    /// The columns of the torque regressor with their places.
    pub(super) fn standard(&self) -> impl Iterator<Item = (usize, &Parameter)> {
        let own = |&c: &usize| self.structure.columns.0.get(c);
        let kept = self.kept.iter().enumerate();
        kept.filter_map(move |(place, c)| Some((place, own(c)?)))
    }

    /// The other columns with their places.
    pub(super) fn extra(&self) -> impl Iterator<Item = (usize, &ExtraColumn)> {
        let n = self.structure.columns.len();
        let all = || self.structure.extra.iter().chain(self.friction);
        let kept = self.kept.iter().enumerate().filter(move |(_, c)| **c >= n);
        kept.filter_map(move |(place, c)| Some((place, all().nth(c - n)?)))
    }

    /// Place of a parameter.
    pub(super) fn place(&self, parameter: &Parameter) -> Option<usize> {
        self.standard()
            .find(|(_, p)| *p == parameter)
            .map(|(place, _)| place)
    }

    /// Position among the estimated values of a column that has one of its own.
    pub(super) fn estimated(&self, place: usize) -> Option<usize> {
        let base = &self.structure.reduction.base;
        let c = self.kept[place];
        match self.friction_number(c) {
            Some(k) => Some(base.len() + k),
            None => base.iter().position(|&b| b == c),
        }
    }

    /// Where the value of a column comes from.
    pub(super) fn source(&self, place: usize) -> Source {
        let (r, c) = (&self.structure.reduction, self.kept[place]);
        if r.unidentifiable.contains(&c) {
            Source::Prior
        } else if self.friction_number(c).is_some() || r.identifiable_alone.contains(&c) {
            Source::Data
        } else {
            Source::Combination
        }
    }

    /// Whether a joint has friction terms beside viscous, Coulomb and offset.
    pub(super) fn has_further_friction(&self, of: usize) -> bool {
        let own =
            |e: &ExtraColumn| matches!(e, ExtraColumn::Friction { joint, .. } if *joint == of);
        self.friction.iter().any(own)
    }

    /// `K`: estimated values of completed ones; a friction term is itself.
    pub(super) fn regrouping(&self) -> Mat<f64> {
        let r = &self.structure.reduction;
        let n = r.base.len();
        Mat::from_fn(n + self.friction.len(), self.kept.len(), |i, place| {
            let c = self.kept[place];
            match (i.checked_sub(n), self.friction_number(c)) {
                (None, None) => r.regrouping[(i, c)],
                (Some(k), Some(own)) if k == own => 1.0,
                _ => 0.0,
            }
        })
    }

    fn friction_number(&self, column: usize) -> Option<usize> {
        column.checked_sub(self.structure.columns.len() + self.structure.extra.len())
    }
}
