//! Effects of sun and air that an environment may leave out.

/// A physical effect of the surroundings that can be idealised away. Its name stands under
/// `idealised` in an environment, and every report prints it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// The air absorbs and scatters.
    Atmosphere,
    /// Sunlight is detected.
    Background,
}

impl Effect {
    /// All effects.
    pub const ALL: [Self; 2] = [Self::Atmosphere, Self::Background];

    /// The effect called `name`.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.name() == name)
    }

    /// Name in an environment.
    pub fn name(self) -> &'static str {
        match self {
            Self::Atmosphere => "atmosphere",
            Self::Background => "background",
        }
    }

    /// Returns the assumption that stands for it when it is left out.
    pub fn assumption(self) -> &'static str {
        match self {
            Self::Atmosphere => "the air is perfectly clear",
            Self::Background => "no sunlight reaches the detector",
        }
    }
}
