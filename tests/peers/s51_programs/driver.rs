//! Builds a C program with SDCC, runs it on s51 and on this emulator, and returns the output and the end time
//! of each.
//!
//! s51 is controlled by its options alone: a breakpoint on the read of XDATA 7654h, `run`, `quit`, and a file
//! for the serial port. It stops after the instruction with the read, and prints the clocks since reset, 12
//! per machine cycle.

use std::path::Path;
use std::process::Command;

use emu_8051::{Mcs51, chips};
use emu_core::image::{Image, load_hex};
use emu_core::{Chip, ChipEvent, Cpu, Probe, RamInit, StopReason};
use emu_test_support::{run_tool, test_folder};

use crate::tools::source;

/// A read of this XDATA address ends a program.
const END: u16 = 0x7654;

/// Time limit of one program on s51, in seconds.
const PATIENCE: &str = "60";

/// Limit of one program in machine cycles: 60 s of chip time.
const LIMIT: u64 = 60_000_000;

/// The result of a run.
#[derive(Debug, PartialEq, Eq)]
pub struct Outcome {
    /// The bytes sent on the serial port.
    pub text: String,
    /// Machine cycles when the program ended.
    pub cycles: u64,
}

/// The chip of all programs.
fn chip() -> &'static Chip {
    chips::chip("at89c52").expect("an 8052 with idle mode")
}

/// Compiles `NAME.c` for a memory model, with one macro defined, to a HEX file in a separate folder.
pub fn build(name: &str, model: &str, way: &str) -> String {
    let dir = test_folder!(&format!("s51_programs/{name}-{model}-{way}"));
    let (c, include) = (source(&format!("tests/peers/s51_programs/{name}.c")), source("tests/peers/s51_programs"));
    let args = [
        "-mmcs51",
        &format!("--model-{model}"),
        "--iram-size",
        "256",
        "--disable-warning",
        "283", // Empty argument lists.
        &format!("-D{way}"),
        &format!("-I{}", include.display()),
        &c.to_string_lossy(),
        "-o",
        "program.ihx",
    ];
    run_tool("sdcc", &args, &dir);
    dir.join("program.ihx").to_string_lossy().into_owned()
}

/// Runs a HEX file on s51.
pub fn theirs(hex: &str) -> Outcome {
    let hex = Path::new(hex);
    let dir = hex.parent().expect("a folder");
    let text = dir.join("s51.txt");
    let output = Command::new("timeout")
        .args([PATIENCE, "s51", "-t", "C52", "-b"])
        .args(["-S", &format!("uart=0,in=/dev/null,out={}", text.display())])
        .args(["-e", &format!("break xram r {END:#x}"), "-e", "run", "-e", "quit"])
        .arg(hex)
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap_or_else(|e| panic!("s51: {e}"));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("Event break"), "{}: {}\n{said}", hex.display(), output.status);
    let ticks = said.lines().find_map(|line| line.strip_prefix("Simulated ")?.split(' ').next()?.parse::<u64>().ok());
    let ticks = ticks.unwrap_or_else(|| panic!("{}: no count of ticks\n{said}", hex.display()));
    assert_eq!(ticks % 12, 0, "{}", hex.display());
    let text = std::fs::read(&text).unwrap_or_else(|e| panic!("{}: {e}", text.display()));
    Outcome { text: String::from_utf8_lossy(&text).into_owned(), cycles: ticks / 12 }
}

/// Reads a HEX file as the image of [`chip`].
fn image(hex: &str) -> Image {
    let bytes = std::fs::read(hex).unwrap_or_else(|e| panic!("{hex}: {e}"));
    load_hex(hex, &bytes, chip().hex_spaces).unwrap_or_else(|e| panic!("{hex}: {e:?}")).image
}

/// Records sent bytes, and stops at the read that ends a program.
struct Watch {
    xdata: u8,
    text: Vec<u8>,
}

impl Probe for Watch {
    const DATA: bool = true;
    const EVENTS: bool = true;
    fn on_data_access(&mut self, _: u64, space: u8, addr: u16, _: u8, write: bool) -> bool {
        space == self.xdata && addr == END && !write
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Sent { byte, .. } = event {
            self.text.push(byte);
        }
        false
    }
}

/// Runs a HEX file on this emulator.
pub fn ours(hex: &str) -> Outcome {
    let xdata = chip().spaces.iter().position(|space| space.name == "xdata").expect("external memory") as u8;
    let mut watch = Watch { xdata, text: Vec::new() };
    let mut machine = Mcs51::new(chip(), &image(hex), RamInit::Random(1));
    let stop = machine.run(LIMIT, &mut watch);
    assert_eq!(stop, StopReason::Probe, "{hex}: {:?}", String::from_utf8_lossy(&watch.text));
    let cycles = machine.cycle();
    // Run through the stop bit of the last byte, which s51 counts as already sent.
    let _ = machine.run(cycles + 500, &mut watch);
    Outcome { text: String::from_utf8_lossy(&watch.text).into_owned(), cycles }
}
