//! Locations of the bytes of a C object on a machine, and their current values.

use std::ops::Range;

use emu_core::image::{AVR_DATA, BitRange, ByteLocation, SpaceAddress};

use super::{ObjectBase, ObjectExpr};
use crate::debug::call_stack::{CallFrame, CalledFrame, MachineFrame, memory_at};
use crate::debug::dyn_machine::DynMachine;

/// The location of a byte of an object on a machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ObjectByteLocation {
    /// In a memory: its name, and the address.
    Memory(&'static str, u32),
    /// No location, but a known value.
    Value(u8),
    /// The compiler has optimized it away.
    OptimizedAway,
    /// No memory has this address, or the function of the variable is not being called.
    Missing,
}

impl ObjectExpr {
    /// Returns the frame in which a variable is in scope.
    pub(super) fn frame(&self, machine: &dyn DynMachine, known: &[Range<u32>], level: usize) -> Option<CallFrame> {
        let is_known = |frame: &CallFrame| {
            let byte = emu_core::image::FrameView::pc_byte(&MachineFrame { machine, frame });
            known.iter().any(|range| range.contains(&byte))
        };
        if level == 0
            && let Some(frame) = self.calls.frame(machine, 0).filter(is_known)
        {
            return Some(frame);
        }
        self.calls.frames(machine).into_iter().skip(level).find(is_known)
    }

    /// Returns the locations of its bytes.
    #[must_use]
    pub fn byte_locations(&self, machine: &dyn DynMachine) -> Vec<ObjectByteLocation> {
        const MOST: u32 = 1 << 16;
        let bytes = self.bytes().unwrap_or(0).min(MOST);
        let missing = || vec![ObjectByteLocation::Missing; bytes as usize];
        let index = self.indices.iter().try_fold(i64::from(self.offset), |sum, (index, size)| {
            sum.checked_add(index.value(machine)?.checked_mul(i64::from(*size))?)
        });
        let Some(first) = index else { return missing() };
        let chip = machine.chip();
        let in_memory = |address: u32| match memory_at(chip, address) {
            Some(SpaceAddress { space, addr }) if machine.peek(space, addr).is_some() => {
                ObjectByteLocation::Memory(space, addr)
            }
            _ => ObjectByteLocation::Missing,
        };
        match &self.base {
            ObjectBase::At(addr) => {
                let addr = addr.value(machine).and_then(|addr| addr.checked_add(first));
                let Some(addr) = addr.and_then(|addr| u32::try_from(addr).ok()) else { return missing() };
                let is_data = addr < 0x1_0000 && !chip.has_sdcc_pointers();
                let addr = if is_data { addr | AVR_DATA } else { addr };
                (0..bytes).map(|n| in_memory(addr.saturating_add(n))).collect()
            }
            ObjectBase::Value(_) | ObjectBase::AddressOf(_) => {
                let Some(value) = self.number(machine) else {
                    let gone = matches!(&self.base, ObjectBase::Value(of) if of.is_optimized_out(machine));
                    let what = if gone { ObjectByteLocation::OptimizedAway } else { ObjectByteLocation::Missing };
                    return vec![what; bytes as usize];
                };
                let value = value.to_le_bytes();
                (0..bytes as usize)
                    .map(|n| value.get(n).copied().map_or(ObjectByteLocation::Missing, ObjectByteLocation::Value))
                    .collect()
            }
            ObjectBase::Function(_) => missing(),
            ObjectBase::Kept(all) => {
                let at = |n: u32| all.get(usize::try_from(first.checked_add(n.into())?).ok()?);
                (0..bytes).map(|n| at(n).copied().unwrap_or(ObjectByteLocation::Missing)).collect()
            }
            ObjectBase::Variable { variable, known, level } => {
                let frame = match known.is_empty() {
                    true => self.calls.frame(machine, 0),
                    false => self.frame(machine, known, *level),
                };
                let Some(frame) = frame else { return missing() };
                let view = CalledFrame { calls: &self.calls, frame: MachineFrame { machine, frame: &frame } };
                let byte = emu_core::image::FrameView::pc_byte(&view);
                let all = self.info().locate_bytes(variable, self.info().function_at(byte), &view);
                let cell = |at: ByteLocation| match at {
                    ByteLocation::Memory(address) => in_memory(address),
                    // On the 8051, the places where a call saves registers are unknown.
                    ByteLocation::Register(number) if chip.has_sdcc_pointers() => {
                        let bank = machine.reg("PSW").unwrap_or(0) & 0x18;
                        match frame.word == machine.pc() {
                            true => ObjectByteLocation::Memory(chip.ram_space, bank + u32::from(number)),
                            false => ObjectByteLocation::OptimizedAway,
                        }
                    }
                    ByteLocation::Register(number) => match frame.saved_registers.get(usize::from(number)) {
                        Some(saved) => ObjectByteLocation::Memory(chip.ram_space, saved.unwrap_or(number.into())),
                        None => ObjectByteLocation::Missing,
                    },
                    ByteLocation::Value(value) => ObjectByteLocation::Value(value),
                    ByteLocation::OptimizedOut => ObjectByteLocation::OptimizedAway,
                };
                // Bytes after the end of an array in memory are memory too.
                let at = |n: u32| {
                    let n = first.checked_add(n.into())?;
                    match (usize::try_from(n).ok().and_then(|n| all.get(n)), all.first()) {
                        (Some(at), _) => Some(cell(*at)),
                        (None, Some(ByteLocation::Memory(address))) => {
                            let n = i32::try_from(n).ok()?;
                            Some(in_memory(address.checked_add_signed(n)?))
                        }
                        _ => None,
                    }
                };
                (0..bytes).map(|n| at(n).unwrap_or(ObjectByteLocation::Missing)).collect()
            }
        }
    }
}

