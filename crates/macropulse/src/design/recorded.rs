//! What recorded shots, ticks and samples are held against before they are decoded.

use macropulse_codec::files::{Digest, Limits, SampleHeader};

use super::Design;
use super::detector::Detector;

/// Shots of a scan whose places and times go into the digest.
const SAMPLES: u64 = 256;

impl Design {
    /// How many rows, labels, words, … its shots may have.
    pub fn limits(&self) -> Limits {
        let codebook = &self.coding.codebook;
        Limits {
            rows: self.scan.rows,
            columns: self.scan.columns,
            labels: if self.is_coded() { codebook.labels() } else { 1 },
            words: if self.is_coded() { codebook.words() as u32 } else { 1 },
            channels: self.channels(),
        }
    }

    /// Whether it records samples, and no ticks.
    pub fn is_sampled(&self) -> bool {
        matches!(self.detector, Detector::Sampled(_))
    }

    /// What is said of its samples before they come, their number left open; `None` of a sensor that
    /// records ticks.
    pub fn sample_header(&self) -> Option<SampleHeader> {
        let Detector::Sampled(sampled) = &self.detector else { return None };
        Some(SampleHeader {
            tick_fs: self.tdc.tick_fs,
            channels: self.channels(),
            codes: sampled.codes,
            step_photons: Some(sampled.step),
            digest: Some(self.recorded_digest()),
            count: None,
        })
    }

    /// The hash of all that is sent and how it is timed: the codebook chip by chip, the lengths of
    /// chips and ticks, which pixel is sent what, and when. What the receiver is set to, its gate
    /// included, is not in it: the same record may be decoded in many ways.
    pub fn recorded_digest(&self) -> Digest {
        let mut hash = crate::digest::Digest::new();
        let mut numbers = |values: &[u64]| {
            values.iter().for_each(|value| hash.bytes(&value.to_le_bytes()));
        };
        let (scan, tdc, codebook) = (&self.scan, &self.tdc, &self.coding.codebook);
        let lengths = [self.coding.chip_fs, tdc.tick_fs, tdc.clock_fs].map(|fs| fs as u64);
        numbers(&lengths);
        numbers(&[scan.rows.into(), scan.columns.into(), scan.rate_millihertz]);
        numbers(&[self.shots_per_scan(), self.channels().into(), codebook.chips().into()]);
        numbers(&[codebook.zeros_are_lit().into(), codebook.words() as u64]);
        numbers(&[self.coding.first_word.into(), self.coding.word_modulus.into()]);
        for word in 0..codebook.words() {
            let marks = &codebook.word(word as u16).marks;
            numbers(&[marks.len() as u64]);
            marks.iter().for_each(|mark| numbers(&[(*mark).into()]));
        }
        for label in 0..codebook.labels() {
            let bits = codebook.lit_bits(label as u16);
            numbers(&[bits.len() as u64]);
            bits.iter().for_each(|bit| numbers(&[(*bit).into()]));
        }
        for column in 0..scan.columns as u16 {
            numbers(&[self.coding.label_of(column).into()]);
        }
        let (pattern, shots) = (scan.model(), self.shots_per_scan());
        for sample in 0..SAMPLES.min(shots) {
            let order = sample * shots / SAMPLES.min(shots);
            let (row, column) = pattern.pixel(order);
            let moment = pattern.moment(order, self.scan_period());
            numbers(&[row.into(), column.into(), pattern.channel_of(order, row).into()]);
            numbers(&[moment.shots, moment.then.to_bits()]);
        }
        Digest::parse(&hash.text()).unwrap_or(Digest([0; 16]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn digest(name: &str, set: &[(&str, &str)]) -> Digest {
        let set: Vec<(String, String)> =
            set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Design::open(name, &set).unwrap().recorded_digest()
    }

    #[test]
    fn what_is_sent_and_timed_counts_and_what_the_receiver_is_set_to_does_not() {
        let paper = digest("kim-park-2016", &[]);
        let others = [
            digest("hdl-64e", &[]),
            digest("kim-park-2016", &[("code.word.modulus", "28")]),
            digest("kim-park-2016", &[("tdc.resolution_ps", "1.25")]),
            digest("kim-park-2016", &[("scan.scans_per_s", "59.0")]),
        ];
        assert!(others.iter().all(|other| *other != paper));
        let receivers = [
            digest("kim-park-2016", &[("receiver.kind", "blind")]),
            digest("kim-park-2016", &[("scan.max_range_m", "90")]),
            digest("kim-park-2016", &[("receiver.returns", "3")]),
        ];
        assert_eq!(receivers, [paper; 3]);
        assert_eq!(digest("kim-park-2016", &[]), paper);
    }
}
