//! Ticks made straight from a shot log and known ranges, without scene, light or detector.

use std::ops::Range;

use macropulse::codec::ShotLog;
use macropulse::codec::Ticks;
use macropulse::codec::code::{Codebook, Crc, Family, Keying, Payload};
use macropulse::codec::decode::{
    Bitwise, Correlation, Effort, Method, Opening, Receiver, ReceiverKind, Returns,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

/// Length of a tick and of a chip, fs.
pub const TICK_FS: i64 = 2500;

/// Columns of a scan.
pub const COLUMNS: u32 = 848;

/// Farthest round trip, in chips.
pub const GATE: u32 = 400_277;

/// Round trip, in chips, of the surface that the pixel at (row, column) sees, if any.
pub type Scene = fn(u32, u32) -> Option<i64>;

/// A bright box in front of falling ground, sky above.
pub fn car(row: u32, column: u32) -> Option<i64> {
    match (row, column) {
        (4.., 300..=500) => Some(80_000 + i64::from(column % 7) * 40 + i64::from(row)),
        (12.., _) => Some(266_000 - i64::from(row) * 4_000 + i64::from(column.abs_diff(424)) * 90),
        _ => None,
    }
}

/// A slope that falls by ten centimetres a pixel, in both directions.
pub fn slope(row: u32, column: u32) -> Option<i64> {
    Some(20_000 + 270 * i64::from(column) + 310 * i64::from(row))
}

/// Nothing alike next to each other, one pixel in four empty.
pub fn random(row: u32, column: u32) -> Option<i64> {
    let mut chance = ChaCha8Rng::seed_from_u64(u64::from(row * COLUMNS + column));
    let lag = i64::from(chance.next_u32() % (GATE + 1));
    (chance.next_u32() % 4 != 0).then_some(lag)
}

/// Nothing anywhere.
pub fn sky(_: u32, _: u32) -> Option<i64> {
    None
}

/// Disturbances of the light on its way to the ticks.
#[derive(Debug, Clone, Copy)]
pub struct Weather {
    /// Share of the marks that is seen.
    pub seen: f64,
    /// Dark and background counts a second.
    pub false_edges: f64,
    /// Standard deviation of the timing of a detection event, in ticks.
    pub jitter: f64,
}

/// Every mark is seen, at its place, and nothing else.
pub const CLEAR: Weather = Weather { seen: 1.0, false_edges: 0.0, jitter: 0.0 };

/// The sensor of the paper, or one much like it.
pub struct Sensor {
    pub codebook: Codebook,
    pub receiver: Receiver,
    /// Label of the first column.
    pub first_label: u32,
    /// Column to label, beyond counting.
    pub labels: u32,
}

impl Sensor {
    /// As printed: ten bits of label and a CRC that begins at 0.
    pub fn printed(kind: ReceiverKind) -> Self {
        Self::with_payload(kind, Payload::new(10, Crc::default(), false).unwrap())
    }

    /// With a sync bit in front and a CRC that begins at 7.
    pub fn with_sync(kind: ReceiverKind) -> Self {
        let crc = Crc { init: 7, ..Crc::default() };
        Self::with_payload(kind, Payload::new(10, crc, true).unwrap())
    }

    fn with_payload(kind: ReceiverKind, payload: Payload) -> Self {
        let labels = COLUMNS;
        let correlation = Correlation { light_ticks: GATE, ..Correlation::default() };
        let bitwise = |opening| {
            let (bit_threshold, ticks_per_chip, jitter_ticks) = (15, 1, 0.0);
            Method::Bitwise(Bitwise { opening, bit_threshold, ticks_per_chip, jitter_ticks })
        };
        let method = match kind {
            ReceiverKind::Literal => bitwise(Opening::FirstBit),
            ReceiverKind::Blind => bitwise(Opening::AnyBit),
            _ => Method::Matched(correlation, Effort::Quick),
        };
        Self {
            codebook: Codebook::new(Family::prime(29).unwrap(), Some(payload), 1024, Keying::OnOff)
                .unwrap(),
            receiver: Receiver { gate_ticks: (0, GATE), method, ..Receiver::matched(TICK_FS) },
            first_label: 0,
            labels,
        }
    }

    /// The settings of its matched receiver.
    pub fn matched(&mut self) -> (&mut Correlation, &mut Effort) {
        let settings = match &mut self.receiver.method {
            Method::Matched(correlation, effort) => Some((correlation, effort)),
            _ => None,
        };
        settings.unwrap()
    }

    /// The shots of `rows`, with 26 guard shots at both ends.
    pub fn log(&self, rows: Range<u32>) -> ShotLog {
        const GUARD_SHOTS: u32 = 26;
        let first = (rows.start * COLUMNS).saturating_sub(GUARD_SHOTS);
        let shots = first..rows.end * COLUMNS + GUARD_SHOTS;
        let owned = (rows.start * COLUMNS - first) as usize..(rows.end * COLUMNS - first) as usize;
        // 6 666 666 666⅔ chips a scan of 407 040 shots.
        let fired = |shot: u32| i64::from(shot) * 20_000_000_000 / (3 * 407_040) * TICK_FS;
        ShotLog {
            first: first.into(),
            fired_at_fs: shots.clone().map(fired).collect(),
            row: shots.clone().map(|shot| (shot / COLUMNS) as u16).collect(),
            column: shots.clone().map(|shot| (shot % COLUMNS) as u16).collect(),
            label: shots.clone().map(|shot| self.label(shot)).collect(),
            word: shots.clone().map(|shot| (shot % 29) as u16).collect(),
            channel: shots.map(|_| 0).collect(),
            owned,
        }
    }

    fn label(&self, shot: u32) -> u16 {
        let within = if self.labels == COLUMNS {
            shot % COLUMNS
        } else {
            shot.wrapping_mul(2_654_435_761) >> 22
        };
        (self.first_label + within) as u16
    }

    /// The ticks that the shots of `log` leave.
    pub fn ticks(&self, log: &ShotLog, scene: Scene, weather: Weather) -> Ticks {
        let mut chance = ChaCha8Rng::seed_from_u64(20_161_017 + log.first);
        let mut share = || f64::from(chance.next_u32()) / 2_f64.powi(32);
        let epoch = log.fired_at_fs[0] / TICK_FS;
        let end = log.fired_at_fs[log.len() - 1] / TICK_FS + i64::from(GATE) + 12_000;
        let mut lit = Vec::new();
        for shot in 0..log.len() {
            let Some(lag) = scene(log.row[shot].into(), log.column[shot].into()) else { continue };
            let start = log.fired_at_fs[shot] / TICK_FS + lag - epoch;
            for &mark in self.codebook.marks(log.label[shot], log.word[shot]) {
                if weather.seen < 1.0 && share() >= weather.seen {
                    continue;
                }
                let mut late = 0;
                if weather.jitter > 0.0 {
                    let seed = (share() * 1e9) as u64;
                    let normal: f64 = StandardNormal.sample(&mut ChaCha8Rng::seed_from_u64(seed));
                    late = (0.5 + weather.jitter * normal).floor() as i64;
                }
                lit.push(start + i64::from(mark) + late);
            }
        }
        let mean = weather.false_edges * (end - epoch) as f64 * TICK_FS as f64 * 1e-15;
        lit.extend((0..mean as u64).map(|_| (share() * (end - epoch) as f64) as i64));
        let mut tick: Vec<u32> = lit.into_iter().filter_map(|tick| tick.try_into().ok()).collect();
        tick.sort_unstable();
        tick.dedup();
        Ticks { epoch, tick, ..Ticks::default() }
    }

    /// Decodes `rows` of `scene` and compares with what is there.
    pub fn score(&self, rows: Range<u32>, scene: Scene, weather: Weather) -> Score {
        let log = self.log(rows);
        let ticks = self.ticks(&log, scene, weather);
        let returns = self.receiver.decode(&self.codebook, &log, &ticks).unwrap();
        Score::new(&self.codebook, (&log, scene), &returns)
    }
}

/// Returns against truth.
#[derive(Debug, Default)]
pub struct Score {
    /// Shots that met something and carried light.
    pub echoes: u32,
    /// Echoes that were found within four chips.
    pub right: u32,
    /// Echoes that were found elsewhere.
    pub wrong: u32,
    /// Shots that met nothing.
    pub empty: u32,
    /// Empty shots that have an answer nevertheless.
    pub false_returns: u32,
    /// Mean and root mean square of the range error of the right ones, in chips.
    pub bias: f64,
    pub rms: f64,
}

impl Score {
    pub fn new(codebook: &Codebook, seen: (&ShotLog, Scene), returns: &Returns) -> Self {
        let (log, scene) = seen;
        let mut found = vec![None; log.len()];
        for (&shot, &tof) in returns.shot.iter().zip(&returns.tof) {
            assert!(log.owned.contains(&(shot as usize)), "shot {shot} is in the guard");
            found[shot as usize] = Some(tof / (TICK_FS as f64 * 1e-15));
        }
        let mut score = Self::default();
        for shot in log.owned.clone() {
            let lag = scene(log.row[shot].into(), log.column[shot].into());
            let lit = !codebook.marks(log.label[shot], log.word[shot]).is_empty();
            match (lag.filter(|_| lit), found[shot]) {
                (None, found) => {
                    score.empty += 1;
                    score.false_returns += u32::from(found.is_some());
                }
                (Some(_), None) => score.echoes += 1,
                (Some(lag), Some(found)) => {
                    score.echoes += 1;
                    let error = found - (lag as f64 + 0.5);
                    if error.abs() <= 4.0 {
                        score.right += 1;
                        score.bias += error;
                        score.rms += error * error;
                    } else {
                        score.wrong += 1;
                    }
                }
            }
        }
        let right = f64::from(score.right.max(1));
        score.bias /= right;
        score.rms = (score.rms / right).sqrt();
        score
    }

    /// Share of the echoes that were found where they are, in percent.
    pub fn percent_right(&self) -> f64 {
        100.0 * f64::from(self.right) / f64::from(self.echoes.max(1))
    }
}
