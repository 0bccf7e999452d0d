//! The lane: the kernels' one generic, for one sample (`f64`) and for eight side by side.
//!
//! Products and sums that belong together are fused (`mul_add`), and sine and cosine are our own polynomial: so one
//! sample, eight samples and every instruction set give the same bits.

use std::ops::{Add, Mul, Neg, Sub};

/// Arithmetic of a sample, or of several that do not mix.
pub(crate) trait Lane:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + 'static
{
    /// The same value in every sample.
    fn splat(x: f64) -> Self;
    /// `self · a + b`, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Sine and cosine of an angle (rad) plus a number of quarter turns.
    fn sin_cos(self, quarters: u64) -> (Self, Self);
    /// -1, 0 or 1.
    fn sign(self) -> Self;
}

/// What eight numbers are kept in: a vector of the machine, so that the compiler never takes them apart.
#[cfg(target_arch = "x86_64")]
type Eight = std::arch::x86_64::__m512d;
#[cfg(not(target_arch = "x86_64"))]
type Eight = [f64; 8];

/// Eight samples side by side, a cache line.
///
/// Every operation is written out number by number and compiles to as few instructions as the machine allows.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(crate) struct F64x8(Eight);

impl F64x8 {
    #[inline(always)]
    pub(crate) fn new(x: [f64; 8]) -> Self {
        Self(bytemuck::must_cast(x))
    }

    #[inline(always)]
    pub(crate) fn array(self) -> [f64; 8] {
        bytemuck::must_cast(self.0)
    }

    pub(crate) fn as_array(&self) -> &[f64; 8] {
        bytemuck::must_cast_ref(&self.0)
    }

    pub(crate) fn as_array_mut(&mut self) -> &mut [f64; 8] {
        bytemuck::must_cast_mut(&mut self.0)
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl $trait for F64x8 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, o: Self) -> Self {
                let (a, b) = (self.array(), o.array());
                let mut r = [0.0; 8];
                for k in 0..8 {
                    r[k] = a[k] $op b[k];
                }
                Self::new(r)
            }
        }
    };
}
lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);

impl Neg for F64x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let a = self.array();
        let mut r = [0.0; 8];
        for k in 0..8 {
            r[k] = -a[k];
        }
        Self::new(r)
    }
}

impl Lane for f64 {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        f64::mul_add(self, a, b)
    }
    #[inline(always)]
    fn sin_cos(self, quarters: u64) -> (Self, Self) {
        if self.abs() <= REDUCTION_LIMIT {
            return sin_cos_reduced(self, quarters);
        }
        let (s, c) = f64::sin_cos(self);
        quarters_further(s, c, quarters)
    }
    #[inline(always)]
    fn sign(self) -> Self {
        f64::from(i8::from(self > 0.0) - i8::from(self < 0.0))
    }
}

impl Lane for F64x8 {
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self::new([x; 8])
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        let (x, a, b) = (self.array(), a.array(), b.array());
        let mut r = [0.0; 8];
        for k in 0..8 {
            r[k] = f64::mul_add(x[k], a[k], b[k]);
        }
        Self::new(r)
    }
    #[inline(always)]
    fn sin_cos(self, quarters: u64) -> (Self, Self) {
        let x = self.array();
        let (mut s, mut c) = ([0.0; 8], [0.0; 8]);
        let mut all_small = true;
        for k in 0..8 {
            (s[k], c[k]) = sin_cos_reduced(x[k], quarters);
            all_small &= x[k].abs() <= REDUCTION_LIMIT;
        }
        // A branch a lane would break the vector code; angles this large are rare, and done again one by one.
        if !all_small {
            for k in 0..8 {
                (s[k], c[k]) = Lane::sin_cos(x[k], quarters);
            }
        }
        (Self::new(s), Self::new(c))
    }
    #[inline(always)]
    fn sign(self) -> Self {
        let x = self.array();
        let mut r = [0.0; 8];
        for k in 0..8 {
            r[k] = x[k].sign();
        }
        Self::new(r)
    }
}

