//! Records: the input of a receiver beside its shot log.

use crate::{Beats, Histograms, Samples, Taps, Ticks};

/// Declares the kinds of record: variant and type, its name in the plural, one of the things that are counted in it,
/// and the ending of its files.
macro_rules! kinds {
    ($($(#[$doc:meta])* $Kind:ident, $name:literal, $one:literal, $ending:literal;)+) => {
        /// A kind of record.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum RecordKind {
            $($(#[$doc])* $Kind,)+
        }

        impl RecordKind {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$Kind,)+];

            /// Its name in the plural, as in files, formats and messages.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$Kind => $name,)+ }
            }

            /// The things that are counted in it, in the singular.
            pub fn counted(self) -> &'static str {
                match self { $(Self::$Kind => $one,)+ }
            }

            /// The ending of its files in their binary form.
            pub fn ending(self) -> &'static str {
                match self { $(Self::$Kind => $ending,)+ }
            }
        }

        /// The input of a receiver beside its shot log.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Record<'a> {
            $($(#[$doc])* $Kind(&'a $Kind),)+
        }

        impl Record<'_> {
            /// Returns the kind of this record.
            pub fn kind(&self) -> RecordKind {
                match self { $(Self::$Kind(_) => RecordKind::$Kind,)+ }
            }
        }

        /// The same, owned.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Given {
            $($(#[$doc])* $Kind($Kind),)+
        }

        impl<'a> From<&'a Given> for Record<'a> {
            fn from(given: &'a Given) -> Self {
                match given { $(Given::$Kind(record) => Self::$Kind(record),)+ }
            }
        }

        $(impl<'a> From<&'a $Kind> for Record<'a> {
            fn from(record: &'a $Kind) -> Self {
                Self::$Kind(record)
            }
        })+
    };
}

kinds! {
    /// Ticks of time-to-digital converters.
    Ticks, "ticks", "tick", "mpt";
    /// Samples of analogue-to-digital converters.
    Samples, "samples", "sample", "mpw";
    /// Histograms of counters, added up over the pulses of a burst.
    Histograms, "histograms", "count", "mph";
    /// Taps of lock-in detectors.
    Taps, "taps", "tap", "mpa";
    /// Beats of coherent detectors.
    Beats, "beats", "peak", "mpb";
}

impl RecordKind {
    /// The names of all kinds, with commas between them and `word` before the last one.
    pub fn listed(word: &str) -> String {
        let names: Vec<&str> = Self::ALL.iter().map(|kind| kind.name()).collect();
        let (others, last) = names.split_at(names.len() - 1);
        format!("{} {word} {}", others.join(", "), last.concat())
    }

    /// True if there is a record of each shot, made of the light of that shot alone. Ticks and samples are of a time
    /// in which light of many shots may arrive.
    pub fn is_by_shot(self) -> bool {
        !matches!(self, Self::Ticks | Self::Samples)
    }
}
