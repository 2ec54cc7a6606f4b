//! Possible returns: lags at which the marks of a word stand out together.

use super::filter::Filtered;
use super::{Band, Mark, Rule, Sum};
use crate::kernels::{LAGS, lower, standing_out};

/// Candidates of a shot at most, the strongest.
const MOST: usize = 16;

/// A lag of a shot at which light may have come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub shot: usize,
    pub lag: i64,
    /// Order of the candidates: light that is there for certain comes first. The strength of clipped light is
    /// not known, and the nearer one is likely to be the stronger.
    pub rank: f32,
}

/// All candidates of the `band`, the strongest first.
pub(super) fn candidates((band, rule): (&Band, &Rule), filtered: &Filtered) -> Vec<Candidate> {
    let mut search = Search::new((band, rule), filtered);
    let mut all = Vec::new();
    for shot in 0..band.fired.len() {
        search.candidates_of(shot, &mut all);
    }
    all.sort_by(|one: &Candidate, other| {
        let places = (one.lag, one.shot).cmp(&(other.lag, other.shot));
        other.rank.total_cmp(&one.rank).then(places)
    });
    all
}

/// The search for one shot after another, with its memory.
pub(super) struct Search<'a> {
    band: &'a Band<'a>,
    rule: &'a Rule,
    /// The signal, infinite where it tells nothing.
    open: Vec<f32>,
    /// How strong the least mark must be, for each weight of a word.
    floor: Vec<f32>,
    /// The least mark at each lag of a block.
    least: Vec<f32>,
    /// The signal at a mark at these lags, if not all of them are in the record.
    beyond: Vec<f32>,
    /// Places in a block at which the least mark is strong enough.
    standing_out: Vec<usize>,
    /// When the marks of the shot leave, in ticks from the first sample on.
    marks: Vec<i64>,
    /// The marks that count: room for one lag.
    counted: Vec<Mark>,
}

impl<'a> Search<'a> {
    /// The search for the shots of a `band` in its filtered signal.
    pub fn new((band, rule): (&'a Band<'a>, &'a Rule), filtered: &Filtered) -> Self {
        let told = filtered.signal.iter().zip(&filtered.doubt);
        let open = told.map(|(signal, doubt)| if *doubt == 0.0 { *signal } else { f32::INFINITY });
        Self {
            band,
            rule,
            open: open.collect(),
            floor: (0..rule.least_of.len()).map(|marks| rule.least(marks)).collect(),
            least: Vec::with_capacity(LAGS),
            beyond: Vec::with_capacity(LAGS),
            standing_out: Vec::new(),
            marks: Vec::new(),
            counted: Vec::new(),
        }
    }

    /// Looks for the light of `shot` from here on.
    pub fn look_for(&mut self, shot: usize) {
        let fired = self.band.fired[shot];
        self.marks.clear();
        self.marks.extend(self.band.marks(shot).map(|mark| fired + mark));
    }

    fn candidates_of(&mut self, shot: usize, all: &mut Vec<Candidate>) {
        self.look_for(shot);
        let (Some(&first), Some(&last)) = (self.marks.first(), self.marks.last()) else { return };
        // Lags at which a mark is in the record.
        let from = (-last).max(0);
        let until = (self.open.len() as i64 - first).min(self.band.lags);
        let before = all.len();
        for begin in (from..until).step_by(LAGS) {
            self.find_standing_out(begin, (until - begin).min(LAGS as i64) as usize);
            for at in 0..self.standing_out.len() {
                let lag = begin + self.standing_out[at] as i64;
                all.extend(self.candidate(shot, lag));
            }
            keep_strongest(all, before);
        }
    }

    /// Finds where the least mark is strong enough, of `count` lags from `begin` on.
    fn find_standing_out(&mut self, begin: i64, count: usize) {
        let length = self.open.len() as i64;
        self.least.clear();
        self.least.resize(count, f32::INFINITY);
        for mark in &self.marks {
            let from = mark + begin;
            if from >= 0 && from + count as i64 <= length {
                lower(&mut self.least, &self.open[from as usize..][..count]);
                continue;
            }
            let open = |at: i64| usize::try_from(at).ok().and_then(|at| self.open.get(at)).copied();
            let signal = (from..from + count as i64).map(|at| open(at).unwrap_or(f32::INFINITY));
            self.beyond.clear();
            self.beyond.extend(signal);
            lower(&mut self.least, &self.beyond);
        }
        self.standing_out.clear();
        standing_out(&self.least, self.floor[self.marks.len()], &mut self.standing_out);
    }

    /// That at `lag`, if the score there reaches the threshold and those beside it are no higher.
    fn candidate(&mut self, shot: usize, lag: i64) -> Option<Candidate> {
        let sum = self.sum(lag).filter(|sum| sum.score >= self.rule.threshold)?;
        let is_whole = self.counted.len() == self.marks.len();
        let is_peak = self.sum(lag - 1).is_none_or(|before| before.score <= sum.score)
            && self.sum(lag + 1).is_none_or(|behind| behind.score < sum.score);
        let rank = sum.least * if is_whole { 1.0 } else { 0.5 };
        is_peak.then_some(Candidate { shot, lag, rank })
    }

    /// The marks at `lag` of the shot that is looked for together, if enough of them count.
    pub fn sum(&mut self, lag: i64) -> Option<Sum> {
        self.counted.clear();
        for mark in &self.marks {
            let Ok(place) = usize::try_from(mark + lag) else { continue };
            match self.open.get(place) {
                Some(&height) if height < f32::INFINITY => {
                    self.counted.push(Mark { place, height, doubt: 0.0 });
                }
                _ => {}
            }
        }
        let is_enough = self.counted.len() >= self.rule.fewest(self.marks.len());
        is_enough.then(|| self.rule.sum(&self.counted, self.marks.len())).flatten()
    }
}

/// Keeps the strongest of those from place `first` on.
fn keep_strongest(all: &mut Vec<Candidate>, first: usize) {
    if all.len() - first > MOST {
        all[first..]
            .sort_by(|one, other| other.rank.total_cmp(&one.rank).then(one.lag.cmp(&other.lag)));
        all.truncate(first + MOST);
    }
}
