//! The external bus (user's manual, "Accessing external memory", figures of the data memory cycles): what MOVX does to the
//! pins of ports 0, 2 and 3.
//!
//! It is over by the end of the instruction, so it changes no pin for good but port 0, whose latch is left with ones. The edges
//! are logged for who wants to see them. Within the two cycles of MOVX, in clocks:
//!
//! ```text
//! first  S5P1  P0 takes the lower, P2 the upper byte of the address      S6P1  P0 lets go, for a read
//!        S6P2  P0 takes the byte, for a write
//! second S1P1  RD or WR falls     S4P1  it rises     S4P2  P0 lets go, P2 shows its latch again
//! ```

use emu_core::cpu::{Bus as _, Wake};
use emu_core::pins::{Event, Level, PinId, Time};

use super::Soc;
use crate::periph::map::{at, pin};
use crate::periph::ports::PINS;

/// Clocks of the first cycle.
const ADDRESS: u8 = 8;
const TURN: u8 = 10;
const DATA: u8 = 11;
/// Clocks of the second cycle.
const FALL: u8 = 0;
const RISE: u8 = 6;
const RELEASE: u8 = 7;

/// A byte is moved over the bus.
#[derive(Debug, Clone, Copy)]
pub struct Transfer {
    /// Address; its upper byte is that of the latch of P2 for MOVX @Ri.
    pub addr: u16,
    /// The byte.
    pub value: u8,
    /// It goes out.
    pub write: bool,
}

impl Soc {
    /// MOVX is to be told of: it changes the latch of port 0, or its edges are wanted.
    #[inline]
    #[must_use]
    pub fn minds_movx(&self) -> bool {
        self.shows_bus || self.ports.latch(0) != 0xFF
    }

    /// Logs the edges of MOVX from now on, or does not. A chip without a bus has none.
    pub fn show_bus(&mut self, on: bool) {
        self.shows_bus = on && self.part.bus;
    }

    /// MOVX whose last cycle is `now`: leaves ones in the latch of port 0.
    pub fn external_access(&mut self, transfer: Transfer, now: u64) -> Wake {
        if self.shows_bus && self.log.is_on() && !self.ports.is_bus(0) {
            self.log_transfer(transfer, now);
        }
        self.write_bits(u16::from(at::P0), 0xFF, 0xFF, now)
    }

    /// Logs edges, sent bytes and fights over pins from the machine cycle `now` on, those that are fought for already too, or
    /// stops and forgets them.
    pub fn log(&mut self, on: bool, now: u64) {
        self.log.switch(on, now, (0..PINS as PinId).filter(|&pin| self.ports.contention(pin)));
    }

    /// The byte whose stop bit is being sent.
    #[must_use]
    pub fn stopping(&self) -> Option<u8> {
        self.serial.stopping()
    }

    fn log_transfer(&mut self, transfer: Transfer, now: u64) {
        self.run(now);
        let [high, low] = transfer.addr.to_be_bytes();
        let strobe = if transfer.write { pin::WR } else { pin::RD };
        let (first, second) = (now.saturating_sub(1), now);
        let mut levels = [0, 1, 2, 3].map(|port| [0, 1, 2, 3, 4, 5, 6, 7].map(|bit| self.level(port * 8 + bit)));
        let rest = levels;
        let mut edge = |cycle: u64, clock: u8, pin: PinId, level: Level| {
            let before = &mut levels[usize::from(pin / 8)][usize::from(pin % 8)];
            if *before != level {
                *before = level;
                let phase = clock * self.clocks_per_cycle / 12;
                self.log.note(Event::Edge { at: Time { cycle, phase }, pin, level });
            }
        };
        for bit in 0..8 {
            edge(first, ADDRESS, bit, Level::of(low >> bit & 1 == 1));
            edge(first, ADDRESS, 16 + bit, Level::of(high >> bit & 1 == 1));
        }
        for bit in 0..8 {
            match transfer.write {
                true => edge(first, DATA, bit, Level::of(transfer.value >> bit & 1 == 1)),
                false => edge(first, TURN, bit, Level::Float),
            }
        }
        let pulls = rest[3][usize::from(strobe % 8)] == Level::High;
        if pulls {
            edge(second, FALL, strobe, Level::Low);
            edge(second, RISE, strobe, Level::High);
        }
        for bit in 0..8 {
            // What the latch of port 0 does to its pins it does now, before the ones are written.
            edge(second, RELEASE, bit, rest[0][usize::from(bit)]);
            edge(second, RELEASE, 16 + bit, rest[2][usize::from(bit)]);
        }
    }
}
