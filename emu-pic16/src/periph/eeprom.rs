//! The EEPROM, and access of the program to program memory (DS30292 section 4, DS39582 section 3, DS35007
//! section 3, DS40044 section 13, DS39598 and DS30487 section 3).
//!
//! A write starts only after 55h to EECON2, AAh to EECON2 two instruction cycles later, and WR set in the
//! cycle after that, as in the five instructions of the data sheets; WREN must have been set before. A
//! separate clock times the write, which continues in sleep. In the data sheets two NOPs follow the start of
//! every access to program memory: these instructions execute as NOP ([`Pic16Signal::Ignore`]), on chips with
//! FREE only the second one. Then the core halts ([`Pic16Signal::Stall`]).

use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};
use std::ops::Range;

use emu_core::NEVER;

use super::map::{InterruptFlag, Sfr};
use super::{Device, Pic16Outbox, Pic16Signal};
use crate::chips::NonvolatileKind;

/// Mask of EEPGD in EECON1: the access is to program memory.
const EEPGD: u8 = 1 << 7;
/// Mask of FREE in EECON1: the write erases a row of program memory.
const FREE: u8 = 1 << 4;
/// Mask of EEIF in EECON1, on chips that have it there: a write is complete.
const EEIF: u8 = 1 << 4;
/// Mask of WRERR in EECON1: a reset has aborted a write.
const WRERR: u8 = 1 << 3;
/// Mask of WREN in EECON1: writes are enabled.
const WREN: u8 = 1 << 2;
/// Mask of WR in EECON1: starts a write; set during the write.
const WR: u8 = 1 << 1;
/// Mask of RD in EECON1: starts a read; set during the read.
const RD: u8 = 1;

/// Clocks per instruction cycle.
const CLOCKS_PER_CYCLE: u64 = 4;
/// Number of words written at a time, on chips that write blocks.
const BLOCK_WORDS: usize = 4;
/// Number of words that FREE erases.
const ERASE_ROW_WORDS: u16 = 32;
/// Value of an erased word.
const ERASED_WORD: u16 = 0x3FFF;

/// Properties of program memory as the program can access it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FlashAccess {
    /// Number of program words of the chip.
    pub words: u16,
    /// Words that the program may write, by WRT (and on the 16F87x by CP) of the configuration word.
    pub writable: Range<u16>,
    /// Duration of a write or an erase in clocks of the oscillator.
    pub clocks: u64,
}

/// A write in progress.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct WriteOperation {
    /// Clock at which the core halts; [`NEVER`] if it does not halt, or has halted already.
    stall: u64,
    /// Clock at which the write is complete.
    until: u64,
    effect: WriteEffect,
}

emu_core::state! { WriteOperation { stall, until, effect } }

/// Effect of a write when it is complete.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
enum WriteEffect {
    #[default]
    /// None: a buffer word was filled, or the address is protected.
    Nothing,
    /// Writes a byte of the EEPROM: address, value.
    Byte(u8, u8),
    /// Writes words of program memory.
    Words(Pic16Signal),
}

impl SnapshotState for WriteEffect {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let (mut tag, mut byte, mut words) = match self {
            WriteEffect::Byte(addr, value) => (1_u8, (*addr, *value), (0, Vec::new())),
            WriteEffect::Words(Pic16Signal::FlashWrite { addr, words }) => (2, (0, 0), (*addr, words.clone())),
            WriteEffect::Words(Pic16Signal::FlashProgram { addr, words }) => (3, (0, 0), (*addr, words.clone())),
            _ => (0, (0, 0), (0, Vec::new())),
        };
        tag.pass_state(tape)?;
        byte.pass_state(tape)?;
        words.pass_state(tape)?;
        let (addr, words) = words;
        *self = match tag {
            0 => WriteEffect::Nothing,
            1 => WriteEffect::Byte(byte.0, byte.1),
            2 => WriteEffect::Words(Pic16Signal::FlashWrite { addr, words }),
            3 => WriteEffect::Words(Pic16Signal::FlashProgram { addr, words }),
            _ => return Err(SnapshotDamaged),
        };
        Ok(())
    }
}

/// The EEPROM and the access to program memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Eeprom {
    kind: NonvolatileKind,
    bytes: Vec<u8>,
    write_clocks: u64,
    flash: FlashAccess,
    eedata: u8,
    eeadr: u8,
    eedath: u8,
    eeadrh: u8,
    /// EECON1 without WR and RD.
    eecon1: u8,
    /// The last of 55h and AAh that was written in the right order, and its clock.
    unlock: Option<(u8, u64)>,
    /// A read of program memory in progress: clock of its end, and the word.
    read: Option<(u64, u16)>,
    job: Option<WriteOperation>,
    buffers: [u16; BLOCK_WORDS],
}

impl SnapshotState for Pic16Eeprom {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        #[rustfmt::skip]
        let Pic16Eeprom {
            kind: _, write_clocks: _, flash: _, bytes, eedata, eeadr, eedath, eeadrh, eecon1, unlock, read, job, buffers,
        } = self;
        tape.pass_memory(bytes)?;
        for register in [eedata, eeadr, eedath, eeadrh, eecon1] {
            register.pass_state(tape)?;
        }
        unlock.pass_state(tape)?;
        read.pass_state(tape)?;
        job.pass_state(tape)?;
        buffers.pass_state(tape)
    }
}