/// Beyond this angle (rad) the three-part reduction loses digits, and the standard library takes over.
const REDUCTION_LIMIT: f64 = 1.0e6;
/// π/2 in three parts of 53 bits each; their fused products leave the reduced angle correct to its last bit.
const HALF_PI: [f64; 3] = [
    std::f64::consts::FRAC_PI_2,
    6.123_233_995_736_766e-17,
    -1.497_384_904_859_169_8e-33,
];
/// Adding 1.5 · 2^52 rounds to an integer and leaves it in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Sine and cosine on [-π/4, π/4] after reduction, the minimax polynomials of fdlibm (Sun Microsystems, 1993).
#[inline(always)]
fn sin_cos_reduced(x: f64, quarters: u64) -> (f64, f64) {
    let shifted = x.mul_add(std::f64::consts::FRAC_2_PI, ROUND);
    let k = shifted - ROUND;
    let r = (-k).mul_add(HALF_PI[0], x);
    let r = (-k).mul_add(HALF_PI[1], r);
    let r = (-k).mul_add(HALF_PI[2], r);
    let z = r * r;
    let s = 1.589_690_995_211_55e-10_f64
        .mul_add(z, -2.505_076_025_340_686_3e-8)
        .mul_add(z, 2.755_731_370_707_006_8e-6)
        .mul_add(z, -1.984_126_982_985_795e-4)
        .mul_add(z, 8.333_333_333_322_49e-3)
        .mul_add(z, -1.666_666_666_666_663_2e-1);
    let sine = (r * z).mul_add(s, r);
    let c = (-1.135_964_755_778_819_5e-11_f64)
        .mul_add(z, 2.087_572_321_298_175e-9)
        .mul_add(z, -2.755_731_435_139_066_3e-7)
        .mul_add(z, 2.480_158_728_947_673e-5)
        .mul_add(z, -1.388_888_888_887_411e-3)
        .mul_add(z, 4.166_666_666_666_66e-2);
    let cosine = (z * z).mul_add(c, (-0.5_f64).mul_add(z, 1.0));
    quarters_further(sine, cosine, shifted.to_bits().wrapping_add(quarters))
}

/// Sine and cosine of an angle some quarter turns on.
#[inline(always)]
fn quarters_further(sine: f64, cosine: f64, quarters: u64) -> (f64, f64) {
    let (a, b) = if quarters & 1 == 0 {
        (sine, cosine)
    } else {
        (cosine, sine)
    };
    let flip_sine = (quarters & 2) << 62;
    let flip_cosine = (quarters.wrapping_add(1) & 2) << 62;
    (
        f64::from_bits(a.to_bits() ^ flip_sine),
        f64::from_bits(b.to_bits() ^ flip_cosine),
    )
}

/// Runs an operation compiled for the best instruction set of this machine.
///
/// The operation is a struct, not a closure: only its own method is certain to be inlined into the function that has
/// the instructions.
#[inline]
pub(crate) fn dispatch<Op: pulp::WithSimd>(operation: Op) -> Op::Output {
    pulp::Arch::new().dispatch(operation)
}

// The kernels below this line take no closures: a closure handed to a function of the standard library is compiled
// without the instructions of its caller.

/// Vector of three lanes.
pub(crate) type V3<T> = [T; 3];

/// `a × b`.
#[inline(always)]
pub(crate) fn cross<T: Lane>(a: V3<T>, b: V3<T>) -> V3<T> {
    [
        a[1].mul_add(b[2], -(a[2] * b[1])),
        a[2].mul_add(b[0], -(a[0] * b[2])),
        a[0].mul_add(b[1], -(a[1] * b[0])),
    ]
}

/// `a · b`.
#[inline(always)]
pub(crate) fn dot<T: Lane>(a: V3<T>, b: V3<T>) -> T {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// `a + b`.
#[inline(always)]
pub(crate) fn add<T: Lane>(a: V3<T>, b: V3<T>) -> V3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `-a`.
#[inline(always)]
pub(crate) fn minus<T: Lane>(a: V3<T>) -> V3<T> {
    [-a[0], -a[1], -a[2]]
}

/// `x a`.
#[inline(always)]
pub(crate) fn times<T: Lane>(x: T, a: V3<T>) -> V3<T> {
    [x * a[0], x * a[1], x * a[2]]
}

/// A constant vector in every lane.
#[inline(always)]
pub(crate) fn splat<T: Lane>(a: [f64; 3]) -> V3<T> {
    [T::splat(a[0]), T::splat(a[1]), T::splat(a[2])]
}

/// Zero vector.
#[inline(always)]
pub(crate) fn zero<T: Lane>() -> V3<T> {
    [T::splat(0.0); 3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn identity_sine_and_cosine_agree_with_the_standard_library(x in -1.0e5..1.0e5_f64) {
            let (s, c) = Lane::sin_cos(x, 0);
            let (s0, c0) = x.sin_cos();
            // Two units in the last place of 1.
            prop_assert!((s - s0).abs() <= 2.0 * f64::EPSILON && (c - c0).abs() <= 2.0 * f64::EPSILON);
        }

        #[test]
        fn identity_eight_lanes_give_the_bits_of_one(x in -10.0..10.0_f64, quarters in 0..4_u64) {
            let eight = F64x8::new([x, -x, x + 1.0, x - 1.0, x * 0.5, x * 3.0, 1.0e7 * x, 0.0]);
            let (s, c) = eight.sin_cos(quarters);
            for k in 0..8 {
                let (s1, c1) = Lane::sin_cos(eight.array()[k], quarters);
                prop_assert_eq!(s.array()[k].to_bits(), s1.to_bits());
                prop_assert_eq!(c.array()[k].to_bits(), c1.to_bits());
            }
        }
    }
}
