//! A formula as a tree: known torques are computed by it, and source code in other languages is written from it.

use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};

/// A formula of quantities.
///
/// [`Self::at`] defines its value; whoever writes it in another language follows the tree node by node.
#[derive(Debug, Clone, PartialEq)]
pub enum Formula {
    /// A constant.
    Number(f64),
    /// The quantity at this place of the list the formula is given.
    Quantity(usize),
    /// A function of one argument.
    Function(Function, Box<Formula>),
    /// An operation on two.
    Operation(Operation, Box<[Formula; 2]>),
}

/// Functions of one argument, rad where it is an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    /// `-x`.
    Negative,
    /// `|x|`.
    Abs,
    /// 1 or -1 with the sign of `x`, of a zero too.
    Signum,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Inverse sine.
    Asin,
    /// Inverse cosine.
    Acos,
    /// Inverse tangent.
    Atan,
    /// Hyperbolic sine.
    Sinh,
    /// Hyperbolic cosine.
    Cosh,
    /// Hyperbolic tangent.
    Tanh,
    /// Inverse hyperbolic sine.
    Asinh,
    /// Inverse hyperbolic cosine.
    Acosh,
    /// Inverse hyperbolic tangent.
    Atanh,
    /// The next whole number below.
    Floor,
    /// The nearest whole number, halves away from zero.
    Round,
    /// The next whole number above.
    Ceil,
    /// The whole part.
    Trunc,
    /// What is left of it.
    Fract,
    /// `e^x`.
    Exp,
    /// Square root.
    Sqrt,
    /// Cube root.
    Cbrt,
    /// Natural logarithm.
    Ln,
    /// Logarithm to base 2.
    Log2,
    /// Logarithm to base 10.
    Log10,
}

/// Operations on two arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    /// `a + b`.
    Add,
    /// `a - b`.
    Subtract,
    /// `a b`.
    Multiply,
    /// `a / b`.
    Divide,
    /// `a^b`.
    Power,
    /// Angle of the point (b, a), rad.
    Atan2,
    /// The smaller.
    Min,
    /// The greater.
    Max,
}

/// Letters of one formula at most: a tree no deeper than this is walked on any thread's stack.
const LONGEST: usize = 2000;

impl Formula {
    /// Reads a formula of these quantities.
    ///
    /// # Errors
    /// What was met, and the rule.
    pub(super) fn parse(text: &str, known: &[&str]) -> Result<Self, (String, String)> {
        if text.len() > LONGEST {
            return Err((
                format!("{} letters", text.len()),
                format!("a formula has {LONGEST} at most; name parts of it in `with`"),
            ));
        }
        let no_formula = |e: exmex::ExError| {
            let rule = "write it with + - * / ^, brackets, PI, sin, cos, sqrt and so on";
            (format!("`{text}` is no formula: {e}"), rule.to_owned())
        };
        let expression = FlatEx::<Self, Operators>::parse(text).map_err(no_formula)?;
        let mut quantities = Vec::new();
        for variable in expression.var_names() {
            let Some(at) = known.iter().position(|k| k == variable) else {
                return Err((
                    format!("`{variable}` is not known here"),
                    format!("a formula may use {}", known.join(", ")),
                ));
            };
            quantities.push(Self::Quantity(at));
        }
        // "Evaluated" on trees, the expression is its own tree: one grammar, no second reader.
        expression.eval(&quantities).map_err(no_formula)
    }

    /// Its value; not a number where it has none.
    ///
    /// # Panics
    /// If it names a quantity that is not in the list.
    pub fn at(&self, quantities: &[f64]) -> f64 {
        match self {
            Self::Number(x) => *x,
            Self::Quantity(k) => quantities[*k],
            Self::Function(function, x) => function.of(x.at(quantities)),
            Self::Operation(operation, ab) => {
                operation.of(ab[0].at(quantities), ab[1].at(quantities))
            }
        }
    }
}

