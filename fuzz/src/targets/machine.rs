//! Targets of machines: bytes as programs, and bytes as states.

use std::sync::LazyLock;

use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::{Cpu, StopReason};
use emu_core::image::Image;
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_debug::snapshot;

use crate::machines::{MachineVisitor, assemble, family_chip, family_program, image_of_bytes, visit_machine};

/// Machine cycles of a run.
const CYCLES: u64 = 10_000;

/// Number of bytes at the start of an input that are pin edges of three bytes each: pin, level, time in
/// hundreds of cycles.
const EDGES: usize = 24;

/// Reads a snapshot file; written again, it must be the same.
pub(crate) fn snapshot(data: &[u8]) {
    if let Ok(snapshot::DecodedSnapshot { header: head, state }) = snapshot::decode_snapshot("fuzz.snp", data) {
        assert!(snapshot::encode_snapshot(&head, state) == data, "it comes back as it was written");
        assert!(snapshot::decode_snapshot_for("fuzz.snp", data, &head).is_ok(), "it is of itself");
    }
}

fn run_program(family: ChipFamily, data: &[u8]) {
    let (edges, code) = data.split_at_checked(EDGES).unwrap_or((&[], data));
    let chip = family_chip(family);
    visit_machine(chip, &image_of_bytes(chip, code), EdgeRun { chip, edges });
}

struct EdgeRun<'a> {
    chip: &'static Chip,
    edges: &'a [u8],
}

impl MachineVisitor for EdgeRun<'_> {
    type Output = ();

    fn visit<C: Cpu + 'static>(self, mut cpu: C) {
        let pins = self.chip.pins.len().max(1);
        for edge in self.edges.chunks_exact(3) {
            let [pin, level, when] = edge else { continue };
            let level = [PinLevel::Low, PinLevel::High, PinLevel::Float, PinLevel::PullUp][usize::from(level % 4)];
            cpu.drive(CycleTime::at(u64::from(*when) * 100), (usize::from(*pin) % pins) as PinId, level);
        }
        // Any slicing of a run must give the same machine, up to a halt: a run from there would execute a
        // jump to itself once more.
        let mut other = cpu.clone();
        cpu.run(CYCLES, &mut ());
        let half = self.edges.first().map_or(CYCLES / 2, |byte| u64::from(*byte) * 37);
        if other.run(half.min(CYCLES), &mut ()) == StopReason::Limit {
            other.run(CYCLES, &mut ());
        }
        assert!(cpu.save() == other.save(), "{}: halves differ from the whole", self.chip.name);
    }
}

/// Runs the input as a program on AVR.
pub(crate) fn run_avr(data: &[u8]) {
    run_program(ChipFamily::Avr, data);
}

/// Runs the input as a program on the 8051.
pub(crate) fn run_8051(data: &[u8]) {
    run_program(ChipFamily::Mcs51, data);
}

/// Runs the input as a program on the PIC16.
pub(crate) fn run_pic16(data: &[u8]) {
    run_program(ChipFamily::Pic16, data);
}

/// Runs the input as a program on AP101.
pub(crate) fn run_ap101(data: &[u8]) {
    run_program(ChipFamily::Ap101, data);
}

/// The programs of the machines whose state is restored.
static IMAGES: LazyLock<[Image; 4]> =
    LazyLock::new(|| crate::machines::FAMILIES.map(|family| assemble(family_chip(family), family_program(family))));

fn restore_state(family: ChipFamily, data: &[u8]) {
    let own = crate::machines::FAMILIES.iter().position(|other| *other == family).unwrap_or(0);
    visit_machine(family_chip(family), &IMAGES[own], StateRestore(data));
}

struct StateRestore<'a>(&'a [u8]);

impl MachineVisitor for StateRestore<'_> {
    type Output = ();

    fn visit<C: Cpu + 'static>(self, cpu: C) {
        let mut forged = cpu.clone();
        if forged.restore(self.0).is_err() {
            assert!(forged.save() == cpu.save(), "a refusal has changed the machine");
            return;
        }
        assert_round_trip(&cpu, &forged);
        forged.run(forged.cycle().saturating_add(CYCLES), &mut ());
        assert_round_trip(&cpu, &forged);
    }
}

fn assert_round_trip<C: Cpu>(cpu: &C, other: &C) {
    let (state, mut third) = (other.save(), cpu.clone());
    assert!(third.restore(&state).is_ok(), "what it saves is refused");
    assert!(third.save() == state, "what it saves comes back as another");
}

/// Restores the input as a state of AVR.
pub(crate) fn state_avr(data: &[u8]) {
    restore_state(ChipFamily::Avr, data);
}

/// Restores the input as a state of the 8051.
pub(crate) fn state_8051(data: &[u8]) {
    restore_state(ChipFamily::Mcs51, data);
}

/// Restores the input as a state of the PIC16.
pub(crate) fn state_pic16(data: &[u8]) {
    restore_state(ChipFamily::Pic16, data);
}

/// Restores the input as a state of AP101.
pub(crate) fn state_ap101(data: &[u8]) {
    restore_state(ChipFamily::Ap101, data);
}
