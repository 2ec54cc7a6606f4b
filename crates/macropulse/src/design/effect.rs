//! Effects that a sensor file may leave out; those of sun and air belong to the
//! [environment](crate::environment::Effect).

/// A physical effect that can be idealised away. Its name stands under `idealised` in the sensor
/// file, and every report prints it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// The beam has a width: several rays, several delays.
    Footprint,
    /// Photons follow from energy, aperture and optics.
    LinkBudget,
    /// The energy is held to a laser class.
    EyeSafety,
    /// The detector has a finite bandwidth and a finite area.
    DetectorBandwidth,
    /// A micropulse reaches into neighbouring chips.
    InterChip,
    /// The mirror moves during a macropulse.
    MirrorMotion,
}

impl Effect {
    /// All effects.
    pub const ALL: [Self; 6] = [
        Self::Footprint,
        Self::LinkBudget,
        Self::EyeSafety,
        Self::DetectorBandwidth,
        Self::InterChip,
        Self::MirrorMotion,
    ];

    /// Name in the sensor file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Footprint => "footprint",
            Self::LinkBudget => "link-budget",
            Self::EyeSafety => "eye-safety",
            Self::DetectorBandwidth => "detector-bandwidth",
            Self::InterChip => "inter-chip",
            Self::MirrorMotion => "mirror-motion",
        }
    }

    /// The assumption that replaces it when it is left out.
    pub fn assumption(self) -> &'static str {
        match self {
            Self::Footprint => "the beam is a line without width",
            Self::LinkBudget => {
                "the receiver is declared by what it can see, not by energy, aperture and optics"
            }
            Self::EyeSafety => "the shot may carry whatever energy its sensitivity needs",
            Self::DetectorBandwidth => {
                "a detector fast enough for every chip exists in the size needed"
            }
            Self::InterChip => "a micropulse does not reach into neighbouring chips",
            Self::MirrorMotion => "the beam stands still during a macropulse",
        }
    }
}
