//! How far a run is: a bar on a terminal, plain lines elsewhere, or JSON for programs.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::options::{Common, ProgressKind};
use crate::text::{NO_BREAK, grouped, harmless, say};

/// Least time between two plain lines or JSON objects.
const PAUSE: Duration = Duration::from_secs(5);

/// The progress of one run, in shots. Told from many threads.
pub struct Progress {
    name: String,
    total: u64,
    done: AtomicU64,
    began: Instant,
    /// When the next line is due, in ms after the beginning.
    due: AtomicU64,
    face: Face,
}

enum Face {
    Bar(ProgressBar),
    Lines,
    Json,
    Nothing,
}

impl Progress {
    /// The progress of `total` shots of what is called `name`.
    pub fn of(common: &Common, name: &str, total: u64) -> Self {
        let name = &harmless(name, |_| char::REPLACEMENT_CHARACTER.to_string()).replace('\n', " ");
        let face = match common.progress {
            ProgressKind::Json => Face::Json,
            ProgressKind::None => Face::Nothing,
            ProgressKind::Auto if common.quiet => Face::Nothing,
            ProgressKind::Auto if std::io::stderr().is_terminal() => Face::Bar(bar(name, total)),
            ProgressKind::Auto => Face::Lines,
        };
        let first_due = if matches!(face, Face::Json) { 0 } else { PAUSE.as_millis() as u64 };
        Self {
            name: name.to_owned(),
            total,
            done: AtomicU64::new(0),
            began: Instant::now(),
            due: AtomicU64::new(first_due),
            face,
        }
    }

    /// Counts `shots` more as done.
    pub fn add(&self, shots: u64) {
        let done = self.done.fetch_add(shots, Ordering::Relaxed) + shots;
        match &self.face {
            Face::Bar(bar) => bar.inc(shots),
            Face::Lines | Face::Json if self.is_due() => self.line("progress", done),
            _ => {}
        }
    }

    /// The run is over; of the bar nothing stays.
    pub fn finish(&self) {
        match &self.face {
            Face::Bar(bar) => bar.finish_and_clear(),
            Face::Json => self.line("done", self.done.load(Ordering::Relaxed)),
            _ => {}
        }
    }

    /// Returns true if a line is due, but only to one of several threads that ask.
    fn is_due(&self) -> bool {
        let now = self.began.elapsed().as_millis() as u64;
        let due = self.due.load(Ordering::Relaxed);
        let next = now + PAUSE.as_millis() as u64;
        now >= due
            && self.due.compare_exchange(due, next, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }

    fn line(&self, event: &str, done: u64) {
        let elapsed = self.began.elapsed().as_secs_f64();
        let rate = done as f64 / elapsed.max(1e-9);
        let left = self.total.saturating_sub(done) as f64 / rate.max(1e-9);
        if matches!(self.face, Face::Json) {
            let line = serde_json::json!({
                "event": event, "name": self.name, "shots": done, "shots_total": self.total,
                "elapsed_s": elapsed, "shots_per_s": rate, "left_s": left,
            });
            say(&line.to_string());
        } else {
            let percent = 100.0 * done as f64 / self.total.max(1) as f64;
            let rate = spaced(rate);
            say(&format!("{}: {percent:.0} %, {rate} shots/s, {left:.0} s left", self.name));
        }
    }
}

fn bar(name: &str, total: u64) -> ProgressBar {
    let looks = "{msg} {wide_bar} {percent:>3} %  {per_sec}  {eta} left ";
    let style = ProgressStyle::with_template(looks)
        .map(|style| {
            style.with_key(
                "per_sec",
                |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
                    let _ = write!(out, "{} shots/s", spaced(state.per_sec()));
                },
            )
        })
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(total).with_style(style).with_message(name.to_owned())
}

fn spaced(rate: f64) -> String {
    grouped(round(rate)).replace(NO_BREAK, " ")
}

/// A rate to three digits that count.
fn round(rate: f64) -> u64 {
    let digits = rate.max(1.0).log10().floor() as i32;
    let step = 10_f64.powi((digits - 2).max(0));
    ((rate / step).round() * step) as u64
}

#[cfg(test)]
mod tests {
    use super::round;

    #[test]
    fn rates_are_rounded_to_three_digits() {
        assert_eq!(
            [0.0, 7.4, 999.6, 14_327.0, 1.005e9].map(round),
            [0, 7, 1000, 14_300, 1_010_000_000]
        );
    }
}
