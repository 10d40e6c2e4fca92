//! The external bus: the effect of MOVX on the pins of ports 0, 2 and 3 (user's manual, "Accessing external
//! memory", figures of the data memory cycles).
//!
//! The transfer ends with the instruction, so it changes no pin permanently except those of port 0, whose
//! latch is set to ones. The edges are logged on request. In clocks of the two cycles of MOVX:
//!
//! ```text
//! first  S5P1  P0 takes the lower, P2 the upper byte of the address      S6P1  P0 floats, for a read
//!        S6P2  P0 takes the byte, for a write
//! second S1P1  RD or WR falls     S4P1  it rises     S4P2  P0 floats, P2 shows its latch again
//! ```

use emu_core::cpu::{Bus as _, BusEffect};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

use super::Mcs51Soc;
use crate::periph::map::{pin, sfr};

/// Clocks of the first cycle.
const ADDRESS_PHASE: u8 = 8;
const TURNAROUND_PHASE: u8 = 10;
const DATA_PHASE: u8 = 11;
/// Clocks of the second cycle.
const STROBE_FALL_PHASE: u8 = 0;
const STROBE_RISE_PHASE: u8 = 6;
const RELEASE_PHASE: u8 = 7;

/// A byte that is moved over the bus.
#[derive(Debug, Clone, Copy)]
pub struct BusTransfer {
    /// Address; for MOVX @Ri its upper byte is that of the latch of P2.
    pub addr: u16,
    /// The byte.
    pub value: u8,
    /// Whether the byte is written.
    pub write: bool,
}

impl Mcs51Soc {
    /// Whether MOVX must be reported to the chip: it changes the latch of port 0, or its edges are logged.
    #[inline]
    #[must_use]
    pub fn has_bus_pins(&self) -> bool {
        self.logs_bus || self.ports.latch(0) != 0xFF
    }

    /// Enables or disables logging of the edges of MOVX. A chip without a bus has none.
    pub fn set_bus_on_pins(&mut self, on: bool) {
        self.logs_bus = on && self.part.has_bus;
    }

    /// Applies a MOVX whose last cycle is `now`: it sets the latch of port 0 to ones.
    pub fn external_access(&mut self, transfer: BusTransfer, now: u64) -> BusEffect {
        if self.logs_bus && self.log.is_enabled() && !self.ports.is_bus(0) {
            self.log_transfer(transfer, now);
        }
        self.write_bits(u16::from(sfr::P0), 0xFF, 0xFF, now)
    }

    fn log_transfer(&mut self, transfer: BusTransfer, now: u64) {
        self.run(now);
        let [high, low] = transfer.addr.to_be_bytes();
        let strobe = if transfer.write { pin::WR } else { pin::RD };
        let (first, second) = (now.saturating_sub(1), now);
        let mut levels = [0, 1, 2, 3].map(|port| [0, 1, 2, 3, 4, 5, 6, 7].map(|bit| self.level(port * 8 + bit)));
        let rest = levels;
        let mut edge = |cycle: u64, clock: u8, pin: PinId, level: PinLevel| {
            let before = &mut levels[usize::from(pin / 8)][usize::from(pin % 8)];
            if *before != level {
                *before = level;
                let phase = clock * self.clocks_per_cycle / 12;
                self.log.record(ChipEvent::Edge { at: CycleTime { cycle, phase }, pin, level });
            }
        };
        for bit in 0..8 {
            edge(first, ADDRESS_PHASE, bit, PinLevel::from_bit(low >> bit & 1 == 1));
            edge(first, ADDRESS_PHASE, 16 + bit, PinLevel::from_bit(high >> bit & 1 == 1));
        }
        for bit in 0..8 {
            match transfer.write {
                true => edge(first, DATA_PHASE, bit, PinLevel::from_bit(transfer.value >> bit & 1 == 1)),
                false => edge(first, TURNAROUND_PHASE, bit, PinLevel::Float),
            }
        }
        let pulls = rest[3][usize::from(strobe % 8)] == PinLevel::High;
        if pulls {
            edge(second, STROBE_FALL_PHASE, strobe, PinLevel::Low);
            edge(second, STROBE_RISE_PHASE, strobe, PinLevel::High);
        }
        for bit in 0..8 {
            // The pins of port 0 return to the level of the present latch, before the ones are written.
            edge(second, RELEASE_PHASE, bit, rest[0][usize::from(bit)]);
            edge(second, RELEASE_PHASE, 16 + bit, rest[2][usize::from(bit)]);
        }
    }
}
