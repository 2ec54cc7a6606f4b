//! Cells in Geiger mode (a SPAD array) that share the light: each is blind for a while after it has
//! fired.

use schemars::JsonSchema;
use serde::Deserialize;

use super::table::MOST_COUNTS;
use super::{
    Awaited, Detector, FirstEvent, Idle, Lit, Model, Sensitivity, SensitivityFile, Table, Typed,
    length_followed,
};
use crate::design::{Error, Light};
use crate::units::{fs_from_s, s_from_fs};

/// Number of dead times before the first owned shot at which cells start. They start in the mixture of armed
/// and blind that steady light leaves. After one dead time without light of its own a cell is armed, whatever
/// it was before. Four leave less than a hundredth of a percent.
const DEAD_TIMES: i64 = 4;

/// `[detector.geiger]` as typed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    /// Declared sensitivity; if the list `idealised` names `link-budget`.
    sensitivity: Option<SensitivityFile>,
    /// Detections per photon; with a link budget.
    #[schemars(range(min = 1e-6, max = 1))]
    efficiency: Option<f64>,
    /// Cells that share the light.
    #[schemars(range(min = 1, max = 1048576))]
    cells: u32,
    /// Time for which a cell is blind after a count, ns.
    #[schemars(range(min = 0, max = 1e6))]
    dead_time_ns: f64,
    /// Rate of dark counts (DCR), per second.
    #[schemars(range(min = 0, max = 1e12))]
    dark_counts_hz: f64,
    /// Rate of counts by sunlight, per second; without a link budget, from which it follows.
    #[schemars(range(min = 0, max = 1e12))]
    background_hz: f64,
    /// Timing jitter, ps rms.
    #[schemars(range(min = 0, max = 1e6))]
    jitter_ps: f64,
    /// When a cell counts again; with [histogram]. Left out: `free-running`.
    arming: Option<Arming>,
    /// Probability that a count leaves an afterpulse; with [histogram].
    #[schemars(range(min = 0, max = 0.9))]
    afterpulsing: Option<f64>,
    /// Mean delay of an afterpulse, ns: exponential; with [histogram].
    #[schemars(range(min = 0.001, max = 1e6))]
    afterpulse_ns: Option<f64>,
    /// Probability that a count makes another cell count at once, optical crosstalk; with [histogram].
    #[schemars(range(min = 0, max = 0.9))]
    crosstalk: Option<f64>,
}

/// When a cell that has counted counts again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Arming {
    /// After its dead time.
    FreeRunning,
    /// When the next pulse is sent: one count of each cell and pulse ("single stop").
    OncePerPulse,
}

/// Mean delay of an afterpulse, ns, if the file does not say it.
const AFTERPULSE_NS: f64 = 30.0;

/// Cells in Geiger mode that share the light: each is blind for a while after it has fired.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geiger {
    /// Mean photons detected per mark at the reference target, all cells being armed.
    pub sensitivity: Sensitivity,
    /// Cells; light falls on each of them alike.
    pub cells: u32,
    /// Time for which a cell that has fired is blind, fs.
    pub dead_fs: i64,
    /// Dark counts of all cells together, were they always armed, 1/s.
    pub dark: f64,
    /// Background counts of all cells where the file declares them, 1/s; else 0.
    pub background: f64,
    /// Standard deviation of the timing, s.
    pub jitter: f64,
    /// When a cell counts again.
    pub arming: Arming,
    /// Probability that a count leaves an afterpulse.
    pub afterpulsing: f64,
    /// Mean delay of an afterpulse, fs.
    pub afterpulse_fs: i64,
    /// Probability that a count makes another cell count.
    pub crosstalk: f64,
}

impl Typed for File {
    fn efficiency(&self) -> Option<f64> {
        self.efficiency
    }

    fn idle(&self) -> Idle {
        Idle::EITHER
    }

    fn check(&self, table: &Table) -> Result<Detector, Error> {
        let sensitivity = table.sensitivity(self.sensitivity.as_ref(), |pd| -(-pd).ln_1p())?;
        let dark = table.dark(self.dark_counts_hz)?;
        let background = table.background(self.background_hz)?;
        let dead = table.within("dead_time_ns", self.dead_time_ns, 0.0, 1e6)?;
        self.only_with_histograms(table)?;
        let share = |key, typed: Option<f64>| table.within(key, typed.unwrap_or(0.0), 0.0, 0.9);
        let delay = self.afterpulse_ns.unwrap_or(AFTERPULSE_NS);
        let delay = table.within("afterpulse_ns", delay, 1e-3, 1e6)?;
        Ok(Detector::Geiger(Geiger {
            sensitivity,
            cells: table.count("cells", self.cells, 1, 1 << 20)?,
            dead_fs: fs_from_s(dead * 1e-9),
            dark,
            background,
            jitter: table.jitter(self.jitter_ps)?,
            arming: self.arming.unwrap_or(Arming::FreeRunning),
            afterpulsing: share("afterpulsing", self.afterpulsing)?,
            afterpulse_fs: fs_from_s(delay * 1e-9),
            crosstalk: share("crosstalk", self.crosstalk)?,
        }))
    }
}

