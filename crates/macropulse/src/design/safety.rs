//! Eye safety: our reading of IEC 60825-1:2014, class 1, 700–1050 nm, point source. Not a
//! certification. Every assumption is a parameter.

/// Emission limits at one wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Class1 {
    /// C4 = 10^(0.002·(λ − 700 nm)) \[IEC60825\].
    pub c4: f64,
}

/// Pulses within this time count as one between 700 and 1050 nm (T_i), s.
pub const COUNTED_AS_ONE: f64 = 5e-6;

impl Class1 {
    /// The limits at `wavelength` metres; `None` outside 700…1050 nm.
    pub fn at(wavelength: f64) -> Option<Self> {
        let nm = wavelength * 1e9;
        (700.0..=1050.0).contains(&nm).then(|| Self { c4: libm::pow(10.0, 0.002 * (nm - 700.0)) })
    }

    /// Energy, J, that one exposure of `duration` seconds may have:
    /// 3.8e-8 J below 10 ps; 7.7e-8·C4 J to 5 µs; 7e-4·t^0.75·C4 J to 10 s; then 3.9e-4·C4·t.
    pub fn single_exposure(&self, duration: f64) -> f64 {
        match duration {
            t if t < 1e-11 => 3.8e-8,
            t if t <= COUNTED_AS_ONE => 7.7e-8 * self.c4,
            t if t <= 10.0 => 7e-4 * libm::pow(t, 0.75) * self.c4,
            t => self.continuous() * t,
        }
    }

    /// Power, W, allowed without end: 3.9e-4·C4 (C7 = 1).
    pub fn continuous(&self) -> f64 {
        3.9e-4 * self.c4
    }

    /// Energy, J, each shot of a scan may have when the eye's aperture collects all shots that
    /// cross it within T_i.
    pub fn per_shot(&self, scanned: &Scanned) -> f64 {
        let crossing = scanned.aperture / scanned.distance / scanned.pixel_pitch;
        let within = (COUNTED_AS_ONE / scanned.pixel_period).min(crossing);
        self.single_exposure(within * scanned.pixel_period) * scanned.c5() / within
    }
}

/// How a scanning beam crosses an eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scanned {
    /// Angle between shots, rad.
    pub pixel_pitch: f64,
    /// Time between shots, s.
    pub pixel_period: f64,
    /// Aperture of the measurement, m (7 mm).
    pub aperture: f64,
    /// Distance of the measurement, m (100 mm).
    pub distance: f64,
    /// Groups of shots that reach the eye within 10 s; `None` leaves C5 out.
    pub groups: Option<f64>,
}

impl Scanned {
    /// C5 = 1 for N ≤ 600 groups, else max(5·N^−0.25, 0.4).
    fn c5(&self) -> f64 {
        match self.groups {
            Some(n) if n > 600.0 => (5.0 * libm::pow(n, -0.25)).max(0.4),
            _ => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper(groups: Option<f64>) -> Scanned {
        Scanned {
            pixel_pitch: (43.2_f64 / 848.0).to_radians(),
            pixel_period: 1.0 / (60.0 * 407_040.0),
            aperture: 7e-3,
            distance: 0.1,
            groups,
        }
    }

    #[test]
    fn the_limits_at_905_nm() {
        let limits = Class1::at(905e-9).unwrap();
        approx::assert_relative_eq!(limits.c4, 2.570, max_relative = 1e-3);
        approx::assert_relative_eq!(limits.single_exposure(27e-9), 197.9e-9, max_relative = 1e-3);
        approx::assert_relative_eq!(limits.continuous(), 1.00e-3, max_relative = 3e-3);
    }

    #[test]
    fn a_macropulse_may_have_one_nanojoule() {
        let limits = Class1::at(905e-9).unwrap();
        approx::assert_relative_eq!(limits.per_shot(&paper(None)), 2.51e-9, max_relative = 5e-3);
        approx::assert_relative_eq!(
            limits.per_shot(&paper(Some(47_534.0))),
            1.01e-9,
            max_relative = 5e-3
        );
    }

    #[test]
    fn other_wavelengths_are_not_guessed() {
        assert!(Class1::at(1550e-9).is_none());
    }
}
