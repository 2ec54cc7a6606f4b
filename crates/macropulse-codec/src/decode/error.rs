//! Why a receiver cannot decode what it is given.

/// Input of a receiver that breaks what was agreed: one sentence with what is wrong and what to do. Light
/// that cannot be decoded is no error; it is counted in [`Returns`](super::Returns).
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting of the receiver is outside its limits.
    #[error("`{setting}` of the receiver is {value}; use {possible}")]
    Setting {
        /// Its name.
        setting: &'static str,
        /// Its value.
        value: String,
        /// Possible values, as the end of the sentence.
        possible: &'static str,
    },
    /// The range gate ends before it begins.
    #[error(
        "the range gate ends {farthest} ticks after firing, before it begins ({nearest}): swap the \
         two of `gate_ticks`"
    )]
    Gate {
        /// Nearest round trip, in ticks.
        nearest: u32,
        /// Farthest round trip, in ticks.
        farthest: u32,
    },
    /// A macropulse and the time in which it may come are more than is kept in memory.
    #[error(
        "{what} of {ticks} ticks is too long to be kept in memory; up to {possible} are possible: \
         use longer ticks or a shorter one"
    )]
    TooLong {
        /// Name of the thing that is too long, with its article.
        what: &'static str,
        /// How long it is, in ticks.
        ticks: u64,
        /// How long it may be, in ticks.
        possible: u64,
    },
    /// The receiver does not understand 0 bits that are sent as light.
    #[error("0 bits of this codebook are lit, which only a balanced receiver understands: use it")]
    LitZeros,
    /// A column is not as long as the ones beside it.
    #[error("the column `{column}` has {length} entries for {wanted} {of}: give one for each{or}")]
    Column {
        /// Its name.
        column: &'static str,
        /// Its length.
        length: usize,
        /// How long it should be.
        wanted: usize,
        /// Things that have an entry each, in the plural.
        of: &'static str,
        /// Alternative to the entries, as the end of the sentence.
        or: &'static str,
    },
    /// The ticks of a channel do not ascend.
    #[error(
        "tick number {place} is {tick} after {before}: sort the ticks of each channel, and give no \
         tick twice"
    )]
    TicksDoNotAscend {
        /// Place in the column.
        place: usize,
        /// The tick.
        tick: u32,
        /// The tick before it.
        before: u32,
    },
    /// The channels of the ticks do not ascend.
    #[error(
        "tick number {place} is of channel {channel}, after one of channel {before}: sort ticks by \
         channel first"
    )]
    ChannelsDoNotAscend {
        /// Place in the column.
        place: usize,
        /// The channel.
        channel: u16,
        /// The channel before it.
        before: u16,
    },
    /// A shot of the log was fired before the one in front of it.
    #[error("shot {shot} of the log was fired before shot {}: sort the log by time", shot - 1)]
    ShotsDoNotAscend {
        /// Place in the log.
        shot: usize,
    },
    /// The owned shots are not shots of the log.
    #[error(
        "the owned shots {start} to {end} are not within the {shots} shots of the log: let `owned` \
         begin no later than it ends, and end with the log at most"
    )]
    Owned {
        /// First owned shot.
        start: usize,
        /// The shot behind the last owned one.
        end: usize,
        /// Shots of the log.
        shots: usize,
    },
    /// A shot sent what the codebook does not have.
    #[error(
        "shot {shot} has the {what} {number}, but the codebook ends with {last}: decode with the \
         codebook that was sent with"
    )]
    NotInCodebook {
        /// Place in the log.
        shot: usize,
        /// `label` or `word`.
        what: &'static str,
        /// Which one.
        number: u16,
        /// The last one there is.
        last: u32,
    },
    /// A shot was fired when time cannot be counted.
    #[error(
        "shot {shot} was fired at {fired_at_fs} fs: its light comes later than is counted, which is \
         up to ±9.2e18 fs; count time from a later moment on"
    )]
    Time {
        /// Place in the log.
        shot: usize,
        /// When it was fired, fs.
        fired_at_fs: i64,
    },
    /// A shot was fired so long before or after the ticks that none can be of it.
    #[error(
        "shot {shot} was fired {ticks} ticks after the epoch of the ticks, which are counted up to \
         4294967295: decode shots that are so far apart one stretch of time after another"
    )]
    FarFromTicks {
        /// Place in the log.
        shot: usize,
        /// When it was fired, in ticks from the epoch on.
        ticks: i64,
    },
    /// A receiver of one kind of record was given another one.
    #[error("this receiver decodes {wants}, and is given {given}: use a receiver of {given}")]
    Record {
        /// Kind of record that it decodes.
        wants: &'static str,
        /// Kind of record that it is given.
        given: &'static str,
    },
    /// The channels of samples do not ascend.
    #[error(
        "channel number {place} of the samples is {channel}, after {before}: sort them by channel, \
         and give each channel once"
    )]
    SampledChannelsDoNotAscend {
        /// Place in the column.
        place: usize,
        /// The channel.
        channel: u16,
        /// The channel before it.
        before: u16,
    },
    /// The channels do not all have the same number of samples.
    #[error(
        "{codes} samples are not as many of each of {channels} channels: give all channels samples \
         of the same moments"
    )]
    UnevenSamples {
        /// Samples of all channels.
        codes: usize,
        /// Number of channels.
        channels: usize,
    },
    /// A shot was fired so long before or after the samples that none can be of it.
    #[error(
        "shot {shot} was fired {ticks} ticks after the first sample, further than the 4294967296 that \
         are counted: decode shots that are so far apart one stretch of time after another"
    )]
    FarFromSamples {
        /// Place in the log.
        shot: usize,
        /// When it was fired, in ticks from the first sample on.
        ticks: i64,
    },
    /// A detector that stops at its first photon counted more photons than laser pulses were sent.
    #[error(
        "shot {shot} has {counted} counts of {cycles} laser pulses, each of which stops the detector once: \
         set `cycles` right, or `pile_up` to none if the detector counts several photons of a pulse"
    )]
    MoreThanCycles {
        /// Place in the log.
        shot: usize,
        /// All its counts.
        counted: u64,
        /// Laser pulses accumulated.
        cycles: u32,
    },
    /// A shot is to be explained that is not in the log.
    #[error("shot {shot} is not in the log")]
    NoSuchShot {
        /// Its index.
        shot: usize,
    },
}
