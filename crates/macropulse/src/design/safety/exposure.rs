//! The energy that class 1 allows to the shots that cross an eye.

use super::class1::{Class1, LONGEST};

/// Exposures beyond [`LONGEST`] are judged up to this time, s, and then by their mean power.
const LAST: f64 = 100.0;

/// Rules that depend on the place.
pub(super) const RULES: usize = 4;

/// Places at which a run of shots is cut at each end, to find the part that is allowed least.
const CUTS: usize = 128;

/// A shot that crosses the aperture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// When within the scan it is fired, s.
    pub time: f64,
    /// The share of its light that passes the aperture.
    pub share: f64,
    /// Its energy through the aperture, in energies of a mean shot.
    pub energy: f64,
}

/// The shots of one scan that cross an aperture at one place.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossings {
    /// The exposures that this aperture judges: longer than the first and up to the second, s.
    pub durations: [f64; 2],
    /// The shots, in the order of their times.
    pub shots: Vec<Crossing>,
}

/// The light that a sensor sends to an eye.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposure {
    /// How far away the eye is, m.
    pub distance: f64,
    /// Duration of a scan, s.
    pub scan_period: f64,
    /// Length of a shot, s.
    pub shot: f64,
    /// Length of one mark, s.
    pub mark: f64,
    /// The most light that one shot brings through an aperture, in energies of a mean shot.
    pub brightest_shot: f64,
    /// The same of one mark.
    pub brightest_mark: f64,
    /// The largest share of a shot's energy within T_i.
    pub counted_as_one: f64,
    /// True if groups of shots that cross the eye count as repeated exposures, which brings in C5.
    pub count_groups: bool,
    /// The shots that cross the eye, by aperture and where the eye is.
    pub places: Vec<Crossings>,
}

/// Which exposure a limit is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// One mark of a shot alone.
    Mark,
    /// One shot alone.
    SingleShot,
    /// The shots that cross the eye within T_i and so count as one; repeated, with C5.
    Group,
    /// Shots of one scan, over any time longer than T_i.
    Scan,
    /// Scan after scan, up to 100 s.
    Repeated,
    /// Scan after scan without end.
    Average,
}

impl Rule {
    /// Every rule, in the order of growing duration.
    pub const ALL: [Self; 6] =
        [Self::Mark, Self::SingleShot, Self::Group, Self::Scan, Self::Repeated, Self::Average];

    /// Returns its subject in a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mark => "one mark",
            Self::SingleShot => "one shot",
            Self::Group => "the shots that count as one",
            Self::Scan => "one scan",
            Self::Repeated => "several scans",
            Self::Average => "scan after scan",
        }
    }
}

/// The limit that one rule sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The rule.
    pub rule: Rule,
    /// How far away the eye is that it protects, m.
    pub distance: f64,
    /// Shots it adds up: their shares through the aperture.
    pub shots: f64,
    /// How bright those are on average, the mean shot being 1.
    pub brightness: f64,
    /// Duration of the exposure, s.
    pub duration: f64,
    /// Energy, J, that the mean shot may have.
    pub energy: f64,
}

/// The smallest of `limits`.
pub fn strictest(limits: &[Limit]) -> Option<&Limit> {
    limits.iter().min_by(|a, b| a.energy.total_cmp(&b.energy))
}

/// Returns the smallest of `limits` for each rule, in the order of growing duration. A rule without a limit
/// is left out.
pub fn strictest_of_each(limits: &[Limit]) -> Vec<Limit> {
    let of_rule = |rule: Rule| {
        let limits = limits.iter().filter(|limit| limit.rule == rule);
        limits.min_by(|a, b| a.energy.total_cmp(&b.energy)).copied()
    };
    Rule::ALL.into_iter().filter_map(of_rule).collect()
}