impl Pic16Eeprom {
    /// Returns the module after power-up. `bytes` is the complete content of the EEPROM; `write_clocks` is
    /// the duration of a byte write in clocks of the oscillator.
    #[must_use]
    pub fn new(kind: NonvolatileKind, bytes: &[u8], write_clocks: u64, flash: FlashAccess) -> Pic16Eeprom {
        Pic16Eeprom {
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
            buffers: [ERASED_WORD; BLOCK_WORDS],
        }
    }

    /// Returns the content of the EEPROM.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Sets a byte of the EEPROM from outside the chip; addresses out of range are ignored.
    pub fn set_byte(&mut self, addr: usize, value: u8) {
        if let Some(byte) = self.bytes.get_mut(addr) {
            *byte = value;
        }
    }

    /// Supplies the word that [`Pic16Signal::FlashRead`] requested; must be called before any other function.
    pub fn flash_data(&mut self, word: u16) {
        if let Some((_, data)) = &mut self.read {
            *data = word;
        }
    }

    /// Reports whether the program can access program memory.
    const fn has_flash(&self) -> bool {
        matches!(
            self.kind,
            NonvolatileKind::Word | NonvolatileKind::Block4 | NonvolatileKind::Read | NonvolatileKind::Row32
        )
    }

    /// Returns the writable bits of EECON1, without WR and RD.
    const fn writable_bits(&self) -> u8 {
        match self.kind {
            NonvolatileKind::None => 0,
            NonvolatileKind::F84 => EEIF | WRERR | WREN,
            NonvolatileKind::F62x => WRERR | WREN,
            NonvolatileKind::Word | NonvolatileKind::Block4 | NonvolatileKind::Read => EEPGD | WRERR | WREN,
            NonvolatileKind::Row32 => EEPGD | FREE | WRERR | WREN,
        }
    }

    /// Returns the existing bits of EEADRH: five, but on the 818, 819, 87 and 88 only those that the memory
    /// size needs.
    const fn eeadrh_bits(&self) -> u8 {
        match self.kind {
            NonvolatileKind::Row32 => (self.flash.words.saturating_sub(1) >> 8) as u8 & 0x1F,
            _ if self.has_flash() => 0x1F,
            _ => 0,
        }
    }

    const fn address(&self) -> u16 {
        (self.eeadrh as u16) << 8 | self.eeadr as u16
    }

    /// Reports whether a write is in progress at `t`.
    fn is_writing(&self, t: u64) -> bool {
        self.job.as_ref().is_some_and(|job| job.until > t)
    }

    /// Reports whether a read is in progress at `t`.
    fn is_reading(&self, t: u64) -> bool {
        self.read.is_some_and(|(until, _)| until > t)
    }

    /// Returns the word that a read of program memory loads into EEDATH and EEDATA by `t`, if it is not
    /// loaded yet.
    fn read_result(&self, t: u64) -> Option<u16> {
        self.read.filter(|&(until, _)| until <= t).map(|(_, word)| word)
    }

    /// Makes the instructions after the start of an access at `t` execute as NOP.
    fn ignore_instructions(&self, t: u64, out: &mut Pic16Outbox) {
        let from = if self.kind == NonvolatileKind::Row32 { t + CLOCKS_PER_CYCLE } else { t };
        out.push(Pic16Signal::Ignore { from, until: t + 2 * CLOCKS_PER_CYCLE });
    }

    fn start_read(&mut self, t: u64, out: &mut Pic16Outbox) {
        if self.eecon1 & EEPGD == 0 {
            self.eedata = self.bytes.get(usize::from(self.eeadr)).copied().unwrap_or(0);
            return;
        }
        self.read = Some((t + 2 * CLOCKS_PER_CYCLE, 0));
        out.push(Pic16Signal::FlashRead { addr: self.address() });
        self.ignore_instructions(t, out);
    }

