//! Acquisition: the exact maximum over the gate, and the places where light is left over.
//!
//! Coarse pictures of the timeline have one bit for eight ticks. They bound the count of marks from above for eight
//! lags at once, as a mark that is lit is lit in the picture. There are eight pictures, each a tick later, so that one
//! bit covers exactly the eight ticks on which a mark may fall. The lags are counted one by one only if the bound is
//! high enough. A lag that is skipped cannot be the maximum.
//!
//! Before that, the pictures are searched for the code word alone. If a macropulse has k marks, one of its B lit bits
//! has k/B of them at least. This takes a fraction of the marks, looked up once for all bits. In bright light it leaves
//! next to nothing to be counted. It is left out if chance gives that number of marks nearly everywhere.

use std::ops::Range;

use super::Band;
use super::sent::Sent;
use super::track::below;
use crate::decode::field::Field;
use crate::decode::timeline::Timeline;
use crate::kernels::{
    COARSE, Counts, SIXTEEN, WIDE, and, any_behind, coarse, in_pictures, is_dark,
    least_most_and_sum, sum_along, with_enough,
};
use crate::statistics::normal_quantile;

/// Lags that are counted at once.
pub(super) const BLOCK: i64 = 64 * WIDE as i64;

/// Memory kept from search to search.
#[derive(Debug, Default)]
pub(super) struct Search {
    /// The marks of the macropulse at hand in the pictures, and those of its code word.
    places: Marks,
    word: Marks,
    /// Bits of the pictures at which the word may begin, from the first lag of a range on.
    words: Vec<u64>,
    counts: Counts<WIDE>,
    /// Lags that were counted one by one in the last search.
    counted: i64,
    pictures: Pictures,
    /// Ticks at which marks count as found.
    lit: Timeline,
}

/// Marks in the pictures, and the farthest of them.
#[derive(Debug, Default)]
struct Marks {
    places: Vec<u32>,
    farthest: u32,
}

impl Marks {
    /// Sets them to those at the `ticks`, in pictures of `stride` bits each.
    fn set(&mut self, ticks: &[u32], stride: u32) {
        in_pictures(ticks, stride, &mut self.places);
        self.farthest = self.places.iter().copied().max().unwrap_or(0);
    }

    /// Finds the bits of the `pictures`, from `first` on, at which `needed` marks may be there.
    fn find(&self, pictures: &Pictures, first: u32, needed: u32, enough: &mut [u64]) {
        let marks = (&*self.places, self.farthest);
        with_enough::<WIDE>(&pictures.words, first, marks, needed, enough);
    }
}

/// The pictures of all that is at hand, one for each shift, made where they are asked for.
#[derive(Debug, Default)]
struct Pictures {
    /// One behind the other.
    words: Vec<u64>,
    /// Machine words of each.
    stride: usize,
    /// The first tick that they show.
    shown: Option<i64>,
    /// Which segments are made.
    made: Vec<bool>,
}

/// Ticks of a segment: an eighth of the gate of a lidar that sees 100 m at 2.5 ps a tick, in whole machine words of a
/// picture. Half and four times this number take equally long.
const SEGMENT: i64 = 1 << 15;

impl Pictures {
    /// Makes the pictures of `span` that are missing. They go on showing ticks that are cancelled later, which costs
    /// time and nothing else. Making them anew after 8, 32 or 128 macropulses costs more.
    fn show(&mut self, field: &Field, span: &Range<i64>, memory: &mut Timeline) {
        let extent = field.extent();
        if self.shown != Some(extent.start) {
            self.shown = Some(extent.start);
            let segments = ((extent.end - extent.start) / SEGMENT + 1) as usize;
            self.made.clear();
            self.made.resize(segments, false);
            // Blocks of lags are read beyond their end.
            self.stride = segments * (SEGMENT / PER_WORD) as usize + 4 * WIDE;
            self.words.resize(self.stride * COARSE, 0);
        }
        let first = (span.start - extent.start).max(0) / SEGMENT;
        let segments = first..((span.end - extent.start) / SEGMENT + 1).min(self.made.len() as i64);
        for segment in segments {
            if std::mem::replace(&mut self.made[segment as usize], true) {
                continue;
            }
            let start = extent.start + segment * SEGMENT;
            let ticks = start..(start + SEGMENT + 64).min(extent.end);
            let words = field.lit_by_residual(&ticks, memory).words(&ticks);
            let begin = (segment * SEGMENT / PER_WORD) as usize;
            for (shift, picture) in self.words.chunks_exact_mut(self.stride).enumerate() {
                coarse(words, shift, &mut picture[begin..begin + (SEGMENT / PER_WORD) as usize]);
            }
        }
    }
}