impl File {
    /// Refuses keys that only a histogram follows, and such as need another.
    fn only_with_histograms(&self, table: &Table) -> Result<(), Error> {
        let typed = [
            ("arming", self.arming.is_some()),
            ("afterpulsing", self.afterpulsing.is_some()),
            ("afterpulse_ns", self.afterpulse_ns.is_some()),
            ("crosstalk", self.crosstalk.is_some()),
        ];
        let key = |named: &str| typed.iter().find(|(key, is_typed)| *is_typed && *key == named);
        let refuse = |key: &str, why: &str| table.refuse_key(key, why.to_owned());
        if table.before.readout.histogram().is_none() {
            let first = typed.iter().find(|(_, is_typed)| *is_typed);
            return first.map_or(Ok(()), |(key, _)| {
                refuse(key, "is followed where counts go into a [histogram] alone: leave it out")
            });
        }
        if key("afterpulse_ns").is_some() && self.afterpulsing.is_none() {
            return refuse("afterpulse_ns", "has no effect without `afterpulsing`");
        }
        let is_never_blind = self.dead_time_ns == 0.0 && self.arming != Some(Arming::OncePerPulse);
        match key("afterpulsing").or(key("crosstalk")) {
            Some((key, _)) if is_never_blind => refuse(
                key,
                "is that of cells that are blind behind a count: write dead_time_ns, or arming = \
                 \"once-per-pulse\"",
            ),
            _ => Ok(()),
        }
    }
}

impl Geiger {
    /// Share of the cells that are armed at any moment, 1/(1 + r·τ/N). Each of N cells is blind for the dead
    /// time τ after each of its firings. All of them together get r = `falling` photons per second.
    fn armed(&self, falling: f64) -> f64 {
        let each = falling / f64::from(self.cells);
        1.0 / (1.0 + each * s_from_fs(self.dead_fs))
    }

    /// Probability that any of the cells fires at a mark with n = `photons` detected on average. Each cell is
    /// armed with the probability a = `armed`, independently of the others: 1 − (1 − a·(1 − exp(−n/N)))^N.
    fn any_cell(&self, armed: f64, photons: f64) -> f64 {
        let cells = f64::from(self.cells);
        let fires = -armed * libm::expm1(-photons / cells);
        -libm::expm1(cells * libm::log1p(-fires))
    }
}

impl Model for Geiger {
    fn sensitivity(&self) -> Sensitivity {
        self.sensitivity
    }

    fn declared_background(&self) -> f64 {
        self.background
    }

    fn jitter(&self) -> f64 {
        self.jitter
    }

    fn resolution(&self, light: &Light) -> f64 {
        libm::hypot(self.jitter, length_followed(light))
    }

    fn memory_fs(&self) -> i64 {
        DEAD_TIMES * self.dead_fs
    }

    /// Counts are followed one by one through the cells.
    fn refusal(&self, background: f64) -> Option<String> {
        let rate = self.false_rate(background);
        (rate > MOST_COUNTS).then(|| {
            format!(
                "{rate:.1e} counts per second would fire the detector again and again, more \
                 than are followed one by one ({MOST_COUNTS:.0e}): narrow the field or the filter, \
                 or take another environment"
            )
        })
    }

    fn false_rate(&self, background: f64) -> f64 {
        self.dark + background
    }

    /// An armed cell fires if one photon of those that fall on it is detected.
    fn mark_pd(&self, lit: &Lit) -> f64 {
        self.any_cell(self.armed(lit.falling), lit.photons)
    }

    fn mark_jitter(&self, _: &Lit) -> f64 {
        self.jitter
    }

    fn mark_displacement(&self, _: &Lit, light: &Light) -> f64 {
        length_followed(light)
    }

    fn ready_share(&self, falling: f64) -> f64 {
        self.armed(falling)
    }

    /// A cell is armed at an echo if it has not fired in its dead time τ before. It must have fired neither
    /// at one of the k = ⌊τ/P⌋ echoes in that time, which come every P, nor by itself. Let h = 1 − exp(−n/N),
    /// r the dark and background counts per cell and second, and a the share of the time in which a cell is
    /// armed. All of these exclude each other:
    ///
    /// * armed at an echo: e = 1 − k·h·e − r·τ·a;
    /// * armed at any time: a = 1 − (h·e/P + r·a)·τ.
    ///
    /// Let T be the time since the gate opened. N cells are silent with q = A(T)^N, A(T) = 1 − r·a·T up to τ
    /// and (1 − r·a·τ)·exp(−r·(T − τ)) beyond. Each of them is then armed with g = e/A(T) up to τ and 1
    /// beyond. The echo is seen with q·(1 − (1 − g·(1 − exp(−n/N)))^N).
    fn first_event(&self, awaited: &Awaited) -> FirstEvent {
        let &Awaited { since, photons, false_rate, falling, period, converted, .. } = awaited;
        let cells = f64::from(self.cells);
        let dead = s_from_fs(self.dead_fs);
        let (each, turns) = (false_rate / cells, dead / period);
        let blind = each * dead / (1.0 + each * dead);
        let fires = -libm::expm1(-(falling - false_rate).max(0.0) * period / cells);
        let at_echo = (1.0 - blind) / (1.0 + fires * (turns.floor() - turns * blind));
        let at_any_time = (1.0 - turns * fires * at_echo) * (1.0 - blind);
        let at_opening = 1.0 - each * dead * at_any_time;
        let older = match since < dead {
            true => 1.0 - each * at_any_time * since,
            false => at_opening * libm::exp(-each * (since - dead)),
        };
        let silent = libm::pow(older.clamp(0.0, 1.0), cells);
        let armed = match since < dead {
            true => (at_echo / older.max(f64::MIN_POSITIVE)).min(1.0),
            false => 1.0,
        };
        FirstEvent {
            is_false: 1.0 - silent,
            is_echo: silent * self.any_cell(armed, photons) * converted,
        }
    }

    fn summary(&self) -> String {
        format!(
            "{} cells in Geiger mode; {}; dead for {} ns; {:.0e} dark counts/s",
            self.cells,
            self.sensitivity.summary(),
            s_from_fs(self.dead_fs) * 1e9,
            self.dark
        )
    }

    fn in_sunlight(&self) -> &'static str {
        "each of which fires the cell that it falls on, if that is armed"
    }
}
