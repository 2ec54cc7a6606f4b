//! Which instructions the wide loops use.
//!
//! Every loop gives the same bits on every level; levels differ in speed alone. For tests of that,
//! the environment variable `MACROPULSE_KERNELS` (`plain`, `avx2` or `avx512`) bounds the level of
//! a whole process, see [`asked_for`].

use std::sync::OnceLock;

/// A set of instructions that kernels are compiled for, each including those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// The instructions that every processor of the target has.
    Plain,
    /// x86-64 with AVX2 and BMI (2013).
    Avx2,
    /// x86-64 with AVX-512 F, BW, CD, DQ, VL, VBMI2 and VPOPCNTDQ (2019).
    Avx512,
}

/// The environment variable that bounds the level.
pub const VARIABLE: &str = "MACROPULSE_KERNELS";

/// Returns the level that [`VARIABLE`] asks for; `None` if it is not set.
///
/// # Errors
/// If it names no level, or one that this processor does not have: one sentence with the remedy.
pub fn asked_for() -> Result<Option<Level>, String> {
    let Some(typed) = std::env::var_os(VARIABLE) else { return Ok(None) };
    let typed = typed.to_string_lossy();
    let Some(level) = Level::ALL.into_iter().find(|level| level.name() == typed) else {
        return Err(format!(
            "{VARIABLE}={typed} is no level: use plain, avx2 or avx512, or unset it"
        ));
    };
    match level <= Level::detect() {
        true => Ok(Some(level)),
        false => Err(format!(
            "{VARIABLE}={typed} asks for instructions that this processor does not have: use {} or \
             less, or unset it",
            Level::detect().name()
        )),
    }
}

impl Level {
    /// All levels, the plain one first.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Avx2, Self::Avx512];

    /// Its name in the environment variable.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// The level that loops use: what [`VARIABLE`] asks for, if the processor has it, else the
    /// widest one that it has.
    #[inline]
    pub fn here() -> Self {
        #[cfg(any(test, feature = "choose-level"))]
        if let Some(forced) = forced::level() {
            return forced;
        }
        static HERE: OnceLock<Level> = OnceLock::new();
        *HERE.get_or_init(|| asked_for().ok().flatten().unwrap_or_else(Self::detect))
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
/// Functions that it calls take part only if they are inlined: mark them `#[inline(always)]`.
#[macro_export]
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

            match $crate::level::Level::here() {
                // SAFETY: the processor was asked for each of these features.
                #[cfg(target_arch = "x86_64")]
                $crate::level::Level::Avx512 => unsafe { avx512($($arg),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                $crate::level::Level::Avx2 => unsafe { avx2($($arg),*) },
                _ => plain($($arg),*),
            }
        }
    };
}

/// Lets a test choose the level.
#[cfg(any(test, feature = "choose-level"))]
pub mod forced {
    use super::Level;
    use std::cell::Cell;

    thread_local! {
        static LEVEL: Cell<Option<Level>> = const { Cell::new(None) };
    }

    pub(super) fn level() -> Option<Level> {
        LEVEL.get()
    }

    /// Returns the results of `run` on this thread at each level that the processor has, the plain one first.
    pub fn at_each_level<T>(mut run: impl FnMut() -> T) -> Vec<(Level, T)> {
        let highest = Level::here();
        let mut results = Vec::new();
        for level in Level::ALL.into_iter().filter(|level| *level <= highest) {
            LEVEL.set(Some(level));
            results.push((level, run()));
            LEVEL.set(None);
        }
        results
    }
}
