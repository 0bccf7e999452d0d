//! Intervals in the place of numbers: what a formula can be anywhere on a stretch of its variable.
//!
//! Every operation encloses what the same operation on numbers gives, widened by more than its rounding. Where an
//! operation has no value, or no simple bound, the answer is the whole line: nothing is claimed.

use exmex::{BinOp, MakeOperators, Operator};
use std::f64::consts::{E, PI, TAU};
use std::str::FromStr;

/// Every number from `low` to `high`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Interval {
    pub(super) low: f64,
    pub(super) high: f64,
}

/// More than the rounding of an elementary function, as a share of its value.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

impl FromStr for Interval {
    type Err = std::num::ParseFloatError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(|v| Self { low: v, high: v })
    }
}

impl Interval {
    /// The whole line.
    const ALL: Self = Self {
        low: f64::NEG_INFINITY,
        high: f64::INFINITY,
    };

    pub(super) fn new(low: f64, high: f64) -> Self {
        if low <= high {
            Self { low, high }
        } else {
            Self::ALL
        }
    }

    pub(super) fn is_finite(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    /// From the least to the greatest of values that rounding has touched; the line where one is not a number.
    fn around(values: &[f64]) -> Self {
        if values.iter().any(|v| v.is_nan()) {
            return Self::ALL;
        }
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let wider = |v: f64| ROUNDING * v.abs() + f64::MIN_POSITIVE;
        Self::new(low - wider(low), high + wider(high))
    }

    /// A function that rises, or falls, over the whole interval.
    fn monotone(self, f: fn(f64) -> f64) -> Self {
        Self::around(&[f(self.low), f(self.high)])
    }

    /// A function of the magnitude that rises with it.
    fn even(self, f: fn(f64) -> f64) -> Self {
        self.abs().monotone(f)
    }

    fn abs(self) -> Self {
        let ends = [self.low.abs(), self.high.abs()];
        let least = if self.low <= 0.0 && self.high >= 0.0 {
            0.0
        } else {
            ends[0].min(ends[1])
        };
        Self::new(least, ends[0].max(ends[1]))
    }

    fn times(self, other: Self) -> Self {
        let products = [self.low, self.high].map(|a| [a * other.low, a * other.high]);
        Self::around(products.as_flattened())
    }

    fn over(self, other: Self) -> Self {
        if other.low <= 0.0 && other.high >= 0.0 {
            return Self::ALL;
        }
        let quotients = [self.low, self.high].map(|a| [a / other.low, a / other.high]);
        Self::around(quotients.as_flattened())
    }

    /// `self ^ other`: of any base for a whole exponent, else of a base above zero.
    fn power(self, other: Self) -> Self {
        let n = other.low;
        if n == other.high && n.fract() == 0.0 {
            // A pole at zero is no interval.
            if n < 0.0 && self.low <= 0.0 && self.high >= 0.0 {
                return Self::ALL;
            }
            let base = if n % 2.0 == 0.0 { self.abs() } else { self };
            return Self::around(&[base.low.powf(n), base.high.powf(n)]);
        }
        if self.low <= 0.0 {
            return Self::ALL;
        }
        let corners = [self.low, self.high].map(|b| [b.powf(other.low), b.powf(other.high)]);
        Self::around(corners.as_flattened())
    }

    /// Whether `first + k period` lies within, up to rounding of the quotients.
    fn meets(self, first: f64, period: f64) -> bool {
        let turns = |x: f64| (x - first) / period;
        let rounding = 1e-9;
        (turns(self.high) + rounding).floor() >= (turns(self.low) - rounding).ceil()
    }

    /// The cosine of the interval shifted by `shift`, that is, with its crests at `shift + 2 k π`.
    fn wave(self, f: fn(f64) -> f64, crest: f64) -> Self {
        // Beyond this the turns themselves are no longer certain.
        if !self.is_finite() || self.abs().high > 1e6 {
            return Self::new(-1.0, 1.0);
        }
        let ends = Self::around(&[f(self.low), f(self.high)]);
        Self {
            low: if self.meets(crest + PI, TAU) {
                -1.0
            } else {
                ends.low
            },
            high: if self.meets(crest, TAU) {
                1.0
            } else {
                ends.high
            },
        }
    }

    fn tan(self) -> Self {
        if !self.is_finite() || self.abs().high > 1e6 || self.meets(0.5 * PI, PI) {
            return Self::ALL;
        }
        self.monotone(f64::tan)
    }
}

/// The operators of exmex's floating-point formulas, on intervals: the same names, the same order of evaluation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct IntervalOperators;

fn binary(
    name: &str,
    prio: i64,
    apply: fn(Interval, Interval) -> Interval,
) -> Operator<'_, Interval> {
    Operator::make_bin(name, operation(prio, apply))
}

