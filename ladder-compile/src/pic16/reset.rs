//! Code from reset to the start of the timer: sets up RAM, ports and everything that a reset leaves
//! undefined.

use diag::Severity;
use emu_pic16::isa::Pic16OpKind;
use emu_pic16::periph::map::Sfr;

use super::layout::Pic16Layout;
use super::pacing::Pic16Pacing;
use super::peripherals::{self, Pic16Peripherals};
use super::writer::{Pic16Writer, STATUS, Z};
use crate::pins::AssignedPin;
use crate::target::{CodeMark, CompileJob, PinNeed};

/// Up to this many bytes are cleared one by one, more by a loop.
const MAX_UNROLLED_BYTES: usize = 6;

/// Emits everything before the poll loop. Outputs are low before their pins become outputs.
pub fn emit_reset(
    out: &mut Pic16Writer<'_>,
    job: &CompileJob<'_>,
    layout: &Pic16Layout,
    devices: &Pic16Peripherals,
    pace: &Pic16Pacing,
) {
    let chip = out.chip;
    out.mark(CodeMark::Section("reset: RAM, ports"));
    for bank in 0..4 {
        let used: Vec<u16> = layout.used.iter().copied().filter(|addr| addr >> 7 == bank).collect();
        clear_bytes(out, &used);
    }
    for (&at, cell) in layout.words.iter().zip(&job.ir.words) {
        for (at, k) in (at..).zip(cell.initial.to_le_bytes()).take(cell.bytes.into()) {
            if k != 0 {
                out.set_byte(at, k);
            }
        }
    }
    for bit in job.ir.initial_bits() {
        out.set_bit(layout.bit(bit), true);
    }
    let latched = |letter| job.ir.port_cells(letter).is_some_and(|cells| cells.latch.or(cells.direction).is_some());
    for port in layout.ports.iter().filter(|port| port.output_bits != 0 || latched(port.letter)) {
        out.byte_op(Pic16OpKind::Clrf, port.port);
    }
    for (pin, _) in driven_pins(job, devices).filter(|pin| pin.1) {
        out.set_bit(port_bit(out, pin, false), true);
    }
    if chip.part.comparators == emu_pic16::chips::ComparatorKind::F62x {
        peripherals::disable_comparators(out);
    }
    devices.configure_analog(out);
    for port in &layout.ports {
        let driven = driven_pins(job, devices).fold(0, |all, (pin, _)| all | super::pin_mask(pin, port.letter));
        let directions = port.existing_bits & !(port.output_bits | driven);
        if port.output_bits | driven != 0 {
            out.set_byte(port.tris, directions);
        }
        if port.letter == 'B' && port.input_bits != 0 {
            // Enable the pull-ups of port B for its inputs.
            out.set_bit(chip.bit("NOT_RBPU"), false);
        }
    }
    for (pin, _) in driven_pins(job, devices) {
        if !layout.ports.iter().any(|port| super::pin_mask(pin, port.letter) != 0) {
            out.set_bit(port_bit(out, pin, true), false);
        }
    }
    pace.prepare(out);
    devices.start(out, job.ir.uart);
    out.mark(CodeMark::Section("pacing timer"));
    pace.start(out, layout.fraction, layout.extension);
}

/// Pins that peripherals drive, with their level at rest.
pub fn driven_pins(
    job: &CompileJob<'_>,
    devices: &Pic16Peripherals,
) -> impl Iterator<Item = (&'static str, bool)> + use<> {
    let pwm: Vec<(&'static str, bool)> = job.pwm_outputs().map(|(_, at)| (at.pin, false)).collect();
    pwm.into_iter().chain(devices.bus.map_or_else(Vec::new, |bus| bus.outputs(job)))
}

/// The bit of a pin such as `RC2` in its port, or with `direction` in the register of its directions.
fn port_bit(out: &Pic16Writer<'_>, pin: &str, direction: bool) -> (u16, u8) {
    let chip = out.chip;
    let row =
        chip.part.ports.iter().find(|row| pin.chars().nth(1).is_some_and(|letter| row.port.name().ends_with(letter)));
    let bit = pin.chars().nth(2).and_then(|digit| digit.to_digit(8)).unwrap_or(0);
    (row.map_or(0, |row| chip.reg(if direction { row.tris } else { row.port })), bit as u8)
}

/// Clears bytes that are all in one bank.
fn clear_bytes(out: &mut Pic16Writer<'_>, used: &[u16]) {
    let (Some(&first), Some(&last)) = (used.iter().min(), used.iter().max()) else { return };
    if used.len() <= MAX_UNROLLED_BYTES {
        used.iter().for_each(|&addr| out.byte_op(Pic16OpKind::Clrf, addr));
        return;
    }
    // Clear all RAM from the first to the last byte in use. FSR has eight address bits, IRP is the ninth.
    let chip = out.chip;
    let (fsr, irp) = (chip.reg(Sfr::FSR), chip.bit("IRP"));
    if first > 0xFF {
        out.set_bit(irp, true);
    }
    out.set_byte(fsr, first as u8);
    let again = out.label();
    out.place(again);
    out.byte_op(Pic16OpKind::Clrf, chip.reg(Sfr::INDF));
    let whole = |from: u16, to: u16| {
        (from..=to).all(|addr| matches!(chip.part.file_slot(addr), emu_pic16::chips::FileSlot::Ram(_)))
    };
    if first & 0x80 == 0 && whole(first, first | 0x7F) {
        out.byte_op(Pic16OpKind::IncfF, fsr);
        out.skip_unless((fsr, 7), false);
    } else if first & 0x80 != 0 && whole(first, first | 0x7F) {
        out.byte_op(Pic16OpKind::IncfszF, fsr);
    } else {
        out.byte_op(Pic16OpKind::IncfF, fsr);
        out.byte_op(Pic16OpKind::MovfW, fsr);
        out.literal_op(Pic16OpKind::Xorlw, (last + 1) as u8);
        out.skip_unless((STATUS, Z), false);
    }
    out.goto_back(again, 0x80);
    if first > 0xFF {
        out.set_bit(irp, false);
    }
}

/// What pins need outside of the chip: outputs with an open drain, and inputs of all ports but B, which alone
/// has pull-ups (DS30292, section 3.2).
#[must_use]
pub fn pin_needs(job: &CompileJob<'_>, layout: &Pic16Layout) -> Vec<PinNeed> {
    let open = |pin: &&AssignedPin| {
        pin.output
            && layout
                .ports
                .iter()
                .any(|port| port.letter == pin.port_letter() && port.open_drain_bits >> pin.bit_number() & 1 == 1)
    };
    let drain = |pin: &AssignedPin| PinNeed {
        severity: Severity::Warning,
        cause: format!("`{}` is at {}, which has an open drain: it never goes high by itself", pin.name, pin.pin),
        hint: "use another pin, or a resistor to the supply",
    };
    let floating = PinNeed::of_floating_inputs(job.pins, |pin| pin.port_letter() != 'B');
    job.pins.iter().filter(open).map(drain).chain(floating).chain(job.bus_needs()).collect()
}
