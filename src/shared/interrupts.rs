//! Signals that ask for the end.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// Set by the first signal that asks for the end, so that the run ends well; a second one does what it always does. Where the system
/// refuses so does the first.
pub fn listen_for_interrupts() -> Arc<AtomicBool> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let hangs_up = Some(SIGHUP).filter(|_| !ignores_hangup());
    for signal in [SIGINT, SIGTERM].into_iter().chain(hangs_up) {
        // In this order: the first signal finds it unset.
        _ = signal_hook::flag::register_conditional_default(signal, Arc::clone(&interrupted));
        _ = signal_hook::flag::register(signal, Arc::clone(&interrupted));
    }
    interrupted
}

/// Who started `emu` wants it to go on when the terminal is gone, as `nohup` does. Where the system does not tell, so it is taken.
fn ignores_hangup() -> bool {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return true };
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_none_or(|mask| mask >> (SIGHUP - 1) & 1 == 1)
}
