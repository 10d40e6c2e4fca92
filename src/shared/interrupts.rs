//! Signals that ask the process to end.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// Returns a flag that the first termination signal sets, so that a run ends cleanly. A second signal has its
/// default effect. If the system refuses the handler, the first signal has its default effect too.
pub fn listen_for_interrupts() -> Arc<AtomicBool> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let hangs_up = Some(SIGHUP).filter(|_| !ignores_hangup());
    for signal in [SIGINT, SIGTERM].into_iter().chain(hangs_up) {
        // The order matters: the conditional default must run while the flag is still clear for the first
        // signal.
        _ = signal_hook::flag::register_conditional_default(signal, Arc::clone(&interrupted));
        _ = signal_hook::flag::register(signal, Arc::clone(&interrupted));
    }
    interrupted
}

/// Returns true if the parent process wants `emu` to survive a hang-up of the terminal, as `nohup` does. Also
/// true on systems that do not say.
fn ignores_hangup() -> bool {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return true };
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_none_or(|mask| mask >> (SIGHUP - 1) & 1 == 1)
}
