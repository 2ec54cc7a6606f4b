//! Numbers side by side: one operation on as many `f32` as a packet has rays.

/// Rays of a packet.
pub(crate) const LANES: usize = 16;

/// [`LANES`] numbers of 32 bits. Sets of lanes are bits, lane 0 the lowest.
///
/// Implementations differ in speed, never in a result: each operation is one of IEEE 754.
pub(super) trait Wide: Copy {
    /// `value` in every lane.
    fn splat(value: f32) -> Self;
    fn load(values: &[f32; LANES]) -> Self;
    fn store(self, values: &mut [f32; LANES]);
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

/// What any processor can do.
#[derive(Clone, Copy)]
pub(super) struct Plain([f32; LANES]);

impl Plain {
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

impl Wide for Plain {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn load(values: &[f32; LANES]) -> Self {
        Self(*values)
    }

    #[inline(always)]
    fn store(self, values: &mut [f32; LANES]) {
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
    use super::{LANES, Wide};
    use std::arch::x86_64::*;

    /// Two registers of AVX2. Only for functions that are compiled for it.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx2([__m256; 2]);

    /// One register of AVX-512. Only for functions that are compiled for it.
    #[derive(Clone, Copy)]
    pub(in super::super) struct Avx512(__m512);

    // SAFETY, for each block below: values of the two types are made and used only inside
    // functions that are called after the processor was asked for the feature; loads and stores
    // stay within an array of `LANES` numbers and ask for no alignment.

    const _: () = assert!(LANES == 16);

    impl Wide for Avx2 {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            Self([unsafe { _mm256_set1_ps(value) }; 2])
        }

        #[inline(always)]
        fn load(values: &[f32; LANES]) -> Self {
            let start = values.as_ptr();
            Self(unsafe { [_mm256_loadu_ps(start), _mm256_loadu_ps(start.add(8))] })
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; LANES]) {
            let start = values.as_mut_ptr();
            unsafe {
                _mm256_storeu_ps(start, self.0[0]);
                _mm256_storeu_ps(start.add(8), self.0[1]);
            }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            let ([a, b], [c, d]) = (self.0, other.0);
            Self(unsafe { [_mm256_sub_ps(a, c), _mm256_sub_ps(b, d)] })
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            let ([a, b], [c, d]) = (self.0, other.0);
            Self(unsafe { [_mm256_mul_ps(a, c), _mm256_mul_ps(b, d)] })
        }

        #[inline(always)]
        fn least(self, other: Self) -> Self {
            let ([a, b], [c, d]) = (self.0, other.0);
            Self(unsafe { [_mm256_min_ps(a, c), _mm256_min_ps(b, d)] })
        }

        #[inline(always)]
        fn most(self, other: Self) -> Self {
            let ([a, b], [c, d]) = (self.0, other.0);
            Self(unsafe { [_mm256_max_ps(a, c), _mm256_max_ps(b, d)] })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            let ([a, b], [c, d]) = (self.0, other.0);
            unsafe {
                let low = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, c)) as u32;
                let high = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(b, d)) as u32;
                low | (high << 8)
            }
        }

        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            let ([a, b], [c, d]) = (self.0, other.0);
            unsafe {
                let low = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, c)) as u32;
                let high = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(b, d)) as u32;
                low | (high << 8)
            }
        }
    }

    impl Wide for Avx512 {
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
