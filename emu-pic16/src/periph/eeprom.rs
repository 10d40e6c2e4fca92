//! The EEPROM, and program memory as the program itself reads and writes it (DS30292 section 4, DS39582 section 3, DS35007
//! section 3, DS40044 section 13, DS39598 and DS30487 section 3).
//!
//! A write is let through by 55h to EECON2, AAh to EECON2 two instruction cycles later and WR set in the cycle after that, as
//! the five instructions of the data sheets do; WREN must have been set before. It takes its time by a clock of its own, which
//! sleep does not stop. The data sheets have two NOPs follow the start of every access to program memory: these instructions
//! run as NOP ([`Signal::Ignore`]), on the chips with FREE only the second. Then the core stands ([`Signal::Stall`]).

use emu_core::state::{Damaged, State, Tape};
use std::ops::Range;

use emu_core::NEVER;

use super::map::{Flag, Sfr};
use super::{Device, Outbox, Signal};
use crate::chips::Memory;

/// The access is to program memory.
const EEPGD: u8 = 1 << 7;
/// The write erases a row of program memory.
const FREE: u8 = 1 << 4;
/// A write is over, where it stands in EECON1.
const EEIF: u8 = 1 << 4;
/// A reset has broken a write off.
const WRERR: u8 = 1 << 3;
/// Writes are let through.
const WREN: u8 = 1 << 2;
/// Starts a write; set while it goes on.
const WR: u8 = 1 << 1;
/// Starts a read; set while it goes on.
const RD: u8 = 1;

/// Clocks of an instruction cycle.
const CYCLE: u64 = 4;
/// Words that are written at a time on chips that write blocks.
const BLOCK: usize = 4;
/// Words that FREE erases.
const ROW: u16 = 32;
/// An erased word.
const ERASED: u16 = 0x3FFF;

/// Program memory as the program can write it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Flash {
    /// Program words of the chip.
    pub words: u16,
    /// Those that the program may write, by WRT (and on the 16F87x by CP) of the configuration word.
    pub writable: Range<u16>,
    /// Clocks of the oscillator that a write or an erase takes.
    pub clocks: u64,
}

/// A write that goes on.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Job {
    /// When the core begins to stand still; [`NEVER`] where it does not, or no more.
    stall: u64,
    /// When it is over.
    until: u64,
    effect: Effect,
}

emu_core::state! { Job { stall, until, effect } }

/// What a write has done when it is over.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
enum Effect {
    #[default]
    /// Nothing: a buffer word has been filled, or the address is protected.
    Nothing,
    /// A byte of the EEPROM.
    Byte(u8, u8),
    /// Words of program memory.
    Words(Signal),
}

impl State for Effect {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let (mut tag, mut byte, mut words) = match self {
            Effect::Byte(addr, value) => (1_u8, (*addr, *value), (0, Vec::new())),
            Effect::Words(Signal::FlashWrite { addr, words }) => (2, (0, 0), (*addr, words.clone())),
            Effect::Words(Signal::FlashProgram { addr, words }) => (3, (0, 0), (*addr, words.clone())),
            _ => (0, (0, 0), (0, Vec::new())),
        };
        tag.state(tape)?;
        byte.state(tape)?;
        words.state(tape)?;
        let (addr, words) = words;
        *self = match tag {
            0 => Effect::Nothing,
            1 => Effect::Byte(byte.0, byte.1),
            2 => Effect::Words(Signal::FlashWrite { addr, words }),
            3 => Effect::Words(Signal::FlashProgram { addr, words }),
            _ => return Err(Damaged),
        };
        Ok(())
    }
}

/// The EEPROM and the way to program memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Eeprom {
    kind: Memory,
    bytes: Vec<u8>,
    write_clocks: u64,
    flash: Flash,
    eedata: u8,
    eeadr: u8,
    eedath: u8,
    eeadrh: u8,
    /// EECON1 without WR and RD.
    eecon1: u8,
    /// The last of 55h and AAh that has been written in order, and when.
    unlock: Option<(u8, u64)>,
    /// A read of program memory: when it is over, and the word.
    read: Option<(u64, u16)>,
    job: Option<Job>,
    buffers: [u16; BLOCK],
}

impl State for Eeprom {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        #[rustfmt::skip]
        let Eeprom {
            kind: _, write_clocks: _, flash: _, bytes, eedata, eeadr, eedath, eeadrh, eecon1, unlock, read, job, buffers,
        } = self;
        tape.memory(bytes)?;
        for register in [eedata, eeadr, eedath, eeadrh, eecon1] {
            register.state(tape)?;
        }
        unlock.state(tape)?;
        read.state(tape)?;
        job.state(tape)?;
        buffers.state(tape)
    }
}

