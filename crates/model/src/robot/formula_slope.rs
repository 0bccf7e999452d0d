//! Formulas and how they change: numbers that carry a derivative along.

use super::formula::{Formula, Function, Operation};

impl Formula {
    /// Its value and derivative where each quantity has a value and a derivative; of a kink, that of one side.
    ///
    /// # Panics
    /// If it names a quantity that is not in the list.
    pub(super) fn with_slope(&self, quantities: &[[f64; 2]]) -> [f64; 2] {
        match self {
            Self::Number(x) => [*x, 0.0],
            Self::Quantity(k) => quantities[*k],
            Self::Function(function, x) => {
                let [x, dx] = x.with_slope(quantities);
                // A constant does not change, not even where the function has no slope.
                let slope = if dx == 0.0 {
                    0.0
                } else {
                    function.slope(x) * dx
                };
                [function.of(x), slope]
            }
            Self::Operation(operation, ab) => {
                let [a, b] = [ab[0].with_slope(quantities), ab[1].with_slope(quantities)];
                let slopes = operation.slopes(a[0], b[0]);
                let part = |dx: f64, slope: f64| if dx == 0.0 { 0.0 } else { slope * dx };
                let slope = part(a[1], slopes[0]) + part(b[1], slopes[1]);
                [operation.of(a[0], b[0]), slope]
            }
        }
    }
}

impl Function {
    fn slope(self, x: f64) -> f64 {
        match self {
            Self::Negative => -1.0,
            Self::Abs => x.signum(),
            Self::Signum | Self::Floor | Self::Round | Self::Ceil | Self::Trunc => 0.0,
            Self::Fract => 1.0,
            Self::Sin => x.cos(),
            Self::Cos => -x.sin(),
            Self::Tan => 1.0 + x.tan().powi(2),
            Self::Asin => 1.0 / (1.0 - x * x).sqrt(),
            Self::Acos => -1.0 / (1.0 - x * x).sqrt(),
            Self::Atan => 1.0 / (1.0 + x * x),
            Self::Sinh => x.cosh(),
            Self::Cosh => x.sinh(),
            Self::Tanh => 1.0 - x.tanh().powi(2),
            Self::Asinh => 1.0 / (x * x + 1.0).sqrt(),
            Self::Acosh => 1.0 / (x * x - 1.0).sqrt(),
            Self::Atanh => 1.0 / (1.0 - x * x),
            Self::Exp => x.exp(),
            Self::Sqrt => 0.5 / x.sqrt(),
            Self::Cbrt => 1.0 / (3.0 * x.cbrt().powi(2)),
            Self::Ln => 1.0 / x,
            Self::Log2 => 1.0 / (x * std::f64::consts::LN_2),
            Self::Log10 => 1.0 / (x * std::f64::consts::LN_10),
        }
    }
}

impl Operation {
    /// By the first and by the second argument.
    fn slopes(self, a: f64, b: f64) -> [f64; 2] {
        let first = |is_first: bool| {
            [
                f64::from(u8::from(is_first)),
                f64::from(u8::from(!is_first)),
            ]
        };
        match self {
            Self::Add => [1.0, 1.0],
            Self::Subtract => [1.0, -1.0],
            Self::Multiply => [b, a],
            Self::Divide => [1.0 / b, -a / (b * b)],
            Self::Power => [b * a.powf(b - 1.0), a.powf(b) * a.ln()],
            Self::Atan2 => {
                let square = a * a + b * b;
                [b / square, -a / square]
            }
            Self::Min => first(a <= b),
            Self::Max => first(a >= b),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::super::formula::Formula;

    #[test]
    fn identity_the_slope_of_every_function_by_differences() {
        let formulas = [
            "1 - x + 2 - y * 3 / x / 2 * y - -x^2^3",
            "(x + 1) / (y - 3) * (2 + x) ^ (1 / 3) + 2^x + x^y",
            "abs(x) + signum(-y) + sin(x) + cos(y) + tan(x) + asin(x / 9) + acos(y / 9) + atan(x)",
            "sinh(x) * cosh(y) / tanh(x) - asinh(x) + acosh(1 + x) - atanh(x / 9)",
            "floor(3 * x) + round(y) + ceil(x) + trunc(y) + fract(x) + exp(-x) + sqrt(x) + cbrt(y)",
            "ln(x) + log2(y) + log10(x)",
            "atan2(x, y) + min(x, y) * max(x, 2) + max(y, x)",
        ];
        for text in formulas {
            let tree = Formula::parse(text, &["x", "y"]).unwrap();
            for [x, y] in [[0.3, 1.7], [1.31, 0.4]] {
                let at = |t: f64| tree.at(&[x + t, y - 0.7 * t]);
                // Five-point difference: truncation h⁴ and rounding / h both near 1e-12, times some ten.
                let h = 5e-4;
                let numeric = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                let [value, slope] = tree.with_slope(&[[x, 1.0], [y, -0.7]]);
                assert_eq!(value, tree.at(&[x, y]), "{text}");
                let error = (slope - numeric).abs();
                assert!(
                    error < 1e-9 * slope.abs().max(1.0),
                    "{text}: {slope} {numeric}"
                );
            }
        }
    }

    #[test]
    fn regress_what_does_not_change_has_no_slope_even_at_a_pole() {
        let tree = Formula::parse("sqrt(y) + (y - 1)^2 + x^2", &["x", "y"]).unwrap();
        assert_eq!(tree.with_slope(&[[3.0, 1.0], [0.0, 0.0]])[1], 6.0);
    }
}
