//! A model of the EEPROM and the access to program memory that steps clock by clock.

use std::collections::BTreeMap;

use emu_pic16::chips::NonvolatileKind;
use emu_pic16::periph::map::{InterruptFlag, Sfr};
use emu_pic16::periph::{Pic16Outbox, Pic16Signal};

/// Operation in progress.
#[derive(Clone, PartialEq)]
enum Busy {
    Idle,
    /// A byte write: remaining clocks.
    Byte(u64),
    /// A read of program memory: remaining clocks of its two cycles.
    Read(u64),
    /// A write to program memory without effect: remaining clocks.
    Short(u64),
    /// Two cycles of set-up, then the write: remaining clocks of both.
    Flash(u64, u64),
}

pub struct Model {
    pub kind: NonvolatileKind,
    pub cells: BTreeMap<u8, u8>,
    pub regs: BTreeMap<&'static str, u8>,
    pub wren: bool,
    pub wrerr: bool,
    pub eepgd: bool,
    pub free: bool,
    pub eeif: bool,
    busy: Busy,
    pending: (u8, u8, u16, u16),
    erase: bool,
    buffers: [u16; 4],
    write_clocks: u64,
    flash_clocks: u64,
    first_writable: u16,
    /// Values written to EECON2 in the last cycles, the last one first, None for cycles without a write; then
    /// whether any other register of the EEPROM was written in between.
    history: [Option<u8>; 3],
}

impl Model {
    pub fn new(
        kind: NonvolatileKind,
        cells: &[u8],
        write_clocks: u64,
        flash_clocks: u64,
        first_writable: u16,
    ) -> Model {
        Model {
            kind,
            cells: (0..=255).zip(cells.iter().copied()).collect(),
            regs: ["EEDATA", "EEADR", "EEDATH", "EEADRH"].map(|r| (r, 0)).into(),
            wren: false,
            wrerr: false,
            eepgd: false,
            free: false,
            eeif: false,
            busy: Busy::Idle,
            pending: (0, 0, 0, 0),
            erase: false,
            buffers: [0x3FFF; 4],
            write_clocks,
            flash_clocks,
            first_writable,
            history: [None; 3],
        }
    }

    fn flash(&self) -> bool {
        matches!(
            self.kind,
            NonvolatileKind::Word | NonvolatileKind::Block4 | NonvolatileKind::Read | NonvolatileKind::Row32
        )
    }

    fn done(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.eeif = true;
        out.push(Pic16Signal::Flag { t, flag: InterruptFlag::EEIF });
        self.busy = Busy::Idle;
    }

    /// Executes one clock, up to `t`.
    pub fn tick(&mut self, t: u64, out: &mut Pic16Outbox) {
        match &mut self.busy {
            Busy::Idle => {}
            Busy::Byte(left) | Busy::Read(left) | Busy::Short(left) if *left > 1 => *left -= 1,
            Busy::Byte(_) => {
                let (addr, value, ..) = self.pending;
                if let Some(cell) = self.cells.get_mut(&addr) {
                    *cell = value;
                }
                self.done(t, out);
            }
            Busy::Read(_) => {
                let word = super::word_at(self.pending.2);
                self.regs.insert("EEDATA", word as u8);
                self.regs.insert("EEDATH", (word >> 8) as u8 & 0x3F);
                self.busy = Busy::Idle;
            }
            Busy::Short(_) => self.busy = Busy::Idle,
            Busy::Flash(set_up, left) => {
                if *set_up > 0 {
                    *set_up -= 1;
                    if *set_up == 0 {
                        out.push(Pic16Signal::Stall { until: t + *left });
                    }
                    return;
                }
                *left -= 1;
                if *left == 0 {
                    let (_, _, addr, word) = self.pending;
                    out.push(match self.kind {
                        NonvolatileKind::Word => Pic16Signal::FlashWrite { addr, words: vec![word] },
                        NonvolatileKind::Block4 => {
                            Pic16Signal::FlashWrite { addr: addr / 4 * 4, words: self.buffers.to_vec() }
                        }
                        _ if self.erase => Pic16Signal::FlashWrite { addr: addr / 32 * 32, words: vec![0x3FFF; 32] },
                        _ => Pic16Signal::FlashProgram { addr: addr / 4 * 4, words: self.buffers.to_vec() },
                    });
                    self.done(t, out);
                }
            }
        }
    }

