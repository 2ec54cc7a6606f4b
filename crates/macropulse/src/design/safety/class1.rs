//! The limits of class 1 at one wavelength \[IEC60825\].

/// Exposures are judged up to this time, s, beyond which the limit is a power.
pub const LONGEST: f64 = 10.0;

/// How far away an eye behind a telescope is, m.
pub const TELESCOPE: f64 = 2.0;

/// Angle, mrad, below which a source is a point on the retina, α_min.
const POINT: f64 = 1.5;

/// The largest α_max, mrad, which is that of exposures of a quarter of a second and longer.
const LARGE: f64 = 100.0;

/// How many times nearer a source seems behind a telescope.
const MAGNIFIED: f64 = 7.0;

/// Limits of emission at one wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Class1 {
    /// 700 to 1050 nm: the eye focuses the light on its retina.
    Retina {
        /// C4 = 10^(0.002·(λ/nm − 700)).
        c4: f64,
        /// Angle α that the source subtends, mrad; 1.5 for a point.
        source: f64,
    },
    /// 1400 to 1500 nm: the light is absorbed before it reaches the retina, part of it in the lens.
    Lens,
    /// 1500 to 1800 nm: the light is absorbed in front of the lens.
    Cornea,
}

/// An opening through which light is judged, and the durations of the exposures that it judges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Diameter, m.
    pub diameter: f64,
    /// It judges exposures longer than the first and up to the second, s.
    pub durations: [f64; 2],
}

/// The distance and the width of the opening through which light is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Condition {
    /// Distance of the opening, m.
    pub distance: f64,
    /// How many times as wide as for the bare eye it is.
    pub widened: f64,
}

impl Condition {
    /// Returns condition 3, the bare eye, `distance` metres away.
    pub fn bare_eye(distance: f64) -> Self {
        Self { distance, widened: 1.0 }
    }
}

impl Class1 {
    /// The limits at `wavelength` metres; `None` outside 700…1050 and 1400…1800 nm.
    pub fn at(wavelength: f64) -> Option<Self> {
        match wavelength * 1e9 {
            nm if (700.0..=1050.0).contains(&nm) => {
                Some(Self::Retina { c4: libm::pow(10.0, 0.002 * (nm - 700.0)), source: POINT })
            }
            nm if (1400.0..1500.0).contains(&nm) => Some(Self::Lens),
            nm if (1500.0..=1800.0).contains(&nm) => Some(Self::Cornea),
            _ => None,
        }
    }

    /// The limits of light whose source is `width` m wide, under a `condition`. It makes no difference above 1400 nm.
    pub fn of_source(self, width: f64, condition: &Condition) -> Self {
        let Self::Retina { c4, .. } = self else { return self };
        let magnified = if condition.widened > 1.0 { MAGNIFIED } else { 1.0 };
        Self::Retina { c4, source: (magnified * width / condition.distance * 1e3).max(POINT) }
    }

    /// The factor by which a spot on the retina that is larger than that of a point raises the limit of an exposure of
    /// `duration` t seconds.
    ///
    /// C6 = α/1.5 mrad up to α_max. Light from more than α_max of an even source does not count, which makes it
    /// α²/(1.5 mrad·α_max) beyond. The bound α_max is 5 mrad below 625 µs, 200 mrad·√(t/s) to 0.25 s and 100 mrad beyond.
    fn c6(&self, duration: f64) -> f64 {
        match self {
            Self::Retina { source, .. } => source / POINT * (source / largest(duration)).max(1.0),
            Self::Lens | Self::Cornea => 1.0,
        }
    }

    /// Time, s, beyond which the limit is a power: T2 = 10·10^((α − 1.5 mrad)/98.5 mrad), 100 at most; 10 above 1400 nm.
    fn until_power(&self) -> f64 {
        match self {
            Self::Retina { source, .. } => {
                LONGEST * libm::pow(10.0, (source.min(LARGE) - POINT) / (LARGE - POINT))
            }
            Self::Lens | Self::Cornea => LONGEST,
        }
    }

