//! A peer's process. Whatever it has started ends with it, so on Unix it leads a process group of its own: a signal of the terminal does
//! not reach it there, and [`super::Start::interrupt_name`] ends the run instead.

use std::io;
use std::process::{Child, Command};

/// A process that is ended with its group when this is dropped. Elsewhere than on Unix it is ended alone.
#[derive(Debug)]
pub(super) struct PeerProcess(pub Child);

impl PeerProcess {
    /// Starts it.
    ///
    /// # Errors
    /// As [`Command::spawn`].
    pub fn spawn(command: &mut Command) -> io::Result<PeerProcess> {
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(command, 0);
        command.spawn().map(PeerProcess)
    }
}

impl Drop for PeerProcess {
    fn drop(&mut self) {
        end_group(&self.0);
        _ = self.0.kill();
        _ = self.0.wait();
    }
}

#[cfg(unix)]
fn end_group(leader: &Child) {
    use rustix::process::{Pid, Signal, kill_process_group};
    if let Some(group) = i32::try_from(leader.id()).ok().and_then(Pid::from_raw) {
        _ = kill_process_group(group, Signal::KILL);
    }
}

#[cfg(not(unix))]
fn end_group(_: &Child) {}