/// Returns the limit that each rule sets for `exposure`, in the order of growing duration. A rule that no
/// exposure falls under is left out.
///
/// The shots that follow each other through an aperture are judged in runs of several durations. Each run has
/// at most the energy of a single exposure that lasts equally long. So the sum of the energies of its shots,
/// times that of a mean shot, is ≤ AEL(t). The durations begin at T_i and are doubled each time. Whole
/// numbers of scans are tried, too, doubled each time, to 100 s.
pub fn limits(class: &Class1, exposure: &Exposure) -> Vec<Limit> {
    let mut all = Vec::new();
    let mut add = |rule, shots: f64, brightness: f64, duration| {
        let factor = if exposure.count_groups { class.c5_of_long(duration) } else { 1.0 };
        let energy = factor * class.single_exposure(duration) / (shots * brightness);
        all.push(Limit { rule, distance: exposure.distance, shots, brightness, duration, energy });
    };
    if exposure.mark < exposure.shot {
        add(Rule::Mark, exposure.brightest_mark, 1.0, exposure.mark);
    }
    add(Rule::SingleShot, 1.0, exposure.brightest_shot, exposure.shot);
    for Crossings { durations, shots } in &exposure.places {
        let train = Train::of(class, exposure, (*durations, shots));
        all.extend(train.limits().into_iter().flatten());
    }
    strictest_of_each(&all)
}

/// The energy, J, that each rule about several shots allows a mean shot where these `shots` cross an aperture
/// that judges such `durations`; infinite where it does not apply.
pub(super) fn allowed(
    class: &Class1,
    exposure: &Exposure,
    durations: [f64; 2],
    shots: &[Crossing],
) -> [f64; RULES] {
    let limits = Train::of(class, exposure, (durations, shots)).limits();
    limits.map(|limit| limit.map_or(f64::INFINITY, |limit| limit.energy))
}

/// The shots that cross an aperture in two scans, and the sums of what they bring.
struct Train<'a> {
    class: &'a Class1,
    exposure: &'a Exposure,
    durations: [f64; 2],
    /// Shots in one scan.
    shots: usize,
    times: Vec<f64>,
    /// Shares and energies of all shots before the one with that number.
    sums: Vec<[f64; 2]>,
}

impl<'a> Train<'a> {
    fn of(
        class: &'a Class1,
        exposure: &'a Exposure,
        (durations, crossing): ([f64; 2], &[Crossing]),
    ) -> Self {
        let shots = crossing.len();
        let (mut times, mut sums) = (Vec::with_capacity(2 * shots), vec![[0.0; 2]]);
        let mut sum = [0.0; 2];
        for scan in [0.0, exposure.scan_period] {
            for shot in crossing {
                times.push(scan + shot.time);
                sum = [sum[0] + shot.share, sum[1] + shot.energy];
                sums.push(sum);
            }
        }
        Self { class, exposure, durations, shots, times, sums }
    }

    fn limits(&self) -> [Option<Limit>; RULES] {
        [self.group(), self.within_a_scan(), self.repeated(), self.average()]
    }

    /// Returns true if this aperture judges exposures of `duration` seconds.
    fn judges(&self, duration: f64) -> bool {
        duration > self.durations[0] && duration <= self.durations[1]
    }

    /// Returns the limit of `rule` on a mean shot if `sum` crosses, from `factor` times the limit of
    /// `duration`.
    fn limit(
        &self,
        rule: Rule,
        [shots, energy]: [f64; 2],
        (duration, factor): (f64, f64),
    ) -> Limit {
        let allowed = factor * self.class.single_exposure(duration) / energy;
        Limit {
            rule,
            distance: self.exposure.distance,
            shots,
            brightness: energy / shots,
            duration,
            energy: allowed,
        }
    }

    /// Returns the longest runs of shots that fit into `longest` seconds, one for each first shot of the
    /// scan. A run is the number of its first shot and the number behind its last.
    fn runs(&self, longest: f64) -> impl Iterator<Item = [usize; 2]> {
        let mut end = 0;
        (0..self.shots).map(move |first| {
            // A scan's worth at most: the same shot does not come twice.
            let most = first + self.shots;
            end = end.max(first + 1);
            while end < most && self.duration([first, end + 1]) <= longest {
                end += 1;
            }
            [first, end]
        })
    }

    /// Shares and energies of a run.
    fn sum(&self, [first, end]: [usize; 2]) -> [f64; 2] {
        let ([before, energy_before], [all, energy]) = (self.sums[first], self.sums[end]);
        [all - before, energy - energy_before]
    }

    /// Seconds from the first light of a run to the last.
    fn duration(&self, [first, end]: [usize; 2]) -> f64 {
        self.times[end - 1] + self.exposure.shot - self.times[first]
    }

