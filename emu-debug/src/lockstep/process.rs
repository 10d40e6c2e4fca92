//! A peer's process. All its children end with it, so on Unix it leads a process group of its own. Signals of
//! the terminal do not reach that group; [`super::PeerStart::interrupt`] ends the run instead.

use std::io;
use std::process::{Child, Command};

/// A process that ends when this is dropped; on Unix with its whole group, elsewhere without its children.
#[derive(Debug)]
pub(super) struct PeerProcess(pub Child);

impl PeerProcess {
    /// Starts the process.
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
