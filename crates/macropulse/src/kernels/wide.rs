//! Numbers side by side: one operation on as many `f32` as a packet has rays, or as boxes lie side
//! by side in a hierarchy.

use macropulse_codec::level::Level;

/// Rays of a packet.
pub(crate) const LANES: usize = 16;

/// Boxes of a node, and triangles of a block.
pub(super) const SIDE: usize = 8;

/// `N` numbers of 32 bits. Sets of lanes are bits, lane 0 the lowest.
///
/// Implementations differ in speed, never in a result: each operation is one of IEEE 754.
pub(super) trait Wide<const N: usize>: Copy {
    /// `value` in every lane.
    fn splat(value: f32) -> Self;
    fn load(values: &[f32; N]) -> Self;
    fn store(self, values: &mut [f32; N]);
    fn minus(self, other: Self) -> Self;
    fn times(self, other: Self) -> Self;
    /// The lesser; `other` if either is NaN.
    fn least(self, other: Self) -> Self;
    /// The greater; `other` if either is NaN.
    fn most(self, other: Self) -> Self;
    /// Lanes in which `self` ≤ `other`; not those with NaN.
    fn at_most(self, other: Self) -> u32;
    /// Lanes in which `self` < `other`; not those with NaN.
    fn below(self, other: Self) -> u32;
}

/// What numbers are held in at one level.
pub(super) trait Registers {
    /// One for each ray of a packet.
    type Rays: Wide<LANES>;
    /// One for each box of a node.
    type Boxes: Wide<SIDE>;
}

/// What is done with the widest registers there are.
pub(super) trait Task {
    /// It takes part in what a level has only if it is inlined.
    fn run<R: Registers>(&mut self);
}

/// Runs a task, compiled for each [`Level`], on the widest that the processor has.
#[inline]
pub(super) fn on_level<T: Task>(mut task: T) {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    fn avx2<T: Task>(task: &mut T) {
        task.run::<Avx2>();
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
    #[target_feature(enable = "avx512f,avx512bw,avx512cd,avx512dq,avx512vl")]
    fn avx512<T: Task>(task: &mut T) {
        task.run::<Avx512>();
    }

    match Level::here() {
        // SAFETY: the processor was asked for each of these features.
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => unsafe { avx512(&mut task) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => unsafe { avx2(&mut task) },
        _ => task.run::<Any>(),
    }
}

/// What any processor can do.
#[derive(Clone, Copy)]
pub(super) struct Plain<const N: usize>([f32; N]);

/// No registers but those that every processor has.
pub(super) struct Any;

impl Registers for Any {
    type Rays = Plain<LANES>;
    type Boxes = Plain<SIDE>;
}

impl<const N: usize> Plain<N> {
    #[inline(always)]
    fn each(self, other: Self, run: impl Fn(f32, f32) -> f32) -> Self {
        let mut result = self.0;
        for (result, other) in result.iter_mut().zip(&other.0) {
            *result = run(*result, *other);
        }
        Self(result)
    }

    #[inline(always)]
    fn lanes(self, other: Self, holds: impl Fn(f32, f32) -> bool) -> u32 {
        let pairs = self.0.iter().zip(&other.0).enumerate();
        pairs.fold(0, |set, (lane, (a, b))| set | (u32::from(holds(*a, *b)) << lane))
    }
}

impl<const N: usize> Wide<N> for Plain<N> {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    fn load(values: &[f32; N]) -> Self {
        Self(*values)
    }

    #[inline(always)]
    fn store(self, values: &mut [f32; N]) {
        *values = self.0;
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.each(other, |a, b| a - b)
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self.each(other, |a, b| a * b)
    }

    #[inline(always)]
    fn least(self, other: Self) -> Self {
        self.each(other, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn most(self, other: Self) -> Self {
        self.each(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.lanes(other, |a, b| a <= b)
    }

    #[inline(always)]
    fn below(self, other: Self) -> u32 {
        self.lanes(other, |a, b| a < b)
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

/// Compilers make poor masks of loops of comparisons, so these are spelled out.
#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{LANES, Registers, SIDE, Wide};
    use std::arch::x86_64::*;

    /// The registers of AVX2.
    pub(in super::super) struct Avx2;

    impl Registers for Avx2 {
        type Rays = Twice;
        type Boxes = Eight;
    }

    /// The registers of AVX-512.
    pub(in super::super) struct Avx512;

    impl Registers for Avx512 {
        type Rays = Sixteen;
        type Boxes = Eight;
    }

    /// A register of AVX2. Only for functions that are compiled for it, as the two below.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Eight(__m256);

    /// Two registers of AVX2.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Twice(Eight, Eight);

    /// A register of AVX-512.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Sixteen(__m512);

    // SAFETY, for each block below: values of these types are made and used only inside
    // functions that are called after the processor was asked for the feature; loads and stores
    // stay within an array of as many numbers and ask for no alignment.

    const _: () = assert!(SIDE == 8 && LANES == 16);

    impl Wide<SIDE> for Eight {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            Self(unsafe { _mm256_set1_ps(value) })
        }

        #[inline(always)]
        fn load(values: &[f32; SIDE]) -> Self {
            Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; SIDE]) {
            unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            Self(unsafe { _mm256_sub_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            Self(unsafe { _mm256_mul_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn least(self, other: Self) -> Self {
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn most(self, other: Self) -> Self {
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
        }

        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
        }
    }

    impl Wide<LANES> for Twice {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            let eight = Eight::splat(value);
            Self(eight, eight)
        }

        #[inline(always)]
        fn load(values: &[f32; LANES]) -> Self {
            let start = values.as_ptr();
            unsafe { Self(Eight(_mm256_loadu_ps(start)), Eight(_mm256_loadu_ps(start.add(SIDE)))) }
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; LANES]) {
            let start = values.as_mut_ptr();
            unsafe {
                _mm256_storeu_ps(start, self.0.0);
                _mm256_storeu_ps(start.add(SIDE), self.1.0);
            }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            Self(self.0.minus(other.0), self.1.minus(other.1))
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            Self(self.0.times(other.0), self.1.times(other.1))
        }

        #[inline(always)]
        fn least(self, other: Self) -> Self {
            Self(self.0.least(other.0), self.1.least(other.1))
        }

        #[inline(always)]
        fn most(self, other: Self) -> Self {
            Self(self.0.most(other.0), self.1.most(other.1))
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            self.0.at_most(other.0) | (self.1.at_most(other.1) << SIDE)
        }

        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            self.0.below(other.0) | (self.1.below(other.1) << SIDE)
        }
    }

    impl Wide<LANES> for Sixteen {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            Self(unsafe { _mm512_set1_ps(value) })
        }

        #[inline(always)]
        fn load(values: &[f32; LANES]) -> Self {
            Self(unsafe { _mm512_loadu_ps(values.as_ptr()) })
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; LANES]) {
            unsafe { _mm512_storeu_ps(values.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            Self(unsafe { _mm512_sub_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            Self(unsafe { _mm512_mul_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn least(self, other: Self) -> Self {
            Self(unsafe { _mm512_min_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn most(self, other: Self) -> Self {
            Self(unsafe { _mm512_max_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) })
        }

        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
        }
    }
}
