//! Numbers side by side: one operation on all `f32` of a packet of rays, or of the boxes that lie side by
//! side in a hierarchy.

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

/// Registers that hold numbers at one level.
pub(super) trait Registers {
    /// One for each ray of a packet.
    type Rays: Wide<LANES>;
    /// One for each box of a node.
    type Boxes: Wide<SIDE>;

    /// The greatest of the lanes in `set`, none of them NaN; minus infinity if there are none.
    #[inline(always)]
    fn greatest(rays: Self::Rays, set: u32) -> f32 {
        let mut lanes = [0.0; LANES];
        rays.store(&mut lanes);
        for (lane, value) in lanes.iter_mut().enumerate() {
            *value = if set >> lane & 1 == 1 { *value } else { f32::NEG_INFINITY };
        }
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                let (one, other) = (lanes[lane], lanes[lane + half]);
                lanes[lane] = if one > other { one } else { other };
            }
            half /= 2;
        }
        lanes[0]
    }

    /// The same of each of some.
    #[inline(always)]
    fn greatest_of_each(rays: &[Self::Rays; SIDE], set: u32) -> [f32; SIDE] {
        let mut greatest = [0.0; SIDE];
        for (greatest, rays) in greatest.iter_mut().zip(rays) {
            *greatest = Self::greatest(*rays, set);
        }
        greatest
    }
}

/// A task for the widest registers there are.
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

/// Has an element brought into the nearest cache that is asked for soon; nothing else happens.
#[inline(always)]
pub(crate) fn fetch<T>(values: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(value) = values.get(index) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let first: *const i8 = std::ptr::from_ref(value).cast();
        // SAFETY: nothing is read; and all of this is within the element.
        let fetch = |offset| unsafe { _mm_prefetch::<_MM_HINT_T0>(first.add(offset)) };
        (0..size_of::<T>()).step_by(64).for_each(fetch);
        fetch(size_of::<T>().saturating_sub(1));
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (values, index);
}

