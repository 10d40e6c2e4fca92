//! A model of self-programming that steps cycle by cycle, with its own program memory.

use emu_avr::periph::spm::{ConfigBytes, SpmKind};

const SECOND_PS: u64 = 1_000_000_000_000;
/// Duration of a command in picoseconds.
const WRITE_PS: u64 = 4_100 * 1_000_000;

#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Command {
    Load,
    Erase,
    Write,
    Reenable,
    Lock,
    Row,
}

pub struct Model {
    pub kind: SpmKind,
    pub bytes: ConfigBytes,
    pub boot: u32,
    pub hz: u64,
    pub flash: Vec<u16>,
    pub spmie: bool,
    pub rwwsb: bool,
    /// Command written to SPMCSR, and the remaining cycles in which it is enabled.
    pub armed: Option<(Command, u8)>,
    /// Command that was enabled in the cycle that has just ended.
    standing: Option<Command>,
    /// Command in progress, with the remaining picoseconds and the lock bits after it.
    pub busy: Option<(Command, u64, u8)>,
    pub halted: bool,
    pub buffer: Vec<Option<u16>>,
    /// Remaining cycles of an EEPROM write.
    pub eeprom: u64,
}

impl Model {
    pub fn new(kind: SpmKind, bytes: ConfigBytes, boot: u32, hz: u64) -> Model {
        Model {
            kind,
            bytes,
            boot,
            hz,
            flash: vec![0x1234; kind.flash as usize / 2],
            spmie: false,
            rwwsb: false,
            armed: None,
            standing: None,
            busy: None,
            halted: false,
            buffer: vec![None; kind.page as usize / 2],
            eeprom: 0,
        }
    }

    /// Executes the end of a cycle.
    pub fn tick(&mut self) {
        self.standing = self.armed.map(|(command, _)| command);
        self.armed = self.armed.and_then(|(command, left)| (left > 1).then(|| (command, left - 1)));
        self.eeprom = self.eeprom.saturating_sub(1);
        if let Some((command, left, lock)) = self.busy {
            let left = left.saturating_sub(SECOND_PS / self.hz);
            self.busy = Some((command, left, lock)).filter(|_| left > 0);
            if left == 0 {
                self.bytes.lock = lock;
                self.halted = false;
            }
        }
    }

    pub fn spmcsr(&self) -> u8 {
        let command = self.busy.map(|busy| busy.0).or(self.armed.map(|armed| armed.0));
        let low = match command {
            None => 0x00,
            Some(Command::Load) => 0x01,
            Some(Command::Erase) => 0x03,
            Some(Command::Write) => 0x05,
            Some(Command::Lock) => 0x09,
            Some(Command::Reenable) => 0x11,
            Some(Command::Row) => 0x21,
        };
        low + u8::from(self.rwwsb) * 0x40 + u8::from(self.spmie) * 0x80
    }

    pub fn write(&mut self, value: u8) {
        if self.eeprom > 0 {
            return;
        }
        self.spmie = value >= 0x80;
        if self.busy.is_some() {
            return;
        }
        let command = match value % if self.kind.signature_row { 0x40 } else { 0x20 } {
            0x01 => Command::Load,
            0x03 => Command::Erase,
            0x05 => Command::Write,
            0x09 => Command::Lock,
            0x11 => Command::Reenable,
            0x21 => Command::Row,
            _ => return,
        };
        self.armed = Some((command, 4));
        self.standing = None;
        if command == Command::Reenable {
            self.buffer.fill(None);
        }
    }

    fn lock_bit(&self, bit: u8) -> bool {
        !self.kind.boot || self.bytes.lock >> bit & 1 == 1
    }

    fn boots(&self, addr: u32) -> bool {
        self.kind.boot && addr % self.kind.flash >= self.boot
    }

    /// Executes an SPM that ends at this edge.
    pub fn spm(&mut self, z: u32, data: u16, pc: u32) {
        // A command written at this very edge came after the SPM.
        let Some(command) = self.standing.filter(|_| self.busy.is_none()) else { return };
        (self.armed, self.standing) = (None, None);
        if self.eeprom > 0 || self.kind.boot && !self.boots(pc) {
            return;
        }
        let page = z % self.kind.flash / self.kind.page * self.kind.page;
        let words = page as usize / 2..(page + self.kind.page) as usize / 2;
        match command {
            Command::Load => {
                self.rwwsb = false;
                self.buffer[(z % self.kind.page / 2) as usize].get_or_insert(data);
            }
            Command::Reenable => self.rwwsb = false,
            Command::Row => {}
            Command::Lock => {
                let lock = (0..8).fold(0, |lock, bit| {
                    let stays = self.bytes.lock >> bit & 1;
                    let given = data as u8 >> bit & 1;
                    lock | if self.kind.lock >> bit & 1 == 1 { stays & given } else { stays } << bit
                });
                self.busy = Some((command, WRITE_PS, lock));
            }
            Command::Erase | Command::Write => {
                // Modes 2 and 3 of the section: SPM must not write to it.
                if !self.lock_bit(if self.boots(page) { 4 } else { 2 }) {
                    return;
                }
                if command == Command::Erase {
                    self.flash[words].fill(0xFFFF);
                } else {
                    for (word, new) in self.flash[words].iter_mut().zip(&self.buffer) {
                        *word &= new.unwrap_or(0xFFFF);
                    }
                    self.buffer.fill(None);
                }
                self.busy = Some((command, WRITE_PS, self.bytes.lock));
                self.rwwsb |= page < self.kind.nrww;
                self.halted = page >= self.kind.nrww;
            }
        }
    }

    /// Executes an LPM that starts in this cycle.
    pub fn lpm(&mut self, z: u32, pc: u32) -> Option<u8> {
        if let Some((command @ (Command::Lock | Command::Row), 2..=4)) = self.armed
            && self.eeprom == 0
            && self.busy.is_none()
        {
            self.armed = None;
            let ConfigBytes { lock, fuses, signature, calibration } = self.bytes;
            let row = [signature[0], calibration, signature[1], 0xFF, signature[2]];
            let locks = [fuses[0], lock, fuses[2], fuses[1]];
            let z = (z % 0x1_0000) as usize;
            let found = if command == Command::Lock { locks.get(z) } else { row.get(z) };
            return Some(found.copied().unwrap_or(0xFF));
        }
        let across = self.boots(z) != self.boots(pc);
        let barred = across && !self.lock_bit(if self.boots(z) { 5 } else { 3 });
        (barred || self.unreadable(z)).then_some(0xFF)
    }

    pub fn unreadable(&self, addr: u32) -> bool {
        self.rwwsb && addr % self.kind.flash < self.kind.nrww
    }

    pub fn bars_interrupts(&self, pc: u32, ivsel: bool) -> bool {
        match (self.boots(pc), ivsel) {
            (false, true) => !self.lock_bit(3),
            (true, false) => !self.lock_bit(5),
            _ => false,
        }
    }

    pub fn reset(&mut self) {
        if let Some((_, _, lock)) = self.busy.take() {
            self.bytes.lock = lock;
        }
        (self.spmie, self.rwwsb, self.armed, self.standing, self.halted) = (false, false, None, None, false);
        self.buffer.fill(None);
    }
}
