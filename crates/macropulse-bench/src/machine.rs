//! The machine, in words, how often to measure on it, and what its programs print.

use std::fs;
use std::process::Command;

use macropulse::codec::level::Level;
use macropulse::processor::thread_seconds;

/// Describes the program and the machine, on which the figures depend.
pub fn words() -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let processors = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name: &str| {
        processors.lines().find_map(|line| {
            let value = line.strip_prefix(name)?.trim_start().strip_prefix(':')?;
            Some(value.trim())
        })
    };
    // Processors of one name may be years apart.
    let made = field("cpu family").zip(field("model"));
    let made = made.map(|(family, model)| format!(" (family {family}, model {model})"));
    format!(
        "Macropulse {} on {}{}, {threads} threads, {} kernels.",
        env!("CARGO_PKG_VERSION"),
        field("model name").unwrap_or(std::env::consts::ARCH),
        made.unwrap_or_default(),
        Level::here().name()
    )
}

/// Returns the seconds of this thread for `run`: the least of the rounds that add up to a second. A `run`
/// that takes longer is timed once.
pub fn least_seconds(mut run: impl FnMut()) -> f64 {
    least_of_rounds(|| seconds(&mut run))
}

/// The least of the seconds that `round` gives, of rounds that add up to a second.
pub fn least_of_rounds(mut round: impl FnMut() -> f64) -> f64 {
    let (mut least, mut sum) = (f64::INFINITY, 0.0);
    while sum < 1.0 {
        let seconds = round();
        (least, sum) = (seconds.min(least), sum + seconds);
    }
    least
}

/// Seconds of this thread for `run`.
pub fn seconds(run: impl FnOnce()) -> f64 {
    let began = thread_seconds();
    run();
    thread_seconds() - began
}

/// Returns the output of a command, or why it failed.
pub fn printed(command: &mut Command) -> Result<String, String> {
    let output = command.output().map_err(|why| why.to_string())?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}
