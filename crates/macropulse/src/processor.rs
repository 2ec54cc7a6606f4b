//! Time spent computing, in which other programs on the same machine have no part.

/// Time for which the calling thread has been on a processor, s; on other systems than Linux, the
/// time since it first asked.
///
/// Only differences mean anything, and only those taken on one thread.
pub fn thread_seconds() -> f64 {
    #[cfg(target_os = "linux")]
    {
        let spent = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        spent.tv_sec as f64 + 1e-9 * spent.tv_nsec as f64
    }
    #[cfg(not(target_os = "linux"))]
    {
        thread_local! {
            static FIRST: std::time::Instant = std::time::Instant::now();
        }
        FIRST.with(|first| first.elapsed().as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    #[test]
    fn work_counts() {
        let (before, began) = (thread_seconds(), Instant::now());
        while thread_seconds() - before < 1e-3 {
            assert!(began.elapsed() < Duration::from_secs(60), "the clock stands still");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn waiting_does_not_count() {
        let before = thread_seconds();
        std::thread::sleep(Duration::from_millis(50));
        assert!(thread_seconds() - before < 0.04);
    }
}
