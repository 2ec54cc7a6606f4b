//! Eye safety: our reading of IEC 60825-1:2014, class 1, point source \[IEC60825\]. Not a
//! certification. Every assumption is a parameter.

use std::f64::consts::FRAC_PI_4;

/// Exposures are judged up to this time, s, beyond which the limit is a power.
const LONGEST: f64 = 10.0;

/// Limits of emission at one wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Class1 {
    /// 700 to 1050 nm: the eye focuses the light on its retina.
    Retina {
        /// C4 = 10^(0.002·(λ/nm − 700)).
        c4: f64,
    },
    /// 1500 to 1800 nm: the light is absorbed before it reaches the retina.
    Cornea,
}

impl Class1 {
    /// The limits at `wavelength` metres; `None` outside 700…1050 and 1500…1800 nm.
    pub fn at(wavelength: f64) -> Option<Self> {
        match wavelength * 1e9 {
            nm if (700.0..=1050.0).contains(&nm) => {
                Some(Self::Retina { c4: libm::pow(10.0, 0.002 * (nm - 700.0)) })
            }
            nm if (1500.0..=1800.0).contains(&nm) => Some(Self::Cornea),
            _ => None,
        }
    }

    /// Energy, J, that one exposure of `duration` t seconds may have.
    ///
    /// * 700–1050 nm: 3.8e-8 below 10 ps; 7.7e-8·C4 to 5 µs; 7e-4·t^0.75·C4 to 10 s; then
    ///   3.9e-4·C4·t.
    /// * 1500–1800 nm: 8e-3 to 0.35 s; 1.8e-2·t^0.75 to 10 s; then 1e-2·t (these from memory).
    pub fn single_exposure(&self, duration: f64) -> f64 {
        match (self, duration) {
            (_, t) if t > LONGEST => self.continuous() * t,
            (Self::Retina { .. }, t) if t < 1e-11 => 3.8e-8,
            (Self::Retina { c4 }, t) if t <= self.counted_as_one() => 7.7e-8 * c4,
            (Self::Retina { c4 }, t) => 7e-4 * libm::pow(t, 0.75) * c4,
            (Self::Cornea, t) if t <= 0.35 => 8e-3,
            (Self::Cornea, t) => 1.8e-2 * libm::pow(t, 0.75),
        }
    }

    /// Power, W, allowed without end: 3.9e-4·C4 (C7 = 1), or 1e-2.
    pub fn continuous(&self) -> f64 {
        match self {
            Self::Retina { c4 } => 3.9e-4 * c4,
            Self::Cornea => 1e-2,
        }
    }

    /// Shots within this time count as one, T_i, s.
    pub fn counted_as_one(&self) -> f64 {
        match self {
            Self::Retina { .. } => 5e-6,
            Self::Cornea => 10.0,
        }
    }

    /// Diameter, m, of the aperture through which an exposure of `duration` t seconds is judged:
    /// 7 mm; or 1 mm to 0.35 s, 1.5·t^(3/8) mm to 10 s, 3.5 mm beyond.
    pub fn aperture(&self, duration: f64) -> f64 {
        match (self, duration) {
            (Self::Retina { .. }, _) => 7e-3,
            (Self::Cornea, t) if t <= 0.35 => 1e-3,
            (Self::Cornea, t) if t < LONGEST => 1.5e-3 * libm::pow(t, 0.375),
            (Self::Cornea, _) => 3.5e-3,
        }
    }

    /// What each rule allows to a shot of `scanned`, the rules in order of growing duration.
    pub fn limits(&self, scanned: &Scanned) -> Vec<Limit> {
        let mut limits = Vec::new();
        let mut add = |rule, shots: f64, duration: f64, factor: f64| {
            // A rule about several shots says nothing new where not even one other takes part.
            if shots > 1.0 || rule == Rule::SingleShot {
                let energy = self.single_exposure(duration) * factor / shots;
                limits.push(Limit { rule, shots, duration, energy });
            }
        };
        add(Rule::SingleShot, 1.0, scanned.shot, 1.0);
        let width = |duration| (self.aperture(duration) / scanned.distance) / scanned.pitch[0];
        let height = |duration| (self.aperture(duration) / scanned.distance) / scanned.pitch[1];

        let line = width(0.0) * scanned.pixel_period;
        let counted = line.min(self.counted_as_one());
        let shots = (counted / scanned.pixel_period).max(1.0);
        let lines = height(LONGEST).max(1.0) * scanned.scan_rate * LONGEST;
        let factor = if scanned.count_lines { self.c5(lines) } else { 1.0 };
        add(Rule::Line, shots, counted, factor);

        let pass = (height(0.0) * scanned.line_period).max(line);
        let inside = |duration| (FRAC_PI_4 * width(duration) * height(duration)).max(1.0);
        add(Rule::Scan, inside(pass), pass, 1.0);
        let forever = LONGEST * (1.0 + f64::EPSILON);
        add(Rule::Average, inside(forever) * scanned.scan_rate * forever, forever, 1.0);
        limits
    }