    /// The shots within T_i, together one exposure, which C5 reduces where many of them follow.
    fn group(&self) -> Option<Limit> {
        let longest = self.class.counted_as_one();
        if longest > self.exposure.scan_period || !self.judges(longest) {
            return None;
        }
        let together = longest.max(self.exposure.shot);
        let groups = self.groups(together) as f64 * (together / longest) * LONGEST
            / self.exposure.scan_period;
        let counts = self.exposure.count_groups;
        let factor = if counts { self.class.c5(groups.ceil()) } else { 1.0 };
        let runs = self.runs(longest);
        let brightest = runs.max_by(|a, b| self.sum(*a)[1].total_cmp(&self.sum(*b)[1]));
        brightest.map(|run| {
            // The duration is for people to read: the limit is that of T_i.
            let sum = self.sum(run).map(|sum| sum * self.exposure.counted_as_one);
            let limit = self.limit(Rule::Group, sum, (longest, factor));
            Limit { duration: self.duration(run), ..limit }
        })
    }

    /// How many exposures a scan has, where shots within `together` seconds of the first one are
    /// one.
    fn groups(&self, together: f64) -> usize {
        let mut groups = 0;
        let mut until = f64::NEG_INFINITY;
        for time in &self.times[..self.shots] {
            if *time >= until {
                groups += 1;
                until = time + together;
            }
        }
        groups
    }

    fn within_a_scan(&self) -> Option<Limit> {
        let period = self.exposure.scan_period.min(LAST);
        let counted = self.class.counted_as_one();
        // Shots within T_i have their own rule, unless the scan is over sooner.
        let least = if counted > period { 0.0 } else { counted };
        let mut longest = least.max(self.exposure.shot);
        let mut best: Option<(f64, [usize; 2])> = None;
        while longest < period {
            longest = (longest * 2.0).min(period);
            let mut strictest: Option<(f64, [usize; 2])> = None;
            for run in self.runs(longest) {
                // Less light in more time than that of the strictest is allowed more.
                let is_less = strictest.is_some_and(|(_, other)| {
                    self.sum(run)[1] <= self.sum(other)[1]
                        && self.duration(run) >= self.duration(other)
                });
                if !is_less {
                    self.keep(&mut strictest, run, least);
                }
            }
            // A part of it may be allowed less, for a shorter time.
            for _ in 0..2 {
                if let Some((_, [first, end])) = strictest {
                    let ends = (first + 1..end).step_by((end - first).div_ceil(CUTS));
                    ends.for_each(|end| self.keep(&mut strictest, [first, end], least));
                }
                if let Some((_, [first, end])) = strictest {
                    let firsts = (first..end).step_by((end - first).div_ceil(CUTS));
                    firsts.for_each(|first| self.keep(&mut strictest, [first, end], least));
                }
            }
            best = best.into_iter().chain(strictest).min_by(|a, b| a.0.total_cmp(&b.0));
        }
        best.map(|(_, run)| self.limit(Rule::Scan, self.sum(run), (self.duration(run), 1.0)))
    }

    /// Keeps the `run` if it is judged, lasts longer than `least` and is allowed less than the `strictest`.
    fn keep(&self, strictest: &mut Option<(f64, [usize; 2])>, run: [usize; 2], least: f64) {
        let duration = self.duration(run);
        if duration > least && self.judges(duration) {
            let energy = self.class.single_exposure(duration) / self.sum(run)[1];
            if strictest.is_none_or(|(other, _)| energy < other) {
                *strictest = Some((energy, run));
            }
        }
    }

    fn repeated(&self) -> Option<Limit> {
        let period = self.exposure.scan_period;
        let (first, last) = (self.times.first()?, self.times.get(self.shots - 1)?);
        let pass = last - first + self.exposure.shot;
        let once = *self.sums.get(self.shots)?;
        let most = |longest: f64| ((longest - pass) / period * (1.0 + 1e-12)).floor() + 1.0;
        let mut tried: Vec<f64> = (1..40).map(|power| libm::exp2(f64::from(power))).collect();
        // And the most scans that one exposure, one aperture or all that is judged can hold.
        let ends = [LONGEST, self.durations[1].min(LAST)];
        tried.extend(ends.map(most));
        // From 10 s on a power is allowed, which the first exposure beyond uses up soonest.
        tried.push(most(LONGEST) + 1.0);
        let mut limits = Vec::new();
        for scans in tried {
            // Beyond the last step of the limits an exposure is as long as it is judged.
            let duration = (scans - 1.0) * period + pass;
            if scans >= 2.0 && duration <= LAST && self.judges(duration) {
                let sum = once.map(|part| part * scans);
                limits.push(self.limit(Rule::Repeated, sum, (duration, 1.0)));
            }
        }
        strictest(&limits).copied()
    }

