//! The PIC16 examples do what their headers state, and their HEX files equal the output of our assembler and
//! of gpasm for their sources.

use std::path::PathBuf;
use std::process::Command;

use emu_core::image::load_hex;
use emu_core::{ChipEvent, Cpu, PinId, Probe, RamInit, StopReason};
use emu_pic16::{Pic16, chips};

fn example(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/pic16").join(name)
}

fn read(name: &str) -> String {
    let path = example(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Records sent bytes with the cycles of their ends, and the cycles at which the lamp on RB0 changed.
struct Seen {
    lamp: PinId,
    text: Vec<u8>,
    ends: Vec<u64>,
    edges: Vec<u64>,
}

impl Probe for Seen {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        match event {
            ChipEvent::Sent { at, byte, .. } => {
                self.text.push(byte);
                self.ends.push(at.cycle);
            }
            ChipEvent::Edge { at, pin, .. } if pin == self.lamp => self.edges.push(at.cycle),
            _ => (),
        }
        false
    }
}

fn after(name: &str, mcu: &str, cycles: u64) -> (Seen, StopReason) {
    let chip = chips::chip(mcu).unwrap_or_else(|| panic!("{mcu}"));
    let loaded = load_hex(name, read(name).as_bytes(), chip.hex_spaces).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    assert!(loaded.warnings.is_empty(), "{name}: {:?}", loaded.warnings);
    let mut seen = Seen { lamp: chip.pin("RB0").expect("RB0"), text: Vec::new(), ends: Vec::new(), edges: Vec::new() };
    let mut cpu = Pic16::new(chip, &loaded.image, RamInit::Random(1));
    let stop = cpu.run(cycles, &mut seen);
    // TRMT is set in the middle of the stop bit; a program that sleeps then leaves the line unchanged.
    seen.text.extend(cpu.byte_in_stop_bit());
    (seen, stop)
}

#[test]
fn they_do_what_their_heads_say() {
    let (hello, stop) = after("hello.hex", "pic16f877a", 200_000);
    assert_eq!((String::from_utf8_lossy(&hello.text).as_ref(), stop), ("Hello from a PIC16\n", StopReason::Halted));
    // A bit takes 16 * 26 clocks, and a byte ten bits. The program refills TXREG in time, so there is no gap
    // between bytes.
    assert!(hello.ends.windows(2).all(|pair| pair[1] - pair[0] == 10 * 16 * 26 / 4), "{:?}", hello.ends);
    // The power-up timer takes 72 ms of the second; the rest has 56 overflows. The first edge occurs when the
    // pin becomes an output. GOTO takes two cycles, so an interrupt may be one cycle late.
    let (blink, stop) = after("blink.hex", "pic16f873", 1_000_000);
    assert_eq!((blink.edges.len(), stop), (1 + 56, StopReason::Limit), "{:?}", blink.edges);
    let first = blink.edges[1];
    for (i, edge) in (0u64..).zip(&blink.edges[1..]) {
        assert!((first + 16_384 * i).abs_diff(*edge) <= 1, "{:?}", blink.edges);
    }
}

/// The files of examples and benchmarks, which gpasm wrote, equal the output of our assembler for their
/// sources.
#[test]
fn the_hex_files_belong_to_their_sources() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let mut count = 0;
    for folder in ["examples/pic16", "benches/programs_pic"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.extension().is_none_or(|e| e != "asm") {
                continue;
            }
            let bytes = std::fs::read(&path).expect("a source");
            let name = emu_asm::named_chip(&bytes).unwrap_or_else(|| panic!("{}: no list p=", path.display()));
            let chip = chips::chip(&name).unwrap_or_else(|| panic!("{}: {name}", path.display()));
            let made = emu_asm::assemble_text(chip, &String::from_utf8_lossy(&bytes));
            let made = made.unwrap_or_else(|e| panic!("{}:\n{e}", path.display()));
            let hex = path.with_extension("hex");
            let there =
                load_hex("", &std::fs::read(&hex).expect("a HEX file"), chip.hex_spaces).expect("a good HEX file");
            assert_eq!(made.segments, there.image.segments, "{}", hex.display());
            count += 1;
        }
    }
    assert_eq!(count, 8);
}

#[test]
#[ignore = "needs gpasm (package gputils)"]
fn gpasm_makes_the_same_files() {
    for name in ["blink", "hello"] {
        let made = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.hex"));
        let status = Command::new("gpasm").arg("-q").arg("-o").arg(&made).arg(example(&format!("{name}.asm"))).status();
        assert!(status.expect("gpasm starts").success(), "{name}.asm");
        let made = std::fs::read_to_string(&made).expect("what gpasm made");
        assert!(made.replace("\r\n", "\n") == read(&format!("{name}.hex")).replace("\r\n", "\n"), "{name}.hex");
    }
}
