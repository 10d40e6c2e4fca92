//! All probes of a run as one.

use emu_core::cpu::{Probe, Subcycle};
use emu_core::lint::Lint;
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

use crate::probes::uart_log::UartLog;
use crate::probes::waveform::WaveWriter;
use crate::run::run_controller::StretchWatch;

/// The serial output, awaited levels, a waveform, and a probe of instructions and accesses (`()` for none).
pub struct RunProbes<C> {
    /// The bytes that the chip sends.
    pub uart: UartLog,
    /// Position of the first awaited text that was seen, if there was one, in the order given to
    /// [`UartLog::new`].
    pub found_text: Option<usize>,
    /// Awaited levels.
    pub awaited_pins: Vec<(PinId, PinLevel)>,
    /// Position in `awaited_pins` of the first level that was seen, if there was one.
    pub found_pin: Option<usize>,
    /// Pins with contention between chip and outside, each with its first cycle.
    pub contention: Vec<(PinId, u64)>,
    /// The events that the controller of the run waits for.
    pub stretch_watch: StretchWatch,
    /// Waveform.
    pub wave: Option<WaveWriter>,
    /// The observer of instructions and accesses.
    pub inner: C,
}

impl<C: Probe> Probe for RunProbes<C> {
    const INSN: bool = C::INSN;
    const EVERY_ITERATION: bool = C::EVERY_ITERATION;
    const DATA: bool = C::DATA;
    const DATA_READS: bool = C::DATA_READS;
    const FLOW: bool = C::FLOW;
    const EVENTS: bool = true;
    const LINT: bool = C::LINT;
    const SUBCYCLE: bool = C::SUBCYCLE;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.inner.on_instruction(at, pc)
    }

    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        self.inner.on_data_access(at, space, addr, value, write)
    }

    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        self.inner.on_branch(next, to, taken);
    }

    fn on_flow_start(&mut self, pc: u32) {
        self.inner.on_flow_start(pc);
    }

    fn on_flow_end(&mut self, pc: u32) {
        self.inner.on_flow_end(pc);
    }

    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.inner.on_interrupt(at, vector);
    }

    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        self.inner.on_lint(at, pc, lint);
    }

    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        self.inner.on_subcycle(at, phase, pc, word)
    }

    fn on_event(&mut self, event: ChipEvent) -> bool {
        if let Some(wave) = &mut self.wave {
            wave.write_event(event);
        }
        match event {
            ChipEvent::Edge { pin, .. } if self.stretch_watch.pins.contains(&pin) => {
                self.stretch_watch.triggered = true
            }
            ChipEvent::Sent { uart: 0, .. } if self.stretch_watch.bytes => self.stretch_watch.triggered = true,
            _ => {}
        }
        match event {
            ChipEvent::Edge { pin, level, .. } if self.found_pin.is_none() => {
                self.found_pin = self.awaited_pins.iter().position(|wanted| *wanted == (pin, level));
            }
            ChipEvent::Contention { at, pin } if self.contention.iter().all(|(other, _)| *other != pin) => {
                self.contention.push((pin, at.cycle));
            }
            ChipEvent::Sent { uart: 0, byte, .. } => {
                let text = self.uart.push_byte(byte);
                self.found_text = self.found_text.or(text);
            }
            _ => {}
        }
        self.found_pin.is_some() || self.found_text.is_some() || self.stretch_watch.triggered
    }
}
