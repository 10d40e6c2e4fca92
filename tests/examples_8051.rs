//! The HEX files of the 8051 examples match their sources, and the programs do what their headers state.

#[path = "../benches/programs51/assemble.rs"]
mod assemble;

use std::path::PathBuf;

use emu_8051::{Mcs51, chips};
use emu_core::image::{load_hex, write_hex};
use emu_core::{ChipEvent, Cpu, PinId, Probe, RamInit};

fn example(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/8051").join(name)
}

fn read(name: &str) -> String {
    let path = example(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// With EMU_WRITE set, the test rewrites the HEX files.
#[test]
fn the_hex_files_belong_to_their_sources() {
    for name in ["hello", "blink", "mode0"] {
        let image = assemble::image(&read(&format!("{name}.s"))).unwrap_or_else(|e| panic!("{name}.s: {e}"));
        let segments: Vec<_> =
            image.segments.iter().map(|s| emu_core::image::HexSegment { addr: s.addr, bytes: &s.bytes }).collect();
        let hex = write_hex(&segments);
        if std::env::var_os("EMU_WRITE").is_some() {
            std::fs::write(example(&format!("{name}.hex")), &hex).unwrap_or_else(|e| panic!("{name}.hex: {e}"));
        }
        assert!(read(&format!("{name}.hex")) == hex, "{name}.hex is not what {name}.s says; EMU_WRITE=1 writes it");
    }
}

/// Records sent bytes, and the cycles at which the lamp on P1.0 changed.
struct Seen {
    lamp: PinId,
    text: Vec<u8>,
    edges: Vec<u64>,
}

impl Probe for Seen {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        match event {
            ChipEvent::Sent { byte, .. } => self.text.push(byte),
            ChipEvent::Edge { at, pin, .. } if pin == self.lamp => self.edges.push(at.cycle),
            _ => (),
        }
        false
    }
}

fn after(name: &str, mcu: &str, cycles: u64) -> Seen {
    let chip = chips::chip(mcu).unwrap_or_else(|| panic!("{mcu}"));
    let loaded = load_hex(name, read(name).as_bytes(), chip.hex_spaces).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    let mut seen = Seen { lamp: chip.pin("P1.0").expect("P1.0"), text: Vec::new(), edges: Vec::new() };
    Mcs51::new(chip, &loaded.image, RamInit::Random(1)).run(cycles, &mut seen);
    seen
}

#[test]
fn they_do_what_their_heads_say() {
    assert_eq!(String::from_utf8_lossy(&after("hello.hex", "8052", 40_000).text), "Hello from an 8051\n");
    assert_eq!(String::from_utf8_lossy(&after("mode0.hex", "8052", 1_000).text), "6\n");
    // Ten wakes per change, each up to 20 cycles late. Reset drives the pin high before the first one.
    let edges = after("blink.hex", "at89s52", 1_000_000).edges;
    let between: Vec<u64> = edges.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert_eq!(between.len(), 8, "{edges:?}");
    assert!(between.iter().all(|cycles| (100_000..=100_200).contains(cycles)), "{edges:?}");
}
