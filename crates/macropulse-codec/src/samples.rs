//! Samples: what analogue-to-digital converters hand to a receiver.

/// The samples of one stretch of time, those of one channel behind those of another, all of the same
/// moments.
///
/// A tick is as long as the period of the converter: sample `n` of a channel is the signal at
/// `epoch + n` ticks. Codes carry no trace of what made them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Samples {
    /// When the first sample is taken, in ticks since the first scan began.
    pub epoch: i64,
    /// Detector channels, ascending; one alone where the sensor has a single one.
    pub channel: Vec<u16>,
    /// Codes, channel by channel, the same number of each. 0 is the level without light of any lidar.
    pub code: Vec<i16>,
}

impl Samples {
    /// Samples of each channel.
    pub fn per_channel(&self) -> usize {
        self.code.len() / self.channel.len().max(1)
    }

    /// The codes of the channel `number`; none where it has none.
    pub fn of(&self, number: u16) -> &[i16] {
        let count = self.per_channel();
        match self.channel.binary_search(&number) {
            Ok(place) => self.code.get(place * count..(place + 1) * count).unwrap_or_default(),
            Err(_) => &[],
        }
    }

    /// True if there is no sample.
    pub fn is_empty(&self) -> bool {
        self.code.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_channel_has_its_codes() {
        let samples = Samples { epoch: 0, channel: vec![2, 5], code: vec![1, 2, 3, 4, 5, 6] };
        assert_eq!((samples.of(2), samples.of(5)), (&[1, 2, 3][..], &[4, 5, 6][..]));
        assert!(samples.of(3).is_empty());
    }
}
