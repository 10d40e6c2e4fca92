//! `--vcd-add`: resolves names of registers, memory and ladder symbols to signals.

use diag::nearest;
use emu_core::cpu::Cpu;
use emu_debug::ProgramSource;
use emu_debug::bit_space::BIT_SPACE;
use emu_debug::trace::{SignalSource, TraceSignal, register_bits};
use ladder_compile::{CellLocation, ImageMap};

use crate::shared::usage_error::UsageError;

/// Maximum size of a signal, in bytes.
const MAX_SIGNAL_BYTES: u32 = 8;

/// Resolves a text to a signal: a symbol of the ladder program, a register of the core, memory, or a bit of a
/// byte.
pub fn parse_signal<C: Cpu>(
    text: &str,
    cpu: &C,
    source: &ProgramSource<'_>,
    map: Option<&ImageMap>,
) -> Result<TraceSignal, UsageError> {
    let (chip, text) = (cpu.chip(), text.trim());
    let name: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    if name.is_empty() || name.chars().any(|c| c.is_control() || !c.is_ascii()) {
        return Err(UsageError::SignalName);
    }
    if let Some(symbol) = map.and_then(|map| map.symbols.iter().find(|symbol| symbol.name == text)) {
        let (source, bits) = match &symbol.place {
            CellLocation::Bit { space, addr, bit } => (SignalSource::Bit(find_space(cpu, space)?, *addr, *bit), 1),
            CellLocation::Word { space, addr, bytes } => {
                let space = find_space(cpu, space)?;
                let len = u32::from(*bytes).clamp(1, MAX_SIGNAL_BYTES);
                (SignalSource::Bytes(space, *addr, len), len * 8)
            }
        };
        return check_signal_exists(TraceSignal { name, bits, source }, cpu);
    }
    if let Some(index) = chip.cpu_regs.iter().position(|reg| reg.eq_ignore_ascii_case(text)) {
        let bits = chip.cpu_regs.get(index).map_or(8, |reg| register_bits(chip, reg));
        return Ok(TraceSignal { name, bits, source: SignalSource::Register(index) });
    }
    let range = match (source.names.parse_range(text), text.rsplit_once('.')) {
        (Ok(range), _) => range,
        // A bit without an address of its own.
        (Err(_), Some((byte, bit))) if matches!(bit.as_bytes(), [b'0'..=b'7']) => {
            let range = source.names.parse_range(byte)?;
            let bit = bit.bytes().next().unwrap_or(b'0') - b'0';
            let source = SignalSource::Bit(range.space, range.start * chip.bytes_per_address(range.space), bit);
            return check_signal_exists(TraceSignal { name, bits: 1, source }, cpu);
        }
        (Err(why), _) => {
            let suggestion = map.and_then(|map| nearest(text, map.symbols.iter().map(|symbol| symbol.name.as_str())));
            return Err(match suggestion {
                Some(near) => UsageError::MisspeltSignal { near: near.to_owned() },
                None => why.into(),
            });
        }
    };
    let width = chip.bytes_per_address(range.space);
    let len = (range.end - range.start).saturating_mul(width);
    if len > MAX_SIGNAL_BYTES {
        return Err(UsageError::SignalTooLong { bytes: len, most: MAX_SIGNAL_BYTES });
    }
    let is_single_bit = range.space == BIT_SPACE || chip.is_bit_controller() && width == 1;
    if is_single_bit && len > 1 {
        return Err(UsageError::SeveralBits);
    }
    let addr = range.start * width;
    let source = if is_single_bit {
        SignalSource::Bit(range.space, addr, 0)
    } else {
        SignalSource::Bytes(range.space, addr, len)
    };
    check_signal_exists(TraceSignal { name, bits: if is_single_bit { 1 } else { len * 8 }, source }, cpu)
}

/// Finds a memory of the chip by the name in a map.
fn find_space<C: Cpu>(cpu: &C, space: &str) -> Result<&'static str, UsageError> {
    let chip = cpu.chip();
    let found = chip.spaces.iter().map(|space| space.name).find(|name| *name == space);
    found.ok_or_else(|| UsageError::UnknownMemory { space: space.to_owned(), chip: chip.name })
}

/// Returns the signal if the machine has all its bytes, otherwise an error.
fn check_signal_exists<C: Cpu>(signal: TraceSignal, cpu: &C) -> Result<TraceSignal, UsageError> {
    let (space, addr, len) = match signal.source {
        SignalSource::Register(_) => return Ok(signal),
        SignalSource::Bytes(space, addr, len) => (space, addr, len),
        SignalSource::Bit(space, addr, _) => (space, addr, 1),
    };
    match (addr..addr.saturating_add(len)).find(|&addr| cpu.peek(space, addr).is_none()) {
        None => Ok(signal),
        Some(addr) => {
            let addr = addr / cpu.chip().bytes_per_address(space);
            Err(UsageError::NoMemoryAt { chip: cpu.chip().name, space, addr })
        }
    }
}