    fn start_write(&mut self, t: u64, out: &mut Pic16Outbox) {
        if self.eecon1 & EEPGD == 0 {
            let until = t.saturating_add(self.write_clocks);
            self.job = Some(WriteOperation { stall: NEVER, until, effect: WriteEffect::Byte(self.eeadr, self.eedata) });
            return;
        }
        let addr = self.address();
        let word = u16::from(self.eedath) << 8 | u16::from(self.eedata);
        let place = usize::from(addr) % BLOCK_WORDS;
        let erase = self.kind == NonvolatileKind::Row32 && self.eecon1 & FREE != 0;
        let blocks = matches!(self.kind, NonvolatileKind::Block4 | NonvolatileKind::Row32) && !erase;
        if blocks && let Some(buffer) = self.buffers.get_mut(place) {
            *buffer = word;
        }
        let short = blocks && place != BLOCK_WORDS - 1;
        let first = addr & !(BLOCK_WORDS as u16 - 1);
        let words = match self.kind {
            NonvolatileKind::None | NonvolatileKind::F84 | NonvolatileKind::F62x | NonvolatileKind::Read => return,
            NonvolatileKind::Word => Pic16Signal::FlashWrite { addr, words: vec![word] },
            NonvolatileKind::Block4 => Pic16Signal::FlashWrite { addr: first, words: self.buffers.to_vec() },
            NonvolatileKind::Row32 if erase => Pic16Signal::FlashWrite {
                addr: addr & !(ERASE_ROW_WORDS - 1),
                words: vec![ERASED_WORD; ERASE_ROW_WORDS.into()],
            },
            NonvolatileKind::Row32 => Pic16Signal::FlashProgram { addr: first, words: self.buffers.to_vec() },
        };
        if !(short && self.kind == NonvolatileKind::Row32) {
            self.ignore_instructions(t, out);
        }
        let set_up = t + 2 * CLOCKS_PER_CYCLE;
        self.job = Some(if short {
            WriteOperation { stall: NEVER, until: t + CLOCKS_PER_CYCLE, effect: WriteEffect::Nothing }
        } else if !self.flash.writable.contains(&addr) {
            WriteOperation { stall: NEVER, until: set_up, effect: WriteEffect::Nothing }
        } else {
            let until = set_up.saturating_add(self.flash.clocks);
            WriteOperation { stall: set_up, until, effect: WriteEffect::Words(words) }
        });
    }

    fn write_eecon1(&mut self, value: u8, t: u64, out: &mut Pic16Outbox) {
        let unlocked = self.unlock.take() == Some((0xAA, t - CLOCKS_PER_CYCLE.min(t)));
        let enabled = self.eecon1 & value & WREN != 0;
        let busy = self.is_writing(t) || self.is_reading(t);
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

impl Device<Pic16Signal> for Pic16Eeprom {
    type Reg = Sfr;

    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
        if let Some(word) = self.read_result(t) {
            [self.eedath, self.eedata] = (word & ERASED_WORD).to_be_bytes();
            self.read = None;
        }
        if let Some(job) = self.job.as_mut().filter(|job| job.stall <= t) {
            job.stall = NEVER;
            out.push(Pic16Signal::Stall { until: job.until });
        }
        if let Some(WriteOperation { until, effect, .. }) = self.job.take_if(|job| job.until <= t) {
            match effect {
                WriteEffect::Nothing => return,
                WriteEffect::Byte(addr, value) => self.set_byte(addr.into(), value),
                WriteEffect::Words(signal) => out.push(signal),
            }
            if self.kind == NonvolatileKind::F84 {
                self.eecon1 |= EEIF;
            }
            out.push(Pic16Signal::Flag { t: until, flag: InterruptFlag::EEIF });
        }
    }

    fn next_deadline(&self) -> u64 {
        match &self.job {
            Some(job) if job.effect != WriteEffect::Nothing => job.stall.min(job.until),
            _ => NEVER,
        }
    }

    fn peek(&self, reg: Sfr, t: u64) -> u8 {
        let [high, low] = match self.read_result(t) {
            Some(word) => (word & ERASED_WORD).to_be_bytes(),
            None => [self.eedath, self.eedata],
        };
        match reg {
            Sfr::EEDATA => low,
            Sfr::EEDATH => high,
            Sfr::EEADR => self.eeadr,
            Sfr::EEADRH => self.eeadrh,
            Sfr::EECON1 => {
                self.eecon1 | if self.is_writing(t) { WR } else { 0 } | if self.is_reading(t) { RD } else { 0 }
            }
            _ => 0,
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
        let before = out.len();
        self.run_due(t, out);
        if self.kind == NonvolatileKind::None {
            return;
        }
        match (reg, self.unlock) {
            (Sfr::EECON1, _) => {
                self.write_eecon1(value, t, out);
                // A write that is complete at this very clock sets the flag nevertheless.
                let set = out.iter().skip(before).any(|s| matches!(s, Pic16Signal::Flag { .. }));
                if self.kind == NonvolatileKind::F84 && set {
                    self.eecon1 |= EEIF;
                }
            }
            (Sfr::EECON2, Some((0x55, at))) if value == 0xAA && t == at + 2 * CLOCKS_PER_CYCLE => {
                self.unlock = Some((0xAA, t))
            }
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

    /// Writes have their own clock, so they continue.
    /// Resets the module at `t`; everything due at `t` is executed first. A write in progress is aborted,
    /// which sets WRERR unless the power was off.
    fn reset(&mut self, power_on: bool, t: u64, _out: &mut Pic16Outbox) {
        self.run_due(t, &mut Pic16Outbox::new());
        let broken = self.job.take().is_some_and(|job| job.effect != WriteEffect::Nothing);
        self.eecon1 &= if power_on { 0 } else { EEPGD | WRERR };
        if broken && !power_on {
            self.eecon1 |= WRERR;
        }
        self.read = None;
        self.unlock = None;
    }

    fn steady_until(&self, reg: Sfr, t: u64) -> u64 {
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