    fn average(&self) -> Option<Limit> {
        if !self.durations[1].is_infinite() || self.shots == 0 {
            return None;
        }
        let scans = LAST / self.exposure.scan_period;
        let sum = self.sums[self.shots].map(|part| part * scans);
        Some(self.limit(Rule::Average, sum, (LAST, 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const CLASS: Class1 = Class1::Retina { c4: 1.0, source: 1.5 };

    fn of(times: &[f64], count_groups: bool) -> Vec<Limit> {
        let shot = |&time: &f64| Crossing { time, share: 0.5, energy: 1.0 };
        let shots = times.iter().map(shot).collect();
        limits(
            &CLASS,
            &Exposure {
                distance: 0.1,
                scan_period: 0.1,
                shot: 1e-9,
                mark: 1e-9,
                brightest_shot: 1.0,
                brightest_mark: 1.0,
                counted_as_one: 1.0,
                count_groups,
                places: vec![Crossings { durations: [0.0, f64::INFINITY], shots }],
            },
        )
    }

    fn found(limits: &[Limit], rule: Rule) -> Limit {
        *limits.iter().find(|limit| limit.rule == rule).unwrap()
    }

    #[test]
    fn one_shot_a_scan_is_held_by_its_single_exposure() {
        let limits = of(&[0.03], true);
        // 100 shots in 10 s are no reason for C5, and one mark is all of the shot.
        assert_eq!(strictest(&limits).unwrap().energy, 7.7e-8);
        let rules: Vec<Rule> = limits.iter().map(|limit| limit.rule).collect();
        assert_eq!(rules, [Rule::SingleShot, Rule::Group, Rule::Repeated, Rule::Average]);
        assert_eq!(found(&limits, Rule::Group).brightness, 2.0);
        assert_relative_eq!(found(&limits, Rule::Average).energy, 3.9e-5, max_relative = 1e-12);
    }

    #[test]
    fn shots_within_t_i_are_one_wherever_the_scan_ends() {
        let together = of(&[0.03, 0.03 + 4e-6], true);
        assert_relative_eq!(found(&together, Rule::Group).energy, 3.85e-8, max_relative = 1e-12);
        // The last shot of a scan and the first of the next are 2 µs apart.
        let over_the_end = of(&[1e-6, 0.1 - 1e-6], true);
        assert_relative_eq!(found(&over_the_end, Rule::Group).energy, 3.85e-8, max_relative = 1e-9);
        let apart = of(&[0.03, 0.03 + 6e-6], true);
        assert_eq!(found(&apart, Rule::Group).energy, 7.7e-8);
        let scan = found(&apart, Rule::Scan);
        assert_relative_eq!(scan.duration, 6.001e-6, max_relative = 1e-9);
        assert_relative_eq!(scan.energy, 7e-4 * 6.001e-6_f64.powf(0.75) / 2.0, max_relative = 1e-9);
    }

    #[test]
    fn many_groups_in_ten_seconds_bring_in_c5() {
        let times: Vec<f64> = (0..64).map(|n| f64::from(n) * 1e-3).collect();
        let c5 = 5.0 * 6400_f64.powf(-0.25);
        let counted = found(&of(&times, true), Rule::Group).energy;
        assert_relative_eq!(counted, 7.7e-8 * c5, max_relative = 1e-12);
        assert_eq!(found(&of(&times, false), Rule::Group).energy, 7.7e-8);
    }

    #[test]
    fn an_eye_that_nothing_crosses_is_no_limit() {
        let rules: Vec<Rule> = of(&[], true).iter().map(|limit| limit.rule).collect();
        assert_eq!(rules, [Rule::SingleShot]);
    }
}
