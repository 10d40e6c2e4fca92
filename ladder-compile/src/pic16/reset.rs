//! From reset to the start of the timer: RAM, ports and what else a reset leaves undefined.

use emu_pic16::isa::Kind;
use emu_pic16::periph::map::Sfr;

use super::layout::Layout;
use super::out::{Out, STATUS, Z};
use super::pace::Pace;
use super::periph::{self, Devices};
use crate::target::{Job, Mark};

/// So many bytes are cleared one by one, more by a loop.
const UNROLLED: usize = 6;

/// Everything before the loop that waits. Outputs are low before they become outputs.
pub fn reset(out: &mut Out<'_>, job: &Job<'_>, layout: &Layout, devices: &Devices, pace: &Pace) {
    let chip = out.chip;
    out.mark(Mark::Part("reset: RAM, ports"));
    for bank in 0..4 {
        let used: Vec<u16> = layout.used.iter().copied().filter(|addr| addr >> 7 == bank).collect();
        clear(out, &used);
    }
    for (&at, cell) in layout.words.iter().zip(&job.ir.words) {
        for (at, k) in (at..).zip(cell.initial.to_le_bytes()).take(cell.bytes.into()) {
            if k != 0 {
                out.set(at, k);
            }
        }
    }
    for port in layout.ports.iter().filter(|port| port.outputs != 0) {
        out.f(Kind::Clrf, port.port);
    }
    let pwm = job.target.pwm.filter(|_| devices.pwm.is_some());
    if chip.part.comparators == emu_pic16::chips::Comparators::F62x {
        periph::comparators(out);
    }
    devices.analog(out);
    let pwm_bit = pwm.and_then(|pin| Some((pin.chars().nth(1)?, pin.chars().nth(2)?.to_digit(8)?)));
    for port in &layout.ports {
        let pwm = pwm_bit.filter(|(letter, _)| *letter == port.letter).map_or(0, |(_, bit)| 1u8 << bit);
        let directions = port.bits & !(port.outputs | pwm);
        if port.outputs | pwm != 0 {
            out.set(port.tris, directions);
        }
        if port.letter == 'B' && port.inputs != 0 {
            // Port B has pull-ups for its inputs.
            out.put(chip.bit("NOT_RBPU"), false);
        }
    }
    if let Some((letter, bit)) = pwm_bit
        && !layout.ports.iter().any(|port| port.letter == letter)
    {
        let row = chip.part.ports.iter().find(|row| row.port.name().ends_with(letter));
        if let Some(row) = row {
            out.f(Kind::Bcf, 0);
            out.items.pop();
            out.put((chip.reg(row.tris), bit as u8), false);
        }
    }
    pace.prepare(out);
    devices.start(out, job.ir.uart);
    out.mark(Mark::Part("pacing timer"));
    pace.start(out, layout.fraction, layout.extension);
}

/// Clears the bytes, which lie in one bank.
fn clear(out: &mut Out<'_>, used: &[u16]) {
    let (Some(&first), Some(&last)) = (used.iter().min(), used.iter().max()) else { return };
    if used.len() <= UNROLLED {
        used.iter().for_each(|&addr| out.f(Kind::Clrf, addr));
        return;
    }
    // All of the chip's bytes from the first to the last in use; FSR has eight bits, IRP the ninth.
    let chip = out.chip;
    let (fsr, irp) = (chip.reg(Sfr::FSR), chip.bit("IRP"));
    if first > 0xFF {
        out.put(irp, true);
    }
    out.set(fsr, first as u8);
    let again = out.label();
    out.place(again);
    out.f(Kind::Clrf, chip.reg(Sfr::INDF));
    let whole =
        |from: u16, to: u16| (from..=to).all(|addr| matches!(chip.part.place(addr), emu_pic16::chips::Place::Ram(_)));
    if first & 0x80 == 0 && whole(first, first | 0x7F) {
        out.f(Kind::IncfF, fsr);
        out.only_if((fsr, 7), false);
    } else if first & 0x80 != 0 && whole(first, first | 0x7F) {
        out.f(Kind::IncfszF, fsr);
    } else {
        out.f(Kind::IncfF, fsr);
        out.f(Kind::MovfW, fsr);
        out.lit(Kind::Xorlw, (last + 1) as u8);
        out.only_if((STATUS, Z), false);
    }
    out.back(again, 0x80);
    if first > 0xFF {
        out.put(irp, false);
    }
}

/// What the user should know of the pins: cause and hint.
#[must_use]
pub fn warnings(job: &Job<'_>, layout: &Layout) -> Vec<(String, String)> {
    let open = |pin: &&crate::pins::Pin| {
        pin.output && layout.ports.iter().any(|port| port.letter == pin.port() && port.open >> pin.bit() & 1 == 1)
    };
    let tell = |pin: &crate::pins::Pin| {
        let cause = format!("`{}` is at {}, which has an open drain: it never goes high by itself", pin.name, pin.pin);
        (cause, "use another pin, or a resistor to the supply".to_owned())
    };
    job.pins.iter().filter(open).map(tell).collect()
}
