//! Roles that the text of the paper gives the blocks of its Fig. 7, read from its section 3.

/// End of the link that a block belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Emitter and channel: they make the light that arrives.
    Transmitter,
    /// The detector: it responds to that light.
    Receiver,
}

/// A kind of block of Fig. 7.
#[derive(Debug, Clone, Copy)]
pub struct Role {
    /// Its colour.
    pub block: &'static str,
    /// Part it belongs to, by the quantity that the text says it computes.
    pub belongs_to: Part,
    /// Part for which the text repeats it in the proposed lidar.
    pub repeated_for: Part,
}

/// Returns the roles as printed. Pulses and noise belong to the emitter (green). The probability of firing
/// over time follows from the channel (upper blue). Jitter (lower blue) and the time of firing (red) belong
/// to the detector. The text then repeats the first two "for the receiver part", the last two "for the
/// transmitter part".
pub(super) fn printed() -> Vec<Role> {
    use Part::{Receiver, Transmitter};
    [
        ("green", Transmitter, Receiver),
        ("upper blue", Transmitter, Receiver),
        ("lower blue", Receiver, Transmitter),
        ("red", Receiver, Transmitter),
    ]
    .map(|(block, belongs_to, repeated_for)| Role { block, belongs_to, repeated_for })
    .to_vec()
}