    pub fn eecon1(&self) -> u8 {
        let writing = !matches!(self.busy, Busy::Idle | Busy::Read(_));
        let reading = matches!(self.busy, Busy::Read(_));
        let bit4 =
            (self.kind == NonvolatileKind::F84 && self.eeif) || (self.kind == NonvolatileKind::Row32 && self.free);
        [reading, writing, self.wren, self.wrerr, bit4, false, false, self.eepgd]
            .into_iter()
            .enumerate()
            .fold(0, |value, (n, bit)| value | u8::from(bit) << n)
    }

    /// Executes the end of a cycle at `t`, with the write of its instruction.
    pub fn cycle(&mut self, write: Option<(Sfr, u8)>, t: u64, out: &mut Pic16Outbox) {
        let before = self.history;
        self.history = [None, before[0], before[1]];
        let Some((reg, value)) = write.filter(|_| self.kind != NonvolatileKind::None) else { return };
        match reg {
            Sfr::EECON1 => {
                let unlocked = before[0] == Some(0xAA) && before[2] == Some(0x55) && before[1].is_none();
                self.eecon1_written(value, unlocked, t, out);
                // The unlock sequence is consumed.
                self.history = [None; 3];
            }
            Sfr::EECON2 => self.history[0] = Some(value),
            _ => {
                self.history = [None; 3];
                let rows = if self.kind == NonvolatileKind::Row32 { 0x07 } else { 0x1F };
                match reg {
                    Sfr::EEDATA => _ = self.regs.insert("EEDATA", value),
                    Sfr::EEADR => _ = self.regs.insert("EEADR", value),
                    Sfr::EEDATH if self.flash() => _ = self.regs.insert("EEDATH", value & 0x3F),
                    Sfr::EEADRH if self.flash() => _ = self.regs.insert("EEADRH", value & rows),
                    _ => {}
                }
            }
        }
    }

    fn eecon1_written(&mut self, value: u8, unlocked: bool, t: u64, out: &mut Pic16Outbox) {
        let bit = |n: u8| value >> n & 1 != 0;
        let enabled = self.wren && bit(2);
        (self.wren, self.wrerr) = (bit(2), bit(3));
        if self.kind == NonvolatileKind::Row32 {
            self.free = bit(4);
        }
        if self.kind == NonvolatileKind::F84 {
            self.eeif = bit(4) || out.contains(&Pic16Signal::Flag { t, flag: InterruptFlag::EEIF });
        }
        if self.busy != Busy::Idle {
            return;
        }
        self.eepgd = self.flash() && bit(7);
        let [data, addr, high, page] = ["EEDATA", "EEADR", "EEDATH", "EEADRH"].map(|r| self.regs[r]);
        let (word, place) = (u16::from(high) * 256 + u16::from(data), u16::from(page) * 256 + u16::from(addr));
        let late = self.kind == NonvolatileKind::Row32;
        let nops = Pic16Signal::Ignore { from: if late { t + 4 } else { t }, until: t + 8 };
        if bit(1) && unlocked && enabled {
            if !self.eepgd {
                self.pending = (addr, data, 0, 0);
                self.busy = Busy::Byte(self.write_clocks);
                return;
            }
            if self.kind == NonvolatileKind::Read {
                return;
            }
            let erase = late && self.free;
            let blocks = self.kind != NonvolatileKind::Word && !erase;
            if blocks {
                self.buffers[usize::from(place & 3)] = word;
            }
            if blocks && place & 3 != 3 {
                if !late {
                    out.push(nops);
                }
                self.busy = Busy::Short(4);
                return;
            }
            out.push(nops);
            self.erase = erase;
            self.pending = (0, 0, place, word);
            self.busy = if (self.first_writable..0x800).contains(&place) {
                Busy::Flash(8, self.flash_clocks)
            } else {
                Busy::Short(8)
            };
        } else if bit(0) {
            if self.eepgd {
                self.pending = (0, 0, place, 0);
                self.busy = Busy::Read(8);
                out.push(Pic16Signal::FlashRead { addr: place });
                out.push(nops);
            } else {
                let value = self.cells.get(&addr).copied().unwrap_or(0);
                self.regs.insert("EEDATA", value);
            }
        }
    }

    pub fn reset(&mut self, power_on: bool) {
        self.wrerr |= matches!(self.busy, Busy::Byte(_) | Busy::Flash(..));
        if power_on {
            (self.wrerr, self.eepgd) = (false, false);
        }
        (self.wren, self.free, self.eeif) = (false, false, false);
        self.busy = Busy::Idle;
        self.history = [None; 3];
    }
}