impl Function {
    pub(super) fn of(self, x: f64) -> f64 {
        match self {
            Self::Negative => -x,
            Self::Abs => x.abs(),
            Self::Signum => x.signum(),
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tan => x.tan(),
            Self::Asin => x.asin(),
            Self::Acos => x.acos(),
            Self::Atan => x.atan(),
            Self::Sinh => x.sinh(),
            Self::Cosh => x.cosh(),
            Self::Tanh => x.tanh(),
            Self::Asinh => x.asinh(),
            Self::Acosh => x.acosh(),
            Self::Atanh => x.atanh(),
            Self::Floor => x.floor(),
            Self::Round => x.round(),
            Self::Ceil => x.ceil(),
            Self::Trunc => x.trunc(),
            Self::Fract => x.fract(),
            Self::Exp => x.exp(),
            Self::Sqrt => x.sqrt(),
            Self::Cbrt => x.cbrt(),
            Self::Ln => x.ln(),
            Self::Log2 => x.log2(),
            Self::Log10 => x.log10(),
        }
    }
}

impl Operation {
    pub(super) fn of(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Power => a.powf(b),
            Self::Atan2 => a.atan2(b),
            Self::Min => a.min(b),
            Self::Max => a.max(b),
        }
    }
}

impl Default for Formula {
    fn default() -> Self {
        Self::Number(0.0)
    }
}

impl std::str::FromStr for Formula {
    type Err = std::num::ParseFloatError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self::Number)
    }
}

/// The operators of formulas, with the priorities of `exmex` on numbers.
#[derive(Debug, Clone)]
struct Operators;

impl MakeOperators<Formula> for Operators {
    fn make<'a>() -> Vec<Operator<'a, Formula>> {
        use std::f64::consts::{E, PI, TAU};
        let mut all = binary();
        all.extend(unary());
        let constants = [
            ("PI", PI),
            ("π", PI),
            ("E", E),
            ("e", E),
            ("TAU", TAU),
            ("τ", TAU),
        ];
        let constant = |(name, x)| Operator::make_constant(name, Formula::Number(x));
        all.extend(constants.map(constant));
        all
    }
}

fn binary<'a>() -> Vec<Operator<'a, Formula>> {
    use Operation as O;
    fn two(operation: Operation, a: Formula, b: Formula) -> Formula {
        Formula::Operation(operation, Box::new([a, b]))
    }
    fn ranked(
        apply: fn(Formula, Formula) -> Formula,
        prio: i64,
        is_commutative: bool,
    ) -> BinOp<Formula> {
        BinOp {
            apply,
            prio,
            is_commutative,
        }
    }
    let plus = ranked(|a, b| two(O::Add, a, b), 0, true);
    let minus = ranked(|a, b| two(O::Subtract, a, b), 1, false);
    vec![
        Operator::make_bin("^", ranked(|a, b| two(O::Power, a, b), 4, false)),
        Operator::make_bin("*", ranked(|a, b| two(O::Multiply, a, b), 2, true)),
        Operator::make_bin("/", ranked(|a, b| two(O::Divide, a, b), 3, false)),
        Operator::make_bin_unary("+", plus, |a| a),
        Operator::make_bin_unary("-", minus, |a| one(Function::Negative, a)),
        Operator::make_bin("atan2", ranked(|a, b| two(O::Atan2, a, b), 0, false)),
        Operator::make_bin("min", ranked(|a, b| two(O::Min, a, b), 0, false)),
        Operator::make_bin("max", ranked(|a, b| two(O::Max, a, b), 0, false)),
    ]
}

fn one(function: Function, x: Formula) -> Formula {
    Formula::Function(function, Box::new(x))
}

