//! `--vcd-add`: names of registers, memory and ladder symbols as signals.

use emu_core::chip::Family;
use emu_core::cpu::Cpu;
use emu_debug::Source;
use emu_debug::bits::BIT;
use emu_debug::trace::{Signal, SignalSource, register_bits};
use ladder_compile::{Map, Place};

use diag::nearest;

/// Most bytes of a signal.
const MOST: u32 = 8;

/// The signal that a text stands for: a symbol of the ladder program, a register of the core, memory, or a bit of a byte.
pub fn signal<C: Cpu>(text: &str, cpu: &C, source: &Source<'_>, map: Option<&Map>) -> Result<Signal, String> {
    let (chip, text) = (cpu.chip(), text.trim());
    let name: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    if name.is_empty() || name.chars().any(|c| c.is_control() || !c.is_ascii()) {
        return Err("a signal is named by a word of ASCII".to_owned());
    }
    if let Some(symbol) = map.and_then(|map| map.symbols.iter().find(|symbol| symbol.name == text)) {
        let (source, bits) = match &symbol.place {
            Place::Bit { space, addr, bit } => (SignalSource::Bit(known(cpu, space)?, *addr, *bit), 1),
            Place::Word { space, addr, bytes } => {
                let space = known(cpu, space)?;
                let len = u32::from(*bytes).clamp(1, MOST);
                (SignalSource::Bytes(space, *addr, len), len * 8)
            }
        };
        return there(Signal { name, bits, source }, cpu);
    }
    if let Some(index) = chip.cpu_regs.iter().position(|reg| reg.eq_ignore_ascii_case(text)) {
        let bits = chip.cpu_regs.get(index).map_or(8, |reg| register_bits(chip, reg));
        return Ok(Signal { name, bits, source: SignalSource::Register(index) });
    }
    let range = match (source.names.range(text), text.rsplit_once('.')) {
        (Ok(range), _) => range,
        // A bit that has no address of its own.
        (Err(_), Some((byte, bit))) if matches!(bit.as_bytes(), [b'0'..=b'7']) => {
            let range = source.names.range(byte)?;
            let bit = bit.bytes().next().unwrap_or(b'0') - b'0';
            let source = SignalSource::Bit(range.space, range.start * chip.width(range.space), bit);
            return there(Signal { name, bits: 1, source }, cpu);
        }
        (Err(why), _) => {
            let near = map.and_then(|map| nearest(text, map.symbols.iter().map(|symbol| symbol.name.as_str())));
            return Err(near.map_or(why, |near| format!("is nothing that is known; did you mean `{near}`?")));
        }
    };
    let width = chip.width(range.space);
    let len = (range.end - range.start).saturating_mul(width);
    if len > MOST {
        return Err(format!("has {len} bytes; a signal has at most {MOST}"));
    }
    let one = range.space == BIT || chip.family == Family::Ap101 && width == 1;
    if one && len > 1 {
        return Err("names several bits; add them one by one".to_owned());
    }
    let at = range.start * width;
    let source = if one { SignalSource::Bit(range.space, at, 0) } else { SignalSource::Bytes(range.space, at, len) };
    there(Signal { name, bits: if one { 1 } else { len * 8 }, source }, cpu)
}

/// A memory of the chip by the name in a map.
fn known<C: Cpu>(cpu: &C, space: &str) -> Result<&'static str, String> {
    let chip = cpu.chip();
    let found = chip.spaces.iter().map(|(name, ..)| *name).find(|name| *name == space);
    found.ok_or_else(|| format!("the map has it in `{space}`, which {} has not", chip.name))
}

/// The machine has what the signal shows.
fn there<C: Cpu>(signal: Signal, cpu: &C) -> Result<Signal, String> {
    let (space, addr, len) = match signal.source {
        SignalSource::Register(_) => return Ok(signal),
        SignalSource::Bytes(space, addr, len) => (space, addr, len),
        SignalSource::Bit(space, addr, _) => (space, addr, 1),
    };
    match (addr..addr.saturating_add(len)).find(|&addr| cpu.peek(space, addr).is_none()) {
        None => Ok(signal),
        Some(addr) => Err(format!("{} has nothing at {space}:0x{:x}", cpu.chip().name, addr / cpu.chip().width(space))),
    }
}
