//! Runs work on a thread with a time limit.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// A flag that reports to the work that its result is no longer wanted.
#[derive(Debug, Clone, Default)]
pub(super) struct Cancellation(Arc<AtomicBool>);

impl Cancellation {
    /// Ends the work, by unwinding to [`run_with_limit`], if the time limit has expired.
    pub(super) fn unwind_if_cancelled(&self) {
        if self.0.load(Ordering::Relaxed) {
            resume_unwind(Box::new(()));
        }
    }
}

/// Why work did not return a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WorkFailure {
    /// The work panicked.
    Panicked,
    /// The time limit expired. The thread ends at its next call of [`Cancellation::unwind_if_cancelled`] or
    /// with the process.
    TimedOut,
}

/// Runs `work` on a new thread and waits at most `limit` of wall-clock time for its result.
///
/// # Errors
/// The work panicked or exceeded the limit. A thread that cannot be started counts as a timeout.
pub(super) fn run_with_limit<T: Send + 'static>(
    limit: Duration,
    work: impl FnOnce(&Cancellation) -> T + Send + 'static,
) -> Result<T, WorkFailure> {
    let (send, receive) = channel();
    let cancellation = Cancellation::default();
    let watched = cancellation.clone();
    let body = move || {
        let result: Result<T, Box<dyn Any + Send>> = catch_unwind(AssertUnwindSafe(|| work(&watched)));
        // After the time limit the receiver is gone.
        let _ = send.send(result.map_err(drop));
    };
    if thread::Builder::new().spawn(body).is_err() {
        return Err(WorkFailure::TimedOut);
    }
    match receive.recv_timeout(limit) {
        Ok(result) => result.map_err(|()| WorkFailure::Panicked),
        Err(RecvTimeoutError::Disconnected) => Err(WorkFailure::Panicked),
        Err(RecvTimeoutError::Timeout) => {
            cancellation.0.store(true, Ordering::Relaxed);
            Err(WorkFailure::TimedOut)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOON: Duration = Duration::from_millis(1);
    const LATE: Duration = Duration::from_secs(600);

    #[test]
    fn a_value_a_panic_or_the_end_of_the_time() {
        assert_eq!(run_with_limit(LATE, |_| 7), Ok(7));
        assert_eq!(run_with_limit(LATE, |_| resume_unwind(Box::new("broke"))), Err::<(), _>(WorkFailure::Panicked));
        // Nothing is ever sent, so only the time limit ends this.
        let (keep, never) = channel::<()>();
        assert_eq!(run_with_limit(SOON, move |_| never.recv()), Err(WorkFailure::TimedOut));
        drop(keep);
    }

    #[test]
    fn work_that_asks_is_ended() {
        let (alive, ended) = channel::<()>();
        let work = move |cancellation: &Cancellation| {
            let _alive = alive;
            loop {
                cancellation.unwind_if_cancelled();
                thread::yield_now();
            }
        };
        assert_eq!(run_with_limit::<()>(SOON, work), Err(WorkFailure::TimedOut));
        // The channel closes when the thread has ended.
        assert!(ended.recv().is_err());
    }
}
