//! Measurements for the claims, as plain numbers. `claims` judges them.
//!
//! Lengths are in metres, times in seconds, angles in radians, energies in joules.

mod code;
mod equations;
mod experiment;
mod methods;
mod outlook;
mod ranging;
mod roles;
mod system;

pub use code::{Payloads, Repaired, Words};
pub use equations::Equations;
pub use experiment::{Experiment, Seen, Share};
pub use methods::{Methods, Place, Reach};
pub use outlook::{Closing, Outlook};
pub use ranging::{Ranging, Triangles};
pub use roles::{Part, Role};
pub use system::{Converters, Head, Light, Timing};

use super::Error;
use super::experiment::Trial;
use super::receivers::Comparison;
use super::walls::Wall;
use macropulse::design::Design;

/// Numbers that follow from the sensors alone, without an experiment.
#[derive(Debug, Clone)]
pub struct OnPaper {
    /// Code words and their correlations.
    pub words: Words,
    /// Labels, checksums, and the marks they make.
    pub payloads: Payloads,
    /// Eqs. 1, 3 and 4, tried out.
    pub equations: Equations,
    /// Shots, pixels and clocks.
    pub timing: Timing,
    /// The bank of converters.
    pub converters: Converters,
    /// Beam, mirror, energy and what comes back.
    pub light: Light,
    /// The HDL-64E.
    pub head: Head,
    /// Hopes of the conclusion, tried on the ready sensors.
    pub outlook: Outlook,
}

impl OnPaper {
    /// Computes the numbers of the sensor of the paper, `design`, and of the ready sensors it is compared
    /// with.
    ///
    /// # Errors
    /// If the sensor has no prime code or no raster; none of the ready sensors is refused, unless
    /// the program is broken.
    pub fn of(design: &Design) -> Result<Self, Error> {
        Ok(Self {
            words: Words::of(design)?,
            payloads: Payloads::of(design),
            equations: Equations::of(design)?,
            timing: Timing::of(design),
            converters: Converters::of(design)?,
            light: Light::of(design)?,
            head: Head::of(&Design::open("hdl-64e", &[])?),
            outlook: Outlook::of(design)?,
        })
    }
}

/// Everything the claims are judged by.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Numbers that follow from the sensors alone.
    pub on_paper: OnPaper,
    /// Results of the experiment.
    pub experiment: Experiment,
    /// Roles of the blocks of Fig. 7 in the text.
    pub roles: Vec<Role>,
    /// Reach and precision of lidars of different methods.
    pub methods: Methods,
}

impl Measured {
    pub(super) fn of(
        design: &Design,
        trials: &[Trial],
        comparisons: &[Comparison],
        walls: Vec<[Wall; 2]>,
        methods: Methods,
    ) -> Result<Self, Error> {
        Ok(Self {
            on_paper: OnPaper::of(design)?,
            experiment: Experiment { walls, ..Experiment::of(trials, comparisons) },
            roles: roles::printed(),
            methods,
        })
    }
}