/// Ticks that a machine word of a picture stands for.
const PER_WORD: i64 = 64 * COARSE as i64;

impl Search {
    /// Lags that were counted one by one in the last search.
    pub fn counted(&self) -> i64 {
        self.counted
    }

    /// Forgets the pictures.
    pub fn forget(&mut self) {
        self.pictures.shown = None;
    }

    /// The bits from bit `first` of the pictures on that may have `needed` marks.
    fn bounded(&self, first: u32, needed: u32) -> [u64; WIDE] {
        let mut enough = [0; WIDE];
        self.places.find(&self.pictures, first, needed, &mut enough);
        enough
    }

    /// Notes where `needed` marks of the code word may be, in the `bits` bits of the pictures from `first` on. Returns
    /// true if they may be anywhere.
    fn note_words(&mut self, first: u32, bits: u32, needed: u32) -> bool {
        let blocks = bits.div_ceil(BLOCK as u32) as usize;
        // Blocks are read from anywhere.
        self.words.resize(WIDE * (blocks + 1) + 1, 0);
        let (noted, behind) = self.words.split_at_mut(WIDE * blocks);
        self.word.find(&self.pictures, first, needed, noted);
        behind.fill(0);
        noted.iter().any(|word| *word != 0)
    }
}

impl Band<'_> {
    /// The lag among the ascending `lags` at which most marks of `shot` are in the residual, and their number. The
    /// earliest of several such lags counts. `None` if fewer than `least` are found everywhere.
    pub(super) fn maximum(
        &mut self,
        shot: usize,
        lags: &[Range<i64>],
        least: u32,
    ) -> Option<(i64, u32)> {
        let (sent, fired) = (self.sent, self.sent.fired[shot]);
        let (Some(from), Some(to)) = (lags.first(), lags.last()) else { return None };
        self.search.counted = 0;
        if least > sent.weight(shot) {
            return None;
        }
        let span = fired + from.start..fired + to.end + sent.length() + i64::from(sent.width);
        let density = self.leftover().density(shot, &(from.start..to.end));
        self.lay_out(shot);
        let search = &mut self.search;
        search.pictures.show(&self.field, &span, &mut search.lit);
        let origin = self.field.extent().start;
        let stride = 64 * search.pictures.stride as u32;
        search.places.set(&self.marks, stride);
        let bits = sent.lit_bits(shot).len() as u32;
        let (lit, in_word) = (1.0 - (1.0 - density).powi(COARSE as i32), sent.in_word(shot));
        // A bit with enough marks lacks few, so any group of its marks lacks no more than these.
        let lacking = in_word.saturating_sub(least.div_ceil(bits));
        let tell = |marks: &u32| *marks >= lacking + self.chance.in_words.least(*marks, lit);
        let few = (SIXTEEN as u32..in_word).step_by(SIXTEEN).chain([in_word]).find(tell);
        let of_word = few.filter(|_| bits > 1).unwrap_or(0);
        search.word.set(&sent.word(shot).ticks()[..of_word as usize], stride);
        let bit_of = |lag: i64| (fired + lag - origin) / COARSE as i64;
        let mut best = None;
        let mut needed = least.max(1);
        for lags in lags {
            let (first, last) = (bit_of(lags.start), bit_of(lags.end - 1));
            if of_word > 0 {
                let behind = last + 1 - first + sent.length() / COARSE as i64 + 1;
                let in_one = (needed.div_ceil(bits) + of_word).saturating_sub(in_word);
                if !self.search.note_words(first as u32, behind as u32, in_one) {
                    continue;
                }
            }
            for block in (first..=last).step_by(BLOCK as usize) {
                let mut hits = below(last + 1 - block, [u64::MAX; WIDE], true);
                if of_word > 0 {
                    // That many ticks later, two neighbouring bits cover the eight lags.
                    let (words, behind) = (&self.search.words, sent.lit_bits(shot));
                    hits = and(hits, any_behind(words, (block - first) as usize, behind));
                }
                if is_dark(&hits) {
                    continue;
                }
                hits = and(hits, self.search.bounded(block as u32, needed));
                // A machine word of the picture stands for one block of lags.
                for lane in (0..WIDE).filter(|lane| hits[*lane] != 0) {
                    let first = origin + COARSE as i64 * (block + 64 * lane as i64) - fired;
                    let (lag, count) = self.exactly(shot, lags, first);
                    if count >= needed {
                        (best, needed) = (Some((lag, count)), count + 1);
                    }
                }
            }
        }
        best
    }

    /// The lag with most marks of a shot in the residual, the earliest of several, of those `lags` that are in the
    /// block that begins with lag `first`.
    fn exactly(&mut self, shot: usize, lags: &Range<i64>, first: i64) -> (i64, u32) {
        let start = self.sent.fired[shot] + first;
        let span = start..start + BLOCK + self.sent.length();
        let search = &mut self.search;
        let (words, begin) = self.field.lit_by_residual(&span, &mut search.lit).at(start);
        search.counted += BLOCK;
        search.counts.count(words, begin as u32, self.sent.word(shot), self.sent.lit_bits(shot));
        let allowed = below(lags.start - first, [u64::MAX; WIDE], false);
        let allowed = below(lags.end - first, allowed, true);
        let highest = search.counts.highest(allowed);
        highest.map_or((first, 0), |(at, count)| (first + i64::from(at), count))
    }
}

