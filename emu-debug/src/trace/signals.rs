//! Registers and memory as signals of a waveform.

use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::Cpu;

use crate::names::bit_space;
use crate::names::bit_space::BIT_SPACE;
use crate::probes::waveform::{WaveSignal, WaveWriter};

/// Returns the number of bits of a core register.
#[must_use]
pub fn register_bits(chip: &Chip, name: &str) -> u32 {
    match (chip.family, name) {
        (ChipFamily::Ap101, "A") => 1,
        (ChipFamily::Ap101, _) | (_, "PC" | "DPTR") | (ChipFamily::Avr, "SP") => 16,
        _ => 8,
    }
}

/// The source of a signal's value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalSource {
    /// The core register at this position in [`Chip::cpu_regs`].
    Register(usize),
    /// Up to 8 bytes of a memory, the lowest first: memory, byte address, number of bytes.
    Bytes(&'static str, u32, u32),
    /// A bit of a byte of a memory, 0 to 7.
    Bit(&'static str, u32, u8),
}

/// A signal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TraceSignal {
    /// Name, without white space.
    pub name: String,
    /// Number of bits, 1 to 64.
    pub bits: u32,
    /// The source of its value.
    pub source: SignalSource,
}

impl TraceSignal {
    fn value<C: Cpu>(&self, cpu: &C, regs: &[u32]) -> Option<u64> {
        match self.source {
            SignalSource::Register(index) => regs.get(index).map(|value| u64::from(*value)),
            SignalSource::Bytes(space, addr, len) => {
                let peek = |at: u32| cpu.peek(space, addr + at).map(u64::from);
                (0..len).rev().try_fold(0, |high, at| Some(high << 8 | peek(at)?))
            }
            SignalSource::Bit(space, addr, bit) => cpu.peek(space, addr).map(|byte| u64::from(byte >> bit & 1)),
        }
    }
}

/// Signals with their last sampled values.
#[derive(Debug, Clone)]
pub struct TraceSignals {
    list: Vec<TraceSignal>,
    values: Vec<Option<u64>>,
    regs: Vec<u32>,
    /// Addresses of RAM in signals that only change when the program writes them.
    written: Vec<bool>,
    /// Position of the RAM in [`Chip::spaces`].
    ram_space: u8,
    /// Position of the memory `bit`, if there is one.
    bit_space: Option<u8>,
    chip: &'static Chip,
    /// Whether any instruction may change a signal.
    any_instruction: bool,
}

impl TraceSignals {
    /// Returns the signals of a machine, with their current values.
    #[must_use]
    pub fn new<C: Cpu>(list: Vec<TraceSignal>, cpu: &C) -> TraceSignals {
        let chip = cpu.chip();
        let size = chip.space(chip.ram_space).map_or(0, |space| space.size);
        let mut canonical_addresses: Vec<u32> = Vec::new();
        let mut any_instruction = false;
        for signal in &list {
            let (space, addr, len) = match signal.source {
                SignalSource::Bytes(space, addr, len) => (space, addr, len),
                SignalSource::Bit(space, addr, _) => (space, addr, 1),
                SignalSource::Register(_) => ("", 0, 0),
            };
            let cells: Option<Vec<u32>> = (addr..addr + len).map(|addr| cpu.canonical_ram_address(addr)).collect();
            match cells.filter(|cells| space == chip.ram_space && !cells.is_empty()) {
                Some(cells) => canonical_addresses.extend(cells),
                None => any_instruction = true,
            }
        }
        // A cell may have several addresses.
        let written = (0..size)
            .map(|addr| cpu.canonical_ram_address(addr).is_some_and(|cell| canonical_addresses.contains(&cell)))
            .collect();
        let (ram_space, bit_space) = (chip.space_index(chip.ram_space).unwrap_or(u8::MAX), chip.space_index(BIT_SPACE));
        let mut signals = TraceSignals {
            list,
            values: Vec::new(),
            regs: Vec::new(),
            written,
            ram_space,
            bit_space,
            chip,
            any_instruction,
        };
        cpu.read_regs(&mut signals.regs);
        signals.values = signals.list.iter().map(|signal| signal.value(cpu, &signals.regs)).collect();
        signals
    }

    /// Returns the signals for a waveform.
    #[must_use]
    pub fn wave_signals(&self) -> Vec<WaveSignal> {
        let column = |(signal, value): (&TraceSignal, &Option<u64>)| WaveSignal {
            name: signal.name.clone(),
            bits: signal.bits,
            value: *value,
        };
        self.list.iter().zip(&self.values).map(column).collect()
    }

    /// Returns true if a signal may change with any instruction, or without one, so that it must be sampled
    /// after each.
    #[must_use]
    pub fn changes_with_any_instruction(&self) -> bool {
        self.any_instruction
    }

    /// Returns true if a write to an address of a memory may change a signal.
    #[must_use]
    pub fn is_changed_by_write(&self, space: u8, addr: u16) -> bool {
        let at = |addr: u32| self.written.get(addr as usize) == Some(&true);
        if space == self.ram_space {
            return at(addr.into());
        }
        let bit = || bit_space::byte_of_bit(self.chip, addr.into());
        Some(space) == self.bit_space && bit().is_some_and(|bit| bit.space == self.chip.ram_space && at(bit.byte))
    }

    /// Writes the changes at the current cycle of the machine.
    pub fn sample<C: Cpu>(&mut self, cpu: &C, wave: &mut WaveWriter) {
        cpu.read_regs(&mut self.regs);
        for (i, (signal, last)) in self.list.iter().zip(&mut self.values).enumerate() {
            let value = signal.value(cpu, &self.regs);
            if *last != value {
                *last = value;
                wave.change_signal(cpu.cycle(), i, value);
            }
        }
    }
}
