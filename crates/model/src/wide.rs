//! Eight samples side by side, in the registers of the machine that runs.

use crate::lane::{Kernel, Lane, REDUCTION_LIMIT, sin_cos_large, sin_cos_of_rest};
use pulp::{Arch, Simd, WithSimd};
use std::ops::{Add, Mul, Neg, Sub};

/// A number of eight samples in memory, a cache line.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct F64x8(pub [f64; 8]);

impl F64x8 {
    pub(crate) const ZERO: Self = Self([0.0; 8]);
    pub(crate) const ONE: Self = Self([1.0; 8]);
}

/// As many samples as a register holds: eight, four or one.
///
/// It carries the proof that the machine has the instructions; every operation is one of them.
#[derive(Clone, Copy)]
// What does not fit the registers goes to the stack: there, too, as whole cache lines.
#[repr(align(64))]
pub(crate) struct Wide<S: Simd> {
    simd: S,
    x: S::f64s,
}

/// An instruction set, and which register of an [`F64x8`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part<S> {
    simd: S,
    part: usize,
}

impl<S: Simd> Wide<S> {
    #[inline(always)]
    fn with(self, x: S::f64s) -> Self {
        Self { simd: self.simd, x }
    }
}

impl<S: Simd> Add for Wide<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.with(self.simd.add_f64s(self.x, o.x))
    }
}

impl<S: Simd> Sub for Wide<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.with(self.simd.sub_f64s(self.x, o.x))
    }
}

impl<S: Simd> Mul for Wide<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.with(self.simd.mul_f64s(self.x, o.x))
    }
}

impl<S: Simd> Neg for Wide<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // Not the library's: it is not always inlined.
        self.flipped(-0.0)
    }
}

impl<S: Simd> Lane for Wide<S> {
    type At = Part<S>;
    type Cell = F64x8;
    // A power of two.
    const PARTS: usize = 8 / S::F64_LANES;
    #[inline(always)]
    fn part(at: Part<S>, part: usize) -> Part<S> {
        Part {
            simd: at.simd,
            part,
        }
    }
    #[inline(always)]
    fn splat(at: Part<S>, x: f64) -> Self {
        Self {
            simd: at.simd,
            x: at.simd.splat_f64s(x),
        }
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        self.with(self.simd.splat_f64s(x))
    }
    #[inline(always)]
    fn read(at: Part<S>, cell: &F64x8) -> Self {
        Self {
            simd: at.simd,
            // The mask is no change; it spares the check of the index.
            x: S::as_simd_f64s(&cell.0).0[at.part & (Self::PARTS - 1)],
        }
    }
    #[inline(always)]
    fn write(self, at: Part<S>, cell: &mut F64x8) {
        S::as_mut_simd_f64s(&mut cell.0).0[at.part & (Self::PARTS - 1)] = self.x;
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self.with(self.simd.mul_add_f64s(self.x, a.x, b.x))
    }
    #[inline(always)]
    fn sin_cos(self, quarters: u64) -> (Self, Self) {
        let simd = self.simd;
        let (sine, cosine, shifted) = sin_cos_of_rest(self);
        // The integer stands in the low bits, where these sums are exact.
        let turned = simd.add_f64s(shifted.x, simd.splat_f64s(quarters as f64));
        let next = simd.add_f64s(turned, simd.splat_f64s(1.0));
        let (turned, next) = (
            simd.transmute_u64s_f64s(turned),
            simd.transmute_u64s_f64s(next),
        );
        let (one, two, none) = (simd.splat_u64s(1), simd.splat_u64s(2), simd.splat_u64s(0));
        let even = simd.equal_u64s(simd.and_u64s(turned, one), none);
        let sine_stays = simd.equal_u64s(simd.and_u64s(turned, two), none);
        let cosine_stays = simd.equal_u64s(simd.and_u64s(next, two), none);
        let a = simd.select_f64s(even, sine.x, cosine.x);
        let b = simd.select_f64s(even, cosine.x, sine.x);
        let s = simd.select_f64s(sine_stays, a, self.with(a).flipped(-0.0).x);
        let c = simd.select_f64s(cosine_stays, b, self.with(b).flipped(-0.0).x);
        let limit = simd.splat_f64s(REDUCTION_LIMIT);
        let small = simd.less_than_or_equal_f64s(simd.abs_f64s(self.x), limit);
        if simd.first_true_m64s(simd.not_m64s(small)) < S::F64_LANES {
            let [s, c] = again_where_large::<S>(self.x, [s, c], quarters);
            return (self.with(s), self.with(c));
        }
        (self.with(s), self.with(c))
    }
    #[inline(always)]
    fn sign(self) -> Self {
        let simd = self.simd;
        let (zero, one) = (simd.splat_f64s(0.0), simd.splat_f64s(1.0));
        let above = simd.select_f64s(simd.greater_than_f64s(self.x, zero), one, zero);
        let below = simd.select_f64s(simd.less_than_f64s(self.x, zero), one, zero);
        self.with(simd.sub_f64s(above, below))
    }
    #[inline(always)]
    fn flipped(self, sign: f64) -> Self {
        let sign = self.simd.splat_f64s(sign);
        self.with(self.simd.xor_f64s(self.x, sign))
    }
}

