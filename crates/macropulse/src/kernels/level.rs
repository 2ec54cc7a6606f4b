//! What the processor at hand can do.

use std::sync::OnceLock;

/// A set of instructions that kernels are compiled for, each including those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
pub(crate) enum Level {
    /// What every processor of the target has.
    Plain,
    /// x86-64 with AVX2 and BMI (2013).
    Avx2,
    /// x86-64 with AVX-512 F, BW, CD, DQ, VL, VBMI2 and VPOPCNTDQ (2019).
    Avx512,
}

impl Level {
    /// The widest one that this processor has.
    #[inline]
    pub(crate) fn here() -> Self {
        #[cfg(test)]
        if let Some(forced) = forced::level() {
            return forced;
        }
        static HERE: OnceLock<Level> = OnceLock::new();
        *HERE.get_or_init(Self::detect)
    }

    #[cfg(target_arch = "x86_64")]
    fn detect() -> Self {
        macro_rules! has {
            ($($feature:tt)*) => { $(is_x86_feature_detected!($feature))&&* };
        }
        if !has!("avx2" "bmi1" "bmi2" "lzcnt" "popcnt") {
            Self::Plain
        } else if !has!("avx512f" "avx512bw" "avx512cd" "avx512dq" "avx512vl" "avx512vbmi2" "avx512vpopcntdq")
        {
            Self::Avx2
        } else {
            Self::Avx512
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn detect() -> Self {
        Self::Plain
    }
}

/// Compiles a function once for each [`Level`], and calls the widest version there is.
///
/// What the function calls takes part only if it is inlined: mark it `#[inline(always)]`.
macro_rules! on_every_level {
    (
        $(#[$note:meta])*
        $seen:vis fn $name:ident($($arg:ident: $kind:ty),* $(,)?) $(-> $out:ty)? $body:block
    ) => {
        $(#[$note])*
        $seen fn $name($($arg: $kind),*) $(-> $out)? {
            #[inline(always)]
            fn plain($($arg: $kind),*) $(-> $out)? $body

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
            fn avx2($($arg: $kind),*) $(-> $out)? {
                plain($($arg),*)
            }

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
            #[target_feature(enable = "avx512f,avx512bw,avx512cd,avx512dq,avx512vl")]
            #[target_feature(enable = "avx512vbmi2,avx512vpopcntdq")]
            fn avx512($($arg: $kind),*) $(-> $out)? {
                plain($($arg),*)
            }

            match $crate::kernels::level::Level::here() {
                // SAFETY: the processor was asked for each of these features.
                #[cfg(target_arch = "x86_64")]
                $crate::kernels::level::Level::Avx512 => unsafe { avx512($($arg),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                $crate::kernels::level::Level::Avx2 => unsafe { avx2($($arg),*) },
                _ => plain($($arg),*),
            }
        }
    };
}

pub(crate) use on_every_level;

/// Lets a test choose the level.
#[cfg(test)]
pub(crate) mod forced {
    use super::Level;
    use std::cell::Cell;

    thread_local! {
        static LEVEL: Cell<Option<Level>> = const { Cell::new(None) };
    }

    pub(super) fn level() -> Option<Level> {
        LEVEL.get()
    }

    /// What `run` gives on this thread at each level that the processor has, the plain one first.
    pub(crate) fn at_each_level<T>(mut run: impl FnMut() -> T) -> Vec<(Level, T)> {
        let highest = Level::here();
        let levels = [Level::Plain, Level::Avx2, Level::Avx512];
        let mut results = Vec::new();
        for level in levels.into_iter().filter(|level| *level <= highest) {
            LEVEL.set(Some(level));
            results.push((level, run()));
            LEVEL.set(None);
        }
        results
    }
}