impl ObjectExpr {
    /// Returns the bytes that a parameter had when its function was called, if the debugging information
    /// describes them.
    pub(in crate::debug) fn bytes_at_call(&self, machine: &dyn DynMachine) -> Option<Vec<u8>> {
        let ObjectBase::Variable { variable, known, level } = &self.base else { return None };
        let frame = self.frame(machine, known, *level).filter(|_| variable.parameter)?;
        let value = self.calls.parameter_at_call(machine, &frame, variable)?;
        value.to_le_bytes().get(..self.bytes()? as usize).map(<[u8]>::to_vec)
    }
}

impl ObjectByteLocation {
    /// Returns the current value of the byte as a constant.
    pub(super) fn frozen(self, machine: &dyn DynMachine) -> ObjectByteLocation {
        match self {
            ObjectByteLocation::Memory(space, addr) => {
                machine.peek(space, addr).map_or(ObjectByteLocation::Missing, ObjectByteLocation::Value)
            }
            other => other,
        }
    }

    /// Returns the current value of the byte.
    #[must_use]
    pub fn value(self, machine: &dyn DynMachine) -> Option<u8> {
        match self {
            ObjectByteLocation::Memory(space, addr) => machine.peek(space, addr),
            ObjectByteLocation::Value(value) => Some(value),
            ObjectByteLocation::OptimizedAway | ObjectByteLocation::Missing => None,
        }
    }
}

/// Returns the number in up to eight bytes, the lowest first; for a bit field, the value of its bits.
pub(in crate::debug) fn number_from_bytes(bytes: &[u8], bits: Option<BitRange>, signed: bool) -> Option<i64> {
    if bytes.is_empty() || bytes.len() > 8 {
        return None;
    }
    let all = bytes.iter().rev().fold(0u64, |high, byte| high << 8 | u64::from(*byte));
    let BitRange { first, size } = bits.unwrap_or(BitRange { first: 0, size: 8 * bytes.len() as u32 });
    let unused = 64 - size.clamp(1, 64);
    let low = all >> first.min(63) << unused;
    Some(if signed { low as i64 >> unused } else { (low >> unused) as i64 })
}