    /// The share of the limit of one exposure of `duration` t seconds that each of many such has. For a source above 5 mrad
    /// and exposures longer than T_i this is the least C5: 0.4, or 0.2 where α > α_max. It is 1 for all others,
    /// and above 100 mrad.
    pub(super) fn c5_of_long(&self, duration: f64) -> f64 {
        match self {
            Self::Retina { source, .. } if duration > self.counted_as_one() => match *source {
                source if source <= 5.0 || source > LARGE => 1.0,
                source if source <= largest(duration) => 0.4,
                _ => 0.2,
            },
            _ => 1.0,
        }
    }

    /// Energy, J, that one exposure of `duration` t seconds may have.
    ///
    /// * 700–1050 nm: 3.8e-8·C6 below 10 ps; 7.7e-8·C4·C6 to 5 µs; 7e-4·t^0.75·C4·C6 to T2; then
    ///   7e-4·T2^(−¼)·C4·C6·t, which is 3.9e-4·C4·t for a point (C7 = 1).
    /// * 1400–1500 nm: 8e5·t below 1 ns; 8e-4 to 1 ms; 4.4e-3·t^0.25 to 0.35 s; then 1e-2·t.
    /// * 1500–1800 nm: 8e6·t below 1 ns; 8e-3 to 0.35 s; 1.8e-2·t^0.75 to 10 s; then 1e-2·t.
    pub fn single_exposure(&self, duration: f64) -> f64 {
        match (self, duration) {
            (_, t) if t > self.until_power() => self.continuous() * t,
            (Self::Retina { .. }, t) if t < 1e-11 => 3.8e-8 * self.c6(t),
            (Self::Retina { c4, .. }, t) if t <= self.counted_as_one() => 7.7e-8 * c4 * self.c6(t),
            (Self::Retina { c4, .. }, t) => 7e-4 * libm::pow(t, 0.75) * c4 * self.c6(t),
            (Self::Lens, t) if t < 1e-9 => 8e5 * t,
            (Self::Lens, t) if t <= 1e-3 => 8e-4,
            (Self::Lens, t) if t <= 0.35 => 4.4e-3 * libm::pow(t, 0.25),
            (Self::Lens, t) => 1e-2 * t,
            (Self::Cornea, t) if t < 1e-9 => 8e6 * t,
            (Self::Cornea, t) if t <= 0.35 => 8e-3,
            (Self::Cornea, t) => 1.8e-2 * libm::pow(t, 0.75),
        }
    }

    /// Power, W, allowed without end: 3.9e-4·C4 for a point (C7 = 1), 7e-4·T2^(−¼)·C4·C6 for others, or 1e-2.
    pub fn continuous(&self) -> f64 {
        match self {
            Self::Retina { c4, source } if *source <= POINT => 3.9e-4 * c4,
            Self::Retina { c4, .. } => {
                7e-4 * libm::pow(self.until_power(), -0.25) * c4 * self.c6(f64::INFINITY)
            }
            Self::Lens | Self::Cornea => 1e-2,
        }
    }

    /// Shots within this time count as one, T_i, s.
    pub fn counted_as_one(&self) -> f64 {
        match self {
            Self::Retina { .. } => 5e-6,
            Self::Lens => 1e-3,
            Self::Cornea => 10.0,
        }
    }

    /// Diameter, m, of the aperture through which an exposure of `duration` t seconds is judged:
    /// 7 mm; above 1400 nm 1 mm to 0.35 s, 1.5·t^(3/8) mm to 10 s, 3.5 mm beyond.
    pub fn aperture(&self, duration: f64) -> f64 {
        match (self, duration) {
            (Self::Retina { .. }, _) => 7e-3,
            (_, t) if t <= 0.35 => 1e-3,
            (_, t) if t < LONGEST => 1.5e-3 * libm::pow(t, 0.375),
            _ => 3.5e-3,
        }
    }

