//! Ends of a search that the user decides on: a time budget and Ctrl-C.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stopped {
    /// It was done.
    No,
    /// The time budget was used up.
    OutOfTime,
    /// By Ctrl-C.
    Interrupted,
}

/// A handler is a matter of the whole process: one search at a time is told.
static STOP: AtomicBool = AtomicBool::new(false);
static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static SEARCHING: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// Exit code of a process that was interrupted.
const INTERRUPTED_CODE: i32 = 130;

/// Runs a search that ends when the flag is set: after `budget` seconds, or by Ctrl-C. A second Ctrl-C ends the process.
pub(crate) fn watched<T>(
    budget: Option<f64>,
    search: impl FnOnce(&AtomicBool) -> T,
) -> (T, Stopped) {
    HANDLER.call_once(|| {
        // Where no handler can be set the process ends as ever.
        let _ = ctrlc::set_handler(|| {
            if !SEARCHING.load(Ordering::Relaxed) || INTERRUPTED.swap(true, Ordering::Relaxed) {
                std::process::exit(INTERRUPTED_CODE);
            }
            STOP.store(true, Ordering::Relaxed);
        });
    });
    INTERRUPTED.store(false, Ordering::Relaxed);
    STOP.store(false, Ordering::Relaxed);
    SEARCHING.store(true, Ordering::Relaxed);
    let mut out_of_time = false;
    let found = std::thread::scope(|scope| {
        let (done, wait) = channel::<()>();
        let clock = budget.map(|seconds| {
            scope.spawn(move || {
                let timeout = Duration::from_secs_f64(seconds);
                let over = wait.recv_timeout(timeout) == Err(RecvTimeoutError::Timeout);
                if over {
                    STOP.store(true, Ordering::Relaxed);
                }
                over
            })
        });
        let found = search(&STOP);
        drop(done);
        if let Some(clock) = clock {
            out_of_time = clock.join().unwrap_or(false);
        }
        found
    });
    SEARCHING.store(false, Ordering::Relaxed);
    let stopped = if INTERRUPTED.load(Ordering::Relaxed) {
        Stopped::Interrupted
    } else if out_of_time {
        Stopped::OutOfTime
    } else {
        Stopped::No
    };
    (found, stopped)
}
