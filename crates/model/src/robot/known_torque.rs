//! Torques known by their shape over the joint's coordinate: springs and counterbalances.

use super::formula::Formula;
use super::interval::{Interval, IntervalOperators};
use crate::error::Error;
use exmex::{Express, FlatEx};

/// The variable that stands for the joint's coordinate in a formula.
const COORDINATE: &str = "q";

/// A torque on one joint, known as a function of its coordinate up to a scale that is identified beside the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownTorque {
    name: String,
    joint: usize,
    curve: Curve,
}

#[derive(Debug, Clone, PartialEq)]
enum Curve {
    /// Points `(q, torque)`, q rising.
    Table(Vec<[f64; 2]>),
    Formula {
        /// Named quantities in the order they are computed, then the torque itself.
        steps: Vec<Step>,
    },
}

#[derive(Debug, Clone, PartialEq)]
struct Step {
    name: String,
    text: String,
    /// Of `q` and the steps before.
    formula: Formula,
    /// The same text on intervals.
    enclosure: FlatEx<Interval, IntervalOperators>,
    /// Where the variables of `enclosure` stand among `q` and the steps before.
    inputs: Vec<usize>,
}

impl KnownTorque {
    /// From points `(q, torque)`, rad (m) and N·m (N): linear between them, constant beyond the ends.
    ///
    /// # Errors
    /// Fewer than two points, a number that is not finite, coordinates that do not rise.
    pub fn from_table(
        name: impl Into<String>,
        joint: usize,
        points: Vec<[f64; 2]>,
    ) -> Result<Self, Error> {
        let name = name.into();
        let refuse =
            |met: String, rule: &str| Err(Error::robot(format!("known torque {name}"), met, rule));
        if points.len() < 2 {
            return refuse(format!("{} points", points.len()), "a table needs two");
        }
        if let Some(p) = points.iter().flatten().find(|v| !v.is_finite()) {
            return refuse(format!("{p} in its table"), "give finite numbers");
        }
        if let Some(w) = points.windows(2).find(|w| w[1][0] <= w[0][0]) {
            return refuse(
                format!("q = {} after {}", w[1][0], w[0][0]),
                "the coordinates of a table rise from point to point",
            );
        }
        Ok(Self {
            name,
            joint,
            curve: Curve::Table(points),
        })
    }

    /// From a formula of `q` (rad, m) and of named quantities, each computed in order from `q` and those before it.
    ///
    /// Operators `+ - * / ^`, brackets, `PI`, `sqrt`, `sin`, `cos`, `tan`, `asin`, `acos`, `atan`, `exp`, `ln`, `abs`, `tanh`.
    ///
    /// # Errors
    /// A text that is no formula, a quantity that is not known where it is used.
    pub fn from_formula(
        name: impl Into<String>,
        joint: usize,
        quantities: &[(String, String)],
        torque: &str,
    ) -> Result<Self, Error> {
        let name = name.into();
        let mut steps: Vec<Step> = Vec::new();
        let last = (String::new(), torque.to_owned());
        for (quantity, text) in quantities.iter().chain([&last]) {
            let place = if quantity.is_empty() {
                format!("known torque {name}")
            } else {
                format!("known torque {name}, quantity {quantity}")
            };
            let known: Vec<&str> = std::iter::once(COORDINATE)
                .chain(steps.iter().map(|s| s.name.as_str()))
                .collect();
            if known.contains(&quantity.as_str()) {
                let rule = "q is the joint's coordinate; give each quantity a name of its own";
                return Err(Error::robot(place, "a name given twice", rule));
            }
            let formula = Formula::parse(text, &known)
                .map_err(|(met, rule)| Error::robot(&place, met, rule))?;
            let enclosure = FlatEx::parse(text).map_err(|e| {
                let rule = "write it with + - * / ^, brackets, PI, sin, cos, sqrt and so on";
                Error::robot(&place, format!("`{text}` is no formula: {e}"), rule)
            })?;
            // The formula has found every variable among them.
            let place_of = |v: &String| known.iter().position(|k| k == v);
            let inputs = enclosure.var_names().iter().filter_map(place_of).collect();
            steps.push(Step {
                name: quantity.clone(),
                text: text.clone(),
                formula,
                enclosure,
                inputs,
            });
        }
        Ok(Self {
            name,
            joint,
            curve: Curve::Formula { steps },
        })
    }

    /// Name, as its parameter is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Index of the joint it acts on.
    pub fn joint(&self) -> usize {
        self.joint
    }

    /// The same torque on a joint of another number.
    pub(crate) fn on_joint(&self, joint: usize) -> Self {
        Self {
            joint,
            ..self.clone()
        }
    }

