//! Ends of a design that the user decides on: a time budget, counted from the start of the command, and Ctrl-C.

use crate::error::Error;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

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

/// A handler is a matter of the whole process: one design at a time is told.
static STOP: AtomicBool = AtomicBool::new(false);
static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static WATCHED: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// Exit code of a process that was interrupted.
pub(crate) const INTERRUPTED_CODE: u8 = 130;

/// From the start of a command to its end: when there is enough, and why.
pub(crate) struct Watch {
    started: Instant,
    /// s.
    budget: Option<f64>,
    interrupted: &'static AtomicBool,
}

impl Watch {
    /// From now on Ctrl-C is a request to return the best so far; a second one ends the process.
    pub(crate) fn begin(budget: Option<f64>) -> Self {
        HANDLER.call_once(|| {
            // Where no handler can be set the process ends as ever.
            let _ = ctrlc::set_handler(interrupt);
        });
        INTERRUPTED.store(false, Ordering::Relaxed);
        STOP.store(false, Ordering::Relaxed);
        WATCHED.store(true, Ordering::Relaxed);
        Self {
            started: Instant::now(),
            budget,
            interrupted: &INTERRUPTED,
        }
    }

    /// Time left of the budget, s; `None` without one.
    pub(crate) fn left(&self) -> Option<f64> {
        let spent = self.started.elapsed().as_secs_f64();
        self.budget.map(|budget| (budget - spent).max(0.0))
    }

    /// Tells whether Ctrl-C came, or this share of the time that is left now is used up.
    pub(crate) fn enough(&self, share: f64) -> impl Fn() -> bool + Sync + use<> {
        let (now, left) = (Instant::now(), self.left());
        move || {
            let spent = now.elapsed().as_secs_f64();
            STOP.load(Ordering::Relaxed) || left.is_some_and(|left| spent >= share * left)
        }
    }

    /// # Errors
    /// [`Error::Interrupted`] where Ctrl-C came, for who has nothing to return yet.
    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        Ok(())
    }

    /// Runs a search that ends when the flag is set: when the time budget is used up, or by Ctrl-C.
    pub(crate) fn run<T>(&self, search: impl FnOnce(&AtomicBool) -> T) -> (T, Stopped) {
        let left = self.left();
        let mut out_of_time = left == Some(0.0);
        if out_of_time {
            STOP.store(true, Ordering::Relaxed);
        }
        let found = std::thread::scope(|scope| {
            let (done, wait) = channel::<()>();
            let clock = left.filter(|left| *left > 0.0).map(|left| {
                scope.spawn(move || {
                    let timeout = Duration::from_secs_f64(left);
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
        let stopped = if self.interrupted.load(Ordering::Relaxed) {
            Stopped::Interrupted
        } else if out_of_time {
            Stopped::OutOfTime
        } else {
            Stopped::No
        };
        (found, stopped)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        WATCHED.store(false, Ordering::Relaxed);
    }
}

fn interrupt() {
    if !WATCHED.load(Ordering::Relaxed) || INTERRUPTED.swap(true, Ordering::Relaxed) {
        std::process::exit(INTERRUPTED_CODE.into());
    }
    STOP.store(true, Ordering::Relaxed);
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// One test, since there is one flag a process.
    #[test]
    fn regress_ctrl_c_and_the_budget_count_from_the_start_of_the_command() {
        let watch = Watch::begin(None);
        assert!(!watch.enough(0.0)() && watch.check().is_ok());
        assert_eq!(
            watch.run(|stop| stop.load(Ordering::Relaxed)),
            (false, Stopped::No)
        );
        interrupt();
        assert!(watch.enough(0.5)());
        let message = watch.check().unwrap_err().to_string();
        assert!(
            message.contains("before any motion was certified"),
            "{message}"
        );
        assert_eq!(
            watch.run(|stop| stop.load(Ordering::Relaxed)),
            (true, Stopped::Interrupted)
        );
        drop(watch);
        // A budget that was used up before the search began.
        let watch = Watch::begin(Some(0.0));
        assert!(watch.enough(0.25)() && watch.check().is_ok());
        assert_eq!(
            watch.run(|stop| stop.load(Ordering::Relaxed)),
            (true, Stopped::OutOfTime)
        );
        // And one that ends a search that would never end.
        let watch = Watch::begin(Some(0.01));
        let search = |stop: &AtomicBool| {
            while !stop.load(Ordering::Relaxed) {
                std::thread::yield_now();
            }
        };
        assert_eq!(watch.run(search), ((), Stopped::OutOfTime));
    }
}