impl Eeprom {
    /// As after power-up. `bytes`: what the EEPROM holds, all of it; `write_clocks`: clocks of the oscillator that the write of
    /// a byte takes.
    #[must_use]
    pub fn new(kind: Memory, bytes: &[u8], write_clocks: u64, flash: Flash) -> Eeprom {
        Eeprom {
            kind,
            bytes: bytes.to_vec(),
            write_clocks,
            flash,
            eedata: 0,
            eeadr: 0,
            eedath: 0,
            eeadrh: 0,
            eecon1: 0,
            unlock: None,
            read: None,
            job: None,
            buffers: [ERASED; BLOCK],
        }
    }

    /// What the EEPROM holds.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Sets a byte of the EEPROM from outside of the chip; none outside of it.
    pub fn set_byte(&mut self, addr: usize, value: u8) {
        if let Some(byte) = self.bytes.get_mut(addr) {
            *byte = value;
        }
    }

    /// The word that [`Signal::FlashRead`] has asked for; to be given before the next call.
    pub fn flash_data(&mut self, word: u16) {
        if let Some((_, data)) = &mut self.read {
            *data = word;
        }
    }

    /// A reset at `t`; everything due at `t` has been done. It breaks a write off, which sets WRERR unless the power was gone.
    pub fn reset(&mut self, power_on: bool, t: u64) {
        self.run(t, &mut Outbox::new());
        let broken = self.job.take().is_some_and(|job| job.effect != Effect::Nothing);
        self.eecon1 &= if power_on { 0 } else { EEPGD | WRERR };
        if broken && !power_on {
            self.eecon1 |= WRERR;
        }
        self.read = None;
        self.unlock = None;
    }

    /// The chip has the way to program memory.
    const fn has_flash(&self) -> bool {
        matches!(self.kind, Memory::Word | Memory::Block4 | Memory::Read | Memory::Row32)
    }

    /// The bits of EECON1 that can be written, but WR and RD.
    const fn writable_bits(&self) -> u8 {
        match self.kind {
            Memory::None => 0,
            Memory::F84 => EEIF | WRERR | WREN,
            Memory::F62x => WRERR | WREN,
            Memory::Word | Memory::Block4 | Memory::Read => EEPGD | WRERR | WREN,
            Memory::Row32 => EEPGD | FREE | WRERR | WREN,
        }
    }

    /// The bits of EEADRH that there are: five, but only those of the chip's memory on the 818, 819, 87 and 88.
    const fn eeadrh_bits(&self) -> u8 {
        match self.kind {
            Memory::Row32 => (self.flash.words.saturating_sub(1) >> 8) as u8 & 0x1F,
            _ if self.has_flash() => 0x1F,
            _ => 0,
        }
    }

    const fn address(&self) -> u16 {
        (self.eeadrh as u16) << 8 | self.eeadr as u16
    }

    /// A write is going on at `t`.
    fn writing(&self, t: u64) -> bool {
        self.job.as_ref().is_some_and(|job| job.until > t)
    }

    /// A read is going on at `t`.
    fn reading(&self, t: u64) -> bool {
        self.read.is_some_and(|(until, _)| until > t)
    }

    /// The word that a read of program memory has put into EEDATH and EEDATA by `t`, if it is not there yet.
    fn arrived(&self, t: u64) -> Option<u16> {
        self.read.filter(|&(until, _)| until <= t).map(|(_, word)| word)
    }

    /// The instructions after the start of an access at `t` that run as NOP.
    fn ignore(&self, t: u64, out: &mut Outbox) {
        let from = if self.kind == Memory::Row32 { t + CYCLE } else { t };
        out.push(Signal::Ignore { from, until: t + 2 * CYCLE });
    }

    fn start_read(&mut self, t: u64, out: &mut Outbox) {
        if self.eecon1 & EEPGD == 0 {
            self.eedata = self.bytes.get(usize::from(self.eeadr)).copied().unwrap_or(0);
            return;
        }
        self.read = Some((t + 2 * CYCLE, 0));
        out.push(Signal::FlashRead { addr: self.address() });
        self.ignore(t, out);
    }

    fn start_write(&mut self, t: u64, out: &mut Outbox) {
        if self.eecon1 & EEPGD == 0 {
            let until = t.saturating_add(self.write_clocks);
            self.job = Some(Job { stall: NEVER, until, effect: Effect::Byte(self.eeadr, self.eedata) });
            return;
        }
        let addr = self.address();
        let word = u16::from(self.eedath) << 8 | u16::from(self.eedata);
        let place = usize::from(addr) % BLOCK;
        let erase = self.kind == Memory::Row32 && self.eecon1 & FREE != 0;
        let blocks = matches!(self.kind, Memory::Block4 | Memory::Row32) && !erase;
        if blocks && let Some(buffer) = self.buffers.get_mut(place) {
            *buffer = word;
        }
        let short = blocks && place != BLOCK - 1;
        let first = addr & !(BLOCK as u16 - 1);
        let words = match self.kind {
            Memory::None | Memory::F84 | Memory::F62x | Memory::Read => return,
            Memory::Word => Signal::FlashWrite { addr, words: vec![word] },
            Memory::Block4 => Signal::FlashWrite { addr: first, words: self.buffers.to_vec() },
            Memory::Row32 if erase => Signal::FlashWrite { addr: addr & !(ROW - 1), words: vec![ERASED; ROW.into()] },
            Memory::Row32 => Signal::FlashProgram { addr: first, words: self.buffers.to_vec() },
        };
        if !(short && self.kind == Memory::Row32) {
            self.ignore(t, out);
        }
        let set_up = t + 2 * CYCLE;
        self.job = Some(if short {
            Job { stall: NEVER, until: t + CYCLE, effect: Effect::Nothing }
        } else if !self.flash.writable.contains(&addr) {
            Job { stall: NEVER, until: set_up, effect: Effect::Nothing }
        } else {
            let until = set_up.saturating_add(self.flash.clocks);
            Job { stall: set_up, until, effect: Effect::Words(words) }
        });
    }

