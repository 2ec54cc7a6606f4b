//! Long work: off the lock of the interpreter, on threads of our own, and stopped by Ctrl-C.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{Fault, wrong};

/// How often Python is asked whether a signal has come.
const ASKED: Duration = Duration::from_millis(20);

/// How long work that has been told to stop is waited for; what cannot be stopped goes on to its
/// end behind the exception.
const PATIENCE: Duration = Duration::from_millis(500);

/// Most threads that can be asked for.
const MOST_THREADS: usize = 1024;

/// The variable by which rayon is asked for threads where `threads` is 0.
const RAYON_THREADS: &str = "RAYON_NUM_THREADS";

/// Flag that tells work to stop.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Returns true if the work is to stop.
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Returns the same as the control flow of a loop.
    pub fn flow(&self) -> ControlFlow<()> {
        if self.is_raised() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Threads to compute with.
struct Pool {
    /// The process that started them: one that is forked from it has none of them.
    process: u32,
    threads: usize,
    pool: Arc<ThreadPool>,
}

/// Threads of the last call, kept for the next one.
static LAST: Mutex<Option<Pool>> = Mutex::new(None);

fn pool(threads: usize) -> PyResult<Arc<ThreadPool>> {
    if threads > MOST_THREADS {
        return Err(wrong(format!("threads is {threads}; it must be from 0 to {MOST_THREADS}")));
    }
    let asked = std::env::var(RAYON_THREADS).ok().filter(|_| threads == 0);
    if let Some(asked) =
        asked.filter(|asked| asked.parse().is_ok_and(|n: u64| n > MOST_THREADS as u64))
    {
        return Err(wrong(format!(
            "{RAYON_THREADS} is {asked}; it must be from 0 to {MOST_THREADS}"
        )));
    }
    let process = std::process::id();
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = last.as_ref() {
        if known.process == process && known.threads == threads {
            return Ok(Arc::clone(&known.pool));
        }
        if known.process != process {
            // Its threads are in another process: to end them here would wait for ever.
            std::mem::forget(last.take());
        }
    }
    let made = ThreadPoolBuilder::new().num_threads(threads).build();
    let made = made.map_err(|why| Fault::new_err(format!("cannot start the threads: {why}")))?;
    let pool = Arc::new(made);
    *last = Some(Pool { process, threads, pool: Arc::clone(&pool) });
    Ok(pool)
}

/// Does `work` on `threads` threads, 0 for one per core, while other threads of Python run.
///
/// # Errors
/// `KeyboardInterrupt`, or whatever the handler of a signal raises; then `work` has been told to
/// stop. [`Fault`] if it panics.
pub fn done<T: Send + 'static>(
    py: Python<'_>,
    threads: usize,
    work: impl FnOnce(&Stop) -> T + Send + 'static,
) -> PyResult<T> {
    let (pool, stop) = (pool(threads)?, Stop::default());
    let (send, receive) = channel();
    let told = stop.clone();
    pool.spawn(move || {
        let result = catch_unwind(AssertUnwindSafe(|| work(&told)));
        // Nobody listens any more after a signal.
        let _ = send.send(result);
    });
    let mut receive = receive;
    loop {
        let result;
        (result, receive) = py.detach(move || (receive.recv_timeout(ASKED), receive));
        match result {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => {
                let told = "the simulator has panicked, what it printed says where; this is a \
                            fault of Macropulse and not of its input: please report it";
                return Err(Fault::new_err(told));
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(signal) = py.check_signals() {
            stop.0.store(true, Ordering::Relaxed);
            let _ = py.detach(move || receive.recv_timeout(PATIENCE));
            return Err(signal);
        }
    }
}
