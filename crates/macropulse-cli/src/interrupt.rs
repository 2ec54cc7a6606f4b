//! Ctrl-C: the bands under way are finished, files are closed, then the program ends.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::fault::{Fault, warn};

/// What a shell expects of a program ended by Ctrl-C.
pub const EXIT_CODE: u8 = 130;

/// Held while files are written.
static WRITING: Mutex<()> = Mutex::new(());

/// Whether Ctrl-C was pressed.
#[derive(Clone)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Takes Ctrl-C over. The second one ends the program at once, but not within a file.
    pub fn listen() -> Result<Self, Fault> {
        let raised = Arc::new(AtomicBool::new(false));
        let seen = Self(raised.clone());
        ctrlc::set_handler(move || {
            if raised.swap(true, Ordering::SeqCst) {
                let _whole = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
                std::process::exit(i32::from(EXIT_CODE));
            }
            warn("stopping; Ctrl-C again stops at once");
        })
        .map_err(|error| Fault::Ours(format!("cannot listen for Ctrl-C: {error}")))?;
        Ok(seen)
    }

    /// Whether Ctrl-C was pressed.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }

    /// Does what must not be left half done.
    pub fn undisturbed<T>(&self, work: impl FnOnce() -> T) -> T {
        let _whole = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
        work()
    }
}