    /// C5 = 1 for N ≤ 600 groups within 10 s, else max(5·N^−0.25, 0.4); for the retina alone.
    fn c5(&self, groups: f64) -> f64 {
        match self {
            Self::Retina { .. } if groups > 600.0 => (5.0 * libm::pow(groups, -0.25)).max(0.4),
            _ => 1.0,
        }
    }
}

/// How a scanning beam crosses an eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scanned {
    /// Angle between shots of a line and between lines, rad.
    pub pitch: [f64; 2],
    /// Time between shots, between lines, s.
    pub pixel_period: f64,
    /// Time between lines, s.
    pub line_period: f64,
    /// Scans per second.
    pub scan_rate: f64,
    /// Length of a shot, s.
    pub shot: f64,
    /// Distance of the eye, m (100 mm).
    pub distance: f64,
    /// Whether the lines that cross the eye count as repeated exposures, which brings in C5.
    pub count_lines: bool,
}

/// Which exposure a limit is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// One shot alone.
    SingleShot,
    /// The shots of one line that cross the eye, as far as they count as one.
    Line,
    /// All shots of one scan that cross the eye.
    Scan,
    /// Scan after scan without end.
    Average,
}

impl Rule {
    /// What it is about, in a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::SingleShot => "one shot",
            Self::Line => "the shots of one line",
            Self::Scan => "one scan",
            Self::Average => "scan after scan",
        }
    }
}

/// What one rule allows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The rule.
    pub rule: Rule,
    /// Shots it adds up.
    pub shots: f64,
    /// Duration of the exposure, s.
    pub duration: f64,
    /// Energy, J, each of those shots may have.
    pub energy: f64,
}

/// The smallest of `limits`.
pub fn strictest(limits: &[Limit]) -> Option<&Limit> {
    limits.iter().min_by(|a, b| a.energy.total_cmp(&b.energy))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(count_lines: bool) -> Scanned {
        let pixel_period = 1.0 / (60.0 * 407_040.0);
        Scanned {
            pitch: [(43.2_f64 / 848.0).to_radians(), (24.3_f64 / 480.0).to_radians()],
            pixel_period,
            line_period: 848.0 * pixel_period,
            scan_rate: 60.0,
            shot: 27e-9,
            distance: 0.1,
            count_lines,
        }
    }

    fn energy(limits: &[Limit], rule: Rule) -> f64 {
        limits.iter().find(|limit| limit.rule == rule).unwrap().energy
    }

    #[test]
    fn the_limits_at_905_nm() {
        let limits = Class1::at(905e-9).unwrap();
        let Class1::Retina { c4 } = limits else { panic!("905 nm reaches the retina") };
        approx::assert_relative_eq!(c4, 2.570, max_relative = 1e-3);
        approx::assert_relative_eq!(limits.single_exposure(27e-9), 197.9e-9, max_relative = 1e-3);
        approx::assert_relative_eq!(limits.continuous(), 1.00e-3, max_relative = 3e-3);
    }

    #[test]
    fn a_macropulse_may_have_one_nanojoule() {
        let at_905 = Class1::at(905e-9).unwrap();
        let limits = at_905.limits(&paper(true));
        approx::assert_relative_eq!(
            energy(&limits, Rule::SingleShot),
            197.9e-9,
            max_relative = 1e-3
        );
        approx::assert_relative_eq!(energy(&limits, Rule::Line), 1.01e-9, max_relative = 5e-3);
        approx::assert_relative_eq!(energy(&limits, Rule::Scan), 4.41e-9, max_relative = 5e-3);
        approx::assert_relative_eq!(energy(&limits, Rule::Average), 3.41e-9, max_relative = 5e-3);
        assert_eq!(strictest(&limits).unwrap().rule, Rule::Line);
        let without_c5 = at_905.limits(&paper(false));
        approx::assert_relative_eq!(energy(&without_c5, Rule::Line), 2.51e-9, max_relative = 5e-3);
    }

    /// The same scan may carry tens of times the energy where the retina is out of reach, and it
    /// is the mean power that holds it.
    #[test]
    fn at_1550_nm_a_shot_may_have_a_hundred_nanojoules() {
        let limits = Class1::at(1550e-9).unwrap().limits(&paper(true));
        let strictest = strictest(&limits).unwrap();
        assert_eq!(strictest.rule, Rule::Average);
        // 10 mW through 3.5 mm at 100 mm, which is 39.4 by 39.6 shots less the corners.
        approx::assert_relative_eq!(strictest.energy, 136.4e-9, max_relative = 0.01);
        assert!(energy(&limits, Rule::Line) > 1e-6);
    }

    #[test]
    fn limits_of_1550_nm_meet_where_the_rule_changes() {
        let cornea = Class1::Cornea;
        for time in [0.35, 10.0] {
            let (before, after) = (time * (1.0 - 1e-9), time * (1.0 + 1e-9));
            let (before, after) = (cornea.single_exposure(before), cornea.single_exposure(after));
            approx::assert_relative_eq!(before, after, max_relative = 0.03);
        }
    }

    #[test]
    fn other_wavelengths_are_not_guessed() {
        assert!(Class1::at(532e-9).is_none());
        assert!(Class1::at(1310e-9).is_none());
    }
}