    /// Torque at a coordinate (rad, m), N·m (N) for a scale of 1; not a number where a formula has no value.
    pub fn at(&self, q: f64) -> f64 {
        match &self.curve {
            Curve::Table(points) => {
                let after = points.partition_point(|p| p[0] <= q);
                if after == 0 {
                    return points[0][1];
                }
                if after == points.len() {
                    return points[after - 1][1];
                }
                let ([q0, t0], [q1, t1]) = (points[after - 1], points[after]);
                t0 + (t1 - t0) * (q - q0) / (q1 - q0)
            }
            Curve::Formula { steps } => {
                let mut values = Vec::with_capacity(steps.len() + 1);
                values.push(q);
                for step in steps {
                    values.push(step.formula.at(&values));
                }
                values.last().copied().unwrap_or(f64::NAN)
            }
        }
    }

    /// Slope of [`Self::at`], N·m/rad (N/m); of a kink, that of one side, and zero beyond the ends of a table.
    pub fn slope(&self, q: f64) -> f64 {
        match &self.curve {
            Curve::Table(points) => {
                let after = points.partition_point(|p| p[0] <= q);
                if after == 0 || after == points.len() {
                    return 0.0;
                }
                let ([q0, t0], [q1, t1]) = (points[after - 1], points[after]);
                (t1 - t0) / (q1 - q0)
            }
            Curve::Formula { steps } => {
                let mut values = vec![[q, 1.0]];
                for step in steps {
                    values.push(step.formula.with_slope(&values));
                }
                values.last().map_or(f64::NAN, |value| value[1])
            }
        }
    }

    /// Least and greatest torque anywhere from `low` to `high` (rad, m), N·m (N) for a scale of 1.
    ///
    /// Exact for a table. A formula is evaluated on intervals, which bound it from outside, the closer the nearer `low` and
    /// `high` are; infinite where that proves nothing, as beside a pole.
    ///
    /// `range(low, high)[0] ≤ at(q) ≤ range(low, high)[1]` for every `q` between.
    ///
    /// # Panics
    /// If `low` is above `high`.
    #[track_caller]
    pub fn range(&self, low: f64, high: f64) -> [f64; 2] {
        assert!(low <= high, "a range from {low} to {high}");
        match &self.curve {
            Curve::Table(points) => {
                let inside = points.iter().filter(|p| p[0] > low && p[0] < high);
                let ends = [self.at(low), self.at(high)];
                inside.fold([ends[0].min(ends[1]), ends[0].max(ends[1])], |[a, b], p| {
                    [a.min(p[1]), b.max(p[1])]
                })
            }
            Curve::Formula { steps } => {
                let mut values = vec![Interval::new(low, high)];
                for step in steps {
                    let arguments: Vec<Interval> = step.inputs.iter().map(|&k| values[k]).collect();
                    let Ok(value) = step.enclosure.eval(&arguments) else {
                        return [f64::NEG_INFINITY, f64::INFINITY];
                    };
                    values.push(value);
                }
                let torque = values[values.len() - 1];
                [torque.low, torque.high]
            }
        }
    }

    /// The points of a table, `None` for a formula.
    pub fn table(&self) -> Option<&[[f64; 2]]> {
        match &self.curve {
            Curve::Table(points) => Some(points),
            Curve::Formula { .. } => None,
        }
    }

    /// The named quantities and the torque of a formula, as written; `None` for a table.
    pub fn formula(&self) -> Option<(Vec<(&str, &str)>, &str)> {
        let Curve::Formula { steps } = &self.curve else {
            return None;
        };
        let (torque, quantities) = steps.split_last()?;
        let pairs = quantities
            .iter()
            .map(|s| (s.name.as_str(), s.text.as_str()));
        Some((pairs.collect(), torque.text.as_str()))
    }

    /// The named quantities and, without a name, the torque: each a formula of `q` (place 0) and of those before it
    /// (places from 1); `None` for a table.
    pub fn steps(&self) -> Option<Vec<(&str, &Formula)>> {
        match &self.curve {
            Curve::Table(_) => None,
            Curve::Formula { steps } => Some(
                steps
                    .iter()
                    .map(|s| (s.name.as_str(), &s.formula))
                    .collect(),
            ),
        }
    }

    /// The torque whose scale of 1 is this one's of `scale`.
    ///
    /// # Errors
    /// A scale that is not finite; a formula that grows too long.
    pub fn scaled(&self, scale: f64) -> Result<Self, Error> {
        if !scale.is_finite() {
            let place = format!("known torque {}", self.name);
            return Err(Error::robot(
                place,
                format!("a scale of {scale}"),
                "give a finite number",
            ));
        }
        match &self.curve {
            Curve::Table(points) => {
                let scaled = points.iter().map(|&[q, torque]| [q, scale * torque]);
                Self::from_table(&self.name, self.joint, scaled.collect())
            }
            Curve::Formula { steps } => {
                let mut pairs: Vec<(String, String)> = steps
                    .iter()
                    .map(|s| (s.name.clone(), s.text.clone()))
                    .collect();
                let (_, torque) = pairs.pop().unwrap_or_default();
                // Without an exponent, which formulas do not know.
                let torque = format!("{scale} * ({torque})");
                Self::from_formula(&self.name, self.joint, &pairs, &torque)
            }
        }
    }
}
