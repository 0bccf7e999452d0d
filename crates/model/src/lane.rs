//! The lane: the kernels' one generic, for one sample (`f64`) and for a machine's registers of samples side by side.
//!
//! Products and sums that belong together are fused (`mul_add`), and sine and cosine are our own polynomial: so one
//! sample, eight samples and every instruction set give the same bits.

use std::ops::{Add, Mul, Neg, Sub};

/// Arithmetic of a sample, or of several that do not mix.
pub(crate) trait Lane:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + 'static
{
    /// Where a lane runs: the machine's instructions, and which samples of a cell are its own.
    type At: Copy;
    /// A number of every sample in memory.
    type Cell: Copy + 'static;
    /// Registers a cell takes.
    const PARTS: usize;
    /// Another of a cell's registers.
    fn part(at: Self::At, part: usize) -> Self::At;
    /// The same value in every sample.
    fn splat(at: Self::At, x: f64) -> Self;
    /// The same value in every sample, beside an existing lane.
    fn like(self, x: f64) -> Self;
    /// The lane's own samples of a cell.
    fn read(at: Self::At, cell: &Self::Cell) -> Self;
    /// Puts the lane's own samples into a cell.
    fn write(self, at: Self::At, cell: &mut Self::Cell);
    /// `self · a + b`, rounded once.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// Sine and cosine of an angle (rad) plus a number of quarter turns.
    fn sin_cos(self, quarters: u64) -> (Self, Self);
    /// -1, 0 or 1.
    fn sign(self) -> Self;
    /// The negative where `sign` is -0, itself where it is 0.
    fn flipped(self, sign: f64) -> Self;
}

/// An operation written once for every lane whose cells are `C`; it is compiled for several instruction sets.
pub(crate) trait Kernel<C> {
    /// The operation on all samples of the cells, one register (`T::part`) after another; inlined always, so that it is
    /// compiled with the caller's instructions.
    fn run<T: Lane<Cell = C>>(&mut self, at: T::At);
}

impl Lane for f64 {
    type At = ();
    type Cell = Self;
    const PARTS: usize = 1;
    #[inline(always)]
    fn part((): (), _: usize) {}
    #[inline(always)]
    fn splat((): (), x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn read((): (), cell: &f64) -> Self {
        *cell
    }
    #[inline(always)]
    fn write(self, (): (), cell: &mut f64) {
        *cell = self;
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
        sin_cos_large(self, quarters)
    }
    #[inline(always)]
    fn sign(self) -> Self {
        f64::from(i8::from(self > 0.0) - i8::from(self < 0.0))
    }
    #[inline(always)]
    fn flipped(self, sign: f64) -> Self {
        f64::from_bits(self.to_bits() ^ sign.to_bits())
    }
}

/// Sine and cosine of an angle too large for the reduction, or not a number.
#[cold]
#[inline(never)]
pub(crate) fn sin_cos_large(x: f64, quarters: u64) -> (f64, f64) {
    let (s, c) = f64::sin_cos(x);
    quarters_further(s, c, quarters)
}

/// Beyond this angle (rad) the three-part reduction loses digits, and the standard library takes over.
pub(crate) const REDUCTION_LIMIT: f64 = 1.0e6;
/// π/2 in three parts of 53 bits each; their fused products leave the reduced angle correct to its last bit.
const HALF_PI: [f64; 3] = [
    std::f64::consts::FRAC_PI_2,
    6.123_233_995_736_766e-17,
    -1.497_384_904_859_169_8e-33,
];
/// Adding 1.5 · 2^52 rounds to an integer and leaves it in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Sine and cosine of the rest of an angle after its whole quarter turns, on [-π/4, π/4], and those quarter turns in
/// the low bits of the third; the minimax polynomials of fdlibm (Sun Microsystems, 1993).
#[inline(always)]
pub(crate) fn sin_cos_of_rest<T: Lane>(x: T) -> (T, T, T) {
    let round = x.like(ROUND);
    let shifted = x.mul_add(x.like(std::f64::consts::FRAC_2_PI), round);
    let back = round - shifted;
    let r = back.mul_add(x.like(HALF_PI[0]), x);
    let r = back.mul_add(x.like(HALF_PI[1]), r);
    let r = back.mul_add(x.like(HALF_PI[2]), r);
    let z = r * r;
    let s = x
        .like(1.589_690_995_211_55e-10)
        .mul_add(z, x.like(-2.505_076_025_340_686_3e-8))
        .mul_add(z, x.like(2.755_731_370_707_006_8e-6))
        .mul_add(z, x.like(-1.984_126_982_985_795e-4))
        .mul_add(z, x.like(8.333_333_333_322_49e-3))
        .mul_add(z, x.like(-1.666_666_666_666_663_2e-1));
    let sine = (r * z).mul_add(s, r);
    let c = x
        .like(-1.135_964_755_778_819_5e-11)
        .mul_add(z, x.like(2.087_572_321_298_175e-9))
        .mul_add(z, x.like(-2.755_731_435_139_066_3e-7))
        .mul_add(z, x.like(2.480_158_728_947_673e-5))
        .mul_add(z, x.like(-1.388_888_888_887_411e-3))
        .mul_add(z, x.like(4.166_666_666_666_66e-2));
    let cosine = (z * z).mul_add(c, x.like(-0.5).mul_add(z, x.like(1.0)));
    (sine, cosine, shifted)
}

#[inline(always)]
fn sin_cos_reduced(x: f64, quarters: u64) -> (f64, f64) {
    let (sine, cosine, shifted) = sin_cos_of_rest(x);
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

/// A constant vector in every sample.
#[inline(always)]
pub(crate) fn splat<T: Lane>(at: T::At, a: [f64; 3]) -> V3<T> {
    [T::splat(at, a[0]), T::splat(at, a[1]), T::splat(at, a[2])]
}

/// A constant vector in every sample, beside an existing lane.
#[inline(always)]
pub(crate) fn like<T: Lane>(lane: T, a: [f64; 3]) -> V3<T> {
    [lane.like(a[0]), lane.like(a[1]), lane.like(a[2])]
}

/// Zero vector.
#[inline(always)]
pub(crate) fn zero<T: Lane>(at: T::At) -> V3<T> {
    [T::splat(at, 0.0); 3]
}

/// A vector from memory.
#[inline(always)]
pub(crate) fn read<T: Lane>(at: T::At, cells: &V3<T::Cell>) -> V3<T> {
    [
        T::read(at, &cells[0]),
        T::read(at, &cells[1]),
        T::read(at, &cells[2]),
    ]
}

/// A vector to memory.
#[inline(always)]
pub(crate) fn write<T: Lane>(at: T::At, a: V3<T>, cells: &mut V3<T::Cell>) {
    a[0].write(at, &mut cells[0]);
    a[1].write(at, &mut cells[1]);
    a[2].write(at, &mut cells[2]);
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
    }
}