    fn write_eecon1(&mut self, value: u8, t: u64, out: &mut Outbox) {
        let unlocked = self.unlock.take() == Some((0xAA, t - CYCLE.min(t)));
        let enabled = self.eecon1 & value & WREN != 0;
        let busy = self.writing(t) || self.reading(t);
        // EEPGD cannot be changed during an access (register EECON1).
        let mask = self.writable_bits() & if busy { !EEPGD } else { 0xFF };
        self.eecon1 = self.eecon1 & !mask | value & mask;
        if busy {
            return;
        }
        if value & WR != 0 && unlocked && enabled {
            self.start_write(t, out);
        } else if value & RD != 0 {
            self.start_read(t, out);
        }
    }
}

impl Device for Eeprom {
    fn run(&mut self, t: u64, out: &mut Outbox) {
        if let Some(word) = self.arrived(t) {
            [self.eedath, self.eedata] = (word & ERASED).to_be_bytes();
            self.read = None;
        }
        if let Some(job) = self.job.as_mut().filter(|job| job.stall <= t) {
            job.stall = NEVER;
            out.push(Signal::Stall { until: job.until });
        }
        if let Some(Job { until, effect, .. }) = self.job.take_if(|job| job.until <= t) {
            match effect {
                Effect::Nothing => return,
                Effect::Byte(addr, value) => self.set_byte(addr.into(), value),
                Effect::Words(signal) => out.push(signal),
            }
            if self.kind == Memory::F84 {
                self.eecon1 |= EEIF;
            }
            out.push(Signal::Flag { t: until, flag: Flag::EEIF });
        }
    }

    fn next(&self) -> u64 {
        match &self.job {
            Some(job) if job.effect != Effect::Nothing => job.stall.min(job.until),
            _ => NEVER,
        }
    }

    fn peek(&self, reg: Sfr, t: u64) -> u8 {
        let [high, low] = match self.arrived(t) {
            Some(word) => (word & ERASED).to_be_bytes(),
            None => [self.eedath, self.eedata],
        };
        match reg {
            Sfr::EEDATA => low,
            Sfr::EEDATH => high,
            Sfr::EEADR => self.eeadr,
            Sfr::EEADRH => self.eeadrh,
            Sfr::EECON1 => self.eecon1 | if self.writing(t) { WR } else { 0 } | if self.reading(t) { RD } else { 0 },
            _ => 0,
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Outbox) {
        let before = out.len();
        self.run(t, out);
        if self.kind == Memory::None {
            return;
        }
        match (reg, self.unlock) {
            (Sfr::EECON1, _) => {
                self.write_eecon1(value, t, out);
                // A write that is over at this very clock sets the flag all the same.
                let set = out.iter().skip(before).any(|s| matches!(s, Signal::Flag { .. }));
                if self.kind == Memory::F84 && set {
                    self.eecon1 |= EEIF;
                }
            }
            (Sfr::EECON2, Some((0x55, at))) if value == 0xAA && t == at + 2 * CYCLE => self.unlock = Some((0xAA, t)),
            (Sfr::EECON2, _) => self.unlock = (value == 0x55).then_some((0x55, t)),
            _ => {
                self.unlock = None;
                match reg {
                    Sfr::EEDATA => self.eedata = value,
                    Sfr::EEADR => self.eeadr = value,
                    Sfr::EEDATH if self.has_flash() => self.eedath = value & 0x3F,
                    Sfr::EEADRH => self.eeadrh = value & self.eeadrh_bits(),
                    _ => {}
                }
            }
        }
    }

    /// Writes have a clock of their own.
    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
    }

    fn wake(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
    }

    fn steady(&self, reg: Sfr, t: u64) -> u64 {
        let read = self.read.map_or(NEVER, |(until, _)| until);
        let job = self.job.as_ref().map_or(NEVER, |job| job.until);
        let change = match reg {
            Sfr::EEDATA | Sfr::EEDATH => read,
            Sfr::EECON1 => read.min(job),
            _ => NEVER,
        };
        if change <= t { t } else { change }
    }
}