/// Stretches in a [`Group`].
const PER_GROUP: usize = 16;

/// The ticks of some stretches: the least, the most, and the sum.
#[derive(Debug, Clone, Copy)]
struct Group {
    least: u32,
    most: u32,
    sum: u64,
}

impl Group {
    const NONE: Self = Self { least: u32::MAX, most: 0, sum: 0 };

    fn of(stretches: &[u32]) -> Self {
        let (least, most, sum) = least_most_and_sum(stretches);
        Self { least, most, sum }
    }

    /// True if light stands out in a stretch: see [`uneven`].
    fn stands_out(&self, uneven: f64) -> bool {
        let root = |ticks: u32| 2.0 * f64::from(ticks).sqrt();
        root(self.most) - root(self.least) > uneven
    }

    fn with(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            most: self.most.max(other.most),
            sum: self.sum + other.sum,
        }
    }
}

/// Places at which light that is left over may be.
pub(super) struct Leftover<'a> {
    sent: &'a Sent<'a>,
    /// Residual ticks in each cell of a stretch of time.
    cells: Vec<u32>,
    /// The same in a macropulse that begins in a cell, and some more.
    stretches: Vec<u32>,
    begin: i64,
    cell: i64,
    /// Cells that a macropulse takes up.
    together: usize,
    /// One for every [`PER_GROUP`] stretches.
    groups: Vec<Group>,
    /// Among the stretches before this one no light stands out; `None` until that is asked for.
    even_to: Option<usize>,
    /// Light stands out where stretches are so different.
    uneven: f64,
}

/// Blocks of lags, times the marks of each, that a search counts in hardly any time: at a nanosecond each, a
/// microsecond.
const SOON: i64 = 1000;

/// Light stands out if twice the root of the most ticks in a stretch exceeds twice the root of the fewest by this. In a
/// gate of `stretches`, chance does so with a probability of about `false_alarm`.
///
/// Twice the root of a count that chance makes has a variance of about 1 \[Ans48\], in dense and in sparse
/// light. The difference of two has √2 times that deviation. There are fewer than n² pairs, so the
/// probability that any exceeds √2·Q⁻¹(α/n²) is below α. With α = 0.1 %, light stands out by chance in 0.09 %
/// of 200 000 gates of 136 stretches with 400 ticks on average. With 40 ticks it is 0.13 %, and with ten,
/// where the root is less even, 0.9 %. These gates are searched in vain.
fn uneven(stretches: f64, false_alarm: f64) -> f64 {
    -std::f64::consts::SQRT_2 * normal_quantile(false_alarm / (stretches * stretches))
}