/// Two registers side by side: where eight samples take two, what is decided for one is decided for both.
#[derive(Clone, Copy)]
pub(crate) struct Two<S: Simd>(Wide<S>, Wide<S>);

impl<S: Simd> Add for Two<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0, self.1 + o.1)
    }
}

impl<S: Simd> Sub for Two<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self(self.0 - o.0, self.1 - o.1)
    }
}

impl<S: Simd> Mul for Two<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0, self.1 * o.1)
    }
}

impl<S: Simd> Neg for Two<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<S: Simd> Lane for Two<S> {
    type At = Part<S>;
    type Cell = F64x8;
    const PARTS: usize = Wide::<S>::PARTS / 2;
    #[inline(always)]
    fn part(at: Part<S>, part: usize) -> Part<S> {
        Wide::part(at, 2 * part)
    }
    #[inline(always)]
    fn splat(at: Part<S>, x: f64) -> Self {
        Self(Wide::splat(at, x), Wide::splat(at, x))
    }
    #[inline(always)]
    fn like(self, x: f64) -> Self {
        Self(self.0.like(x), self.1.like(x))
    }
    #[inline(always)]
    fn read(at: Part<S>, cell: &F64x8) -> Self {
        let next = Wide::part(at, at.part + 1);
        Self(Wide::read(at, cell), Wide::read(next, cell))
    }
    #[inline(always)]
    fn write(self, at: Part<S>, cell: &mut F64x8) {
        self.0.write(at, cell);
        self.1.write(Wide::part(at, at.part + 1), cell);
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_add(a.0, b.0), self.1.mul_add(a.1, b.1))
    }
    #[inline(always)]
    fn sin_cos(self, quarters: u64) -> (Self, Self) {
        let (s, c) = self.0.sin_cos(quarters);
        let (next_s, next_c) = self.1.sin_cos(quarters);
        (Self(s, next_s), Self(c, next_c))
    }
    #[inline(always)]
    fn sign(self) -> Self {
        Self(self.0.sign(), self.1.sign())
    }
    #[inline(always)]
    fn flipped(self, sign: f64) -> Self {
        Self(self.0.flipped(sign), self.1.flipped(sign))
    }
}

/// Replaces sine and cosine of the angles beyond the reduction's limit; they are rare, and done one by one.
#[cold]
#[inline(never)]
fn again_where_large<S: Simd>(x: S::f64s, sc: [S::f64s; 2], quarters: u64) -> [S::f64s; 2] {
    let [mut s, mut c] = sc;
    let x: &[f64] = bytemuck::cast_slice(std::slice::from_ref(&x));
    let sines: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut s));
    let cosines: &mut [f64] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut c));
    for ((&x, s), c) in x.iter().zip(sines).zip(cosines) {
        if x.abs() <= REDUCTION_LIMIT {
            continue;
        }
        (*s, *c) = sin_cos_large(x, quarters);
    }
    [s, c]
}

/// Runs a kernel over eight samples with the best instructions of this machine.
#[inline]
pub(crate) fn over_eight(kernel: &mut impl Kernel<F64x8>) {
    over_eight_on(Arch::new(), kernel);
}

