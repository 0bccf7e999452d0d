//! Relations as people write them.

use crate::Reduction;

/// Significant digits of a printed coefficient: all of a length in millimetres squared, none of the rounding.
const DIGITS: usize = 8;

impl Reduction {
    /// Names of the base parameters: an R before the link number where something is regrouped (`ZZ1` becomes `ZZR1`).
    ///
    /// `names`: one name a column.
    ///
    /// # Panics
    ///
    /// If there is not one name a column.
    #[track_caller]
    pub fn base_names(&self, names: &[String]) -> Vec<String> {
        (0..self.rank()).map(|b| self.base_name(b, names)).collect()
    }

    /// Base parameter `base_index` (a position in [`base`](Self::base)) in terms of standard parameters:
    /// `ZZR1 = ZZ1 + YY2 + YY3 + 0.4 MZ3 + 0.29 M3`, or the bare name where nothing is regrouped.
    ///
    /// # Panics
    ///
    /// If there is no such base parameter, or not one name a column.
    #[track_caller]
    pub fn relation(&self, base_index: usize, names: &[String]) -> String {
        let base_name = self.base_name(base_index, names);
        let own = self.base[base_index];
        if base_name == names[own] {
            return base_name;
        }
        let others = (0..self.n_columns).filter(|column| *column != own);
        let terms = std::iter::once(own)
            .chain(others)
            .map(|j| (self.regrouping[(base_index, j)], names[j].as_str()));
        format!("{base_name} = {}", sum(terms))
    }

    /// Combined column `dependent` in terms of base columns, `Iyy2 = Iyy1 - Ixx2`: a relation between columns, not between
    /// parameters.
    ///
    /// # Panics
    ///
    /// If there is no such column, or not one name a column.
    #[track_caller]
    pub fn column_relation(&self, dependent: usize, names: &[String]) -> String {
        self.check_names(names);
        let terms = self.column_coefficients(dependent);
        format!(
            "{} = {}",
            names[dependent],
            sum(terms
                .iter()
                .map(|(base, alpha)| (*alpha, names[*base].as_str())))
        )
    }

    #[track_caller]
    fn base_name(&self, base_index: usize, names: &[String]) -> String {
        self.check_names(names);
        assert!(
            base_index < self.rank(),
            "base parameter {base_index} of {}",
            self.rank()
        );
        let name = &names[self.base[base_index]];
        let regrouped = (0..self.n_columns)
            .filter(|j| self.regrouping[(base_index, *j)] != 0.0)
            .count()
            > 1;
        if !regrouped {
            return name.clone();
        }
        let kind = name.trim_end_matches(|c: char| c.is_ascii_digit());
        format!("{kind}R{}", &name[kind.len()..])
    }

    #[track_caller]
    fn check_names(&self, names: &[String]) {
        assert!(
            names.len() == self.n_columns,
            "{} names for {} columns",
            names.len(),
            self.n_columns
        );
    }
}

/// `A + 0.4 B - C`, zeros left out; `0` if nothing is left.
fn sum<'a>(terms: impl Iterator<Item = (f64, &'a str)>) -> String {
    let mut text = String::new();
    for (value, name) in terms.filter(|(value, _)| *value != 0.0) {
        text += match (text.is_empty(), value < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        let size = coefficient(value.abs());
        if size != "1" {
            text += &size;
            text.push(' ');
        }
        text += name;
    }
    if text.is_empty() {
        "0".to_owned()
    } else {
        text
    }
}

/// Shortest text of a number rounded to `DIGITS` significant digits.
fn coefficient(value: f64) -> String {
    let scientific = format!("{value:.*e}", DIGITS - 1);
    let rounded: f64 = scientific.parse().unwrap_or(value);
    if (1e-4..1e8).contains(&rounded) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_carry_no_rounding() {
        assert_eq!(coefficient(0.29000000000000004), "0.29");
        assert_eq!(coefficient(0.9999999999999996), "1");
        assert_eq!(coefficient(0.3302 * 0.3302), "0.10903204");
        assert_eq!(coefficient(1.0 / (0.3048 * 0.3048)), "10.76391");
        assert_eq!(coefficient(1.3e-9), "1.3e-9");
    }

    #[test]
    fn sums_read_as_written() {
        let terms = [
            (-1.0, "Iyy1"),
            (0.0, "M9"),
            (-10.76391, "m2"),
            (3.25, "mx2"),
            (1.0, "Ixx2"),
        ];
        assert_eq!(
            sum(terms.into_iter()),
            "-Iyy1 - 10.76391 m2 + 3.25 mx2 + Ixx2"
        );
        assert_eq!(sum(std::iter::empty()), "0");
    }
}