impl<'a> Leftover<'a> {
    /// The leftover of the ticks at hand from tick `first` on.
    pub fn new(sent: &'a Sent<'a>, field: &mut Field, first: i64) -> Self {
        let all = first..field.extent().end;
        let (cells, begin) = field.residual_cells(&all);
        let cells = cells.to_vec();
        let together = field.stretch(sent.length() + i64::from(sent.width));
        let stretches = vec![0; cells.len()];
        let (all, groups) = (0..cells.len(), vec![Group::NONE; cells.len().div_ceil(PER_GROUP)]);
        let (cell, gate) = (field.cell(), sent.gate());
        let in_gate = (gate.end - gate.start) / cell + 1;
        let mut leftover = Self {
            sent,
            cells,
            stretches,
            begin,
            cell,
            together,
            groups,
            even_to: None,
            uneven: uneven(in_gate as f64, sent.accepted()),
        };
        leftover.sum(all);
        leftover
    }

    /// Ticks of a stretch.
    pub fn stretch_length(&self) -> i64 {
        self.cell * self.together as i64
    }

    /// Counts anew what is left in `light`.
    pub fn renew(&mut self, field: &mut Field, light: &Range<i64>) {
        let (counts, begin) = field.residual_cells(light);
        let first = ((begin - self.begin) / self.cell) as usize;
        let known = self.cells.get_mut(first..).unwrap_or_default();
        let end = first + counts.len().min(known.len());
        known.iter_mut().zip(counts).for_each(|(known, count)| *known = *count);
        self.sum((first + 1).saturating_sub(self.together)..end);
    }

    /// Sums up the cells of each of the `stretches`.
    fn sum(&mut self, stretches: Range<usize>) {
        let cells = self.cells.get(stretches.start..).unwrap_or_default();
        sum_along(cells, self.together, &mut self.stretches[stretches.clone()]);
        self.even_to = None;
        let groups = self.groups.iter_mut().zip(self.stretches.chunks(PER_GROUP));
        let changed = stretches.start / PER_GROUP..stretches.end.div_ceil(PER_GROUP);
        for (group, stretches) in groups.take(changed.end).skip(changed.start) {
            *group = Group::of(stretches);
        }
    }

    /// The ticks of the stretches that begin in `cells`.
    fn group(&self, cells: Range<usize>) -> Group {
        let whole = cells.start.div_ceil(PER_GROUP)..cells.end / PER_GROUP;
        if whole.is_empty() {
            return Group::of(&self.stretches[cells]);
        }
        let before = Group::of(&self.stretches[cells.start..whole.start * PER_GROUP]);
        let behind = Group::of(&self.stretches[whole.end * PER_GROUP..cells.end]);
        self.groups[whole].iter().fold(before.with(behind), |group, other| group.with(*other))
    }

    /// True if light of `shot` that comes after the `lags` may have that number of `ticks` anywhere.
    pub fn may_hold(&self, shot: usize, lags: &Range<i64>, ticks: u32) -> bool {
        let cells = self.cells(self.sent.fired[shot], lags);
        let groups = cells.start / PER_GROUP..cells.end.div_ceil(PER_GROUP);
        self.groups[groups].iter().any(|group| group.most >= ticks)
    }

    /// True if light of `shot` is looked for after the `lags` only where it stands out. A short search need not be
    /// limited so.
    pub fn must_stand_out(&self, shot: usize, lags: &Range<i64>) -> bool {
        let blocks = (lags.end - lags.start) / (BLOCK * COARSE as i64);
        blocks * i64::from(self.sent.weight(shot)) > SOON
    }

    /// True if no light stands out before the end of the `lags` of `shot`. Then [`Self::lags`] is empty if only light
    /// that stands out is looked for. The first stretch that stands out is found once, and remembered.
    pub fn is_even(&mut self, shot: usize, lags: &Range<i64>) -> bool {
        if !self.must_stand_out(shot, lags) {
            return false;
        }
        let (groups, uneven) = (&self.groups, self.uneven);
        let even_to = *self.even_to.get_or_insert_with(|| {
            let mut all = Group::NONE;
            let is_even = |group: &&Group| {
                all = all.with(**group);
                !all.stands_out(uneven)
            };
            PER_GROUP * groups.iter().take_while(is_even).count()
        });
        self.cells(self.sent.fired[shot], lags).end <= even_to
    }

