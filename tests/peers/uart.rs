//! A program of avr-gcc that prints on USART0 prints the same here as under simavr.

use std::path::Path;

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::image::{ElfMachine, load};
use emu_core::{ChipEvent, Cpu, CycleTime, PinId, PinLevel, Probe, RamInit, StopReason};
use emu_test_support::{run_tool, test_folder};

use crate::harness;
use crate::tools::source;

/// Enough cycles for the complete program, which ends with a sleep with interrupts disabled.
const CYCLES: u64 = 8_000_000;

/// Records sent bytes.
#[derive(Default)]
struct Sent(Vec<u8>);

impl Probe for Sent {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let ChipEvent::Sent { byte, .. } = event {
            self.0.push(byte);
        }
        false
    }
}

/// PD0 and PD1, the pins of RXD and TXD.
const RXD: PinId = 16;
const TXD: PinId = 17;

/// Records sent bytes, and stops when TXD changes.
#[derive(Default)]
struct Wire(Sent, Option<PinLevel>);

impl Probe for Wire {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        match event {
            ChipEvent::Edge { pin: TXD, level, .. } => {
                self.1 = Some(level);
                true
            }
            event => self.0.on_event(event),
        }
    }
}

/// Returns the sent bytes with a wire from TXD to RXD. After each instruction RXD gets the level of TXD's
/// last edge.
pub fn sent_by_wire(elf: &Path, cycles: u64) -> Vec<u8> {
    let mut avr = machine(elf);
    let mut wire = Wire::default();
    while avr.cycle() < cycles && matches!(avr.run(cycles, &mut wire), StopReason::Probe | StopReason::Limit) {
        if let Some(level) = wire.1.take() {
            let now = avr.cycle();
            avr.drive(CycleTime { cycle: now, phase: 0 }, RXD, level);
        }
    }
    wire.0.0
}

/// Returns the bytes that a program sends on USART0 until it ends, the reason for the end, and its cycle.
pub fn sent_here(elf: &Path, cycles: u64) -> (Vec<u8>, StopReason, u64) {
    let mut avr = machine(elf);
    let mut sent = Sent::default();
    let stop = avr.run(cycles, &mut sent);
    (sent.0, stop, avr.cycle())
}

fn machine(elf: &Path) -> Avr {
    let bytes = std::fs::read(elf).unwrap_or_else(|e| panic!("{}: {e}", elf.display()));
    let chip = &ATMEGA328P;
    let loaded = load(&elf.to_string_lossy(), &bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine));
    Avr::new(chip, &loaded.expect("an image").image, RamInit::Random(1))
}

#[test]
#[ignore = "needs avr-gcc and simavr: .ci/peers installs them"]
fn a_c_program_prints_the_same() {
    let dir = test_folder!("uart");
    let source = source("tests/peers/hello.c");
    let args = ["-mmcu=atmega328p", "-DF_CPU=16000000", "-Os", "-Wall", &source.to_string_lossy(), "-o", "hello.elf"];
    run_tool("avr-gcc", &args, &dir);
    let theirs = run_tool(harness("simavr_uart"), &["hello.elf", &CYCLES.to_string()], &dir).stdout;

    let (ours, stop, cycle) = sent_here(&dir.join("hello.elf"), CYCLES);

    assert!(ours.starts_with(b"hello, world\n"), "{stop:?}: {:?}", String::from_utf8_lossy(&ours));
    assert!(ours.ends_with(b"sent by interrupt\ndone\n"), "{stop:?}: {:?}", String::from_utf8_lossy(&ours));
    assert_eq!(String::from_utf8_lossy(&ours), String::from_utf8_lossy(&theirs));
    assert_eq!(ours, theirs);
    println!("{} bytes, the same; {stop:?} after {} cycles", theirs.len(), cycle);
}
