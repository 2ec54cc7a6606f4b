//! What may be a return: lags at which the marks of a word stand out together.

use super::filter::Filtered;
use super::{Band, Rule};
use crate::kernels::{LAGS, Lags};

/// Candidates of a shot at most, the strongest.
const MOST: usize = 16;

/// A lag of a shot at which light may have come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub shot: usize,
    pub lag: i64,
    /// The least of its marks that count.
    pub least: f32,
    /// By what candidates are ordered: light that is there for certain comes first.
    pub rank: f32,
}

/// All candidates of the `band`, the strongest first.
pub(super) fn candidates(band: &Band, filtered: &Filtered, rule: &Rule) -> Vec<Candidate> {
    let open: Vec<f32> = filtered
        .signal
        .iter()
        .zip(&filtered.doubt)
        .map(|(signal, doubt)| if *doubt == 0.0 { *signal } else { f32::INFINITY })
        .collect();
    let mut bench = Bench { open, lags: Box::default(), beyond: Vec::new() };
    let mut all = Vec::new();
    for shot in 0..band.fired.len() {
        let first = all.len();
        bench.candidates_of(shot, (band, rule), &mut all);
        keep_strongest(&mut all, first);
    }
    all.sort_by(|one, other| {
        let places = (one.shot, one.lag).cmp(&(other.shot, other.lag));
        other.rank.total_cmp(&one.rank).then(places)
    });
    all
}

/// Keeps the strongest of those from place `first` on.
fn keep_strongest(all: &mut Vec<Candidate>, first: usize) {
    if all.len() - first > MOST {
        all[first..]
            .sort_by(|one, other| other.rank.total_cmp(&one.rank).then(one.lag.cmp(&other.lag)));
        all.truncate(first + MOST);
    }
}

struct Bench {
    /// The signal, infinite where it tells nothing.
    open: Vec<f32>,
    lags: Box<Lags>,
    /// The signal at the marks that are not in the record with all lags, one behind the other.
    beyond: Vec<f32>,
}

impl Bench {
    fn candidates_of(
        &mut self,
        shot: usize,
        (band, rule): (&Band, &Rule),
        all: &mut Vec<Candidate>,
    ) {
        let marks: Vec<i64> = band.marks(shot).collect();
        let (Some(first), Some(last)) = (marks.first(), marks.last()) else { return };
        let fired = band.fired[shot];
        let counting = rule.counting(marks.len());
        let least = rule.least(marks.len());
        let before = all.len();
        // Lags of which a mark is in the record.
        let from = (-fired - last).max(0);
        let until = (self.open.len() as i64 - fired - first).min(band.lags);
        // Each block begins with the last lag but one of the block before it: all but the first and the
        // last lag of a block have a lag to both sides.
        let mut begin = from;
        while begin + 2 < until {
            let count = (until - begin).min(LAGS as i64) as usize;
            let highest = self.score((fired + begin, count), &marks, &counting);
            if highest >= rule.threshold {
                let lags = &self.lags;
                for at in 1..count - 1 {
                    let score = lags.score[at];
                    let is_top = score >= lags.score[at - 1] && score > lags.score[at + 1];
                    if !(is_top && score >= rule.threshold && lags.least[at] >= least) {
                        continue;
                    }
                    let is_whole = lags.count[at] == marks.len() as f32;
                    let rank = lags.least[at] * if is_whole { 1.0 } else { 0.5 };
                    let lag = begin + at as i64;
                    all.push(Candidate { shot, lag, least: lags.least[at], rank });
                }
                keep_strongest(all, before);
            }
            begin += count as i64 - 2;
        }
    }

    /// Scores `count` lags from the tick `begin` on, at which the first mark would be with a lag of 0; the
    /// highest score.
    fn score(
        &mut self,
        (begin, count): (i64, usize),
        marks: &[i64],
        counting: &crate::kernels::Counting,
    ) -> f32 {
        let length = self.open.len() as i64;
        let is_within = |mark: &i64| begin + mark >= 0 && begin + mark + count as i64 <= length;
        self.beyond.clear();
        for mark in marks.iter().filter(|mark| !is_within(mark)) {
            let at = |lag: usize| usize::try_from(begin + mark + lag as i64).ok();
            let signal = |lag: usize| at(lag).and_then(|at| self.open.get(at));
            self.beyond.extend((0..count).map(|lag| signal(lag).copied().unwrap_or(f32::INFINITY)));
        }
        let within = marks.iter().filter(|mark| is_within(mark)).map(|mark| {
            let at = (begin + mark) as usize;
            &self.open[at..at + count]
        });
        let all = within.chain(self.beyond.chunks(count));
        self.lags.score_all((count, counting), all)
    }
}
