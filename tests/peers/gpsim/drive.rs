//! Controls gpsim (version 0.31, Debian's gpsim), with notes about its behaviour.
//!
//! - `-i -c FILE.stc` executes commands in order and changes to the folder of the file; `run` and `step N`
//!   return only when they are done. `load PROCESSOR FILE.hex` takes 20 ms. The exit code carries no
//!   information, hence the checks here.
//! - `dump r` prints all 512 addresses of data memory without side effects, with mirrors, then W and the
//!   program counter, in 0.1 ms. `step N` takes 5 us per instruction, `pc = N` takes 20 us and no cycle,
//!   `cycles` prints the cycle counter.
//! - RAM starts as zeros. A read of an unimplemented address stops a run unless BreakOnInvalidRegisterRead is
//!   off.
//! - `step` over SLEEP, and every `step` after it, takes one cycle of the sleep; `run` continues until the
//!   wake.
//! - It starts at cycle 0 without start-up timers, at 20 MHz.

use std::path::Path;
use std::process::{Command, Stdio};

use emu_core::image::{Image, load_hex};
use emu_core::{Chip, Cpu, RamInit};
use emu_pic16::{Options, Pic16};

/// The first lines of every script, after `load`: 20 MHz, and no stops at unimplemented addresses.
const SETTLE: &str =
    "frequency 20000000\n{p}.BreakOnInvalidRegisterRead = false\n{p}.BreakOnInvalidRegisterWrite = false\n";

/// The oscillator frequency of both machines in Hz.
pub const HZ: u64 = 20_000_000;

/// The visible state of a machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct View {
    /// The cycle counter.
    pub cycle: u64,
    /// Data memory by address; `None` for addresses that gpsim reports as unimplemented.
    pub data: Vec<Option<u8>>,
    pub w: u8,
    pub pc: u16,
    /// The program counter values that were requested between this view and the next.
    pub later: Vec<u16>,
}

/// The command for a [`View`].
pub const VIEW: &str = "cycles\ndump r\n";
/// The command for an entry of [`View::later`].
pub const LATER: &str = "pc\n";

/// Loads a HEX file of `folder`, executes `script`, and collects the views.
pub fn gpsim(chip: &Chip, hex: &str, script: &str, folder: &Path) -> Vec<View> {
    let processor = chip.name.replacen("pic", "p", 1);
    let settle = SETTLE.replace("{p}", &processor);
    let commands = folder.join("commands.stc");
    std::fs::write(&commands, format!("load {processor} {hex}\n{settle}{script}quit\n"))
        .unwrap_or_else(|e| panic!("{}: {e}", commands.display()));
    let output = Command::new("timeout")
        .args(["60", "gpsim", "-i", "-c", "commands.stc"])
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|e| panic!("gpsim: {e}"));
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "gpsim: {} in {}:\n{text}", output.status, folder.display());
    assert!(text.contains("Leaving pic_processor::LoadProgramFile"), "gpsim does not load {hex}:\n{text}");
    views(&text)
}

/// Parses the output of the commands [`VIEW`] and [`LATER`].
fn views(text: &str) -> Vec<View> {
    let mut views: Vec<View> = Vec::new();
    let mut cycle = 0;
    let mut open: Option<View> = None;
    for line in text.lines() {
        let line = line.trim_start_matches("**gpsim> ");
        if line.trim_start().starts_with("00 01 02 03") {
            open = Some(View { cycle, data: Vec::with_capacity(512), w: 0, pc: 0, later: Vec::new() });
        } else if let (Some(view), Some(b':')) = (&mut open, line.as_bytes().get(4)) {
            // Sixteen cells, followed by the same cells as arbitrary text.
            let cells = line[5..].split_whitespace().take(16);
            view.data.extend(cells.map(|c| u8::from_str_radix(c, 16).ok()));
        } else if let Some((name, value)) = line.split_once(" = ") {
            let number = |radix: u32| {
                let digits = value.trim_start_matches("0x").split(' ').next().unwrap_or("");
                u64::from_str_radix(digits, radix).unwrap_or_else(|e| panic!("{line}: {e}"))
            };
            match (name, &mut open) {
                ("W", Some(view)) => view.w = number(16) as u8,
                ("pc", Some(view)) => {
                    view.pc = number(16) as u16;
                    assert_eq!(view.data.len(), 512, "a whole dump");
                    views.extend(open.take());
                }
                ("pc", None) => {
                    let view = views.last_mut().expect("a view before");
                    view.later.push(number(16) as u16);
                }
                _ if name.bytes().all(|b| b.is_ascii_digit()) && value.starts_with("0x") => cycle = number(16),
                _ => {}
            }
        }
    }
    views
}

/// Returns the view of our machine; `there` gives the addresses that its chip implements.
pub fn view(machine: &Pic16, there: &[bool; 0x200]) -> View {
    let cell = |addr: u32| machine.peek("data", addr).expect("data memory");
    View {
        cycle: machine.cycle(),
        data: (0..0x200).map(|addr| there[addr as usize].then(|| cell(addr))).collect(),
        w: machine.reg("W").expect("W") as u8,
        pc: machine.pc() as u16,
        later: Vec::new(),
    }
}

/// Returns which addresses of data memory a chip implements.
pub fn there(chip: &Chip) -> [bool; 0x200] {
    let part = emu_pic16::chips::part(chip.name).expect("a chip of the family");
    part.file_slots().map(|place| place != emu_pic16::chips::FileSlot::None)
}

/// Builds our machine with the same settings as gpsim.
pub fn machine(chip: &'static Chip, image: &Image) -> Pic16 {
    let options = Options { hz: HZ, start_up: false, ..Options::default() };
    Pic16::with(chip, image, RamInit::Zero, options)
}

/// Parses a HEX file as the image of a chip.
pub fn image(chip: &Chip, name: &str, text: &str) -> Image {
    load_hex(name, text.as_bytes(), chip.hex_spaces).unwrap_or_else(|e| panic!("{name}: {e:?}")).image
}