    /// The cells in which light of `shot` begins that comes after the `lags`.
    fn cells(&self, fired: i64, lags: &Range<i64>) -> Range<usize> {
        let cell = |tick: i64| ((tick - self.begin) / self.cell).max(0) as usize;
        let end = (cell(fired + lags.end - 1) + 1).min(self.stretches.len());
        cell(fired + lags.start).min(end)..end
    }

    /// Share of places that are lit by what is left over where light of `shot` may begin.
    pub fn density(&self, shot: usize, lags: &Range<i64>) -> f64 {
        let cells = self.cells(self.sent.fired[shot], lags);
        let places = (cells.len().max(1) * self.together) as f64 * self.cell as f64;
        let ticks = self.group(cells).sum as f64;
        (ticks * f64::from(self.sent.width) / places).min(1.0)
    }

    /// Those of the `lags` of `shot` at which `least` of its marks may be left over; none where hardly
    /// anything is left but what chance spreads evenly. With `is_even` light is looked for that does
    /// not stand out, too.
    pub fn lags(
        &self,
        shot: usize,
        lags: Range<i64>,
        least: u32,
        is_even: bool,
    ) -> Vec<Range<i64>> {
        let mut places: Vec<Range<i64>> = Vec::new();
        let sent = self.sent;
        let (enough, fired) = (sent.ticks_of(shot, least), sent.fired[shot]);
        if lags.is_empty() || !self.may_hold(shot, &lags, enough) {
            return places;
        }
        let cells = self.cells(fired, &lags);
        let all = self.group(cells.clone());
        // The light that is sought adds to the even background. The emptiest stretch has background alone, unless all
        // of them overlap with that light.
        let enough = enough + if cells.len() > 2 * self.together { all.least } else { 0 };
        if self.must_stand_out(shot, &lags) && !all.stands_out(self.uneven) && !is_even {
            return places;
        }
        let at = |cell: usize| self.begin + self.cell * cell as i64 - fired;
        let groups = cells.start / PER_GROUP..cells.end.div_ceil(PER_GROUP);
        let groups = groups.filter(|group| self.groups[*group].most >= enough);
        let each = groups.flat_map(|group| {
            (group * PER_GROUP).max(cells.start)..((group + 1) * PER_GROUP).min(cells.end)
        });
        for cell in each.filter(|cell| self.stretches[*cell] >= enough) {
            let (from, to) = (at(cell).max(lags.start), at(cell + 1).min(lags.end));
            match places.last_mut() {
                Some(last) if last.end >= from => last.end = to,
                _ => places.push(from..to),
            }
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    /// 20 000 gates of fifty stretches in which each of 1280 places has a tick by chance, one in 32; seed 11. With
    /// α = 5 % light stands out in no more of them, but for three standard deviations; with α = 1, the negative
    /// control, in more.
    #[test]
    fn chance_hardly_ever_makes_light_stand_out() {
        const GATES: usize = 20_000;
        const STRETCHES: usize = 50;
        let mut chance = ChaCha8Rng::seed_from_u64(11);
        let mut one_in_32 = || (0..5).fold(u64::MAX, |all, _| all & chance.next_u64());
        let mut gate = || -> Vec<u32> {
            (0..STRETCHES).map(|_| (0..20).map(|_| one_in_32().count_ones()).sum()).collect()
        };
        let gates: Vec<Group> = (0..GATES).map(|_| Group::of(&gate())).collect();
        let most = 1000 + 3 * 31;
        let that_stand_out = |alpha: f64| {
            let uneven = uneven(STRETCHES as f64, alpha);
            gates.iter().filter(|gate| gate.stands_out(uneven)).count()
        };
        let (few, many) = (that_stand_out(0.05), that_stand_out(1.0));
        assert!(few <= most, "{few} of {GATES}");
        assert!(many > most, "{many} of {GATES}");
    }
}
