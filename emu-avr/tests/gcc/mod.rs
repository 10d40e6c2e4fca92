//! Runs avr-gcc, for tests that read the headers of avr-libc.

use std::io::Write;
use std::process::{Command, Stdio};

/// Returns the compiler's output for this source.
pub fn gcc(mcu: &str, args: &[&str], source: &str) -> String {
    let mut command = Command::new("avr-gcc");
    command.arg(format!("-mmcu={mcu}")).args(args);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("avr-gcc runs");
    child.stdin.take().expect("a pipe").write_all(source.as_bytes()).expect("read");
    let run = child.wait_with_output().expect("avr-gcc ends");
    assert!(run.status.success(), "{mcu}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).expect("text")
}
