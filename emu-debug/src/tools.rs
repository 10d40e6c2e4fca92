//! All probes of a run as one.

use emu_core::cpu::{Probe, Subcycle};
use emu_core::lint::Lint;
use emu_core::pins::{Event, Level, PinId, Time};

use crate::host::Watched;
use crate::uart::Uart;
use crate::wave::Wave;

/// The serial output, levels waited for, a waveform, and what looks closer (`()` for nothing).
pub struct Tools<C> {
    /// What the chip sends.
    pub uart: Uart,
    /// Position of the text that was seen, if one was.
    pub text: Option<usize>,
    /// Levels waited for.
    pub pins: Vec<(PinId, Level)>,
    /// Position of the level that was seen, if one was.
    pub pin: Option<usize>,
    /// Pins that chip and outside drove against each other, each with the first cycle of that.
    pub contention: Vec<(PinId, u64)>,
    /// What the host of the run waits for.
    pub watched: Watched,
    /// Waveform.
    pub wave: Option<Wave>,
    /// What looks at instructions and accesses.
    pub close: C,
}

impl<C: Probe> Probe for Tools<C> {
    const INSN: bool = C::INSN;
    const EVERY: bool = C::EVERY;
    const DATA: bool = C::DATA;
    const READS: bool = C::READS;
    const FLOW: bool = C::FLOW;
    const EVENTS: bool = true;
    const LINT: bool = C::LINT;
    const SUBCYCLE: bool = C::SUBCYCLE;

    fn insn(&mut self, at: u64, pc: u32) -> bool {
        self.close.insn(at, pc)
    }

    fn data(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        self.close.data(at, space, addr, value, write)
    }

    fn goes(&mut self, next: u32, to: u32, taken: bool) {
        self.close.goes(next, to, taken);
    }

    fn enters(&mut self, pc: u32) {
        self.close.enters(pc);
    }

    fn breaks(&mut self, pc: u32) {
        self.close.breaks(pc);
    }

    fn irq(&mut self, at: u64, vector: u8) {
        self.close.irq(at, vector);
    }

    fn lint(&mut self, at: u64, pc: u32, lint: Lint) {
        self.close.lint(at, pc, lint);
    }

    fn subcycle(&mut self, at: Time, phase: Subcycle, pc: u32, word: u16) -> bool {
        self.close.subcycle(at, phase, pc, word)
    }

    fn event(&mut self, event: Event) -> bool {
        if let Some(wave) = &mut self.wave {
            wave.event(event);
        }
        match event {
            Event::Edge { pin, .. } if self.watched.pins.contains(&pin) => self.watched.moved = true,
            Event::Sent { uart: 0, .. } if self.watched.bytes => self.watched.moved = true,
            _ => {}
        }
        match event {
            Event::Edge { pin, level, .. } if self.pin.is_none() => {
                self.pin = self.pins.iter().position(|wanted| *wanted == (pin, level));
            }
            Event::Contention { at, pin } if self.contention.iter().all(|(other, _)| *other != pin) => {
                self.contention.push((pin, at.cycle));
            }
            Event::Sent { uart: 0, byte, .. } => {
                let text = self.uart.byte(byte);
                self.text = self.text.or(text);
            }
            _ => {}
        }
        self.pin.is_some() || self.text.is_some() || self.watched.moved
    }
}
