//! How numbers, lists, comments and formulas are written in Rust and in C.

use idim_model::{Formula, Function, Operation};

/// A language of predictors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Language {
    Rust,
    C,
}

impl Language {
    /// The shortest text that reads back as the same number.
    pub(super) fn number(self, x: f64) -> String {
        match (self, x.is_finite(), x > 0.0) {
            (_, true, _) => format!("{x:?}"),
            (Self::Rust, false, true) => "f64::INFINITY".into(),
            (Self::Rust, false, false) if x.is_nan() => "f64::NAN".into(),
            (Self::Rust, false, false) => "f64::NEG_INFINITY".into(),
            (Self::C, false, true) => "INFINITY".into(),
            (Self::C, false, false) if x.is_nan() => "NAN".into(),
            (Self::C, false, false) => "(-INFINITY)".into(),
        }
    }

    /// Items in the brackets of an initialiser.
    pub(super) fn list(self, items: &[String]) -> String {
        let inside = items.join(", ");
        match self {
            Self::Rust => format!("[{inside}]"),
            Self::C => format!("{{{inside}}}"),
        }
    }

    /// Numbers in the brackets of an initialiser.
    pub(super) fn row(self, numbers: &[f64]) -> String {
        let items: Vec<String> = numbers.iter().map(|x| self.number(*x)).collect();
        self.list(&items)
    }

    /// A function of an argument.
    pub(super) fn call(self, function: Function, x: &str) -> String {
        use Function as F;
        if function == F::Negative {
            return format!("(-{x})");
        }
        // Names by (Rust, C99); C's `signum` and `fract` are helpers of the predictor.
        let (rust, c) = match function {
            F::Negative => ("neg", "-"),
            F::Abs => ("abs", "fabs"),
            F::Signum => ("signum", "signum"),
            F::Sin => ("sin", "sin"),
            F::Cos => ("cos", "cos"),
            F::Tan => ("tan", "tan"),
            F::Asin => ("asin", "asin"),
            F::Acos => ("acos", "acos"),
            F::Atan => ("atan", "atan"),
            F::Sinh => ("sinh", "sinh"),
            F::Cosh => ("cosh", "cosh"),
            F::Tanh => ("tanh", "tanh"),
            F::Asinh => ("asinh", "asinh"),
            F::Acosh => ("acosh", "acosh"),
            F::Atanh => ("atanh", "atanh"),
            F::Floor => ("floor", "floor"),
            F::Round => ("round", "round"),
            F::Ceil => ("ceil", "ceil"),
            F::Trunc => ("trunc", "trunc"),
            F::Fract => ("fract", "fract"),
            F::Exp => ("exp", "exp"),
            F::Sqrt => ("sqrt", "sqrt"),
            F::Cbrt => ("cbrt", "cbrt"),
            F::Ln => ("ln", "log"),
            F::Log2 => ("log2", "log2"),
            F::Log10 => ("log10", "log10"),
        };
        match self {
            Self::Rust => format!("f64::{rust}({x})"),
            Self::C => format!("{c}({x})"),
        }
    }

    fn operation(self, operation: Operation, a: &str, b: &str) -> String {
        use Operation as O;
        let (rust, c) = match operation {
            O::Add => return format!("({a} + {b})"),
            O::Subtract => return format!("({a} - {b})"),
            O::Multiply => return format!("({a} * {b})"),
            O::Divide => return format!("({a} / {b})"),
            O::Power => ("powf", "pow"),
            O::Atan2 => ("atan2", "atan2"),
            O::Min => ("min", "fmin"),
            O::Max => ("max", "fmax"),
        };
        match self {
            Self::Rust => format!("f64::{rust}({a}, {b})"),
            Self::C => format!("{c}({a}, {b})"),
        }
    }

    /// A formula of quantities called `x0`, `x1`, ...
    pub(super) fn formula(self, formula: &Formula) -> String {
        match formula {
            Formula::Number(x) => self.number(*x),
            Formula::Quantity(k) => format!("x{k}"),
            Formula::Function(function, x) => self.call(*function, &self.formula(x)),
            Formula::Operation(operation, ab) => {
                self.operation(*operation, &self.formula(&ab[0]), &self.formula(&ab[1]))
            }
        }
    }
}

/// A name inside a comment of one line: nothing that ends or continues it, or turns the direction of the text.
pub(super) fn comment(name: &str) -> String {
    let harmless = |c: char| {
        let turns = ('\u{202a}'..='\u{202e}').contains(&c)
            || ('\u{2066}'..='\u{2069}').contains(&c)
            || ['\u{200e}', '\u{200f}', '\u{61c}', '\u{2028}', '\u{2029}'].contains(&c);
        if c.is_control() || turns || c == '\\' || c == '?' {
            ' '
        } else {
            c
        }
    };
    let text: String = name.chars().map(harmless).collect();
    text.replace("*/", "* /").replace("/*", "/ *")
}