fn operation(prio: i64, apply: fn(Interval, Interval) -> Interval) -> BinOp<Interval> {
    BinOp {
        apply,
        prio,
        is_commutative: false,
    }
}

fn constant(name: &str, value: f64) -> Operator<'_, Interval> {
    let (low, high) = (value.next_down(), value.next_up());
    Operator::make_constant(name, Interval { low, high })
}

impl MakeOperators<Interval> for IntervalOperators {
    fn make<'a>() -> Vec<Operator<'a, Interval>> {
        let unary = Operator::make_unary;
        let plus = operation(0, |a, b| {
            Interval::around(&[a.low + b.low, a.high + b.high])
        });
        let minus = operation(1, |a, b| {
            Interval::around(&[a.low - b.high, a.high - b.low])
        });
        vec![
            binary("^", 4, Interval::power),
            binary("*", 2, Interval::times),
            binary("/", 3, Interval::over),
            Operator::make_bin_unary("+", plus, |a| a),
            Operator::make_bin_unary("-", minus, |a| Interval::new(-a.high, -a.low)),
            binary("atan2", 0, |_, _| {
                Interval::new(-PI.next_up(), PI.next_up())
            }),
            binary("min", 0, |a, b| {
                Interval::new(a.low.min(b.low), a.high.min(b.high))
            }),
            binary("max", 0, |a, b| {
                Interval::new(a.low.max(b.low), a.high.max(b.high))
            }),
            unary("abs", Interval::abs),
            unary("signum", |a| a.monotone(f64::signum)),
            unary("sin", |a| a.wave(f64::sin, 0.5 * PI)),
            unary("cos", |a| a.wave(f64::cos, 0.0)),
            unary("tan", Interval::tan),
            unary("asin", |a| a.monotone(f64::asin)),
            unary("acos", |a| a.monotone(f64::acos)),
            unary("atan", |a| a.monotone(f64::atan)),
            unary("sinh", |a| a.monotone(f64::sinh)),
            unary("cosh", |a| a.even(f64::cosh)),
            unary("tanh", |a| a.monotone(f64::tanh)),
            unary("asinh", |a| a.monotone(f64::asinh)),
            unary("acosh", |a| a.monotone(f64::acosh)),
            unary("atanh", |a| a.monotone(f64::atanh)),
            unary("floor", |a| a.monotone(f64::floor)),
            unary("round", |a| a.monotone(f64::round)),
            unary("ceil", |a| a.monotone(f64::ceil)),
            unary("trunc", |a| a.monotone(f64::trunc)),
            unary("fract", |_| Interval::new(-1.0, 1.0)),
            unary("exp", |a| a.monotone(f64::exp)),
            unary("sqrt", |a| a.monotone(f64::sqrt)),
            unary("cbrt", |a| a.monotone(f64::cbrt)),
            unary("ln", |a| a.monotone(f64::ln)),
            unary("log2", |a| a.monotone(f64::log2)),
            unary("log10", |a| a.monotone(f64::log10)),
            unary("log", |a| a.monotone(f64::ln)),
            constant("PI", PI),
            constant("π", PI),
            constant("E", E),
            constant("e", E),
            constant("TAU", TAU),
            constant("τ", TAU),
        ]
    }
}