    /// The apertures to judge through. One that grows with the duration is taken in three steps,
    /// each as wide as it becomes.
    pub(in crate::design) fn openings(&self) -> Vec<Opening> {
        if let Self::Retina { .. } = self {
            return vec![Opening { diameter: 7e-3, durations: [0.0, f64::INFINITY] }];
        }
        let ends = [0.0, 0.35, 1.0, libm::sqrt(LONGEST), LONGEST, f64::INFINITY];
        let opening = |ends: &[f64]| Opening {
            diameter: self.aperture(ends[1]),
            durations: [ends[0], ends[1]],
        };
        ends.windows(2).map(opening).collect()
    }

    /// Condition 1, an eye behind a telescope or binoculars: 2 m away, through 50 mm to the retina, above
    /// 1400 nm through seven times the openings of the bare eye.
    pub fn telescope(&self) -> Condition {
        let widened = if let Self::Retina { .. } = self { 50.0 / 7.0 } else { 7.0 };
        Condition { distance: TELESCOPE, widened }
    }

    /// C5 = 1 for N ≤ 600 groups within 10 s, else max(5·N^−0.25, 0.4); for the retina alone.
    pub(super) fn c5(&self, groups: f64) -> f64 {
        match self {
            Self::Retina { .. } if groups > 600.0 => (5.0 * libm::pow(groups, -0.25)).max(0.4),
            _ => 1.0,
        }
    }
}

