//! Properties of a design by which recorded shots, ticks and samples are checked before they are decoded.

use macropulse_codec::decode::{self, Returns};
use macropulse_codec::files::{Digest, Limits, SampleHeader};
use macropulse_codec::{Given, Record, RecordKind, ShotLog};

use super::Design;
use super::detector::Detector;

/// Shots of a scan whose places and times go into the digest.
const SAMPLES: u64 = 256;

impl Design {
    /// How many rows, labels, words, … its shots may have.
    pub fn limits(&self) -> Limits {
        let codebook = &self.emission.coding().codebook;
        Limits {
            rows: self.scan.rows,
            columns: self.scan.columns,
            labels: if self.is_coded() { codebook.labels() } else { 1 },
            words: if self.is_coded() { codebook.words() as u32 } else { 1 },
            channels: self.channels(),
        }
    }

    /// Returns the kind of record that its receiver decodes, beside the shot log.
    pub fn records(&self) -> RecordKind {
        self.readout.records()
    }

    /// The part of the `log` of a band that its receiver is given with the record: the shots all of whose light is in
    /// it. A record that is made shot by shot is that of the owned shots alone.
    pub fn known(&self, log: &ShotLog) -> ShotLog {
        match self.records().is_by_shot() {
            true => log.part(log.owned.clone()),
            false => self.cut().known(log),
        }
    }

    /// Decodes a record of the shots of `log` into returns of the owned ones, by their place in it.
    ///
    /// # Errors
    /// As [`Receiver::decode`](macropulse_codec::decode::Receiver::decode).
    pub fn receive<'a>(
        &self,
        log: &ShotLog,
        record: impl Into<Record<'a>>,
    ) -> Result<Returns, decode::Error> {
        self.receiver.decode(&self.emission.coding().codebook, log, record)
    }

    /// Returns the header of its samples, with their number left open; `None` if the detector is not sampled.
    pub fn sample_header(&self) -> Option<SampleHeader> {
        let Detector::Sampled(sampled) = &self.detector else { return None };
        Some(SampleHeader {
            tick_fs: self.clock.tick_fs,
            channels: self.channels(),
            codes: sampled.codes,
            step_photons: Some(sampled.step),
            digest: Some(self.recorded_digest()),
            count: None,
        })
    }

    /// The record of one shot in which nothing was detected; `None` of a sensor whose record is not made shot by shot.
    pub fn blank_record(&self) -> Option<Given> {
        self.readout.model().blank(&self.emission, self.clock)
    }

    /// Returns the hash of all that is sent and how it is timed. It covers the codebook chip by chip, the
    /// lengths of chips and ticks, and what is sent to which pixel, and when. The settings of the receiver,
    /// its gate included, are not in it: the same record may be decoded in many ways.
    pub fn recorded_digest(&self) -> Digest {
        let mut hash = crate::digest::Digest::new();
        let mut numbers = |values: &[u64]| {
            values.iter().for_each(|value| hash.bytes(&value.to_le_bytes()));
        };
        let (scan, clock, codebook) = (&self.scan, self.clock, &self.emission.coding().codebook);
        let lengths =
            [self.emission.coding().chip_fs, clock.tick_fs, clock.period_fs].map(|fs| fs as u64);
        numbers(&lengths);
        numbers(&[scan.rows.into(), scan.columns.into(), scan.rate_millihertz]);
        numbers(&[self.shots_per_scan(), self.channels().into(), codebook.chips().into()]);
        numbers(&[codebook.zeros_are_lit().into(), codebook.words() as u64]);
        numbers(&[
            self.emission.coding().first_word.into(),
            self.emission.coding().word_modulus.into(),
        ]);
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
            numbers(&[self.emission.coding().label_of(column).into()]);
        }
        let (pattern, shots) = (scan.model(), self.shots_per_scan());
        self.emission.model().numbers(&mut numbers);
        self.readout.model().numbers(&mut numbers);
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