/// The level of any processor.
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

        #[inline(always)]
        fn greatest(rays: Twice, set: u32) -> f32 {
            rays.greatest_of_halves(set).greatest_lane()
        }

        #[inline(always)]
        fn greatest_of_each(rays: &[Twice; SIDE], set: u32) -> [f32; SIDE] {
            greatest_of_each(rays, set)
        }
    }

    /// All bits of each lane in `set`.
    #[inline(always)]
    fn mask(set: u32) -> __m256 {
        // SAFETY: the processor has the feature, as for every value of this type.
        unsafe {
            let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let of_set = _mm256_and_si256(_mm256_set1_epi32(set as i32), lanes);
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(of_set, lanes))
        }
    }

    /// The registers of AVX-512.
    pub(in super::super) struct Avx512;

    impl Registers for Avx512 {
        type Rays = Sixteen;
        type Boxes = Eight;

        #[inline(always)]
        fn greatest(rays: Sixteen, set: u32) -> f32 {
            rays.greatest_of_halves(set).greatest_lane()
        }

        #[inline(always)]
        fn greatest_of_each(rays: &[Sixteen; SIDE], set: u32) -> [f32; SIDE] {
            greatest_of_each(rays, set)
        }
    }

    /// Registers for the rays of a packet, of two halves.
    trait Halves: Copy {
        /// The greater of each two lanes of `set` that are [`SIDE`] apart; minus infinity where neither is in it.
        fn greatest_of_halves(self, set: u32) -> Eight;
    }

    /// The greatest of the lanes in `set` of each of some.
    #[inline(always)]
    fn greatest_of_each<R: Halves>(rays: &[R; SIDE], set: u32) -> [f32; SIDE] {
        let mut halves = [Eight::splat(0.0); SIDE];
        for (half, rays) in halves.iter_mut().zip(rays) {
            *half = rays.greatest_of_halves(set);
        }
        let [a, b, c, d, e, f, g, h] = halves;
        let (low, high) = (a.with(b).and(c.with(d)), e.with(f).and(g.with(h)));
        let mut greatest = [0.0; SIDE];
        // SAFETY: the processor has the feature, as for every value of this type.
        unsafe {
            let first = Eight(_mm256_permute2f128_ps::<0x20>(low.0, high.0));
            let last = Eight(_mm256_permute2f128_ps::<0x31>(low.0, high.0));
            first.most(last).store(&mut greatest);
        }
        greatest
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

    // Values of these types are made and used only inside functions that are called after the processor was
    // asked for the feature. Loads and stores ask for no alignment.

    const _: () = assert!(SIDE == 8 && LANES == 16);

    impl Eight {
        /// Its lanes where all bits of a mask are set, those of the other where none is.
        #[inline(always)]
        fn where_set(self, mask: __m256, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask) })
        }

        /// In each half the greater ones of two pairs of lanes, those of the other behind each: halves both.
        #[inline(always)]
        fn with(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            unsafe {
                let low = Self(_mm256_unpacklo_ps(self.0, other.0));
                low.most(Self(_mm256_unpackhi_ps(self.0, other.0)))
            }
        }

        /// The same of pairs that [`Self::with`] made.
        #[inline(always)]
        fn and(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            unsafe {
                let (one, other) = (_mm256_castps_pd(self.0), _mm256_castps_pd(other.0));
                let low = Self(_mm256_castpd_ps(_mm256_unpacklo_pd(one, other)));
                low.most(Self(_mm256_castpd_ps(_mm256_unpackhi_pd(one, other))))
            }
        }

        #[inline(always)]
        fn greatest_lane(self) -> f32 {
            // SAFETY: the processor has the feature, as for every value of this type.
            unsafe {
                let four =
                    _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
                let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
                _mm_cvtss_f32(_mm_max_ss(two, _mm_movehdup_ps(two)))
            }
        }
    }

    impl Wide<SIDE> for Eight {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm256_set1_ps(value) })
        }

        #[inline(always)]
        fn load(values: &[f32; SIDE]) -> Self {
            // SAFETY: the array has eight numbers, and the processor has the feature.
            Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; SIDE]) {
            // SAFETY: the array has eight numbers, and the processor has the feature.
            unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm256_sub_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm256_mul_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn least(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm256_min_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn most(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm256_max_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            // SAFETY: the processor has the feature, as for every value of this type.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
        }

        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            // SAFETY: the processor has the feature, as for every value of this type.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) as u32 }
        }
    }

    impl Halves for Twice {
        #[inline(always)]
        fn greatest_of_halves(self, set: u32) -> Eight {
            let none = Eight::splat(f32::NEG_INFINITY);
            let high = self.1.where_set(mask(set >> SIDE), none);
            self.0.where_set(mask(set), none).most(high)
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
            // SAFETY: the array has sixteen numbers, and the processor has the feature.
            unsafe { Self(Eight(_mm256_loadu_ps(start)), Eight(_mm256_loadu_ps(start.add(SIDE)))) }
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; LANES]) {
            let start = values.as_mut_ptr();
            // SAFETY: the array has sixteen numbers, and the processor has the feature.
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

    impl Halves for Sixteen {
        #[inline(always)]
        fn greatest_of_halves(self, set: u32) -> Eight {
            // SAFETY: the processor has the feature, as for every value of this type.
            unsafe {
                let none = _mm512_set1_ps(f32::NEG_INFINITY);
                let of_set = _mm512_mask_blend_ps(set as u16, none, self.0);
                let low = Eight(_mm512_castps512_ps256(of_set));
                low.most(Eight(_mm512_extractf32x8_ps::<1>(of_set)))
            }
        }
    }

    impl Wide<LANES> for Sixteen {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm512_set1_ps(value) })
        }

        #[inline(always)]
        fn load(values: &[f32; LANES]) -> Self {
            // SAFETY: the array has sixteen numbers, and the processor has the feature.
            Self(unsafe { _mm512_loadu_ps(values.as_ptr()) })
        }

        #[inline(always)]
        fn store(self, values: &mut [f32; LANES]) {
            // SAFETY: the array has sixteen numbers, and the processor has the feature.
            unsafe { _mm512_storeu_ps(values.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm512_sub_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm512_mul_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn least(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm512_min_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn most(self, other: Self) -> Self {
            // SAFETY: the processor has the feature, as for every value of this type.
            Self(unsafe { _mm512_max_ps(self.0, other.0) })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            // SAFETY: the processor has the feature, as for every value of this type.
            u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) })
        }

        #[inline(always)]
        fn below(self, other: Self) -> u32 {
            // SAFETY: the processor has the feature, as for every value of this type.
            u32::from(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use macropulse_codec::level::forced::at_each_level;
    use proptest::prelude::*;

    /// Asks for the greatest of some lanes.
    struct Greatest<'a> {
        values: &'a [[f32; LANES]; SIDE],
        set: u32,
        found: &'a mut [[f32; SIDE]; 2],
    }

    impl Task for Greatest<'_> {
        #[inline(always)]
        fn run<R: Registers>(&mut self) {
            let mut rays = [R::Rays::splat(0.0); SIDE];
            for ((rays, values), found) in rays.iter_mut().zip(self.values).zip(&mut self.found[0])
            {
                *rays = R::Rays::load(values);
                *found = R::greatest(*rays, self.set);
            }
            self.found[1] = R::greatest_of_each(&rays, self.set);
        }
    }

    proptest! {
        #[test]
        fn every_level_tells_the_greatest_of_a_set(
            values in proptest::array::uniform8(proptest::array::uniform16(-1e3..1e3_f32)),
            set in 0..1_u32 << LANES,
        ) {
            let of_set = |values: &[f32; LANES]| {
                let lanes = (0..LANES).filter(|lane| set >> lane & 1 == 1);
                lanes.map(|lane| values[lane]).fold(f32::NEG_INFINITY, f32::max)
            };
            let expected = values.each_ref().map(of_set);
            for (level, found) in at_each_level(|| {
                let mut found = [[0.0; SIDE]; 2];
                on_level(Greatest { values: &values, set, found: &mut found });
                found
            }) {
                prop_assert_eq!(found, [expected; 2], "{:?}", level);
            }
        }
    }
}
