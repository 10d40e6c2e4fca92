//! Locations that have a value: registers, memory, bits, pins, time.

use std::ops::RangeInclusive;

use emu_core::pins::{CycleTime, PinId, PinLevel};

use super::dyn_machine::DynMachine;
use super::error::DebugError;
use crate::stimulus::{ExternalDrive, TimedDrive};

/// A location of the machine with a value, which can usually be set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExpressionPlace {
    /// A core register, as [`Chip::cpu_regs`](emu_core::Chip::cpu_regs) names it.
    Reg(&'static str),
    /// Bytes of a memory, the lowest first.
    Memory {
        /// The memory, as [`Chip::spaces`](emu_core::Chip::spaces) names it.
        space: &'static str,
        /// Address in the unit of [`Cpu::peek`](emu_core::Cpu::peek).
        addr: u32,
        /// Number of bytes, 1 to 4.
        bytes: u8,
        /// The highest bit is the sign.
        signed: bool,
    },
    /// One bit of a byte.
    Bit {
        /// The memory.
        space: &'static str,
        /// Address of the byte.
        addr: u32,
        /// Position, 0 to 7.
        bit: u8,
    },
    /// One bit of a core register.
    RegBit {
        /// The register.
        name: &'static str,
        /// Position, from 0.
        bit: u8,
    },
    /// The level of a pin: 1 if it is high, 0 if it is low; a floating pin has no value.
    Pin(PinId),
    /// Machine cycles since power-up.
    Cycle,
    /// Instructions since power-up.
    Instructions,
    /// The program counter in the unit of the chip's users (bytes on AVR and 8051, words on PIC16 and AP101).
    Pc,
}

impl ExpressionPlace {
    /// Returns the current value; `None` if the location does not exist, or if a pin floats.
    #[must_use]
    pub fn value(self, machine: &dyn DynMachine) -> Option<i64> {
        Some(match self {
            ExpressionPlace::Reg(name) => machine.reg(name)?.into(),
            ExpressionPlace::Memory { space, addr, bytes, signed } => {
                let mut value = 0i64;
                for n in 0..bytes.min(4) {
                    value |= i64::from(machine.peek(space, addr.checked_add(n.into())?)?) << (8 * n);
                }
                let unused = 64 - 8 * u32::from(bytes.clamp(1, 4));
                if signed { value << unused >> unused } else { value }
            }
            ExpressionPlace::Bit { space, addr, bit } => (machine.peek(space, addr)? >> (bit & 7) & 1).into(),
            ExpressionPlace::RegBit { name, bit } => {
                (machine.reg(name)?.checked_shr(bit.into()).unwrap_or(0) & 1).into()
            }
            ExpressionPlace::Pin(pin) => match machine.pin_level(pin) {
                PinLevel::High | PinLevel::PullUp => 1,
                PinLevel::Low | PinLevel::PullDown => 0,
                PinLevel::Float => return None,
            },
            ExpressionPlace::Cycle => i64::try_from(machine.cycle()).unwrap_or(i64::MAX),
            ExpressionPlace::Instructions => i64::try_from(machine.instructions()).unwrap_or(i64::MAX),
            ExpressionPlace::Pc => machine.chip().code_address(machine.pc()).into(),
        })
    }

    /// Returns the allowed values; `None` for a location that cannot be set.
    #[must_use]
    pub fn value_range(self, machine: &dyn DynMachine) -> Option<RangeInclusive<i64>> {
        Some(match self {
            ExpressionPlace::Reg(name) => 0..=max_register_value(machine, name),
            ExpressionPlace::Memory { bytes, signed, .. } => {
                let bits = 8 * u32::from(bytes.clamp(1, 4));
                -(1 << (bits - 1))..=(if signed { (1 << (bits - 1)) - 1 } else { (1 << bits) - 1 })
            }
            ExpressionPlace::Bit { .. } | ExpressionPlace::RegBit { .. } | ExpressionPlace::Pin(_) => 0..=1,
            ExpressionPlace::Pc => {
                let chip = machine.chip();
                0..=i64::from(chip.code_address(chip.flash_bytes / chip.word_bytes.max(1)).saturating_sub(1))
            }
            ExpressionPlace::Cycle | ExpressionPlace::Instructions => return None,
        })
    }
}

/// Returns the highest value that a core register holds, measured on a copy of the machine.
pub(super) fn max_register_value(machine: &dyn DynMachine, name: &str) -> i64 {
    let mut copy = machine.fork();
    copy.set_reg(name, u32::MAX);
    let kept = copy.reg(name).unwrap_or(0);
    // Bits that always read as the same value still belong to it.
    i64::from(kept.checked_next_power_of_two().map_or(u32::MAX, |power| if power == kept { kept } else { power - 1 }))
}

impl ExpressionPlace {
    /// Sets the value.
    ///
    /// # Errors
    /// The location cannot be set, or not to this value.
    pub fn set(self, machine: &mut dyn DynMachine, value: i64) -> Result<(), DebugError> {
        let Some(allowed) = self.value_range(machine) else {
            return Err(DebugError::TimeNotSettable);
        };
        if !allowed.contains(&value) {
            return Err(DebugError::ValueOutOfRange { value, least: *allowed.start(), most: *allowed.end() });
        }
        let done = |done: bool| if done { Ok(()) } else { Err(DebugError::NoSuchPlace) };
        match self {
            ExpressionPlace::Reg(name) => done(machine.set_reg(name, value as u32)),
            ExpressionPlace::Memory { space, addr, bytes, .. } => {
                for (n, byte) in (0..u32::from(bytes.min(4))).zip(value.to_le_bytes()) {
                    done(addr.checked_add(n).is_some_and(|addr| machine.poke(space, addr, byte)))?;
                }
                Ok(())
            }
            ExpressionPlace::Bit { space, addr, bit } => done(machine.poke_bit(space, addr, bit, value != 0)),
            ExpressionPlace::RegBit { name, bit } => {
                let mask = 1u32.checked_shl(bit.into()).unwrap_or(0);
                let old = machine.reg(name).ok_or(DebugError::NoSuchPlace)?;
                done(machine.set_reg(name, if value == 0 { old & !mask } else { old | mask }))
            }
            ExpressionPlace::Pin(pin) => {
                let at = CycleTime::at(machine.cycle());
                let drive = ExternalDrive::Level(pin, PinLevel::from_bit(value != 0));
                Ok(machine.queue_drive(TimedDrive { at, drive })?)
            }
            ExpressionPlace::Pc => {
                let (chip, value) = (machine.chip(), value as u32);
                let per_word = chip.code_address(1).max(1);
                if value % per_word != 0 {
                    return Err(DebugError::WithinWord { addr: value });
                }
                let pc = chip.cpu_regs.iter().copied().find(|reg| matches!(*reg, "PC" | "NA"));
                done(pc.is_some_and(|pc| machine.set_reg(pc, value / per_word)))
            }
            ExpressionPlace::Cycle | ExpressionPlace::Instructions => Ok(()),
        }
    }
}
