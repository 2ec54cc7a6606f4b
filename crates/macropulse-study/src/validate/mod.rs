//! Macropulse beside what others have published, and its forecasts beside its simulations.

mod continuous;
mod devices;
mod forecasts;
mod histograms;
mod page;
mod paper;
mod published;
mod simulated;

use std::path::Path;

use macropulse::formats::write_atomically;
use macropulse::sim::Watch;

pub use forecasts::{Place, SENSORS, SHOTS, places};
pub use published::{Figure, Within};

/// Why nothing could be compared.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// It was asked to stop.
    #[error("stopped before the end")]
    Stopped,
    /// A ready sensor was refused.
    #[error(transparent)]
    Design(#[from] macropulse::design::Error),
    /// A room around a sensor was refused.
    #[error(transparent)]
    Scene(#[from] macropulse::scene::Error),
    /// A ready environment was refused.
    #[error(transparent)]
    Environment(#[from] macropulse::environment::Error),
    /// A ready sensor cannot work in a ready environment.
    #[error(transparent)]
    Operating(#[from] macropulse::channel::Error),
    /// There is no forecast of a ready sensor.
    #[error(transparent)]
    Forecast(#[from] macropulse::predict::Error),
    /// A scan could not be made.
    #[error(transparent)]
    Simulation(#[from] macropulse::sim::Error),
    /// A code was refused.
    #[error(transparent)]
    Code(#[from] macropulse::codec::code::Error),
    /// A file could not be written.
    #[error(transparent)]
    Formats(#[from] macropulse::formats::Error),
}

/// Everything that was compared.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Findings {
    /// Seed of the simulations.
    pub seed: u64,
    /// Published figures.
    pub published: Vec<Figure>,
    /// Forecasts.
    pub forecasts: Vec<Place>,
}

impl Findings {
    /// Published figures that ours do not agree with.
    pub fn figures_that_fail(&self) -> usize {
        self.published.iter().filter(|figure| !figure.holds()).count()
    }

    /// Forecasts that do not agree with what was simulated.
    pub fn forecasts_that_fail(&self) -> usize {
        self.forecasts.iter().filter(|place| !place.holds()).count()
    }

    /// The report as Markdown, the text of docs/validation.md.
    pub fn markdown(&self) -> String {
        page::markdown(self)
    }
}

/// Compares the published figures with ours.
///
/// # Errors
/// None, unless the program is broken.
pub fn published() -> Result<Vec<Figure>, Error> {
    let mut all = published::codes()?;
    all.extend(devices::light()?);
    all.extend(devices::detectors());
    all.extend(devices::scanners()?);
    all.extend(paper::paper()?);
    all.extend(simulated::simulated()?);
    all.extend(histograms::histograms()?);
    all.extend(continuous::continuous()?);
    Ok(all)
}

/// Compares everything.
///
/// # Errors
/// If the watch says stop.
pub fn run(seed: u64, watch: &Watch) -> Result<Findings, Error> {
    let published = published()?;
    let mut all = Vec::new();
    for sensor in SENSORS {
        all.extend(places(sensor, seed, watch)?);
    }
    Ok(Findings { seed, published, forecasts: all })
}

/// Files that [`write()`] writes, the page last.
pub const FILES: [&str; 3] = ["validation.md", "validation.json", "index.html"];

/// Writes `findings` into `folder`, as [`FILES`].
///
/// # Errors
/// If a file cannot be written.
pub fn write(findings: &Findings, folder: &Path) -> Result<(), Error> {
    let json = serde_json::to_string_pretty(&findings).unwrap_or_default() + "\n";
    let texts = [findings.markdown(), json, page::html(findings)];
    for (name, text) in FILES.into_iter().zip(texts) {
        write_atomically(&folder.join(name), |out| out.write_all(text.as_bytes()))?;
    }
    Ok(())
}
