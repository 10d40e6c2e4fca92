//! Controls s51 (version 0.6.4, Debian's sdcc-ucsim), with notes about its behaviour.
//!
//! - `-t 8052` is its HMOS 8052 with 256 bytes of RAM and 64 KB each of code and XDATA. RAM and XDATA start
//!   with random bytes; `fill` sets them.
//! - Commands from a file (`-C`) are executed in order, and `run` returns only at the breakpoint. Input is
//!   echoed, and every line of output is written separately, which takes about 80 us per line. A state that
//!   is set, stepped and dumped with commands takes 4 ms, so a program sets up the cases instead.
//! - `file` loads 64 KB of Intel HEX in 30 ms; `set memory` takes twelve times as long for the same size.
//! - `dump /b` writes raw bytes, in about 1 us each, directly after the echo of the command.
//! - A run executes about 5 million instructions per second. `state` prints the clocks since power-up;
//!   setting the program counter and loading take none.
//! - A push beyond FFh stops the run unless two classes of errors are disabled ([`SETTLE`]).
//! - A dump beyond the end of a memory (RAM above 7Fh of an 8051) is shorter, without a message.
//! - The exit code does not report a missing or malformed file, hence the checks here.

use std::path::Path;
use std::process::{Command, Stdio};

use emu_core::image::write_hex;

use crate::batch::{Batch, CASES};
use crate::program::{RESULT, XDATA};

/// A stack pointer beyond FFh wraps to 0, as on silicon and here, instead of stopping the run; RAM starts as
/// zeros.
const SETTLE: &str = "set error stack off\nset error stack_overflow off\nfill iram 0 255 0\n";

/// The results of a run.
#[derive(PartialEq, Eq)]
pub struct Run {
    /// The results of the cases, in sequence.
    pub results: Vec<u8>,
    /// The part of XDATA that MOVX reaches.
    pub xdata: Vec<u8>,
    /// Idata at the end.
    pub idata: Vec<u8>,
    /// Machine cycles of the complete run.
    pub cycles: u64,
}

/// The output of s51 for a script.
pub struct Said {
    /// The complete output, as far as it is text.
    pub text: String,
    /// The requested dumps.
    pub dumps: Vec<Vec<u8>>,
    /// Clocks since power-up.
    pub clocks: u64,
}

/// Runs a batch on s51; files go to `folder`.
pub fn s51(batch: &Batch, folder: &Path) -> Run {
    let xdata = usize::from(XDATA);
    let script = format!("break {}\npc {}\nrun\n", batch.program.stop, batch.program.start);
    let dumps = [("xram", 0, CASES * RESULT), ("xram", xdata, 0x1_0000 - xdata), ("iram", 0, 256)];
    let mut said = s51_script("8052", &[(0, &batch.code)], &script, &dumps, folder);
    let stop = format!("PC= 0x{:06x}", batch.program.stop);
    assert!(said.text.contains(&stop), "s51 did not come to {stop}:\n{}", said.text);
    let mut next = || said.dumps.remove(0);
    Run { results: next(), xdata: next(), idata: next(), cycles: said.clocks / 12 }
}

/// Loads code memory, executes `script`, and dumps memories (name, first address, length).
pub fn s51_script(
    chip: &str,
    code: &[(u32, &[u8])],
    script: &str,
    dumps: &[(&str, usize, usize)],
    folder: &Path,
) -> Said {
    let file = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    };
    let echoes: Vec<String> =
        dumps.iter().map(|(memory, from, len)| format!("dump /b {memory} {from} {}\n", from + len - 1)).collect();
    let code: Vec<_> = code.iter().map(|&(addr, bytes)| emu_core::image::HexSegment { addr, bytes }).collect();
    file("code.hex", write_hex(&code));
    file("commands", format!("{SETTLE}file \"code.hex\"\n{script}state\n{}kill\n", echoes.concat()));
    let output = Command::new("timeout")
        .args(["60", "s51", "-t", chip, "-b", "-q", "-P", "-C", "commands"])
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|e| panic!("s51: {e}"));
    assert!(output.status.success(), "s51: {}: {}", output.status, String::from_utf8_lossy(&output.stderr));
    let mut rest = output.stdout.as_slice();
    let mut text = String::new();
    let mut memories = Vec::new();
    for (echo, (_, _, len)) in echoes.iter().zip(dumps) {
        let at = rest.windows(echo.len()).position(|w| w == echo.as_bytes());
        let (before, behind) = rest.split_at(at.unwrap_or_else(|| panic!("s51 does not echo {echo}:\n{text}")));
        text += &String::from_utf8_lossy(before);
        assert!(behind.len() >= echo.len() + len, "s51 dumped too little: {echo}");
        memories.push(behind[echo.len()..][..*len].to_vec());
        rest = &behind[echo.len() + len..];
    }
    let total = text.split("Total time since last reset=").nth(1).and_then(|t| t.split('(').nth(1));
    let clocks = total.and_then(|t| t.split(' ').next()).and_then(|t| t.parse().ok());
    Said { clocks: clocks.unwrap_or_else(|| panic!("s51 reports no clocks:\n{text}")), text, dumps: memories }
}
