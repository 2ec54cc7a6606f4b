//! The shots beside each one, in its row and in its column.

use crate::ShotLog;

/// Shots between one and its neighbour in a direction at most.
pub(super) const FARTHEST: usize = 64;

/// Directions in which a shot has neighbours.
const DIRECTIONS: usize = 4;

/// The next shot of each one in each direction: to both sides of its row and its column.
pub(super) struct Neighbours([Vec<Option<u32>>; DIRECTIONS]);

impl Neighbours {
    /// Those of the shots of a `log`.
    pub fn of(log: &ShotLog) -> Self {
        let before = [last_beside(&log.row, &log.column), last_beside(&log.column, &log.row)];
        let [right, below] = [&before[0], &before[1]].map(|before| reversed(before));
        let [left, above] = before;
        Self([left, right, above, below])
    }

    /// The lags at which neighbours lead to expect light of `shot`, if that of another one comes after a known `lag`.
    ///
    /// In each direction they are the lag of the nearest shot that has one, and that on the line through the nearest two.
    pub fn expected_lags(&self, shot: usize, lag: impl Fn(usize) -> Option<i64>) -> Vec<i64> {
        let mut lags = Vec::with_capacity(2 * DIRECTIONS);
        for beside in &self.0 {
            let next = |at: &usize| beside[*at].map(|next| next as usize);
            let way = std::iter::successors(Some(shot), next).enumerate().skip(1).take(FARTHEST);
            let found = way.filter_map(|(away, at)| Some((away as i64, lag(at)?)));
            let two: Vec<(i64, i64)> = found.take(2).collect();
            lags.extend(two.first().map(|(_, lag)| lag));
            if let [(near, lag), (far, other)] = two[..] {
                lags.push(lag + (lag - other) * near / (far - near));
            }
        }
        lags
    }
}

/// Mean number of neighbours of a shot, from which a matched receiver predicts its light. They are in its channel, in
/// its row or its column, and within reach.
pub fn neighbours(log: &ShotLog) -> f64 {
    let each = log.each_channel().into_iter().flat_map(|(_, log)| {
        [last_beside(&log.row, &log.column), last_beside(&log.column, &log.row)]
    });
    // Each pair counts for both.
    let pairs: usize = each.map(|before| pairs_within(&before)).sum();
    2.0 * pairs as f64 / log.len().max(1) as f64
}

/// Pairs of shots in a direction, not farther than [`FARTHEST`] apart, by the shot `before` each one.
fn pairs_within(before: &[Option<u32>]) -> usize {
    let mut behind = vec![0; before.len()];
    for (shot, before) in before.iter().enumerate() {
        behind[shot] = before.map_or(0, |before| behind[before as usize] + 1);
    }
    behind.into_iter().map(|behind: usize| behind.min(FARTHEST)).sum()
}

/// For each shot, the last one before it that is the `same` in one coordinate and not in the `other`.
pub(super) fn last_beside(same: &[u16], other: &[u16]) -> Vec<Option<u32>> {
    let places = same.iter().max().map_or(0, |&place| usize::from(place) + 1);
    let mut last: Vec<Option<u32>> = vec![None; places];
    let mut beside = Vec::with_capacity(same.len());
    for shot in 0..same.len() {
        let here = &mut last[usize::from(same[shot])];
        beside.push(here.filter(|&before| other[before as usize] != other[shot]));
        *here = Some(shot as u32);
    }
    beside
}

/// The next shot behind each one, by those `before`.
fn reversed(before: &[Option<u32>]) -> Vec<Option<u32>> {
    let mut behind = vec![None; before.len()];
    for (shot, before) in (0..).zip(before) {
        if let Some(before) = before {
            behind[*before as usize] = Some(shot);
        }
    }
    behind
}
