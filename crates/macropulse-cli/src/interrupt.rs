//! Ctrl-C: the bands under way are finished, files are closed, then the program ends.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::fault::{Fault, INTERRUPTED};
use crate::text::warn;

/// Held while files are written.
static WRITING: Mutex<()> = Mutex::new(());

/// A flag that Ctrl-C raises.
#[derive(Clone)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Takes Ctrl-C over. The second one ends the program at once, but not within a file. A signal that
    /// whoever started the program wants ignored, as `nohup` does, stays ignored.
    pub fn listen() -> Result<Self, Fault> {
        let raised = Arc::new(AtomicBool::new(false));
        let seen = Self(raised.clone());
        signals::heed(move || {
            if raised.swap(true, Ordering::SeqCst) {
                let _whole = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
                std::process::exit(i32::from(INTERRUPTED));
            }
            warn("stopping; Ctrl-C again stops at once");
        })
        .map_err(|error| Fault::Ours(format!("cannot listen for Ctrl-C: {error}")))?;
        Ok(seen)
    }

    /// Returns true if Ctrl-C was pressed.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }

    /// Does what must not be left half done.
    pub fn undisturbed<T>(&self, work: impl FnOnce() -> T) -> T {
        let _whole = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        work()
    }
}

/// Makes a file that passes the limit of the shell (`ulimit -f`) an error of its write, where it would end
/// the program without a word.
pub fn outlast_limits() -> Result<(), Fault> {
    signals::outlast_limits()
        .map_err(|error| Fault::Ours(format!("cannot listen for signals: {error}")))
}

#[cfg(unix)]
mod signals {
    use std::io;
    use std::sync::Arc;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::flag;
    use signal_hook::iterator::Signals;

    /// Calls `act` at every signal that asks the program to end, and is not ignored.
    pub(super) fn heed(act: impl Fn() + Send + 'static) -> io::Result<()> {
        let ignored = ignored();
        let asked = [SIGINT, SIGTERM, SIGHUP];
        let mut signals = Signals::new(asked.iter().filter(|signal| !has(ignored, **signal)))?;
        std::thread::Builder::new().spawn(move || signals.forever().for_each(|_| act()))?;
        Ok(())
    }

    pub(super) fn outlast_limits() -> io::Result<()> {
        flag::register(SIGXFSZ, Arc::default()).map(|_| ())
    }

    /// The signals that are ignored, a bit for each; none where the system does not say so in a file.
    fn ignored() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
    }

    /// Returns true if `mask` has the bit of a signal.
    fn has(mask: u64, signal: i32) -> bool {
        mask & (1 << (signal - 1)) != 0
    }
}

#[cfg(not(unix))]
mod signals {
    use std::io;

    pub(super) fn heed(act: impl Fn() + Send + 'static) -> io::Result<()> {
        ctrlc::set_handler(act).map_err(io::Error::other)
    }

    pub(super) fn outlast_limits() -> io::Result<()> {
        Ok(())
    }
}