/// α_max, mrad: light from a larger part of a source does not count in an exposure of `duration` t seconds.
fn largest(duration: f64) -> f64 {
    match duration {
        t if t < 625e-6 => 5.0,
        t if t < 0.25 => 200.0 * libm::sqrt(t),
        _ => LARGE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_limits_at_905_nm() {
        let limits = Class1::at(905e-9).unwrap();
        let Class1::Retina { c4, .. } = limits else { panic!("905 nm reaches the retina") };
        assert_relative_eq!(c4, 2.570, max_relative = 1e-3);
        assert_relative_eq!(limits.single_exposure(27e-9), 197.9e-9, max_relative = 1e-3);
        assert_relative_eq!(limits.continuous(), 1.00e-3, max_relative = 3e-3);
        assert_relative_eq!(limits.single_exposure(100.0), 0.1002, max_relative = 1e-3);
        assert_eq!(limits.single_exposure(2.5e-12), 3.8e-8);
    }

    /// A source of 3 mm 0.1 m away subtends 30 mrad, behind a telescope 2 m away 10.5 mrad. Worked out by hand with C4 of
    /// 850 nm, 1.9953, by the limits of IEC 60825-1 and, for sources above α_max, the C_E of ICNIRP, α²/(α_min·α_max).
    #[test]
    fn a_wide_source_is_allowed_more() {
        let point = Class1::at(850e-9).unwrap();
        let eye = point.of_source(3e-3, &Condition::bare_eye(0.1));
        let telescope = point.of_source(3e-3, &point.telescope());
        for (class, duration, energy) in [
            // C6 = 30²/(1.5·5).
            (eye, 1e-9, 7.7e-8 * 1.9953 * 120.0),
            (eye, 1e-4, 7e-4 * 1e-3 * 1.9953 * 120.0),
            // α_max = 200·√0.01 = 20 mrad, and 30 mrad is less than 100.
            (eye, 0.01, 7e-4 * 0.031_622_8 * 1.9953 * 30.0),
            (eye, 1.0, 7e-4 * 1.9953 * 20.0),
            (telescope, 1.0, 7e-4 * 1.9953 * 7.0),
            // T2 = 10·10^(28.5/98.5) = 19.47 s.
            (eye, 100.0, 7e-4 * 100.0 / 19.47_f64.powf(0.25) * 1.9953 * 20.0),
            (point, 1.0, 7e-4 * 1.9953),
        ] {
            assert_relative_eq!(class.single_exposure(duration), energy, max_relative = 1e-3);
        }
        let share = |class: Class1, duration| class.c5_of_long(duration);
        assert_eq!([share(eye, 1e-6), share(eye, 1e-4), share(eye, 0.1)], [1.0, 0.2, 0.4]);
        assert_eq!([share(point, 0.1), share(Class1::Lens, 0.1)], [1.0, 1.0]);
        let wall = point.of_source(1.0, &Condition::bare_eye(0.1));
        assert_eq!(share(wall, 0.1), 1.0);
        let longest = wall.single_exposure(99.0) / 99.0;
        assert_relative_eq!(longest, wall.continuous(), max_relative = 0.01);
        assert_eq!(Class1::Cornea.of_source(1.0, &Condition::bare_eye(0.1)), Class1::Cornea);
    }

    #[test]
    fn a_telescope_has_50_mm_or_seven_times_the_opening() {
        let diameter = |nm: f64, of: fn(&Class1) -> f64| {
            let class = Class1::at(nm * 1e-9).unwrap();
            class.telescope().widened * of(&class)
        };
        assert_relative_eq!(diameter(905.0, |class| class.aperture(1.0)), 0.05);
        assert_relative_eq!(diameter(1550.0, |class| class.aperture(0.1)), 7e-3);
        assert_relative_eq!(diameter(1450.0, |class| class.aperture(20.0)), 24.5e-3);
    }

    #[test]
    fn the_limits_at_850_and_940_nm() {
        for (nm, pulse, power) in [(850.0, 153.6e-9, 0.778e-3), (940.0, 232.5e-9, 1.178e-3)] {
            let limits = Class1::at(nm * 1e-9).unwrap();
            assert_relative_eq!(limits.single_exposure(1e-9), pulse, max_relative = 1e-3);
            assert_relative_eq!(limits.continuous(), power, max_relative = 1e-3);
        }
    }

    #[test]
    fn limits_meet_where_the_rule_changes() {
        let retina = Class1::at(905e-9).unwrap();
        let edges = [
            (retina, vec![5e-6, 10.0]),
            (Class1::Lens, vec![1e-9, 1e-3, 0.35, 10.0]),
            (Class1::Cornea, vec![1e-9, 0.35, 10.0]),
        ];
        for (class, times) in edges {
            for time in times {
                let (before, after) = (time * (1.0 - 1e-9), time * (1.0 + 1e-9));
                let (before, after) = (class.single_exposure(before), class.single_exposure(after));
                assert_relative_eq!(before, after, max_relative = 0.05);
            }
        }
    }

    #[test]
    fn apertures_cover_every_duration_and_are_never_too_small() {
        for class in [Class1::at(905e-9).unwrap(), Class1::Lens, Class1::Cornea] {
            let openings = class.openings();
            assert_eq!(openings[0].durations[0], 0.0);
            assert_eq!(openings.last().unwrap().durations[1], f64::INFINITY);
            for pair in openings.windows(2) {
                assert_eq!(pair[0].durations[1], pair[1].durations[0]);
            }
            for Opening { diameter, durations: [from, to] } in openings {
                for part in [1e-3, 0.5, 1.0] {
                    let time = from + part * (to.min(1e3) - from);
                    assert!(diameter >= class.aperture(time), "{class:?} at {time} s");
                }
            }
        }
        assert_eq!(Class1::Cornea.aperture(1.0), 1.5e-3);
    }

    #[test]
    fn other_wavelengths_are_not_guessed() {
        for nm in [532.0, 1051.0, 1310.0, 1801.0] {
            assert!(Class1::at(nm * 1e-9).is_none(), "{nm}");
        }
        assert_eq!(Class1::at(1450e-9), Some(Class1::Lens));
        assert_eq!(Class1::at(1550e-9), Some(Class1::Cornea));
    }
}