/// The same with these instructions.
#[inline]
pub(crate) fn over_eight_on(arch: Arch, kernel: &mut impl Kernel<F64x8>) {
    match arch {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(simd, Eight(kernel)),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Simd::vectorize(simd, EightByTwo(kernel)),
        #[cfg(target_arch = "x86_64")]
        _ => Simd::vectorize(pulp::Scalar, Eight(kernel)),
        #[cfg(not(target_arch = "x86_64"))]
        _ => arch.dispatch(Eight(kernel)),
    }
}

/// Runs a kernel over one sample, with fused multiply-add where the machine has it.
#[inline]
pub(crate) fn over_one(kernel: &mut impl Kernel<f64>) {
    match Arch::new() {
        // One sample has no use for wider registers; with the star it runs on V3.
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(*simd, One(kernel)),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Simd::vectorize(simd, One(kernel)),
        _ => Simd::vectorize(pulp::Scalar, One(kernel)),
    }
}

// Structs, not closures: only their own method is certain to be inlined into the function that has the instructions.

struct Eight<'a, K>(&'a mut K);

impl<K: Kernel<F64x8>> WithSimd for Eight<'_, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        align_spills();
        self.0.run::<Wide<S>>(Part { simd, part: 0 });
    }
}

#[cfg(target_arch = "x86_64")]
struct EightByTwo<'a, K>(&'a mut K);

#[cfg(target_arch = "x86_64")]
impl<K: Kernel<F64x8>> WithSimd for EightByTwo<'_, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        align_spills();
        self.0.run::<Two<S>>(Part { simd, part: 0 });
    }
}

/// One number at the alignment of a register on the stack: only then does the compiler align what it spills there, too. A
/// register across two cache lines is slow to store and slower to read back.
#[inline(always)]
fn align_spills() {
    let mut aligned = F64x8::ZERO;
    std::hint::black_box(&mut aligned);
}

struct One<'a, K>(&'a mut K);

impl<K: Kernel<f64>> WithSimd for One<'_, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.0.run::<f64>(());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::architectures;
    use proptest::prelude::*;

    /// Sine, cosine, sign and the fused product of eight numbers.
    struct Functions {
        x: F64x8,
        quarters: u64,
        out: [F64x8; 4],
    }

    impl Kernel<F64x8> for Functions {
        #[inline(always)]
        fn run<T: Lane<Cell = F64x8>>(&mut self, at: T::At) {
            for part in 0..T::PARTS {
                let at = T::part(at, part);
                let x = T::read(at, &self.x);
                let (s, c) = x.sin_cos(self.quarters);
                let [sine, cosine, sign, fused] = &mut self.out;
                s.write(at, sine);
                c.write(at, cosine);
                x.sign().write(at, sign);
                s.mul_add(x, -c).write(at, fused);
            }
        }
    }

    /// Registers the decisions are repeated for.
    struct Repeats(usize);

    impl Kernel<F64x8> for Repeats {
        #[inline(always)]
        fn run<T: Lane<Cell = F64x8>>(&mut self, _: T::At) {
            self.0 = T::PARTS;
        }
    }

    #[test]
    fn kernels_over_eight_run_once_wherever_two_registers_or_one_hold_them() {
        for arch in architectures() {
            let mut repeats = Repeats(0);
            over_eight_on(arch, &mut repeats);
            let expected = if matches!(arch, Arch::Scalar) { 8 } else { 1 };
            assert_eq!(repeats.0, expected, "{arch:?}");
        }
    }

    proptest! {
        #[test]
        fn identity_eight_lanes_give_the_bits_of_one(x in -10.0..10.0_f64, quarters in 0..4_u64) {
            let eight = [x, -x, x + 1.0, x - 1.0, x * 0.5, x * 3.0, 1.0e7 * x, 0.0];
            for arch in architectures() {
                let mut functions = Functions { x: F64x8(eight), quarters, out: [F64x8::ZERO; 4] };
                over_eight_on(arch, &mut functions);
                for (k, x) in eight.into_iter().enumerate() {
                    let (s, c) = Lane::sin_cos(x, quarters);
                    let expected = [s, c, Lane::sign(x), s.mul_add(x, -c)];
                    for (found, expected) in functions.out.iter().zip(expected) {
                        prop_assert_eq!(found.0[k].to_bits(), expected.to_bits());
                    }
                }
            }
        }
    }
}