fn unary<'a>() -> Vec<Operator<'a, Formula>> {
    use Function as F;
    vec![
        Operator::make_unary("abs", |x| one(F::Abs, x)),
        Operator::make_unary("signum", |x| one(F::Signum, x)),
        Operator::make_unary("sin", |x| one(F::Sin, x)),
        Operator::make_unary("cos", |x| one(F::Cos, x)),
        Operator::make_unary("tan", |x| one(F::Tan, x)),
        Operator::make_unary("asin", |x| one(F::Asin, x)),
        Operator::make_unary("acos", |x| one(F::Acos, x)),
        Operator::make_unary("atan", |x| one(F::Atan, x)),
        Operator::make_unary("sinh", |x| one(F::Sinh, x)),
        Operator::make_unary("cosh", |x| one(F::Cosh, x)),
        Operator::make_unary("tanh", |x| one(F::Tanh, x)),
        Operator::make_unary("asinh", |x| one(F::Asinh, x)),
        Operator::make_unary("acosh", |x| one(F::Acosh, x)),
        Operator::make_unary("atanh", |x| one(F::Atanh, x)),
        Operator::make_unary("floor", |x| one(F::Floor, x)),
        Operator::make_unary("round", |x| one(F::Round, x)),
        Operator::make_unary("ceil", |x| one(F::Ceil, x)),
        Operator::make_unary("trunc", |x| one(F::Trunc, x)),
        Operator::make_unary("fract", |x| one(F::Fract, x)),
        Operator::make_unary("exp", |x| one(F::Exp, x)),
        Operator::make_unary("sqrt", |x| one(F::Sqrt, x)),
        Operator::make_unary("cbrt", |x| one(F::Cbrt, x)),
        Operator::make_unary("ln", |x| one(F::Ln, x)),
        Operator::make_unary("log2", |x| one(F::Log2, x)),
        Operator::make_unary("log10", |x| one(F::Log10, x)),
        Operator::make_unary("log", |x| one(F::Ln, x)),
    ]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Formula, Operators};
    use exmex::{Express, FloatOpsFactory, MakeOperators};

    /// Every function once, every pair of neighbours among the operations, signs in front of powers.
    const FORMULAS: [&str; 9] = [
        "1 - x + 2 - y * 3 / x / 2 * y - -x^2^3",
        "x * y / 3 * x - 2 / 3 * x^-2 + -sin(x)^2",
        "(x + 1) / (y - 1) * (2 - x) ^ (1 / 3)",
        "abs(x) + signum(-y) + sin(x) + cos(y) + tan(x) + asin(x / 9) + acos(y / 9) + atan(x)",
        "sinh(x) * cosh(y) / tanh(x) - asinh(x) + acosh(1 + x) - atanh(x / 9)",
        "floor(3 * x) + round(y) + ceil(x) + trunc(y) + fract(x) + exp(-x) + sqrt(x) + cbrt(y)",
        "ln(x) + log2(y) + log10(x) + log(y) + PI + π + E + e + TAU + τ",
        "atan2(x, y) + min(x, y) * max(x, 2)",
        "--x - +y",
    ];

    #[test]
    fn identity_the_tree_is_what_the_parser_computes_on_numbers() {
        for text in FORMULAS {
            let (tree, flat) = (
                Formula::parse(text, &["y", "x"]).unwrap(),
                exmex::parse::<f64>(text).unwrap(),
            );
            for [x, y] in [[0.3, 1.7], [2.5, -0.4], [1.0, 3.0]] {
                let values: Vec<f64> = flat
                    .var_names()
                    .iter()
                    .map(|v| if v == "x" { x } else { y })
                    .collect();
                let (a, b) = (tree.at(&[y, x]), flat.eval(&values).unwrap());
                // Constants folded by the parser may stand in another order of sums.
                let same = (a - b).abs() <= 1e-14 * b.abs().max(1.0) || (a.is_nan() && b.is_nan());
                assert!(same, "{text} at {x}, {y}: {a} instead of {b}");
            }
        }
    }

    #[test]
    fn identity_operators_are_those_of_numbers() {
        let (ours, theirs) = (Operators::make(), FloatOpsFactory::<f64>::make());
        assert_eq!(ours.len(), theirs.len());
        for theirs in theirs {
            let ours = ours.iter().find(|o| o.repr() == theirs.repr()).unwrap();
            assert_eq!(ours.has_unary(), theirs.has_unary());
            assert_eq!(ours.constant().is_some(), theirs.constant().is_some());
            let rank = |b: exmex::BinOp<f64>| (b.prio, b.is_commutative);
            let ours = ours.bin().ok().map(|b| (b.prio, b.is_commutative));
            assert_eq!(ours, theirs.bin().ok().map(rank));
        }
    }

    #[test]
    fn regress_a_formula_without_end_is_refused() {
        let long = "1+".repeat(2000) + "1";
        let (met, rule) = Formula::parse(&long, &["q"]).unwrap_err();
        assert!(
            met.contains("letters") && rule.contains("with"),
            "{met}; {rule}"
        );
    }
}
