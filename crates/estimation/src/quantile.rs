//! Quantiles of the distributions that intervals and tests rest on.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// From here on the expansion of Student's t about the normal distribution (Abramowitz & Stegun 26.7.5) is exact to 1e-11.
const EXPANSION_FROM: f64 = 1000.0;

/// Quantile of Student's t: `P(t ≤ result) = probability`. Infinite degrees of freedom give the normal distribution.
///
/// # Panics
/// If `probability` is not inside (0, 1) or `degrees_of_freedom` is not positive.
#[track_caller]
pub fn student_t_quantile(probability: f64, degrees_of_freedom: f64) -> f64 {
    check(probability, degrees_of_freedom);
    let n = degrees_of_freedom;
    if n < EXPANSION_FROM {
        // The positive half, by symmetry.
        let upper = probability.max(1.0 - probability);
        let size = StudentsT::new(0.0, 1.0, n).map_or(f64::NAN, |t| invert(|x| t.cdf(x), upper));
        return if probability < 0.5 { -size } else { size };
    }
    let z = Normal::standard().inverse_cdf(probability);
    let z2 = z * z;
    let g1 = (z2 + 1.0) / 4.0;
    let g2 = ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
    let g3 = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
    z * (1.0 + (g1 + (g2 + g3 / n) / n) / n)
}

/// Quantile of χ².
///
/// # Panics
/// As [`student_t_quantile`].
#[track_caller]
pub fn chi_square_quantile(probability: f64, degrees_of_freedom: f64) -> f64 {
    check(probability, degrees_of_freedom);
    ChiSquared::new(degrees_of_freedom).map_or(f64::NAN, |c| invert(|x| c.cdf(x), probability))
}

/// Quantile of Fisher's F.
///
/// # Panics
/// As [`student_t_quantile`].
#[track_caller]
pub fn f_quantile(probability: f64, numerator_freedom: f64, denominator_freedom: f64) -> f64 {
    check(probability, numerator_freedom);
    check(probability, denominator_freedom);
    FisherSnedecor::new(numerator_freedom, denominator_freedom)
        .map_or(f64::NAN, |f| invert(|x| f.cdf(x), probability))
}

/// The positive `x` with `cdf(x) = probability`, by bisection: statrs' own inverses lose all but four digits, or panic, when the
/// freedom is large.
fn invert(cdf: impl Fn(f64) -> f64, probability: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while cdf(high) < probability && high < f64::MAX / 2.0 {
        (low, high) = (high, 2.0 * high);
    }
    loop {
        let middle = 0.5 * (low + high);
        // The two ends are neighbours, or as near as matters for a quantile below 1e-300.
        if middle <= low || middle >= high || high < f64::MIN_POSITIVE {
            return high;
        }
        if cdf(middle) < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[track_caller]
fn check(probability: f64, freedom: f64) {
    assert!(
        probability > 0.0 && probability < 1.0,
        "probability {probability} is not inside (0, 1)"
    );
    assert!(freedom > 0.0, "{freedom} degrees of freedom");
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SciPy 1.17.1, `stats.t.ppf`, `chi2.ppf`, `f.ppf`, `norm.ppf`; relative agreement.
    const SAME: f64 = 1e-8;

    #[track_caller]
    fn agrees(got: f64, expected: f64) {
        assert!(
            (got / expected - 1.0).abs() < SAME,
            "{got}, SciPy {expected}"
        );
    }

    #[test]
    fn oracle_student() {
        agrees(student_t_quantile(0.975, 1.0), 12.706204736174694);
        agrees(student_t_quantile(0.975, 10.0), 2.228138851986274);
        agrees(student_t_quantile(0.025, 10.0), -2.228138851986274);
        agrees(student_t_quantile(0.975, 300.0), 1.9679030112610865);
        // Both sides of the expansion's border meet.
        agrees(
            student_t_quantile(0.975, 999.999999),
            student_t_quantile(0.975, 1000.0),
        );
        agrees(student_t_quantile(0.975, 1e6), 1.959966356814107);
        agrees(student_t_quantile(0.6, 5.0), 0.2671808657041451);
        agrees(student_t_quantile(0.9995, 3.0), 12.923978636687961);
        agrees(student_t_quantile(0.975, f64::INFINITY), 1.959963984540054);
    }

    #[test]
    fn oracle_chi_square() {
        agrees(chi_square_quantile(0.95, 1.0), 3.841458820694124);
        agrees(chi_square_quantile(0.95, 43.0), 59.30351202689981);
        agrees(chi_square_quantile(0.5, 36.0), 35.335572835576905);
        agrees(chi_square_quantile(0.99, 5000.0), 5235.57183813011);
    }

    #[test]
    fn oracle_fisher() {
        agrees(f_quantile(0.95, 1.0, 20.0), 4.351243503329288);
        agrees(f_quantile(0.95, 3.0, 20.0), 3.098391212140781);
        agrees(f_quantile(0.95, 7.0, 18000.0), 2.0100976935615886);
        agrees(f_quantile(0.99, 1.0, 1e6), 6.634921929465655);
    }
}
